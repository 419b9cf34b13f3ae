//! The recovered light in the form that prediction, textures, pictures and exports use.

use std::sync::Arc;

use crate::math::rgb::Rgb;
use crate::reconstruct::bright::BrightCells;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::solution::Solution;
use crate::reconstruct::transport::{PatchRadiosity, Transport};

/// The light that a reconstruction recovered: everything that lights the known surfaces besides what
/// the photographs show.
#[derive(Clone, Debug, Default)]
pub struct RecoveredLight {
    /// Where light comes from.
    pub lights: VirtualLights,
    /// The lobes of these lights, light by light.
    pub lobes: Lobes,
    /// E_ij per lobe and channel, in the photographs' unit of radiance.
    pub emission: Vec<Rgb>,
    /// The radiosity of known surfaces that no photograph shows; without patches where it was not
    /// computed.
    pub patch_radiosity: PatchRadiosity,
    /// Cells of bright surfaces, at which additional rays are aimed; without cells in a result that was
    /// read from a file.
    pub bright: Arc<BrightCells>,
}

impl RecoveredLight {
    /// The light among the products of a reconstruction.
    pub fn of(
        lights: &VirtualLights,
        lobes: &Lobes,
        transport: &Transport,
        solution: &Solution,
    ) -> Self {
        Self {
            lights: lights.clone(),
            lobes: lobes.clone(),
            emission: solution.emission.clone(),
            patch_radiosity: transport.patch_radiosity.clone(),
            bright: transport.bright.clone(),
        }
    }

    /// Whether any lobe of a light, by its index, has any emission.
    pub fn shines(&self, light: usize) -> bool {
        self.lobes.of(light).any(|lobe| self.emission[lobe].iter().any(|&e| e > 0.0))
    }
}
