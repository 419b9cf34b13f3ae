//! `transforms.json`: cameras in the convention of NeRF, instant-ngp and nerfstudio.
//!
//! Fields may stand at the top or in a frame, where they win. Unknown fields are ignored.

mod frames;
mod srgb;

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec2, DVec3};

use self::frames::{Problems, Reader};
use super::json::{self, Field};
use super::orientation::Orientation;
use super::{Error, Fault, inside, single};
use crate::exposures::Response;
pub use crate::exposures::Vignetting;
use crate::scene::Camera;

pub use srgb::take_as_srgb;

/// What a `file_path` without extension may mean, in the order in which it is tried.
const EXTENSIONS: [&str; 5] = ["exr", "hdr", "png", "jpg", "jpeg"];

/// Whether the images must be there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Images {
    /// A capture: a frame without its image is skipped, with a warning.
    Needed,
    /// Cameras to render from: only names and, where `w` and `h` are missing, sizes are of use.
    Optional,
    /// An import: a frame without its image is kept if its size is known, and else skipped.
    Wanted,
}

/// Finds the image that a `file_path` means.
pub(super) type Finder<'a> = &'a dyn Fn(&str) -> Option<PathBuf>;

/// A camera file.
#[derive(Clone, Debug)]
pub struct Cameras {
    pub frames: Vec<Frame>,
    pub vignetting: Option<Vignetting>,
    /// By which JPEG, PNG and TIFF are radiance, exposure series and single ones.
    pub response: Option<Response>,
    pub warnings: Vec<String>,
    /// What nerfstudio's `applied_transform` and `applied_scale` say has been done to the
    /// coordinates: they were multiplied by the matrix, moved, and then scaled.
    pub applied: Option<Applied>,
}

/// new = scale (linear old + offset).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Applied {
    pub linear: DMat3,
    pub offset: DVec3,
    pub scale: f64,
}

#[derive(Clone, Debug)]
pub struct Frame {
    /// `file_path` as written.
    pub name: String,
    /// The place in the file, as `frames[3] (images/003.exr)`.
    pub place: String,
    pub camera: Camera,
    /// The image, where there is one.
    pub image: Option<PathBuf>,
    /// How its pixels are turned before they are those of the camera.
    pub orientation: Orientation,
    /// The file does not say that the image is for geometry only.
    pub is_measurement: bool,
    /// The file says that the image is for geometry only.
    pub is_geometry: bool,
    /// An exposure series that stands in place of an image of radiance.
    pub brackets: Vec<Bracket>,
    /// The picture that says which pixels are left out: `mask_path`, or the one that is found by
    /// its name ([`super::masks::beside`]).
    pub mask: Option<PathBuf>,
}

/// One exposure of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Bracket {
    pub file: PathBuf,
    /// `None` where only the file itself may say it.
    pub exposure_secs: Option<f64>,
}

impl Vignetting {
    /// The factor by which a pixel position is darkened.
    pub fn factor(&self, camera: &Camera, pixel: DVec2) -> f64 {
        let half_diagonal = 0.5 * (camera.width as f64).hypot(camera.height as f64);
        let r2 = (pixel - camera.principal_px).length_squared() / (half_diagonal * half_diagonal);
        self.falloff(r2)
    }
}

/// Reads a camera file; images are looked for beside it.
pub fn read(file: &Path, images: Images) -> Result<Cameras, Error> {
    let folder = file.parent().unwrap_or(Path::new(""));
    interpret(file, &json::read(file)?, images, &|name| find_below(folder, name))
}

/// Reads the bytes of a camera file whose images are elsewhere; `file` is for messages.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Cameras, Error> {
    interpret(file, &json::parse_bytes(file, bytes)?, Images::Wanted, &|_| None)
}

/// The image below `folder` that a `file_path` means, with or without its extension.
pub(super) fn find_below(folder: &Path, name: &str) -> Option<PathBuf> {
    let path = inside::join(folder, name)?;
    if path.is_file() {
        return Some(path);
    }
    // "img.001" has a dot but no extension of an image, so append rather than replace.
    let with = |extension: &&str| {
        let mut longer = path.as_os_str().to_owned();
        longer.push(".");
        longer.push(extension);
        PathBuf::from(longer)
    };
    EXTENSIONS.iter().map(with).find(|path| path.is_file())
}

/// Reads the value of a camera file.
pub(super) fn interpret(
    file: &Path,
    value: &serde_json::Value,
    images: Images,
    find: Finder,
) -> Result<Cameras, Error> {
    let root = Field::root(file, value)?;
    let items = match root.get("frames") {
        Some(frames) => frames.items()?,
        None => Vec::new(),
    };
    if items.is_empty() {
        return Err(Error::Invalid(Fault::new(
            file,
            "frames",
            "there is no camera in the file",
            "Export the cameras again; every photograph needs an entry in \"frames\"",
        )));
    }
    let mut reader = Reader { file, root: &root, images, find, problems: Problems::default() };
    let mut frames = Vec::with_capacity(items.len());
    for item in &items {
        frames.extend(reader.frame(item)?);
    }
    if frames.is_empty() {
        let problems = &reader.problems;
        if !items.is_empty() && problems.unplaced.len() == items.len() {
            return Err(Error::Missing(Fault::new(
                file,
                "frames",
                "no photograph has a camera yet",
                "Draw on the photographs, and place their cameras with lobelia model",
            )));
        }
        let places = problems.missing.iter().chain(&problems.outside).chain(&problems.sizeless);
        let first = places.map(String::as_str).next().unwrap_or("");
        return Err(Error::Missing(Fault::new(
            file,
            "frames",
            format!("none of the {} images it names exists (first: \"{first}\")", items.len()),
            "Put the images where file_path says, relative to this file, or correct file_path",
        )));
    }
    let warnings = reader.problems.warnings(file, &frames);
    // Cameras alone need no response, and their folder may lack its table.
    let response = root.get("response").filter(|_| images == Images::Needed);
    Ok(Cameras {
        vignetting: vignetting(&root)?,
        response: response.map(|field| single::read_response(&field)).transpose()?,
        applied: applied(&root)?,
        frames,
        warnings,
    })
}

fn applied(root: &Field) -> Result<Option<Applied>, Error> {
    let (linear, offset) = match root.get("applied_transform") {
        None => (DMat3::IDENTITY, DVec3::ZERO),
        Some(field) => {
            let rows = field.items()?;
            if !(3..=4).contains(&rows.len()) {
                return Err(field.wrong("the matrix must have 3 rows of 4 numbers"));
            }
            let mut columns = [[0.0; 3]; 4];
            for (row, field) in rows.iter().take(3).enumerate() {
                for (column, number) in field.numbers::<4>()?.into_iter().enumerate() {
                    columns[column][row] = number;
                }
            }
            let [x, y, z, offset] = columns;
            (DMat3::from_cols_array_2d(&[x, y, z]), DVec3::from(offset))
        }
    };
    let scale = match root.get("applied_scale") {
        None => 1.0,
        Some(field) => match field.number()? {
            scale if scale > 0.0 => scale,
            _ => return Err(field.wrong("a scale must be positive")),
        },
    };
    let applied = Applied { linear, offset, scale };
    let nothing = Applied { linear: DMat3::IDENTITY, offset: DVec3::ZERO, scale: 1.0 };
    Ok((applied != nothing).then_some(applied))
}

fn vignetting(root: &Field) -> Result<Option<Vignetting>, Error> {
    let Some(field) = root.get("vignetting") else { return Ok(None) };
    let coefficient = |key| field.get(key).map_or(Ok(0.0), |field| field.number());
    let vignetting = Vignetting { a: coefficient("a")?, b: coefficient("b")? };
    Ok((vignetting != Vignetting { a: 0.0, b: 0.0 }).then_some(vignetting))
}
