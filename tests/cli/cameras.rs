//! `lobelia new --cameras`: an engine is a script on the path.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use lobelia::io::exr;
use serde_json::Value;

use crate::{Run, files_below, json, lobelia};

/// Places the first and the third photograph.
const PLACES: &str = r#"
d="$4/sparse/0"; mkdir -p "$d"
printf '1 RADIAL 80 60 70 40 30 0 0\n' > "$d/cameras.txt"
printf '1 0.7071 0.7071 0 0 0 0 0 1 000000.jpg\n40 30 0\n2 0.7071 0.7071 0 0 -1 0 0 1 000002.jpg\n22.5 30 0\n' > "$d/images.txt"
printf '0 0 4 0 9 9 9 0.5 1 0 2 0\n' > "$d/points3D.txt"
"#;

/// `lobelia new capture --images 0.exr 1.exr 2.exr`, where Python does what a script says.
fn new(folder: &Path, script: &str) -> Command {
    let bin = folder.join("bin");
    fs::create_dir_all(&bin).unwrap();
    let python = bin.join("python3");
    let question = "#!/bin/sh\nif [ \"$1\" = -c ]; then echo modules pycolmap openmvg_rs; exit; fi";
    fs::write(&python, format!("{question}\n{script}\n")).unwrap();
    fs::set_permissions(&python, fs::Permissions::from_mode(0o755)).unwrap();
    let images: Vec<PathBuf> = (0..3).map(|own| folder.join(format!("{own}.exr"))).collect();
    for image in &images {
        exr::write_rgb(image, 80, 60, &[[0.5; 3]; 80 * 60]).unwrap();
    }
    let mut command = lobelia();
    command.env("PATH", format!("{}:/usr/bin:/bin", bin.display()));
    command.env("XDG_DATA_HOME", folder.join("none"));
    command.arg("new").arg(folder.join("capture")).arg("--images").args(&images);
    command
}

#[test]
fn photographs_that_an_engine_places_have_cameras_and_the_others_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let run = Run::of(new(folder.path(), PLACES).args(["--cameras", "auto"])).succeeds();
    let capture = folder.path().join("capture");
    for part in ["openmvg-rs: 2 of 3 photographs placed", "images/1.exr  not placed"] {
        assert!(run.out.contains(part), "\"{part}\" is missing in: {}", run.out);
    }
    run.says(&["up is guessed", "2 m away"]);
    let cameras = json(&folder.path().join("capture/transforms.json"));
    let has_pose = |own: &Value| own.get("transform_matrix").is_some();
    let frames: Vec<bool> = cameras["frames"].as_array().unwrap().iter().map(has_pose).collect();
    assert_eq!(frames, [true, false, true]);
    assert_eq!(cameras["frames"][1]["placed"], Value::Bool(false));
    assert_eq!(cameras["frames"][0]["fl_x"], 70.0);
    // What was found is kept: solved again it gives the same.
    let written = fs::read(capture.join("transforms.json")).unwrap();
    Run::of(lobelia().arg("model").arg(&capture)).succeeds();
    assert_eq!(fs::read(capture.join("transforms.json")).unwrap(), written);
    let model = lobelia::io::model::read(&capture.join("model.json")).unwrap();
    assert_eq!(model.found_points.len(), 1);
    assert!(model.photographs[1].found.is_none() && model.photographs[2].found.is_some());
}

#[test]
fn an_engine_that_is_missing_leaves_nothing_and_one_that_fails_leaves_the_capture() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = new(folder.path(), "exit 1");
    command.env("PATH", folder.path());
    Run::of(command.args(["--cameras", "pycolmap"])).fails(1, &["pycolmap", "pip", "lines"]);
    assert!(!folder.path().join("capture").exists());
    let script = "echo 'error: OutOfMemory: too large'; exit 3";
    let run = Run::of(new(folder.path(), script).args(["--cameras", "pycolmap"]));
    assert_eq!(run.code, Some(1));
    run.says(&["OutOfMemory: too large (exit code 3)", "the capture is written, without cameras"]);
    assert_eq!(files_below(&folder.path().join("capture")).len(), 4);
}
