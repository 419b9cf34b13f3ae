//! Opens and closes the Model page, and stores unsaved changes for recovery.

use std::path::{Path, PathBuf};

use super::ModelPage;
use crate::app::state::State;
use crate::io::model as model_files;

/// Opens the page of a folder, without asking about what is open.
pub fn open(state: &mut State, folder: &Path) {
    match ModelPage::start(folder, state.engines.clone(), &state.ctx) {
        Ok(page) => state.modelling = Some(Box::new(page)),
        Err(error) => {
            let text = format!("no thread can be started: {error}");
            state.messages.error("The Model page cannot be opened", text);
        }
    }
}

/// What was kept for recovery is saved, or not wanted.
pub fn forget_kept(state: &State, folder: PathBuf) {
    state.writer.send(move || {
        model_files::forget(&folder);
        Ok(())
    });
}

/// Leaves the page without asking.
pub fn close(state: &mut State) {
    if let Some(page) = state.modelling.take()
        && page.is_changed()
    {
        forget_kept(state, page.folder.clone());
    }
}

/// Keeps what is not saved, in case that the program ends.
pub(super) fn keep(state: &State) {
    let Some(page) = &state.modelling else { return };
    let Some(document) = &page.document else { return };
    let (folder, model) = (page.folder.clone(), document.model().clone());
    if document.is_changed() {
        state.writer.send(move || {
            model_files::keep(&folder, &model).map_err(|error| format!("Autosave: {error}"))
        });
    } else {
        forget_kept(state, folder);
    }
}
