//! The coverage mask and the lobes chosen from it (Section 4.2, Fig. 6).

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lobelia::reconstruct::lights::{LightKind, VirtualLight, VirtualLights};
use lobelia::reconstruct::lobes::{CoverageMask, LobeOptions, choose, coverage};
use lobelia::scene::Views;
use lobelia::watch::Watch;

use crate::rooms::{Room, Tracer, camera};

/// A horizontal square photographed from above, with a steep wide view of all of it.
fn patch(half: f64) -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.square(floor, half, 0.0);
    room
}

fn photograph_from(room: &mut Room, position: DVec3) {
    room.photograph(camera((80, 80), 0.4, position, DVec3::ZERO), |_| [0.5; 3]);
}

fn light(position: Vec3, normal: Vec3) -> VirtualLight {
    VirtualLight::disc(LightKind::Sphere, position, normal.normalize_or_zero(), 0.1)
}

fn mask_of(room: &Room, light: &VirtualLight, side: usize) -> CoverageMask {
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    coverage(&views, light, side, &Watch::new()).unwrap()
}

fn set_fraction(mask: &CoverageMask) -> f64 {
    mask.pixels.iter().filter(|set| **set).count() as f64 / mask.pixels.len() as f64
}

/// The number of pixels with a neighbour of the other kind.
fn boundary_pixels(mask: &CoverageMask) -> usize {
    let side = mask.side;
    let at = |x: usize, y: usize| mask.pixels[y * side + x];
    (0..side * side)
        .filter(|index| {
            let (x, y) = (index % side, index / side);
            let differs = |u: usize, v: usize| at(u, v) != at(x, y);
            (x > 0 && differs(x - 1, y))
                || (y > 0 && differs(x, y - 1))
                || (x + 1 < side && differs(x + 1, y))
                || (y + 1 < side && differs(x, y + 1))
        })
        .count()
}

/// Solid angle of the rectangle [x0, x1] × [y0, y1] in the plane at distance `d`.
fn rectangle_solid_angle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], d: f64) -> f64 {
    let corner = |x: f64, y: f64| (x * y / (d * (x * x + y * y + d * d).sqrt())).atan();
    corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)
}

#[test]
fn the_mask_covers_the_solid_angle_of_a_rectangle() {
    let half = 0.8;
    let mut room = patch(half);
    photograph_from(&mut room, DVec3::new(0.1, -0.2, 2.0));
    let side = 384;
    // Nearly straight above, aside, and with a tilted normal that still has all of the patch before it.
    for (position, normal) in [
        (Vec3::new(0.03, -0.05, 1.0), Vec3::new(0.05, 0.02, -1.0)),
        (Vec3::new(0.9, 0.4, 1.2), Vec3::new(-0.03, 0.07, -1.0)),
        (Vec3::new(-0.7, 0.5, 1.5), Vec3::new(0.3, -0.2, -1.0)),
    ] {
        let mask = mask_of(&room, &light(position, normal), side);
        let p = position.as_dvec3();
        let exact =
            rectangle_solid_angle([-half - p.x, half - p.x], [-half - p.y, half - p.y], p.z)
                / (2.0 * PI);
        // Only pixels on the rectangle's rim can be wrong: about half of those that are counted,
        // which lie on both sides of it. A rim pixel's centre decides for all of it. How the rim
        // cuts pixels is as good as random where it is aligned with nothing: a uniform error of
        // variance 1/12 of a pixel each, and five standard deviations of their sum.
        let rim = 0.5 * boundary_pixels(&mask) as f64;
        let bound = 5.0 * (rim / 12.0).sqrt() / (side * side) as f64;
        let found = set_fraction(&mask);
        assert!((found - exact).abs() <= bound, "{position}: {found} for {exact} ± {bound}");
        assert!(bound < 0.005 * exact, "the bound {bound} says nothing about {exact}");
    }
}

#[test]
fn what_no_camera_sees_is_not_covered() {
    let mut room = patch(0.8);
    photograph_from(&mut room, DVec3::new(0.1, -0.2, 2.0));
    // The underside of the patch.
    let below = light(Vec3::new(0.1, 0.0, -0.8), Vec3::Z);
    assert_eq!(set_fraction(&mask_of(&room, &below, 64)), 0.0);
    // The same light sees it when a camera stands below.
    photograph_from(&mut room, DVec3::new(0.1, -0.2, -2.0));
    assert!(set_fraction(&mask_of(&room, &below, 64)) > 0.2);
}

#[test]
fn the_far_side_of_an_occluder_is_not_covered() {
    // A wall across the floor hides the far half of it from the camera, but not from a light.
    let mut room = patch(0.8);
    let wall = room.untagged("wall");
    let height = 1.5;
    room.rectangle(
        wall,
        DVec3::new(-0.8, 0.0, 0.0),
        DVec3::new(1.6, 0.0, 0.0),
        DVec3::new(0.0, 0.0, height),
    );
    let eye = DVec3::new(0.0, -2.0, 0.7);
    room.photograph(camera((120, 120), 0.6, eye, DVec3::new(0.0, 0.0, 0.3)), |_| [0.5; 3]);
    // Lower than the wall on both sides of it.
    let far = light(Vec3::new(0.05, 0.7, 0.6), -Vec3::Z);
    assert_eq!(set_fraction(&mask_of(&room, &far, 64)), 0.0, "it is all in the wall's shadow");
    let near = light(Vec3::new(0.05, -0.4, 0.6), -Vec3::Z);
    let mask = mask_of(&room, &near, 64);
    // Half of the floor, from y = −0.8 to the wall, is all that is covered of the plane below;
    // the wall itself fills what the light sees beyond: above, too.
    let tracer = Tracer::new(&room.capture.mesh);
    let floor = rectangle_solid_angle([-0.85, 0.75], [-0.4, 0.4], 0.6) / (2.0 * PI);
    assert!(set_fraction(&mask) > floor - 4.0 / 64.0);
    assert!(tracer.nearest(near.position.as_dvec3(), DVec3::Y).is_some());
}

#[test]
fn pixels_that_are_no_measurement_cover_nothing() {
    let mut room = patch(0.8);
    let camera = camera((80, 80), 0.4, DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO);
    // The image's left half is not a number; up is +y, so that is x < 0 on the floor.
    let pixels = (0..6400).map(|i| if i % 80 < 40 { [f32::NAN; 3] } else { [0.5; 3] }).collect();
    room.photograph_of(camera, pixels, None);
    let side = 256;
    let mask = mask_of(&room, &light(Vec3::new(0.0, 0.0, 1.0), -Vec3::Z), side);
    let exact = rectangle_solid_angle([0.0, 0.8], [-0.8, 0.8], 1.0) / (2.0 * PI);
    // Rim pixels, half of those counted, are off by half of themselves at most. On the line
    // between the halves the photograph's pixel decides, whose border the line is.
    let bound = 0.25 * boundary_pixels(&mask) as f64 / (side * side) as f64;
    assert!((set_fraction(&mask) - exact).abs() <= bound);
}

#[test]
fn lobes_point_at_what_is_covered() {
    let half = 0.6;
    let mut room = patch(half);
    photograph_from(&mut room, DVec3::new(0.1, -0.2, 2.0));
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let mut lights = VirtualLights {
        lights: vec![
            light(Vec3::new(0.3, 0.2, 1.0), Vec3::new(-0.3, -0.2, -1.0)),
            // Turned away: no lobe, and the light is dropped.
            light(Vec3::new(0.0, 0.0, 1.0), Vec3::Z),
            light(Vec3::new(-1.0, 0.5, 0.8), Vec3::new(1.0, -0.5, -0.8)),
        ],
        spacing_m: 1.0,
        sphere_center: Vec3::ZERO,
        sphere_radius_m: 1.5,
    };
    let options = LobeOptions { exponent: 13.0, ..LobeOptions::default() };
    let lobes = choose(&views, &mut lights, &options, &Watch::new()).unwrap();
    assert_eq!(lights.lights.len(), 2);
    assert_eq!(lobes.first.len(), 3);
    assert_eq!(*lobes.first.last().unwrap(), lobes.lobes.len());
    for (index, light) in lights.lights.iter().enumerate() {
        let own = lobes.of(index);
        assert!((2..=36).contains(&own.len()), "{} lobes", own.len());
        for lobe in &lobes.lobes[own] {
            assert_eq!(lobe.light, index);
            assert_eq!(lobe.exponent, 13.0);
            assert!((lobe.direction.length() - 1.0).abs() < 1e-5);
            assert!(lobe.direction.dot(light.normal) > 0.0);
            let t = -light.position.z / lobe.direction.z;
            let p = light.position + t * lobe.direction;
            // A centroid lies in its pixels' convex hull. The map from the mask to the floor is
            // curved, within a region of a sixth of the mask by a few per cent.
            let reach = f64::from(p.x.abs().max(p.y.abs()));
            assert!(t > 0.0 && reach < half * 1.05, "a lobe points to {p}");
        }
    }
}
