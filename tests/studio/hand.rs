//! Mouse and keys in the viewport.

use eframe::egui;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use lobelia::app::viewport::{ViewCamera, ViewportEvent};

use crate::viewport::{SIZE, Window, bare, capture, keep, picture, surface, whole, window};

/// From above.
const TOP: ViewCamera = ViewCamera {
    target: glam::Vec3::new(1.75, 1.65, 0.0),
    distance: 8.0,
    azimuth: -std::f32::consts::FRAC_PI_2,
    elevation: std::f32::consts::FRAC_PI_2,
    orthographic: true,
};
/// Points per metre there: 8 m × 2 × 0.364 fill the height.
const METRE: f32 = SIZE[1] / (TOP.distance * 0.728);

/// Where a place is drawn there.
fn at(x: f32, y: f32) -> egui::Pos2 {
    let middle = TOP.target;
    egui::pos2(0.5 * SIZE[0] + (x - middle.x) * METRE, 0.5 * SIZE[1] - (y - middle.y) * METRE)
}

/// What a click tells.
fn click(window: &mut Window, place: egui::Pos2, modifiers: egui::Modifiers) -> Vec<ViewportEvent> {
    window.hover_at(place);
    window.run_steps(1);
    for pressed in [true, false] {
        let button = egui::PointerButton::Primary;
        let event = egui::Event::PointerButton { pos: place, button, pressed, modifiers };
        window.event_modifiers(event, modifiers);
        window.run_steps(1);
    }
    std::mem::take(&mut window.state_mut().events)
}

#[test]
fn clicks_pick_what_is_drawn_there() {
    let mut window = window(bare());
    window.state_mut().viewport.set_camera(TOP);
    window.state_mut().viewport.settings.cameras = false;
    picture(&mut window);
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
fn clicks_pick_samples_lights_and_cameras() {
    let content = whole();
    let (samples, lights) = (content.samples.clone(), content.lights.clone());
    let mut window = window(content);
    window.state_mut().viewport.set_camera(TOP);
    picture(&mut window);
    let none = egui::Modifiers::NONE;
    let cloud = samples.expect("samples");
    let on_floor = |position: glam::Vec3| position.z.abs() < 1e-3;
    let sample = cloud.samples.iter().position(|sample| on_floor(sample.position)).expect("one");
    let place = cloud.samples[sample].position;
    let picked = click(&mut window, at(place.x, place.y), none);
    assert_eq!(picked, [ViewportEvent::PickSample(sample)]);

    window.state_mut().viewport.settings.samples = false;
    let (lights, _) = lights.expect("lights");
    let mut furthest = 0.0f32;
    for (x, y) in (0..12).flat_map(|x| (0..9).map(move |y| (x, y))) {
        let place = egui::pos2(200.0 + 40.0 * x as f32, 120.0 + 50.0 * y as f32);
        if let [ViewportEvent::PickLight(light)] = click(&mut window, place, none)[..] {
            let light = &lights.lights[light];
            let away = place.distance(at(light.position.x, light.position.y));
            assert!(away < light.radius_m * METRE + 8.0, "{away} points from {light:?}");
            furthest = furthest.max(away);
        }
    }
    keep(&picture(&mut window), "lights-from-above");
    assert!(furthest > 16.0, "lights are hit {furthest} points from their centres at most");

    window.state_mut().viewport.settings.lights = false;
    let eye = capture().photographs[2].camera.position.as_vec3();
    let picked = click(&mut window, at(eye.x, eye.y), none);
    assert_eq!(picked, [ViewportEvent::PickPhotograph(2)]);
}

#[test]
fn a_photograph_in_its_camera_is_selected() {
    let mut window = window(bare());
    window.state_mut().viewport.set_camera(TOP);
    keep(&picture(&mut window), "thumbnails");
    let capture = capture();
    let (mut low, mut high) = capture.mesh.bounds().expect("a mesh");
    for photograph in &capture.photographs {
        let eye = photograph.camera.position.as_vec3();
        (low, high) = (low.min(eye), high.max(eye));
    }
    // The middle of a picture lies as far before its camera as pictures of so few are drawn.
    let depth = 0.09 * 0.5 * (high - low).length();
    let middle = |index: usize| {
        let camera = &capture.photographs[index].camera;
        camera.position.as_vec3() - camera.world_from_camera.z_axis.as_vec3() * depth
    };
    let none = egui::Modifiers::NONE;
    let place = at(middle(3).x, middle(3).y);
    assert_eq!(click(&mut window, place, none), [ViewportEvent::PickPhotograph(3)]);
    assert_eq!(window.state().viewport.is_looking_through(), None);
}

#[test]
fn a_saturated_value_is_told_from_a_measured_one() {
    let mut own = lobelia::scene::Capture::clone(&capture());
    let image = own.photographs[0].image.clone().expect("a measurement");
    let pixels = image.pixels().collect();
    let blown = lobelia::scene::Image::new(image.width(), image.height(), pixels, Some(0.0));
    own.photographs[0].image = Some(std::sync::Arc::new(blown));
    let mut content = bare();
    content.capture = Some(std::sync::Arc::new(own));
    let mut window = window(content);
    for (photograph, saturated) in [(0, Some(0)), (1, None)] {
        window.state_mut().viewport.look_through(Some(photograph));
        window.hover_at(egui::pos2(400.0, 400.0));
        window.run_steps(2);
        let hovered = window.state().viewport.hovered().cloned().expect("a surface");
        assert_eq!(hovered.no_measurement, saturated);
        assert_eq!(hovered.radiance.map(|(_, of)| of), (photograph == 1).then_some(1));
    }
}

#[test]
fn escape_leaves_the_box_wherever_the_cursor_is() {
    let mut window = studio();
    let cursor = |window: &crate::Window| window.harness.output().platform_output.cursor_icon;
    window.key(egui::Modifiers::NONE, egui::Key::B);
    assert_eq!(cursor(&window), egui::CursorIcon::Crosshair);
    window.harness.hover_at(egui::pos2(3.0, 3.0));
    window.step();
    assert_ne!(cursor(&window), egui::CursorIcon::Crosshair);
    window.key(egui::Modifiers::NONE, egui::Key::Escape);
    let middle = window.node("Viewport").rect().center();
    window.harness.hover_at(middle);
    window.step();
    assert_ne!(cursor(&window), egui::CursorIcon::Crosshair);
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
