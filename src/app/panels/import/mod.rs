//! The import page: settings on the left, what they give on the right.

mod exposures;
mod fields;
mod found;
mod measure;
mod path;
mod photographs;

use eframe::egui::{self, Id};

use super::modal;
use super::numbers::fixed;
use crate::app::actions::{Action, ImportAction};
use crate::app::import::{ImportPage, View};
use crate::app::theme;
use crate::app::viewport::Content;
use crate::watch::Progress;

/// The largest and the smallest side that rooms, houses and table tops have, in metres.
const USUAL_M: std::ops::RangeInclusive<f32> = 0.2..=200.0;

pub fn import_ui(ui: &mut egui::Ui, page: &mut ImportPage, actions: &mut Vec<Action>) {
    egui::Panel::left("import choices")
        .resizable(true)
        .default_size(384.0)
        .size_range(300.0..=560.0)
        .show(ui, |ui| {
            let frame = egui::Frame::NONE;
            egui::Panel::bottom("import buttons").frame(frame).show(ui, |ui| {
                buttons(ui, page, actions);
            });
            egui::CentralPanel::no_frame().show(ui, |ui| {
                egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    // The bar floats over what reaches the edge.
                    let room = egui::Margin { right: 10, ..egui::Margin::ZERO };
                    let frame = egui::Frame::NONE.inner_margin(room);
                    frame.show(ui, |ui| fields::fields_ui(ui, page, actions));
                });
            });
        });
    egui::Panel::bottom("import found")
        .resizable(true)
        .default_size(136.0)
        .size_range(60.0..=400.0)
        .show(ui, |ui| found::found_ui(ui, page, actions));
    egui::CentralPanel::default_margins().show(ui, |ui| {
        ui.horizontal(|ui| {
            for (view, name, help) in [
                (View::Mesh, "Mesh", "The mesh with a person of 1.7 m beside it, and the cameras"),
                (
                    View::Photographs,
                    "Photographs",
                    "The mesh's edges over each photograph, projected with its camera",
                ),
                (View::Exposures, "Exposures", "Exposure series, and the response of the camera"),
            ] {
                ui.selectable_value(&mut page.view, view, name).on_hover_text(help);
            }
            if page.is_checking() {
                ui.spinner();
            }
        });
        ui.add_space(2.0);
        match page.view {
            View::Mesh => mesh_ui(ui, page),
            View::Photographs => photographs::photographs_ui(ui, page),
            View::Exposures => exposures::exposures_ui(ui, page),
        }
    });
    replace_ui(ui.ctx(), page, actions);
}

fn buttons(ui: &mut egui::Ui, page: &ImportPage, actions: &mut Vec<Action>) {
    ui.add_space(4.0);
    if let Some((name, progress)) = page.work() {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label(name);
            if ui.button("Cancel").on_hover_text("Stop this (Esc)").clicked() {
                actions.push(Action::Import(ImportAction::Cancel));
            }
            if let Some(Progress { done, total }) = progress.filter(|own| own.total > 0) {
                let part = (done as f32 / total as f32).min(1.0);
                let bar = egui::ProgressBar::new(part).desired_height(14.0);
                ui.add(bar.text(format!("{done} of {total}")));
            }
        });
        ui.add_space(2.0);
    }
    ui.horizontal(|ui| {
        let obstacle = page.obstacle();
        let text = egui::RichText::new("Write capture and open");
        let enabled = obstacle.is_none();
        let (text, fill) = if enabled {
            (text.color(egui::Color32::WHITE), theme::ACCENT)
        } else {
            (text, ui.visuals().widgets.inactive.weak_bg_fill)
        };
        let button = egui::Button::new(text).fill(fill).min_size(egui::vec2(0.0, 26.0));
        let is_meshless = page.import.as_ref().is_some_and(|own| own.geometry.is_none());
        let help = if is_meshless {
            "Write photographs and cameras into the folder, whole or not at all, and go on with the \
             mesh: drawn on the photographs, or of another file"
        } else {
            "Write the capture into its folder, whole or not at all, and open it"
        };
        let response = ui
            .add_enabled(enabled, button)
            .on_hover_text(help)
            .on_disabled_hover_text(obstacle.unwrap_or_default());
        if response.clicked() {
            actions.push(Action::Import(ImportAction::Write { replace: false }));
        }
        let close = egui::Button::new("Close").min_size(egui::vec2(0.0, 26.0));
        let help = "Leave this page; what was chosen stays";
        if ui.add(close).on_hover_text(help).clicked() {
            actions.push(Action::Import(ImportAction::Hide));
        }
    });
    ui.add_space(4.0);
}

fn mesh_ui(ui: &mut egui::Ui, page: &mut ImportPage) {
    let Some(survey) = page.survey.clone() else {
        let text = match (&page.import, &page.problem) {
            (None, None) => {
                "Choose cameras, a mesh, or both. What they hold is shown here before anything is \
                 written."
            }
            (None, Some(_)) => "Nothing to show: the message below says why.",
            (Some(_), _) => "Preparing the view…",
        };
        ui.centered_and_justified(|ui| ui.weak(text));
        return;
    };
    let size = survey.import.geometry.as_ref().and_then(|own| own.mesh.bounds());
    ui.horizontal_wrapped(|ui| {
        match size.map(|(low, high)| high - low) {
            Some(size) => {
                let sides = size.to_array().map(|side| fixed(side, 2)).join(" × ");
                ui.strong(format!("{sides} m"))
                    .on_hover_text("The mesh along x, y and z, in metres of the capture");
                let largest = size.max_element();
                if !USUAL_M.contains(&largest) {
                    let word = if largest < 1.0 { "small" } else { "large" };
                    let text = format!("Unusually {word}: is the unit right?");
                    ui.colored_label(ui.visuals().warn_fg_color, text);
                }
            }
            None => {
                ui.weak("There is no mesh.");
            }
        }
        let reference = "The person is 1.7 m tall; the grid's lines are 1 m apart, more in large \
                         scenes. +z (blue) is up.";
        ui.weak(reference);
    });
    let content = Content { capture: Some(survey.scene.clone()), ..Content::default() };
    // Nothing is selected here.
    let _ = page.viewport.show(ui, &content);
}

fn replace_ui(ctx: &egui::Context, page: &mut ImportPage, actions: &mut Vec<Action>) {
    let Some(folder) = page.replace.clone() else { return };
    let (answer, left) = modal::ask(ctx, "Replace the capture?", 440.0, |ui| {
        ui.label(format!("{} holds a capture already.", folder.display()));
        ui.label("Its photographs, cameras, mesh and tags would be lost.");
        ui.add_space(6.0);
        modal::buttons(ui, ("Replace", "Lose the capture that is there"), true, false)
    });
    if answer.is_some() || left {
        page.replace = None;
        if answer == Some(true) {
            actions.push(Action::Import(ImportAction::Write { replace: true }));
        }
    }
}

/// An id of a widget of the page.
fn id(name: &str) -> Id {
    Id::unique(("import", name))
}
