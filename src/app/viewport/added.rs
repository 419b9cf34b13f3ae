//! Outlines of added lights and objects, and the handles of the selected one.

use eframe::egui::{self, Color32, Painter, Response, Stroke, Ui};
use glam::{BVec3, Vec2, Vec3};

use crate::app::relight::Added;
use crate::app::things::Things;
use crate::app::viewport::Viewport;
use crate::app::viewport::content::{Content, Shading};
use crate::app::viewport::gizmo::{AXES, Mode, tips};
use crate::app::viewport::projection::Projection;
use crate::app::viewport::ring;
use crate::render::edits::Shape;
use crate::scene::{Dome, Emitter, KnownLight};

const COLORS: [Color32; 3] = [
    Color32::from_rgb(230, 84, 84),
    Color32::from_rgb(126, 186, 60),
    Color32::from_rgb(84, 140, 240),
];
const ACCENT: Color32 = Color32::from_rgb(255, 140, 26);

/// Draws what was added, and the handles of the selected one.
pub fn draw(view: &Viewport, ui: &Ui, response: &Response, content: &Content, p: &Projection) {
    let painter = ui.painter_at(response.rect);
    let marks = Marks { painter: &painter, projection: p, origin: response.rect.min };
    let Things { edits, given } = &content.things;
    let added = edits.lights.iter().enumerate().filter_map(|(index, light)| match &light.shape {
        Shape::Emitter(emitter) => Some((Added::Light(index), emitter)),
        Shape::Dome(_) => None,
    });
    let known = given.lights.iter().enumerate().filter_map(|(index, light)| match light {
        KnownLight::Shape { emitter, .. } => Some((Added::Known(index), emitter)),
        KnownLight::Visible { .. } | KnownLight::Dome { .. } => None,
    });
    for (item, emitter) in added.chain(known) {
        let Some(middle) = content.things.middle(item, view.scene.bounds) else { continue };
        let color = if content.selected_added == Some(item) { ACCENT } else { Color32::WHITE };
        marks.light(emitter, middle, 0.1 * view.scene.ball().1, color);
    }
    for (index, object) in edits.objects.iter().enumerate() {
        let is_selected = content.selected_added == Some(Added::Object(index));
        if !is_selected && view.settings.shading == Shading::Relit {
            continue;
        }
        let color = if is_selected { ACCENT } else { Color32::WHITE };
        if let Some((low, high)) = object.mesh.bounds() {
            let corner = |k: usize| {
                let at = Vec3::select(BVec3::new(k & 1 > 0, k & 2 > 0, k & 4 > 0), high, low);
                object.world_from_object.transform_point3(at.as_dvec3()).as_vec3()
            };
            for a in 0..8usize {
                for bit in [1, 2, 4] {
                    if a & bit == 0 {
                        marks.line(corner(a), corner(a | bit), color, 1.5);
                    }
                }
            }
        }
    }
    let domes = (0..edits.lights.len()).map(Added::Light);
    for item in domes.chain((0..given.lights.len()).map(Added::Known)) {
        let middle = content.things.middle(item, view.scene.bounds);
        if let Some((dome, middle)) = content.things.dome(item).zip(middle) {
            marks.dome(dome, middle, content.selected_added == Some(item));
        }
    }
    let Some(item) = content.selected_added else { return };
    let Some(middle) = content.things.middle(item, view.scene.bounds) else { return };
    let Some(center) = p.project(middle) else { return };
    if content.things.dome(item).is_some() {
        return;
    }
    let (mode, held) = view.gizmo.held();
    for (axis, tip) in tips(p, middle).into_iter().enumerate() {
        let Some(tip) = tip else { continue };
        let color = if held == Some(axis) { Color32::WHITE } else { COLORS[axis] };
        marks.handle(center, tip, mode, color);
    }
    let at = marks.at(center);
    painter.circle(at, 5.0, Color32::WHITE, Stroke::new(1.5, ACCENT));
}

struct Marks<'a> {
    painter: &'a Painter,
    projection: &'a Projection,
    origin: egui::Pos2,
}

impl Marks<'_> {
    fn at(&self, local: Vec2) -> egui::Pos2 {
        self.origin + egui::vec2(local.x, local.y)
    }

    fn line(&self, from: Vec3, to: Vec3, color: Color32, width: f32) {
        if let Some((a, b)) = self.projection.project(from).zip(self.projection.project(to)) {
            let line = [self.at(a), self.at(b)];
            // Dark below, so that it is seen on bright pictures, too.
            self.painter
                .line_segment(line, Stroke::new(width + 1.5, Color32::from_black_alpha(120)));
            self.painter.line_segment(line, Stroke::new(width, color));
        }
    }

    fn circle(&self, center: Vec3, normal: Vec3, radius_m: f32, color: Color32) {
        const PARTS: usize = 32;
        let (a, b) = normal.any_orthonormal_pair();
        let place = |k: usize| {
            let angle = k as f32 / PARTS as f32 * std::f32::consts::TAU;
            center + (a * angle.cos() + b * angle.sin()) * radius_m
        };
        for k in 0..PARTS {
            self.line(place(k), place(k + 1), color, 1.5);
        }
    }

    /// A light in outline; `size_m` is the length of arrows.
    fn light(&self, emitter: &Emitter, middle: Vec3, size_m: f32, color: Color32) {
        match *emitter {
            Emitter::Rectangle { corners, normal } => {
                for k in 0..4 {
                    self.line(corners[k], corners[(k + 1) % 4], color, 1.5);
                }
                self.line(middle, middle + normal * size_m, color, 1.5);
            }
            Emitter::Sphere { center, radius_m } => {
                self.circle(center, self.projection.forward, radius_m, color);
            }
            Emitter::Point { position } => {
                for axis in AXES {
                    let half = axis * 0.25 * size_m;
                    self.line(position - half, position + half, color, 1.5);
                }
            }
            Emitter::Spot { position, direction, outer_angle, .. } => {
                let angle = outer_angle.clamp(0.02, 1.4);
                let (far, radius) = (2.0 * size_m * angle.cos(), 2.0 * size_m * angle.sin());
                let rim = position + direction * far;
                self.circle(rim, direction, radius, color);
                let (a, b) = direction.any_orthonormal_pair();
                for side in [a, -a, b, -b] {
                    self.line(position, rim + side * radius, color, 1.5);
                }
            }
            Emitter::Sun { direction, .. } => {
                self.line(middle, middle + direction * 3.0 * size_m, color, 1.5);
                let (a, b) = direction.any_orthonormal_pair();
                let tip = middle + direction * 3.0 * size_m;
                for side in [a, -a, b, -b] {
                    let barb = (0.4 * side - direction) * 0.5 * size_m;
                    self.line(tip, tip + barb, color, 1.5);
                }
                self.circle(middle, self.projection.forward, 0.3 * size_m, color);
            }
        }
        if let Some(center) = self.projection.project(middle) {
            let at = self.at(center);
            self.painter.circle(at, 4.0, color, Stroke::new(1.0, Color32::from_black_alpha(160)));
        }
    }

    /// A dome: half a ball above the scene, and where the middle of its image lies; of the selected
    /// one also the ring by which it is turned.
    fn dome(&self, dome: &Dome, middle: Vec3, is_selected: bool) {
        let Some(center) = self.projection.project(middle) else { return };
        let at = self.at(center);
        let color = if is_selected { ACCENT } else { Color32::WHITE };
        let under = Color32::from_black_alpha(160);
        let arc: Vec<egui::Pos2> = (0..=16)
            .map(|k| {
                let angle = k as f32 / 16.0 * std::f32::consts::PI;
                at + 9.0 * egui::vec2(angle.cos(), -angle.sin())
            })
            .chain([at + egui::vec2(9.0, 0.0)])
            .collect();
        self.painter.line(arc.clone(), Stroke::new(4.0, under));
        self.painter.line(arc, Stroke::new(2.0, color));
        if !is_selected {
            return;
        }
        let places = ring::places(self.projection, middle, dome);
        let ring: Vec<egui::Pos2> = places.map(|place| self.at(place)).collect();
        let closed: Vec<egui::Pos2> = ring.iter().chain(ring.first()).copied().collect();
        self.painter.line(closed.clone(), Stroke::new(4.0, under));
        self.painter.line(closed, Stroke::new(2.5, COLORS[2]));
        if let Some(front) = ring.first() {
            self.painter.line_segment([at, *front], Stroke::new(3.5, under));
            self.painter.line_segment([at, *front], Stroke::new(2.0, color));
            self.painter.circle(*front, 6.0, COLORS[2], Stroke::new(1.5, Color32::WHITE));
        }
    }

    fn handle(&self, center: Vec2, tip: Vec2, mode: Mode, color: Color32) {
        let (from, to) = (self.at(center), self.at(tip));
        self.painter.line_segment([from, to], Stroke::new(2.5, color));
        match mode {
            Mode::Move => {
                let along = (to - from).normalized();
                let aside = egui::vec2(-along.y, along.x);
                let base = to - 9.0 * along;
                let corners = vec![to + 3.0 * along, base + 5.0 * aside, base - 5.0 * aside];
                self.painter.add(egui::Shape::convex_polygon(corners, color, Stroke::NONE));
            }
            Mode::Turn => {
                self.painter.circle(to, 6.0, Color32::TRANSPARENT, Stroke::new(2.5, color));
            }
            Mode::Scale => {
                let square = egui::Rect::from_center_size(to, egui::Vec2::splat(10.0));
                self.painter.rect_filled(square, 1.0, color);
            }
        }
    }
}
