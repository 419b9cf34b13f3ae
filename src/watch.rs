//! Progress and cancellation of one job: the only thing that a long loop shares with whoever
//! started it.
//!
//! Progress is counted into an atomic rather than sent, so that a loop may tick for every ray
//! without flooding a channel; the reader polls. Every job has its own `Watch`, so a late
//! cancel cannot stop the next job.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// The job was asked to stop. An ending, not a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// A handle on one job's progress; clones share it.
#[derive(Clone, Debug, Default)]
pub struct Watch {
    cancelled: Arc<AtomicBool>,
    counts: Arc<Counts>,
    /// Cancels this one, too.
    outer: Option<Arc<Watch>>,
}

#[derive(Debug, Default)]
struct Counts {
    done: AtomicU64,
    total: AtomicU64,
}

/// How far the current stage is, in units of the stage's own choice; `total` 0 means unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    pub done: u64,
    pub total: u64,
}

impl Watch {
    pub fn new() -> Self {
        Self::default()
    }

    /// A handle that is cancelled with this one but counts for itself: for the loops within a
    /// step of a stage that counts its steps.
    pub fn within(&self) -> Self {
        Self { counts: Arc::default(), ..self.clone() }
    }

    /// A handle that is cancelled with this one, and can be cancelled alone: for one of several
    /// answers that a job gives.
    pub fn part(&self) -> Self {
        Self { outer: Some(Arc::new(self.clone())), ..Self::default() }
    }

    /// Starts counting a stage of `total` units from zero.
    pub fn begin(&self, total: u64) {
        self.counts.done.store(0, Relaxed);
        self.counts.total.store(total, Relaxed);
    }

    /// Counts `units` more and says whether to go on.
    pub fn advance(&self, units: u64) -> Result<(), Cancelled> {
        self.counts.done.fetch_add(units, Relaxed);
        self.check()
    }

    /// Counts one unit and says whether to go on.
    pub fn tick(&self) -> Result<(), Cancelled> {
        self.advance(1)
    }

    /// `Err(Cancelled)` once the job has been cancelled.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.cancelled.load(Relaxed) {
            return Err(Cancelled);
        }
        self.outer.as_ref().map_or(Ok(()), |outer| outer.check())
    }

    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    pub fn progress(&self) -> Progress {
        Progress { done: self.counts.done.load(Relaxed), total: self.counts.total.load(Relaxed) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_cancelled_alone_or_with_the_whole() {
        let whole = Watch::new();
        let (part, other) = (whole.part(), whole.part().within());
        part.cancel();
        assert_eq!((part.check(), other.check(), whole.check()), (Err(Cancelled), Ok(()), Ok(())));
        whole.cancel();
        assert_eq!((other.check(), whole.check()), (Err(Cancelled), Err(Cancelled)));
    }
}
