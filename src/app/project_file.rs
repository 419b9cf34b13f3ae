//! The part of the open project that is written to its file.

use serde_json::Value;

use super::project::Project;
use super::state::State;
use super::view_file;
use crate::io::project::{ProjectFile, Relight};

/// All of it that belongs into a file; the caller says where results go.
pub fn file_of(state: &State, project: &Project) -> ProjectFile {
    let given = &project.edit().given;
    ProjectFile {
        capture: project.folder.clone(),
        original: None,
        tags: project.edit().tags(&project.loaded),
        lights: (given.lights != project.loaded.lights || !given.unread.is_empty())
            .then(|| given.values(&project.loaded)),
        charts: project.chart_values(),
        environment: (given.environment != project.loaded.environment).then_some(given.environment),
        options: project.edit().options.clone(),
        masks: (*project.edit().masks).clone(),
        relight: Relight::Edits(project.edit().relight.clone(), project.edit().unread.clone()),
        solution: project.solution.clone().filter(|_| !project.is_outdated()),
        results: project.results.clone(),
        view: view_of(state),
        layout: state.layout.value(),
    }
}

/// How the 3D view is set, and which light is seen alone there.
fn view_of(state: &State) -> Value {
    let mut view = view_file::value(&state.viewport.settings, state.viewport.camera());
    if let Some(alone) = state.panels.alone() {
        view["alone"] = alone.value();
    }
    view
}
