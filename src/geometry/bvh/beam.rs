//! Rays through neighbouring pixels, traced together. They go through the tree once, and where all
//! of them meet one triangle that nothing is in front of, none is traced.

use glam::Vec3;

use super::Ray;
use super::portable::{larger, mask, smaller};
use super::ray::{Prepared, WIDENING};
use super::traverse::{Kernel, Slot, Stack};
use super::wide::{Child, LANES, Lanes, Leaf, Node, WideTree};

/// Rays of one beam at most.
pub const MOST_RAYS: usize = 64;

/// Directions whose components along one axis of the world are no smaller part of them than this
/// make a beam.
const LEAST_ALONG: f32 = 0.3;
/// By what slopes are widened: more than directions in single precision are off.
const SLOPE_ERROR: f32 = 1e-6;
/// The same, relatively, for depths.
const DEPTH_ERROR: f32 = 1e-5;

/// Between what slopes to an axis of the world rays from one origin lie.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    origin: Vec3,
    /// x, y, z of the beam as axes of the world; rays run along z.
    axes: [usize; 3],
    /// 1 where they run along the axis, −1 where against it.
    sign: f32,
    /// Smallest and largest x/z, and y/z.
    low: [f32; 2],
    high: [f32; 2],
}

impl Beam {
    /// The beam that holds these unit directions; `None` where they are too far apart for one.
    pub fn of(origin: Vec3, directions: impl IntoIterator<Item = Vec3>) -> Option<Self> {
        let mut directions = directions.into_iter();
        let first = directions.next()?;
        let z = first.abs().max_position();
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][z];
        let sign = first[z].signum();
        let mut beam =
            Self { origin, axes, sign, low: [f32::INFINITY; 2], high: [f32::NEG_INFINITY; 2] };
        for direction in std::iter::once(first).chain(directions) {
            let along = sign * direction[z];
            if along.is_nan() || along < LEAST_ALONG {
                return None;
            }
            for side in 0..2 {
                let slope = direction[axes[side]] / along;
                let error = SLOPE_ERROR * (1.0 + slope.abs());
                beam.low[side] = beam.low[side].min(slope - error);
                beam.high[side] = beam.high[side].max(slope + error);
            }
        }
        Some(beam)
    }
}

/// What the rays of a beam meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Met {
    /// All of them this triangle before anything else, or nothing.
    One(Option<u32>),
    /// Each the triangle that was written for it.
    Each,
}

/// A ray of a beam, and the nearest hit so far.
struct Traced {
    prepared: Prepared,
    /// Depth along the beam for a unit of distance.
    along: f32,
    t: f32,
    triangle: u32,
}

const NO_TRIANGLE: u32 = u32::MAX;

/// See `RayCaster::closest_of_beam`. `stack` has room for `tree.stack_size` entries.
///
/// # Safety
/// The processor has the kernel's instructions.
#[inline(always)]
pub unsafe fn closest<K: Kernel>(
    tree: &WideTree,
    beam: &Beam,
    rays: &dyn Fn(usize) -> Ray,
    hits: &mut [Option<u32>],
    stack: &mut [Slot],
) -> Met {
    assert!(stack.len() >= tree.stack_size && hits.len() <= MOST_RAYS);
    if tree.nodes.is_empty() {
        return Met::One(None);
    }
    let wide = Wide::new(beam, tree);
    let mut traced: Vec<Traced> = Vec::new();
    // The one triangle so far that any ray may meet, which all of them do, and its leaf.
    let mut cover: Option<(u32, usize)> = None;
    // Depth beyond which nothing is nearer than what was met.
    let mut far = f32::INFINITY;

    let mut stack = Stack::new(stack);
    let mut child = Child::node(0);
    loop {
        if child.is_leaf() {
            let leaf = &tree.leaves[child.index()];
            let meeting = wide.meeting(leaf, far);
            if meeting != 0 {
                let lane = meeting.trailing_zeros() as usize & 7;
                let is_first = traced.is_empty() && cover.is_none();
                let covered = if is_first && meeting.count_ones() == 1 {
                    wide.covered(leaf, lane)
                } else {
                    None
                };
                if let Some(depth) = covered {
                    cover = Some((leaf.triangles[lane], child.index()));
                    far = depth;
                } else {
                    if traced.is_empty() {
                        let started = |index: usize| {
                            let ray = rays(index);
                            Traced {
                                prepared: Prepared::new(&ray, tree),
                                along: ray.direction[beam.axes[2]].abs(),
                                t: ray.t_max.next_down(),
                                triangle: NO_TRIANGLE,
                            }
                        };
                        traced = (0..hits.len()).map(started).collect();
                        if let Some((_, index)) = cover {
                            // SAFETY: the caller's promise.
                            unsafe { test::<K>(&mut traced, &tree.leaves[index]) };
                        }
                    }
                    // SAFETY: the caller's promise.
                    far = unsafe { test::<K>(&mut traced, leaf) };
                }
            }
        } else {
            let node = &tree.nodes[child.index()];
            let (met, near) = wide.boxes(node, far);
            // SAFETY: the stack holds `tree.stack_size` entries.
            if let Some(nearest) = unsafe { stack.put_aside_all_but_nearest(node, met, &near) } {
                child = nearest;
                continue;
            }
        }
        match stack.pop_within(far) {
            Some(next) => child = next,
            None => return ended(&traced, cover, hits),
        }
    }
}

fn ended(traced: &[Traced], cover: Option<(u32, usize)>, hits: &mut [Option<u32>]) -> Met {
    if traced.is_empty() {
        return Met::One(cover.map(|(triangle, _)| triangle));
    }
    for (hit, traced) in hits.iter_mut().zip(traced) {
        *hit = (traced.triangle != NO_TRIANGLE).then_some(traced.triangle);
    }
    Met::Each
}

/// Tests the rays against the triangles of a leaf, as `traverse::closest` does. Returns the depth
/// up to which any of them may still meet something nearer.
///
/// # Safety
/// The processor has the kernel's instructions.
#[inline(always)]
unsafe fn test<K: Kernel>(traced: &mut [Traced], leaf: &Leaf) -> f32 {
    let mut far = 0.0f32;
    let mut bounds = None;
    for own in traced {
        // SAFETY: as promised by the caller.
        let (mut met, found) =
            unsafe { K::new(&own.prepared).triangles(&own.prepared, leaf, own.t) };
        while met != 0 {
            let lane = met.trailing_zeros() as usize & 7;
            met &= met - 1;
            let (t, triangle) = (found.t.0[lane], leaf.triangles[lane]);
            // Where on a triangle's plane a ray is that runs within it nobody knows; one that passes
            // the leaf by does not meet it.
            if (t < own.t || (t == own.t && triangle < own.triangle))
                && own.prepared.enters(*bounds.get_or_insert_with(|| leaf.bounds()), own.t)
            {
                (own.t, own.triangle) = (t, triangle);
            }
        }
        far = far.max(own.t * own.along);
    }
    far * (1.0 + DEPTH_ERROR)
}

/// A beam in a tree.
struct Wide {
    beam: Beam,
    /// x, y, z of the origin along the beam's axes.
    origin: [f32; 3],
    /// By what boxes and triangles are made larger, in metres.
    error: f32,
}

impl Wide {
    #[inline(always)]
    fn new(beam: &Beam, tree: &WideTree) -> Self {
        let origin = beam.origin;
        let farthest = (origin - tree.low).abs().max((tree.high - origin).abs()).max_element();
        let error = farthest * WIDENING + origin.abs().max_element() * f32::EPSILON;
        Self { beam: *beam, origin: beam.axes.map(|axis| origin[axis]), error }
    }

    /// Which children's boxes a ray of the beam may meet up to a depth, and the depth at which
    /// they begin.
    #[inline(always)]
    fn boxes(&self, node: &Node, far: f32) -> (u32, Lanes) {
        let Self { beam: Beam { axes, sign, low, high, .. }, origin, error } = self;
        let rows = if *sign > 0.0 { [0, 1] } else { [1, 0] };
        let near_z = &node.bounds[2 * axes[2] + rows[0]].0;
        let far_z = &node.bounds[2 * axes[2] + rows[1]].0;
        let (mut near, mut is_met) = ([0.0; LANES], [false; LANES]);
        for lane in 0..LANES {
            near[lane] = larger((near_z[lane] - origin[2]) * sign - error, 0.0);
            is_met[lane] = near[lane] <= far;
        }
        for side in 0..2 {
            let least = &node.bounds[2 * axes[side]].0;
            let most = &node.bounds[2 * axes[side] + 1].0;
            for lane in 0..LANES {
                let end = (far_z[lane] - origin[2]) * sign + error;
                let begins = smaller(near[lane] * low[side], end * low[side]);
                let ends = larger(near[lane] * high[side], end * high[side]);
                is_met[lane] &= (end >= 0.0)
                    & (begins <= most[lane] - origin[side] + error)
                    & (ends >= least[lane] - origin[side] - error);
            }
        }
        (mask(|lane| is_met[lane]), Lanes(near))
    }

    /// A corner of the triangles of a leaf along the beam's axes.
    #[inline(always)]
    fn corner(&self, leaf: &Leaf, corner: usize) -> [[f32; LANES]; 3] {
        let mut along = [[0.0; LANES]; 3];
        for (axis, along) in along.iter_mut().enumerate() {
            let of_world = &leaf.corners[corner][self.beam.axes[axis]].0;
            let sign = if axis == 2 { self.beam.sign } else { 1.0 };
            for lane in 0..LANES {
                along[lane] = (of_world[lane] - self.origin[axis]) * sign;
            }
        }
        along
    }

    /// Which triangles of a leaf a ray of the beam may meet up to a depth.
    #[inline(always)]
    fn meeting(&self, leaf: &Leaf, far: f32) -> u32 {
        let Self { beam: Beam { low, high, .. }, error, .. } = self;
        let mut is_met = [true; LANES];
        let corners = [self.corner(leaf, 0), self.corner(leaf, 1), self.corner(leaf, 2)];
        // All corners are on the outer side of a side of the beam, behind it, or beyond the depth; or
        // they are no numbers, as those of absent triangles.
        for lane in 0..LANES {
            let [a, b, c] = [corners[0][2][lane], corners[1][2][lane], corners[2][2][lane]];
            let (least, most) = (smaller(smaller(a, b), c), larger(larger(a, b), c));
            is_met[lane] &= (most >= -error) & (least <= far + error);
        }
        for side in 0..2 {
            // The plane through the origin moves by as much as its slope times that of a corner.
            let margin = error * (1.0 + low[side].abs().max(high[side].abs()));
            for lane in 0..LANES {
                let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
                for corner in &corners {
                    let (across, depth) = (corner[side][lane], corner[2][lane]);
                    most = larger(across - low[side] * depth, most);
                    least = smaller(across - high[side] * depth, least);
                }
                is_met[lane] &= (most >= -margin) & (least <= margin);
            }
        }
        mask(|lane| is_met[lane])
    }

    /// The depth up to which a triangle reaches within the beam, where all rays meet it.
    fn covered(&self, leaf: &Leaf, lane: usize) -> Option<f32> {
        let Self { beam: Beam { low, high, .. }, error, .. } = self;
        let corners = [0, 1, 2]
            .map(|corner| Vec3::from_array(self.corner(leaf, corner).map(|lanes| lanes[lane])));
        if corners.iter().any(|corner| corner.z <= *error) {
            return None;
        }
        let sides = [
            Vec3::new(low[0], low[1], 1.0),
            Vec3::new(low[0], high[1], 1.0),
            Vec3::new(high[0], low[1], 1.0),
            Vec3::new(high[0], high[1], 1.0),
        ];
        let size = |v: Vec3| v.abs().element_sum();
        let [a, b, c] = corners;
        let mut facing = 0.0;
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let edge = p.cross(q);
            for side in sides {
                let inside = edge.dot(side);
                if inside.abs() <= 2.0 * error * (size(p) + size(q)) * size(side) {
                    return None;
                }
                if facing == 0.0 {
                    facing = inside.signum();
                }
                if inside * facing < 0.0 {
                    return None;
                }
            }
        }
        let normal = (b - a).cross(c - a);
        let depth = sides.map(|side| normal.dot(a) / normal.dot(side));
        let most = depth.into_iter().fold(0.0, f32::max) * (1.0 + 10.0 * DEPTH_ERROR) + error;
        let corner = a.z.max(b.z).max(c.z) + error;
        // Grazed, its depth is not well known.
        Some(if depth.iter().all(|depth| *depth > 0.0) { most.min(corner) } else { corner })
    }
}
