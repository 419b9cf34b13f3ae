//! Eq. 6 to 9: the equations between the radiance of a sample, reflectances and emissions.
//!
//! A diffuse sample has the same radiance in all directions and gives one equation, for its mean
//! radiance. A specular sample gives one equation for every photograph that shows it.

use std::f64::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::lights::{VirtualLight, VirtualLights};
use crate::reconstruct::samples::{Sample, SampleCloud};
use crate::reconstruct::transport::Transport;
use crate::scene::{Brdf, Capture, MaterialKind, Viewing};
use crate::solve::kernels::exp2;

/// One equation: that of a diffuse sample, or that of a specular sample in one photograph.
#[derive(Clone, Copy, Debug)]
pub struct Equation {
    /// Index into `SampleCloud::samples`.
    pub sample: usize,
    /// Index into `Capture::materials`.
    pub material: usize,
    /// L(x, ω_r) per channel.
    pub radiance: Rgb,
    /// Weight of this equation; those of one sample add up to 1.
    pub share: f64,
    /// Its entry in `Equations::glossy`, for a specular sample.
    pub glossy: Option<usize>,
}

/// What a specular sample's equation needs beyond a diffuse one's.
#[derive(Clone, Debug)]
pub struct Glossy {
    /// How the photograph sees the sample: γ between the mirrored direction and ω_i equals γ of
    /// Eq. 12.
    pub viewing: Viewing,
    /// log₂ cos γ for each virtual light, −∞ where the light is not in front of the mirror.
    light_log_cosine: Vec<f32>,
    /// Radiance records within the mirror's hemisphere: log₂ cos γ, and radiance × projected
    /// solid angle per channel.
    record_log_cosine: Vec<f32>,
    record_irradiance: [Vec<f32>; CHANNELS],
}

/// All equations of a capture, ordered by sample.
#[derive(Clone, Debug, Default)]
pub struct Equations {
    /// Ordered by sample.
    pub rows: Vec<Equation>,
    /// One for each row of a specular sample, in the order of the rows.
    pub glossy: Vec<Glossy>,
    /// The rows of each material.
    pub of_material: Vec<Vec<usize>>,
    /// Mean radiance over the samples, by which a radiance is judged to be nearly nothing.
    pub mean_radiance: Rgb,
}

/// The number of equations of a capture, without setting them up.
pub fn count(capture: &Capture, cloud: &SampleCloud, views_per_sample: usize) -> usize {
    let of_sample = |sample: &Sample| match capture.materials[sample.material].kind {
        MaterialKind::Diffuse => 1,
        MaterialKind::Specular => sample.views.len().min(views_per_sample),
    };
    cloud.samples.iter().map(of_sample).sum()
}

/// Radiances below this part of the mean count as this much where a relative error is formed.
const DARK: f64 = 1e-3;
/// The same in a channel that is black everywhere; its inverse's square is still a number.
const DARKEST: f64 = 1e-30;

impl Equations {
    /// Sets the equations up; a specular sample uses at most `views_per_sample` photographs.
    pub fn new(
        capture: &Capture,
        cloud: &SampleCloud,
        lights: &VirtualLights,
        transport: &Transport,
        views_per_sample: usize,
    ) -> Self {
        let mut equations =
            Self { of_material: vec![Vec::new(); capture.materials.len()], ..Self::default() };
        // Which view of which sample each glossy equation is for.
        let mut glossy = Vec::new();
        for (index, sample) in cloud.samples.iter().enumerate() {
            for (sum, value) in equations.mean_radiance.iter_mut().zip(sample.radiance) {
                *sum += f64::from(value) / cloud.samples.len() as f64;
            }
            let mut push = |radiance: [f32; CHANNELS], share, glossy| {
                equations.of_material[sample.material].push(equations.rows.len());
                equations.rows.push(Equation {
                    sample: index,
                    material: sample.material,
                    radiance: radiance.map(f64::from),
                    share,
                    glossy,
                });
            };
            match capture.materials[sample.material].kind {
                MaterialKind::Diffuse => push(sample.radiance, 1.0, None),
                MaterialKind::Specular => {
                    let views = spread(sample.views.clone(), views_per_sample);
                    for &view in &views {
                        push(
                            cloud.views[view].radiance,
                            1.0 / views.len() as f64,
                            Some(glossy.len()),
                        );
                        glossy.push((index, view));
                    }
                }
            }
        }
        equations.glossy = glossy
            .par_iter()
            .map(|&(sample, view)| {
                Glossy::new(cloud, lights, transport, sample, cloud.views[view].direction)
            })
            .collect();
        equations
    }

    /// The same equations for other lights.
    pub fn with_lights(mut self, cloud: &SampleCloud, lights: &VirtualLights) -> Self {
        let glossy: Vec<(usize, usize)> =
            self.rows.iter().filter_map(|row| Some((row.glossy?, row.sample))).collect();
        for (index, sample) in glossy {
            self.glossy[index].set_lights(&cloud.samples[sample], lights);
        }
        self
    }

    /// The smallest radiance that a relative error is formed with.
    pub fn dark(&self, channel: usize) -> f64 {
        (DARK * self.mean_radiance[channel]).max(DARKEST)
    }

    /// L⁺ of one equation (Eq. 6): the part that comes from the photographed surfaces.
    pub fn photographed(&self, row: &Equation, reflectance: &Brdf, transport: &Transport) -> Rgb {
        let is_specular = reflectance.specular.iter().any(|&s| s > 0.0);
        let specular = match row.glossy {
            Some(glossy) if is_specular => self.glossy[glossy].records(reflectance.exponent),
            _ => [0.0; CHANNELS],
        };
        std::array::from_fn(|c| {
            reflectance.diffuse[c] / PI * transport.irradiance(row.sample, c)
                + reflectance.lobe_scale(c) * specular[c]
        })
    }
}

impl Glossy {
    fn new(
        cloud: &SampleCloud,
        lights: &VirtualLights,
        transport: &Transport,
        sample: usize,
        towards_camera: Vec3,
    ) -> Self {
        let point = &cloud.samples[sample];
        let viewing = Viewing::from(towards_camera, point.normal);
        let mut glossy = Self {
            viewing,
            light_log_cosine: Vec::new(),
            record_log_cosine: Vec::new(),
            record_irradiance: Default::default(),
        };
        glossy.set_lights(point, lights);
        for record in transport.records_of(sample) {
            let log = log_cosine(viewing.mirror, record.direction);
            if log > f32::NEG_INFINITY {
                glossy.record_log_cosine.push(log);
                for (channel, irradiance) in record.irradiance.iter().enumerate() {
                    glossy.record_irradiance[channel].push(*irradiance);
                }
            }
        }
        glossy
    }

    fn set_lights(&mut self, sample: &Sample, lights: &VirtualLights) {
        let towards = |light: &VirtualLight| light.direction_from(sample.position);
        let lights = lights.lights.iter();
        self.light_log_cosine =
            lights.map(|light| log_cosine(self.viewing.mirror, towards(light))).collect();
    }

    /// Σ_j L_j cosⁿγ_j cos θ_j ω_j over the radiance records, per channel.
    pub fn records(&self, exponent: f64) -> Rgb {
        let exponent = exponent as f32;
        // Eight partial sums each, so that the loop can be vectorised.
        let mut sums = [[0.0f32; 8]; CHANNELS];
        let [red, green, blue] = &self.record_irradiance;
        let mut logs = self.record_log_cosine.chunks_exact(8);
        let mut colours = red.chunks_exact(8).zip(green.chunks_exact(8)).zip(blue.chunks_exact(8));
        for (log, ((r, g), b)) in logs.by_ref().zip(colours.by_ref()) {
            for k in 0..8 {
                let factor = power(exponent, log[k]);
                sums[0][k] += factor * r[k];
                sums[1][k] += factor * g[k];
                sums[2][k] += factor * b[k];
            }
        }
        let mut total = sums.map(|lanes| lanes.iter().map(|&v| f64::from(v)).sum::<f64>());
        let done = self.record_log_cosine.len() / 8 * 8;
        for k in done..self.record_log_cosine.len() {
            let factor = power(exponent, self.record_log_cosine[k]);
            for (total, irradiance) in total.iter_mut().zip(&self.record_irradiance) {
                *total += f64::from(factor * irradiance[k]);
            }
        }
        total
    }

    /// f of Eq. 12 from each virtual light's centre towards the camera.
    pub fn light_factors(&self, reflectance: &Brdf, channel: usize) -> Vec<f64> {
        let diffuse = reflectance.diffuse[channel] / PI;
        let scale = reflectance.lobe_scale(channel);
        let exponent = reflectance.exponent as f32;
        let factor = |&log: &f32| diffuse + scale * f64::from(power(exponent, log));
        self.light_log_cosine.iter().map(factor).collect()
    }

    /// Σ_i G_i cosⁿγ_i over the virtual lights, where `irradiance[i]` is light i's at the
    /// sample, per channel.
    pub fn lights(&self, exponent: f64, irradiance: &[Rgb]) -> Rgb {
        let mut total = [0.0; CHANNELS];
        for (&log, irradiance) in self.light_log_cosine.iter().zip(irradiance) {
            let factor = f64::from(power(exponent as f32, log));
            for (total, value) in total.iter_mut().zip(irradiance) {
                *total += factor * value;
            }
        }
        total
    }
}

/// log₂ of the cosine between two unit vectors, −∞ beyond 90°.
fn log_cosine(mirror: Vec3, direction: Vec3) -> f32 {
    let cosine = mirror.dot(direction).min(1.0);
    if cosine > 0.0 { cosine.log2() } else { f32::NEG_INFINITY }
}

/// cosⁿγ = 2^(n log₂ cos γ); 2⁻¹⁰⁰, of which nothing is left in a radiance, where it is less.
#[inline]
fn power(exponent: f32, log_cosine: f32) -> f32 {
    exp2(exponent * log_cosine)
}

/// At most `count` of a range, evenly spread over it.
fn spread(range: std::ops::Range<usize>, count: usize) -> Vec<usize> {
    let length = range.len();
    if length <= count {
        return range.collect();
    }
    (0..count).map(|k| range.start + k * length / count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_is_exp2() {
        for i in 0..4000 {
            let log = -(i as f32) * 0.0007;
            for exponent in [0.3f32, 1.0, 7.5, 40.0, 300.0] {
                let exact = (f64::from(exponent) * f64::from(log)).exp2();
                if exact > 1e-28 {
                    let relative = (f64::from(power(exponent, log)) / exact - 1.0).abs();
                    // The product itself is rounded to 2⁻²⁴ of up to 93.
                    assert!(relative < 6e-6, "{exponent} × {log}: {relative}");
                }
            }
        }
        assert!(power(20.0, f32::NEG_INFINITY) < 1e-29);
        assert!(power(0.0, f32::NEG_INFINITY) < 1e-29);
    }

    #[test]
    fn views_are_spread_evenly() {
        assert_eq!(spread(4..7, 5), [4, 5, 6]);
        assert_eq!(spread(10..20, 4), [10, 12, 15, 17]);
    }
}
