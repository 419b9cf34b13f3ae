//! Triangulates simple polygons, convex or not, by ear clipping in the plane of the polygon.

use glam::{DVec2, DVec3};

/// What became of a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    Sound,
    /// No ear was left (the outline crosses itself) or the search took too long: the rest is a
    /// fan, which may cover too much.
    Fan,
    /// No area: no triangles.
    Flat,
}

/// A triangle whose height is this much smaller than its longest edge has no usable normal.
const THINNEST: f64 = 1e-9;

/// Appends triangles of indices into `corners`, in the polygon's winding. `budget` bounds the
/// point tests: one polygon of 100,000 corners would otherwise take minutes.
pub fn triangulate(corners: &[DVec3], triangles: &mut Vec<[usize; 3]>, budget: &mut u64) -> Shape {
    let start = triangles.len();
    let fan = |from: &[usize], triangles: &mut Vec<[usize; 3]>| {
        let fan = from.windows(2).skip(1).map(|pair| [from[0], pair[0], pair[1]]);
        triangles.extend(fan.filter(|t| has_area(t.map(|corner| corners[corner]))));
    };
    if corners.len() == 3 {
        fan(&[0, 1, 2], triangles);
        return if triangles.len() > start { Shape::Sound } else { Shape::Flat };
    }
    let Some(points) = flatten(corners) else { return Shape::Flat };
    let mut remaining: Vec<usize> = (0..points.len()).collect();
    let mut shape = Shape::Sound;
    while remaining.len() > 3 {
        if is_convex(&points, &remaining) {
            break;
        }
        let Some(ear) = find_ear(&points, &remaining, budget) else {
            shape = Shape::Fan;
            break;
        };
        let count = remaining.len();
        let ear_corners =
            [remaining[(ear + count - 1) % count], remaining[ear], remaining[(ear + 1) % count]];
        if has_area(ear_corners.map(|corner| corners[corner])) {
            triangles.push(ear_corners);
        }
        remaining.remove(ear);
    }
    fan(&remaining, triangles);
    if triangles.len() > start { shape } else { Shape::Flat }
}

/// Whether a triangle's normal means anything.
pub fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let longest =
        (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).cross(c - a).length() > THINNEST * longest
}

/// The corners in the plane of Newell's normal, seen from the side on which they run
/// counter-clockwise; `None` without area.
fn flatten(corners: &[DVec3]) -> Option<Vec<DVec2>> {
    // Differences from one corner keep the digits of a small polygon far from the origin.
    let origin = *corners.first()?;
    let (mut normal, mut extent) = (DVec3::ZERO, 0.0_f64);
    for (index, corner) in corners.iter().enumerate() {
        let next = corners[(index + 1) % corners.len()];
        normal += (*corner - origin).cross(next - origin);
        extent = extent.max((*corner - origin).length_squared());
    }
    if normal.length() <= THINNEST * extent {
        return None;
    }
    let (x_axis, y_axis) = normal.normalize().any_orthonormal_pair();
    let flat =
        |corner: &DVec3| DVec2::new((*corner - origin).dot(x_axis), (*corner - origin).dot(y_axis));
    let points: Vec<DVec2> = corners.iter().map(flat).collect();
    // The pair of axes may be left-handed about the normal.
    let mirrored = x_axis.cross(y_axis).dot(normal) < 0.0;
    Some(if mirrored { points.iter().map(|p| DVec2::new(-p.x, p.y)).collect() } else { points })
}

/// Twice the signed area.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// No corner turns right, and the outline goes round once, so a fan is right.
fn is_convex(points: &[DVec2], remaining: &[usize]) -> bool {
    let count = remaining.len();
    let at = |index: usize| points[remaining[index % count]];
    let mut angle = 0.0;
    for index in 0..count {
        let (before, after) = (at(index + 1) - at(index), at(index + 2) - at(index + 1));
        let (sine, cosine) = (before.perp_dot(after), before.dot(after));
        if sine < 0.0 || (sine == 0.0 && cosine < 0.0) {
            return false;
        }
        angle += sine.atan2(cosine);
    }
    angle < 3.0 * std::f64::consts::PI
}

/// The position in `remaining` of a corner that can be cut off: it turns left, or lies on a
/// straight line, and no other corner is inside the cut.
fn find_ear(points: &[DVec2], remaining: &[usize], budget: &mut u64) -> Option<usize> {
    let count = remaining.len();
    // Wide ears first would be nicer triangles; the first one found is enough for ray casting.
    (0..count).find(|&ear| {
        let [a, b, c] = [ear + count - 1, ear, ear + 1].map(|index| remaining[index % count]);
        let [pa, pb, pc] = [a, b, c].map(|index| points[index]);
        let area = turn(pa, pb, pc);
        if area < 0.0 || (area == 0.0 && (pb - pa).dot(pc - pb) < 0.0) || *budget == 0 {
            return false;
        }
        *budget = budget.saturating_sub(count as u64);
        !remaining.iter().any(|&other| {
            let p = points[other];
            // Corners at the same place as the cut's own (a hole joined by a double edge) do
            // not block it.
            ![a, b, c].contains(&other)
                && p != pa
                && p != pb
                && p != pc
                && turn(pa, pb, p) >= 0.0
                && turn(pb, pc, p) >= 0.0
                && turn(pc, pa, p) >= 0.0
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        let signed = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|index| corners[index]);
            0.5 * (b - a).cross(c - a)
        };
        triangles.iter().map(signed).sum::<DVec3>().length()
    }

    fn cut(outline: &[(f64, f64)]) -> (Shape, f64, usize) {
        // Tilted and far away, as real polygons are.
        let tilt = glam::DMat3::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 0.3);
        let corners: Vec<DVec3> = outline
            .iter()
            .map(|&(x, y)| tilt * DVec3::new(x, y, 0.0) + DVec3::new(10.0, -20.0, 5.0))
            .collect();
        let mut triangles = Vec::new();
        let shape = triangulate(&corners, &mut triangles, &mut 1_000_000);
        let unsigned: f64 = triangles.iter().map(|t| area(&corners, &[*t])).sum();
        assert!((unsigned - area(&corners, &triangles)).abs() < 1e-9, "a triangle is turned over");
        (shape, unsigned, triangles.len())
    }

    #[test]
    fn concave_outlines_keep_their_area() {
        let ell = [(0., 0.), (2., 0.), (2., 1.), (1., 1.), (1., 2.), (0., 2.)];
        let (shape, area, count) = cut(&ell);
        assert!(shape == Shape::Sound && (area - 3.0).abs() < 1e-9 && count == 4);
        // A dart whose first corner is the wrong apex of a fan, and a comb.
        let dart = [(0., 0.), (2., 1.), (0., 2.), (1., 1.)];
        assert!((cut(&dart).1 - 1.0).abs() < 1e-9);
        let comb = [
            (0., 0.),
            (7., 0.),
            (7., 3.),
            (6., 3.),
            (6., 1.),
            (5., 1.),
            (5., 3.),
            (4., 3.),
            (4., 1.),
            (3., 1.),
            (3., 3.),
            (2., 3.),
            (2., 1.),
            (1., 1.),
            (1., 3.),
            (0., 3.),
        ];
        assert!((cut(&comb).1 - 15.0).abs() < 1e-9);
    }

    #[test]
    fn a_hole_joined_by_a_double_edge_stays_open() {
        let frame = [
            (0., 0.),
            (4., 0.),
            (4., 4.),
            (0., 4.),
            (0., 0.),
            (1., 1.),
            (1., 3.),
            (3., 3.),
            (3., 1.),
            (1., 1.),
        ];
        let (_, area, _) = cut(&frame);
        assert!((area - 12.0).abs() < 1e-9, "area {area}");
    }

    #[test]
    fn degenerate_outlines_end() {
        assert_eq!(cut(&[(0., 0.), (1., 0.), (2., 0.), (3., 0.)]).0, Shape::Flat);
        assert_eq!(cut(&[(0., 0.), (0., 0.), (0., 0.)]).0, Shape::Flat);
        let collinear = [(0., 0.), (1., 0.), (2., 0.), (2., 2.), (0., 2.)];
        assert!((cut(&collinear).1 - 4.0).abs() < 1e-9);
        let bow_tie = [(0., 0.), (2., 2.), (2., 0.), (0., 3.)];
        let mut triangles = Vec::new();
        let corners = bow_tie.map(|(x, y)| DVec3::new(x, y, 0.0));
        triangulate(&corners, &mut triangles, &mut 1000);
    }
}
