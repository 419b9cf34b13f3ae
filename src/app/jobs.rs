//! The workers behind the window, and what their events mean for the project.
//!
//! There are three: reading a capture, like other short work, and making pictures must not wait
//! for a reconstruction that runs, and all are the worker that the terminal drives.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::Duration;

use eframe::egui;

use super::derived::{self, Derived};
use super::files::{self, Opening};
use super::project::{Products, Project, Run};
use super::state::State;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::CoverageMask;
use crate::reconstruct::{Reconstruction, Update};
use crate::render::RenderOptions;
use crate::render::film::Film;
use crate::render::scene::Solved;
use crate::worker::{Command, Event, Frame, Happening, Job, Rendering, Worker};

/// How often progress is looked at while something runs.
const PULSE: Duration = Duration::from_millis(100);

/// A photograph as the results have it, getting clearer.
pub struct Picture {
    job: Job,
    /// The results that it is made from.
    of: Arc<Reconstruction>,
    pub photograph: usize,
    /// Pixels of the photograph along a side of one of the picture's.
    pub step: usize,
    pub film: Option<Arc<Film>>,
    pub is_done: bool,
}

/// The masks of some lights (Fig. 6).
pub struct Coverage {
    job: Job,
    pub of: Arc<VirtualLights>,
    pub masks: Option<Arc<Vec<Option<CoverageMask>>>>,
}

/// Pixels along the longer side of a picture that is made to compare.
const COMPARED: usize = 800;

pub struct Jobs {
    loader: Worker,
    runner: Worker,
    painter: Worker,
    /// The photograph that is made anew, to be compared.
    pub picture: Option<Picture>,
    /// What the lights see, where it was asked for.
    pub coverage: Option<Coverage>,
    ctx: egui::Context,
    pub opening: Option<(Job, Opening)>,
    /// The export under way, and what it writes.
    pub exporting: Option<(Job, Arc<Reconstruction>)>,
    /// Numbers that are being worked out, and of what.
    derived: Option<(Arc<Reconstruction>, Receiver<Arc<Derived>>)>,
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
            painter: worker()?,
            picture: None,
            coverage: None,
            ctx: ctx.clone(),
            opening: None,
            exporting: None,
            derived: None,
        })
    }

    /// Reads a capture; a reading that was under way is given up.
    pub fn open(&mut self, opening: Opening) {
        self.cancel_opening();
        let job = self.loader.send(Command::Load { path: opening.folder.clone() });
        self.opening = Some((job, opening));
    }

    pub fn cancel_opening(&mut self) {
        if let Some((job, _)) = self.opening.take() {
            self.loader.cancel(job);
        }
    }

    pub fn run(&mut self, project: &mut Project) {
        self.derived = None;
        let (edit, capture) = (project.edit().clone(), project.capture.clone());
        let options = Box::new(edit.run_options());
        let job = self.runner.send(Command::Reconstruct { capture: capture.clone(), options });
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

    /// Writes the results; nothing is done without any.
    pub fn export(&mut self, project: &Project, folder: PathBuf) {
        let Some((whole, (edit, capture))) =
            project.products.whole.clone().zip(project.products.of.clone())
        else {
            return;
        };
        let job = self.runner.send(Command::Export {
            capture,
            options: Box::new(edit.run_options()),
            reconstruction: whole.clone(),
            load_secs: project.load_secs,
            folder,
        });
        self.exporting = Some((job, whole));
    }

    /// Makes a photograph anew from the results.
    pub fn compare(&mut self, project: &Project, photograph: usize) {
        self.stop_comparing();
        let capture = project.result_capture();
        let (Some(whole), Some(seen)) =
            (project.products.whole.clone(), capture.photographs.get(photograph))
        else {
            return;
        };
        let step = seen.camera.width.max(seen.camera.height).div_ceil(COMPARED);
        let frame = Frame {
            name: seen.name.clone(),
            camera: seen.camera.reduced(step),
            photograph: Some(photograph),
        };
        let job = self.painter.send(Command::Render(Box::new(Rendering {
            capture: capture.clone(),
            solved: Arc::new(Solved::from(whole.as_ref())),
            edits: Arc::default(),
            frames: vec![frame],
            options: RenderOptions::default(),
            files: None,
        })));
        self.picture =
            Some(Picture { job, of: whole, photograph, step, film: None, is_done: false });
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

    pub fn stop_comparing(&mut self) {
        if let Some(picture) = self.picture.take() {
            self.painter.cancel(picture.job);
        }
    }

    /// Works out the numbers of finished results that have none yet.
    fn derive(&mut self, project: &Project) {
        let products = &project.products;
        if let Some(whole) = products.whole.clone().filter(|_| products.derived.is_none()) {
            let ctx = self.ctx.clone();
            let answer = derived::on_a_thread(whole.clone(), move || ctx.request_repaint());
            self.derived = Some((whole, answer));
        }
    }

    pub fn is_busy(&self) -> bool {
        self.opening.is_some() || self.exporting.is_some() || self.derived.is_some()
    }
}

/// Takes all events since the last frame.
pub fn drain(state: &mut State) {
    let events: Vec<Event> = state.jobs.loader.events().try_iter().collect();
    for event in events {
        loader_event(state, event);
    }
    let events: Vec<Event> = state.jobs.runner.events().try_iter().collect();
    for event in events {
        runner_event(state, event);
    }
    let events: Vec<Event> = state.jobs.painter.events().try_iter().collect();
    for event in events {
        painter_event(state, event);
    }
    let shown = state.project.as_ref().and_then(|project| project.products.whole.as_ref());
    if state
        .jobs
        .picture
        .as_ref()
        .is_some_and(|picture| shown.is_none_or(|shown| !Arc::ptr_eq(shown, &picture.of)))
    {
        state.jobs.stop_comparing();
    }
    if state.project.is_none()
        && let Some(coverage) = state.jobs.coverage.take()
    {
        state.jobs.loader.cancel(coverage.job);
    }
    if let Some((whole, answer)) = &state.jobs.derived {
        let answer = answer.try_recv();
        // Another project, or another run's results, may be shown by now.
        if let (Ok(derived), Some(Project { products, .. })) = (&answer, &mut state.project)
            && products.whole.as_ref().is_some_and(|shown| Arc::ptr_eq(shown, whole))
        {
            products.derived = Some(derived.clone());
        }
        if !matches!(answer, Err(TryRecvError::Empty)) {
            state.jobs.derived = None;
        }
    }
    if let Some(project) = &mut state.project
        && let Some(run) = &mut project.run
    {
        run.progress = state.jobs.runner.progress(run.job).filter(|_| run.stage().is_some());
        state.jobs.ctx.request_repaint_after(PULSE);
    }
}

fn loader_event(state: &mut State, event: Event) {
    if let Some(coverage) = state.jobs.coverage.as_mut().filter(|own| own.job == event.job) {
        if let Happening::Covered(masks) = event.happening {
            coverage.masks = Some(masks);
        }
        return;
    }
    // Only the latest opening counts; a project that was open stays until it has succeeded.
    if state.jobs.opening.as_ref().is_none_or(|(job, _)| *job != event.job)
        || !event.happening.is_ending()
    {
        return;
    }
    let Some((_, opening)) = state.jobs.opening.take() else { return };
    match event.happening {
        Happening::Loaded(capture) => files::opened(state, opening, capture),
        Happening::Failed(text) => state.messages.error("This cannot be opened", text),
        _ => {}
    }
}

fn painter_event(state: &mut State, event: Event) {
    let Some(picture) = state.jobs.picture.as_mut().filter(|picture| picture.job == event.job)
    else {
        return;
    };
    match event.happening {
        Happening::Picture { film, .. } => picture.film = Some(film),
        Happening::Failed(text) => {
            picture.is_done = true;
            state.messages.error("The picture cannot be made", text);
        }
        happening => picture.is_done |= happening.is_ending(),
    }
}

fn runner_event(state: &mut State, event: Event) {
    if let Some((_, exported)) = state.jobs.exporting.take_if(|(job, _)| *job == event.job) {
        match event.happening {
            Happening::Exported(folder) => {
                if let Some(Project { products, .. }) = &mut state.project {
                    let is_shown = |whole: &Arc<_>| Arc::ptr_eq(whole, &exported);
                    products.exported |= products.whole.as_ref().is_some_and(is_shown);
                }
                state.messages.notice(format!("Results written to {}", folder.display()));
            }
            Happening::Failed(text) => {
                state.messages.error("The results cannot be written", text);
            }
            Happening::Cancelled => {}
            _ => state.jobs.exporting = Some((event.job, exported)),
        }
        return;
    }
    let Some(project) = &mut state.project else { return };
    if project.run.as_ref().is_none_or(|run| run.job != event.job) {
        return;
    }
    match event.happening {
        Happening::Update(update) => {
            if let Some(line) = line(&update) {
                state.messages.info(line);
            }
            project.update(update);
        }
        Happening::Reconstructed(whole) => {
            let secs = end(project).map_or(0.0, |run| run.began.elapsed().as_secs_f64());
            let brief = whole.solution.brief();
            for note in &whole.solution.notes {
                state.messages.info(note.clone());
            }
            for warning in &whole.warnings {
                state.messages.warning(warning.clone());
            }
            project.products.finish(whole);
            state.messages.info(state.probe.report().unwrap_or_default());
            state.messages.notice(format!("Done in {secs:.1} s. {brief}"));
            state.jobs.derive(project);
        }
        Happening::Cancelled => {
            give_back(project);
            state.jobs.derive(project);
            state.messages.notice("The run was cancelled.");
        }
        Happening::Failed(text) => {
            give_back(project);
            state.jobs.derive(project);
            state.messages.error("The reconstruction stopped", text);
        }
        _ => {}
    }
}

fn end(project: &mut Project) -> Option<Run> {
    let mut run = project.run.take()?;
    run.end_stage();
    Some(run)
}

/// A run that came to nothing leaves what was there before it; where there was nothing, what it
/// found so far is better than that.
fn give_back(project: &mut Project) {
    if let Some(run) = end(project)
        && run.previous.whole.is_some()
    {
        project.products = run.previous;
        project.selection.forget_products();
    }
}

fn line(update: &Update) -> Option<String> {
    Some(match update {
        Update::Stage(stage) => format!("Stage {}", stage.name()),
        Update::Samples(cloud) => format!("{} samples", cloud.samples.len()),
        Update::Lights(lights, lobes) => {
            format!("{} virtual lights, {} lobes", lights.lights.len(), lobes.lobes.len())
        }
        Update::Transport(_) => return None,
        Update::Iteration(iteration) => format!(
            "Iteration {}: relative RMS {} %",
            iteration.index,
            iteration.rms.relative.map(|value| format!("{:.2}", 100.0 * value)).join(" / ")
        ),
    })
}
