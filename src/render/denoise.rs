//! Takes noise out of a picture, where what is seen says that neighbours are lit alike.
//!
//! An edge-avoiding à-trous wavelet (Dammertz et al. 2010) over the light that falls on surfaces:
//! their albedo, which has no noise, is divided out, so that textures stay sharp. Neighbours count
//! less the more their normals and distances differ, and the more their light differs than the
//! noise explains (Schied et al. 2017), which is estimated from the two halves of the paths.

use glam::Vec3;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance};
use crate::render::film::Film;

/// Rounds, each with neighbours twice as far away.
const ROUNDS: u32 = 5;
/// The kernel of a cubic B-spline.
const SPLINE: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Differences of light that count as noise, in standard deviations.
const LIGHT: f32 = 4.0;
/// How sharply differences of normals separate surfaces.
const NORMAL: i32 = 64;
/// Albedos below are taken to be this.
const DARKEST: f32 = 0.02;

/// What is known of a pixel without noise.
struct Guide {
    albedo: Radiance,
    normal: Vec3,
    distance_m: f32,
    /// Change of the distance from one pixel to the next, across and down.
    slope: [f32; 2],
    is_known: bool,
}

/// The light on a pixel: every layer, then the direct part; with the variance of its mean.
#[derive(Clone)]
struct Light {
    layers: Vec<Radiance>,
    brightness: f32,
    variance: f32,
}

/// The film with less noise; its layers still add up. What has no surface stays as it is.
pub fn denoised(film: &Film) -> Film {
    if film.paths < 2 {
        return film.clone();
    }
    let (width, height) = (film.width, film.height);
    let guides = guides(film);
    let mut lights = demodulated(film, &guides);
    smooth_variance(&mut lights, &guides, (width, height));
    for round in 0..ROUNDS {
        let step = 1 << round;
        lights = (0..width * height)
            .into_par_iter()
            .map(|index| filtered(&lights, &guides, (width, height), index, step))
            .collect();
    }
    let mut result = film.clone();
    for (index, (light, guide)) in lights.iter().zip(&guides).enumerate() {
        let modulated = |light: &Radiance| std::array::from_fn(|c| light[c] * guide.albedo[c]);
        let layers: Vec<Radiance> = light.layers.iter().map(modulated).collect();
        result.set_light(index, &layers);
    }
    result
}

fn guides(film: &Film) -> Vec<Guide> {
    let (width, height) = (film.width, film.height);
    let (albedo, normal) = (film.albedo(), film.normal());
    let (distance_m, coverage) = (film.distance_m(), film.coverage());
    let slope = |index: usize, stride: usize, at: usize, count: usize| {
        let here = distance_m[index];
        let before = (at > 0).then(|| here - distance_m[index - stride]);
        let after = (at + 1 < count).then(|| distance_m[index + stride] - here);
        // Of the two the smaller one: the other may reach over an edge.
        let all = [before, after].into_iter().flatten();
        all.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
    };
    (0..width * height)
        .map(|index| Guide {
            albedo: albedo[index].map(|value| value.max(DARKEST)),
            normal: Vec3::from(normal[index]).normalize_or_zero(),
            distance_m: distance_m[index],
            slope: [
                slope(index, 1, index % width, width),
                slope(index, width, index / width, height),
            ],
            is_known: coverage[index] > 0.5,
        })
        .collect()
}

fn demodulated(film: &Film, guides: &[Guide]) -> Vec<Light> {
    let light = |(index, guide): (usize, &Guide)| {
        let divided = |light: Radiance| std::array::from_fn(|c| light[c] / guide.albedo[c]);
        let (layers, halves_apart) = film.light(index);
        let layers: Vec<Radiance> = layers.into_iter().map(divided).collect();
        // The last one is the direct part, which is in the others already.
        let sum = layers[..layers.len() - 1].iter().flatten().sum::<f32>();
        let apart: Radiance = divided(halves_apart);
        let error = apart.iter().sum::<f32>() / CHANNELS as f32;
        Light { layers, brightness: sum / CHANNELS as f32, variance: error * error }
    };
    guides.par_iter().enumerate().map(|(index, guide)| light((index, guide))).collect()
}

/// The variance of one pixel, estimated from the difference of two halves, is itself noisy: it is
/// averaged with its neighbours'.
fn smooth_variance(lights: &mut [Light], guides: &[Guide], (width, height): (usize, usize)) {
    const REACH: usize = 3;
    let smooth = |index: usize| {
        let (x, y) = (index % width, index / width);
        let (mut sum, mut weights) = (0.0f32, 0.0f32);
        for v in y.saturating_sub(REACH)..=(y + REACH).min(height - 1) {
            for u in x.saturating_sub(REACH)..=(x + REACH).min(width - 1) {
                let other = v * width + u;
                let weight = alike(&guides[index], &guides[other], (u, v), (x, y));
                sum += weight * lights[other].variance;
                weights += weight;
            }
        }
        if weights > 0.0 { sum / weights } else { lights[index].variance }
    };
    let smoothed: Vec<f32> = (0..lights.len()).into_par_iter().map(smooth).collect();
    for (light, variance) in lights.iter_mut().zip(smoothed) {
        light.variance = variance;
    }
}

/// From 0 to 1, whether two pixels show one smooth surface.
fn alike(a: &Guide, b: &Guide, (u, v): (usize, usize), (x, y): (usize, usize)) -> f32 {
    if a.is_known != b.is_known {
        return 0.0;
    }
    if !a.is_known {
        return 1.0;
    }
    let (across, down) = (u as f32 - x as f32, v as f32 - y as f32);
    let expected = a.slope[0] * across + a.slope[1] * down;
    let steepest = a.slope[0].abs() * across.abs() + a.slope[1].abs() * down.abs();
    let off = (b.distance_m - a.distance_m - expected).abs();
    let scale = 0.5 * steepest + 2e-3 * a.distance_m;
    a.normal.dot(b.normal).max(0.0).powi(NORMAL) * (-off / scale.max(f32::MIN_POSITIVE)).exp()
}

fn filtered(
    lights: &[Light],
    guides: &[Guide],
    (width, height): (usize, usize),
    index: usize,
    step: usize,
) -> Light {
    let (x, y) = (index % width, index / width);
    let (own, guide) = (&lights[index], &guides[index]);
    let noise = LIGHT * own.variance.sqrt() + 1e-6 * own.brightness.abs() + f32::MIN_POSITIVE;
    let mut sum =
        Light { layers: vec![[0.0; CHANNELS]; own.layers.len()], brightness: 0.0, variance: 0.0 };
    let mut weights = 0.0f32;
    for j in -2..=2isize {
        for i in -2..=2isize {
            let (u, v) = (x as isize + i * step as isize, y as isize + j * step as isize);
            if u < 0 || v < 0 || u >= width as isize || v >= height as isize {
                continue;
            }
            let (u, v) = (u as usize, v as usize);
            let other = &lights[v * width + u];
            let kernel = SPLINE[i.unsigned_abs()] * SPLINE[j.unsigned_abs()];
            let close = alike(guide, &guides[v * width + u], (u, v), (x, y));
            let lit_alike = (-(own.brightness - other.brightness).abs() / noise).exp();
            let weight = kernel * close * lit_alike;
            for (sum, light) in sum.layers.iter_mut().zip(&other.layers) {
                for (sum, value) in sum.iter_mut().zip(light) {
                    *sum += weight * value;
                }
            }
            sum.brightness += weight * other.brightness;
            sum.variance += weight * weight * other.variance;
            weights += weight;
        }
    }
    for value in sum.layers.iter_mut().flatten() {
        *value /= weights;
    }
    sum.brightness /= weights;
    sum.variance /= weights * weights;
    sum
}
