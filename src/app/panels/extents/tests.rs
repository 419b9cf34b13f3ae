use glam::Vec3;

use super::Extents;
use crate::geometry::mesh::Mesh;

#[test]
fn triangles_and_areas_are_summed_over_surfaces() {
    // A rectangle of 2 m by 3 m on surface 2, half of another of 1 m by 1 m on surface 0.
    let mesh = Mesh {
        positions: vec![
            Vec3::ZERO,
            Vec3::new(2.0, 0.0, 0.0),
            Vec3::new(2.0, 3.0, 0.0),
            Vec3::new(0.0, 3.0, 0.0),
            Vec3::new(0.0, 0.0, 1.0),
            Vec3::new(1.0, 0.0, 1.0),
            Vec3::new(0.0, 1.0, 1.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6]],
        surface: vec![2, 2, 0],
        polygon: vec![0, 0, 1],
        texcoords: Vec::new(),
    };
    let own = Extents::of(&mesh);
    assert_eq!(own.size, Some(Vec3::new(2.0, 3.0, 1.0)));
    assert_eq!(own.sum(&[2].into()), (2, 6.0));
    assert_eq!(own.sum(&[0].into()), (1, 0.5));
    assert_eq!(own.sum(&[0, 1, 2, 9].into()), (3, 6.5));
    assert_eq!(own.sum(&[].into()), (0, 0.0));
    assert_eq!(Extents::of(&Mesh::default()).size, None);
}
