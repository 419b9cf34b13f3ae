//! Carries out the actions of the import page.

use std::path::Path;

use super::ImportPage;
use crate::app::actions::{Field, ImportAction};
use crate::app::leaving::leave;
use crate::app::opening::AfterPrompt;
use crate::app::state::State;
use crate::app::workspaces::Workspace;
use crate::io::import::{Writing, Written};
use crate::io::mesh;
use crate::worker::Command;

/// Does what was asked for.
pub fn apply(state: &mut State, what: ImportAction) {
    if let ImportAction::Show(source) = what {
        show(state, source.as_deref());
        return;
    }
    let Some(page) = &mut state.import else { return };
    match what {
        ImportAction::Show(_) => {}
        ImportAction::Hide => page.is_shown = false,
        ImportAction::Choose(field, path) => page.choose(field, &path),
        ImportAction::Read => page.request = None,
        ImportAction::Cancel => page.cancel(),
        ImportAction::Write { replace } => write(state, replace),
    }
}

fn show(state: &mut State, source: Option<&Path>) {
    if state.import.is_none() {
        match ImportPage::start(&state.render, &state.ctx) {
            Ok(page) => state.import = Some(Box::new(page)),
            Err(error) => {
                let text = format!("no thread can be started: {error}");
                state.messages.error("The import page cannot be opened", text);
                return;
            }
        }
    }
    let Some(page) = &mut state.import else { return };
    page.is_shown = true;
    if let Some(source) = source {
        // Onto a page with cameras, a mesh is that of the cameras.
        let is_own_mesh = mesh::is_mesh(source) && page.path(Field::Cameras).is_some();
        page.choose(if is_own_mesh { Field::Mesh } else { Field::Cameras }, source);
    }
}

fn write(state: &mut State, replace: bool) {
    let Some(page) = &mut state.import else { return };
    if let Some(obstacle) = page.obstacle() {
        state.messages.notice(obstacle);
        return;
    }
    let (Some(import), Some(folder)) = (page.import.clone(), page.path(Field::Out)) else { return };
    let merge = page.merge && !import.series.is_empty();
    if merge && let Err(problem) = page.merging.check_corners() {
        state.messages.error(NOT_WRITTEN, problem);
        return;
    }
    if let Some(job) = page.investigating.take() {
        page.reader.cancel(job);
        page.question = None;
    }
    let merge = merge.then(|| page.merging.clone());
    let as_srgb = page.as_srgb;
    let writing = Box::new(Writing { replace, merge, as_srgb, ..Writing::default() });
    page.writing = Some(page.reader.send(Command::WriteCapture { import, folder, writing }));
}

pub(super) const NOT_WRITTEN: &str = "The capture cannot be written";

/// The capture stands: it is opened, and the page has done its work.
pub(super) fn written(state: &mut State, folder: &Path, written: &Written) {
    let warnings = state.import.as_ref().and_then(|page| page.import.clone());
    let warnings = warnings.iter().flat_map(|import| &import.warnings);
    for warning in warnings.chain(&written.warnings) {
        state.messages.warning(warning.clone());
    }
    state.messages.notice(format!("Capture written to {}", folder.display()));
    state.import = None;
    state.layout.current = Workspace::Capture;
    leave(state, AfterPrompt::Open(folder.to_owned()));
}
