//! The light at the texels of a surface (Eq. 14), computed where it changes and interpolated
//! where it does not.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::math::sampling::{Random, grid_side};
use crate::reconstruct::Stream;
use crate::reconstruct::bright::BrightCells;
use crate::reconstruct::hemisphere::{Record, hemisphere};
use crate::reconstruct::options::Options;
use crate::reconstruct::recovered::RecoveredLight;
use crate::reconstruct::textures::{Place, TextureOptions};
use crate::reconstruct::transport::arriving;
use crate::scene::{Gloss, SurfacePoint, Viewing, Views};
use crate::watch::{Cancelled, Watch};

/// Neighbouring irradiances that differ by less than this are interpolated between: more than
/// the noise of the few rays, less than the shadows that would be seen in a texture.
const SMOOTH: f64 = 0.1;

/// The light at texels: what was recovered, with what is gathered from the photographs.
pub(in crate::reconstruct) struct Light<'a> {
    recovered: &'a RecoveredLight,
    /// Indices of the lights with any emission.
    lit: Vec<usize>,
    seed: u64,
    bright: BrightCells,
}

impl<'a> Light<'a> {
    /// The seed is that of `options`.
    pub(in crate::reconstruct) fn new(
        views: &Views,
        recovered: &'a RecoveredLight,
        options: &Options,
    ) -> Self {
        let lights = 0..recovered.lights.lights.len();
        let lit = lights.filter(|&light| recovered.shines(light)).collect();
        let bright = BrightCells::new(views);
        Self { recovered, lit, seed: options.general.seed as u64, bright }
    }

    /// Random numbers for one texel: the same for all, so that what the few rays miss changes
    /// smoothly over the surface instead of turning up as grain in the texture.
    fn random(&self) -> Random {
        Random::new(self.seed, Stream::Textures as u64, 0)
    }

    /// I_s of Eq. 14 at a surface point.
    fn photographed(&self, views: &Views, point: SurfacePoint, options: &TextureOptions) -> Rgb {
        let side = grid_side(options.rays);
        let gathered = hemisphere(views, &self.bright, point, side, &mut self.random());
        self.recovered.patch_radiosity.added_to(gathered.irradiance, &gathered.unphotographed)
    }

    /// The virtual lights' part of Eq. 14 at a surface point.
    fn virtual_lights(&self, views: &Views, point: SurfacePoint, options: &TextureOptions) -> Rgb {
        let mut total = [0.0; CHANNELS];
        for (_, irradiance) in self.lights_apart(views, point, options) {
            for (total, value) in total.iter_mut().zip(irradiance) {
                *total += value;
            }
        }
        total
    }

    /// G of Eq. 14 at one surface point.
    pub(in crate::reconstruct) fn at(
        &self,
        views: &Views,
        point: SurfacePoint,
        options: &TextureOptions,
    ) -> Rgb {
        let photographed = self.photographed(views, point, options);
        let direct = self.virtual_lights(views, point, options);
        std::array::from_fn(|c| photographed[c] + direct[c])
    }

    /// G of Eq. 14 at every placed texel.
    pub(super) fn irradiance(
        &self,
        views: &Views,
        places: &[Option<Place>],
        width: usize,
        options: &TextureOptions,
        watch: &Watch,
    ) -> Result<Vec<Option<Rgb>>, Cancelled> {
        let direct = |point| self.virtual_lights(views, point, options);
        let grid = Grid { places, width, stride: options.stride, finest: 1 };
        let direct = map(grid, None, direct, watch)?;
        // Light from photographed surfaces comes from all around and is the smoother part: where
        // its changes are small against the whole, or finer than its rays resolve, they are
        // interpolated.
        let indirect = |point| self.photographed(views, point, options);
        let grid = Grid { finest: options.stride / 2, ..grid };
        let indirect = map(grid, Some(&direct), indirect, watch)?;
        let sum = |(a, b): (Option<Rgb>, Option<Rgb>)| {
            a.zip(b).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c]))
        };
        Ok(direct.into_iter().zip(indirect).map(sum).collect())
    }

    /// Irradiance from each lit light above the horizon, with the light's index.
    fn lights_apart(
        &self,
        views: &Views,
        point: SurfacePoint,
        options: &TextureOptions,
    ) -> Vec<(usize, Rgb)> {
        let side = grid_side(options.disc_rays);
        let mut found = Vec::new();
        for &index in &self.lit {
            let light = &self.recovered.lights.lights[index];
            let range = self.recovered.lobes.of(index);
            let mut values = vec![0.0f32; range.len()];
            arriving(
                views,
                light,
                &self.recovered.lobes.lobes[range.clone()],
                point,
                side,
                &mut self.random(),
                &mut values,
            );
            let mut irradiance = [0.0; CHANNELS];
            for (&value, emission) in values.iter().zip(&self.recovered.emission[range]) {
                for (sum, emission) in irradiance.iter_mut().zip(emission) {
                    *sum += emission * f64::from(value);
                }
            }
            if irradiance != [0.0; CHANNELS] {
                found.push((index, irradiance));
            }
        }
        found
    }

    /// The light at a surface point by direction, for a specular lobe.
    pub(super) fn incident(
        &self,
        views: &Views,
        point: SurfacePoint,
        options: &TextureOptions,
    ) -> Incident {
        let side = grid_side(options.rays);
        let records = hemisphere(views, &self.bright, point, side, &mut self.random()).records;
        let lights = self.lights_apart(views, point, options);
        Incident { records, lights }
    }

    /// Radiance that a specular lobe of a strength per channel reflects from a surface point.
    pub(super) fn reflected(
        &self,
        incident: &Incident,
        point: SurfacePoint,
        viewing: Viewing,
        (gloss, strength): (Gloss, Rgb),
    ) -> Rgb {
        let mut total = [0.0; CHANNELS];
        for record in &incident.records {
            let factor = gloss.value(viewing, record.direction, 0.0);
            for (total, irradiance) in total.iter_mut().zip(record.irradiance) {
                *total += factor * f64::from(irradiance);
            }
        }
        for (index, irradiance) in &incident.lights {
            let light = &self.recovered.lights.lights[*index];
            let factor = light.lobe(point.position, viewing, gloss);
            for (total, irradiance) in total.iter_mut().zip(irradiance) {
                *total += factor * irradiance;
            }
        }
        std::array::from_fn(|c| strength[c] * total[c] / PI)
    }
}

/// The light at a surface point by direction.
pub(super) struct Incident {
    records: Vec<Record>,
    /// Irradiance from each light, with its index.
    lights: Vec<(usize, Rgb)>,
}

/// The texels over which irradiance is mapped.
#[derive(Clone, Copy)]
struct Grid<'a> {
    places: &'a [Option<Place>],
    width: usize,
    /// Side of the largest cells, in texels.
    stride: usize,
    /// Cells of this side or less are interpolated however their corners differ.
    finest: usize,
}

/// Irradiance at every placed texel: at the corners of square cells, and at every texel of
/// the cells over which it changes or whose corners lie elsewhere. Changes are judged against
/// its sum with `base`.
fn map(
    grid: Grid,
    base: Option<&[Option<Rgb>]>,
    evaluate: impl Fn(SurfacePoint) -> Rgb + Sync,
    watch: &Watch,
) -> Result<Vec<Option<Rgb>>, Cancelled> {
    let Grid { places, width, stride, finest } = grid;
    let mut known: Vec<Option<Rgb>> = vec![None; places.len()];
    let height = places.len() / width.max(1);
    // Halving must end at 1 with all cells aligned.
    let mut stride = stride.next_power_of_two();
    let mut wanted: Vec<usize> = (0..places.len())
        .filter(|i| (i % width) % stride == 0 && (i / width) % stride == 0)
        .collect();
    loop {
        wanted.retain(|&index| places[index].is_some() && known[index].is_none());
        let computed: Vec<Rgb> = wanted
            .par_iter()
            .map(|&index| {
                watch.tick()?;
                let point = places[index].map(|place| place.point);
                Ok(point.map_or([0.0; CHANNELS], &evaluate))
            })
            .collect::<Result<_, Cancelled>>()?;
        for (&index, irradiance) in wanted.iter().zip(computed) {
            known[index] = Some(irradiance);
        }
        if stride == 1 {
            return Ok(known);
        }
        wanted.clear();
        let finer = stride / 2;
        for y in (0..height).step_by(stride) {
            for x in (0..width).step_by(stride) {
                let corners = [(x, y), (x + stride, y), (x, y + stride), (x + stride, y + stride)]
                    .map(|(u, v)| (u < width && v < height).then(|| v * width + u));
                // A cell that a coarser one has interpolated is complete already.
                let cell = |step: usize| {
                    (y..(y + stride).min(height)).step_by(step).flat_map(move |v| {
                        (x..(x + stride).min(width)).step_by(step).map(move |u| v * width + u)
                    })
                };
                match smooth(places, &known, base, corners, stride <= finest) {
                    Some(values) => {
                        for index in cell(1) {
                            if places[index].is_some() && known[index].is_none() {
                                let s = ((index % width) - x) as f64 / stride as f64;
                                let t = ((index / width) - y) as f64 / stride as f64;
                                known[index] = Some(bilinear(values, s, t));
                                watch.tick()?;
                            }
                        }
                    }
                    None => wanted.extend(cell(finer)),
                }
            }
        }
        stride = finer;
    }
}

/// The corners' irradiances if they lie on one polygon and hardly differ, or whatever they are.
fn smooth(
    places: &[Option<Place>],
    known: &[Option<Rgb>],
    base: Option<&[Option<Rgb>]>,
    corners: [Option<usize>; 4],
    whatever_they_are: bool,
) -> Option<[Rgb; 4]> {
    let mut values = [[0.0; CHANNELS]; 4];
    let mut whole = [0.0f64; CHANNELS];
    let mut polygon = None;
    for (value, corner) in values.iter_mut().zip(corners) {
        let index = corner?;
        let place = places[index].as_ref()?;
        if *polygon.get_or_insert(place.polygon) != place.polygon {
            return None;
        }
        *value = known[index]?;
        let base = base.and_then(|base| base[index]).unwrap_or_default();
        for c in 0..CHANNELS {
            whole[c] = whole[c].max(value[c] + base[c]);
        }
    }
    let alike = (0..CHANNELS).all(|c| {
        let low = values.iter().map(|v| v[c]).fold(f64::INFINITY, f64::min);
        let high = values.iter().map(|v| v[c]).fold(0.0, f64::max);
        high - low <= SMOOTH * whole[c]
    });
    (alike || whatever_they_are).then_some(values)
}

fn bilinear(values: [Rgb; 4], s: f64, t: f64) -> Rgb {
    std::array::from_fn(|c| {
        let top = values[0][c] * (1.0 - s) + values[1][c] * s;
        let bottom = values[2][c] * (1.0 - s) + values[3][c] * s;
        top * (1.0 - t) + bottom * t
    })
}
