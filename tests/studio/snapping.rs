//! Corners that come to lie where two lines of the photograph cross.

use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2};
use glam::DVec2;
use lobelia::io::exr;
use lobelia::model::{Model, Stroke};

use crate::Window;
use crate::modelling::{SIZE, empty, saved};

const NONE: Modifiers = Modifiers::NONE;
/// The corners of a bright sheet in the photograph.
const LOW: DVec2 = DVec2::new(180.0, 140.0);
const HIGH: DVec2 = DVec2::new(450.0, 330.0);

/// A window with a photograph of the sheet, its lines found.
fn window(folder: &std::path::Path) -> (Window, std::path::PathBuf) {
    let capture = empty(folder);
    let pixel = |index: usize| {
        let place = DVec2::new((index % SIZE.0) as f64, (index / SIZE.0) as f64) + 0.5;
        let is_sheet = place.cmpgt(LOW).all() && place.cmplt(HIGH).all();
        [if is_sheet { 0.75 } else { 0.15 }; 3]
    };
    let pixels: Vec<[f32; 3]> = (0..SIZE.0 * SIZE.1).map(pixel).collect();
    exr::write_rgb(&capture.join("images/001.exr"), SIZE.0, SIZE.1, &pixels).unwrap();
    let mut window = Window::modelling(&folder.join("home"), &capture);
    window.wait_solved();
    (window, capture)
}

/// Where corners are shown, in their order.
fn shown(model: &Model) -> Vec<DVec2> {
    let pick = |stroke: &Stroke| match stroke {
        Stroke::Pick { pixel, .. } => *pixel,
        other => panic!("{other:?}"),
    };
    model.strokes.iter().map(pick).collect()
}

#[track_caller]
fn is_at(own: DVec2, place: DVec2, within: f64) {
    assert!(own.distance(place) < within, "{own} instead of {place}");
}

/// Presses, moves and releases with keys held.
fn drag_with(window: &mut Window, places: &[Pos2], modifiers: Modifiers) {
    let mut event = |event: Event| {
        window.harness.event_modifiers(event, modifiers);
        window.harness.run_steps(1);
    };
    let press = |pos: Pos2, pressed: bool| Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers,
    };
    event(Event::PointerMoved(places[0]));
    event(press(places[0], true));
    for place in &places[1..] {
        event(Event::PointerMoved(*place));
    }
    event(press(places[places.len() - 1], false));
}

#[test]
fn a_corner_comes_to_lie_where_two_lines_cross() {
    let folder = tempfile::tempdir().unwrap();
    let (mut window, capture) = window(folder.path());
    window.key(NONE, Key::G);
    let corners = [LOW, DVec2::new(HIGH.x, LOW.y), HIGH, DVec2::new(LOW.x, HIGH.y)];
    let beside = [DVec2::new(4.0, -3.0), DVec2::new(-5.0, 2.0), DVec2::new(-3.0, -4.0)];
    let at = |window: &Window, pixel: DVec2| window.pixel(SIZE, pixel);
    // A click beside the crossing.
    let place = at(&window, corners[0] + beside[0]);
    window.drag(&[place]);
    // With Ctrl it stays as the hand does it, and so it does with S.
    let place = at(&window, corners[1] + beside[1]);
    drag_with(&mut window, &[place], Modifiers::COMMAND);
    window.key(NONE, Key::S);
    assert!(window.has("Lines and corners do not snap to edges of the photograph"));
    let place = at(&window, corners[2] + beside[2]);
    window.drag(&[place]);
    window.key(NONE, Key::S);
    // Far from all crossings: an edge alone is none.
    let middle = DVec2::new(LOW.x, 0.5 * (LOW.y + HIGH.y));
    let place = at(&window, middle + DVec2::X);
    window.drag(&[place]);
    window.save_model();
    let own = shown(&saved(&capture));
    is_at(own[0], corners[0], 0.2);
    is_at(own[1], corners[1] + beside[1], 0.01);
    is_at(own[2], corners[2] + beside[2], 0.01);
    is_at(own[3], middle + DVec2::X, 0.01);

    // What is there is only selected by a click, though a crossing is near.
    window.key(NONE, Key::V);
    let place = at(&window, corners[1] + beside[1] + DVec2::new(1.0, 1.0));
    window.drag(&[place]);
    window.save_model();
    is_at(shown(&saved(&capture))[1], corners[1] + beside[1], 0.01);
    // Dragged, it comes to lie on the crossing wherever it was taken hold of; with Ctrl not.
    let grip = DVec2::new(2.0, 1.0);
    let from = at(&window, corners[2] + beside[2] + grip);
    let to = at(&window, corners[2] + DVec2::new(2.0, 3.0) + grip);
    window.drag(&[from, from.lerp(to, 0.5), to]);
    window.save_model();
    is_at(shown(&saved(&capture))[2], corners[2], 0.2);
    window.key(Modifiers::COMMAND, Key::Z);
    assert!(window.has("Undone: move point"));
    drag_with(&mut window, &[from, from.lerp(to, 0.5), to], Modifiers::COMMAND);
    window.save_model();
    is_at(shown(&saved(&capture))[2], corners[2] + DVec2::new(2.0, 3.0), 0.01);
}

/// Where a frame takes long, a button is pressed and let go of within one: no click is lost.
#[test]
fn a_click_within_one_frame_shows_a_corner() {
    let folder = tempfile::tempdir().unwrap();
    let (mut window, capture) = window(folder.path());
    window.key(NONE, Key::G);
    let corners = [DVec2::new(60.0, 300.0), DVec2::new(520.0, 60.0)];
    for corner in corners {
        let pos = window.pixel(SIZE, corner);
        window.to(pos);
        let (button, modifiers) = (PointerButton::Primary, NONE);
        let event = |pressed| Event::PointerButton { pos, button, pressed, modifiers };
        window.harness.input_mut().events.extend([true, false].map(event));
        window.harness.run_steps(1);
    }
    window.step();
    window.save_model();
    let own = shown(&saved(&capture));
    assert_eq!(own.len(), 2);
    is_at(own[0], corners[0], 0.01);
    is_at(own[1], corners[1], 0.01);
}
