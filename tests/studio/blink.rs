//! The model's faces over the photograph, while a key is held or switched on.

use eframe::egui::{self, Key, Modifiers, Pos2};
use glam::DVec2;

use crate::Window;
use crate::displaced::models;
use crate::edges::opened;
use crate::modelling::{row, solved};

const NONE: Modifiers = Modifiers::NONE;
const SIZE: (usize, usize) = (320, 240);

/// The colour of the window at a place.
fn color(window: &mut Window, place: Pos2) -> [u8; 3] {
    let picture = window.harness.render().unwrap();
    let [r, g, b, _] = picture.get_pixel(place.x as u32, place.y as u32).0;
    [r, g, b]
}

/// Presses the key, or lets go of it.
fn held(window: &mut Window, is_held: bool) {
    let event = egui::Event::Key {
        key: Key::W,
        physical_key: None,
        pressed: is_held,
        repeat: false,
        modifiers: NONE,
    };
    window.harness.event(event);
    window.harness.run_steps(2);
}

#[test]
fn faces_are_seen_while_a_key_is_held_or_switched_on() {
    let [model, _] = models();
    let folder = tempfile::tempdir().unwrap();
    let (_, mut window) = opened(folder.path(), &model);
    // In the middle of the top of a box, away from edges and strokes.
    let solution = solved(&model);
    let thing = crate::displaced::thing(&model);
    let top = &solution.corners[thing][4..];
    let middle = top.iter().sum::<glam::DVec3>() / 4.0;
    let pixel: DVec2 = solution.cameras[0].unwrap().project(middle).unwrap().0;
    let place = window.pixel(SIZE, pixel);
    let photograph = color(&mut window, place);
    held(&mut window, true);
    window.wait("the faces", |window| !window.harness.state().is_busy());
    let faces = color(&mut window, place);
    assert_ne!(faces, photograph);
    held(&mut window, false);
    assert_eq!(color(&mut window, place), photograph, "the key is let go of");
    // The same by the button; the key then shows the photograph.
    window.press("Faces");
    window.wait("the faces", |window| !window.harness.state().is_busy());
    assert_eq!(color(&mut window, place), faces);
    held(&mut window, true);
    assert_eq!(color(&mut window, place), photograph);
    held(&mut window, false);
    assert_eq!(color(&mut window, place), faces);
    // What is typed into a field is no key of the page.
    window.press("Faces");
    row(&mut window, "box1");
    window.node("Name").focus();
    window.step();
    held(&mut window, true);
    let typing = color(&mut window, place);
    held(&mut window, false);
    assert_eq!(typing, color(&mut window, place));
}
