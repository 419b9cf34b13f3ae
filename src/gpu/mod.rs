//! Path tracing and denoising on a graphics card, by compute shaders of `wgpu` that any card of the
//! last decade runs. What is estimated, and how, is that of [`render::path`](crate::render::path), from the same
//! trees, tables and points; only rounding differs, so that pictures agree up to noise, but not to
//! the byte.
//!
//! A card that is lost, or has too little memory for a scene, is replaced by the processor, and
//! says so ([`Tracer::trouble`](crate::render::tracer::Tracer::trouble)).

mod card;
mod denoise;
mod device;
mod parameters;
mod shader;
mod upload;

pub use card::Card;
pub use device::{Adapters, NoCard};
