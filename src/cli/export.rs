//! `lobelia export CAPTURE --solution DIR --out DIR`.

use anyhow::Context;
use clap::ArgMatches;
use glam::Vec3;

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::recovered::{self, Recovered};
use crate::cli::{Ending, arguments, job};
use crate::io;
use crate::io::export::elsewhere::{Format, Plan};
use crate::options::OptionValue;
use crate::render::probe::ProbeSettings;
use crate::worker::{Command, SceneExport, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let solution = arguments::required_path(matches, "solution");
    let folder = arguments::required_path(matches, "out");
    io::export::check_folder(&folder)?;
    job::catch_interrupts()?;
    let mut display = Display::new(matches.get_flag("quiet"));
    let mut worker = Worker::start(|| ()).context("the worker thread cannot be started")?;

    let Recovered { capture, solved, edits } = recovered::read(matches, &mut worker, &mut display)?;
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
    let scene_export = SceneExport { capture, solved, edits, plan };
    display.stage("export");
    job::wait(&mut worker, Command::ExportScene(Box::new(scene_export)), &mut display)?;
    display.clear();
    say_line!("exported to {}", folder.display());
    Ok(())
}
