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
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    cancelled: AtomicBool,
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

    /// Starts counting a stage of `total` units from zero.
    pub fn begin(&self, total: u64) {
        self.shared.done.store(0, Relaxed);
        self.shared.total.store(total, Relaxed);
    }

    /// Counts `units` more and says whether to go on.
    pub fn advance(&self, units: u64) -> Result<(), Cancelled> {
        self.shared.done.fetch_add(units, Relaxed);
        self.check()
    }

    /// Counts one unit and says whether to go on.
    pub fn tick(&self) -> Result<(), Cancelled> {
        self.advance(1)
    }

    /// `Err(Cancelled)` once the job has been cancelled.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.shared.cancelled.load(Relaxed) { Err(Cancelled) } else { Ok(()) }
    }

    pub fn cancel(&self) {
        self.shared.cancelled.store(true, Relaxed);
    }

    pub fn progress(&self) -> Progress {
        Progress { done: self.shared.done.load(Relaxed), total: self.shared.total.load(Relaxed) }
    }
}
