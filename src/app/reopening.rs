//! Opens a capture again after its mesh and cameras were made anew. Tags, options and edits stay
//! with surfaces of the same name, and so does their undo history.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use super::edit::Edit;
use super::given::GivenLight;
use super::messages::Messages;
use super::opening::Opening;
use super::project::Project;
use super::state::State;
use super::unsaved::UnsavedWork;
use crate::io::edits::{Place, Unread};
use crate::io::project;
use crate::io::tags::light_values;
use crate::scene::{Capture, KnownLight};

/// Reads a capture anew.
pub fn reopen(state: &mut State, folder: &Path) {
    let of = |project: &&Project| project.folder == folder;
    let file = state.project.as_ref().filter(of).and_then(|project| project.file.clone());
    state.jobs.open(Opening {
        path: file.clone().unwrap_or_else(|| folder.to_owned()),
        folder: folder.to_owned(),
        project: None,
        edits: None,
        lights: None,
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
    let given = relit(edit, old, new);
    let resolved = project::materials(&edit.tags(old), &given.lit(new));
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
    let given = Arc::new(given);
    (Edit { materials, given, absent: resolved.absent, ..edit.clone() }, resolved.warnings)
}

/// The known light on another capture. What was never changed is as the new tags say.
fn relit(edit: &Edit, old: &Capture, new: &Capture) -> GivenLight {
    let (was, mut given) = (&edit.given, GivenLight::of(new));
    if was.environment != old.environment {
        given.environment = was.environment;
    }
    if was.lights != old.lights || !was.unread.is_empty() {
        let indexed = was.lights.iter().map(|light| match light {
            KnownLight::Visible { name, surfaces } => {
                let of = |&surface: &usize| {
                    let name = &old.surfaces[surface].name;
                    new.surfaces.iter().position(|other| other.name == *name)
                };
                let surfaces: Option<Vec<usize>> = surfaces.iter().map(of).collect();
                surfaces.map(|surfaces| KnownLight::Visible { name: name.clone(), surfaces })
            }
            other => Some(other.clone()),
        });
        (given.lights, given.unread) = (Vec::new(), was.unread.clone());
        for (light, moved) in was.lights.iter().zip(indexed) {
            match moved {
                Some(moved) => given.lights.push(moved),
                None => given.unread.push(lost(light, old)),
            }
        }
    }
    given
}

/// A visible light whose surfaces are gone.
fn lost(light: &KnownLight, old: &Capture) -> Unread {
    Unread {
        place: Place::Light,
        value: light_values(std::slice::from_ref(light), &[], old).remove(0),
        problem: Some(format!("The capture has the surfaces of \"{}\" no more.", light.name())),
        is_missing: false,
    }
}
