//! Measuring a length over a photograph of an import, and the scale that follows from it.

use eframe::egui::{self, Align2, Color32, CursorIcon, DragValue, Painter, Rect, Response, Stroke};
use glam::DVec2;

use crate::app::entry;
use crate::app::import::{ImportPage, REACH};
use crate::app::panels::numbers::short;
use crate::io::import::Picked;
use crate::scene::Camera;

/// Yellow, beside the orange, blue and magenta of what else is drawn there.
const MEASURED: Color32 = Color32::from_rgb(255, 230, 60);

/// What is measured, what it is in truth, and the button that sets the scale.
pub fn measure_ui(ui: &mut egui::Ui, page: &mut ImportPage) {
    ui.horizontal_wrapped(|ui| {
        let own = &mut page.measuring;
        let Some(length) = own.length_m() else {
            let what = match own.ends.len() {
                0 => "Click a place: COLMAP's points, corners of the mesh, or the mesh.",
                1 => "Click the other end, on this photograph or on another.",
                _ => "Both places are the same: click two that are apart.",
            };
            ui.weak(what);
            missed_ui(ui, own.has_missed);
            return;
        };
        ui.label(format!("Measured: {} m", short(length)))
            .on_hover_text("At the present scale. Another click begins anew");
        let label = ui.label("in truth");
        let mut truth = own.true_m.unwrap_or(length);
        let field = DragValue::new(&mut truth).range(1e-6..=1e6).speed(0.005 * length);
        let field = field.max_decimals(6).suffix(" m");
        let help = "The true length: 2.4, 240 cm";
        let response = entry::number(ui, field, entry::Unit::Length);
        if response.on_hover_text(help).labelled_by(label.id).changed() {
            own.true_m = Some(truth);
        }
        let obstacle = own.obstacle();
        let button = egui::Button::new("Set the scale");
        let clicked = ui
            .add_enabled(obstacle.is_none(), button)
            .on_hover_text("Change Scale at the left, so that this length is right")
            .on_disabled_hover_text(obstacle.unwrap_or_default())
            .clicked();
        missed_ui(ui, own.has_missed);
        if clicked {
            page.set_scale();
        }
    });
}

fn missed_ui(ui: &mut egui::Ui, has_missed: bool) {
    if has_missed {
        let text = "There is neither a point nor the mesh where you clicked.";
        ui.colored_label(ui.visuals().warn_fg_color, text);
    }
}

/// Takes a click on the photograph, which is drawn in `rect`, its pixels `scale` points wide.
pub fn click(
    ui: &egui::Ui,
    page: &mut ImportPage,
    response: &Response,
    (rect, scale): (Rect, f32),
) {
    if !page.measuring.is_on {
        return;
    }
    if response.hovered() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    if response.clicked()
        && let Some(at) = response.interact_pointer_pos()
    {
        let pixel = (at - rect.min) / scale;
        page.measure_at(DVec2::new(pixel.x.into(), pixel.y.into()), (REACH / scale).into());
    }
}

/// Draws both ends and the line between them, as far as the camera sees them.
pub fn draw(painter: &Painter, page: &ImportPage, camera: &Camera, (rect, scale): (Rect, f32)) {
    if !page.measuring.is_on {
        return;
    }
    let under = |width: f32| Stroke::new(width + 2.0, Color32::from_black_alpha(160));
    let seen: Vec<_> = page
        .measuring
        .ends
        .iter()
        .filter_map(|(place, picked)| {
            let (pixel, _) = camera.project(*place)?;
            Some((rect.min + egui::vec2(pixel.x as f32, pixel.y as f32) * scale, *picked))
        })
        .collect();
    if let [(a, _), (b, _)] = seen[..] {
        painter.line_segment([a, b], under(2.0));
        painter.line_segment([a, b], Stroke::new(2.0, MEASURED));
        if let Some(length) = page.measuring.length_m() {
            let text = format!("{} m", short(length));
            let font = egui::FontId::proportional(13.0);
            let galley = painter.layout_no_wrap(text, font, MEASURED);
            let place = Align2::CENTER_BOTTOM
                .anchor_size(a + 0.5 * (b - a) - egui::vec2(0.0, 6.0), galley.size());
            painter.rect_filled(place.expand(3.0), 3.0, Color32::from_black_alpha(190));
            painter.galley(place.min, galley, MEASURED);
        }
    }
    for (at, picked) in seen {
        painter.circle_stroke(at, 5.0, under(2.0));
        match picked {
            Picked::Point => drop(painter.circle_stroke(at, 5.0, Stroke::new(2.0, MEASURED))),
            Picked::Corner => {
                let square = Rect::from_center_size(at, egui::Vec2::splat(9.0));
                let stroke = Stroke::new(2.0, MEASURED);
                painter.rect_stroke(square, 0.0, stroke, egui::StrokeKind::Middle);
            }
            Picked::Surface => drop(painter.circle_filled(at, 4.0, MEASURED)),
        }
    }
}
