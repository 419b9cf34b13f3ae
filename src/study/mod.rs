//! Studies of the results: how far they are from the truth, what seconds buy, and what harms them.

pub mod chart;
pub mod degrade;
pub mod flip;
pub mod front;
pub mod measure;
pub mod pictures;
pub mod report;
pub mod runs;
pub mod score;
pub mod settings;
pub mod speed;
pub mod speed_chart;
pub mod stability;
pub mod stability_chart;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use crate::io;
use crate::reconstruct::{self, Options};
use crate::study::runs::Choice;
use crate::watch::Watch;

/// A study to be carried out, or the part of one.
#[derive(Clone, Debug)]
pub struct Study {
    pub subject: Subject,
    pub folder: PathBuf,
    /// Runs by their numbers; all, and the charts, where there are none.
    pub only: Vec<usize>,
    /// Only make the charts of the runs that are there.
    pub collect: bool,
}

#[derive(Clone, Debug)]
pub enum Subject {
    Speed { captures: Vec<PathBuf>, quick: bool, repeats: usize },
    Stability { capture: PathBuf, quick: bool, seeds: usize },
}

impl Study {
    /// The names of all runs, by their numbers.
    pub fn names(&self) -> Result<Vec<String>, io::Error> {
        use runs::Planned;
        Ok(match &self.subject {
            Subject::Speed { captures, quick, repeats } => {
                speed::plan(captures, *quick, *repeats)?.iter().map(Planned::name).collect()
            }
            Subject::Stability { capture, quick, seeds } => {
                stability::plan(capture, *quick, *seeds).iter().map(Planned::name).collect()
            }
        })
    }

    /// Carries the study out, and gives what is to be told. `watch` counts runs; `say` hears of
    /// each that is done.
    pub fn perform(
        &self,
        watch: &Watch,
        say: &(dyn Fn(String) + Sync),
    ) -> Result<Vec<String>, io::Error> {
        let is_part = !self.only.is_empty();
        match &self.subject {
            Subject::Speed { captures, quick, repeats } => {
                let plan = speed::plan(captures, *quick, *repeats)?;
                if !self.collect {
                    let choice = Choice { only: self.only.clone(), parallel: false };
                    speed::carry_out(&self.folder, &plan, &choice, watch, say)?;
                }
                if is_part { Ok(Vec::new()) } else { speed::collect(&self.folder, &plan) }
            }
            Subject::Stability { capture, quick, seeds } => {
                let plan = stability::plan(capture, *quick, *seeds);
                if !self.collect {
                    let choice = Choice { only: self.only.clone(), parallel: true };
                    stability::carry_out(&self.folder, &plan, &choice, watch, say)?;
                }
                if is_part { Ok(Vec::new()) } else { stability::collect(&self.folder, &plan) }
            }
        }
    }
}

/// All options of a run in a line.
fn described(options: &Options) -> String {
    let mut text = env!("CARGO_PKG_VERSION").to_owned();
    for declaration in options.declarations() {
        let value = options.get(declaration.section, declaration.name).unwrap_or_default();
        text.push_str(&format!(" {}.{}={value}", declaration.section, declaration.name));
    }
    for (material, rgb) in &options.start {
        text.push_str(&format!(" {material}={rgb:?}"));
    }
    text
}

/// Runs a reconstruction so that neither an error nor a panic ends the study: they are its
/// results. Only a cancelled run is an ending.
fn guarded<T>(
    run: impl FnOnce() -> Result<T, reconstruct::Error>,
) -> Result<Result<T, String>, io::Error> {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(value)) => Ok(Ok(value)),
        Ok(Err(reconstruct::Error::Cancelled(cancelled))) => Err(cancelled.into()),
        Ok(Err(error)) => Ok(Err(error.to_string())),
        Err(_) => Ok(Err(PANIC.to_owned())),
    }
}

/// What is said of a run that panicked.
pub const PANIC: &str = "an internal error stopped the run";
