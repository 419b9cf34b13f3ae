//! New from photographs: the dialog for the photographs and the folder.

use eframe::egui;

use super::modal::ask;
use crate::app::actions::{Action, NewAction, PathRequest};
use crate::app::panels::numbers::{counted, named};
use crate::app::state::State;
use crate::app::theme;

const TITLE: &str = "New from photographs";

pub fn begin_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let progress = state
        .dialogs
        .begin
        .as_ref()
        .and_then(|own| own.job)
        .and_then(|job| state.jobs.progress(job));
    let Some(own) = &mut state.dialogs.begin else { return };
    let is_copying = own.job.is_some();
    let ((), left) = ask(ctx, TITLE, 560.0, |ui| {
        ui.label(
            "Photographs of one room or table from different places; one is enough to begin. \
             OpenEXR and Radiance are measured; JPEG, PNG, TIFF and RAW give geometry.",
        );
        ui.add_space(6.0);
        ui.add_enabled_ui(!is_copying, |ui| {
            ui.horizontal(|ui| {
                let add =
                    ui.button("Add photographs…").on_hover_text("Choose one or several files");
                if add.clicked() {
                    actions.push(Action::Ask(PathRequest::NewPhotographs));
                }
                ui.weak(counted(own.photographs.len(), "photograph", "photographs"));
            });
            let height = (ui.ctx().content_rect().height() - 420.0).clamp(80.0, 200.0);
            egui::ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(
                ui,
                |ui| {
                    for (index, file) in own.photographs.iter().enumerate() {
                        ui.horizontal(|ui| {
                            let name = file.file_name().unwrap_or_default().to_string_lossy();
                            let help = format!("Leave {name} out");
                            let remove = ui.small_button("Remove").on_hover_text(&help);
                            if named(remove, help).clicked() {
                                actions.push(Action::New(NewAction::Remove(index)));
                            }
                            let label = egui::Label::new(name.as_ref()).truncate();
                            ui.add(label).on_hover_text(file.display().to_string());
                        });
                    }
                },
            );
            ui.add_space(6.0);
            let label = ui.label("Folder for the capture");
            ui.horizontal(|ui| {
                let browse = egui::Button::new("Folder…");
                let room = ui.available_width() - 76.0;
                let field = egui::TextEdit::singleline(&mut own.folder).desired_width(room);
                let help =
                    "It is made; the photographs are copied into it. It must be new or empty.";
                if ui.add(field).on_hover_text(help).labelled_by(label.id).changed() {
                    own.is_chosen = true;
                }
                if ui.add(browse).on_hover_text("Choose the folder").clicked() {
                    actions.push(Action::Ask(PathRequest::NewFolder));
                }
            });
        });
        if let Some(problem) = &own.problem {
            ui.add_space(4.0);
            ui.colored_label(ui.visuals().error_fg_color, problem);
        }
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            let obstacle = own.obstacle();
            let is_ready = obstacle.is_none() && !is_copying;
            let text = egui::RichText::new("Create").color(egui::Color32::WHITE);
            let create = egui::Button::new(text).fill(theme::ACCENT);
            let response = ui
                .add_enabled(is_ready, create)
                .on_hover_text("Copy the photographs into the folder and begin to draw")
                .on_disabled_hover_text(obstacle.unwrap_or("The photographs are being copied."));
            if response.clicked() {
                actions.push(Action::New(NewAction::Create));
            }
            let help = if is_copying { "Stop copying" } else { "Leave it (Esc)" };
            if ui.button("Cancel").on_hover_text(help).clicked() {
                actions.push(Action::New(NewAction::Leave));
            }
            if is_copying {
                ui.spinner();
                let done = progress.map_or(0, |own| own.done);
                ui.label(format!("Copying: {done} of {}", own.photographs.len()));
            } else if let Some(obstacle) = obstacle {
                ui.weak(obstacle);
            }
        });
    });
    if left && !is_copying {
        actions.push(Action::New(NewAction::Leave));
    }
}
