//! Draggable numbers in threes, lengths, angles and directions.

use std::ops::RangeInclusive;

use eframe::egui::{self, DragValue};
use glam::Vec3;

use crate::app::entry::{self, Unit};
use crate::math::rgb::Rgb;

pub fn position(ui: &mut egui::Ui, what: &str, value: Vec3) -> Option<Vec3> {
    let mut edited = value.to_array();
    let mut changed = false;
    ui.horizontal(|ui| {
        for (value, axis) in edited.iter_mut().zip(["x", "y", "z"]) {
            let field = DragValue::new(value).speed(0.01).range(-1e6..=1e6).max_decimals(3);
            changed |= entry::number(ui, field, Unit::Length)
                .accessible_name(format!("{what}, {axis}"))
                .on_hover_text(format!("{what}, {axis} in metres"))
                .changed();
        }
    });
    changed.then(|| Vec3::from(edited))
}

pub fn length(ui: &mut egui::Ui, name: &str, value: &mut f32) -> bool {
    let speed = 0.01 * value.max(1e-3);
    let field = DragValue::new(value).speed(speed).range(1e-4..=1e4).max_decimals(4);
    let response = entry::number(ui, field, Unit::Length);
    response.accessible_name(name).on_hover_text(name).changed()
}

pub fn angle(ui: &mut egui::Ui, name: &str, radians: &mut f32, help: &str) -> bool {
    let mut degrees = radians.to_degrees();
    let field =
        DragValue::new(&mut degrees).speed(0.2).range(0.0..=180.0).max_decimals(2).suffix("°");
    let response = entry::number(ui, field, Unit::Angle);
    let changed = response.accessible_name(name).on_hover_text(help).changed();
    if changed {
        *radians = degrees.to_radians();
    }
    changed
}

/// The direction of light by the angles that surveyors use.
pub fn direction_ui(ui: &mut egui::Ui, direction: &mut Vec3) -> bool {
    let from = -*direction;
    let mut azimuth = from.y.atan2(from.x).to_degrees();
    let mut elevation = from.z.clamp(-1.0, 1.0).asin().to_degrees();
    let mut changed = false;
    for (name, value, range, help) in [
        ("Azimuth", &mut azimuth, -180.0..=180.0, "Where the light comes from, from +x to +y"),
        ("Elevation", &mut elevation, -90.0..=90.0, "How high above the ground it comes from"),
    ] {
        ui.weak(name);
        let field = DragValue::new(value).speed(0.3).range(range).max_decimals(1).suffix("°");
        let response = entry::number(ui, field, Unit::Angle);
        changed |= response.accessible_name(name).on_hover_text(help).changed();
        ui.end_row();
    }
    if changed {
        let (a, e) = (azimuth.to_radians(), elevation.to_radians());
        *direction = -Vec3::new(e.cos() * a.cos(), e.cos() * a.sin(), e.sin());
    }
    changed
}

/// Three draggable numbers; the new ones where any was changed.
pub fn triple(
    ui: &mut egui::Ui,
    what: &str,
    values: Rgb,
    range: RangeInclusive<f64>,
    speed: f64,
) -> Option<Rgb> {
    let mut edited = values;
    let mut changed = false;
    for (value, channel) in edited.iter_mut().zip(["red", "green", "blue"]) {
        let field = DragValue::new(value).range(range.clone()).speed(speed).max_decimals(4);
        changed |= entry::number(ui, field, Unit::Plain)
            .accessible_name(format!("{what}, {channel}"))
            .on_hover_text(format!("{what}, {channel}, linear"))
            .changed();
    }
    changed.then_some(edited)
}
