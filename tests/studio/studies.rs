//! The workspace Study: points and curves that come while it runs, what can be done with them, and
//! what is said where something is missing.

use std::fs;
use std::path::{Path, PathBuf};

use eframe::egui;
use egui_kittest::kittest::{NodeT as _, Queryable as _};

use crate::runs::coarse;
use crate::{Window, example};

/// A window with the coarse project in the workspace Study.
fn studying(folder: &Path) -> Window {
    let mut window = Window::at(folder, Some(&coarse(folder, 150)));
    window.wait_for("Photographs (6)");
    window.key(egui::Modifiers::NONE, egui::Key::F6);
    window
}

fn names(window: &Window, part: &str) -> Vec<String> {
    let found = window.harness.query_all_by_label_contains(part);
    let name = |node: egui_kittest::Node| {
        let node = node.accesskit_node();
        node.label().or_else(|| node.value())
    };
    found.filter_map(name).collect()
}

/// The names of the points of the chart of speed.
fn points(window: &Window) -> Vec<String> {
    names(window, " s, error ")
}

fn save_to(window: &mut Window, folder: &Path) {
    window.click("Save…");
    window.write("Path", folder.to_str().unwrap());
    window.click("Save study");
}

#[test]
fn settings_become_points_that_can_be_used_and_saved() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = studying(folder.path());
    assert!(window.has_part("how the error falls with computing time on this capture"));
    window.wait("the look for the truth", |window| !window.harness.state().is_busy());
    window.click("Run study");
    window.wait("two points", |window| points(window).len() >= 2);
    // A run would spoil the seconds: that is asked first.
    window.key(egui::Modifiers::COMMAND, egui::Key::R);
    assert!(window.has("Run beside the study?") && !window.has("Cancel run"));
    window.click_front("Cancel");
    assert!(!window.has("Run beside the study?") && !window.has("Cancel run"));
    window.click("Cancel study");
    window.wait("the end", |window| !window.harness.state().is_busy());
    assert!(window.has_part("was stopped; its"));
    let kept = points(&window);
    assert!(kept.len() >= 2, "{kept:?}");
    assert!(window.has("Go on with the study"));

    // Another measure of the same runs.
    window.click("Photograph, FLIP");
    assert!(points(&window).len() == kept.len() && points(&window) != kept);

    let other = points(&window).into_iter().find(|name| !name.starts_with("your options"));
    let other = other.expect("a setting");
    let setting = other.rsplit_once(": ").unwrap().0.to_owned();
    window.click(&other);
    assert!(window.has_part(&format!("Run options set to \"{setting}\"")));
    let used = format!("The run's options are those of \"{setting}\".");
    assert!(window.has(&used));
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert!(window.has_part(&format!("Undone: setting {setting}")) && !window.has(&used));

    let out = folder.path().join("speed");
    save_to(&mut window, &out);
    window.wait("the files", |window| window.has_part("The study is written to"));
    for file in ["speed.json", "speed.csv", "front.csv", "corner.svg", "corner.png"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let table = fs::read_to_string(out.join("speed.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + kept.len(), "{table}");
    assert!(table.contains(&setting));

    // What was saved is not asked about.
    window.menu("File", "Close project");
    assert!(window.has("Open example"));
}

#[test]
fn curves_and_sentences_say_what_the_capture_bears() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = studying(folder.path());
    window.click("Stability");
    assert!(window.has_part("Switch on the degradations to test, and run the study"));
    window.wait("the look for the truth", |window| !window.harness.state().is_busy());
    window.click("Image noise");
    for (field, text) in [("Steps", "2"), ("Seeds", "1")] {
        window.write(field, text);
        window.key(egui::Modifiers::NONE, egui::Key::Enter);
    }
    assert!(window.has("6 runs"), "as it is and two steps, by two methods");
    window.click("Run study");
    let curve = |window: &Window| names(window, "noise of").len();
    window.wait("the first step", |window| curve(window) >= 1);
    window.menu("File", "Close project");
    assert!(window.has_part("The study of this capture was not saved"));
    window.click("Cancel");
    window.wait("the end", |window| !window.harness.state().is_busy());
    let of = |way: &str| names(&window, &format!("{way}, noise of")).len();
    assert_eq!((of("joint"), of("paper")), (2, 2));
    assert!(window.has_part("joint tolerates") || window.has_part("joint breaks at"));
    assert!(window.has_part("Of 6 runs, 0 stopped with an internal error"));
    assert!(window.has_part("As the capture is, the reflectances"));

    let out = folder.path().join("stability");
    save_to(&mut window, &out);
    window.wait("the files", |window| window.has_part("The study is written to"));
    for file in ["report.html", "stability.csv", "stability.json", "breaks.csv", "stability.svg"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    // The same again is done already; more of it is not.
    assert!(window.has("6 runs done"));
    window.click("Lens distortion wrong");
    assert!(window.has("4 of 10 runs left"));
    window.click("Go on with the study");
    window.wait("the end", |window| !window.harness.state().is_busy());
    assert!(window.has_part("a lens coefficient k1") && curve(&window) >= 4);
}

/// The example in a folder of its own, with another truth or none.
fn copy(folder: &Path, truth: Option<&str>) -> PathBuf {
    let to = folder.join("corner");
    fs::create_dir_all(to.join("images")).unwrap();
    for place in ["", "images"] {
        for entry in fs::read_dir(example().join(place)).unwrap() {
            let entry = entry.unwrap();
            if entry.file_type().unwrap().is_file() && entry.file_name() != "truth.json" {
                fs::copy(entry.path(), to.join(place).join(entry.file_name())).unwrap();
            }
        }
    }
    if let Some(truth) = truth {
        fs::write(to.join("truth.json"), truth).unwrap();
    }
    to
}

#[test]
fn what_is_missing_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::at(folder.path(), Some(&copy(folder.path(), None)));
    window.wait_for("Photographs (6)");
    window.click("Study");
    window.wait("the look", |window| window.has_part("(no truth.json)"));
    window.click("Stability");
    assert!(window.has_part("errors are estimated by the intervals"));

    // Without materials there is nothing to study; the step that is missing is offered.
    let project = folder.path().join("untagged.lobelia");
    let text = serde_json::json!({ "version": 1, "capture": example(), "materials": [] });
    fs::write(&project, text.to_string()).unwrap();
    let mut window = Window::at(folder.path(), Some(&project));
    window.wait_for("Photographs (6)");
    window.key(egui::Modifiers::NONE, egui::Key::F6);
    assert!(!window.has("Run study"));
    window.click("Tag surfaces");
    assert!(window.has("Viewport"), "the workspace Tag has the 3D view");

    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::at(folder.path(), Some(&copy(folder.path(), Some("{"))));
    window.wait_for("Photographs (6)");
    window.key(egui::Modifiers::NONE, egui::Key::F6);
    window.wait_for("What is true of this capture cannot be read");
    assert!(window.has_part("truth.json cannot be read"));
    assert!(window.has_part("corner/truth.json"), "the file is named");
    window.click("Dismiss");
    window.wait("the look for the truth", |window| !window.harness.state().is_busy());

    // A folder that cannot be one is an error that names it.
    window.click("Run study");
    window.wait("a point", |window| !points(window).is_empty());
    window.click("Cancel study");
    window.wait("the end", |window| !window.harness.state().is_busy());
    let file = folder.path().join("corner/scene.obj");
    save_to(&mut window, &file.join("study"));
    window.wait_for("The study cannot be written");
}
