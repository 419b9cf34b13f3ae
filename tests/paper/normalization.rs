//! The grey-world start (Section 5.2): it must not depend on the light's colour or strength.

use glam::DVec3;
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::normalize::initial_diffuse;
use lobelia::reconstruct::samples::{SampleOptions, place};
use lobelia::scene::Views;
use lobelia::watch::Watch;

use crate::rooms::{Room, camera};

const REFLECTANCES: [Rgb; 2] = [[0.6, 0.3, 0.2], [0.2, 0.3, 0.7]];

/// A floor in two colours under a light of some colour that falls off across it.
fn start_under(light: Rgb) -> Vec<Rgb> {
    let mut room = Room::default();
    for (index, corner) in [-1.0, 0.0].into_iter().enumerate() {
        let half = room.diffuse(&format!("half {index}"));
        room.rectangle(half, DVec3::new(corner, -1.0, 0.0), DVec3::X, DVec3::Y * 2.0);
    }
    for eye in [DVec3::new(0.5, -1.5, 1.5), DVec3::new(-0.8, 1.2, 1.8)] {
        room.photograph(camera((80, 60), 0.9, eye, DVec3::ZERO), |struck| {
            let shade =
                1.0 / (0.3 + (struck.position - DVec3::new(0.4, 0.2, 1.0)).length_squared());
            std::array::from_fn(|c| (REFLECTANCES[struck.surface][c] * light[c] * shade) as f32)
        });
    }
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    // A window of one pixel: a mean over pixels of unlike brightness is no single colour.
    let options = SampleOptions { window_px: 1, ..SampleOptions::default() };
    let cloud = place(&views, &options, 1, &Watch::new()).unwrap();
    let start = initial_diffuse(&views, &cloud, &Watch::new()).unwrap();
    start.into_iter().map(Option::unwrap).collect()
}

#[test]
fn the_start_does_not_depend_on_the_lights_colour() {
    let white = start_under([1.0; 3]);
    for light in [[3.0, 3.0, 3.0], [1.0, 0.6, 0.25], [0.02, 0.5, 40.0]] {
        for (a, b) in white.iter().zip(start_under(light)) {
            for (a, b) in a.iter().zip(b) {
                // Both ends of an iteration that stops at changes of 1e-6; it contracts by at
                // least a half a step here, and photographs are rounded to 6e-8.
                assert!((a - b).abs() < 5e-6, "{light:?}: {a} became {b}");
            }
        }
    }
}

#[test]
fn the_start_adds_up_to_one_and_tells_the_colours_apart() {
    let start = start_under([1.0, 0.6, 0.25]);
    for rho in &start {
        assert!((rho.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{rho:?}");
    }
    assert!(start[0][0] > start[1][0] + 0.1 && start[0][2] < start[1][2] - 0.1, "{start:?}");
}

#[test]
fn two_colours_in_one_image_have_a_known_normal_form() {
    // Per photograph the fixed point is a gain per channel such that the mean of the normalised
    // colours is 1/3 each. With two colours and weights w that is solved here by bisection on
    // nothing but that definition, for colours symmetric in red and blue: green's gain is the
    // only unknown.
    let reflectances: [Rgb; 2] = [[0.6, 0.3, 0.1], [0.1, 0.3, 0.6]];
    let mut room = Room::default();
    for (index, corner) in [-1.0, 0.0].into_iter().enumerate() {
        let half = room.diffuse(&format!("half {index}"));
        room.rectangle(half, DVec3::new(corner, -1.0, 0.0), DVec3::X, DVec3::Y * 2.0);
    }
    // Straight from above, with an even number of columns: as many pixels of each colour.
    let eye = DVec3::new(0.0, 0.0, 3.0);
    room.photograph(camera((64, 64), 2.0, eye, DVec3::ZERO), |struck| {
        reflectances[struck.surface].map(|value| value as f32)
    });
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let cloud = place(&views, &SampleOptions::default(), 1, &Watch::new()).unwrap();
    let start = initial_diffuse(&views, &cloud, &Watch::new()).unwrap();
    let green = |gain: f64| 0.3 * gain / (0.7 + 0.3 * gain);
    let (mut low, mut high) = (0.1, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if green(middle) < 1.0 / 3.0 { low = middle } else { high = middle }
    }
    for (found, colour) in start.iter().zip(reflectances) {
        let sum = colour[0] + low * colour[1] + colour[2];
        let expected = [colour[0] / sum, low * colour[1] / sum, colour[2] / sum];
        for (found, expected) in found.unwrap().iter().zip(expected) {
            // The iteration's own tolerance of 1e-6, and photographs in single precision.
            assert!((found - expected).abs() < 2e-6, "{found} for {expected}");
        }
    }
}
