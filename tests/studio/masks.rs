//! Masks over photographs: strokes, undo, saving, a crash, a run, and suggestions.

use std::fs;
use std::path::Path;

use eframe::egui::{self, Key, Modifiers, PointerButton, Pos2};

use crate::nothing_lost::{json_of, save};
use crate::runs::coarse;
use crate::{Window, example};

const NONE: Modifiers = Modifiers::NONE;

/// A coarse project with the brush in the hand, over the first photograph.
fn painting(folder: &Path) -> Window {
    let file = coarse(folder, 60);
    let mut window = Window::at(&folder.join("home"), Some(&file));
    window.wait_for("Photographs (6)");
    window.wait("the view", |window| !window.harness.state().is_busy());
    window.key(Modifiers::SHIFT, Key::P);
    assert!(window.has_part("Hatched pixels"), "the panel is in front");
    window
}

/// A place in the 3D view, in parts of its size.
fn place(window: &Window, x: f32, y: f32) -> Pos2 {
    let rect = window.node("Viewport").rect();
    rect.min + egui::vec2(x * rect.width(), y * rect.height())
}

fn button(window: &mut Window, pos: Pos2, pressed: bool, modifiers: Modifiers) {
    let button = PointerButton::Primary;
    let event = egui::Event::PointerButton { pos, button, pressed, modifiers };
    window.harness.event_modifiers(event, modifiers);
    window.harness.run_steps(1);
}

/// Drags over the 3D view.
fn stroke(window: &mut Window, from: [f32; 2], to: [f32; 2], modifiers: Modifiers) {
    let (from, to) = (place(window, from[0], from[1]), place(window, to[0], to[1]));
    window.harness.hover_at(from);
    window.harness.run_steps(1);
    button(window, from, true, modifiers);
    for step in 1..=8 {
        let pos = from.lerp(to, step as f32 / 8.0);
        window.harness.event_modifiers(egui::Event::PointerMoved(pos), modifiers);
        window.harness.run_steps(1);
    }
    button(window, to, false, modifiers);
    window.step();
}

/// The parts of the photographs that the panel says are masked.
fn shares(window: &Window) -> Vec<f64> {
    let all = window.labels(" %");
    let number = |text: &String| text.strip_suffix(" %")?.parse().ok();
    all.iter().filter_map(number).collect()
}

fn masked(window: &Window) -> f64 {
    shares(window).into_iter().fold(0.0, f64::max)
}

#[test]
fn a_stroke_is_one_step_and_is_saved_kept_and_opened_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("coarse.lobelia");
    let mut window = painting(folder.path());
    assert_eq!(masked(&window), 0.0);
    stroke(&mut window, [0.4, 0.5], [0.6, 0.6], NONE);
    let first = masked(&window);
    assert!(first > 0.2 && first < 20.0, "{first}");
    assert!(window.has("this window"));
    // Larger, and in another direction.
    window.key(NONE, Key::CloseBracket);
    stroke(&mut window, [0.6, 0.4], [0.45, 0.7], NONE);
    let second = masked(&window);
    assert!(second > first + 0.1, "{second}");
    window.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(masked(&window), first);
    window.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(masked(&window), second);
    // Alt erases what both have left out, on the way there.
    stroke(&mut window, [0.4, 0.5], [0.6, 0.6], Modifiers::ALT);
    let third = masked(&window);
    assert!(third < second - 0.1, "{third}");
    window.harness.state_mut().autosave();
    let kept = folder.path().join("home/recovery/unsaved-0.lobelia");
    assert!(json_of(&kept)["masks"]["images/000.exr"]["runs"].is_string());
    save(&mut window);
    assert_eq!(json_of(&file)["masks"].as_object().unwrap().len(), 1);
    drop(window);
    let mut window = Window::at(&folder.path().join("home"), Some(&file));
    window.wait_for("Photographs (6)");
    window.key(Modifiers::SHIFT, Key::P);
    assert_eq!(masked(&window), third);
}

#[test]
fn a_stroke_is_given_up_and_tools_draw_boxes_outlines_and_surfaces() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = painting(folder.path());
    let (from, to) = (place(&window, 0.4, 0.5), place(&window, 0.6, 0.6));
    window.harness.hover_at(from);
    window.harness.run_steps(1);
    button(&mut window, from, true, NONE);
    window.harness.hover_at(to);
    window.harness.run_steps(1);
    window.key(NONE, Key::Escape);
    button(&mut window, to, false, NONE);
    window.step();
    assert_eq!(masked(&window), 0.0, "Esc gives the stroke up");
    window.click("Box");
    stroke(&mut window, [0.4, 0.4], [0.6, 0.6], NONE);
    let boxed = masked(&window);
    assert!(boxed > 1.0, "{boxed}");
    window.click("Clear");
    assert_eq!(masked(&window), 0.0);
    window.click("Surface");
    let middle = place(&window, 0.5, 0.75);
    for modifiers in [NONE, Modifiers::ALT] {
        window.harness.hover_at(middle);
        window.harness.run_steps(1);
        button(&mut window, middle, true, modifiers);
        button(&mut window, middle, false, modifiers);
        window.wait("the pixels of the surface", |window| {
            (masked(window) > 2.0) == (modifiers == NONE)
        });
    }
}

#[test]
fn a_run_takes_the_masks_that_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = painting(folder.path());
    let middle = place(&window, 0.5, 0.5);
    window.harness.hover_at(middle);
    for _ in 0..6 {
        window.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::M);
        window.key(NONE, Key::Tab);
    }
    // The rows that are in sight.
    let shares = shares(&window);
    assert!(shares.len() > 2 && shares.iter().all(|share| *share == 100.0), "{shares:?}");
    window.key(Modifiers::COMMAND, Key::R);
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    assert!(window.has_part("The reconstruction stopped"), "nothing is measured");
}

#[test]
fn a_stroke_that_is_taken_back_costs_the_next_run_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = painting(folder.path());
    window.key(Modifiers::COMMAND, Key::R);
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    window.key(NONE, Key::F3);
    window.key(Modifiers::SHIFT, Key::P);
    let keeps = |window: &Window| window.has_part("The next run keeps every stage");
    assert!(keeps(&window));
    stroke(&mut window, [0.4, 0.5], [0.6, 0.6], NONE);
    assert!(masked(&window) > 0.2 && !keeps(&window), "another mask is another input");
    window.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(masked(&window), 0.0);
    assert!(keeps(&window));
}

#[test]
fn suggested_masks_are_one_step() {
    let folder = tempfile::tempdir().unwrap();
    // A black square that the mesh does not have.
    let room = folder.path().join("room");
    fs::create_dir_all(room.join("images")).unwrap();
    for part in ["", "images"] {
        for entry in fs::read_dir(example().join(part)).unwrap().flatten() {
            if entry.path().is_file() {
                fs::copy(entry.path(), room.join(part).join(entry.file_name())).unwrap();
            }
        }
    }
    let first = room.join("images/000.exr");
    let image = lobelia::io::exr::read(&first).unwrap();
    let (width, height, mut pixels) = (image.width, image.height, image.pixels);
    for (y, x) in (0..height / 5).flat_map(|y| (0..height / 5).map(move |x| (y, x))) {
        pixels[(y + height / 2) * width + x + width / 2] = [0.0; 3];
    }
    lobelia::io::exr::write_rgb(&first, width, height, &pixels).unwrap();
    let mut window = Window::at(&folder.path().join("home"), Some(&room));
    window.wait_for("Photographs (6)");
    window.key(Modifiers::SHIFT, Key::P);
    window.click("Suggest masks");
    window.wait("the masks", |window| window.has("Suggest masks"));
    let found = masked(&window);
    assert!(found > 1.5 && found < 6.0, "{found}");
    window.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(masked(&window), 0.0);
}
