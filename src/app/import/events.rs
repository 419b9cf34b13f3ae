//! Handles the events of the import page's workers.

use std::sync::Arc;

use super::ImportPage;
use super::acting::{NOT_WRITTEN, written};
use crate::app::state::State;
use crate::worker::{Command, Event, JobEvent};

pub(super) fn drain(state: &mut State) {
    let Some(page) = &mut state.import else { return };
    let events: Vec<Event> = page.reader.events().try_iter().collect();
    for event in page.checker.events().try_iter().collect::<Vec<_>>() {
        page.checker_event(event);
    }
    for event in events {
        reader_event(state, event);
    }
}

fn reader_event(state: &mut State, event: Event) {
    let Some(page) = &mut state.import else { return };
    if !event.what.is_ending() {
        return;
    }
    if page.reading.take_if(|job| *job == event.job).is_some() {
        page.read(event.what);
    } else if page.investigating.take_if(|job| *job == event.job).is_some() {
        page.found = match event.what {
            JobEvent::Investigated(found) => Some(Ok(found)),
            JobEvent::Failed(text) => Some(Err(text)),
            _ => Some(Err("Recovering the response was cancelled.".to_owned())),
        };
    } else if page.writing.take_if(|job| *job == event.job).is_some() {
        match event.what {
            JobEvent::CaptureWritten(folder, what) => written(state, &folder, &what),
            JobEvent::Occupied(folder) => page.replace = Some(folder),
            JobEvent::Failed(text) => state.messages.error(NOT_WRITTEN, text),
            _ => state.messages.notice("Writing was cancelled. Nothing was left half-written."),
        }
    }
}

impl ImportPage {
    fn read(&mut self, ending: JobEvent) {
        match ending {
            JobEvent::Imported(import) => {
                let before = self.import.take();
                self.lose_import();
                self.measuring.follow();
                // Another source: the one that is looked at may be none of it.
                let is_same = before.is_some_and(|before| before.shots.len() == import.shots.len());
                if !is_same {
                    self.shot = 0;
                }
                let command = Command::Survey { import: import.clone() };
                self.surveying = Some(self.checker.send(command));
                self.import = Some(import);
            }
            JobEvent::Failed(text) => {
                self.lose_import();
                self.problem = Some(text);
            }
            _ => {}
        }
    }

    fn checker_event(&mut self, event: Event) {
        if !event.what.is_ending() {
            return;
        }
        if self.surveying.take_if(|job| *job == event.job).is_some() {
            match event.what {
                JobEvent::Surveyed(survey) => self.survey = Some(survey),
                JobEvent::Failed(text) => self.problem = Some(text),
                _ => {}
            }
        } else if self.checking.take_if(|(job, _)| *job == event.job).is_some() {
            match event.what {
                JobEvent::Checked(check) => self.check = Some(Arc::clone(&check)),
                JobEvent::Failed(text) => self.problem = Some(text),
                _ => {}
            }
        }
    }
}
