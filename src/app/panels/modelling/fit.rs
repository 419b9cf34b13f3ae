//! The fit of the model: what prevents its use, and photographs and strokes in the order of their
//! errors.

use eframe::egui;

use super::tools;
use crate::app::actions::{Action, ModelAction, ToEdges};
use crate::app::modelling::ModelPage;
use crate::app::modelling::tool::{Selected, Tool};
use crate::app::panels::numbers::{check_mark, counted, named};
use crate::model::{Model, ModelError, Stroke};

/// Strokes that are listed: the worst.
const LISTED: usize = 40;

pub fn fit_ui(ui: &mut egui::Ui, page: &mut ModelPage, model: &Model, actions: &mut Vec<Action>) {
    ui.separator();
    ui.horizontal(|ui| {
        ui.strong("Fit");
        if page.is_solving() {
            ui.spinner();
        }
    });
    if let Some(failure) = &page.failure {
        ui.colored_label(ui.visuals().error_fg_color, failure);
    }
    if model.strokes.is_empty() && !model.has_found() {
        ui.weak("Nothing is drawn yet. Strokes with large errors will be listed here.");
        return;
    }
    let Some(solved) = page.solved.clone() else {
        ui.weak("Solving…");
        return;
    };
    let error = ui.visuals().error_fg_color;
    let warning = ui.visuals().warn_fg_color;
    match &solved.outcome {
        Err(problem) => problem_ui(ui, page, model, problem, error),
        Ok(solution) => {
            match solution.stroke_px.filter(|_| solution.is_usable()) {
                Some(_) if model.strokes.is_empty() => {
                    ui.horizontal(|ui| {
                        check_mark(ui);
                        ui.label("Solved: the cameras stand as they were found");
                    });
                }
                Some(own) => {
                    ui.horizontal(|ui| {
                        check_mark(ui);
                        ui.label(format!("Solved: strokes are off by {own:.2} px"))
                            .on_hover_text("Standard deviation of a stroke");
                    });
                }
                None => drop(ui.colored_label(error, "The strokes do not determine everything")),
            }
            for problem in &solution.problems {
                problem_ui(ui, page, model, problem, error);
            }
            for problem in &solution.unplaced {
                problem_ui(ui, page, model, problem, warning);
            }
            notes_ui(ui, page, model, &solution.notes, warning);
            if solution.is_usable() && !model.things.is_empty() {
                edges_ui(ui, page, model, actions);
            }
        }
    }
    ui.add_space(6.0);
    photographs_ui(ui, page, model);
    ui.add_space(6.0);
    strokes_ui(ui, page, model);
}

/// The lines of the photographs that are edges of things.
fn edges_ui(ui: &mut egui::Ui, page: &ModelPage, model: &Model, actions: &mut Vec<Action>) {
    let found = model.strokes.iter().filter(|own| own.is_found()).count();
    ui.horizontal_wrapped(|ui| {
        let help = "Find the lines of the photographs that are edges of things. They are more exact than \
                    drawn strokes, and cameras and things are solved with both (Shift+E)";
        tools::to_edges_ui(ui, page, ("Fit all to edges", help), ToEdges::All, actions);
        if found > 0 {
            ui.weak(counted(found, "found edge", "found edges"));
            let help = "Remove them: the drawn strokes alone place everything again";
            let button = ui.small_button("Remove").on_hover_text(help);
            if named(button, "Remove found edges".to_owned()).clicked() {
                actions.push(Action::Model(ModelAction::ForgetFound));
            }
        }
    });
}

/// A problem in the solver's words; clicked, it shows what it is about.
fn problem_ui(
    ui: &mut egui::Ui,
    page: &mut ModelPage,
    model: &Model,
    problem: &ModelError,
    color: egui::Color32,
) {
    let name = problem.place.split_once('(').and_then(|(_, own)| own.strip_suffix(')'));
    let mut text = problem.to_string();
    if let Some(name) = name.filter(|name| !text.contains(name)) {
        text = format!("{name}: {text}");
    }
    words_ui(ui, page, model, &problem.place, &text, color);
}

fn notes_ui(
    ui: &mut egui::Ui,
    page: &mut ModelPage,
    model: &Model,
    notes: &[String],
    warning: egui::Color32,
) {
    for note in notes {
        let is_off = note.starts_with("strokes[");
        let color = if is_off { warning } else { ui.visuals().weak_text_color() };
        // The number says nothing to a reader of the page.
        let text = match note.split_once("] ") {
            Some((_, rest)) if is_off => rest.trim_start_matches('(').replacen(')', "", 1),
            _ => note.clone(),
        };
        words_ui(ui, page, model, note, &text, color);
    }
}

fn words_ui(
    ui: &mut egui::Ui,
    page: &mut ModelPage,
    model: &Model,
    place: &str,
    text: &str,
    color: egui::Color32,
) {
    let Some(go) = place_of(place, model) else {
        ui.colored_label(color, text);
        return;
    };
    let label = egui::Label::new(egui::RichText::new(text).color(color)).wrap();
    let response = ui.add(label.sense(egui::Sense::click()));
    let response = response.on_hover_cursor(egui::CursorIcon::PointingHand);
    if response.on_hover_text("Click to show which part of the model it is about").clicked() {
        match go {
            Go::Photograph(index) => page.show(index),
            Go::Select(selected) => select(page, model, selected),
        }
    }
}

/// Selects something, in the photograph that shows it.
fn select(page: &mut ModelPage, model: &Model, selected: Selected) {
    page.selected = selected;
    page.tool = Tool::Select;
    if let Selected::Stroke(index) = selected
        && let Some(photograph) = model.strokes[index].photograph()
    {
        page.show(photograph);
    }
}

/// What the place of a problem is about.
#[derive(Debug, PartialEq)]
enum Go {
    Photograph(usize),
    Select(Selected),
}

/// `strokes[3] …`, `things[1] (box1)`, `photographs[0] (…)`.
fn place_of(place: &str, model: &Model) -> Option<Go> {
    let (list, rest) = place.split_once('[')?;
    let index: usize = rest.split_once(']')?.0.parse().ok()?;
    match list {
        "strokes" if index < model.strokes.len() => Some(Go::Select(Selected::Stroke(index))),
        "things" if index < model.things.len() => Some(Go::Select(Selected::Thing(index))),
        "points" if index < model.points.len() => Some(Go::Select(Selected::Point(index))),
        "photographs" if index < model.photographs.len() => Some(Go::Photograph(index)),
        _ => None,
    }
}

/// The photographs by how badly they fit, those without a camera first.
fn photographs_ui(ui: &mut egui::Ui, page: &mut ModelPage, model: &Model) {
    ui.strong("Photographs").on_hover_text("The worst first");
    let mut rows: Vec<(f64, usize, String)> = (0..model.photographs.len())
        .map(|index| {
            let report = page
                .solution()
                .and_then(|own| own.photographs.iter().find(|own| own.photograph == index));
            match report {
                Some(own) if own.strokes == 0 => (0.0, index, "found".to_owned()),
                Some(own) => {
                    let strokes = counted(own.strokes, "stroke", "strokes");
                    (own.rms_px, index, format!("{strokes}  {:.2} px", own.rms_px))
                }
                None => (f64::INFINITY, index, "not placed".to_owned()),
            }
        })
        .collect();
    rows.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, index, text) in rows {
        let name = model.photographs[index].name.trim_start_matches("images/");
        if row_ui(ui, index == page.shown, name, &text).clicked() {
            page.show(index);
        }
    }
}

/// The strokes by how far they are off, those of all photographs together.
fn strokes_ui(ui: &mut egui::Ui, page: &mut ModelPage, model: &Model) {
    ui.strong("Strokes").on_hover_text("The worst first, of all photographs");
    let mut rows: Vec<(f64, usize)> = (0..model.strokes.len())
        .filter(|index| model.strokes[*index].photograph().is_some())
        .map(|index| (page.residual(index).unwrap_or(-1.0), index))
        .collect();
    rows.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let count = rows.len();
    for (off, index) in rows.into_iter().take(LISTED) {
        let text = if off < 0.0 { "open".to_owned() } else { format!("{off:.2} px") };
        let is_on = page.selected == Selected::Stroke(index);
        if row_ui(ui, is_on, &short_name(model, &model.strokes[index]), &text).clicked() {
            select(page, model, Selected::Stroke(index));
        }
    }
    if count > LISTED {
        ui.weak(format!("And {} that fit better", count - LISTED));
    }
}

fn short_name(model: &Model, stroke: &Stroke) -> String {
    let what: Vec<String> = match stroke {
        Stroke::Line { axis, .. } => vec![format!("along {}", axis.name())],
        Stroke::Rim { thing, top, .. } => {
            let circle = if *top { "top" } else { "bottom" };
            vec![format!("{}.{circle}", model.things[*thing].id)]
        }
        _ => stroke.places().iter().map(|place| model.place_name(*place)).collect(),
    };
    let photograph = stroke.photograph().map_or(String::new(), |index| {
        let name = model.photographs[index].name.trim_start_matches("images/");
        format!("  {name}")
    });
    format!("{} {}{photograph}", stroke.name(), what.join(" to "))
}

/// A row of a list: a name that is cut, and a number.
fn row_ui(ui: &mut egui::Ui, is_on: bool, name: &str, text: &str) -> egui::Response {
    let width = ui.available_width();
    let button =
        egui::Button::selectable(is_on, name).shortcut_text(tools::beside(text, is_on)).truncate();
    ui.add(button.min_size(egui::vec2(width, 0.0))).on_hover_text(format!("{name}: {text}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Point;

    #[test]
    fn places_of_problems_are_found() {
        let model = Model { points: vec![Point { id: "p1".into() }], ..Model::default() };
        assert_eq!(place_of("points[0] (p1)", &model), Some(Go::Select(Selected::Point(0))));
        assert_eq!(place_of("points[1]", &model), None);
        assert_eq!(place_of("strokes[x", &model), None);
        assert_eq!(place_of("", &model), None);
    }
}
