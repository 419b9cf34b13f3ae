//! The reasons why a command cannot be used at present; its menu entry shows them.

use super::{Command, Menu};
use crate::app::actions::{Action, Lighting, Masking, ModelAction, PathRequest, Relight, Select};
use crate::app::state::State;

const NO_RESULTS: &str = "There are no results yet: run first (Ctrl+R).";
const NOTHING_SELECTED: &str = "Select surfaces first: click them in the 3D view or the outliner.";
const NOTHING_ADDED: &str = "Select an added light or object first.";

impl Command {
    /// What hinders it; only of use where it is not enabled.
    pub fn obstacle(&self, state: &State) -> &'static str {
        if state.is_importing() && !self.is_of_the_window() {
            return "This belongs to an open capture: close the import page first.";
        }
        match &self.action {
            Action::Undo if state.viewport.is_moving() => "End the movement first (Enter or Esc).",
            Action::Redo if state.viewport.is_moving() => "End the movement first (Enter or Esc).",
            Action::Undo => "Nothing was changed yet.",
            Action::Redo => "Nothing was undone.",
            Action::OpenExample => "The example is not installed beside the program.",
            Action::Cancel => "Nothing runs.",
            _ if state.is_modelling() => self.obstacle_to_model(state),
            Action::Model(ModelAction::Show) => "Open a capture first.",
            Action::Model(_) => "This belongs to the Model page: show it first (F7).",
            Action::Run | Action::RunAfresh => state.obstacle_to_run().unwrap_or_default(),
            _ if state.project.is_none() => "Open a capture first.",
            Action::Ask(PathRequest::Export) if state.is_running() => "The run is not done yet.",
            Action::Ask(PathRequest::Export) => NO_RESULTS,
            Action::ExportScene(_) if state.jobs.is_exporting_scene() => {
                "A scene is being exported already."
            }
            Action::Relight(Relight::AskPictures) if state.jobs.is_rendering() => {
                "Pictures are being rendered already."
            }
            Action::ExportScene(_) | Action::Relight(Relight::AskPictures) => NO_RESULTS,
            Action::Lighting(Lighting::AddVisible) | Action::AskMaterial | Action::HideSelected => {
                NOTHING_SELECTED
            }
            Action::Masking(Masking::Suggest) if state.jobs.is_suggesting() => {
                "Masks are being suggested already."
            }
            Action::Masking(Masking::Suggest) => {
                "Masks are suggested where photographs disagree: three that measure radiance or more \
                 are needed."
            }
            Action::Charting(_) => "Add a chart, or select one in the Charts panel, first.",
            Action::Masking(_) => "Look through a photograph first (0).",
            Action::Relight(_) => NOTHING_ADDED,
            Action::Select(Select::StrongestLight) => {
                "Select a sample first, after a run: the light that is strongest there is found."
            }
            Action::Select(_) => NO_RESULTS,
            Action::LookThrough(None) => "No photograph is looked through.",
            _ => "This does nothing now.",
        }
    }

    /// The same on the Model page.
    fn obstacle_to_model(&self, state: &State) -> &'static str {
        let page = state.modelling.as_ref();
        match &self.action {
            _ if page.is_none_or(|page| page.document.is_none()) => "The model is not read yet.",
            Action::Model(ModelAction::Use) => {
                "The model cannot be used yet: the button Use this model says why."
            }
            Action::Relight(Relight::Duplicate) => "Select a thing first.",
            Action::Relight(Relight::Remove) => "Select a thing, a point or a stroke first.",
            _ if matches!(self.menu, Menu::Edit | Menu::View | Menu::Relight) => {
                "This belongs to the 3D view: leave the Model page first."
            }
            _ => "Open a capture first.",
        }
    }
}
