//! Import: cameras of other programs, a mesh and photographs become a capture.
//!
//! Every reader turns a file into [`View`]s, the same for all: where the camera stood, in OpenGL
//! axes, and its lens as the file gives it. [`read()`] then finds the photographs, settles what a
//! file leaves to them (sizes), and brings cameras and mesh into metres; [`write()`] makes the
//! capture. Nothing is written by reading.
//!
//! # Pixels
//!
//! Positions in an image count from its top left corner, so that the centre of the first pixel
//! is (0.5, 0.5), as in [`crate::scene::Camera`]. Each reader says in its own words what its
//! program does, with the source:
//!
//! | program | first pixel's centre | here |
//! |---|---|---|
//! | COLMAP, Metashape, nerfstudio | (0.5, 0.5) | as it stands |
//! | AliceVision (Meshroom) | (0, 0) | half a pixel is added |
//! | RealityCapture, OpenSfM, Bundler, glTF | measured from the image's middle | half the size is added |
//!
//! These are pixels as a photograph's file stores them: the programs leave EXIF's orientation aside.
//! Here photographs are turned upright, and their cameras with them, so that both look the same way
//! up. A camera file of the upright size alone is of a program that has turned the photograph
//! itself; a mirrored photograph stays as it is stored, since no camera mirrors.
//!
//! Lens distortion is kept as parameters and applied where rays are made: never to the images.

pub mod alicevision;
pub mod bundler;
mod check;
pub mod colmap;
mod figure;
mod files;
mod fit;
mod format;
mod geometry;
mod measure;
pub mod metashape;
mod notes;
pub mod opensfm;
mod options;
mod own;
mod photographs;
mod read;
pub mod reality_capture;
mod reprojection;
mod series;
mod shown;
mod source;
mod tracks;
mod world;
mod write;

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec2, DVec3};

use super::brackets::Series;
use super::obj::Geometry;
use super::orientation::Orientation;
use super::pose::{self, NoRotation};
use super::{Error, Fault};
use crate::scene::{Camera, Distortion};

pub use check::{Mark, ShotCheck, Survey, check_shot, survey};
pub use geometry::Tidied;
pub use measure::{Picked, place_at};
pub use options::{Axis, Options, Surfaces, Unit};
pub use photographs::is_photograph;
pub use read::read;
pub use reprojection::{Observation, Reprojection};
pub use shown::{Shown, read as show};
pub use source::is_foreign;
pub(in crate::io) use tracks::tracks;
pub use write::{Copying, Holds, Writing, Written, check_folder, holds, write};

/// What is to be said where no photograph measures anything.
pub const NOTHING_MEASURED: &str = "no photograph is linear radiance (OpenEXR or .hdr), so nothing \
                                    can be reconstructed from this capture yet; --srgb takes \
                                    single JPEG, PNG and TIFF for it";

/// What an import has read, before anything is written.
#[derive(Clone, Debug, Default)]
pub struct Import {
    /// What the source is, for a person.
    pub format: &'static str,
    pub shots: Vec<Shot>,
    pub geometry: Option<Geometry>,
    /// What was done to the mesh.
    pub tidied: Tidied,
    /// The points of a COLMAP model, in metres.
    pub points: Vec<DVec3>,
    /// Photographs that are exposures of series, in the order of their cameras.
    pub series: Vec<ShotSeries>,
    /// How well the points of a COLMAP model fall on their observations by these cameras.
    pub reprojection: Option<Reprojection>,
    pub warnings: Vec<String>,
}

/// A photograph with its camera, in metres.
#[derive(Clone, Debug)]
pub struct Shot {
    /// As the source calls it.
    pub name: String,
    pub camera: Camera,
    /// `None` where it was not found.
    pub image: Option<PathBuf>,
    /// How its pixels are turned before they are those of the camera.
    pub orientation: Orientation,
    /// The picture that says which of its pixels are left out.
    pub mask: Option<PathBuf>,
    /// Linear radiance, and not for geometry only.
    pub is_measurement: bool,
    /// What a COLMAP model observed in it.
    pub observations: Vec<Observation>,
}

/// The exposures that a camera's photograph belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct ShotSeries {
    /// An index into `Import::shots`.
    pub shot: usize,
    /// Cameras of other exposures of the same view; merging leaves them out.
    pub others: Vec<usize>,
    /// Its reference is the camera's photograph.
    pub series: Series,
}

impl Shot {
    /// Whether its photograph is a JPEG, PNG or TIFF that is no radiance.
    pub fn is_single_code(&self) -> bool {
        let is_raw = self.image.as_deref().is_some_and(super::raw::is_raw);
        self.image.is_some() && !self.is_measurement && !is_raw
    }
}

impl Import {
    /// What was found, a line each, for a person.
    pub fn summary(&self) -> Vec<String> {
        let found = self.shots.iter().filter(|shot| shot.image.is_some()).count();
        let measured = self.shots.iter().filter(|shot| shot.is_measurement).count();
        let mut lines = vec![format!(
            "{}: {} cameras, {found} photographs, {measured} of them radiance",
            self.format,
            self.shots.len()
        )];
        let masks = self.shots.iter().filter(|shot| shot.mask.is_some()).count();
        if masks > 0 {
            lines.push(format!("masks: {masks}"));
        }
        if let Some(geometry) = &self.geometry {
            let (triangles, surfaces) = (geometry.mesh.triangles.len(), geometry.surfaces.len());
            lines.push(format!("mesh: {triangles} triangles in {surfaces} surfaces"));
            let Tidied { vertices, joined, degenerate } = self.tidied;
            lines.push(format!(
                "vertices: {vertices}, {joined} of them joined to others; {degenerate} triangles \
                 without area left out"
            ));
            if let Some((low, high)) = geometry.mesh.bounds() {
                let size = high - low;
                lines.push(format!("size: {:.3} × {:.3} × {:.3} m", size.x, size.y, size.z));
            }
        }
        if let Some(check) = &self.reprojection {
            lines.push(format!(
                "points: {} with {} observations, {:.3} px from them in the mean, {:.3} px in the \
                 median, {:.3} px at most; against the model's own figures {:.4} px at most, \
                 {:.4} px for 99 %",
                check.points,
                check.observations,
                check.mean_px,
                check.median_px,
                check.worst_px,
                check.disagreement_px,
                check.disagreement_99_px
            ));
        }
        let exposures = || self.series.iter().map(|view| view.series.files.len());
        if let (Some(fewest), Some(most)) = (exposures().min(), exposures().max()) {
            let count = self.series.len();
            let each =
                if fewest == most { format!("{most}") } else { format!("{fewest} to {most}") };
            lines.push(format!("exposure series: {count}, of {each} exposures"));
        }
        lines
    }
}

/// What a reader gives.
#[derive(Clone, Debug, Default)]
pub struct Parsed {
    pub views: Vec<View>,
    pub warnings: Vec<String>,
}

/// A camera as a file gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The photograph's name or path.
    pub name: String,
    /// Under which name the program saves the photograph once it is undistorted.
    pub undistorted: Option<String>,
    /// The place in the file, for messages.
    pub place: String,
    /// Width and height in pixels, where the file says.
    pub size: Option<(usize, usize)>,
    pub lens: Lens,
    pub distortion: Distortion,
    /// Columns are the camera's axes in the world (+x right, +y up, looking along −z).
    pub world_from_camera: DMat3,
    pub position: DVec3,
}

/// The part of a lens that depends on the image's size, in the unit of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// In pixels, the principal point from the corner.
    Pixels { focal: DVec2, principal: DVec2 },
    /// In pixels, the principal point in the middle.
    Centred { focal: DVec2 },
    /// In lengths of the image's longer side, the principal point from the middle.
    Relative { focal: DVec2, offset: DVec2 },
    /// The vertical angle of view, and width over height where it is not the image's.
    Angle { yfov: f64, aspect_ratio: Option<f64> },
}

impl Lens {
    /// Focal lengths and principal point in pixels from the corner.
    fn in_pixels(&self, (width, height): (usize, usize)) -> (DVec2, DVec2) {
        let size = DVec2::new(width as f64, height as f64);
        match *self {
            Self::Pixels { focal, principal } => (focal, principal),
            Self::Centred { focal } => (focal, 0.5 * size),
            Self::Relative { focal, offset } => {
                let side = size.max_element();
                (focal * side, 0.5 * size + offset * side)
            }
            Self::Angle { yfov, aspect_ratio } => {
                let focal_y = 0.5 * size.y / (0.5 * yfov).tan();
                // The picture is `aspect_ratio` times as wide as high in the scene.
                let stretch = aspect_ratio.map_or(1.0, |ratio| size.x / (size.y * ratio));
                (DVec2::new(focal_y * stretch, focal_y), 0.5 * size)
            }
        }
    }
}

impl View {
    /// The camera for an image of that size.
    fn camera(&self, file: &Path, size: (usize, usize)) -> Result<Camera, Error> {
        let (focal, principal) = self.lens.in_pixels(size);
        let wrong = |problem: &str| {
            let remedy = "Correct it there, or export the cameras again";
            Error::Invalid(Fault::new(file, self.place.clone(), problem, remedy))
        };
        if !(focal.is_finite() && focal.cmpgt(DVec2::ZERO).all()) {
            return Err(wrong("the focal length is not a positive number"));
        }
        let Distortion { radial, tangential, denominator } = self.distortion;
        let terms = radial.iter().chain(&tangential).chain(&denominator);
        if !principal.is_finite() || !terms.clone().all(|term| term.is_finite()) {
            return Err(wrong("principal point and distortion must be finite numbers"));
        }
        let largest = size.0.max(size.1);
        if size.0.min(size.1) == 0 || largest as f64 > 1e6 {
            return Err(wrong("the image size is none"));
        }
        if !self.position.is_finite() {
            return Err(wrong("the position of the camera is not finite"));
        }
        let orientation = pose::orientation(self.world_from_camera).map_err(|failure| {
            wrong(match failure {
                NoRotation::Mirrored => "the pose mirrors the camera",
                NoRotation::Deformed => "the pose is no rotation",
            })
        })?;
        let rotation = orientation.rotation;
        Ok(Camera::new(size, focal, principal, self.distortion, rotation, self.position))
    }
}

/// From a pose world to camera in the axes of computer vision (+y down, looking along +z).
fn from_vision(camera_from_world: DMat3, translation: DVec3) -> (DMat3, DVec3) {
    let world_from_camera = camera_from_world.transpose();
    (vision_to_graphics(world_from_camera), -(world_from_camera * translation))
}

/// Camera axes in the world, from those of computer vision to OpenGL's.
fn vision_to_graphics(world_from_camera: DMat3) -> DMat3 {
    let [x, y, z] = [world_from_camera.x_axis, world_from_camera.y_axis, world_from_camera.z_axis];
    DMat3::from_cols(x, -y, -z)
}

/// A word on something that concerns several places, of which the first is named.
fn gathered(file: &Path, places: &[String], what: &str) -> Option<String> {
    let first = places.first()?;
    let more = match places.len() {
        1 => String::new(),
        count => format!(" and {} more", count - 1),
    };
    Some(format!("{}, {first}{more}: {what}", file.display()))
}
