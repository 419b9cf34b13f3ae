//! What is drawn over the photograph: the solved things with hidden edges dashed, the strokes
//! coloured by kind, and their errors.

use eframe::egui::{
    Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke as Line, StrokeKind, vec2,
};
use glam::DVec2;

use super::hands::{self, places, projected};
use super::view::View;
use crate::app::modelling::ModelPage;
use crate::app::modelling::drag::{Drag, Dragged};
use crate::app::modelling::tool::{Selected, Target, Tool};
use crate::model::from_points::{Wanted, holds};
use crate::model::{Axis, Model, Place, Stroke};

/// Orange as what is selected in the 3D view; cyan and magenta beside it: told apart by any eye.
pub const EDGE: Color32 = Color32::from_rgb(255, 150, 30);
const MARK: Color32 = Color32::from_rgb(64, 220, 255);
/// Lines that were found to be edges.
const ON_LINE: Color32 = Color32::from_rgb(120, 255, 120);
const OFF: Color32 = Color32::from_rgb(255, 80, 200);
const POINT: Color32 = Color32::from_rgb(250, 240, 160);
const FOUND: Color32 = Color32::from_rgba_premultiplied(96, 120, 120, 120);
const RIM: Color32 = Color32::from_black_alpha(130);
/// A stroke that is off by more is marked, in pixels.
const SHOWN_PX: f64 = 1.0;

/// The colour of an axis, as in the 3D view.
pub fn axis_color(axis: Axis) -> Color32 {
    match axis {
        Axis::X => Color32::from_rgb(235, 100, 84),
        Axis::Y => Color32::from_rgb(96, 196, 88),
        Axis::Z => Color32::from_rgb(100, 166, 255),
    }
}

pub fn overlay_ui(painter: &Painter, page: &ModelPage, model: &Model, view: &View) {
    if page.overlays.lines {
        lines(painter, page, view);
    }
    if page.overlays.points || matches!(page.tool, Tool::Lasso(_)) {
        points(painter, page, model, view);
    }
    if page.overlays.model {
        solved(painter, page, view);
        corners(painter, page, model, view);
    }
    if page.overlays.strokes {
        // The worst of the photograph, unless all are good.
        let own = |stroke: &usize| model.strokes[*stroke].photograph() == Some(page.shown);
        let residual = |stroke: &usize| page.residual(*stroke).unwrap_or(0.0);
        let worst = (0..model.strokes.len())
            .filter(own)
            .max_by(|a, b| residual(a).total_cmp(&residual(b)))
            .filter(|stroke| residual(stroke) > SHOWN_PX);
        for index in (0..model.strokes.len()).filter(own) {
            stroke(painter, page, model, view, index, worst == Some(index));
        }
    }
    known(painter, page, model, view);
    crossing(painter, page, view);
    target(painter, page, model, view);
}

/// The two lines on whose crossing a corner comes to lie, and a square around that.
fn crossing(painter: &Painter, page: &ModelPage, view: &View) {
    let pointer = painter.ctx().input(|input| input.pointer.latest_pos());
    let Some(pointer) = pointer.filter(|own| view.rect.contains(*own)) else { return };
    let Some(found) = hands::crossing(painter.ctx(), page, view, pointer) else { return };
    for line in found.lines {
        segment(painter, line.ends.map(|end| view.at(end)), Line::new(1.6, Color32::WHITE));
    }
    let square = Rect::from_center_size(view.at(found.at), vec2(13.0, 13.0));
    for line in [Line::new(4.0, RIM), Line::new(2.0, Color32::WHITE)] {
        painter.rect_stroke(square, 0.0, line, StrokeKind::Middle);
    }
}

/// Lines that were found in the photograph: faint, on dark as on bright.
fn lines(painter: &Painter, page: &ModelPage, view: &View) {
    for line in page.lines.get(&page.shown).iter().flat_map(|lines| lines.iter()) {
        let ends = line.ends.map(|end| view.at(end));
        painter.line_segment(ends, Line::new(2.4, Color32::from_black_alpha(60)));
        painter.line_segment(ends, Line::new(1.0, FOUND));
    }
}

/// Points that an engine has found in this photograph, where its camera sees them now.
fn points(painter: &Painter, page: &ModelPage, model: &Model, view: &View) {
    let Some(solution) = page.solution() else { return };
    let Some(Some(camera)) = solution.cameras.get(page.shown) else { return };
    let is_lasso = |drag: &&Drag| matches!(drag.what, Dragged::New(Tool::Lasso(_)));
    let around = page.drag.as_ref().filter(is_lasso).map_or(&[][..], |drag| &drag.way);
    for point in model.found_points.iter().filter(|own| own.photographs.contains(&page.shown)) {
        let place = solution.state.found.point(point.position);
        if let Some((pixel, _)) = camera.project(place) {
            let (radius, color) = if holds(around, pixel) { (2.6, EDGE) } else { (1.6, POINT) };
            painter.circle(view.at(pixel), radius, color, Line::new(0.8, RIM));
        }
    }
    let outline: Vec<Pos2> = around.iter().map(|pixel| view.at(*pixel)).collect();
    if let [first, .., last] = outline[..] {
        painter.extend(Shape::dashed_line(
            &[last, first],
            Line::new(1.2, Color32::WHITE),
            5.0,
            4.0,
        ));
        for line in [Line::new(3.4, RIM), Line::new(1.6, Color32::WHITE)] {
            painter.line(outline.clone(), line);
        }
    }
}

/// The edges of the solved things: those behind others dashed.
fn solved(painter: &Painter, page: &ModelPage, view: &View) {
    let Some(drawing) = page.drawing.as_ref().filter(|own| own.photograph == page.shown) else {
        return;
    };
    // While the strokes are being solved, what is drawn is of before.
    let color = if page.is_solved() { EDGE } else { EDGE.gamma_multiply(0.6) };
    let line = |points: &[glam::Vec2]| -> Vec<Pos2> {
        points.iter().map(|point| view.at(point.as_dvec2())).collect()
    };
    for stroke in drawing.strokes.iter().filter(|own| own.is_hidden && page.overlays.hidden) {
        let dashes = Shape::dashed_line(
            &line(&stroke.points),
            Line::new(1.2, color.gamma_multiply(0.75)),
            5.0,
            4.0,
        );
        painter.extend(dashes);
    }
    let seen = || drawing.strokes.iter().filter(|own| !own.is_hidden);
    for stroke in seen() {
        painter.line(line(&stroke.points), Line::new(3.2, Color32::from_black_alpha(70)));
    }
    for stroke in seen() {
        painter.line(line(&stroke.points), Line::new(1.6, color));
    }
}

/// Corners of the selected thing that this photograph does not show yet, to be dragged.
fn corners(painter: &Painter, page: &ModelPage, model: &Model, view: &View) {
    let selected = page.selected.thing(model);
    for (place, pixel) in places(page, model) {
        if model.pick_of(page.shown, place).is_some() {
            continue;
        }
        let at = view.at(pixel);
        let is_own = matches!(place, Place::Corner { thing, .. } if Some(thing) == selected);
        let radius = if is_own { 4.0 } else { 2.5 };
        painter.circle(at, radius, RIM, Line::new(1.4, EDGE));
    }
}

fn stroke(
    painter: &Painter,
    page: &ModelPage,
    model: &Model,
    view: &View,
    index: usize,
    is_worst: bool,
) {
    let own = &model.strokes[index];
    let is_selected = page.selected == Selected::Stroke(index);
    let width = if is_selected { 3.0 } else { 1.8 };
    let color = own.axis().map_or(MARK, axis_color);
    let off = page.residual(index);
    let mut place = None;
    match own {
        Stroke::Line { from, to, axis, .. } => {
            let ends = [view.at(*from), view.at(*to)];
            segment(painter, ends, Line::new(width, color));
            arrow(painter, ends, Line::new(width, color));
            let name = axis.name();
            label(painter, ends[0].lerp(ends[1], 0.5) + vec2(6.0, -6.0), Align2::LEFT_BOTTOM, name);
            place = Some(ends[1]);
        }
        Stroke::Edge { from, to, .. } => {
            let ends = [view.at(*from), view.at(*to)];
            if own.is_found() && !is_selected {
                painter.line_segment(ends, Line::new(1.0, ON_LINE));
            } else {
                segment(painter, ends, Line::new(width, color));
            }
            place = Some(ends[0].lerp(ends[1], 0.5));
        }
        Stroke::Pick { at, pixel, .. } => {
            let own = view.at(*pixel);
            if let Some(seen) = projected(page, *at)
                && seen.distance(*pixel) > SHOWN_PX
            {
                painter.line_segment([own, view.at(seen)], Line::new(1.6, OFF));
            }
            cross(painter, own, if is_selected { 8.0 } else { 5.0 }, Line::new(width, color));
            place = Some(own);
        }
        Stroke::Rim { pixel, .. } => {
            let own = view.at(*pixel);
            cross(painter, own, if is_selected { 8.0 } else { 5.0 }, Line::new(width, color));
            place = Some(own);
        }
        Stroke::Position { .. } | Stroke::Length { .. } => {}
    }
    let has_ends = is_selected && !own.is_found();
    if has_ends && let Stroke::Line { from, to, .. } | Stroke::Edge { from, to, .. } = own {
        for end in [from, to] {
            painter.circle(view.at(*end), 4.5, RIM, Line::new(1.6, color));
        }
    }
    if let (Some(place), Some(off), true) = (place, off, is_worst || is_selected) {
        let text = format!("{}{off:.1} px", if is_worst { "worst  " } else { "off by " });
        if is_worst {
            painter.circle_stroke(place, 11.0, Line::new(2.0, OFF));
        }
        label(painter, place + vec2(12.0, 8.0), Align2::LEFT_TOP, &text);
    }
}

/// The origin, and known lengths.
fn known(painter: &Painter, page: &ModelPage, model: &Model, view: &View) {
    let all = places(page, model);
    let at =
        |place: &Place| all.iter().find(|(own, _)| own == place).map(|(_, pixel)| view.at(*pixel));
    for (index, stroke) in model.strokes.iter().enumerate() {
        let width = if page.selected == Selected::Stroke(index) { 2.6 } else { 1.4 };
        match stroke {
            Stroke::Position { at: place, position, .. } => {
                let Some(middle) = at(place) else { continue };
                painter.circle_stroke(middle, 8.0, Line::new(width + 1.6, RIM));
                painter.circle_stroke(middle, 8.0, Line::new(width, Color32::WHITE));
                let text = match *position == glam::DVec3::ZERO {
                    true => "origin".to_owned(),
                    false => {
                        let [x, y, z] = position.to_array();
                        format!("{x:.2} {y:.2} {z:.2} m")
                    }
                };
                label(painter, middle + vec2(-10.0, 10.0), Align2::RIGHT_TOP, &text);
            }
            Stroke::Length { between: [a, b], length_m, .. } => {
                let (Some(a), Some(b)) = (at(a), at(b)) else { continue };
                let line =
                    |width, color| Shape::dashed_line(&[a, b], Line::new(width, color), 7.0, 5.0);
                painter.extend(line(width + 1.4, RIM));
                painter.extend(line(width, Color32::WHITE));
                label(painter, a.lerp(b, 0.5), Align2::CENTER_CENTER, &format!("{length_m:.3} m"));
            }
            _ => {}
        }
    }
}

/// What the next press marks, beside the cursor; what is being drawn and is no model yet.
fn target(painter: &Painter, page: &ModelPage, model: &Model, view: &View) {
    let Some(cursor) = painter.ctx().input(|input| input.pointer.hover_pos()) else { return };
    if !view.rect.contains(cursor) {
        return;
    }
    let text = match page.tool {
        Tool::Select => return,
        Tool::Lasso(Wanted::Plane) => "plane from points".to_owned(),
        Tool::Lasso(Wanted::Box) => "box from points".to_owned(),
        Tool::Line(axis) => axis.name().to_owned(),
        Tool::Mark(target) => target.name(model),
        Tool::Origin => "origin".to_owned(),
        Tool::Length => "known length".to_owned(),
    };
    label(painter, cursor + vec2(14.0, -10.0), Align2::LEFT_BOTTOM, &text);
    if let Some(drag) = page.drag.as_ref().filter(|_| page.tool == Tool::Length) {
        segment(painter, [view.at(drag.from), cursor], Line::new(1.4, Color32::WHITE));
    }
    if let Tool::Mark(Target::Edge(between)) = page.tool {
        let ends = between.map(|place| projected(page, place).map(|own: DVec2| view.at(own)));
        if let [Some(a), Some(b)] = ends {
            painter.line_segment([a, b], Line::new(4.0, EDGE.gamma_multiply(0.45)));
        }
    }
}

fn segment(painter: &Painter, ends: [Pos2; 2], line: Line) {
    painter.line_segment(ends, Line::new(line.width + 1.8, RIM));
    painter.line_segment(ends, line);
}

/// The head of an arrow at the second end.
fn arrow(painter: &Painter, [from, to]: [Pos2; 2], line: Line) {
    let along = (to - from).normalized();
    for side in [-1.0, 1.0] {
        let back = to - 9.0 * along + 4.5 * side * along.rot90();
        segment(painter, [to, back], line);
    }
}

fn cross(painter: &Painter, middle: Pos2, half: f32, line: Line) {
    for line in [Line::new(line.width + 1.8, RIM), line] {
        painter.line_segment([middle - vec2(half, 0.0), middle + vec2(half, 0.0)], line);
        painter.line_segment([middle - vec2(0.0, half), middle + vec2(0.0, half)], line);
    }
}

/// White text on a dark ground, legible on any photograph.
pub fn label(painter: &Painter, at: Pos2, anchor: Align2, text: &str) {
    let galley =
        painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), Color32::WHITE);
    let rect = anchor.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand2(vec2(3.0, 1.0)), 2.0, Color32::from_black_alpha(170));
    painter.galley(rect.min, galley, Color32::WHITE);
}
