//! The stage cache: the products of earlier runs of a capture, so that a run begins at the first
//! stage whose inputs differ.
//!
//! Every product is stored with the inputs of the step that made it (`reads.rs` lists the inputs of
//! each step). A run reuses a product if these inputs, and those of every step on which it builds,
//! equal its own. Products are shared, not copied. A run that reuses products gives the same bytes
//! as one from the beginning.
//!
//! The products of two runs are kept: those of the last run that ended, and those of the last run
//! that was stopped after it made something new. If an artist stops a run, neither the earlier
//! result nor the finished stages are lost. In addition to the parts of a result, the cache holds
//! the visibility buffers: 16 bytes for each pixel of the photographs, or about one byte if there
//! are many pixels, in one copy as long as geometry and cameras are the same. All memory is
//! released with the last clone of the cache.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::geometry::bvh::RayCaster;
use crate::math::rgb::Rgb;
use crate::reconstruct::equations::Equations;
use crate::reconstruct::gain::Gain;
use crate::reconstruct::in_front;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::reads::{Inputs, Step};
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::Solution;
use crate::reconstruct::textures::Texture;
use crate::reconstruct::transport::Transport;
use crate::reconstruct::{Method, Options, RecoveredLight, Stage};
use crate::scene::{Capture, MirrorsAndGlass, Optics, Photograph, Views, VisibilityCache};

/// The stage cache of one capture. Clones share their contents.
#[derive(Clone, Default)]
pub struct StageCache {
    runs: Arc<Mutex<CachedRuns>>,
    afresh: bool,
}

#[derive(Clone, Default)]
struct CachedRuns {
    ended: Option<RunProducts>,
    stopped: Option<RunProducts>,
    changes: u64,
}

impl StageCache {
    /// The same cache for a run that takes nothing over, but stores its products.
    pub fn afresh(&self) -> Self {
        Self { afresh: true, ..self.clone() }
    }

    /// A cache of its own with the same products, which later runs with either do not change in the
    /// other. The products themselves are shared.
    pub fn fork(&self) -> Self {
        let runs = self.lock().clone();
        Self { runs: Arc::new(Mutex::new(runs)), afresh: self.afresh }
    }

    /// For each of [`Stage::ALL`] whether a run with these inputs would take its products over.
    pub fn stages(&self, capture: &Capture, options: &Options) -> [bool; 5] {
        let inputs = Inputs::of_all(capture, options);
        let method = options.general.method;
        let earlier = self.earlier();
        Stage::ALL.map(|stage| {
            let step = Step::ending(stage, method);
            earlier.iter().any(|run| run.holds(step, method, &inputs))
        })
    }

    /// A number that grows with every change of the contents.
    pub fn changes(&self) -> u64 {
        self.lock().changes
    }

    /// Runs whose products may be taken over; where several fit, the first counts.
    pub(super) fn earlier(&self) -> Vec<RunProducts> {
        if self.afresh {
            return Vec::new();
        }
        let runs = self.lock();
        runs.stopped.iter().chain(&runs.ended).cloned().collect()
    }

    /// Stores the products of a run that ended.
    pub(super) fn ended(&self, products: RunProducts) {
        let mut runs = self.lock();
        runs.ended = Some(products);
        runs.stopped = None;
        runs.changes += 1;
    }

    /// Stores the products of a run that was stopped, if any of them is new.
    pub(super) fn stopped(&self, products: RunProducts) {
        if products.is_new {
            let mut runs = self.lock();
            runs.stopped = Some(products);
            runs.changes += 1;
        }
    }

    fn lock(&self) -> MutexGuard<'_, CachedRuns> {
        self.runs.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for StageCache {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let runs = self.lock();
        f.debug_struct("StageCache")
            .field("ended", &runs.ended.is_some())
            .field("stopped", &runs.stopped.is_some())
            .field("afresh", &self.afresh)
            .finish()
    }
}

/// The products of one run, as far as it came, with the inputs of each.
#[derive(Clone, Default)]
pub(super) struct RunProducts {
    pub visibility: Option<Product<Visibility>>,
    pub samples: Option<Product<SampleProducts>>,
    pub gathered: Option<Product<Transport>>,
    pub lights: Option<Product<LightProducts>>,
    pub coupled: Option<Product<Transport>>,
    pub solved: Option<Product<SolveProducts>>,
    pub textures: Option<Product<Vec<Texture>>>,
    /// Seconds that each of `Stage::ALL` took, in the run that did it.
    pub secs: [f64; 5],
    /// Whether this run made any of them itself.
    pub is_new: bool,
}

/// The product of a step, with the inputs that it was made from.
pub(super) struct Product<T> {
    pub inputs: Arc<Inputs>,
    pub value: Arc<T>,
}

impl<T> Clone for Product<T> {
    fn clone(&self) -> Self {
        Self { inputs: self.inputs.clone(), value: self.value.clone() }
    }
}

/// The ray caster and the visibility buffers of all photographs.
pub(super) struct Visibility {
    pub caster: RayCaster,
    pub buffers: VisibilityCache,
}

/// The samples, and what is computed from them about the photographs.
pub(super) struct SampleProducts {
    pub cloud: Arc<SampleCloud>,
    /// Mirrors and glass, which have no samples.
    pub mirrors: Arc<MirrorsAndGlass>,
    /// Gains of the photographs; only where they are divided out.
    pub gains: Vec<Gain>,
    /// What photographs show in front of surfaces.
    pub in_front: in_front::Found,
    /// The photographs without the pixels that show this and divided by the gains, where there are
    /// any of either.
    pub corrected: Option<Vec<Photograph>>,
    /// Diffuse reflectance per material to start from (Eq. 11).
    pub start: Vec<Option<Rgb>>,
}

impl Visibility {
    /// The photographs of a capture with what each pixel sees.
    pub(super) fn views<'a>(&'a self, capture: &'a Capture) -> Views<'a> {
        Views::with_visibility(capture, &self.caster, &self.buffers)
    }
}

impl SampleProducts {
    /// A capture with its photographs as they are used.
    pub(super) fn corrected(&self, capture: &Capture) -> Capture {
        let mut capture = capture.clone();
        if let Some(photographs) = &self.corrected {
            capture.photographs.clone_from(photographs);
        }
        capture
    }

    /// The reflectances to start from: known ones, given ones, else Eq. 11.
    pub(super) fn start_of(&self, inputs: &Inputs) -> Vec<Option<Rgb>> {
        let mut start = self.start.clone();
        for (diffuse, material) in start.iter_mut().zip(&inputs.capture.materials) {
            let given = inputs.options.start.get(&material.name).copied();
            if let (Some(diffuse), Some(value)) = (diffuse, material.known_diffuse.or(given)) {
                *diffuse = value;
            }
        }
        start
    }

    /// A solution with the mirrors and the glass that were found, and what is in front of surfaces.
    pub(super) fn told(&self, capture: &Capture, mut solution: Solution) -> Solution {
        solution.notes.extend(self.in_front.note());
        for (material, optics) in capture.materials.iter().zip(&self.mirrors.optics) {
            let what = match optics {
                Optics::Opaque => continue,
                Optics::Mirror(_) => "a mirror",
                Optics::Glass => "clear glass, which light passes",
            };
            solution.notes.push(format!("\"{}\" is taken to be {what}", material.name));
        }
        solution.optics.clone_from(&self.mirrors.optics);
        solution
    }
}

/// Virtual lights and their lobes.
pub(super) struct LightProducts {
    pub lights: Arc<VirtualLights>,
    pub lobes: Arc<Lobes>,
}

/// The products of the solve.
#[derive(Clone)]
pub(super) struct SolveProducts {
    pub lights: Arc<VirtualLights>,
    pub lobes: Arc<Lobes>,
    pub transport: Arc<Transport>,
    pub equations: Arc<Equations>,
    pub solution: Arc<Solution>,
}

impl SolveProducts {
    /// The light that was recovered, of its parts.
    pub(super) fn light(&self) -> RecoveredLight {
        RecoveredLight::of(&self.lights, &self.lobes, &self.transport, &self.solution)
    }
}

impl RunProducts {
    /// The inputs of a step; `None` where it was not done.
    fn inputs(&self, step: Step) -> Option<&Inputs> {
        let inputs = match step {
            Step::Visibility => self.visibility.as_ref().map(|product| &product.inputs),
            Step::Samples => self.samples.as_ref().map(|product| &product.inputs),
            Step::Gathered => self.gathered.as_ref().map(|product| &product.inputs),
            Step::Lights => self.lights.as_ref().map(|product| &product.inputs),
            Step::Coupled => self.coupled.as_ref().map(|product| &product.inputs),
            Step::Solved => self.solved.as_ref().map(|product| &product.inputs),
            Step::Textures => self.textures.as_ref().map(|product| &product.inputs),
        };
        inputs.map(Arc::as_ref)
    }

    /// Whether a step, and every step that it builds on, was done with these inputs.
    pub(super) fn holds(&self, step: Step, method: Method, inputs: &[Arc<Inputs>; 7]) -> bool {
        self.inputs(step).is_some_and(|own| own.same_as(&inputs[step as usize]))
            && step.builds_on(method).iter().all(|&below| self.holds(below, method, inputs))
    }
}
