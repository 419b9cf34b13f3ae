//! Cameras and a partial model from photographs alone. Cameras and things ([`Thing`]: boxes, rooms
//! and so on) are computed from strokes ([`Stroke`]) that a person draws on the photographs.
//!
//! ```text
//! Model                   lenses, photographs, things, points, strokes
//!   -> calibrate::start   closed forms: vanishing points, linear places, resection
//!   -> adjust             one bundle adjustment of everything, with a robust loss
//!   -> determined         standard errors, and what the strokes leave open, in words
//!   -> Solution           cameras, corners, faces, the residual of every stroke
//! ```
//!
//! The world is in metres, z up, the floor at z = 0. No files, and nothing of a window.

pub mod adjust;
pub mod calibrate;
mod check;
mod conventions;
pub mod determined;
mod edit;
pub mod found;
pub mod from_points;
pub mod jet;
pub mod lines;
mod movement;
mod report;
pub mod residuals;
pub mod rig;
pub mod snap;
mod solve;
pub mod strokes;
pub mod things;
pub mod to_edges;
mod tracks;
pub mod unknowns;
pub mod view;

use std::sync::Arc;

use glam::DVec2;

pub use adjust::{AdjustOptions, Stopped};
pub use found::{FoundCameras, FoundPoint, FoundPose, Similarity};
pub use report::{Estimate, LensReport, PhotographReport, StrokeReport, ThingReport};
pub use solve::{Solution, solve, solve_near, solve_watched};
pub use strokes::{Axis, Place, Stroke};
pub use things::{Opening, Shape, Side, Support, Surfaces, Thing};
pub use view::{Optic, Pose};

use crate::watch::Cancelled;

/// Photographs, things that are to be placed, and the strokes that place them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Lenses of the photographs.
    pub lenses: Vec<Lens>,
    /// The photographs.
    pub photographs: Vec<Photograph>,
    /// Each is listed before those that it carries.
    pub things: Vec<Thing>,
    /// Points that belong to no thing.
    pub points: Vec<Point>,
    /// The strokes: drawn ones and typed numbers, then the lines that were found to be edges.
    pub strokes: Vec<Stroke>,
    /// Points that an engine has found: things can be fitted to them, and they tell how its cameras
    /// stand to each other.
    pub found_points: Arc<Vec<FoundPoint>>,
    /// The unit of [`Photograph::found`] is the metre: where no length is given, that is kept.
    pub found_in_metres: bool,
}

/// A lens with its sensor, of one photograph or of several.
#[derive(Clone, Debug, PartialEq)]
pub struct Lens {
    /// Its name, different from others.
    pub id: String,
    /// In pixels; `None` where only the strokes can tell.
    pub focal_px: Option<f64>,
    /// In pixels from the image's top left corner; `None` is the middle of the image.
    pub principal_px: Option<DVec2>,
    /// OpenCV's k1 and k2.
    pub radial: DVec2,
    /// What of it is adjusted.
    pub fit: Fit,
}

/// Which numbers of a lens are adjusted; others are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fit {
    /// The focal length.
    pub focal: bool,
    /// The principal point.
    pub principal: bool,
    /// The radial term of r².
    pub k1: bool,
    /// The radial term of r⁴.
    pub k2: bool,
}

/// A photograph, with what is known of its camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Photograph {
    /// `file_path` in the camera file.
    pub name: String,
    /// Index into `Model::lenses`.
    pub lens: usize,
    /// Width and height in pixels.
    pub size: (usize, usize),
    /// Where an engine has placed it.
    pub found: Option<FoundPose>,
}

/// A point that belongs to no thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Its name, different from others.
    pub id: String,
}

/// Why a model was not solved, or nothing was fitted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unsolved {
    /// It was asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// What is wrong with the model.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// What is wrong with a model, in words: a clause that names what is meant, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem}. {remedy}.")]
pub struct ModelError {
    /// The place in the model, as its file names it: `strokes[3]`, `things[1] (box1)`. Empty where
    /// the whole is meant.
    pub place: String,
    /// Without a full stop.
    pub problem: String,
    /// Without a full stop.
    pub remedy: String,
}

impl Fit {
    /// Focal length, principal point (x, y), k1, k2.
    pub fn parts(self) -> [bool; 5] {
        [self.focal, self.principal, self.principal, self.k1, self.k2]
    }
}

impl Default for Fit {
    /// The focal length alone.
    fn default() -> Self {
        Self { focal: true, principal: false, k1: false, k2: false }
    }
}

impl ModelError {
    fn new(
        place: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self { place: place.into(), problem: problem.into(), remedy: remedy.into() }
    }
}

impl Model {
    /// What a place is called: `box1.top2`, or the id of a point.
    pub fn place_name(&self, place: Place) -> String {
        match place {
            Place::Corner { thing, corner } => {
                let names = things::corner_names(&self.things[thing]);
                format!("{}.{}", self.things[thing].id, names[corner])
            }
            Place::Point(index) => self.points[index].id.clone(),
        }
    }

    /// Whether enough is drawn of a place to find it. A corner belongs to a thing; a point alone has to be shown
    /// in two photographs of those that `is_used` accepts, or to have a known position.
    pub fn can_place(&self, place: Place, is_used: impl Fn(usize) -> bool) -> bool {
        let Place::Point(_) = place else { return true };
        let strokes = || self.strokes.iter().filter(|own| own.places().contains(&place));
        let mut shown: Vec<usize> =
            strokes().filter_map(Stroke::photograph).filter(|&index| is_used(index)).collect();
        shown.dedup();
        shown.len() > 1 || strokes().any(|own| matches!(own, Stroke::Position { .. }))
    }

    /// What a stroke is called in messages: where it stands and what it says.
    pub fn stroke_name(&self, index: usize) -> String {
        let stroke = &self.strokes[index];
        let what: Vec<String> = match stroke {
            Stroke::Line { axis, .. } => vec![format!("along {}", axis.name())],
            Stroke::Rim { thing, top, .. } => {
                let circle = if *top { "top" } else { "bottom" };
                vec![format!("{}.{circle}", self.things[*thing].id)]
            }
            _ => stroke.places().iter().map(|&place| self.place_name(place)).collect(),
        };
        let photograph = stroke
            .photograph()
            .map_or(String::new(), |index| format!(" in {}", self.photographs[index].name));
        format!("strokes[{index}] ({} {}{photograph})", stroke.name(), what.join(" to "))
    }
}
