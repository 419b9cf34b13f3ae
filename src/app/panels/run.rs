//! The run: the method, the options, and the progress of the stages.

use std::sync::Arc;

use eframe::egui;

use super::context::Context;
use super::no_radiance::no_radiance_ui;
use super::numbers::{check_mark, count, cut, duration, named, rgb};
use super::options::{is_used, option_ui, section_title};
use crate::app::actions::Action;
use crate::app::change::Change;
use crate::app::edit::Edit;
use crate::app::keys;
use crate::app::products::Run;
use crate::app::project::Project;
use crate::options::Declaration;
use crate::reconstruct::memory::gigabytes;
use crate::reconstruct::{MemoryNeed, Method, Stage};

pub struct State {
    declarations: Vec<Declaration>,
    changed_only: bool,
    foreseen: Option<Foreseen>,
}

/// Which stages the next run would take over, and of what that is true.
struct Foreseen {
    edit: Arc<Edit>,
    /// Of what is kept.
    changes: u64,
    kept: [bool; 5],
}

impl Default for State {
    fn default() -> Self {
        let declarations = crate::reconstruct::Options::default().declarations();
        Self { declarations, changed_only: false, foreseen: None }
    }
}

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, actions, .. } = context;
    let size = Some(egui::vec2(ui.available_width(), 28.0));
    run_button(ui, project, ["Run reconstruction", "Cancel reconstruction"], size, actions);
    match &project.run {
        Some(run) => running(ui, run),
        None => {
            no_radiance_ui(ui, project, actions);
            finished(ui, project);
            next(ui, project, state, actions);
            memory(ui, project);
        }
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
        let reset = reset.on_disabled_hover_text("Every option is at its default.");
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
        .on_hover_text(keys::named(ui.ctx(), help))
        .on_disabled_hover_text(obstacle.unwrap_or_default());
    if response.clicked() {
        actions.push(action);
    }
}

/// How far the current stage is, and the time it still needs, as parts of a row.
pub fn progress_ui(ui: &mut egui::Ui, run: &Run, width: f32) {
    let Some(progress) = run.progress.filter(|progress| progress.total > 0) else { return };
    let part = progress.done as f32 / progress.total as f32;
    // Beside the bar: within it a text is either on the filled part's colour or on the other's.
    ui.add(egui::ProgressBar::new(part.min(1.0)).desired_width(width));
    let (done, total) = (count(progress.done as usize), count(progress.total as usize));
    ui.label(format!("{done} / {total}"));
    if let Some(left) = run.secs_left() {
        ui.label(format!("{} left", duration(left)));
    }
}

/// The stages with a check mark and seconds for each that is done.
fn running(ui: &mut egui::Ui, run: &Run) {
    egui::Grid::new("stages").num_columns(3).spacing([8.0, 2.0]).show(ui, |ui| {
        for stage in &run.kept {
            check_mark(ui);
            ui.label(stage.name());
            ui.weak("kept").on_hover_text(KEPT);
            ui.end_row();
        }
        let current = run.stages.len().saturating_sub(1);
        for (index, (stage, began, secs)) in run.stages.iter().enumerate() {
            if index < current {
                check_mark(ui);
                ui.label(stage.name());
                ui.label(duration(*secs));
            } else {
                ui.spinner();
                ui.strong(stage.name());
                ui.label(duration(began.elapsed().as_secs_f64()));
            }
            ui.end_row();
        }
        let begun: Vec<Stage> = run.stages.iter().map(|(stage, ..)| *stage).collect();
        let is_to_come = |stage: &Stage| !begun.contains(stage) && !run.kept.contains(stage);
        for stage in Stage::ALL.into_iter().filter(is_to_come) {
            ui.label("");
            ui.weak(stage.name());
            ui.label("");
            ui.end_row();
        }
    });
    // Below them, where it may go on in the next row: a narrow panel has no room beside a stage.
    ui.horizontal_wrapped(|ui| progress_ui(ui, run, 60.0));
}

fn finished(ui: &mut egui::Ui, project: &Project) {
    if let Some(whole) = &project.products.whole {
        ui.horizontal_wrapped(|ui| {
            super::numbers::outdated(ui, project);
            ui.label(whole.solution.brief());
        });
        let text: Vec<String> = Stage::ALL
            .iter()
            .map(|stage| {
                let index = *stage as usize;
                match whole.kept[index] {
                    true => format!("{} kept", stage.name()),
                    false => format!("{} {}", stage.name(), duration(whole.seconds[index])),
                }
            })
            .collect();
        let text = ui.weak(text.join(", "));
        if whole.kept.contains(&true) {
            text.on_hover_text(KEPT);
        }
    } else if project.products.of.is_some() {
        ui.weak("The last run did not end; what it found so far is shown.");
    } else {
        ui.weak("Not run yet.");
    }
}

const KEPT: &str =
    "Taken over from an earlier run, in which nothing was different that it depends on";

/// What the next run takes over, and where it begins.
fn next(ui: &mut egui::Ui, project: &Project, state: &mut State, actions: &mut Vec<Action>) {
    let changes = project.stage_cache.changes();
    if changes == 0 {
        state.foreseen = None;
        return;
    }
    let edit = project.edit();
    let is_of_now = |own: &Foreseen| own.changes == changes && Arc::ptr_eq(&own.edit, edit);
    if !state.foreseen.as_ref().is_some_and(is_of_now) {
        let kept = project.stage_cache.stages(&project.capture, &edit.run_options());
        state.foreseen = Some(Foreseen { edit: edit.clone(), changes, kept });
    }
    let Some(Foreseen { kept, .. }) = state.foreseen else { return };
    ui.horizontal_wrapped(|ui| {
        ui.label(foreseen(kept, edit.options.general.method));
        if kept.contains(&true) {
            let obstacle = project.obstacle();
            let button = egui::Button::new("Run afresh").small();
            let help = "Do every stage anew and take nothing over (Ctrl+Shift+R)";
            let response = ui
                .add_enabled(obstacle.is_none(), button)
                .on_hover_text(keys::named(ui.ctx(), help))
                .on_disabled_hover_text(obstacle.unwrap_or_default());
            if response.clicked() {
                actions.push(Action::RunAfresh);
            }
        }
    });
}

/// What the next run takes of memory.
fn memory(ui: &mut egui::Ui, project: &Project) {
    if project.capture.measurements().next().is_none() {
        return;
    }
    let need = MemoryNeed::of(&project.capture, &project.edit().run_options());
    let text = format!("Takes up to {} of memory.", gigabytes(need.peak()));
    let help = format!(
        "At most, of a whole run: {} are the photographs and the mesh, which are there already; the \
         stage that takes most is {}. A run that does not fit is refused.",
        gigabytes(need.loaded),
        need.largest().name()
    );
    ui.weak(text).on_hover_text(help);
}

/// Where the next run begins, in a sentence.
fn foreseen(kept: [bool; 5], method: Method) -> String {
    let order = match method {
        Method::Joint => {
            [Stage::Samples, Stage::Transport, Stage::Solve, Stage::Lights, Stage::Textures]
        }
        Method::Paper => Stage::ALL,
    };
    let names = |wanted: bool| -> Vec<&str> {
        let own = order.iter().filter(|stage| kept[**stage as usize] == wanted);
        own.map(|stage| stage.name()).collect()
    };
    match (names(true).as_slice(), names(false).as_slice()) {
        ([], _) => "The next run does every stage.".to_owned(),
        (_, []) => "The next run keeps every stage: nothing has changed.".to_owned(),
        ([one], [first, ..]) => format!("The next run keeps {one} and begins with {first}."),
        ([others @ .., last], [first, ..]) => {
            let others = others.join(", ");
            format!("The next run keeps {others} and {last}, and begins with {first}.")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_run_is_told_in_the_order_of_its_stages() {
        let kept = |stages: &[Stage]| Stage::ALL.map(|stage| stages.contains(&stage));
        let tell = |stages: &[Stage], method| foreseen(kept(stages), method);
        use Stage::{Lights, Samples, Solve, Textures, Transport};
        assert_eq!(tell(&[], Method::Joint), "The next run does every stage.");
        assert_eq!(
            tell(&[Samples], Method::Paper),
            "The next run keeps samples and begins with lights."
        );
        assert_eq!(
            tell(&[Samples], Method::Joint),
            "The next run keeps samples and begins with transport."
        );
        assert_eq!(
            tell(&[Samples, Transport, Lights, Solve], Method::Joint),
            "The next run keeps samples, transport, solve and lights, and begins with textures."
        );
        let all = [Samples, Transport, Lights, Solve, Textures];
        let nothing = "The next run keeps every stage: nothing has changed.";
        assert_eq!(tell(&all, Method::Paper), nothing);
    }
}
