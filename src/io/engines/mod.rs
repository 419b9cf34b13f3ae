//! Cameras found automatically: an engine of structure from motion that is installed on the
//! computer is run as a program of its own, never linked.
//!
//! ```text
//! installed   which engines there are, and the line that installs one that is missing
//!   -> pictures   the photographs as upright JPEG files in a temporary folder
//!   -> child      the program: its log, silence, cancellation
//!   -> result     the COLMAP model that it wrote, checked and read by the importer
//! ```
//!
//! What comes back is in coordinates of the engine's own: photographs tell neither scale nor which
//! way is up.

mod child;
mod installed;
mod pictures;
mod progress;
mod result;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use super::orientation::Orientation;
use super::{Error, Fault};
use crate::model::FoundCameras;
use crate::watch::Watch;

pub use installed::{Installed, Places, look};

/// An engine of structure from motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// The Python package openmvg-rs.
    OpenMvg,
    /// The Python package pycolmap: COLMAP without its window.
    PyColmap,
    /// COLMAP as an installed program.
    Colmap,
}

impl Engine {
    /// In the order in which they are taken where the choice is left open.
    pub const ALL: [Self; 3] = [Self::OpenMvg, Self::PyColmap, Self::Colmap];

    /// The name by which it is known and asked for.
    pub fn name(self) -> &'static str {
        match self {
            Self::OpenMvg => "openmvg-rs",
            Self::PyColmap => "pycolmap",
            Self::Colmap => "colmap",
        }
    }

    /// The engine of a name.
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|own| own.name() == name)
    }

    /// The Python module, of those that are one.
    fn module(self) -> Option<&'static str> {
        match self {
            Self::OpenMvg => Some("openmvg_rs"),
            Self::PyColmap => Some("pycolmap"),
            Self::Colmap => None,
        }
    }
}

/// How cameras are looked for.
#[derive(Clone, Debug)]
pub struct Search {
    /// `None` takes the first that is installed.
    pub engine: Option<Engine>,
    /// All photographs of one size have the same lens; else each has one of its own.
    pub is_shared: bool,
    /// An engine that writes nothing for so long is stopped.
    pub silence: Duration,
    /// Where engines are looked for.
    pub places: Places,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            engine: None,
            is_shared: true,
            silence: Duration::from_secs(600),
            places: Places::of_system(),
        }
    }
}

/// A photograph that is to be placed.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject {
    /// Where it is.
    pub file: PathBuf,
    /// How its pixels are turned.
    pub orientation: Orientation,
    /// Width and height in pixels, upright.
    pub size: (usize, usize),
    /// Its focal length in pixels, to begin with.
    pub focal_px: Option<f64>,
}

/// What is told while an engine runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Told {
    /// A step of its work begins.
    Step(String),
    /// A line of its log.
    Line(String),
}

/// The engine that a search takes; an error with the line that installs it where it is missing.
pub fn choose(search: &Search) -> Result<Installed, Error> {
    let all = look(&search.places);
    let missing = |engine: &Installed, problem: String| {
        let remedy = format!(
            "Install it in a terminal: {}. Or place the photographs by lines and corners",
            engine.install
        );
        Error::Missing(Fault::new(Path::new(engine.engine.name()), "", problem, remedy))
    };
    match search.engine {
        Some(wanted) => {
            let own = all.into_iter().find(|own| own.engine == wanted);
            let own = own.filter(|own| own.program.is_some());
            own.ok_or_else(|| {
                let own = search.places.missing(wanted);
                missing(&own, "this engine is not installed".to_owned())
            })
        }
        None => {
            let found = all.iter().find(|own| own.program.is_some()).cloned();
            found.ok_or_else(|| {
                let problem = "no engine that finds cameras is installed".to_owned();
                missing(&search.places.missing(Engine::OpenMvg), problem)
            })
        }
    }
}

/// Finds the cameras of photographs; those that could not be placed have none. `watch` counts the
/// units of each step; `tell` is handed the log.
pub fn find(
    photographs: &[Subject],
    search: &Search,
    watch: &Watch,
    tell: &dyn Fn(Told),
) -> Result<FoundCameras, Error> {
    let installed = choose(search)?;
    let engine = installed.engine;
    let program = installed.program.unwrap_or_default();
    let wrong = |problem: String, remedy: &str| {
        Error::Invalid(Fault::new(Path::new(engine.name()), "", problem, remedy))
    };
    if photographs.len() < 2 {
        let remedy = "Place this one by lines along the axes, or by the corners of a box or room";
        return Err(wrong("it needs two photographs or more".to_owned(), remedy));
    }
    let folder = tempfile::Builder::new()
        .prefix("lobelia-cameras-")
        .tempdir()
        .map_err(|source| Error::Write { file: std::env::temp_dir(), source })?;
    tell(Told::Step("Preparing the photographs".to_owned()));
    let pictures = pictures::write(folder.path(), photographs, engine, search.is_shared, watch)?;
    let out = folder.path().join("out");
    std::fs::create_dir_all(out.join("sparse"))
        .map_err(|source| Error::Write { file: out.clone(), source })?;
    let mut steps = progress::Steps::new(watch, tell, photographs.len());
    for command in commands(engine, &program, folder.path(), &out)? {
        let ended = child::run(engine, command, search.silence, watch, &mut |line| {
            steps.take(line);
        })?;
        if !ended.is_success {
            // A mapper that finds nothing ends as a failure in some releases.
            let nothing = result::models(&out).is_empty() && ended.found_nothing();
            let problem = match nothing {
                true => "it found no photographs that show the same points".to_owned(),
                false => format!("it stopped with an error: {}", ended.reason()),
            };
            return Err(wrong(problem, REMEDY));
        }
    }
    watch.check()?;
    tell(Told::Step("Reading the cameras".to_owned()));
    result::read(engine, &out, &pictures, photographs, watch)
}

/// What helps where an engine fails.
const REMEDY: &str = "It needs photographs that overlap and show texture; bare walls have none. \
                      Place the cameras by lines and corners instead, or try another engine";

/// The programs to be run one after the other.
fn commands(
    engine: Engine,
    program: &Path,
    folder: &Path,
    out: &Path,
) -> Result<Vec<Command>, Error> {
    let pictures = folder.join(pictures::FOLDER);
    let script = match engine {
        Engine::OpenMvg => include_str!("openmvg.py"),
        Engine::PyColmap => include_str!("pycolmap.py"),
        Engine::Colmap => return Ok(colmap(program, &pictures, out)),
    };
    // Not called like the module that it imports.
    let file = folder.join("find_cameras.py");
    super::atomic::write_bytes(&file, script.as_bytes())?;
    let mut command = Command::new(program);
    command.arg("-u").arg(&file).arg(&pictures).arg(out);
    Ok(vec![command])
}

fn colmap(program: &Path, pictures: &Path, out: &Path) -> Vec<Command> {
    let database = out.join("database.db");
    let begin = |name: &str| {
        let mut command = Command::new(program);
        command.env("QT_QPA_PLATFORM", "offscreen");
        command.arg(name).arg("--database_path").arg(&database);
        command
    };
    // Version 3.12 has renamed the options of the graphics card.
    let gpu = |name: &str, old: &str, new: &str| {
        let help = Command::new(program).args([name, "-h"]).output();
        let is_new = help.is_ok_and(|own| {
            [own.stdout, own.stderr].iter().any(|text| String::from_utf8_lossy(text).contains(new))
        });
        format!("--{}", if is_new { new } else { old })
    };
    let mut extract = begin("feature_extractor");
    extract.arg("--image_path").arg(pictures);
    extract.args(["--ImageReader.single_camera_per_folder", "1"]);
    extract.args(["--ImageReader.camera_model", "RADIAL"]);
    let own = gpu("feature_extractor", "SiftExtraction.use_gpu", "FeatureExtraction.use_gpu");
    extract.args([&own, "0"]);
    let mut matching = begin("exhaustive_matcher");
    let own = gpu("exhaustive_matcher", "SiftMatching.use_gpu", "FeatureMatching.use_gpu");
    matching.args([&own, "0"]);
    let mut mapper = begin("mapper");
    mapper.arg("--image_path").arg(pictures);
    mapper.arg("--output_path").arg(out.join("sparse"));
    mapper.args(["--Mapper.min_model_size", "2"]);
    vec![extract, matching, mapper]
}
