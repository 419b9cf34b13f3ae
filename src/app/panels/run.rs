//! The run: method, options, stages.

use eframe::egui;

use super::numbers::{check_mark, count, cut, duration, named, rgb};
use super::options::{is_used, option_ui, section_title};
use crate::app::actions::Action;
use crate::app::edit::Change;
use crate::app::project::{Project, Run};
use crate::options::Declaration;
use crate::reconstruct::Stage;

pub struct RunPanelState {
    declarations: Vec<Declaration>,
    changed_only: bool,
}

impl Default for RunPanelState {
    fn default() -> Self {
        let declarations = crate::reconstruct::Options::default().declarations();
        Self { declarations, changed_only: false }
    }
}

pub fn run_ui(
    ui: &mut egui::Ui,
    project: &Project,
    state: &mut RunPanelState,
    actions: &mut Vec<Action>,
) {
    let size = Some(egui::vec2(ui.available_width(), 28.0));
    run_button(ui, project, ["Run reconstruction", "Cancel reconstruction"], size, actions);
    match &project.run {
        Some(run) => running(ui, run),
        None => finished(ui, project),
    }
    ui.separator();
    let any_changed = state
        .declarations
        .iter()
        .any(|d| project.edit().options.get(d.section, d.name).as_deref() != Some(&d.default))
        || !project.edit().options.start.is_empty();
    ui.horizontal_wrapped(|ui| {
        ui.checkbox(&mut state.changed_only, "Changed only")
            .on_hover_text("Show only options that differ from their defaults");
        let reset = ui.add_enabled(any_changed, egui::Button::new("Reset all").small());
        if reset.on_hover_text("Put every option back to its default").clicked() {
            actions.push(Action::Change(Change::DefaultOptions));
        }
    });
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let mut rest = state.declarations.as_slice();
        while let Some(first) = rest.first() {
            let number = rest.iter().take_while(|d| d.section == first.section).count();
            let (own, others) = rest.split_at(number);
            rest = others;
            section(ui, project, own, state.changed_only, actions);
        }
        starts(ui, project, actions);
    });
}

fn section(
    ui: &mut egui::Ui,
    project: &Project,
    declarations: &[Declaration],
    changed_only: bool,
    actions: &mut Vec<Action>,
) {
    let options = &project.edit().options;
    let changed = |d: &&Declaration| options.get(d.section, d.name).as_deref() != Some(&d.default);
    let number = declarations.iter().filter(changed).count();
    if changed_only && number == 0 {
        return;
    }
    let name = declarations[0].section;
    let mut title = section_title(name).to_owned();
    if number > 0 {
        title.push_str(&format!(" ({number} changed)"));
    }
    let used = is_used(name, options);
    let text = egui::RichText::new(title);
    let text = if used { text } else { text.weak() };
    let header = egui::CollapsingHeader::new(text)
        .id_salt(name)
        .default_open(matches!(name, "general" | "samples" | "joint"))
        .show(ui, |ui| {
            for declaration in declarations.iter().filter(|d| !changed_only || changed(d)) {
                option_ui(ui, project, declaration, actions);
            }
        });
    if !used {
        header.header_response.on_hover_text("The method that is chosen does not use these.");
    }
}

/// Reflectances to start from, which a project file may give.
fn starts(ui: &mut egui::Ui, project: &Project, actions: &mut Vec<Action>) {
    let starts = &project.edit().options.start;
    if starts.is_empty() {
        return;
    }
    let title = format!("Start values ({})", starts.len());
    egui::CollapsingHeader::new(title).id_salt("start").default_open(true).show(ui, |ui| {
        for (material, diffuse) in starts {
            ui.horizontal(|ui| {
                let response = ui.small_button("Remove").on_hover_text("Start from Eq. 11 instead");
                let response = named(response, format!("Remove the start of {material}"));
                if response.clicked() {
                    let material = material.clone();
                    actions.push(Action::Change(Change::ForgetStart { material }));
                }
                cut(ui, format!("{material} {}", rgb(*diffuse)));
            });
        }
    });
}

/// Runs, or cancels what runs; `words` for either.
pub fn run_button(
    ui: &mut egui::Ui,
    project: &Project,
    words: [&str; 2],
    size: Option<egui::Vec2>,
    actions: &mut Vec<Action>,
) {
    let [run, cancel] = words;
    let (text, help, action) = if project.run.is_some() {
        let help = "Stop; what was there before comes back (Esc)";
        (egui::RichText::new(cancel), help, Action::Cancel)
    } else {
        let help = "Recover reflectances and light with these options (Ctrl+R)";
        (egui::RichText::new(run).color(egui::Color32::WHITE), help, Action::Run)
    };
    let mut button = egui::Button::new(text);
    let mut obstacle = None;
    if action == Action::Run {
        button = button.fill(crate::app::theme::ACCENT);
        obstacle = project.obstacle();
    }
    let response = ui
        .add_enabled_ui(obstacle.is_none(), |ui| match size {
            Some(size) => ui.add_sized(size, button),
            None => ui.add(button),
        })
        .inner
        .on_hover_text(help)
        .on_disabled_hover_text(obstacle.unwrap_or_default());
    if response.clicked() {
        actions.push(action);
    }
}

/// How far the current stage is, and the time it still needs.
pub fn progress_ui(ui: &mut egui::Ui, run: &Run, width: f32) {
    let Some(progress) = run.progress.filter(|progress| progress.total > 0) else { return };
    let part = progress.done as f32 / progress.total as f32;
    // Beside the bar: within it a text is either on the filled part's colour or on the other's.
    ui.horizontal(|ui| {
        ui.add(egui::ProgressBar::new(part.min(1.0)).desired_width(width));
        let (done, total) = (count(progress.done as usize), count(progress.total as usize));
        ui.label(format!("{done} / {total}"));
        if let Some(left) = run.secs_left() {
            ui.label(format!("{} left", duration(left)));
        }
    });
}

/// The stages with a check mark and seconds for each that is done.
fn running(ui: &mut egui::Ui, run: &Run) {
    egui::Grid::new("stages").num_columns(3).spacing([8.0, 2.0]).show(ui, |ui| {
        let current = run.stages.len().saturating_sub(1);
        for (index, (stage, began, secs)) in run.stages.iter().enumerate() {
            if index < current {
                check_mark(ui);
                ui.label(stage.name());
                ui.label(duration(*secs));
            } else {
                ui.spinner();
                ui.strong(stage.name());
                ui.horizontal(|ui| {
                    ui.label(duration(began.elapsed().as_secs_f64()));
                    progress_ui(ui, run, 60.0);
                });
            }
            ui.end_row();
        }
        let begun: Vec<Stage> = run.stages.iter().map(|(stage, ..)| *stage).collect();
        for stage in Stage::ALL.into_iter().filter(|stage| !begun.contains(stage)) {
            ui.label("");
            ui.weak(stage.name());
            ui.label("");
            ui.end_row();
        }
    });
}

fn finished(ui: &mut egui::Ui, project: &Project) {
    if let Some(whole) = &project.products.whole {
        ui.horizontal_wrapped(|ui| {
            super::numbers::outdated(ui, project);
            ui.label(whole.solution.brief());
        });
        let text: Vec<String> = Stage::ALL
            .iter()
            .zip(whole.seconds)
            .map(|(stage, secs)| format!("{} {}", stage.name(), duration(secs)))
            .collect();
        ui.weak(text.join(", "));
    } else if project.products.of.is_some() {
        ui.weak("The last run did not end; what it found so far is shown.");
    } else {
        ui.weak("Not run yet.");
    }
}
