//! Reflectances of materials that photographs show but that have no sample: things smaller than the
//! distance of samples, beside which samples of other materials lie, and things that show hardly
//! anywhere off their edges.
//!
//! Their pixels also show what is around them, so they take no part in the solve. Once the light is
//! known, Eq. 13 gives their reflectance at each pixel, and the median over the pixels is used.

use std::f64::consts::PI;
use std::sync::Arc;

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::math::sampling::Random;
use crate::reconstruct::candidates::{self, material_of};
use crate::reconstruct::options::Options;
use crate::reconstruct::recovered::RecoveredLight;
use crate::reconstruct::solution::{MaterialCertainty, Solution};
use crate::reconstruct::textures::TextureOptions;
use crate::reconstruct::textures::light::Light;
use crate::reconstruct::{Error, Stream, predict};
use crate::scene::{Brdf, SurfacePoint, Views};
use crate::watch::{Cancelled, Watch};

/// Pixels of a material that are used at most.
const PIXELS: usize = 100;

/// The solution with a reflectance for every material that a photograph measures.
///
/// # Errors
/// `Error::Cancelled`, and `Error::TooManyPixels` as in [`samples::place`](super::samples::place).
pub(super) fn complete(
    views: &Views,
    light: &RecoveredLight,
    mut solution: Arc<Solution>,
    options: &Options,
    watch: &Watch,
) -> Result<Arc<Solution>, Error> {
    let points = points(views, &solution, options)?;
    if points.iter().all(Vec::is_empty) {
        return Ok(solution);
    }
    let (light, rays) = (Light::new(light, options), predict::rays(options));
    let mut names = Vec::new();
    let completed = Arc::make_mut(&mut solution);
    for (material, points) in points.iter().enumerate() {
        let found = at_points(views, &light, points, &rays, watch)?;
        let Some(found) = found else { continue };
        let tagged = &views.capture.materials[material];
        let diffuse = tagged.known_diffuse.unwrap_or(found.map(|own| own.median));
        completed.reflectances[material] = Some(Brdf::diffuse(diffuse));
        if let Some(certainty) = &mut completed.certainty {
            let (sets, scale) = (certainty.light_sets, certainty.scale.log_sd);
            let is_known = tagged.known_diffuse.is_some();
            let interval = |c: usize| (sets > 1 && !is_known).then(|| found[c].interval(scale[c]));
            certainty.materials[material] = Some(MaterialCertainty {
                diffuse: std::array::from_fn(interval),
                identified: [is_known; CHANNELS],
                ..MaterialCertainty::default()
            });
        }
        if tagged.known_diffuse.is_none() {
            names.push(format!("\"{}\"", tagged.name));
        }
    }
    if !names.is_empty() {
        completed.notes.push(format!(
            "{} shown by too few pixels for samples: the reflectance is the median over these \
             pixels, under the light that was found without them",
            match &*names {
                [name] => format!("{name} is"),
                _ => format!("{} are", names.join(", ")),
            }
        ));
    }
    Ok(solution)
}

/// Reflectances in one channel at the pixels of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Distribution {
    median: f64,
    /// Standard deviation of their logarithms, from the middle two thirds.
    log_sd: f64,
}

impl Distribution {
    /// Of at least one number.
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        // Two thirds of a normal distribution lie within a standard deviation of the median.
        let at = |part: f64| values[(part * (values.len() - 1) as f64).round() as usize];
        let (low, high) = (at(1.0 / 6.0).max(f64::MIN_POSITIVE), at(5.0 / 6.0));
        Self { median: at(0.5), log_sd: 0.5 * (high.max(low) / low).ln() }
    }

    /// The 95 % interval, where all reflectances share a scale whose logarithm has that standard
    /// deviation. What is wrong at one pixel, the neighbouring surface or the light, is wrong in the same
    /// way at those beside it, so that many pixels make it no narrower.
    fn interval(&self, scale_log_sd: f64) -> [f64; 2] {
        let width = (1.96 * self.log_sd.hypot(scale_log_sd)).exp();
        [self.median / width, (self.median * width).min(1.0)]
    }
}

/// Eq. 13 at some points; `None` where no light falls on any.
fn at_points(
    views: &Views,
    light: &Light,
    points: &[SurfacePoint],
    rays: &TextureOptions,
    watch: &Watch,
) -> Result<Option<[Distribution; CHANNELS]>, Cancelled> {
    let reflectance = |&point: &SurfacePoint| -> Result<Option<Rgb>, Cancelled> {
        watch.check()?;
        let Some(sent) = views.radiance(point) else { return Ok(None) };
        let irradiance = light.at(views, point, rays);
        let is_lit = irradiance.iter().all(|&value| value > 0.0);
        let reflectance = |c: usize| (PI * f64::from(sent[c]) / irradiance[c]).min(1.0);
        Ok(is_lit.then(|| std::array::from_fn(reflectance)))
    };
    let found: Vec<Option<Rgb>> =
        points.par_iter().map(reflectance).collect::<Result<_, Cancelled>>()?;
    let found: Vec<Rgb> = found.into_iter().flatten().collect();
    let channel = |c: usize| Distribution::of(found.iter().map(|own| own[c]).collect());
    Ok((!found.is_empty()).then(|| std::array::from_fn(channel)))
}

/// Per material that should have a BRDF and has none, up to [`PIXELS`] points that pixels show, chosen
/// at random.
fn points(
    views: &Views,
    solution: &Solution,
    options: &Options,
) -> Result<Vec<Vec<SurfacePoint>>, Error> {
    let mut points = vec![Vec::new(); solution.reflectances.len()];
    let of_material = |material: usize| solution.reflectances[material].is_none();
    if !(0..points.len()).any(of_material) {
        return Ok(points);
    }
    let seed = options.general.seed as u64;
    let wanted = candidates::Wanted {
        min_cosine: options.samples.min_cosine,
        samples: options.samples.count,
        seed,
        of_material: &of_material,
    };
    let mut shown = candidates::find(views, &wanted, false)?;
    Random::new(seed, Stream::Unsampled as u64, 0).shuffle(&mut shown);
    for candidate in shown {
        let own = &mut points[material_of(views, candidate)];
        if own.len() < PIXELS {
            own.push(candidate.point(views));
        }
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_pixels_of_something_else_do_not_count() {
        let mut values: Vec<f64> =
            (0..90).map(|k| 0.2 * (0.001 * f64::from(k - 45)).exp()).collect();
        values.extend([0.0, 0.9, 1.0, 0.9, 0.8, 0.9, 1.0, 0.9, 0.8, 0.9]);
        let found = Distribution::of(values);
        assert!((found.median - 0.2).abs() < 0.002, "{found:?}");
        assert!(found.log_sd < 0.06, "{found:?}");
        let [low, high] = found.interval(0.1);
        assert!((high / low).ln() > 4.0 * 0.98 * 0.1 && high < 0.26 && low > 0.15, "{low} {high}");
    }

    #[test]
    fn one_pixel_is_its_own_median() {
        let found = Distribution::of(vec![0.3]);
        assert_eq!(found, Distribution { median: 0.3, log_sd: 0.0 });
        assert_eq!(Distribution::of(vec![0.0]).interval(0.1), [0.0, 0.0]);
    }
}
