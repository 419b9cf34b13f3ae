//! The common start of commands that use a recovered scene: they read the capture, its solution,
//! and edits.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::anyhow;
use clap::ArgMatches;

use crate::cli::print::note_line;
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::io;
use crate::render::edits::Edits;
use crate::render::groups;
use crate::render::scene::Solved;
use crate::scene::Capture;
use crate::worker::{Command, JobEvent, Worker};

pub(super) struct Recovered {
    pub capture: Arc<Capture>,
    pub solved: Arc<Solved>,
    pub edits: Arc<Edits>,
}

/// Reads what the arguments `capture`, `solution` and `edits` name; what is odd about it is noted.
pub(super) fn read(
    matches: &ArgMatches,
    worker: &mut Worker,
    display: &mut Display,
) -> Result<Recovered, Ending> {
    let path = arguments::required_path(matches, "capture");
    display.stage("load");
    let JobEvent::Loaded(capture) = job::wait(worker, Command::Load { path }, display)? else {
        return Err(Ending::Failed(anyhow!("the capture was not loaded")));
    };
    let solved = io::solved::read(&arguments::required_path(matches, "solution"), &capture)?;
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
    Ok(Recovered { capture, solved: Arc::new(solved), edits: Arc::new(edits) })
}
