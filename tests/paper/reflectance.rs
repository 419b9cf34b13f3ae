//! Eq. 13 and 14 on hand-made irradiances and radiances.

use std::f64::consts::PI;
use std::sync::Arc;

use faer::Mat;
use glam::Vec3;
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::equations::Equations;
use lobelia::reconstruct::lights::VirtualLights;
use lobelia::reconstruct::lobes::{Lobe, Lobes};
use lobelia::reconstruct::reflectance::{GlossOptions, irradiance, update};
use lobelia::reconstruct::transport::{PatchRadiosity, Transport};
use lobelia::scene::Brdf;
use lobelia::watch::Watch;

use crate::rooms::{Dice, Room, bare_sample, cloud};

/// Samples of one material with these radiances; I_s and two lobes' coupling as given.
struct Case {
    room: Room,
    equations: Equations,
    lobes: Lobes,
    transport: Transport,
}

fn case(radiances: &[[f32; 3]], irradiances: &[[f32; 3]], coupling: &[[f64; 2]]) -> Case {
    let mut room = Room::default();
    let material = room.diffuse("paper");
    let samples =
        cloud(radiances.iter().map(|&l| bare_sample(Vec3::ZERO, Vec3::Z, material, l)).collect());
    let transport = Transport {
        irradiance: irradiances.to_vec(),
        records: Arc::default(),
        first_record: vec![0; radiances.len() + 1],
        bright: Arc::default(),
        coupling: Mat::from_fn(radiances.len(), 2, |row, column| coupling[row][column]),
        unphotographed: Arc::default(),
        first_unphotographed: Vec::new(),
        patch_radiosity: PatchRadiosity::default(),
    };
    let lobe = |light| Lobe { light, direction: Vec3::Z, exponent: 1.0 };
    let lobes = Lobes { lobes: vec![lobe(0), lobe(1)], first: vec![0, 1, 2] };
    let equations =
        Equations::new(&room.capture, &samples, &VirtualLights::default(), &transport, 6);
    Case { room, equations, lobes, transport }
}

fn updated(case: &Case, start: Rgb, emission: &[Rgb]) -> Rgb {
    let mut reflectances = vec![Some(Brdf::diffuse(start))];
    update(
        &case.room.capture,
        &case.equations,
        &mut reflectances,
        emission,
        &case.lobes,
        &case.transport,
        &GlossOptions::default(),
        &Watch::new(),
    )
    .unwrap();
    reflectances[0].unwrap().diffuse
}

/// Sums of a few dozen terms in double precision.
const DOUBLE: f64 = 1e-12;

#[test]
fn the_reflectance_is_the_least_squares_answer() {
    let mut dice = Dice::new(5);
    let count = 40;
    let mut triple = |scale: f64| -> [f32; 3] {
        std::array::from_fn(|_| (scale * (0.2 + dice.uniform())) as f32)
    };
    let radiances: Vec<_> = (0..count).map(|_| triple(0.1)).collect();
    let irradiances: Vec<_> = (0..count).map(|_| triple(0.8)).collect();
    let mut dice = Dice::new(6);
    let coupling: Vec<_> = (0..count).map(|_| [dice.uniform(), 0.5 * dice.uniform()]).collect();
    let emission = [[0.3, 0.0, 1.0], [0.2, 0.9, 0.0]];
    let case = case(&radiances, &irradiances, &coupling);
    let found = updated(&case, [0.5; 3], &emission);
    let totals = irradiance(&emission, &case.lobes, &case.transport);
    for c in 0..3 {
        // ρ G/π = L for all samples: normal equation of one unknown.
        let (mut above, mut below) = (0.0, 0.0);
        for s in 0..count {
            // Eq. 14.
            let g = f64::from(irradiances[s][c])
                + coupling[s][0] * emission[0][c]
                + coupling[s][1] * emission[1][c];
            assert!((totals[s][c] / g - 1.0).abs() < DOUBLE);
            above += f64::from(radiances[s][c]) * g / PI;
            below += (g / PI).powi(2);
        }
        let expected = above / below;
        assert!((0.05..0.95).contains(&expected), "the case tests the clamp instead");
        assert!((found[c] / expected - 1.0).abs() < DOUBLE, "{} for {expected}", found[c]);
    }
}

#[test]
fn reflectances_stay_within_physics() {
    // Brighter than white, black, and in the dark.
    let radiances = [[2.0, 0.0, 0.3], [3.0, 0.0, 0.2]];
    let irradiances = [[1.0, 1.0, 0.0], [1.5, 2.0, 0.0]];
    let case = case(&radiances, &irradiances, &[[0.0; 2]; 2]);
    let found = updated(&case, [0.4, 0.4, 0.7], &[[0.0; 3]; 2]);
    // Without light a reflectance cannot be told: it stays what it was.
    assert_eq!(found, [1.0, 0.0, 0.7]);
}

#[test]
fn a_known_reflectance_is_left_alone() {
    let mut case = case(&[[0.3; 3]; 3], &[[1.0; 3]; 3], &[[0.1; 2]; 3]);
    let known = [0.11, 0.22, 0.33];
    case.room.capture.materials[0].known_diffuse = Some(known);
    assert_eq!(updated(&case, known, &[[1.0; 3]; 2]), known);
}
