//! What is dropped onto the window does what is meant, or is told why not.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use eframe::egui;
use serde_json::json;

use crate::nothing_lost::{MESH, json_of, open, point, relit_project, save};
use crate::{Dropped, Window, example};

const NONE: egui::Modifiers = egui::Modifiers::NONE;

fn drop_files(window: &mut Window, files: &[&Path]) {
    let dropped = &mut window.harness.input_mut().dropped_files;
    for file in files {
        dropped.push(Arc::new(Dropped(file.to_path_buf())));
    }
    window.step();
}

#[test]
fn photographs_begin_a_capture() {
    let images = example().join("images");
    let mut window = Window::new();
    window.step();
    drop_files(&mut window, &[&images.join("000.exr"), &images.join("001.exr")]);
    assert!(window.has("New from photographs") && window.has("2 photographs"));
    assert!(window.has("Leave 001.exr out"));
    assert!(!window.has_part("os error"));
    // Their folder means all of them.
    let mut window = Window::new();
    window.step();
    drop_files(&mut window, &[&images]);
    assert!(window.has("6 photographs"));
}

#[test]
fn photographs_go_with_what_is_imported() {
    let images = example().join("images");
    let mut window = Window::new();
    window.step();
    window.key(egui::Modifiers::COMMAND, egui::Key::I);
    drop_files(&mut window, &[&images.join("000.exr")]);
    let folder = window.node("Image folder");
    let shown = egui_kittest::kittest::NodeT::accesskit_node(&folder).value();
    assert_eq!(shown.as_deref(), images.to_str());
}

#[test]
fn what_is_dropped_on_relight_is_set_into_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let file = relit_project(folder.path(), &json!({"lights": [point("lamp", 1.0)]}));
    let mesh = folder.path().join("thing.obj");
    fs::write(&mesh, MESH).unwrap();
    let edits = folder.path().join("more.json");
    fs::write(&edits, json!({"lights": [point("second", 2.0)]}).to_string()).unwrap();
    let mut window = open(folder.path(), &file);
    window.key(NONE, egui::Key::F5);
    drop_files(&mut window, &[&mesh, &edits]);
    window.wait_for("thing  (object)");
    window.wait_for("second  (point)");
    drop_files(&mut window, &[&example().join("images/000.exr")]);
    window.wait_for("000  (dome)");
}

#[test]
fn what_is_of_no_use_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let empty = folder.path().join("holiday");
    fs::create_dir(&empty).unwrap();
    let text = folder.path().join("letter.docx");
    fs::write(&text, "Dear").unwrap();
    let mut window = Window::new();
    window.step();
    drop_files(&mut window, &[&empty]);
    assert!(window.has_part("holiday: there is neither a capture"));
    drop_files(&mut window, &[&text]);
    assert!(window.has_part("letter.docx: files of this kind are not read"));
    // By the terminal and the field for a path, too.
    drop(window);
    let mut window = Window::at(&folder.path().join("home"), Some(&text));
    window.wait("the message", |window| window.has_part("a capture is a folder"));
    assert!(!window.has_part("os error"));
}

#[test]
fn numbers_are_typed_as_people_write_them() {
    let folder = tempfile::tempdir().unwrap();
    let file = relit_project(folder.path(), &json!({"lights": [point("lamp", 1.0)]}));
    let mut window = open(folder.path(), &file);
    window.key(NONE, egui::Key::F5);
    window.click("lamp  (point)");
    let mut typed = |text: &str| {
        window.click("Position, x");
        window.key(egui::Modifiers::COMMAND, egui::Key::A);
        window.harness.event(egui::Event::Text(text.to_owned()));
        window.step();
        window.key(NONE, egui::Key::Enter);
        let told = window.has_part("is not finite") || window.has_part("is no number here");
        save(&mut window);
        let at = json_of(&file)["relight"]["lights"][0]["position"][0].as_f64().unwrap();
        (at, told)
    };
    assert_eq!(typed("0,5"), (0.5, false));
    assert_eq!(typed("3/4"), (0.75, false));
    assert_eq!(typed("40 cm"), (0.4, false));
    assert_eq!(typed("250mm"), (0.25, false));
    for refused in ["nan", "inf", "1/0", "two"] {
        assert_eq!(typed(refused), (0.25, true), "{refused}");
    }
}
