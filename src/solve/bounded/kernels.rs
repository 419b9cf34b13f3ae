//! Sums of products with a fixed order, written so that the compiler keeps them in vector
//! registers, wide ones inside `vectorised`. Lanes and order are the same in all of them, so the
//! result depends neither on that nor on alignment or threads.

const LANES: usize = 16;

/// Runs `job` compiled for the widest registers of this machine, as far as it is inlined.
#[inline]
pub fn vectorised<R>(job: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(job)
}

/// Σ aᵢ bᵢ.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (a_blocks, b_blocks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let tail: f64 = a_blocks.remainder().iter().zip(b_blocks.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_blocks.zip(b_blocks) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    fold(&sums) + tail
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

#[inline(always)]
fn fold(sums: &[f64; LANES]) -> f64 {
    let mut sums = *sums;
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            sums[lane] += sums[lane + half];
        }
        half /= 2;
    }
    sums[0]
}
