//! The method: about one file for each section of the paper.
//!
//! [`run`] calls the stages one after the other. Each is a function from plain data to plain data:
//! samples (4.1), virtual lights and lobes (4.2), transport (5.1), the refinement of reflectances
//! and emissions (5.2 to 5.4), textures (5.5). [`run_cached`] does the same, but reuses the
//! products of earlier runs with the same inputs ([`cache`]).

pub mod bright;
mod candidates;
mod checks;
mod clock;
pub mod emission;
pub mod equations;
pub mod gain;
pub mod hemisphere;
mod in_front;
pub mod joint;
pub mod cache;
pub mod lights;
pub mod lobes;
pub mod materials;
pub mod memory;
pub mod normalize;
pub mod optics;
pub mod options;
pub mod predict;
pub mod quality;
pub mod recovered;
pub mod refine;
mod reads;
pub mod reflectance;
mod run;
pub mod samples;
pub mod solution;
pub mod textures;
pub mod transport;
mod unsampled;
pub mod unwrap;

use std::sync::Arc;

use crate::geometry::spaced::TooManyPoints;
use crate::options::OptionError;
use crate::reconstruct::cache::RunProducts;
use crate::reconstruct::equations::Equations;
use crate::reconstruct::gain::Gain;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::reads::Inputs;
use crate::reconstruct::run::Run;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::{Iteration, Solution};
use crate::reconstruct::textures::Texture;
use crate::reconstruct::transport::Transport;
use crate::scene::Capture;
use crate::solve::bounded::BoundedError;
use crate::watch::{Cancelled, Watch};

pub use cache::StageCache;
pub use memory::MemoryNeed;
pub use options::{Method, Options};
pub use predict::Predicted;
pub use quality::Quality;
pub use recovered::RecoveredLight;

/// The stages of a reconstruction, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Section 4.1: where radiance is compared.
    Samples,
    /// Section 4.2: virtual lights and their lobes.
    Lights,
    /// Section 5.1: light from photographed surfaces, and the coupling with the lobes.
    Transport,
    /// Sections 5.2 to 5.4: reflectances and emissions.
    Solve,
    /// Section 5.5: maps of diffuse reflectance.
    Textures,
}

impl Stage {
    /// All stages, in order; arrays that have an entry per stage have this order.
    pub const ALL: [Self; 5] =
        [Self::Samples, Self::Lights, Self::Transport, Self::Solve, Self::Textures];

    /// The name as people and files see it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Lights => "lights",
            Self::Transport => "transport",
            Self::Solve => "solve",
            Self::Textures => "textures",
        }
    }
}

/// Independent streams of random numbers, so that a change in one stage leaves the others'.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Stream {
    Samples = 1,
    Lights,
    Irradiance,
    Visibility,
    Textures,
    Lamps,
    Folds,
    Relook,
    Unseen,
    Candidates,
    Unsampled,
}

/// Progress of a reconstruction and its products, which are final when they are sent.
#[derive(Clone, Debug)]
pub enum Update {
    /// A stage begins.
    Stage(Stage),
    /// A stage is not done again; its products from an earlier run follow.
    Reused(Stage),
    /// The samples.
    Samples(Arc<SampleCloud>),
    /// The virtual lights and their lobes; `joint` finds them with the solution.
    Lights(Arc<VirtualLights>, Arc<Lobes>),
    /// Light transport to the samples.
    Transport(Arc<Transport>),
    /// An iteration of the solve is done.
    Iteration(Iteration),
}

/// All products of one reconstruction.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    /// Where radiance is compared.
    pub samples: Arc<SampleCloud>,
    /// Where light comes in.
    pub lights: Arc<VirtualLights>,
    /// In which directions; light by light.
    pub lobes: Arc<Lobes>,
    /// Light transport to the samples, from surfaces and lobes.
    pub transport: Arc<Transport>,
    /// The equations between radiance, reflectances and emissions: one row for each diffuse sample,
    /// one for each view of a specular one.
    pub equations: Arc<Equations>,
    /// Reflectances and emissions.
    pub solution: Arc<Solution>,
    /// One for each textured surface that has samples.
    pub textures: Arc<Vec<Texture>>,
    /// Exposures of the photographs relative to one another, where they were looked for.
    pub gains: Vec<Gain>,
    /// Seconds that each stage took when it was done, in the order of `Stage::ALL`.
    pub seconds: [f64; 5],
    /// Whether it was done in an earlier run, and taken over.
    pub kept: [bool; 5],
    /// Warnings about the result, one sentence each.
    pub warnings: Vec<String>,
}

impl Reconstruction {
    /// The light that was recovered, of its parts.
    pub fn light(&self) -> RecoveredLight {
        RecoveredLight::of(&self.lights, &self.lobes, &self.transport, &self.solution)
    }

    /// Seconds that this run spent in each stage: none where it was taken over.
    pub fn spent(&self) -> [f64; 5] {
        std::array::from_fn(|stage| if self.kept[stage] { 0.0 } else { self.seconds[stage] })
    }
}

/// Why there is no reconstruction.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An option is out of its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// No photograph has an image of radiance.
    #[error(
        "no photograph of the capture measures radiance: give at least one frame of \
         transforms.json an OpenEXR or Radiance image"
    )]
    NoMeasurement,
    /// No camera's picture shows the geometry.
    #[error(
        "no pixel of any photograph shows the geometry: check that scene.obj and the cameras of \
         transforms.json are in the same coordinates (metres, OpenGL camera axes)"
    )]
    NothingSeen,
    /// Pictures show the geometry, but no pixel there is valid.
    #[error(
        "no pixel that shows a tagged surface is a measurement: all are saturated, negative or \
         not finite; check the photographs and \"saturation\" in tags.json"
    )]
    NothingMeasured,
    /// Start values name a material that there is not.
    #[error("the start of \"{material}\" names no material of the capture; it has {known}")]
    UnknownStart {
        /// As it was given.
        material: String,
        /// Names of the capture's materials, in a list.
        known: String,
    },
    /// The solve would not fit into memory.
    #[error(
        "to solve for {samples} samples and {lobes} lobes takes up to {gigabytes} GB of memory: \
         lower {lower}"
    )]
    TooLarge {
        /// How many there are.
        samples: usize,
        /// How many there are, or may come to be.
        lobes: usize,
        /// Estimate of the peak, in units of 2³⁰ bytes.
        gigabytes: u128,
        /// Options that make it smaller, as a list in words.
        lower: &'static str,
    },
    /// The machine has not the memory for the run.
    #[error(
        "the run takes up to {needed} of memory, most in the stage {stage}, and {available} are \
         free: {lower}; or close other programs"
    )]
    Memory {
        /// In words, beside the capture, which is there already.
        needed: String,
        /// In words.
        available: String,
        /// The stage that takes most.
        stage: &'static str,
        /// What to change.
        lower: String,
    },
    /// Pixels cannot be numbered.
    #[error(
        "the photographs have too many pixels to choose samples from ({0}): scale the photographs \
         down, or leave some of them out"
    )]
    TooManyPixels(#[from] TooManyPoints),
    /// The numerical solver failed.
    #[error("the bounded least squares failed: {0}")]
    Solve(BoundedError),
    /// The job was cancelled, which is an ending and no fault.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<BoundedError> for Error {
    fn from(error: BoundedError) -> Self {
        match error {
            BoundedError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Solve(other),
        }
    }
}

/// Reconstructs a capture. The same capture and options give the same result on any number of
/// threads. `update` is called with every stage, product and iteration, from any thread.
///
/// # Errors
/// Where an option is out of range, the photographs measure nothing of the geometry, the solve does
/// not fit into memory or fails, or the watch is cancelled.
pub fn run(
    capture: &Capture,
    options: &Options,
    watch: &Watch,
    update: &(dyn Fn(Update) + Sync),
) -> Result<Reconstruction, Error> {
    Ok(run_withholding(capture, options, None, watch, update)?.0)
}

/// As [`run`], but without the samples of one quarter of all blocks, by its number: they are
/// predicted instead (see [`predict`]).
///
/// # Errors
/// As [`run`].
pub fn run_withholding(
    capture: &Capture,
    options: &Options,
    withheld: Option<usize>,
    watch: &Watch,
    update: &(dyn Fn(Update) + Sync),
) -> Result<(Reconstruction, Vec<Predicted>), Error> {
    Run {
        capture,
        options,
        inputs: Inputs::whole(capture, options),
        earlier: Vec::new(),
        products: RunProducts::default(),
        withheld,
        watch,
        update,
    }
    .perform()
}

/// As [`run`], to the same bytes, but beginning at the first stage whose inputs differ from those
/// of the runs in the stage cache.
///
/// # Errors
/// As [`run`]; what was done before the error stays in the cache.
pub fn run_cached(
    capture: &Capture,
    options: &Options,
    stage_cache: &StageCache,
    watch: &Watch,
    update: &(dyn Fn(Update) + Sync),
) -> Result<Reconstruction, Error> {
    let mut run = Run {
        capture,
        options,
        inputs: Inputs::of_all(capture, options),
        earlier: stage_cache.earlier(),
        products: RunProducts::default(),
        withheld: None,
        watch,
        update,
    };
    let result = run.perform();
    match &result {
        Ok(_) => stage_cache.ended(run.products),
        Err(_) => stage_cache.stopped(run.products),
    }
    Ok(result?.0)
}
