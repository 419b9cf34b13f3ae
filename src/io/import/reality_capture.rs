//! RealityCapture's (RealityScan's) CSV of "Internal/External camera parameters".
//!
//! A row an image: `#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2`. Angles are in
//! degrees; the camera's OpenGL axes in the world are Rz(−heading) Rx(pitch) Ry(roll), as
//! nerfstudio's `realitycapture_utils.py` has it. `f` is the focal length of a picture 36 mm
//! long. Image coordinates run from −0.5 to 0.5 along the longer side, from the middle of the
//! image (Capturing Reality, "RealityCapture XMP Camera Math"), whence the principal point
//! `px, py` in that unit, and no half pixel. Distortion is Brown's, with four radial terms;
//! `t1`, `t2` are OpenCV's `p1`, `p2`. Image sizes are not in the file.

use std::collections::HashMap;
use std::path::Path;

use glam::{DMat3, DVec2, DVec3};

use super::format::{Format, Sign};
use super::{Lens, Parsed, View};
use crate::io::{Error, Fault};
use crate::scene::Distortion;

/// Length of the picture that `f` belongs to.
const FILM_MM: f64 = 36.0;

pub(super) const FORMAT: Format = Format {
    name: "RealityCapture CSV",
    signs: &[Sign::Text("csv", is_it, "no RealityCapture CSV (its heading is missing)")],
    parse: |file, bytes, _| parse(file, bytes),
};

/// Whether a text looks like such a file.
fn is_it(text: &str) -> bool {
    let head: String = text.lines().take(5).collect::<Vec<_>>().join("\n").to_lowercase();
    head.contains("name") && head.contains("heading") && head.contains("pitch")
}

/// Reads the bytes of a file; `file` is for messages.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Parsed, Error> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let mut columns: Option<HashMap<String, usize>> = None;
    let mut parsed = Parsed::default();
    for record in reader.byte_records() {
        let record =
            record.map_err(|failure| invalid(file, "", &format!("this is no CSV ({failure})")))?;
        let line = record.position().map_or(0, csv::Position::line);
        let row = Row { file, line, cells: &record };
        let Some(columns) = &columns else {
            let first = row.cell(0).to_lowercase();
            if first.trim_start_matches('#') == "name" {
                columns = Some(heading(&row)?);
            } else if !first.starts_with('#') {
                break;
            }
            continue;
        };
        if row.cell(0).is_empty() || row.cell(0).starts_with('#') {
            continue;
        }
        parsed.views.push(row.view(columns)?);
    }
    if columns.is_none() {
        let problem = "the heading #name,x,y,alt,heading,pitch,roll,f,… is missing";
        return Err(invalid(file, "line 1", problem));
    }
    if parsed.views.is_empty() {
        return Err(invalid(file, "", "there is no camera in the file"));
    }
    Ok(parsed)
}

fn invalid(file: &Path, place: impl Into<String>, problem: &str) -> Error {
    let remedy = "Export the registration as \"Internal/External camera parameters\"";
    Error::Invalid(Fault::new(file, place, problem, remedy))
}

fn heading(row: &Row) -> Result<HashMap<String, usize>, Error> {
    let mut columns = HashMap::new();
    for index in 0..row.cells.len() {
        let name = row.cell(index).to_lowercase();
        let name = match name.trim_start_matches('#') {
            "z" | "altitude" => "alt",
            "yaw" => "heading",
            name => name,
        };
        columns.entry(name.to_owned()).or_insert(index);
    }
    let needed = ["x", "y", "alt", "heading", "pitch", "roll", "f"];
    match needed.iter().find(|name| !columns.contains_key(**name)) {
        Some(missing) => Err(row.wrong(&format!("there is no column \"{missing}\""))),
        None => Ok(columns),
    }
}

struct Row<'a> {
    file: &'a Path,
    line: u64,
    cells: &'a csv::ByteRecord,
}

impl Row<'_> {
    fn cell(&self, index: usize) -> std::borrow::Cow<'_, str> {
        String::from_utf8_lossy(self.cells.get(index).unwrap_or_default())
    }

    fn wrong(&self, problem: &str) -> Error {
        invalid(self.file, format!("line {}", self.line), problem)
    }

    fn view(&self, columns: &HashMap<String, usize>) -> Result<View, Error> {
        let number = |name: &str| -> Result<f64, Error> {
            let Some(&index) = columns.get(name) else { return Ok(0.0) };
            let cell = self.cell(index);
            match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => {
                    let cell: String = cell.chars().take(40).collect();
                    Err(self.wrong(&format!("{name} is \"{cell}\", which is no number")))
                }
            }
        };
        let angle = |name| number(name).map(f64::to_radians);
        let world_from_camera = DMat3::from_rotation_z(-angle("heading")?)
            * DMat3::from_rotation_x(angle("pitch")?)
            * DMat3::from_rotation_y(angle("roll")?);
        let name = self.cell(columns["name"]).into_owned();
        Ok(View {
            place: format!("line {} ({name})", self.line),
            name,
            undistorted: None,
            size: None,
            lens: Lens::Relative {
                focal: DVec2::splat(number("f")? / FILM_MM),
                offset: DVec2::new(number("px")?, number("py")?),
            },
            distortion: Distortion {
                radial: [number("k1")?, number("k2")?, number("k3")?, number("k4")?],
                tangential: [number("t1")?, number("t2")?],
                ..Default::default()
            },
            world_from_camera,
            position: DVec3::new(number("x")?, number("y")?, number("alt")?),
        })
    }
}
