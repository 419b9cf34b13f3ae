//! Finds the object under the pointer, by rays on the CPU.

use std::collections::BTreeSet;

use glam::{Vec2, Vec3};

use crate::app::viewport::content::Hovered;
use crate::app::viewport::marks::placed;
use crate::app::viewport::projection::Projection;
use crate::geometry::bvh::{Hit, Ray, RayCaster};
use crate::reconstruct::lights::VirtualLights;
use crate::scene::{Capture, Image, Role};

/// How near to a mark a click has to be, in points.
pub const REACH: f32 = 8.0;
/// Surfaces that a ray passes because they are hidden, before it gives up.
const MOST_PASSED: usize = 256;
/// Triangles of a surface that are tried, evenly spread, before it counts as covered.
const MOST_TRIED: usize = 256;

/// The known geometry as rays meet it, without what is hidden.
pub struct Picker<'a> {
    pub capture: &'a Capture,
    pub caster: &'a RayCaster,
    pub hidden: &'a BTreeSet<usize>,
}

impl Picker<'_> {
    pub fn closest(&self, mut ray: Ray) -> Option<Hit> {
        for _ in 0..MOST_PASSED {
            let hit = self.caster.closest(&ray)?;
            let surface = self.capture.mesh.surface[hit.triangle as usize] as usize;
            if !self.hidden.contains(&surface) {
                return Some(hit);
            }
            ray.t_min = hit.t + (1e-5 * hit.t).max(1e-6);
        }
        None
    }

    /// The surface under a position in points, the place in metres and the triangle.
    pub fn under(&self, projection: &Projection, position: Vec2) -> Option<(usize, Vec3, usize)> {
        let ray = projection.ray(position);
        let hit = self.closest(ray)?;
        let triangle = hit.triangle as usize;
        let surface = self.capture.mesh.surface[triangle] as usize;
        Some((surface, ray.origin + ray.direction * hit.t, triangle))
    }

    /// Whether nothing that is drawn lies between the eye and a place that is drawn at a position.
    pub fn is_visible(&self, projection: &Projection, position: Vec2, place: Vec3) -> bool {
        let ray = projection.ray(position);
        let distance = (place - ray.origin).dot(ray.direction);
        self.closest(ray).is_none_or(|hit| hit.t > distance * 0.99 - 1e-4)
    }

    /// The visible one of some marks that is drawn nearest to a position.
    pub fn nearest(
        &self,
        projection: &Projection,
        position: Vec2,
        marks: impl Iterator<Item = Vec3>,
    ) -> Option<usize> {
        let mut near: Vec<(f32, usize, Vec2, Vec3)> = marks
            .enumerate()
            .filter_map(|(index, mark)| {
                let drawn = projection.project(mark)?;
                let away = drawn.distance(position);
                (away <= REACH).then_some((away, index, drawn, mark))
            })
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.into_iter()
            .find(|(_, _, drawn, mark)| self.is_visible(projection, *drawn, *mark))
            .map(|(_, index, ..)| index)
    }

    /// The nearest light whose front is drawn at a position, or else the one whose centre is near.
    /// Backs of lights between the eye and the scene are all but invisible: those let a click pass.
    pub fn light(
        &self,
        projection: &Projection,
        position: Vec2,
        lights: &VirtualLights,
    ) -> Option<usize> {
        let ray = projection.ray(position);
        let covered = self.closest(ray).map_or(f32::INFINITY, |hit| hit.t);
        let placed = || lights.lights.iter().map(|light| placed(Some(self.capture), lights, light));
        let hit = placed()
            .zip(&lights.lights)
            .enumerate()
            .filter_map(|(index, ((center, is_ball, radius), light))| {
                let normal = if is_ball { -ray.direction } else { light.normal };
                let towards = -ray.direction.dot(normal);
                let t = (ray.origin - center).dot(normal) / towards;
                let is_hit = towards > 0.0
                    && t > ray.t_min
                    && t * 0.99 - 1e-4 < covered
                    && (ray.origin + ray.direction * t).distance(center) <= radius;
                is_hit.then_some((t, index))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match hit {
            Some((_, index)) => Some(index),
            None => self.nearest(projection, position, placed().map(|(center, ..)| center)),
        }
    }

    /// The surfaces of which the centre of a triangle is visible inside a box.
    pub fn inside(&self, projection: &Projection, low: Vec2, high: Vec2) -> BTreeSet<usize> {
        let mesh = &self.capture.mesh;
        let mut within: Vec<Vec<(Vec2, Vec3)>> = vec![Vec::new(); self.capture.surfaces.len()];
        for (triangle, &surface) in mesh.surface.iter().enumerate() {
            if self.hidden.contains(&(surface as usize)) {
                continue;
            }
            let center = mesh.corners(triangle).iter().sum::<Vec3>() / 3.0;
            let Some(drawn) = projection.project(center) else { continue };
            if drawn.cmpge(low).all() && drawn.cmple(high).all() {
                within[surface as usize].push((drawn, center));
            }
        }
        // Neighbours in the file are neighbours in space, so that the first ones may all be covered.
        let is_seen = |centers: &Vec<(Vec2, Vec3)>| {
            let step = centers.len().div_ceil(MOST_TRIED).max(1);
            centers
                .iter()
                .step_by(step)
                .any(|(drawn, center)| self.is_visible(projection, *drawn, *center))
        };
        (0..within.len()).filter(|surface| is_seen(&within[*surface])).collect()
    }

    /// The value under the cursor, read from the first of some photographs that sees the place.
    pub fn value(
        &self,
        projection: &Projection,
        position: Vec2,
        photographs: impl Iterator<Item = usize>,
    ) -> Option<Hovered> {
        let (surface, place, triangle) = self.under(projection, position)?;
        let normal = self.capture.mesh.normal(triangle);
        let normal =
            if normal.dot(projection.ray(position).direction) > 0.0 { -normal } else { normal };
        let mut photographs = photographs;
        let seen = photographs
            .find_map(|photograph| Some((self.pixel(photograph, place, normal)?, photograph)));
        let radiance = seen
            .and_then(|((image, [x, y]), photograph)| Some((image.radiance(x, y)?, photograph)));
        let material = match self.capture.surfaces[surface].role {
            Role::Material(material) => Some(material),
            _ => None,
        };
        let no_measurement = seen.map(|(_, photograph)| photograph).filter(|_| radiance.is_none());
        Some(Hovered { surface, position: place, material, radiance, no_measurement })
    }

    /// The pixel in which a photograph shows a side of a place; `None` where it does not see it.
    fn pixel(&self, photograph: usize, place: Vec3, normal: Vec3) -> Option<(&Image, [usize; 2])> {
        let photograph = self.capture.photographs.get(photograph)?;
        let image = photograph.image.as_deref()?;
        let towards = photograph.camera.position.as_vec3() - place;
        if towards.dot(normal) <= 0.0 {
            return None;
        }
        let (pixel, distance) = photograph.camera.project(place.as_dvec3())?;
        let distance = distance as f32;
        let direction = towards / distance;
        let offset = 1e-4 * distance;
        let ray = Ray {
            origin: place + normal * offset,
            direction,
            t_min: 0.0,
            t_max: distance - offset,
        };
        if self.caster.occluded(&ray) {
            return None;
        }
        Some((image, [pixel.x as usize, pixel.y as usize]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::viewport::camera::{Side, ViewCamera};
    use std::sync::Arc;

    use crate::geometry::mesh::Mesh;
    use crate::scene::Surface;

    /// Two squares of side 2 about the z axis: surface 0 on the ground, surface 1 a metre above.
    fn capture() -> Capture {
        let square = |z: f32| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, z))
        };
        let surface =
            |name: &str| Surface { name: name.into(), role: Role::Untagged, has_texcoords: false };
        Capture {
            mesh: Arc::new(Mesh {
                positions: [square(0.0), square(1.0)].concat(),
                triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
                surface: vec![0, 0, 1, 1],
                polygon: vec![0, 0, 1, 1],
                texcoords: Vec::new(),
            }),
            surfaces: vec![surface("low"), surface("high")],
            ..Capture::default()
        }
    }

    #[test]
    fn hidden_and_covered_surfaces_are_told_apart() {
        let capture = capture();
        let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
        let mut camera = ViewCamera { distance: 6.0, ..ViewCamera::default() };
        camera.turn_to(Side::Top);
        let size = Vec2::splat(500.0);
        let projection = camera.projection(size, (Vec3::ZERO, 2.0));
        let shown = BTreeSet::new();
        let picker = Picker { capture: &capture, caster: &caster, hidden: &shown };
        let middle = Vec2::new(251.0, 247.0);
        let (surface, place, _) = picker.under(&projection, middle).unwrap();
        assert!(surface == 1 && (place.z - 1.0).abs() < 1e-4);
        assert_eq!(picker.inside(&projection, Vec2::ZERO, size), BTreeSet::from([1]));
        assert!(picker.under(&projection, Vec2::splat(3.0)).is_none());
        let marks = [Vec3::ZERO, Vec3::Z];
        assert_eq!(picker.nearest(&projection, 0.5 * size, marks.into_iter()), Some(1));
        assert_eq!(picker.nearest(&projection, 0.5 * size, [Vec3::ZERO].into_iter()), None);

        let hidden = BTreeSet::from([1]);
        let picker = Picker { capture: &capture, caster: &caster, hidden: &hidden };
        assert_eq!(picker.under(&projection, middle).unwrap().0, 0);
        assert_eq!(picker.inside(&projection, Vec2::ZERO, size), BTreeSet::from([0]));
        assert_eq!(picker.value(&projection, middle, 0..0).unwrap().radiance, None);
    }
}
