//! Things of captures, moved and fitted: the figures of assets/guide/modelling.md.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use lobelia::io::model::{LONGEST, caster};
use lobelia::model::lines::{Picture, detect};
use lobelia::model::things::{Kind, parameters};
use lobelia::model::unknowns::State;
use lobelia::model::{Model, Place, Solution, to_edges};
use lobelia::watch::Watch;

use crate::{json, numbers, read, solved};

/// Corners of one thing: root mean square over those that the photographs show, in pixels.
fn apart_px(solution: &Solution, a: &[DVec3], b: &[DVec3]) -> f64 {
    let mut squares = Vec::new();
    for camera in solution.cameras.iter().flatten() {
        for (a, b) in a.iter().zip(b) {
            if let (Some((a, _)), Some((b, _))) = (camera.project(*a), camera.project(*b)) {
                squares.push(a.distance_squared(b));
            }
        }
    }
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Root mean square distance of a thing's corners from the truth, in millimetres.
fn off_mm(model: &Model, truth: &serde_json::Value, thing: usize, corners: &[DVec3]) -> f64 {
    let off = |(corner, place): (usize, &DVec3)| {
        let name = model.place_name(Place::Corner { thing, corner });
        place.distance_squared(DVec3::from_slice(&numbers(&truth["corners"][&name])))
    };
    let sum: f64 = corners.iter().enumerate().map(off).sum();
    1e3 * (sum / corners.len() as f64).sqrt()
}

/// `LOBELIA_CAPTURES` names the folder of the captures.
#[test]
#[ignore = "needs captures that are not in the repository"]
fn things_of_captures_come_back() {
    let captures = std::env::var_os("LOBELIA_CAPTURES").map(PathBuf::from).unwrap();
    let mut state = 7_u64;
    let mut random = move || {
        // Marsaglia's xorshift, from -1 to 1.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    for name in ["corner-diffuse", "boxes-artificial"] {
        let (model, truth) = (read(&format!("{name}.json")), json(&format!("{name}.truth.json")));
        let base = solved(&model);
        let lines = |file: &Path| {
            let shown = lobelia::io::import::show(file, Default::default(), LONGEST).unwrap();
            let (width, height, step) = (shown.width, shown.height, shown.step);
            Arc::new(detect(&Picture { pixels: &shown.pixels, width, height, step }))
        };
        let folder = captures.join(name);
        let lines: Vec<_> =
            model.photographs.iter().map(|own| lines(&folder.join(&own.name))).collect();
        for thing in 0..model.things.len() {
            let own = &model.things[thing];
            let by_strokes = off_mm(&model, &truth, thing, &base.corners[thing]);
            println!("{name}, {}: by the strokes {by_strokes:.1} mm", own.id);
            for (moved_px, _) in
                [5.0, 7.0, 10.0].into_iter().flat_map(|px| (0..5).map(move |k| (px, k)))
            {
                let step: Vec<f64> = parameters(own)
                    .iter()
                    .map(|parameter| match parameter.kind {
                        _ if own.held.iter().any(|(held, _)| *held == parameter.name) => 0.0,
                        Kind::Yaw => 1.5 * random(),
                        _ => random(),
                    })
                    .collect();
                let at = |factor: f64| -> State {
                    let mut state = base.state.clone();
                    for (value, step) in state.things[thing].iter_mut().flatten().zip(&step) {
                        *value += factor * step;
                    }
                    state
                };
                let apart = |state: &State| {
                    apart_px(&base, &base.corners[thing], &state.corners(&model)[thing])
                };
                let factor = (0..6).fold(1e-3, |factor, _| factor * moved_px / apart(&at(factor)));
                let start = at(factor);
                let before = off_mm(&model, &truth, thing, &start.corners(&model)[thing]);
                let moved = to_edges::follow(&model, &base.state, &start, thing);
                let mut solution = base.clone();
                solution.state = start;
                print!("  moved by {moved_px} px, {before:.1} mm: ");
                match to_edges::fit(&moved, &solution, thing, &lines, caster, &Watch::new()) {
                    Err(problem) => println!("{problem}"),
                    Ok(fitted) => {
                        let after = solved(&fitted.model);
                        let corners = &after.corners[thing];
                        println!(
                            "{:.1} mm, off by {:.2} px, {:.2} px from the strokes",
                            off_mm(&model, &truth, thing, corners),
                            fitted.off_px[1],
                            apart_px(&base, &base.corners[thing], corners)
                        );
                    }
                }
            }
        }
    }
}
