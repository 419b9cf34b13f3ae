//! Section 5.5: a map of diffuse reflectance for every textured surface, by Eq. 13 per texel.
//!
//! Textures are reconstructed once, after the refinement has converged, so that gradients of
//! the light are not taken for texture.

use std::collections::VecDeque;
use std::f64::consts::PI;

use glam::Vec2;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::math::sampling::{Random, grid_side};
use crate::options;
use crate::reconstruct::equations::Reflectance;
use crate::reconstruct::lights::{VirtualLights, disc_grid_side};
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::options::Options;
use crate::reconstruct::refine::Solution;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::transport::{Record, geometric_factor, hemisphere};
use crate::reconstruct::unwrap::{TexelSize, Unwrap, unwrap};
use crate::reconstruct::{Error, Stream};
use crate::scene::{Role, Site, Views};
use crate::watch::{Cancelled, Watch};

options! {
    /// The texture maps of textured materials.
    TextureOptions in "textures" {
        /// Reconstruct textures at all (Section 5.5).
        enabled: bool = true, None, "";
        /// Size of a texel, as a multiple of the surface that a pixel of the nearest photograph
        /// covers.
        texel_px: f64 = 1.0, Some((0.1, 100.0)), "px";
        /// Texels along a texture's side at most.
        max_side: usize = 1024, Some((4.0, 16384.0)), "texels";
        /// Irradiance is computed at every so many texels, and between them only where it
        /// changes quickly.
        stride: usize = 8, Some((1.0, 64.0)), "texels";
        /// Rays that gather the light of photographed surfaces where irradiance is computed.
        rays: usize = 196, Some((1.0, 1e5)), "";
        /// Rays over a light's disc there.
        disc_rays: usize = 4, Some((1.0, 1e4)), "";
    }
}

/// The diffuse reflectance of one surface as a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    pub surface: usize,
    pub material: usize,
    pub unwrap: Unwrap,
    /// Diffuse reflectance, row by row from the top (v = 1); texels that no photograph
    /// measures are filled from their neighbours.
    pub texels: Vec<Radiance>,
    /// The texel was measured.
    pub seen: Vec<bool>,
}

/// Where a texel's centre lies on the surface.
#[derive(Clone, Copy, Debug)]
struct Place {
    polygon: u32,
    site: Site,
}

/// Neighbouring irradiances that differ by less than this are interpolated between: more than
/// the noise of the few rays, less than the shadows that would be seen in a texture.
const SMOOTH: f64 = 0.1;

/// Reconstructs the textures of all textured materials that have samples.
#[expect(clippy::too_many_arguments, reason = "every product of the stages before is needed")]
pub fn reconstruct(
    views: &Views,
    cloud: &SampleCloud,
    lights: &VirtualLights,
    lobes: &Lobes,
    solution: &Solution,
    options: &Options,
    seed: u64,
    watch: &Watch,
) -> Result<Vec<Texture>, Error> {
    let capture = views.capture;
    let mut textures = Vec::new();
    if !options.textures.enabled {
        return Ok(textures);
    }
    let light = Light::new(lights, lobes, solution, options, seed);
    for (surface, tagged) in capture.surfaces.iter().enumerate() {
        let Role::Material(material) = tagged.role else { continue };
        let Some(reflectance) = &solution.reflectances[material] else { continue };
        let Some(footprint) = footprint(views, cloud, surface) else { continue };
        if !capture.materials[material].textured {
            continue;
        }
        let size = TexelSize {
            texel_m: footprint * options.textures.texel_px as f32,
            max_side: options.textures.max_side,
        };
        let unwrap = unwrap(&capture.mesh, surface, tagged.has_texcoords, size);
        let places = rasterize(views, &unwrap);
        watch.begin(2 * places.len() as u64);
        let irradiance =
            light.irradiance(views, &places, unwrap.width, &options.textures, watch)?;
        let estimated: Vec<Option<Radiance>> = places
            .par_iter()
            .zip(&irradiance)
            .map(|(place, irradiance)| {
                watch.check()?;
                let (Some(place), Some(irradiance)) = (place, irradiance) else {
                    return Ok(None);
                };
                Ok(light.texel(views, place.site, *irradiance, reflectance, &options.textures))
            })
            .collect::<Result<_, Cancelled>>()?;
        let seen: Vec<bool> = estimated.iter().map(Option::is_some).collect();
        let fallback = reflectance.diffuse.map(|value| value as f32);
        let texels = fill(estimated, unwrap.width, fallback);
        textures.push(Texture { surface, material, unwrap, texels, seen });
    }
    Ok(textures)
}

/// Mean over the measured texels of a material's textures; `None` where it has none.
pub fn mean_reflectance(textures: &[Texture], material: usize) -> Option<Rgb> {
    let (mut sum, mut count) = ([0.0; CHANNELS], 0usize);
    for texture in textures.iter().filter(|texture| texture.material == material) {
        for (texel, _) in texture.texels.iter().zip(&texture.seen).filter(|(_, seen)| **seen) {
            for (sum, value) in sum.iter_mut().zip(texel) {
                *sum += f64::from(*value);
            }
            count += 1;
        }
    }
    (count > 0).then(|| sum.map(|value| value / count as f64))
}

/// The length on the surface that one pixel of the nearest photograph covers: the median over
/// the surface's samples, in metres.
fn footprint(views: &Views, cloud: &SampleCloud, surface: usize) -> Option<f32> {
    let capture = views.capture;
    let mut footprints: Vec<f32> = cloud
        .samples
        .iter()
        .filter(|sample| sample.surface == surface)
        .map(|sample| {
            cloud.views[sample.views.clone()]
                .iter()
                .map(|view| {
                    let camera = &capture.photographs[view.photograph].camera;
                    let distance = camera.position.as_vec3().distance(sample.position);
                    distance / camera.focal_px.min_element() as f32
                })
                .fold(f32::INFINITY, f32::min)
        })
        .collect();
    footprints.sort_unstable_by(f32::total_cmp);
    footprints.get(footprints.len() / 2).copied()
}

/// The place of every texel's centre; the first triangle that covers a texel has it, unless
/// that place is seen by no photograph and a later one is.
fn rasterize(views: &Views, unwrap: &Unwrap) -> Vec<Option<Place>> {
    let mesh = &views.capture.mesh;
    let size = Vec2::new(unwrap.width as f32, unwrap.height as f32);
    let mut places: Vec<Option<Place>> = vec![None; unwrap.width * unwrap.height];
    for (&triangle, corners) in unwrap.triangles.iter().zip(&unwrap.corners) {
        // Texel coordinates, rows from the top.
        let [a, b, c] = corners.map(|uv| Vec2::new(uv.x, 1.0 - uv.y) * size);
        let doubled = (b - a).perp_dot(c - a);
        if doubled.abs() < 1e-12 {
            continue;
        }
        let low = a.min(b).min(c).floor().max(Vec2::ZERO);
        let high = a.max(b).max(c).ceil().min(size);
        let positions = mesh.corners(triangle);
        let normal = views.normals[triangle];
        for y in low.y as usize..high.y as usize {
            for x in low.x as usize..high.x as usize {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let v = (p - a).perp_dot(c - a) / doubled;
                let w = (b - a).perp_dot(p - a) / doubled;
                // A texel on the edge between two triangles belongs to both.
                if v < -1e-4 || w < -1e-4 || v + w > 1.0002 {
                    continue;
                }
                let position = positions[0] * (1.0 - v - w) + positions[1] * v + positions[2] * w;
                let place = &mut places[y * unwrap.width + x];
                let polygon = mesh.polygon[triangle];
                match place {
                    None => {
                        let site = visible_side(views, Site { position, normal });
                        *place = Some(Place { polygon, site });
                    }
                    Some(other) if other.polygon != polygon => {
                        let site = visible_side(views, Site { position, normal });
                        if !views.is_measured(other.site) && views.is_measured(site) {
                            *place = Some(Place { polygon, site });
                        }
                    }
                    Some(_) => {}
                }
            }
        }
    }
    places
}

/// The side of a surface that is photographed: the outer one, unless only the inner one is.
fn visible_side(views: &Views, outer: Site) -> Site {
    let inner = Site { normal: -outer.normal, ..outer };
    if !views.is_measured(outer) && views.is_measured(inner) { inner } else { outer }
}

/// Everything that lights a texel.
struct Light<'a> {
    lights: &'a VirtualLights,
    lobes: &'a Lobes,
    emission: &'a [Rgb],
    /// The lights with any emission.
    lit: Vec<usize>,
    options: &'a Options,
    seed: u64,
}

impl<'a> Light<'a> {
    fn new(
        lights: &'a VirtualLights,
        lobes: &'a Lobes,
        solution: &'a Solution,
        options: &'a Options,
        seed: u64,
    ) -> Self {
        let is_lit = |light: &usize| {
            lobes.of(*light).any(|lobe| solution.emission[lobe].iter().any(|&e| e > 0.0))
        };
        let lit = (0..lights.lights.len()).filter(is_lit).collect();
        Self { lights, lobes, emission: &solution.emission, lit, options, seed }
    }

    /// Random numbers for one texel: the same for all, so that what the few rays miss changes
    /// smoothly over the surface instead of turning up as grain in the texture.
    fn random(&self) -> Random {
        Random::new(self.seed, Stream::Textures as u64, 0)
    }

    /// I_s of Eq. 14 at a site.
    fn photographed(&self, views: &Views, site: Site, options: &TextureOptions) -> Rgb {
        let side = grid_side(options.rays);
        hemisphere(views, site, side, &mut self.random()).0.map(f64::from)
    }

    /// The virtual lights' part of Eq. 14 at a site.
    fn virtual_lights(&self, views: &Views, site: Site, options: &TextureOptions) -> Rgb {
        let mut total = [0.0; CHANNELS];
        for (_, irradiance) in self.from_lights(views, site, options) {
            for (total, value) in total.iter_mut().zip(irradiance) {
                *total += value;
            }
        }
        total
    }

    /// G of Eq. 14 at every placed texel.
    fn irradiance(
        &self,
        views: &Views,
        places: &[Option<Place>],
        width: usize,
        options: &TextureOptions,
        watch: &Watch,
    ) -> Result<Vec<Option<Rgb>>, Cancelled> {
        let direct = |site| self.virtual_lights(views, site, options);
        let grid = Grid { places, width, stride: options.stride, finest: 1 };
        let direct = map(grid, None, direct, watch)?;
        // Light from photographed surfaces comes from all around and is the smoother part: where
        // its changes are small against the whole, or finer than its rays resolve, they are
        // interpolated.
        let indirect = |site| self.photographed(views, site, options);
        let grid = Grid { finest: options.stride / 2, ..grid };
        let indirect = map(grid, Some(&direct), indirect, watch)?;
        let sum = |(a, b): (Option<Rgb>, Option<Rgb>)| {
            a.zip(b).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c]))
        };
        Ok(direct.into_iter().zip(indirect).map(sum).collect())
    }

    /// Irradiance from each lit light above the horizon, with the light's index.
    fn from_lights(
        &self,
        views: &Views,
        site: Site,
        options: &TextureOptions,
    ) -> Vec<(usize, Rgb)> {
        let side = disc_grid_side(options.disc_rays);
        let mut found = Vec::new();
        for &index in &self.lit {
            let light = &self.lights.lights[index];
            let falloff = self.options.transport.falloff;
            let Some(geometry) = geometric_factor(light, site, falloff) else { continue };
            let mut irradiance = [0.0; CHANNELS];
            for lobe in self.lobes.of(index) {
                let value = f64::from(self.lobes.lobes[lobe].value(-geometry.direction));
                for (sum, emission) in irradiance.iter_mut().zip(self.emission[lobe]) {
                    *sum += emission * value * f64::from(geometry.factor);
                }
            }
            if irradiance == [0.0; CHANNELS] {
                continue;
            }
            let visible = f64::from(light.visibility(views, site, side, &mut self.random()));
            if visible > 0.0 {
                found.push((index, irradiance.map(|value| value * visible)));
            }
        }
        found
    }

    /// Eq. 13 for one texel; `None` where no photograph measures it.
    fn texel(
        &self,
        views: &Views,
        site: Site,
        irradiance: Rgb,
        reflectance: &Reflectance,
        options: &TextureOptions,
    ) -> Option<Radiance> {
        let is_specular = reflectance.specular.iter().any(|&s| s > 0.0);
        let incident = is_specular.then(|| {
            let side = grid_side(options.rays);
            let (_, records) = hemisphere(views, site, side, &mut self.random());
            (records, PI / (side * side) as f64, self.from_lights(views, site, options))
        });
        let (mut sum, mut weights) = ([0.0; CHANNELS], 0.0);
        for map in &views.maps {
            let Some(seen) = views.seen(map, site) else { continue };
            let Some(radiance) = map.image.radiance(seen.x, seen.y) else { continue };
            // A photograph counts by the number of its pixels that show the texel.
            let distance = map.camera.position.as_vec3().distance(site.position);
            let weight = f64::from(seen.cosine / (distance * distance).max(1e-12));
            // Beside an edge a pixel shows another surface too: used where there is no other.
            let weight = if map.is_off_edges(seen.x, seen.y) { weight } else { 1e-3 * weight };
            let mut specular = [0.0; CHANNELS];
            if let Some((records, record_weight, lights)) = &incident {
                let mirror = 2.0 * site.normal.dot(seen.direction) * site.normal - seen.direction;
                specular =
                    self.lobe_light(site, mirror, records, *record_weight, lights, reflectance);
            }
            for c in 0..CHANNELS {
                let diffuse = f64::from(radiance[c]) - reflectance.lobe_scale(c) * specular[c];
                sum[c] += weight * diffuse;
            }
            weights += weight;
        }
        if weights <= 0.0 {
            return None;
        }
        let mut texel = [0.0f32; CHANNELS];
        for c in 0..CHANNELS {
            // Without light a texel's reflectance cannot be told.
            if irradiance[c] <= 0.0 {
                return None;
            }
            texel[c] = (PI * sum[c] / weights / irradiance[c]).clamp(0.0, 1.0) as f32;
        }
        Some(texel)
    }

    /// ∫ L cosⁿγ cos θ dω at a site about the ideal specular direction.
    fn lobe_light(
        &self,
        site: Site,
        mirror: glam::Vec3,
        records: &[Record],
        record_weight: f64,
        lights: &[(usize, Rgb)],
        reflectance: &Reflectance,
    ) -> Rgb {
        let lobe = |direction: glam::Vec3| {
            f64::from(mirror.dot(direction).max(0.0)).powf(reflectance.exponent)
        };
        let mut total = [0.0; CHANNELS];
        for record in records {
            let factor = record_weight * lobe(record.direction);
            for (total, radiance) in total.iter_mut().zip(record.radiance) {
                *total += factor * f64::from(radiance);
            }
        }
        for (index, irradiance) in lights {
            let offset = self.lights.lights[*index].position - site.position;
            let factor = lobe(offset.normalize_or_zero());
            for (total, irradiance) in total.iter_mut().zip(irradiance) {
                *total += factor * irradiance;
            }
        }
        total
    }
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
    evaluate: impl Fn(Site) -> Rgb + Sync,
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
                let site = places[index].map(|place| place.site);
                Ok(site.map_or([0.0; CHANNELS], &evaluate))
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

/// Gives every texel without an estimate the mean of its neighbours that have one, working
/// outwards; `fallback` where there is no estimate at all.
fn fill(estimated: Vec<Option<Radiance>>, width: usize, fallback: Radiance) -> Vec<Radiance> {
    let height = estimated.len() / width.max(1);
    let mut texels = estimated;
    let neighbours = |index: usize| {
        let (x, y) = (index % width, index / width);
        let left = (x > 0).then(|| index - 1);
        let right = (x + 1 < width).then(|| index + 1);
        let above = (y > 0).then(|| index - width);
        let below = (y + 1 < height).then(|| index + width);
        [left, right, above, below].into_iter().flatten()
    };
    let mut queue: VecDeque<usize> =
        (0..texels.len()).filter(|&index| texels[index].is_some()).collect();
    while let Some(index) = queue.pop_front() {
        for next in neighbours(index) {
            if texels[next].is_some() {
                continue;
            }
            let (mut sum, mut count) = ([0.0f32; CHANNELS], 0.0);
            for texel in neighbours(next).filter_map(|index| texels[index]) {
                for (sum, value) in sum.iter_mut().zip(texel) {
                    *sum += value;
                }
                count += 1.0;
            }
            texels[next] = Some(sum.map(|value| value / count));
            queue.push_back(next);
        }
    }
    texels.into_iter().map(|texel| texel.unwrap_or(fallback)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_without_a_measurement_are_filled_from_their_neighbours() {
        let mut estimated = vec![None; 12];
        estimated[0] = Some([0.2; 3]);
        estimated[3] = Some([0.6; 3]);
        let filled = fill(estimated, 4, [0.9; 3]);
        assert_eq!(filled[4], [0.2; 3]);
        assert_eq!(filled[11], [0.6; 3]);
        assert!(filled.iter().all(|t| (0.2..=0.6).contains(&t[0])));
        assert_eq!(fill(vec![None; 4], 2, [0.9; 3]), [[0.9; 3]; 4]);
    }
}
