//! The list of what can be done by menu, key and palette, each described once.

mod draw;
mod file;
mod list;
mod photographs;
mod reasons;

use eframe::egui::{self, Key, KeyboardShortcut};

use super::actions::{
    Action, Charting, Lighting, Masking, ModelAction, PathRequest, Relight, Select,
};
use super::keys::{self, named};
use super::masking;
use super::modelling::ModelPage;
use super::modelling::tool::Selected;
use super::state::State;

pub use draw::{from_points, things};
pub use list::all;

pub struct Command {
    pub name: &'static str,
    pub help: &'static str,
    pub menu: Menu,
    pub key: Option<KeyboardShortcut>,
    pub action: Action,
    /// A line is drawn above it in the menu.
    pub begins_group: bool,
    /// The part of the menu that opens beside it and holds this.
    pub within: Option<&'static str>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    File,
    Edit,
    View,
    Draw,
    Run,
    Relight,
    Help,
}

impl Menu {
    pub const ALL: [Self; 7] =
        [Self::File, Self::Edit, Self::View, Self::Draw, Self::Run, Self::Relight, Self::Help];

    pub fn name(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Edit => "Edit",
            Self::View => "View",
            Self::Draw => "Draw",
            Self::Run => "Run",
            Self::Relight => "Relight",
            Self::Help => "Help",
        }
    }
}

impl Command {
    /// Its name now: undo and redo say what.
    pub fn label(&self, state: &State) -> String {
        let history = state.project.as_ref().map(|project| &project.history);
        let page = state.modelling.as_ref().filter(|_| state.is_modelling());
        let step = match self.action {
            Action::Undo if page.is_some() => {
                page.and_then(|page| page.document.as_ref()?.undo_name())
            }
            Action::Redo if page.is_some() => {
                page.and_then(|page| page.document.as_ref()?.redo_name())
            }
            Action::Undo => history.and_then(|history| history.undo_name()),
            Action::Redo => history.and_then(|history| history.redo_name()),
            _ => None,
        };
        step.map_or_else(|| self.name.to_owned(), |step| format!("{} {step}", self.name))
    }

    /// Whether it is of use on the import page, where no project is seen.
    fn is_of_the_window(&self) -> bool {
        match &self.action {
            Action::TraceOn(_)
            | Action::Theme(_)
            | Action::Scale(_)
            | Action::Workspace(_)
            | Action::Cancel => true,
            Action::Model(ModelAction::Show) => true,
            Action::Ask(PathRequest::Export) | Action::ExportScene(_) => false,
            _ => matches!(self.menu, Menu::File | Menu::Help),
        }
    }

    /// Whether it would do anything on the Model page; `None` for what the page does not change.
    fn is_enabled_on(&self, page: &ModelPage) -> Option<bool> {
        let document = page.document.as_ref();
        Some(match &self.action {
            Action::Undo => document.is_some_and(|own| own.undo_name().is_some()),
            Action::Redo => document.is_some_and(|own| own.redo_name().is_some()),
            Action::Save => document.is_some(),
            Action::Close => true,
            Action::FrameAll => document.is_some(),
            Action::Relight(Relight::Remove) => page.selected != Selected::Nothing,
            Action::Relight(Relight::Duplicate) => matches!(page.selected, Selected::Thing(_)),
            Action::Model(ModelAction::Use) => page.obstacle().is_none(),
            Action::Model(_) => document.is_some(),
            // What belongs to panels that are not seen.
            _ if matches!(self.menu, Menu::Edit | Menu::View | Menu::Relight)
                && !self.is_of_the_window() =>
            {
                false
            }
            _ => return None,
        })
    }

    /// Whether it would do anything now.
    pub fn is_enabled(&self, state: &State) -> bool {
        let project = state.project.as_ref();
        let page = state.modelling.as_ref().filter(|_| state.is_modelling());
        if let Some(is_enabled) = page.and_then(|page| self.is_enabled_on(page)) {
            return is_enabled;
        }
        if state.is_importing() && !self.is_of_the_window() {
            return false;
        }
        match &self.action {
            Action::Model(ModelAction::Show) => project.is_some() || state.modelling.is_some(),
            Action::Model(_) => false,
            Action::Close if state.modelling.is_some() => true,
            Action::OpenExample => state.example.is_some(),
            Action::Save | Action::Ask(PathRequest::SaveAs) | Action::Close => project.is_some(),
            Action::Ask(PathRequest::Export) => {
                project.is_some_and(|p| p.products.whole.is_some() && p.run.is_none())
            }
            Action::Lighting(Lighting::AddVisible) => {
                project.is_some_and(|p| !p.selection.surfaces.is_empty())
            }
            Action::Lighting(_)
            | Action::Relight(Relight::AddLight(_))
            | Action::Ask(
                PathRequest::AddDome
                | PathRequest::AddSky
                | PathRequest::AddChartTable
                | PathRequest::AddObject
                | PathRequest::LoadEdits
                | PathRequest::SaveEdits,
            ) => project.is_some(),
            Action::Masking(Masking::Suggest) => project.is_some_and(|p| {
                p.capture.measurements().count() >= 3 && !state.jobs.is_suggesting()
            }),
            Action::Masking(Masking::Clear | Masking::Invert) => masking::shown(state).is_some(),
            Action::Masking(_) | Action::Charting(Charting::Add(_)) => project.is_some(),
            Action::Charting(_) => project.is_some_and(|p| p.selection.chart.is_some()),
            Action::ExportScene(_) => {
                project.is_some_and(|p| p.products.solved.is_some())
                    && !state.jobs.is_exporting_scene()
            }
            Action::Relight(Relight::AskPictures) => {
                project.is_some_and(|p| p.products.solved.is_some()) && !state.jobs.is_rendering()
            }
            Action::Relight(_) => project.is_some_and(|p| p.selection.added.is_some()),
            // What is being moved in the 3D view comes to an end first.
            Action::Undo | Action::Redo if state.viewport.is_moving() => false,
            Action::Undo => {
                project.is_some_and(|p| p.history.undo_name().is_some() || p.gesture().is_some())
            }
            Action::Redo => project.is_some_and(|p| p.history.redo_name().is_some()),
            Action::Select(Select::WorstSample) => {
                project.is_some_and(|p| p.products.derived.is_some())
            }
            Action::Select(Select::StrongestLight) => {
                project.is_some_and(|p| p.products.whole.is_some() && p.selection.sample.is_some())
            }
            Action::Select(_) | Action::ShowAllSurfaces | Action::NewMaterialOfSelection => {
                project.is_some()
            }
            Action::AskMaterial | Action::HideSelected => {
                project.is_some_and(|p| !p.selection.surfaces.is_empty())
            }
            Action::Run | Action::RunAfresh => state.obstacle_to_run().is_none(),
            Action::Cancel if state.is_importing() => {
                state.import.as_ref().is_some_and(|page| page.is_busy())
            }
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

/// What mouse and keys do in the 3D view beside the commands: keys, name, and more about it.
const IN_VIEW: [(&str, &str, &str); 20] = [
    ("Middle drag", "Orbit", "Turn the view about its middle"),
    ("Shift+middle drag", "Pan", "Move the view sideways"),
    ("Wheel", "Zoom to the cursor", "Come closer or go away"),
    ("Click", "Select a surface", "Or the sample, light, photograph or object below the cursor"),
    ("Shift+click", "Add to the selection", "Or take out of it"),
    ("Double click", "Look through a photograph", "The one below the cursor"),
    ("0", "Look through, or leave", "The selected photograph"),
    ("Tab", "Next photograph", "While looking through one; Shift+Tab goes back"),
    ("B", "Box select", "Draw a box around surfaces; Shift adds them"),
    ("L", "Select a plane", "All that is connected in the plane below the cursor; Shift adds it"),
    ("[ and ]", "Smaller, larger brush", "While a mask is painted over a photograph"),
    ("Alt+drag", "Erase a mask", "With a mask's tool; without one it turns the view"),
    ("1, 3, 7", "Front, right, top", "With Ctrl from the other side"),
    ("5", "Parallel projection", "Or perspective again"),
    ("Right drag", "Look around", "With W, A, S, D, E and Q fly; Shift is faster"),
    ("G, R, S", "Move, rotate, scale", "The selected light or object"),
    ("X, Y, Z", "Along an axis", "While moving, rotating or scaling; digits give a number"),
    ("Ctrl", "Snap to surfaces", "While moving"),
    ("Enter", "Keep the movement", "A click does, too"),
    ("Esc", "Give it up", "What was being moved goes back"),
];

/// The same on the Model page.
const ON_PHOTOGRAPH: [(&str, &str, &str); 6] = [
    (
        "W held",
        "Faces or photograph",
        "The model's faces over the photograph, as long as it is held",
    ),
    ("Ctrl held", "Draw as the hand does", "Strokes and corners do not snap"),
    ("Space", "Skip a corner", "One that the photograph does not show"),
    ("Wheel", "Zoom to the cursor", "Plus and minus do, too"),
    ("Middle drag", "Move the photograph", "Alt+drag does, too"),
    ("Esc", "Give it up", "What is being drawn, then the tool"),
];

/// A row of the list of keys.
pub struct Entry {
    pub menu: &'static str,
    pub name: &'static str,
    pub help: &'static str,
    /// Empty where there is none.
    pub key: String,
}

/// All commands, and what mouse and keys do on the Model page and in the 3D view, with the keys of Linux and Windows.
pub fn entries() -> Vec<Entry> {
    let shortcut = |key: &KeyboardShortcut| key.format(&egui::ModifierNames::NAMES, false);
    entries_with(shortcut, str::to_owned)
}

/// The same with the keys of this system.
pub fn entries_here(ctx: &egui::Context) -> Vec<Entry> {
    entries_with(|key| ctx.format_shortcut(key), |key| named(ctx, key))
}

/// One letter has different meanings on the Model page and in the 3D view, so that each group says where it
/// holds.
fn entries_with(
    shortcut: impl Fn(&KeyboardShortcut) -> String,
    by_hand: impl Fn(&str) -> String,
) -> Vec<Entry> {
    let of_menus = all().into_iter().map(|command| Entry {
        menu: match command.menu {
            Menu::Draw => "Draw, on the Model page",
            menu => menu.name(),
        },
        name: command.name,
        help: command.help,
        key: command.key.as_ref().map_or_else(String::new, &shortcut),
    });
    let of_hand = |menu: &'static str| {
        let by_hand = &by_hand;
        move |(key, name, help): (&str, &'static str, &'static str)| Entry {
            menu,
            name,
            help,
            key: by_hand(key),
        }
    };
    let on_photograph = ON_PHOTOGRAPH.into_iter().map(of_hand("On a photograph of the Model page"));
    let in_view = IN_VIEW.into_iter().map(of_hand("In the 3D view"));
    of_menus.chain(on_photograph).chain(in_view).collect()
}

/// The actions whose keys were pressed. Letters are left to text fields and dialogs.
pub fn pressed(ctx: &egui::Context, state: &State, actions: &mut Vec<Action>) {
    let typing = ctx.text_edit_focused();
    let asks = state.import.as_ref().is_some_and(|page| page.is_shown && page.replace.is_some());
    let dialog = state.dialogs.is_open() || asks;
    // The viewport flies with letters while the right button is held.
    let flying = ctx.input(|input| input.pointer.secondary_down());
    // It takes axes and numbers while something is moved there.
    let at_work = state.viewport.is_at_work();
    // Escape first closes menus, leaves the field that was typed in, or gives up a box. egui has
    // taken the focus away already, so what counts is where it was in the frame before.
    let is_drawing = state.modelling.as_ref().is_some_and(|page| page.drag.is_some());
    let is_dragging =
        is_drawing || state.project.as_ref().is_some_and(|project| project.gesture().is_some());
    let escape = !state.was_typing && !egui::Popup::is_any_open(ctx) && !at_work && !is_dragging;
    for command in specific_first() {
        let Some(key) = command.key else { continue };
        let plain = !key.modifiers.command;
        // Letters mean other things on other pages.
        let is_of_page =
            command.menu == Menu::Draw && command.action != Action::Model(ModelAction::Show);
        if plain && is_of_page && !state.is_modelling() {
            continue;
        }
        // A field that has the focus keeps what was typed.
        let is_function = keys::is_function(key.logical_key);
        if plain && (typing && !is_function || dialog || flying || at_work)
            || dialog && command.action != Action::Quit
        {
            continue;
        }
        if typing && is_for_text(&command.action)
            || command.action == Action::Cancel && !(escape && command.is_enabled(state))
        {
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
        // A run that cannot begin says why not.
        let is_run = matches!(command.action, Action::Run | Action::RunAfresh);
        if pressed && (command.is_enabled(state) || is_run) {
            if typing {
                end_typing(ctx);
            }
            actions.push(command.action);
        }
    }
}

/// Takes the focus from a field, which makes its panel tell what was typed in this frame.
pub fn end_typing(ctx: &egui::Context) {
    ctx.memory_mut(|memory| {
        if let Some(field) = memory.focused() {
            memory.surrender_focus(field);
        }
    });
}

/// What these keys do, text fields do to their text: undo, redo, delete a word.
fn is_for_text(action: &Action) -> bool {
    matches!(action, Action::Undo | Action::Redo | Action::Close)
}

/// All commands, the combinations of most keys first: egui finds Ctrl+Z within Ctrl+Shift+Z, too,
/// and A within Alt+A.
fn specific_first() -> Vec<Command> {
    let mut commands = all();
    commands.sort_by_key(|command| {
        let modifiers = command.key.map(|key| key.modifiers).unwrap_or_default();
        std::cmp::Reverse([modifiers.shift, modifiers.alt].into_iter().filter(|held| *held).count())
    });
    commands
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

    #[test]
    fn a_combination_is_asked_for_before_those_within_it() {
        let commands = specific_first();
        for (index, first) in commands.iter().enumerate() {
            for later in &commands[index + 1..] {
                let (Some(a), Some(b)) = (first.key, later.key) else { continue };
                let takes =
                    a.logical_key == b.logical_key && b.modifiers.matches_logically(a.modifiers);
                assert!(!takes, "{} takes the keys of {}", first.name, later.name);
            }
        }
    }
}
