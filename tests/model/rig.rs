//! Engines' cameras in the world: derivatives, and scenes whose answer is known.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use lobelia::model::rig::Rig;
use lobelia::model::unknowns::{State, Unknowns};
use lobelia::model::{
    AdjustOptions, Axis, Fit, FoundCameras, FoundPoint, FoundPose, Lens, Model, Optic, Photograph,
    Place, Point, Pose, Similarity, Stroke, solve,
};

const LENS: Optic =
    Optic { focal_px: 600.0, principal_px: DVec2::new(320.0, 240.0), radial: DVec2::ZERO };
/// From the world to what the engine says.
const ENGINE: f64 = 0.4;

fn looking(from: DVec3, at: DVec3) -> Pose {
    let ahead = (at - from).normalize_or_zero();
    let right = ahead.cross(DVec3::Z).normalize_or_zero();
    let world_from_camera = DMat3::from_cols(right, right.cross(ahead), -ahead);
    Pose { world_from_camera, position: from }
}

/// Cameras about a table with their true poses; the engine has them turned, moved and smaller.
fn scene() -> (Model, Vec<Pose>, Similarity) {
    let turn = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-2.1);
    let truth: Vec<Pose> = (0..4)
        .map(|index| {
            let angle = 0.5 * f64::from(index) - 2.0;
            let from = DVec3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 1.6);
            looking(from, DVec3::new(0.1, -0.2, 0.3))
        })
        .collect();
    let shift = DVec3::new(4.0, -1.0, 2.0);
    let found = |pose: &Pose| {
        let world_from_camera = turn * pose.world_from_camera;
        let position = ENGINE * (turn * pose.position) + shift;
        FoundPose { pose: Pose { world_from_camera, position }, distance: 3.0 * ENGINE }
    };
    let photographs = truth.iter().enumerate().map(|(index, pose)| Photograph {
        name: format!("{index}.png"),
        lens: 0,
        size: (640, 480),
        found: Some(found(pose)),
    });
    let lens = Lens {
        id: "lens".into(),
        focal_px: Some(LENS.focal_px),
        principal_px: None,
        radial: DVec2::ZERO,
        fit: Fit { focal: false, principal: false, k1: false, k2: false },
    };
    let model =
        Model { lenses: vec![lens], photographs: photographs.collect(), ..Model::default() };
    let back = turn.transpose();
    let world = Similarity { scale: 1.0 / ENGINE, rotation: back, shift: -(back * shift) / ENGINE };
    (model, truth, world)
}

fn pixel(pose: &Pose, point: DVec3) -> DVec2 {
    pose.project(&LENS, point).unwrap().pixel
}

/// Two points 1 m apart along x on the floor, shown in two photographs, and lines along z.
fn strokes(model: &mut Model, truth: &[Pose]) {
    let points = [DVec3::ZERO, DVec3::X];
    model.points = ["a", "b"].map(|id| Point { id: id.into() }).into();
    for photograph in [0, 2] {
        for (index, point) in points.into_iter().enumerate() {
            let pixel = pixel(&truth[photograph], point);
            model.strokes.push(Stroke::Pick { photograph, at: Place::Point(index), pixel });
        }
        let at = |z: f64| pixel(&truth[photograph], DVec3::new(0.2, -0.4, z));
        model.strokes.push(line(photograph, Axis::Z, at(0.0), at(0.9)));
    }
    let at = |x: f64| pixel(&truth[1], DVec3::new(x, 0.3, 0.2));
    model.strokes.push(line(1, Axis::X, at(-0.5), at(0.6)));
    let at = |x: f64| pixel(&truth[3], DVec3::new(x, -0.3, 0.4));
    model.strokes.push(line(3, Axis::X, at(-0.5), at(0.6)));
}

fn line(photograph: usize, axis: Axis, from: DVec2, to: DVec2) -> Stroke {
    Stroke::Line { photograph, axis, from, to }
}

#[test]
fn derivatives_are_those_of_differences() {
    let (mut model, truth, world) = scene();
    strokes(&mut model, &truth);
    let mut state = State::unplaced(&model, &[LENS.focal_px]);
    state.found = world.moved([0.1, 0.2, -0.3, 0.15, 0.3, -0.2, 0.1]);
    let off = |index: usize| 0.1 * (1.0 + index as f64);
    state.poses = truth
        .iter()
        .enumerate()
        .map(|(index, pose)| {
            Some(pose.moved(DVec3::new(off(index), -0.2, 0.3), DVec3::new(0.1, off(index), -0.1)))
        })
        .collect();
    let rows = differentiated(&model, &Rig::of(&model, &state, 3.0), &state);
    assert_eq!(rows, 24);
}

/// Compares the derivatives of a rig's residuals with differences, and counts the residuals.
#[track_caller]
pub fn differentiated(model: &Model, rig: &Rig, state: &State) -> usize {
    let unknowns = Unknowns::of(model, state);
    let base = rig.rows(model, state, &unknowns);
    let mut checked = 0;
    for column in 0..unknowns.list.len() {
        let at = |h: f64| {
            let mut step = vec![0.0; unknowns.list.len()];
            step[column] = h;
            rig.rows(model, &unknowns.moved(state, &step), &unknowns)
        };
        let (low, high) = (at(-1e-6), at(1e-6));
        for (index, row) in base.iter().enumerate() {
            let slope: f64 = row.slopes.iter().filter(|own| own.0 == column).map(|own| own.1).sum();
            let expected = (high[index].value - low[index].value) / 2e-6;
            assert!((slope - expected).abs() < 1e-4 * (1.0 + expected.abs()), "{index} {column}");
            checked += usize::from(expected.abs() > 1.0);
        }
    }
    assert!(checked > 100, "{checked}");
    base.len()
}

#[test]
fn cameras_alone_stand_upright_and_notes_say_what_is_guessed() {
    let (model, truth, _) = scene();
    let solution = solve(&model, &AdjustOptions::default()).unwrap();
    assert!(solution.is_usable(), "{:?}", solution.problems);
    let cameras: Vec<_> = solution.cameras.iter().flatten().collect();
    assert_eq!(cameras.len(), 4);
    // Distances are in proportion, and the tilt is right: these cameras are not rolled.
    let apart = |a: usize, b: usize| cameras[a].position.distance(cameras[b].position);
    let true_apart = |a: usize, b: usize| truth[a].position.distance(truth[b].position);
    assert!((apart(0, 3) / apart(0, 1) - true_apart(0, 3) / true_apart(0, 1)).abs() < 1e-9);
    for (camera, pose) in cameras.iter().zip(&truth) {
        assert!((camera.world_from_camera.z_axis.z - pose.world_from_camera.z_axis.z).abs() < 1e-6);
    }
    assert_eq!(solution.notes.len(), 2, "{:?}", solution.notes);
    assert!(solution.notes[0].contains("up is guessed"), "{:?}", solution.notes);
}

#[test]
fn strokes_put_the_cameras_into_the_world() {
    let (mut model, truth, _) = scene();
    strokes(&mut model, &truth);
    let solution = solve(&model, &AdjustOptions::default()).unwrap();
    assert!(solution.is_usable(), "{:?}", solution.problems);
    // The first point is the origin and the second 1 m away, as where nothing is found.
    for (camera, pose) in solution.cameras.iter().zip(&truth) {
        let camera = camera.as_ref().unwrap();
        assert!(camera.position.distance(pose.position) < 1e-5, "{:?}", camera.position);
        let turn = camera.world_from_camera.transpose() * pose.world_from_camera;
        assert!((turn.col(0).x + turn.col(1).y + turn.col(2).z - 3.0).abs() < 1e-9);
    }
    let notes = &solution.notes;
    assert!(!notes.iter().any(|note| note.contains("guessed")), "{notes:?}");
}

#[test]
fn metres_that_were_found_are_kept_until_a_length_is_given() {
    let (mut model, truth, _) = scene();
    let apart = |model: &Model| {
        let solution = solve(model, &AdjustOptions::default()).unwrap();
        assert!(solution.is_usable(), "{:?}", solution.problems);
        let place = |index: usize| solution.cameras[index].as_ref().unwrap().position;
        (place(0).distance(place(2)), solution.notes)
    };
    let true_apart = truth[0].position.distance(truth[2].position);
    let found_apart = ENGINE * true_apart;
    model.found_in_metres = true;
    let (distance, notes) = apart(&model);
    assert!((distance - found_apart).abs() < 1e-9, "{distance} {found_apart}");
    assert!(!notes.iter().any(|note| note.contains("length")), "{notes:?}");
    strokes(&mut model, &truth);
    let (distance, notes) = apart(&model);
    assert!((distance - found_apart).abs() < 1e-6, "{distance} {found_apart}");
    assert!(!notes.iter().any(|note| note.contains("length")), "{notes:?}");
    let between = [0, 1].map(Place::Point);
    model.strokes.push(Stroke::Length { between, length_m: 1.0, sd_m: 1e-3 });
    let (distance, _) = apart(&model);
    assert!((distance - true_apart).abs() < 1e-5, "{distance} {true_apart}");
}

#[test]
fn a_photograph_that_was_not_found_is_placed_by_what_the_others_show() {
    let (mut model, truth, _) = scene();
    strokes(&mut model, &truth);
    let corners = [
        DVec3::new(0.0, 0.5, 0.0),
        DVec3::new(0.6, 0.4, 0.5),
        DVec3::new(-0.5, -0.3, 0.2),
        DVec3::new(0.3, -0.6, 0.7),
        DVec3::new(-0.3, 0.6, 0.9),
        DVec3::new(0.7, -0.5, 0.1),
    ];
    for (index, corner) in corners.into_iter().enumerate() {
        model.points.push(Point { id: format!("c{index}") });
        for photograph in [0, 1, 3] {
            let at = Place::Point(2 + index);
            let pixel = pixel(&truth[photograph], corner);
            model.strokes.push(Stroke::Pick { photograph, at, pixel });
        }
    }
    model.photographs[3].found = None;
    let solution = solve(&model, &AdjustOptions::default()).unwrap();
    assert!(solution.is_usable(), "{:?}", solution.problems);
    let camera = solution.cameras[3].as_ref().unwrap();
    assert!(camera.position.distance(truth[3].position) < 1e-4, "{:?}", camera.position);
    // Without strokes it stays unplaced, and the others stand.
    model.strokes.retain(|stroke| stroke.photograph() != Some(3));
    let solution = solve(&model, &AdjustOptions::default()).unwrap();
    assert!(solution.cameras[3].is_none() && solution.cameras[2].is_some());
    assert_eq!(solution.unplaced.len(), 1, "{:?}", solution.unplaced);
}

#[test]
fn what_was_found_is_written_and_read_again_and_damage_is_told() {
    let (mut model, truth, _) = scene();
    strokes(&mut model, &truth);
    let point = |x: f64, photographs: &[usize]| FoundPoint {
        position: DVec3::new(x, -1.5e-7, 3.0),
        photographs: photographs.to_vec(),
        pixels: Vec::new(),
    };
    model.found_points = Arc::new(vec![point(0.1, &[0, 3]), point(2.0, &[1, 2, 3])]);
    model.photographs[1].found = None;
    model.found_in_metres = true;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("model.json");
    lobelia::io::model::write(&file, &model).unwrap();
    let read = lobelia::io::model::read(&file).unwrap();
    assert!(read.found_in_metres);
    assert_eq!(read.found_points, model.found_points);
    assert!(read.photographs[1].found.is_none());
    for (own, before) in read.photographs.iter().zip(&model.photographs) {
        let (Some(own), Some(before)) = (own.found, before.found) else { continue };
        assert_eq!((own.pose.position, own.distance), (before.pose.position, before.distance));
        let turn = own.pose.world_from_camera - before.pose.world_from_camera;
        assert!(turn.to_cols_array().iter().all(|own| own.abs() < 1e-14));
    }
    let text = std::fs::read_to_string(&file).unwrap();
    let distance = format!("\"distance\": {}", 3.0 * ENGINE);
    for (old, new, part) in [
        ("0.1 -0.00000015 3  0 3", "0.1 3  0 3 x", "this is no point"),
        ("0.1 -0.00000015 3  0 3", "0.1 1 3  0 9", "this is no point"),
        (distance.as_str(), "\"distance\": 0", "more than 0"),
    ] {
        assert!(text.contains(old), "{old} is missing in {text}");
        std::fs::write(&file, text.replacen(old, new, 1)).unwrap();
        let problem = lobelia::io::model::read(&file).unwrap_err().to_string();
        assert!(problem.contains(part), "{problem}");
    }
}

#[test]
fn an_engine_gives_lenses_and_a_second_run_replaces_the_first() {
    let (mut model, truth, _) = scene();
    model.drop_found(None);
    assert!(!model.has_found());
    let camera = |index: usize, focal_px: f64| {
        let lens = Optic { focal_px, ..LENS };
        Some(truth[index].camera(&lens, (640, 480)))
    };
    let cameras = vec![camera(0, 500.0), None, camera(2, 500.0), camera(3, 700.0)];
    let found = FoundCameras { engine: "engine".into(), cameras, ..Default::default() };
    model.take_found(&found);
    let lens = |index: usize| {
        let lens = model.photographs[index].lens;
        (lens, model.lenses[lens].focal_px)
    };
    assert_eq!([0, 2, 3].map(lens), [(0, Some(500.0)), (0, Some(500.0)), (1, Some(700.0))]);
    assert_eq!((model.lenses[1].id.as_str(), model.lenses[1].fit.focal), ("lens2", false));
    assert!(model.photographs[1].found.is_none());
    let cameras = vec![camera(0, 600.0), camera(1, 600.0), camera(2, 600.0), None];
    model.take_found(&FoundCameras { cameras, ..found });
    let lenses: Vec<usize> = model.photographs.iter().map(|own| own.lens).collect();
    assert_eq!((lenses, model.lenses[0].focal_px), (vec![0, 0, 0, 1], Some(600.0)));
    assert!(model.photographs[3].found.is_none());
}
