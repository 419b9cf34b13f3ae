//! Leaves a project: asks first if unsaved work would be lost.

use std::path::PathBuf;

use eframe::egui;

use super::files;
use super::modelling::keeping;
use super::opening::{AfterPrompt, Opening};
use super::state::State;

/// Leaves the project, after asking where something would be lost.
pub fn leave(state: &mut State, then: AfterPrompt) {
    if state.saves.are_under_way() {
        // Nobody is asked about what is being saved.
        state.saves.then = Some(then);
    } else if state.unsaved_work(matches!(then, AfterPrompt::Quit)).is_nothing() {
        once_saved(state, then);
    } else {
        state.dialogs.unsaved = Some(then);
    }
}

/// Leaves the project without asking, once its results are on the disk.
pub fn once_saved(state: &mut State, then: AfterPrompt) {
    if state.jobs.is_storing() {
        state.messages.notice("The results are being saved first.");
        state.after_storing = Some(then);
    } else {
        proceed(state, then);
    }
}

/// Leaves the project without asking.
pub fn proceed(state: &mut State, then: AfterPrompt) {
    match then {
        AfterPrompt::Open(path) => files::open_unprompted(state, &path),
        AfterPrompt::Model(folder) => {
            files::close_unprompted(state);
            keeping::open(state, &folder);
            files::remember(state, &folder);
        }
        AfterPrompt::Recover(file) => files::recover_unprompted(state, &file),
        AfterPrompt::Show(opening, capture) => files::show(state, *opening, capture),
        AfterPrompt::Close => {
            files::close_unprompted(state);
            files::look_for_recent(state);
        }
        AfterPrompt::Quit => {
            state.settings.layout = state.layout.value();
            state.remember_window();
            files::save_settings(state);
            files::close_unprompted(state);
            state.quitting = true;
            state.ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }
}

/// A folder was opened whose cameras or mesh are still to be made.
pub fn begun(state: &mut State, opening: &Opening, folder: PathBuf) {
    let then = AfterPrompt::Model(folder);
    if state.unsaved_work(false).is_within(&opening.agreed) {
        proceed(state, then);
    } else {
        state.dialogs.unsaved = Some(then);
    }
}
