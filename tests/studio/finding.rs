//! Find cameras on the Model page: engines are scripts on a path of their own.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::NodeT as _;
use lobelia::io::engines::{Places, Search};
use lobelia::io::{exr, model as files};
use lobelia::model::Model;

use crate::Window;

const RUN: &str = "Run the engine";
/// Places the first and the third photograph.
const PLACES: &str = r#"
echo 'step: Matching pairs [1/3]'; echo 'step: Matching pairs [3/3]'
d="$4/sparse/0"; mkdir -p "$d"
printf '1 RADIAL 80 60 70 40 30 0 0\n' > "$d/cameras.txt"
printf '1 0.7071 0.7071 0 0 0 0 0 1 000000.jpg\n40 30 0\n2 0.7071 0.7071 0 0 -1 0 0 1 000002.jpg\n22.5 30 0\n' > "$d/images.txt"
printf '0 0 4 0 9 9 9 0.5 1 0 2 0\n' > "$d/points3D.txt"
"#;

/// A begun capture of three photographs.
fn begun(folder: &Path) -> PathBuf {
    let images: Vec<PathBuf> = (0..3).map(|own| folder.join(format!("{own}.exr"))).collect();
    for image in &images {
        exr::write_rgb(image, 80, 60, &[[0.5; 3]; 80 * 60]).unwrap();
    }
    let capture = folder.join("capture");
    files::new_capture(&capture, &images, &lobelia::watch::Watch::new()).unwrap();
    capture
}

/// A Python that has openmvg-rs, which does what a script says.
fn engine(folder: &Path, script: &str) {
    let file = folder.join("bin/python3");
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    let question = "#!/bin/sh\nif [ \"$1\" = -c ]; then echo modules openmvg_rs; exit; fi";
    fs::write(&file, format!("{question}\n{script}\n")).unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
}

impl Window {
    /// The Model page of the capture with the panel open.
    fn finding(folder: &Path) -> Self {
        let capture = begun(folder);
        let mut window = Self::at(&folder.join("home"), Some(&capture));
        let path = folder.join("bin").into_os_string();
        let places = Places { path, environment: None };
        let silence = Duration::from_secs(2);
        window.harness.state_mut().find_cameras_by(Search { places, silence, ..Search::default() });
        window.wait_for("Find cameras…");
        window.click("Find cameras…");
        window.wait("the engines", |window| !window.harness.state().is_busy());
        window
    }

    pub fn wait_part(&mut self, part: &str) {
        self.wait(part, |window| window.has_part(part));
    }

    fn saved(&mut self, folder: &Path) -> Model {
        self.key(Modifiers::COMMAND, Key::S);
        files::read(&folder.join("capture/model.json")).unwrap()
    }
}

fn placed(model: &Model) -> Vec<bool> {
    model.photographs.iter().map(|own| own.found.is_some()).collect()
}

#[test]
fn an_engine_places_photographs_in_one_step_of_undo() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    engine(folder, PLACES);
    let mut window = Window::finding(folder);
    assert_eq!(window.labels("not installed").len(), 2);
    window.click(RUN);
    window.wait_part("2 of 3 photographs placed by openmvg-rs");
    assert!(window.has_part("1.exr is not: place it by lines and corners"));
    window.wait("the solution", |window| !window.harness.state().is_busy());
    assert!(window.has_part("the cameras stand as they were found"));
    assert!(window.has_part("up is guessed"));
    let model = window.saved(folder);
    assert_eq!(placed(&model), [true, false, true]);
    assert_eq!(model.lenses[0].focal_px, Some(70.0));
    window.key(Modifiers::COMMAND, Key::Z);
    assert!(window.has("Undone: find cameras"));
    assert_eq!(placed(&window.saved(folder)), [false; 3]);
    window.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    // One alone is placed by hand, and then none is found any more.
    window.click("Place this one by hand");
    assert_eq!(placed(&window.saved(folder)), [false, false, true]);
    window.click("Discard the cameras that were found");
    let model = window.saved(folder);
    assert_eq!((placed(&model), model.found_points.len()), (vec![false; 3], 0));
}

#[test]
fn a_run_is_cancelled_fails_or_hangs_and_nothing_changes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    engine(folder, "while :; do echo at work; sleep 0.05; done");
    let mut window = Window::finding(folder);
    window.click(RUN);
    window.wait_for("at work");
    window.harness.run_steps(2);
    window.node("Cancel").click();
    window.wait_for("Cancelled. Nothing has changed.");
    engine(folder, "echo 'error: OutOfMemory: too large'; exit 3");
    window.click(RUN);
    window.wait_part("OutOfMemory: too large (exit code 3)");
    engine(folder, "sleep 60");
    window.click(RUN);
    window.wait_part("written nothing for 2 s");
    assert!(!folder.join("capture/model.json").exists());
    assert!(!folder.join("capture/model.unsaved.json").exists());
}

#[test]
fn a_missing_engine_is_told_with_the_line_that_installs_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut window = Window::finding(folder);
    assert_eq!(window.labels("not installed").len(), 3);
    assert!(window.has_part("pip install openmvg-rs"));
    assert!(window.node(RUN).accesskit_node().is_disabled());
    window.click("Copy the line");
    // It is there after all.
    engine(folder, PLACES);
    window.click("Look again");
    window.wait_for("found");
    assert!(!window.node(RUN).accesskit_node().is_disabled());
}
