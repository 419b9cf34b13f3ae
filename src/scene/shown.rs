//! What the pixels of a camera show of a mesh.

use glam::Vec3;
use rayon::prelude::*;

use super::{Camera, hits};
use crate::geometry::bvh::RayCaster;
use crate::geometry::mesh::Mesh;

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Index into `Mesh::triangles`.
    pub triangle: u32,
    /// The cosine between the way to the camera and the triangle's normal: from 0 to 1, whichever side
    /// is seen.
    pub facing: f32,
}

/// What a ray through the middle of each pixel meets first, row by row from the top; `None` where it
/// meets nothing, and where the lens sees nothing. `caster` holds the mesh's triangles.
pub fn seen(camera: &Camera, mesh: &Mesh, caster: &RayCaster) -> Vec<Option<Seen>> {
    let normals: Vec<Vec3> = (0..mesh.triangles.len()).map(|index| mesh.normal(index)).collect();
    let pixel = |index: usize| {
        let ray = hits::ray(camera, index % camera.width, index / camera.width)?;
        let triangle = caster.closest(&ray)?.triangle;
        let facing = normals[triangle as usize].dot(ray.direction).abs().min(1.0);
        Some(Seen { triangle, facing })
    };
    (0..camera.width * camera.height).into_par_iter().map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec2, DVec3};

    use super::*;

    /// A square of 2 m at 4 m distance, turned by 60°, and a smaller one before it that faces the
    /// camera; a lens with distortion sees both where it projects them.
    #[test]
    fn the_nearest_is_seen_where_it_is_projected() {
        let turn = DMat3::from_rotation_y(60_f64.to_radians());
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let large = corners.map(|(x, y)| turn * DVec3::new(x, y, 0.0) + DVec3::NEG_Z * 4.0);
        let small = corners.map(|(x, y)| DVec3::new(0.2 * x, 0.2 * y, -2.0));
        let positions: Vec<Vec3> = large.iter().chain(&small).map(|own| own.as_vec3()).collect();
        let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let mesh = Mesh {
            positions,
            surface: vec![0, 0, 1, 1],
            polygon: vec![0, 0, 1, 1],
            texcoords: Vec::new(),
            triangles,
        };
        let caster = RayCaster::build(&mesh.positions, &mesh.triangles);
        let distortion =
            crate::scene::Distortion { radial: [0.08, 0.0, 0.0, 0.0], ..Default::default() };
        let camera = Camera::new(
            (160, 120),
            DVec2::splat(110.0),
            DVec2::new(80.0, 60.0),
            distortion,
            DMat3::IDENTITY,
            DVec3::ZERO,
        );
        let seen = seen(&camera, &mesh, &caster);
        assert_eq!(seen.len(), 160 * 120);
        let at = |place: DVec3| {
            let (pixel, _) = camera.project(place).unwrap();
            seen[pixel.y as usize * 160 + pixel.x as usize]
        };
        let own = at(DVec3::new(0.1, 0.1, -2.0)).unwrap();
        assert!(mesh.surface[own.triangle as usize] == 1 && own.facing > 0.99, "{own:?}");
        let own = at(turn * DVec3::new(0.8, 0.8, 0.0) + DVec3::NEG_Z * 4.0).unwrap();
        assert!(mesh.surface[own.triangle as usize] == 0, "{own:?}");
        assert!((own.facing - 0.5).abs() < 0.2, "{own:?}");
        assert_eq!(seen[0], None, "past both");
        // Corners are where the camera projects them, to a pixel.
        for corner in small {
            let inside = at(corner * 1.0 - DVec3::new(corner.x, corner.y, 0.0) * 0.06);
            let outside = at(corner + DVec3::new(corner.x, corner.y, 0.0) * 0.06);
            let surface = |own: Option<Seen>| own.map(|own| mesh.surface[own.triangle as usize]);
            assert_eq!(surface(inside), Some(1));
            assert_ne!(surface(outside), Some(1));
        }
    }
}
