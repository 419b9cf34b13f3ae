//! Charts over photographs: four clicks, a drag, undo, saving and opening again.

use std::path::Path;

use eframe::egui::{self, Key, Modifiers, PointerButton, Pos2};
use serde_json::json;

use crate::Window;
use crate::drawn_chart;
use crate::nothing_lost::{json_of, save};
use crate::runs::coarse;

const NONE: Modifiers = Modifiers::NONE;
/// On the floor, in parts of the 3D view.
const CORNERS: [[f32; 2]; 4] = [[0.29, 0.86], [0.36, 0.85], [0.37, 0.93], [0.29, 0.94]];

/// A coarse project with a new grey card, whose corners are to be clicked in the first photograph.
fn with_a_card(folder: &Path) -> Window {
    let file = coarse(folder, 60);
    let mut window = Window::at(&folder.join("home"), Some(&file));
    window.wait_for("Photographs (6)");
    window.wait("the view", |window| !window.harness.state().is_busy());
    window.click("Charts");
    window.click("Add chart");
    window.click("Grey card");
    window.wait_for("It pins nothing yet: its corners are in no photograph.");
    assert!(window.has_part("Click corner 1 of 4"), "the tool is in the hand");
    window
}

fn place(window: &Window, [x, y]: [f32; 2]) -> Pos2 {
    let rect = window.node("Viewport").rect();
    rect.min + egui::vec2(x * rect.width(), y * rect.height())
}

fn button(window: &mut Window, pos: Pos2, pressed: bool) {
    let button = PointerButton::Primary;
    let event = egui::Event::PointerButton { pos, button, pressed, modifiers: NONE };
    window.harness.event(event);
    window.harness.run_steps(1);
}

fn click(window: &mut Window, at: [f32; 2]) {
    let at = place(window, at);
    window.harness.hover_at(at);
    window.harness.run_steps(1);
    button(window, at, true);
    button(window, at, false);
    window.step();
}

fn click_all(window: &mut Window) {
    for corner in CORNERS {
        click(window, corner);
    }
    let is_known = |window: &Window| window.has_part("its middle is at");
    window.wait("its position", |window| is_known(window) || window.has_part("It pins nothing: "));
    assert!(is_known(window), "{:?}", window.labels("It pins nothing: "));
}

/// What the panel says of where the card is.
fn middle(window: &Window) -> String {
    window.labels("known reflectance; its middle is at").remove(0)
}

#[test]
fn four_clicks_pin_a_card_that_is_undone_saved_and_opened_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("coarse.lobelia");
    let mut window = with_a_card(folder.path());
    click_all(&mut window);
    let first = middle(&window);
    assert!(window.has("1 photograph") || window.has_part("grey card, 1 photograph"));
    window.wait("its radiance", |window| window.has_part("Radiance "));
    // A corner that is dragged is a step of its own.
    let (from, to) = (place(&window, CORNERS[0]), place(&window, [0.27, 0.85]));
    window.harness.hover_at(from);
    window.harness.run_steps(1);
    button(&mut window, from, true);
    window.harness.hover_at(to);
    window.harness.run_steps(1);
    button(&mut window, to, false);
    window.wait("its new position", |window| {
        window.has_part("its middle is at") && middle(window) != first
    });
    let second = middle(&window);
    window.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(middle(&window), first);
    window.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(middle(&window), second);
    // It is a material like others.
    window.click("Tags");
    assert!(window.has_part("card"), "the card is in the list of materials");
    save(&mut window);
    let stored = json_of(&file);
    let charts = stored["charts"].as_array().unwrap();
    assert_eq!((charts.len(), &charts[0]["kind"]), (1, &"grey".into()));
    assert_eq!(charts[0]["views"][0]["file_path"], "images/000.exr");
    let names: Vec<&str> = stored["materials"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|own| own["name"].as_str())
        .collect();
    assert_eq!(names.last(), Some(&"card"));
    drop(window);
    let mut window = Window::at(&folder.path().join("home"), Some(&file));
    window.wait_for("Photographs (6)");
    window.click("Charts");
    window.click("card  (grey card, 1 photograph)");
    assert_eq!(middle(&window), second);
    window.click("Remove chart");
    window.wait("no chart", |window| !window.has_part("its middle is at"));
    save(&mut window);
    let stored = json_of(&file);
    assert!(stored["charts"].is_null(), "as the capture's own files: {}", stored["charts"]);
    assert!(!stored["materials"].as_array().unwrap().iter().any(|own| own["name"] == "card"));
}

#[test]
fn clicks_are_taken_back_and_a_card_that_cannot_be_used_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = with_a_card(folder.path());
    click(&mut window, CORNERS[0]);
    click(&mut window, CORNERS[1]);
    assert!(window.has_part("Click corner 3 of 4"));
    window.key(NONE, Key::Backspace);
    assert!(window.has_part("Click corner 2 of 4"));
    window.key(NONE, Key::Escape);
    assert!(window.has_part("Click corner 1 of 4"));
    // Two sides that cross.
    for corner in [0, 2, 1, 3] {
        click(&mut window, CORNERS[corner]);
    }
    window.wait("why not", |window| window.has_part("It pins nothing: images/000.exr: "));
    window.click("Remove images/000.exr");
    window.wait_for("It pins nothing yet: its corners are in no photograph.");
    click_all(&mut window);
}

#[test]
fn photographs_are_read_by_the_matrix_of_a_chart_and_without_it_again() {
    let folder = tempfile::tempdir().unwrap();
    drawn_chart::capture(folder.path(), &drawn_chart::chart(|_, _, own| own));
    let corners = json!([[20, 24], [128, 24], [128, 96], [20, 96]]);
    let view = json!({"file_path": "images/a.exr", "corners": corners});
    let tags = json!({
        "materials": [{"name": "floor", "surfaces": ["floor"]}],
        "charts": [{"name": "chart", "kind": "colorchecker", "views": [view]}],
    });
    let file = folder.path().join("tags.json");
    std::fs::write(&file, tags.to_string()).unwrap();
    let home = folder.path().join("home");
    let mut window = Window::at(&home, Some(folder.path()));
    window.wait_for("Photographs (1)");
    window.click("Charts");
    window.click("chart  (ColorChecker, 1 photograph)");
    window.wait("its colours", |window| window.has_part("with a matrix"));
    // How far the patches are from their table, the colour of the light apart.
    let with_gains = |window: &Window| -> f64 {
        let text = window.labels("ΔE00 ").remove(0);
        let before = text.split_once(" with a gain").unwrap().0;
        before.rsplit(' ').next().unwrap().parse().unwrap()
    };
    let before = with_gains(&window);
    assert!(before > 2.0, "{before}");
    // A tag that was changed stays.
    window.click("Tags");
    window.click("floor");
    window.click("Specular");
    window.click("Charts");
    window.click("Use the colour matrix of images/a.exr");
    window.wait_for("Photographs are read by a colour matrix.");
    assert_eq!(json_of(&file)["color_matrix"].as_array().unwrap().len(), 3);
    assert_eq!(json_of(&file)["charts"], tags["charts"], "the rest is as it was");
    window.click("chart  (ColorChecker, 1 photograph)");
    window.wait("its colours", |window| window.has_part("with a matrix"));
    let after = with_gains(&window);
    assert!(after < 0.1 * before, "{after} after {before}");
    window.click("Remove matrix");
    let is_read = |window: &Window| !window.has("Photographs are read by a colour matrix.");
    window.wait("the files' own colours", |window| is_read(window));
    assert_eq!(json_of(&file), tags);
    window.key(Modifiers::COMMAND, Key::Z);
    assert!(window.has_part("Undone"), "the step before is still there");
}
