//! The light at the texels of a surface (Eq. 14).

use std::f64::consts::PI;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::math::sampling::{Random, grid_side};
use crate::reconstruct::Stream;
use crate::reconstruct::hemisphere::{Gathered, hemisphere, incoming};
use crate::reconstruct::lights::VisibilityRays;
use crate::reconstruct::options::Options;
use crate::reconstruct::recovered::RecoveredLight;
use crate::reconstruct::textures::cells::{Grid, Sum};
use crate::reconstruct::textures::{Place, TextureOptions};
use crate::reconstruct::transport::arriving;
use crate::scene::{Gloss, Incoming, SurfacePoint, Viewing, Views};
use crate::watch::{Cancelled, Watch};

/// The light at texels: the recovered lights and the light from photographed surfaces.
pub(in crate::reconstruct) struct Light<'a> {
    recovered: &'a RecoveredLight,
    /// Indices of the lights with any emission.
    lit: Vec<usize>,
    seed: u64,
}

impl<'a> Light<'a> {
    /// The seed is that of `options`.
    pub(in crate::reconstruct) fn new(recovered: &'a RecoveredLight, options: &Options) -> Self {
        let lights = 0..recovered.lights.lights.len();
        let lit = lights.filter(|&light| recovered.shines(light)).collect();
        Self { recovered, lit, seed: options.general.seed as u64 }
    }

    /// Random numbers for one texel: the same for all, so that what the few rays miss changes
    /// smoothly over the surface instead of turning up as grain in the texture.
    fn random(&self) -> Random {
        Random::new(self.seed, Stream::Textures as u64, 0)
    }

    /// I_s of Eq. 14 at a surface point.
    fn photographed(&self, views: &Views, point: SurfacePoint, options: &TextureOptions) -> Rgb {
        let side = grid_side(options.rays);
        let gathered = hemisphere(views, &self.recovered.bright, point, side, &mut self.random());
        self.recovered.patch_radiosity.added_to(gathered.irradiance, &gathered.unphotographed)
    }

    /// G of Eq. 14 at one surface point.
    pub(in crate::reconstruct) fn at(
        &self,
        views: &Views,
        point: SurfacePoint,
        options: &TextureOptions,
    ) -> Rgb {
        let photographed = self.photographed(views, point, options);
        let direct = self.lights_apart(views, point, options);
        std::array::from_fn(|c| {
            photographed[c] + direct.iter().map(|(_, irradiance)| irradiance[c]).sum::<f64>()
        })
    }

    /// G of Eq. 14 at every placed texel.
    pub(super) fn irradiance(
        &self,
        views: &Views,
        grid: Grid,
        options: &TextureOptions,
        watch: &Watch,
    ) -> Result<Vec<Option<Rgb>>, Cancelled> {
        let places = grid.places;
        let direct = grid.map(&Direct { light: self, views, places, options }, watch)?;
        // Light from photographed surfaces comes from all around and is the smoother part: where
        // its changes are small against the whole, or finer than its rays resolve, they are
        // interpolated.
        let indirect = Indirect { light: self, views, places, options, direct: &direct };
        let indirect = Grid { finest: grid.stride / 2, ..grid }.map(&indirect, watch)?;
        let sum = |(a, b): (Option<Rgb>, Option<Rgb>)| {
            a.zip(b).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c]))
        };
        Ok(direct.into_iter().zip(indirect).map(sum).collect())
    }

    /// Irradiance from one light.
    fn of_light(
        &self,
        views: &Views,
        point: SurfacePoint,
        light: usize,
        options: &TextureOptions,
    ) -> Rgb {
        let range = self.recovered.lobes.of(light);
        let mut values = vec![0.0f32; range.len()];
        arriving(
            views,
            &self.recovered.lights.lights[light],
            &self.recovered.lobes.lobes[range.clone()],
            point,
            &mut VisibilityRays::new(grid_side(options.disc_rays), self.random()),
            &mut values,
        );
        let mut irradiance = [0.0; CHANNELS];
        for (&value, emission) in values.iter().zip(&self.recovered.emission[range]) {
            for (sum, emission) in irradiance.iter_mut().zip(emission) {
                *sum += emission * f64::from(value);
            }
        }
        irradiance
    }

    /// Irradiance from each lit light above the horizon, with the light's index.
    fn lights_apart(
        &self,
        views: &Views,
        point: SurfacePoint,
        options: &TextureOptions,
    ) -> Vec<(usize, Rgb)> {
        let lights = self.lit.iter();
        lights
            .map(|&light| (light, self.of_light(views, point, light, options)))
            .filter(|(_, irradiance)| *irradiance != [0.0; CHANNELS])
            .collect()
    }

    /// The light at a surface point by direction, for a specular lobe.
    pub(super) fn incident(
        &self,
        views: &Views,
        point: SurfacePoint,
        options: &TextureOptions,
    ) -> Incident {
        let side = grid_side(options.rays);
        let bright = &self.recovered.bright;
        let Gathered { records, unphotographed, .. } =
            hemisphere(views, bright, point, side, &mut self.random());
        let reflected = self.recovered.patch_radiosity.records(&unphotographed);
        let records = records.into_iter().chain(reflected);
        let surfaces = incoming(records);
        let single = |rgb: Rgb| rgb.map(|value| value as f32);
        let lights = self.lights_apart(views, point, options).into_iter();
        Incident { surfaces, lights: lights.map(|(light, rgb)| (light, single(rgb))).collect() }
    }

    /// Radiance that a specular lobe of a strength per channel reflects from a surface point.
    pub(super) fn reflected(
        &self,
        incident: &Incident,
        point: SurfacePoint,
        viewing: Viewing,
        (gloss, strength): (Gloss, Rgb),
    ) -> Rgb {
        let lights = incident.lights.iter().map(|(index, irradiance)| {
            let light = &self.recovered.lights.lights[*index];
            (light.direction_from(point.position), light.angle_from(point.position), *irradiance)
        });
        let lights = Incoming::new(lights).reflected(viewing, gloss);
        let surfaces = incident.surfaces.reflected(viewing, gloss);
        std::array::from_fn(|c| strength[c] * (surfaces[c] + lights[c]) / PI)
    }
}

/// The light at a surface point by direction.
pub(super) struct Incident {
    /// Of known surfaces.
    surfaces: Incoming,
    /// Irradiance from each light, with its index.
    lights: Vec<(usize, Radiance)>,
}

/// The irradiance at texels from each lit light.
struct Direct<'a> {
    light: &'a Light<'a>,
    views: &'a Views<'a>,
    places: &'a [Option<Place>],
    options: &'a TextureOptions,
}

impl Sum for Direct<'_> {
    fn parts(&self) -> usize {
        self.light.lit.len()
    }

    fn compute(&self, texel: usize, parts: &[usize], values: &mut [Radiance]) {
        let Some(place) = &self.places[texel] else { return };
        for &part in parts {
            let light = self.light.lit[part];
            let irradiance = self.light.of_light(self.views, place.point, light, self.options);
            values[part] = irradiance.map(|value| value as f32);
        }
    }
}

/// The irradiance at texels from photographed surfaces, as one part.
struct Indirect<'a> {
    light: &'a Light<'a>,
    views: &'a Views<'a>,
    places: &'a [Option<Place>],
    options: &'a TextureOptions,
    direct: &'a [Option<Rgb>],
}

impl Sum for Indirect<'_> {
    fn parts(&self) -> usize {
        1
    }

    fn compute(&self, texel: usize, _: &[usize], values: &mut [Radiance]) {
        let Some(place) = &self.places[texel] else { return };
        let irradiance = self.light.photographed(self.views, place.point, self.options);
        values[0] = irradiance.map(|value| value as f32);
    }

    fn base(&self, texel: usize) -> Rgb {
        self.direct[texel].unwrap_or_default()
    }
}
