//! The mesh of an import: converted to metres, vertices joined, surfaces separated.

use std::path::Path;

use super::options::Surfaces;
use super::read::Reader;
use super::source::Source;
use super::world::Change;
use crate::io::mesh::{self, regions, weld};
use crate::io::obj::Geometry;
use crate::io::{Error, Fault, capture};

/// What was done to a mesh on its way in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tidied {
    /// Of the file, as far as faces use them.
    pub vertices: usize,
    /// Vertices that became one with another.
    pub joined: usize,
    /// Triangles that have no area, and are left out.
    pub degenerate: usize,
}

impl Reader<'_> {
    pub(super) fn mesh(&mut self, source: &Source, own: Option<Geometry>) -> Result<(), Error> {
        let by = self.options.surfaces.by();
        let geometry = match (&self.options.mesh, own, source) {
            (Some(file), ..) => Some(mesh::read(file, by)?),
            (None, Some(own), _) => Some(own),
            // A capture, or what nearly is one.
            (None, None, Source::Transforms(files)) => {
                let folder = files[0].parent().unwrap_or(Path::new(""));
                let file = capture::find_geometry(folder).ok();
                file.map(|file| mesh::read(&file, by)).transpose()?
            }
            _ => None,
        };
        let Some(mut geometry) = geometry else {
            self.import.warnings.push(
                "there is no mesh: give one by --mesh, or put it into the capture as scene.obj."
                    .to_owned(),
            );
            return Ok(());
        };
        Change::of_mesh(self.options).mesh(&mut geometry.mesh);
        let before = geometry.mesh.positions.len();
        weld::exactly(&mut geometry.mesh);
        let degenerate = weld::within(&mut geometry.mesh, self.options.weld_m as f32);
        let joined = before - geometry.mesh.positions.len();
        self.import.tidied = Tidied { vertices: before, joined, degenerate };
        if joined > 0 && self.options.weld_m > 0.0 {
            geometry.warnings.push(format!("{joined} vertices of the mesh were joined to others."));
        }
        if degenerate > 0 {
            geometry
                .warnings
                .push(format!("{degenerate} triangles without area left out of the mesh."));
        }
        if geometry.mesh.triangles.is_empty() {
            return Err(Error::Invalid(Fault::new(
                self.options.mesh.as_deref().unwrap_or(Path::new("mesh")),
                "",
                "no triangle of the mesh has any area after welding",
                "Give a smaller --weld, or the right unit",
            )));
        }
        let wanted = self.options.surfaces == Surfaces::Regions;
        if wanted || mesh::is_without_surfaces(&geometry) {
            let angle = self.options.planar_angle as f32;
            regions::split(&mut geometry, &regions::Options { angle, ..Default::default() });
        }
        self.import.warnings.append(&mut geometry.warnings);
        self.import.warnings.append(&mut geometry.library_warnings);
        self.import.geometry = Some(geometry);
        Ok(())
    }
}
