//! `transforms.json` of a capture that is begun with photographs alone, and of its solved cameras.

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::io::exif_lens::ExifLens;
use crate::io::json::{self, Field};
use crate::io::orientation::{self, Orientation};
use crate::io::{Error, Fault, atomic};
use crate::model::Model;
use crate::scene::Camera;

/// What `transforms.json` says of a photograph that has no camera yet.
const PLACED: &str = "placed";
/// Fields of a frame, or of the whole file, that a solved camera replaces.
const LENS: [&str; 17] = [
    "camera_model",
    "w",
    "h",
    "fl_x",
    "fl_y",
    "cx",
    "cy",
    "k1",
    "k2",
    "k3",
    "k4",
    "p1",
    "p2",
    "k5",
    "k6",
    "camera_angle_x",
    "camera_angle_y",
];

/// A photograph that has no camera yet.
#[derive(Clone, Debug, PartialEq)]
pub struct Unplaced {
    /// Its path in the capture.
    pub name: String,
    /// Width and height in pixels, turned upright.
    pub size: (usize, usize),
    pub lens: ExifLens,
    /// Its pixels are linear radiance.
    pub is_radiance: bool,
}

/// A camera file of photographs that are not placed: names, sizes, and what EXIF tells.
pub fn begin(photographs: &[Unplaced]) -> String {
    let frame = |own: &Unplaced| {
        let mut frame = Map::new();
        let mut put = |key: &str, value: Value| drop(frame.insert(key.to_owned(), value));
        put("file_path", json!(own.name));
        put("w", json!(own.size.0));
        put("h", json!(own.size.1));
        put(PLACED, json!(false));
        if let Some(focal) = own.lens.focal_px {
            put("fl_x", json!(focal));
            put("fl_y", json!(focal));
        }
        if !own.lens.orientation.is_upright() {
            put("orientation", json!(own.lens.orientation.exif()));
        }
        if !own.is_radiance {
            put("hdr", json!(false));
        }
        Value::Object(frame)
    };
    let value = json!({"frames": photographs.iter().map(frame).collect::<Vec<_>>()});
    format!("{value:#}\n")
}

/// How many photographs a camera file names, and those that have no camera yet.
pub fn unplaced(file: &Path) -> Result<(usize, Vec<String>), Error> {
    let value = json::read(file)?;
    let frames = Field::root(file, &value)?.need("frames")?.items()?;
    let mut names = Vec::new();
    for frame in &frames {
        if !frame.get(PLACED).map_or(Ok(true), |field| field.truth())? {
            names.push(frame.need("file_path")?.text()?.to_owned());
        }
    }
    Ok((frames.len(), names))
}

/// How the camera file of a capture says that a photograph is turned; upright where it does not
/// name it.
pub fn orientation(folder: &Path, name: &str) -> Result<Orientation, Error> {
    let file = folder.join("transforms.json");
    if !file.is_file() {
        return Ok(Orientation::default());
    }
    let value = json::read(&file)?;
    let frames = Field::root(&file, &value)?.get("frames").map(|field| field.items());
    for frame in frames.transpose()?.unwrap_or_default() {
        if frame.get("file_path").is_some_and(|own| own.text().is_ok_and(|own| own == name)) {
            return orientation::of_frame(&frame);
        }
    }
    Ok(Orientation::default())
}

/// Writes the cameras of a model's photographs into a capture's camera file. Frames that are there keep what
/// else they say; photographs that could not be placed keep their place in the file, without a
/// camera.
pub fn write_cameras(file: &Path, model: &Model, cameras: &[Option<Camera>]) -> Result<(), Error> {
    let mut root = match file.exists() {
        true => json::read(file)?,
        false => json!({"frames": []}),
    };
    Field::root(file, &root)?;
    if let Some(frames) = root.get("frames")
        && !frames.is_array()
    {
        let remedy = "Correct that field, or remove the file: it is then written anew";
        let problem = "this must be a list […]";
        return Err(Error::Invalid(Fault::new(file, "frames", problem, remedy)));
    }
    if let Some(top) = root.as_object_mut() {
        // What stood for all frames goes into those that keep it.
        let shared: Map<String, Value> =
            LENS.iter().filter_map(|key| Some(((*key).to_owned(), top.remove(*key)?))).collect();
        let frames = top.entry("frames").or_insert_with(|| json!([]));
        for frame in frames.as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut) {
            for (key, value) in &shared {
                frame.entry(key.clone()).or_insert_with(|| value.clone());
            }
        }
        for (photograph, camera) in model.photographs.iter().zip(cameras) {
            let list = frames.as_array_mut().into_iter().flatten();
            let is_own = |frame: &&mut Value| {
                frame.get("file_path").and_then(Value::as_str) == Some(photograph.name.as_str())
            };
            match list.into_iter().find(is_own).and_then(Value::as_object_mut) {
                Some(frame) => put_camera(frame, camera.as_ref()),
                None => {
                    let mut frame = Map::new();
                    frame.insert("file_path".into(), json!(photograph.name));
                    frame.insert("w".into(), json!(photograph.size.0));
                    frame.insert("h".into(), json!(photograph.size.1));
                    if !shows_radiance(&photograph.name) {
                        frame.insert("hdr".into(), json!(false));
                    }
                    put_camera(&mut frame, camera.as_ref());
                    if let Some(frames) = frames.as_array_mut() {
                        frames.push(Value::Object(frame));
                    }
                }
            }
        }
    }
    atomic::write_bytes(file, format!("{root:#}\n").as_bytes())
}

/// Whether an image's name is that of linear radiance.
fn shows_radiance(name: &str) -> bool {
    let own = Path::new(name).extension().unwrap_or_default().to_ascii_lowercase();
    own == "exr" || own == "hdr"
}

fn put_camera(frame: &mut Map<String, Value>, camera: Option<&Camera>) {
    let Some(camera) = camera else {
        frame.remove("transform_matrix");
        frame.insert(PLACED.into(), json!(false));
        return;
    };
    frame.remove(PLACED);
    LENS.iter().for_each(|key| drop(frame.remove(*key)));
    let mut put = |key: &str, value: Value| drop(frame.insert(key.to_owned(), value));
    let [k1, k2, ..] = camera.distortion.radial;
    put("camera_model", json!(if camera.distortion.is_none() { "PINHOLE" } else { "OPENCV" }));
    put("w", json!(camera.width));
    put("h", json!(camera.height));
    put("fl_x", json!(camera.focal_px.x));
    put("fl_y", json!(camera.focal_px.y));
    put("cx", json!(camera.principal_px.x));
    put("cy", json!(camera.principal_px.y));
    if !camera.distortion.is_none() {
        [("k1", k1), ("k2", k2)].into_iter().for_each(|(key, value)| put(key, json!(value)));
    }
    let row = |row: usize| {
        let axes = camera.world_from_camera.row(row);
        json!([axes.x, axes.y, axes.z, camera.position[row]])
    };
    put("transform_matrix", json!([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]));
}
