//! Many runs that do not depend on each other: each leaves a file of its own, so that a study can
//! be stopped and taken up again, and spread over machines that share a folder.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::io::{self, records};
use crate::watch::Watch;

/// What a run's file holds.
#[derive(Serialize, Deserialize)]
struct Stored<R> {
    /// What was run, in full: another study's file is not taken for this one's.
    key: String,
    row: R,
}

/// A run of a study.
pub trait Planned: Sync {
    /// What a run comes to, as its file holds it.
    type Row: Serialize + DeserializeOwned + Send;
    /// Shown to people, and part of file names.
    fn name(&self) -> String;
    /// Everything that the result depends on.
    fn key(&self) -> String;
}

/// Which runs of a study are carried out, and how.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Numbers in the plan, in this order; all where there are none.
    pub only: Vec<usize>,
    /// Several at a time: where seconds are not measured.
    pub parallel: bool,
}

fn file(folder: &Path, index: usize, run: &impl Planned) -> PathBuf {
    let fine = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    let name: String = run.name().chars().map(fine).take(80).collect();
    folder.join("runs").join(format!("{index:05}-{name}.json"))
}

fn finished<P: Planned>(folder: &Path, index: usize, run: &P) -> Option<P::Row> {
    let stored: Stored<P::Row> = records::read(&file(folder, index, run)).ok()?;
    (stored.key == run.key()).then_some(stored.row)
}

/// What one run of a plan comes to.
pub type Perform<'a, P> = dyn Fn(&P, &Watch) -> Result<<P as Planned>::Row, io::Error> + Sync + 'a;

/// Called with a run that is done: its number in the plan, the run, and what it came to.
pub type Tell<'a, P> = dyn Fn(usize, &P, &<P as Planned>::Row) + Sync + 'a;

/// Carries out the runs that are not done yet. `perform` does one; `watch` counts runs. Each
/// leaves a file in the folder, if there is one.
///
/// # Errors
/// Where a result cannot be written, the job is cancelled, or `perform` fails.
pub fn carry_out<P: Planned>(
    folder: Option<&Path>,
    plan: &[P],
    choice: &Choice,
    watch: &Watch,
    perform: &Perform<P>,
    tell: &Tell<P>,
) -> Result<(), io::Error> {
    let all: Vec<usize> = match choice.only.is_empty() {
        true => (0..plan.len()).collect(),
        false => choice.only.iter().copied().filter(|&index| index < plan.len()).collect(),
    };
    watch.begin(all.len() as u64);
    let one = |&index: &usize| -> Result<(), io::Error> {
        watch.check()?;
        let run = &plan[index];
        if folder.is_none_or(|folder| finished(folder, index, run).is_none()) {
            let row = perform(run, &watch.within())?;
            let stored = Stored { key: run.key(), row };
            if let Some(folder) = folder {
                records::write(&file(folder, index, run), &stored)?;
            }
            tell(index, run, &stored.row);
        }
        Ok(watch.tick()?)
    };
    match choice.parallel {
        true => all.par_iter().try_for_each(one),
        false => all.iter().try_for_each(one),
    }
}

/// The results that are there, in the order of the plan.
pub fn collect<P: Planned>(folder: &Path, plan: &[P]) -> Vec<P::Row> {
    plan.iter().enumerate().filter_map(|(index, run)| finished(folder, index, run)).collect()
}
