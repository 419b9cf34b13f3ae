//! Values that panels keep between frames.

use std::collections::HashMap;

use eframe::egui;
use egui_tiles::TileId;

use crate::app::actions::Select;
use crate::app::panes::panes;
use crate::app::solo::Alone;

/// A tab that is scrolled into sight.
#[derive(Default)]
pub(super) struct OpenedTab {
    pub tab: Option<egui::Id>,
    /// Width of its bar, in points.
    pub width: f32,
    /// Frames in which it was scrolled into sight.
    pub frames: usize,
}

macro_rules! states {
    ($($pane:ident $file:ident $place:ident, $title:literal, $command:literal, $help:literal;)*) => {
        /// What panels remember between frames, the `State` of each; nothing of it is part of a
        /// project.
        #[derive(Default)]
        pub struct PanelState {
            pub title: String,
            /// The open tab of each bar of tabs.
            pub(super) opened_tabs: HashMap<TileId, OpenedTab>,
            $(pub(super) $file: super::$file::State,)*
        }
    };
}

panes!(states);

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
