//! AliceVision's `cameras.sfm`, which Meshroom writes: JSON whose numbers are text.
//!
//! From AliceVision's source: the pose's `rotation` is world to camera in the axes of computer
//! vision, its entries by column (`sfmDataIO/jsonIO.cpp` fills Eigen's matrices in their storage
//! order), and `center` the position. `principalPoint` is an offset from half the image size
//! since version 1.2.1 (`camera/IntrinsicScaleOffset.cpp`), in coordinates in which whole numbers
//! are the centres of pixels (`camera/cameraUndistortImage.hpp` samples there), hence the half
//! pixel added. Brown's `t1`, `t2` are OpenCV's `p1`, `p2` (`camera/DistortionBrown.cpp`).

use std::collections::HashMap;
use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use serde_json::Value;

use super::format::{Format, Sign};
use super::{Lens, Parsed, View, gathered, vision_to_graphics};
use crate::io::json::{self, Field};
use crate::io::{Error, Fault};
use crate::scene::Distortion;

pub(super) const FORMAT: Format = Format {
    name: "AliceVision (Meshroom)",
    signs: &[Sign::End("sfm"), Sign::Json(is_it)],
    parse: |file, bytes, _| parse(file, bytes),
};

/// Whether a JSON value looks like such a file.
fn is_it(value: &Value) -> bool {
    value.get("views").is_some() && value.get("intrinsics").is_some()
}

/// Reads the bytes of a file; `file` is for messages.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Parsed, Error> {
    interpret(file, &json::parse_bytes(file, bytes)?)
}

struct Intrinsic {
    lens: Lens,
    distortion: Distortion,
}

pub(super) fn interpret(file: &Path, value: &Value) -> Result<Parsed, Error> {
    let root = Field::root(file, value)?;
    let mut version = [1.0, 0.0, 0.0];
    if let Some(field) = root.get("version") {
        for (part, field) in version.iter_mut().zip(field.items()?) {
            *part = numeric(&field)?;
        }
    }
    let list = |key: &str| root.get(key).map_or(Ok(Vec::new()), |field| field.items());
    let (mut intrinsics, mut foreign) = (HashMap::new(), HashMap::new());
    for item in list("intrinsics")? {
        let id = identity(&item.need("intrinsicId")?)?;
        match intrinsic(&item, version)? {
            Ok(own) => drop(intrinsics.insert(id, own)),
            Err(model) => drop(foreign.insert(id, (model, item.path.clone()))),
        }
    }
    let mut poses = HashMap::new();
    for item in list("poses")? {
        let transform = item.need("pose")?.need("transform")?;
        let rotation = DMat3::from_cols_array(&numerics::<9>(&transform.need("rotation")?)?);
        let center = DVec3::from(numerics::<3>(&transform.need("center")?)?);
        poses.insert(identity(&item.need("poseId")?)?, (rotation, center));
    }
    let mut parsed = Parsed::default();
    let (mut unposed, mut skipped, mut rigs) = (Vec::new(), Vec::new(), Vec::new());
    let views = list("views")?;
    for item in &views {
        let name = item.need("path")?.text()?.to_owned();
        let id = identity(&item.need("viewId")?)?;
        let place = format!("{} ({})", item.path, if name.is_empty() { &id } else { &name });
        // 4294967295 stands for none.
        let rig = item.get("rigId").map(|field| identity(&field)).transpose()?;
        if rig.is_some_and(|rig| rig != "4294967295") {
            rigs.push(place);
            continue;
        }
        let pose = item.get("poseId").map_or(Ok(id.clone()), |field| identity(&field))?;
        let key = item.get("intrinsicId").map(|field| identity(&field)).transpose()?;
        let own = key.as_ref().and_then(|key| intrinsics.get(key));
        let (Some(&(rotation, position)), Some(own)) = (poses.get(&pose), own) else {
            match key.and_then(|key| foreign.get(&key)) {
                Some((model, _)) => skipped.push(format!("{place}, {model}")),
                None => unposed.push(place),
            }
            continue;
        };
        let side = |key| item.need(key).and_then(|field| numeric(&field)).map(|side| side as usize);
        parsed.views.push(View {
            name: if name.is_empty() { id.clone() } else { name },
            undistorted: Some(id),
            place,
            size: Some((side("width")?, side("height")?)),
            lens: own.lens,
            distortion: own.distortion,
            world_from_camera: vision_to_graphics(rotation.transpose()),
            position,
        });
    }
    if parsed.views.is_empty() {
        return Err(none_placed(file, &views, &foreign));
    }
    let no_pose = "Meshroom found no camera for this photograph, or no lens; it is left out.";
    let no_lens = "this lens model is not supported; the photograph is left out.";
    let no_rig = "cameras of rigs are not read; the photograph is left out.";
    parsed.warnings.extend(gathered(file, &unposed, no_pose));
    parsed.warnings.extend(gathered(file, &skipped, no_lens));
    parsed.warnings.extend(gathered(file, &rigs, no_rig));
    Ok(parsed)
}

fn none_placed(file: &Path, views: &[Field], foreign: &HashMap<String, (String, String)>) -> Error {
    if let Some((model, place)) = foreign.values().next() {
        return Error::Unsupported(Fault::new(
            file,
            place.clone(),
            format!("the lens model {model} is not supported"),
            "Undistort the images (Meshroom's PrepareDenseScene or ExportUndistorted…) and import \
             cameras without distortion",
        ));
    }
    Error::Invalid(Fault::new(
        file,
        "poses",
        format!("none of the {} photographs has a camera position", views.len()),
        "Take the cameras.sfm of the StructureFromMotion node, not of an earlier one",
    ))
}

/// The lens, or the name of a model that is not supported.
fn intrinsic(item: &Field, version: [f64; 3]) -> Result<Result<Intrinsic, String>, Error> {
    let is_before = |minor: f64, micro: f64| (version[1], version[2]) < (minor, micro);
    let text = |key: &str| item.get(key).map_or(Ok(""), |field| field.text());
    // Since 1.2.6 the kind of distortion stands apart from the kind of camera.
    let (kind, undoing) = (text("type")?, text("undistortionType")?);
    let model = match text("distortionType")? {
        "" => kind,
        _ if !["pinhole", "radial1", "radial3", "brown"].contains(&kind) => kind,
        distortion => distortion,
    };
    if !["", "none"].contains(&undoing) {
        return Ok(Err(undoing.to_owned()));
    }
    let (width, height) = (numeric(&item.need("width")?)?, numeric(&item.need("height")?)?);
    let mut parameters = [0.0; 8];
    if let Some(Value::Array(_)) = item.get("distortionParams").map(|field| field.value) {
        let fields = item.need("distortionParams")?.items()?;
        for (parameter, field) in parameters.iter_mut().zip(&fields) {
            *parameter = numeric(field)?;
        }
    }
    let mut scale = 1.0;
    let [k1, k2, k3, t1, t2, ..] = parameters;
    let distortion = match model {
        "pinhole" | "none" => Distortion::default(),
        "radial1" | "radialk1" => Distortion { radial: [k1, 0., 0., 0.], ..Default::default() },
        "radial3" | "radialk3" => Distortion { radial: [k1, k2, k3, 0.], ..Default::default() },
        "radialk3pt" => {
            // The same, divided by its value at radius 1.
            scale = 1.0 / (1.0 + k1 + k2 + k3);
            Distortion { radial: [k1, k2, k3, 0.], ..Default::default() }
        }
        "brown" => {
            Distortion { radial: [k1, k2, k3, 0.], tangential: [t1, t2], ..Default::default() }
        }
        other => return Ok(Err(other.to_owned())),
    };
    let focal = if is_before(2.0, 0.0) {
        let field = item.need("pxFocalLength")?;
        DVec2::splat(numeric(&field)?)
    } else if is_before(2.0, 2.0) {
        DVec2::from(numerics::<2>(&item.need("pxFocalLength")?)?)
    } else {
        let length = numeric(&item.need("focalLength")?)?;
        let sensor = numeric(&item.need("sensorWidth")?)?;
        let ratio = item.get("pixelRatio").map_or(Ok(1.0), |field| numeric(&field))?;
        let x = length / sensor * width;
        // The ratio was that of the focal lengths before 1.2.5, and of the pixels since.
        DVec2::new(x, if is_before(2.0, 5.0) { x / ratio } else { x * ratio })
    };
    let mut principal = DVec2::from(numerics::<2>(&item.need("principalPoint")?)?);
    if !is_before(2.0, 1.0) {
        principal += 0.5 * DVec2::new(width, height);
    }
    let lens = Lens::Pixels { focal: focal * scale, principal: principal + 0.5 };
    Ok(Ok(Intrinsic { lens, distortion }))
}

/// A number, also one in quotes.
fn numeric(field: &Field) -> Result<f64, Error> {
    let Some(text) = field.value.as_str() else { return field.number() };
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(field.wrong("this must be a finite number")),
    }
}

fn numerics<const N: usize>(field: &Field) -> Result<[f64; N], Error> {
    let items = field.items()?;
    if items.len() != N {
        return Err(field.wrong(&format!("{N} numbers are due here, not {}", items.len())));
    }
    let mut numbers = [0.0; N];
    for (number, item) in numbers.iter_mut().zip(&items) {
        *number = numeric(item)?;
    }
    Ok(numbers)
}

/// An id, in quotes or not.
fn identity(field: &Field) -> Result<String, Error> {
    match field.value {
        Value::String(text) => Ok(text.clone()),
        Value::Number(number) => Ok(number.to_string()),
        _ => Err(field.wrong("this must be an id")),
    }
}
