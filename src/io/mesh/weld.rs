//! Vertices at one place become one, and triangles that this leaves without area go.
//!
//! Scans, STL files and glTF files with seams give every corner or every seam its own vertex;
//! only with shared ones is it known which triangles are neighbours.

use std::collections::HashMap;

use glam::Vec3;

use crate::geometry::mesh::Mesh;
use crate::io::polygon::has_area;

/// Joins vertices of exactly the same position; unused ones go.
pub fn exactly(mesh: &mut Mesh) {
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    // Adding 0 makes -0 the same as 0.
    let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
    join(mesh, |position, kept| {
        let next = kept.len() as u32;
        *known.entry(key(position)).or_insert(next)
    });
}

/// Joins vertices that are no farther apart than `tolerance_m` from one that came before; counts
/// the triangles that have lost their area and are left out.
pub fn within(mesh: &mut Mesh, tolerance_m: f32) -> usize {
    if tolerance_m > 0.0 {
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        // Cells are twice as wide as the tolerance, so what is near lies in one of eight.
        let width = 2.0 * f64::from(tolerance_m);
        join(mesh, |position, kept| {
            let place = position.as_dvec3() / width;
            let own = place.floor();
            let side = (place - own - 0.5).signum();
            let cell = |step: [i64; 3]| -> [i64; 3] {
                let own = own.to_array().map(|value| value as i64);
                let side = side.to_array().map(|value| value as i64);
                std::array::from_fn(|axis| own[axis].saturating_add(step[axis] * side[axis]))
            };
            let near = (0..8_i64)
                .map(|corner| [corner & 1, corner >> 1 & 1, corner >> 2])
                .filter_map(|step| cells.get(&cell(step)))
                .flatten()
                .filter(|&&other| kept[other as usize].distance(position) <= tolerance_m)
                .min();
            near.copied().unwrap_or_else(|| {
                let next = kept.len() as u32;
                cells.entry(cell([0; 3])).or_default().push(next);
                next
            })
        });
    }
    drop_degenerate(mesh)
}

/// Renumbers the vertices by `find`, which gives the number of a kept one, or the next number.
fn join(mesh: &mut Mesh, mut find: impl FnMut(Vec3, &[Vec3]) -> u32) {
    let mut numbers = vec![u32::MAX; mesh.positions.len()];
    let mut kept = Vec::new();
    for vertex in mesh.triangles.iter_mut().flatten() {
        let number = &mut numbers[*vertex as usize];
        if *number == u32::MAX {
            let position = mesh.positions[*vertex as usize];
            *number = find(position, &kept);
            if *number as usize == kept.len() {
                kept.push(position);
            }
        }
        *vertex = *number;
    }
    mesh.positions = kept;
}

/// Leaves out triangles without area and says how many.
fn drop_degenerate(mesh: &mut Mesh) -> usize {
    let keep: Vec<bool> = (0..mesh.triangles.len())
        .map(|triangle| has_area(mesh.corners(triangle).map(|corner| corner.as_dvec3())))
        .collect();
    let dropped = keep.iter().filter(|keep| !**keep).count();
    if dropped > 0 {
        retain(&mut mesh.triangles, &keep);
        retain(&mut mesh.surface, &keep);
        retain(&mut mesh.polygon, &keep);
        if !mesh.texcoords.is_empty() {
            retain(&mut mesh.texcoords, &keep);
        }
    }
    dropped
}

fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    values.retain(|_| keep.next().is_none_or(|keep| *keep));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn soup(points: &[[f32; 3]]) -> Mesh {
        let count = points.len() / 3;
        Mesh {
            positions: points.iter().map(|&point| point.into()).collect(),
            triangles: (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            surface: vec![0; count],
            polygon: (0..count as u32).collect(),
            ..Default::default()
        }
    }

    #[test]
    fn near_vertices_become_one_across_cells() {
        let mut mesh = soup(&[
            [0., 0., 0.],
            [1., 0., 0.],
            [0., 1., 0.],
            [-0.0005, -0.0005, 0.0],
            [1.0004, 0., 0.],
            [0., -1., 0.],
            // A sliver that the tolerance closes.
            [5., 5., 5.],
            [5.0001, 5., 5.],
            [5., 5.0001, 5.],
        ]);
        exactly(&mut mesh);
        assert_eq!(mesh.positions.len(), 9);
        assert_eq!(within(&mut mesh, 0.001), 1);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 3]]);
        assert_eq!((mesh.surface.len(), mesh.polygon.len()), (2, 2));
    }
}
