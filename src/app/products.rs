//! The products of runs: those of the latest run, and those of the run in progress.

use std::sync::Arc;
use std::time::Instant;

use super::derived::Derived;
use super::edit::Edit;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::{Iteration, Solution};
use crate::reconstruct::{Reconstruction, Stage};
use crate::render::scene::Solved;
use crate::scene::Capture;
use crate::watch::Progress;
use crate::worker::Job;

/// What the latest run has come to. While it runs there are parts only.
#[derive(Clone, Default)]
pub struct Products {
    /// The state that they belong to, and its capture.
    pub of: Option<(Arc<Edit>, Arc<Capture>)>,
    pub samples: Option<Arc<SampleCloud>>,
    pub lights: Option<(Arc<VirtualLights>, Arc<Lobes>)>,
    pub solution: Option<Arc<Solution>>,
    pub iterations: Vec<Iteration>,
    pub whole: Option<Arc<Reconstruction>>,
    /// What pictures are made from.
    pub solved: Option<Arc<Solved>>,
    /// `whole` is with the project's file, or on its way there.
    pub stored: bool,
    /// Sample by sample, once it has been worked out.
    pub derived: Option<Arc<Derived>>,
    /// Log errors of the run before, to compare with.
    pub before: Option<Arc<Derived>>,
}

/// A reconstruction that is on its way.
pub struct Run {
    pub job: Job,
    pub began: Instant,
    /// The stages that were taken over from earlier runs; they come before all others.
    pub kept: Vec<Stage>,
    /// The stages so far with the seconds they took; the last is the current one.
    pub stages: Vec<(Stage, Instant, f64)>,
    pub progress: Option<Progress>,
    /// What was there before, given back when this is cancelled.
    pub previous: Products,
    pub cancelling: bool,
}

impl Run {
    pub fn new(job: Job, previous: Products) -> Self {
        Self {
            job,
            began: Instant::now(),
            kept: Vec::new(),
            stages: Vec::new(),
            progress: None,
            previous,
            cancelling: false,
        }
    }

    pub fn stage(&self) -> Option<Stage> {
        self.stages.last().map(|(stage, ..)| *stage)
    }

    pub fn end_stage(&mut self) {
        if let Some((_, began, seconds)) = self.stages.last_mut() {
            *seconds = began.elapsed().as_secs_f64();
        }
    }

    /// Seconds that the current stage still needs at its pace so far.
    pub fn secs_left(&self) -> Option<f64> {
        let progress = self.progress.filter(|p| p.total > 0 && p.done > 0 && p.done <= p.total)?;
        let (_, began, _) = self.stages.last()?;
        let elapsed = began.elapsed().as_secs_f64();
        Some(elapsed * (progress.total - progress.done) as f64 / progress.done as f64)
    }
}

impl Products {
    /// Those of a finished run, which was of `capture`.
    pub fn finish(&mut self, capture: &Capture, whole: Arc<Reconstruction>) {
        self.samples = Some(whole.samples.clone());
        self.lights = Some((whole.lights.clone(), whole.lobes.clone()));
        self.iterations.clone_from(&whole.solution.iterations);
        self.solution = Some(whole.solution.clone());
        self.solved = Some(Arc::new(Solved::new(capture, &whole)));
        self.whole = Some(whole);
    }
}
