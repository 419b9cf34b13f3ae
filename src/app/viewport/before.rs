//! The line that divides the picture into the scene as it was and the scene as it is relit.

use eframe::egui::{self, Color32, Rect, Response, Sense, Stroke, Ui, pos2, vec2};

use crate::app::viewport::Viewport;
use crate::app::viewport::content::Shading;

/// Draws it where it is wanted, and lets it be dragged.
pub fn show(view: &mut Viewport, ui: &mut Ui, response: &Response) {
    let Some(part) = view.settings.before.filter(|_| view.settings.shading == Shading::Relit)
    else {
        return;
    };
    let rect = response.rect;
    let x = rect.left() + part * rect.width();
    let handle = Rect::from_center_size(pos2(x, rect.bottom() - 40.0), vec2(26.0, 26.0));
    let grip = ui.interact(handle, ui.scope_id().with("before and after"), Sense::drag());
    grip.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Before and after"));
    if let Some(pointer) = grip.interact_pointer_pos().filter(|_| grip.dragged()) {
        let part = (pointer.x - rect.left()) / rect.width();
        view.settings.before = Some(part.clamp(0.02, 0.98));
    }
    let grip = grip
        .on_hover_cursor(egui::CursorIcon::ResizeHorizontal)
        .on_hover_text("Before on the left, after on the right; drag");
    let painter = ui.painter_at(rect);
    let stroke = Stroke::new(2.0, Color32::WHITE);
    painter.vline(x, rect.y_range(), Stroke::new(3.5, Color32::from_black_alpha(110)));
    painter.vline(x, rect.y_range(), stroke);
    let fill = if grip.hovered() || grip.dragged() { 70 } else { 40 };
    painter.circle(handle.center(), 12.0, Color32::from_gray(fill), stroke);
    for side in [-1.0, 1.0] {
        let tip = handle.center() + vec2(8.0 * side, 0.0);
        let corners = vec![tip, tip - vec2(4.0 * side, 4.0), tip - vec2(4.0 * side, -4.0)];
        painter.add(egui::Shape::convex_polygon(corners, Color32::WHITE, Stroke::NONE));
    }
}
