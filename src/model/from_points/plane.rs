//! Planes through points with many outliers, and rectangles around the points of a plane.

use faer::{Mat, Side};
use glam::{DVec2, DVec3};

use crate::math::sampling::Random;

/// Planes through three random points that are tried.
const TRIES: u64 = 1000;
/// So many points at most tell how good each is.
const ASKED: usize = 1500;
/// Rounds of least squares, and by how many of their standard deviations points may be off in the
/// last of them.
const ROUNDS: usize = 8;
const USUAL: f64 = 3.0;
/// Points of which the third nearest is this many times as far as usual belong to nothing.
const ALONE: f64 = 3.0;
/// One or two points at an end do so, where they are farther from the others than this many times
/// the distance of all from one to the next.
const BEYOND: f64 = 10.0;
/// A level rectangle is taken where it is not larger than the smallest by more than this.
const LEVEL: f64 = 1.1;

/// The places p with normal · p = offset.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Of unit length.
    pub normal: DVec3,
    pub offset: f64,
}

/// A rectangle in a plane, from `low` to `high` along `axis` and at right angles to its left.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    pub axis: DVec2,
    pub low: DVec2,
    pub high: DVec2,
}

impl Plane {
    /// How far a point lies before it; behind it, negative.
    pub fn distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// With its normal the other way, where that is nearer to a direction.
    pub fn towards(self, direction: DVec3) -> Self {
        match self.normal.dot(direction) < 0.0 {
            true => Self { normal: -self.normal, offset: -self.offset },
            false => self,
        }
    }

    fn through([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let normal = (b - a).cross(c - a).try_normalize()?;
        Some(Self { normal, offset: normal.dot(a) })
    }

    /// The plane from which the squared distances are least.
    fn fitted(points: &[DVec3]) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let middle = points.iter().sum::<DVec3>() / points.len() as f64;
        let mut moments = Mat::<f64>::zeros(3, 3);
        for point in points {
            let from = *point - middle;
            for i in 0..3 {
                for j in 0..3 {
                    moments[(i, j)] += from[i] * from[j];
                }
            }
        }
        let eigen = moments.self_adjoint_eigen(Side::Lower).ok()?;
        let least = eigen.U().col(0);
        let normal = DVec3::new(least[0], least[1], least[2]).try_normalize()?;
        Some(Self { normal, offset: normal.dot(middle) })
    }
}

/// The plane that most points lie on, and which they are: of planes through three random points
/// (the same for the same points) the one from which the points are least far, where no point counts
/// as farther than `reach`; then that by least squares through the points near it.
pub fn most(points: &[DVec3], reach: f64) -> Option<(Plane, Vec<usize>)> {
    if points.len() < 3 {
        return None;
    }
    let step = points.len().div_ceil(ASKED);
    let asked: Vec<DVec3> = points.iter().step_by(step).copied().collect();
    let tried = (0..TRIES).filter_map(|index| {
        let mut random = Random::new(1, index, 0);
        let three = std::array::from_fn(|_| points[random.below(points.len())]);
        let plane = Plane::through(three)?;
        let far = |point: &DVec3| (plane.distance(*point) / reach).powi(2).min(1.0);
        Some((plane, asked.iter().map(far).sum::<f64>()))
    });
    let (mut plane, _) = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut within = reach;
    let mut on = Vec::new();
    for _ in 0..ROUNDS {
        let near = |index: &usize| plane.distance(points[*index]).abs() < within;
        on = (0..points.len()).filter(near).collect();
        let own: Vec<DVec3> = on.iter().map(|&index| points[index]).collect();
        plane = Plane::fitted(&own)?;
        let off = own.iter().map(|point| plane.distance(*point).abs()).collect();
        // 1.4826 times the median is the standard deviation of what is Gaussian.
        within = (USUAL * 1.4826 * median(off)).clamp(0.2 * reach, reach);
    }
    Some((plane, on))
}

/// The smallest rectangle around points, or the level one where that is hardly larger: its axis is
/// as nearly the first axis as can be.
pub fn rectangle(points: &[DVec2]) -> Option<Rectangle> {
    let along = |axis: DVec2| {
        let [left, right] = ends(points.iter().map(|point| point.dot(axis)).collect());
        let [below, above] = ends(points.iter().map(|point| axis.perp_dot(*point)).collect());
        let (low, high) = (DVec2::new(left, below), DVec2::new(right, above));
        Rectangle { axis, low, high }
    };
    let area = |own: &Rectangle| (own.high - own.low).element_product();
    // One side of the smallest lies on a side of the hull.
    let hull = hull(points);
    let sides = hull.iter().zip(hull.iter().cycle().skip(1));
    let all = sides.filter_map(|(a, b)| {
        let mut axis = (*b - *a).try_normalize()?;
        while axis.x < axis.y.abs() {
            axis = axis.perp();
        }
        Some(along(axis))
    });
    let smallest = all.min_by(|a, b| area(a).total_cmp(&area(b)))?;
    let level = along(DVec2::X);
    let best = if area(&level) <= LEVEL * area(&smallest) { level } else { smallest };
    (area(&best) > 0.0).then_some(best)
}

/// The least and the greatest of numbers, without one or two at either end that lie by themselves.
pub fn ends(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let mut own = &values[..];
    while let [first, second, third, .., last] = *own {
        let apart = BEYOND * (last - first) / own.len() as f64;
        if second - first <= apart && third - first <= apart {
            break;
        }
        own = &own[1..];
    }
    while let [first, .., third, second, last] = *own {
        let apart = BEYOND * (last - first) / own.len() as f64;
        if last - second <= apart && last - third <= apart {
            break;
        }
        own = &own[..own.len() - 1];
    }
    [own.first().copied().unwrap_or(0.0), own.last().copied().unwrap_or(0.0)]
}

/// The corners of the convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(points: &[DVec2]) -> Vec<DVec2> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |list: &mut dyn Iterator<Item = &DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for &point in list {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    [chain(&mut sorted.iter()), chain(&mut sorted.iter().rev())].concat()
}

/// Which points have others near them.
pub fn dense(points: &[DVec2]) -> Vec<usize> {
    let third = |own: &DVec2| {
        let mut three = [f64::INFINITY; 4];
        for other in points {
            let mut far = own.distance_squared(*other);
            for place in &mut three {
                if far < *place {
                    std::mem::swap(&mut far, place);
                }
            }
        }
        // The nearest is the point itself.
        three[3].sqrt()
    };
    let far: Vec<f64> = points.iter().map(third).collect();
    let usual = median(far.clone());
    (0..points.len()).filter(|&index| far[index] <= ALONE * usual).collect()
}

/// 0 of none.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
