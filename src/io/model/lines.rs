//! The lines in a capture's photographs, and the parts of them that faces of a model hide.

use std::path::{Path, PathBuf};

use super::{NAME, geometry, orientation};
use crate::geometry::bvh::RayCaster;
use crate::io::import::{self, Shown};
use crate::io::{Error, Fault, inside};
use crate::model::lines::{self, Line, Picture};
use crate::model::things::Face;

/// Longer side of a photograph that is looked at and searched for lines, in pixels; larger ones are
/// made smaller by averaging.
pub const LONGEST: usize = 3072;

/// The file of a photograph of a capture.
pub fn photograph(folder: &Path, name: &str) -> Result<PathBuf, Error> {
    inside::join(folder, name).ok_or_else(|| {
        Error::Invalid(Fault::new(
            &folder.join(NAME),
            name,
            "this photograph lies outside of the capture",
            "Put it into the capture's folder, and correct its path",
        ))
    })
}

/// Reads a photograph of a capture for the screen.
pub fn show(folder: &Path, name: &str, longest: usize) -> Result<Shown, Error> {
    import::show(&photograph(folder, name)?, orientation(folder, name)?, longest)
}

/// The lines of a photograph of a capture.
pub fn lines_of(folder: &Path, name: &str) -> Result<Vec<Line>, Error> {
    Ok(lines(&show(folder, name, LONGEST)?))
}

/// The lines of a photograph that was read.
pub fn lines(shown: &Shown) -> Vec<Line> {
    let Shown { step, width, height, ref pixels } = *shown;
    lines::detect(&Picture { pixels, width, height, step })
}

/// What hides what is behind some faces; `None` without any, and where they make no mesh.
pub fn caster(faces: &[Face]) -> Option<RayCaster> {
    if faces.is_empty() {
        return None;
    }
    let mesh = geometry(Path::new(NAME), faces).ok()?.mesh;
    Some(RayCaster::build(&mesh.positions, &mesh.triangles))
}
