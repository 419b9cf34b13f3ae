//! The numbers of a selected stroke or point.

use eframe::egui::{self, DragValue};
use glam::{DVec2, DVec3};

use super::overlay::axis_color;
use super::{Proposal, hands, tools};
use crate::app::actions::{Action, ModelAction};
use crate::app::entry::{self, Unit};
use crate::app::modelling::ModelPage;
use crate::app::modelling::drag::is_origin;
use crate::app::modelling::tool::Target;
use crate::app::panels::numbers::{short, swatch};
use crate::model::{Axis, Model, Place, Stroke};

pub fn stroke_ui(
    ui: &mut egui::Ui,
    page: &mut ModelPage,
    model: &Model,
    index: usize,
    actions: &mut Vec<Action>,
) -> Proposal {
    let own = &model.strokes[index];
    let remove = Action::Model(ModelAction::Remove);
    let turn = Action::Model(ModelAction::Flip);
    let mut buttons = vec![("Remove", "Take this stroke away (Delete)", remove)];
    if own.axis().is_some() {
        buttons.insert(0, ("Turn around", "Let it run the other way (T)", turn));
    }
    tools::heading_ui(ui, &title(model, own), &buttons, actions);
    if let Some(photograph) = own.photograph() {
        ui.weak(format!("in {}", model.photographs[photograph].name));
    }
    match (page.residual(index), own) {
        (None, _) => drop(ui.weak("Its residual is not known yet.")),
        (Some(off), Stroke::Position { sd_m, .. } | Stroke::Length { sd_m, .. }) => {
            ui.label(format!("Off by {:.4} m", off * sd_m))
                .on_hover_text("Difference between the photographs and the typed value");
        }
        (Some(off), _) => {
            ui.label(format!("Off by {off:.2} px"))
                .on_hover_text("Its distance from the fit of all strokes together");
        }
    }
    ui.add_space(4.0);
    let mut edited = own.clone();
    let mut name = None;
    match &mut edited {
        Stroke::Line { axis, from, to, .. } => {
            ui.horizontal(|ui| {
                ui.weak("Along");
                for choice in Axis::ALL {
                    swatch(ui, axis_color(choice));
                    let help = format!("The line runs along {}", choice.name());
                    if ui.radio_value(axis, choice, choice.name()).on_hover_text(help).changed() {
                        name = Some("axis of a line".to_owned());
                    }
                }
            });
            name = name.or(ends_ui(ui, from, to));
        }
        // It lies where the photograph shows a line.
        Stroke::Edge { sd_px: Some(_), .. } => {}
        Stroke::Edge { from, to, .. } => name = ends_ui(ui, from, to),
        Stroke::Pick { pixel, .. } | Stroke::Rim { pixel, .. } => {
            egui::Grid::new("model pixel").show(ui, |ui| {
                if pixel_ui(ui, "Pixel", pixel) {
                    name = Some("pixel".to_owned());
                }
            });
        }
        Stroke::Position { position, sd_m, .. } => name = position_ui(ui, position, sd_m),
        Stroke::Length { length_m, sd_m, .. } => {
            let wants = std::mem::take(&mut page.wants_number);
            name = length_ui(ui, length_m, sd_m, wants);
        }
    }
    ui.add_space(6.0);
    let name = name.filter(|_| edited != *own)?;
    let mut changed = model.clone();
    changed.strokes[index] = edited;
    Some((name, changed))
}

pub fn point_ui(
    ui: &mut egui::Ui,
    page: &mut ModelPage,
    model: &Model,
    index: usize,
    actions: &mut Vec<Action>,
) -> Proposal {
    let own = &model.points[index];
    let remove = Action::Model(ModelAction::Remove);
    let help = "Take this point and its strokes away (Delete)";
    tools::heading_ui(ui, &format!("{} (point)", own.id), &[("Remove", help, remove)], actions);
    let place = Place::Point(index);
    let mut edited = None;
    egui::Grid::new("model point").num_columns(2).show(ui, |ui| {
        edited = tools::name_ui(ui, model, &own.id, "Without a full stop, different from others");
        ui.weak("Position");
        match hands::position(page, place) {
            Some(position) => {
                let [x, y, z] = position.to_array();
                ui.label(format!("{x:.3}  {y:.3}  {z:.3} m"));
            }
            None => {
                ui.weak("not placed");
            }
        }
        ui.end_row();
    });
    // Below the grid, where it wraps: a grid would grow with it, and the photograph shrink.
    let shows = (0..model.photographs.len())
        .filter(|photograph| Target::Place(place).count(model, *photograph) > 0);
    let name = |photograph: usize| model.photographs[photograph].name.trim_start_matches("images/");
    let names: Vec<&str> = shows.map(name).collect();
    ui.label(format!("Shown in {}", names.join(", ")));
    ui.weak("A point needs two photographs from different places.");
    ui.add_space(6.0);
    let mut changed = model.clone();
    changed.points[index].id = edited?;
    Some(("rename".to_owned(), changed))
}

fn title(model: &Model, own: &Stroke) -> String {
    let names: Vec<String> = own.places().iter().map(|place| model.place_name(*place)).collect();
    match own {
        Stroke::Line { axis, .. } => format!("Line along {}", axis.name()),
        Stroke::Pick { .. } => format!("Shows {}", names[0]),
        Stroke::Edge { .. } => {
            let word = if own.is_found() { "Found edge" } else { "Edge" };
            format!("{word} {}", names.join(" to "))
        }
        Stroke::Rim { thing, top, .. } => {
            format!("Point on {}", Target::Rim(*thing, *top).name(model))
        }
        Stroke::Position { .. } if is_origin(own) => format!("Origin at {}", names[0]),
        Stroke::Position { .. } => format!("Position of {}", names[0]),
        Stroke::Length { .. } => format!("Length {}", names.join(" to ")),
    }
}

fn ends_ui(ui: &mut egui::Ui, from: &mut DVec2, to: &mut DVec2) -> Option<String> {
    let mut changed = false;
    egui::Grid::new("model ends").show(ui, |ui| {
        changed |= pixel_ui(ui, "From", from);
        changed |= pixel_ui(ui, "To", to);
    });
    changed.then(|| "end of a line".to_owned())
}

fn pixel_ui(ui: &mut egui::Ui, what: &str, pixel: &mut DVec2) -> bool {
    ui.weak(what);
    let mut changed = false;
    for (axis, value) in ["x", "y"].into_iter().zip(pixel.as_mut()) {
        let field =
            DragValue::new(value).speed(0.1).range(-1e6..=1e6).max_decimals(2).suffix(" px");
        let help = format!("{what}, {axis}: in pixels from the image's top left corner");
        changed |= entry::number(ui, field, Unit::Plain)
            .accessible_name(format!("{what}, {axis}"))
            .on_hover_text(help)
            .changed();
    }
    ui.end_row();
    changed
}

fn position_ui(ui: &mut egui::Ui, position: &mut DVec3, sd_m: &mut f64) -> Option<String> {
    let mut name = None;
    egui::Grid::new("model position").num_columns(2).show(ui, |ui| {
        for (axis, value) in ["x", "y", "z"].into_iter().zip(position.as_mut()) {
            ui.weak(axis);
            let field =
                DragValue::new(value).speed(0.005).range(-1e5..=1e5).max_decimals(4).suffix(" m");
            let response = entry::number(ui, field, Unit::Length);
            let label = format!("Position, {axis}");
            if response.accessible_name(label).on_hover_text("In metres").changed() {
                name = Some(format!("position, {axis}"));
            }
            ui.end_row();
        }
        if sd_ui(ui, sd_m) {
            name = Some("standard deviation".to_owned());
        }
    });
    name
}

fn length_ui(ui: &mut egui::Ui, length_m: &mut f64, sd_m: &mut f64, wants: bool) -> Option<String> {
    let mut name = None;
    egui::Grid::new("model length").num_columns(2).show(ui, |ui| {
        ui.weak("Length");
        let field =
            DragValue::new(length_m).speed(0.005).range(1e-4..=1e5).max_decimals(4).suffix(" m");
        let response = entry::number(ui, field, Unit::Length).accessible_name("Length");
        if wants {
            response.request_focus();
        }
        if response.on_hover_text("As measured: 2.4, 240 cm").changed() {
            name = Some("length".to_owned());
        }
        ui.end_row();
        if sd_ui(ui, sd_m) {
            name = Some("standard deviation".to_owned());
        }
    });
    name
}

/// How well a typed number is known.
fn sd_ui(ui: &mut egui::Ui, sd_m: &mut f64) -> bool {
    ui.weak("Known to ±");
    let mut sd_mm = 1000.0 * *sd_m;
    let field =
        DragValue::new(&mut sd_mm).speed(0.1).range(1e-3..=1e6).max_decimals(3).suffix(" mm");
    let help = format!(
        "Standard deviation: {} m. Photographs that disagree by more are told.",
        short(*sd_m)
    );
    let changed = entry::number(ui, field, Unit::Millimetres)
        .accessible_name("Known to")
        .on_hover_text(help)
        .changed();
    ui.end_row();
    if changed {
        *sd_m = 0.001 * sd_mm;
    }
    changed
}
