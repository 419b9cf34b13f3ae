//! The Model page: what is drawn on the photographs of a capture, and what that places.
//!
//! The page edits the capture's `model.json` through [`Document`]. It has two workers of its own:
//! one solves and draws, one reads photographs. What is asked of them follows from the model and
//! from what is looked at (`follow`), and never waits for a button.

pub mod acting;
pub mod begin;
mod blink;
mod document;
mod edges;
pub mod drag;
pub mod finding;
pub mod follow;
pub mod keeping;
mod pictures;
pub mod points;
mod searching;
pub mod tool;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui;

use crate::io::engines::Search;
use crate::model::lines::Line;
use crate::model::{Model, Solution};
use crate::worker::{Command, Job, ModelDrawing, Modelling, SolvedModel, Worker};

use blink::Blink;
pub use document::Document;
use drag::Drag;
use finding::Finding;
pub use pictures::{Picture, Pictures};
use tool::{Selected, Target, Tool};

/// What is drawn over the photograph.
#[derive(Clone, Copy, Debug)]
pub struct Overlays {
    pub strokes: bool,
    pub model: bool,
    pub hidden: bool,
    /// Points that an engine has found.
    pub points: bool,
    /// Lines that were found in the photograph.
    pub lines: bool,
}

/// Which part of the photograph is seen.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// 1 shows the whole photograph.
    pub zoom: f32,
    /// In points of the window.
    pub shift: egui::Vec2,
}

pub struct ModelPage {
    pub is_shown: bool,
    pub folder: PathBuf,
    /// `None` until it is read.
    pub document: Option<Document>,
    /// Why there is none, in the terminal's words.
    pub problem: Option<String>,
    /// The photograph that is looked at.
    pub shown: usize,
    pub tool: Tool,
    pub selected: Selected,
    pub drag: Option<Drag>,
    pub placement: Placement,
    pub overlays: Overlays,
    /// Lines that are drawn come to lie on edges of the photograph.
    pub snaps: bool,
    /// The number of the selected stroke is to be typed next.
    pub wants_number: bool,
    /// The latest that was solved, and why the solver stopped, if it did.
    pub solved: Option<Arc<SolvedModel>>,
    pub failure: Option<String>,
    pub drawing: Option<Arc<ModelDrawing>>,
    pub pictures: Pictures,
    pub blink: Blink,
    /// The lines of the photographs that were looked at.
    pub lines: BTreeMap<usize, Arc<Vec<Line>>>,
    pub finding: Finding,
    solver: Worker,
    reader: Worker,
    opening: Option<Job>,
    solving: Option<Job>,
    /// What was sent to the solver last, and whether near another solution.
    tried: Option<(Arc<Model>, bool)>,
    drawn: Option<Job>,
    using: Option<Job>,
    /// A photograph is searched for lines, a thing fitted to them.
    searching: Option<Job>,
    fitting: Option<Job>,
}

impl Default for Placement {
    fn default() -> Self {
        Self { zoom: 1.0, shift: egui::Vec2::ZERO }
    }
}

impl ModelPage {
    fn start(folder: &Path, search: Search, ctx: &egui::Context) -> std::io::Result<Self> {
        let worker = || {
            let ctx = ctx.clone();
            Worker::start(move || ctx.request_repaint())
        };
        let mut reader = worker()?;
        let open = Modelling::Open { folder: folder.to_owned() };
        let opening = Some(reader.send(Command::Model(open)));
        Ok(Self {
            is_shown: true,
            folder: folder.to_owned(),
            document: None,
            problem: None,
            shown: 0,
            tool: Tool::default(),
            selected: Selected::default(),
            drag: None,
            placement: Placement::default(),
            overlays: Overlays {
                strokes: true,
                model: true,
                hidden: true,
                points: true,
                lines: true,
            },
            finding: Finding::new(search),
            snaps: true,
            wants_number: false,
            solved: None,
            failure: None,
            drawing: None,
            pictures: Pictures::default(),
            blink: Blink::default(),
            solver: worker()?,
            reader,
            opening,
            solving: None,
            tried: None,
            drawn: None,
            using: None,
            lines: BTreeMap::new(),
            searching: None,
            fitting: None,
        })
    }

    pub fn model(&self) -> Option<&Arc<Model>> {
        self.document.as_ref().map(Document::model)
    }

    /// The latest solution, also where the model has changed since.
    pub fn solution(&self) -> Option<&Solution> {
        self.solved.as_ref()?.outcome.as_ref().ok()
    }

    /// Whether the latest solution is of the present model, and exact unless something is dragged.
    pub fn is_solved(&self) -> bool {
        let is_own = |solved: &Arc<SolvedModel>| {
            self.model().is_some_and(|model| Arc::ptr_eq(&solved.model, model))
                && (!solved.is_preview || self.is_dragging())
        };
        self.solved.as_ref().is_some_and(is_own)
    }

    /// Whether a gesture of the hand goes on.
    fn is_dragging(&self) -> bool {
        self.document.as_ref().is_some_and(|document| document.gesture().is_some())
    }

    /// Whether anything goes on besides the hand.
    pub fn is_busy(&self) -> bool {
        self.opening.is_some()
            || self.solving.is_some()
            || self.drawn.is_some()
            || self.using.is_some()
            || self.searching.is_some()
            || self.blink.job.is_some()
            || self.fitting.is_some()
            || self.pictures.is_reading()
            || self.finding.is_busy()
    }

    pub fn is_solving(&self) -> bool {
        self.solving.is_some()
    }

    pub fn is_changed(&self) -> bool {
        self.document.as_ref().is_some_and(Document::is_changed)
    }

    /// How far a stroke of the present model is off: pixels, or standard deviations of what was
    /// typed. `None` before it is known.
    pub fn residual(&self, stroke: usize) -> Option<f64> {
        let solved = self.solved.as_ref()?;
        let is_same = solved.model.strokes.get(stroke) == self.model()?.strokes.get(stroke);
        let reports = &solved.outcome.as_ref().ok()?.strokes;
        let own = reports.binary_search_by_key(&stroke, |own| own.stroke).ok()?;
        is_same.then(|| reports[own].residual)
    }

    /// What hinders the use of the model, in words.
    pub fn obstacle(&self) -> Option<String> {
        let Some(model) = self.model() else { return Some("The model is not read yet.".into()) };
        if self.using.is_some() {
            return Some("Mesh and cameras are being written.".into());
        }
        if let Some(failure) = self.failure.as_ref().filter(|_| !self.is_solved()) {
            return Some(failure.clone());
        }
        if model.strokes.is_empty() && !model.has_found() {
            return Some("Nothing is drawn yet.".into());
        }
        if !self.is_solved() {
            return Some("The strokes are still being solved.".into());
        }
        match &self.solved.as_ref()?.outcome {
            Err(error) => Some(error.to_string()),
            Ok(solution) => match solution.problems.first() {
                Some(problem) => Some(problem.to_string()),
                None if solution.faces.is_empty() => Some(
                    "There is no surface yet: add a room, a box or a polygon, and show its \
                     corners."
                        .into(),
                ),
                None => None,
            },
        }
    }

    /// Shows another photograph.
    pub fn show(&mut self, photograph: usize) {
        if photograph != self.shown {
            self.shown = photograph;
            self.drag = None;
            // A corner that was shown last may be shown here, too.
            if let (Tool::Mark(Target::Place(_)), Selected::Thing(thing)) =
                (self.tool, self.selected)
                && let Some(model) = self.model()
                && let Some(first) = Target::first(model, thing, photograph)
            {
                self.tool = Tool::Mark(first);
            }
        }
    }

    /// Lets go of what the model no longer has.
    fn tidy(&mut self) {
        let Some(model) = self.document.as_ref().map(|own| own.model().clone()) else { return };
        if !self.tool.is_of(&model) {
            self.tool = Tool::Select;
        }
        if !self.selected.is_of(&model) {
            self.selected = Selected::Nothing;
        }
        self.shown = self.shown.min(model.photographs.len().saturating_sub(1));
    }
}
