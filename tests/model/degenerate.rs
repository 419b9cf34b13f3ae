//! Cases that have no answer end in words, and never in numbers that are none.

use glam::{DMat3, DVec2, DVec3};
use lobelia::model::calibrate::resect::{NoCamera, Sight, resect};
use lobelia::model::{
    AdjustOptions, Axis, Fit, Lens, Model, Photograph, Place, Point, Pose, Shape, Solution, Stroke,
    Support, Surfaces, Thing, solve,
};

use crate::{read, solved};

const FOCAL: f64 = 800.0;
const SIZE: (usize, usize) = (1000, 800);

/// A camera of these tests: its projection shares nothing with the program's.
#[derive(Clone, Copy)]
struct Eye {
    position: DVec3,
    forward: DVec3,
    right: DVec3,
}

impl Eye {
    fn at(position: DVec3, target: DVec3) -> Self {
        let forward = (target - position).normalize();
        Self { position, forward, right: forward.cross(DVec3::Z).normalize() }
    }

    fn sees(&self, point: DVec3) -> DVec2 {
        let (from, down) = (point - self.position, self.forward.cross(self.right));
        let depth = from.dot(self.forward);
        DVec2::new(
            500.0 + FOCAL * from.dot(self.right) / depth,
            400.0 + FOCAL * from.dot(down) / depth,
        )
    }
}

fn model(photographs: usize, focal_px: Option<f64>) -> Model {
    let photograph =
        |index| Photograph { name: format!("{index}.png"), lens: 0, size: SIZE, found: None };
    Model {
        lenses: vec![Lens {
            id: "lens".into(),
            focal_px,
            principal_px: None,
            radial: DVec2::ZERO,
            fit: Fit { focal: focal_px.is_none(), ..Fit::default() },
        }],
        photographs: (0..photographs).map(photograph).collect(),
        ..Model::default()
    }
}

fn line(eye: &Eye, photograph: usize, axis: Axis, from: DVec3) -> Stroke {
    let to = from + axis.direction();
    Stroke::Line { photograph, axis, from: eye.sees(from), to: eye.sees(to) }
}

fn cube(id: &str) -> Thing {
    Thing {
        id: id.into(),
        shape: Shape::Box { flush: None },
        on: Support::Floor,
        held: Vec::new(),
        surfaces: Surfaces::default(),
    }
}

/// Corners of a unit box about the origin, in the order of its names.
fn corners() -> Vec<DVec3> {
    let ring = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
    let level = |z: f64| ring.map(|(x, y)| DVec3::new(x, y, z));
    [level(0.0), level(1.0)].concat()
}

fn picks(eye: &Eye, photograph: usize, thing: usize, which: &[usize]) -> Vec<Stroke> {
    let pick = |&corner: &usize| Stroke::Pick {
        photograph,
        at: Place::Corner { thing, corner },
        pixel: eye.sees(corners()[corner]),
    };
    which.iter().map(pick).collect()
}

/// Everything that is wrong, as one text; all numbers of a solution are finite.
fn words(model: &Model) -> String {
    match solve(model, &AdjustOptions::default()) {
        Err(error) => format!("{} {error}", error.place),
        Ok(solution) => {
            is_finite(&solution);
            let all = solution.problems.iter().chain(&solution.unplaced);
            all.map(|own| format!("{} {own}", own.place)).collect::<Vec<_>>().join("\n")
        }
    }
}

fn is_finite(solution: &Solution) {
    let corners = solution.corners.iter().flatten();
    assert!(corners.into_iter().all(|corner| corner.is_finite()));
    assert!(solution.strokes.iter().all(|own| own.residual.is_finite()));
    for pose in solution.state.poses.iter().flatten() {
        assert!(pose.position.is_finite() && pose.world_from_camera.is_finite());
    }
}

#[track_caller]
fn says(model: &Model, parts: &[&str]) {
    let text = words(model);
    for part in parts {
        assert!(text.contains(part), "\"{part}\" is missing in: {text}");
    }
}

#[test]
fn a_box_alone_is_enough() {
    let eye = Eye::at(DVec3::new(2.4, -3.1, 2.2), DVec3::new(0.0, 0.0, 0.4));
    let mut model = model(1, None);
    model.things.push(cube("box"));
    model.strokes = picks(&eye, 0, 0, &[0, 1, 2, 4, 5, 6, 7]);
    let solution = solved(&model);
    assert!((solution.state.lenses[0].focal_px - FOCAL).abs() < 1e-5);
    // Origin, direction and size are chosen, and said.
    assert_eq!(solution.notes.len(), 3, "{:?}", solution.notes);
    let position = solution.state.poses[0].unwrap().position - DVec3::new(0.5, 0.5, 0.0);
    assert!(position.distance(eye.position) < 1e-6, "{position}");
}

#[test]
fn one_vanishing_point_leaves_the_focal_length_open() {
    let eye = Eye::at(DVec3::new(2.0, -4.0, 1.5), DVec3::ZERO);
    let mut model = model(1, None);
    for k in 0..4 {
        model.strokes.push(line(&eye, 0, Axis::X, DVec3::new(0.0, 0.3 * f64::from(k), 0.1)));
    }
    says(
        &model,
        &["0.png", "one vanishing point", "focal length is not determined", "second axis"],
    );
}

#[test]
fn lines_that_are_parallel_in_the_image_leave_the_focal_length_open() {
    // Straight on: what runs along x and z stays parallel.
    let eye = Eye::at(DVec3::new(0.0, -4.0, 0.5), DVec3::new(0.0, 0.0, 0.5));
    let mut model = model(1, None);
    for k in 0..3 {
        let place = DVec3::new(0.3 * f64::from(k) - 0.5, 0.2, 0.35 * f64::from(k) - 0.3);
        model.strokes.push(line(&eye, 0, Axis::X, place));
        model.strokes.push(line(&eye, 0, Axis::Z, place));
    }
    says(&model, &["0.png", "parallel in the image", "another axis"]);
}

#[test]
fn a_box_seen_edge_on_is_not_enough() {
    let eye = Eye::at(DVec3::new(0.0, -4.0, 0.5), DVec3::new(0.0, 0.0, 0.5));
    let mut model = model(1, None);
    model.things.push(cube("box"));
    model.strokes = picks(&eye, 0, 0, &[0, 1, 4, 5]);
    says(&model, &["0.png", "focal length is not determined"]);
    // With a focal length the depth of the box stays open.
    model.lenses[0].focal_px = Some(FOCAL);
    model.lenses[0].fit.focal = false;
    says(&model, &["the box box is not determined", "other photographs"]);
}

#[test]
fn photographs_from_one_place_do_not_tell_where_a_point_is() {
    let place = DVec3::new(2.4, -3.1, 2.2);
    let mut model = model(2, Some(FOCAL));
    model.things.push(cube("box"));
    model.points.push(Point { id: "far".into() });
    for (photograph, target) in
        [DVec3::new(0.0, 0.0, 0.4), DVec3::new(0.4, 0.3, 0.4)].iter().enumerate()
    {
        let eye = Eye::at(place, *target);
        model.strokes.extend(picks(&eye, photograph, 0, &[0, 1, 2, 4, 5, 6, 7]));
        let pixel = eye.sees(DVec3::new(-2.0, 3.0, 1.0));
        model.strokes.push(Stroke::Pick { photograph, at: Place::Point(0), pixel });
    }
    says(&model, &["the point far", "not determined"]);
}

#[test]
fn a_length_to_a_point_that_is_not_placed_gives_no_scale() {
    let eyes = [DVec3::new(2.4, -3.1, 2.2), DVec3::new(3.2, -1.9, 2.4)];
    let eyes = eyes.map(|place| Eye::at(place, DVec3::new(0.0, 0.0, 0.4)));
    let mut model = model(2, Some(FOCAL));
    model.things.push(cube("box"));
    model.points.push(Point { id: "roof".into() });
    for (photograph, eye) in eyes.iter().enumerate() {
        model.strokes.extend(picks(eye, photograph, 0, &[0, 1, 2, 4, 5, 6, 7]));
    }
    let point = Place::Point(0);
    let pixel = eyes[0].sees(DVec3::new(0.0, 0.5, 1.5));
    model.strokes.push(Stroke::Pick { photograph: 0, at: point, pixel });
    let corner = Place::Corner { thing: 0, corner: 4 };
    model.strokes.push(Stroke::Length { between: [corner, point], length_m: 3.0, sd_m: 1e-3 });
    let solution = solve(&model, &AdjustOptions::default()).unwrap();
    assert!(solution.problems.is_empty(), "{:?}", solution.problems);
    // The box is placed all the same, with the length that is chosen where none is known.
    assert_eq!(solution.unplaced.len(), 1, "{:?}", solution.unplaced);
    assert!(solution.unplaced[0].place.contains("roof"), "{:?}", solution.unplaced);
    assert!(solution.notes.iter().any(|note| note.contains("1 m")), "{:?}", solution.notes);
    let corners = &solution.corners[0];
    assert!((corners[0].distance(corners[1]) - 1.0).abs() < 1e-6, "{corners:?}");
}

#[test]
fn a_box_with_its_top_below_is_turned_inside_out() {
    let eye = Eye::at(DVec3::new(2.4, -3.1, 2.2), DVec3::new(0.0, 0.0, 0.4));
    let mut model = model(1, Some(FOCAL));
    model.things.push(cube("box"));
    model.strokes = picks(&eye, 0, 0, &[0, 1, 2, 4, 5, 6, 7]);
    for stroke in &mut model.strokes {
        // Clockwise: 1, 4, 3, 2.
        if let Stroke::Pick { at: Place::Corner { corner, .. }, .. } = stroke {
            *corner = *corner / 4 * 4 + (4 - *corner % 4) % 4;
        }
    }
    says(&model, &["inside out", "counter-clockwise"]);
}

#[test]
fn strokes_that_contradict_each_other_are_named() {
    let mut model = read("corner-diffuse.json");
    let mut turn = 0;
    for stroke in &mut model.strokes {
        if let Stroke::Pick { at: Place::Corner { thing: 1.., corner }, .. } = stroke {
            turn += 1;
            *corner = (*corner + turn * 3) % 8;
        }
    }
    let text = words(&model);
    assert!(text.contains("strokes[") || text.contains("things["), "{text}");
}

#[test]
fn one_wrong_stroke_does_no_harm_and_is_named() {
    let mut model = read("corner-diffuse.json");
    let sound = solved(&model);
    let at = model.strokes.iter().position(|own| matches!(own, Stroke::Pick { .. })).unwrap();
    let Stroke::Pick { pixel, .. } = &mut model.strokes[at] else { panic!() };
    pixel.x += 45.0;
    let harmed = solved(&model);
    assert!(harmed.notes.iter().any(|note| note.contains(&format!("strokes[{at}]"))));
    assert_eq!(harmed.worst().unwrap().stroke, at);
    for (a, b) in sound.state.poses.iter().zip(&harmed.state.poses) {
        // A tenth of what a camera is uncertain by.
        assert!(a.unwrap().position.distance(b.unwrap().position) < 0.01);
    }
}

#[test]
fn resection_says_what_is_missing() {
    let eye = Eye::at(DVec3::new(0.0, -4.0, 0.5), DVec3::new(0.0, 0.0, 0.5));
    let sights = |points: &[DVec3]| -> Vec<Sight> {
        let sight =
            |&point: &DVec3| Sight { point, pixel: eye.sees(point) - DVec2::new(500., 400.) };
        points.iter().map(sight).collect()
    };
    let wall: Vec<DVec3> =
        (0..6).map(|k| DVec3::new(f64::from(k % 3) - 1.0, 0.0, f64::from(k / 3))).collect();
    assert_eq!(resect(&sights(&wall[..3]), None, 1280.0).err(), Some(NoCamera::TooFew));
    assert_eq!(resect(&sights(&wall), None, 1280.0).err(), Some(NoCamera::FaceOn));
    let line: Vec<DVec3> = (0..6).map(|k| DVec3::X * f64::from(k)).collect();
    assert_eq!(resect(&sights(&line), Some(FOCAL), 1280.0).err(), Some(NoCamera::OnALine));
    // With the focal length the wall alone is enough, and so is a box without it.
    let is_there = |pose: Pose| {
        assert!(pose.position.distance(eye.position) < 1e-6, "{pose:?}");
        let forward = pose.world_from_camera * DVec3::NEG_Z;
        assert!((forward - DVec3::Y).length() < 1e-6 && pose.world_from_camera != DMat3::ZERO);
    };
    is_there(resect(&sights(&wall), Some(FOCAL), 1280.0).unwrap().0);
    let (pose, focal) = resect(&sights(&corners()), None, 1280.0).unwrap();
    is_there(pose);
    assert!((focal - FOCAL).abs() < 1e-6);
}
