//! The method, about a file a section of the paper.
//!
//! [`run`] is a straight line of stages, each a function from plain data to plain data:
//! samples (4.1), virtual lights and lobes (4.2), transport (5.1), the refinement of
//! reflectances and emissions (5.2 to 5.4), textures (5.5).

pub mod emission;
pub mod equations;
pub mod gain;
pub mod joint;
pub mod lights;
pub mod lobes;
pub mod normalize;
pub mod options;
pub mod predict;
pub mod quality;
pub mod refine;
pub mod reflectance;
pub mod samples;
pub mod solution;
pub mod textures;
pub mod transport;
pub mod unwrap;

use std::sync::Arc;
use std::time::Instant;

use crate::geometry::bvh::RayCaster;
use crate::math::rgb::Rgb;
use crate::options::OptionError;
use crate::reconstruct::equations::{Equations, Reflectance};
use crate::reconstruct::gain::{Gain, GainUse};
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::{Iteration, Solution};
use crate::reconstruct::textures::Texture;
use crate::reconstruct::transport::Transport;
use crate::scene::{Capture, KnownLight, Views};
use crate::solve::bounded::BoundedError;
use crate::watch::{Cancelled, Watch};

pub use options::{Method, Options};
pub use predict::Predicted;
pub use quality::Quality;

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
    /// Seconds of each stage, in the order of `Stage::ALL`.
    pub seconds: [f64; 5],
    pub warnings: Vec<String>,
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
        "{samples} samples and {lobes} lobes need {gigabytes} GB of memory: lower samples.count \
         (or raise samples.spacing_m), lights.count or lobes.grid"
    )]
    TooLarge { samples: usize, lobes: usize, gigabytes: u64 },
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
    options.check()?;
    check_start(capture, options)?;
    if capture.measurements().next().is_none() {
        return Err(Error::NoMeasurement);
    }
    let mut clock = Clock::new(update);

    clock.begin(Stage::Samples);
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let seed = options.general.seed as u64;
    let mut views = Views::new(capture, &caster, watch)?;
    let mut samples = samples::place(&views, &options.samples, seed, watch)?;
    let gains = match options.photographs.gain {
        GainUse::Off => Vec::new(),
        GainUse::Report | GainUse::Apply => gain::estimate(capture, &samples),
    };
    let corrected = match options.photographs.gain {
        GainUse::Apply => gain::corrected(capture, &gains),
        GainUse::Off | GainUse::Report => None,
    };
    if let Some(corrected) = &corrected {
        views = Views::new(corrected, &caster, watch)?;
        samples = samples::place(&views, &options.samples, seed, watch)?;
    }
    let capture = views.capture;
    let unseen =
        withheld.map_or_else(Vec::new, |part| predict::withhold(&views, &mut samples, part));
    let samples = Arc::new(samples);
    if samples.samples.is_empty() {
        return Err(if views.shows_anything() {
            Error::NothingMeasured
        } else {
            Error::NothingSeen
        });
    }
    update(Update::Samples(samples.clone()));

    let start = start(&views, &samples, options, watch)?;
    let Products { lights, lobes, transport, equations, solution } = match options.general.method {
        Method::Joint => joint(&views, &samples, &start, options, &mut clock, watch, update)?,
        Method::Paper => paper(&views, &samples, &start, options, &mut clock, watch, update)?,
    };

    clock.begin(Stage::Textures);
    let textures = Arc::new(textures::reconstruct(
        &views,
        &samples,
        &lights,
        &lobes,
        &transport.hidden_light,
        &solution,
        options,
        seed,
        watch,
    )?);

    let seconds = clock.finish();
    let light = (&*lights, &*lobes, &transport.hidden_light, &*solution);
    let predicted = predict::radiance(&views, unseen, light, options, watch)?;
    let mut warnings = views.warnings();
    warnings.extend(gain::warnings(capture, &gains, corrected.is_some()));
    warnings.extend(warn(capture, options, &samples, &lobes, &solution));
    let reconstruction = Reconstruction {
        samples,
        lights,
        lobes,
        transport,
        equations,
        solution,
        textures,
        gains,
        seconds,
        warnings,
    };
    Ok((reconstruction, predicted))
}

/// What the stages between samples and textures come to.
struct Products {
    lights: Arc<VirtualLights>,
    lobes: Arc<Lobes>,
    transport: Arc<Transport>,
    equations: Arc<Equations>,
    solution: Arc<Solution>,
}

/// The paper's method: lights are placed first, and light and reflectances refined in turn.
fn paper(
    views: &Views,
    samples: &Arc<SampleCloud>,
    start: &[Option<Rgb>],
    options: &Options,
    clock: &mut Clock,
    watch: &Watch,
    update: &(dyn Fn(Update) + Sync),
) -> Result<Products, Error> {
    let seed = options.general.seed as u64;
    clock.begin(Stage::Lights);
    let mut lights = lights::place(views, samples, &options.lights, seed, watch)?;
    let lobes = Arc::new(lobes::choose(views, &mut lights, &options.lobes, watch)?);
    let lights = Arc::new(lights);
    update(Update::Lights(lights.clone(), lobes.clone()));

    check_size(samples.samples.len(), lobes.lobes.len())?;
    clock.begin(Stage::Transport);
    let transport = Arc::new(transport::gather(
        views,
        samples,
        &lights,
        &lobes,
        &options.transport,
        seed,
        watch,
    )?);
    update(Update::Transport(transport.clone()));

    clock.begin(Stage::Solve);
    let equations = Arc::new(Equations::new(
        views.capture,
        samples,
        &lights,
        &transport,
        options.gloss.views_per_sample,
    ));
    let start = start.iter().map(|diffuse| diffuse.map(Reflectance::diffuse)).collect();
    let solution = Arc::new(refine::refine(
        views.capture,
        &equations,
        &lobes,
        &transport,
        start,
        options,
        &|iteration| update(Update::Iteration(*iteration)),
        watch,
    )?);
    Ok(Products { lights, lobes, transport, equations, solution })
}

/// The joint method: the lights are part of what is solved for, so they come last.
fn joint(
    views: &Views,
    samples: &Arc<SampleCloud>,
    start: &[Option<Rgb>],
    options: &Options,
    clock: &mut Clock,
    watch: &Watch,
    update: &(dyn Fn(Update) + Sync),
) -> Result<Products, Error> {
    let seed = options.general.seed as u64;
    let lobes = options.joint.largest_set();
    check_size(samples.samples.len(), lobes)?;
    clock.begin(Stage::Transport);
    let mut transport = transport::photographed(views, samples, &options.transport, seed, watch)?;
    let no_lights = VirtualLights::default();
    let views_per_sample = options.gloss.views_per_sample;
    let equations =
        Equations::new(views.capture, samples, &no_lights, &transport, views_per_sample);

    clock.begin(Stage::Solve);
    let outcome = joint::solve(
        views,
        samples,
        &transport,
        &equations,
        start,
        options,
        &|iteration| update(Update::Iteration(*iteration)),
        watch,
    )?;

    clock.begin(Stage::Lights);
    transport.irradiance = outcome.irradiance;
    transport.hidden_light = outcome.hidden_light;
    transport.coupling = outcome.coupling;
    let (lights, lobes) = (Arc::new(outcome.set.lights), Arc::new(outcome.set.lobes));
    update(Update::Lights(lights.clone(), lobes.clone()));
    let transport = Arc::new(transport);
    update(Update::Transport(transport.clone()));
    let equations = Arc::new(equations.with_lights(samples, &lights));
    Ok(Products { lights, lobes, transport, equations, solution: Arc::new(outcome.solution) })
}

/// Seconds of every stage, and the word to the outside that one begins.
struct Clock<'a> {
    update: &'a (dyn Fn(Update) + Sync),
    current: Option<(Stage, Instant)>,
    seconds: [f64; 5],
}

impl<'a> Clock<'a> {
    fn new(update: &'a (dyn Fn(Update) + Sync)) -> Self {
        Self { update, current: None, seconds: [0.0; 5] }
    }

    fn begin(&mut self, stage: Stage) {
        self.stop();
        self.current = Some((stage, Instant::now()));
        (self.update)(Update::Stage(stage));
    }

    fn stop(&mut self) {
        if let Some((stage, began)) = self.current.take() {
            self.seconds[stage as usize] = began.elapsed().as_secs_f64();
        }
    }

    fn finish(mut self) -> [f64; 5] {
        self.stop();
        self.seconds
    }
}

fn check_start(capture: &Capture, options: &Options) -> Result<(), Error> {
    for material in options.start.keys() {
        if !capture.materials.iter().any(|m| m.name == *material) {
            let known: Vec<_> = capture.materials.iter().map(|m| m.name.as_str()).collect();
            return Err(Error::UnknownStart {
                material: material.clone(),
                known: known.join(", "),
            });
        }
    }
    Ok(())
}

/// The coupling of all samples with all lobes is held in memory.
fn check_size(samples: usize, lobes: usize) -> Result<(), Error> {
    let bytes = samples as u64 * lobes as u64 * size_of::<f64>() as u64;
    if bytes > LARGEST_COUPLING {
        return Err(Error::TooLarge { samples, lobes, gigabytes: bytes >> 30 });
    }
    Ok(())
}

/// Bytes; many times what a scene needs, and still within a workstation's memory.
const LARGEST_COUPLING: u64 = 8 << 30;

/// The reflectances to start from: known ones, given ones, else Eq. 11.
fn start(
    views: &Views,
    samples: &SampleCloud,
    options: &Options,
    watch: &Watch,
) -> Result<Vec<Option<Rgb>>, Cancelled> {
    let mut start = normalize::initial_diffuse(views, samples, watch)?;
    for (diffuse, material) in start.iter_mut().zip(&views.capture.materials) {
        let given = options.start.get(&material.name).copied();
        if let (Some(diffuse), Some(value)) = (diffuse, material.known_diffuse.or(given)) {
            *diffuse = value;
        }
    }
    Ok(start)
}

/// What the artist should know about the result.
fn warn(
    capture: &Capture,
    options: &Options,
    samples: &SampleCloud,
    lobes: &Lobes,
    solution: &Solution,
) -> Vec<String> {
    let mut warnings = samples.warnings.clone();
    for (material, reflectance) in capture.materials.iter().zip(&solution.reflectances) {
        if reflectance.is_none() {
            warnings.push(format!(
                "material \"{}\" is measured in no photograph: its reflectance stays unknown",
                material.name
            ));
        }
    }
    if options.general.method == Method::Paper {
        for light in &capture.lights {
            if !matches!(light, KnownLight::Visible { .. }) {
                let (name, kind) = (light.name(), light.kind());
                warnings.push(format!(
                "light \"{name}\" ({kind}) is not used by the method \"paper\", which takes all \
                 light from outside the photographs to be unknown"
            ));
            }
        }
    }
    if lobes.lobes.is_empty() {
        warnings.push(
            "no virtual light was placed, since every ray from the samples meets a photographed \
             surface: the result holds only if all luminaires are tagged as visible lights"
                .to_owned(),
        );
    }
    if samples.samples.len() < lobes.lobes.len() {
        warnings.push(format!(
            "there are fewer samples ({}) than emission lobes ({}): the light is \
             underdetermined; lower samples.spacing_m or raise lights.spacing_factor",
            samples.samples.len(),
            lobes.lobes.len()
        ));
    }
    warnings.extend(solution.warnings.iter().cloned());
    warnings
}
