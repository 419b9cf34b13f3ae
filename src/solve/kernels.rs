//! Sums of products with a fixed order, written so that the compiler keeps them in vector
//! registers, wide ones inside `vectorised`. Lanes and order are the same in all of them, so the
//! result depends neither on that nor on alignment or threads.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Mul};

use faer::{Mat, MatRef};

const LANES: usize = 16;

/// Runs `job` compiled for the widest registers of this machine, as far as it is inlined.
#[inline]
pub fn vectorised<R>(job: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(job)
}

/// Σ aᵢ bᵢ, in single or double precision.
#[inline(always)]
pub fn dot<T>(a: &[T], b: &[T]) -> T
where
    T: Copy + Default + AddAssign + Add<Output = T> + Mul<Output = T> + Sum,
{
    let mut sums = [T::default(); LANES];
    let (a_blocks, b_blocks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest = a_blocks.remainder().iter().zip(b_blocks.remainder());
    let tail: T = rest.map(|(&a, &b)| a * b).sum();
    for (a, b) in a_blocks.zip(b_blocks) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    fold(&sums) + tail
}

/// Σ wᵢ aᵢ².
#[inline(always)]
pub fn weighted_square(a: &[f64], weights: &[f64]) -> f64 {
    let mut squares = [0.0; LANES];
    let (blocks, weight_blocks) = (a.chunks_exact(LANES), weights.chunks_exact(LANES));
    let rest = blocks.remainder().iter().zip(weight_blocks.remainder());
    let tail: f64 = rest.map(|(a, w)| w * a * a).sum();
    for (a, w) in blocks.zip(weight_blocks) {
        for lane in 0..LANES {
            squares[lane] += w[lane] * a[lane] * a[lane];
        }
    }
    fold(&squares) + tail
}

/// Σ aᵢ bᵢ and Σ (wᵢ aᵢ)² in one reading of `a`.
#[inline(always)]
pub fn dot_and_square(a: &[f64], b: &[f64], weights: Option<&[f64]>) -> (f64, f64) {
    let Some(weights) = weights else { return (dot(a, b), dot(a, a)) };
    let (mut sums, mut squares) = ([0.0; LANES], [0.0; LANES]);
    let whole = a.len() - a.len() % LANES;
    for row in (0..whole).step_by(LANES) {
        let (a, b, w) = (&a[row..row + LANES], &b[row..row + LANES], &weights[row..row + LANES]);
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
            let weighted = w[lane] * a[lane];
            squares[lane] += weighted * weighted;
        }
    }
    let (mut sum, mut square) = (fold(&sums), fold(&squares));
    for row in whole..a.len() {
        sum += a[row] * b[row];
        square += (weights[row] * a[row]) * (weights[row] * a[row]);
    }
    (sum, square)
}

/// y += factor · x.
#[inline(always)]
pub fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// A column of a matrix of ours, all of which are column-major.
pub fn column_of<T>(matrix: MatRef<'_, T>, column: usize) -> &[T] {
    let column = matrix.col(column).try_as_col_major().expect("own matrices are column-major");
    column.as_slice()
}

pub fn column_of_mut(matrix: &mut Mat<f64>, column: usize) -> &mut [f64] {
    let column = matrix.col_mut(column).try_as_col_major_mut();
    column.expect("own matrices are column-major").as_slice_mut()
}

#[inline(always)]
fn fold<T: Copy + AddAssign>(sums: &[T; LANES]) -> T {
    let mut sums = *sums;
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            let other = sums[lane + half];
            sums[lane] += other;
        }
        half /= 2;
    }
    sums[0]
}
