//! What a reconstruction becomes in the files; what is in them is read back by tests/formats.

use std::sync::Arc;

use super::*;
use crate::reconstruct::lights::LightKind;
use crate::reconstruct::unwrap::Unwrap;

fn read(reconstruction: &Reconstruction) -> solution::Solution {
    let folder = tempfile::tempdir().unwrap();
    let (capture, options) = (fixture::capture(), Options::default());
    write(folder.path(), &capture, &options, reconstruction, 0.0, &Watch::new()).unwrap();
    solution::Solution::read(&folder.path().join("solution.json")).unwrap()
}

#[test]
fn certainty_is_written_as_far_as_it_goes() {
    let solution = read(&fixture::reconstruction());
    let [floor, wall, unseen] = solution.materials.as_slice() else { panic!("three materials") };
    assert_eq!(floor.diffuse_interval, Some([Some([0.45, 0.56]), Some([0.35, 0.46]), None]));
    assert_eq!(floor.specular_interval, Some([Some([0.04, 0.06]), Some([0.05, 0.07]), None]));
    assert_eq!(floor.exponent_interval, Some([30.0, 52.0]));
    assert_eq!(floor.identified, Some([true, true, false]));
    // Three channels without an interval are a field without a value.
    assert_eq!((wall.diffuse_interval, wall.identified), (None, Some([true; 3])));
    assert_eq!((unseen.identified, unseen.diffuse), (None, None));
    assert_eq!(solution.rms.held_out, Some([0.04, 0.05, 0.06]));
    let scale = solution.scale.unwrap();
    assert_eq!((scale.singular_value[1], scale.log_rms[1], scale.log_sd[1]), (0.6, 0.02, 0.11));
    assert_eq!(solution.stopped, "the objective's gradient vanishes");
    let model = solution.light_model.unwrap();
    assert_eq!((model.world.as_deref(), model.light_sets), (Some("open"), 5));
    assert_eq!((model.lamps, model.sun), (1, true));
    assert!(model.notes[0].contains("a sky explains"));
}

#[test]
fn what_a_grown_model_tried_is_written() {
    use crate::reconstruct::solution::{Selection, Trial, TrialPart};
    let mut reconstruction = fixture::reconstruction();
    assert_eq!(read(&reconstruction).selection, None);
    let mut result = (*reconstruction.solution).clone();
    let trial = |part, standard_error, supported| Trial {
        part,
        before: 0.1,
        after: 0.08,
        change: -0.2,
        standard_error,
        supported,
    };
    let trials = vec![
        trial(TrialPart::Sun, Some(0.05), true),
        trial(TrialPart::Lamp(2), Some(0.3), false),
        trial(TrialPart::Gloss(0), None, false),
        trial(TrialPart::Background(19), Some(0.01), true),
        trial(TrialPart::FineLobes, Some(0.3), false),
        trial(TrialPart::Beside(296), Some(0.01), true),
    ];
    let selection = Selection { candidates: 640, kept: 58, trials };
    result.certainty.as_mut().unwrap().selection = Some(selection);
    reconstruction.solution = std::sync::Arc::new(result);
    let written = read(&reconstruction).selection.unwrap();
    assert_eq!((written.candidates, written.kept), (640, 58));
    let parts: Vec<&str> = written.trials.iter().map(|trial| trial.part.as_str()).collect();
    assert_eq!(parts, ["sun", "lamp", "gloss", "background", "fine lobes", "fine lobes beside"]);
    let numbers: Vec<_> = written.trials.iter().map(|trial| trial.number).collect();
    assert_eq!(numbers, [None, Some(2), None, Some(19), None, Some(296)]);
    let [sun, _, gloss, ..] = written.trials.as_slice() else { panic!("six trials") };
    assert_eq!((gloss.material.as_deref(), gloss.standard_error), (Some("floor"), None));
    assert_eq!((sun.error_before, sun.error_after, sun.change), (0.1, 0.08, -0.2));
    assert_eq!((sun.standard_error, sun.supported, gloss.supported), (Some(0.05), true, false));
}

#[test]
fn without_certainty_nothing_is_made_up() {
    let mut reconstruction = fixture::reconstruction();
    let mut result = (*reconstruction.solution).clone();
    result.certainty = None;
    result.emission.fill([0.0; 3]);
    // Gloss that vanished has no exponent, so there is none to be certain of.
    let mut glossless = fixture::reconstruction();
    let mut other = (*glossless.solution).clone();
    other.reflectances[0].as_mut().unwrap().specular = [0.0; 3];
    glossless.solution = std::sync::Arc::new(other);
    let floor = &read(&glossless).materials[0];
    assert_eq!((floor.exponent, floor.exponent_interval), (None, None));
    assert!(floor.specular_interval.is_some());

    reconstruction.solution = std::sync::Arc::new(result);
    let mut lights = (*reconstruction.lights).clone();
    for light in &mut lights.lights {
        light.kind = LightKind::Sphere;
    }
    reconstruction.lights = std::sync::Arc::new(lights);
    let solution = read(&reconstruction);
    for material in &solution.materials {
        assert_eq!((material.diffuse_interval, material.specular_interval), (None, None));
        assert_eq!((material.exponent_interval, material.identified), (None, None));
    }
    assert_eq!((solution.rms.held_out, solution.scale), (None, None));
    let model = solution.light_model.unwrap();
    assert_eq!((model.world.as_deref(), model.light_sets), (Some("room"), 1));
    assert_eq!((model.lamps, model.sun), (0, false));
    reconstruction.lights = std::sync::Arc::default();
    assert_eq!(lights::model(&reconstruction).world, None);
}

#[test]
fn lights_are_written_by_their_kind_and_dark_ones_left_out() {
    let lights = lights::file(&fixture::capture(), &fixture::reconstruction()).lights;
    let kinds: Vec<&str> = lights.iter().map(|light| light.kind.as_str()).collect();
    assert_eq!(kinds, ["sphere", "surface", "lamp", "sky", "sun", "known"]);
    let [sphere, surface, lamp, sky, sun, known] = lights.as_slice() else { panic!("six") };
    for disc in [sphere, surface] {
        assert!(disc.normal.is_some() && disc.direction.is_none() && disc.name.is_none());
        assert!((disc.area_m2.unwrap() - 0.25 * std::f64::consts::PI).abs() < 1e-6);
        assert_eq!((disc.radius_m, disc.lobes.len()), (Some(0.5), 1));
    }
    assert_eq!(sphere.lobes[0].emission, [0.0; 3]);
    assert_eq!((lamp.position, lamp.radius_m), (Some([1.0, 2.0, 3.0]), Some(0.25)));
    assert_eq!((lamp.normal, lamp.area_m2, lamp.solid_angle_sr), (None, None, None));
    // Its other lobe is dark.
    assert_eq!(lamp.lobes.len(), 1);
    assert_eq!((lamp.lobes[0].exponent, lamp.lobes[0].emission), (0.0, [9.0, 8.0, 7.0]));
    assert_eq!((sky.position, sky.radius_m), (None, None));
    assert_eq!(sky.direction, Some([0.0, 0.0, -1.0]));
    let cone = 2.0 * std::f64::consts::PI * (1.0 - 0.2_f64.cos());
    assert!((sky.solid_angle_sr.unwrap() / cone - 1.0).abs() < 1e-5);
    assert_eq!((sun.direction, sun.solid_angle_sr), (Some([-1.0, 0.0, 0.0]), None));
    assert_eq!((sun.position, sun.lobes[0].emission), (None, [3.0; 3]));
    assert_eq!((known.name.as_deref(), known.lobes.len()), (Some("bulb"), 1));
    assert_eq!((known.position, known.direction, known.radius_m), (None, None, None));
}

#[test]
fn convergence_has_what_is_minimised() {
    let rows = convergence_rows(&fixture::reconstruction().solution.iterations);
    assert_eq!(rows.len(), 2);
    assert_eq!((rows[0].objective, rows[0].largest_change), (Some([2.0, 1.0, 0.5]), 0.5));
}

#[test]
fn a_number_that_is_not_finite_stops_the_summary() {
    let mut reconstruction = fixture::reconstruction();
    let mut result = (*reconstruction.solution).clone();
    result.certainty.as_mut().unwrap().scale.log_sd[2] = f64::INFINITY;
    reconstruction.solution = std::sync::Arc::new(result);
    let folder = tempfile::tempdir().unwrap();
    let (capture, options) = (fixture::capture(), Options::default());
    let written = write(folder.path(), &capture, &options, &reconstruction, 0.0, &Watch::new());
    assert!(written.unwrap_err().to_string().contains("scale"));
    assert!(!folder.path().join("solution.json").exists());
}

#[test]
fn file_names_are_harmless_and_unique() {
    let mut taken = BTreeSet::new();
    assert_eq!(file_name("wall left", &mut taken), "wall_left");
    assert_eq!(file_name("Wall/left", &mut taken), "Wall_left-2");
    assert_eq!(file_name("..", &mut taken), "surface");
    assert_eq!(file_name("../../etc/x", &mut taken), ".._.._etc_x");
    assert_eq!(file_name("", &mut taken), "surface-2");
    assert_eq!(file_name("Böden", &mut taken), "Böden");
}

#[test]
fn a_textured_material_has_the_mean_of_its_texels_and_a_known_one_what_was_given() {
    let (mut capture, mut whole) = (fixture::capture(), fixture::reconstruction());
    let index = 0;
    let unwrap =
        Unwrap { triangles: Vec::new(), corners: Vec::new(), width: 3, height: 1, is_own: true };
    let texels = vec![[0.75; CHANNELS], [0.25; CHANNELS], [0.9; CHANNELS]];
    let seen = vec![true, true, false];
    let texture = Texture { surface: 0, material: index, unwrap, texels, seen };
    whole.textures = Arc::new(vec![texture]);
    let mean = [0.5; CHANNELS];
    let mut solution = (*whole.solution).clone();
    let solved = [0.4; CHANNELS];
    solution.reflectances[index].as_mut().unwrap().diffuse = solved;
    let certainty = solution.certainty.as_mut().unwrap().materials[index].as_mut().unwrap();
    certainty.diffuse = solved.map(|value| Some([0.9 * value, 1.1 * value]));
    whole.solution = Arc::new(solution);

    let told = whole.materials(&capture);
    assert_eq!(told.reflectances[index].unwrap().diffuse, mean);
    for (interval, mean) in told.certainty[index].unwrap().diffuse.iter().zip(mean) {
        let [low, high] = interval.unwrap();
        assert!((low / mean - 0.9).abs() < 1e-12 && (high / mean - 1.1).abs() < 1e-12);
    }
    for other in (0..capture.materials.len()).filter(|&other| other != index) {
        assert_eq!(told.reflectances[other], whole.solution.reflectances[other]);
    }

    capture.materials[index].known_diffuse = Some(solved);
    assert_eq!(whole.materials(&capture).reflectances[index].unwrap().diffuse, solved);
    capture.materials[index].known_diffuse_sd = Some([0.1; CHANNELS]);
    assert_eq!(whole.materials(&capture).reflectances[index].unwrap().diffuse, mean);
}
