//! Sums of products with a fixed order, written so that the compiler keeps them in vector
//! registers. Their result does not depend on alignment or threads.

const LANES: usize = 8;

/// Σ aᵢ bᵢ.
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
pub fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

fn fold(sums: &[f64; LANES]) -> f64 {
    ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]))
}
