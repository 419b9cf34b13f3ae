use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use lobelia::render::edits::{AddedLight, Shape};
use lobelia::render::probe::{Content, Probe, ProbeSettings, probe};
use lobelia::scene::{Dome, Emitter, Image};
use lobelia::watch::Watch;

use crate::recovered::{KINDS, add, corner};
use crate::stage::{Stage, floor, reflectance};

fn at(stage: &Stage, place: Vec3, content: Content, width: usize) -> Probe {
    let settings = ProbeSettings { width, spp: 16, ..ProbeSettings::default() };
    stage.with(&[place], |scene| probe(scene, place, content, &settings, &Watch::new()).unwrap())
}

fn dome(radiance: [f32; 3]) -> AddedLight {
    let image = Arc::new(Image::new(4, 2, vec![radiance; 8], None));
    let dome = Dome::new(image, 1.0);
    AddedLight { name: "sky".into(), shape: Shape::Dome(dome), emission: [1.0; 3], is_on: true }
}

/// Above the horizon of a wide floor the sky itself, below it what the floor reflects of it.
#[test]
fn under_an_even_sky() {
    let mut stage = floor(reflectance(0.5, 0.0, 1.0));
    stage.edits.lights.push(dome([1.0, 2.0, 3.0]));
    let place = Vec3::new(0.1, 0.2, 0.05);
    for content in [Content::Everything, Content::Background] {
        let probe = at(&stage, place, content, 64);
        assert_eq!((probe.width, probe.height), (64, 32));
        let lower = if content == Content::Everything { 0.5 } else { 1.0 };
        for c in 0..3 {
            let sky = (c + 1) as f64;
            // The horizon of ten metres of floor from 5 cm above.
            for (index, texel) in probe.texels.iter().enumerate() {
                let row = index / 64;
                if row < 15 {
                    assert!((f64::from(texel[c]) - sky).abs() < 1e-5, "{row}: {texel:?}");
                }
            }
            // By midpoints of the rows.
            assert!((probe.irradiance(Vec3::Z)[c] / (PI * sky) - 1.0).abs() < 2e-3);
            let below = probe.irradiance(Vec3::NEG_Z)[c] / (PI * sky);
            assert!((below - lower).abs() < 0.01, "{content:?}: {below}");
        }
    }
}

/// As a `dome` of the same axes the probe is what it was taken of.
#[test]
fn its_axes_are_those_of_a_dome() {
    let pixels: Vec<[f32; 3]> = (0..32).map(|k| [k as f32, (k % 8) as f32, 1.0]).collect();
    let image = Arc::new(Image::new(8, 4, pixels, None));
    let shape = Shape::Dome(Dome::new(image, 1.0));
    let mut stage = floor(reflectance(0.5, 0.0, 1.0));
    stage.edits.lights.push(AddedLight {
        name: "sky".into(),
        shape,
        emission: [1.0; 3],
        is_on: true,
    });
    let probe = at(&stage, Vec3::Z, Content::Background, 128);
    let image = Arc::new(Image::new(probe.width, probe.height, probe.texels.clone(), None));
    let again = Dome::new(image, 1.0);
    let Shape::Dome(given) = &stage.edits.lights[0].shape else { unreachable!() };
    for (x, y) in [(3.5, 20.5), (40.5, 11.5), (77.5, 50.5), (100.5, 33.5), (127.5, 5.5)] {
        let direction = probe.direction(Vec2::new(x, y));
        let (a, b) = (given.radiance(direction), again.radiance(direction));
        for c in 0..3 {
            assert!((a[c] - b[c]).abs() < 0.25, "{direction}: {a:?} {b:?}");
        }
    }
    // The left edge looks along +y, the middle along −y, a quarter along +x.
    let near = |x: f32, axis: Vec3| probe.direction(Vec2::new(x, 32.0)).dot(axis) > 0.999;
    assert!(near(0.0, Vec3::Y) && near(32.0, Vec3::X) && near(64.0, Vec3::NEG_Y));
    assert!(near(96.0, Vec3::NEG_X));
}

/// A probe's integral is the irradiance that the path tracer finds on a small white square there.
/// The probe spreads a light over its disc, the tracer takes its middle: of these sizes and
/// distances that is within 1 %.
#[test]
fn its_integral_is_the_irradiance_there() {
    for kinds in [&KINDS[..], &["disc"], &["lamp"], &["sky"], &["sun"], &["panel"], &["spot"]] {
        let mut stage = corner().most(17).spp(64);
        kinds.iter().for_each(|kind| add(&mut stage, kind));
        let bulb = Emitter::Sphere { center: Vec3::new(0.9, -0.9, 1.6), radius_m: 0.15 };
        let stage = stage.light(bulb, [2.0; 3]).light(
            Emitter::Sun { direction: Vec3::new(0.6, 0.0, -0.8), angular_diameter: 0.0093 },
            [0.5; 3],
        );
        let place = DVec3::new(0.7, -0.4, 0.8);
        let expected = at(&stage, place.as_vec3(), Content::Everything, 512).irradiance(Vec3::Z);

        let mut with = stage.clone();
        let white = with.room.diffuse("white");
        with.solved.reflectances.push(Some(reflectance(1.0, 0.0, 1.0)));
        let half = 1e-3;
        let corner = place - DVec3::new(half, half, 0.0);
        with.room.rectangle(white, corner, DVec3::X * 2.0 * half, DVec3::Y * 2.0 * half);
        let seen = with.radiance(place + DVec3::new(0.001, 0.002, 0.02), place);
        for (estimate, expected) in seen.iter().zip(expected) {
            let expected = expected / PI;
            let tolerance = 4.5 * estimate.error + 0.01 * expected;
            assert!(
                (estimate.mean - expected).abs() < tolerance,
                "{kinds:?}: {estimate:?}, by the probe {expected}"
            );
        }
    }
}

#[test]
fn the_same_on_any_number_of_threads() {
    let mut stage = corner();
    KINDS.iter().for_each(|kind| add(&mut stage, kind));
    let once = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| at(&stage, Vec3::new(0.7, -0.4, 0.8), Content::Everything, 64))
    };
    assert_eq!(once(1), once(3));
    let cancelled = Watch::new();
    cancelled.cancel();
    let settings = ProbeSettings::default();
    stage.with(&[], |scene| {
        assert!(probe(scene, Vec3::Z, Content::Everything, &settings, &cancelled).is_err());
    });
}
