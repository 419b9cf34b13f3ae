//! Sums of products with a fixed order, written so that the compiler keeps them in vector
//! registers, wide ones inside `vectorised!`. Each has a fixed number of lanes and a fixed order, so that its
//! result depends neither on the width of the registers nor on alignment or threads.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Mul};

use faer::{Mat, MatMut, MatRef};

const LANES: usize = 16;

/// The value of an expression that is compiled for the widest registers of this machine, with all that is
/// inlined into it. What the compiler does not inline is compiled for those that every machine has; hence a
/// macro, which makes sure of it for the expression itself.
macro_rules! vectorised {
    ($job:expr) => {{
        let once = $crate::solve::kernels::Once;
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                let _once = once;
                $job
            },
        )
    }};
}
pub(crate) use vectorised;

/// Makes a closure that takes it one that is called once. Any other is called by way of a function that
/// the compiler may not inline.
pub(crate) struct Once;

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

/// Columns that are multiplied together, so that what they are multiplied by is read once for all.
pub const TOGETHER: usize = 4;

/// Σ aᵢ bᵢ of some columns `a` with each of `b`, all as long as the first of `b`, in double precision.
#[inline(always)]
pub fn dots_single<const B: usize>(a: [&[f32]; TOGETHER], b: [&[f64]; B]) -> [[f64; B]; TOGETHER] {
    // So few that all sums stay in registers.
    const FEW: usize = 4;
    let rows = b[0].len();
    let (a, b) = (a.map(|a| a[..rows].as_chunks::<FEW>()), b.map(|b| b.as_chunks::<FEW>()));
    let mut sums = [[[0.0; FEW]; B]; TOGETHER];
    let blocks = rows / FEW;
    let (a_blocks, b_blocks) = (a.map(|(a, _)| &a[..blocks]), b.map(|(b, _)| &b[..blocks]));
    for block in 0..blocks {
        for (sums, a) in sums.iter_mut().zip(&a_blocks) {
            let a = a[block].map(f64::from);
            for (sums, b) in sums.iter_mut().zip(&b_blocks) {
                for ((sum, a), b) in sums.iter_mut().zip(a).zip(b[block]) {
                    *sum += a * b;
                }
            }
        }
    }
    std::array::from_fn(|k| {
        std::array::from_fn(|j| {
            let rest = a[k].1.iter().zip(b[j].1);
            let tail: f64 = rest.map(|(&a, b)| f64::from(a) * b).sum();
            let [w, x, y, z] = sums[k][j];
            (w + x) + (y + z) + tail
        })
    })
}

/// The columns in groups of [`TOGETHER`], the last one more than once where it takes that to fill a group.
pub fn groups(columns: &[usize]) -> impl Iterator<Item = [usize; TOGETHER]> + '_ {
    columns.chunks(TOGETHER).map(|some| std::array::from_fn(|k| some[k.min(some.len() - 1)]))
}

/// Σ wᵢ aᵢ² in double precision.
#[inline(always)]
pub fn weighted_square(a: &[f32], weights: &[f64]) -> f64 {
    let mut squares = [0.0; LANES];
    let (blocks, weight_blocks) = (a.chunks_exact(LANES), weights.chunks_exact(LANES));
    let rest = blocks.remainder().iter().zip(weight_blocks.remainder());
    let tail: f64 = rest.map(|(&a, w)| w * f64::from(a) * f64::from(a)).sum();
    for (a, w) in blocks.zip(weight_blocks) {
        for lane in 0..LANES {
            let a = f64::from(a[lane]);
            squares[lane] += w[lane] * a * a;
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

/// The natural logarithm of a positive normal number, to about one unit in the last place; NaN for ∞
/// and NaN. Unlike the logarithm of the C library it is inlined into loops, where the compiler makes
/// vector instructions of it. The coefficients of the series are those of Sun's fdlibm (`e_log.c`).
#[inline(always)]
pub fn ln(x: f64) -> f64 {
    const ROOT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
    const BIAS: u64 = 1023;
    const MANTISSA_BITS: u32 = 52;
    // 2⁵², in whose lowest bits a small integer can be put.
    const WHOLE: u64 = 0x4330_0000_0000_0000;
    const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    // x = 2ᵏ m with √½ ≤ m < √2.
    let biased =
        (x.to_bits().wrapping_sub(ROOT_HALF).wrapping_add(BIAS << MANTISSA_BITS)) >> MANTISSA_BITS;
    let k = f64::from_bits(WHOLE | biased) - (f64::from_bits(WHOLE) + BIAS as f64);
    let m = x.to_bits().wrapping_sub(biased.wrapping_sub(BIAS) << MANTISSA_BITS);
    let f = f64::from_bits(m) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let even = w
        * (3.999_999_999_940_942e-1
            + w * (2.222_219_843_214_978_4e-1 + w * 1.531_383_769_920_937_3e-1));
    let odd = z
        * (6.666_666_666_666_735e-1
            + w * (2.857_142_874_366_239e-1
                + w * (1.818_357_216_161_805e-1 + w * 1.479_819_860_511_658_6e-1)));
    let half = 0.5 * f * f;
    let of_m = half - (s * (half + even + odd) + k * LN_2_LOW) - f;
    // The last term is NaN for ∞ and NaN, and otherwise 0.
    k * LN_2_HIGH - of_m + 0.0 * x
}

/// log₂ of a positive normal number in single precision, to three units in the last place; for loops as
/// [`ln`]. The coefficients of the series are those of fdlibm (`e_logf.c`).
#[inline(always)]
pub fn log2(x: f32) -> f32 {
    const ROOT_HALF: u32 = 0x3f35_04f3;
    const BIAS: u32 = 127;
    const MANTISSA_BITS: u32 = 23;
    // x = 2ᵏ m with √½ ≤ m < √2.
    let biased =
        x.to_bits().wrapping_sub(ROOT_HALF).wrapping_add(BIAS << MANTISSA_BITS) >> MANTISSA_BITS;
    let k = biased as i32 - BIAS as i32;
    let m = f32::from_bits(x.to_bits().wrapping_sub((k << MANTISSA_BITS) as u32));
    let f = m - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let even = w * (0.400_009_72 + w * 0.242_790_79);
    let odd = z * (0.666_666_6 + w * 0.284_987_87);
    let half = 0.5 * f * f;
    let of_m = f - (half - s * (half + even + odd));
    of_m * std::f32::consts::LOG2_E + k as f32
}

/// 2ˣ to 3e-7 relative, of at least 2⁻¹⁰⁰, which is also that of −∞ and NaN. Like [`ln`] it is inlined
/// into loops and made of vector instructions there.
#[inline(always)]
pub fn exp2(x: f32) -> f32 {
    let x = x.max(-100.0);
    // Adding 1.5 × 2²³ rounds to the nearest whole number.
    const ROUND: f32 = 12_582_912.0;
    let whole = (x + ROUND) - ROUND;
    let t = (x - whole) * std::f32::consts::LN_2;
    // Taylor series of eᵗ for |t| ≤ ln 2 / 2.
    let p = 1.0
        + t * (1.0
            + t * (0.5 + t * (1.0 / 6.0 + t * (1.0 / 24.0 + t * (1.0 / 120.0 + t / 720.0)))));
    p * f32::from_bits(((whole as i32 + 127) << 23) as u32)
}

/// y += factor · x.
#[inline(always)]
pub fn add_scaled<X: Copy + Into<f64>>(y: &mut [f64], factor: f64, x: &[X]) {
    for (y, &x) in y.iter_mut().zip(x) {
        *y += factor * x.into();
    }
}

/// y += Σ factorⱼ · xⱼ. The result is the same to the bit as that of [`add_scaled`] for one term after
/// the other, but `y` is read and written a quarter as often.
#[inline(always)]
pub fn add_all_scaled<X: Copy + Into<f64>>(y: &mut [f64], terms: &[(f64, &[X])]) {
    let fours = terms.chunks_exact(4);
    let rest = fours.remainder();
    for four in fours {
        let [(a, p), (b, q), (c, r), (d, s)] = [four[0], four[1], four[2], four[3]];
        for ((((y, &p), &q), &r), &s) in y.iter_mut().zip(p).zip(q).zip(r).zip(s) {
            *y = *y + a * p.into() + b * q.into() + c * r.into() + d * s.into();
        }
    }
    for &(factor, x) in rest {
        add_scaled(y, factor, x);
    }
}

/// A column of a matrix of ours, all of which are column-major.
pub fn column_of<T>(matrix: MatRef<'_, T>, column: usize) -> &[T] {
    let column = matrix.col(column).try_as_col_major().expect("own matrices are column-major");
    column.as_slice()
}

pub fn column_of_mut<T>(matrix: &mut Mat<T>, column: usize) -> &mut [T] {
    slice_of(matrix.as_mut(), column)
}

/// A column of a part of a matrix of ours.
pub fn slice_of<T>(matrix: MatMut<'_, T>, column: usize) -> &mut [T] {
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

#[cfg(test)]
mod tests;
