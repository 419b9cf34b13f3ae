//! Carries out the actions on known lights.

use std::sync::Arc;

use serde_json::json;

use super::actions::{Lighting, Select};
use super::change::Change;
use super::changing;
use super::given::GivenLight;
use super::jobs::Reading;
use super::relight::Added;
use super::selecting::select;
use super::state::State;
use crate::io::tags::StoredLights;

pub fn apply(state: &mut State, what: Lighting) {
    let Some(project) = &state.project else { return };
    let given = project.edit().given.clone();
    match what {
        Lighting::Add(kind) => {
            added(state, "add known light", given.with_shape(kind, &project.loaded))
        }
        Lighting::AddVisible => {
            let surfaces = &project.selection.surfaces;
            if surfaces.is_empty() {
                state.messages.notice("Select the surfaces that shine first.");
            } else {
                let next = given.with_visible(surfaces);
                added(state, "add visible light", next);
            }
        }
        Lighting::AddSky(path) => {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            // A path as it was typed counts from here.
            let path = std::path::absolute(&path).unwrap_or(path);
            let sky = json!({ "kind": "dome", "image": path, "name": name });
            state.jobs.read_lights(state.project.as_ref(), Reading::Sky, vec![sky]);
        }
        Lighting::Find(index, path) => {
            if let Some(part) = given.unread.get(index) {
                let mut value = part.value.clone();
                let path = std::path::absolute(&path).unwrap_or(path);
                value["image"] = json!(path);
                let values = vec![value];
                state.jobs.read_lights(state.project.as_ref(), Reading::FoundLight(index), values);
            }
        }
        Lighting::GiveUp(index) => {
            let mut next = (*given).clone();
            if index < next.unread.len() {
                next.unread.remove(index);
                change(state, "remove", None, next);
            }
        }
    }
}

/// Takes a known light away.
pub fn remove(state: &mut State, index: usize) {
    if let Some(project) = &state.project {
        let next = project.edit().given.without(index);
        change(state, "remove", None, next);
    }
}

pub fn duplicate(state: &mut State, index: usize) {
    let Some(project) = &state.project else { return };
    match project.edit().given.twin(index) {
        Some(next) => added(state, "duplicate", next),
        None => state.messages.notice("A surface belongs to one visible light only."),
    }
}

/// Lights were read from files.
pub fn lights_read(state: &mut State, reading: Reading, stored: StoredLights) {
    for warning in stored.warnings {
        state.messages.warning(warning);
    }
    let Some(project) = &state.project else { return };
    let mut given = (*project.edit().given).clone();
    let Some(light) = stored.lights.into_iter().next() else {
        let problem = stored.unread.first().and_then(|part| part.problem.clone());
        state.messages.error(reading.failed(), problem.unwrap_or_default());
        return;
    };
    let name = match reading {
        Reading::FoundLight(index) if index < given.unread.len() => {
            given.unread.remove(index);
            "find file"
        }
        Reading::FoundLight(_) => return,
        _ => "add known light",
    };
    added(state, name, given.with(light));
}

fn change(state: &mut State, name: &'static str, of: Option<Added>, given: GivenLight) {
    changing::change_project(state, &Change::Given { name, of, given: Arc::new(given) });
}

/// The last light is new.
fn added(state: &mut State, name: &'static str, given: GivenLight) {
    let item = Added::Known(given.lights.len() - 1);
    change(state, name, Some(item), given);
    if let Some(project) = &mut state.project {
        select(project, Select::Added(item));
    }
}
