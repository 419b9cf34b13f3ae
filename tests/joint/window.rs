//! A sun that shines in through an opening, in a room with a lamp: it lights a few patches, in which
//! photographs are several times brighter than elsewhere.

use glam::DVec3;
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::Reconstruction;
use lobelia::reconstruct::lights::LightKind;

use crate::lights::{FLOOR, options, sky};
use crate::rooms::{Room, Tracer, camera, run};

const LOW: DVec3 = DVec3::new(-0.35, -0.3, 0.0);
const HIGH: DVec3 = DVec3::new(0.3, 0.35, 0.6);
const BOX: Rgb = [0.05, 0.10, 0.13];
const WALL: Rgb = [0.10, 0.11, 0.10];
/// The wall is at this y; the opening in it, in x and z.
const WALL_Y: f64 = -1.3;
const OPENING: [[f64; 2]; 2] = [[-0.45, 0.45], [0.7, 1.4]];
const LAMP: DVec3 = DVec3::new(0.5, 0.6, 1.5);
/// Brighter than the lamp where it shines, but not so bright that the light that its patches send on, which
/// these photographs lack, would count.
const SUN: Rgb = [3.0, 2.7, 2.25];

/// A floor with a box before a wall with an opening, lit by the lamp, a dim sky and, from `towards`, by the
/// sun.
fn room(towards: Option<DVec3>) -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    let sides = room.diffuse("box");
    let wall = room.diffuse("wall");
    room.square(floor, 1.5, 0.0);
    room.open_box(sides, LOW, HIGH);
    let [[left, right], [low, high]] = OPENING;
    for ([x0, x1], [z0, z1]) in [
        ([-1.5, left], [0.0, 1.8]),
        ([right, 1.5], [0.0, 1.8]),
        ([left, right], [0.0, low]),
        ([left, right], [high, 1.8]),
    ] {
        let corner = DVec3::new(x0, WALL_Y, z0);
        room.rectangle(wall, corner, DVec3::Z * (z1 - z0), DVec3::X * (x1 - x0));
    }
    // The scale is left to a pin: without light between surfaces nothing else tells it.
    room.capture.materials[floor].known_diffuse = Some(FLOOR);
    let tracer = Tracer::new(&room.capture.mesh);
    let irradiance = |p: DVec3, normal: DVec3| -> Rgb {
        let offset = LAMP - p;
        let cosine = normal.dot(offset.normalize_or_zero()).max(0.0);
        let is_lit = cosine > 0.0 && tracer.is_free(p, LAMP, 1e-4);
        let lamp = if is_lit { 4.5 * cosine / offset.length_squared() } else { 0.0 };
        let sun = towards.map_or(0.0, |towards| {
            let cosine = normal.dot(towards).max(0.0);
            let is_lit = cosine > 0.0 && tracer.is_free(p, p + 20.0 * towards, 1e-4);
            if is_lit { cosine } else { 0.0 }
        });
        let sky = 0.1 * sky(&tracer, p, normal);
        SUN.map(|e| sky + lamp + e * sun)
    };
    for position in
        [DVec3::new(1.5, -1.1, 1.5), DVec3::new(-1.4, -0.9, 1.6), DVec3::new(-0.3, 1.9, 1.5)]
    {
        let camera = camera((240, 180), 0.8, position, DVec3::new(0.0, -0.2, 0.3));
        room.photograph(camera, |struck| {
            let p = struck.position;
            let close = |a: f64, b: f64| (a - b).abs() < 1e-5;
            let (normal, reflectance) = if struck.surface == floor {
                (DVec3::Z, FLOOR)
            } else if struck.surface == wall {
                (DVec3::Y, WALL)
            } else if close(p.z, HIGH.z) {
                (DVec3::Z, BOX)
            } else if close(p.x, HIGH.x) {
                (DVec3::X, BOX)
            } else if close(p.x, LOW.x) {
                (DVec3::NEG_X, BOX)
            } else if close(p.y, HIGH.y) {
                (DVec3::Y, BOX)
            } else {
                (DVec3::NEG_Y, BOX)
            };
            let light = irradiance(p, normal);
            std::array::from_fn(|c| (reflectance[c] / std::f64::consts::PI * light[c]) as f32)
        });
    }
    room
}

/// Unit directions towards the suns that were found.
fn suns(result: &Reconstruction) -> Vec<DVec3> {
    let lights = result.lights.lights.iter();
    lights.filter(|l| l.kind == LightKind::Sun).map(|l| -l.normal.as_dvec3()).collect()
}

fn assert_reflectances(result: &Reconstruction, within: f64) {
    for (material, truth) in [BOX, WALL].into_iter().enumerate() {
        let found = result.solution.reflectances[material + 1].unwrap().diffuse;
        for c in 0..3 {
            assert!((found[c] - truth[c]).abs() < within, "{found:?} for {truth:?}");
        }
    }
}

#[test]
fn a_sun_that_shines_in_through_an_opening_is_found_beside_a_lamp() {
    let towards = DVec3::new(0.15, -0.8, 0.6).normalize();
    let result = run(&room(Some(towards)), &options()).unwrap();
    let suns = suns(&result);
    assert_eq!(suns.len(), 1, "{:?}", result.solution.notes);
    let off = suns[0].dot(towards).clamp(-1.0, 1.0).acos().to_degrees();
    assert!(off < 0.5, "{off}° off");
    assert_reflectances(&result, 0.02);
}

#[test]
fn no_sun_is_found_where_a_lamp_alone_shines() {
    let result = run(&room(None), &options()).unwrap();
    assert!(suns(&result).is_empty(), "{:?}", result.solution.notes);
    assert_reflectances(&result, 0.02);
}
