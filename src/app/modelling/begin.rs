//! New from photographs: which of them, and the folder for the capture that is made of them.

use std::path::{Path, PathBuf};

use crate::app::leaving::{AfterPrompt, leave};
use crate::app::state::State;
use crate::io::import::is_photograph;
use crate::worker::Job;

/// What can be done about it.
#[derive(Clone, Debug, PartialEq)]
pub enum NewAction {
    /// Asks for photographs and a folder.
    Show,
    /// Adds photographs, or those of a folder.
    Add(Vec<PathBuf>),
    Remove(usize),
    /// The folder for the capture.
    Folder(PathBuf),
    Create,
    /// Opens the Model page of a capture that is there.
    Model(PathBuf),
    /// Stops the copying, or leaves the question.
    Leave,
}

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

    /// Adds photographs that are not there yet, by name; a folder's are those in it.
    fn add(&mut self, paths: &[PathBuf]) {
        self.problem = None;
        for path in paths {
            let mut files = match path.is_dir() {
                true => photographs_in(path),
                // Others are refused when the capture is made, with the reason.
                false => vec![path.clone()],
            };
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

fn photographs_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|file| file.is_file() && is_photograph(file))
        .collect();
    files.sort();
    files
}

/// Does what was asked for.
pub fn apply(state: &mut State, what: NewAction) {
    let begin = &mut state.dialogs.begin;
    match what {
        NewAction::Show => drop(begin.get_or_insert_default()),
        NewAction::Add(paths) => begin.get_or_insert_default().add(&paths),
        NewAction::Remove(index) => {
            if let Some(own) = begin.as_mut().filter(|own| index < own.photographs.len()) {
                own.photographs.remove(index);
            }
        }
        NewAction::Folder(folder) => {
            let own = begin.get_or_insert_default();
            own.folder = folder.display().to_string();
            own.is_chosen = true;
        }
        NewAction::Create => {
            if let Some(own) = begin.as_mut().filter(|own| own.obstacle().is_none()) {
                own.problem = None;
                let folder = PathBuf::from(own.folder.trim());
                own.job = Some(state.jobs.begin(folder, own.photographs.clone()));
            }
        }
        NewAction::Model(folder) => leave(state, AfterPrompt::Model(folder)),
        NewAction::Leave => match begin {
            Some(NewCapture { job: Some(job), .. }) => state.jobs.stop_beginning(*job),
            _ => *begin = None,
        },
    }
}

/// The capture stands, or cannot be made.
pub fn ended(state: &mut State, made: Result<PathBuf, String>) {
    match made {
        Ok(folder) => {
            state.dialogs.begin = None;
            state.messages.notice(format!("Capture written to {}", folder.display()));
            leave(state, AfterPrompt::Model(folder));
        }
        Err(problem) => {
            if let Some(own) = &mut state.dialogs.begin {
                own.job = None;
                own.problem = Some(problem);
            }
        }
    }
}
