//! Section 4.2: virtual light sources, which stand for everything that was not modelled.

use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::spaced::select_spaced;
use crate::math::sampling::{
    Frame, Random, grid_side, square_to_disc, square_to_uniform_hemisphere, stratified,
};
use crate::options;
use crate::reconstruct::Stream;
use crate::reconstruct::samples::{SampleCloud, spacing_for};
use crate::scene::{Site, Views};
use crate::watch::{Cancelled, Watch};

options! {
    /// Where virtual lights are placed.
    LightOptions in "lights" {
        /// Rays sent from each sample to find places for virtual lights (Section 4.2).
        rays_per_sample: usize = 16, Some((1.0, 1e4)), "";
        /// Number of virtual lights aimed at when their spacing is chosen automatically.
        count: usize = 140, Some((1.0, 1e5)), "";
        /// Minimum distance between virtual lights (5 to 10 in Section 4.2); auto: chosen to
        /// reach the count, but at least 5.
        spacing_factor: Option<f64> = None, Some((0.1, 1e3)), "sample spacings";
        /// Radius of the bounding sphere that carries lights where no geometry is known,
        /// measured from the geometry's centre.
        radius_factor: f64 = 1.2, Some((1.0, 100.0)), "half-diagonals";
        /// Radius of a light's disc. The paper's print has 1; discs that overlap less fit
        /// better.
        disc_radius_factor: f64 = 0.5, Some((0.01, 10.0)), "light spacings";
    }
}

/// The virtual light sources, without their emissions.
#[derive(Clone, Debug, Default)]
pub struct VirtualLights {
    pub lights: Vec<VirtualLight>,
    /// Minimum distance between lights in metres.
    pub spacing_m: f32,
    pub sphere_center: Vec3,
    pub sphere_radius_m: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualLight {
    pub kind: LightKind,
    pub position: Vec3,
    /// Unit normal: into the bounding sphere, or the known surface's own.
    pub normal: Vec3,
    /// Radius of the disc that the light is taken to be.
    pub radius_m: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightKind {
    /// On the bounding sphere.
    Sphere,
    /// On a known surface that no photograph measures.
    Surface,
}

impl VirtualLight {
    /// A_i, the area of its disc in m².
    pub fn area_m2(&self) -> f32 {
        std::f32::consts::PI * self.radius_m * self.radius_m
    }

    /// V(x, A_i): the fraction of the disc that a site sees, by `side`² jittered rays.
    pub fn visibility(&self, views: &Views, site: Site, side: usize, random: &mut Random) -> f32 {
        let frame = Frame::about(self.normal);
        let mut free = 0;
        for square in stratified(side, random) {
            let disc = square_to_disc(square) * self.radius_m;
            let target = self.position + frame.tangent * disc.x + frame.bitangent * disc.y;
            // The part of a disc below a site's horizon is hidden by the site's own surface.
            let above = (target - site.position).dot(site.normal) > 0.0;
            free += usize::from(above && views.is_free(site, target));
        }
        free as f32 / (side * side) as f32
    }
}

/// Lights closer together than this many sample spacings illuminate the samples almost alike.
const SMALLEST_FACTOR: f32 = 5.0;

/// Places virtual lights where rays from the samples leave what is known.
pub fn place(
    views: &Views,
    cloud: &SampleCloud,
    options: &LightOptions,
    seed: u64,
    watch: &Watch,
) -> Result<VirtualLights, Cancelled> {
    let (low, high) = views.capture.mesh.bounds().unwrap_or_default();
    let sphere_center = 0.5 * (low + high);
    let sphere_radius_m = options.radius_factor as f32 * 0.5 * (high - low).length();
    let side = grid_side(options.rays_per_sample);

    watch.begin(cloud.samples.len() as u64);
    let found: Vec<Vec<VirtualLight>> = cloud
        .samples
        .par_iter()
        .enumerate()
        .map(|(index, sample)| {
            watch.tick()?;
            let mut random = Random::new(seed, Stream::Lights as u64, index as u64);
            let frame = Frame::about(sample.normal);
            let site = sample.site();
            let squares: Vec<_> = stratified(side, &mut random).collect();
            let place = |square| {
                let ray = views.ray(site, frame.to_world(square_to_uniform_hemisphere(square)));
                let (kind, position, normal) = match views.caster.closest(&ray) {
                    Some(hit) => {
                        let site = views.site(&ray, &hit);
                        if views.is_measured(site) {
                            return None;
                        }
                        (LightKind::Surface, site.position, site.normal)
                    }
                    None => {
                        let offset = ray.origin - sphere_center;
                        let along = offset.dot(ray.direction);
                        let beyond = along * along - offset.length_squared()
                            + sphere_radius_m * sphere_radius_m;
                        if beyond < 0.0 {
                            return None;
                        }
                        let position = ray.origin + ray.direction * (beyond.sqrt() - along);
                        let inward = (sphere_center - position).normalize_or_zero();
                        (LightKind::Sphere, position, inward)
                    }
                };
                Some(VirtualLight { kind, position, normal, radius_m: 0.0 })
            };
            Ok(squares.into_iter().filter_map(place).collect())
        })
        .collect::<Result<_, Cancelled>>()?;

    let candidates: Vec<VirtualLight> = found.into_iter().flatten().collect();
    // The rays of one sample come one after the other; in that order the first samples would
    // decide where all lights are.
    let mut order: Vec<u32> = (0..candidates.len() as u32).collect();
    Random::new(seed, Stream::Lights as u64, u64::MAX).shuffle(&mut order);
    let positions: Vec<Vec3> = candidates.iter().map(|light| light.position).collect();
    let spacing_m = match options.spacing_factor {
        Some(factor) => factor as f32 * cloud.spacing_m,
        None => spacing_for(&positions, &order, options.count, watch)?
            .max(SMALLEST_FACTOR * cloud.spacing_m),
    };
    let kept = select_spaced(&positions, &order, spacing_m, watch)?;
    let radius_m = options.disc_radius_factor as f32 * spacing_m;
    let light = |index: u32| VirtualLight { radius_m, ..candidates[index as usize] };
    Ok(VirtualLights {
        lights: kept.into_iter().map(light).collect(),
        spacing_m,
        sphere_center,
        sphere_radius_m,
    })
}
