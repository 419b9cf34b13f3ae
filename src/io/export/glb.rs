//! The model as binary glTF 2.0: surfaces, base colours, lights and cameras in one file.
//!
//! - glTF has y up: everything hangs below a node that turns z up.
//! - The modified Phong lobe ρ_s (n+2)/2π cosⁿγ becomes glTF's microfacet lobe of the same width
//!   and height about normal incidence: cosⁿ of the angle to the mirror direction is about cos⁴ⁿ
//!   of half of it, the angle of the half vector, and a microfacet lobe of width α is about that
//!   power of 2/α² − 2. So α² = 2/(4n + 2), and roughness, whose square is α, is its square root.
//!   `KHR_materials_specular` holds ρ_s at all angles, without Fresnel's rise.
//! - The photographs' unit of radiance counts as 1 cd/m². Point and spot lights are isotropic or
//!   cones: a recovered light gets the intensity that it sends to the middle of the scene.
//! - A camera's principal point and distortion have no place in glTF; they are in its `extras`.

use std::f32::consts::FRAC_PI_2;
use std::io::Write;
use std::path::Path;

use glam::{DMat3, DQuat, Mat3, Quat, Vec3};
use serde_json::{Map as Object, Value, json};

use super::super::{Error, atomic, png};
use super::points;
use crate::math::rgb::{CHANNELS, Radiance, srgb_code};
use crate::render::edits::Shape;
use crate::render::looks::BrdfF32;
use crate::render::model::{Map, Model, Part, PartLook, View};
use crate::render::probe::is_broad;
use crate::scene::Emitter;
use crate::watch::Watch;

/// The reflectance at normal incidence of glTF's dielectric, of index 1.5.
const DIELECTRIC: f32 = 0.04;
/// The node of lights that a light probe stands for better.
const STAND_INS: &str = "background stand-ins";

/// glTF's roughness for a modified Phong exponent.
pub fn roughness(exponent: f32) -> f32 {
    (2.0 / (4.0 * exponent + 2.0)).sqrt().sqrt().clamp(0.0, 1.0)
}

pub fn write(file: &Path, name: &str, model: &Model, watch: &Watch) -> Result<(), Error> {
    let mut glb = Glb::default();
    let mut top = Vec::new();
    watch.begin(model.parts.len() as u64);
    for part in &model.parts {
        watch.tick()?;
        let material = glb.material(part).map_err(|source| failed(file, source))?;
        let mesh = glb.mesh(part, material);
        top.push(glb.push("nodes", json!({"name": part.name, "mesh": mesh})));
    }
    for view in &model.cameras {
        top.push(glb.camera(view));
    }
    top.extend(glb.lights(model));
    // z up to y up: a quarter turn about x.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let mut root = json!({"name": name, "rotation": [-half, 0.0, 0.0, half]});
    if !top.is_empty() {
        root["children"] = top.into();
    }
    let root = glb.push("nodes", root);
    let (json, binary) = glb.finish(root);
    let total = 12 + 8 + json.len() + if binary.is_empty() { 0 } else { 8 + binary.len() };
    let total = u32::try_from(total).map_err(|_| {
        failed(file, std::io::Error::other("a .glb file holds no more than 4 GB".to_owned()))
    })?;
    atomic::write(file, |out| {
        out.write_all(b"glTF")?;
        out.write_all(&2u32.to_le_bytes())?;
        out.write_all(&total.to_le_bytes())?;
        for (kind, data) in [(b"JSON", &json), (b"BIN\0", &binary)] {
            if !data.is_empty() {
                out.write_all(&(data.len() as u32).to_le_bytes())?;
                out.write_all(kind)?;
                out.write_all(data)?;
            }
        }
        Ok(())
    })
}

fn failed(file: &Path, source: std::io::Error) -> Error {
    Error::Write { file: file.to_owned(), source }
}

/// A file in the making.
#[derive(Default)]
struct Glb {
    root: Object<String, Value>,
    lights: Vec<Value>,
    extensions: std::collections::BTreeSet<&'static str>,
    binary: Vec<u8>,
}

impl Glb {
    /// Adds to one of the lists and gives the index.
    fn push(&mut self, list: &str, item: Value) -> usize {
        let list = self.root.entry(list).or_insert_with(|| json!([]));
        let Value::Array(items) = list else { return 0 };
        items.push(item);
        items.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let offset = self.binary.len();
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.push("bufferViews", view)
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> =
            values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        // 34962: vertices; 5126: float.
        let view = self.view(&bytes, Some(34962));
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..N).map(|k| values.iter().map(|v| v[k]).reduce(pick).unwrap_or(0.0)).collect()
        };
        let accessor = json!({
            "bufferView": view, "componentType": 5126, "count": values.len(),
            "type": format!("VEC{N}"), "min": bound(f32::min), "max": bound(f32::max)});
        self.push("accessors", accessor)
    }

    fn mesh(&mut self, part: &Part, material: usize) -> usize {
        let positions: Vec<[f32; 3]> = part.positions.iter().map(|p| p.to_array()).collect();
        let mut attributes = json!({"POSITION": self.floats(&positions)});
        if !part.texcoords.is_empty() {
            // glTF's v points down.
            let coordinates: Vec<[f32; 2]> =
                part.texcoords.iter().map(|uv| [uv.x, 1.0 - uv.y]).collect();
            attributes["TEXCOORD_0"] = self.floats(&coordinates).into();
        }
        let bytes: Vec<u8> =
            part.triangles.iter().flatten().flat_map(|vertex| vertex.to_le_bytes()).collect();
        // 34963: indices; 5125: unsigned.
        let view = self.view(&bytes, Some(34963));
        let indices = json!({"bufferView": view, "componentType": 5125,
            "count": 3 * part.triangles.len(), "type": "SCALAR"});
        let indices = self.push("accessors", indices);
        let primitive = json!({"attributes": attributes, "indices": indices, "material": material});
        self.push("meshes", json!({"name": part.name, "primitives": [primitive]}))
    }

    fn material(&mut self, part: &Part) -> std::io::Result<usize> {
        let mut material = json!({"name": part.name, "doubleSided": true});
        match &part.look {
            PartLook::Plain(brdf) => {
                let [r, g, b] = base_colour(brdf.diffuse, brdf);
                material["pbrMetallicRoughness"] = json!({"baseColorFactor": [r, g, b, 1.0]});
                self.gloss(&mut material, brdf);
            }
            PartLook::Textured(brdf, map) => {
                let texture = self.texture(map, |texel| base_colour(texel, brdf))?;
                material["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": texture}});
                self.gloss(&mut material, brdf);
            }
            PartLook::Shining(map) => {
                let most = map.texels.iter().flatten().copied().fold(0.0, f32::max);
                let most = if most > 0.0 { most } else { 1.0 };
                let texture = self.texture(map, |texel| texel.map(|value| value / most))?;
                material["pbrMetallicRoughness"] = json!({"baseColorFactor": [0, 0, 0, 1]});
                self.gloss(&mut material, &BrdfF32::default());
                material["emissiveTexture"] = json!({"index": texture});
                material["emissiveFactor"] = json!([1, 1, 1]);
                self.extensions.insert("KHR_materials_emissive_strength");
                material["extensions"]["KHR_materials_emissive_strength"] =
                    json!({"emissiveStrength": most});
            }
        }
        Ok(self.push("materials", material))
    }

    fn gloss(&mut self, material: &mut Value, brdf: &BrdfF32) {
        let most = strongest(brdf);
        let surface = &mut material["pbrMetallicRoughness"];
        surface["metallicFactor"] = 0.into();
        if let Some(coat) = brdf.coat {
            // glTF's own dielectric has this index; its roughness is the root of α.
            surface["roughnessFactor"] = coat.sqrt().into();
            return;
        }
        self.extensions.insert("KHR_materials_specular");
        let mut specular = json!({"specularFactor": most});
        if most > 0.0 {
            surface["roughnessFactor"] = roughness(brdf.exponent).into();
            // The factor is the reflectance at grazing incidence, and with the colour and the
            // dielectric's own the one at normal incidence.
            let colour = brdf.specular.map(|value| value / (DIELECTRIC * most));
            specular["specularColorFactor"] = json!(colour);
        }
        material["extensions"] = json!({"KHR_materials_specular": specular});
    }

    fn texture(
        &mut self,
        map: &Map,
        value: impl Fn(Radiance) -> Radiance,
    ) -> std::io::Result<usize> {
        let pixels: Vec<u8> =
            map.texels.iter().flat_map(|&texel| value(texel).map(srgb_code)).collect();
        let encoded = png::encode(map.width, map.height, &pixels)?;
        let view = self.view(&encoded, None);
        let image = self.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        if !self.root.contains_key("samplers") {
            // Linear; edges are repeated, as in our pictures.
            let sampler = json!({"magFilter": 9729, "minFilter": 9729,
                "wrapS": 33071, "wrapT": 33071});
            self.push("samplers", sampler);
        }
        Ok(self.push("textures", json!({"source": image, "sampler": 0})))
    }

    /// A camera's node.
    fn camera(&mut self, view: &View) -> usize {
        let camera = &view.camera;
        let size = [camera.width as f64, camera.height as f64];
        let focal = camera.focal_px;
        let yfov = 2.0 * (0.5 * size[1] / focal.y).atan();
        let aspect = (size[0] / focal.x) / (size[1] / focal.y);
        let principal = camera.principal_px;
        let mut extras = json!({"width": size[0], "height": size[1], "fl_x": focal.x,
            "fl_y": focal.y, "cx": principal.x, "cy": principal.y});
        if !camera.distortion.is_none() {
            let [k1, k2, k3, k4] = camera.distortion.radial;
            let [p1, p2] = camera.distortion.tangential;
            extras["distortion"] =
                json!({"k1": k1, "k2": k2, "k3": k3, "k4": k4, "p1": p1, "p2": p2});
        }
        let lens = json!({"aspectRatio": aspect, "yfov": yfov, "znear": 0.01});
        let name = &view.name;
        let lens =
            json!({"name": name, "type": "perspective", "perspective": lens, "extras": extras});
        let lens = self.push("cameras", lens);
        let rotation = rotation(camera.world_from_camera);
        let place = camera.position.to_array();
        self.push(
            "nodes",
            json!({"name": name, "camera": lens, "translation": place, "rotation": rotation}),
        )
    }

    /// The nodes of all lights, those of the background below one of their own.
    fn lights(&mut self, model: &Model) -> Vec<usize> {
        let (mut nodes, mut broad) = (Vec::new(), Vec::new());
        for (index, light) in model.recovered.iter().enumerate() {
            let Some(facing) = light.facing(model.middle) else { continue };
            let shape = &light.shape;
            let name = format!("recovered {} {index}", points::kind(shape.kind));
            let travels = -facing.direction;
            let is_distant =
                shape.is_distant() || matches!(light.emitter, Some(Emitter::Sun { .. }));
            let node = if is_distant {
                self.light(&name, "directional", facing.irradiance, None, None, travels)
            } else {
                let place = light.emitter.map_or(shape.position, |emitter| emitter.extent().0);
                let intensity = facing.irradiance.map(|e| e * place.distance_squared(model.middle));
                let cone = match light.emitter {
                    Some(Emitter::Spot { direction, inner_angle, outer_angle, .. }) => {
                        Some((direction, inner_angle, outer_angle))
                    }
                    // What glTF has that is nearest to a disc: all of the half space in front.
                    _ if is_broad(shape.kind) => Some((travels, 0.0, FRAC_PI_2)),
                    _ => None,
                };
                // Of a spot the middle may see no more than the rim.
                let intensity = match light.emitter {
                    Some(Emitter::Spot { .. } | Emitter::Point { .. }) => light.lobes[0].1,
                    _ => intensity,
                };
                self.lamp(&name, intensity, place, cone)
            };
            if is_broad(shape.kind) { broad.extend(node) } else { nodes.extend(node) }
        }
        if !broad.is_empty() {
            nodes.push(self.push("nodes", json!({"name": STAND_INS, "children": broad})));
        }
        for added in &model.added {
            // A dome has no place among glTF's lights; it is in light probes.
            let Shape::Emitter(emitter) = &added.shape else { continue };
            let emission = added.emission.map(|value| value as f32);
            let (place, _) = emitter.extent();
            let node = match emitter {
                Emitter::Sun { direction, .. } => {
                    self.light(&added.name, "directional", emission, None, None, *direction)
                }
                Emitter::Spot { direction, inner_angle, outer_angle, .. } => {
                    let cone = Some((*direction, *inner_angle, *outer_angle));
                    self.lamp(&added.name, emission, place, cone)
                }
                Emitter::Point { .. } => self.lamp(&added.name, emission, place, None),
                Emitter::Sphere { radius_m, .. } => {
                    let area = std::f32::consts::PI * radius_m * radius_m;
                    self.lamp(&added.name, emission.map(|value| value * area), place, None)
                }
                // Lambert's cosine is nearest to a cone of 90 degrees.
                Emitter::Rectangle { normal, .. } => {
                    let area = emitter.area_m2();
                    let cone = Some((*normal, 0.0, FRAC_PI_2));
                    self.lamp(&added.name, emission.map(|value| value * area), place, cone)
                }
            };
            nodes.extend(node);
        }
        nodes
    }

    fn lamp(
        &mut self,
        name: &str,
        intensity: Radiance,
        place: Vec3,
        cone: Option<(Vec3, f32, f32)>,
    ) -> Option<usize> {
        match cone {
            Some((axis, inner, outer)) => {
                self.light(name, "spot", intensity, Some([inner, outer]), Some(place), axis)
            }
            None => self.light(name, "point", intensity, None, Some(place), Vec3::NEG_Z),
        }
    }

    /// `strength` in cd or lx; `None` for a light that is dark.
    fn light(
        &mut self,
        name: &str,
        kind: &str,
        strength: Radiance,
        cone: Option<[f32; 2]>,
        place: Option<Vec3>,
        axis: Vec3,
    ) -> Option<usize> {
        let most = strength.iter().copied().fold(0.0, f32::max);
        if most <= 0.0 {
            return None;
        }
        self.extensions.insert("KHR_lights_punctual");
        let colour = strength.map(|value| value / most);
        let mut light = json!({"name": name, "type": kind, "color": colour, "intensity": most});
        if let Some([inner, outer]) = cone {
            // The validator reads 90° in single precision as more than a right angle.
            let outer = outer.clamp(1e-3, FRAC_PI_2 - 1e-6);
            let inner = inner.clamp(0.0, 0.999 * outer);
            light["spot"] = json!({"innerConeAngle": inner, "outerConeAngle": outer});
        }
        self.lights.push(light);
        let mut node = json!({"name": name,
            "extensions": {"KHR_lights_punctual": {"light": self.lights.len() - 1}}});
        if let Some(place) = place {
            node["translation"] = json!(place.to_array());
        }
        if kind != "point" {
            // Lights shine along −z of their node.
            let (x, y) = (-axis).any_orthonormal_pair();
            let turn = Quat::from_mat3(&Mat3::from_cols(x, y, -axis)).as_dquat();
            node["rotation"] = json!(turn.normalize().to_array());
        }
        Some(self.push("nodes", node))
    }

    /// Both chunks, each filled up to whole words.
    fn finish(mut self, root: usize) -> (Vec<u8>, Vec<u8>) {
        let mut file = json!({
            "asset": {"version": "2.0", "generator": concat!("lobelia ", env!("CARGO_PKG_VERSION"))},
            "scene": 0,
            "scenes": [{"nodes": [root]}]});
        if !self.binary.is_empty() {
            self.push("buffers", json!({"byteLength": self.binary.len()}));
        }
        if !self.lights.is_empty() {
            file["extensions"] = json!({"KHR_lights_punctual": {"lights": self.lights}});
        }
        if !self.extensions.is_empty() {
            file["extensionsUsed"] = json!(self.extensions);
        }
        for (list, items) in self.root {
            file[list] = items;
        }
        let mut text = file.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        (text, self.binary)
    }
}

fn rotation(world_from_camera: DMat3) -> [f64; 4] {
    DQuat::from_mat3(&world_from_camera).normalize().to_array()
}

fn strongest(brdf: &BrdfF32) -> f32 {
    brdf.specular.iter().copied().fold(0.0, f32::max).clamp(0.0, 1.0)
}

/// glTF takes from the base colour what the specular lobe reflects.
fn base_colour(diffuse: Radiance, brdf: &BrdfF32) -> [f32; CHANNELS] {
    let rest = (1.0 - strongest(brdf)).max(1e-3);
    diffuse.map(|value| (value / rest).clamp(0.0, 1.0))
}
