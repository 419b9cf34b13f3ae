//! FLIP: a measure of the visible difference between two pictures between which a viewer flips
//! (Andersson et al. 2020), and its form for radiance, HDR-FLIP (Andersson et al. 2021). HDR-FLIP
//! compares both pictures at every exposure that a viewer might choose, and takes the largest error
//! of each pixel.
//!
//! Written from the papers, with their constants. Compared with NVIDIA's own implementation in
//! `tests/study/flip.rs`.

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance, luminance};

/// A picture in linear RGB with the primaries of sRGB, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Linear<'a> {
    /// In pixels.
    pub width: usize,
    /// `width` × height of them.
    pub pixels: &'a [Radiance],
}

/// FLIP of two pictures as a display shows them, values 0 to 1 in linear RGB: an error of 0 to 1
/// for each pixel. `pixels_per_degree` is the viewing distance.
pub fn ldr(truth: Linear, test: Linear, pixels_per_degree: f32) -> Vec<f32> {
    let truth = Prepared::new(truth, pixels_per_degree);
    let test = Prepared::new(test, pixels_per_degree);
    truth.difference(&test)
}

/// HDR-FLIP of two pictures of radiance: the largest error of each pixel over exposures at which
/// the truth's brightest to its median value are shown.
pub fn hdr(truth: Linear, test: Linear, pixels_per_degree: f32) -> Vec<f32> {
    let mut worst = vec![0.0f32; truth.pixels.len()];
    for exposure in exposures(truth.pixels) {
        let show = |picture: Linear| -> Vec<Radiance> {
            picture.pixels.iter().map(|pixel| pixel.map(|v| tone(v * exposure.exp2()))).collect()
        };
        let (shown_truth, shown_test) = (show(truth), show(test));
        let errors = ldr(
            Linear { pixels: &shown_truth, ..truth },
            Linear { pixels: &shown_test, ..test },
            pixels_per_degree,
        );
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
    }
    worst
}

/// Numerator and denominator of the ACES curve by Narkowicz (2015), with the scale of 0.6 that
/// FLIP gives it.
const ACES: [f32; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

fn tone(value: f32) -> f32 {
    let [a, b, c, d, e, f] = ACES;
    let value = value.max(0.0);
    ((a * value * value + b * value + c) / (d * value * value + e * value + f)).clamp(0.0, 1.0)
}

/// Exposures in stops, from that which shows the brightest pixel at 85 % of white to that which
/// shows the median one so, a stop or less apart (HDR-FLIP, Section 4).
fn exposures(truth: &[Radiance]) -> Vec<f32> {
    let mut brightness: Vec<f32> = truth.iter().map(|&rgb| luminance(rgb) as f32).collect();
    brightness.sort_unstable_by(f32::total_cmp);
    let Some(&brightest) = brightness.last() else { return Vec::new() };
    let middle = brightness.len() / 2;
    let median = 0.5 * (brightness[middle.saturating_sub(1)] + brightness[middle]);
    if brightest <= 0.0 {
        return vec![0.0];
    }
    // Where the curve reaches 0.85.
    let white = 0.85;
    let [a, b, c, d, e, f] = ACES;
    let (a, b, c) = (a - white * d, b - white * e, c - white * f);
    let half = -0.5 * b / a;
    let reached = half + (half * half - c / a).sqrt();
    let start = (reached / brightest).log2();
    // A picture that is half black is shown over at most this many stops.
    let stop = (reached / median.max(brightest * (-MOST_STOPS).exp2())).log2();
    let count = ((stop - start).ceil() as usize).max(2);
    (0..count).map(|k| start + (stop - start) * k as f32 / (count - 1) as f32).collect()
}

const MOST_STOPS: f32 = 24.0;

/// Linear RGB of sRGB's primaries to XYZ.
const XYZ: [[f32; 3]; 3] = [
    [0.412_386_56, 0.357_591_49, 0.180_450_49],
    [0.212_636_82, 0.715_182_98, 0.072_180_2],
    [0.019_330_62, 0.119_197_17, 0.950_372_6],
];

/// Of the picture that is white everywhere.
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];

fn xyz([r, g, b]: [f32; 3]) -> [f32; 3] {
    XYZ.map(|row| row[0] * r + row[1] * g + row[2] * b)
}

/// The inverse of [`xyz`].
fn linear([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.241_003_3 * x - 1.537_399 * y - 0.498_615_9 * z,
        -0.969_224_3 * x + 1.875_93 * y + 0.041_554_23 * z,
        0.055_639_42 * x - 0.204_011_21 * y + 1.057_149 * z,
    ]
}

/// The opponent space YCxCz, in which the eye's blur is applied.
fn opponent(rgb: [f32; 3]) -> [f32; 3] {
    let c = xyz(rgb);
    let [x, y, z]: [f32; 3] = std::array::from_fn(|k| c[k] / WHITE[k]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    let c = [y + cx / 500.0, y, y - cz / 200.0];
    linear(std::array::from_fn(|k| c[k] * WHITE[k]))
}

/// CIELAB with Hunt's effect: colours fade as they darken.
fn hunted(rgb: [f32; 3]) -> [f32; 3] {
    let c = xyz(rgb);
    let delta = 6.0f32 / 29.0;
    let [x, y, z] = std::array::from_fn(|k| {
        let t = c[k] / WHITE[k];
        if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 }
    });
    let lightness = 116.0 * y - 16.0;
    let fade = 0.01 * lightness;
    [lightness, fade * 500.0 * (x - y), fade * 200.0 * (y - z)]
}

/// The HyAB distance of two colours to the power 0.7.
fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let chroma = (a[1] - b[1]).hypot(a[2] - b[2]);
    ((a[0] - b[0]).abs() + chroma).powf(0.7)
}

/// Amplitude and width of the Gaussians whose sum is the eye's blur, of Y, Cx and Cz.
const BLUR: [&[(f32, f32)]; CHANNELS] =
    [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];
/// The widest of them.
const WIDEST: f32 = 0.04;
/// Width of the edges and points that the eye finds, in degrees.
const FEATURE: f32 = 0.082;

/// What FLIP compares of one picture.
struct Prepared {
    /// The blurred colours, in Hunt-adjusted CIELAB.
    colors: Vec<[f32; 3]>,
    /// Strength of edges and points.
    features: Vec<[f32; 2]>,
}

impl Prepared {
    fn new(picture: Linear, pixels_per_degree: f32) -> Self {
        let Linear { width, pixels } = picture;
        let opponent: Vec<[f32; 3]> = pixels.par_iter().map(|&pixel| opponent(pixel)).collect();
        let plane = |channel: usize| -> Vec<f32> { opponent.iter().map(|c| c[channel]).collect() };

        let reach = (3.0 * (WIDEST / (2.0 * PI_SQUARED)).sqrt() * pixels_per_degree).ceil() as i32;
        let blurred: [Vec<f32>; CHANNELS] = std::array::from_fn(|channel| {
            let plane = plane(channel);
            let kernels: Vec<Vec<f32>> = BLUR[channel]
                .iter()
                .map(|&(a, b)| {
                    // Its square is what two passes make of it.
                    let amplitude = (a * (std::f32::consts::PI / b).sqrt()).sqrt();
                    let at = |k: i32| (k as f32 / pixels_per_degree).powi(2);
                    (-reach..=reach).map(|k| amplitude * (-PI_SQUARED * at(k) / b).exp()).collect()
                })
                .collect();
            let total: f32 = kernels.iter().map(|k| k.iter().sum::<f32>().powi(2)).sum();
            let mut sum = vec![0.0; plane.len()];
            for kernel in &kernels {
                let part = columns(&rows(&plane, width, kernel), width, kernel);
                for (sum, value) in sum.iter_mut().zip(part) {
                    *sum += value / total;
                }
            }
            sum
        });
        let color = |index: usize| {
            let rgb = from_opponent(std::array::from_fn(|c| blurred[c][index]));
            hunted(rgb.map(|value| value.clamp(0.0, 1.0)))
        };
        let colors = (0..pixels.len()).into_par_iter().map(color).collect();

        let lightness: Vec<f32> = opponent.iter().map(|c| (c[0] + 16.0) / 116.0).collect();
        let [smooth, slope, bend] = feature_kernels(pixels_per_degree);
        let along = rows(&lightness, width, &smooth);
        let strength = |kernel: &[f32]| -> Vec<f32> {
            let x = columns(&rows(&lightness, width, kernel), width, &smooth);
            let y = columns(&along, width, kernel);
            x.iter().zip(y).map(|(x, y)| x.hypot(y)).collect()
        };
        let (edges, points) = (strength(&slope), strength(&bend));
        Self { colors, features: edges.into_iter().zip(points).map(|(e, p)| [e, p]).collect() }
    }

    fn difference(&self, other: &Self) -> Vec<f32> {
        // The largest distance that a display can show: of green and blue.
        let largest = distance(hunted([0.0, 1.0, 0.0]), hunted([0.0, 0.0, 1.0]));
        let (knee, value) = (0.4 * largest, 0.95);
        (0..self.colors.len())
            .into_par_iter()
            .map(|index| {
                let color = distance(self.colors[index], other.colors[index]);
                let color = if color < knee {
                    color * value / knee
                } else {
                    value + (color - knee) / (largest - knee) * (1.0 - value)
                };
                let [a, b] = [self.features[index], other.features[index]];
                let feature = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
                let feature = (std::f32::consts::FRAC_1_SQRT_2 * feature).sqrt();
                color.powf(1.0 - feature)
            })
            .collect()
    }
}

const PI_SQUARED: f32 = std::f32::consts::PI * std::f32::consts::PI;

/// A Gaussian and its first two derivatives, each of whose positive and negative weights sum to
/// one.
fn feature_kernels(pixels_per_degree: f32) -> [Vec<f32>; 3] {
    let sd = 0.5 * FEATURE * pixels_per_degree;
    let reach = (3.0 * sd).ceil() as i32;
    let places = || (-reach..=reach).map(|k| k as f32);
    let gaussian = |x: f32| (-x * x / (2.0 * sd * sd)).exp();
    let kernels = [
        places().map(gaussian).collect::<Vec<_>>(),
        places().map(|x| -x * gaussian(x)).collect(),
        places().map(|x| (x * x / (sd * sd) - 1.0) * gaussian(x)).collect(),
    ];
    kernels.map(|kernel| {
        let sum = |sign: f32| kernel.iter().map(|v| (sign * v).max(0.0)).sum::<f32>();
        let (above, below) = (sum(1.0), sum(-1.0));
        kernel.iter().map(|&v| if v > 0.0 { v / above } else { v / below.max(1e-30) }).collect()
    })
}

/// Convolves every row with a symmetrical window of weights; beyond its ends a row goes on as it
/// ends.
fn rows(plane: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let reach = kernel.len() / 2;
    let convolved = |row: &[f32]| -> Vec<f32> {
        let mut padded = vec![row[0]; reach];
        padded.extend(row);
        padded.extend(vec![row[row.len() - 1]; reach]);
        padded
            .windows(kernel.len())
            .map(|window| window.iter().zip(kernel).map(|(v, w)| v * w).sum())
            .collect()
    };
    plane.par_chunks(width.max(1)).flat_map_iter(convolved).collect()
}

/// The same for columns.
fn columns(plane: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let (reach, height) = (kernel.len() as i64 / 2, (plane.len() / width.max(1)) as i64);
    (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            let mut sums = vec![0.0f32; width];
            for (offset, weight) in (-reach..=reach).zip(kernel) {
                let row = (y + offset).clamp(0, height - 1) as usize * width;
                for (sum, value) in sums.iter_mut().zip(&plane[row..row + width]) {
                    *sum += weight * value;
                }
            }
            sums
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_come_back_from_the_opponent_space() {
        for rgb in [[0.2, 0.5, 0.9], [1.0, 1.0, 1.0], [0.0, 0.1, 0.0]] {
            let back = from_opponent(opponent(rgb));
            for c in 0..3 {
                assert!((back[c] - rgb[c]).abs() < 1e-5, "{rgb:?} became {back:?}");
            }
        }
    }

    #[test]
    fn black_pictures_and_tiny_ones_are_compared_too() {
        let (dark, light) = ([[0.0; 3]; 6], [[0.5; 3]; 6]);
        let picture = |pixels| Linear { width: 3, pixels };
        assert_eq!(hdr(picture(&dark), picture(&dark), 67.0), [0.0; 6]);
        assert!(hdr(picture(&dark), picture(&light), 67.0).iter().all(|e| (0.0..=1.0).contains(e)));
        assert!(hdr(picture(&[]), picture(&[]), 67.0).is_empty());
    }
}
