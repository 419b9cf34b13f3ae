//! The threads that find where charts are and read their patches, so that no frame waits for them.

use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui;
use glam::DMat3;

use crate::app::pending::{Answer, Pending};
use crate::app::project::Project;
use crate::io::capture::TAGS;
use crate::io::chart_table;
use crate::io::tags::pin::Changed;
use crate::scene::charts::{self, Chart, ChartKind, ColorFit, LaidChart, PatchReading, Table};
use crate::scene::{Capture, Image};

/// What is being found out about the charts of the open project.
#[derive(Default)]
pub struct Charts {
    placing: Option<Placing>,
    table: Option<Pending<Result<(ChartKind, Table), String>>>,
    matrix: Option<Pending<Result<(), String>>>,
    reading: Option<(ReadingInputs, Pending<Vec<ViewReading>>)>,
    read: Option<(ReadingInputs, Vec<ViewReading>)>,
}

/// Charts whose positions are being found.
struct Placing {
    name: &'static str,
    /// With the positions before, where there are any.
    wanted: Arc<Vec<LaidChart>>,
    /// The state that they take the place of.
    of: Arc<Vec<LaidChart>>,
    opened: Arc<Capture>,
    answer: Pending<Vec<LaidChart>>,
}

impl Placing {
    /// Whether it is about the present state of a project.
    fn is_of(&self, project: &Project) -> bool {
        Arc::ptr_eq(&self.of, &project.edit().charts) && Arc::ptr_eq(&self.opened, &project.opened)
    }
}

/// A chart and the photographs that it is read in.
struct ReadingInputs {
    chart: Chart,
    images: Vec<Option<Arc<Image>>>,
}

impl ReadingInputs {
    fn are(&self, chart: &Chart, images: &[Option<Arc<Image>>]) -> bool {
        let same = |(a, b): (&Option<Arc<Image>>, &Option<Arc<Image>>)| match (a, b) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        self.chart == *chart && self.images.iter().zip(images).all(same)
    }
}

/// What was read of a chart in one photograph; or why nothing can be.
pub type ViewReading = Result<(Vec<PatchReading>, Option<ColorFit>), String>;

/// Charts that have been placed, and what undo calls that.
pub struct Found {
    pub name: &'static str,
    pub charts: Arc<Vec<LaidChart>>,
}

impl Charts {
    /// The charts as they will be once those under way have been placed.
    pub fn wanted<'a>(&'a self, project: &'a Project) -> &'a Arc<Vec<LaidChart>> {
        let current = self.placing.as_ref().filter(|own| own.is_of(project));
        current.map_or(&project.edit().charts, |own| &own.wanted)
    }

    /// Whether positions are being found.
    pub fn is_placing(&self) -> bool {
        self.placing.is_some()
    }

    /// What was read of a chart, one entry a photograph; `None` while it is not known.
    pub fn reading(&self, chart: &Chart) -> Option<&[ViewReading]> {
        self.read.as_ref().filter(|(of, _)| of.chart == *chart).map(|(_, read)| read.as_slice())
    }

    /// Finds where charts are, in place of what was to be found before; gives them at once where all
    /// positions are known, as after one was removed.
    pub fn place(
        &mut self,
        ctx: &egui::Context,
        project: &Project,
        name: &'static str,
        charts: Vec<Chart>,
    ) -> Option<Found> {
        let known = |chart: &Chart| project.edit().charts.iter().find(|own| own.chart == *chart);
        let placed: Option<Vec<LaidChart>> = charts.iter().map(|own| known(own).cloned()).collect();
        if let Some(charts) = placed {
            self.placing = None;
            return Some(Found { name, charts: Arc::new(charts) });
        }
        let before = self.wanted(project).clone();
        let wanted = charts.iter().map(|chart| {
            let same = before.iter().find(|own| own.chart.name == chart.name);
            let placed = same.map_or_else(|| Err(String::new()), |own| own.placed.clone());
            LaidChart { chart: chart.clone(), placed }
        });
        let wanted = Arc::new(wanted.collect());
        let capture = project.loaded.clone();
        self.placing = Some(Placing {
            name,
            wanted,
            of: project.edit().charts.clone(),
            opened: project.opened.clone(),
            answer: Pending::start("charts", ctx, move || charts::find(&capture, charts)),
        });
        None
    }

    /// Takes charts that have been placed. What was undone meanwhile is not done again.
    pub fn placed(&mut self, project: &Project) -> Option<Found> {
        let answer = self.placing.as_ref()?.answer.answer();
        if answer == Answer::Waiting {
            return None;
        }
        let own = self.placing.take().filter(|own| own.is_of(project))?;
        match answer {
            Answer::Ready(charts) => Some(Found { name: own.name, charts: Arc::new(charts) }),
            Answer::Waiting | Answer::Lost => None,
        }
    }

    /// Reads the reflectances of a chart from a CSV file.
    pub fn read_table(&mut self, ctx: &egui::Context, file: PathBuf) {
        self.table = Some(Pending::start("chart table", ctx, move || {
            let table = chart_table::read(&file).map_err(|error| error.to_string())?;
            Ok((ChartKind::Table(file), table))
        }));
    }

    /// Takes a table that was read.
    pub fn table(&mut self) -> Option<Result<(ChartKind, Table), String>> {
        Pending::take(&mut self.table)
    }

    /// Writes into the `tags.json` of the project's capture that photographs are corrected by a matrix
    /// beyond what is done now; without one, that they are left as they are in their files.
    pub fn write_matrix(
        &mut self,
        ctx: &egui::Context,
        project: &Project,
        correction: Option<DMat3>,
    ) {
        let (file, capture) = (project.folder.join(TAGS), project.opened.clone());
        self.matrix = Some(Pending::start("colour matrix", ctx, move || {
            let write = || -> Result<(), crate::io::Error> {
                let mut changed = Changed::begin(&file, &capture)?;
                match &correction {
                    Some(correction) => changed.set_color_matrix(&capture.corrected_by(correction)),
                    None => changed.remove_color_matrix(),
                }
                changed.write()
            };
            write().map_err(|error| error.to_string())
        }));
    }

    /// What came of writing a matrix, once that is over.
    pub fn matrix(&mut self) -> Option<Result<(), String>> {
        Pending::take(&mut self.matrix)
    }

    /// Reads the patches of the selected chart where that is not done yet.
    pub fn follow_reading(&mut self, ctx: &egui::Context, project: &Project) {
        if let Some((_, pending)) = &self.reading {
            match pending.answer() {
                Answer::Waiting => {}
                Answer::Ready(read) => {
                    self.read = self.reading.take().map(|(of, _)| (of, read));
                }
                Answer::Lost => self.reading = None,
            }
        }
        let selected = project.selection.chart.and_then(|chart| self.wanted(project).get(chart));
        let Some(chart) = selected.map(|own| &own.chart) else { return };
        let image = |photograph: usize| project.capture.photographs.get(photograph)?.image.clone();
        let images: Vec<Option<Arc<Image>>> =
            chart.views.iter().map(|view| image(view.photograph)).collect();
        let is_known = |of: &ReadingInputs| of.are(chart, &images);
        if self.read.as_ref().is_some_and(|(of, _)| is_known(of))
            || self.reading.as_ref().is_some_and(|(of, _)| is_known(of))
        {
            return;
        }
        let of = ReadingInputs { chart: chart.clone(), images: images.clone() };
        let chart = chart.clone();
        let read = move || {
            let views = chart.views.iter().zip(&images);
            let one = |(view, image): (&charts::ChartView, &Option<Arc<Image>>)| {
                let image = image.as_ref().ok_or("it is no measurement of radiance")?;
                let readings = charts::read(image, &chart.table, view.corners_px)?;
                let fit = charts::fit(&chart.table, &readings);
                Ok((readings, fit))
            };
            views.map(one).collect()
        };
        self.reading = Some((of, Pending::start("chart patches", ctx, read)));
    }

    /// Nothing of this belongs to another project.
    pub fn forget(&mut self) {
        *self = Self::default();
    }
}
