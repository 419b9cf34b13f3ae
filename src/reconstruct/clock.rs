//! Seconds of each stage of a run, and the updates that a stage begins or is reused.

use std::time::Instant;

use crate::reconstruct::{Stage, Update};

/// Measures the seconds of every stage, and sends an update when one begins or is reused.
pub(super) struct Clock<'a> {
    update: &'a (dyn Fn(Update) + Sync),
    current: Option<(Stage, Instant)>,
    pub(super) kept: [bool; 5],
}

impl<'a> Clock<'a> {
    pub(super) fn new(update: &'a (dyn Fn(Update) + Sync)) -> Self {
        Self { update, current: None, kept: [false; 5] }
    }

    pub(super) fn begin(&mut self, stage: Stage, secs: &mut [f64; 5]) {
        self.stop(secs);
        self.current = Some((stage, Instant::now()));
        (self.update)(Update::Stage(stage));
    }

    /// A stage is taken over from a run with these seconds.
    pub(super) fn keep(&mut self, stage: Stage, secs: &mut [f64; 5], earlier: &[f64; 5]) {
        self.stop(secs);
        secs[stage as usize] = earlier[stage as usize];
        self.kept[stage as usize] = true;
        (self.update)(Update::Reused(stage));
    }

    pub(super) fn stop(&mut self, secs: &mut [f64; 5]) {
        if let Some((stage, began)) = self.current.take() {
            secs[stage as usize] = began.elapsed().as_secs_f64();
        }
    }
}
