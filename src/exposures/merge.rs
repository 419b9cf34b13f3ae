//! Radiance as the weighted average over exposures (Debevec and Malik 1997, Eq. 6).

use rayon::prelude::*;

use super::options::Weights;
use super::response::{Response, weight};
use super::{Codes, Exposure, MergeOptions};
use crate::math::rgb::{CHANNELS, Radiance};
use crate::watch::{Cancelled, Watch};

/// A merged series.
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    pub width: usize,
    pub height: usize,
    /// Radiance, row by row from the top; NaN in all channels where one of them was measured by
    /// no exposure.
    pub pixels: Vec<Radiance>,
    /// The number of pixels saturated in every exposure that shows them.
    pub too_bright: usize,
    /// The number of other pixels that were not measured.
    pub too_dark: usize,
}

/// What a code counts for and says; the same for all exposures of a depth.
struct Table {
    /// For each code and channel: weight, weight × ln exposure.
    entries: Vec<[[f32; 2]; CHANNELS]>,
}

impl Table {
    /// For codes 0 to `last`.
    fn new(response: &Response, options: &MergeOptions, last: u16) -> Self {
        let entries = (0..=last)
            .into_par_iter()
            .map(|code| {
                let code = f32::from(code) * (super::FULL_SCALE / f32::from(last));
                std::array::from_fn(|channel| {
                    let weight = weight(response, options, channel, code);
                    let ln_exposure = response.ln_exposure(channel, code);
                    // Below black a linear code says nothing, and 0 × −∞ is no number.
                    if weight > 0.0 && ln_exposure.is_finite() {
                        [weight as f32, (weight * ln_exposure) as f32]
                    } else {
                        [0.0; 2]
                    }
                })
            })
            .collect();
        Self { entries }
    }
}

/// Merges the exposures of one view that `trusted` names, into the frame of the exposure
/// numbered `reference`. The image's vignetting is divided out as the options say.
///
/// Beside the exposures it needs 12 bytes a pixel.
///
/// # Panics
/// If `trusted` does not have an entry for each exposure, or there is no exposure `reference`.
pub fn merge(
    exposures: &[Exposure],
    trusted: &[bool],
    reference: usize,
    response: &Response,
    options: &MergeOptions,
    watch: &Watch,
) -> Result<Merged, Cancelled> {
    assert_eq!(exposures.len(), trusted.len());
    let (width, height) = (exposures[reference].width, exposures[reference].height);
    let has = |eight: bool| exposures.iter().any(|e| matches!(e.codes, Codes::Eight(_)) == eight);
    let eight = Table::new(response, options, if has(true) { 255 } else { 1 });
    let sixteen = Table::new(response, options, if has(false) { u16::MAX } else { 1 });
    let used: Vec<(&Exposure, f32)> = std::iter::zip(exposures, trusted)
        .filter(|(_, trusted)| **trusted)
        .map(|(exposure, _)| (exposure, exposure.seconds.ln() as f32))
        .collect();
    let is_shared = options.weights == Weights::Hat;
    let mut pixels = vec![[0.0_f32; CHANNELS]; width * height];
    let counts = pixels
        .par_chunks_mut(width.max(1))
        .enumerate()
        .map(|(y, row)| {
            watch.check()?;
            let mut sums = vec![[[0.0_f32; 2]; CHANNELS]; width];
            for &(exposure, ln_time) in &used {
                match &exposure.codes {
                    Codes::Eight(codes) => {
                        add(&mut sums, exposure, codes, y, &eight, ln_time, is_shared);
                    }
                    Codes::Sixteen(codes) => {
                        add(&mut sums, exposure, codes, y, &sixteen, ln_time, is_shared);
                    }
                }
            }
            let mut counts = [0, 0];
            for (x, (pixel, sums)) in row.iter_mut().zip(&sums).enumerate() {
                if sums.iter().all(|[weight, _]| *weight > 0.0) {
                    *pixel = sums.map(|[weight, sum]| (sum / weight).exp());
                } else {
                    *pixel = [f32::NAN; CHANNELS];
                    counts[usize::from(!is_saturated(&used, options, x, y))] += 1;
                }
            }
            Ok(counts)
        })
        .try_reduce(|| [0, 0], |a, b| Ok([a[0] + b[0], a[1] + b[1]]))?;
    undo_vignetting(&mut pixels, width, height, options);
    Ok(Merged { width, height, pixels, too_bright: counts[0], too_dark: counts[1] })
}

/// Adds a row of an exposure to the sums of weights and of weighted ln E.
fn add<T: Copy + Into<usize>>(
    sums: &mut [[[f32; 2]; CHANNELS]],
    exposure: &Exposure,
    codes: &[[T; CHANNELS]],
    y: usize,
    table: &Table,
    ln_time: f32,
    is_shared: bool,
) {
    let Some(y) = y.checked_add_signed(exposure.shift[1]).filter(|y| *y < exposure.height) else {
        return;
    };
    let row = &codes[y * exposure.width..][..exposure.width];
    // The columns that the exposure shows: shift, and from where in the reference.
    let shift = exposure.shift[0];
    let from = (-shift).max(0) as usize;
    let row = row.get(shift.max(0) as usize..).unwrap_or(&[]);
    let sums = sums.get_mut(from..).unwrap_or(&mut []);
    for (sums, pixel) in sums.iter_mut().zip(row) {
        let entries: [[f32; 2]; CHANNELS] =
            std::array::from_fn(|channel| table.entries[pixel[channel].into()][channel]);
        if is_shared {
            let mean = entries.iter().map(|[weight, _]| weight).sum::<f32>() / CHANNELS as f32;
            for (sums, [weight, weighted]) in sums.iter_mut().zip(entries) {
                if weight > 0.0 {
                    sums[0] += mean;
                    sums[1] += mean * (weighted / weight - ln_time);
                }
            }
        } else {
            for (sums, [weight, weighted]) in sums.iter_mut().zip(entries) {
                sums[0] += weight;
                sums[1] += weighted - weight * ln_time;
            }
        }
    }
}

/// Whether some channel is saturated wherever the pixel is shown.
fn is_saturated(used: &[(&Exposure, f32)], options: &MergeOptions, x: usize, y: usize) -> bool {
    let (_, high) = options.usable();
    (0..CHANNELS).any(|channel| {
        let mut codes = used
            .iter()
            .filter_map(|(exposure, _)| Some(exposure.codes.at(exposure.index(x, y)?)[channel]))
            .peekable();
        codes.peek().is_some() && codes.all(|code| code >= high)
    })
}

fn undo_vignetting(pixels: &mut [Radiance], width: usize, height: usize, options: &MergeOptions) {
    let vignetting = options.vignetting();
    if vignetting == super::Vignetting::default() {
        return;
    }
    let middle = [0.5 * width as f64, 0.5 * height as f64];
    let half_diagonal2 = middle[0].powi(2) + middle[1].powi(2);
    pixels.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let r2 = (x as f64 + 0.5 - middle[0]).powi(2) + (y as f64 + 0.5 - middle[1]).powi(2);
            let gain = (1.0 / vignetting.falloff(r2 / half_diagonal2)) as f32;
            *pixel = pixel.map(|value| value * gain);
        }
    });
}
