//! The tests in plain Rust, for processors without a kernel of their own.
//!
//! Why no ray slips between triangles (Woop, Benthin, Wald 2013): the corners are projected along
//! the ray onto a plane, each by itself, so that neighbours agree to the bit on where a shared
//! corner lies. There, a triangle is met if the ray's point is on the inner side of all edges or
//! on an edge. Which side that is comes from comparing two products; rounding keeps their order or
//! makes them equal, and so never takes one side for the other, only a side for the edge itself.
//! What is inside the projected mesh is thus inside one of its triangles. Fused multiply-adds
//! would round one product and not the other, and break this.

use std::array::from_fn;

use super::beam::{self, Beam, Met};
use super::ray::Prepared;
use super::traverse::{self, Kernel, LeafHits, Slot};
use super::wide::{LANES, Lanes, Leaf, Node, WideTree};
use super::{Blocker, Hit, Ray};

pub fn closest(tree: &WideTree, ray: &Ray, stack: &mut [Slot]) -> Option<Hit> {
    // SAFETY: every processor has these instructions.
    unsafe { traverse::closest::<Portable>(tree, ray, stack) }
}

pub fn occluded(tree: &WideTree, ray: &Ray, last: &mut Blocker, stack: &mut [Slot]) -> bool {
    // SAFETY: every processor has these instructions.
    unsafe { traverse::occluded::<Portable>(tree, ray, last, stack) }
}

pub fn closest_of_beam(
    tree: &WideTree,
    beam: &Beam,
    rays: &dyn Fn(usize) -> Ray,
    hits: &mut [Option<u32>],
    stack: &mut [Slot],
) -> Met {
    // SAFETY: every processor has these instructions.
    unsafe { beam::closest::<Portable>(tree, beam, rays, hits, stack) }
}

/// A ray as it was prepared.
struct Portable {
    prepared: Prepared,
}

impl Kernel for Portable {
    #[inline(always)]
    unsafe fn new(prepared: &Prepared) -> Self {
        Self { prepared: *prepared }
    }

    #[inline(always)]
    unsafe fn boxes(&self, node: &Node, t_max: f32) -> (u32, Lanes) {
        let ray = &self.prepared;
        let [mut near, mut far] = [[ray.t_min; LANES], [t_max; LANES]];
        for axis in 0..3 {
            let near_bound = &node.bounds[ray.near_row[axis]].0;
            let far_bound = &node.bounds[ray.near_row[axis] ^ 1].0;
            for lane in 0..LANES {
                let enters = (near_bound[lane] - ray.near_origin[axis]) * ray.inverse[axis];
                let leaves = (far_bound[lane] - ray.far_origin[axis]) * ray.inverse[axis];
                near[lane] = larger(enters, near[lane]);
                far[lane] = smaller(leaves, far[lane]);
            }
        }
        (mask(|lane| near[lane] <= far[lane]), Lanes(near))
    }

    #[inline(always)]
    unsafe fn triangles(&self, ray: &Prepared, leaf: &Leaf, t_max: f32) -> (u32, LeafHits) {
        let [a, b, c] = leaf.corners.each_ref().map(|corner| {
            let [x, y, z] = from_fn(|axis| {
                let along = &corner[ray.axes[axis]].0;
                from_fn::<f32, LANES, _>(|lane| along[lane] - ray.origin[axis])
            });
            let x: [f32; LANES] = from_fn(|lane| x[lane] - ray.shear[0] * z[lane]);
            let y: [f32; LANES] = from_fn(|lane| y[lane] - ray.shear[1] * z[lane]);
            [x, y, z]
        });
        let edge = |p: &[[f32; LANES]; 3], q: &[[f32; LANES]; 3]| -> [f32; LANES] {
            from_fn(|lane| q[0][lane] * p[1][lane] - q[1][lane] * p[0][lane])
        };
        let (u, v, w) = (edge(&b, &c), edge(&c, &a), edge(&a, &b));
        let sum: [f32; LANES] = from_fn(|lane| u[lane] + v[lane] + w[lane]);
        let t: [f32; LANES] = from_fn(|lane| {
            let weighted = u[lane] * a[2][lane] + v[lane] * b[2][lane] + w[lane] * c[2][lane];
            weighted * ray.shear[2] / sum[lane]
        });
        let met = mask(|lane| {
            let least = smaller(smaller(u[lane], v[lane]), w[lane]);
            let most = larger(larger(u[lane], v[lane]), w[lane]);
            (least >= 0.0 || most <= 0.0) && t[lane] >= ray.t_min && t[lane] <= t_max
        });
        let hits = LeafHits { t: Lanes(t), v: Lanes(v), w: Lanes(w), sum: Lanes(sum) };
        (met, hits)
    }
}

/// The bits of the lanes that pass a test.
#[inline(always)]
pub fn mask(test: impl Fn(usize) -> bool) -> u32 {
    (0..LANES).fold(0, |mask, lane| mask | u32::from(test(lane)) << lane)
}

#[inline(always)]
pub fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
pub fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
