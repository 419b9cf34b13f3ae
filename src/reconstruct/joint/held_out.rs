//! How well a light model predicts what it was not fitted to.

use rayon::prelude::*;

use crate::geometry::mesh::Mesh;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::math::sampling::Random;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::model::Model;
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

/// Root mean square of log(computed/measured) over blocks that were held out, per channel: the
/// rows are fitted without a quarter of the blocks at a time.
pub fn error(fitter: &Fitter, model: &Model, lambda: f64, fits: &Fits) -> Result<Rgb, Error> {
    let fold: Vec<usize> = blocks(fitter).into_iter().map(fold).collect();
    let sums: Vec<(Rgb, f64)> = (0..FOLDS)
        .into_par_iter()
        .map(|held| {
            let weights: Vec<f64> = fitter
                .weights
                .iter()
                .zip(&fold)
                .map(|(&weight, &fold)| if fold == held { 0.0 } else { weight })
                .collect();
            let fitted = fitter.fit(model, lambda, &weights, Some(fits))?;
            let (mut sum, mut total) = ([0.0; CHANNELS], 0.0);
            for (row, &weight) in fitter.weights.iter().enumerate() {
                if fold[row] == held {
                    total += weight;
                    for (sum, fit) in sum.iter_mut().zip(&fitted) {
                        *sum += weight * fit.residuals[row].powi(2);
                    }
                }
            }
            Ok((sum, total))
        })
        .collect::<Result<_, Error>>()?;
    let total: f64 = sums.iter().map(|(_, total)| total).sum();
    Ok(std::array::from_fn(|c| {
        (sums.iter().map(|(sum, _)| sum[c]).sum::<f64>() / total.max(f64::MIN_POSITIVE)).sqrt()
    }))
}

/// One number for all channels.
pub fn mean(error: &Rgb) -> f64 {
    (error.iter().map(|value| value * value).sum::<f64>() / CHANNELS as f64).sqrt()
}
