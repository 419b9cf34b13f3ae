//! COLMAP models, as text and binary.
//!
//! Poses are world to camera in the axes of computer vision; the upper left corner of an image
//! is (0, 0) and the centre of the first pixel (0.5, 0.5) (COLMAP's documentation, "Output
//! Format"). Records are those of its `src/colmap/scene/reconstruction_io`; memory grows with
//! what is read, never with what a count claims.

mod binary;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::{Lens, Parsed, View, from_vision, gathered};
use crate::io::error::read_bounded;
use crate::io::{Error, Fault};
use crate::scene::Distortion;

pub use binary::{cameras as binary_cameras, images as binary_images, points as binary_points};
pub use text::{cameras as text_cameras, images as text_images, points as text_points};

/// A model of ten thousand photographs is about a gigabyte.
const LARGEST: u64 = 4 << 30;

/// A camera as its record stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    pub model: Model,
    pub size: (u64, u64),
    pub parameters: Vec<f64>,
    /// For messages.
    pub place: String,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    pub id: i64,
    /// w, x, y, z.
    pub rotation: [f64; 4],
    pub translation: DVec3,
    pub camera: i64,
    pub name: String,
    pub observations: Vec<DVec2>,
    pub place: String,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    pub position: DVec3,
    /// Mean distance of its projections from their observations, in pixels.
    pub error_px: f64,
    /// Image, and number of the observation in it.
    pub track: Vec<(i64, u64)>,
}

/// The camera models by COLMAP's numbers, with their numbers of parameters.
pub const MODELS: [(&str, usize); 18] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
    ("SIMPLE_DIVISION", 4),
    ("DIVISION", 5),
    ("SIMPLE_FISHEYE", 3),
    ("FISHEYE", 4),
    ("EUCM", 6),
    ("EQUIRECTANGULAR", 2),
];

/// An index into [`MODELS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Model(usize);

impl Model {
    fn of_number(number: i64) -> Option<Self> {
        usize::try_from(number).ok().filter(|number| *number < MODELS.len()).map(Self)
    }

    fn of_name(name: &str) -> Option<Self> {
        MODELS.iter().position(|(own, _)| *own == name).map(Self)
    }

    pub fn name(self) -> &'static str {
        MODELS[self.0].0
    }

    fn count(self) -> usize {
        MODELS[self.0].1
    }
}

impl Record {
    /// Lens and distortion, or `None` for a model that is not perspective with OpenCV's terms.
    fn lens(&self) -> Option<(Lens, Distortion)> {
        let p = |index: usize| self.parameters.get(index).copied().unwrap_or(f64::NAN);
        let pixels = |fx, fy, cx, cy| Lens::Pixels {
            focal: DVec2::new(p(fx), p(fy)),
            principal: DVec2::new(p(cx), p(cy)),
        };
        let radial =
            |k1: f64, k2: f64| Distortion { radial: [k1, k2, 0., 0.], ..Default::default() };
        let opencv = || Distortion { tangential: [p(6), p(7)], ..radial(p(4), p(5)) };
        Some(match self.model.name() {
            "SIMPLE_PINHOLE" => (pixels(0, 0, 1, 2), Distortion::default()),
            "PINHOLE" => (pixels(0, 1, 2, 3), Distortion::default()),
            "SIMPLE_RADIAL" => (pixels(0, 0, 1, 2), radial(p(3), 0.0)),
            "RADIAL" => (pixels(0, 0, 1, 2), radial(p(3), p(4))),
            "OPENCV" => (pixels(0, 1, 2, 3), opencv()),
            "FULL_OPENCV" => {
                let radial = [p(4), p(5), p(8), 0.0];
                let denominator = [p(9), p(10), p(11)];
                (pixels(0, 1, 2, 3), Distortion { radial, denominator, ..opencv() })
            }
            _ => return None,
        })
    }
}

/// A model.
#[derive(Clone, Debug, Default)]
pub struct Reconstruction {
    pub cameras: BTreeMap<i64, Record>,
    pub images: Vec<Image>,
    pub points: Vec<Point>,
    pub warnings: Vec<String>,
}

/// Whether a folder holds a model.
pub fn is_model(folder: &Path) -> bool {
    ["bin", "txt"].iter().any(|kind| {
        folder.join(format!("cameras.{kind}")).is_file()
            && folder.join(format!("images.{kind}")).is_file()
    })
}

/// Reads the model in a folder. Points are only needed to check the cameras, so that trouble with
/// them is a warning.
pub fn read(folder: &Path) -> Result<Reconstruction, Error> {
    let find = |stem: &str| -> Option<PathBuf> {
        // As COLMAP does: binary before text.
        ["bin", "txt"]
            .iter()
            .map(|kind| folder.join(format!("{stem}.{kind}")))
            .find(|path| path.is_file())
    };
    let need = |stem: &str| {
        find(stem).ok_or_else(|| {
            Error::Missing(Fault::new(
                folder,
                "",
                format!("there is neither {stem}.bin nor {stem}.txt"),
                "A COLMAP model is a folder with cameras, images and points3D (sparse/0)",
            ))
        })
    };
    let (camera_file, image_file) = (need("cameras")?, need("images")?);
    let is_binary = |file: &Path| file.extension().is_some_and(|own| own == "bin");
    let bytes = read_bounded(&camera_file, LARGEST)?;
    let cameras = if is_binary(&camera_file) { binary::cameras } else { text::cameras };
    let cameras = cameras(&camera_file, &bytes)?;
    let bytes = read_bounded(&image_file, LARGEST)?;
    let images = if is_binary(&image_file) { binary::images } else { text::images };
    let images = images(&image_file, &bytes)?;
    let mut warnings = Vec::new();
    let points = match find("points3D") {
        None => Ok(Vec::new()),
        Some(file) => read_bounded(&file, LARGEST).and_then(|bytes| {
            let points = if is_binary(&file) { binary::points } else { text::points };
            points(&file, &bytes)
        }),
    };
    let points = points.unwrap_or_else(|error| {
        warnings
            .push(format!("{error} The cameras are used; they cannot be checked by the points."));
        Vec::new()
    });
    Ok(Reconstruction { cameras, images, points, warnings })
}

/// The cameras of a model's images.
pub fn views(file: &Path, model: &Reconstruction) -> Result<Parsed, Error> {
    let mut parsed = Parsed::default();
    let (mut dangling, mut foreign) = (Vec::new(), Vec::new());
    let mut first_foreign = None;
    for image in &model.images {
        let place = format!("{} ({})", image.place, image.name);
        let Some(record) = model.cameras.get(&image.camera) else {
            dangling.push(format!("{place}, camera {}", image.camera));
            continue;
        };
        let Some((lens, distortion)) = record.lens() else {
            first_foreign.get_or_insert(record.model.name());
            foreign.push(format!("{place}, {}", record.model.name()));
            continue;
        };
        let Some(rotation) = rotation(image.rotation) else {
            return Err(Error::Invalid(Fault::new(
                file,
                place,
                "the quaternion of the pose is no rotation",
                "Export the model again",
            )));
        };
        let (world_from_camera, position) = from_vision(rotation, image.translation);
        let side = |side: u64| usize::try_from(side).unwrap_or(usize::MAX);
        parsed.views.push(View {
            name: image.name.clone(),
            undistorted: None,
            place,
            size: Some((side(record.size.0), side(record.size.1))),
            lens,
            distortion,
            world_from_camera,
            position,
        });
    }
    if let (true, Some(name)) = (parsed.views.is_empty(), first_foreign) {
        return Err(Error::Unsupported(Fault::new(
            file,
            foreign.swap_remove(0),
            format!("the lens model {name} is not supported"),
            "Undistort the images to PINHOLE (colmap image_undistorter) and import that model",
        )));
    }
    if parsed.views.is_empty() {
        return Err(Error::Invalid(Fault::new(
            file,
            dangling.first().cloned().unwrap_or_default(),
            "the model has no image with a camera",
            "Export the model again, with cameras and images of the same reconstruction",
        )));
    }
    let no_camera = "the model has no such camera; the image is left out.";
    let no_lens = "this lens model is not supported; the image is left out. Undistort the images \
                   (colmap image_undistorter) to use it.";
    parsed.warnings.extend(gathered(file, &dangling, no_camera));
    parsed.warnings.extend(gathered(file, &foreign, no_lens));
    Ok(parsed)
}

fn rotation([w, x, y, z]: [f64; 4]) -> Option<DMat3> {
    let quaternion = DQuat::from_xyzw(x, y, z, w);
    let length = quaternion.length();
    (length.is_finite() && length > 1e-6).then(|| DMat3::from_quat(quaternion * (1.0 / length)))
}
