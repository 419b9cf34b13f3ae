//! The input of the method: geometry, cameras, photographs and tags.

pub mod agreement;
pub mod ball;
pub mod brdf;
pub mod camera;
pub mod capture;
pub mod charts;
pub mod clutter;
pub mod dome;
pub mod emitter;
pub mod gloss;
mod hits;
mod incoming;
mod look;
pub mod image;
pub mod mask;
mod mirrors;
mod pixels;
pub mod shown;
pub mod views;
pub mod wireframe;

pub use agreement::{agreed, agreeing};
pub use brdf::Brdf;
pub use camera::{Camera, Distortion};
pub use capture::{
    Capture, Display, Environment, KnownLight, Material, MaterialKind, Photograph, Role, Surface,
};
pub use dome::Dome;
pub use emitter::Emitter;
pub use gloss::{Gloss, Viewing, fresnel};
pub use image::Image;
pub use incoming::Incoming;
pub use mask::{Mask, Shape};
pub use mirrors::{MirrorsAndGlass, Optics, without_glass};
pub use pixels::{Stored, Values};
pub use views::{Seen, SurfacePoint, Views, VisibilityCache};
