//! The open project: the capture as loaded, what was changed about it, and what was found.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use super::derived::Derived;
use super::edit::{Change, Edit};
use super::undo::History;
use super::viewport;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::{Iteration, Solution};
use crate::reconstruct::{Reconstruction, Stage, Update};
use crate::scene::Capture;
use crate::watch::Progress;
use crate::worker::Job;

pub struct Project {
    /// The capture's folder.
    pub folder: PathBuf,
    /// The project file, once there is one.
    pub file: Option<PathBuf>,
    /// As the files say.
    pub loaded: Arc<Capture>,
    pub load_secs: f64,
    /// As it would be reconstructed now.
    pub capture: Arc<Capture>,
    edit: Arc<Edit>,
    /// The state that the project file holds, or that needs none; `None` where no file holds what
    /// was opened.
    saved: Option<Arc<Edit>>,
    pub history: History,
    pub selection: Selection,
    pub products: Products,
    pub run: Option<Run>,
    /// The stages of the run before, with their seconds.
    pub last_stages: Vec<(Stage, f64)>,
}

/// What is selected, everywhere in the window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    pub surfaces: BTreeSet<usize>,
    /// The surface from which shift extends.
    pub anchor: Option<usize>,
    pub hidden: BTreeSet<usize>,
    /// Index into the edited list.
    pub material: Option<usize>,
    pub sample: Option<usize>,
    pub light: Option<usize>,
    pub photograph: Option<usize>,
    /// What was selected last: this is what the inspector shows.
    pub focus: Focus,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Focus {
    #[default]
    Nothing,
    Surfaces,
    Material,
    Sample,
    Light,
    Photograph,
}

/// What the latest run has come to. While it runs there are parts only.
#[derive(Clone, Default)]
pub struct Products {
    /// The state that they belong to, and its capture.
    pub of: Option<(Arc<Edit>, Arc<Capture>)>,
    pub samples: Option<Arc<SampleCloud>>,
    pub lights: Option<(Arc<VirtualLights>, Arc<Lobes>)>,
    pub solution: Option<Arc<Solution>>,
    pub iterations: Vec<Iteration>,
    pub whole: Option<Arc<Reconstruction>>,
    /// `whole` was written into a folder.
    pub exported: bool,
    /// Sample by sample, once it has been worked out.
    pub derived: Option<Arc<Derived>>,
    /// Log errors of the run before, to compare with.
    pub before: Option<Arc<Derived>>,
}

/// A reconstruction that is on its way.
pub struct Run {
    pub job: Job,
    pub began: Instant,
    /// The stages so far with the seconds they took; the last is the current one.
    pub stages: Vec<(Stage, Instant, f64)>,
    pub progress: Option<Progress>,
    /// What was there before, given back when this is cancelled.
    pub previous: Products,
    pub cancelling: bool,
}

impl Project {
    pub fn new(folder: PathBuf, loaded: Arc<Capture>, load_secs: f64) -> Self {
        let edit = Arc::new(Edit::of(&loaded, Default::default()));
        Self {
            folder,
            file: None,
            capture: loaded.clone(),
            loaded,
            load_secs,
            saved: Some(edit.clone()),
            edit,
            history: History::default(),
            selection: Selection::default(),
            products: Products::default(),
            run: None,
            last_stages: Vec::new(),
        }
    }

    pub fn edit(&self) -> &Arc<Edit> {
        &self.edit
    }

    /// Changes tags or options so that it can be undone.
    pub fn change(&mut self, change: &Change) -> Result<(), String> {
        let mut edit = (*self.edit).clone();
        edit.apply(change, &self.loaded)?;
        if edit != *self.edit {
            self.history.note(change, &self.edit);
            self.set_edit(Arc::new(edit));
        }
        Ok(())
    }

    /// Goes to another state: by undo, redo, or because a file says so.
    pub fn set_edit(&mut self, edit: Arc<Edit>) {
        if edit.materials != self.edit.materials {
            self.capture = Arc::new(edit.capture(&self.loaded));
        }
        // Materials that come and go renumber the others.
        let selection = &mut self.selection;
        if edit.materials.len() != self.edit.materials.len() {
            selection.material = selection.material.and_then(|index| {
                let name = &self.edit.materials.get(index)?.name;
                edit.materials.iter().position(|material| material.name == *name)
            });
            if selection.material.is_none() && selection.focus == Focus::Material {
                selection.focus = Focus::Nothing;
            }
        }
        self.edit = edit;
    }

    pub fn undo(&mut self) -> Option<String> {
        let (name, state) = self.history.undo(&self.edit.clone())?;
        self.set_edit(state);
        Some(name)
    }

    pub fn redo(&mut self) -> Option<String> {
        let (name, state) = self.history.redo(&self.edit.clone())?;
        self.set_edit(state);
        Some(name)
    }

    pub fn mark_saved(&mut self) {
        self.saved = Some(self.edit.clone());
    }

    pub fn mark_unsaved(&mut self) {
        self.saved = None;
    }

    pub fn is_changed(&self) -> bool {
        self.saved.as_ref() != Some(&self.edit)
    }

    /// The name for the title: of the project file, or of the capture.
    pub fn name(&self) -> String {
        let stem = self.file.as_ref().and_then(|file| file.file_stem());
        stem.map_or_else(|| self.loaded.name.clone(), |stem| stem.to_string_lossy().into_owned())
    }

    /// Whether what is shown was found with other tags or options than those of now.
    pub fn is_outdated(&self) -> bool {
        self.products.of.as_ref().is_some_and(|(edit, _)| *edit != self.edit)
    }

    /// The capture that indices in the products refer to.
    pub fn result_capture(&self) -> &Arc<Capture> {
        self.products.of.as_ref().map_or(&self.capture, |(_, capture)| capture)
    }

    /// Why it cannot be reconstructed now.
    pub fn obstacle(&self) -> Option<&'static str> {
        if self.run.is_some() {
            Some("A reconstruction is running already.")
        } else if self.capture.materials.is_empty() {
            Some("No surface has a material: assign one first.")
        } else if self.capture.measurements().next().is_none() {
            Some("No photograph of the capture measures radiance.")
        } else {
            None
        }
    }

    /// Takes note of what a running reconstruction has come to.
    pub fn update(&mut self, update: Update) {
        let Some(run) = &mut self.run else { return };
        match update {
            Update::Stage(stage) => {
                run.end_stage();
                run.stages.push((stage, Instant::now(), 0.0));
                run.progress = None;
            }
            Update::Samples(samples) => self.products.samples = Some(samples),
            Update::Lights(lights, lobes) => self.products.lights = Some((lights, lobes)),
            Update::Transport(_) => {}
            Update::Iteration(iteration) => self.products.iterations.push(iteration),
        }
    }

    /// What the viewport draws.
    pub fn content(&self) -> viewport::Content {
        // Materials that were edited since are drawn as they are now; samples keep theirs.
        viewport::Content {
            capture: Some(self.capture.clone()),
            result_capture: self.products.of.as_ref().map(|(_, capture)| capture.clone()),
            samples: self.products.samples.clone(),
            lights: self.products.lights.clone(),
            solution: self.products.solution.clone(),
            derived: self.products.derived.clone(),
            focus: self.selection.focus,
            selected_surfaces: self.selection.surfaces.clone(),
            hidden_surfaces: self.selection.hidden.clone(),
            selected_sample: self.selection.sample,
            selected_light: self.selection.light,
            selected_photograph: self.selection.photograph,
        }
    }
}

impl Run {
    pub fn new(job: Job, previous: Products) -> Self {
        Self {
            job,
            began: Instant::now(),
            stages: Vec::new(),
            progress: None,
            previous,
            cancelling: false,
        }
    }

    pub fn stage(&self) -> Option<Stage> {
        self.stages.last().map(|(stage, ..)| *stage)
    }

    pub fn end_stage(&mut self) {
        if let Some((_, began, seconds)) = self.stages.last_mut() {
            *seconds = began.elapsed().as_secs_f64();
        }
    }

    /// Seconds that the current stage still needs at its pace so far.
    pub fn secs_left(&self) -> Option<f64> {
        let progress = self.progress.filter(|p| p.total > 0 && p.done > 0 && p.done <= p.total)?;
        let (_, began, _) = self.stages.last()?;
        let elapsed = began.elapsed().as_secs_f64();
        Some(elapsed * (progress.total - progress.done) as f64 / progress.done as f64)
    }
}

impl Products {
    /// Those of a finished run.
    pub fn finish(&mut self, whole: Arc<Reconstruction>) {
        self.samples = Some(whole.samples.clone());
        self.lights = Some((whole.lights.clone(), whole.lobes.clone()));
        self.iterations.clone_from(&whole.solution.iterations);
        self.solution = Some(whole.solution.clone());
        self.whole = Some(whole);
    }
}
