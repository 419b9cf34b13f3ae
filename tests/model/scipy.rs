//! Against SciPy's `least_squares` on stored problems (tests/golden/model/scipy_adjust.py).

use glam::{DMat3, DVec3};
use lobelia::model::Model;

use crate::{json, numbers, solved};

/// Both minimise to about 1e-9; the task asks for 1e-6.
const AGREEMENT: f64 = 1e-6;

#[track_caller]
fn agrees(what: &str, own: f64, scipy: f64, scale: f64) {
    assert!((own - scipy).abs() <= AGREEMENT * scale, "{what}: {own} and {scipy}");
}

#[test]
fn the_minimum_and_its_standard_errors_are_those_of_scipy() {
    for case in json("adjust.json")["cases"].as_array().unwrap() {
        let name = case["name"].as_str().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("model.json");
        std::fs::write(&file, case["model"].to_string()).unwrap();
        let model: Model = lobelia::io::model::read(&file).unwrap();
        let solution = solved(&model);
        let lens = solution.state.lenses[0];
        let own =
            [lens.focal_px, lens.principal_px.x, lens.principal_px.y, lens.radial.x, lens.radial.y];
        for (k, (own, scipy)) in own.into_iter().zip(numbers(&case["lens"])).enumerate() {
            agrees(&format!("{name}, lens {k}"), own, scipy, if k < 3 { 1000.0 } else { 1.0 });
        }
        for (camera, pose) in case["cameras"].as_array().unwrap().iter().zip(&solution.state.poses)
        {
            let pose = pose.unwrap();
            let rows = camera["rotation"].as_array().unwrap().iter().flat_map(numbers);
            let rotation = DMat3::from_cols_slice(&rows.collect::<Vec<_>>()).transpose();
            let difference = (pose.world_from_camera - rotation).to_cols_array();
            let largest = difference.into_iter().map(f64::abs).fold(0.0, f64::max);
            agrees(&format!("{name}, a rotation"), largest, 0.0, 1.0);
            let position = DVec3::from_slice(&numbers(&camera["position"]));
            agrees(&format!("{name}, a position"), pose.position.distance(position), 0.0, 1.0);
        }
        for (thing, report) in solution.things.iter().enumerate() {
            let (values, errors) =
                (numbers(&case["things"][thing]), numbers(&case["things_sd"][thing]));
            for ((own, value), sd) in report.numbers.iter().zip(values).zip(errors) {
                let what = format!("{name}, {} of thing {thing}", own.name);
                agrees(&what, own.value, value, 1.0);
                agrees(&format!("error of {what}"), own.sd.unwrap(), sd, sd * 100.0);
            }
        }
        for (point, own) in solution.state.points.iter().enumerate() {
            let scipy = DVec3::from_slice(&numbers(&case["points"][point]));
            agrees(&format!("{name}, a point"), own.unwrap().distance(scipy), 0.0, 1.0);
        }
        agrees(name, solution.stroke_px.unwrap(), case["stroke_px"].as_f64().unwrap(), 1.0);
    }
}
