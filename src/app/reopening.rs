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
use crate::scene::charts::{Chart, ChartView, LaidChart};
use crate::scene::{Capture, KnownLight};

/// Reads a capture anew.
pub fn reopen(state: &mut State, folder: &Path) {
    let of = |project: &&Project| project.folder == folder;
    let project = state.project.as_ref().filter(of);
    let file = project.and_then(|project| project.file.clone());
    let charts = project.and_then(Project::chart_values);
    state.jobs.open(Opening {
        path: file.clone().unwrap_or_else(|| folder.to_owned()),
        folder: folder.to_owned(),
        project: None,
        edits: None,
        charts,
        read_charts: None,
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
    let charts = project.loaded.charts.clone();
    let (edit, warnings) = renamed(before.edit(), &captures, charts);
    project.set_edit(Arc::new(edit));
    if before.is_changed() {
        project.mark_unsaved();
    } else {
        project.mark_saved();
    }
    project.history = before.history.map(|edit| {
        let charts = moved_charts(&edit.charts, &captures);
        Arc::new(renamed(edit, &captures, charts).0)
    });
    if !warnings.is_empty() {
        let text = warnings.join("\n") + "\nSaving keeps these tags as they are.";
        messages.error("The surfaces have changed", text);
    }
}

/// The same tags on another capture's surfaces, by their names; what could not be found. Surfaces
/// that are new have the materials of a capture that is opened.
fn renamed(
    edit: &Edit,
    [old, new]: &[Arc<Capture>; 2],
    charts: Arc<Vec<LaidChart>>,
) -> (Edit, Vec<String>) {
    let old = &old.with_charts(edit.charts.clone());
    let new = &new.with_charts(charts.clone());
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
    let edit = Edit { materials, given, charts, absent: resolved.absent, ..edit.clone() };
    (edit, resolved.warnings)
}

/// Charts of an earlier state in another capture. One that is there at present has its position there;
/// others keep theirs. Photographs that are gone show them no more.
fn moved_charts(charts: &[LaidChart], [old, new]: &[Arc<Capture>; 2]) -> Arc<Vec<LaidChart>> {
    let view = |view: &ChartView| {
        let name = &old.photographs[view.photograph].name;
        let photograph = new.photographs.iter().position(|own| own.name == *name)?;
        Some(ChartView { photograph, ..*view })
    };
    let moved = |own: &LaidChart| {
        let views = own.chart.views.iter().filter_map(view).collect();
        let chart = Chart { views, ..own.chart.clone() };
        let now = new.charts.iter().find(|other| other.chart == chart);
        now.cloned().unwrap_or_else(|| LaidChart { chart, placed: own.placed.clone() })
    };
    Arc::new(charts.iter().map(moved).collect())
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
