//! Whole capture folders.

use std::path::Path;

use lobelia::io::capture::load;
use lobelia::io::{Error, exr};
use lobelia::scene::{Capture, MaterialKind, Role};
use lobelia::watch::Watch;
use serde_json::{Value, json};

use crate::{folder, message, put};

const MESH: &str =
    "mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl floor\nf 1 2 3\nusemtl wall\nf 1 3 2\n";
const LIBRARY: &str = "newmtl wall\nillum 2\nKs 1 1 1\nNs 10\n";

fn camera(frames: &[Value]) -> String {
    json!({"fl_x": 5, "w": 4, "h": 2, "frames": frames}).to_string()
}

fn frame(name: &str) -> Value {
    json!({"file_path": name, "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,2],[0,0,0,1]]})
}

/// A sound capture: two photographs of 4 × 2 pixels of radiance 1.
fn sound(folder: &Path) {
    put(folder, "scene.obj", MESH);
    put(folder, "scene.mtl", LIBRARY);
    put(folder, "transforms.json", camera(&[frame("images/0.exr"), frame("images/1.exr")]));
    for name in ["images/0.exr", "images/1.exr"] {
        exr::write_rgb(&folder.join(name), 4, 2, &[[1.0; 3]; 8]).unwrap();
    }
}

fn read(folder: &Path) -> Result<Capture, Error> {
    load(folder, &Watch::new())
}

#[test]
fn a_sound_capture_is_read_without_a_warning() {
    let folder = folder();
    sound(folder.path());
    let watch = Watch::new();
    let capture = load(folder.path(), &watch).unwrap();
    assert!(capture.warnings.is_empty(), "{:?}", capture.warnings);
    assert_eq!((watch.progress().done, watch.progress().total), (2, 2));
    assert_eq!(capture.measurements().count(), 2);
    assert_eq!(capture.photographs[1].name, "images/1.exr");
    let kinds: Vec<MaterialKind> = capture.materials.iter().map(|material| material.kind).collect();
    assert_eq!(kinds, [MaterialKind::Diffuse, MaterialKind::Specular]);
    assert_eq!(capture.surfaces[1].role, Role::Material(1));
}

#[test]
fn a_cancelled_load_stops() {
    let folder = folder();
    sound(folder.path());
    let watch = Watch::new();
    watch.cancel();
    assert!(matches!(load(folder.path(), &watch), Err(Error::Cancelled(_))));
}

#[test]
fn missing_parts_are_named() {
    let folder = folder();
    message(read(folder.path()), &["no geometry", "scene.obj"]);
    message(read(&folder.path().join("nowhere")), &["nowhere", "cannot be read"]);
    put(folder.path(), "room.glb", "glTF");
    message(read(folder.path()), &["room.glb", "no valid GLB", "Export it again"]);
    put(folder.path(), "room.obj", MESH);
    message(read(folder.path()), &["transforms.json", "no camera file"]);
    put(folder.path(), "other.obj", MESH);
    message(read(folder.path()), &["2 meshes", "scene.obj"]);
}

#[test]
fn images_that_do_not_fit_are_named_with_both_sizes() {
    let folder = folder();
    sound(folder.path());
    exr::write_rgb(&folder.path().join("images/1.exr"), 3, 2, &[[1.0; 3]; 6]).unwrap();
    message(read(folder.path()), &["1.exr", "3 x 2", "frames[1] (images/1.exr)", "4 x 2"]);
    put(
        folder.path(),
        "images/1.exr",
        &std::fs::read(folder.path().join("images/0.exr")).unwrap()[..200],
    );
    message(read(folder.path()), &["1.exr", "damaged or cut off"]);
    put(folder.path(), "images/1.exr", "no picture");
    message(read(folder.path()), &["1.exr", "damaged or cut off"]);
    std::fs::remove_file(folder.path().join("images/1.exr")).unwrap();
    let capture = read(folder.path()).unwrap();
    assert_eq!((capture.photographs.len(), capture.warnings.len()), (1, 1));
    assert!(capture.warnings[0].contains("frames[1] (images/1.exr)"));
}

#[test]
fn photographs_that_are_no_measurement_keep_their_cameras() {
    let folder = folder();
    sound(folder.path());
    put(folder.path(), "a.jpg", "broken, but for geometry only");
    let mut shown = frame("a.jpg");
    shown["hdr"] = json!(false);
    let mut unused = frame("images/1.exr");
    unused["use"] = json!("geometry");
    put(folder.path(), "transforms.json", camera(&[shown, unused, frame("images/0.exr")]));
    let capture = read(folder.path()).unwrap();
    let measured: Vec<bool> = capture.photographs.iter().map(|p| p.image.is_some()).collect();
    assert_eq!(measured, [false, false, true]);
    // An 8-bit image that claims to be a measurement.
    put(folder.path(), "transforms.json", camera(&[frame("a.jpg"), frame("images/0.exr")]));
    put(folder.path(), "a.jpg", [0xFF, 0xD8, 0xFF, 0xE0]);
    let warnings = read(folder.path()).unwrap().warnings.join("\n");
    assert!(
        warnings.contains("frames[0] (a.jpg)") && warnings.contains("no measurements"),
        "{warnings}"
    );
}

/// Two frames of three exposures each, gamma 2.2; the second has half the light.
fn bracketed(folder: &Path) -> Vec<Value> {
    sound(folder);
    let radiance = |x: u32| (-2.0 + 0.03 * f64::from(x)).exp();
    let times = [0.25, 1.0, 4.0];
    (0..2)
        .map(|index| {
            let brackets: Vec<Value> = std::iter::zip(["a", "b", "c"], times)
                .map(|(letter, time)| {
                    let name = format!("{index}{letter}.png");
                    let gain = if index == 0 { 1.0 } else { 0.5 };
                    let picture = image::RgbImage::from_fn(100, 50, |x, _| {
                        let code = 255.0 * (gain * radiance(x) * time).powf(1.0 / 2.2);
                        image::Rgb([code.round().clamp(0.0, 255.0) as u8; 3])
                    });
                    picture.save(folder.join(&name)).unwrap();
                    json!({"file_path": name, "exposure_time": time})
                })
                .collect();
            let mut frame = frame(&format!("{index}b.png"));
            (frame["w"], frame["h"], frame["hdr"]) = (json!(100), json!(50), json!(false));
            frame["brackets"] = json!(brackets);
            frame
        })
        .collect()
}

#[test]
fn exposure_series_are_merged_on_one_scale() {
    let folder = folder();
    let frames = bracketed(folder.path());
    put(folder.path(), "transforms.json", camera(&frames));
    let watch = Watch::new();
    let capture = load(folder.path(), &watch).unwrap();
    assert_eq!(watch.progress().done, watch.progress().total);
    assert!(capture.warnings.is_empty(), "{:?}", capture.warnings);
    let image = |index: usize| capture.photographs[index].image.as_ref().unwrap();
    for (x, index) in [(20, 0), (60, 0), (20, 1), (60, 1)] {
        let value = f64::from(image(index).radiance(x, 20).unwrap()[0]);
        let middle = f64::from(image(0).radiance(40, 20).unwrap()[0]);
        let truth = (0.03 * (x as f64 - 40.0)).exp() * [1.0, 0.5][index];
        assert!((value / middle / truth - 1.0).abs() < 0.03, "{x}, {index}: {value} {middle}");
    }
    // Radiance of another origin is in another unit.
    put(folder.path(), "transforms.json", camera(&[frames[0].clone(), frame("images/0.exr")]));
    let warnings = read(folder.path()).unwrap().warnings.join(" ");
    assert!(warnings.contains("same unit"), "{warnings}");
    // A time may stand in the photograph; here it stands nowhere.
    let mut untimed = frames.clone();
    untimed[1]["brackets"][2]["exposure_time"] = Value::Null;
    put(folder.path(), "transforms.json", camera(&untimed));
    message(read(folder.path()), &["1c.png", "frames[1] (1b.png)", "exposure_time"]);
    untimed[1]["brackets"][2]["exposure_time"] = json!(0);
    put(folder.path(), "transforms.json", camera(&untimed));
    message(read(folder.path()), &["frames[1]", "brackets[2]", "positive"]);
    // An exposure that is missing is left out with a warning.
    let mut missing = frames.clone();
    missing[0]["brackets"][0]["file_path"] = json!("gone.png");
    put(folder.path(), "transforms.json", camera(&missing));
    let capture = read(folder.path()).unwrap();
    assert!(capture.warnings.join(" ").contains("gone.png"), "{:?}", capture.warnings);
    assert_eq!(capture.measurements().count(), 2);
}

#[test]
fn an_image_of_radiance_stands_before_its_exposures() {
    let folder = folder();
    sound(folder.path());
    let mut series = frame("images/0.exr");
    series["brackets"] = json!([{"file_path": "0.jpg", "exposure_time": 0.1}]);
    put(folder.path(), "transforms.json", camera(&[series.clone()]));
    assert_eq!(read(folder.path()).unwrap().measurements().count(), 1);
    series["use"] = json!("geometry");
    put(folder.path(), "transforms.json", camera(&[series, frame("images/1.exr")]));
    assert_eq!(read(folder.path()).unwrap().measurements().count(), 1);
}

#[test]
fn vignetting_is_divided_out_after_saturation_is_decided() {
    let folder = folder();
    sound(folder.path());
    let mut value: Value = serde_json::from_str(&camera(&[frame("images/0.exr")])).unwrap();
    value["vignetting"] = json!({"a": -0.35, "b": 0.06});
    put(folder.path(), "transforms.json", value.to_string());
    put(
        folder.path(),
        "tags.json",
        r#"{"materials": [{"name": "a", "surfaces": ["floor", "wall"]}], "saturation": 1.1}"#,
    );
    let capture = read(folder.path()).unwrap();
    let image = capture.photographs[0].image.as_ref().unwrap();
    assert_eq!(image.invalid_count(), 0);
    // The first pixel's centre is (1.5, 0.5) from the middle; the half diagonal is √5.
    let r2 = (1.5 * 1.5 + 0.5 * 0.5) / 5.0;
    let expected = 1.0 / (1.0 - 0.35 * r2 + 0.06 * r2 * r2);
    assert!((f64::from(image.radiance(0, 0).unwrap()[1]) - expected).abs() < 1e-6);
    value["vignetting"] = json!({"a": -2.0});
    put(folder.path(), "transforms.json", value.to_string());
    message(read(folder.path()), &["vignetting"]);
}

/// `LOBELIA_CAPTURES=/path cargo test --release -- --ignored --nocapture` prints every warning.
#[test]
#[ignore = "needs captures that are not in the repository"]
fn captures_load() {
    let root =
        std::env::var("LOBELIA_CAPTURES").expect("LOBELIA_CAPTURES names a folder of captures");
    let mut folders: Vec<_> =
        std::fs::read_dir(root).unwrap().map(|entry| entry.unwrap().path()).collect();
    folders.sort();
    for folder in folders.iter().filter(|folder| folder.join("transforms.json").exists()) {
        lobelia::io::truth::Truth::read(&folder.join("truth.json")).unwrap();
        match read(folder) {
            Ok(capture) => println!(
                "{}: {} triangles, {} of {} photographs measured {:#?}",
                capture.name,
                capture.mesh.triangles.len(),
                capture.measurements().count(),
                capture.photographs.len(),
                capture.warnings
            ),
            Err(error) => println!("{error}"),
        }
    }
}

/// Codes of 8 bits, a row of two pixels each, with and without the time of their exposure.
fn codes(file: &Path, codes: [u8; 8]) {
    let image = image::RgbImage::from_fn(4, 2, |x, y| image::Rgb([codes[(y * 4 + x) as usize]; 3]));
    image.save(file).unwrap();
}

#[test]
fn single_exposures_are_radiance_by_a_stated_response() {
    let folder = folder();
    sound(folder.path());
    let mut cameras: Value =
        serde_json::from_str(&camera(&[frame("images/a.png"), frame("images/b.png")])).unwrap();
    codes(&folder.path().join("images/a.png"), [0, 64, 128, 255, 200, 30, 90, 250]);
    codes(&folder.path().join("images/b.png"), [100; 8]);
    put(folder.path(), "transforms.json", cameras.to_string());
    let capture = read(folder.path()).unwrap();
    assert_eq!(capture.measurements().count(), 0);
    assert!(capture.warnings.iter().any(|own| own.contains("\"response\": \"srgb\"")));

    cameras["response"] = json!("srgb");
    put(folder.path(), "transforms.json", cameras.to_string());
    let capture = read(folder.path()).unwrap();
    let said = capture.warnings.join("\n");
    assert!(said.contains("single exposures") && said.contains("one exposure time"), "{said}");
    let images: Vec<_> =
        capture.photographs.iter().map(|own| own.image.as_ref().unwrap()).collect();
    // IEC 61966-2-1, relative to the code 128.
    let linear = |code: f64| ((code / 255.0 + 0.055) / 1.055).powf(2.4);
    let expected = |code: f64| (linear(code) / linear(128.0)) as f32;
    for (pixel, code) in [(1, 64.0), (2, 128.0), (4, 200.0), (5, 30.0), (6, 90.0)] {
        let found = images[0].radiance(pixel % 4, pixel / 4).unwrap()[1];
        assert!((found / expected(code) - 1.0).abs() < 1e-3, "{code}: {found}");
    }
    assert!((images[1].radiance(0, 0).unwrap()[0] / expected(100.0) - 1.0).abs() < 1e-3);
    // Clipped, and black.
    assert_eq!(images[0].radiance(3, 0), None);
    assert_eq!(images[0].radiance(0, 0), None);

    cameras["response"] = json!("camera.csv");
    put(folder.path(), "transforms.json", cameras.to_string());
    message(read(folder.path()), &["transforms.json", "response", "camera.csv", "merge --curve"]);
    // A table that merge writes: twice the light a code more.
    let rows: String = (0..256)
        .map(|k| format!("{k},{0},{0},{0}\n", 2f64.powf((f64::from(k) - 128.0) / 64.0)))
        .collect();
    put(folder.path(), "camera.csv", format!("value,red,green,blue\n{rows}"));
    let capture = read(folder.path()).unwrap();
    let image = capture.photographs[0].image.as_ref().unwrap();
    let [dark, bright] = [1, 2].map(|x| image.radiance(x, 0).unwrap()[0]);
    assert!((bright / dark - 2.0).abs() < 1e-3, "{bright} {dark}");
}
