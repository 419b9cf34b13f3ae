//! Values that panels keep between frames.

use super::{
    compare, convergence, inspect_sample, known_light, log, masks, outliner, relight, run,
    sample_errors, speed, stability, table, tags,
};
use crate::app::actions::Select;
use crate::app::solo::Alone;

/// What panels remember between frames; nothing of it is part of a project.
#[derive(Default)]
pub struct PanelState {
    pub title: String,
    pub(super) outliner: outliner::OutlinerState,
    pub(super) tags: tags::TagState,
    pub(super) known_light: known_light::KnownLightState,
    pub(super) run: run::RunPanelState,
    pub(super) convergence: convergence::ConvergenceState,
    pub(super) errors: sample_errors::ErrorPlotState,
    pub(super) samples: table::TableState,
    pub(super) lights: table::TableState,
    pub(super) materials: table::TableState,
    pub(super) inspector: inspect_sample::CropCache,
    pub(super) relight: relight::RelightState,
    pub(super) compare: compare::CompareState,
    pub(super) masks: masks::MasksState,
    pub(super) log: log::LogState,
    pub(super) speed: speed::SpeedState,
    pub(super) stability: stability::StabilityState,
}

impl PanelState {
    /// Another project is shown: what referred to the old one goes.
    pub fn forget(&mut self) {
        *self = Self { title: std::mem::take(&mut self.title), ..Self::default() };
    }

    /// The light that is seen alone, for a project to keep.
    pub fn alone(&self) -> Option<&Alone> {
        self.relight.alone.as_ref()
    }

    pub fn set_alone(&mut self, alone: Option<Alone>) {
        self.relight.alone = alone;
    }

    /// Something was selected: tables scroll to it.
    pub fn follow(&mut self, what: &Select) {
        match what {
            Select::Sample(_) | Select::WorstSample => self.samples.follow = true,
            Select::Light(_) | Select::StrongestLight => self.lights.follow = true,
            Select::Material(_) => self.materials.follow = true,
            _ => {}
        }
    }
}
