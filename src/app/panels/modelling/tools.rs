//! The tools, the kinds of things that can be added, and the list of things.

use eframe::egui;

use super::overlay::axis_color;
use crate::app::actions::{Action, ModelAction, ToEdges};
use crate::app::modelling::ModelPage;
use crate::app::modelling::tool::{Selected, Target, Tool};
use crate::app::panels::numbers::{counted, cut, named, short, swatch};
use crate::app::{commands, keys};
use crate::model::from_points::Wanted;
use crate::model::{Axis, Model, Place, Shape, Stroke, Support};

pub fn tools_ui(ui: &mut egui::Ui, page: &mut ModelPage, model: &Model, actions: &mut Vec<Action>) {
    ui.strong("Draw");
    for (tool, name, key, help) in [
        (Tool::Select, "Select and move", "V", "Select what is drawn, and drag it"),
        (Tool::Line(Axis::X), "Line along x", "X", "Edges that run along x, which is level"),
        (Tool::Line(Axis::Y), "Line along y", "Y", "Edges a quarter turn left of x, level, too"),
        (Tool::Line(Axis::Z), "Line along z", "Z", "Upright edges, from below to above"),
        (
            Tool::Mark(Target::NewPoint),
            "Point",
            "P",
            "One point in several photographs, which ties them together",
        ),
        (Tool::Origin, "Origin", "O", "The corner or point that lies at (0, 0, 0)"),
        (Tool::Length, "Known length", "K", "How far two corners or points are apart"),
    ] {
        let is_on = page.tool == tool;
        let row = ui.horizontal(|ui| {
            match tool {
                Tool::Line(axis) => drop(swatch(ui, axis_color(axis))),
                _ => ui.add_space(20.0),
            }
            let button = egui::Button::selectable(is_on, name).shortcut_text(beside(key, is_on));
            ui.add(button.min_size(egui::vec2(ui.available_width(), 0.0)))
        });
        let row = named(row.inner.on_hover_text(format!("{help} ({key})")), name.to_owned());
        if row.clicked() {
            page.tool = tool;
            page.drag = None;
        }
    }
    ui.add_space(8.0);
    ui.strong("Add");
    ui.horizontal_wrapped(|ui| {
        for (name, key, shape, help) in commands::things() {
            let plain = name.trim_start_matches("Add ");
            let mut letters = plain.chars();
            let first = letters.next().unwrap_or_default().to_uppercase();
            let text: String = first.chain(letters).collect();
            let help = format!("{help} ({})", key.name());
            if ui.button(text).on_hover_text(help).clicked() {
                actions.push(Action::Model(ModelAction::Add(shape)));
            }
        }
    });
    if !model.found_points.is_empty() {
        points_ui(ui, page);
    }
    ui.add_space(8.0);
    ui.strong("Things");
    if model.things.is_empty() {
        ui.weak("Add a room or a box and show its corners; each face becomes a surface.");
    }
    for (index, thing) in model.things.iter().enumerate() {
        let selected = page.selected == Selected::Thing(index);
        let text = format!("{}  {}", thing.id, standing(model, index));
        let response = row_ui(ui, selected, text);
        let help = "Select it, and show its corners in this photograph";
        if response.on_hover_text(help).clicked() {
            page.selected = Selected::Thing(index);
            page.tool = Target::first(model, index, page.shown).map_or(Tool::Select, Tool::Mark);
        }
    }
    let is_typed =
        |stroke: &Stroke| matches!(stroke, Stroke::Position { .. } | Stroke::Length { .. });
    let typed: Vec<usize> =
        (0..model.strokes.len()).filter(|index| is_typed(&model.strokes[*index])).collect();
    ui.add_space(8.0);
    ui.strong("Known places and lengths");
    if typed.is_empty() {
        ui.weak("Without a known length, the first edge of the first thing is 1 m.");
    }
    for index in typed {
        let text = typed_name(model, index);
        let response = row_ui(ui, page.selected == Selected::Stroke(index), text);
        if response.on_hover_text("Select it, and type its numbers").clicked() {
            page.selected = Selected::Stroke(index);
            page.tool = Tool::Select;
        }
    }
    if !model.points.is_empty() {
        ui.add_space(8.0);
        ui.strong("Points");
    }
    for (index, point) in model.points.iter().enumerate() {
        let selected = page.selected == Selected::Point(index);
        let place = Place::Point(index);
        let is_of = |stroke: &&Stroke| matches!(stroke, Stroke::Pick { at, .. } if *at == place);
        let count = model.strokes.iter().filter(is_of).count();
        let text = format!("{}  in {}", point.id, counted(count, "photograph", "photographs"));
        let response = row_ui(ui, selected, text);
        if response.on_hover_text("Select it, and show it in this photograph").clicked() {
            page.selected = Selected::Point(index);
            page.tool = Tool::Mark(Target::Place(place));
        }
    }
}

/// Things that are fitted to points.
fn points_ui(ui: &mut egui::Ui, page: &mut ModelPage) {
    ui.add_space(8.0);
    ui.strong("From points");
    ui.horizontal_wrapped(|ui| {
        for (name, key, wanted, help) in commands::from_points() {
            let key = ui.ctx().format_shortcut(&key);
            let tool = Tool::Lasso(wanted);
            let text = if wanted == Wanted::Plane { "Plane" } else { "Box" };
            let button = egui::Button::selectable(page.tool == tool, text);
            let button = ui.add_enabled(!page.is_fitting(), button);
            let button = button
                .on_hover_text(format!("{help} ({key})"))
                .on_disabled_hover_text("A thing is being fitted");
            if named(button, name.to_owned()).clicked() {
                page.tool = if page.tool == tool { Tool::Select } else { tool };
                page.drag = None;
            }
        }
        if page.is_fitting() {
            ui.spinner();
        }
    });
}

/// A button that fits to the lines of the photographs, by its text and its help; it is out of use
/// while something is fitted.
pub fn to_edges_ui(
    ui: &mut egui::Ui,
    page: &ModelPage,
    (text, help): (&str, &str),
    what: ToEdges,
    actions: &mut Vec<Action>,
) {
    let button = ui.add_enabled(!page.is_fitting(), egui::Button::new(text));
    let help = keys::named(ui.ctx(), help);
    let button = button.on_hover_text(help).on_disabled_hover_text("It is being fitted");
    if button.clicked() {
        actions.push(Action::Model(ModelAction::FitToEdges(what)));
    }
    if page.is_fitting() {
        ui.spinner();
        let button = ui.small_button("Cancel").on_hover_text("Stop the fit. Nothing is moved");
        if named(button, "Cancel the fit".to_owned()).clicked() {
            page.cancel_fit();
        }
    }
}

/// What a known place or length says.
pub fn typed_name(model: &Model, index: usize) -> String {
    match &model.strokes[index] {
        Stroke::Length { between: [a, b], length_m, .. } => {
            format!("{} to {}  {length_m:.3} m", model.place_name(*a), model.place_name(*b))
        }
        Stroke::Position { at, position, .. } => {
            let [x, y, z] = position.to_array().map(short);
            format!("{}  at {x} {y} {z} m", model.place_name(*at))
        }
        other => other.name().to_owned(),
    }
}

/// What stands at the end of a row, legible on the selected one, too.
pub fn beside(text: &str, is_on: bool) -> egui::RichText {
    let text = egui::RichText::new(text);
    if is_on { text.color(egui::Color32::from_white_alpha(210)) } else { text }
}

fn row_ui(ui: &mut egui::Ui, selected: bool, text: String) -> egui::Response {
    let button = egui::Button::selectable(selected, text).truncate();
    ui.add(button.min_size(egui::vec2(ui.available_width(), 0.0)))
}

/// What a thing stands on, in words.
pub fn standing(model: &Model, index: usize) -> String {
    let thing = &model.things[index];
    let kind = thing.shape.name();
    if let Shape::Box { flush: Some(side) } = thing.shape {
        return format!("{kind} at {}", side_name(model, side));
    }
    if let Shape::Room { corners, .. } = thing.shape {
        return format!("{corners} walls");
    }
    match thing.on {
        Support::Floor => format!("{kind} on the floor"),
        Support::Top(host) => format!("{kind} on {}", model.things[host].id),
        Support::Side(side) => format!("{kind} in {}", side_name(model, side)),
        Support::Free => format!("{kind}, free"),
    }
}

/// `room1.wall2`, `box1.side3`.
pub fn side_name(model: &Model, side: crate::model::Side) -> String {
    let host = &model.things[side.thing];
    let word = if matches!(host.shape, Shape::Room { .. }) { "wall" } else { "side" };
    format!("{}.{word}{}", host.id, side.index + 1)
}

/// A heading of what is selected, with what can be done about it.
pub fn heading_ui(
    ui: &mut egui::Ui,
    name: &str,
    buttons: &[(&str, &str, Action)],
    actions: &mut Vec<Action>,
) {
    ui.horizontal(|ui| {
        let room = ui.available_width() - 84.0 * buttons.len() as f32;
        ui.scope(|ui| {
            ui.set_max_width(room.max(80.0));
            cut(ui, egui::RichText::new(name).strong());
        });
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            for (text, help, action) in buttons.iter().rev() {
                if ui.small_button(*text).on_hover_text(*help).clicked() {
                    actions.push(action.clone());
                }
            }
        });
    });
}

/// A row for the name of a thing or a point; the new one where it may be called so.
pub fn name_ui(ui: &mut egui::Ui, model: &Model, id: &str, help: &str) -> Option<String> {
    let label = ui.weak("Name");
    let mut text = id.to_owned();
    let field = egui::TextEdit::singleline(&mut text).desired_width(f32::INFINITY);
    let response = ui.add(field).on_hover_text(help).labelled_by(label.id);
    ui.end_row();
    (response.changed() && model.is_free_name(&text)).then_some(text)
}
