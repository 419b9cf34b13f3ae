//! The studies of the open project, of speed and of stability. They have a worker of their own;
//! finished runs stay when a study is stopped.

mod progress;
pub mod events;
mod request;

use std::sync::Arc;

use crate::app::edit::Edit;
use crate::app::project::Project;
use crate::io::truth::Truth;
use crate::study::degradation::Degradation;
use crate::study::settings::SETTINGS;
use crate::study::speed::{self, OWN, Place};
use crate::study::stability::{self, Variant};
use crate::study::{Findings, Row, Study, Subject};
use crate::worker::{Command, Job, Worker};

pub use progress::{Estimate, StudyProgress};
pub use request::{SpeedRequest, StabilityRequest};

/// Whether a `truth.json` lies beside the capture.
#[derive(Clone, Debug, Default)]
pub enum TruthStatus {
    #[default]
    NotAsked,
    Asked(Job),
    Nothing,
    Truth(Arc<Truth>),
    /// The file cannot be read.
    Broken,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Speed,
    Stability,
}

/// What the studies of the open project are and have found.
pub struct Studies {
    study_worker: Worker,
    pub known: TruthStatus,
    pub speed: Option<SpeedStudy>,
    pub stability: Option<StabilityStudy>,
    /// What is being written, and how many runs that are.
    saving: Option<(Job, Kind, usize)>,
}

pub struct SpeedStudy {
    design: speed::Design,
    pub rows: Vec<speed::Row>,
    /// What each row depends on, to know it again.
    keys: Vec<String>,
    pub places: Vec<Place>,
    pub progress: StudyProgress,
}

pub struct StabilityStudy {
    design: stability::Design,
    pub rows: Vec<stability::Row>,
    keys: Vec<String>,
    pub curves: Vec<(Degradation, Variant, stability::DegradationCurve)>,
    pub progress: StudyProgress,
}

impl TruthStatus {
    pub fn truth(&self) -> Option<&Arc<Truth>> {
        match self {
            Self::Truth(truth) => Some(truth),
            _ => None,
        }
    }

    fn job(&self) -> Option<Job> {
        match self {
            Self::Asked(job) => Some(*job),
            _ => None,
        }
    }
}

impl Studies {
    pub fn new(study_worker: Worker) -> Self {
        Self {
            study_worker,
            known: TruthStatus::default(),
            speed: None,
            stability: None,
            saving: None,
        }
    }

    /// Another project is shown, or none.
    pub fn forget(&mut self) {
        for progress in [self.progress(Kind::Speed), self.progress(Kind::Stability)] {
            if let Some(job) = progress.and_then(|progress| progress.job) {
                self.study_worker.cancel(job);
            }
        }
        (self.known, self.speed, self.stability) = (TruthStatus::default(), None, None);
    }

    pub fn progress(&self, kind: Kind) -> Option<&StudyProgress> {
        match kind {
            Kind::Speed => self.speed.as_ref().map(|study| &study.progress),
            Kind::Stability => self.stability.as_ref().map(|study| &study.progress),
        }
    }

    fn progress_mut(&mut self, kind: Kind) -> Option<&mut StudyProgress> {
        match kind {
            Kind::Speed => self.speed.as_mut().map(|study| &mut study.progress),
            Kind::Stability => self.stability.as_mut().map(|study| &mut study.progress),
        }
    }

    /// The study that runs.
    pub fn running(&self) -> Option<(Kind, &StudyProgress)> {
        let all = [Kind::Speed, Kind::Stability];
        let with = all.into_iter().filter_map(|kind| Some((kind, self.progress(kind)?)));
        with.into_iter().find(|(_, progress)| progress.is_running())
    }

    pub fn is_busy(&self) -> bool {
        self.running().is_some() || self.saving.is_some() || self.known.job().is_some()
    }

    /// Runs of studies that would be lost with the project.
    pub fn at_stake(&self) -> usize {
        let all = [Kind::Speed, Kind::Stability];
        all.into_iter().filter_map(|kind| self.progress(kind)).map(StudyProgress::at_stake).sum()
    }

    /// Why no study can begin now.
    pub fn obstacle(&self, project: &Project, kind: Kind) -> Option<&'static str> {
        match self.running() {
            Some((other, _)) if other != kind => Some("The other study is running."),
            _ if matches!(self.known, TruthStatus::NotAsked | TruthStatus::Asked(_)) => {
                Some("The capture's folder is being looked at.")
            }
            _ => project.obstacle(),
        }
    }

    pub fn look_for_truth(&mut self, project: &Project) {
        let folder = project.folder.clone();
        self.known = TruthStatus::Asked(self.study_worker.send(Command::ReadTruth { folder }));
    }

    /// Begins a study, or goes on with what is not done of it. What was measured before stays.
    pub fn begin_speed(&mut self, project: &Project, request: &SpeedRequest) -> Result<(), String> {
        let (design, runs) =
            (request.design(project, &self.known), request.runs(project, &self.known)?);
        let old = self.speed.take().filter(|old| !old.is_outdated(project));
        let saved = old.as_ref().map_or(0, |old| old.progress.saved);
        let kept = old.into_iter().flat_map(|old| old.rows.into_iter().zip(old.keys));
        // Other options of the artist are another setting.
        let is_same = |(row, key): &(speed::Row, String)| {
            row.setting != OWN || runs.iter().any(|run| run.key == *key)
        };
        let (rows, keys): (Vec<_>, Vec<_>) = kept.filter(is_same).unzip();
        let mut progress = StudyProgress::new(project.edit().clone(), runs, &keys, saved);
        progress.cheapest_first();
        let places = speed::places(&rows.iter().collect::<Vec<_>>());
        self.speed = Some(SpeedStudy { design, rows, keys, places, progress });
        self.go_on(Kind::Speed);
        Ok(())
    }

    /// As [`Studies::begin_speed`].
    pub fn begin_stability(&mut self, project: &Project, request: &StabilityRequest) {
        let (design, runs) =
            (request.design(project, &self.known), request.runs(project, &self.known));
        let is_same =
            |old: &StabilityStudy| !old.is_outdated(project) && old.design.base == design.base;
        let old = self.stability.take().filter(is_same);
        let saved = old.as_ref().map_or(0, |old| old.progress.saved);
        let (rows, keys) = old.map(|old| (old.rows, old.keys)).unwrap_or_default();
        let progress = StudyProgress::new(project.edit().clone(), runs, &keys, saved);
        let curves = stability::curves(&rows);
        self.stability = Some(StabilityStudy { design, rows, keys, curves, progress });
        self.go_on(Kind::Stability);
    }

    /// Begins what is not done yet of a study.
    fn go_on(&mut self, kind: Kind) {
        let subject = match kind {
            Kind::Speed => self.speed.as_ref().map(|own| Subject::Speed(own.design.clone())),
            Kind::Stability => {
                self.stability.as_ref().map(|own| Subject::Stability(own.design.clone()))
            }
        };
        let (Some(subject), Some(progress)) = (subject, self.progress(kind)) else { return };
        let only = progress.left();
        if only.is_empty() {
            return;
        }
        let study = Study { subject, folder: None, only, collect: false };
        let job = self.study_worker.send(Command::Study(Box::new(study)));
        if let Some(progress) = self.progress_mut(kind) {
            progress.begin(job);
        }
    }

    /// What a study would be: its runs, those that are done, and the expected time of the others,
    /// relative to that of reconstructions.
    pub fn estimate_speed(&self, project: &Project, request: &SpeedRequest) -> Estimate {
        let runs = request.runs(project, &self.known).unwrap_or_default();
        let old = self.speed.as_ref().filter(|old| !old.is_outdated(project));
        Estimate::of(&runs, old.map_or(&[], |old| &old.keys))
    }

    pub fn estimate_stability(&self, project: &Project, request: &StabilityRequest) -> Estimate {
        let runs = request.runs(project, &self.known);
        let old = self.stability.as_ref().filter(|old| !old.is_outdated(project));
        Estimate::of(&runs, old.map_or(&[], |old| &old.keys))
    }

    pub fn cancel(&mut self, kind: Kind) {
        if let Some(progress) = self.progress_mut(kind)
            && let Some(job) = progress.job
        {
            progress.cancelling = true;
            self.study_worker.cancel(job);
        }
    }

    /// Forgets what was found.
    pub fn clear(&mut self, kind: Kind) {
        self.cancel(kind);
        match kind {
            Kind::Speed => self.speed = None,
            Kind::Stability => self.stability = None,
        }
    }

    /// What was found so far.
    pub fn findings(&self, kind: Kind) -> Option<Findings> {
        let left = self.progress(kind)?.left().len();
        match kind {
            Kind::Speed => {
                let rows = self.speed.as_ref()?.rows.clone();
                let planned = rows.len() + left;
                (!rows.is_empty()).then_some(Findings::Speed { rows, planned })
            }
            Kind::Stability => {
                let study = self.stability.as_ref()?;
                let (capture, rows) = (study.design.source.name(), study.rows.clone());
                let planned = rows.len() + left;
                (!rows.is_empty()).then_some(Findings::Stability { capture, rows, planned })
            }
        }
    }

    fn add(&mut self, number: usize, row: Row) {
        match (row, &mut self.speed, &mut self.stability) {
            (Row::Speed(row), Some(study), _) => {
                study.rows.push(row);
                study.keys.extend(study.progress.key(number).map(str::to_owned));
                study.places = speed::places(&study.rows.iter().collect::<Vec<_>>());
                study.progress.add(number);
            }
            (Row::Stability(row), _, Some(study)) => {
                study.rows.push(row);
                study.keys.extend(study.progress.key(number).map(str::to_owned));
                study.curves = stability::curves(&study.rows);
                study.progress.add(number);
            }
            _ => {}
        }
    }
}

impl SpeedStudy {
    /// Whether tags, or options that no setting decides on, were changed since it began.
    pub fn is_outdated(&self, project: &Project) -> bool {
        let (now, then) = (project.edit(), &self.progress.edit);
        let Some(setting) = SETTINGS.first() else { return false };
        let upon = |edit: &Edit| setting.upon(&edit.run_options(), 1).ok();
        now.materials != then.materials || upon(now) != upon(then)
    }
}

impl StabilityStudy {
    /// Whether tags or options were changed since it began.
    pub fn is_outdated(&self, project: &Project) -> bool {
        !project.edit().same_reconstruction_inputs(&self.progress.edit)
    }
}
