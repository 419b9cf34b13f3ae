//! Mouse and keys in the viewport.

use eframe::egui;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use lobelia::app::viewport::{ViewCamera, ViewportEvent};

use crate::viewport::{SIZE, Window, bare, keep, picture, surface, window};

#[test]
fn clicks_pick_what_is_drawn_there() {
    let mut window = window(bare());
    let top = ViewCamera {
        target: glam::Vec3::new(1.75, 1.65, 0.0),
        distance: 8.0,
        azimuth: -std::f32::consts::FRAC_PI_2,
        elevation: std::f32::consts::FRAC_PI_2,
        orthographic: true,
    };
    window.state_mut().viewport.set_camera(top);
    window.state_mut().viewport.settings.cameras = false;
    picture(&mut window);
    // Orthographic from above: 8 m × 2 × 0.364 fill the height.
    let metre = SIZE[1] / (8.0 * 0.728);
    let at = |x: f32, y: f32| {
        egui::pos2(0.5 * SIZE[0] + (x - 1.75) * metre, 0.5 * SIZE[1] - (y - 1.65) * metre)
    };
    let click = |window: &mut Window, place: egui::Pos2, modifiers: egui::Modifiers| {
        window.hover_at(place);
        window.run_steps(1);
        for pressed in [true, false] {
            let button = egui::PointerButton::Primary;
            let event = egui::Event::PointerButton { pos: place, button, pressed, modifiers };
            window.event_modifiers(event, modifiers);
            window.run_steps(1);
        }
        std::mem::take(&mut window.state_mut().events)
    };
    let on_floor = at(2.3, 0.4);
    let floor = Some(surface("floor"));
    assert_eq!(
        click(&mut window, on_floor, egui::Modifiers::NONE),
        [ViewportEvent::PickSurface { surface: floor, add: false }]
    );
    assert_eq!(
        click(&mut window, on_floor, egui::Modifiers::SHIFT),
        [ViewportEvent::PickSurface { surface: floor, add: true }]
    );
    let hovered = window.state().viewport.hovered().cloned().expect("a surface");
    assert_eq!(hovered.surface, surface("floor"));
    let away = (hovered.position - glam::Vec3::new(2.3, 0.4, 0.0)).length();
    assert!(away < 0.02, "{}", hovered.position);
    let (radiance, photograph) = hovered.radiance.expect("a photograph sees the floor");
    assert!(radiance.iter().all(|v| v.is_finite()) && photograph < 6);
    assert_eq!(
        click(&mut window, egui::pos2(20.0, 400.0), egui::Modifiers::NONE),
        [ViewportEvent::PickSurface { surface: None, add: false }]
    );

    window.key_press(egui::Key::B);
    window.run_steps(1);
    window.drag_at(at(0.3, 1.0));
    window.run_steps(1);
    window.hover_at(at(1.2, 1.9));
    window.run_steps(1);
    keep(&picture(&mut window), "box");
    window.drop_at(at(1.2, 1.9));
    window.run_steps(1);
    match &window.state().events[..] {
        [ViewportEvent::BoxSurfaces { surfaces, add: false }] => {
            assert!(surfaces.contains(&surface("box1")), "{surfaces:?}");
            assert!(!surfaces.contains(&surface("wall1")), "{surfaces:?}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_hand_turns_the_view() {
    let mut window = window(bare());
    let start = *window.state().viewport.camera();
    let (a, b) = (egui::pos2(300.0, 300.0), egui::pos2(340.0, 280.0));
    let press = |window: &mut Window, button, pressed, pos, modifiers| {
        window.event_modifiers(
            egui::Event::PointerButton { pos, button, pressed, modifiers },
            modifiers,
        );
        window.run_steps(1);
    };
    let drag = |window: &mut Window, button, modifiers| {
        window.hover_at(a);
        window.run_steps(1);
        press(window, button, true, a, modifiers);
        for step in 1..=4 {
            window.event_modifiers(
                egui::Event::PointerMoved(a.lerp(b, step as f32 / 4.0)),
                modifiers,
            );
            window.run_steps(1);
        }
        press(window, button, false, b, modifiers);
        *window.state().viewport.camera()
    };
    let middle = egui::PointerButton::Middle;
    let orbited = drag(&mut window, middle, egui::Modifiers::NONE);
    assert!(orbited.azimuth != start.azimuth && orbited.target == start.target);
    let panned = drag(&mut window, middle, egui::Modifiers::SHIFT);
    assert!(panned.azimuth == orbited.azimuth && panned.target != orbited.target);
    let again = drag(&mut window, egui::PointerButton::Primary, egui::Modifiers::ALT);
    assert!(again.azimuth != panned.azimuth && window.state().events.is_empty());
    window.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: egui::vec2(0.0, 3.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: egui::Modifiers::NONE,
    });
    window.run_steps(10);
    assert!(window.state().viewport.camera().distance < again.distance);
    press(&mut window, egui::PointerButton::Secondary, true, b, egui::Modifiers::NONE);
    window.key_down(egui::Key::W);
    let before = window.state().viewport.camera().target;
    window.run_steps(4);
    assert!(window.state().viewport.camera().target != before);
    window.key_up(egui::Key::W);
    press(&mut window, egui::PointerButton::Secondary, false, b, egui::Modifiers::NONE);
    window.key_press(egui::Key::Num5);
    window.run_steps(1);
    assert!(window.state().viewport.camera().orthographic);
    window.state_mut().viewport.frame_all();
    window.key_press(egui::Key::Num7);
    window.run_steps(1);
    keep(&picture(&mut window), "orthographic");
    let camera = window.state().viewport.camera();
    assert!((camera.elevation - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    assert!((camera.target - start.target).length() < 1e-4);
}

/// The window as a whole, with the example and the cursor over the view.
fn studio() -> crate::Window {
    let mut window = crate::Window::with_example();
    let middle = window.node("Viewport").rect().center();
    window.harness.hover_at(middle);
    window.step();
    window
}

#[test]
fn tab_goes_round_the_photographs_and_back() {
    let mut window = studio();
    let middle = window.node("Viewport").rect().center();
    // A click gives the viewport the focus, from which Tab would go on to the toolbar.
    for pressed in [true, false] {
        let (button, modifiers) = (egui::PointerButton::Primary, egui::Modifiers::NONE);
        let event = egui::Event::PointerButton { pos: middle, button, pressed, modifiers };
        window.harness.event(event);
        window.step();
    }
    window.key(egui::Modifiers::NONE, egui::Key::Num0);
    let mut seen = vec![looked_through(&window)];
    for _ in 0..6 {
        window.key(egui::Modifiers::NONE, egui::Key::Tab);
        seen.push(looked_through(&window));
    }
    assert_eq!(seen[6], seen[0], "{seen:?}");
    assert_eq!(seen.iter().collect::<std::collections::BTreeSet<_>>().len(), 6, "{seen:?}");
    for expected in seen.iter().rev().skip(1) {
        window.key(egui::Modifiers::SHIFT, egui::Key::Tab);
        assert_eq!(looked_through(&window), *expected);
    }
    window.key(egui::Modifiers::NONE, egui::Key::Num0);
    assert!(!window.has(&seen[0]), "0 goes back to the free view");
}

/// The name of the photograph that is looked through, as the toolbar has it.
fn looked_through(window: &crate::Window) -> String {
    let found = window.harness.query_all_by_label_contains(" ×").next();
    let node = found.expect("a photograph is looked through");
    node.accesskit_node().label().unwrap_or_default()
}
