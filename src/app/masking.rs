//! Masks in the window: those that are drawn over photographs, and those that are suggested.

use std::sync::Arc;

use super::actions::Masking;
use super::change::Change;
use super::changing;
use super::panes::Pane;
use super::project::Project;
use super::state::State;
use super::viewport::MaskTool;
use crate::io::project::Masks;
use crate::scene::clutter::Suggestion;
use crate::scene::{Capture, Image, Mask, Shape};

pub fn apply(state: &mut State, what: Masking) {
    match what {
        Masking::Tool(tool) => take_up(state, tool),
        Masking::Draw { photograph, shape, is_left_out } => {
            let name = if is_left_out { "paint mask" } else { "erase mask" };
            change(state, photograph, name, |mask| mask.with(&shape, is_left_out));
        }
        Masking::Clear => on_shown(state, "clear mask", |mask| {
            let (width, height) = mask.size();
            Mask::new(mask.size(), &vec![false; width * height])
        }),
        Masking::Invert => on_shown(state, "invert mask", Mask::inverted),
        Masking::Suggest => {
            if let Some(project) = &state.project {
                state.jobs.suggest_masks(project);
                state.layout.show(Pane::Masks);
            }
        }
        Masking::StopSuggesting => state.jobs.stop_suggesting(),
    }
}

/// A tool is for the photograph that is looked through; the selected one where none is.
fn take_up(state: &mut State, tool: Option<MaskTool>) {
    if state.project.is_none() {
        return;
    }
    state.viewport.masking.tool = tool;
    if tool.is_none() {
        return;
    }
    state.viewport.cornering.is_active = false;
    state.layout.show(Pane::Masks);
    look_through_any(state);
}

/// Looks through a photograph where none is: the selected one, or the first that measures radiance.
pub fn look_through_any(state: &mut State) {
    let Some(project) = &state.project else { return };
    if state.viewport.is_looking_through().is_none() {
        let first = || project.capture.measurements().next().map(|(index, ..)| index);
        match project.selection.photograph.or_else(first) {
            Some(photograph) => state.viewport.look_through(Some(photograph)),
            None => state.messages.notice("No photograph of the capture measures radiance."),
        }
    }
}

/// The photograph whose mask is meant: that which is looked through, or the selected one.
pub fn shown(state: &State) -> Option<usize> {
    let project = state.project.as_ref()?;
    let shown = state.viewport.is_looking_through().or(project.selection.photograph)?;
    project.capture.photographs.get(shown)?.image.as_ref().map(|_| shown)
}

fn on_shown(state: &mut State, name: &'static str, of: impl FnOnce(&Mask) -> Mask) {
    match shown(state) {
        Some(photograph) => change(state, photograph, name, of),
        None => state.messages.notice("Look through a photograph, or select one, first."),
    }
}

fn change(
    state: &mut State,
    photograph: usize,
    name: &'static str,
    of: impl FnOnce(&Mask) -> Mask,
) {
    let Some(project) = &state.project else { return };
    let Some(own) = project.capture.photographs.get(photograph) else { return };
    let Some(image) = &own.image else { return };
    let mask = of(&mask_of(image));
    let mut masks = (*project.edit().masks).clone();
    masks.insert(own.name.clone(), Arc::new(mask));
    put_change(state, name, masks);
}

fn put_change(state: &mut State, name: &'static str, masks: Masks) {
    let change = Change::Masks { name, masks: Arc::new(masks) };
    changing::change_project(state, &change);
}

/// What is left out of a photograph now.
fn mask_of(image: &Image) -> Mask {
    Mask::new((image.width(), image.height()), &image.mask_pixels())
}

/// Suggestions have come: what they leave out is left out beside what was before.
pub fn suggested(state: &mut State, of: &Arc<Capture>, suggestions: &[Suggestion]) {
    let Some(project) = &state.project else { return };
    if !Arc::ptr_eq(&project.opened, of) {
        return;
    }
    let mut masks = (*project.edit().masks).clone();
    let mut shares = Vec::new();
    for suggestion in suggestions {
        let Some(own) = project.capture.photographs.get(suggestion.photograph) else { continue };
        let Some(image) = &own.image else { continue };
        shares.push(suggestion.share());
        if suggestion.share() > 0.0 {
            let shape = Shape::Pixels(suggestion.is_masked.clone());
            masks.insert(own.name.clone(), Arc::new(mask_of(image).with(&shape, true)));
        }
    }
    let mean = shares.iter().sum::<f64>() / shares.len().max(1) as f64;
    let text = if shares.len() < 3 {
        "With fewer than three photographs of a point it is not known which one is right: \
         nothing is masked."
            .to_owned()
    } else if mean == 0.0 {
        "The photographs agree: nothing is masked.".to_owned()
    } else {
        format!(
            "{:.1} % of the photographs are masked by suggestion. Look at them; undo takes them away.",
            100.0 * mean
        )
    };
    put_change(state, "suggest masks", masks);
    state.messages.notice(text);
}

/// Masks that belong to no photograph of the capture, or to one of another size: a sentence each.
pub fn unused(project: &Project, masks: &Masks) -> Vec<String> {
    let fits = |name: &str, mask: &Mask| {
        let photographs = &project.loaded.photographs;
        photographs.iter().filter(|own| own.name == name).any(|own| {
            own.image.as_ref().is_some_and(|own| (own.width(), own.height()) == mask.size())
        })
    };
    let others = masks.iter().filter(|(name, mask)| !fits(name, mask));
    others
        .map(|(name, mask)| {
            let (width, height) = mask.size();
            format!("no photograph \"{name}\" of {width} x {height} pixels is there for its mask")
        })
        .collect()
}
