//! The job that renders pictures to files, and its progress.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::Jobs;
use crate::app::messages::Messages;
use crate::app::picture_choices::PictureChoices;
use crate::app::project::Project;
use crate::io::export::pictures::Development;
use crate::render::RenderOptions;
use crate::scene::Camera;
use crate::worker::{Command, Files, Job, JobEvent, Rendering};

/// Pictures on their way to files.
pub struct PicturesJob {
    pub job: Job,
    folder: PathBuf,
    count: usize,
    done: usize,
    began: Instant,
    /// When the latest of them was done.
    latest: Instant,
}

/// How far pictures have come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PicturesProgress {
    /// The picture under way, from 1.
    pub number: usize,
    pub count: usize,
    /// Of that picture, from 0 to 1.
    pub part: f32,
    /// Once a picture is done.
    pub left: Option<Duration>,
}

impl PicturesJob {
    /// What the pictures that are done say of those to come.
    fn left(&self) -> Option<Duration> {
        let each = (self.latest - self.began).checked_div(self.done as u32)?;
        let rest = each * self.count.saturating_sub(self.done) as u32;
        Some(rest.saturating_sub(self.latest.elapsed()))
    }
}

impl Jobs {
    /// Writes pictures, to be looked at as they are shown; `view` is the camera of the 3D view
    /// with the photograph that is looked through.
    pub fn render(
        &mut self,
        project: &Project,
        choices: &PictureChoices,
        shown: Development,
        view: Option<(Camera, Option<usize>)>,
    ) {
        let Some(solved) = project.products.solved.clone() else { return };
        let capture = project.result_capture().clone();
        let frames = choices.frames(&capture, view);
        let (count, folder) = (frames.len(), PathBuf::from(choices.folder.trim()));
        let options = RenderOptions {
            spp: choices.spp,
            noise: choices.noise,
            engine: self.engine,
            ..RenderOptions::default()
        };
        let job = self.render_worker.send(Command::Render(Box::new(Rendering {
            frames,
            capture: capture.clone(),
            solved,
            edits: project.edit().relight.clone(),
            options,
            files: Some(Files {
                folder: folder.clone(),
                png: choices.has_png.then_some(shown),
                composite: choices.has_composite,
                color_space: choices.color_space,
                layers: choices.has_layers,
            }),
        })));
        let now = Instant::now();
        self.rendering = Some(PicturesJob { job, folder, count, done: 0, began: now, latest: now });
    }

    pub fn is_rendering(&self) -> bool {
        self.rendering.is_some()
    }

    /// How far the pictures that are written have come.
    pub fn rendered(&self) -> Option<PicturesProgress> {
        let own = self.rendering.as_ref()?;
        let progress = self.render_worker.progress(own.job);
        let part = progress.map_or(0.0, |now| now.done as f32 / now.total.max(1) as f32);
        Some(PicturesProgress {
            number: (own.done + 1).min(own.count),
            count: own.count,
            part: part.min(1.0),
            left: own.left(),
        })
    }

    pub fn stop_rendering(&mut self) {
        if let Some(own) = &self.rendering {
            self.render_worker.cancel(own.job);
        }
    }

    /// Takes an event of the pictures that are written.
    pub(super) fn pictures_event(&mut self, event: JobEvent, messages: &mut Messages) {
        let Some(own) = &mut self.rendering else { return };
        match &event {
            JobEvent::PictureWritten { done } => {
                own.done = *done;
                own.latest = Instant::now();
            }
            JobEvent::Rendered(_) => {
                messages.notice(format!("Pictures written to {}", own.folder.display()));
            }
            JobEvent::Failed(text) => {
                messages.error("The pictures cannot be written", text.clone());
            }
            JobEvent::Cancelled => messages.notice("Rendering was stopped."),
            _ => {}
        }
        if event.is_ending() {
            self.rendering = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::worker::Worker;

    #[test]
    fn the_time_left_follows_the_pictures_that_are_done() {
        let mut worker = Worker::start(|| ()).unwrap();
        let latest = Instant::now();
        let began = latest - Duration::from_secs(20);
        let job = worker.send(Command::ReadTruth { folder: PathBuf::new() });
        let own = PicturesJob { job, folder: PathBuf::new(), count: 6, done: 2, began, latest };
        let left = own.left().unwrap().as_secs_f64();
        assert!((39.0..=40.0).contains(&left), "{left}");
        let first = PicturesJob { done: 0, ..own };
        assert_eq!(first.left(), None, "nothing is known before the first");
    }
}
