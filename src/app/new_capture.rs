//! The dialog for a new capture: its photographs and its folder.

use std::path::{Path, PathBuf};

use crate::io::import::is_photograph;
use crate::worker::Job;

/// The question, while it is on the screen.
#[derive(Default)]
pub struct NewCapture {
    pub photographs: Vec<PathBuf>,
    pub folder: String,
    /// The folder was chosen and not suggested.
    pub is_chosen: bool,
    pub job: Option<Job>,
    /// Why it cannot be made, in the terminal's words.
    pub problem: Option<String>,
}

impl NewCapture {
    /// What is missing, in words.
    pub fn obstacle(&self) -> Option<&'static str> {
        if self.photographs.is_empty() {
            Some("Add photographs first; one is enough to begin.")
        } else if self.folder.trim().is_empty() {
            Some("Choose the folder for the capture first.")
        } else {
            None
        }
    }

    /// Adds photographs that are not there yet, by what was named: themselves, or their folder.
    pub fn add(&mut self, found: Vec<(PathBuf, Vec<PathBuf>)>) {
        self.problem = None;
        for (path, mut files) in found {
            if files.is_empty() {
                self.problem = Some(format!("{}: there is no photograph in it.", path.display()));
            }
            files.retain(|file| !self.photographs.contains(file));
            self.photographs.extend(files);
        }
        if !self.is_chosen
            && let Some(folder) = self.photographs.first().and_then(|file| file.parent())
        {
            let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
            self.folder = folder.with_file_name(format!("{name}-capture")).display().to_string();
        }
    }
}

/// The photographs that are named, or that are in the folders that are named.
pub fn photographs_of(paths: Vec<PathBuf>) -> Vec<(PathBuf, Vec<PathBuf>)> {
    let look = |path: PathBuf| {
        let files = match path.is_dir() {
            true => photographs_in(&path),
            // Others are refused when the capture is made, with the reason.
            false => vec![path.clone()],
        };
        (path, files)
    };
    paths.into_iter().map(look).collect()
}

fn photographs_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|file| file.is_file() && is_photograph(file))
        .collect();
    files.sort();
    files
}
