//! The commands of the file menu.

use eframe::egui::{Key, Modifiers};

use super::list::{COMMAND, add, group, key};
use super::{Command, Menu};
use crate::app::actions::{Action, ExportAction, ImportAction, NewAction, PathRequest};

/// Adds them to a list.
pub(super) fn file(list: &mut Vec<Command>) {
    use Menu::File;
    let shift = COMMAND | Modifiers::SHIFT;
    add(
        list,
        File,
        "Open capture…",
        key(COMMAND, Key::O),
        Action::Ask(PathRequest::OpenCapture),
        "Open a folder with scene.obj, transforms.json and photographs",
    );
    add(
        list,
        File,
        "Open project…",
        key(shift, Key::O),
        Action::Ask(PathRequest::OpenProject),
        "Open a .lobelia file with tags and options",
    );
    add(
        list,
        File,
        "Open example",
        None,
        Action::OpenExample,
        "Open the shipped example: the corner of a room with three boxes",
    );
    add(
        list,
        File,
        "New from photographs…",
        key(COMMAND, Key::N),
        Action::New(NewAction::Show),
        "Make a capture of photographs alone: cameras and geometry come from what is drawn on them",
    );
    add(
        list,
        File,
        "Import…",
        key(COMMAND, Key::I),
        Action::Import(ImportAction::Show(None)),
        "Make a capture of cameras, a mesh and photographs of other programs, or of exposure series",
    );
    group(
        list,
        File,
        "Save",
        key(COMMAND, Key::S),
        Action::Save,
        "Save tags, options and arrangement to the project file",
    );
    add(
        list,
        File,
        "Save as…",
        key(shift, Key::S),
        Action::Ask(PathRequest::SaveAs),
        "Save to another project file",
    );
    group(
        list,
        File,
        "Export results…",
        key(COMMAND, Key::E),
        Action::Ask(PathRequest::Export),
        "Write solution, lights, samples, convergence and textures into a folder, as the terminal does",
    );
    add(
        list,
        File,
        "Export scene…",
        key(shift, Key::E),
        Action::ExportScene(ExportAction::Show),
        "Write the relit scene for other programs: glTF, Blender, OBJ, Mitsuba 3, light probe, PLY and CSV",
    );
    group(
        list,
        File,
        "Close project",
        key(COMMAND, Key::W),
        Action::Close,
        "Go back to the start page",
    );
    add(list, File, "Quit", key(COMMAND, Key::Q), Action::Quit, "Close the window");
}
