//! The reflectance of every texel (Eq. 13): its photographed radiance, minus that which the
//! specular lobe reflects, divided by the light there.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::reconstruct::textures::cells::{Cell, Grid, Sum};
use crate::reconstruct::textures::light::{Incident, Light};
use crate::reconstruct::textures::{Place, TextureOptions, shows};
use crate::scene::agreement::AGREEMENT;
use crate::scene::views::{Seen, VisibilityBuffer};
use crate::scene::{Brdf, Gloss, SurfacePoint, Viewing, Views};
use crate::watch::{Cancelled, Watch};

/// The error of the light that a specular lobe mirrors, in units of that of a photograph: about a half
/// to a tenth.
const MIRRORED_ERROR: f64 = 5.0;
/// That of a photograph, relative.
const PHOTOGRAPH_ERROR: f64 = 0.1;
/// Standard deviation of a pattern on a surface, relative: printed walls and wood have about this.
const PATTERN: f64 = 0.3;
/// Its correlation between two channels. In natural images channels are correlated by more than this
/// (Ruderman, Cronin and Chiao 1998).
const CORRELATION: f64 = 0.9;
fn brightness(radiance: &Rgb) -> f64 {
    radiance.iter().sum()
}

/// The radiance of a texel in one photograph.
struct Photographed {
    /// Radiance without the specular reflection.
    diffuse: Rgb,
    weight: f64,
    /// Variance of `diffuse`.
    variance: Rgb,
    /// The pixel shows this surface alone.
    is_off_edges: bool,
}

/// The diffuse reflectance of a texel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    pub reflectance: Radiance,
    /// A pixel beside an edge shows another surface too; the texel is shown by others.
    pub is_off_edges: bool,
}

/// The mean of what photographs of a texel show of it, with their weights, without those that are far
/// from the median ([`AGREEMENT`]): a thing in front of the surface, or the mirror image of a bright one, is in few.
/// With its variance.
fn common(seen: &mut [Photographed]) -> Option<(Rgb, Rgb)> {
    seen.sort_by(|a, b| brightness(&a.diffuse).total_cmp(&brightness(&b.diffuse)));
    let half = 0.5 * seen.iter().map(|seen| seen.weight).sum::<f64>();
    let mut passed = 0.0;
    let median = seen.iter().find(|seen| {
        passed += seen.weight;
        passed >= half
    })?;
    let median = brightness(&median.diffuse);
    let (mut sum, mut weights, mut precision) = ([0.0; CHANNELS], 0.0, [0.0; CHANNELS]);
    for Photographed { diffuse, weight, variance, .. } in seen.iter() {
        let own = brightness(diffuse);
        if own <= AGREEMENT * median && own >= median / AGREEMENT || own == median {
            sum.iter_mut().zip(diffuse).for_each(|(sum, value)| *sum += weight * value);
            weights += weight;
            for (precision, variance) in precision.iter_mut().zip(variance) {
                *precision += 1.0 / variance.max(f64::MIN_POSITIVE);
            }
        }
    }
    (weights > 0.0).then(|| (sum.map(|sum| sum / weights), precision.map(|sum| 1.0 / sum)))
}

/// The diffuse radiance of a texel of a glossy surface, between the radiance that was found and that
/// which the mean reflectance of the material would give: the estimate of smallest mean square error
/// (Wiener), by the variance of the former and by how much patterns of surfaces usually vary, and
/// alike in all channels. Where a dark channel is lost under the reflection of a window, the others
/// tell of its pattern. A difference of more than three times the pattern is taken to be specular
/// reflection that the model does not account for.
fn drawn(found: Rgb, variance: Rgb, usual: Rgb) -> Rgb {
    let least = (1e-3 * brightness(&usual)).max(1e-100);
    let unit = DVec3::from(usual).max(DVec3::splat(least));
    let difference = (DVec3::from(found) - DVec3::from(usual)) / unit;
    let beyond = (difference.abs() - 3.0 * PATTERN).max(DVec3::ZERO);
    let noise = DVec3::from(variance) / (unit * unit) + beyond * beyond;
    let shared = DVec3::splat(PATTERN.powi(2) * CORRELATION);
    let pattern = DMat3::from_cols(shared, shared, shared)
        + DMat3::from_diagonal(DVec3::splat(PATTERN.powi(2) * (1.0 - CORRELATION)));
    let drawn = pattern * (pattern + DMat3::from_diagonal(noise)).inverse() * difference;
    (DVec3::from(usual) + unit * drawn).to_array()
}

/// The texels of one surface.
#[derive(Clone, Copy)]
pub(super) struct Texels<'a> {
    pub views: &'a Views<'a>,
    /// Index into `Capture::surfaces`.
    pub surface: usize,
    /// The surface is tagged as specular; it may mirror light although no highlight could be fitted.
    pub is_specular: bool,
    pub grid: Grid<'a>,
    /// G of Eq. 14 at every placed texel.
    pub irradiance: &'a [Option<Rgb>],
    pub light: &'a Light<'a>,
    pub options: &'a TextureOptions,
}

/// The light at the texels of a cell that no corner of the cells tells of: the same for all
/// photographs.
struct OwnLight {
    /// Ascending.
    texels: Vec<usize>,
    incident: Vec<OnceLock<Incident>>,
}

impl OwnLight {
    fn of(texels: &[usize]) -> Self {
        Self { texels: texels.to_vec(), incident: texels.iter().map(|_| OnceLock::new()).collect() }
    }

    fn at(&self, texel: usize, compute: impl FnOnce() -> Incident) -> Option<&Incident> {
        let place = self.texels.binary_search(&texel).ok()?;
        Some(self.incident[place].get_or_init(compute))
    }
}

/// The specular reflection at the texels of a surface, towards one photograph.
struct Mirrored<'a> {
    texels: &'a Texels<'a>,
    incidents: &'a [Option<Incident>],
    own: &'a OwnLight,
    brdf: &'a Brdf,
    gloss: (Gloss, Rgb),
    camera: Vec3,
}

impl Sum for Mirrored<'_> {
    fn parts(&self) -> usize {
        1
    }

    fn compute(&self, texel: usize, _: &[usize], values: &mut [Radiance]) {
        let Some(place) = &self.texels.grid.places[texel] else { return };
        let direction = (self.camera - place.point.position).normalize_or(place.point.normal);
        let viewing = Viewing::from(direction, place.point.normal);
        let mirrored = self.texels.mirrored((self.incidents, self.own), texel, viewing, self.gloss);
        values[0] = mirrored.map(|value| value as f32);
    }

    /// The diffuse radiance of the surface.
    fn base(&self, texel: usize) -> Rgb {
        let irradiance = self.texels.irradiance[texel].unwrap_or_default();
        std::array::from_fn(|c| self.brdf.diffuse[c] * irradiance[c] / PI)
    }
}

/// Cells after which pixels leave memory that are kept elsewhere.
const CELLS_HELD: usize = 256;

impl Texels<'_> {
    /// Per texel its diffuse reflectance; `None` where no photograph measures it, or no light falls.
    pub fn reflectances(
        &self,
        brdf: &Brdf,
        watch: &Watch,
    ) -> Result<Vec<Option<Estimate>>, Cancelled> {
        let incidents = match brdf.gloss() {
            Some(gloss) => Some((self.incidents(watch)?, gloss)),
            None => None,
        };
        let done = AtomicUsize::new(0);
        let of_cell = |cell: Cell| {
            // What was read for other places need not stay in memory.
            if done.fetch_add(1, Ordering::Relaxed) % CELLS_HELD == CELLS_HELD - 1 {
                self.views.buffers.iter().for_each(|buffer| buffer.image.release());
            }
            let texels = self.grid.texels(cell);
            let own = OwnLight::of(&texels);
            let mut photographed: Vec<Vec<Photographed>> =
                texels.iter().map(|_| Vec::new()).collect();
            for buffer in &self.views.buffers {
                watch.check()?;
                let seen: Vec<Option<(Seen, Rgb)>> =
                    texels.iter().map(|&texel| self.seen(buffer, texel)).collect();
                if seen.iter().all(Option::is_none) {
                    continue;
                }
                let mut mirrored = HashMap::new();
                if let Some((incidents, gloss)) = &incidents {
                    let camera = buffer.camera.position.as_vec3();
                    let (own, gloss) = (&own, *gloss);
                    let sum = Mirrored { texels: self, incidents, own, brdf, gloss, camera };
                    mirrored.extend(self.grid.within(cell, &sum, &watch.within())?);
                }
                let each = texels.iter().zip(&mut photographed).zip(seen);
                for ((texel, photographed), seen) in each {
                    let mirrored = mirrored.get(texel).copied().unwrap_or_default();
                    if let (Some(seen), Some(place)) = (seen, &self.grid.places[*texel]) {
                        photographed.push(shown(buffer, place.point, seen, mirrored));
                    }
                }
            }
            let usual = self.is_specular.then_some(brdf.diffuse);
            let found = |(texel, mut photographed): (usize, Vec<Photographed>)| {
                let irradiance = self.irradiance[texel]?;
                Some((texel, reflectance(irradiance, usual, &mut photographed)?))
            };
            Ok(texels.into_iter().zip(photographed).filter_map(found).collect())
        };
        let cells: Vec<Vec<(usize, Estimate)>> =
            self.grid.cells().into_par_iter().map(of_cell).collect::<Result<_, Cancelled>>()?;
        let mut reflectances = vec![None; self.grid.places.len()];
        for (texel, estimate) in cells.into_iter().flatten() {
            reflectances[texel] = Some(estimate);
        }
        Ok(reflectances)
    }

    /// The light by direction at the corners of square cells: what a lobe mirrors of it changes with
    /// the direction of view, which every texel has for itself.
    fn incidents(&self, watch: &Watch) -> Result<Vec<Option<Incident>>, Cancelled> {
        let stride = self.grid.stride;
        let (columns, height) =
            (self.grid.width.div_ceil(stride), self.grid.places.len() / self.grid.width.max(1));
        (0..columns * height.div_ceil(stride))
            .into_par_iter()
            .map(|corner| {
                watch.check()?;
                let (x, y) = (corner % columns * stride, corner / columns * stride);
                let place = &self.grid.places[y * self.grid.width + x];
                let incident =
                    |place: &Place| self.light.incident(self.views, place.point, self.options);
                Ok(place.as_ref().map(incident))
            })
            .collect()
    }

    /// Radiance that the specular lobe mirrors at a texel: with the light at the corners around it
    /// that lie on the same polygon, bilinear; with its own where there is none.
    fn mirrored(
        &self,
        (incidents, own): (&[Option<Incident>], &OwnLight),
        index: usize,
        viewing: Viewing,
        gloss: (Gloss, Rgb),
    ) -> Rgb {
        let Some(place) = &self.grid.places[index] else { return [0.0; CHANNELS] };
        let stride = self.grid.stride;
        let columns = self.grid.width.div_ceil(stride);
        let (x, y) = (index % self.grid.width, index / self.grid.width);
        let part = |at: usize| (at % stride) as f64 / stride as f64;
        let (mut sum, mut weights) = ([0.0; CHANNELS], 0.0);
        for (right, below) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (column, row) = (x / stride + right, y / stride + below);
            let along = |far: usize, part: f64| if far == 1 { part } else { 1.0 - part };
            let weight = along(right, part(x)) * along(below, part(y));
            if weight <= 0.0 || column >= columns {
                continue;
            }
            let Some(Some(incident)) = incidents.get(row * columns + column) else { continue };
            let corner = &self.grid.places[row * stride * self.grid.width + column * stride];
            if corner.as_ref().is_none_or(|corner| corner.polygon != place.polygon) {
                continue;
            }
            let reflected = self.light.reflected(incident, place.point, viewing, gloss);
            sum.iter_mut().zip(reflected).for_each(|(sum, value)| *sum += weight * value);
            weights += weight;
        }
        if weights <= 0.0 {
            let compute = || self.light.incident(self.views, place.point, self.options);
            let Some(own) = own.at(index, compute) else { return [0.0; CHANNELS] };
            return self.light.reflected(own, place.point, viewing, gloss);
        }
        sum.map(|sum| sum / weights)
    }

    /// The place of a texel in a photograph, and the radiance that is measured there.
    fn seen(&self, buffer: &VisibilityBuffer, texel: usize) -> Option<(Seen, Rgb)> {
        let place = self.grid.places[texel].as_ref()?;
        let (seen, radiance) = shows(self.views, buffer, self.surface, place.point)?;
        Some((seen, radiance.map(f64::from)))
    }
}

/// The radiance of a surface point in a photograph, without the specular reflection.
fn shown(
    buffer: &VisibilityBuffer,
    point: SurfacePoint,
    (seen, radiance): (Seen, Rgb),
    mirrored: Rgb,
) -> Photographed {
    // A photograph counts by the number of its pixels that show the texel.
    let distance = buffer.camera.position.as_vec3().distance(point.position);
    let weight = f64::from(seen.cosine / (distance * distance).max(1e-12));
    // Beside an edge a pixel shows another surface too: used where there is no other.
    let is_off_edges = buffer.is_off_edges(seen.x, seen.y);
    let weight = if is_off_edges { weight } else { 1e-3 * weight };
    // The specular reflection is known less well than the measured radiance.
    let part = brightness(&mirrored) / brightness(&radiance).max(f64::MIN_POSITIVE);
    let error = 1.0 + (MIRRORED_ERROR * part).powi(2);
    Photographed {
        diffuse: std::array::from_fn(|c| radiance[c] - mirrored[c]),
        weight: weight / error,
        variance: std::array::from_fn(|c| {
            PHOTOGRAPH_ERROR.powi(2)
                * (radiance[c].powi(2) + (MIRRORED_ERROR * mirrored[c]).powi(2))
        }),
        is_off_edges,
    }
}

/// Eq. 13 for one texel; `usual` is the diffuse reflectance of a material tagged as specular.
fn reflectance(
    irradiance: Rgb,
    usual: Option<Rgb>,
    photographed: &mut [Photographed],
) -> Option<Estimate> {
    // Without light a texel's reflectance cannot be told.
    if irradiance.iter().any(|&value| value <= 0.0) {
        return None;
    }
    let (mut diffuse, variance) = common(photographed)?;
    if let Some(usual) = usual {
        let usual = std::array::from_fn(|c| usual[c] * irradiance[c] / PI);
        diffuse = drawn(diffuse, variance, usual);
    }
    Some(Estimate {
        reflectance: std::array::from_fn(|c| {
            (PI * diffuse[c] / irradiance[c]).clamp(0.0, 1.0) as f32
        }),
        is_off_edges: photographed.iter().any(|photographed| photographed.is_off_edges),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_few_photographs_of_a_texel_show_is_left_out() {
        // Four views of a worktop in kitchen-full, one of them through something bright in front.
        let shown = |value: f64| Photographed {
            diffuse: [value; CHANNELS],
            weight: 1.0,
            variance: [(0.1 * value).powi(2); CHANNELS],
            is_off_edges: true,
        };
        let mut seen = [0.0912, 0.0092, 0.0085, 0.0071].map(shown);
        let (found, variance) = common(&mut seen).unwrap();
        assert!((found[0] - (0.0092 + 0.0085 + 0.0071) / 3.0).abs() < 1e-12, "{found:?}");
        // That of the mean of three.
        assert!((variance[0].sqrt() / (0.1 * found[0] / 3.0f64.sqrt()) - 1.0).abs() < 0.05);
        // One photograph says what it says, also where the specular light was overestimated.
        assert_eq!(common(&mut [shown(-0.01)]).unwrap().0, [-0.01; CHANNELS]);
        assert!(common(&mut []).is_none());
    }

    #[test]
    fn a_texel_is_drawn_to_its_material_as_far_as_it_is_uncertain() {
        let (found, usual) = ([0.02; CHANNELS], [0.018; CHANNELS]);
        // Of all channels together.
        let pattern = (PATTERN * usual[0]).powi(2) * (1.0 + 2.0 * CORRELATION);
        for (variance, expected) in [(0.0, 0.02), (pattern, 0.019), (1e6 * pattern, 0.018)] {
            let drawn = drawn(found, [variance; CHANNELS], usual);
            assert!((drawn[0] - expected).abs() < 1e-8, "{variance}");
        }
        // The mirror image of a window is no pattern.
        assert!(drawn([0.5; CHANNELS], [0.0; CHANNELS], usual)[0] < 0.021);
    }

    #[test]
    fn a_channel_of_which_nothing_is_known_follows_the_others() {
        let usual = [0.2, 0.1, 0.04];
        let found = [0.26, 0.13, 0.4];
        let [red, green, blue] = drawn(found, [0.0, 0.0, 1e6], usual);
        assert!((red - 0.26).abs() < 1e-6 && (green - 0.13).abs() < 1e-6, "{red} {green}");
        // Of two that agree, each correlated with it by 0.9 and with the other: 2 · 0.9 / 1.9.
        assert!((blue / usual[2] - 1.0 - 0.3 * 1.8 / 1.9).abs() < 1e-3, "{blue}");
        // Each channel has a pattern of its own as well.
        let [.., blue] = drawn([0.26, 0.13, 0.03], [0.0; CHANNELS], usual);
        assert!((blue - 0.03).abs() < 1e-6, "{blue}");
        // A channel that a material does not reflect.
        assert!(drawn([0.2, 0.1, 0.001], [1e-4; CHANNELS], [0.2, 0.1, 0.0])[2].is_finite());
    }
}
