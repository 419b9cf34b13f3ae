//! Conventions for the origin, the rotation about the vertical and the scale of a model.
//! Photographs do not determine these. If no stroke gives them, they are chosen here, so that a
//! model of one box can be solved, and a note says what was chosen.

use glam::DVec3;

use super::things::{self, Kind};
use super::unknowns::State;
use super::{Axis, Model, Place, Shape, Stroke, Support};

/// Standard deviation of the chosen values, in metres. Nothing contradicts them, so that each holds
/// exactly whatever this is.
const CHOSEN_SD_M: f64 = 1e-3;

/// The model with what was chosen as further strokes and held numbers, and a note on each choice.
pub fn completed(model: &Model) -> (Model, Vec<String>) {
    let mut model = model.clone();
    let mut notes = Vec::new();
    let positions = model.strokes.iter().filter(|s| matches!(s, Stroke::Position { .. })).count();
    let held_kinds: Vec<Kind> = model.things.iter().flat_map(held_kinds).collect();
    let holds = |kind: Kind| held_kinds.contains(&kind);
    // A length that ends where nothing can be placed does not give the scale.
    let is_told = |s: &Stroke| match s {
        Stroke::Length { between, .. } => between.iter().all(|&at| model.can_place(at, |_| true)),
        _ => false,
    };
    let is_lengthless = !model.strokes.iter().any(is_told);
    let is_scaleless =
        is_lengthless && positions < 2 && !holds(Kind::Length) && !model.scale_is_found();
    let runs_level = |s: &Stroke| matches!(s, Stroke::Line { axis: Axis::X | Axis::Y, .. });
    let is_turned = positions > 1
        || holds(Kind::Yaw)
        || model.strokes.iter().any(runs_level)
        || model.things.iter().any(|t| matches!(t.shape, Shape::Room { rectilinear: true, .. }));
    // The first thing on the floor, or else the first point that is drawn.
    let first = model.things.iter().position(|thing| thing.on == Support::Floor);
    let drawn = |other: Option<Place>| {
        let mut places = model.strokes.iter().flat_map(|stroke| stroke.places()).copied();
        places.find(|&place| Some(place) != other)
    };
    let corner = |corner: usize| match first {
        Some(thing) if model.things[thing].shape != Shape::Cylinder => {
            Some(Place::Corner { thing, corner })
        }
        Some(_) => None,
        None => drawn(None).filter(|_| corner == 0).or_else(|| drawn(drawn(None))),
    };
    let (origin, second) = (corner(0), corner(1));
    if positions == 0 && !(holds(Kind::Coordinate(0)) && holds(Kind::Coordinate(1))) {
        if let Some(at) = origin {
            notes.push(format!("No origin is given: it lies in {}.", model.place_name(at)));
            model.strokes.push(Stroke::Position { at, position: DVec3::ZERO, sd_m: CHOSEN_SD_M });
        } else if let Some(thing) = first {
            notes.push(format!("No origin is given: it lies below {}.", model.things[thing].id));
            model.things[thing].held.extend([("x".to_owned(), 0.0), ("y".to_owned(), 0.0)]);
        }
    }
    if is_scaleless && let Some((a, b)) = origin.zip(second) {
        let (from, to) = (model.place_name(a), model.place_name(b));
        notes.push(format!("No length is known: {from} to {to} is taken to be 1 m."));
        let between = [a, b];
        model.strokes.push(Stroke::Length { between, length_m: 1.0, sd_m: CHOSEN_SD_M });
    }
    let free_box = |thing: &things::Thing| thing.shape == Shape::Box { flush: None };
    if !is_turned && let Some(thing) = model.things.iter_mut().find(|thing| free_box(thing)) {
        notes.push(format!("No direction is given: x runs along the width of {}.", thing.id));
        thing.held.push(("yaw".to_owned(), 0.0));
    }
    (model, notes)
}

/// What the numbers measure that were typed for a thing.
fn held_kinds(thing: &things::Thing) -> Vec<Kind> {
    let parameters = things::parameters(thing);
    let is_held = |name: &str| thing.held.iter().any(|(own, _)| own == name);
    parameters.into_iter().filter(|own| is_held(&own.name)).map(|own| own.kind).collect()
}

/// Where a corner or point is; `corners` are those of every thing in that state.
pub fn at(state: &State, corners: &[Vec<DVec3>], place: Place) -> Option<DVec3> {
    match place {
        Place::Corner { thing, corner } => corners[thing].get(corner).copied(),
        Place::Point(index) => state.points[index],
    }
}
