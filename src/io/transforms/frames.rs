//! Reads the frames: the image and the camera of each, and warnings.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec2, DVec3};

use super::{Bracket, Finder, Frame, Images};
use crate::io::json::Field;
use crate::io::orientation::{self, Orientation};
use crate::io::pose::{self, NoRotation};
use crate::io::{Error, Fault, inside, masks, picture};
use crate::scene::{Camera, Distortion};

/// Larger sides are no photographs.
const LONGEST_SIDE: f64 = 1e6;

/// What is worth a warning, gathered over all frames so that a thousand frames give one.
#[derive(Default)]
pub(super) struct Problems {
    pub(super) missing: Vec<String>,
    pub(super) missing_exposures: Vec<String>,
    pub(super) outside: Vec<String>,
    pub(super) sizeless: Vec<String>,
    pub(super) unplaced: Vec<String>,
    pub(super) scaled: Vec<String>,
    pub(super) sheared: Vec<String>,
    pub(super) lens_unnamed: Vec<String>,
}

impl Problems {
    pub(super) fn warnings(&self, file: &Path, frames: &[Frame]) -> Vec<String> {
        let file = file.display();
        let mut warnings = Vec::new();
        let mut warn = |places: &[String], what: &str| {
            if let Some(first) = places.first() {
                let more = match places.len() {
                    1 => String::new(),
                    count => format!(" and {} more", count - 1),
                };
                warnings.push(format!("{file}, {first}{more}: {what}"));
            }
        };
        warn(&self.missing, "the image does not exist, so the frame is skipped.");
        warn(
            &self.missing_exposures,
            "the exposure does not exist; its series is merged without it.",
        );
        warn(
            &self.outside,
            "the image lies outside of the folder of this file and is not looked for, so the frame \
             is skipped. Copy it into the folder, and name it relative to this file.",
        );
        warn(&self.sizeless, "neither image nor image size is there, so the frame is skipped.");
        warn(
            &self.unplaced,
            "the photograph has no camera yet, so it is left out. Place it with lobelia model.",
        );
        warn(&self.scaled, "the rotation is scaled; the scale is taken out, the position kept.");
        warn(&self.sheared, "the matrix is not quite a rotation; the nearest one is used.");
        warn(
            &self.lens_unnamed,
            "camera_model says that there is no lens distortion, but k1.. or p1, p2 are given: \
             they are applied.",
        );
        let mut seen: HashMap<&str, usize> = HashMap::new();
        let mut repeated = Vec::new();
        for frame in frames {
            let count = seen.entry(frame.name.trim_start_matches("./")).or_default();
            *count += 1;
            if *count == 2 {
                repeated.push(frame.place.clone());
            }
        }
        warn(
            &repeated,
            "the same image has another frame already: one of the two cameras is wrong.",
        );
        warnings
    }
}

pub(super) struct Reader<'a> {
    pub(super) file: &'a Path,
    pub(super) root: &'a Field<'a>,
    pub(super) images: Images,
    pub(super) find: Finder<'a>,
    pub(super) problems: Problems,
}

impl Reader<'_> {
    /// A frame, or `None` where its image is missing.
    pub(super) fn frame(&mut self, item: &Field) -> Result<Option<Frame>, Error> {
        let series = match item.get("brackets") {
            Some(field) => field.items()?,
            None => Vec::new(),
        };
        let named = match (item.get("file_path"), series.get(series.len() / 2)) {
            (None, Some(bracket)) => bracket.need("file_path")?,
            _ => item.need("file_path")?,
        };
        let name = named.text()?.to_owned();
        // From here on complaints name the image as well.
        let place = format!("{} ({name})", item.path);
        let is_placed = item.get("placed").map_or(Ok(true), |field| field.truth())?;
        if !is_placed {
            self.problems.unplaced.push(place);
            return Ok(None);
        }
        let item = &Field { path: place.clone(), ..item.clone() };
        let brackets = self.brackets(&place, &series)?;
        let image =
            (self.find)(&name).or_else(|| Some(brackets.get(brackets.len() / 2)?.file.clone()));
        if image.is_none() && self.images == Images::Needed {
            let places = if inside::leaves(&name) {
                &mut self.problems.outside
            } else {
                &mut self.problems.missing
            };
            places.push(place);
            return Ok(None);
        }
        let is_geometry = match item.get("use") {
            Some(field) => field.text()? == "geometry",
            None => false,
        };
        let mask = self.mask(item, &name)?;
        let is_hdr = item.get("hdr").map_or(Ok(true), |field| field.truth())?;
        let (world_from_camera, position) = self.pose(item)?;
        let has_size = ["w", "h"].iter().all(|key| self.either(item, key).is_some());
        if self.images == Images::Wanted && image.is_none() && !has_size {
            self.problems.sizeless.push(place);
            return Ok(None);
        }
        let orientation = orientation::of_frame(item)?;
        let (width, height) = self.size(item, image.as_deref(), orientation)?;
        let (focal, principal) = self.intrinsics(item, width, height)?;
        let distortion = self.distortion(item)?;
        let size = (width, height);
        let camera = Camera::new(size, focal, principal, distortion, world_from_camera, position);
        Ok(Some(Frame {
            name,
            place,
            camera,
            image,
            orientation,
            is_measurement: is_hdr && !is_geometry,
            is_geometry,
            brackets,
            mask,
        }))
    }

    /// The exposures of a frame whose files are there.
    fn brackets(&mut self, place: &str, series: &[Field]) -> Result<Vec<Bracket>, Error> {
        let mut brackets = Vec::with_capacity(series.len());
        for field in series {
            let name = field.need("file_path")?.text()?;
            let exposure_secs = match field.get("exposure_time") {
                Some(field) => {
                    let value = field.number()?;
                    if value <= 0.0 {
                        return Err(field.wrong("an exposure time must be positive"));
                    }
                    Some(value)
                }
                None => None,
            };
            match (self.find)(name) {
                Some(file) => brackets.push(Bracket { file, exposure_secs }),
                None => self.problems.missing_exposures.push(format!("{place}, {name}")),
            }
        }
        Ok(brackets)
    }

    /// The frame's mask. One that is named must be there: without it what was to be left out would
    /// be measured.
    fn mask(&self, item: &Field, name: &str) -> Result<Option<PathBuf>, Error> {
        let folder = self.file.parent().unwrap_or(Path::new(""));
        let Some(field) = item.get("mask_path") else { return Ok(masks::beside(folder, name)) };
        let named = field.text()?;
        let mask = inside::join(folder, named).filter(|path| path.is_file());
        if mask.is_none() && self.images == Images::Needed {
            let what = if inside::leaves(named) {
                "the mask lies outside of the folder of this file"
            } else {
                "the mask does not exist"
            };
            return Err(field.wrong_with(
                &format!("{what}: \"{named}\""),
                "Put it where mask_path says, relative to this file, or remove mask_path",
            ));
        }
        Ok(mask)
    }

    /// The field of the frame, or else of the whole file.
    fn either<'b>(&'b self, item: &Field<'b>, key: &str) -> Option<Field<'b>> {
        item.get(key).or_else(|| self.root.get(key))
    }

    fn size(
        &self,
        item: &Field,
        image: Option<&Path>,
        orientation: Orientation,
    ) -> Result<(usize, usize), Error> {
        let side = |key| -> Result<Option<usize>, Error> {
            let Some(field) = self.either(item, key) else { return Ok(None) };
            let value = field.number()?;
            if value.fract() != 0.0 || !(1.0..=LONGEST_SIDE).contains(&value) {
                return Err(field.wrong("this must be a whole number of pixels, 1 or more"));
            }
            Ok(Some(value as usize))
        };
        match (side("w")?, side("h")?, image) {
            (Some(width), Some(height), _) => Ok((width, height)),
            (_, _, Some(image)) => {
                picture::dimensions(image).map(|stored| orientation.size(stored))
            }
            _ => Err(item.wrong_with(
                "the image size is missing",
                "Give w and h, at the top of the file or in every frame",
            )),
        }
    }

    fn intrinsics(
        &self,
        item: &Field,
        width: usize,
        height: usize,
    ) -> Result<(DVec2, DVec2), Error> {
        let (width, height) = (width as f64, height as f64);
        let in_frame = |axis| focal(item, axis, width, height);
        let in_file = |axis| focal(self.root, axis, width, height);
        let (x, y) = match (in_frame(0)?, in_frame(1)?) {
            (Some(x), y) => (x, y.unwrap_or(x)),
            (None, y) => match (in_file(0)?, y.map_or_else(|| in_file(1), |y| Ok(Some(y)))?) {
                (Some(x), y) => (x, y.unwrap_or(x)),
                (None, Some(y)) => (y, y),
                (None, None) => {
                    return Err(item.wrong_with(
                        "the focal length is missing",
                        "Give fl_x or camera_angle_x, at the top of the file or in every frame",
                    ));
                }
            },
        };
        let centre = |key, middle| match self.either(item, key) {
            Some(field) => field.number(),
            None => Ok(middle),
        };
        let principal = DVec2::new(centre("cx", 0.5 * width)?, centre("cy", 0.5 * height)?);
        // Some tools give the centre as a fraction of the image.
        if width > 4.0
            && height > 4.0
            && principal.cmpge(DVec2::ZERO).all()
            && principal.max_element() <= 1.0
        {
            return Err(item.wrong_with(
                "cx and cy are within one pixel of the image's corner",
                "Give them in pixels from the corner, not as fractions of the image",
            ));
        }
        Ok((DVec2::new(x, y), principal))
    }

    fn distortion(&mut self, item: &Field) -> Result<Distortion, Error> {
        let model = match self.either(item, "camera_model") {
            Some(field) => field.text()?.to_uppercase(),
            None => "OPENCV".into(),
        };
        let is_fisheye = match self.either(item, "is_fisheye") {
            Some(field) => field.truth()?,
            None => false,
        };
        let coefficient = |key: &str| match self.either(item, key) {
            Some(field) => field.number(),
            None => Ok(0.0),
        };
        let radial = ["k1", "k2", "k3", "k4"].map(coefficient);
        let [k1, k2, k3, k4] = radial;
        let mut radial = [k1?, k2?, k3?, k4?];
        let tangential = [coefficient("p1")?, coefficient("p2")?];
        let mut denominator = [0.0; 3];
        match model.as_str() {
            _ if is_fisheye => return Err(self.foreign_lens(item, "is_fisheye")),
            "PINHOLE" | "SIMPLE_PINHOLE" => {
                if radial != [0.0; 4] || tangential != [0.0; 2] {
                    self.problems.lens_unnamed.push(item.path.clone());
                }
            }
            "SIMPLE_RADIAL" | "RADIAL" => {
                // COLMAP calls the only coefficient k.
                if self.either(item, "k1").is_none() {
                    radial[0] = coefficient("k")?;
                }
            }
            "OPENCV" | "PERSPECTIVE" | "BROWN" => {}
            // k4 to k6 stand in a denominator there.
            "FULL_OPENCV" => {
                denominator = [radial[3], coefficient("k5")?, coefficient("k6")?];
                radial[3] = 0.0;
            }
            _ => return Err(self.foreign_lens(item, &model)),
        }
        Ok(Distortion { radial, tangential, denominator })
    }

    fn foreign_lens(&self, item: &Field, model: &str) -> Error {
        Error::Unsupported(Fault::new(
            self.file,
            item.path.clone(),
            format!("the lens model {model} is not supported"),
            "Undistort the images to PINHOLE (colmap image_undistorter, or ns-process-data), and \
             export the cameras again",
        ))
    }

    fn pose(&mut self, item: &Field) -> Result<(DMat3, DVec3), Error> {
        let field = item.need("transform_matrix")?;
        let rows = field.items()?;
        if !(3..=4).contains(&rows.len()) {
            return Err(field.wrong("the matrix must have 4 rows of 4 numbers"));
        }
        let mut matrix = [[0.0, 0.0, 0.0, 1.0]; 4];
        for (row, field) in matrix.iter_mut().zip(&rows) {
            *row = field.numbers::<4>()?;
        }
        let [x, y, z, last] = matrix;
        if std::iter::zip(last, [0.0, 0.0, 0.0, 1.0]).any(|(a, b): (f64, f64)| (a - b).abs() > 1e-6)
            && rows.len() == 4
        {
            return Err(field.wrong("the last row of the matrix must be 0 0 0 1"));
        }
        let rotation = DMat3::from_cols_array_2d(&[
            [x[0], y[0], z[0]],
            [x[1], y[1], z[1]],
            [x[2], y[2], z[2]],
        ]);
        let orientation = pose::orientation(rotation).map_err(|failure| match failure {
            NoRotation::Mirrored => field.wrong_with(
                "the matrix mirrors the camera (its determinant is negative)",
                "Export cameras with OpenGL axes: x right, y up, looking along -z",
            ),
            NoRotation::Deformed => field.wrong("the matrix is no rotation"),
        })?;
        if orientation.is_sheared {
            self.problems.sheared.push(item.path.clone());
        }
        if orientation.is_scaled {
            self.problems.scaled.push(item.path.clone());
        }
        Ok((orientation.rotation, DVec3::new(x[3], y[3], z[3])))
    }
}

/// The focal length along an axis that one level of the file gives.
fn focal(level: &Field, axis: usize, width: f64, height: f64) -> Result<Option<f64>, Error> {
    let (length, angle, side) =
        [("fl_x", "camera_angle_x", width), ("fl_y", "camera_angle_y", height)][axis];
    if let Some(field) = level.get(length) {
        let value = field.number()?;
        if value <= 0.0 {
            return Err(field.wrong("a focal length must be positive"));
        }
        return Ok(Some(value));
    }
    let Some(field) = level.get(angle) else { return Ok(None) };
    let value = field.number()?;
    if value <= 0.0 || value >= std::f64::consts::PI {
        return Err(field.wrong("the angle of view must lie between 0 and pi (it is in radians)"));
    }
    Ok(Some(0.5 * side / (0.5 * value).tan()))
}
