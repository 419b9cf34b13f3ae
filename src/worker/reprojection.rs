//! What a photograph would show of the things that were placed.

use std::path::Path;
use std::sync::Arc;

use crate::geometry::mesh::Mesh;
use crate::io::model::{self as files, NAME};
use crate::model::things::Face;
use crate::scene::shown::seen;
use crate::worker::modelling::SolvedModel;

/// Longer side of the picture at most, in pixels.
const LONGEST: usize = 960;

/// The faces of a solved model as one photograph shows them.
pub struct Reprojection {
    /// What is shown.
    pub of: Arc<SolvedModel>,
    /// Index into `Model::photographs`.
    pub photograph: usize,
    /// Pixels of a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels of the photograph along a side of one of these.
    pub step: usize,
    /// Index into `surfaces`, and how much the face looks towards the camera, from 0 to 1; `None`
    /// where no face is seen.
    pub pixels: Vec<Option<(u32, f32)>>,
    /// The ids of the surfaces.
    pub surfaces: Vec<String>,
}

impl std::fmt::Debug for Reprojection {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Reprojection")
            .field("photograph", &self.photograph)
            .field("size", &(self.width, self.height))
            .finish_non_exhaustive()
    }
}

/// The mesh of some faces with the names of its surfaces; `None` where they make none.
pub(super) fn mesh(faces: &[Face]) -> Option<(Mesh, Vec<String>)> {
    if faces.is_empty() {
        return None;
    }
    let own = files::geometry(Path::new(NAME), faces).ok()?;
    let names = own.surfaces.into_iter().map(|surface| surface.name).collect();
    Some((own.mesh, names))
}

/// What a photograph shows; without a pixel where it is not placed.
pub(super) fn reprojected(of: Arc<SolvedModel>, photograph: usize) -> Reprojection {
    let solution = of.outcome.as_ref().ok();
    let camera = solution.and_then(|own| own.cameras.get(photograph)?.as_ref());
    let (mut size, mut step, mut pixels) = ((0, 0), 1, Vec::new());
    if let (Some(camera), Some((mesh, _)), Some(caster)) = (camera, &of.mesh, &of.caster) {
        step = camera.width.max(camera.height).div_ceil(LONGEST).max(1);
        let camera = camera.reduced(step);
        size = (camera.width, camera.height);
        let seen = seen(&camera, mesh, caster).into_iter();
        let pixel =
            |own: crate::scene::shown::Seen| (mesh.surface[own.triangle as usize], own.facing);
        pixels = seen.map(|own| own.map(pixel)).collect();
    }
    let surfaces = of.mesh.as_ref().map_or_else(Vec::new, |own| own.1.clone());
    let (width, height) = size;
    Reprojection { of, photograph, width, height, step, pixels, surfaces }
}
