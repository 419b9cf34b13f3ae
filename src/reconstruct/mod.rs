//! The method, about a file a section of the paper.
//!
//! [`run`] is a straight line of stages, each a function from plain data to plain data:
//! samples (4.1), virtual lights and lobes (4.2), transport (5.1), the refinement of
//! reflectances and emissions (5.2 to 5.4), textures (5.5). [`run_cached`] is the same line, but
//! takes products over from earlier runs of the same inputs ([`cache`]).

mod checks;
mod clock;
pub mod emission;
pub mod equations;
pub mod gain;
pub mod joint;
pub mod cache;
pub mod lights;
pub mod lobes;
pub mod normalize;
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
pub use options::{Method, Options};
pub use predict::Predicted;
pub use quality::Quality;
pub use recovered::RecoveredLight;

/// The stages of a reconstruction, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    Samples,
    Lights,
    Transport,
    Solve,
    Textures,
}

impl Stage {
    pub const ALL: [Self; 5] =
        [Self::Samples, Self::Lights, Self::Transport, Self::Solve, Self::Textures];

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
}

/// What a running reconstruction has come to; the products are final when they are sent.
#[derive(Clone, Debug)]
pub enum Update {
    Stage(Stage),
    /// A stage is not done again; its products from an earlier run follow.
    Reused(Stage),
    Samples(Arc<SampleCloud>),
    Lights(Arc<VirtualLights>, Arc<Lobes>),
    Transport(Arc<Transport>),
    Iteration(Iteration),
}

/// All products of one reconstruction.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    pub samples: Arc<SampleCloud>,
    pub lights: Arc<VirtualLights>,
    pub lobes: Arc<Lobes>,
    pub transport: Arc<Transport>,
    pub equations: Arc<Equations>,
    pub solution: Arc<Solution>,
    pub textures: Arc<Vec<Texture>>,
    /// Exposures of the photographs relative to one another, where they were looked for.
    pub gains: Vec<Gain>,
    /// Seconds that each stage took when it was done, in the order of `Stage::ALL`.
    pub seconds: [f64; 5],
    /// Whether it was done in an earlier run, and taken over.
    pub kept: [bool; 5],
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
    #[error(transparent)]
    Option(#[from] OptionError),
    #[error(
        "no photograph of the capture measures radiance: give at least one frame of \
         transforms.json an OpenEXR or Radiance image"
    )]
    NoMeasurement,
    #[error(
        "no pixel of any photograph shows the geometry: check that scene.obj and the cameras of \
         transforms.json are in the same coordinates (metres, OpenGL camera axes)"
    )]
    NothingSeen,
    #[error(
        "no pixel that shows a tagged surface is a measurement: all are saturated, negative or \
         not finite; check the photographs and \"saturation\" in tags.json"
    )]
    NothingMeasured,
    #[error("the start of \"{material}\" names no material of the capture; it has {known}")]
    UnknownStart { material: String, known: String },
    #[error(
        "to solve for {samples} samples and {lobes} lobes takes up to {gigabytes} GB of memory: \
         lower {lower}"
    )]
    TooLarge { samples: usize, lobes: usize, gigabytes: u128, lower: &'static str },
    #[error(
        "the photographs have too many pixels to choose samples from ({0}): scale the photographs \
         down, or leave some of them out"
    )]
    TooManyPixels(#[from] TooManyPoints),
    #[error("the bounded least squares failed: {0}")]
    Solve(BoundedError),
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

/// Reconstructs a capture. The same capture and options give the same
/// result on any number of threads.
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
