//! Carries out the actions that export the recovered scene for other programs.

use std::path::PathBuf;

use super::actions::{Action, ExportAction, Outcome};
use super::asking::beside;
use super::errands;
use super::export_question::ExportQuestion;
use super::state::State;
use crate::io::export::elsewhere::{Format, Plan};
use crate::io::export::{check_folder, sample_rows};
use crate::render::probe::ProbeSettings;
use crate::worker::SceneExport;

pub fn apply(state: &mut State, what: ExportAction) {
    match what {
        ExportAction::Show => show(state),
        ExportAction::Folder(folder) => {
            if let Some(own) = &mut state.dialogs.scene_export {
                own.folder = folder.display().to_string();
                own.problem = None;
            }
        }
        ExportAction::Start => check(state),
        ExportAction::Write => start(state),
        ExportAction::Refuse(problem) => {
            if let Some(own) = &mut state.dialogs.scene_export {
                own.problem = Some(problem);
            }
        }
        ExportAction::Stop => state.jobs.stop_scene_export(),
        ExportAction::Leave => state.dialogs.scene_export = None,
    }
}

fn show(state: &mut State) {
    let Some(project) = &state.project else { return };
    if project.products.solved.is_none() {
        state.messages.notice("Run first: there is no recovered scene yet.");
        return;
    }
    let folder = beside(&project.folder, &format!("{}-scene", project.name()));
    let middle = project.loaded.mesh.bounds().map(|(low, high)| 0.5 * (low + high));
    state.dialogs.scene_export = Some(ExportQuestion {
        formats: vec![Format::Glb],
        probe: ProbeSettings::default(),
        probe_at: None,
        middle: middle.unwrap_or_default().as_dvec3(),
        folder: folder.display().to_string(),
        is_focused: false,
        problem: None,
    });
}

/// Looks whether the folder can be written to, before anything is computed.
fn check(state: &mut State) {
    let Some(own) = &state.dialogs.scene_export else { return };
    let folder = PathBuf::from(own.folder.trim());
    errands::start(state, move || {
        let next = match check_folder(&folder) {
            Ok(()) => ExportAction::Write,
            Err(error) => ExportAction::Refuse(error.to_string()),
        };
        vec![Outcome::Do(Action::ExportScene(next))]
    });
}

fn start(state: &mut State) {
    let (Some(own), Some(project)) = (&state.dialogs.scene_export, &state.project) else {
        return;
    };
    let Some(solved) = project.products.solved.clone() else { return };
    let folder = PathBuf::from(own.folder.trim());
    let capture = project.result_capture().clone();
    let samples = project.products.whole.as_ref().zip(project.products.of.as_ref());
    let samples = samples
        .filter(|_| own.formats.contains(&Format::Ply))
        .map(|(whole, (edit, capture))| sample_rows(capture, &edit.run_options(), whole));
    if capture.photographs.iter().any(|own| !own.camera.distortion.is_none()) {
        state.messages.warning(
            "Lens distortion has no place in these formats; cameras are written without it"
                .to_owned(),
        );
    }
    let plan = Plan {
        folder,
        formats: own.formats.clone(),
        probe_at: own.probe_at.map(|at| at.as_vec3()),
        probe: own.probe,
        samples,
    };
    let edits = project.edit().relight.clone();
    state.jobs.export_scene(SceneExport { capture, solved, edits, plan });
    state.dialogs.scene_export = None;
}
