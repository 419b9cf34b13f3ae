//! Photometric reconstruction: from a partial geometric model, calibrated cameras and HDR
//! photographs to the reflectance of the surfaces and the light that falls on them.
//!
//! The method is that of Gibson, Howard and Hubbard, "Flexible Image-Based Photometric
//! Reconstruction using Virtual Light Sources" (Eurographics 2001); sections and equations cited
//! in the code are that paper's.
//!
//! # The pipeline
//!
//! One reconstruction is a sequence of stages, from plain data to plain data:
//!
//! ```text
//! (Model               io::model::read, model::solve: cameras and geometry from photographs alone)
//! Capture              io::capture::load       geometry, cameras, photographs, tags
//!                      (exposures, where photographs are series of them)
//!   -> SampleCloud     reconstruct::samples    4.1  surface points that photographs show
//!   -> VirtualLights   reconstruct::lights     4.2  positions of light from unmodelled surroundings
//!   -> Lobes           reconstruct::lobes      4.2  its directions (Eq. 8)
//!   -> Transport       reconstruct::transport  5.1  I_s, radiance records, k_ij (Eq. 10)
//!   -> Solution        reconstruct::refine     5.2 to 5.4  reflectances and emissions
//!                      or reconstruct::joint, which finds lights and solution together
//!   -> Vec<Texture>    reconstruct::textures   5.5  maps of reflectance
//!   -> Film            render                  6    pictures with other light and objects
//! ```
//!
//! Every product has public fields, so that a stage can be replaced, saved, drawn or tested
//! alone.
//!
//! # The ladder
//!
//! Modules import only from those above them in this list: `watch`, `options`, `math` < `geometry`,
//! `solve`, `exposures` < `scene` < `model` < `reconstruct` < `render` < `gpu` < `io` < `study` < `worker` <
//! `app` < `cli`.
//!
//! # What always holds
//!
//! - From `math` to `render`: data in, data out. No files, no logging, no globals.
//! - Only `io` opens files. Only `app` names the crates of the window, and only `gpu` beside it those
//!   of graphics cards. `app` calls no stage: it sends commands to `worker` and shows products. Every file is written whole or not at all.
//! - The same capture, options and seed give the same bytes on any number of threads.
//! - Types between stages carry no serde; `io` owns the structs of its files.
//! - Every long loop ticks a [`watch::Watch`], which counts progress and can cancel it.

//!
//! # Glossary
//!
//! - *Visibility buffer*: for each pixel of a photograph the surface position and triangle that it
//!   shows ([`scene::views::VisibilityBuffer`]).
//! - *Surface point*: a position on a known surface with the normal of one side
//!   ([`scene::views::SurfacePoint`]).
//! - *Sample*: a surface point at which measured and computed radiance are compared.
//! - *Virtual light*: a light source that replaces a part of the unmodelled surroundings; *lobe*:
//!   its directional distribution, a power of the cosine about an axis; *emission* E: the strength
//!   of a lobe, in the photographs' unit of radiance.
//! - *Irradiance* I_s: the irradiance of a sample from known surfaces; *coupling* k_ij: irradiance
//!   per unit of a lobe's emission, in sr.
//! - *Radiance record*: the radiance that arrives at a specular sample from one direction.
//! - *BRDF*: the modified Phong model of Eq. 12 ([`scene::Brdf`]).
//! - *Patch radiosity*: the light that is reflected by known surfaces which no photograph shows;
//!   the *form factor* of a patch is its projected solid angle over π
//!   ([`reconstruct::transport::PatchRadiosity`]).
//! - *Bounded least squares*: least squares with bounds, here emissions of at least zero; *active
//!   set*: the unknowns that are at a bound; *KKT residual*: the largest projected gradient, which
//!   is zero at the minimum.
//! - *Residual*: log(computed/measured) of the radiance in one equation; *row*: one equation of the
//!   joint solve.
//! - *Ridge*: a penalty on squared emissions; *prior*: a Gaussian on the logarithms of
//!   reflectances.
//! - *Background*: the virtual lights that are neither lamps nor a sun; *light set*: one choice of
//!   background and lamps, over several of which the result is averaged.
//! - *Paired cross-validation*: two models compared by their errors in the same held-out blocks of
//!   samples.
//! - *Stage cache*: products of earlier runs ([`reconstruct::StageCache`]).
//! - *Degradation*: an error that is added to a capture to measure its effect; *variant*: the solve
//!   whose result is measured ([`study::stability`]).
//! - *Stroke*: what a person draws on a photograph, or types, to place cameras and things
//!   ([`model::Stroke`]); *thing*: a room's shell, box, prism, cylinder or polygon
//!   ([`model::Thing`]); *lens*: the numbers of a camera that photographs may share.
//! - *Vanishing point*: where the images of parallel lines meet; *resection*: a camera from points
//!   whose places are known; *bundle adjustment*: cameras, things and points at the least sum of
//!   squared residuals ([`model::adjust`]).
//! - *Job*: a piece of work of the background thread; *command*: the request for a job; *event*: a
//!   report of a job ([`worker`]).

pub mod watch;

pub mod options;

pub mod math;

pub mod geometry;

pub mod solve;

pub mod exposures;

pub mod scene;

#[warn(missing_docs)]
pub mod model;

#[warn(missing_docs)]
pub mod reconstruct;
pub mod render;
#[cfg(feature = "gpu")]
pub mod gpu;

pub mod io;

#[warn(missing_docs)]
pub mod study;

#[warn(missing_docs)]
pub mod worker;

#[cfg(feature = "studio")]
pub mod app;

pub mod cli;
