//! Carries out selections, and chooses what the inspector shows.

use std::collections::BTreeSet;

use super::actions::{Mode, Select};
use super::derived;
use super::project::{Focus, Project, Selection};

pub fn select(project: &mut Project, what: Select) {
    let count = project.loaded.surfaces.len();
    // What is picked in the 3D view shows its material beside it.
    let material = match &what {
        Select::Surface { surface, .. } => material_of(project, *surface),
        _ => None,
    };
    let selection = &mut project.selection;
    selection.material = material.or(selection.material);
    selection.focus = match what {
        Select::Surface { surface, mode } => {
            match mode {
                Mode::Toggle => {
                    if !selection.surfaces.remove(&surface) {
                        selection.surfaces.insert(surface);
                    }
                }
                Mode::Only => selection.surfaces = BTreeSet::from([surface]),
            }
            selection.anchor = Some(surface);
            Focus::Surfaces
        }
        Select::Extend { to, shown } => {
            let anchor = *selection.anchor.get_or_insert(to);
            let range = shown.range(anchor.min(to)..=anchor.max(to));
            let Selection { surfaces, hidden, .. } = selection;
            surfaces.extend(range.filter(|surface| !hidden.contains(surface)));
            Focus::Surfaces
        }
        Select::Surfaces { surfaces, add } => {
            if !add {
                selection.surfaces.clear();
            }
            selection.anchor = surfaces.first().copied();
            selection.surfaces.extend(surfaces);
            Focus::Surfaces
        }
        Select::AllSurfaces => {
            selection.surfaces = (0..count).filter(|s| !selection.hidden.contains(s)).collect();
            Focus::Surfaces
        }
        Select::Nothing => {
            let hidden = std::mem::take(&mut selection.hidden);
            *selection = Selection { hidden, ..Selection::default() };
            Focus::Nothing
        }
        Select::Material(material) => {
            selection.material = Some(material);
            Focus::Material
        }
        Select::Sample(sample) => {
            selection.sample = Some(sample);
            Focus::Sample
        }
        Select::WorstSample => {
            let derived = project.products.derived.as_ref();
            selection.sample = derived.and_then(|derived| derived.worst()).or(selection.sample);
            Focus::Sample
        }
        Select::Light(light) => {
            selection.light = Some(light);
            Focus::Light
        }
        Select::StrongestLight => {
            let lit = project.products.whole.as_deref().zip(selection.sample);
            let lights = lit.map(|(whole, sample)| derived::irradiance_of(whole, sample).1);
            let Some(&(light, _)) = lights.as_ref().and_then(|lights| lights.first()) else {
                return;
            };
            selection.light = Some(light);
            Focus::Light
        }
        Select::Photograph(photograph) => {
            selection.photograph = Some(photograph);
            Focus::Photograph
        }
        Select::Added(item) => {
            selection.added = Some(item);
            Focus::Added
        }
    };
}

/// The material of the list that a surface has.
fn material_of(project: &Project, surface: usize) -> Option<usize> {
    let material = project.capture.surfaces.get(surface)?.material()?;
    project.edit().listed().get(material).copied()
}
