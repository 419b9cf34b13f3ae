//! `lobelia export CAPTURE --solution DIR --out DIR`.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use clap::ArgMatches;
use glam::Vec3;

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::io;
use crate::io::export::elsewhere::{Format, Plan};
use crate::options::OptionValue;
use crate::render::edits::Edits;
use crate::render::probe::ProbeSettings;
use crate::worker::{Command, Happening, Takeaway, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let path = arguments::required_path(matches, "capture");
    let solution = arguments::required_path(matches, "solution");
    let folder = arguments::required_path(matches, "out");
    io::export::check_folder(&folder)?;
    job::catch_interrupts()?;
    let mut display = Display::new(matches.get_flag("quiet"));
    let mut worker = Worker::start(|| ()).context("the worker thread cannot be started")?;

    display.stage("load");
    let Happening::Loaded(capture) = job::wait(&mut worker, Command::Load { path }, &mut display)?
    else {
        return Ok(());
    };
    let solved = io::solved::read(&solution, &capture)?;
    let edits = match matches.get_one::<PathBuf>("edits") {
        Some(file) => {
            let (edits, warnings) = io::edits::read(file, &capture)?;
            for warning in warnings {
                note_line!("warning: {warning}");
            }
            edits
        }
        None => Edits::default(),
    };
    let formats: Vec<Format> = match matches.get_many::<String>("format") {
        Some(names) => names.filter_map(|name| Format::parse(name).ok()).collect(),
        None => Format::ALL.to_vec(),
    };
    let table = solution.join("samples.csv");
    let samples = if formats.contains(&Format::Ply) && table.is_file() {
        Some(io::table::read_samples(&table)?)
    } else {
        None
    };
    if capture.photographs.iter().any(|photograph| !photograph.camera.distortion.is_none()) {
        note_line!(
            "warning: lens distortion has no place in these formats; cameras are written without it"
        );
    }
    let settings = ProbeSettings::default();
    let probe = ProbeSettings {
        width: matches.get_one::<u64>("probe-width").map_or(settings.width, |&w| w as usize),
        spp: matches.get_one::<u64>("probe-spp").map_or(settings.spp, |&spp| spp as usize),
        ..settings
    };
    let probe_at = matches.get_one::<Vec3>("probe-at").copied();
    let plan = Plan { folder: folder.clone(), formats, probe_at, probe, samples };
    let takeaway = Takeaway { capture, solved: Arc::new(solved), edits: Arc::new(edits), plan };
    display.stage("export");
    job::wait(&mut worker, Command::TakeElsewhere(Box::new(takeaway)), &mut display)?;
    display.clear();
    say_line!("exported to {}", folder.display());
    Ok(())
}
