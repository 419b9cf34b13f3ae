//! Jobs that come to one answer. A new one is a file beside this one: a struct that holds what its
//! answer is for, what is done with the answer (`ended`), and how `Jobs` begins it (`begin_task`).
//! Its line in `events.rs` makes the struct a task.

use std::any::Any;

use super::Jobs;
use crate::watch::Progress;
use crate::worker::{Command, Job, Worker};

/// What an answer is for. The list in `events.rs` implements it for all that it can hand an answer to.
pub trait Task: Any {}

/// Which of the workers does it: each does one job after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    Loader,
    Runner,
    Renderer,
}

/// A task under way.
pub struct Running {
    lane: Lane,
    job: Job,
    task: Box<dyn Any>,
}

impl Running {
    fn is<T: Task>(&self) -> bool {
        self.task.is::<T>()
    }
}

impl Jobs {
    fn worker(&self, lane: Lane) -> &Worker {
        match lane {
            Lane::Loader => &self.loader,
            Lane::Runner => &self.runner,
            Lane::Renderer => &self.render_worker,
        }
    }

    /// Begins a job whose answer the task takes.
    pub(super) fn begin_task(&mut self, lane: Lane, command: Command, task: impl Task) {
        let worker = match lane {
            Lane::Loader => &mut self.loader,
            Lane::Runner => &mut self.runner,
            Lane::Renderer => &mut self.render_worker,
        };
        let job = worker.send(command);
        self.tasks.push(Running { lane, job, task: Box::new(task) });
    }

    /// Takes the task whose job has ended, where it is one of these.
    pub(super) fn take_ended(&mut self, lane: Lane, job: Job) -> Option<Box<dyn Any>> {
        let index = self.tasks.iter().position(|own| (own.lane, own.job) == (lane, job))?;
        Some(self.tasks.remove(index).task)
    }

    fn first<T: Task>(&self) -> Option<&Running> {
        self.tasks.iter().find(|own| own.is::<T>())
    }

    /// Whether some task of a kind is under way.
    pub(super) fn is_at<T: Task>(&self) -> bool {
        self.first::<T>().is_some()
    }

    pub(super) fn job_of<T: Task>(&self) -> Option<Job> {
        self.first::<T>().map(|own| own.job)
    }

    /// How far the first task of a kind is.
    pub(super) fn progress_of<T: Task>(&self) -> Option<Progress> {
        let own = self.first::<T>()?;
        self.worker(own.lane).progress(own.job)
    }

    /// Cancels the tasks of a kind, which then end as cancelled.
    pub(super) fn cancel_tasks<T: Task>(&self) {
        for own in self.tasks.iter().filter(|own| own.is::<T>()) {
            self.worker(own.lane).cancel(own.job);
        }
    }

    /// Wants no answer of tasks of a kind any more.
    pub(super) fn forget_tasks<T: Task>(&mut self) {
        self.tasks.retain(|own| !own.is::<T>());
    }
}
