//! Against OpenCV's projections and their derivatives (tests/golden/model/opencv.py).

use glam::{DMat3, DVec2, DVec3};
use lobelia::model::{Optic, Pose};

use crate::{json, numbers};

#[test]
fn projections_and_their_derivatives_are_those_of_opencv() {
    for case in json("projections.json")["cases"].as_array().unwrap() {
        let [focal_px, cx, cy, k1, k2] = numbers(&case["lens"])[..] else { panic!() };
        let lens = Optic { focal_px, principal_px: DVec2::new(cx, cy), radial: DVec2::new(k1, k2) };
        let rotation = DMat3::from_cols_slice(&numbers(&case["rotation"])).transpose();
        let position = DVec3::from_slice(&numbers(&case["position"]));
        let pose = Pose { world_from_camera: rotation, position };
        for (index, point) in case["points"].as_array().unwrap().iter().enumerate() {
            let projected = pose.project(&lens, DVec3::from_slice(&numbers(point))).unwrap();
            let pixel = DVec2::from_slice(&numbers(&case["pixels"][index]));
            assert!((projected.pixel - pixel).length() < 1e-9, "{projected:?} {pixel}");
            let by = &case["by_lens"][index];
            let column = |k: usize| DVec2::new(numbers(&by[0])[k], numbers(&by[1])[k]);
            let own = [
                projected.by_focal,
                DVec2::X,
                DVec2::Y,
                projected.by_radial[0],
                projected.by_radial[1],
            ];
            for (k, own) in own.into_iter().enumerate() {
                assert!((own - column(k)).length() < 1e-9 * (1.0 + own.length()), "column {k}");
            }
            let back = DVec2::from_slice(&numbers(&case["undistorted"][index]));
            let undistorted = lens.undistort(pixel).unwrap();
            assert!((undistorted.place - back).length() < 1e-9, "{undistorted:?} {back}");
        }
    }
}
