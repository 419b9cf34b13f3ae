//! The common parts of both studies' panels: starting and stopping, progress, saving, and the axes
//! and points of their charts.

use eframe::egui::{self, Color32, Rect, RichText, Sense, vec2};
use egui_plot::{GridInput, GridMark};

use super::numbers::{counted, duration};
use crate::app::actions::{Action, PathRequest, Study};
use crate::app::jobs::Jobs;
use crate::app::jobs::studies::{Estimate, Kind, TruthStatus};
use crate::app::project::Project;
use crate::app::theme::ACCENT;
use crate::app::workspaces::Workspace;
use crate::io::drawing::Ink;
use crate::study::chart::{log_ticks, number};
use crate::study::cost::cost;
use crate::study::stability::Variant;

/// What is to be begun, by which words, and what it would be.
pub struct Proposal {
    pub kind: Kind,
    pub words: &'static str,
    pub help: &'static str,
    pub action: Action,
    pub estimate: Estimate,
    /// Why there is nothing to begin.
    pub obstacle: Option<&'static str>,
}

/// The button that begins or stops, how far it is, and what can be done with the findings.
pub fn course_ui(
    ui: &mut egui::Ui,
    project: &Project,
    jobs: &Jobs,
    proposal: Proposal,
    actions: &mut Vec<Action>,
) {
    let Proposal { kind, words, help, action, estimate, obstacle } = proposal;
    let studies = &jobs.studies;
    let progress = studies.progress(kind);
    if let Some(progress) = progress.filter(|progress| progress.is_running()) {
        let stop = ui
            .add_enabled(!progress.cancelling, egui::Button::new("Cancel study"))
            .on_hover_text("Stop; what was measured stays")
            .on_disabled_hover_text("It ends as soon as the run under way can be left");
        if stop.clicked() {
            actions.push(Action::Study(Study::Cancel(kind)));
        }
        let (done, planned) = (progress.done(), progress.planned());
        let bar = egui::ProgressBar::new(done as f32 / planned.max(1) as f32).desired_width(80.0);
        ui.add(bar);
        ui.label(format!("{done} / {planned} runs"));
        ui.label(match progress.secs_left() {
            Some(left) => format!("about {} left", duration(left.max(1.0))),
            None => format!("for {}", duration(progress.elapsed_secs())),
        });
        if let Some(now) = progress.now().filter(|_| kind == Kind::Speed) {
            ui.weak(now).on_hover_text("What is being run: the setting, and which repeat");
        }
    } else {
        let is_done = estimate.runs > 0 && estimate.done == estimate.runs;
        let all_done = is_done.then_some("All of these runs are done; \"Forget\" begins anew.");
        let obstacle = studies.obstacle(project, kind).or(obstacle).or(all_done);
        let text = if estimate.done > 0 && !is_done { "Go on with the study" } else { words };
        let button = egui::Button::new(RichText::new(text).color(Color32::WHITE)).fill(ACCENT);
        let response = ui
            .add_enabled(obstacle.is_none(), button)
            .on_hover_text(help)
            .on_disabled_hover_text(obstacle.unwrap_or_default());
        if response.clicked() {
            actions.push(action);
        }
        ui.label(estimated(project, &estimate)).on_hover_text(
            "Runs that this asks for, and about how long they take, by the last reconstruction",
        );
    }
    let has_findings = progress.is_some_and(|progress| progress.found() > 0);
    let is_idle = studies.running().is_none();
    let save = ui
        .add_enabled(has_findings, egui::Button::new("Save…"))
        .on_hover_text(
            "Write tables (CSV, JSON) and charts (SVG, PNG) into a folder, as the terminal does",
        )
        .on_disabled_hover_text("Nothing has been measured yet.");
    if save.clicked() {
        actions.push(Action::Ask(PathRequest::SaveStudy(kind)));
    }
    let forget = ui
        .add_enabled(has_findings && is_idle, egui::Button::new("Forget"))
        .on_hover_text("Take all points away, to begin anew")
        .on_disabled_hover_text("There is nothing to forget, or a study runs.");
    if forget.clicked() {
        actions.push(Action::Study(Study::Clear(kind)));
    }
}

fn estimated(project: &Project, estimate: &Estimate) -> String {
    let left = estimate.runs - estimate.done;
    let mut text = match (estimate.done, left) {
        (0, _) => counted(left, "run", "runs"),
        (_, 0) => format!("{} done", counted(estimate.runs, "run", "runs")),
        _ => format!("{left} of {} left", counted(estimate.runs, "run", "runs")),
    };
    let products = &project.products;
    if let (Some(whole), Some((edit, _))) = (&products.whole, &products.of)
        && left > 0
    {
        let pace = whole.seconds.iter().sum::<f64>() / cost(&edit.options);
        text.push_str(&format!(", about {}", duration(pace * estimate.cost)));
    }
    text
}

/// What stands in the way of any study, with the step that is missing; whether the truth is known
/// is asked for once. Gives whether there is something to show.
pub fn ready_ui(
    ui: &mut egui::Ui,
    project: &Project,
    jobs: &Jobs,
    actions: &mut Vec<Action>,
) -> bool {
    if matches!(jobs.studies.known, TruthStatus::NotAsked) {
        actions.push(Action::Study(Study::Look));
    }
    if !project.capture.materials.is_empty() {
        return true;
    }
    ui.add_space(8.0);
    ui.label("No surface has a material yet, so there is nothing to recover or to measure.");
    ui.add_space(4.0);
    let tag = ui.button("Tag surfaces").on_hover_text("Go to the workspace Tag (F2)");
    if tag.clicked() {
        actions.push(Action::Workspace(Workspace::Tag));
    }
    false
}

pub fn ink(ink: Ink, dark: bool) -> Color32 {
    let [r, g, b] = ink.rgb(dark);
    Color32::from_rgb(r, g, b)
}

/// The colour of a way, as in the charts that are written.
pub fn variant_ink(way: Variant) -> Ink {
    Ink::Series(match way {
        Variant::Joint => 0,
        Variant::Paper => 1,
        Variant::Bare => 2,
    })
}

/// Makes a point of a chart something to be hovered, clicked and reached by keys.
pub fn point_ui(
    ui: &mut egui::Ui,
    plot: &egui::Response,
    at: egui::Pos2,
    id: impl egui::AsIdSalt,
    name: &str,
    sense: Sense,
) -> Option<egui::Response> {
    if !plot.rect.contains(at) {
        return None;
    }
    let rect = Rect::from_center_size(at, vec2(13.0, 13.0));
    let response = ui.interact(rect, plot.id.with(id), sense);
    let role = if sense.senses_click() { egui::Role::Button } else { egui::Role::Label };
    response.widget_info(|| egui::WidgetInfo::labeled(role, true, name));
    if response.has_focus() {
        let color = ui.visuals().strong_text_color();
        ui.painter().circle_stroke(at, 10.0, egui::Stroke::new(1.5, color));
    }
    Some(response)
}

/// Marks at round values, on an axis of their logarithms.
pub fn logarithmic(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    if !(low.is_finite() && high.is_finite()) || high - low > 40.0 {
        return Vec::new();
    }
    let range = [low, high].map(|value| 10f64.powf(value));
    let ticks = log_ticks(range, MARKS).into_iter();
    ticks.map(|(value, _)| GridMark { value: value.log10(), step_size: 1.0 }).collect()
}

/// Marks of a logarithmic axis, about this many at most.
const MARKS: f32 = 9.0;

/// What is written at such a mark.
pub fn power(mark: GridMark) -> String {
    number(10f64.powf(mark.value))
}

/// Lines that stay behind the points.
pub fn grid_color(ui: &egui::Ui) -> Color32 {
    ink(Ink::Grid, ui.visuals().dark_mode)
}

/// Marks at whole numbers.
pub fn whole(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    if !(low.is_finite() && high.is_finite()) || high - low > 100.0 {
        return Vec::new();
    }
    let all = low.ceil() as i64..=high.floor() as i64;
    all.map(|value| GridMark { value: value as f64, step_size: 1.0 }).collect()
}
