//! The result of an engine in `model.json`: a pose for each photograph, and one line for each
//! point.

use std::fmt::Write as _;

use glam::{DMat3, DQuat, DVec2, DVec3};
use serde_json::{Value, json};

use crate::io::Error;
use crate::io::json::Field;
use crate::model::{FoundPoint, FoundPose, Pose};

/// `found` of a photograph.
pub(super) fn pose(item: &Field) -> Result<Option<FoundPose>, Error> {
    let Some(field) = item.get("found") else { return Ok(None) };
    let [w, x, y, z] = field.need("rotation")?.numbers::<4>()?;
    let rotation = DQuat::from_xyzw(x, y, z, w);
    let length = rotation.length();
    if !(length.is_finite() && length > 1e-6) {
        let problem = "this is no rotation: a quaternion w, x, y, z of length 1 is due";
        return Err(field.need("rotation")?.wrong(problem));
    }
    let distance = field.need("distance")?.number()?;
    if distance <= 0.0 {
        return Err(field.need("distance")?.wrong("this must be more than 0"));
    }
    let world_from_camera = DMat3::from_quat(rotation * (1.0 / length));
    let position = DVec3::from(field.need("position")?.numbers::<3>()?);
    Ok(Some(FoundPose { pose: Pose { world_from_camera, position }, distance }))
}

/// `found_points`: position, then the photographs that show it, each with the pixel where that is
/// known: `2@312.5,220.25`.
pub(super) fn points(items: Vec<Field>, photographs: usize) -> Result<Vec<FoundPoint>, Error> {
    let point = |item: Field| {
        let wrong = || {
            item.wrong_with(
                "this is no point: \"x y z\" and the numbers of photographs are due, all or none \
                 with \"@x,y\" in pixels",
                "Correct it, or leave found_points out: cameras and things stand without them",
            )
        };
        let mut words = item.text()?.split_whitespace();
        let mut number = || words.next()?.parse::<f64>().ok().filter(|own| own.is_finite());
        let position = number().zip(number()).zip(number()).ok_or_else(wrong)?;
        let ((x, y), z) = position;
        let shown = words.map(|word| seen(word).filter(|own| own.0 < photographs));
        let shown = shown.collect::<Option<Vec<_>>>().ok_or_else(wrong)?;
        let pixels: Vec<DVec2> = shown.iter().filter_map(|own| own.1).collect();
        if !pixels.is_empty() && pixels.len() < shown.len() {
            return Err(wrong());
        }
        let photographs = shown.into_iter().map(|own| own.0).collect();
        Ok(FoundPoint { position: DVec3::new(x, y, z), photographs, pixels })
    };
    items.into_iter().map(point).collect()
}

/// A photograph, and where it shows the point.
fn seen(word: &str) -> Option<(usize, Option<DVec2>)> {
    let Some((photograph, pixel)) = word.split_once('@') else {
        return Some((word.parse().ok()?, None));
    };
    let (x, y) = pixel.split_once(',')?;
    let pixel = DVec2::new(x.parse().ok()?, y.parse().ok()?);
    Some((photograph.parse().ok()?, Some(pixel).filter(|own| own.is_finite())))
}

/// As [`pose`] reads it.
pub(super) fn pose_value(own: &FoundPose) -> Value {
    let rotation = DQuat::from_mat3(&own.pose.world_from_camera).normalize();
    json!({
        "rotation": [rotation.w, rotation.x, rotation.y, rotation.z],
        "position": own.pose.position.to_array(),
        "distance": own.distance,
    })
}

/// As [`points`] reads it: text, so that a point is one line of the file.
pub(super) fn point_value(own: &FoundPoint) -> Value {
    let DVec3 { x, y, z } = own.position;
    let mut text = format!("{x} {y} {z} ");
    for (place, index) in own.photographs.iter().enumerate() {
        let _ = write!(text, " {index}");
        if let Some(pixel) = own.pixels.get(place) {
            let _ = write!(text, "@{},{}", pixel.x, pixel.y);
        }
    }
    Value::String(text)
}
