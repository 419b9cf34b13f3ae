//! The menus and the workspace tabs.

use eframe::egui;

use crate::app::actions::Action;
use crate::app::commands::{self, Menu};
use crate::app::layout::Workspace;
use crate::app::state::State;

pub fn menu_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let frame = egui::Frame::side_top_panel(ui.style()).inner_margin(egui::Margin::symmetric(6, 3));
    egui::Panel::top("menu").frame(frame).show(ui, |ui| {
        egui::MenuBar::new().ui(ui, |ui| {
            let commands = commands::all();
            for menu in Menu::ALL {
                ui.menu_button(menu.name(), |ui| {
                    ui.set_min_width(240.0);
                    for command in commands.iter().filter(|command| command.menu == menu) {
                        if command.begins_group {
                            ui.separator();
                        }
                        let mut button = egui::Button::new(command.label(state));
                        if let Some(key) = &command.key {
                            button = button.shortcut_text(ui.ctx().format_shortcut(key));
                        }
                        let response = ui
                            .add_enabled(command.is_enabled(state), button)
                            .on_hover_text(command.help);
                        if response.clicked() {
                            actions.push(command.action.clone());
                            ui.close();
                        }
                    }
                });
            }
            if state.project.is_some() {
                ui.separator();
                for workspace in Workspace::ALL {
                    let current = state.layout.current == workspace;
                    let tab = egui::Button::selectable(current, workspace.name());
                    if ui.add(tab).on_hover_text(workspace.help()).clicked() {
                        actions.push(Action::Workspace(workspace));
                    }
                }
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    run_button(ui, state, actions);
                });
            }
        });
    });
}

fn run_button(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    if state.is_running() {
        if ui.button("Cancel run").on_hover_text("Stop the run (Esc)").clicked() {
            actions.push(Action::Cancel);
        }
        return;
    }
    let obstacle = state.obstacle_to_run();
    let text = egui::RichText::new("Run").color(egui::Color32::WHITE);
    let button = egui::Button::new(text).fill(crate::app::theme::ACCENT);
    let response = ui
        .add_enabled(obstacle.is_none(), button)
        .on_hover_text("Recover reflectances and light (Ctrl+R)")
        .on_disabled_hover_text(obstacle.unwrap_or_default());
    if response.clicked() {
        actions.push(Action::Run);
    }
}
