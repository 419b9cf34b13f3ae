//! Planes and boxes that are fitted to points which an engine found, in a scene of known answer.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use lobelia::model::from_points::{Fitted, Wanted, fit};
use lobelia::model::{FoundPoint, Model, Place, Shape, Solution, Stroke, Support};

use crate::box_of_points::{BOX, corners, found, points, told};
use crate::solved;

/// An outline around what lies on the box in the middle photograph.
fn outline(solution: &Solution, places: &[DVec3], wide: f64) -> Vec<DVec2> {
    let camera = solution.cameras[2].unwrap();
    let pixels: Vec<DVec2> = places.iter().map(|own| camera.project(*own).unwrap().0).collect();
    let middle = pixels.iter().sum::<DVec2>() / pixels.len() as f64;
    let around = (0..64).map(|k| DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 64.0));
    let far = |way: DVec2| pixels.iter().map(|own| (*own - middle).dot(way)).fold(0.0, f64::max);
    around.map(|way| middle + (far(way) * wide + 4.0) * way).collect()
}

fn fitted(model: &Model, places: &[DVec3], wanted: Wanted) -> Fitted {
    let solution = solved(model);
    let outline = outline(&solution, places, 1.05);
    fit(model, &solution, 2, &outline, wanted).unwrap_or_else(|error| panic!("{error}"))
}

/// How far corners are from where they belong at most; whichever is called the first.
fn apart(own: &[DVec3], truth: &[DVec3]) -> f64 {
    let far = |own: &DVec3| truth.iter().map(|b| own.distance(*b)).fold(f64::INFINITY, f64::min);
    own.iter().map(far).fold(0.0, f64::max)
}

/// All of the box within 8 mm (its sides are half a metre, and points lie 8 mm apart at its ends);
/// after the strokes are solved, too.
#[test]
fn a_box_among_outliers_comes_back() {
    let points = points(250);
    let model = told(&points);
    let own = fitted(&model, &corners(), Wanted::Box);
    assert_eq!(own.model.things[own.thing].shape, Shape::Box { flush: None });
    assert_eq!(own.model.things[own.thing].on, Support::Floor);
    let off = apart(&own.corners, &corners());
    println!("box: {off} m, {}", own.words());
    assert!(off < 0.008, "{off} m");
    assert!(own.off_px < 1.5 && own.points[1] > 650, "{:?}", own.points);
    assert!(own.photographs.len() >= 3 && own.photographs.contains(&2));
    let solution = solved(&own.model);
    let after = apart(&solution.corners[own.thing], &corners());
    assert!(after < 0.009, "{after} m");
    assert!(solution.stroke_px.unwrap() < 1.0);
    // The hidden corner at the back is not marked.
    let hidden = corners()[2];
    for stroke in &own.model.strokes {
        if let Stroke::Pick { at: Place::Corner { corner, .. }, .. } = stroke {
            assert!(own.corners[*corner].distance(hidden) > 0.1, "{stroke:?}");
        }
    }
}

/// Where nothing tells which way is up, the box does: its sizes come back up to one scale.
#[test]
fn a_box_tells_where_up_is() {
    let model = found(&points(250));
    let solution = solved(&model);
    assert!(solution.state.kept[1] && solution.state.kept[6], "nothing is told");
    let places: Vec<DVec3> = model.found_points[..750]
        .iter()
        .map(|own| solution.state.found.point(own.position))
        .collect();
    let outline = outline(&solution, &places, 1.0);
    let own = fit(&model, &solution, 2, &outline, Wanted::Box).unwrap();
    println!("{}", own.words());
    let solution = solved(&own.model);
    let corners = &solution.corners[own.thing];
    let sizes = [[0, 1], [1, 2], [0, 4]].map(|[a, b]| corners[a].distance(corners[b]));
    let scale = sizes[2] / BOX.z;
    let mut level = [sizes[0] / scale, sizes[1] / scale];
    level.sort_by(f64::total_cmp);
    println!("{level:?} {scale}");
    assert!((level[0] - BOX.y).abs() < 0.01 && (level[1] - BOX.x).abs() < 0.01, "{level:?}");
    assert!(solution.state.found.rotation.is_finite());
    assert!(!solution.state.kept[1] && !solution.state.kept[6], "the box tells it");
}

/// The top alone, among wrong points and those of the sides.
#[test]
fn a_plane_among_outliers_comes_back() {
    let points = points(250);
    let model = told(&points);
    let top = &corners()[4..];
    let own = fitted(&model, top, Wanted::Plane);
    let off = apart(&own.corners, top);
    println!("plane: {off} m, {}", own.words());
    assert!(off < 0.012, "{off} m");
    assert_eq!(own.model.things[own.thing].shape, Shape::Polygon { corners: 4 });
    assert_eq!(own.model.things[own.thing].on, Support::Free);
    let level = own.corners.iter().map(|own| (own.z - BOX.z).abs()).fold(0.0, f64::max);
    assert!(level < 0.003, "{level} m");
    // Counter-clockwise seen from above.
    let [a, b, c, _] = own.corners[..] else { panic!() };
    assert!((b - a).cross(c - b).z > 0.0);
    let after = &solved(&own.model).corners[own.thing];
    assert!(apart(after, &own.corners) < 0.002, "{after:?}");
}

/// Above a box that is there already, a plane lies on its top, and a box stands on it.
#[test]
fn what_lies_on_a_thing_is_put_onto_it() {
    let points = points(250);
    let own = fitted(&told(&points), &corners(), Wanted::Box);
    let on_top = fitted(&own.model, &corners()[4..], Wanted::Plane);
    assert_eq!(on_top.model.things[on_top.thing].on, Support::Top(own.thing));
    assert!(solved(&on_top.model).corners[on_top.thing].len() == 4);
}

#[test]
fn what_cannot_be_fitted_is_told() {
    let model = told(&points(60));
    let solution = solved(&model);
    let error = |model: &Model, solution: &Solution, outline: &[DVec2], wanted| {
        fit(model, solution, 2, outline, wanted).unwrap_err().to_string()
    };
    let around = outline(&solution, &corners(), 1.05);
    let none = error(&model, &solution, &[], Wanted::Plane);
    assert!(none.starts_with("the outline holds 0 points"), "{none}");
    let corner = DVec2::splat(2.0);
    let few = [corner, 2.0 * corner, DVec2::new(4.0, 2.0)];
    assert!(error(&model, &solution, &few, Wanted::Box).starts_with("the outline holds 0 points"));
    // One face is no box.
    let mut flat = model.clone();
    flat.found_points =
        Arc::new(model.found_points[..180].iter().skip(1).step_by(3).cloned().collect());
    let own = error(&flat, &solution, &around, Wanted::Box);
    assert!(own.starts_with("the points show one flat face"), "{own}");
    // A photograph that stands nowhere.
    let mut lost = solution.clone();
    lost.cameras[2] = None;
    let own = error(&model, &lost, &around, Wanted::Box);
    assert!(own.contains("images/2.exr is not placed yet"), "{own}");
    // Points that no other photograph shows.
    let mut alone = model.clone();
    let only = |own: &FoundPoint| FoundPoint { photographs: vec![2], ..own.clone() };
    alone.found_points = Arc::new(model.found_points.iter().map(only).collect());
    let own = error(&alone, &solution, &around, Wanted::Box);
    assert!(
        own.contains("no photograph but images/2.exr shows these points and all corners"),
        "{own}"
    );
}
