//! The start page.

use eframe::egui;

use super::cards::left_behind_ui;
use super::numbers::named;
use crate::app::actions::{Action, ImportAction, NewAction, PathRequest};
use crate::app::keys;
use crate::app::state::State;
use crate::io::project;

pub fn start_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    egui::CentralPanel::default_margins().show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let width = ui.available_width().min(640.0);
            let margin = (0.5 * (ui.available_width() - width)).max(0.0);
            ui.add_space((0.08 * ui.available_height()).max(8.0));
            ui.horizontal_top(|ui| {
                ui.add_space(margin);
                ui.vertical(|ui| {
                    ui.set_width(width);
                    page(ui, state, actions);
                });
            });
        });
    });
}

fn page(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    ui.label(egui::RichText::new("Lobelia").size(26.0).strong());
    ui.weak("Reflectances and light from photographs and partial geometry");
    ui.add_space(16.0);
    if let Some(path) = state.jobs.opens() {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label(format!("Opening {}", path.display()));
            if ui.button("Stop").on_hover_text("Give this opening up").clicked() {
                actions.push(Action::CancelOpening);
            }
        });
        ui.add_space(8.0);
    }
    for left in &state.left_behind {
        egui::Frame::group(ui.style()).show(ui, |ui| left_behind_ui(ui, left, actions));
        ui.add_space(8.0);
    }
    ui.horizontal_wrapped(|ui| {
        let size = egui::vec2(0.0, 30.0);
        let mut choice = |text: &str, help: &str, action: Action| {
            let button = egui::Button::new(text).min_size(size);
            if ui.add(button).on_hover_text(keys::named(ui.ctx(), help)).clicked() {
                actions.push(action);
            }
        };
        choice(
            "Open capture…",
            "A folder with scene.obj, transforms.json and photographs (Ctrl+O)",
            Action::Ask(PathRequest::OpenCapture),
        );
        choice(
            "Open project…",
            "A .lobelia file (Ctrl+Shift+O)",
            Action::Ask(PathRequest::OpenProject),
        );
        choice(
            "New from photographs…",
            "Begin with photographs alone: cameras and geometry come from what is drawn on them \
             (Ctrl+N)",
            Action::New(NewAction::Show),
        );
        choice(
            "Import…",
            "Cameras, mesh and photographs of other programs: COLMAP, Meshroom, Metashape, \
             RealityCapture, glTF and more (Ctrl+I)",
            Action::Import(ImportAction::Show(None)),
        );
        if state.example.is_some() {
            choice(
                "Open example",
                "The corner of a room with three boxes, shipped with the program",
                Action::OpenExample,
            );
        }
    });
    ui.add_space(4.0);
    ui.weak(
        "Or drop photographs, a capture, a project, or the cameras of another program onto this \
         window.",
    );
    ui.add_space(20.0);
    recent(ui, state, actions);
}

fn recent(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    ui.heading("Recent");
    ui.add_space(4.0);
    if state.settings.recent.is_empty() {
        ui.weak("Captures and projects that you open will be listed here.");
    }
    for path in &state.settings.recent {
        let exists = !state.missing.contains(path);
        let name = path
            .file_name()
            .map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
        ui.horizontal(|ui| {
            let kind = if project::is_project(path) { "project" } else { "capture" };
            let button = egui::Button::new(name.as_str()).frame(false);
            let response = ui
                .add_enabled(exists, button)
                .on_hover_text(format!("Open this {kind}"))
                .on_disabled_hover_text("It is no longer there, or its drive is not connected.");
            if response.clicked() {
                actions.push(Action::Open(path.clone()));
            }
            if !exists {
                ui.weak("missing");
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let help = format!("Take {name} off this list");
                let remove = ui.small_button("Remove").on_hover_text(&help);
                if named(remove, help).clicked() {
                    actions.push(Action::ForgetRecent(path.clone()));
                }
                let folder = path.parent().unwrap_or(path).display().to_string();
                ui.add(egui::Label::new(egui::RichText::new(folder).weak()).truncate());
            });
        });
    }
}
