//! Things that are moved onto the lines of painted photographs.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use lobelia::io::model::caster;
use lobelia::model::lines::{Line, Picture, detect};
use lobelia::model::things::{Surfaces, corner_names};
use lobelia::model::to_edges::{self, Fitted};
use lobelia::model::{
    Axis, Fit, Lens, Model, Photograph, Place, Shape, Solution, Stroke, Support, Thing, Unsolved,
};
use lobelia::watch::Watch;

use crate::painted::painted;
use crate::solved;

const SIZE: (usize, usize) = (640, 480);
const FOCAL: f64 = 620.0;
/// A box by its middle, width, depth, height; a cylinder by its middle, radius and height.
const BOX: [f64; 5] = [0.0, 0.0, 0.9, 0.6, 0.5];
const CAN: [f64; 4] = [1.1, 0.35, 0.3, 0.7];
const CAMERAS: [[f64; 3]; 3] = [[1.4, -3.0, 1.6], [-1.7, -2.6, 1.4], [2.9, 2.1, 1.9]];

/// Where a camera that looks at the scene shows a point.
fn shown(camera: usize, point: DVec3) -> DVec2 {
    let position = DVec3::from_array(CAMERAS[camera]);
    let back = (position - DVec3::new(0.4, 0.1, 0.25)).normalize();
    let right = DVec3::Z.cross(back).normalize();
    let axes = DMat3::from_cols(right, back.cross(right), back);
    let own = axes.transpose() * (point - position);
    DVec2::new(own.x, -own.y) / -own.z * FOCAL + 0.5 * DVec2::new(SIZE.0 as f64, SIZE.1 as f64)
}

fn corner(index: usize) -> DVec3 {
    let [x, y, width, depth, height] = BOX;
    let (s, t) = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)][index % 4];
    DVec3::new(x + s * width, y + t * depth, if index < 4 { 0.0 } else { height })
}

fn on_can(top: bool, angle: f64) -> DVec3 {
    let [x, y, radius, height] = CAN;
    let z = if top { height } else { 0.0 };
    DVec3::new(x + radius * angle.cos(), y + radius * angle.sin(), z)
}

/// The convex hull, by Andrew's monotone chain.
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - b) <= 1e-9
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let lower = half(&mut points.iter().copied());
    [lower, half(&mut points.iter().rev().copied())].concat()
}

/// What the photographs show: box and can, which cover each other in none.
fn lines(noise: f64) -> Vec<Arc<Vec<Line>>> {
    let lines = |camera: usize| {
        let ring = |top: bool| (0..72).map(move |k| on_can(top, k as f64 * TAU / 72.0));
        let seen = |point: DVec3| shown(camera, point);
        let top: Vec<DVec2> = ring(true).map(seen).collect();
        let both = ring(true).chain(ring(false)).map(seen).collect();
        let mut polygons = vec![(top, 215.0), (hull(both), 75.0)];
        let faces = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 6, 7]];
        for (face, grey) in faces.into_iter().zip([70.0, 100.0, 60.0, 95.0, 200.0]) {
            let own: Vec<DVec2> = face.iter().map(|&index| seen(corner(index))).collect();
            // Counter-clockwise from outside is clockwise with y down.
            if (own[1] - own[0]).perp_dot(own[2] - own[0]) < 0.0 {
                polygons.push((own, grey));
            }
        }
        let pixels = painted(SIZE, &polygons, 140.0, noise);
        let (width, height) = SIZE;
        Arc::new(detect(&Picture { pixels: &pixels, width, height, step: 1 }))
    };
    (0..CAMERAS.len()).map(lines).collect()
}

/// The scene with all strokes where they belong.
fn model() -> Model {
    let thing = |id: &str, shape: Shape| Thing {
        id: id.to_owned(),
        shape,
        on: Support::Floor,
        held: Vec::new(),
        surfaces: Surfaces::default(),
    };
    let lens = Lens {
        id: "lens".into(),
        focal_px: Some(FOCAL),
        principal_px: None,
        radial: DVec2::ZERO,
        fit: Fit { focal: false, principal: false, k1: false, k2: false },
    };
    let photograph = |index: usize| Photograph {
        name: format!("{index}.png"),
        lens: 0,
        size: SIZE,
        found: None,
    };
    let mut model = Model {
        lenses: vec![lens],
        photographs: (0..CAMERAS.len()).map(photograph).collect(),
        things: vec![thing("crate", Shape::Box { flush: None }), thing("can", Shape::Cylinder)],
        ..Model::default()
    };
    for photograph in 0..CAMERAS.len() {
        let along = [(Axis::X, [0, 1]), (Axis::X, [4, 5]), (Axis::Y, [1, 2]), (Axis::Y, [5, 6])];
        for (axis, ends) in along.into_iter().chain([(Axis::Z, [0, 4]), (Axis::Z, [2, 6])]) {
            let [from, to] = ends.map(|index| shown(photograph, corner(index)));
            model.strokes.push(Stroke::Line { photograph, axis, from, to });
        }
        for index in 0..8 {
            let at = Place::Corner { thing: 0, corner: index };
            let pixel = shown(photograph, corner(index));
            model.strokes.push(Stroke::Pick { photograph, at, pixel });
        }
        for (top, k) in (0..12).map(|k| (k % 2 == 0, k)) {
            let pixel = shown(photograph, on_can(top, k as f64 * TAU / 12.0));
            model.strokes.push(Stroke::Rim { photograph, thing: 1, top, pixel });
        }
    }
    // The places of two corners say where the world lies.
    for index in 0..2 {
        let at = Place::Corner { thing: 0, corner: index };
        model.strokes.push(Stroke::Position { at, position: corner(index), sd_m: 1e-3 });
    }
    assert_eq!(corner_names(&model.things[0]).len(), 8);
    model
}

/// The model solved, then with one thing somewhere else: its numbers and its strokes.
fn displaced(thing: usize, by: &[f64]) -> (Model, Solution) {
    let (mut model, mut solution) = (model(), solved(&model()));
    // Typed places would pull the box back.
    model.strokes.retain(|stroke| !matches!(stroke, Stroke::Position { .. }));
    let before = solution.state.clone();
    for (value, by) in solution.state.things[thing].iter_mut().flatten().zip(by) {
        *value += by;
    }
    let model = to_edges::follow(&model, &before, &solution.state, thing);
    (model, solution)
}

fn fitted(thing: usize, by: &[f64], lines: &[Arc<Vec<Line>>]) -> Result<(Fitted, f64), Unsolved> {
    let (model, solution) = displaced(thing, by);
    let fitted = to_edges::fit(&model, &solution, thing, lines, caster, &Watch::new())?;
    // By how many pixels the strokes are off now from where they belong.
    let pixels = |model: &Model| -> Vec<DVec2> {
        let pixel = |stroke: &Stroke| match stroke {
            Stroke::Pick { pixel, .. } | Stroke::Rim { pixel, .. } => Some(*pixel),
            _ => None,
        };
        model.strokes.iter().filter_map(pixel).collect()
    };
    let off = |model: &Model| {
        let pairs = pixels(model).into_iter().zip(pixels(&self::model()));
        pairs.map(|(a, b)| a.distance(b)).fold(0.0, f64::max)
    };
    println!("strokes off by {:.2} px, then {:.2} px: {fitted:?}", off(&model), off(&fitted.model));
    assert!(off(&model) > 5.0);
    let after = off(&fitted.model);
    Ok((fitted, after))
}

/// Every number of a box wrong, by 5 to 15 px in the photographs: all corners come back to 0.5 px,
/// with noise to 1 px; every edge is seen.
#[test]
fn a_box_comes_to_lie_on_its_edges() {
    let moves = [
        [0.03, 0.02, 0.02, 0.03, -0.02, 0.02],
        [-0.04, 0.01, -0.03, -0.02, 0.04, -0.03],
        [0.02, -0.04, 0.04, 0.02, 0.03, 0.03],
    ];
    for (noise, most) in [(0.0, 0.5), (4.0, 1.0)] {
        let lines = lines(noise);
        for by in &moves {
            let (fitted, off) = fitted(0, by, &lines).unwrap();
            assert!(off < most, "{off} px with noise {noise}");
            assert!(fitted.off_px[1] < 0.3 && fitted.off_px[0] > 3.0, "{:?}", fitted.off_px);
            assert!(fitted.part > 0.9 && fitted.photographs == 3, "{fitted:?}");
            assert!(
                fitted.words("crate").contains("of 3 photographs"),
                "{}",
                fitted.words("crate")
            );
        }
    }
}

#[test]
fn a_cylinder_comes_to_lie_on_its_outline() {
    let lines = lines(0.0);
    for by in [[0.03, 0.02, 0.01, 0.02], [-0.03, 0.01, -0.02, -0.02]] {
        let (fitted, off) = fitted(1, &by, &lines).unwrap();
        assert!(off < 1.5, "{off} px");
        assert!(fitted.off_px[1] < 1.0 && fitted.off_px[0] > 2.0, "{:?}", fitted.off_px);
    }
}

/// Only strokes about the thing move, and what was typed about it counts.
#[test]
fn nothing_else_moves() {
    let lines = lines(0.0);
    let (mut model, solution) = displaced(0, &[0.03, 0.02, 0.02, 0.03, -0.02, 0.0]);
    let count = model.strokes.len();
    model.things[0].held.push(("height".to_owned(), solution.state.things[0].as_ref().unwrap()[5]));
    let fitted = to_edges::fit(&model, &solution, 0, &lines, caster, &Watch::new()).unwrap();
    assert_eq!(fitted.values[5], model.things[0].held[0].1);
    assert_eq!(fitted.model.strokes.len(), count);
    for (before, after) in model.strokes.iter().zip(&fitted.model.strokes) {
        if let Stroke::Rim { .. } = before {
            assert_eq!(before, after);
        }
    }
    assert_eq!((&fitted.model.things, &fitted.model.lenses), (&model.things, &model.lenses));
}

#[test]
fn without_lines_nothing_moves_and_words_say_why() {
    let (mut model, mut solution) = displaced(0, &[0.03, 0.02, 0.02, 0.03, -0.02, 0.02]);
    let none = vec![Arc::default(); 3];
    let error = |model: &Model, solution: &Solution, lines: &[Arc<Vec<Line>>]| {
        let outcome = to_edges::fit(model, solution, 0, lines, caster, &Watch::new());
        match outcome {
            Err(Unsolved::Model(error)) => error,
            other => panic!("{other:?}"),
        }
    };
    let own = error(&model, &solution, &none);
    assert_eq!(own.place, "things[0] (crate)");
    assert!(own.to_string().starts_with("no lines of the photographs lie near crate"), "{own}");
    // Fewer lists than photographs are as good as none.
    assert!(error(&model, &solution, &[]).to_string().starts_with("no lines"), "{own}");
    // A line far from all of it.
    let far = Line { ends: [DVec2::new(2.0, 2.0), DVec2::new(600.0, 4.0)], sd_px: 0.25 };
    let far = Arc::new(vec![far]);
    let own = error(&model, &solution, &vec![far; 3]);
    assert!(own.to_string().starts_with("no lines"), "{own}");
    let values = solution.state.things[0].clone().unwrap();
    let names = ["x", "y", "yaw", "width", "depth", "height"];
    model.things[0].held = names.map(str::to_owned).into_iter().zip(values).collect();
    let own = error(&model, &solution, &lines(0.0));
    assert!(own.to_string().contains("all numbers of crate are held"), "{own}");
    model.things[0].held.clear();
    for position in solution.state.poses.iter_mut().flatten().map(|pose| &mut pose.position) {
        *position = -*position;
    }
    let own = error(&model, &solution, &lines(0.0));
    assert!(own.to_string().contains("crate"), "{own}");
    solution.state.things[0] = None;
    let own = error(&model, &solution, &none);
    assert!(own.to_string().contains("crate is not placed yet"), "{own}");
}
