//! Every movement of the hand is one step of undo, and one that is given up is none.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use eframe::egui;
use serde_json::json;

use crate::Window;
use crate::nothing_lost::{json_of, open, point, relit_project, save};

const NONE: egui::Modifiers = egui::Modifiers::NONE;
const UNDO: (egui::Modifiers, egui::Key) = (egui::Modifiers::COMMAND, egui::Key::Z);
const REDO: (egui::Modifiers, egui::Key) =
    (egui::Modifiers::COMMAND.plus(egui::Modifiers::SHIFT), egui::Key::Z);

/// A project with one light at x = 1, which is selected, and the cursor over the 3D view.
fn lamp(folder: &Path) -> (Window, PathBuf) {
    let file = relit_project(folder, &json!({"lights": [point("lamp", 1.0)]}));
    let mut window = open(folder, &file);
    window.key(NONE, egui::Key::F5);
    window.click("lamp  (point)");
    hover(&mut window, 0.0);
    (window, file)
}

fn hover(window: &mut Window, aside: f32) {
    let middle = window.node("Viewport").rect().center();
    window.harness.hover_at(middle + egui::vec2(aside, 0.0));
    window.step();
}

/// Where the light is, as it is saved.
fn x(window: &mut Window, file: &Path) -> f64 {
    save(window);
    json_of(file)["relight"]["lights"][0]["position"][0].as_f64().unwrap()
}

fn press(window: &mut Window, (modifiers, key): (egui::Modifiers, egui::Key)) {
    window.key(modifiers, key);
}

/// Moves it by typing.
fn move_by(window: &mut Window, metres: &str) {
    window.key(NONE, egui::Key::G);
    window.harness.event(egui::Event::Text(metres.to_owned()));
    window.step();
    window.key(NONE, egui::Key::Enter);
}

/// Longer than any clock takes for one movement.
fn rest(window: &mut Window) {
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(1) {
        window.harness.run_steps(1);
    }
}

fn button(window: &mut Window, pos: egui::Pos2, pressed: bool) {
    let button = egui::PointerButton::Primary;
    window.harness.event(egui::Event::PointerButton { pos, button, pressed, modifiers: NONE });
    window.step();
}

/// Drags the field of the light's place along, with a rest between; where the pointer ends.
fn drag_slowly(window: &mut Window) -> egui::Pos2 {
    let start = window.node("Position, x").rect().center();
    window.harness.hover_at(start);
    window.step();
    button(window, start, true);
    for step in 1..=3 {
        window.harness.hover_at(start + egui::vec2(12.0 * step as f32, 0.0));
        window.step();
        if step < 3 {
            rest(window);
        }
    }
    start + egui::vec2(36.0, 0.0)
}

#[test]
fn two_quick_moves_are_two_steps() {
    let folder = tempfile::tempdir().unwrap();
    let (mut window, file) = lamp(folder.path());
    move_by(&mut window, ".1");
    move_by(&mut window, ".1");
    assert_eq!(x(&mut window, &file), 1.2);
    press(&mut window, UNDO);
    assert_eq!(x(&mut window, &file), 1.1);
    press(&mut window, UNDO);
    assert_eq!(x(&mut window, &file), 1.0);
    press(&mut window, REDO);
    press(&mut window, REDO);
    assert_eq!(x(&mut window, &file), 1.2);
}

#[test]
fn one_slow_drag_is_one_step() {
    let folder = tempfile::tempdir().unwrap();
    let (mut window, file) = lamp(folder.path());
    let end = drag_slowly(&mut window);
    button(&mut window, end, false);
    let moved = x(&mut window, &file);
    assert!(moved > 1.1, "{moved}");
    press(&mut window, UNDO);
    assert_eq!(x(&mut window, &file), 1.0);
    press(&mut window, REDO);
    assert_eq!(x(&mut window, &file), moved);
}

#[test]
fn escape_in_a_drag_leaves_no_step_and_keeps_redo() {
    let folder = tempfile::tempdir().unwrap();
    let (mut window, file) = lamp(folder.path());
    move_by(&mut window, ".1");
    press(&mut window, UNDO);
    let end = drag_slowly(&mut window);
    window.key(NONE, egui::Key::Escape);
    button(&mut window, end, false);
    assert_eq!(x(&mut window, &file), 1.0, "as before the drag");
    press(&mut window, REDO);
    assert_eq!(x(&mut window, &file), 1.1, "redo is still there");
    press(&mut window, UNDO);
    assert_eq!(x(&mut window, &file), 1.0, "no step of the drag");

    // The same in the 3D view.
    hover(&mut window, 0.0);
    window.key(NONE, egui::Key::G);
    hover(&mut window, 60.0);
    window.key(NONE, egui::Key::Escape);
    assert_eq!(x(&mut window, &file), 1.0);
    press(&mut window, REDO);
    assert_eq!(x(&mut window, &file), 1.1);
}

#[test]
fn a_cancelled_move_does_not_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let (mut window, file) = lamp(folder.path());
    move_by(&mut window, ".1");
    window.key(NONE, egui::Key::G);
    hover(&mut window, 60.0);
    rest(&mut window);
    window.key(NONE, egui::Key::Escape);
    assert_eq!(x(&mut window, &file), 1.1);
    press(&mut window, UNDO);
    assert_eq!(x(&mut window, &file), 1.0);
}

#[test]
fn a_number_is_typed_in_one_step() {
    let folder = tempfile::tempdir().unwrap();
    let (mut window, file) = lamp(folder.path());
    window.click("Position, x");
    window.click("Position, x");
    for text in ["2", ".", "5"] {
        window.harness.event(egui::Event::Text(text.to_owned()));
        rest(&mut window);
    }
    window.key(NONE, egui::Key::Enter);
    assert_eq!(x(&mut window, &file), 2.5);
    press(&mut window, UNDO);
    assert_eq!(x(&mut window, &file), 1.0);
}

#[test]
fn undo_waits_for_a_move_to_end() {
    let folder = tempfile::tempdir().unwrap();
    let (mut window, file) = lamp(folder.path());
    move_by(&mut window, ".1");
    window.key(NONE, egui::Key::G);
    hover(&mut window, 40.0);
    press(&mut window, UNDO);
    window.key(NONE, egui::Key::Escape);
    assert_eq!(x(&mut window, &file), 1.1, "the move before is kept");
}

#[test]
fn a_slow_click_is_a_click() {
    let mut window = Window::new();
    window.step();
    let place = window.node("Open example").rect().center();
    window.harness.hover_at(place);
    window.harness.run_steps(1);
    for pressed in [true, false] {
        let (button, modifiers) = (egui::PointerButton::Primary, NONE);
        let event = egui::Event::PointerButton { pos: place, button, pressed, modifiers };
        window.harness.event(event);
        // Two seconds of the window's own time.
        window.harness.run_steps(60);
    }
    window.wait_for("Photographs (6)");
}
