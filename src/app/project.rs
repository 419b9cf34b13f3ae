//! The open project: the capture as it was loaded, the changes to it, and the results.

mod matched;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use serde_json::Value;

use super::change::Change;
use super::edit::Edit;
use super::gesture::{Gesture, Preview};
use super::given::GivenLight;
use super::products::{Products, Run};
pub use super::selection::{Focus, Selection};
use super::undo::History;
use super::viewport::{self, MaterialColors};
use crate::io::project::ProjectFile;
use crate::io::results::Results;
use crate::io::tags::{StoredCharts, chart_values};
use crate::reconstruct::{Reconstruction, StageCache, Update};
use crate::render::scene::Solved;
use crate::scene::Capture;
use crate::scene::charts::LaidChart;
use crate::worker::StoreResults;

pub struct Project {
    /// The capture's folder.
    pub folder: PathBuf,
    /// The project file, once there is one.
    pub file: Option<PathBuf>,
    /// As the files say, with the charts of the present state.
    pub loaded: Arc<Capture>,
    /// Those that the capture's own files name.
    charts_of_files: Arc<Vec<LaidChart>>,
    /// As it was opened: what was begun for this project and no other has the same.
    pub opened: Arc<Capture>,
    pub load_secs: f64,
    /// As it would be reconstructed now.
    pub capture: Arc<Capture>,
    edit: Arc<Edit>,
    /// The state that the project file holds, or that needs none; `None` where no file holds what
    /// was opened.
    saved: Option<Arc<Edit>>,
    pub history: History<Edit>,
    preview: Option<Preview>,
    pub selection: Selection,
    pub products: Products,
    /// Where the results of the present tags and options were exported to.
    pub solution: Option<PathBuf>,
    /// The folder with the results that belong to the project's file.
    pub results: Option<PathBuf>,
    pub run: Option<Run>,
    /// What runs of this capture made, as far as another may take it over.
    pub stage_cache: StageCache,
}

impl Project {
    pub fn new(folder: PathBuf, loaded: Arc<Capture>, load_secs: f64) -> Self {
        let edit = Arc::new(Edit::of(&loaded, Default::default()));
        Self {
            folder,
            file: None,
            capture: loaded.clone(),
            charts_of_files: loaded.charts.clone(),
            opened: loaded.clone(),
            loaded,
            load_secs,
            saved: Some(edit.clone()),
            edit,
            history: History::default(),
            preview: None,
            selection: Selection::default(),
            products: Products::default(),
            solution: None,
            results: None,
            run: None,
            stage_cache: StageCache::default(),
        }
    }

    pub fn edit(&self) -> &Arc<Edit> {
        &self.edit
    }

    /// Changes tags or options in a step that can be undone.
    pub fn change(&mut self, change: &Change) -> Result<(), String> {
        let edit = self.changed(change)?;
        if edit != *self.edit {
            self.commit();
            self.history.note(change.name(), self.edit.clone());
            self.set_edit(Arc::new(edit));
        }
        Ok(())
    }

    /// Changes them as part of a gesture, which is one step for each value once it ends.
    pub fn preview(&mut self, change: &Change, gesture: Gesture) -> Result<(), String> {
        let edit = self.changed(change)?;
        if edit == *self.edit {
            return Ok(());
        }
        let goes_on = self
            .preview
            .as_ref()
            .is_some_and(|own| own.gesture == gesture && change.is_of_value_of(&own.change));
        if !goes_on {
            self.commit();
        }
        let before = self.preview.take().map_or_else(|| self.edit.clone(), |own| own.before);
        self.preview = Some(Preview { gesture, change: change.clone(), before });
        self.set_edit(Arc::new(edit));
        Ok(())
    }

    /// The state that a change makes of the present one.
    fn changed(&self, change: &Change) -> Result<Edit, String> {
        let mut edit = (*self.edit).clone();
        edit.apply(change, &self.loaded)?;
        Ok(edit)
    }

    /// The gesture whose changes are no step yet.
    pub fn gesture(&self) -> Option<Gesture> {
        self.preview.as_ref().map(|own| own.gesture)
    }

    /// The gesture ends: what it changed is a step.
    pub fn commit(&mut self) {
        if let Some(own) = self.preview.take()
            && own.before != self.edit
        {
            self.history.note(own.change.name(), own.before);
        }
    }

    /// The gesture is given up: all is as it was before.
    pub fn cancel_gesture(&mut self) {
        if let Some(own) = self.preview.take() {
            self.set_edit(own.before);
        }
    }

    /// Goes to another state: by undo, redo, or because a file says so.
    pub fn set_edit(&mut self, edit: Arc<Edit>) {
        let are_charts_new = edit.charts != self.edit.charts;
        if are_charts_new {
            self.loaded = Arc::new(self.loaded.with_charts(edit.charts.clone()));
        }
        if are_charts_new
            || edit.materials != self.edit.materials
            || edit.given != self.edit.given
            || edit.masks != self.edit.masks
        {
            let earlier = Some((&*self.capture, &*self.edit));
            self.capture = Arc::new(edit.capture(&self.loaded, earlier));
        }
        let selection = &mut self.selection;
        if are_charts_new {
            selection.forget_surfaces_of_charts(&self.loaded);
        }
        // Materials that come and go renumber the others.
        if edit.materials.len() != self.edit.materials.len() {
            selection.material = selection.material.and_then(|index| {
                let name = &self.edit.materials.get(index)?.name;
                edit.materials.iter().position(|material| material.name == *name)
            });
            if selection.material.is_none() && selection.focus == Focus::Material {
                selection.focus = Focus::Nothing;
            }
        }
        if selection.added.is_some_and(|item| !edit.things().exists(item)) {
            selection.added = None;
            if selection.focus == Focus::Added {
                selection.focus = Focus::Nothing;
            }
        }
        self.edit = edit;
    }

    pub fn undo(&mut self) -> Option<String> {
        self.commit();
        let (name, state) = self.history.undo(&self.edit.clone())?;
        self.set_edit(state);
        Some(name)
    }

    pub fn redo(&mut self) -> Option<String> {
        self.commit();
        let (name, state) = self.history.redo(&self.edit.clone())?;
        self.set_edit(state);
        Some(name)
    }

    /// Takes note of charts with which the capture was opened in place of those of its files.
    pub fn opened_with(&mut self, charts: StoredCharts) {
        self.charts_of_files = charts.of_files;
        let unread_charts = Arc::new(charts.unread);
        self.edit = Arc::new(Edit { unread_charts, ..(*self.edit).clone() });
        self.saved = Some(self.edit.clone());
    }

    /// The charts as a project file has them; `None` where they are those of the capture's files.
    pub fn chart_values(&self) -> Option<Vec<Value>> {
        let Edit { charts, unread_charts, .. } = &*self.edit;
        let is_own = *charts != self.charts_of_files || !unread_charts.is_empty();
        is_own.then(|| chart_values(charts, unread_charts, &self.loaded))
    }

    pub fn mark_saved(&mut self) {
        self.mark_saved_as(self.edit.clone());
    }

    /// A state is in the project's file, which may be an earlier one.
    pub fn mark_saved_as(&mut self, edit: Arc<Edit>) {
        self.saved = Some(edit);
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
        self.products
            .of
            .as_ref()
            .is_some_and(|(edit, _)| !edit.same_reconstruction_inputs(&self.edit))
    }

    /// Takes what was read of written results; those of a run are better.
    pub fn restore_solved(&mut self, solved: Arc<Solved>, folder: PathBuf) {
        if self.run.is_none() && self.products.of.is_none() {
            self.products.of = Some((self.edit.clone(), self.capture.clone()));
            self.products.solved = Some(solved);
            self.solution = Some(folder);
        }
    }

    /// Takes the results that belong to the project; those of a run are better.
    pub fn restore_results(&mut self, results: Results, stored: bool) {
        if self.run.is_some() || self.products.whole.is_some() {
            return;
        }
        let Results { materials, absent, masks, options, capture, reconstruction } = results;
        let charts = capture.charts.clone();
        let given = Arc::new(GivenLight::of(&capture));
        let masks = Arc::new(masks);
        let of = Edit { materials, absent, masks, charts, options, given, ..(*self.edit).clone() };
        let of_run = Some((Arc::new(of), capture.clone()));
        self.products = Products { of: of_run, ..Products::default() };
        self.products.finish(&capture, reconstruction);
        self.products.stored = stored;
    }

    /// Results that are in no file of the project. While a run is under way they are those before
    /// it.
    pub fn unsaved_results(&self) -> Option<&Arc<Reconstruction>> {
        Some(self.settled()).filter(|own| !own.stored).and_then(|own| own.whole.as_ref())
    }

    fn settled(&self) -> &Products {
        self.run.as_ref().map_or(&self.products, |run| &run.previous)
    }

    /// Results are with the project's file, or on their way there.
    pub fn mark_results_saved(&mut self, whole: &Arc<Reconstruction>) {
        self.mark_results(whole, true);
    }

    /// They could not be written.
    pub fn mark_results_unsaved(&mut self, whole: &Arc<Reconstruction>) {
        self.mark_results(whole, false);
    }

    fn mark_results(&mut self, whole: &Arc<Reconstruction>, stored: bool) {
        let run = self.run.as_mut().map(|run| &mut run.previous);
        for products in std::iter::once(&mut self.products).chain(run) {
            if products.whole.as_ref().is_some_and(|own| Arc::ptr_eq(own, whole)) {
                products.stored = stored;
            }
        }
    }

    /// What it takes to write the results beside a project's file.
    pub fn storing(&self, folder: PathBuf) -> Option<StoreResults> {
        let products = self.settled();
        let (edit, capture) = products.of.clone()?;
        Some(StoreResults {
            folder,
            inputs: ProjectFile {
                capture: self.folder.clone(),
                tags: edit.tags(&capture),
                lights: Some(edit.given.values(&capture)),
                environment: Some(edit.given.environment),
                charts: Some(chart_values(&edit.charts, &[], &capture)),
                masks: (*edit.masks).clone(),
                options: edit.options.clone(),
                ..ProjectFile::default()
            },
            capture,
            reconstruction: products.whole.clone()?,
            load_secs: self.load_secs,
        })
    }

    /// The capture that indices in the products refer to.
    pub fn result_capture(&self) -> &Arc<Capture> {
        self.products.of.as_ref().map_or(&self.capture, |(_, capture)| capture)
    }

    /// The colours of the materials of the capture.
    pub fn colors(&self) -> MaterialColors {
        MaterialColors { listed: self.edit.listed() }
    }

    /// Those of the results: as the list has materials of these names now, or had them then.
    pub fn result_colors(&self) -> MaterialColors {
        let Some((edit, capture)) = &self.products.of else { return self.colors() };
        let now = |name: &str| self.edit.materials.iter().position(|own| own.name == name);
        let then = edit.listed();
        let names = capture.materials.iter().map(|own| own.name.as_str()).enumerate();
        let place = |(index, name)| now(name).or(then.get(index).copied()).unwrap_or(index);
        MaterialColors { listed: names.map(place).collect() }
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
            Update::Reused(stage) => run.kept.push(stage),
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
            colors: self.colors(),
            result_colors: self.result_colors(),
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
            charts: self.edit.charts.clone(),
            selected_chart: self.selection.chart,
            things: self.edit.things(),
            selected_added: self.selection.added,
            solved: self.products.solved.clone(),
            relit: None,
        }
    }
}

#[cfg(test)]
mod tests;
