use std::fs;
use std::path::{Path, PathBuf};

use lobelia::io::exr;
use serde_json::Value;

use crate::{Run, displaced, example, files_below, json, lobelia};

/// What the model of the boxes has.
const SURFACES: [&str; 6] =
    ["book_cover", "book_pages", "cardboard1", "cardboard2", "cardboard3", "floor"];

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/model").join(name)
}

/// A new capture of the photographs of the boxes, which are grey here.
fn begun(folder: &Path) -> PathBuf {
    let photos = folder.join("my photos");
    let names = ["000.exr", "001.exr", "002.exr"].map(|name| photos.join(name));
    for file in &names {
        exr::write_rgb(file, 640, 480, &vec![[0.5; 3]; 640 * 480]).unwrap();
    }
    let capture = folder.join("capture");
    let run = Run::of(lobelia().arg("new").arg(&capture).arg("--images").args(&names)).succeeds();
    assert!(run.out.contains("images/001.exr  640×480  focal length unknown"), "{}", run.out);
    capture
}

/// The strokes of three photographs; two of them are PNG there.
fn strokes() -> String {
    fs::read_to_string(golden("boxes-artificial.json")).unwrap().replace(".png", ".exr")
}

#[test]
fn photographs_alone_become_a_capture_with_cameras_and_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let capture = begun(folder.path());
    let files = files_below(&capture);
    assert_eq!(files, ["images/000.exr", "images/001.exr", "images/002.exr", "transforms.json"]);
    let info = Run::of(lobelia().arg("info").arg(&capture)).succeeds();
    for part in ["photographs: 3", "without a camera: images/000.exr", "geometry: none", "to do: "]
    {
        assert!(info.out.contains(part), "\"{part}\" is missing in: {}", info.out);
    }
    Run::of(lobelia().arg("model").arg(&capture)).fails(1, &["model.json", "guide"]);

    fs::write(capture.join("model.json"), strokes()).unwrap();
    let run = Run::of(lobelia().arg("model").arg(&capture)).succeeds();
    for part in [
        "images/001.exr  ",
        "direction ± ",
        "strokes[0] (",
        "lens lens: focal_px ",
        "box cardboard3: x ",
        "off by most: strokes[",
        "scene.obj",
    ] {
        assert!(run.out.contains(part), "\"{part}\" is missing in: {}", run.out);
    }
    let cameras = fs::read(capture.join("transforms.json")).unwrap();
    let mesh = fs::read(capture.join("scene.obj")).unwrap();
    let info = Run::of(lobelia().arg("info").arg(&capture)).succeeds();
    assert!(info.out.contains("photographs: 3 (3 measure radiance)"), "{}", info.out);
    assert!(info.out.contains("in 6 surfaces"), "{}", info.out);
    assert_eq!(info.err, "");
    // Again gives the same bytes.
    Run::of(lobelia().arg("model").arg(&capture)).succeeds();
    assert_eq!(fs::read(capture.join("transforms.json")).unwrap(), cameras);
    assert_eq!(fs::read(capture.join("scene.obj")).unwrap(), mesh);
    // glTF reads back with the same surfaces.
    let glb = capture.join("model.glb");
    Run::of(lobelia().arg("model").arg(&capture).arg("--out").arg(&glb)).succeeds();
    let read = lobelia::io::mesh::load(&glb).unwrap();
    let names: Vec<&str> = read.surfaces.iter().map(|surface| surface.name.as_str()).collect();
    assert_eq!(names, SURFACES);
    assert_eq!(read.mesh.triangles.len(), 52);
    // A mesh that came from elsewhere is not written over, and the cameras stay as they are.
    fs::write(capture.join("scene.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let run = Run::of(lobelia().arg("model").arg(&capture));
    assert_eq!(run.code, Some(1));
    run.says(&["scene.obj", "Move it away", "--out"]);
    assert_eq!(fs::read(capture.join("transforms.json")).unwrap(), cameras);
    assert!(fs::read_to_string(capture.join("scene.obj")).unwrap().starts_with("v 0 0 0"));
}

#[test]
fn reflectances_from_the_modelled_geometry_are_those_from_the_true_one() {
    let folder = tempfile::tempdir().unwrap();
    let capture = folder.path().join("capture");
    let mut images: Vec<PathBuf> = fs::read_dir(example().join("images"))
        .unwrap()
        .map(|image| image.unwrap().path())
        .collect();
    images.sort();
    Run::of(lobelia().arg("new").arg(&capture).arg("--images").args(&images)).succeeds();
    // The example has the photographs of corner-diffuse at half their size.
    let mut model = json(&golden("corner-diffuse.json"));
    for photograph in model["photographs"].as_array_mut().unwrap() {
        (photograph["w"], photograph["h"]) = (320.into(), 240.into());
    }
    for stroke in model["strokes"].as_array_mut().unwrap() {
        for key in ["pixel", "from", "to"] {
            for number in stroke.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten() {
                *number = (0.5 * number.as_f64().unwrap()).into();
            }
        }
    }
    fs::write(capture.join("model.json"), model.to_string()).unwrap();
    Run::of(lobelia().arg("model").arg(&capture)).succeeds();
    fs::copy(example().join("tags.json"), capture.join("tags.json")).unwrap();
    let solved = |capture: &Path, name: &str| -> Vec<(String, Vec<f64>)> {
        let out = folder.path().join(name);
        Run::of(lobelia().arg("reconstruct").arg(capture).arg("--out").arg(&out)).succeeds();
        let solution = json(&out.join("solution.json"));
        let numbers = |own: &Value| -> Vec<f64> {
            own.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
        };
        let materials = solution["materials"].as_array().unwrap();
        let one = |own: &Value| (own["name"].as_str().unwrap().into(), numbers(&own["diffuse"]));
        materials.iter().map(one).collect()
    };
    for (own, given) in solved(&capture, "own").iter().zip(&solved(&example(), "given")) {
        assert_eq!(own.0, given.0);
        for (a, b) in own.1.iter().zip(&given.1) {
            // 0.011 here, 0.008 after one common scale, which photographs determine least.
            assert!((a - b).abs() < 0.02, "{own:?} {given:?}");
        }
    }
}

#[test]
fn what_cannot_be_used_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let capture = begun(folder.path());
    let before = fs::read(capture.join("transforms.json")).unwrap();
    let mut model = json(&golden("boxes-artificial.json"));
    // One photograph with lines along one axis alone.
    model["photographs"] = serde_json::json!([{"file_path": "images/000.exr", "w": 640, "h": 480}]);
    model["things"] = serde_json::json!([]);
    model["points"] = serde_json::json!([]);
    model["strokes"] = (0..4)
        .map(|k| {
            serde_json::json!({"kind": "line", "photograph": "images/000.exr", "axis": "x",
                "from": [100, 100 + 40 * k], "to": [500, 130 + 20 * k]})
        })
        .collect();
    fs::write(capture.join("model.json"), model.to_string()).unwrap();
    Run::of(lobelia().arg("model").arg(&capture)).fails(
        1,
        &["model.json, photographs[0]", "one vanishing point", "add lines along a second axis"]
            .map(|part| part.trim_start_matches("add ")),
    );
    fs::write(capture.join("model.json"), &strokes()[..5000]).unwrap();
    Run::of(lobelia().arg("model").arg(&capture)).fails(1, &["model.json", "cut off"]);
    let out = capture.join("mesh.stl");
    Run::of(lobelia().arg("model").arg(&capture).arg("--out").arg(out)).fails(1, &[".obj or .glb"]);
    assert_eq!(fs::read(capture.join("transforms.json")).unwrap(), before);
    assert!(!capture.join("scene.obj").exists());
    Run::of(lobelia().arg("reconstruct").arg(&capture).arg("--out").arg(folder.path().join("out")))
        .fails(1, &["no geometry"]);
}

#[test]
fn a_photograph_that_cannot_be_read_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let (wrong, capture) = (folder.path().join("notes.txt"), folder.path().join("capture"));
    fs::write(&wrong, "no picture").unwrap();
    let sound = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/photographs/exif.jpg");
    let mut command = lobelia();
    command.arg("new").arg(&capture).arg("--images").args([&sound, &wrong]);
    Run::of(&mut command).fails(1, &["notes.txt", "no photograph"]);
    assert!(!capture.exists());
    // One is enough, and two of one name are told apart.
    let twin = folder.path().join("exif.jpg");
    fs::copy(&sound, &twin).unwrap();
    let mut command = lobelia();
    command.arg("new").arg(&capture).arg("--images").args([&sound, &twin]);
    Run::of(&mut command).succeeds();
    let files = files_below(&capture);
    assert_eq!(files, ["images/exif.jpg", "images/exif_2.jpg", "transforms.json"]);
    // It is not written over.
    Run::of(&mut command).fails(1, &["not empty"]);
    // EXIF of its own before the other: stored on its side (orientation 6).
    let mut bytes = fs::read(&sound).unwrap();
    let exif =
        b"\xFF\xE1\0\x22Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0";
    bytes.splice(2..2, exif.iter().copied());
    fs::write(&twin, bytes).unwrap();
    let turned = folder.path().join("turned");
    let run = Run::of(lobelia().arg("new").arg(&turned).arg("--images").arg(&twin)).succeeds();
    assert!(run.out.contains("exif.jpg  32×48") && run.out.contains("turned upright (EXIF 6)"));
    let frame = &json(&turned.join("transforms.json"))["frames"][0];
    assert_eq!(
        (&frame["w"], &frame["h"], &frame["orientation"]),
        (&32.into(), &48.into(), &6.into())
    );
}

/// The capture of the example's photographs with one thing beside its edges: fitted, its strokes are
/// near to those that were drawn on the edges, and the model as it was is kept.
#[test]
fn a_thing_is_fitted_to_the_edges_of_the_photographs() {
    let [drawn, displaced] = displaced::models();
    let folder = tempfile::tempdir().unwrap();
    let capture = displaced::capture(folder.path(), &displaced);
    let (file, kept) = (capture.join("model.json"), capture.join("model.before.json"));
    let before = fs::read(&file).unwrap();
    let fit = |things: &[&str]| {
        let mut command = lobelia();
        command.arg("model").arg(&capture);
        for thing in things {
            command.args(["--fit-to-edges", thing]);
        }
        Run::of(&mut command)
    };
    // A name that is none is refused, with those that there are.
    fit(&["crate"]).fails(1, &["model.json", "names crate", "box1"]);
    assert!(fs::read(&file).unwrap() == before && !kept.exists());
    let run = fit(&[displaced::THING]).succeeds();
    for part in ["box1 is fitted to edges: ", " % of its outline lies on lines", "scene.obj"] {
        assert!(run.out.contains(part), "\"{part}\" is missing in: {}", run.out);
    }
    assert_eq!(fs::read(&kept).unwrap(), before, "the model as it was");
    let read = |file: &Path| lobelia::io::model::read(file).unwrap();
    let off = displaced::apart_px(&read(&file), &drawn);
    let was = displaced::apart_px(&displaced, &drawn);
    assert!(was > 2.5 && off < 0.8, "{was} px before, {off} px after");
    assert!(capture.join("scene.obj").exists());
    // The edges of all things are added behind the strokes, and replaced when they are found again.
    let all = || Run::of(lobelia().arg("model").arg(&capture).arg("--fit-all-to-edges")).succeeds();
    let strokes = read(&file).strokes;
    let run = all();
    assert!(run.out.contains(" edges were found in 6 photographs."), "{}", run.out);
    let found = read(&file);
    assert!(found.drawn() == strokes.len() && found.strokes.len() > strokes.len() + 50);
    assert_eq!(read(&kept).strokes, strokes);
    all();
    assert_eq!(read(&file).drawn(), strokes.len());
    fs::write(&file, fs::read(&kept).unwrap()).unwrap();
    // Where no line is near, nothing is written.
    fs::remove_file(&kept).unwrap();
    let second = fs::read(&file).unwrap();
    for photograph in &drawn.photographs {
        let (width, height) = photograph.size;
        let grey = vec![[0.4; 3]; width * height];
        exr::write_rgb(&capture.join(&photograph.name), width, height, &grey).unwrap();
    }
    fit(&[displaced::THING]).fails(1, &["model.json, things[", "no lines of the photographs"]);
    Run::of(lobelia().arg("model").arg(&capture).arg("--fit-all-to-edges"))
        .fails(1, &["model.json, things", "no line of a photograph is an edge"]);
    assert!(fs::read(&file).unwrap() == second && !kept.exists());
}
