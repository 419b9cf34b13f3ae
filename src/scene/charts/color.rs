//! Properties of the camera from a photographed chart: the colour matrix to linear Rec. 709, and
//! whether its values are linear.
//!
//! The model: a patch of the reflectance t has the radiance m with M m = s t, where M is the matrix
//! and s = 1 + b u + c v the light over the chart, which changes evenly (u and v are −1 to 1 along its
//! sides). M, b and c minimise Σ |M m / s − t|² over the patches, in linear light.

use glam::{DMat3, DVec2, DVec3};

use super::table::{PatchReading, Table};
use crate::math::color::{difference, lab};
use crate::math::rgb::{CHANNELS, Rgb, luminance};
use crate::solve::subplex::{SubplexOptions, subplex};

/// The colour response of a camera, fitted to a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorFit {
    /// Reflectance in linear Rec. 709 from radiance in the middle of the chart.
    pub matrix: DMat3,
    /// How the light changes from the middle to the edge, along the chart's sides.
    pub shading: DVec2,
    /// Per patch CIEDE2000 of reflectance by the readings and by the table: as they are, but for one
    /// scale; with a scale a channel; by the matrix.
    pub differences: Vec<[f64; 3]>,
    /// RMS of M m / s − t over patches and channels.
    pub rms: f64,
    pub curve: Curve,
}

/// Whether a power of the radiance fits the patches better than the radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// The power that fits them best.
    pub power: f64,
    /// RMS then.
    pub rms: f64,
    /// The power fits significantly better, and is not about 1.
    pub is_better: bool,
}

/// Unknowns of the straight model: the matrix and the light's change.
const UNKNOWNS: usize = 11;
/// Fewer patches determine no matrix.
const FEWEST: usize = 8;
/// F of one more unknown from which on it is no chance: one in some hundred charts.
const SIGNIFICANT: f64 = 8.0;
/// Powers as near to 1 as this do no harm.
const STRAIGHT: f64 = 0.05;
/// No table is known better, in parts of white.
const FINEST: f64 = 1e-5;
/// Bounds of the light's change, and of the power.
const STEEPEST: f64 = 0.9;
const POWERS: [f64; 2] = [0.2, 5.0];

impl ColorFit {
    /// The matrix for photographs: what is neutral stays what it is, so that light keeps its colour,
    /// and the others are brought to Rec. 709.
    pub fn correction(&self) -> DMat3 {
        DMat3::from_diagonal(self.matrix.inverse() * DVec3::ONE) * self.matrix
    }

    /// The means of the differences over all patches.
    pub fn mean_differences(&self) -> [f64; 3] {
        let count = self.differences.len() as f64;
        std::array::from_fn(|way| self.differences.iter().map(|own| own[way]).sum::<f64>() / count)
    }
}

/// Finds what readings tell of a camera; `None` of fewer than eight patches, and where they determine no
/// matrix.
pub fn fit(table: &Table, readings: &[PatchReading]) -> Option<ColorFit> {
    if readings.len() < FEWEST {
        return None;
    }
    let problem = Problem::new(table, readings);
    let straight = problem.solve(false)?;
    let curved = problem.solve(true)?;
    let left = (CHANNELS * readings.len() - UNKNOWNS - 1) as f64;
    let floor = FINEST * FINEST * CHANNELS as f64 * readings.len() as f64;
    let gain = left * (straight.squares - curved.squares) / (curved.squares + floor);
    let rms = |squares: f64| (squares / (CHANNELS * readings.len()) as f64).sqrt();
    let is_better = gain > SIGNIFICANT && (curved.power - 1.0).abs() > STRAIGHT;
    let curve = Curve { power: curved.power, rms: rms(curved.squares), is_better };
    Some(ColorFit {
        matrix: straight.matrix * (1.0 / problem.scale),
        shading: straight.shading,
        differences: problem.differences(&straight),
        rms: rms(straight.squares),
        curve,
    })
}

/// The luminance of each patch by its reading, the matrix being that of all, and the response what
/// explains them best; `None` where they determine no matrix.
pub(super) fn luminances(table: &Table, readings: &[PatchReading]) -> Option<Vec<f64>> {
    if readings.len() < FEWEST {
        return None;
    }
    let problem = Problem::new(table, readings);
    let Solved { matrix, shading, power, .. } = problem.solve(true)?;
    let evened = problem.evened(shading, power).into_iter();
    Some(evened.map(|own| luminance((matrix * own).to_array())).collect())
}

/// Readings, the brightest of which is 1, and what they should be.
struct Problem {
    scale: f64,
    read: Vec<DVec3>,
    known: Vec<DVec3>,
    places: Vec<DVec2>,
}

struct Solved {
    matrix: DMat3,
    shading: DVec2,
    power: f64,
    squares: f64,
}

impl Problem {
    fn new(table: &Table, readings: &[PatchReading]) -> Self {
        let scale = readings.iter().flat_map(|own| own.mean).fold(f64::MIN_POSITIVE, f64::max);
        Self {
            scale,
            read: readings.iter().map(|own| DVec3::from_array(own.mean) / scale).collect(),
            known: table.patches.iter().map(|own| DVec3::from_array(own.reflectance)).collect(),
            places: (0..readings.len()).map(|k| table.centred(k)).collect(),
        }
    }

    fn solve(&self, is_curved: bool) -> Option<Solved> {
        let squares = |x: &[f64]| self.at(x).map_or(f64::INFINITY, |solved| solved.squares);
        let steps = [0.1, 0.1, if is_curved { 0.2 } else { 0.0 }];
        let options = SubplexOptions { tolerance: 1e-7, ..Default::default() };
        self.at(&subplex(squares, &[0.0; 3], &steps, &options).x)
    }

    /// The best matrix at a shading and a power, given by its logarithm.
    fn at(&self, x: &[f64]) -> Option<Solved> {
        let (shading, power) = (DVec2::new(x[0], x[1]), x[2].exp());
        if shading.abs().element_sum() > STEEPEST || !(POWERS[0]..=POWERS[1]).contains(&power) {
            return None;
        }
        let evened = self.evened(shading, power);
        let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
        let sum =
            |of: &dyn Fn(usize) -> DMat3| (0..evened.len()).fold(DMat3::ZERO, |sum, k| sum + of(k));
        let own = sum(&|k| outer(evened[k], evened[k]));
        let trace = own.x_axis.x + own.y_axis.y + own.z_axis.z;
        if !(trace > 0.0 && own.determinant() > 1e-12 * trace.powi(3)) {
            return None;
        }
        let matrix = sum(&|k| outer(self.known[k], evened[k])) * own.inverse();
        let off = |k: usize| (matrix * evened[k] - self.known[k]).length_squared();
        let squares = (0..evened.len()).map(off).sum();
        Some(Solved { matrix, shading, power, squares })
    }

    /// Readings to a power, without the light's change.
    fn evened(&self, shading: DVec2, power: f64) -> Vec<DVec3> {
        let light = |place: &DVec2| 1.0 + shading.dot(*place);
        std::iter::zip(&self.read, &self.places)
            .map(|(read, place)| read.powf(power) / light(place))
            .collect()
    }

    /// CIEDE2000 of each patch with one scale, a scale a channel, and the matrix.
    fn differences(&self, solved: &Solved) -> Vec<[f64; 3]> {
        let evened = self.evened(solved.shading, 1.0);
        let pairs = || std::iter::zip(&self.known, &evened);
        let gains = pairs().fold(DVec3::ZERO, |sum, (known, own)| sum + *known * *own)
            / evened.iter().fold(DVec3::ZERO, |sum, own| sum + *own * *own);
        let bright = |v: &DVec3| luminance(v.to_array());
        let one = pairs().map(|(known, own)| bright(known) * bright(own)).sum::<f64>()
            / evened.iter().map(|own| bright(own).powi(2)).sum::<f64>();
        let apart = |known: &DVec3, own: DVec3| {
            let shown: Rgb = own.max(DVec3::ZERO).to_array();
            difference(lab(shown), lab(known.max(DVec3::ZERO).to_array()))
        };
        pairs()
            .map(|(known, own)| {
                [one * *own, gains * *own, solved.matrix * *own].map(|own| apart(known, own))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: DMat3 = DMat3::from_cols_array(&[0.7, 0.2, 0.05, 0.25, 0.8, 0.3, 0.1, 0.15, 0.9]);
    const SHADING: DVec2 = DVec2::new(0.2, -0.15);

    /// The ColorChecker by a camera of other primaries, its radiance bent by `response`.
    fn readings(response: impl Fn(f64) -> f64) -> (Table, Vec<PatchReading>) {
        let table = Table::color_checker();
        let read = |k: usize| {
            let light = 40.0 * (1.0 + SHADING.dot(table.centred(k)));
            let radiance = CAMERA * DVec3::from_array(table.patches[k].reflectance) * light;
            let mean = radiance.to_array().map(|value| response(value.max(0.0)));
            PatchReading { mean, ..Default::default() }
        };
        let readings = (0..24).map(read).collect();
        (table, readings)
    }

    #[test]
    fn the_matrix_is_that_of_the_camera() {
        let (table, readings) = readings(|value| value);
        let found = fit(&table, &readings).unwrap();
        assert!(found.shading.distance(SHADING) < 1e-5, "{}", found.shading);
        let identity = found.matrix * CAMERA * 40.0;
        assert!(identity.abs_diff_eq(DMat3::IDENTITY, 1e-5), "{identity}");
        assert!(!found.curve.is_better && (found.curve.power - 1.0).abs() < 1e-3);
        for (k, [one, _, matrix]) in found.differences.iter().enumerate() {
            assert!(*matrix < 0.01, "{}: {matrix}", table.patches[k].name);
            assert!(*one > 0.1, "{}: {one}", table.patches[k].name);
        }
        // Neutral stays as it was read, and colours are those of Rec. 709 under the light's colour.
        let white = CAMERA * DVec3::ONE;
        let kept = found.correction() * white;
        assert!(kept.distance(white) < 1e-4, "{kept}");
        let red = found.correction() * (CAMERA * DVec3::new(0.4, 0.03, 0.04));
        assert!(red.distance(white * DVec3::new(0.4, 0.03, 0.04)) < 1e-4, "{red}");
    }

    #[test]
    fn a_bent_response_is_noticed() {
        for power in [1.0 / 2.2, 0.8, 1.5] {
            let (table, readings) = readings(|value| value.powf(power));
            let found = fit(&table, &readings).unwrap();
            assert!(found.curve.is_better, "{power}: {:?}", found.curve);
            assert!((found.curve.power * power - 1.0).abs() < 1e-3, "{power}: {:?}", found.curve);
            assert!(found.curve.rms < 1e-5 && found.rms > 20.0 * found.curve.rms);
        }
        // Readings that are off by 2 % here and there are no curve.
        let (table, mut readings) = readings(|value| value);
        for (k, own) in readings.iter_mut().enumerate() {
            let off =
                |channel: usize| 1.0 + 0.02 * (((7 * k + 3 * channel) % 11) as f64 / 5.0 - 1.0);
            own.mean = std::array::from_fn(|channel| own.mean[channel] * off(channel));
        }
        let found = fit(&table, &readings).unwrap();
        assert!(!found.curve.is_better, "{:?}", found.curve);
    }

    #[test]
    fn what_determines_no_matrix_gives_none() {
        let (table, readings) = readings(|value| value);
        assert_eq!(fit(&table, &readings[..5]), None);
        let grey: Vec<PatchReading> =
            readings.iter().map(|own| PatchReading { mean: [own.mean[1]; 3], ..*own }).collect();
        assert_eq!(fit(&table, &grey), None);
        assert_eq!(fit(&table, &[PatchReading::default(); 24]), None);
    }
}
