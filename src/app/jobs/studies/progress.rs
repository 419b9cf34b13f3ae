//! The progress of a study, and the estimated time left.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::app::edit::Edit;
use crate::worker::Job;

/// How often the time left is looked at: seconds are measured meanwhile, so seldom.
pub const PULSE: Duration = Duration::from_millis(400);

/// A run that is planned.
pub struct Planning {
    /// Everything that its result depends on.
    pub key: String,
    pub name: String,
    /// Expected time, relative to other runs'.
    pub cost: f64,
}

/// What a study would be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    pub runs: usize,
    pub done: usize,
    /// Of those that are not done.
    pub cost: f64,
}

impl Estimate {
    pub(super) fn of(runs: &[Planning], done: &[String]) -> Self {
        let is_done = |run: &&Planning| done.contains(&run.key);
        Self {
            runs: runs.len(),
            done: runs.iter().filter(is_done).count(),
            cost: runs.iter().filter(|run| !is_done(run)).map(|run| run.cost).sum(),
        }
    }
}

pub struct StudyProgress {
    /// Runs now.
    pub(super) job: Option<Job>,
    runs: Vec<Planning>,
    /// The order in which they are begun.
    order: Vec<usize>,
    done: Vec<bool>,
    began: Instant,
    /// When the latest run was done, and the expected time of all since it began.
    latest: Option<(Instant, f64)>,
    pub cancelling: bool,
    /// Runs whose results are there, of other plans, too; and so many of them are in a folder.
    found: usize,
    pub(super) saved: usize,
    /// Tags and options that it began with.
    pub edit: Arc<Edit>,
}

impl StudyProgress {
    /// A plan of which some runs may be done already: results are there for `keys`, and `saved` of
    /// them are in a folder.
    pub(super) fn new(edit: Arc<Edit>, runs: Vec<Planning>, keys: &[String], saved: usize) -> Self {
        Self {
            job: None,
            order: (0..runs.len()).collect(),
            done: runs.iter().map(|run| keys.contains(&run.key)).collect(),
            runs,
            began: Instant::now(),
            latest: None,
            cancelling: false,
            found: keys.len(),
            saved: saved.min(keys.len()),
            edit,
        }
    }

    /// What takes little time comes first.
    pub(super) fn cheapest_first(&mut self) {
        self.order.sort_by(|&a, &b| self.runs[a].cost.total_cmp(&self.runs[b].cost));
    }

    /// What a run depends on.
    pub(super) fn key(&self, number: usize) -> Option<&str> {
        self.runs.get(number).map(|run| run.key.as_str())
    }

    pub fn is_running(&self) -> bool {
        self.job.is_some()
    }

    pub fn done(&self) -> usize {
        self.done.iter().filter(|done| **done).count()
    }

    pub fn planned(&self) -> usize {
        self.runs.len()
    }

    /// Runs whose results are there.
    pub fn found(&self) -> usize {
        self.found
    }

    /// Runs that are still to be done, in their order.
    pub(super) fn left(&self) -> Vec<usize> {
        self.order.iter().copied().filter(|&number| !self.done[number]).collect()
    }

    /// Seconds since it was begun or taken up again.
    pub fn elapsed_secs(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// The run that was begun last, where they go one after the other.
    pub fn now(&self) -> Option<&str> {
        let next = self.order.iter().find(|&&number| !self.done[number])?;
        Some(&self.runs[*next].name)
    }

    /// Seconds that are left at the pace so far.
    pub fn secs_left(&self) -> Option<f64> {
        let (latest, spent) = self.latest?;
        let pace = (latest - self.began).as_secs_f64() / spent;
        let left: f64 = self.left().into_iter().map(|number| self.runs[number].cost).sum();
        Some((pace * left - latest.elapsed().as_secs_f64()).max(0.0))
    }

    /// Runs that no folder holds.
    pub(super) fn at_stake(&self) -> usize {
        let unsaved = self.found.saturating_sub(self.saved);
        if self.is_running() { unsaved.max(1) } else { unsaved }
    }

    pub(super) fn begin(&mut self, job: Job) {
        self.job = Some(job);
        self.began = Instant::now();
        self.latest = None;
        self.cancelling = false;
    }

    pub(super) fn end(&mut self) {
        self.job = None;
        self.cancelling = false;
    }

    pub(super) fn add(&mut self, number: usize) {
        if let (Some(done), Some(run)) = (self.done.get_mut(number), self.runs.get(number)) {
            *done = true;
            self.found += 1;
            let before = self.latest.map_or(0.0, |(_, spent)| spent);
            self.latest = Some((Instant::now(), before + run.cost));
        }
    }

    /// So many runs are in a folder now.
    pub(super) fn mark_saved(&mut self, count: usize) {
        self.saved = count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_follows_the_order_and_the_pace() {
        let run = |(name, cost): (&str, f64)| Planning {
            key: format!("key of {name}"),
            name: name.to_owned(),
            cost,
        };
        let runs = || [("a", 3.0), ("b", 1.0), ("c", 2.0)].map(run).into();
        let mut progress = StudyProgress::new(Arc::default(), runs(), &[], 0);
        progress.cheapest_first();
        assert_eq!((progress.now(), progress.secs_left()), (Some("b"), None));
        progress.began = Instant::now() - Duration::from_secs(10);
        progress.add(1);
        assert_eq!((progress.now(), progress.done(), progress.left()), (Some("c"), 1, vec![2, 0]));
        // One unit of work took ten seconds, and five are left.
        let left = progress.secs_left().unwrap();
        assert!((left - 50.0).abs() < 1.0, "{left}");
        assert_eq!(progress.at_stake(), 1);
        progress.mark_saved(1);
        assert_eq!(progress.at_stake(), 0);
        progress.add(7);
        assert_eq!(progress.done(), 1);
        // Of another plan, and of this one.
        let keys = ["key of z".to_owned(), "key of a".to_owned()];
        let again = StudyProgress::new(Arc::default(), runs(), &keys, 1);
        assert_eq!((again.done(), again.at_stake(), again.left()), (1, 1, vec![1, 2]));
        let estimate = Estimate::of(&runs(), &keys);
        assert_eq!(estimate, Estimate { runs: 3, done: 1, cost: 3.0 });
    }
}
