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
//! Modules import only from those above them in this list:
//! `watch`, `options`, `math` < `geometry`, `solve`, `exposures` < `scene` < `reconstruct` < `render` < `io` <
//! `study` < `worker` < `app` < `cli`.
//!
//! # What always holds
//!
//! - From `math` to `render`: data in, data out. No files, no logging, no globals.
//! - Only `io` opens files. Only `app` names the crates of the window, and it calls no stage: it
//!   sends commands to `worker` and shows products. Every file is written whole or not at all.
//! - The same capture, options and seed give the same bytes on any number of threads.
//! - Types between stages carry no serde; `io` owns the structs of its files.
//! - Every long loop ticks a [`watch::Watch`], which counts progress and can cancel it.

pub mod watch;

pub mod options;

pub mod math;

pub mod geometry;

pub mod solve;

pub mod exposures;

pub mod scene;

pub mod reconstruct;
pub mod render;

pub mod io;

pub mod study;

pub mod worker;

#[cfg(feature = "studio")]
pub mod app;

pub mod cli;
