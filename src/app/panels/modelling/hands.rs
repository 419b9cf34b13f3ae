//! Pointer input on the photograph: presses, drags and selections.

use std::sync::Arc;

use eframe::egui::{self, Key, Modifiers, PointerButton, Pos2};
use glam::{DVec2, DVec3};

use super::view::View;
use crate::app::actions::{Action, ModelAction};
use crate::app::modelling::ModelPage;
use crate::app::modelling::drag::{Drag, Dragged};
use crate::app::modelling::tool::{Selected, Target, Tool};
use crate::model::from_points::Wanted;
use crate::model::snap::{self, Crossing};
use crate::model::{Model, Place, Stroke};

/// How near the pointer must be to a mark, and to a line, in points.
const NEAR: f32 = 9.0;
const NEAR_LINE: f32 = 5.0;
/// How far a line moves to an edge of the photograph, and a corner to a crossing of two, in points
/// and at most in pixels.
const SNAP: f32 = 6.0;
const SNAP_CORNER: f32 = 9.0;
const MOST_SNAP_PX: f64 = 12.0;

/// Where something is moved from when the pointer has gone farther, in points.
const MOVED: f32 = 2.0;

/// Begins, follows and ends what the primary button does.
pub fn hands_ui(
    ui: &egui::Ui,
    page: &mut ModelPage,
    model: &Model,
    view: &View,
    response: &egui::Response,
    actions: &mut Vec<Action>,
) {
    let alt = ui.input(|input| input.modifiers.alt);
    // Where frames are slow, a click may begin and end within one.
    let is_pressed = response.drag_started_by(PointerButton::Primary)
        || response.contains_pointer()
            && ui.input(|input| input.pointer.button_pressed(PointerButton::Primary));
    if is_pressed
        && page.drag.is_none()
        && !alt
        && let Some(press) = ui
            .input(|input| input.pointer.press_origin())
            .or(response.interact_pointer_pos())
            .or(ui.input(|input| input.pointer.latest_pos()))
    {
        response.request_focus();
        begin(page, model, view, press);
    }
    if page.drag.is_some() {
        follow(ui, page, view, response, actions);
    } else if page.tool == Tool::Select && response.dragged_by(PointerButton::Primary) && !alt {
        page.placement.shift += ui.input(|input| input.pointer.delta());
    }
    // A question in front takes the keys.
    let is_typing = ui.ctx().text_edit_focused() || is_asked(ui);
    if page.drag.is_none()
        && page.tool != Tool::Select
        && !is_typing
        && ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Escape))
    {
        page.tool = Tool::Select;
    }
    // Skips a corner that this photograph does not show.
    if let Tool::Mark(target @ Target::Place(Place::Corner { .. })) = page.tool
        && !is_typing
        && ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Space))
        && let Some(next) = target.next(model, page.shown)
    {
        page.tool = Tool::Mark(next);
    }
}

/// Whether a question stands in front of the page.
pub fn is_asked(ui: &egui::Ui) -> bool {
    ui.memory(|memory| memory.top_modal_layer().is_some())
}

fn begin(page: &mut ModelPage, model: &Model, view: &View, press: Pos2) {
    let from = view.pixel(press);
    let what = match page.tool {
        Tool::Select => {
            let (selected, dragged) = under(page, model, view, press);
            page.selected = selected;
            match dragged {
                Some(dragged) => dragged,
                None => return,
            }
        }
        tool => Dragged::New(tool),
    };
    let Some(before) = page.model().cloned() else { return };
    page.drag =
        Some(Drag { what, photograph: page.shown, from, before, at: from, way: vec![from] });
}

fn follow(
    ui: &egui::Ui,
    page: &mut ModelPage,
    view: &View,
    response: &egui::Response,
    actions: &mut Vec<Action>,
) {
    let is_over = response.drag_stopped_by(PointerButton::Primary)
        || !ui.input(|input| input.pointer.primary_down());
    let place = response.interact_pointer_pos().or(ui.input(|input| input.pointer.latest_pos()));
    if let Some(place) = place {
        let pointer = view.pixel(place);
        let crossing = crossing(ui.ctx(), page, view, place);
        let Some(drag) = &mut page.drag else { return };
        // The corner lies on the crossing, wherever it was taken hold of.
        let by = crossing.zip(drag.corner(pointer)).map(|(own, corner)| own.at - corner);
        drag.at = pointer + by.unwrap_or_default();
    }
    if let Some(Drag { what: Dragged::New(Tool::Lasso(wanted)), .. }) = page.drag {
        lasso(ui, page, view, wanted, is_over, actions);
        return;
    }
    let Some(drag) = page.drag.clone() else { return };
    let near = |pixel: DVec2| place_near(page, &drag.before, view, view.at(pixel));
    let length = |between: [Place; 2]| {
        let [a, b] = between.map(|place| position(page, place));
        Some(a?.distance(b?))
    };
    if let Some((name, model)) = drag.model(near, length) {
        let mut model = model;
        if is_over {
            if is_snapping(ui.ctx(), page) {
                snap(page, view, &drag, &mut model);
            }
            ended(page, &drag, &model);
        }
        actions.push(Action::Model(ModelAction::Change(name, Arc::new(model))));
    }
    if is_over {
        page.drag = None;
    }
}

/// Draws around points, and has something fitted to those.
fn lasso(
    ui: &egui::Ui,
    page: &mut ModelPage,
    view: &View,
    wanted: Wanted,
    is_over: bool,
    actions: &mut Vec<Action>,
) {
    let Some(drag) = &mut page.drag else { return };
    let last = drag.way.last().copied().unwrap_or(drag.from);
    if view.at(last).distance(view.at(drag.at)) >= MOVED {
        drag.way.push(drag.at);
    }
    if ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Escape)) {
        page.drag = None;
    } else if is_over && let Some(drag) = page.drag.take() {
        // A click goes around nothing.
        if drag.way.len() > 2 {
            let fit = ModelAction::FitToPoints(drag.photograph, drag.way, wanted);
            actions.push(Action::Model(fit));
        }
    }
}

/// Whether what is drawn comes to lie on what the photograph shows: Ctrl draws as the hand does.
fn is_snapping(ctx: &egui::Context, page: &ModelPage) -> bool {
    page.snaps && !ctx.input(|input| input.modifiers.command)
}

fn reach_px(view: &View, points: f32) -> f64 {
    f64::from(points / view.scale).clamp(1.5, MOST_SNAP_PX)
}

/// The crossing of two lines of the photograph on which a corner comes to lie that is dragged, or that a
/// click would show.
pub fn crossing(
    ctx: &egui::Context,
    page: &ModelPage,
    view: &View,
    pointer: Pos2,
) -> Option<Crossing> {
    let pixel = view.pixel(pointer);
    let corner = match &page.drag {
        Some(drag) if drag.moves() && view.at(drag.from).distance(pointer) < MOVED => None,
        Some(drag) => drag.corner(pixel),
        None => match page.tool {
            Tool::Mark(Target::Place(_) | Target::NewPoint) => Some(pixel),
            _ => None,
        },
    };
    let photograph = page.drag.as_ref().map_or(page.shown, |drag| drag.photograph);
    let lines = page.lines.get(&photograph).filter(|_| is_snapping(ctx, page))?;
    snap::to_crossing(corner?, lines, reach_px(view, SNAP_CORNER))
}

/// Moves what was drawn onto a line that was found in the photograph, or else onto the edge that is
/// nearest, where there is one.
fn snap(page: &ModelPage, view: &View, drag: &Drag, model: &mut Model) {
    let index = match drag.what {
        Dragged::New(Tool::Line(_) | Tool::Mark(Target::Edge(_))) => model.drawn() - 1,
        Dragged::End(stroke, _) => stroke,
        _ => return,
    };
    let (Stroke::Line { from, to, .. } | Stroke::Edge { from, to, .. }) = &mut model.strokes[index]
    else {
        return;
    };
    let reach_px = reach_px(view, SNAP);
    let brightness = |pixel| page.pictures.brightness(drag.photograph, pixel);
    let lines = page.lines.get(&drag.photograph).map_or(&[][..], |lines| lines);
    let found = snap::to_lines([*from, *to], lines, reach_px);
    let found = found.or_else(|| snap::line([*from, *to], reach_px, brightness));
    if let Some([a, b]) = found {
        (*from, *to) = (a, b);
    }
}

/// What is selected, and drawn next, once something has been drawn.
fn ended(page: &mut ModelPage, drag: &Drag, model: &Model) {
    let last = model.drawn().saturating_sub(1);
    match drag.what {
        Dragged::New(Tool::Line(_) | Tool::Mark(Target::Edge(_) | Target::Rim(..))) => {}
        Dragged::New(Tool::Mark(target @ Target::Place(Place::Corner { thing, .. }))) => {
            page.selected = Selected::Thing(thing);
            page.tool = target.next(model, page.shown).map_or(Tool::Select, Tool::Mark);
        }
        Dragged::New(Tool::Mark(Target::NewPoint)) => {
            let point = model.points.len() - 1;
            page.selected = Selected::Point(point);
            page.tool = Tool::Mark(Target::Place(Place::Point(point)));
        }
        Dragged::New(Tool::Origin) => {
            page.selected = Selected::Stroke(last);
            page.tool = Tool::Select;
        }
        Dragged::New(Tool::Length) => {
            page.selected = Selected::Stroke(last);
            page.tool = Tool::Select;
            page.wants_number = true;
        }
        _ => {}
    }
}

/// Where a corner or point is, in metres, by the latest solution.
pub fn position(page: &ModelPage, place: Place) -> Option<DVec3> {
    let solution = page.solution()?;
    let solved = &page.solved.as_ref()?.model;
    let model = page.model()?;
    // Things may have come and gone since.
    match place {
        Place::Corner { thing, corner } => {
            let is_same = solved.things.get(thing)?.shape == model.things.get(thing)?.shape
                && solved.things[thing].id == model.things[thing].id;
            solution.corners.get(thing)?.get(corner).copied().filter(|_| is_same)
        }
        Place::Point(index) => {
            let is_same = solved.points.get(index) == model.points.get(index);
            solution.state.points.get(index).copied().flatten().filter(|_| is_same)
        }
    }
}

/// Where the photograph that is looked at shows a place, by the latest solution.
pub fn projected(page: &ModelPage, place: Place) -> Option<DVec2> {
    let camera = page.solution()?.cameras.get(page.shown)?.as_ref()?;
    camera.project(position(page, place)?).map(|(pixel, _)| pixel)
}

/// Every corner and point with where the photograph has it: as it was shown, or as it is solved.
pub fn places(page: &ModelPage, model: &Model) -> Vec<(Place, DVec2)> {
    let corners = model.things.iter().enumerate().flat_map(|(thing, own)| {
        let count = crate::model::things::corner_names(own).len();
        (0..count).map(move |corner| Place::Corner { thing, corner })
    });
    let points = (0..model.points.len()).map(Place::Point);
    let at = |place: Place| {
        let drawn = model.pick_of(page.shown, place).and_then(|own| match model.strokes[own] {
            Stroke::Pick { pixel, .. } => Some(pixel),
            _ => None,
        });
        Some((place, drawn.or_else(|| projected(page, place))?))
    };
    corners.chain(points).filter_map(at).collect()
}

fn place_near(page: &ModelPage, model: &Model, view: &View, press: Pos2) -> Option<Place> {
    let all = places(page, model).into_iter();
    nearest(all.map(|(place, pixel)| (place, view.at(pixel).distance(press))), NEAR)
}

fn nearest<T>(all: impl Iterator<Item = (T, f32)>, within: f32) -> Option<T> {
    let near = all.filter(|(_, distance)| *distance <= within);
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(own, _)| own)
}

/// What lies under the pointer: what becomes selected, and what a drag from there moves.
pub fn under(
    page: &ModelPage,
    model: &Model,
    view: &View,
    press: Pos2,
) -> (Selected, Option<Dragged>) {
    let own = model
        .strokes
        .iter()
        .enumerate()
        .filter(|(_, stroke)| page.overlays.strokes && stroke.photograph() == Some(page.shown))
        .filter(|(_, stroke)| !stroke.is_found());
    let mut marks: Vec<((usize, Dragged), f32)> = Vec::new();
    let mut lines: Vec<((usize, Dragged), f32)> = Vec::new();
    for (index, stroke) in own {
        let away = |pixel: DVec2| view.at(pixel).distance(press);
        match stroke {
            Stroke::Line { from, to, .. } | Stroke::Edge { from, to, .. } => {
                marks.push(((index, Dragged::End(index, false)), away(*from)));
                marks.push(((index, Dragged::End(index, true)), away(*to)));
                let along = from_segment(press, [view.at(*from), view.at(*to)]);
                lines.push(((index, Dragged::Body(index)), along));
            }
            Stroke::Pick { pixel, .. } | Stroke::Rim { pixel, .. } => {
                marks.push(((index, Dragged::Pixel(index)), away(*pixel)));
            }
            Stroke::Position { .. } | Stroke::Length { .. } => {}
        }
    }
    if let Some((index, dragged)) = nearest(marks.into_iter(), NEAR) {
        return (Selected::Stroke(index), Some(dragged));
    }
    if page.overlays.model {
        let open = places(page, model).into_iter();
        let open = open.filter(|(place, _)| model.pick_of(page.shown, *place).is_none());
        let open = open.map(|(place, pixel)| (place, view.at(pixel).distance(press)));
        if let Some(place) = nearest(open, NEAR) {
            let selected = match place {
                Place::Corner { thing, .. } => Selected::Thing(thing),
                Place::Point(point) => Selected::Point(point),
            };
            return (selected, Some(Dragged::Corner(place)));
        }
    }
    if let Some((index, dragged)) = nearest(lines.into_iter(), NEAR_LINE) {
        return (Selected::Stroke(index), Some(dragged));
    }
    (Selected::Nothing, None)
}

fn from_segment(place: Pos2, [a, b]: [Pos2; 2]) -> f32 {
    let (along, from) = (b - a, place - a);
    let part = (from.dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
    (from - part * along).length()
}
