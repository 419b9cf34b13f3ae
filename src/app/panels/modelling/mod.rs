//! The Model page: tools and things on the left, the photograph in the middle with the others
//! below, numbers and the fit on the right.

mod blink;
mod diagram;
mod find;
mod fit;
mod hands;
mod overlay;
mod photograph;
mod strokes;
mod surfaces;
mod thing;
mod thumbs;
mod tools;
mod view;

use std::sync::Arc;

use eframe::egui;

use crate::app::actions::{Action, ModelAction};
use crate::app::keys;
use crate::app::modelling::ModelPage;
use crate::app::modelling::tool::Selected;
use crate::app::project::Project;
use crate::app::theme;
use crate::model::Model;

/// A change that a panel proposes: what undo calls it, and the model after it.
type Proposal = Option<(String, Model)>;

pub fn model_ui(
    ui: &mut egui::Ui,
    page: &mut ModelPage,
    project: Option<&Project>,
    actions: &mut Vec<Action>,
) {
    let Some(model) = page.model().cloned() else {
        egui::CentralPanel::default_margins().show(ui, |ui| match &page.problem {
            Some(problem) => {
                ui.add_space(24.0);
                ui.vertical_centered(|ui| {
                    ui.set_max_width(560.0);
                    ui.heading("The model of this capture cannot be read");
                    ui.add_space(6.0);
                    ui.colored_label(ui.visuals().error_fg_color, problem);
                    ui.add_space(6.0);
                    let help = keys::named(ui.ctx(), "Go back; nothing is changed (Ctrl+W)");
                    if ui.button("Close").on_hover_text(help).clicked() {
                        actions.push(Action::Close);
                    }
                });
            }
            None => {
                ui.centered_and_justified(|ui| ui.weak("Reading the photographs' names…"));
            }
        });
        return;
    };
    if model.photographs.is_empty() {
        egui::CentralPanel::default_margins().show(ui, |ui| {
            let text = "This capture names no photograph. Begin anew with New from photographs \
                        (Ctrl+N).";
            let text = keys::named(ui.ctx(), text);
            ui.centered_and_justified(|ui| ui.weak(text));
        });
        return;
    }
    egui::Panel::left("model tools")
        .resizable(true)
        .default_size(196.0)
        .size_range(160.0..=320.0)
        .show(ui, |ui| {
            scrolled(ui, "model tools", |ui| {
                find::cameras_ui(ui, page, &model, actions);
                tools::tools_ui(ui, page, &model, actions);
            });
        });
    egui::Panel::right("model numbers")
        .resizable(true)
        .default_size(312.0)
        .size_range(264.0..=480.0)
        .show(ui, |ui| {
            let frame = egui::Frame::NONE;
            egui::Panel::bottom("model use").frame(frame).show(ui, |ui| use_ui(ui, page, actions));
            egui::CentralPanel::no_frame().show(ui, |ui| {
                scrolled(ui, "model numbers", |ui| {
                    if page.finding.is_shown {
                        find::find_ui(ui, page, &model, actions);
                    } else {
                        let proposal = selected_ui(ui, page, &model, actions);
                        propose(proposal, actions);
                    }
                    fit::fit_ui(ui, page, &model, actions);
                });
            });
        });
    egui::Panel::bottom("model photographs")
        .resizable(false)
        .exact_size(86.0)
        .show(ui, |ui| thumbs::thumbs_ui(ui, page, &model));
    egui::CentralPanel::default_margins().show(ui, |ui| {
        photograph::bar_ui(ui, page, &model);
        view::view_ui(ui, page, &model, project, actions);
    });
}

/// A part of the page that scrolls, its bar beside what it scrolls.
fn scrolled(ui: &mut egui::Ui, name: &str, body: impl FnOnce(&mut egui::Ui)) {
    egui::ScrollArea::vertical().id_salt(name).auto_shrink(false).show(ui, |ui| {
        let room = egui::Margin { right: 10, top: 4, ..egui::Margin::ZERO };
        egui::Frame::NONE.inner_margin(room).show(ui, body);
    });
}

fn propose(proposal: Proposal, actions: &mut Vec<Action>) {
    if let Some((name, model)) = proposal {
        actions.push(Action::Model(ModelAction::Change(name, Arc::new(model))));
    }
}

/// The numbers of what is selected.
fn selected_ui(
    ui: &mut egui::Ui,
    page: &mut ModelPage,
    model: &Model,
    actions: &mut Vec<Action>,
) -> Proposal {
    match page.selected {
        Selected::Nothing => photograph::photograph_ui(ui, page, model),
        Selected::Thing(index) => thing::thing_ui(ui, page, model, index, actions),
        Selected::Point(index) => strokes::point_ui(ui, page, model, index, actions),
        Selected::Stroke(index) => strokes::stroke_ui(ui, page, model, index, actions),
    }
}

/// The way on to tagging.
fn use_ui(ui: &mut egui::Ui, page: &ModelPage, actions: &mut Vec<Action>) {
    ui.add_space(4.0);
    let obstacle = page.obstacle();
    let enabled = obstacle.is_none();
    let text = egui::RichText::new("Use this model");
    let (text, fill) = if enabled {
        (text.color(egui::Color32::WHITE), theme::ACCENT)
    } else {
        (text, ui.visuals().widgets.inactive.weak_bg_fill)
    };
    let size = egui::vec2(ui.available_width(), 28.0);
    let button = egui::Button::new(text).fill(fill);
    let help = keys::named(
        ui.ctx(),
        "Write scene.obj and the cameras into the capture and go on with tagging. Tags stay \
         with the surfaces of their names (Ctrl+M).",
    );
    let response = ui
        .add_enabled_ui(enabled, |ui| ui.add_sized(size, button))
        .inner
        .on_hover_text(help)
        .on_disabled_hover_text(obstacle.unwrap_or_default());
    if response.clicked() {
        actions.push(Action::Model(ModelAction::Use));
    }
    ui.add_space(4.0);
}
