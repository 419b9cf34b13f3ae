//! Measures one reconstruction: time and memory, the error against the truth, and the error at
//! held-out samples and in a held-out photograph.

use serde::{Deserialize, Serialize};

use crate::geometry::bvh::RayCaster;
use crate::io::export::summary;
use crate::io::process;
use crate::io::truth::Truth;
use crate::math::rgb::CHANNELS;
use crate::reconstruct::{self, Options, Predicted};
use crate::render::edits::Edits;
use crate::render::scene::{Geometry, Scene, Solved};
use crate::render::{RenderOptions, render};
use crate::scene::{Capture, Views};
use crate::study::{pictures, score};
use crate::watch::Watch;

/// What one reconstruction took and gave.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// How many were placed.
    pub samples: usize,
    /// How many the light model has.
    pub lobes: usize,
    /// Seconds of stage `samples`.
    pub samples_s: f64,
    /// Seconds of stage `lights`.
    pub lights_s: f64,
    /// Seconds of stage `transport`.
    pub transport_s: f64,
    /// Seconds of stage `solve`.
    pub solve_s: f64,
    /// Seconds of stage `textures`.
    pub textures_s: f64,
    /// Of all stages; reading the files is no part of it.
    pub total_s: f64,
    /// Largest resident set while it ran, with the capture; none where the system does not tell.
    pub peak_mb: Option<f64>,
    /// Mean absolute error of the diffuse reflectances; none without a truth.
    pub error_raw: Option<f64>,
    /// The same after the one factor on all of them that makes it least.
    pub error_one_scale: Option<f64>,
    /// The same after such a factor for each channel.
    pub error_channel_scales: Option<f64>,
    /// Mean half-width of the 95 % intervals; none where there are no intervals.
    pub half_width: Option<f64>,
    /// How well the result predicts.
    #[serde(flatten)]
    pub held_out: HeldOut,
}

/// How well a result predicts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// RMS of computed − measured over that of measured, in samples of blocks that were held out.
    pub blocks_relative_rms: Option<f64>,
    /// The same over the pixels of a photograph that was held out and made anew; none where there
    /// is but one.
    pub photograph_relative_rms: Option<f64>,
    /// Mean FLIP of that photograph.
    pub photograph_flip: Option<f64>,
    /// Mean HDR-FLIP of that photograph.
    pub photograph_hdr_flip: Option<f64>,
}

/// Reconstructs and measures. `part` chooses the blocks and the photograph that are held out of a
/// second reconstruction; without it nothing is predicted.
pub fn measure(
    capture: &Capture,
    options: &Options,
    truth: Option<&Truth>,
    part: Option<usize>,
    watch: &Watch,
) -> Result<Measured, reconstruct::Error> {
    process::forget_peak_memory();
    let whole = reconstruct::run(capture, options, watch, &|_| ())?;
    let peak = process::peak_memory();
    let solution = summary(capture, options, &whole, 0.0);
    let score = truth.map(|truth| score::compare(&solution, truth));
    let [samples_s, lights_s, transport_s, solve_s, textures_s] = whole.seconds;
    let measured = Measured {
        samples: whole.samples.samples.len(),
        lobes: whole.lobes.lobes.len(),
        samples_s,
        lights_s,
        transport_s,
        solve_s,
        textures_s,
        total_s: whole.seconds.iter().sum(),
        peak_mb: peak.map(|bytes| (bytes as f64 / 1e6).round()),
        error_raw: score.as_ref().and_then(|s| s.raw).map(|e| e.mean_diffuse),
        error_one_scale: score.as_ref().and_then(|s| s.common_scale).map(|e| e.errors.mean_diffuse),
        error_channel_scales: score
            .as_ref()
            .and_then(|s| s.channel_scale)
            .map(|e| e.errors.mean_diffuse),
        half_width: score::mean_half_width(&solution),
        held_out: HeldOut::default(),
    };
    drop(whole);
    let held_out = match part {
        Some(part) => predict(capture, options, part, watch)?,
        None => HeldOut::default(),
    };
    Ok(Measured { held_out, ..measured })
}

/// Pixels across a picture that is made to be compared: smaller ones have less noise for the time.
const PICTURE_PX: usize = 240;

/// Reconstructs without a quarter of the blocks and one photograph, and predicts both.
fn predict(
    capture: &Capture,
    options: &Options,
    part: usize,
    watch: &Watch,
) -> Result<HeldOut, reconstruct::Error> {
    let measurements: Vec<usize> = capture.measurements().map(|(index, ..)| index).collect();
    let mut kept = capture.clone();
    let left_out = (measurements.len() > 1)
        .then(|| measurements[(part + measurements.len() / 2) % measurements.len()]);
    if let Some(photograph) = left_out {
        kept.photographs[photograph].image = None;
    }
    let (whole, predicted) =
        reconstruct::run_withholding(&kept, options, Some(part), watch, &|_| ())?;
    let mut held_out =
        HeldOut { blocks_relative_rms: relative_rms(&predicted), ..HeldOut::default() };
    let Some(photograph) = left_out else { return Ok(held_out) };
    let Some(image) = &capture.photographs[photograph].image else { return Ok(held_out) };

    let camera = &capture.photographs[photograph].camera;
    let step = camera.width.div_ceil(PICTURE_PX).max(1);
    let small = camera.reduced(step);
    let caster = RayCaster::build(&kept.mesh.positions, &kept.mesh.triangles);
    let views = Views::new(&kept, &caster, watch)?;
    let (edits, solved) = (Edits::default(), Solved::new(&kept, &whole));
    let geometry = Geometry::new(&kept, &solved, &edits);
    let scene = Scene::new(&views, &geometry, &solved, &edits, &[small.position.as_vec3()]);
    let pictures = RenderOptions { spp: 32, ..RenderOptions::default() };
    let film = render(&scene, &small, &pictures, watch, &|_| ())?;
    let score = pictures::against_photograph("", &film, image);
    if score.pixels > 0 {
        held_out.photograph_relative_rms = Some(score.relative_rms);
        held_out.photograph_flip = Some(score.mean_flip);
        held_out.photograph_hdr_flip = Some(score.mean_hdr_flip);
    }
    Ok(held_out)
}

fn relative_rms(predicted: &[Predicted]) -> Option<f64> {
    let (mut difference, mut total) = (0.0, 0.0);
    for sample in predicted {
        for c in 0..CHANNELS {
            difference += (sample.computed[c] - sample.measured[c]).powi(2);
            total += sample.measured[c].powi(2);
        }
    }
    (total > 0.0).then(|| (difference / total).sqrt())
}
