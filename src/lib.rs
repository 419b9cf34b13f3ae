//! Photometric reconstruction: from a partial geometric model, calibrated cameras and HDR
//! photographs to what the surfaces reflect and what light falls on them.
//!
//! The method is that of Gibson, Howard and Hubbard, "Flexible Image-Based Photometric
//! Reconstruction using Virtual Light Sources" (Eurographics 2001); sections and equations cited
//! in the code are that paper's.
//!
//! # The pipeline
//!
//! One reconstruction is a straight line of plain data:
//!
//! ```text
//! (Model               io::model::read, model::solve: cameras and geometry from photographs alone)
//! Capture              io::capture::load       geometry, cameras, photographs, tags
//!                      (exposures, where photographs are series of them)
//!   -> SampleCloud     reconstruct::samples    4.1  points seen in the photographs
//!   -> VirtualLights   reconstruct::lights     4.2  where light from the unknown comes in
//!   -> Lobes           reconstruct::lobes      4.2  in which directions (Eq. 8)
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
//! `solve`, `exposures` < `scene` < `model` < `reconstruct` < `render` < `io` < `study` < `worker` < `app` <
//! `cli`.
//!
//! # What always holds
//!
//! - From `math` to `render`: data in, data out. No files, no logging, no globals.
//! - Only `io` opens files. Only `app` names the crates of the window, and it calls no stage: it
//!   sends commands to `worker` and shows products. Every file is written whole or not at all.
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
//! - *Virtual light*, *lobe*, *emission*: where light from what was not modelled comes in, in which
//!   directions, and how much (E).
//! - *Irradiance* I_s: what photographed surfaces send to a sample; *coupling* k_ij: irradiance per
//!   unit of a lobe's emission.
//! - *Radiance record*: radiance that one direction brings to a specular sample.
//! - *BRDF*: the modified Phong model of Eq. 12 ([`scene::Brdf`]).
//! - *Patch radiosity*: the light that known surfaces reflect which no photograph shows; a patch's
//!   *form factor* is its projected solid angle over π ([`reconstruct::transport::PatchRadiosity`]).
//! - *Bounded least squares*, *active set*, *KKT residual*: the numerical problem of emissions at
//!   or above zero, the unknowns that are at a bound, and how far a result is from the minimum.
//! - *Ridge*: a penalty on squared emissions; *prior*: one on the logarithms of reflectances.
//! - *Paired cross-validation*: two models compared by their errors on the same held-out blocks of
//!   samples.
//! - *Stage cache*: products of earlier runs ([`reconstruct::StageCache`]).
//! - *Degradation*, *variant*: what is made worse about a capture, and which solve it is tried on
//!   ([`study::stability`]).
//! - *Stroke*: what a person draws on a photograph, or types, to place cameras and things
//!   ([`model::Stroke`]); *thing*: a room's shell, box, prism, cylinder or polygon
//!   ([`model::Thing`]); *lens*: the numbers of a camera that photographs may share.
//! - *Vanishing point*: where the images of parallel lines meet; *resection*: a camera from points
//!   whose places are known; *bundle adjustment*: cameras, things and points at the least sum of
//!   squared residuals ([`model::adjust`]).
//! - *Command*, *event*, *job*: what the worker is sent, what it reports, and the two together
//!   ([`worker`]).

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

pub mod io;

#[warn(missing_docs)]
pub mod study;

#[warn(missing_docs)]
pub mod worker;

#[cfg(feature = "studio")]
pub mod app;

pub mod cli;
