//! The status bar: the job in progress, the value under the pointer, and the counts.

use eframe::egui;

use super::numbers::{count, counted, duration, rgb, short as short_number};
use super::run::progress_ui;
use crate::app::actions::{Action, ExportAction};
use crate::app::keys;
use crate::app::products::Run;
use crate::app::project::Project;
use crate::app::state::State;
use crate::app::viewport::{PictureValue, Viewport};
use crate::math::rgb::luminance;

pub fn status_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let frame = egui::Frame::side_top_panel(ui.style()).inner_margin(egui::Margin::symmetric(8, 3));
    egui::Panel::bottom("status").frame(frame).show(ui, |ui| {
        ui.horizontal(|ui| {
            ui.set_min_height(20.0);
            match &state.project {
                Some(Project { run: Some(run), .. }) => running(ui, run, actions),
                _ if state.jobs.studies.running().is_some() => {
                    ui.spinner();
                    if let Some((_, progress)) = state.jobs.studies.running() {
                        let (done, planned) = (progress.done(), progress.planned());
                        ui.label(format!("Studying: {done} of {planned} runs"));
                    }
                }
                _ if state.jobs.exporting().is_some() => {
                    ui.spinner();
                    ui.label("Writing results");
                }
                _ if state.jobs.is_rendering() => {
                    ui.spinner();
                    let text = state
                        .jobs
                        .rendered()
                        .map_or(String::new(), |own| format!(" ({} of {})", own.number, own.count));
                    ui.label(format!("Rendering pictures{text}"));
                }
                _ if state.jobs.opens().is_some() => {
                    ui.spinner();
                    ui.label("Opening");
                }
                _ if state.saves.take_long() => {
                    ui.spinner();
                    ui.label("Saving");
                }
                _ if state.jobs.is_exporting_scene() => {
                    ui.spinner();
                    ui.label("Exporting the scene");
                    if ui.small_button("Stop").on_hover_text("Stop the export").clicked() {
                        actions.push(Action::ExportScene(ExportAction::Stop));
                    }
                }
                _ => {
                    ui.weak("Ready");
                    next_ui(ui, state, actions);
                }
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let adapter = egui::RichText::new(short(&state.adapter)).weak();
                ui.label(adapter).on_hover_text(format!("Graphics adapter: {}", state.adapter));
                if let Some(project) = &state.project {
                    ui.separator();
                    counts(ui, project);
                    let text = under_cursor(project, &state.viewport);
                    if !text.is_empty() {
                        ui.separator();
                        ui.add(egui::Label::new(text).truncate());
                    }
                }
            });
        });
    });
}

/// What comes next on the way from a capture to pictures, where there is room to say so.
fn next_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let Some((text, action)) = state.next_step() else { return };
    let gap = 100.0 - ui.min_rect().width();
    if ui.available_width() < 620.0 || state.is_importing() || state.is_modelling() {
        return;
    }
    ui.add_space(gap.max(0.0));
    let button = egui::Button::new(keys::named(ui.ctx(), text)).small();
    if ui.add(button).on_hover_text("What comes next").clicked() {
        actions.push(action);
    }
}

fn running(ui: &mut egui::Ui, run: &Run, actions: &mut Vec<Action>) {
    ui.spinner();
    let stage = run.stage().map_or("starting", |stage| stage.name());
    ui.label(if run.cancelling { "Cancelling".to_owned() } else { format!("Stage {stage}") });
    progress_ui(ui, run, 80.0);
    ui.weak(duration(run.began.elapsed().as_secs_f64()));
    if ui.small_button("Cancel").on_hover_text("Stop the run (Esc)").clicked() {
        actions.push(Action::Cancel);
    }
}

fn counts(ui: &mut egui::Ui, project: &Project) {
    let products = &project.products;
    let mut parts = Vec::new();
    if let Some(samples) = &products.samples {
        parts.push(counted(samples.samples.len(), "sample", "samples"));
    }
    if let Some((lights, lobes)) = &products.lights {
        parts.push(counted(lights.lights.len(), "light", "lights"));
        let lit = products.solution.as_ref().map(|solution| solution.active_lobes());
        parts.push(match lit {
            Some(lit) => format!("{} of {} lobes lit", count(lit), count(lobes.lobes.len())),
            None => counted(lobes.lobes.len(), "lobe", "lobes"),
        });
    }
    if parts.is_empty() {
        parts.push(counted(project.loaded.photographs.len(), "photograph", "photographs"));
        parts.push(counted(project.loaded.mesh.triangles.len(), "triangle", "triangles"));
    }
    ui.label(parts.join(", "));
}

/// Software adapters have long names with versions in brackets.
fn short(adapter: &str) -> String {
    let name = adapter.split(['(', ',']).next().unwrap_or(adapter).trim();
    name.chars().take(28).collect()
}

/// The value of the picture that is shown, then the surface and the place.
fn under_cursor(project: &Project, viewport: &Viewport) -> String {
    let mut text = match viewport.value() {
        Some(PictureValue::Radiance(own)) => format!(
            "radiance {}, luminance {}  ",
            rgb(own.map(f64::from)),
            short_number(luminance(own))
        ),
        Some(PictureValue::Reflectance(own)) => format!("reflectance {}  ", rgb(own)),
        Some(PictureValue::NoMeasurement) => "saturated or invalid  ".to_owned(),
        None => String::new(),
    };
    let Some(hovered) = viewport.hovered() else { return text.trim_end().to_owned() };
    if let Some(surface) = project.loaded.surfaces.get(hovered.surface) {
        text.push_str(&surface.name);
    }
    if let Some(material) = hovered.material.and_then(|index| project.capture.materials.get(index))
    {
        text.push_str(&format!(", {}", material.name));
    }
    let p = hovered.position;
    text.push_str(&format!("  at {:.2} {:.2} {:.2} m", p.x, p.y, p.z));
    text
}
