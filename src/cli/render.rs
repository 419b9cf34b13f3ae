//! `lobelia render CAPTURE --solution DIR --out DIR`.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use clap::ArgMatches;

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::io;
use crate::io::transforms::{self, Images};
use crate::render::RenderOptions;
use crate::render::edits::Edits;
use crate::render::groups;
use crate::worker::{Command, Files, Frame, Happening, Rendering, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let path = arguments::required_path(matches, "capture");
    let solution = arguments::required_path(matches, "solution");
    let folder = arguments::required_path(matches, "out");
    let mut options = RenderOptions::default();
    arguments::apply_render(matches, &mut options)?;
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
    let (_, unknown) = groups::factors(&capture, &solved, &edits);
    for name in unknown {
        let known: Vec<String> =
            groups::groups(&capture, &solved).into_iter().map(|group| group.name).collect();
        note_line!(
            "warning: the recovered light has no group \"{name}\"; it has {}",
            known.join(", ")
        );
    }
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
        png: matches.get_flag("png"),
        composite: matches.get_flag("composite"),
    };
    let rendering = Rendering {
        capture,
        solved: Arc::new(solved),
        edits: Arc::new(edits),
        frames,
        options,
        files: Some(files),
    };
    display.stage("render");
    job::wait(&mut worker, Command::Render(Box::new(rendering)), &mut display)?;
    display.clear();
    say_line!("{count} pictures in {}", folder.display());
    Ok(())
}
