//! The background thread: it receives commands and sends events.
//!
//! The window and the terminal send the same commands, so that both give the same results. Jobs are
//! done one after the other; each has its own [`Watch`], so that a late cancel cannot stop the
//! next. A panic inside a job becomes [`JobEvent::Failed`] and the thread goes on with the next.

mod command;
mod elsewhere;
pub mod engine;
mod event;
mod relight;
mod merge;
mod modelling;
mod panics;
mod render;
mod reprojection;
mod store;
mod memory;

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use crate::io::engines::Told;
use crate::io::logfile;
use crate::reconstruct::Update;
use crate::watch::{Progress, Watch};

pub use command::{Command, EditSource};
pub use elsewhere::SceneExport;
pub use event::{Event, Job, JobEvent};
pub use merge::{MergeReport, Merging, Place, Written};
pub use modelling::{EdgesFitted, ModelDrawing, Modelling, OnEdges, PointsFitted, SolvedModel};
pub use panics::record_panics;
pub use relight::{LatestRequest, PreviewRequest, Relighting, Relit};
pub use render::{Files, Frame, Rendering};
pub use reprojection::Reprojection;
pub use store::StoreResults;

/// The worker thread. Dropping this cancels all jobs and waits for the thread to end.
pub struct Worker {
    commands: Option<Sender<(Job, Watch, Command)>>,
    events: Receiver<Event>,
    watches: Arc<Mutex<HashMap<Job, Watch>>>,
    next: u64,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread. `wake` is called after every event (a window asks for a repaint).
    pub fn start(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let (commands, orders) = channel::<(Job, Watch, Command)>();
        let (sender, events) = channel();
        let watches: Arc<Mutex<HashMap<Job, Watch>>> = Arc::default();
        let shared = watches.clone();
        let thread = std::thread::Builder::new().name("worker".to_owned()).spawn(move || {
            for (job, watch, command) in orders {
                let emit = |what| {
                    record(job, &what);
                    // Sending fails only if the receiver was dropped; then nobody needs the event.
                    let _ = sender.send(Event { job, what });
                    wake();
                };
                emit(JobEvent::Started);
                let ending = perform(command, &watch, &emit);
                // Before the last event is sent: whoever receives it finds no progress any more.
                shared.lock().unwrap_or_else(PoisonError::into_inner).remove(&job);
                emit(ending);
            }
        })?;
        Ok(Self { commands: Some(commands), events, watches, next: 0, thread: Some(thread) })
    }

    /// Queues a command and returns the job under which its events come.
    pub fn send(&mut self, command: Command) -> Job {
        let job = Job(self.next);
        self.next += 1;
        let watch = Watch::new();
        self.lock().insert(job, watch.clone());
        if let Some(commands) = &self.commands {
            // The thread ends only when this sender is dropped.
            let _ = commands.send((job, watch, command));
        }
        job
    }

    /// The events so far; use `recv` to wait and `try_iter` to drain.
    pub fn events(&self) -> &Receiver<Event> {
        &self.events
    }

    /// Asks a job to stop; a job that has ended is left alone.
    pub fn cancel(&self, job: Job) {
        if let Some(watch) = self.lock().get(&job) {
            watch.cancel();
        }
    }

    /// How far a job's current stage is; `None` once it has ended.
    pub fn progress(&self, job: Job) -> Option<Progress> {
        self.lock().get(&job).map(Watch::progress)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, HashMap<Job, Watch>> {
        self.watches.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        for watch in self.lock().values() {
            watch.cancel();
        }
        self.commands = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Carries a command out; the event is the one that ends its job.
fn perform(command: Command, watch: &Watch, emit: &(dyn Fn(JobEvent) + Sync)) -> JobEvent {
    // A job shares nothing with the next but read-only products, so nothing half-changed can
    // be seen after a panic.
    match catch_unwind(AssertUnwindSafe(|| command.perform(watch, emit))) {
        Ok(event) => event,
        Err(panic) => {
            let text = panics::message(panic.as_ref());
            let place =
                panics::latest_place().map_or(String::new(), |place| format!(" at {place}"));
            let log = logfile::path()
                .map_or(String::new(), |path| format!(" The log is {}.", path.display()));
            JobEvent::Failed(format!(
                "an internal error stopped the job: {text}{place}. Please report it.{log}"
            ))
        }
    }
}

/// Logs what a job reports, apart from its pictures and iterations.
fn record(job: Job, what: &JobEvent) {
    let job = job.0;
    match what {
        JobEvent::Started => log::debug!("job {job}: started"),
        JobEvent::Update(Update::Stage(stage)) => log::info!("job {job}: {}", stage.name()),
        JobEvent::Update(Update::Reused(stage)) => log::info!("job {job}: {} kept", stage.name()),
        JobEvent::Loaded(capture) => {
            log::info!(
                "job {job}: capture with {} photographs, {} triangles, {} materials",
                capture.photographs.len(),
                capture.mesh.triangles.len(),
                capture.materials.len()
            );
            capture.warnings.iter().for_each(|warning| log::warn!("job {job}: {warning}"));
        }
        JobEvent::Reconstructed(whole) => {
            log::info!("job {job}: {}", whole.solution.brief());
            whole.warnings.iter().for_each(|warning| log::warn!("job {job}: {warning}"));
        }
        JobEvent::Told(Told::Step(name)) => log::info!("job {job}: {name}"),
        JobEvent::Told(Told::Line(line)) => log::debug!("job {job}: {line}"),
        JobEvent::Failed(message) => log::error!("job {job}: {message}"),
        JobEvent::Cancelled => log::info!("job {job}: cancelled"),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::Options;
    use crate::scene::Capture;

    /// The event that ends a job.
    fn ending(worker: &Worker, job: Job) -> JobEvent {
        loop {
            let event = worker.events().recv().unwrap();
            if event.job == job && event.what.is_ending() {
                return event.what;
            }
        }
    }

    #[test]
    fn an_error_is_an_event_and_the_worker_goes_on() {
        let mut worker = Worker::start(|| ()).unwrap();
        for _ in 0..2 {
            let job = worker.send(Command::Reconstruct {
                capture: Arc::new(Capture::default()),
                options: Box::default(),
                stage_cache: None,
            });
            match ending(&worker, job) {
                JobEvent::Failed(message) => assert!(message.contains("no photograph")),
                other => panic!("{other:?}"),
            }
            assert_eq!(worker.progress(job), None);
        }
    }

    #[test]
    fn a_panic_is_an_event() {
        let event = perform(Command::Panic, &Watch::new(), &|_| ());
        assert!(matches!(event, JobEvent::Failed(text) if text.contains("on purpose")));
    }

    #[test]
    fn a_queued_job_can_be_cancelled_and_a_late_cancel_harms_nothing() {
        let mut worker = Worker::start(|| ()).unwrap();
        let first = worker.send(Command::Load { path: "/nonexistent/capture".into() });
        ending(&worker, first);
        worker.cancel(first);
        let second = worker.send(Command::Reconstruct {
            capture: Arc::new(Capture::default()),
            options: Box::new(Options::default()),
            stage_cache: None,
        });
        assert!(matches!(ending(&worker, second), JobEvent::Failed(_)));
    }
}
