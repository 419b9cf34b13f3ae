//! The results of a project's last run, in a folder beside its file: everything that the export
//! writes, `run.bin` with what the studio shows besides, and `inputs.lobelia` with the tags and
//! options that they were found with.

mod run;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::read_bounded;
use super::project::{self, Absent, ProjectFile};
use super::{Error, Fault, atomic, export, solved, tags};
use crate::reconstruct::{Options, Reconstruction};
use crate::render::scene::Solved;
use crate::scene::{Capture, Material};
use crate::watch::Watch;

const INPUTS: &str = "inputs.lobelia";
const RUN: &str = "run.bin";
/// The coupling of thousands of samples and lobes has some hundred megabytes.
const LARGEST: u64 = 16 << 30;

/// Results as they are read back.
#[derive(Clone, Debug)]
pub struct Results {
    /// In the order of the list, with those without surfaces.
    pub materials: Vec<Material>,
    /// Surfaces that the tags name and the capture lacks.
    pub absent: Absent,
    /// That the run was made with.
    pub masks: project::Masks,
    /// Of the run.
    pub options: Options,
    /// As it was tagged for the run.
    pub capture: Arc<Capture>,
    /// What the run gave.
    pub reconstruction: Arc<Reconstruction>,
}

/// The folder beside a project's file.
pub fn folder_of(project: &Path) -> PathBuf {
    with_end(project, "-data")
}

fn with_end(path: &Path, end: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(end);
    PathBuf::from(name)
}

/// Writes results into a folder, which takes the place of the one before once it is whole.
pub fn write(
    folder: &Path,
    inputs: &ProjectFile,
    capture: &Capture,
    reconstruction: &Reconstruction,
    load_secs: f64,
    watch: &Watch,
) -> Result<(), Error> {
    let failed = |source| Error::Write { file: folder.to_owned(), source };
    let is_foreign = folder.exists() && !folder.join(INPUTS).is_file();
    if is_foreign && std::fs::read_dir(folder).map_err(failed)?.next().is_some() {
        return Err(Error::Invalid(Fault::new(
            folder,
            "",
            "results belong here, and other files are in the way",
            "Move that folder away, or save the project under another name",
        )));
    }
    let parent = folder.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(parent).map_err(failed)?;
    let mut builder = tempfile::Builder::new();
    let part = builder.prefix(".lobelia-").suffix(".part").tempdir_in(parent).map_err(failed)?;
    project::write(&part.path().join(INPUTS), inputs)?;
    let bytes = run::bytes(capture, reconstruction);
    atomic::write_bytes(&part.path().join(RUN), &bytes)?;
    export::write(part.path(), capture, &inputs.options, reconstruction, load_secs, watch)?;
    // Between these two steps the results before are found under the other name.
    let former = with_end(folder, "~");
    if folder.exists() {
        let _ = std::fs::remove_dir_all(&former);
        std::fs::rename(folder, &former).map_err(failed)?;
    }
    std::fs::rename(part.path(), folder).map_err(failed)?;
    // It has another name by now.
    let _ = part.keep();
    let _ = std::fs::remove_dir_all(&former);
    Ok(())
}

/// Removes results that nobody wants.
pub fn remove(folder: &Path) {
    for folder in [folder.to_owned(), with_end(folder, "~")] {
        if folder.join(INPUTS).is_file() {
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}

/// Reads the results of a folder for a capture as it was loaded.
pub fn read(folder: &Path, loaded: &Capture) -> Result<Results, Error> {
    let former = with_end(folder, "~");
    let folder = if folder.exists() || !former.exists() { folder } else { &former };
    let inputs_file = folder.join(INPUTS);
    let inputs = project::read(&inputs_file)?;
    let charts = inputs.charts.map(|values| tags::stored_charts(&inputs_file, &values, loaded));
    let loaded = charts.as_ref().map_or(loaded, |stored| &*stored.capture);
    let lights = inputs.lights.map_or_else(
        || loaded.lights.clone(),
        |values| tags::stored_lights(&inputs_file, &values, loaded).lights,
    );
    let environment = inputs.environment.unwrap_or(loaded.environment);
    let lit = project::lit(loaded, &lights, environment);
    let resolved = project::materials(&inputs.tags, &lit);
    let mut capture = project::tagged(&lit, &resolved.materials);
    project::put_masks(&mut capture, &inputs.masks, None);
    let file = folder.join(RUN);
    let bytes = read_bounded(&file, LARGEST)?;
    let mut reconstruction = run::parse(&file, &bytes, &capture, &inputs.options)?;
    let solved =
        Solved { reflectances: reconstruction.solution.reflectances.clone(), ..Solved::default() };
    reconstruction.textures = Arc::new(solved::textures(folder, &capture, &solved)?);
    Ok(Results {
        materials: resolved.materials,
        absent: resolved.absent,
        masks: inputs.masks,
        options: inputs.options,
        capture: Arc::new(capture),
        reconstruction: Arc::new(reconstruction),
    })
}
