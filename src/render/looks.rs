//! The BRDF of every surface of the capture, with the edits applied.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::math::rgb::{CHANNELS, Radiance};
use crate::math::sampling::{Frame, mirrored};
use crate::reconstruct::textures::Texture;
use crate::render::edits::{Edits, GREY};
use crate::render::scene::Solved;
use crate::scene::gloss::Reflected;
use crate::scene::{Brdf, Capture, Gloss, Optics, Role, Viewing, fresnel};

/// [`Brdf`] in single precision, as the path tracer evaluates it (Eq. 12).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BrdfF32 {
    pub diffuse: Radiance,
    pub specular: Radiance,
    pub exponent: f32,
    /// Roughness α of a coat; the specular reflectance is then zero.
    pub coat: Option<f32>,
}

impl From<&Brdf> for BrdfF32 {
    fn from(reflectance: &Brdf) -> Self {
        Self {
            diffuse: reflectance.diffuse.map(|value| value as f32),
            specular: reflectance.specular.map(|value| value as f32),
            exponent: reflectance.exponent as f32,
            coat: reflectance.coat.map(|roughness| roughness as f32),
        }
    }
}

impl BrdfF32 {
    pub fn is_specular(&self) -> bool {
        self.coat.is_some() || self.specular.iter().any(|&part| part > 0.0)
    }

    pub fn gloss(&self) -> Gloss {
        match self.coat {
            Some(roughness) => Gloss::Coat { roughness: roughness.into() },
            None => Gloss::Phong { exponent: self.exponent.into() },
        }
    }

    /// ρ_s; of a coat 1.
    pub fn strength(&self) -> Radiance {
        if self.coat.is_some() { [1.0; CHANNELS] } else { self.specular }
    }

    /// f in 1/sr.
    pub fn value(&self, viewing: Viewing, direction: Vec3) -> Radiance {
        let lobe = if self.is_specular() {
            self.gloss().value(viewing, direction, 0.0) as f32
        } else {
            0.0
        };
        let strength = self.strength();
        std::array::from_fn(|c| (self.diffuse[c] + strength[c] * lobe) / PI)
    }

    /// The part of the paths that the specular lobe sends on.
    pub fn specular_part(&self, viewing: Viewing) -> f32 {
        let diffuse = self.diffuse.iter().sum::<f32>();
        let specular = match self.coat {
            Some(_) => {
                let cosine = viewing.normal.dot(viewing.mirror).clamp(0.0, 1.0);
                CHANNELS as f32 * fresnel(cosine.into()) as f32
            }
            None => self.specular.iter().sum::<f32>(),
        };
        if specular > 0.0 { specular / (diffuse + specular) } else { 0.0 }
    }

    /// Density by solid angle with which the path tracer chooses a direction.
    pub fn density(&self, viewing: Viewing, direction: Vec3, cosine: f32) -> f32 {
        let part = self.specular_part(viewing);
        let mut density = (1.0 - part) * cosine / PI;
        if part > 0.0 {
            density += part
                * match self.coat {
                    Some(roughness) => Reflected::new(viewing, direction)
                        .map_or(0.0, |reflected| reflected.density(roughness.into()) as f32),
                    None => {
                        let along = viewing.mirror.dot(direction);
                        // 0⁰ is 1, and an exponent of 0 sends nothing below the mirror direction's
                        // horizon.
                        let lobe = if along > 0.0 { along.powf(self.exponent) } else { 0.0 };
                        (self.exponent + 1.0) / (2.0 * PI) * lobe
                    }
                };
        }
        density
    }

    /// A direction that the specular lobe sends light from, by a point of the unit square.
    pub fn sample_lobe(&self, viewing: Viewing, square: Vec2) -> Vec3 {
        let angle = 2.0 * PI * square.y;
        let about = |axis: Vec3, height: f32| {
            let across = (1.0 - height * height).max(0.0).sqrt();
            let local = Vec3::new(across * angle.cos(), across * angle.sin(), height);
            Frame::about(axis).to_world(local)
        };
        match self.coat {
            Some(roughness) => {
                // The half vector with density D cos θ: tan²θ = α² u/(1−u) (Walter et al. 2007).
                let tangent2 = roughness * roughness * square.x / (1.0 - square.x).max(1e-7);
                let half = about(viewing.normal, 1.0 / (1.0 + tangent2).sqrt());
                let towards = mirrored(viewing.mirror, viewing.normal);
                mirrored(towards, half)
            }
            None => about(viewing.mirror, square.x.powf(1.0 / (self.exponent + 1.0))),
        }
    }
}

/// How a surface of the capture is shaded.
#[derive(Clone, Copy, Debug)]
pub enum SurfaceLook<'a> {
    Reflects(BrdfF32),
    /// The same with the diffuse reflectance of a texture.
    Textured(BrdfF32, &'a Texture),
    /// A mirror with the part of the light that it reflects. Edits leave it as it is.
    Mirror(Radiance),
    /// Clear glass. Edits leave it as it is.
    Glass,
    /// Nothing is known but what the photographs show: it sends that, and reflects nothing.
    Photographed,
}

/// One per surface of the capture.
pub fn surface_looks<'a>(
    capture: &Capture,
    solved: &'a Solved,
    edits: &Edits,
) -> Vec<SurfaceLook<'a>> {
    let mean = mean(&solved.reflectances);
    let look = |(index, role): (usize, Role)| {
        let Role::Material(material) = role else { return SurfaceLook::Photographed };
        match solved.optics.get(material).copied().unwrap_or_default() {
            Optics::Mirror(reflected) => return SurfaceLook::Mirror(reflected),
            Optics::Glass => return SurfaceLook::Glass,
            Optics::Opaque => {}
        }
        let mut reflectance = solved.reflectances[material].unwrap_or(mean);
        let change = edits.materials.get(&capture.materials[material].name);
        if let Some(change) = change {
            reflectance.diffuse = change.diffuse.unwrap_or(reflectance.diffuse);
            if let (Some(roughness), true) =
                (reflectance.coat, change.specular.is_some() || change.exponent.is_some())
            {
                // A lobe of the artist's own takes the coat's place, as wide where they say nothing.
                reflectance.exponent = Gloss::Coat { roughness }.exponent();
                reflectance.coat = None;
            }
            reflectance.specular = change.specular.unwrap_or(reflectance.specular);
            reflectance.exponent = change.exponent.unwrap_or(reflectance.exponent);
            // Diffuse and specular reflectance add up to 1 at most: the one that was not changed is
            // lowered.
            let Brdf { diffuse, specular, .. } = &mut reflectance;
            for (diffuse, specular) in diffuse.iter_mut().zip(specular) {
                if change.diffuse.is_some() {
                    *specular = specular.min(1.0 - *diffuse);
                } else if change.specular.is_some() {
                    *diffuse = diffuse.min(1.0 - *specular);
                }
            }
        }
        let is_repainted = change.is_some_and(|change| change.diffuse.is_some());
        let texture = solved.textures.iter().find(|texture| texture.surface == index);
        let brdf = BrdfF32::from(&reflectance);
        match texture.filter(|_| !is_repainted) {
            Some(texture) => SurfaceLook::Textured(brdf, texture),
            None => SurfaceLook::Reflects(brdf),
        }
    };
    capture.surfaces.iter().map(|surface| surface.role).enumerate().map(look).collect()
}

/// The BRDF of surfaces that no photograph shows: the mean diffuse reflectance of the others.
fn mean(reflectances: &[Option<Brdf>]) -> Brdf {
    let mut sum = [0.0; CHANNELS];
    let mut count = 0.0f64;
    for reflectance in reflectances.iter().flatten() {
        for (sum, value) in sum.iter_mut().zip(reflectance.diffuse) {
            *sum += value;
        }
        count += 1.0;
    }
    Brdf::diffuse(sum.map(|sum| if count > 0.0 { sum / count } else { GREY }))
}
