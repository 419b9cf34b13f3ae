//! Requests for pictures of a scene that is edited, and the pictures.

use std::sync::Arc;

use crate::math::rgb::Radiance;
use crate::render::edits::Edits;
use crate::scene::Camera;

/// The picture of a scene, as far as it is refined.
#[derive(Clone, Debug)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    /// Radiance, and the part of the pixel that the scene covers.
    pub after: Vec<(Radiance, f32)>,
    /// The scene without edits, or the photograph.
    pub before: Option<Vec<(Radiance, f32)>>,
    /// Paths per pixel of the light that has fewest.
    pub paths: usize,
    /// No finer picture follows.
    pub is_done: bool,
    /// Paths that were traced for it since it was asked for.
    pub traced: u64,
    /// The name of what traced them.
    pub tracer: String,
}

/// The request for a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    pub edits: Arc<Edits>,
    /// Its size is that of the finest picture.
    pub camera: Camera,
    /// Index of the photograph, taken from the same place, that the edits are composited into.
    pub photograph: Option<usize>,
    /// Also the scene without edits.
    pub before: bool,
}
