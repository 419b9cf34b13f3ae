//! `lobelia reconstruct CAPTURE --out DIR`.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use clap::ArgMatches;

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::report::report;
use crate::cli::{Ending, arguments, job};
use crate::io;
use crate::reconstruct::Options;
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
    let JobEvent::Loaded(capture) = job::wait(&mut worker, Command::Load { path }, &mut display)?
    else {
        return Ok(());
    };
    let load_secs = began.elapsed().as_secs_f64();
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
    say_line!("written to {}", folder.display());
    Ok(())
}
