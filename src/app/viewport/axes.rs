//! The ball of axes in the corner of the 3D view: shows the directions of the axes; a click turns
//! the view.

use eframe::egui::{self, Align2, Color32, FontId, Id, Rect, Sense, Stroke, Ui, vec2};
use glam::Vec3;

use crate::app::keys;
use crate::app::viewport::camera::Side;
use crate::app::viewport::projection::Projection;

const RADIUS: f32 = 34.0;
const KNOB: f32 = 8.0;

/// Draws the ball; tells which axis was clicked.
pub fn show(ui: &Ui, rect: Rect, projection: &Projection) -> Option<Side> {
    let center = rect.right_top() + vec2(-RADIUS - KNOB - 8.0, RADIUS + KNOB + 8.0);
    let colors = [
        Color32::from_rgb(213, 94, 80),
        Color32::from_rgb(90, 170, 80),
        Color32::from_rgb(86, 150, 233),
    ];
    let ends = [
        (Vec3::X, 0, "X", Side::Right, "View from the right (3)"),
        (-Vec3::X, 0, "", Side::Left, "View from the left (Ctrl+3)"),
        (Vec3::Y, 1, "Y", Side::Back, "View from the back (Ctrl+1)"),
        (-Vec3::Y, 1, "", Side::Front, "View from the front (1)"),
        (Vec3::Z, 2, "Z", Side::Top, "View from the top (7)"),
        (-Vec3::Z, 2, "", Side::Bottom, "View from below (Ctrl+7)"),
    ];
    let mut ends = ends.map(|(axis, index, letter, side, help)| {
        let depth = axis.dot(projection.forward);
        let offset = vec2(axis.dot(projection.right), -axis.dot(projection.up)) * RADIUS;
        (depth, center + offset, colors[index], letter, side, help)
    });
    // Those in front are drawn last.
    ends.sort_by(|a, b| b.0.total_cmp(&a.0));
    let painter = ui.painter_at(rect);
    let backdrop = ui.visuals().window_fill.gamma_multiply(0.55);
    painter.circle_filled(center, RADIUS + KNOB + 2.0, backdrop);
    let mut clicked = None;
    for (_, place, color, letter, side, help) in ends {
        let help = &keys::named(ui.ctx(), help);
        let knob = Rect::from_center_size(place, vec2(2.0 * KNOB, 2.0 * KNOB));
        let response = ui.interact(knob, Id::unique(("axis", help)), Sense::click());
        response
            .widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Button, true, help));
        if letter.is_empty() {
            painter.circle(place, KNOB - 2.0, backdrop, Stroke::new(1.5, color));
        } else {
            painter.line_segment([center, place], Stroke::new(2.0, color));
            painter.circle_filled(place, KNOB, color);
            let font = FontId::proportional(12.0);
            painter.text(place, Align2::CENTER_CENTER, letter, font, Color32::BLACK);
        }
        if response.hovered() {
            painter.circle_stroke(place, KNOB, Stroke::new(1.5, ui.visuals().strong_text_color()));
        }
        if response.on_hover_text(help).clicked() {
            clicked = Some(side);
        }
    }
    clicked
}
