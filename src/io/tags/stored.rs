//! Known lights in a project, in the form of `tags.json`; those that cannot be read are kept.

use std::collections::HashMap;
use std::path::Path;

use serde_json::{Value, json};

use super::{Reader, lights};
use crate::io::edits::{Place, Unread, emitter_value, named_file, short};
use crate::io::error::listed;
use crate::io::json::Field;
use crate::io::paths::absolute;
use crate::io::{Error, Fault};
use crate::scene::{Capture, KnownLight, Role};

/// Known lights of a project, with what of them could not be read.
#[derive(Clone, Debug, Default)]
pub struct StoredLights {
    /// What could be read.
    pub lights: Vec<KnownLight>,
    /// What could not: it is kept, and written back.
    pub unread: Vec<Unread>,
    /// What is odd about what could.
    pub warnings: Vec<String>,
}

/// Reads them against the surfaces of a capture; paths are relative to the folder of `file`.
pub fn stored_lights(file: &Path, values: &[Value], capture: &Capture) -> StoredLights {
    let mut surfaces = capture.surfaces.clone();
    // What the capture's own lights have may be another's here.
    surfaces.iter_mut().for_each(|surface| surface.role = Role::Untagged);
    let mut reader = Reader {
        surfaces: &mut surfaces,
        owners: HashMap::new(),
        absent: Vec::new(),
        warnings: Vec::new(),
    };
    let mut stored = StoredLights::default();
    for (index, value) in values.iter().enumerate() {
        let item = Field { file, path: format!("lights[{index}]"), value };
        match stored_light(&mut reader, &item, stored.lights.len()) {
            Ok(light) => stored.lights.push(light),
            Err(error) => stored.unread.push(Unread::new(Place::Light, &item, Some(&error))),
        }
    }
    stored.warnings = reader.warnings;
    stored
}

fn stored_light(reader: &mut Reader, item: &Field, index: usize) -> Result<KnownLight, Error> {
    if item.get("kind").is_some_and(|kind| kind.value == "dome") {
        // A person chose the image, which may lie anywhere.
        let name = item.get("name").map(|field| field.text().map(str::to_owned)).transpose()?;
        let image = named_file(&item.need("image")?, "image")?;
        let dome = lights::dome(item, image, &mut reader.warnings)?;
        let name = name.unwrap_or_else(|| format!("light {}", index + 1));
        return Ok(KnownLight::Dome { name, dome });
    }
    reader.absent.clear();
    let light = reader.light(item, index)?;
    // Half of a light would be saved as half.
    match reader.absent.first() {
        None => Ok(light),
        Some((place, problem)) => Err(Error::Invalid(Fault::new(
            item.file,
            place.clone(),
            problem.clone(),
            format!(
                "The light is left out until the capture has its surfaces again; it has {}",
                listed(reader.surfaces.iter().map(|surface| surface.name.as_str()))
            ),
        ))),
    }
}

/// Known lights as `tags.json` would have them, with what could not be read; paths are absolute.
pub fn light_values(lights: &[KnownLight], unread: &[Unread], capture: &Capture) -> Vec<Value> {
    let own = lights.iter().map(|light| light_value(light, capture));
    own.chain(unread.iter().map(|part| part.value.clone())).collect()
}

fn light_value(light: &KnownLight, capture: &Capture) -> Value {
    let mut value = match light {
        KnownLight::Visible { surfaces, .. } => {
            let names: Vec<&str> =
                surfaces.iter().map(|&surface| capture.surfaces[surface].name.as_str()).collect();
            json!({ "kind": "visible", "surfaces": names })
        }
        KnownLight::Dome { dome, .. } => {
            let image = absolute(&dome.file).display().to_string();
            let mut value = json!({ "kind": "dome", "image": image, "scale": short(dome.scale) });
            if dome.turn != 0.0 {
                value["turn"] = json!(short(dome.turn));
            }
            value
        }
        KnownLight::Shape { emitter, emission, color, .. } => {
            let mut value = emitter_value(emitter);
            value[emitter.quantity()] = json!(emission);
            if let Some(color) = color {
                value["color"] = json!(color);
            }
            value
        }
    };
    value["name"] = json!(light.name());
    value
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::scene::{Dome, Emitter, Image, Surface};

    fn capture() -> Capture {
        let surface =
            |name: &str| Surface { name: name.into(), role: Role::Untagged, has_texcoords: false };
        Capture { surfaces: vec![surface("wall"), surface("bulb")], ..Capture::default() }
    }

    fn shape(name: &str, emitter: Emitter) -> KnownLight {
        KnownLight::Shape { name: name.into(), emitter, emission: None, color: None }
    }

    #[test]
    fn lights_of_every_kind_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let image = dunce::canonicalize(folder.path()).unwrap().join("sky.exr");
        let pixels = vec![[1.0f32; 3]; 8];
        crate::io::exr::write_rgb(&image, 4, 2, &pixels).unwrap();
        let sky = Image::new(4, 2, pixels, None);
        let panel = Emitter::Rectangle {
            corners: [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 2.0, 0.0), Vec3::new(0.0, 2.0, 0.0)],
            normal: -Vec3::Z,
        };
        let spot = Emitter::Spot {
            position: Vec3::new(0.1, 0.2, 0.3),
            direction: -Vec3::Z,
            inner_angle: 0.3,
            outer_angle: 0.55,
        };
        let lights = vec![
            KnownLight::Shape {
                name: "panel".into(),
                emitter: panel,
                emission: Some([9.0, 8.0, 7.5]),
                color: None,
            },
            KnownLight::Shape {
                name: "ball".into(),
                emitter: Emitter::Sphere { center: Vec3::ONE, radius_m: 0.1 },
                emission: None,
                color: Some([1.0, 0.9, 0.7]),
            },
            shape("point", Emitter::Point { position: Vec3::X }),
            shape("spot", spot),
            shape("sun", Emitter::Sun { direction: -Vec3::Z, angular_diameter: 0.0093 }),
            KnownLight::Visible { name: "lamp".into(), surfaces: vec![1] },
            KnownLight::Dome {
                name: "sky".into(),
                dome: Dome { file: image, image: Arc::new(sky), scale: 2.5, turn: 0.75 },
            },
        ];
        let values = light_values(&lights, &[], &capture());
        let file = folder.path().join("a.lobelia");
        let stored = stored_lights(&file, &values, &capture());
        assert_eq!(stored.unread, []);
        assert_eq!(stored.lights, lights);
    }

    #[test]
    fn what_cannot_be_read_is_kept_as_it_is() {
        let values = [
            json!({ "kind": "dome", "image": "/nowhere/sky.exr", "name": "sky" }),
            json!({ "kind": "visible", "surfaces": ["bulb", "shade"] }),
            json!({ "kind": "point", "position": [0, 0, 1] }),
            json!({ "kind": "candle" }),
        ];
        let stored = stored_lights(Path::new("/nowhere/a.lobelia"), &values, &capture());
        assert_eq!(stored.lights, [shape("light 1", Emitter::Point { position: Vec3::Z })]);
        assert_eq!(stored.unread.len(), 3);
        assert!(stored.unread[0].is_missing);
        let problem = stored.unread[1].problem.clone().unwrap();
        assert!(problem.contains("shade"), "{problem}");
        let kept = light_values(&stored.lights, &stored.unread, &capture());
        assert_eq!(kept[1..], [values[0].clone(), values[1].clone(), values[3].clone()]);
    }
}
