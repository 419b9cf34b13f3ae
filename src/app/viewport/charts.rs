//! Charts over the photograph that is looked through: where their corners are, and the tool that places
//! them.

use eframe::egui::{
    self, Align2, Color32, Key, Modifiers, PointerButton, Pos2, Response, Stroke, Ui,
};
use glam::DVec2;

use crate::app::viewport::Viewport;
use crate::app::viewport::content::{Content, ViewportEvent};
use crate::app::viewport::masks::{drawn_at, pixel_at, under};
use crate::app::viewport::projection::Projection;

/// A corner can be dragged from this many points away.
const REACH: f32 = 12.0;
/// Radius of the mark on a corner, in points. It is open, so that the corner is seen.
const MARK: f32 = 5.0;
const COLOR: Color32 = Color32::from_rgb(64, 220, 255);
const UNPLACED: Color32 = Color32::from_rgb(255, 176, 64);

/// The tool that places corners, and what is under way with it.
#[derive(Default)]
pub struct Cornering {
    pub is_active: bool,
    /// Corners that were clicked, in pixels, of which chart in which photograph; fewer than four.
    begun: Vec<DVec2>,
    of: Option<(usize, usize)>,
    /// The corner that is dragged, and where all four are meanwhile.
    dragged: Option<(usize, [DVec2; 4])>,
}

impl Cornering {
    /// Whether corners are being placed.
    pub fn is_at_work(&self) -> bool {
        !self.begun.is_empty() || self.dragged.is_some()
    }

    /// Corners of the chart that were clicked so far.
    pub fn begun(&self) -> usize {
        self.begun.len()
    }

    /// Forgets what belongs to a photograph.
    pub fn clear(&mut self) {
        *self = Self { is_active: self.is_active, ..Self::default() };
    }
}

/// Whether the tool has the photograph: clicks and drags are for corners.
pub fn is_active(view: &Viewport) -> bool {
    view.cornering.is_active && view.through.is_some()
}

/// The corners of a chart in a photograph.
fn corners_in(content: &Content, chart: usize, photograph: usize) -> Option<[DVec2; 4]> {
    let views = &content.charts.get(chart)?.chart.views;
    Some(views.iter().find(|own| own.photograph == photograph)?.corners_px)
}

/// Places corners with the tool; says whether the pointer is taken.
pub fn interact(
    view: &mut Viewport,
    ui: &Ui,
    response: &Response,
    content: &Content,
    p: &Projection,
    events: &mut Vec<ViewportEvent>,
) -> bool {
    let found = under(view, content).filter(|_| view.cornering.is_active);
    let selected = content.selected_chart.filter(|&chart| chart < content.charts.len());
    let (Some((photograph, shown)), Some(chart)) = (found, selected) else {
        view.cornering.clear();
        return false;
    };
    let cornering = &mut view.cornering;
    if cornering.of != Some((photograph, chart)) {
        cornering.clear();
        cornering.of = Some((photograph, chart));
    }
    if response.contains_pointer() {
        ui.ctx().set_cursor_icon(egui::CursorIcon::Crosshair);
    }
    let is_free = !ui.ctx().text_edit_focused();
    let pressed = |key| is_free && ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
    if cornering.is_at_work() && pressed(Key::Escape) {
        cornering.begun.clear();
        cornering.dragged = None;
        return true;
    }
    if !cornering.begun.is_empty() && pressed(Key::Backspace) {
        cornering.begun.pop();
    }
    let camera = &shown.camera;
    let place = |position: Pos2| pixel_at(camera, p, position - response.rect.min);
    let Some(corners_px) = corners_in(content, chart, photograph) else {
        let clicked = response.clicked_by(PointerButton::Primary);
        if let Some(at) = response.interact_pointer_pos().filter(|_| clicked).and_then(place) {
            response.request_focus();
            cornering.begun.push(at);
        }
        if let &[a, b, c, d] = cornering.begun.as_slice() {
            cornering.begun.clear();
            events.push(ViewportEvent::Cornered { photograph, corners_px: [a, b, c, d] });
            ui.ctx().request_repaint();
        }
        return true;
    };
    let pressed = response.is_pointer_button_down_on()
        && ui.input(|input| input.pointer.button_pressed(PointerButton::Primary));
    if let Some(position) = response.interact_pointer_pos().filter(|_| pressed) {
        response.request_focus();
        let off = |corner: DVec2| {
            let drawn = drawn_at(camera, p, corner)?;
            Some((response.rect.min + drawn).distance(position))
        };
        let near = (0..4).filter_map(|k| Some((k, off(corners_px[k])?)));
        let nearest = near.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, off)| *off <= REACH);
        cornering.dragged = nearest.map(|(k, _)| (k, corners_px));
    } else if let Some((corner, now)) = &mut cornering.dragged
        && let Some(at) = response.interact_pointer_pos().and_then(place)
    {
        now[*corner] = at;
    }
    let is_down = ui.input(|input| input.pointer.primary_down());
    if let Some((_, now)) = cornering.dragged.take_if(|_| !is_down)
        && now != corners_px
    {
        events.push(ViewportEvent::Cornered { photograph, corners_px: now });
        ui.ctx().request_repaint();
    }
    true
}

/// The charts that the photograph shows, and the corners that were clicked.
pub fn draw(view: &Viewport, ui: &Ui, response: &Response, content: &Content, p: &Projection) {
    let Some((photograph, shown)) = under(view, content) else { return };
    let (camera, origin) = (&shown.camera, response.rect.min);
    let painter = ui.painter_at(response.rect);
    let at = |corner: &DVec2| Some(origin + drawn_at(camera, p, *corner)?);
    let shadowed = |points: &[Pos2], color: Color32, width: f32| {
        painter.line(points.to_vec(), Stroke::new(width + 2.0, Color32::from_black_alpha(160)));
        painter.line(points.to_vec(), Stroke::new(width, color));
    };
    let marks = |points: &[Pos2], color: Color32| {
        for (number, &point) in (1..).zip(points) {
            painter.circle_stroke(point, MARK, Stroke::new(3.0, Color32::from_black_alpha(160)));
            painter.circle_stroke(point, MARK, Stroke::new(1.5, color));
            label(&painter, point + egui::vec2(8.0, -8.0), &number.to_string(), color);
        }
    };
    for (index, own) in content.charts.iter().enumerate() {
        let Some(corners) = corners_in(content, index, photograph) else { continue };
        let is_selected = content.selected_chart == Some(index);
        let corners = match view.cornering.dragged {
            Some((_, now)) if is_selected => now,
            _ => corners,
        };
        let points: Vec<Pos2> = corners.iter().filter_map(at).collect();
        let &[a, b, c, d] = points.as_slice() else { continue };
        let color = if own.placed.is_ok() { COLOR } else { UNPLACED };
        shadowed(&[a, b, c, d, a], color, if is_selected { 2.0 } else { 1.0 });
        if is_selected {
            marks(&points, color);
        }
        let lowest = points.iter().copied().max_by(|a, b| a.y.total_cmp(&b.y)).unwrap_or(a);
        label(&painter, lowest + egui::vec2(0.0, 8.0), &own.chart.name, color);
    }
    let begun: Vec<Pos2> = view.cornering.begun.iter().filter_map(at).collect();
    if !begun.is_empty() {
        let cursor = response.hover_pos();
        let line: Vec<Pos2> = begun.iter().copied().chain(cursor).collect();
        shadowed(&line, COLOR, 1.5);
        marks(&begun, COLOR);
    }
}

/// A word on a dark ground, so that it is legible over any photograph.
fn label(painter: &egui::Painter, place: Pos2, text: &str, color: Color32) {
    let font = egui::FontId::proportional(12.0);
    let galley = painter.layout_no_wrap(text.to_owned(), font, color);
    let rect = Align2::LEFT_CENTER.anchor_size(place, galley.size());
    painter.rect_filled(rect.expand2(egui::vec2(3.0, 1.0)), 3.0, Color32::from_black_alpha(160));
    painter.galley(rect.min, galley, color);
}
