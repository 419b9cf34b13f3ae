//! A mesh before it is written, with a person 1.7 m tall beside it, so that a wrong unit is visible
//! at once.

use std::f32::consts::TAU;
use std::sync::Arc;

use glam::Vec3;

use super::Import;
use crate::geometry::mesh::Mesh;
use crate::scene::{Capture, Photograph, Role, Surface};

/// How tall the person is, in metres.
pub const TALL_M: f32 = 1.7;
/// Corners of a cross-section.
const AROUND: u32 = 12;
/// Cross-sections of a part of the body: height, half width and half depth in metres.
type Rings = &'static [[f32; 3]];
/// The parts, with how far to the side they are.
const BODY: [(f32, Rings); 6] = [
    (
        0.0,
        &[
            [1.47, 0.03, 0.03],
            [1.50, 0.06, 0.07],
            [1.58, 0.08, 0.095],
            [1.65, 0.07, 0.08],
            [TALL_M, 0.02, 0.02],
        ],
    ),
    (
        0.0,
        &[
            [0.78, 0.12, 0.09],
            [0.90, 0.17, 0.11],
            [1.10, 0.13, 0.10],
            [1.35, 0.19, 0.11],
            [1.43, 0.16, 0.08],
            [1.49, 0.05, 0.05],
        ],
    ),
    (0.09, &[[0.0, 0.05, 0.11], [0.07, 0.045, 0.06], [0.45, 0.055, 0.06], [0.85, 0.085, 0.09]]),
    (-0.09, &[[0.0, 0.05, 0.11], [0.07, 0.045, 0.06], [0.45, 0.055, 0.06], [0.85, 0.085, 0.09]]),
    (0.24, &[[0.72, 0.03, 0.045], [0.90, 0.035, 0.04], [1.20, 0.045, 0.045], [1.41, 0.05, 0.05]]),
    (-0.24, &[[0.72, 0.03, 0.045], [0.90, 0.035, 0.04], [1.20, 0.045, 0.045], [1.41, 0.05, 0.05]]),
];

/// The mesh with the person beside it, a colour for each surface, and the cameras.
pub(super) fn scene(import: &Import) -> Capture {
    let mut mesh = import.geometry.as_ref().map(|own| own.mesh.clone()).unwrap_or_default();
    let mut surfaces: Vec<Surface> =
        import.geometry.as_ref().map(|own| own.surfaces.clone()).unwrap_or_default();
    for (index, surface) in surfaces.iter_mut().enumerate() {
        surface.role = Role::Material(index);
    }
    let role = Role::Luminaire(0);
    surfaces.push(Surface { name: "person, 1.7 m".to_owned(), role, has_texcoords: false });
    let positions = || import.shots.iter().map(|shot| shot.camera.position.as_vec3());
    let (low, high) = mesh.bounds().unwrap_or_else(|| {
        (positions().fold(Vec3::ZERO, Vec3::min), positions().fold(Vec3::ZERO, Vec3::max))
    });
    // Where the first view looks from, so that no wall hides it.
    let feet = Vec3::new(high.x + 0.6, 0.5 * (low.y + high.y), low.z);
    stand(&mut mesh, feet, surfaces.len() as u32 - 1);
    mesh.texcoords.clear();
    let photographs = import.shots.iter().map(|shot| Photograph {
        name: shot.name.clone(),
        camera: shot.camera,
        image: None,
        // All of them would be read for a view that is about the mesh.
        display: None,
    });
    Capture {
        photographs: photographs.collect(),
        mesh: Arc::new(mesh),
        surfaces,
        ..Capture::default()
    }
}

fn stand(mesh: &mut Mesh, feet: Vec3, surface: u32) {
    let mut polygon = mesh.polygon.iter().max().map_or(0, |last| last + 1);
    let face = |mesh: &mut Mesh, corners: &[u32], polygon: u32| {
        for k in 2..corners.len() {
            mesh.triangles.push([corners[0], corners[k - 1], corners[k]]);
            mesh.surface.push(surface);
            // All of a part is one polygon, so that no wireframe covers it.
            mesh.polygon.push(polygon);
        }
    };
    for (side, rings) in BODY {
        let base = mesh.positions.len() as u32;
        for [height, width, depth] in rings {
            for k in 0..AROUND {
                let (sin, cos) = (TAU * k as f32 / AROUND as f32).sin_cos();
                // The breadth is across the first view, from +x.
                let own = Vec3::new(depth * sin, side + width * cos, *height);
                mesh.positions.push(feet + own);
            }
        }
        let ring = |index: usize, k: u32| base + index as u32 * AROUND + k % AROUND;
        for index in 1..rings.len() {
            for k in 0..AROUND {
                let (a, b) = (ring(index - 1, k), ring(index - 1, k + 1));
                face(mesh, &[a, ring(index, k), ring(index, k + 1), b], polygon);
            }
        }
        let around = |index: usize| (0..AROUND).map(move |k| ring(index, k)).collect::<Vec<_>>();
        face(mesh, &around(0), polygon);
        face(mesh, &around(rings.len() - 1).into_iter().rev().collect::<Vec<_>>(), polygon);
        polygon += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_person_stands_beside_the_mesh_and_faces_outwards() {
        let capture = scene(&Import::default());
        let (low, high) = capture.mesh.bounds().unwrap();
        assert!((high.z - low.z - TALL_M).abs() < 1e-6 && low.z == 0.0);
        // Every part is closed and its faces look outwards: the volume is that of a person.
        let mesh = &capture.mesh;
        let volume: f32 = (0..mesh.triangles.len())
            .map(|triangle| {
                let [a, b, c] = mesh.corners(triangle).map(|corner| corner - low);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!((0.04..0.12).contains(&volume), "{volume} m³");
        assert_eq!(capture.surfaces.len(), 1);
    }
}
