//! Planes and boxes from points that an engine found, drawn around in the window.

use eframe::egui::{Key, Modifiers, Pos2};
use egui_kittest::kittest::NodeT as _;
use glam::{DVec2, DVec3};
use lobelia::model::{Shape, Stroke, Support, Thing};

use crate::Window;
use crate::box_of_points::{SIZE, cameras, corners, points, told};
use crate::modelling::{capture, empty, saved, solved};

const NONE: Modifiers = Modifiers::NONE;
const SHIFT: Modifiers = Modifiers::SHIFT;

/// The window with the middle photograph, and a way around what lies on the box there.
fn window(folder: &std::path::Path) -> (Window, std::path::PathBuf, Vec<Pos2>) {
    let capture = capture(folder, &told(&points(120)));
    let mut window = Window::modelling(&folder.join("home"), &capture);
    window.wait_solved();
    window.press("Photograph images/2.exr");
    window.wait_solved();
    let way = around(&window, &corners());
    (window, capture, way)
}

/// A way around places of the scene.
fn around(window: &Window, places: &[DVec3]) -> Vec<Pos2> {
    let camera = &cameras()[2];
    let pixels: Vec<DVec2> = places.iter().map(|own| camera.project(*own).unwrap().0).collect();
    let middle = pixels.iter().sum::<DVec2>() / pixels.len() as f64;
    let far = |way: DVec2| pixels.iter().map(|own| (*own - middle).dot(way)).fold(0.0, f64::max);
    let around = (0..=40).map(|k| DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 41.0));
    around.map(|way| window.pixel(SIZE, middle + (1.05 * far(way) + 4.0) * way)).collect()
}

/// What was drawn, as it is saved.
fn drawn(capture: &std::path::Path) -> (Vec<Thing>, Vec<Stroke>) {
    let model = saved(capture);
    (model.things, model.strokes)
}

#[test]
fn a_box_and_a_plane_are_fitted_to_points_that_are_drawn_around() {
    let folder = tempfile::tempdir().unwrap();
    let (mut window, capture, way) = window(folder.path());
    let before = drawn(&capture);
    window.key(SHIFT, Key::L);
    assert!(window.has_part("Draw around points of one box"));
    window.drag(&way);
    window.wait_part("box1 is fitted to ");
    window.wait_solved();
    window.save_model();
    let model = saved(&capture);
    assert_eq!(model.things.len(), before.0.len() + 1);
    assert_eq!(
        (&model.things[0].shape, model.things[0].on),
        (&Shape::Box { flush: None }, Support::Floor)
    );
    assert!(window.has("box1 (box)"), "it is selected");
    let solution = solved(&model);
    for (own, truth) in solution.corners[0].iter().zip(corners()) {
        let far = corners().iter().map(|b| own.distance(*b)).fold(f64::INFINITY, f64::min);
        assert!(far < 0.02, "{own} {truth}");
    }
    // One step of undo.
    window.key(Modifiers::COMMAND, Key::Z);
    assert!(window.has("Undone: fit box1 to points"));
    window.save_model();
    assert_eq!(drawn(&capture), before);
    // By the button; Escape gives an outline up, and so does a click.
    window.wait_solved();
    window.press("Plane from points");
    window.to(way[0]);
    window.button(way[0], true);
    window.to(way[10]);
    window.to(way[20]);
    window.key(NONE, Key::Escape);
    window.button(way[20], false);
    window.step();
    window.drag(&way[..1]);
    window.step();
    assert!(
        !window.harness.state().is_busy() && window.has_part("Draw around points of one plane")
    );
    window.save_model();
    assert_eq!(drawn(&capture), before);
    let way = around(&window, &corners()[4..]);
    window.drag(&way);
    window.wait_part("polygon1 is fitted to ");
    window.wait_solved();
    window.save_model();
    assert_eq!(saved(&capture).things[0].shape, Shape::Polygon { corners: 4 });
}

/// An outline around nothing is answered with what to do; nothing changes.
#[test]
fn an_outline_without_points_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (mut window, capture, way) = window(folder.path());
    let before = drawn(&capture);
    window.key(NONE, Key::L);
    let corner = window.pixel(SIZE, DVec2::splat(20.0));
    let shift = corner - way[0];
    let away: Vec<Pos2> = way.iter().map(|own| way[0] + 0.05 * (*own - way[0]) + shift).collect();
    window.drag(&away);
    window.wait_part("Nothing was fitted");
    assert!(window.has_part("the outline holds 0 points, and 12 are needed"));
    window.save_model();
    assert_eq!(drawn(&capture), before);
}

/// Without points the tools say where points come from.
#[test]
fn without_points_there_is_nothing_to_draw_around() {
    let folder = tempfile::tempdir().unwrap();
    let capture = empty(folder.path());
    let mut window = Window::modelling(&folder.path().join("home"), &capture);
    assert!(!window.has("Plane from points"));
    window.key(NONE, Key::L);
    assert!(window.has_part("There are no points"));
    assert!(!window.has_part("Draw around points"));
    assert!(!window.node("Line along x").accesskit_node().is_disabled());
}
