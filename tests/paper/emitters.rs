//! Luminaires of known shape: irradiance against closed forms and quadrature in double precision.
//!
//! Estimates are compared by a z-test: the mean of many independent ones must lie within four of
//! its standard errors (chance fails one such test in 16,000; seeds are fixed, so none fails by
//! chance twice), and that standard error must be small enough for the test to tell anything.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3};
use lobelia::math::sampling::Random;
use lobelia::scene::{Dome, Emitter, Image, SurfacePoint, Views};
use lobelia::watch::Watch;

use crate::rooms::Room;

const RUNS: u64 = 64;

/// Mean and standard error over independent estimates.
fn estimated(room: &Room, light: &Emitter, point: SurfacePoint, side: usize) -> (f64, f64) {
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let runs: Vec<f64> = (0..RUNS)
        .map(|run| f64::from(light.irradiance(&views, point, side, &mut Random::new(run, 5, 0))))
        .collect();
    let mean = runs.iter().sum::<f64>() / RUNS as f64;
    let variance = runs.iter().map(|run| (run - mean).powi(2)).sum::<f64>() / (RUNS - 1) as f64;
    (mean, (variance / RUNS as f64).sqrt())
}

fn agrees(room: &Room, light: &Emitter, point: SurfacePoint, expected: f64) {
    let (mean, error) = estimated(room, light, point, 16);
    assert!(error <= 5e-3 * expected, "{light:?}: {mean} ± {error} tells nothing of {expected}");
    // Single precision adds what the spread over the runs does not show.
    let tolerance = 4.0 * error + 3e-6 * expected;
    assert!((mean - expected).abs() <= tolerance, "{light:?}: {mean} ± {error}, not {expected}");
}

/// A floor far below, so that there is geometry that shades nothing.
fn empty() -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.square(floor, 1.0, -3.0);
    room
}

/// Geometry that hides what is above `z` and on the side x < 0 of a surface point at the origin.
fn half_hidden(z: f64) -> Room {
    let mut room = empty();
    let blind = room.diffuse("blind");
    room.rectangle(blind, DVec3::new(-9.0, -9.0, z), DVec3::X * 9.0, DVec3::Y * 18.0);
    room
}

fn surface_point(normal: Vec3) -> SurfacePoint {
    SurfacePoint { position: Vec3::ZERO, normal: normal.normalize_or_zero() }
}

fn panel(corners: [DVec3; 4], normal: DVec3) -> Emitter {
    Emitter::Rectangle {
        corners: corners.map(|corner| corner.as_vec3()),
        normal: normal.normalize_or_zero().as_vec3(),
    }
}

/// The rectangle [x0, x1] × [y0, y1] at a height, shining down.
fn ceiling([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> Emitter {
    let corner = |x, y| DVec3::new(x, y, z);
    panel([corner(x0, y0), corner(x1, y0), corner(x1, y1), corner(x0, y1)], -DVec3::Z)
}

/// π times the view factor of a parallel rectangle with a corner above the element: sides a and
/// b in units of the distance.
fn corner_form(a: f64, b: f64) -> f64 {
    let (p, q) = (a.hypot(1.0), b.hypot(1.0));
    0.5 * (a / p * (b / p).atan() + b / q * (a / q).atan())
}

/// The same for [x0, x1] × [y0, y1] at height z above the origin.
fn above([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> f64 {
    let f = |x: f64, y: f64| x.signum() * y.signum() * corner_form(x.abs() / z, y.abs() / z);
    f(x1, y1) - f(x0, y1) - f(x1, y0) + f(x0, y0)
}

/// Lambert's formula: half the sum over the edges of the angle that each subtends times the
/// cosine of its plane. For a polygon above the horizon of the origin, of unit radiance.
fn lambert(corners: &[DVec3], normal: DVec3) -> f64 {
    let edge = |(k, from): (usize, &DVec3)| {
        let to = corners[(k + 1) % corners.len()];
        let across = from.cross(to);
        across.length().atan2(from.dot(to)) * across.dot(normal) / across.length()
    };
    0.5 * corners.iter().enumerate().map(edge).sum::<f64>().abs()
}

/// A sphere of which a cone of half-angle `half` is full, `tilt` off the normal: over the circles
/// of equal height, the part of each within the cone.
fn cone_form(half: f64, tilt: f64) -> f64 {
    let steps = 200_000;
    let (first, last) = ((tilt - half).max(0.0), (tilt + half).min(FRAC_PI_2));
    let step = (last - first) / steps as f64;
    let ring = |k| {
        let polar = first + (k as f64 + 0.5) * step;
        let cosine = (half.cos() - polar.cos() * tilt.cos()) / (polar.sin() * tilt.sin());
        2.0 * cosine.clamp(-1.0, 1.0).acos() * polar.cos() * polar.sin() * step
    };
    (0..steps).map(ring).sum()
}

#[test]
fn the_forms_agree_with_each_other() {
    // An infinite plane fills the hemisphere.
    assert!((above([-1e6, 1e6], [-1e6, 1e6], 1.0) - PI).abs() < 1e-5);
    let corner = |x, y| DVec3::new(x, y, 2.0);
    let corners = [corner(-1.0, 0.5), corner(1.5, 0.5), corner(1.5, 2.0), corner(-1.0, 2.0)];
    let difference = above([-1.0, 1.5], [0.5, 2.0], 2.0) - lambert(&corners, DVec3::Z);
    assert!(difference.abs() < 1e-12, "{difference}");
    // Wholly above the horizon a cone gives π sin² of its half-angle times the cosine.
    let expected = PI * 0.3f64.sin().powi(2) * 0.7f64.cos();
    assert!((cone_form(0.3, 0.7) - expected).abs() < 1e-6);
}

#[test]
fn a_panel_above_a_parallel_plane() {
    for (x, y, z) in [
        ([-1.0, 1.5], [-0.5, 2.0], 2.0),
        ([0.5, 0.8], [1.0, 1.1], 0.9),
        ([-3.0, 3.0], [0.0, 4.0], 1.5),
    ] {
        agrees(&empty(), &ceiling(x, y, z), surface_point(Vec3::Z), above(x, y, z));
    }
}

#[test]
fn any_simple_quadrilateral_either_way_round() {
    let at = |x: f64, y: f64| DVec3::new(x, y, 2.0 + 0.3 * x);
    let normal = DVec3::new(0.3, 0.0, -1.0);
    let shapes = [
        [at(0.0, 0.0), at(2.0, 0.3), at(2.5, 1.5), at(0.5, 1.2)],
        [at(-1.0, -1.0), at(2.0, -1.0), at(0.5, 1.0), at(0.0, 1.0)],
        // With a corner that points inwards.
        [at(0.0, 0.0), at(2.0, -1.0), at(0.5, 0.2), at(0.0, 2.0)],
    ];
    let up = surface_point(Vec3::new(0.2, 0.1, 1.0));
    for corners in shapes {
        let expected = lambert(&corners, up.normal.as_dvec3());
        for start in 0..4 {
            let turned: [DVec3; 4] = std::array::from_fn(|k| corners[(start + k) % 4]);
            agrees(&empty(), &panel(turned, normal), up, expected);
            let [a, b, c, d] = turned;
            agrees(&empty(), &panel([d, c, b, a], normal), up, expected);
        }
    }
}

#[test]
fn a_panel_partly_below_the_horizon() {
    let corner = |y, z| DVec3::new(1.5, y, z);
    let corners = [corner(-1.0, -2.0), corner(1.0, -2.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let seen = [corner(-1.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    agrees(&empty(), &panel(corners, -DVec3::X), surface_point(Vec3::Z), lambert(&seen, DVec3::Z));
}

#[test]
fn half_of_a_light_is_hidden() {
    let (x, y) = ([-1.0, 1.5], [-0.5, 2.0]);
    agrees(
        &half_hidden(1.0),
        &ceiling(x, y, 2.0),
        surface_point(Vec3::Z),
        above([0.0, 1.5], y, 2.0),
    );
    let sphere = Emitter::Sphere { center: Vec3::Z * 2.0, radius_m: 0.7 };
    agrees(&half_hidden(1.0), &sphere, surface_point(Vec3::Z), 0.5 * PI * 0.35f64.powi(2));
    let sun = Emitter::Sun { direction: -Vec3::Z, angular_diameter: Emitter::SUN_DIAMETER };
    agrees(&half_hidden(1.0), &sun, surface_point(Vec3::Z), 0.5);
    // Geometry behind a light hides nothing, and any geometry is before the sun.
    agrees(&half_hidden(3.0), &ceiling(x, y, 2.0), surface_point(Vec3::Z), above(x, y, 2.0));
    agrees(&half_hidden(3.0), &sphere, surface_point(Vec3::Z), PI * 0.35f64.powi(2));
    // Within a sphere it is behind the light that the surface point sees.
    agrees(&half_hidden(2.0), &sphere, surface_point(Vec3::Z), PI * 0.35f64.powi(2));
    agrees(&half_hidden(1e3), &sun, surface_point(Vec3::Z), 0.5);
    for light in [
        Emitter::Point { position: Vec3::new(-0.5, 0.0, 2.0) },
        spot(Vec3::new(-0.5, 0.0, 2.0), -Vec3::Z),
    ] {
        assert_eq!(estimated(&half_hidden(1.0), &light, surface_point(Vec3::Z), 1).0, 0.0);
        assert!(estimated(&half_hidden(3.0), &light, surface_point(Vec3::Z), 1).0 > 0.1);
    }
}

#[test]
fn a_sphere_near_far_and_at_the_horizon() {
    for (distance, radius) in [(3.0, 0.5), (1.0, 0.95), (50.0, 0.01)] {
        let half = f64::asin(radius / distance);
        for tilt in [0.0f64, 0.4, 1.2, FRAC_PI_2 + 0.5 * half] {
            let direction = DVec3::new(tilt.sin() * 0.6, tilt.sin() * 0.8, tilt.cos());
            let light = Emitter::Sphere {
                center: (direction * distance).as_vec3(),
                radius_m: radius as f32,
            };
            let expected = if tilt + half <= FRAC_PI_2 {
                PI * (radius / distance).powi(2) * tilt.cos()
            } else {
                cone_form(half, tilt)
            };
            agrees(&empty(), &light, surface_point(Vec3::Z), expected);
        }
    }
}

#[test]
fn within_and_upon_a_light_nothing_is_infinite() {
    let up = surface_point(Vec3::Z);
    for center in [Vec3::ZERO, Vec3::new(0.2, 0.1, -0.3)] {
        // Every ray arrives, so that nothing is left to chance.
        let (mean, _) = estimated(&empty(), &Emitter::Sphere { center, radius_m: 0.5 }, up, 8);
        assert!((mean - PI).abs() < 1e-6, "{mean}");
    }
    let touching = [
        Emitter::Sphere { center: Vec3::Z * 0.5, radius_m: 0.5 },
        Emitter::Sphere { center: Vec3::ZERO, radius_m: 0.0 },
        Emitter::Point { position: Vec3::ZERO },
        spot(Vec3::ZERO, -Vec3::Z),
        ceiling([-1.0, 1.0], [-1.0, 1.0], 0.0),
        ceiling([-1.0, 1.0], [-1.0, 1.0], 1e-25),
        ceiling([1.0, 1.0], [0.0, 0.0], 1.0),
    ];
    for light in touching {
        for side in [0, 1, 4] {
            let (mean, _) = estimated(&empty(), &light, up, side);
            assert!(mean.is_finite() && mean >= 0.0, "{light:?}: {mean}");
        }
        assert!((light.direction_from(up.position).length() - 1.0).abs() < 1e-6);
    }
}

fn spot(position: Vec3, direction: Vec3) -> Emitter {
    Emitter::Spot { position, direction, inner_angle: 0.3, outer_angle: 0.6 }
}

#[test]
fn a_point_fades_with_the_square_of_its_distance() {
    let light = Emitter::Point { position: Vec3::new(1.0, -2.0, 2.0) };
    agrees(&empty(), &light, surface_point(Vec3::Z), 2.0 / 3.0 / 9.0);
    agrees(&empty(), &light, surface_point(Vec3::X), 1.0 / 3.0 / 9.0);
}

#[test]
fn a_spot_fades_between_its_angles() {
    for (angle, expected) in [
        (0.0, 1.0),
        (0.29, 1.0),
        // Half-way in the cosine the smooth step is at one half.
        (f64::acos(0.5 * (0.3f64.cos() + 0.6f64.cos())), 0.5),
        // And at a quarter of it at 1/16 (3 − 2/4).
        (f64::acos(0.25 * 0.3f64.cos() + 0.75 * 0.6f64.cos()), 0.15625),
        (0.61, 0.0),
        (2.0, 0.0),
        (PI, 0.0),
    ] {
        let axis = DVec3::new(angle.sin(), 0.0, -angle.cos()).as_vec3();
        let (found, error) =
            estimated(&empty(), &spot(Vec3::Z * 2.0, axis), surface_point(Vec3::Z), 1);
        assert_eq!(error, 0.0);
        assert!((found - expected / 4.0).abs() < 2e-6, "{angle}: {found}, not {expected} / 4");
    }
    let sharp = Emitter::Spot {
        position: Vec3::Z,
        direction: -Vec3::Z,
        inner_angle: 0.5,
        outer_angle: 0.5,
    };
    let off = |angle: f32| SurfacePoint { position: Vec3::X * angle.tan(), normal: Vec3::Z };
    assert!(estimated(&empty(), &sharp, off(0.49), 1).0 > 0.1);
    assert_eq!(estimated(&empty(), &sharp, off(0.51), 1).0, 0.0);
}

#[test]
fn a_sun_is_told_by_the_irradiance_of_what_faces_it() {
    for angular_diameter in [0.0, Emitter::SUN_DIAMETER, 0.5, 1.5] {
        for tilt in [0.0f64, 0.4, 0.75] {
            let towards = DVec3::new(0.0, tilt.sin(), tilt.cos()).as_vec3();
            let light = Emitter::Sun { direction: -towards, angular_diameter };
            agrees(&empty(), &light, surface_point(Vec3::Z), tilt.cos());
        }
    }
    // Half set: of a disc of unit irradiance, that is of radiance 1 / (π sin²).
    let light = Emitter::Sun { direction: -Vec3::X, angular_diameter: 1.0 };
    let expected = cone_form(0.5, FRAC_PI_2) / (PI * 0.5f64.sin().powi(2));
    agrees(&empty(), &light, surface_point(Vec3::Z), expected);
}

#[test]
fn below_the_horizon_and_behind_a_panel_it_is_dark() {
    let low = Vec3::new(1.0, 0.0, -1.0);
    let lights = [
        ceiling([-1.0, 1.0], [-1.0, 1.0], -1.0),
        panel([DVec3::Z, DVec3::X + DVec3::Z, DVec3::ONE, DVec3::Y + DVec3::Z], DVec3::Z),
        Emitter::Sphere { center: low, radius_m: 0.9 },
        Emitter::Point { position: low },
        spot(low, -low.normalize_or_zero()),
        Emitter::Sun { direction: -low.normalize_or_zero(), angular_diameter: 0.1 },
    ];
    for light in lights {
        assert_eq!(estimated(&empty(), &light, surface_point(Vec3::Z), 8), (0.0, 0.0), "{light:?}");
    }
}

#[test]
fn more_rays_err_less() {
    // Of stratified points on something smooth the error falls in proportion to their number,
    // 16-fold here, and of independent ones 4-fold.
    let lights = [
        ceiling([-1.0, 1.5], [-0.5, 2.0], 2.0),
        Emitter::Sphere { center: Vec3::new(0.5, 0.0, 1.0), radius_m: 0.8 },
    ];
    for light in lights {
        let error = |side| estimated(&empty(), &light, surface_point(Vec3::Z), side).1;
        assert!(error(16) < error(4) / 8.0, "{light:?}: {} and {}", error(4), error(16));
    }
}

#[test]
fn the_middle_of_a_light_is_found() {
    let from = Vec3::new(1.0, 1.0, 0.0);
    let expect = |light: &Emitter, towards: Vec3| {
        let difference = light.direction_from(from) - towards.normalize_or_zero();
        assert!(difference.length() < 1e-6, "{light:?}: {difference}");
    };
    expect(&ceiling([0.0, 4.0], [0.0, 2.0], 3.0), Vec3::new(1.0, 0.0, 3.0));
    // A trapezoid's centre of area is nearer to its longer side: 4/3 · 3/2 up here.
    let corners = [(0.0, 0.0), (4.0, 0.0), (3.0, 3.0), (1.0, 3.0)];
    let corners = corners.map(|(x, y)| DVec3::new(x, y, 3.0));
    expect(&panel(corners, -DVec3::Z), Vec3::new(1.0, 1.0 / 3.0, 3.0));
    expect(&Emitter::Sphere { center: Vec3::Z, radius_m: 0.1 }, Vec3::new(-1.0, -1.0, 1.0));
    expect(&spot(Vec3::Z, Vec3::X), Vec3::new(-1.0, -1.0, 1.0));
    expect(&Emitter::Sun { direction: Vec3::X, angular_diameter: 0.1 }, -Vec3::X);
}

/// A dome whose pixel in column x and row y is (x, y, 1).
fn numbered(width: usize, height: usize) -> Dome {
    let pixel = |index: usize| [(index % width) as f32, (index / width) as f32, 1.0];
    let pixels = (0..width * height).map(pixel).collect();
    Dome::new(Image::new(width, height, pixels, None).into(), 2.0)
}

#[test]
fn a_dome_turns_by_the_compass_from_the_y_axis() {
    let dome = numbered(8, 4);
    let expect = |direction: Vec3, expected: [f32; 3]| {
        let found = dome.radiance(direction.normalize_or_zero());
        let close = std::iter::zip(found, expected).all(|(a, b)| (a - 2.0 * b).abs() < 1e-4);
        assert!(close, "{direction}: {found:?}, not twice {expected:?}");
    };
    // The centre of column 0 is 22.5° to the right of +y, and that of row 1 is 67.5° from z.
    let (aside, polar) = (22.5f32.to_radians(), 67.5f32.to_radians());
    let at = |column: f32, polar: f32| {
        let azimuth = aside + column * 2.0 * aside;
        Vec3::new(azimuth.sin() * polar.sin(), azimuth.cos() * polar.sin(), polar.cos())
    };
    for column in 0..8 {
        expect(at(column as f32, polar), [column as f32, 1.0, 1.0]);
        expect(
            at(column as f32, 3.0 * 22.5f32.to_radians() + 2.0 * aside),
            [column as f32, 2.0, 1.0],
        );
    }
    expect(Vec3::X, [1.5, 1.5, 1.0]);
    expect(-Vec3::Y, [3.5, 1.5, 1.0]);
    expect(-Vec3::X, [5.5, 1.5, 1.0]);
    // Between the last column and the first.
    expect(Vec3::Y, [3.5, 1.5, 1.0]);
    assert_eq!(dome.radiance(Vec3::Z)[1..], [0.0, 2.0]);
    assert_eq!(dome.radiance(-Vec3::Z)[1..], [6.0, 2.0]);
}

#[test]
fn a_dome_of_holes_or_of_nothing_is_black_there() {
    let mut pixels = vec![[1.0; 3]; 8];
    pixels[2] = [f32::INFINITY, 1.0, 1.0];
    let dome = Dome::new(Image::new(4, 2, pixels, None).into(), 1.0);
    // The centre of column 2 and row 0.
    let found = dome.radiance(Vec3::new(-0.5, -0.5, 0.5f32.sqrt()));
    assert!(found.iter().all(|value| value.abs() < 1e-5), "{found:?}");
    let nothing = Dome::new(Image::new(0, 0, Vec::new(), None).into(), 1.0);
    assert_eq!(nothing.radiance(Vec3::Z), [0.0; 3]);
}
