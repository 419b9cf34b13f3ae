//! Dialogs that wait for an answer: paths, unsaved work, a capture that was moved, a material; and
//! the windows of the help menu.

use std::path::PathBuf;

use eframe::egui;

use super::modal::{ask, buttons, path_field};
use super::numbers::{list_color, swatch};
use crate::app::actions::{Action, PathRequest};
use crate::app::change::Change;
use crate::app::commands;
use crate::app::dialogs::PathField;
use crate::app::opening::AfterPrompt;
use crate::app::state::State;

const ENTER: &str = "Go on (Enter)";

pub fn questions_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    if state.dialogs.path.is_some() {
        path_ui(ctx, state, actions);
    } else if state.dialogs.replace.is_some() {
        replace_ui(ctx, state, actions);
    } else if state.dialogs.unsaved.is_some() {
        unsaved_ui(ctx, state, actions);
    } else if state.dialogs.begin.is_some() {
        super::begin::begin_ui(ctx, state, actions);
    } else if state.dialogs.scene_export.is_some() {
        super::scene_export::scene_export_ui(ctx, state, actions);
    } else if state.dialogs.pictures.is_some() {
        super::pictures::pictures_ui(ctx, state, actions);
    } else if state.dialogs.run_beside_study.is_some() {
        beside_study_ui(ctx, state, actions);
    } else if state.dialogs.locate.is_some() {
        locate_ui(ctx, state, actions);
    } else if state.dialogs.meshless.is_some() {
        super::meshless::meshless_ui(ctx, state, actions);
    } else if state.dialogs.assign {
        assign_ui(ctx, state, actions);
    }
    super::guide::guide_ui(ctx, state);
    if state.dialogs.shortcuts {
        shortcuts_ui(ctx, state);
    }
    if state.dialogs.about {
        about_ui(ctx, state);
    }
    if state.dialogs.report.is_some() {
        report_ui(ctx, state, actions);
    }
}

fn path_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let Some(PathField { asked, text, notice, focused }) = &mut state.dialogs.path else { return };
    let asked = *asked;
    let (answer, left) = ask(ctx, asked.title(), 560.0, |ui| {
        if let Some(notice) = notice {
            ui.label(*notice);
        }
        let entered = path_field(ui, text, focused, "A path on this computer");
        ui.add_space(6.0);
        buttons(ui, (accept(asked), ENTER), !text.trim().is_empty(), entered)
    });
    match answer {
        Some(true) => {
            let path = PathBuf::from(text.trim());
            state.dialogs.path = None;
            actions.push(asked.action(path, false));
        }
        Some(false) => leave_path(state),
        None if left => leave_path(state),
        None => {}
    }
}

/// Not saving leaves what was to come after it undone.
fn leave_path(state: &mut State) {
    state.dialogs.path = None;
    state.dialogs.unsaved = None;
}

fn accept(asked: PathRequest) -> &'static str {
    match asked {
        PathRequest::OpenCapture | PathRequest::OpenProject => "Open",
        PathRequest::SaveAs => "Save",
        PathRequest::Export => "Export",
        PathRequest::Locate | PathRequest::Find(_) | PathRequest::FindLight(_) => "Use",
        PathRequest::AddObject
        | PathRequest::AddDome
        | PathRequest::AddSky
        | PathRequest::AddChartTable => "Add",
        PathRequest::LoadEdits => "Load",
        PathRequest::SaveEdits | PathRequest::SavePlot(..) => "Save",
        PathRequest::ImportCameras
        | PathRequest::ImportCameraFolder
        | PathRequest::ImportImages
        | PathRequest::ImportMesh
        | PathRequest::ImportOut
        | PathRequest::RenderTo
        | PathRequest::SceneFolder
        | PathRequest::NewFolder => "Choose",
        PathRequest::NewPhotographs => "Add photographs",
        PathRequest::SaveStudy(_) => "Save study",
    }
}

fn replace_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let Some((asked, path)) = state.dialogs.replace.clone() else { return };
    let (title, what, help) = match asked {
        PathRequest::Export => (
            "Replace the results?",
            "holds results already. They would be lost.",
            "Lose the results in that folder",
        ),
        _ => (
            "Replace the file?",
            "is there already. Its contents would be lost.",
            "Lose what that file holds",
        ),
    };
    let (answer, left) = ask(ctx, title, 420.0, |ui| {
        ui.label(format!("{} {what}", path.display()));
        ui.add_space(6.0);
        buttons(ui, ("Replace", help), true, false)
    });
    if answer.is_some() || left {
        state.dialogs.replace = None;
        if answer == Some(true) {
            actions.push(asked.action(path, true));
        } else {
            leave_path(state);
        }
    }
}

fn unsaved_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let name = state.project.as_ref().map_or_else(String::new, |project| project.name());
    let stake = state.unsaved_work(matches!(state.dialogs.unsaved, Some(AfterPrompt::Quit)));
    let is_changed = stake.edit.is_some() || stake.results.is_some() || stake.model.is_some();
    let title = if is_changed { "Save changes?" } else { "Leave the project?" };
    let mut choices = Vec::new();
    if is_changed {
        choices.push(("Save", "Save it first", Some(Action::Unsaved { save: true })));
    }
    let (text, help) = if is_changed {
        ("Don't save", "Lose what was changed since the last save")
    } else {
        ("Leave", "Go on all the same")
    };
    choices.push((text, help, Some(Action::Unsaved { save: false })));
    choices.push(("Cancel", "Stay here (Esc)", None));
    let (answer, left) = ask(ctx, title, 420.0, |ui| {
        for (is_lost, text) in [
            (
                stake.edit.is_some(),
                format!("Tags or options of \"{name}\" were changed and not saved."),
            ),
            (stake.model.is_some(), "What was drawn on the photographs is not saved.".to_owned()),
            (stake.run.is_some(), "The reconstruction that runs would be cancelled.".to_owned()),
            (stake.results.is_some(), "The results are not saved: they would be lost.".to_owned()),
            (stake.study > 0, "The study of this capture was not saved: it would be lost.".into()),
            (stake.export.is_some(), "Results are being written: that would stop.".to_owned()),
        ] {
            if is_lost {
                ui.label(text);
            }
        }
        ui.add_space(6.0);
        ui.horizontal(|ui| {
            let clicked = |(text, help, action): (&str, &str, Option<Action>)| {
                ui.button(text).on_hover_text(help).clicked().then_some(action)
            };
            choices.into_iter().filter_map(clicked).last()
        })
        .inner
    });
    match answer {
        // What comes after waits for this to be carried out.
        Some(Some(action @ Action::Unsaved { .. })) => actions.push(action),
        Some(other) => {
            state.dialogs.unsaved = None;
            actions.extend(other);
        }
        None if left => state.dialogs.unsaved = None,
        None => {}
    }
}

/// A run beside a study of speed.
fn beside_study_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let Some(afresh) = state.dialogs.run_beside_study else { return };
    let (answer, left) = ask(ctx, "Run beside the study?", 420.0, |ui| {
        ui.label(
            "The study of speed measures seconds. A run beside it takes part of the machine, and \
             makes them longer than they are.",
        );
        ui.add_space(6.0);
        buttons(ui, ("Run all the same", "Begin the run now"), true, false)
    });
    if answer == Some(true) {
        actions.push(Action::RunBesideStudy { afresh });
    }
    if answer.is_some() || left {
        state.dialogs.run_beside_study = None;
    }
}

fn locate_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let Some(locate) = &mut state.dialogs.locate else { return };
    let (answer, left) = ask(ctx, "Find the capture", 560.0, |ui| {
        ui.label("The capture of this project is not where it was. Where is its folder now?");
        ui.weak(locate.opening.folder.display().to_string());
        let entered = path_field(ui, &mut locate.text, &mut locate.focused, "The capture's folder");
        if ui.button("Browse…").on_hover_text("Choose the folder").clicked() {
            actions.push(Action::Ask(PathRequest::Locate));
        }
        ui.add_space(6.0);
        buttons(ui, ("Use", ENTER), !locate.text.trim().is_empty(), entered)
    });
    match answer {
        Some(true) => actions.push(Action::Locate(PathBuf::from(locate.text.trim()))),
        Some(false) => state.dialogs.locate = None,
        None if left => state.dialogs.locate = None,
        None => {}
    }
}

fn assign_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let Some(project) = &state.project else { return };
    let surfaces = project.selection.surfaces.clone();
    let (chosen, left) = ask(ctx, "Assign material", 280.0, |ui| {
        let mut chosen = None;
        egui::ScrollArea::vertical().max_height(360.0).show(ui, |ui| {
            for (index, material) in project.edit().materials.iter().enumerate() {
                ui.horizontal(|ui| {
                    swatch(ui, list_color(project, index));
                    let button = egui::Button::new(material.name.as_str()).frame(false);
                    if ui.add(button).on_hover_text("Assign this material").clicked() {
                        let surfaces = surfaces.clone();
                        chosen = Some(Change::Assign { surfaces, material: index });
                    }
                });
            }
        });
        ui.separator();
        if ui.button("New material").on_hover_text("Make one of these surfaces").clicked() {
            chosen = Some(Change::NewMaterial { surfaces: surfaces.clone() });
        }
        if ui.button("No material").on_hover_text("Estimate no reflectance there").clicked() {
            chosen = Some(Change::Unassign { surfaces: surfaces.clone() });
        }
        chosen
    });
    if let Some(change) = chosen {
        actions.push(Action::Change(change));
        state.dialogs.assign = false;
    } else if left {
        state.dialogs.assign = false;
    }
}

fn shortcuts_ui(ctx: &egui::Context, state: &mut State) {
    let mut entries = commands::entries_here(ctx);
    entries.retain(|entry| !entry.key.is_empty());
    // Each column has one width, so that it is aligned across the groups.
    let cell = |ui: &mut egui::Ui, width: f32, text: egui::RichText| {
        ui.horizontal(|ui| {
            ui.set_min_width(width);
            ui.label(text);
        })
    };
    let (closed, left) = ask(ctx, "Keyboard shortcuts", 620.0, |ui| {
        let scroll = egui::ScrollArea::vertical().auto_shrink([false, true]);
        scroll.max_height(ctx.content_rect().height() - 160.0).show(ui, |ui| {
            for group in entries.chunk_by(|a, b| a.menu == b.menu) {
                ui.add_space(4.0);
                ui.strong(group[0].menu);
                let grid = egui::Grid::new(group[0].menu).num_columns(4).striped(true);
                grid.spacing([12.0, 3.0]).show(ui, |ui| {
                    for pair in group.chunks(2) {
                        for entry in pair {
                            cell(ui, 100.0, egui::RichText::new(&entry.key).monospace());
                            cell(ui, 165.0, egui::RichText::new(entry.name));
                        }
                        ui.end_row();
                    }
                });
            }
        });
        ui.add_space(6.0);
        ui.button("Close").on_hover_text("Close this list (Esc)").clicked()
    });
    state.dialogs.shortcuts = !(closed || left);
}

fn report_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let Some(report) = &state.dialogs.report else { return };
    let (closed, left) = ask(ctx, "Report a problem", 620.0, |ui| {
        ui.label(
            "Copy this into your report, and add what you did and what you expected. It holds no \
             photographs; names of your files and folders may be in it.",
        );
        ui.add_space(6.0);
        let height = (ctx.content_rect().height() - 220.0).max(80.0);
        egui::ScrollArea::both().max_height(height).show(ui, |ui| {
            let text = egui::RichText::new(report.as_str()).monospace();
            ui.add(egui::Label::new(text).selectable(true).extend())
                .on_hover_text("What is copied");
        });
        ui.add_space(6.0);
        ui.horizontal(|ui| {
            if ui.button("Copy report").on_hover_text("Copy it to the clipboard").clicked() {
                actions.push(Action::Copy(report.clone()));
            }
            ui.button("Close").on_hover_text("Close this window (Esc)").clicked()
        })
        .inner
    });
    if closed || left {
        state.dialogs.report = None;
    }
}

fn about_ui(ctx: &egui::Context, state: &mut State) {
    let (adapter, guide) = (state.adapter.clone(), state.guide.clone());
    let (closed, left) = ask(ctx, "About Lobelia", 460.0, |ui| {
        ui.label(format!("Version {}", env!("CARGO_PKG_VERSION")));
        ui.label(env!("CARGO_PKG_DESCRIPTION"));
        ui.add_space(6.0);
        ui.label(
            "The method is that of Gibson, Howard and Hubbard, \"Flexible Image-Based \
             Photometric Reconstruction using Virtual Light Sources\" (Eurographics 2001).",
        );
        ui.add_space(6.0);
        ui.weak(format!("Graphics adapter: {adapter}"));
        ui.weak(format!("Licence: {}", env!("CARGO_PKG_LICENSE")));
        if let Some(guide) = &guide {
            ui.weak(format!("User guide: {}", guide.display()));
        }
        ui.add_space(6.0);
        ui.button("Close").on_hover_text("Close this window (Esc)").clicked()
    });
    state.dialogs.about = !(closed || left);
}
