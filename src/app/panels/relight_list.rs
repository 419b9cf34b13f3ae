//! The list of added lights and objects, with placeholders for those that could not be read.

use std::sync::Arc;

use eframe::egui::{self, Button, Color32, RichText};

use super::numbers::{emission_color, left, named, reflectance_color, swatch};
use crate::app::actions::{Action, PathRequest, Relight, Select};
use crate::app::change::Change;
use crate::app::project::{Focus, Project};
use crate::app::relight::Added;
use crate::app::solo::{Alone, Solo, is_alone, toggled};
use crate::io::edits::Unread;
use crate::render::edits::Shape;

/// Below this width, in points, a light takes two rows.
const NARROW: f32 = 230.0;

/// `parts` are the names of the recovered light's parts, `now` the light that is seen alone.
pub fn list_ui(
    ui: &mut egui::Ui,
    project: &Project,
    parts: &[String],
    now: &mut Option<Alone>,
    actions: &mut Vec<Action>,
) {
    let edits = &project.edit().relight;
    let unread = &project.edit().unread;
    if edits.lights.is_empty() && edits.objects.is_empty() && unread.is_empty() {
        ui.weak("Nothing yet. Add a light or an object; it can then be moved in the 3D view.");
    }
    let selected = project.selection.added.filter(|_| project.selection.focus == Focus::Added);
    let mut change = None;
    let mut soloed = None;
    // In a narrow panel the switches of a light stand below its name.
    let is_narrow = ui.available_width() < NARROW;
    let mut row = |ui: &mut egui::Ui, item, name: &str, kind: &str, color| {
        let button_ui = |ui: &mut egui::Ui, actions: &mut Vec<Action>| {
            let text = format!("{name}  ({kind})");
            let width = ui.available_width();
            let button = Button::selectable(selected == Some(item), left(text)).truncate();
            let response = ui.add(button.min_size(egui::vec2(width, 0.0))).on_hover_text(
                "Select it: G, R and S move, rotate and scale it; right-click for more",
            );
            if response.clicked() {
                actions.push(Action::Select(Select::Added(item)));
            }
            response.context_menu(|ui| {
                for (text, help, what) in [
                    ("Duplicate", "Make a twin", Relight::Duplicate),
                    ("Remove", "Take it away", Relight::Remove),
                ] {
                    if ui.button(text).on_hover_text(help).clicked() {
                        actions.push(Action::Select(Select::Added(item)));
                        actions.push(Action::Relight(what));
                        ui.close();
                    }
                }
            });
        };
        let mut switch_ui = |ui: &mut egui::Ui| {
            if let Added::Light(index) = item {
                let mut is_on = edits.lights[index].is_on;
                let switch = named(ui.checkbox(&mut is_on, ""), format!("{name} on"));
                if switch.on_hover_text("Turn it off and on; its strength stays").changed() {
                    change = Some((index, is_on));
                }
            }
        };
        let mut alone_ui = |ui: &mut egui::Ui| {
            if let Added::Light(_) = item {
                let solo = Solo::Added(name.to_owned());
                let is_alone = is_alone(edits, now.as_ref(), &solo, parts);
                if solo_ui(ui, name, is_alone) {
                    soloed = Some(solo);
                }
            }
        };
        ui.horizontal(|ui| {
            swatch(ui, color);
            if is_narrow {
                button_ui(ui, actions);
                return;
            }
            switch_ui(ui);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                alone_ui(ui);
                button_ui(ui, actions);
            });
        });
        if is_narrow && matches!(item, Added::Light(_)) {
            ui.horizontal(|ui| {
                swatch(ui, Color32::TRANSPARENT);
                switch_ui(ui);
                alone_ui(ui);
            });
        }
    };
    for (index, light) in edits.lights.iter().enumerate() {
        let kind = match &light.shape {
            Shape::Emitter(emitter) => emitter.kind(),
            Shape::Dome(_) => "dome",
        };
        row(ui, Added::Light(index), &light.name, kind, emission_color(light.emission));
    }
    for (index, object) in edits.objects.iter().enumerate() {
        let diffuse = object.surfaces.first().map_or([0.5; 3], |(_, own)| own.diffuse);
        let color = reflectance_color(diffuse);
        row(ui, Added::Object(index), &object.name, "object", color);
    }
    if let Some((index, is_on)) = change {
        let mut edits = (**edits).clone();
        edits.lights[index].is_on = is_on;
        let (of, edits) = (Some(Added::Light(index)), Arc::new(edits));
        let name = if is_on { "turn on" } else { "turn off" };
        actions.push(Action::Change(Change::Relight { name, of, edits }));
    }
    if let Some(solo) = soloed {
        let edits = Arc::new(toggled(edits, now, solo, parts));
        actions.push(Action::Change(Change::Relight { name: "solo", of: None, edits }));
    }
    for (index, part) in unread.iter().enumerate() {
        unread_ui(ui, index, part, actions);
    }
}

/// The switch that lets one light be seen alone; says whether it was clicked.
pub fn solo_ui(ui: &mut egui::Ui, name: &str, is_alone: bool) -> bool {
    let response =
        named(ui.add(Button::selectable(is_alone, "Solo").small()), format!("Solo {name}"));
    let help = if is_alone {
        "All lights as they were before"
    } else {
        "This light alone, until it is clicked again"
    };
    response.on_hover_text(help).clicked()
}

/// The placeholder of a part of the project that could not be read.
fn unread_ui(ui: &mut egui::Ui, index: usize, part: &Unread, actions: &mut Vec<Action>) {
    let Some(problem) = &part.problem else { return };
    let name = part.name();
    let kind = if part.is_missing { "missing file" } else { "not read" };
    let text = RichText::new(format!("{name}  ({kind})")).color(ui.visuals().warn_fg_color);
    let buttons = egui::Layout::right_to_left(egui::Align::Center);
    ui.allocate_ui_with_layout(row_size(ui), buttons, |ui| {
        let button = named(ui.small_button("Remove"), format!("Remove {name}"));
        if button.on_hover_text("Take it out of the project").clicked() {
            actions.push(Action::Relight(Relight::GiveUp(index)));
        }
        if part.file().is_some() {
            let button = named(ui.small_button("Find…"), format!("Find {name}…"));
            if button.on_hover_text("Say where its file is now").clicked() {
                actions.push(Action::Ask(PathRequest::Find(index)));
            }
        }
        // The name takes what is left, below the names of the others.
        ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
            swatch(ui, Color32::TRANSPARENT);
            ui.add_space(ui.spacing().button_padding.x);
            ui.add(egui::Label::new(text).truncate()).on_hover_text(problem);
        });
    });
}

fn row_size(ui: &egui::Ui) -> egui::Vec2 {
    egui::vec2(ui.available_width(), ui.spacing().interact_size.y)
}
