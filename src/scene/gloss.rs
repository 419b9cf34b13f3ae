//! Specular reflection: the modified Phong lobe of Eq. 12, or a dielectric coat.

use std::f64::consts::PI;

use glam::Vec3;

use crate::math::sampling::mirrored;

/// The shape of a specular lobe, without its strength ρ_s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gloss {
    /// (n+2)/(2π) cosⁿγ (Eq. 12), whose strength is unknown.
    Phong { exponent: f64 },
    /// A rough dielectric of index 1.5 over the diffuse surface: the microfacet model of Walter et
    /// al. 2007 with the distribution GGX of roughness α, the shadowing of Smith (correlated in
    /// height) and Fresnel's reflectance. Its strength is 1.
    Coat { roughness: f64 },
}

/// How a surface point is viewed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewing {
    /// The surface normal, on the viewer's side.
    pub normal: Vec3,
    /// In which a mirror would see; a unit vector, as all directions here away from the surface.
    pub mirror: Vec3,
}

/// Logarithm of a part of a lobe's height that no sum of double precision shows.
const DARK_LOG: f64 = -40.0;
/// Index of refraction of a coat: of varnish, plastic and glaze within a few hundredths.
pub(super) const INDEX: f64 = 1.5;
/// The reflectance of a smooth coat for evenly distributed light, 2 ∫ F(μ) μ dμ from 0 to 1. A rough
/// coat reflects a few thousandths less.
const MEAN_FRESNEL: f64 = 0.0918;

impl Viewing {
    /// From the unit direction towards the viewer.
    pub fn from(towards: Vec3, normal: Vec3) -> Self {
        Self { normal, mirror: mirrored(towards, normal) }
    }
}

impl Gloss {
    /// π f/ρ_s for light from a direction, averaged over a light of this angular radius in radians:
    /// the lobe is widened by the light's size, its integral kept.
    ///
    /// A Phong lobe's variance about its axis is about 1/n, that of a disc of angular radius a is
    /// a²/4. The mean of GGX over that disc about its peak is that of α² + a²/4: with half vectors
    /// turning by half of what directions do, 4/(π a²) ∫ α²/(α² + u)² du from 0 to a²/4.
    pub fn value(self, viewing: Viewing, direction: Vec3, angle: f64) -> f64 {
        match self {
            Self::Phong { exponent } => {
                let cosine = f64::from(viewing.mirror.dot(direction));
                if cosine <= 0.0 {
                    return 0.0;
                }
                let n = 1.0 / (1.0 / exponent + 0.25 * angle * angle);
                // ln x ≤ x − 1: far from the lobe nothing is left, and a power takes time.
                if n * (cosine - 1.0) < DARK_LOG {
                    return 0.0;
                }
                0.5 * (n + 2.0) * cosine.powf(n)
            }
            Self::Coat { roughness } => {
                let square = roughness * roughness + 0.25 * angle * angle;
                PI * Reflected::new(viewing, direction)
                    .map_or(0.0, |reflected| reflected.brdf(square.min(1.0)))
            }
        }
    }

    /// A coat whose lobe is about as wide as a Phong lobe of this exponent: the normals of a Beckmann
    /// surface vary by α²/2 along each axis and directions by twice as many radians, 2 α² = 1/n.
    pub fn coat_like(exponent: f64) -> Self {
        Self::Coat { roughness: (0.5 / exponent).sqrt().min(1.0) }
    }

    /// The part of evenly distributed light that a lobe of strength 1 reflects, over all directions (the
    /// bihemispherical reflectance). What a Phong lobe loses below the surface is left out.
    pub fn albedo(self) -> f64 {
        match self {
            Self::Phong { .. } => 1.0,
            Self::Coat { .. } => MEAN_FRESNEL,
        }
    }

    /// The exponent of a Phong lobe that is about as wide.
    pub fn exponent(self) -> f64 {
        match self {
            Self::Phong { exponent } => exponent,
            Self::Coat { roughness } => 0.5 / (roughness * roughness),
        }
    }
}

/// The directions of a reflection, by their cosines.
pub struct Reflected {
    /// With the normal: of the light, of the viewer.
    light: f64,
    viewer: f64,
    /// Squared sine and cosine of the half vector with the normal.
    half_sine2: f64,
    half_cosine2: f64,
    /// Of the half vector with the viewer, and with the light.
    difference: f64,
}

impl Reflected {
    /// `None` where the light or the viewer is below the surface.
    pub fn new(viewing: Viewing, direction: Vec3) -> Option<Self> {
        let Viewing { normal, mirror } = viewing;
        let (light, viewer) = (normal.dot(direction), normal.dot(mirror));
        if light <= 0.0 || viewer <= 0.0 {
            return None;
        }
        let towards = 2.0 * viewer * normal - mirror;
        let half = (towards + direction).normalize_or(normal);
        let sine2 = f64::from(normal.cross(half).length_squared()).min(1.0);
        Some(Self {
            light: light.into(),
            viewer: viewer.into(),
            half_sine2: sine2,
            half_cosine2: 1.0 - sine2,
            difference: f64::from(half.dot(direction)).clamp(0.0, 1.0),
        })
    }

    /// f in 1/sr, given α².
    fn brdf(&self, square: f64) -> f64 {
        let across = |cosine: f64| (square + (1.0 - square) * cosine * cosine).sqrt();
        // Shadowing and masking over 4 cos θ_i cos θ_o.
        let visible = 0.5 / (self.viewer * across(self.light) + self.light * across(self.viewer));
        self.distribution(square) * visible * fresnel(self.difference)
    }

    /// The distribution of normals D by solid angle, given α².
    fn distribution(&self, square: f64) -> f64 {
        square / (PI * (self.half_sine2 + square * self.half_cosine2).powi(2))
    }

    /// The density by solid angle of the light's direction where the half vector is chosen with
    /// density D cos θ.
    pub fn density(&self, roughness: f64) -> f64 {
        let distribution = self.distribution(roughness * roughness);
        distribution * self.half_cosine2.sqrt() / (4.0 * self.difference.max(f64::MIN_POSITIVE))
    }
}

/// The reflectance of unpolarised light at the coat, by the cosine of incidence.
pub fn fresnel(cosine: f64) -> f64 {
    let within = (1.0 - (1.0 - cosine * cosine) / (INDEX * INDEX)).sqrt();
    let across = (cosine - INDEX * within) / (cosine + INDEX * within);
    let along = (INDEX * cosine - within) / (INDEX * cosine + within);
    0.5 * (across * across + along * along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::{
        Frame, Random, square_to_cosine_hemisphere, square_to_disc, stratified,
    };

    fn viewing(degrees: f32) -> Viewing {
        let angle = degrees.to_radians();
        Viewing::from(Vec3::new(angle.sin(), 0.0, angle.cos()), Vec3::Z)
    }

    /// ∫ f cos θ dω by rays in proportion to the cosine.
    fn albedo(gloss: Gloss, viewing: Viewing, angle: f64) -> f64 {
        let side = 1000;
        let frame = Frame::about(Vec3::Z);
        let mut random = Random::new(1, 2, 3);
        let values = stratified(side, &mut random).map(|square| {
            gloss.value(viewing, frame.to_world(square_to_cosine_hemisphere(square)), angle)
        });
        values.sum::<f64>() / (side * side) as f64
    }

    #[test]
    fn fresnel_is_that_of_glass() {
        // ((1.5 − 1)/(1.5 + 1))² at normal incidence, all of it at grazing incidence; at Brewster's
        // angle half of what is polarised across: tan θ = 1.5.
        assert!((fresnel(1.0) - 0.04).abs() < 1e-12);
        assert!((fresnel(0.0) - 1.0).abs() < 1e-12);
        let brewster = 1.5f64.atan().cos();
        let across = (2.25f64 - 1.0) / (2.25 + 1.0);
        assert!((fresnel(brewster) - 0.5 * across * across).abs() < 1e-12);
    }

    #[test]
    fn diffuse_light_is_reflected_by_a_coat_as_by_glass() {
        let steps = 10_000;
        let cosines = (0..steps).map(|step| (f64::from(step) + 0.5) / f64::from(steps));
        let mean: f64 =
            cosines.map(|cosine| 2.0 * fresnel(cosine) * cosine).sum::<f64>() / f64::from(steps);
        let found = Gloss::Coat { roughness: 0.1 }.albedo();
        assert!((found - mean).abs() < 1e-4, "{found} {mean}");
    }

    #[test]
    fn a_smooth_coat_reflects_what_fresnel_says() {
        for degrees in [0.0f32, 30.0, 60.0] {
            let expected = fresnel(f64::from(degrees.to_radians().cos()));
            let found = albedo(Gloss::Coat { roughness: 0.05 }, viewing(degrees), 0.0);
            assert!((found / expected - 1.0).abs() < 0.06, "{degrees}: {found} {expected}");
        }
    }

    #[test]
    fn a_coat_is_the_same_both_ways() {
        let gloss = Gloss::Coat { roughness: 0.3 };
        let (a, b) = (
            Vec3::new(0.5, 0.1, 0.86).normalize_or_zero(),
            Vec3::new(-0.3, 0.6, 0.7).normalize_or_zero(),
        );
        let there = gloss.value(Viewing::from(a, Vec3::Z), b, 0.0);
        let back = gloss.value(Viewing::from(b, Vec3::Z), a, 0.0);
        assert!(there > 0.0 && (there / back - 1.0).abs() < 1e-5, "{there} {back}");
    }

    /// The highlight of a large light is that of a small one smoothed over its disc.
    #[test]
    fn a_lobe_is_widened_by_the_light() {
        let (gloss, seen) = (Gloss::Coat { roughness: 0.1 }, viewing(40.0));
        let angle = 0.2f32;
        let light = Frame::about(seen.mirror);
        let mut sum = 0.0;
        let mut count = 0;
        for square in stratified(300, &mut Random::new(1, 1, 1)) {
            let disc = angle * square_to_disc(square);
            let direction = light.normal + disc.x * light.tangent + disc.y * light.bitangent;
            sum += gloss.value(seen, direction.normalize_or_zero(), 0.0);
            count += 1;
        }
        let found = gloss.value(seen, seen.mirror, f64::from(angle));
        let expected = sum / f64::from(count);
        assert!((found / expected - 1.0).abs() < 0.15, "{found} {expected}");
    }
}
