//! Metashape's (PhotoScan's) camera export, XML.
//!
//! Metashape's manual, "Camera models": the centre of the top left pixel is (0.5, 0.5), the
//! principal point (`cx`, `cy`) an offset from half the image size, and the tangential terms are
//! x' = … + P1 (r² + 2x²) + 2 P2 xy: OpenCV's with `p1` and `p2` the other way round. `b1` is
//! fx − fy. A camera's `transform` is camera to chunk in the axes of computer vision, by row; the
//! chunk's or the component's own transform leads to the coordinates of exported meshes.

use std::collections::HashMap;
use std::path::Path;

use glam::{DMat3, DMat4, DVec2, DVec3};
use roxmltree::{Document, Node};

use super::format::{Format, Sign};
use super::{Lens, Parsed, View, gathered, vision_to_graphics};
use crate::io::{Error, Fault};
use crate::scene::Distortion;

/// A skew that moves no pixel by more than this is passed over.
const SKEW_PX: f64 = 0.05;

pub(super) const FORMAT: Format = Format {
    name: "Metashape XML",
    signs: &[Sign::Text("xml", is_it, "no camera export of Metashape")],
    parse: |file, bytes, _| parse(file, bytes),
};

/// Whether a text looks like such a file.
fn is_it(text: &str) -> bool {
    text.contains("<sensor") && text.contains("<camera")
}

/// Reads the bytes of a file; `file` is for messages.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Parsed, Error> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let options = roxmltree::ParsingOptions { nodes_limit: 20_000_000, ..Default::default() };
    let document = Document::parse_with_options(text, options).map_err(|failure| {
        Error::Invalid(Fault::new(
            file,
            "",
            format!("this is not valid XML ({failure})"),
            "Export the cameras again as Agisoft XML",
        ))
    })?;
    let reader = Reader { file, document: &document };
    reader.read()
}

struct Reader<'a> {
    file: &'a Path,
    document: &'a Document<'a>,
}

struct Sensor {
    size: (usize, usize),
    lens: Lens,
    distortion: Distortion,
    skew: bool,
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

impl<'a> Reader<'a> {
    fn read(&self) -> Result<Parsed, Error> {
        let all = |name: &'static str| {
            self.document.descendants().filter(move |node| node.has_tag_name(name))
        };
        let Some(chunk) = all("chunk").next() else {
            return Err(self.wrong(self.document.root(), "there is no <chunk> in the file"));
        };
        let (mut sensors, mut foreign) = (HashMap::new(), HashMap::new());
        for node in all("sensor") {
            let id = node.attribute("id").unwrap_or_default();
            match self.sensor(node)? {
                Some(Ok(sensor)) => drop(sensors.insert(id, sensor)),
                Some(Err(kind)) => drop(foreign.insert(id, kind)),
                None => {}
            }
        }
        let world = child(chunk, "transform").map_or(Ok(DMat4::IDENTITY), |t| self.placement(t))?;
        let mut components = HashMap::new();
        for node in all("component") {
            if let (Some(id), Some(transform)) = (node.attribute("id"), child(node, "transform")) {
                components.insert(id, self.placement(transform)?);
            }
        }
        let mut parsed = Parsed::default();
        let (mut unposed, mut skipped, mut skewed) = (Vec::new(), Vec::new(), Vec::new());
        for node in all("camera") {
            let name = node.attribute("label").unwrap_or_default();
            let place = self.place(node, name);
            let Some(transform) = child(node, "transform") else {
                // Groups of cameras and other lists name cameras without a label.
                if node.attribute("label").is_some() {
                    unposed.push(place);
                }
                continue;
            };
            let key = node.attribute("sensor_id").unwrap_or_default();
            let Some(sensor) = sensors.get(key) else {
                match foreign.get(key) {
                    Some(kind) => skipped.push(format!("{place}, {kind}")),
                    None => unposed.push(place),
                }
                continue;
            };
            if sensor.skew {
                skewed.push(place.clone());
            }
            let own = node.attribute("component_id").and_then(|id| components.get(id));
            let matrix = *own.unwrap_or(&world) * self.matrix(transform)?;
            let linear = DMat3::from_mat4(matrix);
            parsed.views.push(View {
                name: name.to_owned(),
                undistorted: None,
                place,
                size: Some(sensor.size),
                lens: sensor.lens,
                distortion: sensor.distortion,
                world_from_camera: vision_to_graphics(linear),
                position: matrix.w_axis.truncate(),
            });
        }
        if parsed.views.is_empty() {
            return Err(self.none(foreign.values().next()));
        }
        let file = self.file;
        let no_pose = "Metashape has not aligned this photograph, or not its lens; it is left out.";
        let no_lens = "this kind of lens is not supported; the photograph is left out.";
        let skew = "the lens has a skew (b2), which is left out: the picture is off by more than \
                    0.05 pixels. Align again with b2 fixed to 0.";
        parsed.warnings.extend(gathered(file, &unposed, no_pose));
        parsed.warnings.extend(gathered(file, &skipped, no_lens));
        parsed.warnings.extend(gathered(file, &skewed, skew));
        if parsed.views.iter().any(|view| view.position.length() > 1e5) {
            parsed.warnings.push(format!(
                "{}: cameras are more than 100 km from the origin (geocentric coordinates). Export \
                 cameras and mesh in local coordinates.",
                file.display()
            ));
        }
        Ok(parsed)
    }

    fn none(&self, foreign: Option<&String>) -> Error {
        match foreign {
            Some(kind) => Error::Unsupported(Fault::new(
                self.file,
                "sensors",
                format!("the kind of lens \"{kind}\" is not supported"),
                "Export undistorted photographs with their cameras",
            )),
            None => self.wrong(self.document.root(), "no camera in the file is aligned"),
        }
    }

    /// The lens; the kind where it is not supported, and nothing where it was not calibrated.
    fn sensor(&self, node: Node<'a, 'a>) -> Result<Option<Result<Sensor, String>>, Error> {
        let kind = node.attribute("type").unwrap_or("frame");
        let adjusted = |node: &Node| node.attribute("class") == Some("adjusted");
        let calibrations = || node.children().filter(|child| child.has_tag_name("calibration"));
        let Some(calibration) = calibrations().find(adjusted).or_else(|| calibrations().next())
        else {
            return Ok((kind != "frame").then(|| Err(kind.to_owned())));
        };
        if kind != "frame" {
            return Ok(Some(Err(kind.to_owned())));
        }
        let resolution = child(calibration, "resolution").or_else(|| child(node, "resolution"));
        let Some(resolution) = resolution else {
            return Err(self.wrong(node, "the sensor has no <resolution>"));
        };
        let side = |name| -> Result<usize, Error> {
            let side = resolution.attribute(name).and_then(|text| text.trim().parse().ok());
            side.ok_or_else(|| self.wrong(resolution, "width and height must be whole numbers"))
        };
        let size = (side("width")?, side("height")?);
        let term = |name: &str| -> Result<f64, Error> {
            let Some(node) = child(calibration, name) else { return Ok(0.0) };
            Ok(self.numbers::<1>(node)?[0])
        };
        if term("p3")? != 0.0 || term("p4")? != 0.0 {
            return Ok(Some(Err("frame with p3 and p4".to_owned())));
        }
        // Before version 1.3 fx and fy were apart.
        let focal = match child(calibration, "f") {
            Some(_) => DVec2::new(term("f")? + term("b1")?, term("f")?),
            None => DVec2::new(term("fx")?, term("fy")?),
        };
        let half = 0.5 * DVec2::new(size.0 as f64, size.1 as f64);
        let mut principal = DVec2::new(term("cx")?, term("cy")?);
        if child(calibration, "f").is_some() {
            principal += half;
        }
        let skew = term("b2")?.abs() * half.y / focal.y.abs().max(1e-9) > SKEW_PX;
        let distortion = Distortion {
            radial: [term("k1")?, term("k2")?, term("k3")?, term("k4")?],
            tangential: [term("p2")?, term("p1")?],
            ..Default::default()
        };
        Ok(Some(Ok(Sensor { size, lens: Lens::Pixels { focal, principal }, distortion, skew })))
    }

    /// Rotation, translation and scale of a chunk or component.
    fn placement(&self, node: Node<'a, 'a>) -> Result<DMat4, Error> {
        let rotation = match child(node, "rotation") {
            Some(node) => DMat3::from_cols_array(&self.numbers::<9>(node)?).transpose(),
            None => DMat3::IDENTITY,
        };
        let translation = match child(node, "translation") {
            Some(node) => DVec3::from(self.numbers::<3>(node)?),
            None => DVec3::ZERO,
        };
        let scale = child(node, "scale").map_or(Ok([1.0]), |node| self.numbers::<1>(node))?[0];
        let mut matrix = DMat4::from_mat3(rotation * scale);
        matrix.w_axis = translation.extend(1.0);
        Ok(matrix)
    }

    fn matrix(&self, node: Node<'a, 'a>) -> Result<DMat4, Error> {
        Ok(DMat4::from_cols_array(&self.numbers::<16>(node)?).transpose())
    }

    fn numbers<const N: usize>(&self, node: Node<'a, 'a>) -> Result<[f64; N], Error> {
        let text = node.text().unwrap_or_default();
        let mut numbers = [f64::NAN; N];
        let mut words = text.split_whitespace();
        for number in &mut numbers {
            let value = words.next().and_then(|word| word.parse::<f64>().ok());
            *number = value.filter(|value| value.is_finite()).ok_or_else(|| {
                self.wrong(node, &format!("<{}> needs {N} numbers", node.tag_name().name()))
            })?;
        }
        Ok(numbers)
    }

    fn place(&self, node: Node, name: &str) -> String {
        let line = self.document.text_pos_at(node.range().start).row;
        if name.is_empty() { format!("line {line}") } else { format!("line {line} ({name})") }
    }

    fn wrong(&self, node: Node, problem: &str) -> Error {
        let place = self.place(node, "");
        let remedy = "Export the cameras again as Agisoft XML (File, Export, Export Cameras)";
        Error::Invalid(Fault::new(self.file, place, problem, remedy))
    }
}
