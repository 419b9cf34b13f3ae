//! Finds the photographs with a known rotation, and the points and things in them, that can be
//! placed together.

use glam::DMat3;

use super::linear::Seen;
use crate::model::{Model, Place, Stroke};

/// What hangs together by picks and edges with the first known position, or else with the
/// first photograph.
pub(super) fn connected(model: &Model, rotations: &[Option<DMat3>]) -> Seen {
    let mut seen = Seen {
        photographs: vec![false; model.photographs.len()],
        things: vec![false; model.things.len()],
        points: vec![false; model.points.len()],
    };
    let reach = |seen: &mut Seen, place: Place| -> bool {
        let flag = match place {
            Place::Corner { thing, .. } => &mut seen.things[thing],
            Place::Point(point) => &mut seen.points[point],
        };
        !std::mem::replace(flag, true)
    };
    let has = |seen: &Seen, place: Place| match place {
        Place::Corner { thing, .. } => seen.things[thing],
        Place::Point(point) => seen.points[point],
    };
    let is_shown = |place: &Place| {
        model.strokes.iter().any(|stroke| {
            let is_same = |own: &Place| match (own, place) {
                (Place::Corner { thing: a, .. }, Place::Corner { thing: b, .. }) => a == b,
                _ => own == place,
            };
            stroke.photograph().is_some_and(|index| rotations[index].is_some())
                && stroke.places().iter().any(is_same)
        })
    };
    let mut known = model.strokes.iter().filter_map(|stroke| match stroke {
        Stroke::Position { at, .. } => Some(*at),
        _ => None,
    });
    match known.find(is_shown) {
        Some(first) => {
            reach(&mut seen, first);
        }
        None => {
            let is_placed = |index: &usize| rotations[*index].is_some();
            let is_drawn = |index: &usize| {
                let mut strokes = model.strokes.iter();
                let is_own =
                    |own: &Stroke| own.photograph() == Some(*index) && !own.places().is_empty();
                strokes.any(is_own) && is_found(model, *index)
            };
            let all = || (0..rotations.len()).filter(is_placed);
            if let Some(first) = all().find(is_drawn).or_else(|| all().next()) {
                seen.photographs[first] = true;
            }
        }
    }
    let mut grows = true;
    while grows {
        grows = false;
        // What an engine found hangs together.
        let found = || (0..rotations.len()).filter(|index| is_found(model, *index));
        if found().any(|index| seen.photographs[index]) {
            for index in found().filter(|index| rotations[*index].is_some()) {
                grows |= !std::mem::replace(&mut seen.photographs[index], true);
            }
        }
        for stroke in &model.strokes {
            let Some(photograph) = stroke.photograph() else { continue };
            if rotations[photograph].is_none() {
                continue;
            }
            for &place in stroke.places() {
                if has(&seen, place) && !seen.photographs[photograph] {
                    seen.photographs[photograph] = true;
                    grows = true;
                }
                if seen.photographs[photograph]
                    && model.can_place(place, |index| rotations[index].is_some())
                {
                    grows |= reach(&mut seen, place);
                }
            }
        }
    }
    seen
}

fn is_found(model: &Model, photograph: usize) -> bool {
    model.photographs[photograph].found.is_some()
}
