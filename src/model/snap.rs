//! Moves a drawn line onto the nearest edge in the photograph.
//!
//! At many places along the line, the steepest change of brightness across it within the search
//! distance is a candidate. The straight line with the most candidates on it is taken (all pairs of
//! candidates from the two ends are tried) and fitted to them by least squares. If fewer than half
//! of the places have a candidate on it, there is no edge, and the line stays as it was drawn.
//!
//! A corner is moved onto the crossing of two lines that were found in the photograph.

use glam::DVec2;

use super::lines::Line;

/// Places along the line at most, and pixels between them at least.
const MOST_PLACES: usize = 120;
const APART_PX: f64 = 2.0;
/// Between offsets that are tried across the line.
const STEP_PX: f64 = 0.5;
/// Half the distance over which a change of brightness is measured.
const HALF_PX: f64 = 0.75;
/// A change counts where it is this many times the mean of those within reach.
const STEEP: f64 = 2.0;
/// And where it is this part of white at least: steps of eight bits are no edges.
const LEAST: f64 = 0.015;
/// Candidates within this distance of a line agree with it.
const AGREE_PX: f64 = 0.75;
/// The part of all places that must agree.
const AGREED: f64 = 0.5;
/// The part of a drawn line beside which a line that was found must run.
const BESIDE: f64 = 0.7;
/// Lines cross where the sine of the angle between them is at least this: 15°.
const CROSSING: f64 = 0.26;
/// A line that was found counts beyond its ends by this part of its length, and by so many times the
/// reach at most: it often ends before the corner that it makes.
const BEYOND: f64 = 0.25;
const BEYOND_REACH: f64 = 2.0;

/// Where two lines of a photograph cross.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// In pixels.
    pub at: DVec2,
    /// The two.
    pub lines: [Line; 2],
}

/// The edge nearest to a line, by its ends, or `None` where the photograph shows none within
/// `reach_px` of it. `brightness` is that of a place in the photograph, as it is shown:
/// 1 is white; `None` outside.
pub fn line(
    ends: [DVec2; 2],
    reach_px: f64,
    brightness: impl Fn(DVec2) -> Option<f64>,
) -> Option<[DVec2; 2]> {
    let along = ends[1] - ends[0];
    let length = along.length();
    let normal = along.perp().try_normalize()?;
    let count = ((length / APART_PX) as usize).min(MOST_PLACES);
    if count < 6 {
        return None;
    }
    let part = |place: usize| (place as f64 + 0.5) / count as f64;
    let found: Vec<(f64, f64)> = (0..count)
        .filter_map(|place| {
            let middle = ends[0] + part(place) * along;
            let at = |offset: f64| brightness(middle + offset * normal);
            Some((part(place), steepest(reach_px, at)?))
        })
        .collect();
    let agree = |line: (f64, f64)| {
        found.iter().filter(move |(s, offset)| (line.0 + line.1 * s - offset).abs() < AGREE_PX)
    };
    let pairs = |first: bool| {
        let list = found.iter().filter(move |(s, _)| if first { *s < 0.4 } else { *s > 0.6 });
        let list: Vec<&(f64, f64)> = list.collect();
        // Some thirty of each end are enough.
        let step = list.len().div_ceil(30).max(1);
        list.into_iter().step_by(step)
    };
    let through = |(s, a): &(f64, f64), (t, b): &(f64, f64)| {
        let slope = (b - a) / (t - s);
        (a - slope * s, slope)
    };
    let lines = pairs(true).flat_map(|a| pairs(false).map(move |b| through(a, b)));
    let best = lines.max_by_key(|line| agree(*line).count())?;
    let own: Vec<&(f64, f64)> = agree(best).collect();
    if (own.len() as f64) < AGREED * count as f64 {
        return None;
    }
    let (from, slope) = fitted(&own)?;
    Some([ends[0] + from * normal, ends[1] + (from + slope) * normal])
}

/// Where a drawn line comes to lie on one of `lines`: that of which both ends are nearest, within
/// `reach_px`, and which runs beside most of it.
pub fn to_lines(ends: [DVec2; 2], lines: &[Line], reach_px: f64) -> Option<[DVec2; 2]> {
    let length = ends[0].distance(ends[1]);
    let off = |line: &Line| {
        let along = line.direction();
        let places = ends.map(|end| (end - line.ends[0]).dot(along).clamp(0.0, line.length()));
        let beside = (places[0] - places[1]).abs();
        let feet = ends.map(|end| line.foot(end));
        let off = feet[0].distance(ends[0]).max(feet[1].distance(ends[1]));
        (off < reach_px && beside >= BESIDE * length).then_some((off, feet))
    };
    let near = lines.iter().filter_map(off).min_by(|a, b| a.0.total_cmp(&b.0));
    near.map(|(_, feet)| feet).filter(|_| length > 0.0)
}

/// The crossing of two of `lines` that is nearest to a place, within `reach_px` of it.
pub fn to_crossing(place: DVec2, lines: &[Line], reach_px: f64) -> Option<Crossing> {
    let beyond = |line: &Line| (BEYOND * line.length()).min(BEYOND_REACH * reach_px);
    // A line that is farther from the place has no crossing near it.
    let is_near = |line: &&Line| line.distance(place) < reach_px + beyond(line);
    let near: Vec<&Line> = lines.iter().filter(is_near).collect();
    let crossing = |a: &Line, b: &Line| {
        let (along, other) = (a.direction(), b.direction());
        let sine = along.perp_dot(other);
        if sine.abs() < CROSSING {
            return None;
        }
        let at = a.ends[0] + along * ((b.ends[0] - a.ends[0]).perp_dot(other) / sine);
        let is_on = [a, b].into_iter().all(|line| line.distance(at) <= beyond(line));
        (is_on && at.distance(place) < reach_px).then_some(Crossing { at, lines: [*a, *b] })
    };
    let pairs = near.iter().enumerate();
    let pairs = pairs.flat_map(|(index, a)| near[index + 1..].iter().map(move |b| (*a, *b)));
    let found = pairs.filter_map(|(a, b)| crossing(a, b));
    found.min_by(|a, b| a.at.distance(place).total_cmp(&b.at.distance(place)))
}

/// Where brightness changes most, as an offset; `None` where it changes alike everywhere.
fn steepest(reach_px: f64, at: impl Fn(f64) -> Option<f64>) -> Option<f64> {
    let count = (2.0 * reach_px / STEP_PX) as usize + 1;
    let offset = |index: usize| index as f64 * STEP_PX - reach_px;
    let change = |index: usize| -> Option<f64> {
        Some((at(offset(index) + HALF_PX)? - at(offset(index) - HALF_PX)?).abs())
    };
    let changes: Vec<f64> = (0..count).map(change).collect::<Option<_>>()?;
    let mean = changes.iter().sum::<f64>() / count as f64;
    let inner = 1..count.saturating_sub(1);
    let top = inner.max_by(|a, b| changes[*a].total_cmp(&changes[*b]))?;
    let [a, b, c] = [changes[top - 1], changes[top], changes[top + 1]];
    if b < LEAST || b <= STEEP * mean || b < a || b < c {
        return None;
    }
    // The top of the parabola through the three.
    let bend = a - 2.0 * b + c;
    let shift = if bend < 0.0 { 0.5 * (a - c) / bend } else { 0.0 };
    Some(offset(top) + shift * STEP_PX)
}

/// Least squares: value at 0 and slope.
fn fitted(points: &[&(f64, f64)]) -> Option<(f64, f64)> {
    let count = points.len() as f64;
    let (s, d) = points.iter().fold((0.0, 0.0), |sum, own| (sum.0 + own.0, sum.1 + own.1));
    let (s, d) = (s / count, d / count);
    let spread: f64 = points.iter().map(|own| (own.0 - s).powi(2)).sum();
    if spread <= 1e-9 {
        return None;
    }
    let slope = points.iter().map(|own| (own.0 - s) * (own.1 - d)).sum::<f64>() / spread;
    Some((d - slope * s, slope))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::Random;

    /// A photograph of an edge between two greys, one pixel wide, with noise that is the same for
    /// the same pixel.
    fn edge(through: DVec2, normal: DVec2, noise: f64) -> impl Fn(DVec2) -> Option<f64> {
        move |place: DVec2| {
            let side = (place - through).dot(normal);
            let pixel = place.floor();
            let seed = (pixel.x as i64 * 7919 + pixel.y as i64 * 104_729) as u64;
            let own = f64::from(Random::new(seed, 0, 0).uniform()) - 0.5;
            Some(0.4 + 0.3 * (side + 0.5).clamp(0.0, 1.0) + noise * own)
        }
    }

    #[test]
    fn a_line_comes_to_lie_on_the_edge() {
        let normal = DVec2::new(-0.2, 1.0).normalize();
        let through = DVec2::new(40.0, 60.3);
        let tangent = -normal.perp();
        let on_edge = [through - 30.0 * tangent, through + 90.0 * tangent];
        for (first, second) in [(3.0, -2.0), (0.0, 0.0), (-4.0, -3.5)] {
            let drawn = [on_edge[0] + first * normal, on_edge[1] + second * normal];
            for noise in [0.0, 0.05] {
                let found = line(drawn, 6.0, edge(through, normal, noise)).unwrap();
                for end in found {
                    let off = (end - through).dot(normal).abs();
                    assert!(off < 0.15, "{off} px with noise {noise}");
                }
            }
        }
    }

    #[test]
    fn a_line_comes_to_lie_on_the_nearest_that_was_found() {
        let line = |a: (f64, f64), b: (f64, f64)| Line {
            ends: [DVec2::from(a), DVec2::from(b)],
            sd_px: 0.25,
        };
        let lines = [
            line((0.0, 10.0), (100.0, 10.0)),
            line((100.0, 13.0), (0.0, 13.0)),
            line((48.0, 0.0), (48.0, 90.0)),
        ];
        let snapped =
            |a: (f64, f64), b: (f64, f64)| to_lines([DVec2::from(a), DVec2::from(b)], &lines, 4.0);
        let on_second = [DVec2::new(20.0, 13.0), DVec2::new(80.0, 13.0)];
        assert_eq!(snapped((20.0, 12.0), (80.0, 13.5)), Some(on_second));
        assert_eq!(snapped((20.0, 12.0), (80.0, 18.0)), None, "one end is far");
        assert_eq!(snapped((90.0, 10.0), (150.0, 10.0)), None, "most of it is beyond the line");
        assert_eq!(snapped((20.0, 12.0), (20.0, 12.0)), None, "a point");
        assert_eq!(to_lines(on_second, &[], 4.0), None);
    }

    #[test]
    fn a_corner_comes_to_lie_on_the_nearest_crossing() {
        let line = |a: (f64, f64), b: (f64, f64)| Line {
            ends: [DVec2::from(a), DVec2::from(b)],
            sd_px: 0.25,
        };
        let lines = [
            // Two that end before the corner (100, 50) which they make, by 4 px and 3 px.
            line((20.0, 50.0), (96.0, 50.0)),
            line((100.0, 53.0), (100.0, 120.0)),
            // One through the first, which is farther from the corner.
            line((92.0, 20.0), (92.0, 80.0)),
            // Nearly along the first, and one that ends too far before the corner.
            line((20.0, 46.0), (140.0, 52.0)),
            line((150.0, 100.0), (120.0, 70.0)),
        ];
        let at = |x: f64, y: f64, reach: f64| to_crossing(DVec2::new(x, y), &lines, reach);
        let found = at(102.0, 49.0, 5.0).unwrap();
        assert!(found.at.distance(DVec2::new(100.0, 50.0)) < 1e-9, "{found:?}");
        assert_eq!(found.lines, [lines[0], lines[1]]);
        let found = at(93.0, 51.0, 5.0).unwrap();
        assert!(found.at.distance(DVec2::new(92.0, 50.0)) < 1e-9, "{found:?}");
        assert_eq!(at(110.0, 60.0, 5.0), None, "none is within reach");
        assert_eq!(at(60.0, 50.0, 5.0), None, "a line alone has no crossing");
        let apart = |gap: f64| {
            let lines =
                [line((0.0, 0.0), (20.0, 0.0)), line((20.0 + gap, 0.5), (20.0 + gap, 40.0))];
            to_crossing(DVec2::new(20.0 + gap, 1.0), &lines, 4.0)
        };
        assert!(apart(4.0).is_some(), "a quarter of its length beyond its end");
        assert_eq!(apart(6.0), None, "more");
        assert_eq!(to_crossing(DVec2::ZERO, &[], 4.0), None);
        let point = line((3.0, 3.0), (3.0, 3.0));
        assert_eq!(to_crossing(DVec2::splat(3.0), &[point, lines[0]], 4.0), None);
    }

    #[test]
    fn without_an_edge_a_line_stays() {
        let drawn = [DVec2::new(10.0, 10.0), DVec2::new(90.0, 40.0)];
        assert_eq!(line(drawn, 6.0, |_| Some(0.5)), None);
        assert_eq!(line(drawn, 6.0, |place| Some(0.01 * place.y)), None, "a ramp");
        assert_eq!(line(drawn, 6.0, |_| None), None);
        let noise = edge(DVec2::new(1e4, 1e4), DVec2::Y, 0.3);
        assert_eq!(line(drawn, 6.0, noise), None, "noise alone");
        let short = [DVec2::ZERO, DVec2::new(3.0, 0.0)];
        assert_eq!(line(short, 6.0, |place| Some(place.y.signum())), None);
    }
}
