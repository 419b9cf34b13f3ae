use std::fs;
use std::path::Path;
use std::sync::Arc;

use eframe::egui;
use lobelia::app::viewport::{Content, ViewCamera};

use crate::viewport::{bare, picture, window};
use crate::{Dropped, Window, example};

fn copy_example(to: &Path) {
    fs::create_dir_all(to.join("images")).unwrap();
    for part in ["", "images"] {
        for entry in fs::read_dir(example().join(part)).unwrap().flatten() {
            if entry.path().is_file() {
                fs::copy(entry.path(), to.join(part).join(entry.file_name())).unwrap();
            }
        }
    }
}

fn make_floor_specular(window: &mut Window) {
    window.click("Tag");
    window.click("floor (1)");
    window.click("Specular");
    assert!(window.has("specular"));
}

#[test]
fn a_project_is_saved_and_comes_back_and_its_capture_may_move() {
    let folder = tempfile::tempdir().unwrap();
    let capture = folder.path().join("room");
    copy_example(&capture);
    let file = folder.path().join("work.lobelia");
    let home = folder.path().join("home");
    let mut window = Window::at(&home, Some(&capture));
    window.wait_for("Photographs (6)");
    make_floor_specular(&mut window);
    window.key(egui::Modifiers::COMMAND, egui::Key::S);
    window.write("Path", file.to_str().unwrap());
    window.click("Save");
    assert!(file.is_file());
    drop(window);

    let mut window = Window::at(&home, Some(&file));
    window.wait_for("Photographs (6)");
    window.click("Tag");
    assert!(window.has("specular"));
    drop(window);

    let moved = folder.path().join("elsewhere");
    fs::rename(&capture, &moved).unwrap();
    let mut window = Window::at(&home, Some(&file));
    window.step();
    assert!(window.has("Find the capture"));
    window.write("Path", moved.to_str().unwrap());
    window.click("Use");
    window.wait_for("Photographs (6)");
    window.click("Tag");
    assert!(window.has("specular"));
}

#[test]
fn unsaved_work_is_asked_about() {
    let mut window = Window::with_example();
    make_floor_specular(&mut window);
    window.menu("File", "Close project");
    assert!(window.has("Save changes?"));
    window.click("Cancel");
    assert!(window.has("Photographs (6)"));
    window.menu("File", "Close project");
    window.click("Don't save");
    assert!(window.has("Open example"));
}

#[test]
fn work_that_a_crash_left_is_offered() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path().join("home");
    let mut window = Window::at(&home, Some(&example()));
    window.wait_for("Photographs (6)");
    make_floor_specular(&mut window);
    window.harness.state_mut().autosave();
    // As a crash leaves it: kept, and locked by nobody.
    let kept = home.join("recovery/unsaved-0.lobelia");
    // The loop of events may end without a question, by a crash or an error of the system.
    drop(window);
    assert!(kept.exists(), "work that nobody gave up is lost");

    let mut window = Window::at(&home, Some(&example()));
    window.wait_for("Photographs (6)");
    assert!(window.has_part("Its work on \"corner\" was kept, just now"), "beside a project");
    drop(window);
    let mut window = Window::at(&home, None);
    window.step();
    window.click("Recover");
    window.wait_for("Photographs (6)");
    window.click("Tag");
    assert!(window.has("specular"));
    assert!(!kept.exists());
    window.menu("File", "Close project");
    assert!(window.has("Save changes?"), "recovered work is not saved yet");
}

#[test]
fn leaving_for_good_leaves_nothing_to_recover() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path().join("home");
    let mut window = Window::at(&home, Some(&example()));
    window.wait_for("Photographs (6)");
    make_floor_specular(&mut window);
    window.harness.state_mut().autosave();
    assert!(home.join("recovery/unsaved-0.lobelia").exists());
    window.menu("File", "Quit");
    window.click("Don't save");
    drop(window);
    assert_eq!(fs::read_dir(home.join("recovery")).unwrap().count(), 0);
}

#[test]
fn another_project_of_that_name_is_not_replaced_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("room.lobelia");
    fs::write(&file, "last week's").unwrap();
    let mut window = Window::with_example();
    make_floor_specular(&mut window);
    for answer in ["Cancel", "Replace"] {
        assert_eq!(fs::read_to_string(&file).unwrap(), "last week's");
        window.key(egui::Modifiers::COMMAND, egui::Key::S);
        // Without the extension, which is added.
        window.write("Path", folder.path().join("room").to_str().unwrap());
        window.click("Save");
        assert!(window.has("Replace the file?"));
        window.click(answer);
    }
    assert!(fs::read_to_string(&file).unwrap().contains("specular"));
    window.click("Diffuse");
    window.key(egui::Modifiers::COMMAND, egui::Key::S);
    assert!(!window.has("Replace the file?"), "its own file is not asked about");
}

#[test]
fn work_done_while_another_capture_is_read_is_asked_about() {
    let folder = tempfile::tempdir().unwrap();
    let capture = folder.path().join("room");
    copy_example(&capture);
    let mut window = Window::with_example();
    window.click("Tag");
    window.click("floor (1)");
    let place = window.node("Specular").rect().center();
    let button = |pressed| egui::Event::PointerButton {
        pos: place,
        button: egui::PointerButton::Primary,
        pressed,
        modifiers: egui::Modifiers::NONE,
    };
    window.harness.hover_at(place);
    window.harness.event(button(true));
    window.step();
    window.harness.input_mut().dropped_files.push(Arc::new(Dropped(capture)));
    while !window.has_part("Opening") {
        window.harness.run_steps(1);
    }
    // In the frame in which its reading is told: it has not come to its end.
    window.harness.event(button(false));
    window.wait_for("Save changes?");
    window.click("Cancel");
    assert!(window.has("specular"), "the work is still there");
}

#[test]
fn tags_that_the_capture_lacks_are_told_and_not_saved_away() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("old.lobelia");
    let project = serde_json::json!({
        "version": 1,
        "capture": example(),
        "materials": [{"name": "rug", "specular": false, "surfaces": ["rug", "floor"]}],
    });
    fs::write(&file, project.to_string()).unwrap();
    let mut window = Window::at(&folder.path().join("home"), Some(&file));
    window.wait_for("Photographs (6)");
    assert!(window.has("The capture has changed since the project was saved"));
    assert!(window.has_part("no surface \"rug\" any more"));
    // They follow their material to another name.
    window.click("Tag");
    window.click("rug (1)");
    window.write("Name", "carpet");
    window.key(egui::Modifiers::NONE, egui::Key::Enter);
    window.key(egui::Modifiers::COMMAND, egui::Key::S);
    let stored: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
    let carpet = &stored["materials"][0];
    assert_eq!(carpet["name"], "carpet");
    assert_eq!(carpet["surfaces"], serde_json::json!(["floor", "rug"]));
}

#[test]
fn deleting_a_material_selects_no_other() {
    let mut window = Window::with_example();
    window.click("Tag");
    window.click("floor (1)");
    window.click("Delete");
    assert!(!window.has("floor (1)") && !window.has("Delete"));
}

#[test]
fn a_kept_camera_stays_when_its_capture_comes() {
    let mut window = window(Content::default());
    let kept = ViewCamera { distance: 3.0, orthographic: true, ..ViewCamera::default() };
    window.state_mut().viewport.set_camera(kept);
    window.state_mut().content = bare();
    picture(&mut window);
    assert!(*window.state().viewport.camera() == kept);
    window.state_mut().viewport.frame_all();
    picture(&mut window);
    assert!(*window.state().viewport.camera() != kept);
}
