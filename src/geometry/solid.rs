//! A mesh with data that are computed from it once and used often: its bounding box and its ray
//! caster.

use std::ops::Deref;
use std::sync::OnceLock;

use glam::Vec3;

use super::bvh::RayCaster;
use super::mesh::Mesh;

/// A mesh that does not change.
#[derive(Default)]
pub struct Solid {
    mesh: Mesh,
    bounds: OnceLock<Option<(Vec3, Vec3)>>,
    caster: OnceLock<RayCaster>,
}

impl Solid {
    /// As of [`Mesh::bounds`].
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        *self.bounds.get_or_init(|| self.mesh.bounds())
    }

    /// Works everything out, which takes its time for large meshes.
    pub fn prepare(&self) {
        self.bounds();
        let build = || RayCaster::build(&self.mesh.positions, &self.mesh.triangles);
        self.caster.get_or_init(build);
    }

    /// What rays meet of it, once it is prepared.
    pub fn caster(&self) -> Option<&RayCaster> {
        self.caster.get()
    }
}

impl From<Mesh> for Solid {
    fn from(mesh: Mesh) -> Self {
        Self { mesh, ..Self::default() }
    }
}

impl Deref for Solid {
    type Target = Mesh;

    fn deref(&self) -> &Mesh {
        &self.mesh
    }
}

impl std::fmt::Debug for Solid {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.mesh.fmt(out)
    }
}
