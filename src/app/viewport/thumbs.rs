//! The photographs in the frusta of their cameras. They use the textures that colour the mesh, so
//! they need no textures of their own.

use glam::Vec3;

use crate::app::viewport::gpu::Thumb;
use crate::app::viewport::marks;
use crate::geometry::bvh::Ray;
use crate::scene::{Camera, Capture};

/// Of a selected photograph, as a multiple of the others.
const SELECTED: f32 = 1.3;

/// How deep a frustum is drawn, in metres: as many photographs are there, as small is each.
pub fn depth(photographs: usize, scene_radius: f32) -> f32 {
    let crowd = (photographs as f32 / 8.0).max(1.0).sqrt();
    (0.09 / crowd).max(0.02) * scene_radius
}

/// The same of one of them.
pub fn depth_of(photograph: usize, selected: Option<usize>, depth: f32) -> f32 {
    if selected == Some(photograph) { SELECTED * depth } else { depth }
}

/// The pictures of the photographs that lie in layers of the texture.
pub fn thumbs(
    capture: &Capture,
    layers: impl Iterator<Item = (usize, usize)>,
    selected: Option<usize>,
    [accent, plain]: [[f32; 4]; 2],
    depth: f32,
) -> Vec<Thumb> {
    let thumb = |(layer, photograph): (usize, usize)| {
        let is_selected = selected == Some(photograph);
        let depth = depth_of(photograph, selected, depth);
        let [corner, right, down] = place(&capture.photographs[photograph].camera, depth);
        Thumb {
            corner: corner.to_array(),
            layer: layer as u32,
            right: right.to_array(),
            down: down.to_array(),
            frame: if is_selected { accent } else { plain },
            width: if is_selected { 2.5 } else { 1.0 },
        }
    };
    layers.map(thumb).collect()
}

/// The upper left corner of a picture and its sides to the right and down.
fn place(camera: &Camera, depth: f32) -> [Vec3; 3] {
    let [corner, right, _, down] = marks::image_corners(camera, depth);
    [corner, right - corner, down - corner]
}

/// Where along a ray a camera's picture is met.
pub fn hit(camera: &Camera, depth: f32, ray: &Ray) -> Option<f32> {
    let [corner, right, down] = place(camera, depth);
    let normal = right.cross(down);
    let t = (corner - ray.origin).dot(normal) / ray.direction.dot(normal);
    let at = ray.origin + ray.direction * t - corner;
    let (u, v) = (at.dot(right) / right.length_squared(), at.dot(down) / down.length_squared());
    let is_inside = (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
    // Not a number, which is in no range, where the picture is seen from its edge.
    (t > ray.t_min && is_inside).then_some(t)
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec2, DVec3};

    use super::*;
    use crate::scene::Distortion;

    #[test]
    fn a_picture_is_met_where_it_is_drawn_and_from_both_sides() {
        // Looks along -z from the origin; 2 by 1 at 1 m.
        let camera = Camera::new(
            (200, 100),
            DVec2::splat(100.0),
            DVec2::new(100.0, 50.0),
            Distortion::default(),
            DMat3::IDENTITY,
            DVec3::ZERO,
        );
        let ray = |origin, direction| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        let met = |origin, direction| hit(&camera, 0.5, &ray(origin, direction));
        let near = |t: Option<f32>, right: f32| t.is_some_and(|t| (t - right).abs() < 1e-5);
        assert!(near(met(Vec3::ZERO, -Vec3::Z), 0.5));
        assert!(near(met(Vec3::new(0.0, 0.0, -2.0), Vec3::Z), 1.5));
        // Half as wide as deep to each side, and a quarter high.
        assert!(met(Vec3::new(0.49, 0.24, 0.0), -Vec3::Z).is_some());
        assert_eq!(met(Vec3::new(0.51, 0.0, 0.0), -Vec3::Z), None);
        assert_eq!(met(Vec3::new(0.0, 0.26, 0.0), -Vec3::Z), None);
        assert_eq!(met(Vec3::ZERO, Vec3::Z), None);
        assert_eq!(met(Vec3::new(0.0, 0.0, -0.5), Vec3::X), None);
        let [corner, right, down] = place(&camera, 0.5);
        assert!(corner.distance(Vec3::new(-0.5, 0.25, -0.5)) < 1e-5, "{corner}");
        assert!(right.distance(Vec3::X) < 1e-5 && down.distance(-0.5 * Vec3::Y) < 1e-5);
    }

    #[test]
    fn many_photographs_are_drawn_small() {
        assert_eq!(depth(6, 2.0), depth(8, 2.0));
        assert!(depth(32, 2.0) < 0.6 * depth(8, 2.0) && depth(100_000, 2.0) > 0.0);
    }
}
