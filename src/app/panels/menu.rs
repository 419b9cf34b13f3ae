//! The menus and the workspace tabs.

use eframe::egui;

use super::run::run_button;
use crate::app::actions::{Action, ModelAction};
use crate::app::commands::{self, Command, Menu};
use crate::app::state::State;
use crate::app::workspaces::Workspace;

pub fn menu_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let frame = egui::Frame::side_top_panel(ui.style()).inner_margin(egui::Margin::symmetric(6, 3));
    egui::Panel::top("menu").frame(frame).show(ui, |ui| {
        egui::MenuBar::new().ui(ui, |ui| {
            let commands = commands::all();
            for menu in Menu::ALL {
                ui.menu_button(menu.name(), |ui| {
                    ui.set_min_width(240.0);
                    let own: Vec<&Command> =
                        commands.iter().filter(|command| command.menu == menu).collect();
                    for part in own.chunk_by(|a, b| a.within == b.within) {
                        match part[0].within {
                            Some(name) => {
                                ui.menu_button(name, |ui| entries_ui(ui, state, part, actions));
                            }
                            None => entries_ui(ui, state, part, actions),
                        }
                    }
                });
            }
            if state.project.is_some() || state.modelling.is_some() {
                ui.separator();
                // Large text leaves no room for all of them beside the menus.
                if ui.available_width() < TABS {
                    ui.menu_button(format!("Workspace: {}", page(state)), |ui| {
                        tabs_ui(ui, state, actions);
                    })
                    .response
                    .on_hover_text("The workspaces");
                } else {
                    tabs_ui(ui, state, actions);
                }
            }
            if let Some(project) = &state.project {
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    run_button(ui, project, ["Run", "Cancel run"], None, actions);
                });
            }
        });
    });
}

/// Points that all tabs and the button to run need.
const TABS: f32 = 480.0;

/// The page that is shown.
fn page(state: &State) -> &'static str {
    match () {
        () if state.is_importing() => "Import",
        () if state.is_modelling() => "Model",
        () => state.layout.current.name(),
    }
}

fn tabs_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let tab = egui::Button::selectable(state.is_modelling(), "Model");
    let help = "Lines and corners on the photographs, which place cameras and things (F7)";
    if ui.add(tab).on_hover_text(help).clicked() {
        actions.push(Action::Model(ModelAction::Show));
    }
    for workspace in Workspace::ALL.into_iter().filter(|_| state.project.is_some()) {
        let tab = egui::Button::selectable(page(state) == workspace.name(), workspace.name());
        if ui.add(tab).on_hover_text(workspace.help()).clicked() {
            actions.push(Action::Workspace(workspace));
        }
    }
}

fn entries_ui(ui: &mut egui::Ui, state: &State, part: &[&Command], actions: &mut Vec<Action>) {
    for command in part {
        if command.begins_group {
            ui.separator();
        }
        let mut button = egui::Button::new(command.label(state));
        if let Some(key) = &command.key {
            button = button.shortcut_text(ui.ctx().format_shortcut(key));
        }
        let response = ui
            .add_enabled(command.is_enabled(state), button)
            .on_hover_text(command.help)
            .on_disabled_hover_text(command.obstacle(state));
        if response.clicked() {
            actions.push(command.action.clone());
            ui.close();
        }
    }
}
