//! Reads a solution from its files, so that it can be rendered.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use super::error::read_bounded;
use super::export::file_name;
use super::solution::{Light, Lights, Solution};
use super::{Error, Fault, exr};
use crate::math::rgb::CHANNELS;
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::reconstruct::lobes::Lobe;
use crate::reconstruct::solution::MaterialCertainty;
use crate::reconstruct::textures::Texture;
use crate::reconstruct::unwrap::Unwrap;
use crate::render::scene::Solved;
use crate::scene::Brdf;
use crate::scene::{Capture, Emitter, KnownLight, Optics, Role};

/// Coordinates of textures take about 100 bytes a triangle.
const LARGEST: u64 = 4 << 30;

/// Reads `solution.json`, `lights.json` and the textures of a folder for the capture that they
/// were made from.
pub fn read(folder: &Path, capture: &Capture) -> Result<Solved, Error> {
    let file = folder.join("solution.json");
    let solution = Solution::read(&file)?;
    let mut solved = Solved::default();
    for material in &capture.materials {
        let Some(found) = solution.materials.iter().find(|found| found.name == material.name)
        else {
            return Err(other(&file, "materials", &format!("no material \"{}\"", material.name)));
        };
        solved.reflectances.push(found.diffuse.map(|diffuse| Brdf {
            diffuse,
            specular: found.specular.unwrap_or_default(),
            exponent: found.exponent.unwrap_or(1.0),
            coat: found.roughness,
        }));
        solved.optics.push(match (found.model.as_deref(), found.specular) {
            (Some("mirror"), Some(reflected)) => Optics::Mirror(reflected.map(|part| part as f32)),
            (Some("glass"), _) => Optics::Glass,
            _ => Optics::Opaque,
        });
        solved.certainty.push(found.identified.map(|identified| MaterialCertainty {
            diffuse: found.diffuse_interval.unwrap_or_default(),
            specular: found.specular_interval.unwrap_or_default(),
            exponent: found.exponent_interval,
            roughness: found.roughness_interval,
            identified,
        }));
    }
    let file = folder.join("lights.json");
    for (index, light) in Lights::read(&file)?.lights.iter().enumerate() {
        add(&mut solved, light, capture, &file, index)?;
    }
    solved.light.lobes.first.push(solved.light.lobes.lobes.len());
    solved.textures = Arc::new(textures(folder, capture, &solved)?);
    Ok(solved)
}

/// The solution belongs to another capture, or to other tags.
fn other(file: &Path, place: &str, what: &str) -> Error {
    Error::Invalid(Fault::new(
        file,
        place,
        format!("this solution has {what}, which the capture has or asks for"),
        "Reconstruct the capture again with its present tags, or name the capture it is of",
    ))
}

fn add(
    solved: &mut Solved,
    light: &Light,
    capture: &Capture,
    file: &Path,
    index: usize,
) -> Result<(), Error> {
    let wrong = |what: &str| {
        Error::Invalid(Fault::new(
            file,
            format!("lights[{index}]"),
            what,
            "Reconstruct again: lobelia writes this file",
        ))
    };
    let vector = |value: Option<[f64; 3]>, name: &str| {
        value
            .map(|value| DVec3::from_array(value).as_vec3())
            .filter(|value| value.is_finite())
            .ok_or_else(|| wrong(&format!("a {} light has a {name}", light.kind)))
    };
    let radius_m = light.radius_m.unwrap_or(0.0) as f32;
    let disc = |kind| -> Result<VirtualLight, Error> {
        let (position, normal) = (vector(light.position, "position")?, light.normal);
        Ok(VirtualLight::disc(kind, position, vector(normal, "normal")?, radius_m))
    };
    let shape = match light.kind.as_str() {
        "sphere" => disc(LightKind::Sphere)?,
        "surface" => disc(LightKind::Surface)?,
        "lamp" => VirtualLight::lamp(vector(light.position, "position")?, radius_m),
        "sky" => {
            // Ω = 4π sin²(half/2).
            let part = light.solid_angle_sr.unwrap_or(0.0) / (4.0 * std::f64::consts::PI);
            let half_angle = 2.0 * part.clamp(0.0, 1.0).sqrt().asin();
            let direction = vector(light.direction, "direction")?;
            VirtualLight::distant(LightKind::Sky, direction, half_angle as f32)
        }
        "sun" => {
            let direction = vector(light.direction, "direction")?;
            VirtualLight::distant(LightKind::Sun, direction, 0.5 * Emitter::SUN_DIAMETER)
        }
        "known" => {
            let named = |known: &KnownLight| Some(known.name()) == light.name.as_deref();
            let known =
                capture.lights.iter().position(named).ok_or_else(|| {
                    wrong("there is no light of this name among the capture's tags")
                })?;
            // Where lobes of reflection find it, as in the solve.
            let (position, radius_m) = match &capture.lights[known] {
                KnownLight::Shape { emitter, .. } => emitter.extent(),
                _ => (Vec3::ZERO, 0.0),
            };
            let kind = LightKind::Known(known);
            VirtualLight { kind, ..VirtualLight::lamp(position, radius_m) }
        }
        kind => return Err(wrong(&format!("\"{kind}\" is no kind of light"))),
    };
    let number = solved.light.lights.lights.len();
    solved.light.lobes.first.push(solved.light.lobes.lobes.len());
    solved.light.lights.lights.push(shape);
    for lobe in &light.lobes {
        if !lobe.emission.iter().all(|value| value.is_finite() && *value >= 0.0) {
            return Err(wrong("an emission is a number of 0 or more"));
        }
        solved.light.lobes.lobes.push(Lobe {
            light: number,
            direction: DVec3::from_array(lobe.direction).as_vec3(),
            exponent: lobe.exponent as f32,
        });
        solved.light.emission.push(lobe.emission);
    }
    Ok(())
}

/// The textures that a folder of results has for what was solved.
pub(super) fn textures(
    folder: &Path,
    capture: &Capture,
    solved: &Solved,
) -> Result<Vec<Texture>, Error> {
    let folder = folder.join("textures");
    let mut textures = Vec::new();
    let mut taken = BTreeSet::new();
    for (surface, tagged) in capture.surfaces.iter().enumerate() {
        let Role::Material(material) = tagged.role else { continue };
        if !capture.materials[material].textured || solved.reflectances[material].is_none() {
            continue;
        }
        let name = file_name(&tagged.name, &mut taken);
        let image = folder.join(format!("{name}.exr"));
        if !image.is_file() {
            // No photograph shows this surface, or textures were not asked for.
            taken.remove(&name.to_lowercase());
            continue;
        }
        let picture = exr::read(&image)?;
        let mesh = &capture.mesh;
        let triangles: Vec<usize> = (0..mesh.triangles.len())
            .filter(|&triangle| mesh.surface[triangle] as usize == surface)
            .collect();
        let map = folder.join(format!("{name}.obj"));
        let is_own = !map.is_file();
        let corners: Vec<[Vec2; 3]> = if is_own {
            triangles.iter().filter_map(|&t| mesh.texcoords.get(t).copied()).collect()
        } else {
            coordinates(&map)?
        };
        if corners.len() != triangles.len() {
            return Err(other(&image, "", "a texture for another geometry"));
        }
        let (width, height) = (picture.width, picture.height);
        let seen = exr::read_channel(&image, "seen")?
            .map_or(vec![true; width * height], |seen| seen.iter().map(|&s| s > 0.5).collect());
        let unwrap = Unwrap { triangles, corners, width, height, is_own };
        let texels = picture.pixels;
        textures.push(Texture { surface, material, unwrap, texels, seen });
    }
    Ok(textures)
}

/// The texture coordinates of a map that was written with a texture, three to a triangle.
fn coordinates(file: &Path) -> Result<Vec<[Vec2; 3]>, Error> {
    let bytes = read_bounded(file, LARGEST)?;
    let mut all = Vec::new();
    for (index, line) in String::from_utf8_lossy(&bytes).lines().enumerate() {
        let Some(rest) = line.strip_prefix("vt ") else { continue };
        let mut numbers = rest.split_whitespace().map(|word| word.parse::<f32>());
        match (numbers.next(), numbers.next()) {
            (Some(Ok(u)), Some(Ok(v))) if u.is_finite() && v.is_finite() => {
                all.push(Vec2::new(u, v));
            }
            _ => {
                return Err(Error::Invalid(Fault::new(
                    file,
                    format!("line {}", index + 1),
                    "two texture coordinates are due here",
                    "Reconstruct again: lobelia writes this file",
                )));
            }
        }
    }
    Ok(all.chunks_exact(CHANNELS).map(|corners| [corners[0], corners[1], corners[2]]).collect())
}
