//! Changes the open project. Each change is a step of undo, or part of a drag that becomes one
//! step.

use super::actions::Select;
use super::change::Change;
use super::project::Project;
use super::selecting::select;
use super::state::State;

/// A change that a panel proposes: a step of its own, or part of what the hand is doing.
pub fn follow_hand(state: &mut State, change: &Change) {
    let gesture = state.hand.gesture().filter(|_| change.is_of_value_of(change));
    let (Some(gesture), Some(project)) = (gesture, &mut state.project) else {
        return change_project(state, change);
    };
    if let Err(problem) = project.preview(change, gesture) {
        state.messages.notice(problem);
    }
}

/// A step of its own; what is new is selected.
pub fn change_project(state: &mut State, change: &Change) {
    let Some(project) = &mut state.project else { return };
    match project.change(change) {
        Ok(()) => {
            let materials = &project.edit().materials;
            let shown = match change {
                Change::NewMaterial { .. } => Some(materials.len() - 1),
                Change::Merge { from, into } => Some(into - usize::from(into > from)),
                _ => None,
            };
            if let Some(material) = shown {
                select(project, Select::Material(material));
            }
        }
        Err(problem) => state.messages.notice(problem),
    }
}

/// Takes a step back or forth, and says which.
pub fn tell(state: &mut State, word: &str, step: impl FnOnce(&mut Project) -> Option<String>) {
    if let Some(name) = state.project.as_mut().and_then(step) {
        state.messages.notice(format!("{word}: {name}"));
    }
}
