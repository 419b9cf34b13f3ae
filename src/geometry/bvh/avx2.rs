//! The tests with AVX2: eight children or triangles at once.
//!
//! Fused multiply-adds would save instructions but round otherwise than the portable kernel, and
//! in the edge functions they would take away the antisymmetry that makes shared edges tight.

use std::arch::x86_64::*;

use super::ray::Prepared;
use super::traverse::{self, Kernel, LeafHits};
use super::wide::{Lanes, Leaf, Node, WideTree};
use super::{Hit, Ray};

/// # Safety
/// The processor has AVX2.
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
pub unsafe fn closest(tree: &WideTree, ray: &Ray) -> Option<Hit> {
    // SAFETY: as promised by the caller.
    unsafe { traverse::closest::<Avx2>(tree, ray) }
}

/// # Safety
/// The processor has AVX2.
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
pub unsafe fn occluded(tree: &WideTree, ray: &Ray) -> bool {
    // SAFETY: as promised by the caller.
    unsafe { traverse::occluded::<Avx2>(tree, ray) }
}

/// A ray spread over registers.
struct Avx2 {
    near_row: [usize; 3],
    near_origin: [__m256; 3],
    far_origin: [__m256; 3],
    inverse: [__m256; 3],
    t_min: __m256,
}

impl Kernel for Avx2 {
    #[inline(always)]
    unsafe fn new(prepared: &Prepared) -> Self {
        // SAFETY: the caller promises AVX2.
        let spread = |values: [f32; 3]| values.map(|value| unsafe { _mm256_set1_ps(value) });
        Self {
            near_row: prepared.near_row,
            near_origin: spread(prepared.near_origin),
            far_origin: spread(prepared.far_origin),
            inverse: spread(prepared.inverse),
            // SAFETY: the caller promises AVX2.
            t_min: unsafe { _mm256_set1_ps(prepared.t_min) },
        }
    }

    #[inline(always)]
    unsafe fn boxes(&self, node: &Node, t_max: f32) -> (u32, Lanes) {
        // SAFETY: the caller promises AVX2, and `Lanes` are aligned to 32 bytes.
        unsafe {
            let near = |axis: usize| {
                let bound = load(node.bounds.get_unchecked(self.near_row[axis]));
                _mm256_mul_ps(_mm256_sub_ps(bound, self.near_origin[axis]), self.inverse[axis])
            };
            let far = |axis: usize| {
                let bound = load(node.bounds.get_unchecked(self.near_row[axis] ^ 1));
                _mm256_mul_ps(_mm256_sub_ps(bound, self.far_origin[axis]), self.inverse[axis])
            };
            let near =
                _mm256_max_ps(_mm256_max_ps(near(0), near(1)), _mm256_max_ps(near(2), self.t_min));
            let far = _mm256_min_ps(
                _mm256_min_ps(far(0), far(1)),
                _mm256_min_ps(far(2), _mm256_set1_ps(t_max)),
            );
            let met = _mm256_cmp_ps::<_CMP_LE_OQ>(near, far);
            (_mm256_movemask_ps(met) as u32, store(near))
        }
    }

    #[inline(always)]
    unsafe fn triangles(&self, ray: &Prepared, leaf: &Leaf, t_max: f32) -> (u32, LeafHits) {
        // SAFETY: the caller promises AVX2, and `Lanes` are aligned to 32 bytes.
        unsafe {
            let [shear_x, shear_y, scale] = ray.shear.map(|value| _mm256_set1_ps(value));
            let origin = ray.origin.map(|value| _mm256_set1_ps(value));
            let sheared = |corner: &[Lanes; 3]| {
                let along = |axis: usize| {
                    _mm256_sub_ps(load(corner.get_unchecked(ray.axes[axis])), origin[axis])
                };
                let z = along(2);
                let x = _mm256_sub_ps(along(0), _mm256_mul_ps(shear_x, z));
                let y = _mm256_sub_ps(along(1), _mm256_mul_ps(shear_y, z));
                [x, y, z]
            };
            let edge = |p: &[__m256; 3], q: &[__m256; 3]| {
                _mm256_sub_ps(_mm256_mul_ps(q[0], p[1]), _mm256_mul_ps(q[1], p[0]))
            };
            let [a, b, c] = [0, 1, 2].map(|corner| sheared(&leaf.corners[corner]));
            let (u, v, w) = (edge(&b, &c), edge(&c, &a), edge(&a, &b));

            let zero = _mm256_setzero_ps();
            let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
            let most = _mm256_max_ps(_mm256_max_ps(u, v), w);
            let inside = _mm256_or_ps(
                _mm256_cmp_ps::<_CMP_GE_OQ>(least, zero),
                _mm256_cmp_ps::<_CMP_LE_OQ>(most, zero),
            );
            if _mm256_movemask_ps(inside) == 0 {
                return (0, LeafHits { t: store(zero), u: store(zero), v: store(zero) });
            }

            let sum = _mm256_add_ps(_mm256_add_ps(u, v), w);
            let weighted = _mm256_add_ps(
                _mm256_add_ps(_mm256_mul_ps(u, a[2]), _mm256_mul_ps(v, b[2])),
                _mm256_mul_ps(w, c[2]),
            );
            let t = _mm256_div_ps(_mm256_mul_ps(weighted, scale), sum);
            let late = _mm256_cmp_ps::<_CMP_GE_OQ>(t, self.t_min);
            let early = _mm256_cmp_ps::<_CMP_LE_OQ>(t, _mm256_set1_ps(t_max));
            let met = _mm256_and_ps(inside, _mm256_and_ps(late, early));
            let hits = LeafHits {
                t: store(t),
                u: store(_mm256_div_ps(v, sum)),
                v: store(_mm256_div_ps(w, sum)),
            };
            (_mm256_movemask_ps(met) as u32, hits)
        }
    }
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
