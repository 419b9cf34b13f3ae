//! Opening a capture in its own place: after its mesh and cameras were made anew. Tags, options and
//! edits stay with the surfaces of their names, and so does their undo.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::edit::Edit;
use super::files::Opening;
use super::leaving::{AfterPrompt, UnsavedWork, proceed};
use super::messages::Messages;
use super::project::Project;
use super::state::State;
use crate::io::project;
use crate::scene::Capture;

/// Reads a capture anew.
pub fn reopen(state: &mut State, folder: &Path) {
    let of = |project: &&Project| project.folder == folder;
    let file = state.project.as_ref().filter(of).and_then(|project| project.file.clone());
    state.jobs.open(Opening {
        path: file.clone().unwrap_or_else(|| folder.to_owned()),
        folder: folder.to_owned(),
        project: None,
        edits: None,
        file,
        recovered: None,
        is_reopened: true,
        agreed: UnsavedWork::default(),
        began: Instant::now(),
    });
}

/// The project that what is being opened takes over from.
pub fn take(state: &mut State, opening: &Opening) -> Option<Project> {
    let mut before =
        state.project.take_if(|project| opening.is_reopened && project.folder == opening.folder)?;
    state.jobs.cancel(&mut before);
    before.commit();
    Some(before)
}

/// Gives a project what was changed about the one before.
pub fn carry_over(before: &Project, project: &mut Project, messages: &mut Messages) {
    let captures = [before.loaded.clone(), project.loaded.clone()];
    let (edit, warnings) = renamed(before.edit(), &captures);
    project.set_edit(Arc::new(edit));
    if before.is_changed() {
        project.mark_unsaved();
    } else {
        project.mark_saved();
    }
    project.history = before.history.map(|edit| Arc::new(renamed(edit, &captures).0));
    if !warnings.is_empty() {
        let text = warnings.join("\n") + "\nSaving keeps these tags as they are.";
        messages.error("The surfaces have changed", text);
    }
}

/// The same tags on another capture's surfaces, by their names; what could not be found. Surfaces
/// that are new have the materials of a capture that is opened.
fn renamed(edit: &Edit, [old, new]: &[Arc<Capture>; 2]) -> (Edit, Vec<String>) {
    let resolved = project::materials(&edit.tags(old), new);
    let mut materials = resolved.materials;
    let is_known = |surface: &usize| {
        let name = &new.surfaces[*surface].name;
        old.surfaces.iter().any(|other| other.name == *name)
    };
    for material in new.materials.iter().filter(|own| !own.surfaces.iter().any(is_known)) {
        if !materials.iter().any(|other| other.name == material.name) {
            materials.push(material.clone());
        }
    }
    (Edit { materials, absent: resolved.absent, ..edit.clone() }, resolved.warnings)
}

/// A folder was opened whose cameras or mesh are still to be made.
pub fn begun(state: &mut State, opening: &Opening, folder: PathBuf) {
    let then = AfterPrompt::Model(folder);
    if UnsavedWork::of(state, false).is_within(&opening.agreed) {
        proceed(state, then);
    } else {
        state.dialogs.unsaved = Some(then);
    }
}
