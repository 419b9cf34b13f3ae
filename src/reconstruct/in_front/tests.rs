//! A floor under cameras that stand around it, with a red cube that the mesh lacks.

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::*;
use crate::geometry::bvh::RayCaster;
use crate::geometry::mesh::Mesh;
use crate::math::rgb::Radiance;
use crate::scene::{Camera, Distortion, Image, Photograph, Role, Surface};

const SIDE: usize = 80;
const FLOOR: Radiance = [0.3, 0.28, 0.25];
const CUBE: Radiance = [0.4, 0.08, 0.05];

fn camera(index: usize) -> Camera {
    let angle = index as f64;
    let position = DVec3::new(2.4 * angle.cos(), 2.4 * angle.sin(), 1.7);
    let back = (position - DVec3::new(0.0, 0.0, 0.1)).normalize_or_zero();
    let right = DVec3::Z.cross(back).normalize_or_zero();
    let axes = DMat3::from_cols(right, back.cross(right), back);
    let middle = DVec2::splat(0.5 * SIDE as f64);
    let focal = DVec2::splat(80.0);
    Camera::new((SIDE, SIDE), focal, middle, Distortion::default(), axes, position)
}

/// Whether a ray meets the cube of 0.6 m that stands on the floor.
fn meets_cube(from: DVec3, direction: DVec3) -> bool {
    let (least, most) = (DVec3::new(-0.3, -0.3, 0.0), DVec3::new(0.3, 0.3, 0.6));
    let (a, b) = ((least - from) / direction, (most - from) / direction);
    a.min(b).max_element() < a.max(b).min_element()
}

fn capture(has_cube: bool) -> Capture {
    let corner = |x: f32, y: f32| Vec3::new(9.0 * x, 9.0 * y, 0.0);
    let mesh = Mesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        surface: vec![0, 0],
        polygon: vec![0, 0],
        ..Mesh::default()
    };
    let photograph = |index: usize| {
        let camera = camera(index);
        let shown = |pixel: usize| {
            let place = DVec2::new((pixel % SIDE) as f64 + 0.5, (pixel / SIDE) as f64 + 0.5);
            let direction = camera.direction(place).unwrap();
            if has_cube && meets_cube(camera.position, direction) { CUBE } else { FLOOR }
        };
        let pixels = (0..SIDE * SIDE).map(shown).collect();
        let image = Some(Arc::new(Image::new(SIDE, SIDE, pixels, None)));
        Photograph { name: format!("{index}.exr"), camera, image, display: None }
    };
    let surface = Surface { name: "floor".into(), role: Role::Untagged, has_texcoords: false };
    Capture {
        mesh: Arc::new(mesh),
        surfaces: vec![surface],
        photographs: (0..6).map(photograph).collect(),
        ..Capture::default()
    }
}

fn found(capture: &Capture, with_things: bool) -> InFront {
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(capture, &caster, &Watch::new()).unwrap();
    find(&views, with_things, &Watch::new()).unwrap()
}

#[test]
fn pixels_of_a_cube_that_is_not_modelled_are_left_out() {
    let capture = capture(true);
    let in_front = found(&capture, true);
    let left = in_front.capture.unwrap();
    let (mut cube, mut cube_left, mut floor, mut floor_left) = (0, 0, 0, 0);
    for (before, after) in capture.photographs.iter().zip(&left.photographs) {
        let (before, after) = (before.image.as_ref().unwrap(), after.image.as_ref().unwrap());
        for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
            let is_left = usize::from(after.radiance(x, y).is_some());
            if before.radiance(x, y) == Some(CUBE) {
                (cube, cube_left) = (cube + 1, cube_left + is_left);
            } else {
                (floor, floor_left) = (floor + 1, floor_left + is_left);
            }
        }
    }
    assert!(cube > 1000 && cube_left * 4 < cube, "{cube_left} of {cube}");
    assert!(floor_left * 100 > floor * 94, "{floor_left} of {floor}");
    let things = in_front.found.things.clone().unwrap();
    let part = (cube + floor - cube_left - floor_left) as f64 / (cube + floor) as f64;
    assert!((things.share - part).abs() < 1e-9, "{} and {part}", things.share);
    let note = in_front.found.note().unwrap();
    assert!(note.contains(&format!("{:.1} % of the photographs", 100.0 * part)), "{note}");
    assert!(note.contains(&things.most.0), "{note}");
}

#[test]
fn a_photograph_that_has_a_mask_keeps_it() {
    let mut capture = capture(true);
    Arc::make_mut(capture.photographs[2].image.as_mut().unwrap()).mask(|x, y| x < 3 && y < 3);
    let left = found(&capture, true).capture.unwrap();
    let masked = |index: usize| left.photographs[index].image.as_ref().unwrap().masked_count();
    assert_eq!(masked(2), 9);
    assert!(masked(1) > 100 && masked(3) > 100, "{} and {}", masked(1), masked(3));
}

#[test]
fn nothing_is_left_out_where_nothing_is_or_nobody_asks() {
    for (has_cube, with_things) in [(true, false), (false, true)] {
        let in_front = found(&capture(has_cube), with_things);
        assert_eq!(in_front.found, Found::default());
        assert!(in_front.capture.is_none() && in_front.found.note().is_none());
    }
}
