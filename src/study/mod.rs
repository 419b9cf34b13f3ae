//! Studies of the results: error against the truth, error against computing time, and error against
//! degradations of the capture.

pub mod chart;
pub mod cost;
pub mod degrade;
pub mod flip;
pub mod front;
pub mod degradation;
pub mod measure;
pub mod pictures;
pub mod reference;
pub mod report;
pub mod runs;
pub mod score;
pub mod settings;
pub mod speed;
pub mod speed_chart;
pub mod stability;
pub mod stability_chart;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::io;
use crate::io::truth::Truth;
use crate::reconstruct::{self, Options};
use crate::scene::Capture;
use crate::study::runs::{Choice, Planned};
use crate::watch::Watch;

/// A study to be carried out, or the part of one.
#[derive(Clone, Debug)]
pub struct Study {
    /// What is studied.
    pub subject: Subject,
    /// Where runs, tables and charts are written to; with `None` findings are only
    /// passed on.
    pub folder: Option<PathBuf>,
    /// Runs by their numbers, in this order; all, and the charts, where there are none.
    pub only: Vec<usize>,
    /// Only make the charts of the runs that are there.
    pub collect: bool,
}

/// The kind of a study, and its design.
#[derive(Clone, Debug)]
pub enum Subject {
    /// Accuracy against seconds.
    Speed(speed::Design),
    /// Error against degradations.
    Stability(stability::Design),
}

/// Where a study takes a capture from.
#[derive(Clone, Debug)]
pub enum Source {
    /// A folder, as its files are, with the truth that lies beside them.
    Folder(PathBuf),
    /// One that is open, as the artist has tagged it, with what is known to be true of it.
    Open(Opened),
}

/// A capture, and its truth where that is known.
pub type Opened = (Arc<Capture>, Option<Arc<Truth>>);

impl Source {
    /// The capture's name.
    pub fn name(&self) -> String {
        match self {
            Self::Folder(folder) => io::capture::name(folder),
            Self::Open((capture, _)) => capture.name.clone(),
        }
    }

    fn open(&self, watch: &Watch) -> Result<Opened, io::Error> {
        match self {
            Self::Folder(folder) => {
                let capture = io::capture::load(folder, watch)?;
                Ok((Arc::new(capture), Truth::beside(folder)?.map(Arc::new)))
            }
            Self::Open(opened) => Ok(opened.clone()),
        }
    }

    fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Folder(own), Self::Folder(other)) => own == other,
            (Self::Open((own, _)), Self::Open((other, _))) => Arc::ptr_eq(own, other),
            _ => false,
        }
    }
}

/// What one run of a study came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Of the run in the plan.
    pub number: usize,
    /// The name of the run.
    pub name: String,
    /// Its result.
    pub row: Row,
}

/// The result of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Row {
    /// Of a study of speed.
    Speed(speed::Row),
    /// Of a study of stability.
    Stability(stability::Row),
}

/// What was found so far, to be written.
#[derive(Clone, Debug)]
pub enum Findings {
    /// Of a study of speed.
    Speed {
        /// Runs that are done.
        rows: Vec<speed::Row>,
        /// Runs of the whole plan.
        planned: usize,
    },
    /// Of a study of stability.
    Stability {
        /// Its name.
        capture: String,
        /// Runs that are done.
        rows: Vec<stability::Row>,
        /// Runs of the whole plan.
        planned: usize,
    },
}

impl Findings {
    /// Writes tables, charts and report, and returns the lines of a summary.
    pub fn write(&self, folder: &Path) -> Result<Vec<String>, io::Error> {
        match self {
            Self::Speed { rows, planned } => speed::write(folder, rows, *planned),
            Self::Stability { capture, rows, planned } => {
                stability::write(folder, capture, rows, *planned)
            }
        }
    }
}

impl Study {
    /// The names of all runs, by their numbers.
    pub fn names(&self) -> Result<Vec<String>, io::Error> {
        Ok(match &self.subject {
            Subject::Speed(design) => speed::plan(design)?.iter().map(Planned::name).collect(),
            Subject::Stability(design) => {
                stability::plan(design).iter().map(Planned::name).collect()
            }
        })
    }

    /// Carries the study out, and returns the lines of its summary. `watch` counts runs; `tell` is
    /// called with each that is done.
    pub fn perform(
        &self,
        watch: &Watch,
        tell: &(dyn Fn(Finding) + Sync),
    ) -> Result<Vec<String>, io::Error> {
        let folder = self.folder.as_deref();
        let whole = folder.filter(|_| self.only.is_empty());
        let only = self.only.clone();
        match &self.subject {
            Subject::Speed(design) => {
                let plan = speed::plan(design)?;
                let tell = |number: usize, run: &speed::Run, row: &speed::Row| {
                    tell(Finding { number, name: run.name(), row: Row::Speed(row.clone()) });
                };
                if !self.collect {
                    let choice = Choice { only, parallel: false };
                    speed::carry_out(folder, &plan, &choice, watch, &tell)?;
                }
                whole.map_or(Ok(Vec::new()), |folder| speed::collect(folder, &plan))
            }
            Subject::Stability(design) => {
                let plan = stability::plan(design);
                let tell = |number: usize, run: &stability::Run, row: &stability::Row| {
                    tell(Finding { number, name: run.name(), row: Row::Stability(row.clone()) });
                };
                if !self.collect {
                    let choice = Choice { only, parallel: true };
                    stability::carry_out(folder, design, &plan, &choice, watch, &tell)?;
                }
                whole.map_or(Ok(Vec::new()), |folder| {
                    stability::collect(folder, &design.source.name(), &plan)
                })
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
