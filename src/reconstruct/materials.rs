//! The reflectance of every material as it is written and shown.

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::Reconstruction;
use crate::reconstruct::solution::MaterialCertainty;
use crate::reconstruct::textures::mean_reflectance;
use crate::scene::{Brdf, Capture};

/// The reflectances and intervals of the solve, except for textured materials: they have the mean over
/// their texels, which is larger than the geometric mean that the solve finds.
#[derive(Clone, Debug, PartialEq)]
pub struct Materials {
    /// Per material of the capture; `None` where no photograph shows it.
    pub reflectances: Vec<Option<Brdf>>,
    /// Per material the intervals of its reflectance; empty where the method gives none.
    pub certainty: Vec<Option<MaterialCertainty>>,
}

impl Reconstruction {
    /// The reflectances to write and to show; `capture` is that of the reconstruction.
    pub fn materials(&self, capture: &Capture) -> Materials {
        let solution = &self.solution;
        let mut reflectances = solution.reflectances.clone();
        let certainty = solution.certainty.as_ref();
        let mut certainty =
            certainty.map_or_else(Vec::new, |certainty| certainty.materials.clone());
        for (index, brdf) in reflectances.iter_mut().enumerate() {
            let Some(brdf) = brdf else { continue };
            // What is known is what was given, not the mean of a texture made with it.
            let material = &capture.materials[index];
            if material.is_exactly_known() && solution.certainty.is_some() {
                continue;
            }
            let Some(mean) = mean_reflectance(&self.textures, index) else { continue };
            if let Some(certainty) = certainty.get_mut(index).and_then(Option::as_mut) {
                certainty.diffuse = about(certainty.diffuse, brdf.diffuse, mean);
            }
            brdf.diffuse = mean;
        }
        Materials { reflectances, certainty }
    }
}

/// Intervals about one value, moved to be about another.
fn about(
    intervals: [Option<[f64; 2]>; CHANNELS],
    before: Rgb,
    after: Rgb,
) -> [Option<[f64; 2]>; CHANNELS] {
    std::array::from_fn(|c| {
        let factor = if before[c] > 0.0 { after[c] / before[c] } else { 1.0 };
        intervals[c].map(|ends| ends.map(|end| (end * factor).min(1.0)))
    })
}
