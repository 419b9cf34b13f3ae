//! k_ij of Eq. 10 against the irradiance from uniform discs.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lobelia::math::sampling::Random;
use lobelia::reconstruct::lights::{LightKind, VirtualLight, VirtualLights, VisibilityRays};
use lobelia::reconstruct::lobes::{Lobe, Lobes};
use lobelia::reconstruct::transport::{LightGeometry, TransportOptions, gather, geometric_factor};
use lobelia::scene::{SurfacePoint, Views};
use lobelia::watch::Watch;

use crate::rooms::{Room, bare_sample, cloud};

/// A chain of a few dozen single-precision operations, each rounding by at most 2⁻²⁴.
const SINGLE: f64 = 3e-6;

fn disc(position: Vec3, normal: Vec3, radius_m: f32) -> VirtualLight {
    VirtualLight::disc(LightKind::Sphere, position, normal.normalize_or_zero(), radius_m)
}

fn floor_site(x: f32, y: f32) -> SurfacePoint {
    SurfacePoint { position: Vec3::new(x, y, 0.0), normal: Vec3::Z }
}

/// Each light with one lobe, α = 1 along its normal: a diffuse disc of unit radiance.
fn diffuse_lobes(lights: &[VirtualLight]) -> Lobes {
    Lobes {
        lobes: lights
            .iter()
            .enumerate()
            .map(|(light, disc)| Lobe { light, direction: disc.normal, exponent: 1.0 })
            .collect(),
        first: (0..=lights.len()).collect(),
    }
}

fn lights_of(lights: Vec<VirtualLight>) -> VirtualLights {
    VirtualLights { lights, spacing_m: 1.0, sphere_center: Vec3::ZERO, sphere_radius_m: 10.0 }
}

/// The irradiance from a disc of unit radiance, radius `radius`, parallel to the receiver at
/// height `height`, its centre `aside` off the receiver's normal (Howell's catalogue, B-13).
fn disc_irradiance(radius: f64, height: f64, aside: f64) -> f64 {
    let (r2, h2, a2) = (radius * radius, height * height, aside * aside);
    let sum = h2 + a2 + r2;
    0.5 * PI * (1.0 - (h2 + a2 - r2) / (sum * sum - 4.0 * r2 * a2).sqrt())
}

fn floor_room() -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.square(floor, 3.0, 0.0);
    room
}

#[test]
fn coupling_with_a_disc_is_the_closed_form_irradiance() {
    let room = floor_room();
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let (radius, height) = (0.05f32, 1.0f32);
    let light = disc(Vec3::new(0.0, 0.0, height), -Vec3::Z, radius);
    let asides = [0.0f32, 0.3, 1.0, 2.5];
    let samples: Vec<_> = asides
        .iter()
        .map(|&x| bare_sample(Vec3::new(0.6 * x, 0.8 * x, 0.0), Vec3::Z, 0, [0.0; 3]))
        .collect();
    let lights = lights_of(vec![light]);
    let transport = gather(
        &views,
        &cloud(samples),
        &lights,
        &diffuse_lobes(&lights.lights),
        &TransportOptions::default(),
        1,
        &Watch::new(),
    )
    .unwrap();
    for (row, &aside) in asides.iter().enumerate() {
        let exact = disc_irradiance(f64::from(radius), f64::from(height), f64::from(aside));
        let coupling = transport.coupling[(row, 0)];
        // Eq. 10 takes the disc's centre for all of it. The mean of cos cos'/r² = h²/s² over the
        // disc, s = h² + a², differs from the centre's by R²/8 times its Laplacian, which
        // is (−8/s + 24 a²/s²) of it: between −8/s and 16/s. So by 2 R²/s at most, and a tenth of
        // that covers the next order (R²/s < 0.003).
        let s = f64::from(height * height + aside * aside);
        let tolerance = 2.2 * f64::from(radius * radius) / s;
        assert!((coupling / exact - 1.0).abs() < tolerance, "{aside}: {coupling} for {exact}");
        // On the axis the difference is known: πR²/h² for πR²/(h² + R²).
        if aside == 0.0 {
            let ratio = 1.0 + f64::from(radius / height).powi(2);
            assert!((coupling / exact / ratio - 1.0).abs() < SINGLE);
        }
        assert_eq!(transport.irradiance[row], [0.0; 3], "nothing was photographed");
    }
}

#[test]
fn a_small_tilted_disc_follows_both_cosines_and_the_lobes_exponent() {
    let room = floor_room();
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let light = disc(Vec3::new(0.7, -0.4, 1.3), Vec3::new(-0.5, 0.1, -0.8), 0.01);
    let sample = bare_sample(Vec3::new(-0.2, 0.5, 0.0), Vec3::Z, 0, [0.0; 3]);
    let aim = Vec3::new(-0.4, 0.6, -0.9).normalize_or_zero();
    let lobes = Lobes {
        lobes: [(light.normal, 1.0), (aim, 20.0), (-aim, 20.0), (aim, 0.0)]
            .map(|(direction, exponent)| Lobe { light: 0, direction, exponent })
            .to_vec(),
        first: vec![0, 4],
    };
    let transport = gather(
        &views,
        &cloud(vec![sample.clone()]),
        &lights_of(vec![light]),
        &lobes,
        &TransportOptions::default(),
        1,
        &Watch::new(),
    )
    .unwrap();
    let offset = light.position.as_dvec3() - sample.position.as_dvec3();
    let r2 = offset.length_squared();
    let incoming = -offset / r2.sqrt();
    let base = PI * 1e-4 * (-incoming.z) / r2;
    let emitter_cosine = incoming.dot(light.normal.as_dvec3().normalize_or_zero());
    let lobe_cosine = incoming.dot(aim.as_dvec3().normalize_or_zero());
    let expected = [base * emitter_cosine, base * lobe_cosine.powi(20), 0.0, base];
    for (column, expected) in expected.into_iter().enumerate() {
        let coupling = transport.coupling[(0, column)];
        // The 20th power multiplies the cosine's rounding by 20.
        let tolerance = 21.0 * SINGLE * expected;
        assert!((coupling - expected).abs() <= tolerance, "{column}: {coupling} for {expected}");
    }
}

#[test]
fn a_disc_below_the_horizon_gives_nothing() {
    let room = floor_room();
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let below = disc(Vec3::new(0.2, 0.3, -1.0), Vec3::Z, 0.3);
    let level = disc(Vec3::new(5.0, 0.0, 0.0), -Vec3::X, 0.3);
    for light in [below, level] {
        assert!(geometric_factor(&light, floor_site(0.0, 0.0)).is_none());
    }
    let lights = lights_of(vec![below, level]);
    let samples = vec![bare_sample(Vec3::ZERO, Vec3::Z, 0, [0.0; 3])];
    let lobes = diffuse_lobes(&lights.lights);
    let options = TransportOptions::default();
    let transport =
        gather(&views, &cloud(samples), &lights, &lobes, &options, 1, &Watch::new()).unwrap();
    assert_eq!(transport.coupling[(0, 0)], 0.0);
    assert_eq!(transport.coupling[(0, 1)], 0.0);
}

#[test]
fn close_discs_are_clamped() {
    let radius = 0.4f32;
    let area = PI * 0.16;
    let factor = |height: f32| {
        let light = disc(Vec3::new(0.0, 0.0, height), -Vec3::Z, radius);
        let LightGeometry { direction, factor } =
            geometric_factor(&light, floor_site(0.0, 0.0)).unwrap();
        assert!((direction - Vec3::Z).length() < 1e-6);
        f64::from(factor)
    };
    // Beyond half the radius 1/r², within it the value at half the radius.
    for (height, r2) in [(1.0, 1.0), (0.3, 0.09), (0.2, 0.04), (0.1, 0.04), (1e-4, 0.04)] {
        let expected = area / r2;
        let found = factor(height);
        assert!((found / expected - 1.0).abs() < SINGLE, "{height}: {found} for {expected}");
    }
}

/// A floor under a half-plane whose edge runs halfway between the floor and the light's disc,
/// on the line from the origin to the disc's centre, at an angle.
fn half_covered(angle: f64, centre: DVec3) -> Room {
    let mut room = floor_room();
    let cover = room.untagged("cover");
    let along = DVec3::new(angle.cos(), angle.sin(), 0.0);
    let aside = DVec3::Z.cross(along);
    room.rectangle(cover, centre / 2.0 - 5.0 * along, 10.0 * along, 5.0 * aside);
    room
}

#[test]
fn a_half_plane_hides_half_of_a_disc() {
    let centre = DVec3::new(0.2, -0.1, 2.0);
    let light = disc(centre.as_vec3(), -Vec3::Z, 0.25);
    for angle in [0.3, 1.1, 2.0, 4.0] {
        let room = half_covered(angle, centre);
        let caster = room.caster();
        let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
        for side in [3usize, 8] {
            let trials = 1500;
            let mut sum = 0.0;
            for trial in 0..trials {
                let mut rays = VisibilityRays::new(side, Random::new(7, 1, trial));
                let visible = f64::from(light.visibility(&views, floor_site(0.0, 0.0), &mut rays));
                // A diameter comes from a straight line through the centre of the square that
                // the rays are stratified over, so it crosses at most 2 × side − 1 of its
                // side² cells. The others are half free and half hidden by symmetry.
                assert!((visible - 0.5).abs() <= 1.0 / side as f64, "{visible}");
                sum += visible;
            }
            // Every crossed cell is one coin: variance 1/4 at most, over side⁴. Five standard
            // deviations of the mean over the trials.
            let variance = 2.0 * side as f64 / 4.0 / (side as f64).powi(4);
            let bound = 5.0 * (variance / trials as f64).sqrt();
            let mean = sum / trials as f64;
            assert!((mean - 0.5).abs() < bound, "{angle}, {side}: {mean} ± {bound}");
        }
    }
}

#[test]
fn visibility_is_all_or_nothing_away_from_edges() {
    let mut room = floor_room();
    let cover = room.untagged("cover");
    room.rectangle(
        cover,
        DVec3::new(0.5, -1.0, 1.0),
        DVec3::new(2.0, 0.0, 0.0),
        DVec3::new(0.0, 2.0, 0.0),
    );
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let mut rays = VisibilityRays::new(4, Random::new(1, 1, 1));
    let mut visible = |x: f32| {
        let light = disc(Vec3::new(x, 0.0, 2.0), -Vec3::Z, 0.2);
        light.visibility(&views, floor_site(x, 0.0), &mut rays)
    };
    assert_eq!(visible(-0.5), 1.0);
    assert_eq!(visible(1.5), 0.0);
}
