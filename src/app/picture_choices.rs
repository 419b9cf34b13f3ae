//! The settings of pictures that are rendered to files: views, size, number of paths, file kinds.

use crate::io::exr::ColorSpace;
use crate::scene::{Camera, Capture};
use crate::worker::Frame;

/// Pixels across that a picture of the view may have.
pub const WIDTHS: std::ops::RangeInclusive<usize> = 16..=16384;

/// The choices, and the folder.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureChoices {
    pub folder: String,
    /// The view as it is shown, else all photographs.
    pub is_view: bool,
    /// Pixels across the view's picture.
    pub width: usize,
    /// Pixels of a photograph along a side of one of its picture's.
    pub step: usize,
    /// Paths per pixel at most.
    pub spp: usize,
    /// Relative noise at which tracing stops earlier.
    pub noise: Option<f64>,
    pub has_png: bool,
    /// The edits set into the photographs.
    pub has_composite: bool,
    /// Of the EXR files.
    pub color_space: ColorSpace,
    /// Light by light, albedo, normals and distance in the EXR files.
    pub has_layers: bool,
}

impl Default for PictureChoices {
    fn default() -> Self {
        let (folder, width) = (String::new(), 1920);
        Self {
            folder,
            is_view: false,
            width,
            step: 1,
            spp: 64,
            noise: None,
            has_png: true,
            has_composite: true,
            color_space: ColorSpace::Rec709,
            has_layers: true,
        }
    }
}

impl PictureChoices {
    /// The pictures; `view` is the camera of the 3D view with the photograph that is looked
    /// through. Only pictures of a photograph's own size can have the edits set into it.
    pub fn frames(&self, capture: &Capture, view: Option<(Camera, Option<usize>)>) -> Vec<Frame> {
        let photograph = |index: usize| {
            let own = &capture.photographs[index];
            Frame {
                name: own.name.clone(),
                camera: own.camera.reduced(self.step),
                photograph: (self.step == 1).then_some(index),
            }
        };
        match view.filter(|_| self.is_view) {
            Some((_, Some(index))) if index < capture.photographs.len() => vec![photograph(index)],
            Some((camera, _)) => {
                vec![Frame {
                    name: "view".into(),
                    camera: wide(&camera, self.width),
                    photograph: None,
                }]
            }
            None if self.is_view => Vec::new(),
            None => (0..capture.photographs.len()).map(photograph).collect(),
        }
    }
}

/// The same view with another number of pixels across.
fn wide(camera: &Camera, width: usize) -> Camera {
    let factor = width as f64 / camera.width.max(1) as f64;
    let height = (camera.height as f64 * factor).round().max(1.0) as usize;
    let mut wide = *camera;
    (wide.width, wide.height) = (width, height);
    wide.focal_px *= factor;
    wide.principal_px *= factor;
    wide
}
