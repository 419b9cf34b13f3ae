//! What a project holds stays there: what cannot be read, the file before, results of a run.

use std::fs;
use std::path::{Path, PathBuf};

use eframe::egui;
use serde_json::{Value, json};

use crate::runs::coarse;
use crate::{Window, example};

const NONE: egui::Modifiers = egui::Modifiers::NONE;
pub const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 2 3\nf 1 2 4\n";

/// A project of the example that is relit.
pub fn relit_project(folder: &Path, relight: &Value) -> PathBuf {
    let file = folder.join("relit.lobelia");
    let project = json!({
        "version": 1, "capture": example(), "materials": [], "relight": relight,
    });
    fs::write(&file, project.to_string()).unwrap();
    file
}

pub fn point(name: &str, x: f64) -> Value {
    json!({"name": name, "kind": "point", "position": [x, 1.5, 1.0], "intensity": [1, 1, 1]})
}

pub fn json_of(file: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap()
}

/// A window with a project, once all of it has been read.
pub fn open(folder: &Path, file: &Path) -> Window {
    let mut window = Window::at(&folder.join("home"), Some(file));
    window.wait_for("Photographs (6)");
    window.wait("all of it", |window| !window.harness.state().is_busy());
    window
}

pub fn save(window: &mut Window) {
    window.key(egui::Modifiers::COMMAND, egui::Key::S);
    assert!(!window.has("Save project as"), "the project has a file");
}

#[test]
fn a_missing_object_is_kept_told_and_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("thing.obj");
    let rows = json!([[1, 0, 0, 0.5], [0, 1, 0, 0.25], [0, 0, 1, 0], [0, 0, 0, 1]]);
    let object = json!({
        "name": "thing", "mesh": "thing.obj", "world_from_object": rows,
        "materials": {"red": {"diffuse": [0.6, 0.1, 0.1]}},
    });
    let lights: Vec<Value> = (0..4).map(|k| point(&format!("lamp {k}"), f64::from(k))).collect();
    let relight = json!({"lights": lights, "objects": [object]});
    let file = relit_project(folder.path(), &relight);

    // The mesh is not there: nothing of the project goes when it is saved.
    let mut window = open(folder.path(), &file);
    assert!(window.has_part("thing.obj"), "the message names the file");
    window.key(NONE, egui::Key::F5);
    assert!(window.has("lamp 3  (point)") && window.has_part("thing  (missing"));
    save(&mut window);
    let stored = json_of(&file);
    assert_eq!(stored["relight"]["lights"].as_array().unwrap().len(), 4);
    assert_eq!(stored["relight"]["objects"], json!([object]));
    drop(window);

    // It has moved: the project follows it, in one step.
    let moved = folder.path().join("elsewhere.obj");
    fs::write(&moved, MESH).unwrap();
    let mut window = open(folder.path(), &file);
    window.key(NONE, egui::Key::F5);
    window.click("Find thing…");
    window.write("Path", moved.to_str().unwrap());
    window.click_front("Use");
    window.wait_for("thing  (object)");
    assert!(!window.has_part("(missing"));
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert!(window.has_part("thing  (missing"));
    window.key(egui::Modifiers::COMMAND | egui::Modifiers::SHIFT, egui::Key::Z);
    save(&mut window);
    let stored = json_of(&file)["relight"]["objects"][0].clone();
    assert_eq!((&stored["mesh"], &stored["name"]), (&json!("elsewhere.obj"), &json!("thing")));
    assert_eq!(stored["world_from_object"][0][3], 0.5, "it stays where it stood");
    assert_eq!(stored["materials"]["red"]["diffuse"], json!([0.6, 0.1, 0.1]));
    drop(window);

    // A placeholder can be taken out of the project, and brought back.
    fs::remove_file(&moved).unwrap();
    assert!(!mesh.exists());
    let mut window = open(folder.path(), &file);
    window.key(NONE, egui::Key::F5);
    window.click("Remove thing");
    assert!(!window.has_part("(missing"));
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert!(window.has_part("thing  (missing"));
}

#[test]
fn what_cannot_be_read_is_saved_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("broken.obj"), "v 0 0 0\n").unwrap();
    let relight = json!({
        "lights": [
            point("good", 1.0),
            {"name": "beam", "kind": "laser", "strength": 3},
            {"name": "sky", "kind": "dome", "image": "gone.exr", "scale": 2},
        ],
        "objects": [{"name": "bust", "mesh": "broken.obj"}],
        "materials": {"carpet": {"diffuse": [0.1, 0.2, 0.3]}},
        "original_light_groups": {"window": "bright"},
        "fog": {"density": 0.25},
    });
    let file = relit_project(folder.path(), &relight);
    let mut window = open(folder.path(), &file);
    assert!(window.has_part("laser") && window.has_part("gone.exr"));
    save(&mut window);
    let stored = json_of(&file)["relight"].clone();
    for key in ["objects", "materials", "original_light_groups", "fog"] {
        assert_eq!(stored[key], relight[key], "{key}");
    }
    assert_eq!(stored["lights"][0]["name"], "good");
    assert_eq!(stored["lights"][1], relight["lights"][1]);
    assert_eq!(stored["lights"][2], relight["lights"][2]);

    // A project in another folder names the same files.
    fs::create_dir(folder.path().join("other")).unwrap();
    window.menu("File", "Save as…");
    let other = folder.path().join("other/copy.lobelia");
    window.write("Path", other.to_str().unwrap());
    window.click_front("Save");
    assert_eq!(json_of(&other)["relight"]["lights"][2]["image"], "../gone.exr");
}

#[test]
fn saving_keeps_the_file_before() {
    let folder = tempfile::tempdir().unwrap();
    let file = relit_project(folder.path(), &json!({"lights": [point("lamp", 1.0)]}));
    let former = fs::read(&file).unwrap();
    let mut window = open(folder.path(), &file);
    window.key(NONE, egui::Key::F5);
    window.menu("Add light", "Sun");
    save(&mut window);
    let backup = folder.path().join("relit.lobelia~");
    assert_eq!(fs::read(&backup).unwrap(), former);
    // Saving what is saved already does not push the one before out.
    save(&mut window);
    assert_eq!(fs::read(&backup).unwrap(), former);
    assert_eq!(json_of(&file)["relight"]["lights"].as_array().unwrap().len(), 2);
}

/// A window with a project whose run has ended.
fn run(folder: &Path, file: &Path) -> Window {
    let mut window = open(folder, file);
    window.key(egui::Modifiers::COMMAND, egui::Key::R);
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    window
}

#[test]
fn results_are_saved_with_the_project_and_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = coarse(folder.path(), 150);
    let mut window = run(folder.path(), &file);
    window.click("Inspect");
    window.click("samples row 7");
    // Where its light comes from.
    let shown = |window: &Window| -> Vec<String> {
        window.labels(" %").into_iter().filter(|label| label.ends_with(" %")).collect()
    };
    let share = shown(&window);
    assert!(share.len() > 1, "{share:?}");
    window.menu("File", "Close project");
    assert!(window.has_part("The results are not saved"), "closing would lose them");
    window.click("Cancel");
    save(&mut window);
    window.wait("the results on the disk", |window| !window.harness.state().is_busy());
    assert!(folder.path().join("coarse.lobelia-data/solution.json").is_file());
    window.menu("File", "Close project");
    assert!(window.has("Open example"), "nothing is lost, so nothing is asked");
    drop(window);

    let mut window = open(folder.path(), &file);
    window.click("Reconstruct");
    assert!(window.has_part("relative RMS (%)") && !window.has("Not run yet."));
    window.click("Error per sample");
    assert!(window.has_part("RMS of the logarithm"));
    window.click("Inspect");
    window.click("samples row 7");
    assert_eq!(shown(&window), share);
    window.key(NONE, egui::Key::F5);
    assert!(!window.has_part("Run first"));

    // A tag that is changed afterwards does not cost the results.
    window.click("Tag");
    window.click("floor (1)");
    window.click("Delete");
    assert!(!window.has("floor (1)"));
    save(&mut window);
    drop(window);
    let mut window = open(folder.path(), &file);
    window.click("Reconstruct");
    assert!(window.has("Outdated"), "they are of earlier tags");
    window.click("Inspect");
    window.click("samples row 7");
    assert_eq!(shown(&window), share);
}

#[test]
fn results_survive_a_crash() {
    let folder = tempfile::tempdir().unwrap();
    let file = coarse(folder.path(), 150);
    let mut window = run(folder.path(), &file);
    window.harness.state_mut().autosave();
    // As a crash leaves it: nobody has answered a question.
    drop(window);
    let mut window = Window::at(&folder.path().join("home"), None);
    window.step();
    window.click("Recover");
    window.wait_for("Photographs (6)");
    window.wait("all of it", |window| !window.harness.state().is_busy());
    window.click("Inspect");
    assert!(window.has_part("m apart"));
    window.menu("File", "Close project");
    assert!(window.has_part("The results are not saved"));
}
