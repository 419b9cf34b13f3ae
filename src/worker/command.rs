//! Commands: the jobs of the worker.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::exposures::MergeOptions;
use crate::geometry::bvh::RayCaster;
use crate::io;
use crate::io::brackets::{self, Series};
use crate::io::import::{self, Holds, Import, Survey, Writing};
use crate::io::truth::Truth;
use crate::reconstruct::lights::{LightKind, VirtualLight, VirtualLights};
use crate::reconstruct::lobes::{CoverageMask, coverage};
use crate::reconstruct::{self, Options, Reconstruction, StageCache};
use crate::scene::{Capture, Views, clutter};
use crate::study::{Findings, Study};
use crate::watch::{Cancelled, Watch};
use crate::worker::elsewhere::{self, SceneExport};
use crate::worker::event::JobEvent;
use crate::worker::memory;
use crate::worker::merge::{self, Merging};
use crate::worker::modelling::{self, Modelling};
use crate::worker::relight::{self, Relighting};
use crate::worker::render::{self, Rendering};
use crate::worker::store::StoreResults;

/// A job for the worker.
#[derive(Clone, Debug)]
pub enum Command {
    /// Read a capture's folder.
    Load {
        /// The folder.
        path: PathBuf,
    },
    /// Take a capture's JPEG, PNG and TIFF photographs for radiance by the curve of sRGB.
    TakeAsSrgb {
        /// Of the capture; its camera file is changed.
        folder: PathBuf,
    },
    /// Read cameras and mesh of other programs; nothing is written.
    Import {
        /// A file or folder of cameras.
        source: PathBuf,
        /// Where images and mesh are, and how they are read.
        options: Box<import::Options>,
    },
    /// Write what was imported as a capture.
    WriteCapture {
        /// What was read.
        import: Arc<Import>,
        /// Of the capture; made where it is missing.
        folder: PathBuf,
        /// What is copied, and whether a capture there is replaced.
        writing: Box<Writing>,
    },
    /// Prepare to compare what was imported with its photographs.
    Survey {
        /// What was read.
        import: Arc<Import>,
    },
    /// Compare one of the photographs with what was imported.
    CheckShot {
        /// What [`JobEvent::Surveyed`] gave.
        survey: Arc<Survey>,
        /// Index of the photograph among the import's.
        shot: usize,
    },
    /// Find what exposure series share: the response, shifts, whether their times are right.
    Investigate {
        /// The series, with the files of each.
        series: Vec<Series>,
        /// How response, shifts and weights are found.
        options: Box<MergeOptions>,
    },
    /// Reconstruct a loaded capture; with a cache from the first stage that differs from earlier
    /// runs.
    Reconstruct {
        /// As it is tagged.
        capture: Arc<Capture>,
        /// Of every stage.
        options: Box<Options>,
        /// Takes products from earlier runs, and this run's.
        stage_cache: Option<StageCache>,
    },
    /// Write a reconstruction into a folder, each file whole or not at all.
    Export {
        /// That it was made of.
        capture: Arc<Capture>,
        /// That it was made with.
        options: Box<Options>,
        /// What is written.
        reconstruction: Arc<Reconstruction>,
        /// Seconds that loading took, for the report.
        load_secs: f64,
        /// Made where it is missing.
        folder: PathBuf,
    },
    /// Find what each light of the bounding sphere sees of the photographed surfaces (Fig. 6).
    Cover {
        /// With the geometry and photographs.
        capture: Arc<Capture>,
        /// One mask is made for each.
        lights: Arc<VirtualLights>,
    },
    /// Find what stands before the known surfaces in the photographs.
    SuggestMasks {
        /// With the geometry and photographs.
        capture: Arc<Capture>,
        /// Evidence from which on a pixel is masked.
        threshold: f64,
    },
    /// Make pictures of a recovered scene.
    Render(Box<Rendering>),
    /// Show a recovered scene while it is changed, until cancelled.
    Relight(Relighting),
    /// Read results that were written, as far as pictures need them.
    ReadSolved {
        /// That they were made of.
        capture: Arc<Capture>,
        /// That they were written into.
        folder: PathBuf,
    },
    /// Read edits and the files that they name.
    ReadEdits {
        /// That the edits refer to.
        capture: Arc<Capture>,
        /// Where they are.
        source: EditSource,
    },
    /// Read the edits of a project, as far as they can be.
    ReadStoredEdits {
        /// That the edits refer to.
        capture: Arc<Capture>,
        /// The project's file: paths are relative to it.
        file: PathBuf,
        /// The edits in it.
        value: Box<serde_json::Value>,
    },
    /// Read the charts of a project, as far as they can be, and find their positions.
    ReadStoredCharts {
        /// As it was loaded.
        capture: Arc<Capture>,
        /// The project's file: paths are relative to it.
        file: PathBuf,
        /// The charts in it.
        values: Vec<serde_json::Value>,
    },
    /// Read the known lights of a project, as far as they can be.
    ReadStoredLights {
        /// Whose surfaces they name.
        capture: Arc<Capture>,
        /// The project's file: paths are relative to it.
        file: PathBuf,
        /// The lights in it.
        values: Vec<serde_json::Value>,
    },
    /// Write results beside a project's file.
    StoreResults(Box<StoreResults>),
    /// Read the results beside a project's file.
    ReadResults {
        /// As it was loaded.
        capture: Arc<Capture>,
        /// That they were written into.
        folder: PathBuf,
    },
    /// Make cameras and a mesh of photographs and strokes.
    Model(Modelling),
    /// Merge exposure series to images of radiance.
    Merge(Box<Merging>),
    /// Write a recovered scene for other programs.
    ExportScene(Box<SceneExport>),
    /// Carry out a study, or a part of one.
    Study(Box<Study>),
    /// Write what a study has found.
    WriteStudy {
        /// The runs that are done.
        findings: Box<Findings>,
        /// Made where it is missing.
        folder: PathBuf,
    },
    /// Read the `truth.json` of a capture's folder, if it has one; for studies alone.
    ReadTruth {
        /// Of the capture.
        folder: PathBuf,
    },
    /// Panics, to test that the worker goes on.
    #[cfg(test)]
    Panic,
}

/// Where edits are.
#[derive(Clone, Debug)]
pub enum EditSource {
    /// A file of their own.
    File(PathBuf),
    /// Within a file that holds other things, too.
    Value {
        /// That file: paths of objects are relative to it.
        file: PathBuf,
        /// The edits in it.
        value: Box<serde_json::Value>,
    },
}

impl Command {
    /// Carries the command out; what happens before its end goes to `emit`.
    pub(super) fn perform(self, watch: &Watch, emit: &(dyn Fn(JobEvent) + Sync)) -> JobEvent {
        match self {
            Self::Load { path } => match io::capture::load(&path, watch) {
                Ok(capture) => JobEvent::Loaded(Arc::new(capture)),
                Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                Err(error) if io::model::is_begun(&path) => {
                    JobEvent::Begun(path, error.to_string())
                }
                Err(error) if io::model::lacks_mesh(&path) => {
                    JobEvent::Meshless(path, error.to_string())
                }
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            Self::TakeAsSrgb { folder } => {
                match io::transforms::take_as_srgb(&folder.join("transforms.json")) {
                    Ok(_) => JobEvent::CamerasChanged(folder),
                    Err(error) => JobEvent::Failed(error.to_string()),
                }
            }
            Self::Model(job) => match modelling::perform(job, watch, emit) {
                Ok(event) => event,
                Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            Self::SuggestMasks { capture, threshold } => {
                match clutter::suggest(&capture, threshold, watch) {
                    Ok(masks) => JobEvent::MasksSuggested(Arc::new(masks)),
                    Err(Cancelled) => JobEvent::Cancelled,
                }
            }
            Self::Import { source, options } => match import::read(&source, &options, watch) {
                Ok(import) => JobEvent::Imported(Arc::new(import)),
                Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            Self::WriteCapture { import, folder, writing } => {
                // A capture in the way is for whoever asked to decide on.
                if !writing.replace && import::holds(&folder).is_ok_and(|own| own == Holds::Capture)
                {
                    return JobEvent::Occupied(folder);
                }
                match import::write(&import, &folder, &writing, watch) {
                    Ok(written) => JobEvent::CaptureWritten(folder, Arc::new(written)),
                    Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                    Err(error) => JobEvent::Failed(error.to_string()),
                }
            }
            Self::Survey { import } => match import::survey(import, watch) {
                Ok(survey) => JobEvent::Surveyed(Arc::new(survey)),
                Err(Cancelled) => JobEvent::Cancelled,
            },
            Self::CheckShot { survey, shot } => match import::check_shot(&survey, shot, watch) {
                Ok(check) => JobEvent::Checked(Arc::new(check)),
                Err(Cancelled) => JobEvent::Cancelled,
            },
            Self::Investigate { series, options } => {
                watch.begin(brackets::steps(&series) - series.len() as u64);
                match brackets::investigate(&series, None, &options, watch) {
                    Ok(found) => JobEvent::Investigated(Arc::new(found)),
                    Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                    Err(error) => JobEvent::Failed(error.to_string()),
                }
            }
            Self::Reconstruct { capture, options, stage_cache } => {
                let update = |update| emit(JobEvent::Update(update));
                if let Err(error) = memory::check(&capture, &options) {
                    return JobEvent::Failed(error.to_string());
                }
                let result = match &stage_cache {
                    Some(stage_cache) => {
                        reconstruct::run_cached(&capture, &options, stage_cache, watch, &update)
                    }
                    None => reconstruct::run(&capture, &options, watch, &update),
                };
                match result {
                    Ok(reconstruction) => JobEvent::Reconstructed(Arc::new(reconstruction)),
                    Err(reconstruct::Error::Cancelled(_)) => JobEvent::Cancelled,
                    Err(error) => JobEvent::Failed(error.to_string()),
                }
            }
            Self::Export { capture, options, reconstruction, load_secs, folder } => {
                let written = io::export::write(
                    &folder,
                    &capture,
                    &options,
                    &reconstruction,
                    load_secs,
                    watch,
                );
                match written {
                    Ok(()) => JobEvent::Exported(folder),
                    Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                    Err(error) => JobEvent::Failed(error.to_string()),
                }
            }
            Self::Cover { capture, lights } => match cover(&capture, &lights, watch) {
                Ok(masks) => JobEvent::Covered(Arc::new(masks)),
                Err(Cancelled) => JobEvent::Cancelled,
            },
            Self::Render(rendering) => match render::perform(&rendering, watch, emit) {
                Ok(event) => event,
                Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            Self::Relight(relighting) => {
                relight::perform(&relighting, watch, emit).unwrap_or(JobEvent::Cancelled)
            }
            Self::ReadSolved { capture, folder } => match io::solved::read(&folder, &capture) {
                Ok(solved) => JobEvent::Solved(Arc::new(solved)),
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            Self::ReadEdits { capture, source } => {
                let read = match source {
                    EditSource::File(file) => io::edits::read(&file, &capture),
                    EditSource::Value { file, value } => {
                        io::edits::of_value(&file, &value, &capture)
                    }
                };
                match read {
                    Ok((edits, warnings)) => {
                        edits.objects.iter().for_each(|object| object.mesh.prepare());
                        JobEvent::Edits(Arc::new(edits), warnings)
                    }
                    Err(error) => JobEvent::Failed(error.to_string()),
                }
            }
            Self::ReadStoredEdits { capture, file, value } => {
                match io::edits::stored(&file, &value, &capture) {
                    Ok(stored) => {
                        stored.edits.objects.iter().for_each(|object| object.mesh.prepare());
                        JobEvent::StoredEdits(Box::new(stored))
                    }
                    Err(error) => JobEvent::Failed(error.to_string()),
                }
            }
            Self::ReadStoredCharts { capture, file, values } => {
                let stored = io::tags::stored_charts(&file, &values, &capture);
                JobEvent::StoredCharts(Box::new(stored))
            }
            Self::ReadStoredLights { capture, file, values } => {
                let stored = io::tags::stored_lights(&file, &values, &capture);
                JobEvent::StoredLights(Box::new(stored))
            }
            Self::StoreResults(store) => match store.write(watch) {
                Ok(()) => JobEvent::Exported(store.folder),
                Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            Self::ReadResults { capture, folder } => match io::results::read(&folder, &capture) {
                Ok(results) => JobEvent::Results(Box::new(results)),
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            Self::Merge(merging) => match merge::perform(&merging, watch) {
                Ok(event) => event,
                Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            Self::ExportScene(scene_export) => match elsewhere::perform(&scene_export, watch) {
                Ok(event) => event,
                Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            Self::Study(study) => {
                let tell = |found| emit(JobEvent::Found(Box::new(found)));
                match study.perform(watch, &tell) {
                    Ok(lines) => JobEvent::Studied(lines),
                    Err(io::Error::Cancelled(_)) => JobEvent::Cancelled,
                    Err(error) => JobEvent::Failed(error.to_string()),
                }
            }
            Self::WriteStudy { findings, folder } => match write_study(&findings, &folder) {
                Ok(_) => JobEvent::Exported(folder),
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            Self::ReadTruth { folder } => match Truth::beside(&folder) {
                Ok(truth) => JobEvent::Truth(truth.map(Arc::new)),
                Err(error) => JobEvent::Failed(error.to_string()),
            },
            #[cfg(test)]
            Self::Panic => panic!("on purpose"),
        }
    }
}

fn write_study(findings: &Findings, folder: &Path) -> Result<Vec<String>, io::Error> {
    io::export::check_folder(folder)?;
    findings.write(folder)
}

/// Side of the masks that are shown, in pixels.
const MASK_PX: usize = 96;

fn cover(
    capture: &Capture,
    lights: &VirtualLights,
    watch: &Watch,
) -> Result<Vec<Option<CoverageMask>>, Cancelled> {
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(capture, &caster, watch)?;
    watch.begin((lights.lights.len() * MASK_PX) as u64);
    let mask = |light: &VirtualLight| {
        let is_disc = light.kind == LightKind::Sphere;
        is_disc.then(|| coverage(&views, light, MASK_PX, watch)).transpose()
    };
    lights.lights.iter().map(mask).collect()
}
