//! Jobs of modelling: placing cameras and things by strokes, and what is drawn of them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec2, Vec3};

use crate::geometry::bvh::RayCaster;
use crate::geometry::mesh::Mesh;
use crate::io;
use crate::io::engines::{self, Places, Search, Subject};
use crate::io::import::Shown;
use crate::io::model::{self as files, NAME};
use crate::model::from_points::{self, Wanted};
use crate::model::lines::Line;
use crate::model::to_edges;
use crate::model::{
    AdjustOptions, Model, ModelError, Solution, Unsolved, solve_near, solve_watched,
};
use crate::scene::wireframe::{self, Stroke};
use crate::watch::{Cancelled, Watch};
use crate::worker::event::JobEvent;
use crate::worker::reprojection;

/// Edges that are drawn; of more only creases.
const MOST_EDGES: usize = 20_000;

/// A model with what its strokes say.
pub struct SolvedModel {
    /// What was solved.
    pub model: Arc<Model>,
    /// Cameras and things, or why nothing could be placed.
    pub outcome: Result<Solution, ModelError>,
    /// It was solved near another, for what is shown while something is dragged.
    pub is_preview: bool,
    /// Edges of the faces, in metres.
    edges: Vec<[Vec3; 2]>,
    /// The faces, with the ids of their surfaces.
    pub(super) mesh: Option<(Mesh, Vec<String>)>,
    /// What hides edges and faces.
    pub(super) caster: Option<RayCaster>,
}

/// The edges of a solved model as one photograph shows them.
#[derive(Debug)]
pub struct ModelDrawing {
    /// What is drawn.
    pub of: Arc<SolvedModel>,
    /// Index into `Model::photographs`.
    pub photograph: usize,
    /// None where the photograph is not placed.
    pub strokes: Vec<Stroke>,
}

/// A job of modelling.
#[derive(Clone, Debug)]
pub enum Modelling {
    /// Make a capture of photographs alone.
    Begin {
        /// New or empty.
        folder: PathBuf,
        /// The photographs.
        images: Vec<PathBuf>,
    },
    /// Read the model of a capture, or begin one.
    Open {
        /// The capture's folder.
        folder: PathBuf,
    },
    /// Say which engines that find cameras are installed.
    Engines(Places),
    /// Find the cameras of a model's photographs by an engine.
    FindCameras {
        /// The capture's folder.
        folder: PathBuf,
        /// Its photographs, with what is known of their lenses.
        model: Arc<Model>,
        /// Which engine, and how.
        search: Box<Search>,
    },
    /// Place everything by the strokes.
    Solve {
        /// What is solved.
        model: Arc<Model>,
        /// Solved before, with other strokes; given while something is dragged.
        near: Option<Arc<SolvedModel>>,
    },
    /// Draw what was placed as a photograph shows it.
    Draw {
        /// What [`JobEvent::ModelSolved`] gave.
        of: Arc<SolvedModel>,
        /// Index into `Model::photographs`.
        photograph: usize,
    },
    /// Draw the faces of what was placed as a photograph shows them.
    Reproject {
        /// What [`JobEvent::ModelSolved`] gave.
        of: Arc<SolvedModel>,
        /// Index into `Model::photographs`.
        photograph: usize,
    },
    /// Find the lines of a photograph.
    FindLines {
        /// As it was read.
        shown: Arc<Shown>,
        /// Index into `Model::photographs`.
        photograph: usize,
    },
    /// Find where a thing's outline lies on the lines of the photographs, or which of those lines
    /// are edges of all things.
    FitToEdges {
        /// The capture's folder.
        folder: PathBuf,
        /// What [`JobEvent::ModelSolved`] gave.
        of: Arc<SolvedModel>,
        /// Index into `Model::things`; `None` for the edges of all.
        thing: Option<usize>,
        /// By photograph, those that are known; others are found first.
        lines: BTreeMap<usize, Arc<Vec<Line>>>,
    },
    /// Fit a plane or a box to the points in an outline.
    FitToPoints {
        /// What [`JobEvent::ModelSolved`] gave.
        of: Arc<SolvedModel>,
        /// That the outline is drawn on, by its index.
        photograph: usize,
        /// In its pixels.
        outline: Vec<DVec2>,
        /// What is fitted.
        wanted: Wanted,
    },
    /// Write model, mesh and cameras into the capture.
    Use {
        /// The capture's folder.
        folder: PathBuf,
        /// What is written.
        of: Arc<SolvedModel>,
    },
    /// Read a photograph for the screen.
    Show {
        /// The capture's folder.
        folder: PathBuf,
        /// Its path in there.
        name: String,
        /// Longer side of what is shown, in pixels.
        longest: usize,
    },
}

impl std::fmt::Debug for SolvedModel {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("SolvedModel").field("outcome", &self.outcome).finish_non_exhaustive()
    }
}

/// What a fit to edges has found.
#[derive(Debug)]
pub struct EdgesFitted {
    /// What was fitted.
    pub of: Arc<SolvedModel>,
    /// Index into `Model::things`; `None` where the edges of all were found.
    pub thing: Option<usize>,
    /// The model then, or why nothing fits.
    pub outcome: Result<OnEdges, ModelError>,
    /// Of every photograph.
    pub lines: Vec<Arc<Vec<Line>>>,
}

/// A model that was fitted to edges.
#[derive(Debug)]
pub struct OnEdges {
    /// With strokes where they are then.
    pub model: Arc<Model>,
    /// What has changed.
    pub words: String,
}

/// What a fit to points has found.
#[derive(Debug)]
pub struct PointsFitted {
    /// What was solved before.
    pub of: Arc<SolvedModel>,
    /// The model with the new thing, or why there is none.
    pub outcome: Result<from_points::Fitted, ModelError>,
}

/// Carries a job out; an error in the words of the terminal.
pub(super) fn perform(
    job: Modelling,
    watch: &Watch,
    emit: &(dyn Fn(JobEvent) + Sync),
) -> Result<JobEvent, io::Error> {
    Ok(match job {
        Modelling::Begin { folder, images } => {
            files::new_capture(&folder, &images, watch)?;
            JobEvent::CaptureBegun(folder)
        }
        Modelling::Open { folder } => JobEvent::ModelOpened(Box::new(files::open(&folder)?)),
        Modelling::Engines(places) => JobEvent::Engines(engines::look(&places)),
        Modelling::FindCameras { folder, model, search } => {
            let photographs = subjects(&folder, &model)?;
            let tell = |told| emit(JobEvent::Told(told));
            let found = engines::find(&photographs, &search, watch, &tell)?;
            JobEvent::CamerasFound(Arc::new(found))
        }
        Modelling::Solve { model, near } => {
            JobEvent::ModelSolved(Arc::new(solved(model, near.as_deref(), watch)?))
        }
        Modelling::Draw { of, photograph } => {
            let strokes = drawn(&of, photograph, watch)?;
            JobEvent::ModelDrawn(Arc::new(ModelDrawing { of, photograph, strokes }))
        }
        Modelling::Reproject { of, photograph } => {
            JobEvent::ModelReprojected(Arc::new(reprojection::reprojected(of, photograph)))
        }
        Modelling::FindLines { shown, photograph } => {
            JobEvent::LinesFound(photograph, Arc::new(files::lines(&shown)))
        }
        Modelling::FitToEdges { folder, of, thing, lines } => {
            JobEvent::FittedToEdges(Arc::new(fitted(&folder, of, thing, &lines, watch)?))
        }
        Modelling::FitToPoints { of, photograph, outline, wanted } => {
            let outcome = match &of.outcome {
                Ok(solution) => from_points::fit(&of.model, solution, photograph, &outline, wanted),
                Err(error) => Err(error.clone()),
            };
            watch.check()?;
            JobEvent::FittedToPoints(Arc::new(PointsFitted { of, outcome }))
        }
        Modelling::Use { folder, of } => {
            write(&folder, &of)?;
            JobEvent::ModelUsed(of)
        }
        Modelling::Show { folder, name, longest } => {
            JobEvent::Shown(Arc::new(files::show(&folder, &name, longest)?))
        }
    })
}

fn subjects(folder: &Path, model: &Model) -> Result<Vec<Subject>, io::Error> {
    let subject = |own: &crate::model::Photograph| {
        Ok(Subject {
            file: files::photograph(folder, &own.name)?,
            orientation: io::model::orientation(folder, &own.name)?,
            size: own.size,
            focal_px: model.lenses.get(own.lens).and_then(|lens| lens.focal_px),
        })
    };
    model.photographs.iter().map(subject).collect()
}

/// An outcome, unless it was cancelled.
fn outcome<T>(result: Result<T, Unsolved>) -> Result<Result<T, ModelError>, Cancelled> {
    match result {
        Ok(value) => Ok(Ok(value)),
        Err(Unsolved::Model(error)) => Ok(Err(error)),
        Err(Unsolved::Cancelled(cancelled)) => Err(cancelled),
    }
}

fn solved(
    model: Arc<Model>,
    near: Option<&SolvedModel>,
    watch: &Watch,
) -> Result<SolvedModel, Cancelled> {
    let preview = near.and_then(|near| {
        let solution = near.outcome.as_ref().ok()?;
        solve_near(&model, (&near.model, solution))
    });
    let is_preview = preview.is_some();
    let outcome = match preview {
        Some(solution) => Ok(solution),
        None => outcome(solve_watched(&model, &AdjustOptions::default(), watch))?,
    };
    let faces = outcome.as_ref().map_or(&[][..], |solution| &solution.faces);
    // Faces of things that have run away make no mesh; then nothing is drawn of them.
    let mesh = reprojection::mesh(faces);
    let edges = mesh.as_ref().map_or_else(Vec::new, |own| wireframe::edges(&own.0, MOST_EDGES));
    let caster = mesh.as_ref().map(|(own, _)| RayCaster::build(&own.positions, &own.triangles));
    Ok(SolvedModel { model, outcome, is_preview, edges, mesh, caster })
}

fn fitted(
    folder: &Path,
    of: Arc<SolvedModel>,
    thing: Option<usize>,
    known: &BTreeMap<usize, Arc<Vec<Line>>>,
    watch: &Watch,
) -> Result<EdgesFitted, io::Error> {
    watch.begin(of.model.photographs.len() as u64);
    let mut lines = Vec::new();
    for (index, own) in of.model.photographs.iter().enumerate() {
        watch.tick()?;
        lines.push(match known.get(&index) {
            Some(lines) => lines.clone(),
            None => Arc::new(files::lines_of(folder, &own.name)?),
        });
    }
    let model = &of.model;
    let on_edges = |solution: &Solution| -> Result<OnEdges, Unsolved> {
        let (model, words) = match thing {
            Some(thing) => {
                let fitted = to_edges::fit(model, solution, thing, &lines, files::caster, watch)?;
                let words = fitted.words(&model.things[thing].id);
                (fitted.model, words)
            }
            None => {
                let found = to_edges::find(model, solution, &lines, files::caster, watch)?;
                let words = found.words();
                (found.model, words)
            }
        };
        Ok(OnEdges { model: Arc::new(model), words })
    };
    let solution = of.outcome.as_ref().map_err(|error| Unsolved::from(error.clone()));
    let outcome = outcome(solution.and_then(on_edges))?;
    Ok(EdgesFitted { of, thing, outcome, lines })
}

fn drawn(of: &SolvedModel, photograph: usize, watch: &Watch) -> Result<Vec<Stroke>, Cancelled> {
    let solution = of.outcome.as_ref().ok();
    match solution.and_then(|own| own.cameras.get(photograph)?.as_ref()) {
        Some(camera) => wireframe::strokes(camera, &of.edges, of.caster.as_ref(), watch),
        None => Ok(Vec::new()),
    }
}

/// Writes `model.json`, then mesh and cameras as `lobelia model` does. A mesh of another program is
/// not written over.
fn write(folder: &Path, of: &SolvedModel) -> Result<(), io::Error> {
    let fault = |error: &ModelError| {
        let file = folder.join(NAME);
        io::Error::Invalid(io::Fault::new(&file, &*error.place, &*error.problem, &*error.remedy))
    };
    let solution = of.outcome.as_ref().map_err(fault)?;
    if let Some(problem) = solution.problems.first() {
        return Err(fault(problem));
    }
    let mesh = folder.join("scene.obj");
    files::check_own(&mesh)?;
    files::save(folder, &of.model)?;
    files::write_obj(&mesh, &solution.faces)?;
    files::write_cameras(&folder.join("transforms.json"), &of.model, &solution.cameras)
}
