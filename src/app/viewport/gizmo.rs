//! Lights and objects that were set into the scene: how they are clicked, and moved by handles and
//! by keys (G, R and S, then X, Y or Z and a number), as artists are used to.

use eframe::egui::{self, Event, Key, PointerButton, Response, Ui};
use glam::{Quat, Vec2, Vec3};

use crate::app::entry::{self, Unit};
use crate::app::relight::{Added, Motion};
use crate::app::things::Things;
use crate::app::viewport::Viewport;
use crate::app::viewport::content::{Content, ViewportEvent};
use crate::app::viewport::input::{self, has_keys};
use crate::app::viewport::picking::Picker;
use crate::app::viewport::projection::Projection;
use crate::app::viewport::ring::{self, UP};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    #[default]
    Move,
    Turn,
    Scale,
}

/// The mode of the handles, and the transform that is in progress.
#[derive(Default)]
pub struct Gizmo {
    pub mode: Mode,
    active: Option<Transform>,
}

/// A light or an object on its way.
struct Transform {
    item: Added,
    mode: Mode,
    /// Of the world; freely without one.
    axis: Option<usize>,
    /// As it was before.
    base: Things,
    middle: Vec3,
    start: Vec2,
    /// A number that is being typed.
    typed: String,
    /// By a handle that is held, not by a key.
    is_drag: bool,
}

/// Points from the middle to the tip of a handle.
const ARM: f32 = 64.0;
/// Points around a handle that take hold of it.
const GRIP: f32 = 9.0;
pub(super) const AXES: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];
impl Mode {
    pub const ALL: [(Self, &'static str, &'static str); 3] = [
        (Self::Move, "Move", "Handles move it (G); hold Ctrl to snap to surfaces"),
        (Self::Turn, "Rotate", "Handles turn it (R)"),
        (Self::Scale, "Scale", "Handles scale it (S)"),
    ];

    /// What undo calls it.
    fn name(self) -> &'static str {
        match self {
            Self::Move => "move",
            Self::Turn => "rotate",
            Self::Scale => "scale",
        }
    }
}

impl Gizmo {
    pub fn is_active(&self) -> bool {
        self.active.is_some()
    }

    /// The mode of the handles now, and the axis that is dragged.
    pub(super) fn held(&self) -> (Mode, Option<usize>) {
        self.active.as_ref().map_or((self.mode, None), |own| (own.mode, own.axis))
    }

    /// What is being done, for the viewport's corner.
    pub fn status(&self) -> Option<String> {
        let own = self.active.as_ref().filter(|own| !own.is_drag)?;
        let axis = own.axis.map_or("", |axis| [" along X", " along Y", " along Z"][axis]);
        let typed = if own.typed.is_empty() { String::new() } else { format!(": {}", own.typed) };
        let hint = "X Y Z axis, digits, Enter or click to keep, Esc to leave";
        Some(format!("{}{axis}{typed}   {hint}", own.mode.name()))
    }
}

/// Handles and keys; true where the pointer is taken and nothing else may have it.
pub fn interact(
    view: &mut Viewport,
    ui: &Ui,
    response: &Response,
    content: &Content,
    projection: &Projection,
    events: &mut Vec<ViewportEvent>,
) -> bool {
    let origin = response.rect.min;
    let pointer = ui.input(|i| i.pointer.latest_pos());
    let local = pointer.map(|position| input::local(origin, position));
    if view.gizmo.active.is_some() {
        go_on(view, ui, response, content, projection, local, events);
        return true;
    }
    let Some(item) = content.selected_added.filter(|item| content.things.exists(*item)) else {
        return false;
    };
    let Some(middle) = content.things.middle(item, view.scene.bounds) else { return false };
    // A dome is everywhere: it turns about the vertical, and that is all that handles can do to it.
    let is_dome = content.things.dome(item).is_some();
    let begin = |mode: Mode, axis: Option<usize>, start, is_drag| Transform {
        item,
        mode: if is_dome && mode == Mode::Move { Mode::Turn } else { mode },
        axis: if is_dome { Some(UP) } else { axis },
        base: content.things.clone(),
        middle,
        start,
        typed: String::new(),
        is_drag,
    };
    // S flies back while the right button is held.
    if has_keys(ui, response) && !ui.input(|i| i.pointer.secondary_down()) {
        for (key, mode) in [(Key::G, Mode::Move), (Key::R, Mode::Turn), (Key::S, Mode::Scale)] {
            if ui.input_mut(|i| i.consume_key(egui::Modifiers::NONE, key))
                && let Some(start) = local
            {
                view.gizmo.active = Some(begin(mode, None, start, false));
                return true;
            }
        }
    }
    if response.drag_started_by(PointerButton::Primary)
        && let Some(press) = ui.input(|i| i.pointer.press_origin())
    {
        let press = input::local(origin, press);
        let Some(center) = projection.project(middle) else { return false };
        let near: Vec<(f32, Option<usize>)> = match content.things.dome(item) {
            Some(dome) => ring::places(projection, middle, dome)
                .map(|place| (place.distance(press), Some(UP)))
                .collect(),
            None => tips(projection, middle)
                .into_iter()
                .enumerate()
                .filter_map(|(axis, tip)| Some((tip?.distance(press), Some(axis))))
                .chain([(center.distance(press), None)])
                .collect(),
        };
        let held = near.into_iter().filter(|(away, _)| *away <= GRIP);
        let held = held.min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, axis)) = held {
            view.gizmo.active = Some(begin(view.gizmo.mode, axis, press, true));
            return true;
        }
    }
    false
}

/// The transform that is under way: a step of it, or its end.
fn go_on(
    view: &mut Viewport,
    ui: &Ui,
    response: &Response,
    content: &Content,
    projection: &Projection,
    local: Option<Vec2>,
    events: &mut Vec<ViewportEvent>,
) {
    let Some(own) = &mut view.gizmo.active else { return };
    if !own.is_drag {
        typing(ui, own);
    }
    let (escaped, entered) = ui.input_mut(|i| {
        let escaped = i.consume_key(egui::Modifiers::NONE, Key::Escape);
        (escaped, i.consume_key(egui::Modifiers::NONE, Key::Enter))
    });
    let is_left = escaped
        || (!own.is_drag && response.clicked_by(PointerButton::Secondary))
        || !content.things.exists(own.item);
    let (item, name) = (own.item, own.mode.name());
    if is_left {
        view.gizmo.active = None;
        events.push(ViewportEvent::LeftAsItWas);
        return;
    }
    let snaps = ui.input(|i| i.modifiers.command);
    let snapped = || {
        let (capture, caster) = view.scene.capture.as_ref().zip(view.scene.caster.as_ref())?;
        let picker = Picker { capture, caster, hidden: &content.hidden_surfaces };
        let (_, place, triangle) = picker.under(projection, local?)?;
        let normal = capture.mesh.normal(triangle);
        let normal = if normal.dot(projection.eye - place) < 0.0 { -normal } else { normal };
        Some(place + normal * own.base.reach_m(own.item, normal) - own.middle)
    };
    let motion = own.motion(projection, local, if snaps { snapped() } else { None });
    if let Some(motion) = motion {
        let things = own.base.moved(own.item, motion);
        events.push(ViewportEvent::Moved { item, name, things });
    }
    let is_kept = if own.is_drag {
        response.drag_stopped() || !ui.input(|i| i.pointer.primary_down())
    } else {
        entered || response.clicked_by(PointerButton::Primary)
    };
    if is_kept {
        view.gizmo.active = None;
        events.push(ViewportEvent::Kept);
    }
    ui.ctx().request_repaint();
}

/// Axes and numbers.
fn typing(ui: &Ui, own: &mut Transform) {
    ui.input_mut(|i| {
        i.events.retain(|event| {
            match event {
                Event::Key { key: Key::Backspace, pressed: true, .. } => {
                    own.typed.pop();
                }
                Event::Key { key, pressed: true, modifiers, .. } if modifiers.is_none() => {
                    match key {
                        Key::X => own.axis = Some(0),
                        Key::Y => own.axis = Some(1),
                        Key::Z => own.axis = Some(2),
                        // Digits come as text, too.
                        _ => return matches!(key, Key::Escape | Key::Enter),
                    }
                }
                Event::Text(text) => {
                    let is_number =
                        |letter: char| letter.is_ascii_digit() || ".,-/".contains(letter);
                    own.typed.extend(text.chars().filter(|letter| is_number(*letter)));
                }
                _ => return true,
            }
            false
        });
    });
}

impl Transform {
    /// The whole way since the start; `None` where the pointer says nothing.
    fn motion(
        &self,
        projection: &Projection,
        now: Option<Vec2>,
        snapped: Option<Vec3>,
    ) -> Option<Motion> {
        let typed = entry::parse(&self.typed, Unit::Plain).ok().map(|value| value as f32);
        let axis = self.axis.map(|axis| AXES[axis]);
        Some(match self.mode {
            Mode::Move => Motion::Move(match (typed, axis) {
                (Some(metres), axis) => axis.unwrap_or(Vec3::X) * metres,
                (None, Some(axis)) => {
                    axis * (self.along(projection, axis, now?)?
                        - self.along(projection, axis, self.start)?)
                }
                (None, None) => match snapped {
                    Some(by) => by,
                    None => self.across(projection, now?)? - self.across(projection, self.start)?,
                },
            }),
            Mode::Turn => {
                let towards = -projection.forward;
                let axis = axis.unwrap_or(towards);
                let angle = match typed {
                    Some(degrees) => degrees.to_radians(),
                    None => {
                        let center = projection.project(self.middle)?;
                        // Clockwise on the screen, whose y points down.
                        let turned = (self.start - center).angle_to(now? - center);
                        -turned * if axis.dot(towards) < 0.0 { -1.0 } else { 1.0 }
                    }
                };
                Motion::Turn(Quat::from_axis_angle(axis, angle))
            }
            Mode::Scale => {
                let factor = match typed {
                    Some(factor) => factor.abs(),
                    None => {
                        let center = projection.project(self.middle)?;
                        now?.distance(center) / self.start.distance(center).max(8.0)
                    }
                };
                Motion::Scale(factor.clamp(1e-3, 1e3))
            }
        })
    }

    /// Metres along an axis through the middle of the point nearest to what is seen at a position.
    fn along(&self, projection: &Projection, axis: Vec3, position: Vec2) -> Option<f32> {
        let ray = projection.ray(position);
        let (offset, cosine) = (ray.origin - self.middle, axis.dot(ray.direction));
        let sine = 1.0 - cosine * cosine;
        // Along the line of sight a position says nothing.
        (sine > 1e-4).then(|| (axis.dot(offset) - cosine * ray.direction.dot(offset)) / sine)
    }

    /// The place at a position in the plane through the middle that faces the eye.
    fn across(&self, projection: &Projection, position: Vec2) -> Option<Vec3> {
        let ray = projection.ray(position);
        let steep = ray.direction.dot(projection.forward);
        let t = (self.middle - ray.origin).dot(projection.forward) / steep;
        (steep > 1e-4).then(|| ray.origin + ray.direction * t)
    }
}

/// Where the tips of the handles are drawn: as long on the screen wherever the middle is, where an
/// axis does not point at the eye.
pub(super) fn tips(projection: &Projection, middle: Vec3) -> [Option<Vec2>; 3] {
    let Some(center) = projection.project(middle) else { return [None; 3] };
    // The points that a metre across the view takes there.
    let Some(aside) = projection.project(middle + projection.right) else { return [None; 3] };
    let per_metre = aside.distance(center).max(1e-6);
    AXES.map(|axis| projection.project(middle + axis * (ARM / per_metre)))
}

/// The added light or object under a position: a light's middle, or an object's surface.
pub fn under(
    content: &Content,
    projection: &Projection,
    position: Vec2,
    bounds: (Vec3, Vec3),
    scene_t: f32,
) -> Option<Added> {
    let Things { edits, given } = &content.things;
    let near = |item: Added| {
        let place = content.things.middle(item, bounds)?;
        let away = projection.project(place)?.distance(position);
        (away <= 14.0).then_some((away, item))
    };
    let added = (0..edits.lights.len()).map(Added::Light);
    let lights = added.chain((0..given.lights.len()).map(Added::Known));
    let light = lights.filter_map(near).min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, light)) = light {
        return Some(light);
    }
    let ray = projection.ray(position);
    let hit = edits.objects.iter().enumerate().filter_map(|(index, object)| {
        let t = object.met_m(&ray)?;
        (t < scene_t).then_some((t, Added::Object(index)))
    });
    hit.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, object)| object)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::viewport::projection::Range;

    const SIZE: Vec2 = Vec2::new(400.0, 300.0);

    /// From −y, x to the right and z up.
    fn projection() -> Projection {
        let range = Range { near: 0.01, far: 100.0 };
        let axes = [Vec3::X, Vec3::Z, -Vec3::Y];
        Projection::free(Vec3::new(0.0, -4.0, 0.0), axes, 0.5, false, SIZE, range)
    }

    fn transform(mode: Mode, axis: Option<usize>, start: Vec2) -> Transform {
        Transform {
            item: Added::Light(0),
            mode,
            axis,
            base: Things::default(),
            middle: Vec3::new(0.5, 0.0, 0.5),
            start,
            typed: String::new(),
            is_drag: true,
        }
    }

    #[test]
    fn what_is_dragged_stays_under_the_pointer() {
        let p = projection();
        let to = Vec3::new(-0.3, 0.0, 0.9);
        let at = |place: Vec3| p.project(place).unwrap();
        let own = transform(Mode::Move, None, at(Vec3::new(0.5, 0.0, 0.5)));
        let Some(Motion::Move(by)) = own.motion(&p, Some(at(to)), None) else { panic!("moved") };
        assert!((own.middle + by - to).length() < 1e-4, "{by}");
        for (axis, expected) in [(0, Vec3::X * -0.8), (2, Vec3::Z * 0.4)] {
            let own = transform(Mode::Move, Some(axis), own.start);
            let now = at(own.middle + expected);
            let Some(Motion::Move(by)) = own.motion(&p, Some(now), None) else { panic!("moved") };
            assert!((by - expected).length() < 1e-4, "{by}");
        }
        // Along the line of sight a position says nothing.
        let own = transform(Mode::Move, Some(1), SIZE / 2.0);
        let ahead = Transform { middle: Vec3::ZERO, ..own };
        assert_eq!(ahead.motion(&p, Some(SIZE / 2.0), None), None);
    }

    #[test]
    fn turning_follows_the_hand_and_numbers_win_over_it() {
        let p = projection();
        let center = p.project(Vec3::new(0.5, 0.0, 0.5)).unwrap();
        let own = transform(Mode::Turn, None, center + Vec2::X * 50.0);
        // A quarter clockwise on the screen: what pointed right points down.
        let now = center + Vec2::Y * 50.0;
        let Some(Motion::Turn(turn)) = own.motion(&p, Some(now), None) else { panic!("turned") };
        assert!((turn * Vec3::X + Vec3::Z).length() < 1e-5);
        let typed = Transform { typed: "90".into(), axis: Some(2), ..own };
        let Some(Motion::Turn(turn)) = typed.motion(&p, None, None) else { panic!("turned") };
        assert!((turn * Vec3::X - Vec3::Y).length() < 1e-5);
        let scaled = transform(Mode::Scale, None, center + Vec2::X * 40.0);
        assert_eq!(
            scaled.motion(&p, Some(center + Vec2::Y * 80.0), None),
            Some(Motion::Scale(2.0))
        );
    }
}
