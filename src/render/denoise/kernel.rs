//! The weights of neighbours, for all pixels of a row at once.

use super::{GUIDES, Guides};

/// Differences of light that count as noise, in standard deviations. One pixel that is much too bright
/// makes for seven, as the variance is averaged over seven by seven pixels: less, and it stays alone.
const LIGHT: f32 = 8.0;
/// How sharply differences of normals separate surfaces: they count by this power of two of the
/// cosine between them.
const NORMAL_SQUARINGS: u32 = 6;

/// From 0 to 1, whether two pixels that lie `away` from each other show one smooth surface, whose
/// distance changes by `slope` from one pixel to the next; `further` of the exponent is against it.
/// The same for both where `slope` is.
#[inline(always)]
pub fn alike(
    own: [f32; GUIDES],
    other: [f32; GUIDES],
    slope: [f32; 2],
    away: [f32; 2],
    further: f32,
) -> f32 {
    let [nx, ny, nz, none, distance_m, ..] = own;
    let expected = slope[0] * away[0] + slope[1] * away[1];
    let steepest = (slope[0] * away[0]).abs() + (slope[1] * away[1]).abs();
    let off = (other[4] - distance_m - expected).abs();
    let scale = 0.5 * steepest + 1e-3 * (distance_m + other[4]);
    let scale = scale.max(f32::MIN_POSITIVE);
    let cosine = nx * other[0] + ny * other[1] + nz * other[2] + none * other[3];
    let mut near = cosine.max(0.0);
    for _ in 0..NORMAL_SQUARINGS {
        near *= near;
    }
    near * exp(-off / scale - further)
}

/// eˣ of numbers below 0 to four digits; what is below 1e-26 is no less.
#[inline(always)]
fn exp(x: f32) -> f32 {
    // Adding it leaves the nearest integer in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    let binary = (x * std::f32::consts::LOG2_E).max(-86.0);
    let shifted = binary + ROUND;
    let rest = binary - (shifted - ROUND);
    let power = shifted.to_bits().wrapping_sub(ROUND.to_bits()).wrapping_add(127) << 23;
    // 2ʳ by its series.
    let part = 1.0
        + rest
            * (std::f32::consts::LN_2
                + rest * (0.240_226_5 + rest * (0.055_504_1 + rest * 0.009_618_1)));
    part * f32::from_bits(power)
}

/// One of the neighbours of all pixels of a row.
pub(super) struct Tap {
    /// The row, and that of the neighbours.
    row: usize,
    pub(super) other: usize,
    /// The first pixel that has such a neighbour, the neighbour, and how many have.
    first: usize,
    neighbour: usize,
    count: usize,
    away: [f32; 2],
}

impl Tap {
    pub(super) fn new(guides: &Guides, (row, across, down): (usize, isize, isize)) -> Option<Self> {
        let other = row.checked_add_signed(down).filter(|other| *other < guides.height)?;
        let reach = across.unsigned_abs();
        let count = guides.width.checked_sub(reach).filter(|count| *count > 0)?;
        let (first, neighbour) = if across < 0 { (reach, 0) } else { (0, reach) };
        Some(Self { row, other, first, neighbour, count, away: [across as f32, down as f32] })
    }
}

/// Pixels that are processed at once.
const LANES: usize = 8;

/// Some numbers of as many pixels.
struct Block<const N: usize>([[f32; LANES]; N]);

impl<const N: usize> Block<N> {
    /// The pixels from the `first` one on.
    #[inline(always)]
    fn of(planes: [&[f32]; N], first: usize) -> Self {
        let mut block = [[0.0; LANES]; N];
        for (block, plane) in block.iter_mut().zip(planes) {
            block.copy_from_slice(&plane[first..first + LANES]);
        }
        Self(block)
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> [f32; N] {
        let mut numbers = [0.0; N];
        for (number, plane) in numbers.iter_mut().zip(&self.0) {
            *number = plane[lane];
        }
        numbers
    }
}

/// The numbers of one pixel.
#[inline(always)]
fn single<const N: usize>(planes: [&[f32]; N], pixel: usize) -> [f32; N] {
    let mut numbers = [0.0; N];
    for (number, plane) in numbers.iter_mut().zip(planes) {
        *number = plane[pixel];
    }
    numbers
}

/// What two pixels count for each other that lie `away` from each other: by their guides, and by their
/// brightness and its variance.
#[inline(always)]
fn weight([own, other]: [[f32; GUIDES]; 2], [here, there]: [[f32; 2]; 2], away: [f32; 2]) -> f32 {
    let noise = LIGHT * (0.5 * (here[1] + there[1])).sqrt();
    let least = 1e-6 * (here[0] + there[0]).abs() + f32::MIN_POSITIVE;
    let apart = ((here[0] - there[0]) / (noise + least)).powi(2);
    let slope = [0.5 * (own[5] + other[5]), 0.5 * (own[6] + other[6])];
    alike(own, other, slope, away, apart)
}

/// The weights of one neighbour of all pixels of a row, and their sums.
pub(super) struct Kernel {
    weights: Vec<f32>,
    sums: Vec<f32>,
}

impl Kernel {
    pub(super) fn new(width: usize) -> Self {
        Self { weights: vec![0.0; width], sums: vec![0.0; width] }
    }

    /// `light` holds the brightness of the pixels and its variance, then those of their neighbours. A
    /// neighbour counts for a pixel as much as the pixel does for it.
    #[inline(always)]
    pub(super) fn weigh(
        &mut self,
        guides: &Guides,
        tap: &Tap,
        factor: f32,
        light: [[&[f32]; 2]; 2],
    ) {
        let Tap { row, other, first, neighbour, count, away } = *tap;
        // Plain loops: closures of `array::map` are not always inlined, and are then compiled without
        // the wide registers.
        let mut own: [&[f32]; GUIDES] = [&[]; GUIDES];
        let mut others = own;
        for plane in 0..GUIDES {
            own[plane] = &guides.plane(row, plane)[first..first + count];
            others[plane] = &guides.plane(other, plane)[neighbour..neighbour + count];
        }
        let here = [&light[0][0][first..first + count], &light[0][1][first..first + count]];
        let there = [
            &light[1][0][neighbour..neighbour + count],
            &light[1][1][neighbour..neighbour + count],
        ];
        let weights = &mut self.weights[..count];
        let sums = &mut self.sums[first..first + count];
        let whole = count / LANES * LANES;
        // Blocks are copied, because the compiler cannot rule out that so many slices overlap, and would
        // process one pixel at a time.
        for block in (0..whole).step_by(LANES) {
            let (own, others) = (Block::of(own, block), Block::of(others, block));
            let (here, there) = (Block::of(here, block), Block::of(there, block));
            let mut found = [0.0; LANES];
            for (lane, found) in found.iter_mut().enumerate() {
                let guides = [own.lane(lane), others.lane(lane)];
                *found = factor * weight(guides, [here.lane(lane), there.lane(lane)], away);
            }
            weights[block..block + LANES].copy_from_slice(&found);
            for (sum, found) in sums[block..block + LANES].iter_mut().zip(found) {
                *sum += found;
            }
        }
        for k in whole..count {
            let (own, others) = (single(own, k), single(others, k));
            weights[k] = factor * weight([own, others], [single(here, k), single(there, k)], away);
            sums[k] += weights[k];
        }
    }

    /// Adds the neighbours' values by their weights, or by the squares of these.
    #[inline(always)]
    pub(super) fn add(&self, tap: &Tap, plane: &[f32], sums: &mut [f32], is_squared: bool) {
        let values = &plane[tap.neighbour..tap.neighbour + tap.count];
        let sums = &mut sums[tap.first..tap.first + tap.count];
        let weights = &self.weights[..tap.count];
        for ((sum, value), weight) in sums.iter_mut().zip(values).zip(weights) {
            *sum += if is_squared { weight * weight } else { *weight } * value;
        }
    }

    /// Adds the pixels' own values by what their neighbours, whose weights add up to less than 1,
    /// leave of it.
    #[inline(always)]
    pub(super) fn keep(&self, plane: &[f32], sums: &mut [f32], is_squared: bool) {
        for ((sum, value), others) in sums.iter_mut().zip(plane).zip(&self.sums) {
            let own = 1.0 - others;
            *sum += if is_squared { own * own } else { own } * value;
        }
    }

    #[inline(always)]
    pub(super) fn divide(&self, values: &mut [f32]) {
        for (value, sum) in values.iter_mut().zip(&self.sums) {
            *value /= *sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::exp;

    #[test]
    fn the_exponential_is_right_to_four_digits() {
        for k in 0..6000 {
            let x = -0.01 * k as f32;
            let (found, expected) = (exp(x), f64::from(x).exp());
            let error = f64::from(found) / expected.max(1e-26) - 1.0;
            assert!(error.abs() < 1e-4 || expected < 1e-25, "{x}: {found}, not {expected}");
        }
        assert!(exp(f32::NEG_INFINITY) < 1e-25);
        assert_eq!(exp(0.0), 1.0);
    }
}
