//! Waits for a job of the worker: progress, Ctrl-C, and the exit.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use anyhow::{Context, anyhow};
use clap::ArgMatches;

use crate::cli::Ending;
use crate::cli::progress::Display;
use crate::io::engines::Told;
use crate::worker::{Command, JobEvent, Worker};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Lets Ctrl-C cancel the running job instead of ending the program.
pub(super) fn catch_interrupts() -> Result<(), Ending> {
    ctrlc::set_handler(|| INTERRUPTED.store(true, Relaxed))?;
    Ok(())
}

/// Takes as many threads as were asked for.
pub(super) fn use_threads(matches: &ArgMatches) -> Result<(), Ending> {
    if let Some(&threads) = matches.get_one::<u64>("threads") {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads as usize)
            .build_global()
            .context("the threads cannot be started")?;
    }
    Ok(())
}

/// How often progress is redrawn and Ctrl-C is looked for.
const PULSE: Duration = Duration::from_millis(50);

/// Sends a command and waits for the event that ends it.
pub(super) fn wait(
    worker: &mut Worker,
    command: Command,
    display: &mut Display,
) -> Result<JobEvent, Ending> {
    let job = worker.send(command);
    loop {
        if INTERRUPTED.load(Relaxed) {
            worker.cancel(job);
        }
        match worker.events().recv_timeout(PULSE) {
            Ok(event) if event.job == job => match event.what {
                JobEvent::Started
                | JobEvent::Picture { .. }
                | JobEvent::PictureWritten { .. }
                | JobEvent::Judged { .. } => {}
                JobEvent::Update(update) => display.update(&update),
                JobEvent::Told(Told::Step(name)) => display.stage(&name),
                JobEvent::Told(Told::Line(_)) => {}
                JobEvent::Found(found) => {
                    display.note(&format!("{}: {}", found.number, found.name));
                }
                JobEvent::Failed(message)
                | JobEvent::Begun(_, message)
                | JobEvent::Meshless(_, message) => {
                    display.clear();
                    return Err(Ending::Failed(anyhow!(message)));
                }
                JobEvent::Cancelled => {
                    display.clear();
                    return Err(Ending::Cancelled);
                }
                ending => return Ok(ending),
            },
            Ok(_) => {}
            Err(RecvTimeoutError::Timeout) => {
                if let Some(progress) = worker.progress(job) {
                    display.progress(progress);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Ending::Failed(anyhow!("the worker ended unexpectedly")));
            }
        }
    }
}
