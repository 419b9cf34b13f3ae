//! The panels, one file each. They show the project and return actions.

pub mod begin;
pub mod cards;
mod compare;
mod compared;
mod convergence;
mod extents;
mod fields;
mod guide;
pub mod import;
mod inspect_light;
mod inspect_sample;
mod inspect_texture;
mod inspector;
mod known_light;
mod lights;
mod log;
mod masks;
mod materials;
mod meshless;
mod no_radiance;
pub mod menu;
mod modal;
pub mod modelling;
pub mod numbers;
mod options;
mod outliner;
pub mod palette;
mod pictures;
pub mod questions;
mod relight;
mod relight_added;
mod relight_list;
mod run;
mod sample_errors;
mod scene_export;
mod samples;
pub mod start;
pub mod state;
pub mod status;
mod stability;
mod stability_curves;
mod speed;
mod speed_chart;
mod study;
mod table;
mod tags;

use eframe::egui;
use egui_tiles::{TileId, UiResponse};

use self::state::PanelState;
use super::actions::{Action, Masking, Mode, Select};
use super::jobs::Jobs;
use super::messages::Messages;
use super::panes::Pane;
use super::project::Project;
use super::state::State;
use super::viewport::{Content, Viewport, ViewportEvent};

/// The arrangement of panels around the 3D view.
pub fn workspace_ui(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    let State { project, layout, viewport, panels, messages, jobs, .. } = state;
    let Some(project) = project else { return };
    egui::CentralPanel::no_frame().show(ui, |ui| {
        let mut behavior = Behavior { project, viewport, panels, messages, jobs, actions };
        layout.tree().ui(&mut behavior, ui);
    });
}

struct Behavior<'a> {
    project: &'a Project,
    viewport: &'a mut Viewport,
    panels: &'a mut PanelState,
    messages: &'a Messages,
    jobs: &'a Jobs,
    actions: &'a mut Vec<Action>,
}

impl egui_tiles::Behavior<Pane> for Behavior<'_> {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _tile: TileId, pane: &mut Pane) -> UiResponse {
        let Self { project, viewport, panels, messages, jobs, actions } = self;
        if *pane == Pane::Viewport {
            let content = Content { relit: jobs.relit().cloned(), ..project.content() };
            let events = viewport.show(ui, &content);
            actions.extend(events.into_iter().map(viewport_action));
            return UiResponse::None;
        }
        let fill = ui.visuals().panel_fill;
        let frame = egui::Frame::new().fill(fill).inner_margin(6.0);
        frame.show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            match pane {
                Pane::Viewport => {}
                Pane::Outliner => {
                    outliner::outliner_ui(ui, project, viewport, &mut panels.outliner, actions);
                }
                Pane::Tags => tags::tags_ui(ui, project, &mut panels.tags, actions),
                Pane::KnownLight => {
                    known_light::known_light_ui(ui, project, &mut panels.known_light, actions);
                }
                Pane::Run => run::run_ui(ui, project, &mut panels.run, actions),
                Pane::Inspector => {
                    panels.inspector.exposure = viewport.exposure();
                    let coverage = jobs.coverage.as_ref();
                    inspector::inspector_ui(ui, project, coverage, &mut panels.inspector, actions);
                }
                Pane::Relight => {
                    let (state, gizmo) = (&mut panels.relight, &mut viewport.gizmo.mode);
                    relight::relight_ui(ui, project, jobs, state, gizmo, actions);
                }
                Pane::Convergence => {
                    convergence::convergence_ui(ui, project, &mut panels.convergence, actions);
                }
                Pane::SampleErrors => {
                    sample_errors::sample_errors_ui(ui, project, &mut panels.errors, actions);
                }
                Pane::Samples => samples::samples_ui(ui, project, &mut panels.samples, actions),
                Pane::Lights => lights::lights_ui(ui, project, &mut panels.lights, actions),
                Pane::Materials => {
                    materials::materials_ui(ui, project, &mut panels.materials, actions);
                }
                Pane::Compare => {
                    let state = &mut panels.compare;
                    state.exposure = viewport.exposure();
                    compare::compare_ui(ui, project, jobs.picture.as_ref(), state, actions);
                }
                Pane::Masks => {
                    masks::masks_ui(ui, project, jobs, viewport, &mut panels.masks, actions);
                }
                Pane::Log => log::log_ui(ui, messages, &mut panels.log, actions),
                Pane::Speed => speed::speed_ui(ui, project, jobs, &mut panels.speed, actions),
                Pane::Stability => {
                    stability::stability_ui(ui, project, jobs, &mut panels.stability, actions);
                }
            }
        });
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> egui::WidgetText {
        pane.title().into()
    }

    fn simplification_options(&self) -> egui_tiles::SimplificationOptions {
        egui_tiles::SimplificationOptions {
            all_panes_must_have_tabs: true,
            ..egui_tiles::SimplificationOptions::default()
        }
    }

    fn gap_width(&self, _style: &egui::Style) -> f32 {
        2.0
    }

    fn tab_bar_height(&self, _style: &egui::Style) -> f32 {
        24.0
    }

    fn tab_text_color(
        &self,
        visuals: &egui::Visuals,
        _tiles: &egui_tiles::Tiles<Pane>,
        _tile: TileId,
        state: &egui_tiles::TabState,
    ) -> egui::Color32 {
        if state.active { visuals.strong_text_color() } else { visuals.weak_text_color() }
    }
}

fn viewport_action(event: ViewportEvent) -> Action {
    Action::Select(match event {
        ViewportEvent::Moved { item, name, things } => {
            return Action::Transform(things.change(name, item));
        }
        ViewportEvent::Masked { photograph, shape, is_left_out } => {
            return Action::Masking(Masking::Draw { photograph, shape, is_left_out });
        }
        ViewportEvent::Kept => return Action::KeepTransform,
        ViewportEvent::LeftAsItWas => return Action::LeaveTransform,
        ViewportEvent::PickAdded(item) => Select::Added(item),
        ViewportEvent::PickSurface { surface: None, add: true } => {
            Select::Surfaces { surfaces: Default::default(), add: true }
        }
        ViewportEvent::PickSurface { surface: None, add: false } => Select::Nothing,
        ViewportEvent::PickSurface { surface: Some(surface), add } => {
            Select::Surface { surface, mode: if add { Mode::Toggle } else { Mode::Only } }
        }
        ViewportEvent::BoxSurfaces { surfaces, add } => Select::Surfaces { surfaces, add },
        ViewportEvent::PickSample(sample) => Select::Sample(sample),
        ViewportEvent::PickLight(light) => Select::Light(light),
        ViewportEvent::PickPhotograph(photograph) => Select::Photograph(photograph),
    })
}
