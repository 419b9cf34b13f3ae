//! The light of known surfaces on the samples, in all and by direction.

use std::sync::Arc;

use crate::math::rgb::{Radiance, Rgb};
use crate::reconstruct::hemisphere::{Record, UnphotographedHit};
use crate::reconstruct::transport::Transport;

/// The light of known surfaces on the samples: of those that photographs show, and of those whose radiosity
/// is computed.
#[derive(Clone, Debug, Default)]
pub struct SurfaceLight {
    /// I_s per sample of the cloud, in the photographs' unit times sr.
    pub irradiance: Arc<Vec<Radiance>>,
    /// Per unphotographed hit of the transport the radiance of the patch that it lies on; empty before the
    /// radiosity is computed.
    pub patches: Arc<Vec<Radiance>>,
}

impl SurfaceLight {
    /// The light of photographed surfaces alone.
    pub fn photographed(transport: &Transport) -> Self {
        Self { irradiance: Arc::new(transport.irradiance.clone()), patches: Arc::default() }
    }

    /// The light on a specular sample by direction.
    pub fn records<'a>(
        &'a self,
        transport: &'a Transport,
        sample: usize,
    ) -> impl Iterator<Item = Record> + 'a {
        transport.records_of(sample).iter().copied().chain(self.of_patches(transport, sample))
    }

    /// The part of it that comes from unphotographed surfaces.
    pub fn of_patches<'a>(
        &'a self,
        transport: &'a Transport,
        sample: usize,
    ) -> impl Iterator<Item = Record> + 'a {
        self.hits(transport, sample).map(|(hit, radiance)| hit.record(radiance))
    }

    /// What photographs show of the irradiance of a sample, and the light of the patches.
    pub fn irradiance_on(&self, transport: &Transport, sample: usize) -> Rgb {
        let mut sum = transport.irradiance[sample].map(f64::from);
        for (hit, radiance) in self.hits(transport, sample) {
            for (sum, value) in sum.iter_mut().zip(radiance) {
                *sum += hit.projected_sr * f64::from(value);
            }
        }
        sum
    }

    /// The unphotographed hits of a sample, with their radiance.
    fn hits<'a>(
        &'a self,
        transport: &'a Transport,
        sample: usize,
    ) -> impl Iterator<Item = (&'a UnphotographedHit, Radiance)> + 'a {
        let first = transport.first_unphotographed[sample];
        let radiance = self.patches.get(first..).unwrap_or_default();
        transport.unphotographed_of(sample).iter().zip(radiance.iter().copied())
    }
}
