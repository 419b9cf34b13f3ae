//! `lobelia reconstruct CAPTURE --out DIR`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use clap::ArgMatches;

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::report::{plural, report};
use crate::cli::{Ending, arguments, job};
use crate::io;
use crate::reconstruct::memory::gigabytes;
use crate::reconstruct::{MemoryNeed, Options};
use crate::worker::{Command, JobEvent, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let path = arguments::required_path(matches, "capture");
    let folder = arguments::required_path(matches, "out");
    let mut options = Options::default();
    if let Some(file) = matches.get_one::<PathBuf>("options") {
        io::options::read(file, &mut options)?;
    }
    arguments::apply(matches, &mut options)?;
    io::export::check_folder(&folder)?;
    job::use_threads(matches)?;
    job::catch_interrupts()?;
    let mut display = Display::new(matches.get_flag("quiet"));
    let mut worker = Worker::start(|| ()).context("the worker thread cannot be started")?;

    let began = Instant::now();
    display.stage("load");
    let JobEvent::Loaded(capture) =
        job::wait(&mut worker, Command::Load { path: path.clone() }, &mut display)?
    else {
        return Ok(());
    };
    let load_secs = began.elapsed().as_secs_f64();
    display.say(&format!(
        "recovering the reflectances of {} and the light on them from {}",
        plural(capture.materials.len(), "material"),
        plural(capture.photographs.len(), "photograph"),
    ));
    let need = MemoryNeed::of(&capture, &options);
    let in_files = match need.in_files {
        0 => String::new(),
        bytes => format!(
            "; beside it {} of photographs in files, of which memory holds what there is room for",
            gigabytes(bytes)
        ),
    };
    display.say(&format!(
        "memory: up to {}, most of it in the stage {}{in_files}",
        gigabytes(need.peak()),
        need.largest().name()
    ));
    let command = Command::Reconstruct {
        capture: capture.clone(),
        options: Box::new(options.clone()),
        stage_cache: None,
    };
    let JobEvent::Reconstructed(reconstruction) = job::wait(&mut worker, command, &mut display)?
    else {
        return Ok(());
    };
    let export = Command::Export {
        capture: capture.clone(),
        options: Box::new(options),
        reconstruction: reconstruction.clone(),
        load_secs,
        folder: folder.clone(),
    };
    job::wait(&mut worker, export, &mut display)?;
    display.clear();
    for warning in capture.warnings.iter().chain(&reconstruction.warnings) {
        note_line!("warning: {warning}");
    }
    for line in report(&capture, &reconstruction, load_secs) {
        say_line!("{line}");
    }
    if let Some(peak) = io::process::peak_memory() {
        display.say(&format!("memory at the peak: {}", gigabytes(peak)));
    }
    say_line!("written to {}", folder.display());
    display.say(&next(&path, &folder));
    Ok(())
}

/// What can be done with the result.
fn next(capture: &Path, folder: &Path) -> String {
    let program = std::env::args_os().next().unwrap_or_else(|| "lobelia".into());
    let (program, capture, folder) = (program.display(), capture.display(), folder.display());
    let mut text = format!(
        "next: {folder}/solution.json holds the reflectances with their intervals\n      \
         {program} render {capture} --solution {folder} --out {folder}/pictures --png"
    );
    if cfg!(feature = "studio") {
        text += &format!("\n      {program} {capture}   opens the studio");
    }
    text
}
