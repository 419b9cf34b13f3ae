//! Cameras that an engine finds: which engines there are, the run under way, and what came of it.

use std::collections::VecDeque;
use std::sync::Arc;

use eframe::egui;

use super::{ModelPage, follow as page_follow};
use crate::app::actions::FindAction;
use crate::app::state::State;
use crate::io::engines::{Installed, Search, Told};
use crate::model::{FoundCameras, Model};
use crate::watch::Progress;
use crate::worker::{Command, Event, Job, JobEvent, Modelling, Worker};

/// Lines of the log that are kept.
const KEPT: usize = 300;

/// The panel.
pub struct Finding {
    pub is_shown: bool,
    /// `None` while they are looked for.
    pub engines: Option<Vec<Installed>>,
    pub search: Search,
    /// What the engine does.
    pub step: String,
    pub log: VecDeque<String>,
    /// What came of the last run, in words.
    pub outcome: Option<Result<String, String>>,
    job: Option<Job>,
    looking: Option<Job>,
    /// Started with the panel: most never need it.
    worker: Option<Worker>,
}

impl Finding {
    pub fn new(search: Search) -> Self {
        Self {
            is_shown: false,
            engines: None,
            search,
            step: String::new(),
            log: VecDeque::new(),
            outcome: None,
            job: None,
            looking: None,
            worker: None,
        }
    }

    pub fn is_running(&self) -> bool {
        self.job.is_some()
    }

    pub fn is_busy(&self) -> bool {
        self.job.is_some() || self.looking.is_some()
    }

    pub fn progress(&self) -> Option<Progress> {
        self.worker.as_ref()?.progress(self.job?)
    }

    /// The engine that is chosen.
    pub fn chosen(&self) -> Option<&Installed> {
        let wanted = self.search.engine?;
        self.engines.as_ref()?.iter().find(|own| own.engine == wanted)
    }

    /// What hinders a run, in words.
    pub fn obstacle(&self, photographs: usize) -> Option<&'static str> {
        if photographs < 2 {
            return Some("It needs two photographs or more.");
        }
        match (&self.engines, self.chosen()) {
            (None, _) => Some("Installed engines are being looked for."),
            (_, Some(own)) if own.program.is_some() => None,
            _ => Some("This engine is not installed."),
        }
    }

    fn send(&mut self, job: Modelling, ctx: &egui::Context) -> std::io::Result<Job> {
        let worker = match &mut self.worker {
            Some(worker) => worker,
            none => {
                let ctx = ctx.clone();
                none.insert(Worker::start(move || ctx.request_repaint())?)
            }
        };
        Ok(worker.send(Command::Model(job)))
    }

    fn look(&mut self, ctx: &egui::Context) {
        if self.looking.is_none() {
            self.engines = None;
            let job = Modelling::Engines(self.search.places.clone());
            match self.send(job, ctx) {
                Ok(job) => self.looking = Some(job),
                Err(error) => {
                    self.outcome = Some(Err(format!("no thread can be started: {error}")))
                }
            }
        }
    }

    fn take_engines(&mut self, engines: Vec<Installed>) {
        let is_there = |own: &&Installed| own.program.is_some();
        if self.search.engine.is_none() {
            let first = engines.iter().find(is_there).or_else(|| engines.first());
            self.search.engine = first.map(|own| own.engine);
        }
        self.engines = Some(engines);
    }
}

/// Does what was asked for.
pub fn apply(state: &mut State, what: FindAction) {
    let ctx = state.ctx.clone();
    let Some(page) = &mut state.modelling else { return };
    let Some(model) = page.model().cloned() else { return };
    let own = &mut page.finding;
    match what {
        FindAction::Show(is_shown) => {
            own.is_shown = is_shown;
            if is_shown && own.engines.is_none() {
                own.look(&ctx);
            }
        }
        FindAction::Look => own.look(&ctx),
        FindAction::Engine(engine) => own.search.engine = Some(engine),
        FindAction::Shared(is_shared) => own.search.is_shared = is_shared,
        FindAction::Start => {
            if own.is_running() || own.obstacle(model.photographs.len()).is_some() {
                return;
            }
            (own.outcome, own.step) = (None, String::new());
            own.log.clear();
            let search = Box::new(own.search.clone());
            let job = Modelling::FindCameras { folder: page.folder.clone(), model, search };
            match own.send(job, &ctx) {
                Ok(job) => own.job = Some(job),
                Err(error) => own.outcome = Some(Err(format!("no thread can be started: {error}"))),
            }
        }
        FindAction::Cancel => {
            if let Some((job, worker)) = own.job.zip(own.worker.as_ref()) {
                worker.cancel(job);
            }
        }
        FindAction::Forget(photograph) => {
            let mut edited = Model::clone(&model);
            edited.drop_found(photograph);
            let name = match photograph {
                Some(_) => "place a photograph by hand",
                None => "forget found cameras",
            };
            change(page, name, edited);
            page_follow::keep(state);
        }
    }
}

fn change(page: &mut ModelPage, name: &str, model: Model) {
    if let Some(document) = &mut page.document {
        document.change(name.to_owned(), Arc::new(model), None);
    }
}

/// Takes what the worker tells.
pub(super) fn follow(state: &mut State) {
    let Some(page) = &mut state.modelling else { return };
    let Some(worker) = &page.finding.worker else { return };
    let events: Vec<Event> = worker.events().try_iter().collect();
    for Event { job, what } in events {
        let Some(page) = &mut state.modelling else { return };
        let own = &mut page.finding;
        match what {
            JobEvent::Told(Told::Step(step)) => own.step = step,
            JobEvent::Told(Told::Line(line)) => {
                own.log.push_back(line);
                if own.log.len() > KEPT {
                    own.log.pop_front();
                }
            }
            JobEvent::Engines(engines) => {
                own.looking = None;
                own.take_engines(engines);
            }
            what if what.is_ending() && own.job == Some(job) => {
                own.job = None;
                match what {
                    JobEvent::CamerasFound(found) => {
                        take(page, &found);
                        page_follow::keep(state);
                    }
                    JobEvent::Failed(text) => own.outcome = Some(Err(text)),
                    _ => own.outcome = Some(Err("Cancelled. Nothing has changed.".to_owned())),
                }
            }
            what if what.is_ending() => {
                own.looking = None;
                own.engines.get_or_insert_default();
            }
            _ => {}
        }
    }
}

/// What was found becomes a step of undo.
fn take(page: &mut ModelPage, found: &FoundCameras) {
    let Some(model) = page.model().cloned() else { return };
    page.finding.outcome = Some(Ok(words(&model, found)));
    let mut edited = Model::clone(&model);
    edited.take_found(found);
    change(page, "find cameras", edited);
}

/// "18 of 20 photographs placed …"
fn words(model: &Model, found: &FoundCameras) -> String {
    let count = model.photographs.len();
    let mut text = format!("{} of {count} photographs placed by {}", found.placed(), found.engine);
    if let Some(off) = found.error_px {
        text += &format!("; its points are off by {off:.2} px");
    }
    let missed = model.photographs.iter().zip(&found.cameras).filter(|own| own.1.is_none());
    let names: Vec<&str> = missed.map(|(own, _)| own.name.trim_start_matches("images/")).collect();
    match &names[..] {
        [] => text += ".",
        [name] => text += &format!(". {name} is not: place it by lines and corners."),
        [names @ .., last] => {
            let names = names.join(", ");
            text += &format!(". {names} and {last} are not: place them by lines and corners.");
        }
    }
    text
}
