//! What the joint solve promises as a whole: where it starts does not matter, and its error is that
//! of samples that neither chose nor fitted the model.

use std::collections::BTreeMap;

use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::options::Options;
use lobelia::reconstruct::solution::TrialPart;
use lobelia::reconstruct::{self, Reconstruction};
use lobelia::watch::Watch;

use crate::lights;
use crate::rooms::Room;

fn diffuse(result: &Reconstruction) -> Vec<Rgb> {
    result.solution.reflectances.iter().flatten().map(|found| found.diffuse).collect()
}

fn run(room: &Room, options: &Options) -> Reconstruction {
    reconstruct::run(&room.capture, options, &Watch::new(), &|_| ()).unwrap()
}

/// A start off by 4 either way was drawn into the ridge's unit and moved the optimum.
#[test]
fn a_start_off_by_four_moves_nothing() {
    let mut room = lights::lamp_and_sky();
    // The scale is left to a pin: without light between surfaces nothing else tells it.
    room.capture.materials[0].known_diffuse = Some(lights::FLOOR);
    let mut options = lights::options();
    options.joint.max_lamps = 2;
    let usual = diffuse(&run(&room, &options));
    for factor in [0.25, 4.0] {
        let of = |(material, rgb): (&lobelia::scene::Material, &Rgb)| {
            (material.name.clone(), rgb.map(|value| (factor * value).min(1.0)))
        };
        let start: BTreeMap<String, Rgb> =
            room.capture.materials.iter().zip(&usual).map(of).collect();
        let moved = diffuse(&run(&room, &Options { start, ..options.clone() }));
        for (usual, moved) in usual.iter().flatten().zip(moved.iter().flatten()) {
            assert!((usual - moved).abs() < 0.002, "× {factor}: {moved} for {usual}");
        }
    }
}

#[test]
fn the_error_is_that_of_blocks_that_nothing_was_fitted_to() {
    let room = lights::lamp_and_sky();
    let result = run(&room, &lights::options());
    let certainty = result.solution.certainty.as_ref().unwrap();
    let held_out = certainty.held_out.expect("there are blocks enough");
    for (held_out, within) in held_out.into_iter().zip(certainty.scale.log_rms) {
        assert!(held_out.is_finite() && held_out > 0.5 * within, "{held_out} {within}");
        assert!(held_out < 10.0 * within, "{held_out} {within}");
    }
    // One rule for every part.
    let selection = certainty.selection.as_ref().unwrap();
    assert!(selection.trials.iter().any(|trial| trial.part == TrialPart::Room));
    for trial in &selection.trials {
        let falls = trial.standard_error.is_some_and(|error| -trial.change > error);
        assert_eq!(trial.supported, falls, "{trial:?}");
    }
}
