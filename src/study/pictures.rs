//! The error of rendered pictures against true ones, over the pixels that show known surfaces.
//!
//! Differences of radiance are measured by their relative RMS. Their visibility is measured by PSNR
//! and FLIP (Andersson et al. 2020) of sRGB pictures at one exposure, for which the 99th percentile
//! of the true values is white, and by HDR-FLIP at the exposure at which they are most visible.

use std::path::Path;

use serde::Serialize;

use crate::io::export::pictures::percentile;
use crate::io::picture::{self, Picture};
use crate::io::{Error, Fault, exr};
use crate::math::rgb::{CHANNELS, Radiance, srgb};
use crate::render::film::Film;
use crate::scene::Image;
use crate::study::flip::{self, Linear};

/// A picture beside the true one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PictureScore {
    /// Of the files, without extension.
    pub name: String,
    /// Pixels that were compared.
    pub pixels: usize,
    /// Root mean square of the differences over that of the true values.
    pub relative_rms: f64,
    /// Of the sRGB values, not rounded; `null` where they are equal.
    pub psnr_db: Option<f64>,
    /// At [`PIXELS_PER_DEGREE`], over the pixels that were compared; 0 to 1.
    pub mean_flip: f64,
    /// The same over all exposures that a viewer might choose.
    pub mean_hdr_flip: f64,
}

/// A monitor of 0.7 m and 3840 pixels, seen from 0.7 m: FLIP's own default.
pub const PIXELS_PER_DEGREE: f32 = 67.0;

/// Pixels of which known surfaces cover a smaller part than this are not compared.
const COVERED: f32 = 0.999;

/// Compares every true picture of a folder with the render of that name, in their order.
///
/// # Errors
/// Where a file cannot be read, two of a name differ in size, or no two have a name in common.
pub fn compare_folders(renders: &Path, truths: &Path) -> Result<Vec<PictureScore>, Error> {
    let (rendered, truth_files) = (picture::by_stem(renders)?, picture::by_stem(truths)?);
    let mut scores = Vec::new();
    for (name, truth_file) in &truth_files {
        let Some(render_file) = rendered.get(name) else { continue };
        let (render, truth) = (picture::read(render_file)?, picture::read(truth_file)?);
        if (render.width, render.height) != (truth.width, truth.height) {
            let problem = format!(
                "it has {} x {} pixels, and {} has {} x {}",
                render.width,
                render.height,
                truth_file.display(),
                truth.width,
                truth.height
            );
            let remedy = "Render it with the camera of the true picture";
            return Err(Error::Invalid(Fault::new(render_file, "", problem, remedy)));
        }
        let coverage = match picture::Format::of(render_file)? {
            picture::Format::OpenExr => exr::read_channel(render_file, "A")?,
            _ => None,
        };
        scores.push(compare(name, &render, coverage.as_deref(), &truth));
    }
    if scores.is_empty() {
        return Err(Error::Missing(Fault::new(
            renders,
            "",
            format!("none of its pictures has the name of one in {}", truths.display()),
            "Render the true pictures' cameras: lobelia render … --cameras FILE",
        )));
    }
    Ok(scores)
}

/// Compares two pictures of one size. `coverage` is the part of each pixel, row by row, that known
/// surfaces cover; without it every pixel counts. Pixels that are not finite in the truth do not.
pub fn compare(
    name: &str,
    render: &Picture,
    coverage: Option<&[f32]>,
    truth: &Picture,
) -> PictureScore {
    let is_compared = |index: usize| {
        coverage.is_none_or(|coverage| coverage[index] > COVERED)
            && truth.pixels[index].iter().all(|value| value.is_finite())
    };
    let compared: Vec<bool> = (0..truth.pixels.len()).map(is_compared).collect();
    let kept: Vec<Radiance> = truth
        .pixels
        .iter()
        .zip(&compared)
        .filter_map(|(&pixel, &compared)| compared.then_some(pixel))
        .collect();
    let white = percentile(&kept, 0.99);
    let white = if white > 0.0 { white } else { 1.0 };
    let shown = |pixel: Radiance| pixel.map(|value| srgb(value / white));

    let pairs = || {
        let both = render.pixels.iter().zip(&truth.pixels).zip(&compared);
        both.filter_map(|((&render, &truth), &compared)| compared.then_some((render, truth)))
    };
    let (mut difference, mut total, mut shown_difference) = (0.0f64, 0.0f64, 0.0f64);
    for (r, t) in pairs() {
        for c in 0..CHANNELS {
            difference += f64::from(r[c] - t[c]).powi(2);
            total += f64::from(t[c]).powi(2);
            shown_difference += f64::from(shown(r)[c] - shown(t)[c]).powi(2);
        }
    }
    let mean_squared = shown_difference / (CHANNELS * kept.len()).max(1) as f64;
    // Other pixels are alike in both, so that FLIP sees no edge there that is in one alone.
    let seen = |pixels: &[Radiance], scale: f32, largest: f32| -> Vec<Radiance> {
        let visible = |(pixel, &compared): (&Radiance, &bool)| match compared {
            true => pixel.map(|value| (value / scale).clamp(0.0, largest)),
            false => [0.0; CHANNELS],
        };
        pixels.iter().zip(&compared).map(visible).collect()
    };
    let mean = |compare: fn(Linear, Linear, f32) -> Vec<f32>, scale: f32, largest: f32| {
        let (truth_seen, render_seen) =
            (seen(&truth.pixels, scale, largest), seen(&render.pixels, scale, largest));
        let view = |pixels| Linear { width: truth.width, pixels };
        let errors = compare(view(&truth_seen), view(&render_seen), PIXELS_PER_DEGREE);
        let values = errors.iter().zip(&compared).filter(|(_, compared)| **compared);
        values.map(|(error, _)| f64::from(*error)).sum::<f64>() / kept.len().max(1) as f64
    };
    PictureScore {
        name: name.to_owned(),
        pixels: kept.len(),
        relative_rms: if total > 0.0 { (difference / total).sqrt() } else { difference.sqrt() },
        psnr_db: (mean_squared > 0.0).then(|| -10.0 * mean_squared.log10()),
        mean_flip: mean(flip::ldr, white, 1.0),
        mean_hdr_flip: mean(flip::hdr, 1.0, f32::MAX),
    }
}

/// Compares a render with the photograph that was taken from there; the photograph's pixels are
/// averaged to the render's. What no photograph measures and no known surface covers does not
/// count.
pub fn against_photograph(name: &str, film: &Film, photograph: &Image) -> PictureScore {
    let (width, height) = (film.width, film.height);
    let step = (photograph.width() / width.max(1)).max(1);
    let picture = |pixels| Picture { width, height, pixels, notes: Vec::new() };
    let truth = picture(reduced(photograph, width, height, step));
    compare(name, &picture(film.beauty()), Some(&film.coverage()), &truth)
}

/// Means over `step`² pixels; not a number where one of them is no measurement.
fn reduced(image: &Image, width: usize, height: usize, step: usize) -> Vec<Radiance> {
    let mean = |x: usize, y: usize| -> Radiance {
        let mut sum = [0.0f32; CHANNELS];
        for v in y * step..(y + 1) * step {
            for u in x * step..(x + 1) * step {
                let pixel = image.radiance(u, v).unwrap_or([f32::NAN; CHANNELS]);
                for (sum, value) in sum.iter_mut().zip(pixel) {
                    *sum += value;
                }
            }
        }
        sum.map(|sum| sum / (step * step) as f32)
    };
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(pixel: impl Fn(usize, usize) -> Radiance) -> Picture {
        let (width, height) = (40, 30);
        let pixels = (0..width * height).map(|k| pixel(k % width, k / width)).collect();
        Picture { width, height, pixels, notes: Vec::new() }
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let truth = picture(|x, y| [x as f32, y as f32, 1.0]);
        let score = compare("a", &truth, None, &truth);
        let expected = PictureScore {
            name: "a".into(),
            pixels: 1200,
            relative_rms: 0.0,
            psnr_db: None,
            mean_flip: 0.0,
            mean_hdr_flip: 0.0,
        };
        assert_eq!(score, expected);
    }

    #[test]
    fn a_factor_on_grey_has_the_error_of_its_srgb_values() {
        // White is the truth's own 2; the sRGB of 0.5 is 0.735357.
        let (truth, render) = (picture(|_, _| [2.0; 3]), picture(|_, _| [1.0; 3]));
        let score = compare("a", &render, None, &truth);
        assert!((score.relative_rms - 0.5).abs() < 1e-7);
        let expected = -20.0 * (1.0f64 - 0.735_357).log10();
        assert!((score.psnr_db.unwrap() - expected).abs() < 1e-3, "{score:?}");
        assert!(score.mean_flip > 0.05 && score.mean_flip < 1.0, "{score:?}");
    }

    #[test]
    fn what_is_unknown_in_either_does_not_count() {
        let truth = picture(|x, _| if x < 10 { [f32::NAN; 3] } else { [1.0; 3] });
        let render = picture(|x, _| if (10..20).contains(&x) { [50.0; 3] } else { [1.0; 3] });
        let coverage: Vec<f32> =
            (0..1200).map(|k| if (10..20).contains(&(k % 40)) { 0.5 } else { 1.0 }).collect();
        let score = compare("a", &render, Some(&coverage), &truth);
        assert_eq!((score.pixels, score.relative_rms, score.mean_flip), (600, 0.0, 0.0));
        assert_eq!(score.mean_hdr_flip, 0.0);
        let none = compare("a", &render, Some(&[0.0; 1200]), &truth);
        assert_eq!((none.pixels, none.psnr_db, none.mean_flip), (0, None, 0.0));
    }
}
