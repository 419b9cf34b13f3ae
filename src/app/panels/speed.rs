//! The study of speed: error against computing time on the open capture, updated while it runs.

use std::sync::Arc;

use eframe::egui;

use super::context::Context;
use super::numbers::{counted, cut, empty, short};
use super::speed_chart::chart_ui;
use super::study::{Proposal, course_ui, ready_ui};
use super::table::{Head, Rows, TableState, head, table_ui};
use crate::app::actions::{Action, Study};
use crate::app::edit::Edit;
use crate::app::jobs::Jobs;
use crate::app::jobs::studies::{Estimate, Kind, SpeedRequest, SpeedStudy, TruthStatus};
use crate::app::project::Project;
use crate::study::settings::{Scope, Setting};
use crate::study::speed::{MEASURES, OWN, Place};
use crate::study::speed_chart::{front_of, verdicts_by};

pub struct State {
    request: SpeedRequest,
    /// Chosen by hand; else the first that was measured.
    measure: Option<usize>,
    estimate: Option<(SpeedRequest, Arc<Edit>, usize, Estimate)>,
    /// The setting that the run's options are, by those options and the runs so far.
    in_use: Option<(Arc<Edit>, usize, Option<String>)>,
    front: TableState,
}

impl Default for State {
    fn default() -> Self {
        Self {
            request: SpeedRequest { scope: Scope::First, repeats: 1 },
            measure: None,
            estimate: None,
            in_use: None,
            front: TableState::default(),
        }
    }
}

const SCOPES: [(Scope, &str, &str); 3] = [
    (Scope::First, "First look", "Your options and seven settings that take little time"),
    (
        Scope::Quick,
        "Small",
        "Your options and some twenty settings, draft, standard and fine among them: minutes",
    ),
    (Scope::Whole, "Whole", "Your options and all sixty settings: for a lunch break or a night"),
];

/// What the measures are called here, and what they mean.
const NAMES: [(&str, &str); MEASURES.len()] = [
    (
        "Reflectance",
        "Mean absolute error of the diffuse reflectances against truth.json, on a scale from 0 to \
         1",
    ),
    (
        "Reflectance, scaled",
        "The same after the one factor that fits best: light and reflectance trade a factor",
    ),
    (
        "Held-out samples",
        "A quarter of the sample blocks was left out and predicted: RMS of the difference over \
         RMS of the radiance",
    ),
    (
        "Held-out photograph",
        "One photograph was left out and made anew: RMS of the difference over RMS of the radiance",
    ),
    (
        "Photograph, FLIP",
        "The same photograph as a viewer sees it who flips between both (HDR-FLIP): 0 is the \
         same, 0.05 hard to see",
    ),
];

/// Below this width the table stands under the chart.
const BESIDE: f32 = 620.0;
const TABLE: f32 = 292.0;

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, jobs, actions, .. } = context;
    if !ready_ui(ui, project, jobs, actions) {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        state.design_ui(ui);
        let proposal = Proposal {
            kind: Kind::Speed,
            words: "Run study",
            help: "Reconstruct with each setting, and measure seconds and error",
            action: Action::Study(Study::Speed(state.request.clone())),
            estimate: state.estimate(project, jobs),
            obstacle: None,
        };
        course_ui(ui, project, jobs, proposal, actions);
    });
    let study = jobs.studies.speed.as_ref().filter(|study| !study.rows.is_empty());
    let has = |measure: usize| {
        study.is_some_and(|study| study.places.iter().any(|p| p.errors[measure].is_some()))
    };
    let measure = state.measure.filter(|&own| study.is_none() || has(own));
    let measure = measure.or((0..MEASURES.len()).find(|&own| has(own))).unwrap_or(2);
    ui.horizontal_wrapped(|ui| {
        ui.label("Error of");
        for (own, (name, help)) in NAMES.iter().enumerate() {
            let missing = missing(project, &jobs.studies.known, own);
            let button = egui::Button::selectable(own == measure, *name);
            let response = ui
                .add_enabled(missing.is_none() || has(own), button)
                .on_hover_text(*help)
                .on_disabled_hover_text(missing.unwrap_or_default());
            if response.clicked() {
                state.measure = Some(own);
            }
        }
    });
    warnings_ui(ui, project, jobs, study);
    let Some(study) = study else {
        let is_running = jobs.studies.progress(Kind::Speed).is_some_and(|own| own.is_running());
        empty(
            ui,
            if is_running {
                "The first setting is being run. Its point will appear here."
            } else {
                "Run the study to see how the error falls with computing time on this capture. \
                 Every setting \
                 becomes a point; a click on one sets the run's options."
            },
        );
        return;
    };
    let in_use = state.in_use(project, study);
    let room = ui.available_size();
    let is_beside = room.x >= BESIDE;
    let layout = if is_beside {
        egui::Layout::left_to_right(egui::Align::Min)
    } else {
        egui::Layout::top_down(egui::Align::Min)
    };
    ui.with_layout(layout, |ui| {
        let chart = if is_beside {
            egui::vec2(room.x - TABLE - 8.0, room.y)
        } else {
            egui::vec2(room.x, 0.6 * room.y)
        };
        ui.allocate_ui_with_layout(chart, egui::Layout::top_down(egui::Align::Min), |ui| {
            ui.set_min_size(chart);
            if let Some(setting) = chart_ui(ui, &study.places, measure, in_use.as_deref()) {
                actions.push(Action::Study(Study::Use(setting)));
            }
        });
        ui.vertical(|ui| {
            front_ui(ui, study, measure, in_use.as_deref(), &mut state.front, actions)
        });
    });
}

impl State {
    fn design_ui(&mut self, ui: &mut egui::Ui) {
        ui.label("Settings");
        let name = SCOPES.iter().find(|(scope, ..)| *scope == self.request.scope);
        let (_, name, help) = name.unwrap_or(&SCOPES[0]);
        let shown = egui::ComboBox::from_id_salt("scope").width(84.0).selected_text(*name).show_ui(
            ui,
            |ui| {
                for (scope, name, help) in SCOPES {
                    ui.selectable_value(&mut self.request.scope, scope, name).on_hover_text(help);
                }
            },
        );
        let named =
            || egui::WidgetInfo::labeled(egui::Role::ComboBox, true, format!("Settings: {name}"));
        shown.response.widget_info(named);
        shown.response.on_hover_text(*help);
        let field = egui::DragValue::new(&mut self.request.repeats).range(1..=9).speed(0.05);
        ui.add(field.prefix("Repeats ")).accessible_name("Repeats").on_hover_text(
            "Each setting is run so often, with other seeds and other parts held out",
        );
    }

    fn estimate(&mut self, project: &Project, jobs: &Jobs) -> Estimate {
        let edit = project.edit();
        let found = jobs.studies.progress(Kind::Speed).map_or(0, |progress| progress.found());
        if let Some((request, of, runs, estimate)) = &self.estimate
            && (request, *runs) == (&self.request, found)
            && Arc::ptr_eq(of, edit)
        {
            return *estimate;
        }
        let estimate = jobs.studies.estimate_speed(project, &self.request);
        self.estimate = Some((self.request.clone(), edit.clone(), found, estimate));
        estimate
    }

    /// The setting on the chart whose options the next run will have.
    fn in_use(&mut self, project: &Project, study: &SpeedStudy) -> Option<String> {
        let (edit, runs) = (project.edit(), study.rows.len());
        if let Some((of, count, in_use)) = &self.in_use
            && Arc::ptr_eq(of, edit)
            && *count == runs
        {
            return in_use.clone();
        }
        let options = &edit.options;
        let is_used = |place: &&Place| match Setting::named(&place.setting) {
            Some(setting) => {
                setting.upon(options, options.general.seed).ok().as_ref() == Some(options)
            }
            None => place.setting == OWN && study.progress.edit.options == *options,
        };
        let in_use = study.places.iter().find(is_used).map(|place| place.setting.clone());
        self.in_use = Some((edit.clone(), runs, in_use.clone()));
        in_use
    }
}

/// Why a measure cannot be had of this capture.
fn missing(project: &Project, known: &TruthStatus, measure: usize) -> Option<&'static str> {
    match (measure, known) {
        (0 | 1, TruthStatus::Nothing) => Some("No truth.json lies beside this capture."),
        (0 | 1, TruthStatus::Broken) => Some("The capture's truth.json cannot be read."),
        (3 | 4, _) if project.capture.measurements().count() < 2 => {
            Some("The capture has one photograph: none can be left out.")
        }
        _ => None,
    }
}

fn warnings_ui(ui: &mut egui::Ui, project: &Project, jobs: &Jobs, study: Option<&SpeedStudy>) {
    // Words, and what they mean; whether they warn.
    let mut all: Vec<(bool, String, String)> = Vec::new();
    match jobs.studies.known {
        TruthStatus::Nothing => all.push((
            false,
            "What this capture truly reflects is not known (no truth.json): errors are those of \
             what was held out."
                .to_owned(),
            "A truth.json beside the capture, with true reflectances, adds their errors".to_owned(),
        )),
        TruthStatus::Broken => all.push((
            true,
            "truth.json cannot be read: errors are those of what was held out.".to_owned(),
            "The message about it says what is wrong".to_owned(),
        )),
        _ => {}
    }
    if let Some(study) = study {
        if study.is_outdated(project) {
            let help = "Tags, or options that no setting decides on, were changed since. Running \
                        again begins anew.";
            all.push((true, "Outdated".to_owned(), help.to_owned()));
        }
        if study.progress.is_running() && jobs.disturbs_seconds() {
            let help = "A picture is being made at the same time, so seconds come out too long. \
                        Leave the shading Relit of the 3D view, or let the picture end.";
            all.push((true, "Disturbed".to_owned(), help.to_owned()));
        }
        let failures: Vec<String> = study
            .rows
            .iter()
            .filter_map(|row| Some(format!("{}: {}", row.setting, row.failure.as_ref()?)))
            .collect();
        if !failures.is_empty() {
            let text = counted(failures.len(), "run gave no result", "runs gave no result");
            all.push((true, text, failures.join("\n")));
        }
    }
    if all.is_empty() {
        return;
    }
    let (warn, weak) = (ui.visuals().warn_fg_color, ui.visuals().weak_text_color());
    ui.horizontal_wrapped(|ui| {
        for (is_warning, text, help) in all {
            ui.colored_label(if is_warning { warn } else { weak }, text).on_hover_text(help);
        }
    });
}

fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).chain(['.']).collect()
}

const HEADS: [Head; 4] = [
    head("Setting", 116.0, "Settings that nothing beats in both seconds and error"),
    head("Seconds", 54.0, "Of the reconstruction, median of the repeats"),
    head("Error", 50.0, "By the measure that is chosen, mean of the repeats"),
    head("MB", 40.0, "Peak memory of the whole program while it ran"),
];

fn front_ui(
    ui: &mut egui::Ui,
    study: &SpeedStudy,
    measure: usize,
    in_use: Option<&str>,
    state: &mut TableState,
    actions: &mut Vec<Action>,
) {
    ui.set_max_width(TABLE);
    let front = front_of(&study.places, measure);
    ui.strong("Best for their time");
    if front.is_empty() {
        ui.weak("No run has this measure yet.");
        return;
    }
    let error = |place: &Place| place.errors[measure].unwrap_or(f64::NAN);
    let compare = |column: usize, a: usize, b: usize| {
        let (a, b) = (front[a], front[b]);
        match column {
            0 => a.setting.cmp(&b.setting),
            1 => a.seconds.total_cmp(&b.seconds),
            2 => error(a).total_cmp(&error(b)),
            _ => a.peak_mb.unwrap_or(0.0).total_cmp(&b.peak_mb.unwrap_or(0.0)),
        }
    };
    let rows = Rows {
        identity: study.rows.len() * MEASURES.len() + measure,
        count: front.len(),
        selected: front.iter().position(|place| Some(place.setting.as_str()) == in_use),
        compare: &compare,
    };
    let height = (0.45 * ui.available_height()).min(26.0 + 20.0 * front.len() as f32).max(80.0);
    let clicked = ui
        .allocate_ui(egui::vec2(TABLE, height), |ui| {
            ui.set_height(height);
            table_ui(ui, "front", state, &HEADS, &rows, |ui, row, column| {
                let place = front[row];
                match column {
                    0 => cut(ui, place.setting.as_str()),
                    1 => ui.label(short(place.seconds)),
                    2 => ui.label(short(error(place))),
                    _ => ui.label(place.peak_mb.map_or(String::new(), |mb| format!("{mb:.0}"))),
                };
            })
        })
        .inner;
    if let Some(row) = clicked {
        actions.push(Action::Study(Study::Use(front[row].setting.clone())));
    }
    ui.weak(match in_use {
        Some(setting) => format!("The run's options are those of \"{setting}\"."),
        None => "Click a setting, here or in the chart, to set the run's options.".to_owned(),
    });
    ui.add_space(6.0);
    egui::ScrollArea::vertical().id_salt("verdicts").show(ui, |ui| {
        for verdict in verdicts_by(&study.places, measure) {
            ui.add(egui::Label::new(sentence(&verdict)).wrap());
        }
    });
}
