//! The list of what can be done by menu, key and palette, each described once.

mod list;

use eframe::egui::{self, Key, KeyboardShortcut};

use super::actions::Action;
use super::dialogs::Asked;
use super::state::State;

pub use list::all;

pub struct Command {
    pub name: &'static str,
    pub help: &'static str,
    pub menu: Menu,
    pub key: Option<KeyboardShortcut>,
    pub action: Action,
    /// A line is drawn above it in the menu.
    pub begins_group: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    File,
    Edit,
    View,
    Run,
    Help,
}

impl Menu {
    pub const ALL: [Self; 5] = [Self::File, Self::Edit, Self::View, Self::Run, Self::Help];

    pub fn name(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Edit => "Edit",
            Self::View => "View",
            Self::Run => "Run",
            Self::Help => "Help",
        }
    }
}

impl Command {
    /// Its name now: undo and redo say what.
    pub fn label(&self, state: &State) -> String {
        let history = state.project.as_ref().map(|project| &project.history);
        let step = match self.action {
            Action::Undo => history.and_then(|history| history.undo_name()),
            Action::Redo => history.and_then(|history| history.redo_name()),
            _ => None,
        };
        step.map_or_else(|| self.name.to_owned(), |step| format!("{} {step}", self.name))
    }

    /// Whether it would do anything now.
    pub fn is_enabled(&self, state: &State) -> bool {
        let project = state.project.as_ref();
        match &self.action {
            Action::OpenExample => state.example.is_some(),
            Action::Save | Action::Ask(Asked::SaveAs) | Action::Close => project.is_some(),
            Action::Ask(Asked::Export) => {
                project.is_some_and(|p| p.products.whole.is_some() && p.run.is_none())
            }
            Action::Undo => project.is_some_and(|p| p.history.undo_name().is_some()),
            Action::Redo => project.is_some_and(|p| p.history.redo_name().is_some()),
            Action::Select(_) | Action::ShowAllSurfaces | Action::NewMaterialOfSelection => {
                project.is_some()
            }
            Action::AskMaterial | Action::HideSelected => {
                project.is_some_and(|p| !p.selection.surfaces.is_empty())
            }
            Action::Run => state.obstacle_to_run().is_none(),
            Action::Cancel => state.is_running(),
            Action::Workspace(_)
            | Action::ResetLayout
            | Action::ShowPane(_)
            | Action::FrameAll
            | Action::FrameSelection => project.is_some(),
            Action::LookThrough(None) => state.viewport.is_looking_through().is_some(),
            _ => true,
        }
    }
}

/// The actions whose keys were pressed. Letters are left to text fields and dialogs.
pub fn pressed(ctx: &egui::Context, state: &State, actions: &mut Vec<Action>) {
    let typing = ctx.text_edit_focused();
    let dialog = state.dialogs.is_open();
    // The viewport flies with letters while the right button is held.
    let flying = ctx.input(|input| input.pointer.secondary_down());
    let mut commands = all();
    // The longer combinations first: Ctrl+Z is also within Ctrl+Shift+Z.
    commands.sort_by_key(|command| {
        std::cmp::Reverse(command.key.map_or(0, |key| u8::from(key.modifiers.shift)))
    });
    for command in commands {
        let Some(key) = command.key else { continue };
        let plain = !key.modifiers.command;
        if plain && (typing || dialog || flying) || dialog && command.action != Action::Quit {
            continue;
        }
        let pressed = ctx.input_mut(|input| {
            if key.logical_key == Key::Questionmark {
                // It is typed with shift on most keyboards, and elsewhere on others.
                input.events.iter().any(|event| matches!(event, egui::Event::Text(t) if t == "?"))
            } else {
                input.consume_shortcut(&key)
            }
        });
        if pressed && command.is_enabled(state) {
            actions.push(command.action);
        } else if pressed && command.action == Action::Run {
            // It says why not.
            actions.push(Action::Run);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_means_two_things() {
        let commands = all();
        for (index, a) in commands.iter().enumerate() {
            for b in &commands[index + 1..] {
                assert!(a.key.is_none() || a.key != b.key, "{} and {}", a.name, b.name);
                assert_ne!(a.name, b.name);
            }
        }
    }
}
