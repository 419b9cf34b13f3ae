//! Ray casting: closest hit and occlusion. The only file that names `obvhs`.

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::triangle::Triangle;
use rayon::prelude::*;

/// A segment of a half-line: hits with `t_min <= t < t_max` count.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    /// Unit length, so that `t` is in metres.
    pub direction: Vec3,
    pub t_min: f32,
    pub t_max: f32,
}

/// Where a ray meets a triangle, at `(1 − u − v) a + u b + v c`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub t: f32,
    pub triangle: u32,
    pub u: f32,
    pub v: f32,
}

/// The triangles in a bounding volume hierarchy.
pub struct RayCaster {
    bvh: Bvh2,
    corners: Vec<[Vec3; 3]>,
}

impl RayCaster {
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let corners: Vec<[Vec3; 3]> =
            triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let boxed: Vec<Triangle> = corners
            .iter()
            .map(|[a, b, c]| Triangle { v0: (*a).into(), v1: (*b).into(), v2: (*c).into() })
            .collect();
        let bvh = obvhs::bvh2::builder::build_bvh2_from_tris(
            &boxed,
            BvhBuildParams::medium_build(),
            &mut Default::default(),
        );
        Self { bvh, corners }
    }

    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut best = RayHit::none();
        let mut found = None;
        let r = ObvhsRay::new(
            Vec3A::from(ray.origin),
            Vec3A::from(ray.direction),
            ray.t_min,
            ray.t_max,
        );
        self.bvh.ray_traverse(r, &mut best, |r, i| {
            let triangle = self.bvh.primitive_indices[i];
            match intersect(&self.corners[triangle as usize], ray, r.tmax) {
                Some((t, u, v)) => {
                    found = Some(Hit { t, triangle, u, v });
                    t
                }
                None => f32::INFINITY,
            }
        });
        found
    }

    pub fn occluded(&self, ray: &Ray) -> bool {
        let r = ObvhsRay::new(
            Vec3A::from(ray.origin),
            Vec3A::from(ray.direction),
            ray.t_min,
            ray.t_max,
        );
        !self.bvh.ray_traverse_miss(r, |r, i| {
            let triangle = self.bvh.primitive_indices[i];
            match intersect(&self.corners[triangle as usize], ray, r.tmax) {
                Some((t, _, _)) => t,
                None => f32::INFINITY,
            }
        })
    }

    pub fn closest_batch(&self, rays: &[Ray]) -> Vec<Option<Hit>> {
        rays.par_iter().with_min_len(256).map(|ray| self.closest(ray)).collect()
    }

    pub fn occluded_batch(&self, rays: &[Ray]) -> Vec<bool> {
        rays.par_iter().with_min_len(256).map(|ray| self.occluded(ray)).collect()
    }
}

fn intersect(&[a, b, c]: &[Vec3; 3], ray: &Ray, t_max: f32) -> Option<(f32, f32, f32)> {
    let (ab, ac) = (b - a, c - a);
    let p = ray.direction.cross(ac);
    let det = ab.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = ray.origin - a;
    let u = s.dot(p) / det;
    let q = s.cross(ab);
    let v = ray.direction.dot(q) / det;
    let t = ac.dot(q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= ray.t_min && t < t_max).then_some((t, u, v))
}
