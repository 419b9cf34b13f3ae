//! *Fit to edges* on the Model page: the button, the key, undo, and what is refused.

use std::fs;

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::NodeT as _;

use crate::Window;
use crate::displaced::{THING, apart_px, capture, models};
use crate::modelling::{row, saved};

const NONE: Modifiers = Modifiers::NONE;
const FIT: &str = "Fit to edges";

#[test]
fn a_thing_is_fitted_by_the_button_or_the_key_and_undone() {
    let [drawn, displaced] = models();
    let folder = tempfile::tempdir().unwrap();
    let capture = capture(folder.path(), &displaced);
    let before = apart_px(&displaced, &drawn);
    assert!(before > 2.5, "{before} px");
    let mut window = Window::modelling(&folder.path().join("home"), &capture);
    window.wait_usable();
    // The key needs a thing; the button stands below the sketch of one.
    assert!(!window.has(FIT));
    window.key(NONE, Key::E);
    assert!(window.has("Select a thing first."));
    row(&mut window, THING);
    window.key(NONE, Key::V);
    window.click(FIT);
    window.wait_part(&format!("{THING} is fitted to edges: "));
    window.save_model();
    let by_button = saved(&capture);
    let after = apart_px(&by_button, &drawn);
    assert!(after < 0.8, "{before} px before, {after} px after");
    window.wait_usable();
    // One step of undo, that comes back as it was.
    window.key(Modifiers::COMMAND, Key::Z);
    assert!(window.has(&format!("Undone: fit {THING} to edges")));
    window.save_model();
    assert!(apart_px(&saved(&capture), &displaced) < 1e-9);
    window.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    window.save_model();
    assert!(apart_px(&saved(&capture), &by_button) < 1e-9);
    window.key(Modifiers::COMMAND, Key::Z);
    window.wait_usable();
    // The key does what the button does, to the last digit; meanwhile the button is out of use.
    window.harness.key_press_modifiers(NONE, Key::E);
    window.harness.run_steps(1);
    assert!(window.harness.state().is_busy());
    window.wait("the fit", |window| {
        window.has_part(&format!("{THING} is fitted to edges: "))
            && !window.harness.state().is_busy()
    });
    assert!(!window.node(FIT).accesskit_node().is_disabled());
    window.save_model();
    assert!(apart_px(&saved(&capture), &by_button) < 1e-9);
}

/// Photographs without any line: a message says so, and nothing is moved.
#[test]
fn without_lines_nothing_is_moved() {
    let [_, displaced] = models();
    let folder = tempfile::tempdir().unwrap();
    let capture = capture(folder.path(), &displaced);
    for photograph in &displaced.photographs {
        let (width, height) = photograph.size;
        let grey = vec![[0.4; 3]; width * height];
        lobelia::io::exr::write_rgb(&capture.join(&photograph.name), width, height, &grey).unwrap();
    }
    let file = capture.join("model.json");
    let before = fs::read(&file).unwrap();
    let mut window = Window::modelling(&folder.path().join("home"), &capture);
    window.wait_usable();
    row(&mut window, THING);
    window.key(NONE, Key::V);
    window.click(FIT);
    window.wait_part("Nothing was moved");
    assert!(window.has_part(&format!("no lines of the photographs lie near {THING}")));
    window.save_model();
    assert_eq!(fs::read(&file).unwrap(), before);
}
