//! The file dialogs of the system, in front of the window that asks.

use std::ffi::OsString;
use std::path::Path;
use std::time::Instant;

use eframe::Frame;
use pollster::block_on;
use rfd::AsyncFileDialog;

use super::actions::{PathRequest, PlotFile};
use super::asking::suggestion;
use super::dialogs::Picking;
use super::pending::Pending;
use super::state::State;
use crate::io::project::EXTENSION;

#[cfg(test)]
mod tests;

/// Whether the system can show file dialogs. On Linux the desktop's portal does, which is reached by the
/// session bus, or else the program zenity. Without both, the answer would be the same as that of Cancel,
/// and on a busy machine too late to be told from it (`asking`).
pub fn exist() -> bool {
    !cfg!(target_os = "linux") || can_be_asked(&|name| std::env::var_os(name))
}

fn can_be_asked(variable: &dyn Fn(&str) -> Option<OsString>) -> bool {
    let bus = variable("DBUS_SESSION_BUS_ADDRESS").is_some_and(|address| !address.is_empty())
        || variable("XDG_RUNTIME_DIR")
            .is_some_and(|folder| Path::new(&folder).join("bus").exists());
    let paths = variable("PATH").unwrap_or_default();
    bus || std::env::split_paths(&paths).any(|folder| folder.join("zenity").is_file())
}

/// Opens the dialog that was asked for in this frame, on a thread of its own.
pub fn open_wanted(state: &mut State, window: &Frame) {
    let Some(asked) = state.dialogs.wanted.take() else { return };
    let start = suggestion(state, asked);
    let mut dialog = AsyncFileDialog::new().set_title(asked.title()).set_parent(window);
    if matches!(asked, PathRequest::OpenProject | PathRequest::SaveAs) {
        dialog = dialog.add_filter("Lobelia project", &[EXTENSION]);
    }
    let (name, kinds): (&str, &[&str]) = match asked {
        PathRequest::AddObject => ("Mesh", &crate::io::mesh::EXTENSIONS),
        PathRequest::AddDome | PathRequest::AddSky => ("Light from all around", &["exr", "hdr"]),
        PathRequest::LoadEdits | PathRequest::SaveEdits => ("Edits", &["json"]),
        PathRequest::AddChartTable => ("Table", &["csv"]),
        PathRequest::ImportMesh => ("Mesh", &crate::io::mesh::EXTENSIONS),
        PathRequest::SavePlot(_, PlotFile::Csv) => ("Table", &["csv"]),
        PathRequest::SavePlot(_, PlotFile::Svg) => ("Drawing", &["svg"]),
        _ => ("", &[]),
    };
    if !kinds.is_empty() {
        dialog = dialog.add_filter(name, kinds);
    }
    if asked.is_new_file()
        && let Some(name) = start.file_name()
    {
        dialog = dialog.set_file_name(name.to_string_lossy());
    }
    let began = Instant::now();
    let wait = move || {
        let folder = start.parent().filter(|folder| folder.is_dir());
        let dialog = match folder {
            Some(folder) => dialog.set_directory(folder),
            None => dialog,
        };
        let picked = match asked {
            PathRequest::NewPhotographs => {
                let files = block_on(dialog.pick_files()).unwrap_or_default();
                let paths = files.iter().map(|file| file.path().to_owned()).collect();
                return (paths, began.elapsed());
            }
            PathRequest::OpenProject
            | PathRequest::AddObject
            | PathRequest::AddDome
            | PathRequest::AddSky
            | PathRequest::AddChartTable
            | PathRequest::LoadEdits
            | PathRequest::Find(_)
            | PathRequest::FindLight(_)
            | PathRequest::ImportCameras
            | PathRequest::ImportMesh => block_on(dialog.pick_file()),
            _ if asked.is_new_file() => block_on(dialog.save_file()),
            _ => block_on(dialog.pick_folder()),
        };
        (picked.iter().map(|file| file.path().to_owned()).collect(), began.elapsed())
    };
    // Without a thread there is no answer, and the window shows a field of its own.
    let answer = Pending::start("file dialog", &state.ctx, wait);
    state.dialogs.picking = Some(Picking { asked, answer, began });
}
