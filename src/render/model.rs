//! A recovered scene with its edits as plain data, from which exports are written.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use crate::geometry::mesh::Mesh;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::reconstruct::textures::{fill, points};
use crate::reconstruct::unwrap::{TexelSize, unwrap};
use crate::render::edits::{AddedLight, Edits};
use crate::render::lights::Light;
use crate::render::looks::{BrdfF32, SurfaceLook, surface_looks};
use crate::render::scene::{Scene, Shell, Solved, unseen_shines};
use crate::scene::{Camera, Capture, Image, Photograph, Views};
use crate::watch::{Cancelled, Watch};

/// All surfaces and lights of the scene.
#[derive(Clone, Debug)]
pub struct Model {
    /// The capture's surfaces with triangles, then the objects'.
    pub parts: Vec<Part>,
    /// Recovered lights that shine, times the edits' factor on them.
    pub recovered: Vec<Light>,
    pub added: Vec<AddedLight>,
    /// The box that reflects only added light.
    pub shell: Option<Shell>,
    /// The photographs' cameras; no two have the same name.
    pub cameras: Vec<View>,
    /// The middle of the geometry, and half the diagonal of the box around it.
    pub middle: Vec3,
    pub radius_m: f32,
}

/// A camera of the capture.
#[derive(Clone, Debug)]
pub struct View {
    pub name: String,
    pub camera: Camera,
    /// The 99th percentile of its photograph's radiance, or of all where it is no measurement.
    pub white: f32,
}

/// One surface; no two have the same name.
#[derive(Clone, Debug)]
pub struct Part {
    pub name: String,
    /// Parts with the same look share its name.
    pub material: String,
    pub positions: Vec<Vec3>,
    /// Per position, v up; empty unless the look has a map.
    pub texcoords: Vec<Vec2>,
    pub triangles: Vec<[u32; 3]>,
    pub look: PartLook,
    /// What it sends of the recovered light is the light of recovered lights on it already.
    pub is_counted: bool,
}

#[derive(Clone, Debug)]
pub enum PartLook {
    Plain(BrdfF32),
    /// With the diffuse reflectance of a map.
    Textured(BrdfF32, Map),
    /// A luminaire, or of no known reflectance: radiance as photographed.
    Shining(Map),
}

/// Values over the unit square of texture coordinates, row by row from the top (v = 1).
#[derive(Clone, Debug)]
pub struct Map {
    pub width: usize,
    pub height: usize,
    pub texels: Vec<Radiance>,
}

/// Exponent of the lobe that stands for a mirror in other programs: half of it within 1°.
const MIRROR_EXPONENT: f32 = 4500.0;
/// Texels along the side of a shining surface that is about as wide as high.
const SHINING_SIDE: f32 = 128.0;

impl Model {
    pub fn new(
        scene: &Scene,
        photographs: &Views,
        solved: &Solved,
        edits: &Edits,
        watch: &Watch,
    ) -> Result<Self, Cancelled> {
        let capture = photographs.capture;
        let mut names = Names::default();
        let mut parts = Vec::new();
        watch.begin(capture.surfaces.len() as u64);
        let members = by_surface(&capture.mesh, capture.surfaces.len());
        let looks = surface_looks(capture, solved, edits);
        let unseen_shines = unseen_shines(solved);
        for ((index, surface), look) in capture.surfaces.iter().enumerate().zip(looks) {
            watch.tick()?;
            let triangles = &members[index];
            if triangles.is_empty() {
                continue;
            }
            let name = names.unused(&surface.name);
            let (look, material, corners) = match look {
                // Light passes it, and the formats that are written describe it too differently.
                SurfaceLook::Glass => continue,
                SurfaceLook::Mirror(specular) => {
                    let brdf =
                        BrdfF32 { specular, exponent: MIRROR_EXPONENT, ..BrdfF32::default() };
                    (PartLook::Plain(brdf), name.clone(), None)
                }
                SurfaceLook::Reflects(brdf) => {
                    let material = surface.material().map(|m| capture.materials[m].name.clone());
                    (PartLook::Plain(brdf), material.unwrap_or_else(|| name.clone()), None)
                }
                SurfaceLook::Textured(brdf, texture) => {
                    let unwrap = &texture.unwrap;
                    let texels = texture.texels.clone();
                    let map = Map { width: unwrap.width, height: unwrap.height, texels };
                    // In the order of `triangles`, as every unwrap is.
                    (PartLook::Textured(brdf, map), name.clone(), Some(unwrap.corners.clone()))
                }
                SurfaceLook::Photographed => {
                    let (map, corners) = photographed(photographs, index, triangles, edits, watch)?;
                    (PartLook::Shining(map), name.clone(), Some(corners))
                }
            };
            let mut part = Part::new(name, material, look, &capture.mesh, triangles, corners);
            let is_unseen = surface.material().is_some_and(|m| solved.reflectances[m].is_none());
            part.is_counted = is_unseen && unseen_shines;
            parts.push(part);
        }
        for object in &edits.objects {
            let mesh = object.placed();
            let members = by_surface(&mesh, object.surfaces.len());
            for (index, ((_, reflectance), triangles)) in
                object.surfaces.iter().zip(&members).enumerate()
            {
                if triangles.is_empty() {
                    continue;
                }
                let suffix =
                    if members.len() > 1 { format!(" {}", index + 1) } else { String::new() };
                let name = names.unused(&format!("{}{suffix}", object.name));
                let look = PartLook::Plain(BrdfF32::from(reflectance));
                parts.push(Part::new(name.clone(), name, look, &mesh, triangles, None));
            }
        }
        let mut recovered = scene.recovered.lights().to_vec();
        recovered.retain(|_| scene.original_light > 0.0);
        for (_, emission) in recovered.iter_mut().flat_map(|light| &mut light.lobes) {
            *emission = emission.map(|value| value * scene.original_light);
        }
        let everything = parts.iter().flat_map(|part| part.positions.iter().copied());
        let (low, high) = everything.fold(
            (Vec3::splat(f32::INFINITY), Vec3::splat(f32::NEG_INFINITY)),
            |(low, high), p| (low.min(p), high.max(p)),
        );
        let (low, high) = if parts.is_empty() { (Vec3::ZERO, Vec3::ZERO) } else { (low, high) };
        Ok(Self {
            parts,
            recovered,
            added: edits.lights.iter().filter(|light| light.is_on).cloned().collect(),
            cameras: cameras(capture),
            shell: scene.shell.filter(|_| edits.lights.iter().any(|light| light.is_on)),
            middle: 0.5 * (low + high),
            radius_m: 0.5 * (high - low).length(),
        })
    }
}

fn cameras(capture: &Capture) -> Vec<View> {
    let mut names = Names::default();
    let white = |image: &Image| {
        // Of more than a million pixels, every so many-th.
        let step = image.pixels().len().div_ceil(1 << 20).max(1);
        let pixels = image.pixels().step_by(step);
        let mut values: Vec<f32> = pixels.flatten().filter(|value| value.is_finite()).collect();
        let index = (values.len().saturating_sub(1) as f64 * 0.99) as usize;
        if values.is_empty() {
            1.0
        } else {
            *values.select_nth_unstable_by(index, f32::total_cmp).1
        }
    };
    let whites: Vec<Option<f32>> =
        capture.photographs.iter().map(|p| p.image.as_deref().map(white)).collect();
    let brightest = whites.iter().flatten().copied().fold(0.0, f32::max);
    let view = |(photograph, own): (&Photograph, &Option<f32>)| {
        let path = photograph.name.replace('\\', "/");
        let stem = path.rsplit('/').next().unwrap_or_default();
        let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
        let name = names.unused(if stem.is_empty() { "camera" } else { stem });
        View { name, camera: photograph.camera, white: own.unwrap_or(brightest) }
    };
    capture.photographs.iter().zip(&whites).map(view).collect()
}

/// The triangles of each surface, in their order.
fn by_surface(mesh: &Mesh, surfaces: usize) -> Vec<Vec<usize>> {
    let mut members = vec![Vec::new(); surfaces];
    for (triangle, &surface) in mesh.surface.iter().enumerate() {
        members[surface as usize].push(triangle);
    }
    members
}

/// The radiance of a surface from the photographs; where none shows it, from its neighbourhood.
fn photographed(
    views: &Views,
    surface: usize,
    triangles: &[usize],
    edits: &Edits,
    watch: &Watch,
) -> Result<(Map, Vec<[Vec2; 3]>), Cancelled> {
    let mesh = &views.capture.mesh;
    let area_m2: f32 = triangles.iter().map(|&triangle| mesh.area(triangle)).sum();
    let size = TexelSize {
        texel_m: (area_m2.sqrt() / SHINING_SIDE).max(1e-6),
        max_side: 4 * SHINING_SIDE as usize,
    };
    let unwrap = unwrap(mesh, surface, false, size);
    let factor = edits.original_light as f32;
    let measured = points(views, &unwrap, &watch.within())?.into_iter().map(|point| {
        point.and_then(|point| views.radiance(point)).map(|value| value.map(|v| v * factor))
    });
    let texels = fill(measured.collect(), unwrap.width, [0.0; CHANNELS]);
    Ok((Map { width: unwrap.width, height: unwrap.height, texels }, unwrap.corners))
}

impl Part {
    /// `corners` are the texture coordinates of `triangles`.
    fn new(
        name: String,
        material: String,
        look: PartLook,
        mesh: &Mesh,
        triangles: &[usize],
        corners: Option<Vec<[Vec2; 3]>>,
    ) -> Self {
        let mut part = Self {
            name,
            material,
            positions: Vec::new(),
            texcoords: Vec::new(),
            triangles: Vec::new(),
            look,
            is_counted: false,
        };
        let mut known = HashMap::new();
        for (index, &triangle) in triangles.iter().enumerate() {
            let mut indices = [0; 3];
            for (k, &vertex) in mesh.triangles[triangle].iter().enumerate() {
                let uv = corners.as_ref().map_or(Vec2::ZERO, |corners| corners[index][k]);
                let key = (vertex, uv.x.to_bits(), uv.y.to_bits());
                indices[k] = *known.entry(key).or_insert_with(|| {
                    part.positions.push(mesh.positions[vertex as usize]);
                    if corners.is_some() {
                        part.texcoords.push(uv);
                    }
                    part.positions.len() as u32 - 1
                });
            }
            part.triangles.push(indices);
        }
        part
    }

    pub fn map(&self) -> Option<&Map> {
        match &self.look {
            PartLook::Plain(_) => None,
            PartLook::Textured(_, map) | PartLook::Shining(map) => Some(map),
        }
    }
}

/// Names that were given.
#[derive(Default)]
struct Names(HashMap<String, usize>);

impl Names {
    fn unused(&mut self, name: &str) -> String {
        let mut unused = name.to_owned();
        while self.0.contains_key(&unused) {
            let count = self.0.entry(name.to_owned()).or_insert(1);
            *count += 1;
            unused = format!("{name} ({count})");
        }
        self.0.insert(unused.clone(), 1);
        unused
    }
}
