//! `lobelia new DIR --images FILES…`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::anyhow;
use clap::ArgMatches;

use crate::cli::job::{catch_interrupts, wait};
use crate::cli::print::{note_line, say, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments};
use crate::io::engines::{self, Engine, Search};
use crate::io::model;
use crate::model::{AdjustOptions, Model, solve};
use crate::watch::Watch;
use crate::worker::{Command, JobEvent, Modelling, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let folder = arguments::required_path(matches, "folder");
    let images: Vec<PathBuf> = matches.get_many("images").unwrap_or_default().cloned().collect();
    let search = matches.get_one::<String>("cameras").map(|name| Search {
        engine: Engine::of(name),
        is_shared: matches.get_one::<String>("lenses").is_none_or(|own| own == "shared"),
        ..Search::default()
    });
    if let Some(search) = &search {
        // Before anything is written.
        engines::choose(search)?;
    }
    let photographs = model::new_capture(&folder, &images, &Watch::new())?;
    for own in &photographs {
        say!("{}  {}×{}", own.name, own.size.0, own.size.1);
        match own.lens.focal_px {
            Some(focal) => say!("  focal length {focal:.0} px (EXIF)"),
            None => say!("  focal length unknown"),
        }
        if !own.lens.orientation.is_upright() {
            say!("  turned upright (EXIF {})", own.lens.orientation.exif());
        }
        say_line!("{}", if own.is_radiance { "" } else { "  no radiance: geometry only" });
    }
    say_line!("written to {}", folder.display());
    if let Some(search) = search {
        let found = find_cameras(&folder, search);
        if found.is_err() {
            note_line!("the capture is written, without cameras");
        }
        found?;
    }
    say_line!("next: {}, then lobelia model {}", model::NAME, folder.display());
    Ok(())
}

/// Finds the cameras of a capture that was begun, and writes them into it.
fn find_cameras(folder: &Path, search: Search) -> Result<(), Ending> {
    catch_interrupts()?;
    let model = Arc::new(model::open(folder)?.model);
    let mut worker = Worker::start(|| ())?;
    let mut display = Display::new(false);
    let job = Modelling::FindCameras {
        folder: folder.to_owned(),
        model: model.clone(),
        search: Box::new(search),
    };
    let ending = wait(&mut worker, Command::Model(job), &mut display)?;
    display.clear();
    let JobEvent::CamerasFound(found) = ending else {
        return Err(anyhow!("the job ended unexpectedly").into());
    };
    let mut placed = Model::clone(&model);
    placed.take_found(&found);
    model::save(folder, &placed)?;
    // As it is read again, so that solving it again gives the same bytes.
    let placed = model::read(&folder.join(model::NAME))?;
    let solution = solve(&placed, &AdjustOptions::default()).map_err(|error| anyhow!(error))?;
    model::write_cameras(&folder.join("transforms.json"), &placed, &solution.cameras)?;
    let count = model.photographs.len();
    say!("{}: {} of {count} photographs placed", found.engine, found.placed());
    match found.error_px {
        Some(off) => say_line!(", points off by {off:.2} px in the median"),
        None => say_line!(),
    }
    for (own, _) in model.photographs.iter().zip(&found.cameras).filter(|own| own.1.is_none()) {
        say_line!("  {}  not placed: place it by lines and corners", own.name);
    }
    solution.notes.iter().for_each(|note| note_line!("warning: {note}"));
    Ok(())
}
