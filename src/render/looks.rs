//! The BRDF of every surface of the capture, after the edits.

use crate::math::rgb::{CHANNELS, Radiance};
use crate::reconstruct::textures::Texture;
use crate::render::edits::{Edits, GREY};
use crate::render::scene::Solved;
use crate::scene::{Brdf, Capture, Gloss, Role};

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

/// How a surface of the capture is shaded.
#[derive(Clone, Copy, Debug)]
pub enum SurfaceLook<'a> {
    Reflects(BrdfF32),
    /// The same with the diffuse reflectance of a texture.
    Textured(BrdfF32, &'a Texture),
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
