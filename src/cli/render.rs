//! `lobelia render CAPTURE --solution DIR --out DIR`.

use std::path::PathBuf;

use anyhow::{Context, anyhow};
use clap::ArgMatches;

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::recovered::{self, Recovered};
use crate::cli::{Ending, arguments, color_space, job};
use crate::io;
use crate::io::export::pictures::Development;
use crate::io::transforms::{self, Images};
use crate::render::tracer::{Processor, Tracer};
use crate::render::{Engine, RenderOptions};
use crate::worker::engine::{self as engines, Chosen};
use crate::worker::{Command, Files, Frame, Rendering, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let folder = arguments::required_path(matches, "out");
    let mut options = RenderOptions::default();
    arguments::apply_render(matches, &mut options)?;
    io::export::check_folder(&folder)?;
    job::catch_interrupts()?;
    let Chosen { tracer, reason } = engines::tracer(options.engine);
    if let Some(reason) = reason.filter(|_| options.engine == Engine::Card) {
        return Err(anyhow!("--engine card: {reason}").into());
    }
    let mut display = Display::new(matches.get_flag("quiet"));
    let mut worker = Worker::start(|| ()).context("the worker thread cannot be started")?;

    let Recovered { capture, solved, edits } = recovered::read(matches, &mut worker, &mut display)?;
    let frames: Vec<Frame> = match matches.get_one::<PathBuf>("cameras") {
        Some(file) => transforms::read(file, Images::Optional)?
            .frames
            .into_iter()
            .map(|frame| Frame { name: frame.name, camera: frame.camera, photograph: None })
            .collect(),
        None => capture
            .photographs
            .iter()
            .enumerate()
            .map(|(index, photograph)| Frame {
                name: photograph.name.clone(),
                camera: photograph.camera,
                photograph: Some(index),
            })
            .collect(),
    };
    let count = frames.len();
    let files = Files {
        folder: folder.clone(),
        png: matches.get_flag("png").then_some(Development::Automatic),
        composite: matches.get_flag("composite"),
        color_space: color_space::chosen(matches),
        layers: true,
    };
    let rendering = Rendering { capture, solved, edits, frames, options, files: Some(files) };
    display.stage("render");
    job::wait(&mut worker, Command::Render(Box::new(rendering)), &mut display)?;
    display.clear();
    if let Some(trouble) = tracer.trouble() {
        note_line!("The graphics card failed, and the processor went on: {trouble}");
    }
    let name = tracer.name();
    let by = if name == Processor.name() { String::new() } else { format!(", traced by {name}") };
    say_line!("{count} pictures in {}{by}", folder.display());
    Ok(())
}
