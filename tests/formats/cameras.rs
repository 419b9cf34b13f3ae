//! `transforms.json`.

use glam::{DMat3, DVec2, DVec3};
use lobelia::io::Error;
use lobelia::io::transforms::{Cameras, Images, read};
use serde_json::{Value, json};

use crate::{folder, message, put};

const POSE: [[f64; 4]; 4] =
    [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 2.], [0., 0., 0., 1.]];

fn load(value: &Value) -> Result<Cameras, Error> {
    let folder = folder();
    read(&put(folder.path(), "transforms.json", value.to_string()), Images::Optional)
}

/// A file of one frame with further fields at the top and in the frame.
fn one(top: Value, frame: Value) -> Value {
    let mut value =
        json!({"w": 640, "h": 480, "frames": [{"file_path": "a.exr", "transform_matrix": POSE}]});
    for (key, field) in top.as_object().unwrap() {
        value[key] = field.clone();
    }
    for (key, field) in frame.as_object().unwrap() {
        value["frames"][0][key] = field.clone();
    }
    value
}

#[test]
fn points_fall_where_opencv_puts_them() {
    let text = include_str!("../golden/projection/projection.json");
    let golden: Value = serde_json::from_str(text).unwrap();
    let mut compared = 0;
    for case in golden["cases"].as_array().unwrap() {
        let cameras = load(&case["transforms"]).unwrap();
        let camera = &cameras.frames[0].camera;
        for (point, pixel) in
            std::iter::zip(case["points"].as_array().unwrap(), case["pixels"].as_array().unwrap())
        {
            let point: [f64; 3] = serde_json::from_value(point.clone()).unwrap();
            let pixel: [f64; 2] = serde_json::from_value(pixel.clone()).unwrap();
            let (ours, _) = camera.project(DVec3::from(point)).expect("in the image");
            // Both work in double precision; the pose went through a rotation vector there.
            let error = (ours - DVec2::from(pixel)).length();
            assert!(error < 1e-8, "{}: {ours} and {pixel:?}", case["name"]);
            let towards = (DVec3::from(point) - camera.position).normalize_or_zero();
            let ray = camera.direction(DVec2::from(pixel)).expect("a ray");
            assert!((ray - towards).length() < 1e-9);
            compared += 1;
        }
    }
    assert_eq!(compared, 200);
}

#[test]
fn intrinsics_come_from_the_frame_or_the_file_or_an_angle() {
    let focal = |value: &Value| load(value).unwrap().frames[0].camera.focal_px;
    assert_eq!(focal(&one(json!({"fl_x": 500}), json!({}))), DVec2::splat(500.0));
    assert_eq!(
        focal(&one(json!({"fl_x": 500, "fl_y": 490}), json!({"fl_x": 300}))),
        DVec2::splat(300.0)
    );
    let angles = json!({"camera_angle_x": 1.0, "camera_angle_y": 0.8});
    let expected = DVec2::new(320.0 / 0.5_f64.tan(), 240.0 / 0.4_f64.tan());
    assert!((focal(&one(angles, json!({}))) - expected).length() < 1e-9);
    let camera = load(&one(json!({"fl_x": 500, "w": 640.0}), json!({}))).unwrap().frames[0].camera;
    assert_eq!((camera.principal_px, camera.width), (DVec2::new(320.0, 240.0), 640));
    let shifted = one(json!({"fl_x": 500, "cx": 300}), json!({"cx": 310, "cy": 250.5}));
    assert_eq!(load(&shifted).unwrap().frames[0].camera.principal_px, DVec2::new(310.0, 250.5));
    message(load(&one(json!({}), json!({}))), &["frames[0] (a.exr)", "focal length is missing"]);
    message(load(&one(json!({"fl_x": -5}), json!({}))), &["fl_x", "positive"]);
    message(load(&one(json!({"camera_angle_x": 45}), json!({}))), &["camera_angle_x", "radians"]);
    message(load(&one(json!({"fl_x": 500, "w": 0}), json!({}))), &[", w:", "whole number"]);
    message(load(&one(json!({"fl_x": 500, "w": 640.5}), json!({}))), &["whole number"]);
    message(load(&one(json!({"fl_x": 500, "cx": 0.5, "cy": 0.5}), json!({}))), &["fractions"]);
    message(load(&one(json!({"fl_x": "wide"}), json!({}))), &["fl_x", "finite number"]);
}

#[test]
fn lens_models_map_or_are_refused_by_name() {
    let lens = |top: Value| load(&one(top, json!({"fl_x": 500})));
    let opencv =
        lens(json!({"camera_model": "OPENCV", "k1": 0.1, "k4": 0.4, "p2": 0.2, "aabb_scale": 16}));
    let distortion = opencv.unwrap().frames[0].camera.distortion;
    assert_eq!((distortion.radial, distortion.tangential), ([0.1, 0.0, 0.0, 0.4], [0.0, 0.2]));
    let radial = lens(json!({"camera_model": "SIMPLE_RADIAL", "k": 0.1})).unwrap();
    assert_eq!(radial.frames[0].camera.distortion.radial[0], 0.1);
    let pinhole = lens(json!({"camera_model": "PINHOLE", "k1": 0.1})).unwrap();
    assert!(pinhole.warnings[0].contains("applied"));
    for model in ["OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "EQUIRECTANGULAR", "FOV"] {
        message(lens(json!({"camera_model": model})), &[model, "Undistort"]);
    }
    message(lens(json!({"is_fisheye": true})), &["is_fisheye"]);
    // OpenCV's k4 to k6 are a divisor's, not the polynomial's fourth term.
    let rational = lens(json!({"camera_model": "FULL_OPENCV", "k3": 0.3, "k4": 0.4, "k6": 0.6}));
    let distortion = rational.unwrap().frames[0].camera.distortion;
    assert_eq!(distortion.radial, [0.0, 0.0, 0.3, 0.0]);
    assert_eq!(distortion.denominator, [0.4, 0.0, 0.6]);
}

#[test]
fn poses_are_rotations() {
    let pose =
        |matrix: Value| load(&one(json!({"fl_x": 500}), json!({"transform_matrix": matrix})));
    let scaled = json!([[100, 0, 0, 1], [0, 100, 0, 2], [0, 0, 100, 3], [0, 0, 0, 1]]);
    let cameras = pose(scaled).unwrap();
    assert!(cameras.warnings[0].contains("scaled"));
    let camera = &cameras.frames[0].camera;
    assert!(
        (camera.world_from_camera - DMat3::IDENTITY)
            .to_cols_array()
            .iter()
            .all(|v| v.abs() < 1e-12)
    );
    assert_eq!(camera.position, DVec3::new(1.0, 2.0, 3.0));
    assert!(pose(json!([[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3]])).unwrap().warnings.is_empty());
    // Rounded to three digits: the nearest rotation, silently.
    let rounded = json!([[0.8, -0.6, 0, 0], [0.60002, 0.8, 0, 0], [0, 0, 1, 0]]);
    let cameras = pose(rounded).unwrap();
    let matrix = cameras.frames[0].camera.world_from_camera;
    let error = matrix.transpose() * matrix - DMat3::IDENTITY;
    assert!(error.to_cols_array().iter().all(|v| v.abs() < 1e-12) && cameras.warnings.is_empty());
    let slightly = json!([[1, 0.004, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]);
    assert!(pose(slightly).unwrap().warnings[0].contains("not quite a rotation"));
    message(
        pose(json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0]])),
        &["frames[0] (a.exr)", "mirrors"],
    );
    message(pose(json!([[1, 1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]])), &["no rotation"]);
    message(pose(json!([[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]])), &["no rotation"]);
    message(pose(json!([[1, 0, 0], [0, 1, 0], [0, 0, 1]])), &["4 numbers"]);
    message(pose(json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]])), &["last row"]);
    message(
        pose(json!([[1, 0, 0, null], [0, 1, 0, 0], [0, 0, 1, 0]])),
        &["transform_matrix[0][3]"],
    );
}

#[test]
fn broken_json_names_line_and_column() {
    let folder = folder();
    let load = |text: &str| read(&put(folder.path(), "transforms.json", text), Images::Optional);
    message(load("{\"w\": 640,\n\"frames\": [{"), &["transforms.json, line 2", "cut off"]);
    message(load("{\"w\": 640,\n  oops }"), &["line 2, column 3"]);
    message(load(""), &["cut off"]);
    message(load("[]"), &["one object"]);
    message(load("{}"), &["no camera"]);
    message(load("{\"frames\": []}"), &["no camera"]);
    message(load(&"[".repeat(100_000)), &["recursion limit"]);
    message(load("{\"frames\": [{\"transform_matrix\": []}]}"), &["frames[0]", "file_path"]);
    message(load("{\"frames\": [3]}"), &["frames[0]"]);
    let nan = r#"{"fl_x": NaN, "w": 4, "h": 4, "frames": [{"file_path": "a", "transform_matrix": [[1,0,0,-Infinity],[0,1,0,0],[0,0,1,0]]}]}"#;
    message(load(nan), &["frames[0] (a).transform_matrix[0][3]", "NaN"]);
}

#[test]
fn images_are_found_as_people_name_them() {
    let folder = folder();
    put(folder.path(), "images/b.001.exr", "");
    put(folder.path(), "images/c.png", "");
    let frame = |name: &str| json!({"file_path": name, "transform_matrix": POSE});
    let frames = ["images\\b.001", "./images/c", "images/lost.exr", "./images/c"].map(frame);
    let value = json!({"fl_x": 5, "w": 4, "h": 4, "frames": frames});
    let cameras =
        read(&put(folder.path(), "transforms.json", value.to_string()), Images::Needed).unwrap();
    let names: Vec<String> = cameras
        .frames
        .iter()
        .map(|frame| frame.image.as_ref().unwrap().file_name().unwrap().to_string_lossy().into())
        .collect();
    assert_eq!(names, ["b.001.exr", "c.png", "c.png"]);
    let warnings = cameras.warnings.join("\n");
    assert!(
        warnings.contains("frames[2] (images/lost.exr)") && warnings.contains("frames[3]"),
        "{warnings}"
    );
    let value = json!({"fl_x": 5, "w": 4, "h": 4, "frames": [frame("x.exr"), frame("y.exr")]});
    let file = put(folder.path(), "transforms.json", value.to_string());
    message(read(&file, Images::Needed), &["none of the 2 images", "x.exr"]);
}
