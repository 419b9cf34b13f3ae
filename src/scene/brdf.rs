//! The reflectance model of every material (Eq. 12).

use std::f64::consts::PI;

use crate::math::rgb::{CHANNELS, Rgb};

/// The BRDF of one material: the modified Phong model of Eq. 12,
/// f = ρ_d/π + (n+2)/(2π) ρ_s cosⁿγ, where γ is the angle between the mirrored direction of view and
/// that of the incoming light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brdf {
    /// ρ_d, 0 to 1.
    pub diffuse: Rgb,
    /// ρ_s, 0 to 1; zero for diffuse materials.
    pub specular: Rgb,
    /// n; without effect where ρ_s is zero.
    pub exponent: f64,
}

impl Brdf {
    /// A diffuse BRDF: ρ_s is zero.
    pub fn diffuse(diffuse: Rgb) -> Self {
        Self { diffuse, specular: [0.0; CHANNELS], exponent: 1.0 }
    }

    /// (n+2)/(2π) ρ_s, the factor of cosⁿγ in Eq. 12.
    pub fn lobe_scale(&self, channel: usize) -> f64 {
        (self.exponent + 2.0) / (2.0 * PI) * self.specular[channel]
    }
}
