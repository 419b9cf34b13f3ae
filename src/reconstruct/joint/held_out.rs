//! How well a light model predicts what it was not fitted to.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::geometry::mesh::Mesh;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::math::sampling::Random;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::model::Model;
use crate::reconstruct::joint::terms::loss;
use crate::reconstruct::samples::Sample;
use crate::reconstruct::{Error, Stream};

/// Parts that are held out in turn.
pub const FOLDS: usize = 4;
/// Side of a block in half-diagonals. Errors of the light model and textures make neighbours
/// alike, so that single samples held out would be predicted by the ones beside them.
const BLOCK: f32 = 0.2;

/// The block of every row.
pub fn blocks(fitter: &Fitter) -> Vec<u64> {
    let mesh = &fitter.data.views.capture.mesh;
    let of = block(mesh);
    fitter.rows.sample.iter().map(|&sample| of(&fitter.data.cloud.samples[sample])).collect()
}

/// Tells the block of a sample: samples of one surface within one cell of a grid are in one.
pub fn block(mesh: &Mesh) -> impl Fn(&Sample) -> u64 {
    let (low, high) = mesh.bounds().unwrap_or_default();
    let side = (BLOCK * 0.5 * (high - low).length()).max(f32::MIN_POSITIVE);
    move |sample| {
        let cell = ((sample.position - low) / side).floor().as_u64vec3();
        ((cell.x << 21 | cell.y) << 21 | cell.z) ^ ((sample.surface as u64) << 44)
    }
}

/// The part, below [`FOLDS`], in which a block is held out.
pub fn fold(block: u64) -> usize {
    Random::new(0, Stream::Folds as u64, block).below(FOLDS)
}

/// What a model makes of blocks that were held out.
pub struct Prediction {
    /// Root mean square of log(computed/measured), per channel.
    pub error: Rgb,
    /// Per row its weight times what the fits make small there, all channels together.
    pub losses: Vec<f64>,
}

/// Fits the rows without a quarter of the blocks at a time, and predicts those.
pub fn predict(
    fitter: &Fitter,
    model: &Model,
    lambda: f64,
    fits: &Fits,
) -> Result<Prediction, Error> {
    let fold: Vec<usize> = blocks(fitter).into_iter().map(fold).collect();
    /// What one fold's rows add.
    struct Part {
        sum: Rgb,
        weight: f64,
        losses: Vec<(usize, f64)>,
    }
    let parts: Vec<Part> = (0..FOLDS)
        .into_par_iter()
        .map(|held| {
            let weights: Vec<f64> = fitter
                .weights
                .iter()
                .zip(&fold)
                .map(|(&weight, &fold)| if fold == held { 0.0 } else { weight })
                .collect();
            let fitted = fitter.fit(model, lambda, &weights, Some(fits))?;
            let mut part = Part { sum: [0.0; CHANNELS], weight: 0.0, losses: Vec::new() };
            for (row, &weight) in fitter.weights.iter().enumerate() {
                if fold[row] == held {
                    part.weight += weight;
                    for (sum, fit) in part.sum.iter_mut().zip(&fitted) {
                        *sum += weight * fit.residuals[row].powi(2);
                    }
                    part.losses.push((row, weight * loss_of(fitter, &fitted, row)));
                }
            }
            Ok(part)
        })
        .collect::<Result<_, Error>>()?;
    let total: f64 = parts.iter().map(|part| part.weight).sum();
    let error = std::array::from_fn(|c| {
        (parts.iter().map(|part| part.sum[c]).sum::<f64>() / total.max(f64::MIN_POSITIVE)).sqrt()
    });
    let mut losses = vec![0.0; fitter.weights.len()];
    for (row, loss) in parts.into_iter().flat_map(|part| part.losses) {
        losses[row] = loss;
    }
    Ok(Prediction { error, losses })
}

/// The same of the rows that a model was fitted to: no prediction of it is better.
pub fn losses_within(fitter: &Fitter, fits: &Fits) -> Vec<f64> {
    let of = |(row, weight): (usize, &f64)| weight * loss_of(fitter, fits, row);
    fitter.weights.iter().enumerate().map(of).collect()
}

fn loss_of(fitter: &Fitter, fits: &Fits, row: usize) -> f64 {
    // Not even an infinity counts where there is no weight.
    if fitter.weights[row] <= 0.0 {
        return 0.0;
    }
    let robust = fitter.robust[fitter.rows.material[row]];
    let objective = fitter.options.objective;
    fits.iter().map(|fit| loss(objective.of(fit.residuals[row]).0, robust)).sum()
}

/// Root mean square of log(computed/measured) over blocks that were held out, per channel.
pub fn error(fitter: &Fitter, model: &Model, lambda: f64, fits: &Fits) -> Result<Rgb, Error> {
    Ok(predict(fitter, model, lambda, fits)?.error)
}

/// By how much one model predicts better than another, block by block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Roots of the mean losses of the two.
    pub before: f64,
    pub after: f64,
    /// after/before − 1.
    pub relative: f64,
    /// Of that, from the differences of the blocks, which are taken to be independent; ∞ where
    /// there are fewer than two.
    pub standard_error: f64,
}

impl Change {
    /// Compares the losses of two models on some rows, of one fitter both.
    pub fn between(
        fitter: &Fitter,
        before: &[f64],
        after: &[f64],
        counts: impl Fn(usize) -> bool,
    ) -> Self {
        let mut of_block: BTreeMap<u64, [f64; 3]> = BTreeMap::new();
        for (row, block) in blocks(fitter).into_iter().enumerate() {
            if fitter.weights[row] > 0.0 && counts(row) {
                let sums = of_block.entry(block).or_default();
                sums[0] += CHANNELS as f64 * fitter.weights[row];
                sums[1] += before[row];
                sums[2] += after[row];
            }
        }
        let blocks: Vec<[f64; 3]> = of_block.into_values().collect();
        Self::of_blocks(&blocks)
    }

    /// From weight and the two losses of every block.
    fn of_blocks(blocks: &[[f64; 3]]) -> Self {
        let sum = |k: usize| blocks.iter().map(|block| block[k]).sum::<f64>();
        let weight = sum(0).max(f64::MIN_POSITIVE);
        let (before, after) = (sum(1) / weight, sum(2) / weight);
        let fall = before - after;
        // Of a ratio of sums, blocks being unequal.
        let squares: f64 =
            blocks.iter().map(|block| (block[1] - block[2] - fall * block[0]).powi(2)).sum();
        let count = blocks.len() as f64;
        let of_fall = (squares * count / (count - 1.0).max(f64::MIN_POSITIVE)).sqrt() / weight;
        let both = (before * after).sqrt();
        Self {
            before: before.sqrt(),
            after: after.sqrt(),
            relative: if before > 0.0 { (after / before).sqrt() - 1.0 } else { 0.0 },
            standard_error: if blocks.len() < 2 || both <= 0.0 {
                f64::INFINITY
            } else {
                0.5 * of_fall / both
            },
        }
    }

    /// Whether the error falls by more than its standard error.
    pub fn is_supported(&self) -> bool {
        -self.relative > self.standard_error
    }
}

/// One number for all channels.
pub fn mean(error: &Rgb) -> f64 {
    (error.iter().map(|value| value * value).sum::<f64>() / CHANNELS as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_paired_and_their_error_is_that_of_their_mean() {
        // Equal weights: the fall is the mean of 0.2, 0.4, 0.6, its error 0.2/√3 by hand.
        let blocks = [[1.0, 1.0, 0.8], [1.0, 9.0, 8.6], [1.0, 2.0, 1.4]];
        let change = Change::of_blocks(&blocks);
        assert!((change.before - 4.0f64.sqrt()).abs() < 1e-12);
        assert!((change.relative - ((3.6f64 / 4.0).sqrt() - 1.0)).abs() < 1e-12);
        let of_fall = 0.2 / 3.0f64.sqrt();
        let of_root = of_fall / (2.0 * (4.0f64 * 3.6).sqrt());
        assert!((change.standard_error - of_root).abs() < 1e-12, "{change:?}");
        // However different the blocks are, all of them fell.
        assert!(change.is_supported());
        let mixed = Change::of_blocks(&[[1.0, 1.0, 0.5], [1.0, 1.0, 1.4], [1.0, 1.0, 1.0]]);
        assert!(mixed.relative < 0.0 && !mixed.is_supported(), "{mixed:?}");
        assert!(!Change::of_blocks(&blocks[..1]).is_supported());
        assert!(!Change::of_blocks(&[]).is_supported());
        assert!(!Change::of_blocks(&[[1.0, 0.0, 0.0]; 3]).is_supported());
    }
}
