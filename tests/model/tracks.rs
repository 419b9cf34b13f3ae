//! Points of an engine in the adjustment: derivatives, SciPy, and a lens that the engine has wrong.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use lobelia::model::rig::Rig;
use lobelia::model::unknowns::State;
use lobelia::model::{AdjustOptions, FoundPoint, Model, Stroke, solve};

use crate::rig::differentiated;
use crate::{json, numbers};

/// The task asks for 1e-6; the points are placed to rounding of their pixels.
const AGREEMENT: f64 = 1e-6;
const EXACT: AdjustOptions =
    AdjustOptions { loss_px: 3.0, max_steps: 500, tolerance_px: 1e-9, tracks_px: 1e-7 };

fn read(case: &serde_json::Value) -> Model {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("model.json");
    std::fs::write(&file, case["model"].to_string()).unwrap();
    lobelia::io::model::read(&file).unwrap()
}

#[test]
fn cameras_strokes_and_points_of_an_engine_together_are_those_of_scipy() {
    let case = json("tracks.json");
    let solution = solve(&read(&case), &EXACT).unwrap();
    assert!(solution.is_usable(), "{:?}", solution.problems);
    let lens = numbers(&case["lens"]);
    let own = solution.state.lenses[0];
    assert!((own.focal_px - lens[0]).abs() < AGREEMENT * 1000.0, "{own:?} {lens:?}");
    assert!((own.radial.x - lens[3]).abs() < AGREEMENT, "{own:?} {lens:?}");
    let mut turned = 0.0_f64;
    for (camera, pose) in case["cameras"].as_array().unwrap().iter().zip(&solution.state.poses) {
        let pose = pose.unwrap();
        let rows = camera["rotation"].as_array().unwrap().iter().flat_map(numbers);
        let rotation = DMat3::from_cols_slice(&rows.collect::<Vec<_>>()).transpose();
        let difference = (pose.world_from_camera - rotation).to_cols_array();
        turned = difference.into_iter().map(f64::abs).fold(turned, f64::max);
        let position = DVec3::from_slice(&numbers(&camera["position"]));
        assert!(pose.position.distance(position) < AGREEMENT, "{position} {:?}", pose.position);
    }
    assert!(turned < AGREEMENT, "{turned}");
    for (point, own) in solution.state.points.iter().enumerate() {
        let scipy = DVec3::from_slice(&numbers(&case["points"][point]));
        assert!(own.unwrap().distance(scipy) < AGREEMENT, "{scipy} {own:?}");
    }
    // By default the points' term is made anew until that moves nothing by a hundredth of a pixel.
    let quick = solve(&read(&case), &AdjustOptions::default()).unwrap();
    assert!((quick.state.lenses[0].focal_px - lens[0]).abs() < 0.01, "{:?}", quick.state.lenses);
}

#[test]
fn derivatives_are_those_of_differences() {
    let model = read(&json("tracks.json"));
    let mut state = State::unplaced(&model, &[930.0]);
    let found = model.photographs.iter().map(|own| own.found.map(|found| found.pose));
    state.poses = found.collect();
    let rig = Rig::of(&model, &state, 3.0);
    state.found = state.found.moved([0.1, 0.2, -0.3, 0.15, 0.3, -0.2, 0.1]);
    state.poses = state.poses.iter().map(|pose| Some(state.found.pose(&pose.unwrap()))).collect();
    let rows = differentiated(&model, &rig, &state);
    // Six of each photograph and two of the lens, and two by which the lens is held.
    assert_eq!(rows, 5 * 6 + 2 + 2);
}

#[test]
fn a_focal_length_that_the_engine_has_wrong_is_mended_by_its_own_points() {
    // The engine's is 5 % too long, and each of its cameras is off by a hundredth of a radian.
    let model = read(&json("tracks.json"));
    let (engine, truth) = (model.lenses[0].focal_px.unwrap(), 900.0);
    let mut alone = model.clone();
    alone.strokes.clear();
    alone.points.clear();
    let focal = |model: &Model| solve(model, &EXACT).unwrap().state.lenses[0].focal_px;
    assert_eq!(engine, 945.0);
    assert!((focal(&alone) - truth).abs() < 6.0, "{}", focal(&alone));
    // Held, it stays.
    alone.lenses[0].fit.focal = false;
    assert_eq!(focal(&alone), engine);
    // Without pixels of the points, cameras stay as the engine has them.
    let mut held = model.clone();
    held.strokes.retain(|own| matches!(own, Stroke::Position { .. } | Stroke::Length { .. }));
    held.lenses[0].fit = lobelia::model::Fit { focal: false, k1: false, ..model.lenses[0].fit };
    let no_pixels = |own: &FoundPoint| FoundPoint { pixels: Vec::new(), ..own.clone() };
    held.found_points = Arc::new(model.found_points.iter().map(no_pixels).collect());
    let solution = solve(&held, &EXACT).unwrap();
    let apart = |a: usize, b: usize| {
        let place = |index: usize| solution.cameras[index].as_ref().unwrap().position;
        place(a).distance(place(b))
    };
    let found = |index: usize| model.photographs[index].found.unwrap().pose.position;
    let of_engine = found(0).distance(found(4)) / found(0).distance(found(1));
    assert!((apart(0, 4) / apart(0, 1) - of_engine).abs() < 1e-9);
}

#[test]
fn a_photograph_without_points_stays_where_the_engine_has_it() {
    let mut model = read(&json("tracks.json"));
    let last = model.photographs.len() - 1;
    let without = |own: &FoundPoint| {
        let places = (0..own.photographs.len()).filter(|&place| own.photographs[place] != last);
        let (photographs, pixels) =
            places.map(|place| (own.photographs[place], own.pixels[place])).unzip();
        FoundPoint { photographs, pixels, ..own.clone() }
    };
    model.found_points = Arc::new(model.found_points.iter().map(without).collect());
    model.strokes.retain(|own| own.photograph() != Some(last));
    let state = solve(&model, &EXACT).unwrap().state;
    let found = |index: usize| model.photographs[index].found.unwrap().pose;
    let moved = |index: usize| {
        let own = state.found.back(&state.poses[index].unwrap());
        own.position.distance(found(index).position)
    };
    assert!(moved(last) < 1e-6, "{}", moved(last));
    assert!((0..last).all(|index| moved(index) > 1e-3));
}

#[test]
fn points_that_tell_nothing_are_left_out_and_damage_is_told() {
    let case = json("tracks.json");
    let mut model = read(&case);
    // A point that no two rays meet in, one behind the cameras, and one shown by one photograph.
    let mut points = model.found_points.to_vec();
    points[1].position = DVec3::new(1e9, 1e9, 1e9);
    points[2].photographs.truncate(1);
    points[2].pixels.truncate(1);
    points[3].position = 5.0 * model.photographs[0].found.unwrap().pose.position;
    model.found_points = Arc::new(points);
    let solution = solve(&model, &EXACT).unwrap();
    assert!(solution.is_usable(), "{:?}", solution.problems);
    let focal = solution.state.lenses[0].focal_px;
    assert!((focal - 900.0).abs() < 8.0, "{focal}");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("model.json");
    let written = lobelia::io::model::to_text(&read(&case));
    std::fs::write(&file, &written).unwrap();
    assert_eq!(lobelia::io::model::read(&file).unwrap().found_points, read(&case).found_points);
    assert!(written.contains("\"version\": 2"));
    let place = written.find('@').unwrap();
    for wrong in ["@", "@nan,", "@1,2,", ""] {
        let text = format!("{}{wrong}{}", &written[..place], &written[place + 1..]);
        std::fs::write(&file, text).unwrap();
        let problem = lobelia::io::model::read(&file).map(|_| ()).map_err(|own| own.to_string());
        match wrong {
            "@" => assert_eq!(problem, Ok(())),
            _ => assert!(problem.unwrap_err().contains("this is no point"), "{wrong}"),
        }
    }
}
