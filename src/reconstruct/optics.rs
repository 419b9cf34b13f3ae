//! Finds which of the materials that are tagged as specular are mirrors or clear glass. The pixels
//! of such a material show other surfaces, which other photographs show too.
//!
//! Neither the light nor the reflectances have to be known for this. Each pixel of such a material
//! is predicted in three ways, all from other pixels: as an opaque surface, from other photographs
//! of the same point; as a mirror, from the surface that the mirrored ray meets; and as clear
//! glass, from the surface behind it and the surface that the mirrored ray meets, weighted by
//! Fresnel's equations.

use std::collections::BTreeMap;

use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::bvh::Ray;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::scene::{MaterialKind, Optics, SurfacePoint, Views, agreed, fresnel};
use crate::watch::{Cancelled, Watch};

/// A pixel: an index into [`Views::buffers`], its column and its row.
type Place = (usize, usize, usize);

/// A pixel of a specular material, as other pixels predict it.
struct Pixel {
    /// Cell of the grid that pixels are compared by.
    block: (u32, [i32; 3]),
    radiance: Radiance,
    /// Radiance of the same point in other photographs.
    opaque: Radiance,
    /// Radiance of the surface that the mirrored ray meets.
    mirrored: Radiance,
    /// Radiance of the surface behind, and the fraction of it that all faces of the glass on the
    /// way transmit.
    behind: Option<(Radiance, f32)>,
}

/// Pixels of a material that are looked at, evenly over all that show it.
const PIXELS: usize = 2000;
/// Faces of glass that a ray may pass.
const MOST_FACES: usize = 8;
/// Side of a block in half-diagonals of the geometry's bounds.
const SIDE: f32 = 0.05;
/// A mirror or glass is taken for one where it predicts better by this many standard errors, over
/// this many blocks. One standard error, as elsewhere, is not enough: pixels of things that stand
/// on a surface and were not modelled are predicted badly in every way. Set on the two kitchens,
/// where a mirror is found with 6, glass with 4, and a worktop full of things reaches 2.8.
const DEVIATIONS: f64 = 3.0;
const ENOUGH_BLOCKS: usize = 8;
/// A logarithm further off counts no more than this: there one pixel is mixed with another surface,
/// or something stands there that was not modelled.
const FAR: f64 = 1.5;

/// Per material of the capture, whether it is opaque, a mirror or glass.
///
/// # Errors
/// If it is cancelled.
pub fn find(views: &Views, watch: &Watch) -> Result<Vec<Optics>, Cancelled> {
    let capture = views.capture;
    let (low, high) = capture.mesh.bounds().unwrap_or_default();
    let block_m = (SIDE * 0.5 * (high - low).length()).max(f32::MIN_POSITIVE);
    // Counted first, so that memory holds those alone that are looked at.
    let mut count = vec![0usize; capture.materials.len()];
    visit(views, watch, &mut |material, _| count[material] += 1)?;
    let step: Vec<usize> = count.iter().map(|count| count.div_ceil(PIXELS).max(1)).collect();
    let mut places: Vec<Vec<Place>> = vec![Vec::new(); count.len()];
    let mut next = vec![0usize; count.len()];
    visit(views, watch, &mut |material, place| {
        if next[material].is_multiple_of(step[material]) {
            places[material].push(place);
        }
        next[material] += 1;
    })?;
    let of_material = |(material, places): (usize, &Vec<Place>)| {
        let pixels: Vec<Option<Pixel>> = places
            .par_iter()
            .map(|&place| {
                watch.check()?;
                Ok(pixel(views, material, place, block_m))
            })
            .collect::<Result<_, Cancelled>>()?;
        let pixels: Vec<Pixel> = pixels.into_iter().flatten().collect();
        Ok(classify(&pixels))
    };
    places.iter().enumerate().map(of_material).collect()
}

/// Every pixel off the edges that shows a material which is tagged as specular, photograph by
/// photograph.
fn visit(
    views: &Views,
    watch: &Watch,
    each: &mut dyn FnMut(usize, Place),
) -> Result<(), Cancelled> {
    let capture = views.capture;
    let is_specular = |material: &usize| capture.materials[*material].kind != MaterialKind::Diffuse;
    // Mostly there are none, and the pixels need not be looked at.
    if !(0..capture.materials.len()).any(|material| is_specular(&material)) {
        return Ok(());
    }
    for (index, buffer) in views.buffers.iter().enumerate() {
        watch.check()?;
        for y in 0..buffer.camera.height {
            for run in buffer.runs(y).filter(|run| run.is_off_edges) {
                if let Some(material) = capture.material_of(run.triangle).filter(is_specular) {
                    run.columns.for_each(|x| each(material, (index, x, y)));
                }
            }
        }
    }
    Ok(())
}

/// What a material is by its pixels.
fn classify(pixels: &[Pixel]) -> Optics {
    let tint = tint(pixels);
    let mirror = |pixel: &Pixel| {
        Some(off(pixel.radiance, std::array::from_fn(|c| tint[c] * pixel.mirrored[c])))
    };
    let glass = |pixel: &Pixel| {
        let (behind, through) = pixel.behind?;
        let seen =
            std::array::from_fn(|c| through * behind[c] + (1.0 - through) * pixel.mirrored[c]);
        Some(off(pixel.radiance, seen))
    };
    let as_mirror = Improvement::of(pixels, &mirror);
    let as_glass = Improvement::of(pixels, &glass);
    match (as_mirror.is_clear(), as_glass.is_clear()) {
        (false, false) => Optics::Opaque,
        (true, true) if as_glass.change < as_mirror.change => Optics::Glass,
        (true, _) => Optics::Mirror(tint),
        (false, true) => Optics::Glass,
    }
}

/// How much better another way predicts the pixels that both do.
struct Improvement {
    /// The change of the mean error.
    change: f64,
    /// Of that change, from its spread over the blocks.
    standard_error: f64,
    blocks: usize,
}

impl Improvement {
    fn of(pixels: &[Pixel], error: &dyn Fn(&Pixel) -> Option<f64>) -> Self {
        let mut blocks: BTreeMap<_, (f64, f64)> = BTreeMap::new();
        for pixel in pixels {
            let Some(own) = error(pixel) else { continue };
            let (sum, count) = blocks.entry(pixel.block).or_default();
            *sum += own - off(pixel.radiance, pixel.opaque);
            *count += 1.0;
        }
        let count = blocks.values().map(|(_, count)| count).sum::<f64>().max(1.0);
        let change = blocks.values().map(|(sum, _)| sum).sum::<f64>() / count;
        let spread: f64 = blocks.values().map(|(sum, own)| (sum - own * change).powi(2)).sum();
        Self { change, standard_error: spread.sqrt() / count, blocks: blocks.len() }
    }

    fn is_clear(&self) -> bool {
        self.blocks >= ENOUGH_BLOCKS && -self.change > DEVIATIONS * self.standard_error
    }
}

fn pixel(views: &Views, material: usize, (index, x, y): Place, block_m: f32) -> Option<Pixel> {
    let capture = views.capture;
    let buffer = &views.buffers[index];
    let radiance = buffer.window(x, y, 3)?;
    let (position, triangle) = buffer.hit(x, y)?;
    let towards = (buffer.camera.position.as_vec3() - position).normalize_or_zero();
    let point = views.side(position, triangle, towards);

    let others = views.buffers.iter().enumerate().filter(|(other, _)| *other != index);
    let others: Vec<Radiance> = others
        .filter_map(|(_, other)| {
            let seen = views.seen(other, point)?;
            other.window(seen.x, seen.y, 3)
        })
        .collect();
    if others.is_empty() {
        return None;
    }
    let opaque = agreed(&others);
    let mirror = 2.0 * towards.dot(point.normal) * point.normal - towards;
    let met = |ray: &Ray| {
        let hit = views.caster.closest(ray)?;
        (capture.material_of(hit.triangle) != Some(material)).then_some(())?;
        views.radiance(views.surface_point(ray, &hit))
    };
    let mirrored = met(&views.ray(point, mirror))?;
    let behind = behind(views, material, point, -towards);
    let cell = (position / block_m).floor().as_ivec3().to_array();
    Some(Pixel {
        block: (capture.mesh.surface[triangle as usize], cell),
        radiance,
        opaque,
        mirrored,
        behind,
    })
}

fn behind(
    views: &Views,
    material: usize,
    point: SurfacePoint,
    direction: Vec3,
) -> Option<(Radiance, f32)> {
    let mut through = 1.0 - fresnel((-direction.dot(point.normal)).into()) as f32;
    let mut ray =
        Ray { origin: point.position, direction, t_min: views.offset_m, t_max: f32::INFINITY };
    for _ in 0..MOST_FACES {
        let hit = views.caster.closest(&ray)?;
        let met = views.surface_point(&ray, &hit);
        if views.capture.material_of(hit.triangle) != Some(material) {
            return Some((views.radiance(met)?, through));
        }
        through *= 1.0 - fresnel((-direction.dot(met.normal)).into()) as f32;
        ray.t_min = hit.t + views.offset_m;
    }
    None
}

/// How far off a prediction is: the mean over the channels of its logarithm's error.
fn off(measured: Radiance, predicted: Radiance) -> f64 {
    let error = |c: usize| {
        let ratio = f64::from(predicted[c].max(1e-9)) / f64::from(measured[c].max(1e-9));
        ratio.ln().abs().min(FAR)
    };
    (0..CHANNELS).map(error).sum::<f64>() / CHANNELS as f64
}

/// The median ratio of the pixels' radiance to that of the surfaces that the mirrored rays meet.
fn tint(pixels: &[Pixel]) -> Radiance {
    std::array::from_fn(|c| {
        let mut parts: Vec<f32> =
            pixels.iter().map(|p| p.radiance[c] / p.mirrored[c].max(1e-9)).collect();
        parts.sort_by(f32::total_cmp);
        parts.get(parts.len() / 2).map_or(0.0, |part| part.min(1.0))
    })
}
