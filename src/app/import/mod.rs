//! The import page: what was chosen on it, and what the workers have found of that.
//!
//! It has two workers of its own, so that a photograph can be looked at while another job runs:
//! one reads, recovers responses and writes, one holds photographs against the cameras. What is
//! asked of them follows from the choices (`follow`), and never waits for a button.

pub mod acting;
mod events;
pub mod follow;
mod measuring;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use eframe::{egui, egui_wgpu};

use super::actions::Field;
use super::viewport::{Shading, ViewSettings, Viewport};
use crate::exposures::MergeOptions;
use crate::io::brackets::{Found, Series};
use crate::io::import::{self, Import, ShotCheck, Survey};
use crate::watch::Progress;
use crate::worker::{Job, Worker};

pub use measuring::{Measuring, REACH};

/// What fills the page's right side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    #[default]
    Mesh,
    Photographs,
    Exposures,
}

/// What is to be read, and how.
#[derive(Clone, Debug, PartialEq)]
struct Request {
    source: PathBuf,
    options: import::Options,
}

/// What series are investigated, and how.
#[derive(Clone, Debug, PartialEq)]
struct Question {
    series: Vec<Series>,
    options: MergeOptions,
}

/// What is drawn over photographs.
#[derive(Clone, Copy, Debug)]
pub struct Overlays {
    pub edges: bool,
    pub hidden: bool,
    pub points: bool,
}

pub struct ImportPage {
    pub is_shown: bool,
    /// What stands in the fields of [`Field`]; what counts is `chosen`.
    pub texts: [String; 4],
    pub chosen: [String; 4],
    pub times: String,
    pub chosen_times: String,
    pub options: import::Options,
    /// Exposure series are merged.
    pub merge: bool,
    pub merging: MergeOptions,
    /// Single photographs are taken for radiance by the curve of sRGB.
    pub as_srgb: bool,
    pub view: View,
    pub shot: usize,
    pub overlays: Overlays,
    pub measuring: Measuring,
    pub viewport: Viewport,
    /// The picture of the photograph on the screen.
    pub texture: Option<(Arc<ShotCheck>, egui::TextureHandle)>,
    reader: Worker,
    checker: Worker,
    /// What was asked for last, and what choices have been waiting since when.
    request: Option<Request>,
    waiting: Option<(Request, Instant)>,
    reading: Option<Job>,
    pub import: Option<Arc<Import>>,
    /// Why there is none; the terminal's own words.
    pub problem: Option<String>,
    surveying: Option<Job>,
    pub survey: Option<Arc<Survey>>,
    checking: Option<(Job, usize)>,
    pub check: Option<Arc<ShotCheck>>,
    question: Option<Question>,
    asking: Option<(Question, Instant)>,
    investigating: Option<Job>,
    pub found: Option<Result<Arc<Found>, String>>,
    writing: Option<Job>,
    /// A capture that is in the way.
    pub replace: Option<PathBuf>,
}

impl ImportPage {
    fn start(render: &egui_wgpu::RenderState, ctx: &egui::Context) -> std::io::Result<Self> {
        let worker = || {
            let ctx = ctx.clone();
            Worker::start(move || ctx.request_repaint())
        };
        let mut viewport = Viewport::new(render);
        viewport.is_preview = true;
        viewport.settings = ViewSettings { shading: Shading::Material, ..ViewSettings::default() };
        Ok(Self {
            is_shown: true,
            texts: Default::default(),
            chosen: Default::default(),
            times: String::new(),
            chosen_times: String::new(),
            options: import::Options::default(),
            merge: false,
            merging: MergeOptions::default(),
            as_srgb: false,
            view: View::default(),
            shot: 0,
            overlays: Overlays { edges: true, hidden: false, points: true },
            measuring: Measuring::default(),
            viewport,
            texture: None,
            reader: worker()?,
            checker: worker()?,
            request: None,
            waiting: None,
            reading: None,
            import: None,
            problem: None,
            surveying: None,
            survey: None,
            checking: None,
            check: None,
            question: None,
            asking: None,
            investigating: None,
            found: None,
            writing: None,
            replace: None,
        })
    }

    /// What stands in a field, as it counts.
    pub fn path(&self, field: Field) -> Option<PathBuf> {
        let text = self.chosen[field as usize].trim();
        (!text.is_empty()).then(|| PathBuf::from(text))
    }

    /// Where to begin looking for what goes into a field.
    pub fn suggestion(&self, field: Field) -> PathBuf {
        let source = || self.path(Field::Cameras).or(self.path(Field::Images));
        let near = || source().and_then(|path| Some(path.parent()?.join("")));
        match (self.path(field), field) {
            (Some(path), _) => path,
            (None, Field::Out) => source().map_or_else(PathBuf::new, |path| {
                // A capture's own camera file stands for its folder.
                let is_own = path.ends_with("transforms.json");
                let path = path.parent().filter(|_| is_own).unwrap_or(&path);
                let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                path.with_file_name(format!("{stem}-capture"))
            }),
            (None, _) => near().unwrap_or_default(),
        }
    }

    pub fn is_busy(&self) -> bool {
        self.reading.is_some() || self.investigating.is_some() || self.writing.is_some()
    }

    pub fn is_writing(&self) -> bool {
        self.writing.is_some()
    }

    /// What goes on, and how far it is.
    pub fn work(&self) -> Option<(&'static str, Option<Progress>)> {
        let jobs = [
            (self.writing, "Writing the capture"),
            (self.reading, "Reading"),
            (self.investigating, "Recovering the response"),
        ];
        let (job, name) = jobs.into_iter().find_map(|(job, name)| Some((job?, name)))?;
        Some((name, self.reader.progress(job)))
    }

    /// A photograph is being held against its camera.
    pub fn is_checking(&self) -> bool {
        self.surveying.is_some() || self.checking.is_some()
    }

    /// What hinders writing, in words.
    pub fn obstacle(&self) -> Option<&'static str> {
        if self.writing.is_some() {
            return Some("The capture is being written.");
        }
        if self.reading.is_some() || self.waiting.is_some() {
            return Some("The sources are still being read.");
        }
        let Some(import) = &self.import else {
            return Some("Choose cameras, or a mesh, first.");
        };
        if import.shots.is_empty() {
            return Some(
                "There are no cameras in what was chosen, and a capture needs some. Choose them \
                 above, or begin with photographs alone (File, New from photographs).",
            );
        }
        if self.path(Field::Out).is_none() {
            return Some("Choose the folder for the capture first.");
        }
        None
    }

    fn choose(&mut self, field: Field, path: &Path) {
        let text = path.display().to_string();
        self.texts[field as usize].clone_from(&text);
        self.chosen[field as usize] = text;
    }

    fn cancel(&mut self) {
        for job in [self.writing, self.investigating].into_iter().flatten() {
            self.reader.cancel(job);
        }
        if let Some(job) = self.reading.take() {
            self.reader.cancel(job);
            self.problem = Some("Reading was cancelled.".to_owned());
        }
    }
}
