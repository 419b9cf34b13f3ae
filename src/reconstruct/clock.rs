//! What time a run takes, stage by stage, and what is told of it.

use std::time::Instant;

use crate::reconstruct::{Stage, Update};

/// Seconds of every stage, and the word to the outside that one begins, or is kept.
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

    /// A stage is taken over, which once took that long.
    pub(super) fn keep(&mut self, stage: Stage, secs: &mut [f64; 5], earlier: &[f64; 5]) {
        self.stop(secs);
        secs[stage as usize] = earlier[stage as usize];
        self.kept[stage as usize] = true;
        (self.update)(Update::Kept(stage));
    }

    pub(super) fn stop(&mut self, secs: &mut [f64; 5]) {
        if let Some((stage, began)) = self.current.take() {
            secs[stage as usize] = began.elapsed().as_secs_f64();
        }
    }
}
