//! Point sets with a minimum distance (Sections 4.1 and 4.2).
//!
//! The paper keeps its samples apart with a KD-tree, and so do we, with `kiddo`'s. Its mutable
//! tree refuses points in a plane, which every wall is, so immutable trees are rebuilt as the
//! set grows.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use crate::watch::{Cancelled, Watch};

/// Candidates in the first batch, when nothing has been kept yet.
const FIRST_BATCH: usize = 1 << 10;
/// How much larger each batch is than the one before: all of the candidates are fetched from
/// memory for each, and what few reject is decided one by one.
const GROWTH: usize = 4;
/// No batch is larger, so that a cancel is noticed soon.
const LARGEST_BATCH: usize = 1 << 20;
/// Survivors of a batch that are compared one with another before the tree is rebuilt: at least
/// this many, and a part of what is kept already, so that rebuilding stays a small share.
const SMALLEST_BLOCK: usize = 1 << 10;
const BLOCK_PART: usize = 16;
/// Points that rejected one of the candidates before and are asked first: neighbours along a row
/// of pixels, and those of the rows before.
const RECENT: usize = 24;

/// There are more points than 32-bit indices can number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0} points are more than the {max} that can be chosen from", max = u32::MAX)]
pub struct TooManyPoints(pub usize);

/// The indices of so many candidates, in their order.
pub fn indices(count: usize) -> Result<Vec<u32>, TooManyPoints> {
    Ok((0..index_end(count)?).collect())
}

/// One past the last index of so many candidates.
fn index_end(count: usize) -> Result<u32, TooManyPoints> {
    u32::try_from(count).map_err(|_| TooManyPoints(count))
}

/// Indices of the candidates kept, greedily in the given order: a candidate is kept if and only
/// if no earlier kept one is nearer than `min_distance` (in the unit of the coordinates).
///
/// `order` lists the indices of the candidates that are in question. Candidates that are not
/// finite are never kept. All others are where `min_distance` is not positive. Candidates that
/// are neighbours in space are best neighbours in the slice: then most are rejected by the
/// point that rejected their neighbour.
pub fn select_spaced(
    candidates: &[Vec3],
    order: &[u32],
    min_distance: f32,
    watch: &Watch,
) -> Result<Vec<u32>, Cancelled> {
    let point = |index: u32| candidates[index as usize];
    let finite = order.iter().copied().filter(|&index| point(index).is_finite());
    if min_distance.is_nan() || min_distance <= 0.0 {
        return Ok(finite.collect());
    }
    let Some(first) = finite.clone().next() else { return Ok(Vec::new()) };

    // Each batch is thinned in parallel by what is kept already; what survives is decided in the
    // given order, so the answer is the sequential one however many threads there are.
    let mut kept = Kept::new(point(first), min_distance);
    let mut start = 0;
    let mut batch = FIRST_BATCH;
    while start < order.len() {
        watch.check()?;
        let end = order.len().min(start + batch);
        let mut by_place = order[start..end].to_vec();
        by_place.par_sort_unstable();
        let free = kept.thin(candidates, &by_place);
        let mut survivors: Vec<u32> = order[start..end]
            .iter()
            .copied()
            .filter(|index| free.binary_search(index).is_ok())
            .collect();
        while !survivors.is_empty() {
            watch.check()?;
            let largest = SMALLEST_BLOCK.max(kept.points.len() / BLOCK_PART);
            let rest = survivors.split_off(survivors.len().min(largest));
            let block = kept.points.len();
            for index in survivors {
                let near = |&other: &Vec3| kept.is_nearer(other, point(index));
                if !kept.points[block..].iter().any(near) {
                    kept.points.push(point(index));
                    kept.indices.push(index);
                }
            }
            kept.rebuild();
            survivors = kept.thin(candidates, &rest);
        }
        start = end;
        batch = (batch * GROWTH).min(LARGEST_BATCH);
    }
    Ok(kept.indices)
}

/// The points kept so far.
struct Kept {
    points: Vec<Vec3>,
    indices: Vec<u32>,
    /// All of `points` up to the last `rebuild`, in the tree's coordinates.
    tree: Option<ImmutableKdTree<f32, 3>>,
    origin: Vec3,
    min_distance: f64,
}

impl Kept {
    fn new(origin: Vec3, min_distance: f32) -> Self {
        let min_distance = f64::from(min_distance);
        Self { points: Vec::new(), indices: Vec::new(), tree: None, origin, min_distance }
    }

    /// Coordinates in units of the distance, so that no square of a distance that matters is too
    /// large or too small for single precision. Far points are clamped: all that is asked is
    /// whether they are nearer than one unit.
    fn local(&self, point: Vec3) -> [f32; 3] {
        let local = (point.as_dvec3() - self.origin.as_dvec3()) / self.min_distance;
        local.to_array().map(|x| x.clamp(-1e15, 1e15) as f32)
    }

    /// The candidates of a list that are finite and not near a point of the tree, in its order.
    fn thin(&self, candidates: &[Vec3], list: &[u32]) -> Vec<u32> {
        let thin = |chunk: &[u32]| {
            let mut rejecting: VecDeque<Vec3> = VecDeque::with_capacity(RECENT);
            let mut free = Vec::new();
            for &index in chunk {
                let point = candidates[index as usize];
                if !point.is_finite() || rejecting.iter().any(|&near| self.is_nearer(near, point)) {
                    continue;
                }
                match self.nearer(point) {
                    None => free.push(index),
                    Some(near) => {
                        rejecting.truncate(RECENT - 1);
                        rejecting.push_front(near);
                    }
                }
            }
            free
        };
        let chunks: Vec<Vec<u32>> = list.par_chunks(1 << 12).map(thin).collect();
        chunks.concat()
    }

    /// A point of the tree nearer than the distance.
    fn nearer(&self, point: Vec3) -> Option<Vec3> {
        let tree = self.tree.as_ref()?;
        let place = self.local(point);
        let nearest = tree.query(&place).nearest_one::<SquaredEuclidean<f32>>().execute();
        let found = self.points[nearest.item as usize];
        if self.is_nearer(found, point) {
            return Some(found);
        }
        // Rounded coordinates of far points may make another one seem the nearest; then all that
        // seem nearly as near are asked.
        let rounding = 4.0 * f32::EPSILON * place.iter().fold(1.0f32, |a, b| a.max(b.abs()));
        let reach = 1.0 + 2.0 * rounding;
        if nearest.distance > reach * reach {
            return None;
        }
        self.points.iter().copied().find(|&other| self.is_nearer(other, point))
    }

    /// Distances are compared in double precision, and everywhere by this one function.
    fn is_nearer(&self, a: Vec3, b: Vec3) -> bool {
        let squared = self.min_distance * self.min_distance;
        a.as_dvec3().distance_squared(b.as_dvec3()) < squared
    }

    fn rebuild(&mut self) {
        let local: Vec<[f32; 3]> = self.points.iter().map(|&point| self.local(point)).collect();
        // Serially, so that equal distances are resolved alike however many threads there are.
        let builder = ImmutableKdTree::<f32, 3>::builder();
        let tree = builder.with_parallel_construction_threshold(usize::MAX);
        self.tree =
            Some(tree.build_from_slice(&local).expect("an immutable tree takes finite points"));
    }
}

/// Which of some points is nearest.
#[derive(Clone)]
pub struct Nearest {
    tree: Arc<ImmutableKdTree<f32, 3>>,
}

impl std::fmt::Debug for Nearest {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.debug_struct("Nearest").finish_non_exhaustive()
    }
}

impl Nearest {
    /// `None` without points, or where one is not finite.
    pub fn new(points: &[Vec3]) -> Option<Self> {
        if points.is_empty() || !points.iter().all(|point| point.is_finite()) {
            return None;
        }
        let points: Vec<[f32; 3]> = points.iter().map(Vec3::to_array).collect();
        // Serially, so that equal distances are resolved alike however many threads there are.
        let builder = ImmutableKdTree::<f32, 3>::builder();
        let tree = builder.with_parallel_construction_threshold(usize::MAX);
        Some(Self { tree: Arc::new(tree.build_from_slice(&points).ok()?) })
    }

    /// The index of the point nearest to `point`, which must be finite.
    pub fn to(&self, point: Vec3) -> usize {
        let place = point.to_array();
        let nearest = self.tree.query(&place).nearest_one::<SquaredEuclidean<f32>>().execute();
        nearest.item as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::Random;

    /// Points in [-1, 1]³.
    fn scattered(count: usize, seed: u64) -> Vec<Vec3> {
        let mut random = Random::new(seed, 0, 0);
        let mut coordinate = || 2.0 * random.uniform() - 1.0;
        (0..count).map(|_| Vec3::new(coordinate(), coordinate(), coordinate())).collect()
    }

    fn brute_force(candidates: &[Vec3], min_distance: f32) -> Vec<u32> {
        let mut kept: Vec<u32> = Vec::new();
        for (index, &point) in candidates.iter().enumerate() {
            let squared = f64::from(min_distance).powi(2);
            let near = |&k: &u32| {
                let kept = candidates[k as usize].as_dvec3();
                kept.distance_squared(point.as_dvec3()) < squared
            };
            let free = min_distance <= 0.0 || !kept.iter().any(near);
            if point.is_finite() && free {
                kept.push(index as u32);
            }
        }
        kept
    }

    fn select(candidates: &[Vec3], min_distance: f32) -> Vec<u32> {
        let order: Vec<u32> = (0..candidates.len() as u32).collect();
        select_spaced(candidates, &order, min_distance, &Watch::new()).unwrap()
    }

    fn check(candidates: &[Vec3], min_distance: f32) {
        let kept = select(candidates, min_distance);
        assert_eq!(kept, brute_force(candidates, min_distance), "distance {min_distance}");
    }

    #[test]
    fn indices_that_do_not_fit_are_an_error() {
        assert_eq!(indices(3), Ok(vec![0, 1, 2]));
        assert_eq!(index_end(u32::MAX as usize), Ok(u32::MAX));
        assert_eq!(index_end(u32::MAX as usize + 1), Err(TooManyPoints(1 << 32)));
    }

    #[test]
    fn the_order_decides() {
        let points = scattered(3000, 9);
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        Random::new(1, 1, 1).shuffle(&mut order);
        let ordered: Vec<Vec3> = order.iter().map(|&index| points[index as usize]).collect();
        let expected: Vec<u32> =
            brute_force(&ordered, 0.2).into_iter().map(|place| order[place as usize]).collect();
        assert_eq!(select_spaced(&points, &order, 0.2, &Watch::new()), Ok(expected));
        assert_eq!(select_spaced(&points, &[7], 0.2, &Watch::new()), Ok(vec![7]));
    }

    #[test]
    fn the_answer_is_the_sequential_one() {
        let cloud = scattered(8000, 1);
        let plane: Vec<Vec3> = cloud.iter().map(|p| p.with_z(0.5)).collect();
        let line: Vec<Vec3> = cloud.iter().map(|p| Vec3::X * p.x).collect();
        let lattice: Vec<Vec3> = cloud.iter().map(|p| (*p * 8.0).round() / 8.0).collect();
        for points in [&cloud, &plane, &line, &lattice] {
            for distance in [1e-6, 0.03, 0.125, 0.5, 10.0, f32::INFINITY] {
                check(points, distance);
            }
        }
    }

    #[test]
    fn duplicates_count_once() {
        let same = vec![Vec3::splat(0.3); 5000];
        assert_eq!(select(&same, 1e-3), [0]);
        check(&[scattered(3000, 2), scattered(3000, 2)].concat(), 1e-4);
    }

    #[test]
    fn points_at_the_distance_are_kept() {
        let row: Vec<Vec3> = (0..100).map(|i| Vec3::X * i as f32).collect();
        assert_eq!(select(&row, 1.0).len(), 100);
        assert_eq!(select(&row, 1.001).len(), 50);
    }

    #[test]
    fn odd_input() {
        let odd = [Vec3::NAN, Vec3::ZERO, Vec3::INFINITY, Vec3::ZERO, Vec3::splat(1e30)];
        assert_eq!(select(&odd, 1.0), [1, 4]);
        assert_eq!(select(&odd, 0.0), [1, 3, 4]);
        assert_eq!(select(&odd, -1.0), [1, 3, 4]);
        assert!(select(&[], 1.0).is_empty());
        let huge: Vec<Vec3> = scattered(3000, 3).iter().map(|p| *p * 1e30).collect();
        for distance in [1e-30, 1.0, 1e29, 3e38] {
            check(&huge, distance);
        }
        // Distances whose squares single precision cannot hold.
        let tiny: Vec<Vec3> = scattered(1000, 8).iter().map(|p| *p * 1e-25).collect();
        check(&tiny, 1e-26);
    }

    #[test]
    fn a_cancelled_watch_stops() {
        let watch = Watch::new();
        watch.cancel();
        assert_eq!(select_spaced(&scattered(10, 4), &[0, 1], 0.1, &watch), Err(Cancelled));
    }
}
