//! The panels, one file each. They show the project and return actions.

pub mod begin;
pub mod cards;
mod charts;
mod compare;
mod compared;
mod context;
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
mod view;

use eframe::egui;
use egui_tiles::{TileId, UiResponse};

use self::context::Context;
use self::state::{OpenedTab, PanelState};
use super::actions::Action;
use super::panes::{Pane, panes};
use super::state::State;

/// The arrangement of panels around the 3D view.
pub fn workspace_ui(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    let State { project, layout, viewport, panels, messages, jobs, .. } = state;
    let Some(project) = project else { return };
    egui::CentralPanel::no_frame().show(ui, |ui| {
        let context = Context { project, viewport, messages, jobs, actions };
        layout.ui(&mut Behavior { context, panels, bar: None }, ui);
    });
}

struct Behavior<'a> {
    context: Context<'a>,
    panels: &'a mut PanelState,
    /// The bar of tabs that is drawn, its open tab, and its width in points.
    bar: Option<(TileId, Option<TileId>, f32)>,
}

macro_rules! show {
    ($($pane:ident $file:ident $place:ident, $title:literal, $command:literal, $help:literal;)*) => {
        fn show(pane: Pane, ui: &mut egui::Ui, context: Context, panels: &mut PanelState) {
            match pane {
                $(Pane::$pane => $file::show(ui, context, &mut panels.$file),)*
            }
        }
    };
}

panes!(show);

impl egui_tiles::Behavior<Pane> for Behavior<'_> {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _tile: TileId, pane: &mut Pane) -> UiResponse {
        let Context { project, viewport, messages, jobs, actions } = &mut self.context;
        let context = Context { project, viewport, messages, jobs, actions };
        let margin = if *pane == Pane::Viewport { 0.0 } else { 6.0 };
        let fill = ui.visuals().panel_fill;
        egui::Frame::new().fill(fill).inner_margin(margin).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            show(*pane, ui, context, self.panels);
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

    fn top_bar_right_ui(
        &mut self,
        _tiles: &egui_tiles::Tiles<Pane>,
        ui: &mut egui::Ui,
        bar: TileId,
        tabs: &egui_tiles::Tabs,
        _scrolled: &mut f32,
    ) {
        self.bar = Some((bar, tabs.active, ui.max_rect().width()));
    }

    /// A tab that was opened, by a key or the palette too, is scrolled into sight where its bar is too
    /// narrow for all of them; and once more after the bar became wider or narrower.
    fn on_tab_button(
        &mut self,
        _tiles: &mut egui_tiles::Tiles<Pane>,
        tile: TileId,
        button: egui::Response,
    ) -> egui::Response {
        // The arrows beside the tabs come a frame after these were found to be too many.
        const FRAMES: usize = 3;
        if let Some((bar, Some(active), width)) = self.bar
            && active == tile
        {
            let opened = self.panels.opened_tabs.entry(bar).or_default();
            if (opened.tab, opened.width) != (Some(button.id), width) {
                *opened = OpenedTab { tab: Some(button.id), width, frames: 0 };
            }
            if opened.frames < FRAMES {
                opened.frames += 1;
                button.scroll_to_me_animation(None, egui::style::ScrollAnimation::none());
                button.ctx.request_repaint();
            }
        }
        button
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
