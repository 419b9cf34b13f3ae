//! The menus and the workspace tabs.

use eframe::egui;

use super::run::run_button;
use crate::app::actions::Action;
use crate::app::commands::{self, Command, Menu};
use crate::app::layout::Workspace;
use crate::app::modelling::ModelAction;
use crate::app::state::State;

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
                let tab = egui::Button::selectable(state.is_modelling(), "Model");
                let help =
                    "Lines and corners on the photographs, which place cameras and things (F7)";
                if ui.add(tab).on_hover_text(help).clicked() {
                    actions.push(Action::Model(ModelAction::Show));
                }
            }
            if let Some(project) = &state.project {
                for workspace in Workspace::ALL {
                    let current = state.layout.current == workspace
                        && !state.is_importing()
                        && !state.is_modelling();
                    let tab = egui::Button::selectable(current, workspace.name());
                    if ui.add(tab).on_hover_text(workspace.help()).clicked() {
                        actions.push(Action::Workspace(workspace));
                    }
                }
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    run_button(ui, project, ["Run", "Cancel run"], None, actions);
                });
            }
        });
    });
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
        let response =
            ui.add_enabled(command.is_enabled(state), button).on_hover_text(command.help);
        if response.clicked() {
            actions.push(command.action.clone());
            ui.close();
        }
    }
}
