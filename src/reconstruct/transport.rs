//! Section 5.1: light transport to each sample, from photographed surfaces and from each lobe.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use faer::Mat;
use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::spaced::Nearest;
use crate::math::rgb::{Radiance, Rgb};
use crate::math::sampling::{Random, grid_side};
use crate::options;
use crate::reconstruct::Stream;
use crate::reconstruct::bright::BrightCells;
use crate::reconstruct::hemisphere::{Gathered, Record, UnphotographedHit, hemisphere};
use crate::reconstruct::lights::{LightKind, VirtualLight, VirtualLights, VisibilityRays};
use crate::reconstruct::lobes::{Lobe, Lobes};
use crate::reconstruct::samples::{Sample, SampleCloud};
use crate::scene::{KnownLight, MaterialKind, SurfacePoint, Views};
use crate::watch::{Cancelled, Watch};

options! {
    /// How densely the light at each sample is sampled.
    TransportOptions in "transport" {
        /// Rays over the hemisphere of a diffuse sample that gather the light of photographed
        /// surfaces (Section 5.1).
        rays: usize = 400, Some((1.0, 1e6)), "";
        /// The same for samples of specular materials, whose rays are kept as radiance records.
        glossy_rays: usize = 900, Some((1.0, 1e6)), "";
        /// Jittered rays that find the visible fraction of a light's disc (Section 4.2).
        disc_rays: usize = 9, Some((1.0, 1e4)), "";
    }
}

/// Everything that is needed to compute a sample's radiance from reflectances and emissions.
/// Records and unphotographed hits take most of its memory, and are shared between clones.
#[derive(Clone, Debug)]
pub struct Transport {
    /// I_s per sample: irradiance from photographed surfaces, in the photographs' unit times sr.
    pub irradiance: Vec<Radiance>,
    /// The radiance records of all specular samples, one after the other.
    pub records: Arc<Vec<Record>>,
    /// Per sample the first of its records, and at the end their number; equal for diffuse ones.
    pub first_record: Vec<usize>,
    /// k_ij, samples × lobes: irradiance at the sample per unit of the lobe's emittance, in sr
    /// (Eq. 10 with 1/r²).
    pub coupling: Mat<f64>,
    /// Where rays from the samples met known surfaces that no photograph shows, sample by sample.
    pub unphotographed: Arc<Vec<UnphotographedHit>>,
    /// Per sample the first of these, and at the end their number.
    pub first_unphotographed: Vec<usize>,
    /// The radiosity of those surfaces; zero unless it was computed.
    pub patch_radiosity: PatchRadiosity,
    /// Cells of bright surfaces, at which additional rays are aimed.
    pub bright: Arc<BrightCells>,
}

/// The radiosity solution of known surfaces that no photograph shows. They are divided into patches
/// around points, each with one diffuse radiance. The default has no patches and therefore no
/// radiosity.
#[derive(Clone, Debug, Default)]
pub struct PatchRadiosity {
    /// Finds the patch of a position.
    nearest: Option<Nearest>,
    /// Per patch.
    pub(super) radiance: Vec<Radiance>,
}

impl PatchRadiosity {
    /// `radiance` has one entry for each point of `nearest`, in their order.
    pub fn new(nearest: Nearest, radiance: Vec<Radiance>) -> Self {
        Self { nearest: Some(nearest), radiance }
    }

    /// I_s plus the irradiance from the patches that the unphotographed hits lie on; unchanged
    /// where there are no patches.
    pub fn added_to(&self, irradiance: Radiance, unphotographed: &[UnphotographedHit]) -> Rgb {
        let mut sum = irradiance.map(f64::from);
        for record in self.records(unphotographed) {
            sum.iter_mut().zip(record.irradiance).for_each(|(sum, own)| *sum += f64::from(own));
        }
        sum
    }

    /// What arrives from unphotographed hits, by direction; nothing where there are no patches.
    pub fn records<'a>(
        &'a self,
        unphotographed: &'a [UnphotographedHit],
    ) -> impl Iterator<Item = Record> + 'a {
        self.nearest.iter().flat_map(move |nearest| {
            let radiance = |hit: &UnphotographedHit| self.radiance[nearest.to(hit.point.position)];
            unphotographed.iter().map(move |hit| hit.record(radiance(hit)))
        })
    }
}

impl Transport {
    /// The radiance records of one sample; none for a diffuse one.
    pub fn records_of(&self, sample: usize) -> &[Record] {
        &self.records[self.first_record[sample]..self.first_record[sample + 1]]
    }

    /// The hits of one sample on surfaces that no photograph shows.
    pub fn unphotographed_of(&self, sample: usize) -> &[UnphotographedHit] {
        &self.unphotographed
            [self.first_unphotographed[sample]..self.first_unphotographed[sample + 1]]
    }

    /// I_s of one sample and channel.
    pub fn irradiance(&self, sample: usize, channel: usize) -> f64 {
        f64::from(self.irradiance[sample][channel])
    }
}

/// Gathers the light of photographed surfaces and couples every lobe with every sample.
pub fn gather(
    views: &Views,
    cloud: &SampleCloud,
    lights: &VirtualLights,
    lobes: &Lobes,
    options: &TransportOptions,
    seed: u64,
    watch: &Watch,
) -> Result<Transport, Cancelled> {
    let mut transport = photographed(views, cloud, options, seed, watch)?;
    transport.coupling = couple(views, cloud, lights, lobes, options, seed, watch)?;
    Ok(transport)
}

/// Gathers the light of photographed surfaces; the coupling stays without columns.
pub fn photographed(
    views: &Views,
    cloud: &SampleCloud,
    options: &TransportOptions,
    seed: u64,
    watch: &Watch,
) -> Result<Transport, Cancelled> {
    let count = cloud.samples.len();
    watch.begin(count as u64);
    let bright = BrightCells::new(views);
    let glossy_side = grid_side(options.glossy_rays);
    let done = AtomicUsize::new(0);
    let gathered: Vec<Gathered> = cloud
        .samples
        .par_iter()
        .enumerate()
        .map(|(index, sample)| {
            watch.tick()?;
            views.count_point(&done);
            let mut random = Random::new(seed, Stream::Irradiance as u64, index as u64);
            let specular = views.capture.materials[sample.material].kind == MaterialKind::Specular;
            let side = if specular { glossy_side } else { grid_side(options.rays) };
            let mut gathered =
                hemisphere(views, &bright, sample.surface_point(), side, &mut random);
            if !specular {
                gathered.records = Vec::new();
            }
            Ok(gathered)
        })
        .collect::<Result<_, Cancelled>>()?;
    let (mut records, mut unphotographed) = (Vec::new(), Vec::new());
    let (mut first_record, mut first_unphotographed) = (vec![0], vec![0]);
    let mut irradiance = Vec::with_capacity(count);
    for own in gathered {
        irradiance.push(own.irradiance);
        records.extend(own.records);
        first_record.push(records.len());
        unphotographed.extend(own.unphotographed);
        first_unphotographed.push(unphotographed.len());
    }
    Ok(Transport {
        irradiance,
        records: records.into(),
        first_record,
        coupling: Mat::zeros(count, 0),
        unphotographed: unphotographed.into(),
        first_unphotographed,
        patch_radiosity: PatchRadiosity::default(),
        bright: bright.into(),
    })
}

/// Couples every lobe with every sample: k_ij, samples × lobes.
pub fn couple(
    views: &Views,
    cloud: &SampleCloud,
    lights: &VirtualLights,
    lobes: &Lobes,
    options: &TransportOptions,
    seed: u64,
    watch: &Watch,
) -> Result<Mat<f64>, Cancelled> {
    let all: Vec<usize> = (0..cloud.samples.len()).collect();
    let rows = couple_some(views, cloud, &all, (lights, lobes), options, seed, watch)?;
    Ok(Mat::from_fn(rows.len(), lobes.lobes.len(), |row, column| f64::from(rows[row][column])))
}

/// k_ij of some samples of the cloud, each with a value per lobe, in sr. A sample has the same
/// values whichever others it is coupled with.
pub(super) fn couple_some(
    views: &Views,
    cloud: &SampleCloud,
    samples: &[usize],
    (lights, lobes): (&VirtualLights, &Lobes),
    options: &TransportOptions,
    seed: u64,
    watch: &Watch,
) -> Result<Vec<Vec<f32>>, Cancelled> {
    watch.begin(samples.len() as u64);
    samples
        .par_iter()
        .map(|&index| {
            watch.tick()?;
            let random = Random::new(seed, Stream::Visibility as u64, index as u64);
            let sample = &cloud.samples[index];
            Ok(couple_sample(views, sample, lights, lobes, options, random))
        })
        .collect()
}

/// k_ij of one sample for every lobe.
fn couple_sample(
    views: &Views,
    sample: &Sample,
    lights: &VirtualLights,
    lobes: &Lobes,
    options: &TransportOptions,
    random: Random,
) -> Vec<f32> {
    let mut rays = VisibilityRays::new(grid_side(options.disc_rays), random);
    let mut row = vec![0.0f32; lobes.lobes.len()];
    for (index, light) in lights.lights.iter().enumerate() {
        let range = lobes.of(index);
        let (shapes, values) = (&lobes.lobes[range.clone()], &mut row[range]);
        arriving(views, light, shapes, sample.surface_point(), &mut rays, values);
    }
    row
}

/// k_ij of one light's lobes at a surface point.
pub fn arriving(
    views: &Views,
    light: &VirtualLight,
    lobes: &[Lobe],
    point: SurfacePoint,
    rays: &mut VisibilityRays,
    values: &mut [f32],
) {
    values.fill(0.0);
    if let LightKind::Known(known) = light.kind {
        if let KnownLight::Shape { emitter, .. } = &views.capture.lights[known] {
            values.fill(emitter.irradiance(views, point, rays.side, &mut rays.random));
        }
        return;
    }
    let Some(geometry) = geometric_factor(light, point) else { return };
    for (value, lobe) in values.iter_mut().zip(lobes) {
        *value = lobe.value(-geometry.direction) * geometry.factor;
    }
    // No ray is needed: no lobe of this light emits in this direction.
    if values.iter().all(|&value| value <= 1e-7 * geometry.factor) {
        values.fill(0.0);
        return;
    }
    let visible = light.visibility(views, point, rays);
    for value in values {
        *value *= visible;
    }
}

/// The part of Eq. 10 that a light's lobes share.
#[derive(Clone, Copy, Debug)]
pub struct LightGeometry {
    /// Unit direction from the surface point to the light, −ω_i.
    pub direction: Vec3,
    /// A_i cos θ_i / r².
    pub factor: f32,
}

/// A_i cos θ_i / r² for a light seen from a surface point; `None` below the surface point's
/// horizon.
pub fn geometric_factor(light: &VirtualLight, point: SurfacePoint) -> Option<LightGeometry> {
    if light.is_distant() {
        let cosine = -light.normal.dot(point.normal);
        let factor = match light.kind {
            // The emission of a sun is its irradiance already.
            LightKind::Sun => cosine,
            // Part of a cell may be above the horizon that its middle is below.
            _ => cosine.max(0.0) * light.solid_angle_sr(),
        };
        return (factor > 0.0).then_some(LightGeometry { direction: -light.normal, factor });
    }
    let offset = light.position - point.position;
    let distance = offset.length();
    let direction = offset / distance.max(f32::MIN_POSITIVE);
    let cosine = direction.dot(point.normal);
    if cosine <= 0.0 {
        return None;
    }
    // Eq. 10. The print of Eq. 3, 5 and 10 lacks 1/r², without which k is no irradiance and
    // reflectances come out 0.2 wrong. Within its own disc a light is no point any more; there 1/r²
    // is not let grow.
    let factor = light.area_m2() * cosine / distance.max(0.5 * light.radius_m).powi(2);
    Some(LightGeometry { direction, factor })
}
