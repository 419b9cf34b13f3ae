//! Numbers per sample, light and material that tables and plots show. They are computed once, on a
//! background thread.

use faer::Mat;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::Reconstruction;
use crate::reconstruct::lights::LightKind;

#[derive(Debug, Default)]
pub struct Derived {
    pub samples: Vec<SampleNumbers>,
    /// Samples ordered by material, each material's in the order of their indices; and where
    /// each material begins, with the number of samples at the end.
    pub by_material: Vec<u32>,
    pub material_start: Vec<usize>,
    /// Where each sample stands in that order.
    pub place: Vec<u32>,
    /// Root mean square of the log errors.
    pub log_rms: f64,
    pub lights: Vec<LightNumbers>,
    /// For each lobe, whether it shines where no sample is: photographs say nothing of its strength.
    pub unseen: Vec<bool>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleNumbers {
    pub material: usize,
    pub observed: Rgb,
    pub computed: Rgb,
    /// Mean over the channels of the natural logarithm of computed over observed.
    pub log_error: f64,
    pub views: usize,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightNumbers {
    /// The largest emission of any lobe that lights a sample, or else of any, as the mean of the
    /// channels.
    pub strongest: f64,
    pub emission: Rgb,
    pub lobes: usize,
    pub lit_lobes: usize,
    /// Its part of all irradiance of all samples from virtual lights.
    pub share: f64,
    /// Samples that get more than a thousandth of their irradiance from virtual lights from it.
    pub lit_samples: usize,
}

impl LightNumbers {
    /// Whether it shines, and no sample gets any of its light.
    pub fn is_unseen(&self) -> bool {
        self.lit_lobes > 0 && self.lit_samples == 0
    }
}

/// What samples owe to lights below this part of their light is nothing.
const LIT: f64 = 1e-3;

impl Derived {
    pub fn of(whole: &Reconstruction) -> Self {
        let samples = samples(whole);
        let materials = samples.iter().map(|sample| sample.material + 1).max().unwrap_or(0);
        let mut by_material: Vec<u32> = (0..samples.len() as u32).collect();
        by_material.sort_by_key(|&index| samples[index as usize].material);
        let material_start = (0..=materials)
            .map(|material| {
                by_material.partition_point(|&index| samples[index as usize].material < material)
            })
            .collect();
        let mut place = vec![0; samples.len()];
        for (at, &index) in by_material.iter().enumerate() {
            place[index as usize] = at as u32;
        }
        let sum: f64 = samples.iter().map(|sample| sample.log_error.powi(2)).sum();
        let log_rms = (sum / samples.len().max(1) as f64).sqrt();
        let (lights, unseen) = lights(whole);
        Self { by_material, material_start, place, log_rms, lights, unseen, samples }
    }

    /// The sample with the largest error.
    pub fn worst(&self) -> Option<usize> {
        let error = |index: usize| self.samples[index].log_error.abs();
        (0..self.samples.len()).max_by(|a, b| error(*a).total_cmp(&error(*b)))
    }

    /// The samples of a material with the largest errors, worst first.
    pub fn worst_of(&self, material: usize, count: usize) -> Vec<usize> {
        let (Some(&from), Some(&to)) =
            (self.material_start.get(material), self.material_start.get(material + 1))
        else {
            return Vec::new();
        };
        let mut indices: Vec<usize> =
            self.by_material[from..to].iter().map(|&index| index as usize).collect();
        let error = |index: &usize| self.samples[*index].log_error.abs();
        indices.sort_by(|a, b| error(b).total_cmp(&error(a)));
        indices.truncate(count);
        indices
    }
}

fn samples(whole: &Reconstruction) -> Vec<SampleNumbers> {
    let mut samples: Vec<SampleNumbers> = whole
        .samples
        .samples
        .iter()
        .map(|sample| SampleNumbers {
            material: sample.material,
            views: sample.views.len(),
            ..SampleNumbers::default()
        })
        .collect();
    for (row, computed) in whole.equations.rows.iter().zip(&whole.solution.computed) {
        let sample = &mut samples[row.sample];
        for (c, computed) in computed.iter().enumerate() {
            sample.observed[c] += row.share * row.radiance[c];
            sample.computed[c] += row.share * computed;
        }
    }
    let dark: Rgb = std::array::from_fn(|c| whole.equations.dark(c));
    for sample in &mut samples {
        let log =
            |c: usize| (sample.computed[c].max(dark[c]) / sample.observed[c].max(dark[c])).ln();
        sample.log_error = (0..CHANNELS).map(log).sum::<f64>() / CHANNELS as f64;
    }
    samples
}

fn lights(whole: &Reconstruction) -> (Vec<LightNumbers>, Vec<bool>) {
    let mean = |rgb: &Rgb| rgb.iter().sum::<f64>() / CHANNELS as f64;
    let coupling = &whole.transport.coupling;
    let emission = &whole.solution.emission;
    let (rows, lobes) = (coupling.nrows(), coupling.ncols().min(emission.len()));
    let mut total = vec![0.0; rows];
    for (lobe, emission) in emission[..lobes].iter().enumerate() {
        let strength = mean(emission);
        if strength > 0.0 {
            for (total, k) in total.iter_mut().zip(coupling.col(lobe).iter()) {
                *total += k * strength;
            }
        }
    }
    let all: f64 = total.iter().sum();
    let mut own = vec![0.0; rows];
    let unseen = unseen(coupling, emission, &total);
    let lights = (0..whole.lights.lights.len())
        .map(|light| {
            let range = whole.lobes.of(light);
            let mut numbers = LightNumbers { lobes: range.len(), ..LightNumbers::default() };
            own.fill(0.0);
            let mut seen = false;
            for lobe in range.filter(|&lobe| lobe < lobes) {
                let strength = mean(&emission[lobe]);
                if strength <= 0.0 {
                    continue;
                }
                numbers.lit_lobes += 1;
                let is_seen = !unseen[lobe];
                if (is_seen, strength) > (seen, numbers.strongest) {
                    seen = is_seen;
                    (numbers.strongest, numbers.emission) = (strength, emission[lobe]);
                }
                for (own, k) in own.iter_mut().zip(coupling.col(lobe).iter()) {
                    *own += k * strength;
                }
            }
            if all > 0.0 {
                numbers.share = own.iter().sum::<f64>() / all;
            }
            numbers.lit_samples =
                own.iter().zip(&total).filter(|(own, total)| **own > LIT * **total).count();
            numbers
        })
        .collect();
    (lights, unseen)
}

/// For each lobe, whether it has an emission of which no sample gets a thousandth of its light, given
/// the irradiance of each sample from all lobes.
fn unseen(coupling: &Mat<f64>, emission: &[Rgb], total: &[f64]) -> Vec<bool> {
    let strength = |own: &Rgb| own.iter().sum::<f64>() / CHANNELS as f64;
    let lobes = emission.iter().take(coupling.ncols()).enumerate();
    lobes
        .map(|(lobe, own)| {
            let strength = strength(own);
            let lit = |(k, total): (&f64, &f64)| k * strength > LIT * total;
            strength > 0.0 && !coupling.col(lobe).iter().zip(total).any(lit)
        })
        .collect()
}

/// The irradiance of one sample by source: from the known geometry, and from each light that
/// gives any, strongest first.
pub fn irradiance_of(whole: &Reconstruction, sample: usize) -> (Rgb, Vec<(usize, Rgb)>) {
    let geometry = std::array::from_fn(|c| whole.transport.irradiance(sample, c));
    let coupling = &whole.transport.coupling;
    let lobes = coupling.ncols().min(whole.solution.emission.len());
    let mut lights: Vec<(usize, Rgb)> = (0..whole.lights.lights.len())
        .map(|light| {
            let mut sum = [0.0; CHANNELS];
            for lobe in whole.lobes.of(light).filter(|&lobe| lobe < lobes) {
                let k = coupling[(sample, lobe)];
                for (sum, emission) in sum.iter_mut().zip(whole.solution.emission[lobe]) {
                    *sum += k * emission;
                }
            }
            (light, sum)
        })
        .filter(|(_, sum)| sum.iter().any(|&value| value > 0.0))
        .collect();
    let total = |rgb: &Rgb| rgb.iter().sum::<f64>();
    lights.sort_by(|a, b| total(&b.1).total_cmp(&total(&a.1)));
    (geometry, lights)
}

/// What a kind of light is called.
pub fn kind_name(kind: LightKind) -> &'static str {
    match kind {
        LightKind::Sphere => "Sphere disc",
        LightKind::Surface => "Surface disc",
        LightKind::Lamp => "Lamp",
        LightKind::Sky => "Sky cell",
        LightKind::Sun => "Sun",
        LightKind::Known(_) => "Known light",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lobe_that_lights_no_sample_is_told_from_one_that_does() {
        // The third shines brightest, past all samples; the fourth is dark.
        let coupling = Mat::from_fn(2, 4, |row, lobe| match lobe {
            0 => 0.5,
            1 => 0.001 * row as f64,
            2 => 1e-9,
            _ => 0.0,
        });
        let emission = [1.0, 2.0, 1753.0, 0.0].map(|value| [value; CHANNELS]);
        let total = [0.5, 0.502];
        assert_eq!(unseen(&coupling, &emission, &total), [false, false, true, false]);
        let numbers =
            |lit_samples| LightNumbers { lit_lobes: 1, lit_samples, ..Default::default() };
        assert!(numbers(0).is_unseen() && !numbers(1).is_unseen());
        assert!(!LightNumbers::default().is_unseen(), "what is dark is not unseen");
    }
}
