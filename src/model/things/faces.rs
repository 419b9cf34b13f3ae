//! The faces of things, as polygons of the mesh that is made of them.

use glam::DVec3;

use super::{Opening, Shape, Support, Thing};

/// Pieces that a cylinder's side is cut into. The pieces' corners lie on the true surface, which
/// is then 0.2 % of the radius away from the pieces' middles at most.
const PIECES: usize = 48;
/// How far a polygon that lies on another thing is lifted off it in the mesh, in metres, so that
/// rays meet the polygon and not what it lies on.
const LIFT_M: f64 = 1e-3;

/// A face: one or several flat polygons, counter-clockwise from where the face is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// The stable id of the surface that it belongs to.
    pub surface: String,
    /// Corners in metres, in order.
    pub polygons: Vec<Vec<DVec3>>,
}

/// The faces of a thing that belong to the mesh. `corners` are those of the thing, `circles` the
/// middles of a cylinder's bottom and top and its radius; metres.
pub fn faces(thing: &Thing, corners: &[DVec3], circles: Option<([DVec3; 2], f64)>) -> Vec<Face> {
    let mut list = Vec::new();
    // Faces that others hide are there only where they were given a surface.
    let is_named = |face: &str| thing.surfaces.named.iter().any(|(name, _)| name == face);
    let mut put = |name: &str, polygons: Vec<Vec<DVec3>>| {
        if let Some(surface) = thing.surfaces.of(&thing.id, name) {
            list.push(Face { surface, polygons });
        }
    };
    let reversed = |ring: &[DVec3]| ring.iter().rev().copied().collect::<Vec<_>>();
    match &thing.shape {
        Shape::Room { corners: count, openings, .. } => {
            let (floor, rest) = corners.split_at(*count);
            let (ceiling, holes) = rest.split_at(*count);
            put("floor", vec![floor.to_vec()]);
            for wall in 0..*count {
                let next = (wall + 1) % count;
                let outline = [floor[next], floor[wall], ceiling[wall], ceiling[next]];
                put(&format!("wall{}", wall + 1), pierced(outline, wall, openings, holes));
            }
            put("ceiling", vec![reversed(ceiling)]);
        }
        Shape::Box { .. } | Shape::Prism { .. } => {
            let count = corners.len() / 2;
            let (bottom, top) = corners.split_at(count);
            let is_flush = matches!(thing.shape, Shape::Box { flush: Some(_) });
            for side in 0..count {
                let (next, name) = ((side + 1) % count, format!("side{}", side + 1));
                if side > 0 || !is_flush || is_named(&name) {
                    put(&name, vec![vec![bottom[side], bottom[next], top[next], top[side]]]);
                }
            }
            put("top", vec![top.to_vec()]);
            if is_named("bottom") {
                put("bottom", vec![reversed(bottom)]);
            }
        }
        Shape::Cylinder => {
            let Some(([low, high], radius)) = circles else { return list };
            let ring = |middle: DVec3| -> Vec<DVec3> {
                let angle = |i: usize| i as f64 * std::f64::consts::TAU / PIECES as f64;
                let at = |i| middle + radius * DVec3::new(angle(i).cos(), angle(i).sin(), 0.0);
                (0..PIECES).map(at).collect()
            };
            let (bottom, top) = (ring(low), ring(high));
            let piece = |i: usize| {
                let next = (i + 1) % PIECES;
                vec![bottom[i], bottom[next], top[next], top[i]]
            };
            put("side", (0..PIECES).map(piece).collect());
            put("top", vec![top.clone()]);
            if is_named("bottom") {
                put("bottom", vec![reversed(&bottom)]);
            }
        }
        Shape::Polygon { .. } => {
            let lift = match thing.on {
                Support::Free => 0.0,
                _ => LIFT_M,
            };
            let lift = lift * normal(corners);
            put("front", vec![corners.iter().map(|corner| corner + lift).collect()]);
        }
    }
    list
}

/// Unit normal of a flat polygon by its winding; zero without area.
pub fn normal(corners: &[DVec3]) -> DVec3 {
    let first = corners.first().copied().unwrap_or_default();
    let pairs = corners.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first));
    pairs.sum::<DVec3>().normalize_or_zero()
}

/// A wall without its openings, as rectangles between the lines on which openings begin and end.
fn pierced(
    outline: [DVec3; 4],
    wall: usize,
    openings: &[Opening],
    corners: &[DVec3],
) -> Vec<Vec<DVec3>> {
    let [origin, right, _, up] = outline;
    let (across, height) = (right - origin, up - origin);
    let place = |corner: DVec3| {
        let s = (corner - origin).dot(across) / across.length_squared();
        (s.clamp(0.0, 1.0), ((corner - origin).dot(height) / height.length_squared()).clamp(0., 1.))
    };
    let own = openings.iter().zip(corners.as_chunks::<4>().0);
    let holes: Vec<[(f64, f64); 2]> = own
        .filter(|(opening, _)| opening.wall == wall)
        .map(|(_, corners)| [place(corners[0]), place(corners[2])])
        .collect();
    if holes.is_empty() {
        return vec![outline.to_vec()];
    }
    let cuts = |pick: fn((f64, f64)) -> f64| {
        let mut cuts: Vec<f64> = holes.iter().flatten().map(|&corner| pick(corner)).collect();
        cuts.extend([0.0, 1.0]);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        cuts
    };
    let (columns, rows) = (cuts(|corner| corner.0), cuts(|corner| corner.1));
    let at = |s: f64, t: f64| origin + s * across + t * height;
    let mut pieces = Vec::new();
    for column in columns.windows(2) {
        for row in rows.windows(2) {
            let (s, t) = (0.5 * (column[0] + column[1]), 0.5 * (row[0] + row[1]));
            let is_in = |hole: &[(f64, f64); 2]| {
                let between = |value: f64, a: f64, b: f64| value > a.min(b) && value < a.max(b);
                between(s, hole[0].0, hole[1].0) && between(t, hole[0].1, hole[1].1)
            };
            if !holes.iter().any(is_in) {
                pieces.push(vec![
                    at(column[0], row[0]),
                    at(column[1], row[0]),
                    at(column[1], row[1]),
                    at(column[0], row[1]),
                ]);
            }
        }
    }
    pieces
}
