//! The workers behind the window.
//!
//! There are five, since neither must wait for another: one reads captures and does other short
//! work, one reconstructs, one makes pictures, one shows the relit scene, one studies. All are the
//! worker that the terminal drives.

mod charts;
pub mod events;
mod masks;
mod reading;
mod rendering;
mod results;
mod scene_export;
pub mod studies;
mod tasks;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use eframe::egui;

use super::derived::Derived;
use super::opening::{LookingInto, Opening};
use super::pending::Pending;
use super::products::{Products, Run};
use super::project::Project;
use crate::reconstruct::Reconstruction;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::CoverageMask;
use crate::render::film::Film;
use crate::render::scene::Solved;
use crate::render::{Engine, RenderOptions};
use crate::scene::Capture;
use crate::study::pictures::PictureScore;
use crate::watch::Progress;
use crate::worker::{
    Command, Frame, Job, LatestRequest, Modelling, PreviewRequest, Relighting, Relit, Rendering,
    Worker,
};

/// How often progress is looked at while something runs.
const PULSE: Duration = Duration::from_millis(100);

/// A photograph as the results have it, getting clearer.
pub struct Picture {
    job: Job,
    /// The results that it is made from.
    pub of: Arc<Reconstruction>,
    pub photograph: usize,
    /// Pixels of the photograph along a side of one of the picture's.
    pub step: usize,
    pub film: Option<Arc<Film>>,
    /// The finished picture beside the photograph.
    pub score: Option<Box<PictureScore>>,
    pub is_done: bool,
}

/// The relit scene in the viewport.
struct Relighter {
    job: Job,
    latest: LatestRequest,
    /// The results that it is made from.
    of: Arc<Solved>,
    capture: Arc<Capture>,
    request: Option<PreviewRequest>,
    /// The newest picture.
    relit: Option<Arc<Relit>>,
}

/// The masks of some lights (Fig. 6).
pub struct Coverage {
    job: Job,
    pub of: Arc<VirtualLights>,
    pub masks: Option<Arc<Vec<Option<CoverageMask>>>>,
}

/// Pixels along the longer side of a picture that is made to compare.
const COMPARED: usize = 800;

use charts::Charts;
pub use charts::{Found, ViewReading};
pub use reading::Reading;
use rendering::PicturesJob;
use studies::Studies;
use tasks::Running;

pub struct Jobs {
    loader: Worker,
    runner: Worker,
    render_worker: Worker,
    relighter: Worker,
    /// What traces the paths of pictures.
    engine: Engine,
    relight: Option<Relighter>,
    pub studies: Studies,
    /// Jobs that come to one answer.
    tasks: Vec<Running>,
    /// Where charts are, and what is read of them.
    pub charts: Charts,
    /// Pictures that are being written.
    rendering: Option<PicturesJob>,
    /// The photograph that is made anew, to be compared.
    pub picture: Option<Picture>,
    /// What the lights see, where it was asked for.
    pub coverage: Option<Coverage>,
    ctx: egui::Context,
    /// What is looked at first, where something is opened.
    pub(in crate::app) looking_into: Option<LookingInto>,
    pub opening: Option<(Job, Opening)>,
    /// The capture of what is being opened, once it has been read.
    loaded: Option<Arc<Capture>>,
    /// Numbers that are being worked out, and of what.
    derived: Option<(Arc<Reconstruction>, Pending<Arc<Derived>>)>,
}

impl Jobs {
    pub fn start(ctx: &egui::Context) -> std::io::Result<Self> {
        let worker = || {
            let ctx = ctx.clone();
            Worker::start(move || ctx.request_repaint())
        };
        Ok(Self {
            loader: worker()?,
            runner: worker()?,
            render_worker: worker()?,
            relighter: worker()?,
            engine: Engine::Auto,
            relight: None,
            studies: Studies::new(worker()?),
            tasks: Vec::new(),
            charts: Charts::default(),
            rendering: None,
            picture: None,
            coverage: None,
            ctx: ctx.clone(),
            looking_into: None,
            opening: None,
            loaded: None,
            derived: None,
        })
    }

    /// Reads a capture; a reading that was under way is given up.
    pub fn open(&mut self, opening: Opening) {
        self.cancel_opening();
        let job = self.loader.send(Command::Load { path: opening.folder.clone() });
        self.opening = Some((job, opening));
    }

    /// Makes a capture of photographs alone.
    pub fn begin(&mut self, folder: PathBuf, images: Vec<PathBuf>) -> Job {
        self.loader.send(Command::Model(Modelling::Begin { folder, images }))
    }

    /// How far a capture is that is begun.
    pub fn progress(&self, job: Job) -> Option<Progress> {
        self.loader.progress(job)
    }

    pub fn stop_beginning(&self, job: Job) {
        self.loader.cancel(job);
    }

    pub fn cancel_opening(&mut self) {
        self.loaded = None;
        self.looking_into = None;
        if let Some((job, _)) = self.opening.take() {
            self.loader.cancel(job);
        }
    }

    /// Begins a run; `afresh` where nothing is to be taken over from earlier ones.
    pub fn run(&mut self, project: &mut Project, afresh: bool) {
        self.derived = None;
        project.solution = None;
        let (edit, capture) = (project.edit().clone(), project.capture.clone());
        let options = Box::new(edit.run_options());
        let stage_cache =
            if afresh { project.stage_cache.afresh() } else { project.stage_cache.clone() };
        let job = self.runner.send(Command::Reconstruct {
            capture: capture.clone(),
            options,
            stage_cache: Some(stage_cache),
        });
        let before = project.products.derived.clone().or(project.products.before.clone());
        let next = Products { of: Some((edit, capture)), before, ..Products::default() };
        let previous = std::mem::replace(&mut project.products, next);
        project.selection.forget_products();
        project.run = Some(Run::new(job, previous));
    }

    pub fn cancel(&self, project: &mut Project) {
        if let Some(run) = &mut project.run {
            run.cancelling = true;
            self.runner.cancel(run.job);
        }
    }

    /// Makes a photograph anew from the results.
    pub fn compare(&mut self, project: &Project, photograph: usize) {
        self.stop_comparing();
        let capture = project.result_capture();
        let products = &project.products;
        let (Some(whole), Some(solved), Some(seen)) =
            (products.whole.clone(), products.solved.clone(), capture.photographs.get(photograph))
        else {
            return;
        };
        let step = seen.camera.width.max(seen.camera.height).div_ceil(COMPARED);
        let frame = Frame {
            name: seen.name.clone(),
            camera: seen.camera.reduced(step),
            photograph: Some(photograph),
        };
        let job = self.render_worker.send(Command::Render(Box::new(Rendering {
            capture: capture.clone(),
            solved,
            edits: Arc::default(),
            frames: vec![frame],
            options: RenderOptions { engine: self.engine, ..RenderOptions::default() },
            files: None,
        })));
        self.picture = Some(Picture {
            job,
            of: whole,
            photograph,
            step,
            film: None,
            score: None,
            is_done: false,
        });
    }

    /// Finds what the lights see.
    pub fn cover(&mut self, project: &Project) {
        let Some((lights, _)) = project.products.lights.clone() else { return };
        if let Some(coverage) = self.coverage.take() {
            self.loader.cancel(coverage.job);
        }
        let capture = project.result_capture().clone();
        let job = self.loader.send(Command::Cover { capture, lights: lights.clone() });
        self.coverage = Some(Coverage { job, of: lights, masks: None });
    }

    /// Pictures that are asked for from now on are traced on another device.
    pub fn set_engine(&mut self, engine: Engine) {
        if engine != self.engine {
            self.engine = engine;
            self.stop_relighting();
        }
    }

    /// Requests the viewport's relit picture; with `None`, where it is not shown, rendering stops.
    pub fn relight(&mut self, project: Option<&Project>, request: Option<PreviewRequest>) {
        let results = project.and_then(|project| {
            Some((project.products.solved.clone()?, project.result_capture().clone()))
        });
        let (Some((solved, capture)), Some(request)) = (results, request) else {
            self.stop_relighting();
            return;
        };
        if self.relight.as_ref().is_some_and(|own| !Arc::ptr_eq(&own.of, &solved)) {
            self.stop_relighting();
        }
        let relight = self.relight.get_or_insert_with(|| {
            let latest = LatestRequest::default();
            let relighting = Relighting {
                capture: capture.clone(),
                solved: solved.clone(),
                engine: self.engine,
                latest: latest.clone(),
            };
            let job = self.relighter.send(Command::Relight(relighting));
            Relighter { job, latest, of: solved, capture, request: None, relit: None }
        });
        let request = PreviewRequest {
            photograph: request
                .photograph
                .filter(|&index| index < relight.capture.photographs.len()),
            ..request
        };
        let is_new = relight.request.as_ref().is_none_or(|now| {
            !Arc::ptr_eq(&now.edits, &request.edits)
                || (now.camera, now.photograph, now.before)
                    != (request.camera, request.photograph, request.before)
        });
        if is_new {
            relight.latest.put(request.clone());
            relight.request = Some(request);
        }
    }

    fn stop_relighting(&mut self) {
        if let Some(relight) = self.relight.take() {
            self.relighter.cancel(relight.job);
        }
    }

    /// The newest picture of the relit scene.
    pub fn relit(&self) -> Option<&Arc<Relit>> {
        self.relight.as_ref()?.relit.as_ref()
    }

    pub fn stop_comparing(&mut self) {
        if let Some(picture) = self.picture.take() {
            self.render_worker.cancel(picture.job);
        }
    }

    /// Works out the numbers of finished results that have none yet.
    pub(in crate::app) fn derive(&mut self, project: &Project) {
        let products = &project.products;
        if let Some(whole) = products.whole.clone().filter(|_| products.derived.is_none()) {
            let of = whole.clone();
            let work = move || Arc::new(Derived::of(&of));
            self.derived = Some((whole, Pending::start("numbers", &self.ctx, work)));
        }
    }

    /// What is being opened.
    pub fn opens(&self) -> Option<&Path> {
        let looked = self.looking_into.as_ref().map(|own| own.path.as_path());
        looked.or(self.opening.as_ref().map(|(_, opening)| opening.folder.as_path()))
    }

    pub fn is_busy(&self) -> bool {
        self.opens().is_some()
            || !self.tasks.is_empty()
            || self.derived.is_some()
            || self.rendering.is_some()
            || self.studies.is_busy()
    }

    /// Whether something is computed beside a study that measures seconds.
    pub fn disturbs_seconds(&self) -> bool {
        let is_painting = self.picture.as_ref().is_some_and(|picture| !picture.is_done);
        let is_relighting = self
            .relight
            .as_ref()
            .is_some_and(|own| own.relit.as_ref().is_none_or(|relit| !relit.is_done));
        self.rendering.is_some() || self.is_exporting_scene() || is_painting || is_relighting
    }
}
