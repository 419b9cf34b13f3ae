//! Sends commands to the import page's workers when its settings have changed, after a short pause.

use std::time::{Duration, Instant};

use super::{ImportPage, Question, Request, events};
use crate::app::actions::Field;
use crate::app::state::State;
use crate::io::import;
use crate::worker::Command;

/// How long a choice rests before work is begun for it.
const REST: Duration = Duration::from_millis(250);
/// How often progress is looked at while something runs.
const PULSE: Duration = Duration::from_millis(100);

/// Takes what the workers have found, and asks for what is wanted now.
pub fn follow(state: &mut State) {
    events::drain(state);
    let ctx = state.ctx.clone();
    let Some(page) = &mut state.import else { return };
    if page.is_busy() || page.is_checking() {
        ctx.request_repaint_after(PULSE);
    }
    if page.is_writing() {
        return;
    }
    let rests = [page.read_what_is_chosen(), page.ask_about_series()];
    if let Some(rest) = rests.into_iter().flatten().min() {
        ctx.request_repaint_after(rest);
    }
    page.check_what_is_shown();
}

impl ImportPage {
    /// Reads anew where the choices are others; the time until that, where they have not rested.
    fn read_what_is_chosen(&mut self) -> Option<Duration> {
        let source = self.path(Field::Cameras).or(self.path(Field::Mesh));
        let Some(source) = source else {
            self.forget();
            self.request = None;
            return None;
        };
        let own_mesh = self.path(Field::Mesh).filter(|mesh| *mesh != source);
        let times = self.chosen_times.trim();
        let wanted = Request {
            source,
            options: import::Options {
                images: self.path(Field::Images).into_iter().collect(),
                mesh: own_mesh,
                times: (!times.is_empty()).then(|| times.to_owned()),
                ..self.options.clone()
            },
        };
        if self.request.as_ref() == Some(&wanted) {
            self.waiting = None;
            return None;
        }
        if self.waiting.as_ref().is_none_or(|(waiting, _)| *waiting != wanted) {
            self.waiting = Some((wanted, Instant::now()));
        }
        let (wanted, since) = self.waiting.as_ref()?;
        // The first reading need not wait.
        if self.request.is_some() && since.elapsed() < REST {
            return Some(REST - since.elapsed());
        }
        let Request { source, options } = wanted.clone();
        if let Some(job) = self.reading.take() {
            self.reader.cancel(job);
        }
        let options = Box::new(options);
        self.reading = Some(self.reader.send(Command::Import { source, options }));
        self.problem = None;
        self.request = self.waiting.take().map(|(wanted, _)| wanted);
        None
    }

    /// Recovers the response of the series that are to be merged.
    fn ask_about_series(&mut self) -> Option<Duration> {
        let series: Vec<_> = match (&self.import, self.merge) {
            (Some(import), true) => import.series.iter().map(|view| view.series.clone()).collect(),
            _ => Vec::new(),
        };
        if series.is_empty() {
            self.stop_asking();
            self.found = None;
            return None;
        }
        let wanted = Question { series, options: self.merging.clone() };
        if self.question.as_ref() == Some(&wanted) {
            self.asking = None;
            return None;
        }
        if self.asking.as_ref().is_none_or(|(asking, _)| *asking != wanted) {
            self.asking = Some((wanted, Instant::now()));
        }
        let (wanted, since) = self.asking.as_ref()?;
        if self.reading.is_some() {
            return None;
        }
        if self.question.is_some() && since.elapsed() < REST {
            return Some(REST - since.elapsed());
        }
        let Question { series, options } = wanted.clone();
        let asked = self.asking.take().map(|(wanted, _)| wanted);
        self.stop_asking();
        let options = Box::new(options);
        self.investigating = Some(self.reader.send(Command::Investigate { series, options }));
        self.question = asked;
        None
    }

    fn stop_asking(&mut self) {
        if let Some(job) = self.investigating.take() {
            self.reader.cancel(job);
        }
        self.question = None;
        self.asking = None;
    }

    /// Holds the photograph that is looked at against its camera.
    fn check_what_is_shown(&mut self) {
        let Some(survey) = self.survey.clone() else { return };
        let count = survey.import.shots.len();
        self.shot = self.shot.min(count.saturating_sub(1));
        let is_there = self.check.as_ref().is_some_and(|check| check.shot == self.shot);
        let is_coming = self.checking.is_some_and(|(_, shot)| shot == self.shot);
        if count == 0 || is_there && self.checking.is_none() || is_coming {
            return;
        }
        if let Some((job, _)) = self.checking.take() {
            self.checker.cancel(job);
        }
        let shot = self.shot;
        self.checking = Some((self.checker.send(Command::CheckShot { survey, shot }), shot));
    }

    /// Nothing is chosen any more.
    fn forget(&mut self) {
        if let Some(job) = self.reading.take() {
            self.reader.cancel(job);
        }
        self.waiting = None;
        self.problem = None;
        self.lose_import();
    }

    /// What was found of an import goes with it.
    pub(super) fn lose_import(&mut self) {
        let jobs = [self.surveying.take(), self.checking.take().map(|(job, _)| job)];
        for job in jobs.into_iter().flatten() {
            self.checker.cancel(job);
        }
        self.import = None;
        self.survey = None;
        self.check = None;
        self.texture = None;
    }
}
