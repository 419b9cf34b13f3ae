//! Translations of hand-held exposures by median threshold bitmaps (Ward 2003).
//!
//! An image thresholded at its median looks the same at every exposure. Two such bitmaps are
//! compared at nine translations on each level of an image pyramid, the translation doubling
//! from level to level; pixels near the threshold do not count.

use rayon::prelude::*;

use super::{Codes, Exposure};
use crate::watch::{Cancelled, Watch};

/// The coarsest level halves the image this many times; all levels together reach 127 pixels.
const LEVELS: usize = 6;
/// No level has a shorter side than this, in pixels, which keeps translations below a sixteenth of
/// the shorter side.
const SHORTEST_SIDE: usize = 24;
/// Pixels this near the threshold do not count, in 255ths of full scale.
const UNSURE: u8 = 4;
/// A translation must lower the share of differing pixels below this part of what it is
/// without, or none is undone: exposures from a tripod stay as they are.
const GAIN: f64 = 0.8;
/// Thresholds to choose from, as shares of the pixels below: the median first.
const SHARES: [f64; 3] = [0.5, 0.17, 0.83];
/// A threshold within these is neither in the noise nor saturated.
const SOUND: std::ops::RangeInclusive<u8> = 16..=239;

/// Grey values of one level of the pyramid.
#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    grey: Vec<u8>,
}

/// The shift of every exposure against the reference. Each is found against its neighbour in
/// exposure time, where bitmaps are most alike, and added up.
pub fn shifts(
    exposures: &[Exposure],
    reference: usize,
    watch: &Watch,
) -> Result<Vec<[isize; 2]>, Cancelled> {
    let mut order: Vec<usize> = (0..exposures.len()).collect();
    order.sort_by(|a, b| exposures[*a].seconds.total_cmp(&exposures[*b].seconds));
    let pyramids: Vec<Vec<Level>> = exposures.par_iter().map(pyramid).collect();
    let between: Vec<[isize; 2]> = order
        .par_windows(2)
        .map(|pair| {
            watch.check()?;
            Ok(translation(&pyramids[pair[0]], &pyramids[pair[1]]))
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut shifts = vec![[0, 0]; exposures.len()];
    let mut sum = [0, 0];
    for (place, &exposure) in order.iter().enumerate() {
        if place > 0 {
            sum = [sum[0] + between[place - 1][0], sum[1] + between[place - 1][1]];
        }
        shifts[exposure] = sum;
    }
    let origin = shifts.get(reference).copied().unwrap_or_default();
    for shift in &mut shifts {
        *shift = [shift[0] - origin[0], shift[1] - origin[1]];
    }
    Ok(shifts)
}

fn pyramid(exposure: &Exposure) -> Vec<Level> {
    // Ward's luminance; 16-bit codes are mostly linear, and their root fills eight bits better.
    let grey = match &exposure.codes {
        Codes::Eight(codes) => codes
            .iter()
            .map(|[r, g, b]| {
                ((54 * u32::from(*r) + 183 * u32::from(*g) + 19 * u32::from(*b)) >> 8) as u8
            })
            .collect(),
        Codes::Sixteen(codes) => codes
            .iter()
            .map(|[r, g, b]| {
                let sum = 54 * u32::from(*r) + 183 * u32::from(*g) + 19 * u32::from(*b);
                (sum >> 8).isqrt() as u8
            })
            .collect(),
    };
    let mut levels = vec![Level { width: exposure.width, height: exposure.height, grey }];
    for _ in 0..LEVELS {
        let last = &levels[levels.len() - 1];
        let (width, height) = (last.width / 2, last.height / 2);
        if width.min(height) < SHORTEST_SIDE {
            break;
        }
        let mut grey = Vec::with_capacity(width * height);
        for y in 0..height {
            let upper = &last.grey[2 * y * last.width..][..2 * width];
            let lower = &last.grey[(2 * y + 1) * last.width..][..2 * width];
            let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
            grey.extend(pairs.map(|(a, b)| {
                let sum = u16::from(a[0]) + u16::from(a[1]) + u16::from(b[0]) + u16::from(b[1]);
                ((sum + 2) / 4) as u8
            }));
        }
        levels.push(Level { width, height, grey });
    }
    levels
}

/// By what the second image is shifted against the first; 0 where they give no reason to think
/// that it is.
fn translation(first: &[Level], second: &[Level]) -> [isize; 2] {
    if (first[0].width, first[0].height) != (second[0].width, second[0].height) {
        return [0, 0];
    }
    let share = best_share(&first[0], &second[0]);
    let mut shift = [0, 0];
    let mut differing = [0.0, 0.0];
    for (a, b) in std::iter::zip(first, second).rev() {
        let (first, second) = (bitmap(a, share), bitmap(b, share));
        shift = shift.map(|value| 2 * value);
        let mut best = f64::INFINITY;
        let mut chosen = shift;
        // The translation as it is first, so that it stays where others are no better.
        let steps = [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];
        for (dx, dy) in steps {
            let candidate = [shift[0] + dx, shift[1] + dy];
            let share = difference(&first, &second, a.width, a.height, candidate);
            if share < best {
                (best, chosen) = (share, candidate);
            }
        }
        shift = chosen;
        differing = [best, difference(&first, &second, a.width, a.height, [0, 0])];
    }
    if differing[0] < GAIN * differing[1] { shift } else { [0, 0] }
}

/// The share of pixels below the threshold that suits both images: the median, unless it is
/// black or saturated in one.
fn best_share(first: &Level, second: &Level) -> f64 {
    let is_sound = |share: &&f64| {
        [first, second].iter().all(|level| SOUND.contains(&threshold(level, **share)))
    };
    SHARES.iter().find(is_sound).copied().unwrap_or(SHARES[0])
}

/// The grey value with that share of the pixels below it.
fn threshold(level: &Level, share: f64) -> u8 {
    let mut histogram = [0_usize; 256];
    for &grey in &level.grey {
        histogram[usize::from(grey)] += 1;
    }
    let wanted = share * level.grey.len() as f64;
    let mut below = 0;
    for (grey, count) in histogram.iter().enumerate() {
        below += count;
        if below as f64 >= wanted {
            return grey as u8;
        }
    }
    u8::MAX
}

/// 0 below the threshold, 1 above it, 2 where that is not sure: two pixels differ surely when the
/// exclusive or of theirs is 1.
fn bitmap(level: &Level, share: f64) -> Vec<u8> {
    let threshold = threshold(level, share);
    level
        .grey
        .iter()
        .map(
            |&grey| {
                if grey.abs_diff(threshold) <= UNSURE { 2 } else { u8::from(grey > threshold) }
            },
        )
        .collect()
}

/// The share of surely differing pixels where both images are, with the second one shifted.
fn difference(first: &[u8], second: &[u8], width: usize, height: usize, shift: [isize; 2]) -> f64 {
    let [dx, dy] = shift;
    let columns = width.saturating_sub(dx.unsigned_abs());
    let rows = height.saturating_sub(dy.unsigned_abs());
    if columns == 0 || rows == 0 {
        return f64::INFINITY;
    }
    // Where the overlap begins in each image.
    let begins = |shift: isize| ((-shift).max(0) as usize, shift.max(0) as usize);
    let ((x1, x2), (y1, y2)) = (begins(dx), begins(dy));
    let differing: u64 = (0..rows)
        .into_par_iter()
        .map(|row| {
            let first = &first[(y1 + row) * width + x1..][..columns];
            let second = &second[(y2 + row) * width + x2..][..columns];
            first.iter().zip(second).map(|(a, b)| u64::from(a ^ b == 1)).sum::<u64>()
        })
        .sum();
    differing as f64 / (rows * columns) as f64
}
