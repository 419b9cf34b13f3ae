//! Carries out the actions of relighting.

use std::sync::Arc;

use glam::Vec3;
use serde_json::json;

use super::actions::{Outcome, PathRequest, Relight, Select};
use super::asking::beside;
use super::change::Change;
use super::changing;
use super::errands;
use super::jobs::Reading;
use super::lighting;
use super::relight::{self, Added, Motion};
use super::selecting::select;
use super::state::State;
use super::things::Things;
use super::viewport::Shading;
use crate::io::edits;
use crate::render::edits::Edits;
use crate::worker::EditSource;

pub fn apply(state: &mut State, what: Relight) {
    let bright = state.viewport.bright();
    let Some(project) = &mut state.project else { return };
    let edits = project.edit().relight.clone();
    let things = project.edit().things();
    let selected = project.selection.added.filter(|item| things.exists(*item));
    match what {
        Relight::AddLight(kind) => {
            let next = relight::with_light(&edits, kind, &project.loaded, bright);
            let item = Added::Light(next.lights.len() - 1);
            added(state, "add light", next, item);
        }
        Relight::AddObject(path) => {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let value = json!({ "objects": [{ "mesh": path, "name": name }] });
            read(state, Reading::Object, value);
        }
        Relight::AddDome(path) => {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let dome = json!({ "kind": "dome", "image": path, "name": name });
            read(state, Reading::Dome, json!({ "lights": [dome] }));
        }
        Relight::Load(path) => {
            let project = state.project.as_ref();
            state.jobs.read_edits(project, Reading::File, EditSource::File(path));
        }
        Relight::Save(path, replace) => {
            let path = if path.extension().is_some() { path } else { path.with_extension("json") };
            errands::start(state, move || {
                if !replace && path.exists() {
                    return vec![Outcome::AskToReplace(PathRequest::SaveEdits, path)];
                }
                vec![match edits::write(&path, &edits) {
                    Ok(()) => Outcome::Notice(format!("Edits written to {}", path.display())),
                    Err(error) => Outcome::Error("The edits cannot be written", error.to_string()),
                }]
            });
        }
        Relight::Remove => {
            if let Some(Added::Known(index)) = selected {
                lighting::remove(state, index);
            } else if let Some(item) = selected {
                change(state, "remove", None, relight::without(&edits, item));
            }
        }
        Relight::Duplicate => {
            if let Some(Added::Known(index)) = selected {
                lighting::duplicate(state, index);
            } else if let Some(item) = selected {
                let next = relight::twin(&edits, item);
                let twin = match item {
                    Added::Object(_) => Added::Object(next.objects.len() - 1),
                    _ => Added::Light(next.lights.len() - 1),
                };
                added(state, "duplicate", next, twin);
            }
        }
        Relight::Drop => {
            if let Some(item) = selected
                && let Some(next) = dropped(state, &things, item)
            {
                changing::change_project(state, &next.change("drop to surface", item));
            }
        }
        Relight::Find(index, path) => {
            if let Some(part) = project.edit().unread.get(index) {
                // A path as it was typed counts from here.
                let path = std::path::absolute(&path).unwrap_or(path);
                let value = part.with_file(&path);
                read(state, Reading::Found(index), value);
            }
        }
        Relight::GiveUp(index) => {
            let mut unread = (*project.edit().unread).clone();
            if index < unread.len() {
                unread.remove(index);
                let (name, unread) = ("remove", Arc::new(unread));
                changing::change_project(state, &Change::Unread { name, edits, unread });
            }
        }
        Relight::AskPictures => {
            let mut choices = state.dialogs.last_pictures.clone();
            let folder = beside(&project.folder, &format!("{}-pictures", project.name()));
            choices.folder = folder.display().to_string();
            state.dialogs.pictures_focused = false;
            state.dialogs.pictures = Some(choices);
        }
        Relight::PicturesFolder(folder) => {
            if let Some(own) = &mut state.dialogs.pictures {
                own.folder = folder.display().to_string();
            }
        }
        Relight::Render(choices) => {
            state.dialogs.pictures = None;
            let (shown, view) = (state.viewport.development(), state.viewport.seen());
            state.jobs.render(project, &choices, shown, view);
            state.dialogs.last_pictures = *choices;
        }
        Relight::StopRendering => state.jobs.stop_rendering(),
    }
}

/// Reads a file by edits that name it.
fn read(state: &mut State, reading: Reading, value: serde_json::Value) {
    // A path as it was typed counts from here.
    let file = std::env::current_dir().unwrap_or_default().join("edits.json");
    let source = EditSource::Value { file, value: Box::new(value) };
    state.jobs.read_edits(state.project.as_ref(), reading, source);
}

fn change(state: &mut State, name: &'static str, of: Option<Added>, edits: Edits) {
    let change = Change::Relight { name, of, edits: Arc::new(edits) };
    changing::change_project(state, &change);
}

fn added(state: &mut State, name: &'static str, edits: Edits, item: Added) {
    change(state, name, Some(item), edits);
    let Some(project) = &mut state.project else { return };
    select(project, Select::Added(item));
    if project.products.solved.is_some() {
        state.viewport.settings.shading = Shading::Relit;
    }
}

/// On the surface below its middle, or on the lowest of the geometry where there is none.
fn dropped(state: &State, things: &Things, item: Added) -> Option<Things> {
    let project = state.project.as_ref()?;
    let bounds = project.loaded.mesh.bounds()?;
    let middle = things.middle(item, bounds)?;
    let ground = state.viewport.below(middle).unwrap_or(Vec3::new(middle.x, middle.y, bounds.0.z));
    let reach_m = things.reach_m(item, Vec3::Z);
    let by = ground + Vec3::Z * reach_m - middle;
    Some(things.moved(item, Motion::Move(by)))
}

/// Edits have been read: from the project's own file, or to be added.
pub fn edits_read(state: &mut State, reading: Reading, edits: Arc<Edits>, warnings: Vec<String>) {
    for warning in warnings {
        state.messages.warning(warning);
    }
    let Some(project) = &mut state.project else { return };
    let now = project.edit().relight.clone();
    match reading {
        Reading::Found(index) => found(state, index, &edits),
        Reading::Sky | Reading::FoundLight(_) | Reading::Cameras => {}
        Reading::File => {
            change(state, "load edits", None, relight::with_edits(&now, &edits));
            state.messages.notice("Edits loaded");
        }
        Reading::Dome => {
            let only = Edits { lights: edits.lights.clone(), ..(*now).clone() };
            let next = Edits { lights: relight::with_edits(&now, &only).lights, ..(*now).clone() };
            let item = Added::Light(next.lights.len() - 1);
            added(state, "add dome", next, item);
        }
        Reading::Object => {
            let Some(bounds) = project.loaded.mesh.bounds() else { return };
            let only = Edits { objects: edits.objects.clone(), ..(*now).clone() };
            let objects = relight::with_edits(&now, &only).objects;
            let next = Edits { objects, ..(*now).clone() };
            let item = Added::Object(next.objects.len() - 1);
            let next = placed(next, item, bounds);
            let given = project.edit().given.clone();
            let things = Things { edits: Arc::new(next), given };
            let next = dropped(state, &things, item).unwrap_or(things);
            added(state, "add object", (*next.edits).clone(), item);
        }
    }
}

/// A part of the project that could not be read has been, from another file: it takes its place.
fn found(state: &mut State, index: usize, edits: &Edits) {
    let Some(project) = &mut state.project else { return };
    let mut unread = (*project.edit().unread).clone();
    if index >= unread.len() {
        return;
    }
    unread.remove(index);
    let mut next = (*project.edit().relight).clone();
    next.lights.extend(edits.lights.iter().cloned());
    next.objects.extend(edits.objects.iter().cloned());
    let item = match edits.lights.is_empty() {
        true => Added::Object(next.objects.len() - 1),
        false => Added::Light(next.lights.len() - 1),
    };
    let (edits, unread) = (Arc::new(next), Arc::new(unread));
    changing::change_project(state, &Change::Unread { name: "find file", edits, unread });
    if let Some(project) = &mut state.project {
        select(project, Select::Added(item));
    }
}

/// A new object in the middle of the geometry; one of another unit is brought to a tenth of its
/// size.
fn placed(edits: Edits, item: Added, bounds: (Vec3, Vec3)) -> Edits {
    let (low, high) = bounds;
    let size_m = (high - low).length();
    let Added::Object(index) = item else { return edits };
    let own = edits.objects[index].mesh.bounds().map_or(0.0, |(low, high)| (high - low).length());
    let is_odd = own > size_m || own < 1e-3 * size_m;
    let scaled = if is_odd && own > 0.0 {
        relight::moved(&edits, item, Motion::Scale(0.1 * size_m / own))
    } else {
        edits
    };
    match relight::middle(&scaled, item, bounds) {
        Some(middle) => {
            let by = 0.5 * (low + high) - middle;
            relight::moved(&scaled, item, Motion::Move(by))
        }
        None => scaled,
    }
}
