//! Cameras and things from strokes: against SciPy, OpenCV, known scenes, and degenerate cases.

mod degenerate; // cases without an answer
mod files; // model.json written, read, damaged
mod found_edges; // lines of photographs that are edges of things
mod from_points; // planes and boxes from points of an engine
mod lines; // lines found in pictures of known lines
mod painted; // pictures of known outlines
mod near; // solutions near another, while something is dragged
mod opencv; // projections against OpenCV
mod rig; // cameras that an engine placed, put into the world
mod to_edges; // things moved onto the lines of photographs
mod to_edges_captures; // the same on captures that are not in the repository
mod tracks; // points of an engine in the adjustment
mod scipy; // the adjustment against SciPy's least_squares
mod scenes; // strokes with one pixel of error on captures of known answer

#[path = "../shared/box_of_points.rs"]
mod box_of_points;
#[path = "../shared/displaced.rs"]
#[allow(dead_code, reason = "the captures on disk are for other tests")]
mod displaced;

use std::path::{Path, PathBuf};

use lobelia::model::{AdjustOptions, Model, Solution, solve};
use serde_json::Value;

/// A file of tests/golden/model.
fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/model").join(name)
}

fn read(name: &str) -> Model {
    lobelia::io::model::read(&golden(name)).unwrap_or_else(|error| panic!("{error}"))
}

fn json(name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(golden(name)).unwrap()).unwrap()
}

#[track_caller]
fn solved(model: &Model) -> Solution {
    let solution = solve(model, &AdjustOptions::default());
    let solution = solution.unwrap_or_else(|error| panic!("{}: {error}", error.place));
    assert_eq!(solution.problems, [], "{:?}", solution.notes);
    solution
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}
