//! The list itself.

use eframe::egui::{Key, KeyboardShortcut, Modifiers};

use super::{Command, Menu, draw, file, photographs};
use crate::app::actions::{Action, Lighting, PathRequest, Select};
use crate::app::panes::Pane;
use crate::app::relight::NewLight;
use crate::app::workspaces::Workspace;
use crate::render::Engine;

pub(super) const COMMAND: Modifiers = Modifiers::COMMAND;
const NONE: Modifiers = Modifiers::NONE;

/// All commands, in the order of the menus.
pub fn all() -> Vec<Command> {
    let mut list = Vec::new();
    file::file(&mut list);
    edit(&mut list);
    view(&mut list);
    draw::draw(&mut list);
    run(&mut list);
    relight(&mut list);
    help(&mut list);
    list
}

fn edit(list: &mut Vec<Command>) {
    use Menu::Edit;
    add(list, Edit, "Undo", key(COMMAND, Key::Z), Action::Undo, "Take the latest change back");
    add(
        list,
        Edit,
        "Redo",
        key(COMMAND | Modifiers::SHIFT, Key::Z),
        Action::Redo,
        "Make the latest undone change again",
    );
    group(
        list,
        Edit,
        "Select all surfaces",
        key(NONE, Key::A),
        Action::Select(Select::AllSurfaces),
        "Select every surface that is not hidden",
    );
    add(
        list,
        Edit,
        "Select nothing",
        key(Modifiers::ALT, Key::A),
        Action::Select(Select::Nothing),
        "Clear every selection",
    );
    add(
        list,
        Edit,
        "Hide selected surfaces",
        key(NONE, Key::H),
        Action::HideSelected,
        "Leave the selected surfaces out of the 3D view",
    );
    add(
        list,
        Edit,
        "Show all surfaces",
        key(Modifiers::ALT, Key::H),
        Action::ShowAllSurfaces,
        "Bring hidden surfaces back",
    );
    group(
        list,
        Edit,
        "Select worst sample",
        None,
        Action::Select(Select::WorstSample),
        "The sample that the results are furthest from, by ratio",
    );
    add(
        list,
        Edit,
        "Select strongest light",
        None,
        Action::Select(Select::StrongestLight),
        "The virtual light that gives the selected sample most",
    );
    group(
        list,
        Edit,
        "Assign material…",
        key(NONE, Key::M),
        Action::AskMaterial,
        "Choose the material of the selected surfaces",
    );
    add(
        list,
        Edit,
        "New material",
        key(NONE, Key::N),
        Action::NewMaterialOfSelection,
        "Make a material of the selected surfaces",
    );
    known_light(list);
    photographs::masks(list);
    photographs::charts(list);
}

fn known_light(list: &mut Vec<Command>) {
    use Menu::Edit;
    let from = list.len();
    for kind in NewLight::ALL {
        let name = match kind {
            NewLight::Area => "Known area light",
            NewLight::Sphere => "Known sphere light",
            NewLight::Point => "Known point light",
            NewLight::Spot => "Known spot light",
            NewLight::Sun => "Known sun",
        };
        add(list, Edit, name, None, Action::Lighting(Lighting::Add(kind)), kind.help());
    }
    add(
        list,
        Edit,
        "Known sky…",
        None,
        Action::Ask(PathRequest::AddSky),
        "A sky that was photographed, in latitude and longitude (EXR, HDR)",
    );
    add(
        list,
        Edit,
        "Selected surfaces shine",
        None,
        Action::Lighting(Lighting::AddVisible),
        "Make a visible light of the selected surfaces",
    );
    put_within(list, from, "Add known light");
}

fn view(list: &mut Vec<Command>) {
    use Menu::View;
    for workspace in Workspace::ALL {
        let (name, digit) = workspace.command();
        add(list, View, name, key(NONE, digit), Action::Workspace(workspace), workspace.help());
    }
    add(
        list,
        View,
        "Reset layout",
        None,
        Action::ResetLayout,
        "Put the panels of this workspace back in their places",
    );
    let panels = list.len();
    for pane in Pane::ALL {
        let (name, help) = pane.command();
        add(list, View, name, None, Action::ShowPane(pane), help);
    }
    put_within(list, panels, "Panels");
    group(
        list,
        View,
        "Frame all",
        key(NONE, Key::Home),
        Action::FrameAll,
        "Show the whole geometry",
    );
    add(
        list,
        View,
        "Frame selection",
        key(NONE, Key::F),
        Action::FrameSelection,
        "Show what is selected",
    );
    add(
        list,
        View,
        "Leave photograph",
        None,
        Action::LookThrough(None),
        "Stop looking through a photograph",
    );
    group(list, View, "Dark theme", None, Action::Theme("dark"), "Dark neutral greys");
    add(list, View, "Light theme", None, Action::Theme("light"), "Light neutral greys");
    add(list, View, "System theme", None, Action::Theme("system"), "As the desktop is set");
    let engines = list.len();
    add(
        list,
        View,
        "Trace on a graphics card if there is one",
        None,
        Action::TraceOn(Engine::Auto),
        "Trace the paths of pictures on a graphics card, and on the processor where there is none",
    );
    add(
        list,
        View,
        "Trace on the processor",
        None,
        Action::TraceOn(Engine::Processor),
        "Trace the paths of pictures on the processor: slower, and the same to the byte each time",
    );
    put_within(list, engines, "Tracing of pictures");
    let scales = list.len();
    add(list, View, "Scale 75 %", None, Action::Scale(0.75), "Smaller text and controls");
    add(list, View, "Scale 100 %", None, Action::Scale(1.0), "The desktop's own scale");
    add(list, View, "Scale 125 %", None, Action::Scale(1.25), "Larger text and controls");
    add(list, View, "Scale 150 %", None, Action::Scale(1.5), "Larger text and controls");
    add(list, View, "Scale 200 %", None, Action::Scale(2.0), "Twice as large");
    put_within(list, scales, "Size of text and controls");
}

fn run(list: &mut Vec<Command>) {
    use Menu::Run;
    add(
        list,
        Run,
        "Run reconstruction",
        key(COMMAND, Key::R),
        Action::Run,
        "Recover reflectances and light with the present tags and options; stages that neither \
         changed are kept",
    );
    add(
        list,
        Run,
        "Run all stages afresh",
        key(COMMAND | Modifiers::SHIFT, Key::R),
        Action::RunAfresh,
        "Do every stage anew, also those that an earlier run has done with the same tags and options",
    );
    add(
        list,
        Run,
        "Cancel",
        key(NONE, Key::Escape),
        Action::Cancel,
        "Stop the run; the results before it come back",
    );
}

fn relight(list: &mut Vec<Command>) {
    use crate::app::actions::Relight as Do;
    use Menu::Relight;
    for kind in NewLight::ALL {
        let name = match kind {
            NewLight::Area => "Add area light",
            NewLight::Sphere => "Add sphere light",
            NewLight::Point => "Add point light",
            NewLight::Spot => "Add spot light",
            NewLight::Sun => "Add sun",
        };
        add(list, Relight, name, None, Action::Relight(Do::AddLight(kind)), kind.help());
    }
    add(
        list,
        Relight,
        "Add dome…",
        None,
        Action::Ask(PathRequest::AddDome),
        "Light from all around, from an image in latitude and longitude (EXR, HDR)",
    );
    group(
        list,
        Relight,
        "Add object…",
        None,
        Action::Ask(PathRequest::AddObject),
        "Set a mesh (OBJ, glTF, PLY, STL) into the scene",
    );
    group(
        list,
        Relight,
        "Duplicate",
        key(Modifiers::SHIFT, Key::D),
        Action::Relight(Do::Duplicate),
        "Make a twin of the selected light or object",
    );
    add(
        list,
        Relight,
        "Remove",
        key(NONE, Key::Delete),
        Action::Relight(Do::Remove),
        "Take the selected light or object away",
    );
    add(
        list,
        Relight,
        "Drop to surface",
        key(NONE, Key::End),
        Action::Relight(Do::Drop),
        "Put the selected light or object on the surface below it",
    );
    group(
        list,
        Relight,
        "Load edits…",
        None,
        Action::Ask(PathRequest::LoadEdits),
        "Add the lights, objects and materials of an edits.json",
    );
    add(
        list,
        Relight,
        "Save edits…",
        None,
        Action::Ask(PathRequest::SaveEdits),
        "Write them as an edits.json, for lobelia render",
    );
    add(
        list,
        Relight,
        "Render to files…",
        key(NONE, Key::F12),
        Action::Relight(Do::AskPictures),
        "Make pictures of the view or from the places of all photographs, and set the edits into these",
    );
}

fn help(list: &mut Vec<Command>) {
    use Menu::Help;
    add(
        list,
        Help,
        "Guide",
        None,
        Action::ShowGuide,
        "Tutorial, how to do things, reference, and how far to trust the results",
    );
    add(
        list,
        Help,
        "Command palette…",
        key(COMMAND, Key::P),
        Action::ShowPalette,
        "Search everything that can be done",
    );
    add(
        list,
        Help,
        "Keyboard shortcuts",
        key(NONE, Key::Questionmark),
        Action::ShowShortcuts,
        "All keys",
    );
    add(
        list,
        Help,
        "Report a problem…",
        None,
        Action::ShowReport,
        "Version, graphics adapter, options and log, to be copied into a report; never photographs",
    );
    add(list, Help, "About", None, Action::ShowAbout, "Version and method");
}

/// Moves the newest commands, from an index on, into a menu within the menu.
pub(super) fn put_within(list: &mut [Command], from: usize, name: &'static str) {
    list[from..].iter_mut().for_each(|command| command.within = Some(name));
}

pub(super) fn key(modifiers: Modifiers, key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(modifiers, key))
}

pub(super) fn add(
    list: &mut Vec<Command>,
    menu: Menu,
    name: &'static str,
    key: Option<KeyboardShortcut>,
    action: Action,
    help: &'static str,
) {
    list.push(Command { name, help, menu, key, action, begins_group: false, within: None });
}

pub(super) fn group(
    list: &mut Vec<Command>,
    menu: Menu,
    name: &'static str,
    key: Option<KeyboardShortcut>,
    action: Action,
    help: &'static str,
) {
    list.push(Command { name, help, menu, key, action, begins_group: true, within: None });
}
