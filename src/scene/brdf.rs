//! The reflectance model of every material (Eq. 12).

use std::f64::consts::PI;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::scene::Gloss;

/// The BRDF of one material: the modified Phong model of Eq. 12,
/// f = ρ_d/π + (n+2)/(2π) ρ_s cosⁿγ, where γ is the angle between the mirrored direction of view and
/// that of the incoming light; or a dielectric coat in place of the lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brdf {
    /// ρ_d, 0 to 1.
    pub diffuse: Rgb,
    /// ρ_s, 0 to 1; zero for diffuse materials.
    pub specular: Rgb,
    /// n; without effect where ρ_s is zero.
    pub exponent: f64,
    /// Roughness α of a coat ([`Gloss::Coat`]); ρ_s is then zero.
    pub coat: Option<f64>,
}

impl Brdf {
    /// A diffuse BRDF: ρ_s is zero.
    pub fn diffuse(diffuse: Rgb) -> Self {
        Self { diffuse, specular: [0.0; CHANNELS], exponent: 1.0, coat: None }
    }

    /// The modified Phong model.
    pub fn phong(diffuse: Rgb, specular: Rgb, exponent: f64) -> Self {
        Self { diffuse, specular, exponent, coat: None }
    }

    /// The specular lobe and its strength per channel; `None` of a diffuse surface.
    pub fn gloss(&self) -> Option<(Gloss, Rgb)> {
        match self.coat {
            Some(roughness) => Some((Gloss::Coat { roughness }, [1.0; CHANNELS])),
            None if self.specular == [0.0; CHANNELS] => None,
            None => Some((Gloss::Phong { exponent: self.exponent }, self.specular)),
        }
    }

    /// (n+2)/(2π) ρ_s, the factor of cosⁿγ in Eq. 12.
    pub fn lobe_scale(&self, channel: usize) -> f64 {
        (self.exponent + 2.0) / (2.0 * PI) * self.specular[channel]
    }
}
