//! Writes edits.

use std::path::Path;

use glam::Vec3;
use serde_json::{Map, Value, json};

use crate::io::paths::{absolute, relative};
use crate::io::{Error, atomic};
use crate::math::rgb::Rgb;
use crate::render::edits::{AddedLight, Edits, Object, Override, Shape, Surroundings};
use crate::scene::Emitter;

/// Writes edits, whole or not at all; files that they name are named relative to its folder.
pub fn write(file: &Path, edits: &Edits) -> Result<(), Error> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut text = serde_json::to_string_pretty(&value(edits, folder))
        .map_err(|error| Error::Write { file: file.to_owned(), source: error.into() })?;
    text.push('\n');
    atomic::write_bytes(file, text.as_bytes())
}

/// What a file in `folder` would hold; what is as it was is left out.
pub fn value(edits: &Edits, folder: &Path) -> Value {
    let folder = absolute(folder);
    let unchanged = Edits::default();
    let mut members = Map::new();
    let mut put = |key: &str, value: Value| {
        members.insert(key.to_owned(), value);
    };
    if edits.original_light != unchanged.original_light {
        put("original_light", json!(edits.original_light));
    }
    if !edits.groups.is_empty() {
        put("original_light_groups", json!(edits.groups));
    }
    if !edits.lights.is_empty() {
        put("lights", edits.lights.iter().map(|added| light(added, &folder)).collect());
    }
    if !edits.objects.is_empty() {
        put("objects", edits.objects.iter().map(|added| object(added, &folder)).collect());
    }
    if !edits.materials.is_empty() {
        let materials = edits.materials.iter().map(|(name, other)| (name.clone(), material(other)));
        put("materials", Value::Object(materials.collect()));
    }
    match edits.surroundings {
        Surroundings::Auto => {}
        Surroundings::Open => put("surroundings_albedo", Value::Null),
        Surroundings::Albedo(albedo) => put("surroundings_albedo", json!(albedo)),
    }
    Value::Object(members)
}

fn light(light: &AddedLight, folder: &Path) -> Value {
    let name = &light.name;
    let emitter = match &light.shape {
        Shape::Emitter(emitter) => emitter,
        Shape::Dome(dome) => {
            let image = relative(folder, &absolute(&dome.file));
            let [scale, ..] = light.emission;
            // Its colour is the image's: one factor is all that there is.
            let scale = scale * short(dome.scale);
            let mut value = json!({ "name": name, "kind": "dome", "image": image, "scale": scale });
            if dome.turn != 0.0 {
                value["turn"] = json!(short(dome.turn));
            }
            return with_switch(value, light.is_on);
        }
    };
    let mut value = emitter_value(emitter);
    value["name"] = json!(name);
    value[emitter.quantity()] = json!(light.emission);
    with_switch(value, light.is_on)
}

/// The kind and the numbers of a light's shape.
pub(in crate::io) fn emitter_value(emitter: &Emitter) -> Value {
    let mut value = match *emitter {
        Emitter::Rectangle { corners, normal } => {
            json!({ "corners": corners.map(vector), "normal": vector(normal) })
        }
        Emitter::Sphere { center, radius_m } => {
            json!({ "center": vector(center), "radius_m": short(radius_m) })
        }
        Emitter::Point { position } => json!({ "position": vector(position) }),
        Emitter::Spot { position, direction, inner_angle, outer_angle } => json!({
            "position": vector(position),
            "direction": vector(direction),
            "inner_angle": short(inner_angle),
            "outer_angle": short(outer_angle),
        }),
        Emitter::Sun { direction, angular_diameter } => json!({
            "direction": vector(direction), "angular_diameter": short(angular_diameter),
        }),
    };
    value["kind"] = json!(emitter.kind());
    value
}

/// A light that is on says nothing of it.
fn with_switch(mut light: Value, is_on: bool) -> Value {
    if !is_on {
        light["on"] = json!(false);
    }
    light
}

fn object(object: &Object, folder: &Path) -> Value {
    let rows = glam::DMat4::from(object.world_from_object).transpose().to_cols_array_2d();
    let materials = object.surfaces.iter().map(|(name, reflectance)| {
        let other = Override {
            diffuse: Some(reflectance.diffuse),
            specular: Some(reflectance.specular),
            exponent: Some(reflectance.exponent),
        };
        (name.clone(), material(&other))
    });
    json!({
        "name": object.name,
        "mesh": relative(folder, &absolute(&object.file)),
        "world_from_object": rows,
        "materials": Value::Object(materials.collect()),
    })
}

fn material(material: &Override) -> Value {
    let mut members = Map::new();
    let colours: [(&str, Option<Rgb>); 2] =
        [("diffuse", material.diffuse), ("specular", material.specular)];
    for (key, colour) in colours {
        members.extend(colour.map(|colour| (key.to_owned(), json!(colour))));
    }
    members.extend(material.exponent.map(|exponent| ("exponent".to_owned(), json!(exponent))));
    Value::Object(members)
}

fn vector(vector: Vec3) -> [f64; 3] {
    vector.to_array().map(short)
}

/// The number of fewest digits that single precision does not tell from it.
pub(in crate::io) fn short(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}
