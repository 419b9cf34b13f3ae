//! Cameras that an engine finds: the installed engines, the run in progress, and its result.

use std::collections::VecDeque;

use eframe::egui;

use crate::io::engines::{Installed, Search};
use crate::watch::Progress;
use crate::worker::{Command, Job, Modelling, Worker};

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
    pub(super) job: Option<Job>,
    pub(super) looking: Option<Job>,
    /// Started with the panel: most never need it.
    pub(super) worker: Option<Worker>,
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

    pub(super) fn send(&mut self, job: Modelling, ctx: &egui::Context) -> std::io::Result<Job> {
        let worker = match &mut self.worker {
            Some(worker) => worker,
            none => {
                let ctx = ctx.clone();
                none.insert(Worker::start(move || ctx.request_repaint())?)
            }
        };
        Ok(worker.send(Command::Model(job)))
    }

    pub(super) fn look(&mut self, ctx: &egui::Context) {
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

    pub(super) fn take_engines(&mut self, engines: Vec<Installed>) {
        let is_there = |own: &&Installed| own.program.is_some();
        if self.search.engine.is_none() {
            let first = engines.iter().find(is_there).or_else(|| engines.first());
            self.search.engine = first.map(|own| own.engine);
        }
        self.engines = Some(engines);
    }
}
