//! The tests with AVX2: eight children or triangles at once.
//!
//! Fused multiply-adds would save instructions but round otherwise than the portable kernel, and
//! in the edge functions they would take away the antisymmetry that makes shared edges tight.

use std::arch::x86_64::*;

use super::beam::{self, Beam, Met};
use super::ray::Prepared;
use super::traverse::{self, Kernel, LeafHits, Slot};
use super::wide::{Lanes, Leaf, Node, WideTree};
use super::{Blocker, Hit, Ray};

/// Whether the processor has AVX2, as this file calls it: with the instructions for masks that
/// came along with it.
pub fn is_available() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

/// # Safety
/// `is_available`.
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
pub unsafe fn closest(tree: &WideTree, ray: &Ray, stack: &mut [Slot]) -> Option<Hit> {
    // SAFETY: as promised by the caller.
    unsafe { traverse::closest::<Avx2>(tree, ray, stack) }
}

/// # Safety
/// `is_available`.
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
pub unsafe fn occluded(tree: &WideTree, ray: &Ray, last: &mut Blocker, stack: &mut [Slot]) -> bool {
    // SAFETY: as promised by the caller.
    unsafe { traverse::occluded::<Avx2>(tree, ray, last, stack) }
}

/// # Safety
/// `is_available`.
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
pub unsafe fn closest_of_beam(
    tree: &WideTree,
    beam: &Beam,
    rays: &dyn Fn(usize) -> Ray,
    hits: &mut [Option<u32>],
    stack: &mut [Slot],
) -> Met {
    // SAFETY: as promised by the caller.
    unsafe { beam::closest::<Avx2>(tree, beam, rays, hits, stack) }
}

/// A ray spread over registers.
struct Avx2 {
    near_row: [usize; 3],
    near_origin: [__m256; 3],
    far_origin: [__m256; 3],
    inverse: [__m256; 3],
    t_min: __m256,
}

impl Avx2 {
    /// Where the ray enters the children's slabs along an axis.
    ///
    /// # Safety
    /// The processor has AVX2.
    #[inline(always)]
    unsafe fn enter(&self, node: &Node, axis: usize) -> __m256 {
        // SAFETY: the caller promises AVX2; rows are below 6.
        unsafe {
            let bound = load(node.bounds.get_unchecked(self.near_row[axis]));
            _mm256_mul_ps(_mm256_sub_ps(bound, self.near_origin[axis]), self.inverse[axis])
        }
    }

    /// Where the ray leaves them.
    ///
    /// # Safety
    /// The processor has AVX2.
    #[inline(always)]
    unsafe fn leave(&self, node: &Node, axis: usize) -> __m256 {
        // SAFETY: the caller promises AVX2; rows are below 6, and so is the other row of a pair.
        unsafe {
            let bound = load(node.bounds.get_unchecked(self.near_row[axis] ^ 1));
            _mm256_mul_ps(_mm256_sub_ps(bound, self.far_origin[axis]), self.inverse[axis])
        }
    }
}

impl Kernel for Avx2 {
    #[inline(always)]
    unsafe fn new(prepared: &Prepared) -> Self {
        // SAFETY: the caller promises AVX2.
        unsafe {
            Self {
                near_row: prepared.near_row,
                near_origin: spread(&prepared.near_origin),
                far_origin: spread(&prepared.far_origin),
                inverse: spread(&prepared.inverse),
                t_min: _mm256_set1_ps(prepared.t_min),
            }
        }
    }

    #[inline(always)]
    unsafe fn boxes(&self, node: &Node, t_max: f32) -> (u32, Lanes) {
        // SAFETY: the caller promises AVX2, and `Lanes` are aligned to 32 bytes.
        unsafe {
            let near = _mm256_max_ps(
                _mm256_max_ps(self.enter(node, 0), self.enter(node, 1)),
                _mm256_max_ps(self.enter(node, 2), self.t_min),
            );
            let far = _mm256_min_ps(
                _mm256_min_ps(self.leave(node, 0), self.leave(node, 1)),
                _mm256_min_ps(self.leave(node, 2), _mm256_set1_ps(t_max)),
            );
            let met = _mm256_cmp_ps::<_CMP_LE_OQ>(near, far);
            (_mm256_movemask_ps(met) as u32, store(near))
        }
    }

    #[inline(always)]
    unsafe fn triangles(&self, ray: &Prepared, leaf: &Leaf, t_max: f32) -> (u32, LeafHits) {
        // SAFETY: the caller promises AVX2, and `Lanes` are aligned to 32 bytes.
        unsafe {
            let (origin, shear) = (spread(&ray.origin), spread(&ray.shear));
            let a = sheared(&leaf.corners[0], ray, &origin, &shear);
            let b = sheared(&leaf.corners[1], ray, &origin, &shear);
            let c = sheared(&leaf.corners[2], ray, &origin, &shear);
            let (u, v, w) = (edge(&b, &c), edge(&c, &a), edge(&a, &b));

            let nothing = Lanes([0.0; 8]);
            let zero = _mm256_setzero_ps();
            let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
            let most = _mm256_max_ps(_mm256_max_ps(u, v), w);
            let inside = _mm256_or_ps(
                _mm256_cmp_ps::<_CMP_GE_OQ>(least, zero),
                _mm256_cmp_ps::<_CMP_LE_OQ>(most, zero),
            );
            if _mm256_movemask_ps(inside) == 0 {
                return (0, LeafHits { t: nothing, v: nothing, w: nothing, sum: nothing });
            }

            let sum = _mm256_add_ps(_mm256_add_ps(u, v), w);
            let weighted = _mm256_add_ps(
                _mm256_add_ps(_mm256_mul_ps(u, a[2]), _mm256_mul_ps(v, b[2])),
                _mm256_mul_ps(w, c[2]),
            );
            let t = _mm256_div_ps(_mm256_mul_ps(weighted, shear[2]), sum);
            let late = _mm256_cmp_ps::<_CMP_GE_OQ>(t, self.t_min);
            let early = _mm256_cmp_ps::<_CMP_LE_OQ>(t, _mm256_set1_ps(t_max));
            let met = _mm256_and_ps(inside, _mm256_and_ps(late, early));
            let met = _mm256_movemask_ps(met) as u32;
            if met == 0 {
                return (0, LeafHits { t: nothing, v: nothing, w: nothing, sum: nothing });
            }
            (met, LeafHits { t: store(t), v: store(v), w: store(w), sum: store(sum) })
        }
    }
}

// No closures and no `map` above: they would not inherit the target's features, and every
// instruction in them would become a call.

/// A corner as seen along the ray.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn sheared(
    corner: &[Lanes; 3],
    ray: &Prepared,
    origin: &[__m256; 3],
    shear: &[__m256; 3],
) -> [__m256; 3] {
    // SAFETY: the caller promises AVX2; `axes` are below 3.
    unsafe {
        let x = _mm256_sub_ps(load(corner.get_unchecked(ray.axes[0])), origin[0]);
        let y = _mm256_sub_ps(load(corner.get_unchecked(ray.axes[1])), origin[1]);
        let z = _mm256_sub_ps(load(corner.get_unchecked(ray.axes[2])), origin[2]);
        let x = _mm256_sub_ps(x, _mm256_mul_ps(shear[0], z));
        let y = _mm256_sub_ps(y, _mm256_mul_ps(shear[1], z));
        [x, y, z]
    }
}

/// Twice the signed area between the ray and an edge; exactly opposite for the opposite edge.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn edge(p: &[__m256; 3], q: &[__m256; 3]) -> __m256 {
    // SAFETY: the caller promises AVX2.
    unsafe { _mm256_sub_ps(_mm256_mul_ps(q[0], p[1]), _mm256_mul_ps(q[1], p[0])) }
}

/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn spread(values: &[f32; 3]) -> [__m256; 3] {
    // SAFETY: the caller promises AVX2.
    unsafe { [_mm256_set1_ps(values[0]), _mm256_set1_ps(values[1]), _mm256_set1_ps(values[2])] }
}

/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn load(lanes: &Lanes) -> __m256 {
    // SAFETY: `Lanes` are aligned to 32 bytes.
    unsafe { _mm256_load_ps(lanes.0.as_ptr()) }
}

/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn store(register: __m256) -> Lanes {
    let mut lanes = Lanes([0.0; 8]);
    // SAFETY: `Lanes` are aligned to 32 bytes.
    unsafe { _mm256_store_ps(lanes.0.as_mut_ptr(), register) };
    lanes
}
