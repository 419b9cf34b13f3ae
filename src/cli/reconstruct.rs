//! `lobelia reconstruct CAPTURE --out DIR`.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Context;
use clap::ArgMatches;

use crate::cli::print::{note_line, say, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::io;
use crate::reconstruct::{Options, Reconstruction, Stage};
use crate::scene::{Capture, MaterialKind};
use crate::worker::{Command, Happening, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let path = arguments::required_path(matches, "capture");
    let folder = arguments::required_path(matches, "out");
    let mut options = Options::default();
    if let Some(file) = matches.get_one::<PathBuf>("options") {
        io::options::read(file, &mut options)?;
    }
    arguments::apply(matches, &mut options)?;
    io::export::check_folder(&folder)?;
    if let Some(&threads) = matches.get_one::<u64>("threads") {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads as usize)
            .build_global()
            .context("the threads cannot be started")?;
    }
    job::catch_interrupts()?;
    let mut display = Display::new(matches.get_flag("quiet"));
    let mut worker = Worker::start(|| ()).context("the worker thread cannot be started")?;

    let began = Instant::now();
    display.stage("load");
    let Happening::Loaded(capture) = job::wait(&mut worker, Command::Load { path }, &mut display)?
    else {
        return Ok(());
    };
    let load_secs = began.elapsed().as_secs_f64();
    let command =
        Command::Reconstruct { capture: capture.clone(), options: Box::new(options.clone()) };
    let Happening::Reconstructed(reconstruction) = job::wait(&mut worker, command, &mut display)?
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
    report(&capture, &reconstruction, load_secs);
    say_line!("written to {}", folder.display());
    Ok(())
}

/// Prints what came out, warnings on stderr.
fn report(capture: &Arc<Capture>, reconstruction: &Reconstruction, load_secs: f64) {
    for warning in capture.warnings.iter().chain(&reconstruction.warnings) {
        note_line!("warning: {warning}");
    }
    let solution = &reconstruction.solution;
    say_line!(
        "{} samples, {} virtual lights, {} of {} lobes active",
        reconstruction.samples.samples.len(),
        reconstruction.lights.lights.len(),
        solution.active_lobes(),
        reconstruction.lobes.lobes.len(),
    );
    say_line!("{}", solution.brief());
    let widest = capture.materials.iter().map(|m| m.name.chars().count()).max().unwrap_or(0);
    for (material, reflectance) in capture.materials.iter().zip(&solution.reflectances) {
        let Some(reflectance) = reflectance else {
            say_line!("  {:widest$}  not measured", material.name);
            continue;
        };
        let [r, g, b] = reflectance.diffuse;
        say!("  {:widest$}  diffuse {r:.3} {g:.3} {b:.3}", material.name);
        if material.kind == MaterialKind::Specular {
            let [r, g, b] = reflectance.specular;
            say!("  specular {r:.3} {g:.3} {b:.3}  exponent {:.1}", reflectance.exponent);
        }
        say_line!();
    }
    let stages: Vec<String> = Stage::ALL
        .iter()
        .zip(reconstruction.seconds)
        .map(|(stage, seconds)| format!("{} {seconds:.2}", stage.name()))
        .collect();
    let total = load_secs + reconstruction.seconds.iter().sum::<f64>();
    say_line!("seconds: load {load_secs:.2}, {}, total {total:.2}", stages.join(", "));
}
