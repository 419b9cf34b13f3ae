use std::path::Path;

use eframe::egui;
use egui_kittest::kittest::NodeT as _;

use crate::Window;
use crate::runs::coarse;

const NONE: egui::Modifiers = egui::Modifiers::NONE;

/// A project whose results are there, in the workspace for relighting.
pub fn relit(folder: &Path) -> Window {
    let mut window = Window::at(folder, Some(&coarse(folder, 150)));
    window.wait_for("Photographs (6)");
    window.key(NONE, egui::Key::F5);
    assert!(window.has_part("Run first"));
    window.key(egui::Modifiers::COMMAND, egui::Key::R);
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    window.key(NONE, egui::Key::F1);
    window.key(NONE, egui::Key::F5);
    window
}

#[test]
fn light_is_added_seen_undone_and_saved() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    window.wait("the first picture", |window| window.has_part("paths a pixel"));
    assert!(window.has("All of it") && window.has_part("Nothing yet"));
    window.menu("Add light", "Sphere");
    assert!(window.has("sphere light 1  (sphere)") && window.has("Radius, m"));
    window.menu("Add light", "Sun");
    assert!(window.has("sun light 1  (sun)") && window.has("Elevation"));
    window.click("Duplicate");
    assert!(window.has("sun light 2  (sun)"));
    window.key(NONE, egui::Key::Delete);
    assert!(!window.has("sun light 2  (sun)"));
    // Each of them was one step.
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert!(window.has("sun light 2  (sun)"));
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert!(!window.has("sun light 2  (sun)") && window.has("sun light 1  (sun)"));
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert!(!window.has("sun light 1  (sun)") && window.has("sphere light 1  (sphere)"));
    // The results are as good as they were: what is relit is no input of a run.
    assert!(!window.has("Outdated"));

    window.click("Before | after");
    assert!(window.has("Before and after"));
    window.click("All of it");
    window.key(egui::Modifiers::COMMAND, egui::Key::S);
    drop(window);
    let mut window = Window::at(folder.path(), Some(&folder.path().join("coarse.lobelia")));
    window.wait_for("Photographs (6)");
    window.key(NONE, egui::Key::F5);
    window.wait_for("sphere light 1  (sphere)");
    let text = std::fs::read_to_string(folder.path().join("coarse.lobelia")).unwrap();
    assert!(text.contains("\"original_light\": 0.0"), "{text}");
}

/// The paths a pixel of the picture that is shown, and how it came about.
fn shown(window: &Window) -> Option<(usize, String)> {
    let labels = window.labels("paths a pixel, ");
    let (paths, state) = labels.first()?.strip_prefix("In the 3D view: ")?.split_once(' ')?;
    Some((paths.parse().ok()?, state.trim_start_matches("paths a pixel, ").to_owned()))
}

/// Strengths are factors on layers that are there: the picture follows, and is as clear as before.
#[test]
fn a_strength_that_is_dragged_traces_no_path() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    window.menu("Add light", "Sphere");
    let is_clear = |window: &Window| shown(window).is_some_and(|(paths, _)| paths >= 4);
    window.wait("a clear picture", is_clear);
    let field = "Factor on all of the recovered light";
    // Down, up, and again: by more than what still is a click.
    for way in [-20.0, 20.0, -20.0] {
        let from = window.node(field).rect().center();
        window.harness.drag_at(from);
        window.harness.run_steps(1);
        for step in 1..4 {
            window.harness.hover_at(from + egui::vec2(way * step as f32, 0.0));
            window.wait("a picture without a path", |window| {
                let (paths, state) = shown(window).expect("there is a picture");
                assert!(paths >= 4, "it was traced anew");
                state == "recombined" || state == "done"
            });
        }
        window.harness.drop_at(from + egui::vec2(3.0 * way, 0.0));
        window.step();
    }
    // The same of turning a light off, and on again.
    for _ in 0..2 {
        window.click("sphere light 1 on");
        window.wait("a picture without a path", |window| {
            let (paths, state) = shown(window).expect("there is a picture");
            assert!(paths >= 4, "it was traced anew");
            state == "recombined" || state == "done"
        });
    }
}

#[test]
fn objects_come_from_files_and_bad_ones_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("thing.obj");
    std::fs::write(&file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 2 3\nf 1 2 4\n")
        .unwrap();
    let empty = folder.path().join("empty.obj");
    std::fs::write(&empty, "v 0 0 0\n").unwrap();
    let mut window = relit(folder.path());
    for (path, expected) in [(&empty, "This object cannot be added"), (&file, "thing  (object)")] {
        window.click("Add object…");
        window.write("Path", path.to_str().unwrap());
        window.click_front("Add");
        window.wait(expected, |window| window.has(expected));
    }
    assert!(window.has("Scale of the object"));
    assert!(window.has("red, diffuse reflectance, red"));
    window.click("Drop to surface");

    let edits = folder.path().join("edits.json");
    window.click("Save edits…");
    window.write("Path", edits.to_str().unwrap());
    window.click_front("Save");
    let text = std::fs::read_to_string(&edits).unwrap();
    assert!(text.contains("\"thing.obj\"") && text.contains("world_from_object"), "{text}");
    window.click("Load edits…");
    window.write("Path", edits.to_str().unwrap());
    window.click_front("Load");
    window.wait_for("thing 1  (object)");

    let pictures = folder.path().join("pictures");
    window.click("Render to files…");
    window.write("Folder", pictures.to_str().unwrap());
    window.click_front("Render");
    window.wait("the first picture file", |_| {
        std::fs::read_dir(&pictures).is_ok_and(|files| files.count() > 0)
    });
    window.click("Stop");
    window.wait_for("Rendering was stopped.");
    let half = std::fs::read_dir(&pictures).unwrap().filter(|file| {
        let name = file.as_ref().unwrap().file_name();
        !["exr", "png"].iter().any(|end| name.to_string_lossy().ends_with(end))
    });
    assert_eq!(half.count(), 0);
}

#[test]
fn a_light_is_seen_alone_and_the_others_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    window.menu("Add light", "Sphere");
    window.menu("Add light", "Point");
    window.click("point light 1 on");
    let is_on = |window: &Window, label: &str| {
        let toggled = window.node(label).accesskit_node().toggled();
        toggled == Some(egui::accesskit::Toggled::True)
    };
    let state = |window: &Window| {
        ["sphere light 1 on", "point light 1 on", "All of it"].map(|label| is_on(window, label))
    };
    assert_eq!(state(&window), [true, false, true]);
    window.click("Solo point light 1");
    assert_eq!(state(&window), [false, true, false]);
    window.click("Solo sphere light 1");
    assert_eq!(state(&window), [true, false, false]);
    window.click("Solo sphere light 1");
    assert_eq!(state(&window), [true, false, true], "as they were before the first");
    // Each of them was one step.
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert_eq!(state(&window), [true, false, false]);
    // The project remembers how it was before.
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert_eq!(state(&window), [true, false, true]);
    window.click("Solo point light 1");
    assert_eq!(state(&window), [false, true, false]);
    window.key(egui::Modifiers::COMMAND, egui::Key::S);
    window.wait("the results on the disk", |window| !window.harness.state().is_busy());
    drop(window);
    let mut window = Window::at(folder.path(), Some(&folder.path().join("coarse.lobelia")));
    window.wait_for("Photographs (6)");
    window.wait("the results", |window| !window.harness.state().is_busy());
    window.key(NONE, egui::Key::F5);
    assert_eq!(state(&window), [false, true, false]);
    window.click("Solo point light 1");
    assert_eq!(state(&window), [true, false, true], "as they were before it was closed");
}
