//! Models of which a stroke has moved, solved near the solution before, against the solver that begins
//! from nothing.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use lobelia::model::{AdjustOptions, Model, Shape, Solution, Stroke, solve, solve_near};

use crate::{read, solved};

/// Moves one pick.
fn moved(model: &Model, pick: usize, by: DVec2) -> Model {
    let mut moved = model.clone();
    let mut picks = moved.strokes.iter_mut().filter_map(|stroke| match stroke {
        Stroke::Pick { pixel, .. } => Some(pixel),
        _ => None,
    });
    *picks.nth(pick).expect("a pick") += by;
    moved
}

/// The largest difference between what two solutions show of all corners and points, in pixels.
fn apart_px(a: &Solution, b: &Solution) -> f64 {
    let places = |own: &Solution| -> Vec<DVec3> {
        own.corners
            .iter()
            .flatten()
            .copied()
            .chain(own.state.points.iter().flatten().copied())
            .collect()
    };
    let (own, other) = (places(a), places(b));
    assert_eq!(own.len(), other.len());
    let mut most = 0.0_f64;
    for (camera, twin) in a.cameras.iter().flatten().zip(b.cameras.iter().flatten()) {
        for (p, q) in own.iter().zip(&other) {
            if let (Some((p, _)), Some((q, _))) = (camera.project(*p), twin.project(*q)) {
                most = most.max(p.distance(q));
            }
        }
    }
    most
}

#[test]
fn a_stroke_that_moves_is_followed_to_the_same_solution() {
    for name in ["corner-diffuse.json", "boxes-one.json", "things.json"] {
        let model = read(name);
        let mut before = (model.clone(), solved(&model));
        // As a hand goes on, each from the one before.
        for step in 1..=4 {
            let next = moved(&model, 7, DVec2::new(1.5, -1.0) * f64::from(step));
            let near = solve_near(&next, (&before.0, &before.1)).expect("only a stroke has moved");
            let exact = solved(&next);
            let (apart, went) = (apart_px(&near, &exact), apart_px(&exact, &before.1));
            println!(
                "{name}, step {step}: {apart:.4} px of {went:.2}, {} steps for {}",
                near.steps, exact.steps
            );
            assert!(apart < 0.05, "{name}, step {step}: {apart} px");
            assert!(near.steps < exact.steps.max(6), "{} {}", near.steps, exact.steps);
            assert_eq!(near.strokes.len(), exact.strokes.len());
            before = (next, near);
        }
    }
}

/// Whatever else has changed, or was not sound before, is left to the solver that begins from nothing.
#[test]
fn more_than_a_moved_stroke_is_not_solved_near() {
    let model = read("corner-diffuse.json");
    let solution = solved(&model);
    let changed = |change: &dyn Fn(&mut Model)| {
        let mut other = model.clone();
        change(&mut other);
        solve_near(&other, (&model, &solution)).is_none()
    };
    assert!(!changed(&|_| ()));
    assert!(changed(&|model| {
        model.add_thing(Shape::Box { flush: None });
    }));
    assert!(changed(&|model| model.things[1].held.push(("height".into(), 0.3))));
    assert!(changed(&|model| model.lenses[0].focal_px = Some(600.0)));
    assert!(changed(&|model| drop(model.photographs.pop())));
    assert!(changed(&|model| model.points.clear()));
    assert!(changed(&|model| model.found_points = Arc::default()), "another list of points");
    // A stroke that no photograph can show.
    assert!(changed(&|model| {
        if let Some(Stroke::Pick { pixel, .. }) =
            model.strokes.iter_mut().find(|s| s.name() == "pick")
        {
            *pixel = DVec2::splat(f64::NAN);
        }
    }));
    let mut broken = solution.clone();
    broken.problems.extend(solve(&Model::default(), &AdjustOptions::default()).err());
    assert!(!broken.is_usable());
    assert!(solve_near(&model, (&model, &broken)).is_none());
}
