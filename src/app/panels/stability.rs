//! The study of stability: how the error grows as one property of the open capture after the other
//! is degraded.

use std::sync::Arc;

use eframe::egui;

use super::context::Context;
use super::numbers::{counted, empty};
use super::stability_curves::curves_ui;
use super::study::{Proposal, course_ui, ready_ui};
use crate::app::actions::{Action, Study};
use crate::app::edit::Edit;
use crate::app::jobs::Jobs;
use crate::app::jobs::studies::{Estimate, Kind, StabilityRequest, StabilityStudy, TruthStatus};
use crate::app::project::Project;
use crate::study::degradation::Degradation;
use crate::study::report;
use crate::study::stability::Variant;

pub struct State {
    /// Of every degradation: whether it is tried, and its most severe step.
    degradations: [(bool, f64); Degradation::ALL.len()],
    steps: usize,
    seeds: usize,
    /// In the order of `Variant::ALL`.
    variants: [bool; Variant::ALL.len()],
    draft: bool,
    estimate: Option<(StabilityRequest, Arc<Edit>, usize, Estimate)>,
}

impl Default for State {
    fn default() -> Self {
        Self {
            degradations: Degradation::ALL
                .map(|degradation| (false, degradation.levels()[degradation.levels().len() / 2])),
            steps: 3,
            seeds: 2,
            variants: Variant::ALL.map(|variant| variant != Variant::Bare),
            draft: false,
            estimate: None,
        }
    }
}

const CONTROLS: f32 = 332.0;

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, jobs, actions, .. } = context;
    if !ready_ui(ui, project, jobs, actions) {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        let request = state.request();
        let obstacle = match &request {
            request if request.degradations.is_empty() => {
                Some("Switch on the degradations to test.")
            }
            request if request.variants.is_empty() => Some("Switch a method on."),
            _ => None,
        };
        let proposal = Proposal {
            kind: Kind::Stability,
            words: "Run study",
            help: "Make the capture worse, step by step, and reconstruct it each time",
            action: Action::Study(Study::Stability(request.clone())),
            estimate: state.estimate(project, jobs, request),
            obstacle,
        };
        course_ui(ui, project, jobs, proposal, actions);
    });
    let room = ui.available_size();
    ui.with_layout(egui::Layout::left_to_right(egui::Align::Min), |ui| {
        let controls = egui::vec2(CONTROLS.min(0.5 * room.x), room.y);
        ui.allocate_ui_with_layout(controls, egui::Layout::top_down(egui::Align::Min), |ui| {
            ui.set_min_size(controls);
            egui::ScrollArea::vertical().id_salt("degradations").auto_shrink(false).show(
                ui,
                |ui| {
                    state.controls_ui(ui);
                },
            );
        });
        ui.separator();
        egui::ScrollArea::vertical().id_salt("curves").auto_shrink(false).show(ui, |ui| {
            ui.vertical(|ui| findings_ui(ui, project, jobs));
        });
    });
}

impl State {
    fn request(&self) -> StabilityRequest {
        let degradations = Degradation::ALL.into_iter().zip(self.degradations);
        let tried = degradations.filter(|(_, (is_on, _))| *is_on);
        let variants = Variant::ALL.into_iter().zip(self.variants).filter(|(_, is_on)| *is_on);
        StabilityRequest {
            degradations: tried
                .map(|(degradation, (_, most))| {
                    (degradation, degradation.steps_to(most, self.steps))
                })
                .collect(),
            variants: variants.map(|(variant, _)| variant).collect(),
            seeds: self.seeds,
            draft: self.draft,
        }
    }

    fn estimate(&mut self, project: &Project, jobs: &Jobs, request: StabilityRequest) -> Estimate {
        if request.degradations.is_empty() {
            return Estimate::default();
        }
        let found = jobs.studies.progress(Kind::Stability).map_or(0, |progress| progress.found());
        if let Some((of, edit, runs, estimate)) = &self.estimate
            && (of, *runs) == (&request, found)
            && Arc::ptr_eq(edit, project.edit())
        {
            return *estimate;
        }
        let estimate = jobs.studies.estimate_stability(project, &request);
        self.estimate = Some((request, project.edit().clone(), found, estimate));
        estimate
    }

    fn controls_ui(&mut self, ui: &mut egui::Ui) {
        ui.horizontal_wrapped(|ui| {
            ui.label("Methods");
            for (variant, is_on) in Variant::ALL.into_iter().zip(&mut self.variants) {
                let (name, help) = match variant {
                    Variant::Joint => ("joint", "Light and reflectances solved together"),
                    Variant::Bare => (
                        "bare",
                        "joint without the loss that makes outliers count less and without the \
                         rejection of pixels beside edges",
                    ),
                    Variant::Paper => ("paper", "The published method's alternation"),
                };
                ui.checkbox(is_on, name).on_hover_text(help);
            }
        });
        ui.horizontal_wrapped(|ui| {
            let field = egui::DragValue::new(&mut self.steps).range(1..=5).speed(0.05);
            ui.add(field.prefix("Steps "))
                .accessible_name("Steps")
                .on_hover_text("Steps of each, the most severe one at the end");
            let field = egui::DragValue::new(&mut self.seeds).range(1..=9).speed(0.05);
            ui.add(field.prefix("Seeds ")).accessible_name("Seeds").on_hover_text(
                "Each step is run with this number of seeds; the bands span their results",
            );
            ui.checkbox(&mut self.draft, "Draft").on_hover_text(
                "Run by the quality draft, which is quicker, rather than by your options",
            );
        });
        ui.separator();
        ui.horizontal(|ui| {
            ui.strong("Degradation");
            let any = self.degradations.iter().any(|(is_on, _)| *is_on);
            for (name, help, on) in
                [("All", "Switch everything on", true), ("None", "Switch everything off", false)]
            {
                let button = ui.add_enabled(on || any, egui::Button::new(name).small());
                let button = button.on_disabled_hover_text("Everything is off already.");
                if button.on_hover_text(help).clicked() {
                    self.degradations.iter_mut().for_each(|(is_on, _)| *is_on = on);
                }
            }
        });
        for (degradation, (is_on, most)) in Degradation::ALL.into_iter().zip(&mut self.degradations)
        {
            degradation_ui(ui, degradation, is_on, most);
        }
    }
}

/// A switch, and up to which severity.
fn degradation_ui(ui: &mut egui::Ui, degradation: Degradation, is_on: &mut bool, most: &mut f64) {
    let levels = degradation.levels();
    let (first, last) = (levels[0], levels[levels.len() - 1]);
    ui.horizontal(|ui| {
        let size = egui::vec2(186.0, ui.spacing().interact_size.y);
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(size, layout, |ui| {
            ui.set_min_width(size.x);
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.checkbox(is_on, degradation.title()).on_hover_text(format!(
                "{}. In: {}.",
                degradation.help(),
                degradation.unit()
            ));
        });
        let [prefix, suffix] = degradation.affixes();
        ui.spacing_mut().slider_width = 58.0;
        let slider = egui::Slider::new(most, first..=last).prefix(prefix).suffix(suffix);
        let slider = if degradation.is_whole() {
            slider.integer()
        } else {
            slider.logarithmic(true).custom_formatter(|value, _| two_digits(value))
        };
        let response = ui.add(slider).accessible_name(format!("{}, up to", degradation.title()));
        // Whoever sets a severity wants it tried.
        if response.changed() {
            *is_on = true;
            *most = two_digits(*most).parse().unwrap_or(*most);
        }
        response.on_hover_text(format!(
            "The most severe step: {}. Milder ones come before it.",
            degradation.step(*most)
        ));
    });
}

/// So that a severity reads well on axes and in sentences.
fn two_digits(value: f64) -> String {
    crate::study::chart::number(value)
}

fn findings_ui(ui: &mut egui::Ui, project: &Project, jobs: &Jobs) {
    let warn = ui.visuals().warn_fg_color;
    match jobs.studies.known {
        TruthStatus::Nothing => {
            ui.weak(
                "The truth is not known (no truth.json): errors are estimated by the \
                     intervals of the capture as it is, and how far results move from it.",
            )
            .on_hover_text(
                "A truth.json beside the capture, with true reflectances, gives \
                                the errors themselves",
            );
        }
        TruthStatus::Broken => {
            ui.colored_label(warn, "truth.json cannot be read: errors are estimated.");
        }
        _ => {}
    }
    let study = jobs.studies.stability.as_ref();
    let is_running = study.is_some_and(|study| study.progress.is_running());
    let Some(study) = study.filter(|study| !study.rows.is_empty()) else {
        empty(
            ui,
            if is_running {
                "The capture as it is comes first; the curves follow."
            } else {
                "Switch on the degradations to test, and run the study: curves show how the error \
                 grows, and sentences say which errors this capture tolerates."
            },
        );
        return;
    };
    head_ui(ui, project, study);
    curves_ui(ui, &study.curves);
}

fn head_ui(ui: &mut egui::Ui, project: &Project, study: &StabilityStudy) {
    let warn = ui.visuals().warn_fg_color;
    ui.horizontal_wrapped(|ui| {
        if study.is_outdated(project) {
            ui.colored_label(warn, "Outdated")
                .on_hover_text("Tags or options were changed since. Running again begins anew.");
        }
        let failures: Vec<String> = study
            .rows
            .iter()
            .filter_map(|row| {
                let failure = row.failure.as_ref()?;
                Some(format!("{} {}, {}: {failure}", row.degradation, row.level, row.variant))
            })
            .collect();
        if !failures.is_empty() {
            let text = counted(failures.len(), "run gave no result", "runs gave no result");
            ui.colored_label(warn, text).on_hover_text(failures.join("\n"));
        }
    });
    if let Some(opening) = report::opening(&study.curves) {
        ui.add(egui::Label::new(opening).wrap());
    }
    ui.weak(report::soundness(&study.rows));
}
