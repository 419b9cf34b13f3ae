//! User input in the 3D view: turning the view, keys, clicks and boxes.

use eframe::egui::{self, Key, Modifiers, PointerButton, Pos2, Response, Ui};
use glam::{Vec2, Vec3};

use crate::app::viewport::camera::Side;
use crate::app::viewport::content::{Content, Shading, ViewportEvent};
use crate::app::viewport::gizmo;
use crate::app::viewport::picking::Picker;
use crate::app::viewport::projection::{Placement, Projection};
use crate::app::viewport::{Boxing, Viewport, charts, masks, thumbs};

/// Scene radii per second.
const FLYING: f32 = 0.6;

/// Moves the view. The keys are consumed, so that they mean nothing else to the window.
pub fn navigate(view: &mut Viewport, ui: &Ui, response: &Response, content: &Content) {
    let size = Vec2::new(response.rect.width(), response.rect.height());
    let (modifiers, motion) = ui.input(|i| (i.modifiers, i.pointer.delta()));
    let drag = Vec2::new(motion.x, motion.y);
    let middle = response.dragged_by(PointerButton::Middle);
    let is_free = !has_tool(view);
    let alt_left = response.dragged_by(PointerButton::Primary) && modifiers.alt && is_free;
    if middle || alt_left {
        if modifiers.shift {
            if view.through.is_some() {
                view.placement.shift += drag;
            } else {
                view.camera.pan(drag, size.y);
            }
        } else if drag != Vec2::ZERO {
            leave_photograph(view, content);
            view.camera.orbit(drag);
        }
    }
    if response.contains_pointer() {
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta.y, i.zoom_delta()));
        let factor = (-0.0025 * scroll).exp() / pinch.max(1e-3);
        if let Some(cursor) = response.hover_pos().filter(|_| factor != 1.0) {
            let from_middle = cursor - response.rect.center();
            let from_middle = Vec2::new(from_middle.x, from_middle.y);
            if view.through.is_some() {
                zoom_photograph(&mut view.placement, 1.0 / factor, from_middle);
            } else {
                let radius = view.scene.ball().1;
                view.camera.zoom(factor, from_middle, size.y, radius);
            }
        }
    }
    if response.is_pointer_button_down_on() && ui.input(|i| i.pointer.secondary_down()) {
        fly(view, ui, drag, content);
    } else if has_keys(ui, response) {
        keys(view, ui, content);
    }
}

/// Whether clicks and drags over the photograph are for a tool.
fn has_tool(view: &Viewport) -> bool {
    masks::is_active(view) || charts::is_active(view)
}

/// Keys count while the cursor is over the viewport or it has the focus, and nobody types.
pub fn has_keys(ui: &Ui, response: &Response) -> bool {
    (response.contains_pointer() || response.has_focus()) && !ui.ctx().text_edit_focused()
}

fn fly(view: &mut Viewport, ui: &Ui, drag: Vec2, content: &Content) {
    let mut way = Vec3::ZERO;
    let (faster, seconds) = ui.input_mut(|i| {
        let faster = i.modifiers.shift;
        for (key, step) in [
            (Key::W, Vec3::Y),
            (Key::S, -Vec3::Y),
            (Key::D, Vec3::X),
            (Key::A, -Vec3::X),
            (Key::E, Vec3::Z),
            (Key::Q, -Vec3::Z),
        ] {
            if i.key_down(key) {
                way += step;
            }
            i.consume_key(Modifiers::NONE, key);
            i.consume_key(Modifiers::SHIFT, key);
        }
        (faster, i.stable_dt.min(0.1))
    });
    if way == Vec3::ZERO && drag == Vec2::ZERO {
        return;
    }
    leave_photograph(view, content);
    view.camera.look(drag);
    if way != Vec3::ZERO {
        let speed = FLYING * view.scene.ball().1 * if faster { 4.0 } else { 1.0 };
        view.camera.fly(way.normalize_or_zero() * speed * seconds);
        ui.ctx().request_repaint();
    }
}

fn keys(view: &mut Viewport, ui: &Ui, content: &Content) {
    let pressed = |modifiers, key| ui.input_mut(|i| i.consume_key(modifiers, key));
    let plain = |key| pressed(Modifiers::NONE, key);
    for (key, side, other) in [
        (Key::Num1, Side::Front, Side::Back),
        (Key::Num3, Side::Right, Side::Left),
        (Key::Num7, Side::Top, Side::Bottom),
    ] {
        let turned = if plain(key) {
            Some(side)
        } else if pressed(Modifiers::COMMAND, key) {
            Some(other)
        } else {
            None
        };
        if let Some(side) = turned {
            leave_photograph(view, content);
            view.camera.turn_to(side);
        }
    }
    if plain(Key::Num5) {
        leave_photograph(view, content);
        view.camera.orthographic ^= true;
    }
    if !has_tool(view) && plain(Key::B) {
        view.boxing = Boxing::Armed;
    }
}

/// Looking through photographs; tells which one.
pub fn photograph_keys(
    view: &mut Viewport,
    ui: &Ui,
    response: &Response,
    content: &Content,
    events: &mut Vec<ViewportEvent>,
) {
    let count = content.capture.as_ref().map_or(0, |capture| capture.photographs.len());
    if count == 0 || !has_keys(ui, response) {
        return;
    }
    let pressed = |modifiers, key| ui.input_mut(|i| i.consume_key(modifiers, key));
    let mut wanted = None;
    if pressed(Modifiers::NONE, Key::Num0) {
        if view.through.is_some() {
            leave_photograph(view, content);
        } else {
            wanted = Some(content.selected_photograph.unwrap_or(0).min(count - 1));
        }
    }
    // Elsewhere Tab moves the focus, as everywhere.
    if let Some(now) = view.through {
        // With shift first: a plain Tab is also within Shift+Tab.
        if pressed(Modifiers::SHIFT, Key::Tab) {
            wanted = Some((now + count - 1) % count);
        } else if pressed(Modifiers::NONE, Key::Tab) {
            wanted = Some((now + 1) % count);
        }
    }
    if let Some(photograph) = wanted {
        view.look_through(Some(photograph));
        events.push(ViewportEvent::PickPhotograph(photograph));
    }
}

/// While a photograph is looked through, the viewport has the focus and keeps Tab to itself: egui
/// reads Tab before any widget does, and would move the focus on.
pub fn keep_tab(view: &Viewport, ui: &Ui, response: &Response) {
    let tab = view.through.is_some();
    if tab && has_keys(ui, response) && !response.has_focus() {
        response.request_focus();
        // The filter can be set from the next frame on.
        ui.ctx().request_repaint();
    }
    let filter = egui::EventFilter { tab, ..egui::EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
}

/// Goes on from the photograph's place with the free view.
pub fn leave_photograph(view: &mut Viewport, content: &Content) {
    let Some(photograph) = view.through.take() else { return };
    let Some(photograph) =
        content.capture.as_ref().and_then(|capture| capture.photographs.get(photograph))
    else {
        return;
    };
    let eye = photograph.camera.position.as_vec3();
    let forward = -photograph.camera.world_from_camera.z_axis.as_vec3();
    let (center, radius) = view.scene.ball();
    let ahead = (center - eye).dot(forward).max(0.2 * radius);
    view.camera.take(eye, forward, ahead);
}

fn zoom_photograph(placement: &mut Placement, factor: f32, cursor: Vec2) {
    let zoom = (placement.zoom * factor).clamp(0.2, 100.0);
    let factor = zoom / placement.zoom;
    placement.shift = cursor + (placement.shift - cursor) * factor;
    placement.zoom = zoom;
}

/// A place in the window from the viewport's corner, in points.
pub fn local(origin: Pos2, position: Pos2) -> Vec2 {
    Vec2::new(position.x - origin.x, position.y - origin.y)
}

/// Clicks and boxes.
pub fn select(
    view: &mut Viewport,
    ui: &Ui,
    response: &Response,
    content: &Content,
    projection: &Projection,
    events: &mut Vec<ViewportEvent>,
) {
    let origin = response.rect.min;
    let local = |position: Pos2| local(origin, position);
    let modifiers = ui.input(|i| i.modifiers);
    let picker = view
        .scene
        .capture
        .as_ref()
        .zip(view.scene.caster.as_ref())
        .map(|(capture, caster)| Picker { capture, caster, hidden: &content.hidden_surfaces });
    if view.boxing != Boxing::Off {
        if response.contains_pointer() {
            ui.ctx().set_cursor_icon(egui::CursorIcon::Crosshair);
        }
        // Wherever the cursor is: nothing else may take it while a box is under way.
        if !ui.ctx().text_edit_focused()
            && ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Escape))
        {
            view.boxing = Boxing::Off;
            return;
        }
        if response.drag_started_by(PointerButton::Primary)
            && let Some(start) = ui.input(|i| i.pointer.press_origin())
        {
            view.boxing = Boxing::From(start);
        }
        if let Boxing::From(start) = view.boxing
            && response.drag_stopped_by(PointerButton::Primary)
        {
            if let Some((picker, end)) = picker.as_ref().zip(response.interact_pointer_pos()) {
                let (a, b) = (local(start), local(end));
                let surfaces = picker.inside(projection, a.min(b), a.max(b));
                events.push(ViewportEvent::BoxSurfaces { surfaces, add: modifiers.shift });
            }
            view.boxing = Boxing::Off;
        } else if response.clicked() {
            view.boxing = Boxing::Off;
        }
        return;
    }
    let Some(picker) = picker else { return };
    let pressed_l = has_keys(ui, response)
        && (ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::L))
            || ui.input_mut(|i| i.consume_key(Modifiers::SHIFT, Key::L)));
    if let Some(position) = response.hover_pos().filter(|_| pressed_l) {
        let surface = picker.under(projection, local(position)).map(|(surface, ..)| surface);
        events.push(ViewportEvent::PickSurface { surface, add: modifiers.shift });
    }
    if !response.clicked_by(PointerButton::Primary) || modifiers.alt {
        return;
    }
    response.request_focus();
    let Some(position) = response.interact_pointer_pos().map(local) else { return };
    let settings = &view.settings;
    let behind = picker.closest(projection.ray(position)).map_or(f32::INFINITY, |hit| hit.t);
    if let Some(item) = gizmo::under(content, projection, position, view.scene.bounds, behind) {
        events.push(ViewportEvent::PickAdded(item));
        return;
    }
    if let Some(photograph) = thumb_under(view, &picker, content, projection, position) {
        if response.double_clicked_by(PointerButton::Primary) {
            view.look_through(Some(photograph));
        }
        events.push(ViewportEvent::PickPhotograph(photograph));
        return;
    }
    // What a rendering hides cannot be clicked either.
    let is_bare = settings.shading == Shading::Relit;
    let (samples, lights) = (settings.samples && !is_bare, settings.lights && !is_bare);
    if let Some(cloud) = content.samples.as_ref().filter(|_| samples) {
        let marks = cloud.samples.iter().map(|sample| sample.position);
        if let Some(sample) = picker.nearest(projection, position, marks) {
            events.push(ViewportEvent::PickSample(sample));
            return;
        }
    }
    if let Some((lights, _)) = content.lights.as_ref().filter(|_| lights)
        && let Some(light) = picker.light(projection, position, lights)
    {
        events.push(ViewportEvent::PickLight(light));
        return;
    }
    if settings.cameras && !is_bare && view.through.is_none() {
        let eyes = picker.capture.photographs.iter().map(|p| p.camera.position.as_vec3());
        if let Some(photograph) = picker.nearest(projection, position, eyes) {
            events.push(ViewportEvent::PickPhotograph(photograph));
            return;
        }
    }
    let surface = picker.under(projection, position).map(|(surface, ..)| surface);
    events.push(ViewportEvent::PickSurface { surface, add: modifiers.shift });
}

/// The photograph whose picture is drawn at a position in front of all else.
pub fn thumb_under(
    view: &Viewport,
    picker: &Picker,
    content: &Content,
    projection: &Projection,
    position: Vec2,
) -> Option<usize> {
    let settings = &view.settings;
    let is_drawn = settings.cameras && settings.thumbnails && settings.shading != Shading::Relit;
    if !is_drawn || view.through.is_some() {
        return None;
    }
    let ray = projection.ray(position);
    let depth = thumbs::depth(picker.capture.photographs.len(), view.scene.ball().1);
    let met = view.scene.layers.filled().filter_map(|(_, photograph)| {
        let depth = thumbs::depth_of(photograph, content.selected_photograph, depth);
        let t = thumbs::hit(&picker.capture.photographs[photograph].camera, depth, &ray)?;
        Some((t, photograph))
    });
    let (t, photograph) = met.min_by(|a, b| a.0.total_cmp(&b.0))?;
    picker.closest(ray).is_none_or(|hit| t < hit.t).then_some(photograph)
}
