//! The known geometry as triangles, each belonging to a surface and to an input polygon.

use glam::{Vec2, Vec3};

/// Triangles of the partial geometric model, in metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The surface (`usemtl` group) of each triangle.
    pub surface: Vec<u32>,
    /// The input polygon of each triangle, numbered over the whole mesh; polygons are planar.
    pub polygon: Vec<u32>,
    /// Texture coordinates of each triangle's corners, or empty where no surface has any.
    /// Zero on triangles whose surface has none.
    pub texcoords: Vec<[Vec2; 3]>,
}

impl Mesh {
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|vertex| self.positions[vertex as usize])
    }

    /// Unit normal by winding; zero for a triangle without area.
    pub fn normal(&self, triangle: usize) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Area in m².
    pub fn area(&self, triangle: usize) -> f32 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Smallest and largest corner of the box around the triangles; `None` without any.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut corners =
            self.triangles.iter().flatten().map(|&vertex| self.positions[vertex as usize]);
        let first = corners.next()?;
        Some(corners.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
    }
}
