//! Carries out the actions that make a new capture from photographs.

use std::path::PathBuf;

use crate::app::actions::{Action, NewAction, Outcome};
use crate::app::errands;
use crate::app::leaving::leave;
use crate::app::new_capture::{NewCapture, photographs_of};
use crate::app::opening::AfterPrompt;
use crate::app::state::State;

/// Does what was asked for.
pub fn apply(state: &mut State, what: NewAction) {
    let begin = &mut state.dialogs.begin;
    match what {
        NewAction::Show => drop(begin.get_or_insert_default()),
        NewAction::Add(paths) => {
            begin.get_or_insert_default();
            let look = move || Outcome::Do(Action::New(NewAction::Found(photographs_of(paths))));
            errands::start(state, move || vec![look()]);
        }
        NewAction::Found(found) => {
            // Nothing, where the question was left meanwhile.
            if let Some(own) = begin {
                own.add(found);
            }
        }
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
