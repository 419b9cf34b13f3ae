//! Section 5.5: the texture coordinates of each point of a textured surface.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3};

use crate::geometry::mesh::Mesh;

/// Texture coordinates of a surface's triangles, in [0, 1]², v up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unwrap {
    /// Indices into `Mesh::triangles`.
    pub triangles: Vec<usize>,
    /// The corners' coordinates, one entry per triangle.
    pub corners: Vec<[Vec2; 3]>,
    /// Size of the texture in texels.
    pub width: usize,
    /// In texels.
    pub height: usize,
    /// The coordinates are the file's own `vt`.
    pub is_own: bool,
}

/// The largest texture: texels further apart than asked for, but no more than this many along a
/// side.
#[derive(Clone, Copy, Debug)]
pub struct TexelSize {
    /// Side of a texel on the surface, in metres.
    pub texel_m: f32,
    /// Largest side of the texture, in texels.
    pub max_side: usize,
}

/// Texels kept free around every chart, so that bilinear look-ups stay within it.
const PADDING: f32 = 2.0;

/// The surface's own coordinates where it has usable ones, else an unwrap by polygon.
pub fn unwrap(mesh: &Mesh, surface: usize, has_texcoords: bool, size: TexelSize) -> Unwrap {
    let triangles: Vec<usize> = (0..mesh.triangles.len())
        .filter(|&triangle| mesh.surface[triangle] as usize == surface)
        .collect();
    if has_texcoords && let Some(own) = own(mesh, &triangles, size) {
        return own;
    }
    by_polygon(mesh, triangles, size)
}

/// The file's coordinates; `None` where they leave [0, 1]², which repeats the texture, overlap,
/// or cover nothing.
fn own(mesh: &Mesh, triangles: &[usize], size: TexelSize) -> Option<Unwrap> {
    let corners: Vec<[Vec2; 3]> =
        triangles.iter().map(|&triangle| mesh.texcoords[triangle]).collect();
    let inside = |uv: &Vec2| (-1e-4..=1.0001).contains(&uv.x) && (-1e-4..=1.0001).contains(&uv.y);
    if !corners.iter().flatten().all(inside) {
        return None;
    }
    let area: f32 = triangles.iter().map(|&triangle| mesh.area(triangle)).sum();
    let covered: f32 = corners.iter().map(|[a, b, c]| 0.5 * (b - a).perp_dot(c - a).abs()).sum();
    if covered < 1e-6 {
        return None;
    }
    let side = ((area / covered).sqrt() / size.texel_m).ceil() as usize;
    let side = side.clamp(4, size.max_side.max(4));
    if overlap(&corners, side) {
        return None;
    }
    Some(Unwrap { triangles: triangles.to_vec(), corners, width: side, height: side, is_own: true })
}

/// Whether more than a hundredth of the texels that triangles cover lie in two of them. Such a
/// texel stands for two places, whose reflectances may differ.
fn overlap(corners: &[[Vec2; 3]], side: usize) -> bool {
    let mut covered = vec![false; side * side];
    let (mut once, mut again) = (0usize, 0usize);
    for triangle in corners {
        let [a, b, c] = triangle.map(|uv| uv * side as f32);
        let doubled = (b - a).perp_dot(c - a);
        if doubled.abs() < 1e-12 {
            continue;
        }
        let low = a.min(b).min(c).floor().max(Vec2::ZERO);
        let high = a.max(b).max(c).ceil().min(Vec2::splat(side as f32));
        for y in low.y as usize..high.y as usize {
            for x in low.x as usize..high.x as usize {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let v = (p - a).perp_dot(c - a) / doubled;
                let w = (b - a).perp_dot(p - a) / doubled;
                // Neighbours both have the texels on their common edge.
                if v < 1e-3 || w < 1e-3 || v + w > 0.999 {
                    continue;
                }
                let known = &mut covered[y * side + x];
                *(if *known { &mut again } else { &mut once }) += 1;
                *known = true;
            }
        }
    }
    100 * again > once
}

/// Every polygon flat in its own rectangle, the rectangles in shelves (tallest first).
fn by_polygon(mesh: &Mesh, triangles: Vec<usize>, size: TexelSize) -> Unwrap {
    let mut polygons: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (index, &triangle) in triangles.iter().enumerate() {
        polygons.entry(mesh.polygon[triangle]).or_default().push(index);
    }
    let mut corners = vec![[Vec2::ZERO; 3]; triangles.len()];
    let mut charts = Vec::new();
    for (_, members) in polygons {
        let extent = flatten(mesh, &triangles, &members, &mut corners);
        charts.push((members, extent));
    }
    charts.sort_by(|a, b| b.1.y.total_cmp(&a.1.y));

    // The texel grows until the shelves fit.
    let mut texel_m = size.texel_m;
    let (places, extent) = loop {
        let (places, extent) = shelve(charts.iter().map(|(_, extent)| *extent / texel_m));
        if extent.max_element() <= size.max_side as f32 || !extent.is_finite() {
            break (places, extent);
        }
        texel_m *= 1.05 * (extent.max_element() / size.max_side as f32).sqrt();
    };
    let (width, height) = (extent.x.ceil().max(4.0), extent.y.ceil().max(4.0));
    for ((members, _), place) in charts.iter().zip(places) {
        for &member in members {
            for uv in &mut corners[member] {
                *uv = (*uv / texel_m + place) / Vec2::new(width, height);
            }
        }
    }
    Unwrap { triangles, corners, width: width as usize, height: height as usize, is_own: false }
}

/// Writes the polygon's coordinates in its own plane in metres, from (0, 0), and returns its
/// extent. The longer side lies along u, which packs better.
fn flatten(mesh: &Mesh, triangles: &[usize], members: &[usize], corners: &mut [[Vec2; 3]]) -> Vec2 {
    let largest = members
        .iter()
        .copied()
        .max_by(|&a, &b| mesh.area(triangles[a]).total_cmp(&mesh.area(triangles[b])));
    let Some(largest) = largest else { return Vec2::ZERO };
    let normal = mesh.normal(triangles[largest]);
    let across = longest_outer_edge(mesh, triangles, members).normalize_or(Vec3::X);
    let up = normal.cross(across);
    let flat = |p: Vec3| Vec2::new(p.dot(across), p.dot(up));
    let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
    for &member in members {
        corners[member] = mesh.corners(triangles[member]).map(flat);
        for uv in corners[member] {
            low = low.min(uv);
            high = high.max(uv);
        }
    }
    for &member in members {
        for uv in &mut corners[member] {
            *uv -= low;
        }
    }
    high - low
}

/// The longest edge that only one of the polygon's triangles has: along it the polygon's box is
/// usually tight, while its triangles' inner edges are diagonals.
fn longest_outer_edge(mesh: &Mesh, triangles: &[usize], members: &[usize]) -> Vec3 {
    let mut edges: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for &member in members {
        let [a, b, c] = mesh.triangles[triangles[member]];
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry([from.min(to), from.max(to)]).or_default() += 1;
        }
    }
    edges
        .into_iter()
        .filter(|&(_, count)| count == 1)
        .map(|([from, to], _)| mesh.positions[to as usize] - mesh.positions[from as usize])
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        .unwrap_or(Vec3::X)
}

/// Places rectangles on shelves of nearly the width of the square that holds them all; returns
/// their lower left corners and the whole extent, in the rectangles' unit.
fn shelve(rectangles: impl Iterator<Item = Vec2> + Clone) -> (Vec<Vec2>, Vec2) {
    let padded = rectangles.map(|size| size + 2.0 * PADDING);
    let area: f32 = padded.clone().map(|size| size.x * size.y).sum();
    let widest = padded.clone().map(|size| size.x).fold(0.0, f32::max);
    let width = (1.05 * area.sqrt()).max(widest);
    let (mut places, mut cursor, mut shelf, mut extent) =
        (Vec::new(), Vec2::ZERO, 0.0f32, Vec2::ZERO);
    for size in padded {
        if cursor.x > 0.0 && cursor.x + size.x > width {
            cursor = Vec2::new(0.0, cursor.y + shelf);
            shelf = 0.0;
        }
        places.push(cursor + PADDING);
        cursor.x += size.x;
        shelf = shelf.max(size.y);
        extent = extent.max(Vec2::new(cursor.x, cursor.y + shelf));
    }
    (places, extent)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit cube, one polygon of two triangles a side.
    fn cube() -> Mesh {
        let mut mesh = Mesh::default();
        for axis in 0..3 {
            for side in [0.0f32, 1.0] {
                let base = mesh.positions.len() as u32;
                for (s, t) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                    let mut p = Vec3::ZERO;
                    p[axis] = side;
                    p[(axis + 1) % 3] = s;
                    p[(axis + 2) % 3] = t;
                    mesh.positions.push(p);
                }
                for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                    mesh.polygon.push(2 * axis as u32 + side as u32);
                    mesh.surface.push(0);
                    mesh.triangles.push([base + a, base + b, base + c]);
                }
            }
        }
        mesh
    }

    #[test]
    fn polygons_keep_their_size_and_do_not_overlap() {
        let mesh = cube();
        let unwrap = unwrap(&mesh, 0, false, TexelSize { texel_m: 0.01, max_side: 4096 });
        let texels = Vec2::new(unwrap.width as f32, unwrap.height as f32);
        let mut boxes = Vec::new();
        for pair in unwrap.corners.chunks(2) {
            let all: Vec<Vec2> = pair.iter().flatten().map(|uv| *uv * texels).collect();
            let low = all.iter().fold(Vec2::INFINITY, |a, b| a.min(*b));
            let high = all.iter().fold(Vec2::NEG_INFINITY, |a, b| a.max(*b));
            assert!(low.min_element() >= 0.0 && high.cmple(texels).all());
            assert!((high - low - 100.0).abs().max_element() < 0.1, "{low} to {high}");
            boxes.push((low, high));
        }
        for (i, a) in boxes.iter().enumerate() {
            for b in &boxes[..i] {
                assert!(a.0.cmpge(b.1).any() || b.0.cmpge(a.1).any(), "{a:?} overlaps {b:?}");
            }
        }
    }

    #[test]
    fn a_texture_stays_within_the_largest_side() {
        let unwrap = unwrap(&cube(), 0, false, TexelSize { texel_m: 1e-4, max_side: 256 });
        assert!(unwrap.width <= 256 && unwrap.height <= 256);
        assert!(unwrap.width > 128);
    }
}
