//! Converts the coordinates of a source to those of a capture: metres, +z up.

use glam::{DMat3, DVec3};

use super::{Options, Shot};
use crate::geometry::mesh::Mesh;
use crate::io::transforms::Applied;
use crate::scene::Camera;

/// new = scale · rotation · old + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    rotation: DMat3,
    scale: f64,
}

impl Change {
    pub fn of_cameras(options: &Options) -> Self {
        Self { rotation: options.up.to_z(), scale: options.unit.0 * options.scale }
    }

    pub fn of_mesh(options: &Options) -> Self {
        let unit = options.mesh_unit.unwrap_or(options.unit);
        let up = options.mesh_up.unwrap_or(options.up);
        Self { rotation: up.to_z(), scale: unit.0 * options.scale }
    }

    pub fn shot(&self, shot: &mut Shot) {
        let position = self.point(shot.camera.position);
        shot.camera = moved(&shot.camera, self.rotation * shot.camera.world_from_camera, position);
    }

    pub fn point(&self, point: DVec3) -> DVec3 {
        self.scale * (self.rotation * point)
    }

    pub fn mesh(&self, mesh: &mut Mesh) {
        // Left alone to the bit where nothing is asked for.
        if *self == (Self { rotation: DMat3::IDENTITY, scale: 1.0 }) {
            return;
        }
        for position in &mut mesh.positions {
            *position = self.point(position.as_dvec3()).as_vec3();
        }
    }
}

fn moved(camera: &Camera, rotation: DMat3, position: DVec3) -> Camera {
    let size = (camera.width, camera.height);
    let (focal, principal) = (camera.focal_px, camera.principal_px);
    Camera::new(size, focal, principal, camera.distortion, rotation, position)
}

/// Takes back what nerfstudio has done to the coordinates; `None` where that cannot be.
pub(super) fn undo(applied: &Applied, camera: &Camera) -> Option<Camera> {
    let determinant = applied.linear.determinant();
    if !determinant.is_finite() || determinant < 1e-9 {
        return None;
    }
    let inverse = applied.linear.inverse();
    let position = inverse * (camera.position / applied.scale - applied.offset);
    let rotation = inverse * camera.world_from_camera;
    let rotation = crate::io::pose::orientation(rotation).ok()?.rotation;
    Some(moved(camera, rotation, position))
}
