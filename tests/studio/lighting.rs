//! Known light: made and edited in the window, kept by the project.

use std::fs;
use std::path::Path;

use eframe::egui;
use serde_json::{Value, json};

use crate::nothing_lost::{json_of, open, save};
use crate::{Window, example};

const NONE: egui::Modifiers = egui::Modifiers::NONE;

fn project(folder: &Path, lights: &Value) -> std::path::PathBuf {
    let file = folder.join("lit.lobelia");
    let surfaces = |name: &str| json!({"name": name, "specular": false, "surfaces": [name]});
    let materials: Vec<Value> = ["floor", "wall1", "wall2", "box1"].map(surfaces).into();
    let project = json!({
        "version": 3, "capture": example(), "materials": materials, "lights": lights,
    });
    fs::write(&file, project.to_string()).unwrap();
    file
}

fn undo(window: &mut Window) {
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
}

#[test]
fn known_lights_and_the_environment_are_made_undone_and_saved() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), &json!([]));
    let mut window = open(folder.path(), &file);
    window.key(NONE, egui::Key::F2);
    window.click("Known light");
    window.click("Open");
    undo(&mut window);
    window.key(egui::Modifiers::COMMAND | egui::Modifiers::SHIFT, egui::Key::Z);

    window.menu("Add known light", "Sphere");
    assert!(window.has("sphere light 1  (sphere, to be found)"));
    window.click("Known radiance");
    assert!(window.has("sphere light 1  (sphere)"));
    undo(&mut window);
    assert!(window.has("sphere light 1  (sphere, to be found)"));
    window.click("Known colour");
    window.click("Duplicate");
    window.key(NONE, egui::Key::Delete);
    undo(&mut window);
    assert!(window.has("sphere light 2  (sphere, to be found)"));

    // It is moved by hand in the 3D view as added lights are.
    window.click("sphere light 1  (sphere, to be found)");
    save(&mut window);
    let place = |file: &Path| json_of(file)["lights"][0]["center"][0].as_f64().unwrap();
    let before = place(&file);
    let middle = window.node("Viewport").rect().center();
    window.harness.hover_at(middle);
    window.step();
    window.key(NONE, egui::Key::G);
    window.harness.event(egui::Event::Text("0.25".to_owned()));
    window.step();
    window.key(NONE, egui::Key::Enter);
    save(&mut window);
    assert!((place(&file) - before - 0.25).abs() < 1e-5);
    undo(&mut window);
    save(&mut window);
    assert!((place(&file) - before).abs() < 1e-6, "it was one step");
    let stored = json_of(&file);
    assert_eq!(stored["environment"], "open");
    assert_eq!(stored["lights"].as_array().unwrap().len(), 2);
    assert_eq!(stored["lights"][1]["color"], json!([1.0, 1.0, 1.0]));
    drop(window);

    let mut window = open(folder.path(), &file);
    window.key(NONE, egui::Key::F2);
    window.click("Known light");
    assert!(window.has("sphere light 2  (sphere, to be found)"));
    window.key(NONE, egui::Key::F1);
    assert!(window.has("open"), "the overview tells the environment");
}

#[test]
fn surfaces_become_a_visible_light_and_leave_their_material() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), &json!([]));
    let mut window = open(folder.path(), &file);
    window.key(NONE, egui::Key::F2);
    assert!(window.has("box1 (1)"));
    window.click("box1");
    window.click("Known light");
    window.click("Selected surfaces shine");
    assert!(window.has("visible light 1  (visible)"));
    window.click("Tags");
    assert!(window.has("box1 (0)"));
    // Such a surface is given no material.
    window.key(NONE, egui::Key::M);
    window.click_front("wall1");
    assert!(window.has_part("belongs to the visible light"), "it says why not");
    save(&mut window);
    let stored = json_of(&file);
    assert_eq!(stored["lights"][0]["surfaces"], json!(["box1"]));
    undo(&mut window);
    assert!(window.has("box1 (1)"));
    drop(window);
    let mut window = open(folder.path(), &file);
    window.key(NONE, egui::Key::F2);
    window.click("Known light");
    assert!(window.has("visible light 1  (visible)"));
}

#[test]
fn a_missing_sky_is_kept_told_and_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let sky = json!({"name": "noon", "kind": "dome", "image": "gone.exr", "scale": 2.0});
    let lamp = json!({
        "name": "lamp", "kind": "point", "position": [1.0, 1.0, 2.0], "intensity": null,
    });
    let file = project(folder.path(), &json!([sky, lamp]));
    let mut window = open(folder.path(), &file);
    assert!(window.has_part("gone.exr"), "the message names the file");
    window.key(NONE, egui::Key::F2);
    window.click("Known light");
    assert!(window.has("lamp  (point, to be found)") && window.has_part("noon  (missing"));
    window.click("lamp  (point, to be found)");
    window.click("Known intensity");
    save(&mut window);
    let stored = json_of(&file)["lights"].clone();
    assert_eq!(stored[0]["intensity"], json!([1.0, 1.0, 1.0]));
    assert_eq!(stored[1], sky);

    let found = folder.path().join("found.hdr");
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".to_vec();
    bytes.extend([128u8, 128, 128, 129].repeat(8));
    fs::write(&found, bytes).unwrap();
    window.click("Find noon…");
    window.write("Path", found.to_str().unwrap());
    window.click_front("Use");
    window.wait_for("noon  (dome)");
    assert!(!window.has_part("(missing"));
    save(&mut window);
    let stored = json_of(&file)["lights"].clone();
    assert_eq!((&stored[1]["image"], &stored[1]["scale"]), (&json!("found.hdr"), &json!(2.0)));
}

#[test]
fn a_sky_is_turned_and_scaled_by_numbers_keys_and_the_mouse() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".to_vec();
    bytes.extend([128u8, 128, 128, 129].repeat(8));
    fs::write(folder.path().join("sky.hdr"), bytes).unwrap();
    let sky = json!({"name": "noon", "kind": "dome", "image": "sky.hdr", "scale": 2.0});
    let file = project(folder.path(), &json!([sky]));
    let mut window = open(folder.path(), &file);
    window.key(NONE, egui::Key::F2);
    window.click("Known light");
    window.click("noon  (dome)");
    let stored = |window: &mut Window, key: &str| {
        save(window);
        json_of(&file)["lights"][0][key].as_f64().unwrap_or(0.0)
    };
    let degrees = |window: &mut Window| stored(window, "turn").to_degrees();
    let typed = |window: &mut Window, text: &str| {
        window.harness.event(egui::Event::Text(text.to_owned()));
        window.step();
        window.key(NONE, egui::Key::Enter);
    };
    window.click("Turn of the dome");
    window.key(egui::Modifiers::COMMAND, egui::Key::A);
    typed(&mut window, "30");
    assert!((degrees(&mut window) - 30.0).abs() < 1e-3);
    undo(&mut window);
    assert_eq!(degrees(&mut window), 0.0);
    // Over the 3D view: R turns about the vertical whatever the axis, S makes it brighter.
    let middle = window.node("Viewport").rect().center();
    window.harness.hover_at(middle);
    window.step();
    window.key(NONE, egui::Key::R);
    typed(&mut window, "45");
    assert!((degrees(&mut window) - 45.0).abs() < 1e-3);
    window.key(NONE, egui::Key::S);
    typed(&mut window, "2");
    assert!((stored(&mut window, "scale") - 4.0).abs() < 1e-6);
    assert!((degrees(&mut window) - 45.0).abs() < 1e-3);
    // By the mouse, and a click keeps it; one step of undo.
    window.key(NONE, egui::Key::R);
    for step in 1..=4 {
        window.harness.hover_at(middle + egui::vec2(30.0 * step as f32, 10.0 * step as f32));
        window.step();
    }
    window.key(NONE, egui::Key::Enter);
    assert!((degrees(&mut window) - 45.0).abs() > 1.0);
    undo(&mut window);
    assert!((degrees(&mut window) - 45.0).abs() < 1e-3);
    undo(&mut window);
    undo(&mut window);
    assert_eq!((degrees(&mut window), stored(&mut window, "scale")), (0.0, 2.0));
}
