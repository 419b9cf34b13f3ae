use std::fs;
use std::path::Path;

use eframe::egui;

use crate::{Window, example};

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
    let contents = fs::read(&kept).unwrap();
    assert_eq!(window.home, home);
    drop(window);
    assert!(!kept.exists(), "a window that closes leaves nothing");
    fs::write(&kept, contents).unwrap();

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
