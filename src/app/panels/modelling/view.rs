//! The photograph that is drawn on: the mapping from its pixels to the window, and the overlay.

use eframe::egui::{
    self, Color32, Modifiers, PointerButton, Pos2, Rect, Sense, TextureId, Vec2, pos2, vec2,
};
use glam::DVec2;

use super::{blink, hands, overlay};
use crate::app::actions::Action;
use crate::app::modelling::tool::Tool;
use crate::app::modelling::{ModelPage, Picture, Placement};
use crate::app::project::Project;
use crate::model::Model;

/// Free space around a photograph, in points: ends of strokes may lie outside of it.
const MARGIN: f32 = 10.0;
/// Side of the magnifier in points, and how many points a pixel has in it.
const LOUPE: f32 = 132.0;
const LOUPE_ZOOM: f32 = 6.0;

/// Where the pixels of the photograph lie in the window.
#[derive(Clone, Copy)]
pub struct View {
    /// Of the window.
    pub rect: Rect,
    /// Where the image's top left corner is.
    pub origin: Pos2,
    /// Points a pixel.
    pub scale: f32,
}

impl View {
    fn new(rect: Rect, size: Vec2, placement: Placement) -> Self {
        let room = (rect.size() - Vec2::splat(2.0 * MARGIN)).max(Vec2::splat(8.0));
        let fit = (room.x / size.x).min(room.y / size.y);
        let scale = (fit * placement.zoom).max(1e-4);
        let origin = rect.center() + placement.shift - 0.5 * scale * size;
        Self { rect, origin, scale }
    }

    /// Where a pixel is.
    pub fn at(&self, pixel: DVec2) -> Pos2 {
        let scale = f64::from(self.scale);
        self.origin + vec2((pixel.x * scale) as f32, (pixel.y * scale) as f32)
    }

    /// The pixel at a place.
    pub fn pixel(&self, place: Pos2) -> DVec2 {
        let from = place - self.origin;
        DVec2::new(f64::from(from.x), f64::from(from.y)) / f64::from(self.scale)
    }
}

pub fn view_ui(
    ui: &mut egui::Ui,
    page: &mut ModelPage,
    model: &Model,
    project: Option<&Project>,
    actions: &mut Vec<Action>,
) {
    let rect = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(rect, Sense::drag());
    let name = "Photograph to draw on";
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, name));
    let size = model.photographs[page.shown].size;
    let size = vec2(size.0 as f32, size.1 as f32);
    navigate(ui, page, &response);
    let view = View::new(rect, size, page.placement);
    hands::hands_ui(ui, page, model, &view, &response, actions);
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, ui.visuals().extreme_bg_color);
    let own = Rect::from_min_size(view.origin, view.scale * size);
    let shown = match page.pictures.full(page.shown) {
        Some(Picture::Shown(texture, covered)) => Some((texture.id(), *covered)),
        Some(Picture::Failed(problem)) => {
            let problem = problem.clone();
            message(ui, own.intersect(rect), &problem);
            None
        }
        None => match page.pictures.small(page.shown) {
            Some(Picture::Shown(texture, covered)) => Some((texture.id(), *covered)),
            _ => {
                message(ui, own.intersect(rect), "Reading the photograph…");
                None
            }
        },
    };
    let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
    if let Some((texture, covered)) = shown {
        // Pixels beyond the last whole square are not shown, and not stretched into.
        let place = Rect::from_min_size(view.origin, view.scale * covered.min(size));
        painter.image(texture, place, whole, Color32::WHITE);
    }
    blink::key_ui(ui, page);
    if !blink::faces_ui(&painter, page, project, &view) {
        overlay::overlay_ui(&painter, page, model, &view);
    }
    if let Some((texture, covered)) = shown
        && let Some(cursor) = response.hover_pos().or(response.interact_pointer_pos())
        && (page.drag.is_some() || page.tool != Tool::Select)
        && !matches!(page.tool, Tool::Lasso(_))
        && own.contains(cursor)
        && !hands::is_asked(ui)
    {
        loupe(ui, &painter, &view, (texture, covered), cursor);
    }
    cursor_icon(ui, page, &response);
}

fn message(ui: &mut egui::Ui, rect: Rect, text: &str) {
    ui.painter().rect_filled(rect, 0.0, ui.visuals().faint_bg_color);
    // Text that can be selected would take what is drawn there.
    let label = egui::Label::new(egui::RichText::new(text).weak()).wrap().selectable(false);
    ui.put(rect.shrink2(vec2(0.1, 0.3) * rect.size()), label);
}

/// The wheel zooms to the cursor, the middle button moves.
fn navigate(ui: &egui::Ui, page: &mut ModelPage, response: &egui::Response) {
    let motion = ui.input(|input| input.pointer.delta());
    let alt = ui.input(|input| input.modifiers.alt);
    let middle = response.dragged_by(PointerButton::Middle);
    if middle || (alt && response.dragged_by(PointerButton::Primary) && page.drag.is_none()) {
        page.placement.shift += motion;
    }
    if !response.contains_pointer() {
        return;
    }
    let (scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta.y, input.zoom_delta()));
    let factor = (0.0025 * scroll).exp() * pinch;
    if let Some(cursor) = response.hover_pos().filter(|_| factor != 1.0) {
        zoom(&mut page.placement, factor, cursor - response.rect.center());
    }
    // A plus or minus of the keyboard zooms, too.
    if !ui.ctx().text_edit_focused() {
        for (key, factor) in
            [(egui::Key::Plus, 1.25), (egui::Key::Equals, 1.25), (egui::Key::Minus, 0.8)]
        {
            if ui.input_mut(|input| input.consume_key(Modifiers::NONE, key)) {
                let middle =
                    response.hover_pos().map_or(Vec2::ZERO, |own| own - response.rect.center());
                zoom(&mut page.placement, factor, middle);
            }
        }
    }
}

fn zoom(placement: &mut Placement, factor: f32, cursor: Vec2) {
    let next = (placement.zoom * factor).clamp(0.2, 100.0);
    let factor = next / placement.zoom;
    placement.shift = cursor + (placement.shift - cursor) * factor;
    placement.zoom = next;
}

/// The pixels under the cursor, large, in a corner away from it.
fn loupe(
    ui: &egui::Ui,
    painter: &egui::Painter,
    view: &View,
    (texture, covered): (TextureId, Vec2),
    cursor: Pos2,
) {
    let side = LOUPE.min(0.4 * view.rect.size().min_elem());
    let is_left = cursor.x > view.rect.center().x;
    let corner = match is_left {
        true => view.rect.left_top() + Vec2::splat(8.0),
        false => view.rect.right_top() + vec2(-8.0 - side, 8.0),
    };
    let rect = Rect::from_min_size(corner, Vec2::splat(side));
    let pixel = view.pixel(cursor);
    let zoom = LOUPE_ZOOM.max(2.0 * view.scale);
    let half = 0.5 * side / zoom;
    let middle = vec2(pixel.x as f32, pixel.y as f32);
    let uv = Rect::from_min_max(
        ((middle - Vec2::splat(half)) / covered).to_pos2(),
        ((middle + Vec2::splat(half)) / covered).to_pos2(),
    );
    painter.rect_filled(rect, 2.0, Color32::BLACK);
    painter.image(texture, rect, uv, Color32::WHITE);
    let middle = rect.center();
    for (stroke, gap) in [(Color32::from_black_alpha(150), 3.0), (Color32::WHITE, 1.0)] {
        for way in [vec2(1.0, 0.0), vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(0.0, -1.0)] {
            let ends = [middle + 4.0 * way, middle + 16.0 * way];
            painter.line_segment(ends, egui::Stroke::new(gap, stroke));
        }
    }
    let edge = egui::Stroke::new(1.0, ui.visuals().strong_text_color());
    painter.rect_stroke(rect, 2.0, edge, egui::StrokeKind::Outside);
    let text = format!("{:.1}, {:.1} px", pixel.x, pixel.y);
    overlay::label(painter, rect.left_bottom() + vec2(4.0, -4.0), egui::Align2::LEFT_BOTTOM, &text);
}

fn cursor_icon(ui: &egui::Ui, page: &ModelPage, response: &egui::Response) {
    if !response.contains_pointer() {
        return;
    }
    let icon = match page.tool {
        _ if response.dragged_by(PointerButton::Middle) => egui::CursorIcon::Grabbing,
        Tool::Select => egui::CursorIcon::Default,
        _ => egui::CursorIcon::Crosshair,
    };
    ui.ctx().set_cursor_icon(icon);
}
