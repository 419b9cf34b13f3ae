//! What earlier runs of a capture made, so that a run begins at the first stage that differs.
//!
//! A product is taken over where the step that made it, and every step that this one builds on,
//! read the same then as now (`reads.rs` has the table of what they read). It is the same
//! product, not a copy, and the result has the same bytes as that of a run from the beginning.
//!
//! Two runs are kept: the last that ended, and the last that did not but made something new, so
//! that an artist who stops a run loses neither what was there before nor the stages that were
//! done. Both hold what pixels see (16 bytes for each pixel of the photographs, once as long as
//! the geometry and the cameras are the same) beside what a result consists of. All of it goes
//! with the last handle.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::geometry::bvh::RayCaster;
use crate::math::rgb::Rgb;
use crate::reconstruct::equations::Equations;
use crate::reconstruct::gain::Gain;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::reads::{Inputs, Step};
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::Solution;
use crate::reconstruct::textures::Texture;
use crate::reconstruct::transport::Transport;
use crate::reconstruct::{Method, Options, Stage};
use crate::scene::{Capture, Photograph, Sightlines};

/// A handle on what runs of one capture left; clones are handles on the same.
#[derive(Clone, Default)]
pub struct Keeper {
    kept: Arc<Mutex<Kept>>,
    afresh: bool,
}

#[derive(Default)]
struct Kept {
    ended: Option<Made>,
    stopped: Option<Made>,
    changes: u64,
}

impl Keeper {
    /// A handle for a run that takes nothing over; what it makes is kept.
    pub fn afresh(&self) -> Self {
        Self { afresh: true, ..self.clone() }
    }

    /// For each of [`Stage::ALL`] whether a run with these would take it over.
    pub fn stages(&self, capture: &Capture, options: &Options) -> [bool; 5] {
        let inputs = Inputs::of_all(capture, options);
        let method = options.general.method;
        let earlier = self.earlier();
        Stage::ALL.map(|stage| {
            let step = Step::ending(stage, method);
            earlier.iter().any(|made| made.holds(step, method, &inputs))
        })
    }

    /// Grows with every change of what is kept.
    pub fn changes(&self) -> u64 {
        self.lock().changes
    }

    /// What may be taken over, best first.
    pub(super) fn earlier(&self) -> Vec<Made> {
        if self.afresh {
            return Vec::new();
        }
        let kept = self.lock();
        kept.stopped.iter().chain(&kept.ended).cloned().collect()
    }

    /// Keeps what a run made that ended.
    pub(super) fn ended(&self, made: Made) {
        let mut kept = self.lock();
        kept.ended = Some(made);
        kept.stopped = None;
        kept.changes += 1;
    }

    /// Keeps what a run made until it was stopped, if anything of it is new.
    pub(super) fn stopped(&self, made: Made) {
        if made.is_new {
            let mut kept = self.lock();
            kept.stopped = Some(made);
            kept.changes += 1;
        }
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Keeper {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kept = self.lock();
        f.debug_struct("Keeper")
            .field("ended", &kept.ended.is_some())
            .field("stopped", &kept.stopped.is_some())
            .field("afresh", &self.afresh)
            .finish()
    }
}

/// What one run made, as far as it came, with what it was made of.
#[derive(Clone, Default)]
pub(super) struct Made {
    pub sight: Option<Product<Sight>>,
    pub samples: Option<Product<Placed>>,
    pub gathered: Option<Product<Transport>>,
    pub lights: Option<Product<Lit>>,
    pub coupled: Option<Product<Transport>>,
    pub solved: Option<Product<Solved>>,
    pub textures: Option<Product<Vec<Texture>>>,
    /// Of each of `Stage::ALL` what it took to make it, in this run or before.
    pub secs: [f64; 5],
    /// Not everything was taken over.
    pub is_new: bool,
}

/// What a step came to, and what it had read.
pub(super) struct Product<T> {
    pub of: Arc<Inputs>,
    pub it: Arc<T>,
}

impl<T> Clone for Product<T> {
    fn clone(&self) -> Self {
        Self { of: self.of.clone(), it: self.it.clone() }
    }
}

/// What every pixel sees.
pub(super) struct Sight {
    pub caster: RayCaster,
    pub lines: Sightlines,
}

/// The samples, and what comes of the photographs with them.
pub(super) struct Placed {
    pub cloud: Arc<SampleCloud>,
    /// The gains that were looked for to be divided out.
    pub gains: Vec<Gain>,
    /// The photographs without telling gains, where there were any.
    pub corrected: Option<Vec<Photograph>>,
    /// Eq. 11, by material.
    pub start: Vec<Option<Rgb>>,
}

/// Virtual lights and their lobes.
pub(super) struct Lit {
    pub lights: Arc<VirtualLights>,
    pub lobes: Arc<Lobes>,
}

/// What the solve comes to.
#[derive(Clone)]
pub(super) struct Solved {
    pub lights: Arc<VirtualLights>,
    pub lobes: Arc<Lobes>,
    pub transport: Arc<Transport>,
    pub equations: Arc<Equations>,
    pub solution: Arc<Solution>,
}

impl Made {
    /// What a step had read; `None` where it was not done.
    fn of(&self, step: Step) -> Option<&Inputs> {
        let of = match step {
            Step::Sight => self.sight.as_ref().map(|product| &product.of),
            Step::Samples => self.samples.as_ref().map(|product| &product.of),
            Step::Gathered => self.gathered.as_ref().map(|product| &product.of),
            Step::Lights => self.lights.as_ref().map(|product| &product.of),
            Step::Coupled => self.coupled.as_ref().map(|product| &product.of),
            Step::Solved => self.solved.as_ref().map(|product| &product.of),
            Step::Textures => self.textures.as_ref().map(|product| &product.of),
        };
        of.map(Arc::as_ref)
    }

    /// Whether a step was done with these, and all that it builds on.
    pub(super) fn holds(&self, step: Step, method: Method, inputs: &[Arc<Inputs>; 7]) -> bool {
        self.of(step).is_some_and(|of| of.are(&inputs[step as usize]))
            && step.builds_on(method).iter().all(|&below| self.holds(below, method, inputs))
    }
}
