//! *Fit to edges* on the Model page: the button, the key, undo, and what is refused.

use std::fs;
use std::path::{Path, PathBuf};

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::NodeT as _;

use glam::DVec2;
use lobelia::model::{Model, Place, Stroke};

use crate::Window;
use crate::displaced::{THING, apart_px, capture, models, thing};
use crate::modelling::{row, saved};

const NONE: Modifiers = Modifiers::NONE;
const FIT: &str = "Fit to edges";

/// A capture of the example's photographs with a model, and the window with it, solved.
pub fn opened(folder: &Path, model: &Model) -> (PathBuf, Window) {
    let capture = capture(folder, model);
    let mut window = Window::modelling(&folder.join("home"), &capture);
    window.wait_usable();
    (capture, window)
}

/// Drags a corner of the thing in the first photograph, and returns the thing's index.
fn drag_a_corner(window: &mut Window, drawn: &Model) -> usize {
    let own = thing(drawn);
    let at = Place::Corner { thing: own, corner: 4 };
    let Stroke::Pick { pixel, .. } = drawn.strokes[drawn.pick_of(0, at).unwrap()] else { panic!() };
    let size = drawn.photographs[0].size;
    window.key(NONE, Key::V);
    let way = [DVec2::ZERO, DVec2::new(3.0, 1.0)].map(|by| window.pixel(size, pixel + by));
    window.drag(&way);
    own
}

#[test]
fn a_thing_is_fitted_by_the_button_or_the_key_and_undone() {
    let [drawn, displaced] = models();
    let folder = tempfile::tempdir().unwrap();
    let before = apart_px(&displaced, &drawn);
    assert!(before > 2.5, "{before} px");
    let (capture, mut window) = opened(folder.path(), &displaced);
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

/// All edges are found at once, the strokes stay, and one step of undo takes the edges away. Dragging a
/// corner of a thing forgets those of the thing.
#[test]
fn the_edges_of_all_things_are_found_removed_and_forgotten() {
    let [drawn, _] = models();
    let folder = tempfile::tempdir().unwrap();
    let (capture, mut window) = opened(folder.path(), &drawn);
    window.key(Modifiers::SHIFT, Key::E);
    window.wait_part(" edges were found in 6 photographs.");
    window.save_model();
    let found = saved(&capture);
    let count = found.strokes.len() - drawn.strokes.len();
    assert!(count > 80 && found.drawn() == drawn.strokes.len(), "{count} found");
    window.wait_usable();
    assert!(window.has(&format!("{count} found edges")));
    window.key(Modifiers::COMMAND, Key::Z);
    assert!(window.has("Undone: fit all to edges"));
    window.wait_usable();
    // The button does what the key does.
    window.click("Fit all to edges");
    window.wait("the fit", |window| {
        window.has(&format!("{count} found edges")) && !window.harness.state().is_busy()
    });
    window.save_model();
    assert!(saved(&capture).strokes == found.strokes);
    // A corner is dragged: what held its thing where it was is gone.
    let own = drag_a_corner(&mut window, &drawn);
    window.wait_usable();
    window.save_model();
    let is_own = |place: &Place| matches!(place, Place::Corner { thing, .. } if *thing == own);
    let is_about = |stroke: &&Stroke| stroke.is_found() && stroke.places().iter().any(is_own);
    let dragged = saved(&capture);
    assert!(dragged.strokes.iter().find(is_about).is_none());
    let left = dragged.strokes.iter().filter(|stroke| stroke.is_found()).count();
    assert_eq!(left, count - found.strokes.iter().filter(is_about).count());
    window.click("Remove found edges");
    window.wait_usable();
    assert!(!window.has(&format!("{count} found edges")) && !window.has("Remove found edges"));
    window.save_model();
    assert_eq!(saved(&capture).strokes.len(), drawn.strokes.len());
}

/// The button and any change of the model stop a search; nothing is moved then.
#[test]
fn a_search_for_edges_is_stopped_by_hand_and_by_a_change_of_the_model() {
    let [drawn, _] = models();
    let folder = tempfile::tempdir().unwrap();
    let (capture, mut window) = opened(folder.path(), &drawn);
    let begin = |window: &mut Window| {
        window.harness.key_press_modifiers(Modifiers::SHIFT, Key::E);
        window.harness.run_steps(2);
    };
    begin(&mut window);
    window.click("Cancel the fit");
    window.wait_part("The fit was cancelled: nothing was moved.");
    window.wait_usable();
    window.save_model();
    assert!(saved(&capture).strokes == drawn.strokes);
    begin(&mut window);
    drag_a_corner(&mut window, &drawn);
    window.wait_part("The model has changed meanwhile: nothing was moved.");
    window.wait_usable();
    window.save_model();
    let dragged = saved(&capture);
    assert!(dragged.strokes.iter().all(|stroke| !stroke.is_found()));
    assert!(dragged.strokes != drawn.strokes);
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
    window.key(Modifiers::SHIFT, Key::E);
    window.wait_part("no line of a photograph is an edge of a thing");
    window.save_model();
    assert_eq!(fs::read(&file).unwrap(), before);
}
