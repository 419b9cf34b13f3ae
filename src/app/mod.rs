//! The studio: the window of the program.
//!
//! It holds no method of its own. Panels show an open `project` and say what was asked for by
//! `actions`; `dispatch` does it at the end of the frame; `jobs` sends commands to the worker that the
//! terminal drives too, and takes its events.

mod actions;
mod asking;
#[expect(clippy::module_inception, reason = "the file that wires the app together")]
mod app;
mod change;
mod changing;
mod charting;
mod commands;
mod derived;
mod dialogs;
mod dispatch;
mod dropping;
mod edit;
mod entry;
mod errands;
mod export_question;
mod file_dialog;
mod files;
mod gesture;
mod given;
mod guide;
mod import;
mod jobs;
mod keeping;
mod keys;
#[cfg(test)]
mod killed;
mod layout;
mod leaving;
mod lighting;
mod masking;
mod messages;
mod modelling;
mod new_capture;
mod opening;
mod paced;
mod panels;
mod panes;
mod pending;
mod probe;
mod picture_choices;
mod plots;
mod products;
mod project;
mod project_file;
mod relight;
mod relighting;
mod reopening;
mod report;
mod saving;
mod scene_export;
mod selecting;
mod selection;
mod solo;
mod state;
mod studying;
mod theme;
mod things;
mod undo;
mod unsaved;
mod view_file;
pub mod viewport;
#[cfg(test)]
mod walk;
mod workspaces;
mod writer;

use std::path::PathBuf;
use std::time::Instant;

use eframe::egui;

use crate::io::settings::Settings;

pub use app::Studio;
pub use commands::entries;

/// How the window starts.
#[derive(Clone, Debug, Default)]
pub struct Launch {
    /// A capture's folder or a project file to open at once.
    pub path: Option<PathBuf>,
    /// Where settings and unsaved work are kept; `None` to keep nothing.
    pub home: Option<PathBuf>,
    /// Ask for paths in the window only, never by the system's dialogs.
    pub own_dialogs: bool,
    /// When the program began, to say how soon the capture was seen.
    pub began: Option<Instant>,
}

/// Opens the window and returns when it is closed.
pub fn open(path: Option<PathBuf>) -> Result<(), String> {
    let began = Instant::now();
    let home = crate::io::settings::home();
    let settings = home.as_deref().map(Settings::read).unwrap_or_default();
    let [width, height] = settings.window.unwrap_or([1280.0, 720.0]);
    let launch = Launch { path, home, own_dialogs: false, began: Some(began) };
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Lobelia")
            .with_app_id("lobelia")
            .with_icon(icon())
            .with_inner_size([width.clamp(800.0, 16384.0), height.clamp(500.0, 16384.0)])
            .with_maximized(settings.is_maximized)
            .with_min_inner_size([800.0, 500.0])
            .with_drag_and_drop(true),
        ..Default::default()
    };
    eframe::run_native("Lobelia", options, Box::new(|cc| Ok(Box::new(Studio::new(cc, launch)?))))
        .map_err(|error| error.to_string())
}

/// The window's icon, from `assets/package/lobelia.svg`.
fn icon() -> egui::IconData {
    let png = include_bytes!("../../assets/package/lobelia-64.png");
    eframe::icon_data::from_png_bytes(png).unwrap_or_default()
}
