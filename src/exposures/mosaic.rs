//! Three channels at every pixel of a sensor that measures one at each.
//!
//! The missing channels are the mean of the nearest sites that measured them, bilinear
//! interpolation on a Bayer sensor: linear in the light, so that levels and averages stay what
//! they were, and the pixels stay where cameras were calibrated on them, which halving would undo.

use rayon::prelude::*;

use crate::math::rgb::CHANNELS;

/// At and above this fraction of the white level a site is taken to be saturated: what is
/// interpolated from it would be no measurement.
const SATURATED: f32 = 0.98;

/// Which channel each site of a sensor measures, repeated over it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    pub width: usize,
    /// Row by row from the top left; 0 red, 1 green, 2 blue.
    pub channels: Vec<usize>,
}

/// A part of a sensor, in sites.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
}

/// A site near another: how far it is to the right and down.
type Offset = [isize; 2];

/// The pixels of `shown` as 16-bit codes, row by row from the top, 65535 where saturated.
///
/// `values` has `width` sites a row, 0 at black and 1 at white; sites outside `light` are not
/// used. `shown` lies within `light`. A channel of which there is no site at all is 0.
///
/// # Panics
/// If the pattern is empty, or an area reaches beyond `values`.
pub fn interpolate(
    values: &[f32],
    width: usize,
    pattern: &Pattern,
    light: Area,
    shown: Area,
) -> Vec<[u16; CHANNELS]> {
    let rows = pattern.channels.len() / pattern.width;
    let near: Vec<[Vec<Offset>; CHANNELS]> = (0..pattern.channels.len())
        .map(|phase| std::array::from_fn(|channel| nearest(pattern, phase, channel)))
        .collect();
    let within = |x: isize, y: isize| {
        let x = usize::try_from(x).ok()?;
        let y = usize::try_from(y).ok()?;
        let is_in = (light.x..light.x + light.width).contains(&x)
            && (light.y..light.y + light.height).contains(&y);
        is_in.then(|| values[y * width + x])
    };
    let mean = |x: usize, y: usize, offsets: &[Offset]| {
        let (mut sum, mut count, mut largest) = (0.0_f32, 0, 0.0_f32);
        for [right, down] in offsets {
            if let Some(value) = within(x as isize + right, y as isize + down) {
                sum += value;
                count += 1;
                largest = largest.max(value);
            }
        }
        let mean = || if largest < SATURATED { code(sum / count as f32) } else { u16::MAX };
        (count > 0).then(mean)
    };
    let mut pixels = vec![[0; CHANNELS]; shown.width * shown.height];
    pixels.par_chunks_mut(shown.width.max(1)).enumerate().for_each(|(row, pixels)| {
        let y = shown.y + row;
        for (column, pixel) in pixels.iter_mut().enumerate() {
            let x = shown.x + column;
            let phase = y % rows * pattern.width + x % pattern.width;
            for (channel, pixel) in pixel.iter_mut().enumerate() {
                *pixel = if pattern.channels[phase] == channel {
                    code(values[y * width + x])
                } else {
                    mean(x, y, &near[phase][channel])
                        .or_else(|| mean(x, y, &around(pattern, phase, channel)))
                        .unwrap_or(0)
                };
            }
        }
    });
    pixels
}

/// A fraction of the white level as a 16-bit code.
pub fn code(value: f32) -> u16 {
    // As a cast: NaN is 0, and what lies beyond an end is that end.
    (value * f32::from(u16::MAX)).round() as u16
}

/// The sites of a channel in the smallest square around a phase of the pattern that has any.
fn nearest(pattern: &Pattern, phase: usize, channel: usize) -> Vec<Offset> {
    let reach = pattern.width.max(pattern.channels.len() / pattern.width) as isize;
    let squares = (1..=reach).map(|reach| sites(pattern, phase, channel, reach));
    squares.into_iter().find(|sites| !sites.is_empty()).unwrap_or_default()
}

/// All sites of a channel within a pattern's length, for corners where the nearest are cut off.
fn around(pattern: &Pattern, phase: usize, channel: usize) -> Vec<Offset> {
    let reach = pattern.width.max(pattern.channels.len() / pattern.width) as isize;
    sites(pattern, phase, channel, reach)
}

fn sites(pattern: &Pattern, phase: usize, channel: usize, reach: isize) -> Vec<Offset> {
    let width = pattern.width as isize;
    let rows = pattern.channels.len() as isize / width;
    let (x, y) = (phase as isize % width, phase as isize / width);
    (-reach..=reach)
        .flat_map(|down| (-reach..=reach).map(move |right| [right, down]))
        .filter(|[right, down]| {
            let place = (y + down).rem_euclid(rows) * width + (x + right).rem_euclid(width);
            pattern.channels[place as usize] == channel
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bayer() -> Pattern {
        Pattern { width: 2, channels: vec![0, 1, 1, 2] }
    }

    fn whole(width: usize, height: usize) -> Area {
        Area { x: 0, y: 0, width, height }
    }

    #[test]
    fn a_plane_of_light_comes_back_exactly_away_from_the_edge() {
        let (width, height) = (12, 10);
        let light = |x: usize, y: usize, channel: usize| {
            0.1 + 0.02 * x as f32 + 0.03 * y as f32 + 0.05 * channel as f32
        };
        let xtrans: Vec<usize> = "GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG"
            .chars()
            .map(|c| "RGB".find(c).unwrap())
            .collect();
        for pattern in [bayer(), Pattern { width: 6, channels: xtrans }] {
            let rows = pattern.channels.len() / pattern.width;
            let is_bayer = pattern.width == 2;
            let values: Vec<f32> = (0..width * height)
                .map(|site| {
                    let (x, y) = (site % width, site / width);
                    light(x, y, pattern.channels[y % rows * pattern.width + x % pattern.width])
                })
                .collect();
            let area = whole(width, height);
            let pixels = interpolate(&values, width, &pattern, area, area);
            for y in 2..height - 2 {
                for x in 2..width - 2 {
                    for (channel, code) in pixels[y * width + x].into_iter().enumerate() {
                        let own = f32::from(code) / 65535.0;
                        // The sites of an X-Trans sensor lie aslant of a pixel, by one each way.
                        let tolerance = if is_bayer { 1e-5 } else { 0.06 };
                        let expected = light(x, y, channel);
                        assert!((own - expected).abs() < tolerance, "{x} {y} {channel}: {own}");
                    }
                }
            }
        }
    }

    #[test]
    fn saturated_and_masked_sites_do_not_leak() {
        let (width, height) = (8, 8);
        let mut values = vec![0.25_f32; width * height];
        // A red site at white; its neighbours know no red.
        values[4 * width + 4] = 1.0;
        // The first two columns are masked: what they hold is no light.
        for y in 0..height {
            values[y * width] = 0.9;
            values[y * width + 1] = 0.9;
        }
        let light = Area { x: 2, y: 0, width: 6, height };
        let pixels = interpolate(&values, width, &bayer(), light, light);
        let at = |x: usize, y: usize| pixels[y * 6 + x - 2];
        assert_eq!(at(4, 4)[0], u16::MAX);
        assert_eq!(at(5, 4)[0], u16::MAX);
        assert_eq!(at(3, 3)[0], u16::MAX);
        assert_eq!(at(6, 6), [16384; 3]);
        for y in 0..height {
            assert_eq!(at(2, y)[1..], [16384; 2], "row {y}");
        }
    }

    #[test]
    fn degenerate_sensors_have_pixels_too() {
        let one = interpolate(&[0.5], 1, &bayer(), whole(1, 1), whole(1, 1));
        assert_eq!(one, [[32768, 0, 0]]);
        let hostile = [f32::NAN, -1.0, f32::INFINITY, 7.0];
        let pixels = interpolate(&hostile, 2, &bayer(), whole(2, 2), whole(2, 2));
        assert_eq!(pixels[0][0], 0);
        assert_eq!(pixels[3][2], u16::MAX);
        assert!(interpolate(&[], 0, &bayer(), whole(0, 0), whole(0, 0)).is_empty());
    }
}
