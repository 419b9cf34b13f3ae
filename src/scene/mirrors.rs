//! Mirrors and clear glass: surfaces that have no radiance of their own.

use crate::geometry::bvh::{Hit, Ray, RayCaster};
use crate::geometry::mesh::Mesh;
use crate::math::rgb::Radiance;
use crate::math::sampling::mirrored;
use crate::scene::{Capture, Views};

/// Optical behaviour of a material's surfaces besides reflection by a BRDF.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Optics {
    /// Nothing: it has a BRDF.
    #[default]
    Opaque,
    /// A mirror, with the part of the light per channel that it reflects.
    Mirror(Radiance),
    /// Clear glass with an index of refraction of 1.5, too thin to shift what lies behind it.
    Glass,
}

/// The mirrors and the glass of a capture, and its geometry without the glass.
pub struct MirrorsAndGlass {
    /// Per material; materials beyond its end are opaque.
    pub optics: Vec<Optics>,
    /// `None` without any glass.
    pub caster: Option<RayCaster>,
}

/// Mirrors that a ray of light is followed over.
const MOST_MIRRORS: usize = 4;

impl Optics {
    /// Of a triangle of a capture, by what is known of each material.
    pub fn of(capture: &Capture, optics: &[Self], triangle: u32) -> Self {
        let material = capture.material_of(triangle);
        material.and_then(|material| optics.get(material).copied()).unwrap_or_default()
    }
}

impl MirrorsAndGlass {
    pub fn new(capture: &Capture, optics: Vec<Optics>) -> Self {
        let caster = without_glass(capture, &optics, &capture.mesh);
        Self { optics, caster }
    }
}

/// The triangles of a mesh, which begin with those of a capture, without the glass; `None` where
/// there is none.
pub fn without_glass(capture: &Capture, optics: &[Optics], mesh: &Mesh) -> Option<RayCaster> {
    if !optics.contains(&Optics::Glass) {
        return None;
    }
    let known = capture.mesh.triangles.len();
    let triangle = |(index, &corners): (usize, &[u32; 3])| {
        let is_glass = index < known && Optics::of(capture, optics, index as u32) == Optics::Glass;
        // Triangles keep their numbers; one without area is never hit.
        if is_glass { [corners[0]; 3] } else { corners }
    };
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().enumerate().map(triangle).collect();
    Some(RayCaster::build(&mesh.positions, &triangles))
}

impl<'a> Views<'a> {
    /// The same with mirrors, and with glass that light passes.
    pub fn through(self, found: &'a MirrorsAndGlass) -> Self {
        let caster = found.caster.as_ref().unwrap_or(self.caster);
        Self { caster, optics: &found.optics, ..self }
    }

    pub fn optics(&self, triangle: u32) -> Optics {
        Optics::of(self.capture, self.optics, triangle)
    }

    /// What a ray of light meets, by way of mirrors: its last stretch, the hit, and the part of the
    /// light per channel that the mirrors reflect.
    pub fn met(&self, ray: Ray) -> Option<(Ray, Hit, Radiance)> {
        let (mut ray, mut part) = (ray, [1.0; 3]);
        for _ in 0..=MOST_MIRRORS {
            let hit = self.caster.closest(&ray)?;
            let Optics::Mirror(reflected) = self.optics(hit.triangle) else {
                return Some((ray, hit, part));
            };
            part = std::array::from_fn(|c| part[c] * reflected[c]);
            let point = self.surface_point(&ray, &hit);
            ray = self.ray(point, mirrored(-ray.direction, point.normal));
        }
        None
    }
}
