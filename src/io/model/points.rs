//! `points.json` of a capture: the points of the program that has found its cameras, in their
//! coordinates.
//!
//! ```text
//! { "format": "lobelia-points", "version": 1,
//!   "photographs": ["images/a.jpg", "images/b.jpg"],
//!   "points": ["x y z  0@12.5,80 1@40,71.25"] }
//! ```
//!
//! Lines are those of `found_points` in `model.json`, with photographs by their number in the list.

use std::path::Path;

use serde_json::json;

use super::found;
use crate::io::json::{self, Field};
use crate::io::{Error, atomic};
use crate::model::FoundPoint;

/// The file's name in a capture.
pub const POINTS: &str = "points.json";
const FORMAT: &str = "lobelia-points";

/// Writes points; the photographs are those of the camera file.
pub fn write_points(
    file: &Path,
    photographs: &[String],
    points: &[FoundPoint],
) -> Result<(), Error> {
    let value = json!({
        "format": FORMAT,
        "version": 1,
        "photographs": photographs,
        "points": points.iter().map(found::point_value).collect::<Vec<_>>(),
    });
    atomic::write_bytes(file, format!("{value:#}\n").as_bytes())
}

/// Reads points of which the photographs are numbered as in a list of names; what others show is
/// left out.
pub fn read_points(file: &Path, photographs: &[&str]) -> Result<Vec<FoundPoint>, Error> {
    let value = json::read(file)?;
    let root = Field::root(file, &value)?;
    let format = root.need("format")?;
    if format.text()? != FORMAT {
        return Err(format.wrong(&format!("these are no points: it must be \"{FORMAT}\"")));
    }
    let mut numbers = Vec::new();
    for name in root.need("photographs")?.items()? {
        let name = name.text()?;
        numbers.push(photographs.iter().position(|own| *own == name));
    }
    let mut points = found::points(root.need("points")?.items()?, numbers.len())?;
    for point in &mut points {
        let old = std::mem::take(&mut point.photographs);
        let is_known = |place: &usize| numbers[old[*place]].is_some();
        let places: Vec<usize> = (0..old.len()).filter(is_known).collect();
        point.photographs = places.iter().filter_map(|&place| numbers[old[place]]).collect();
        if !point.pixels.is_empty() {
            point.pixels = places.iter().map(|&place| point.pixels[place]).collect();
        }
    }
    points.retain(|own| !own.photographs.is_empty());
    Ok(points)
}
