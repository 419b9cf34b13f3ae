//! The light that a specular lobe reflects of what arrives from many directions at once, in single
//! precision and by vector instructions.

use glam::Vec3;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::scene::gloss::{Gloss, INDEX, Viewing};
use crate::solve::kernels::{dot, exp2, log2, vectorised};

/// Light from many directions at a surface point.
#[derive(Clone, Debug, Default)]
pub struct Incoming {
    /// The coordinates of the unit directions that it comes from.
    direction: [Vec<f32>; 3],
    /// A quarter of the squared angular radius of each light, in radians.
    widening: Vec<f32>,
    /// Irradiance from each direction, per channel.
    irradiance: [Vec<f32>; CHANNELS],
}

impl Incoming {
    /// From unit directions, each with the angular radius of a light in radians and its irradiance.
    pub fn new(light: impl Iterator<Item = (Vec3, f32, Radiance)>) -> Self {
        let mut incoming = Self::default();
        for (direction, angle, irradiance) in light {
            let coordinates = incoming.direction.iter_mut().zip(direction.to_array());
            let channels = incoming.irradiance.iter_mut().zip(irradiance);
            coordinates.chain(channels).for_each(|(values, value)| values.push(value));
            incoming.widening.push(0.25 * angle * angle);
        }
        incoming
    }

    /// ∫ L π f/ρ_s cos θ dω, per channel: the sum of the irradiance from each direction times
    /// [`Gloss::value`] for it.
    pub fn reflected(&self, viewing: Viewing, gloss: Gloss) -> Rgb {
        let values = self.values(viewing, gloss);
        self.irradiance
            .each_ref()
            .map(|irradiance| vectorised!(f64::from(dot(&values, irradiance))))
    }

    /// [`Gloss::value`] for every direction.
    fn values(&self, viewing: Viewing, gloss: Gloss) -> Vec<f32> {
        let Viewing { normal, mirror } = viewing;
        let mut values = vec![0.0; self.widening.len()];
        let [x, y, z] = &self.direction;
        let each = values.iter_mut().zip(x).zip(y).zip(z).zip(&self.widening);
        let each =
            each.map(|((((value, &x), &y), &z), &widening)| (value, Vec3::new(x, y, z), widening));
        match gloss {
            Gloss::Phong { exponent } => {
                let flat = (exponent as f32).recip();
                vectorised!({
                    for (value, direction, widening) in each {
                        let cosine = mirror.dot(direction).clamp(f32::MIN_POSITIVE, 1.0);
                        let n = (flat + widening).recip();
                        *value = 0.5 * (n + 2.0) * exp2(n * log2(cosine));
                    }
                });
            }
            Gloss::Coat { roughness } => {
                let flat = (roughness * roughness) as f32;
                let viewer = normal.dot(mirror);
                let towards = 2.0 * viewer * normal - mirror;
                vectorised!({
                    for (value, direction, widening) in each {
                        let light = normal.dot(direction).max(0.0);
                        let half = towards + direction;
                        let square = half.length_squared().max(f32::MIN_POSITIVE);
                        let sine2 = (normal.cross(half).length_squared() / square).min(1.0);
                        // The cosine between the half vector and the light is half the length of their sum.
                        let fresnel = fresnel((0.5 * square.sqrt()).min(1.0));
                        let is_above = light > 0.0 && viewer > 0.0;
                        let rough = (flat + widening).min(1.0);
                        let across = |cosine: f32| (rough + (1.0 - rough) * cosine * cosine).sqrt();
                        let shadowed = viewer * across(light) + light * across(viewer);
                        let spread = sine2 + rough * (1.0 - sine2);
                        let coat = fresnel * 0.5 * rough
                            / (spread * spread * shadowed.max(f32::MIN_POSITIVE));
                        *value = if is_above { coat } else { 0.0 };
                    }
                });
            }
        }
        values
    }
}

/// [`fresnel`](super::gloss::fresnel) in single precision.
#[inline(always)]
fn fresnel(cosine: f32) -> f32 {
    let index = INDEX as f32;
    let within = (1.0 - (1.0 - cosine * cosine) / (index * index)).sqrt();
    let across = (cosine - index * within) / (cosine + index * within);
    let along = (index * cosine - within) / (index * cosine + within);
    0.5 * (across * across + along * along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::{Frame, Random, square_to_cosine_hemisphere};

    #[test]
    fn many_directions_at_once_are_those_one_by_one() {
        let mut random = Random::new(4, 0, 0);
        let frame = Frame::about(Vec3::Z);
        let directions: Vec<(Vec3, f32)> = (0..500)
            .map(|k| {
                let up = frame.to_world(square_to_cosine_hemisphere(random.point()));
                // Some below the surface.
                (if k % 7 == 0 { -up } else { up }, 0.3 * (k % 3) as f32)
            })
            .collect();
        let incoming = Incoming::new(directions.iter().map(|&(d, angle)| (d, angle, [0.5; 3])));
        for degrees in [0.0f32, 35.0, 80.0] {
            let angle = degrees.to_radians();
            let seen = Viewing::from(Vec3::new(angle.sin(), 0.0, angle.cos()), Vec3::Z);
            let phong = [3.0, 40.0].map(|exponent| Gloss::Phong { exponent });
            let coat = [0.05, 0.4].map(|roughness| Gloss::Coat { roughness });
            for gloss in phong.into_iter().chain(coat) {
                let values = incoming.values(seen, gloss);
                let sum: f64 = values.iter().map(|&value| 0.5 * f64::from(value)).sum();
                for found in incoming.reflected(seen, gloss) {
                    assert!((found / sum - 1.0).abs() < 1e-5, "{gloss:?}: {found} {sum}");
                }
                for (&(direction, angle), value) in directions.iter().zip(values) {
                    let expected = gloss.value(seen, direction, angle.into());
                    let error = (f64::from(value) - expected).abs();
                    assert!(error < 1e-4 * (expected + 1e-3), "{gloss:?}: {value} {expected}");
                }
            }
        }
    }
}
