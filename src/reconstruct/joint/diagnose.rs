//! Finds samples and tags that do not fit the model, and makes the warnings about them.

use crate::math::statistics::robust_deviation;
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::problem::Problem;

/// A sample is taken to emit light when it is brighter than computed by this factor in every
/// channel.
pub const EMITS: f64 = 1.5;
/// Its residual also has to be above this many standard deviations of its material's residuals.
const EMITS_DEVIATIONS: f64 = 4.0;
/// For fewer such samples of a surface there is no warning.
const ENOUGH_EMITTERS: usize = 3;
/// A material whose error is above this and this many times that of the others is not one
/// uniform material.
const STRUCTURED: f64 = 0.12;
const STRUCTURED_FACTOR: f64 = 2.0;
/// Surfaces under one tag are taken to be different materials when their mean logarithms differ
/// by more than this.
const APART: f64 = 0.15;
/// A larger part of the residuals than this beyond four robust deviations calls for the robust
/// loss; of a normal distribution it is 0.0001.
const HEAVY_TAIL: f64 = 0.02;

/// The problem without samples that emit light, and a warning for each of their surfaces. A sample
/// counts as emitting if it is brighter than computed by `factor` in every channel.
pub fn without_emitters<'a>(
    problem: &Problem<'a>,
    fitted: &Fitted,
    factor: f64,
) -> (Problem<'a>, Vec<String>) {
    let capture = problem.capture();
    let mut of_surface = vec![0usize; capture.surfaces.len()];
    let mut emitting = Vec::new();
    // A highlight is as bright.
    let diffuse = (0..problem.materials()).filter(|&m| fitted.model.gloss[m].is_none());
    for material in diffuse {
        let rows: Vec<usize> = problem.rows_of(material).collect();
        let limit = fitted
            .channels
            .iter()
            .map(|fit| EMITS_DEVIATIONS * robust_deviation(rows.iter().map(|&r| fit.residuals[r])))
            .fold(factor.ln(), f64::max);
        for row in rows {
            if fitted.channels.iter().all(|fit| -fit.residuals[row] > limit) {
                let surface = problem.data.cloud.samples[problem.rows.sample[row]].surface;
                of_surface[surface] += 1;
                emitting.push((row, surface));
            }
        }
    }
    let mut weights = (*problem.weights).clone();
    for (row, surface) in emitting {
        if of_surface[surface] >= ENOUGH_EMITTERS {
            weights[row] = 0.0;
        }
    }
    let warnings = of_surface
        .iter()
        .enumerate()
        .filter(|(_, count)| **count >= ENOUGH_EMITTERS)
        .map(|(surface, count)| {
            format!(
                "{count} samples on \"{}\" are far brighter than the light model accounts for, and \
                 are left out: photographs may show a lamp or another thing in front of it; model \
                 it (tag a lamp as a visible light) or mask it",
                capture.surfaces[surface].name
            )
        })
        .collect();
    (problem.with_weights(weights), warnings)
}

/// Warnings about tags that contradict the residuals.
pub fn examine(problem: &Problem, fitted: &Fitted) -> Vec<String> {
    let capture = problem.capture();
    let mut warnings = Vec::new();
    let rms: Vec<Option<f64>> = (0..problem.materials())
        .map(|material| {
            let (mut sum, mut count) = (0.0, 0.0);
            for row in problem.rows_of(material) {
                sum += fitted.channels.iter().map(|fit| fit.residuals[row].powi(2)).sum::<f64>();
                count += fitted.channels.len() as f64;
            }
            (count > 0.0).then(|| (sum / count).sqrt())
        })
        .collect();
    let mut plain: Vec<f64> = rms
        .iter()
        .zip(&capture.materials)
        .filter(|(_, material)| !material.textured)
        .filter_map(|(rms, _)| *rms)
        .collect();
    plain.sort_by(f64::total_cmp);
    let typical = plain.get(plain.len() / 2).copied().unwrap_or(0.0);
    for (index, material) in capture.materials.iter().enumerate() {
        let Some(rms) = rms[index] else { continue };
        let stands_out = rms > STRUCTURED && rms > STRUCTURED_FACTOR * typical;
        if material.known_diffuse.is_some() && rms > STRUCTURED {
            warnings.push(format!(
                "the known reflectance of \"{}\" rests on a material that the light model fits \
                 badly (error {:.0} %): its own error is passed on to all the others; pin a \
                 uniform, well lit material instead",
                material.name,
                100.0 * rms
            ));
        }
        if material.textured || !stands_out {
            continue;
        }
        warnings.push(match apart(problem, fitted, index) {
            Some((dark, bright)) => format!(
                "\"{}\" fits badly (error {:.0} %, elsewhere {:.0} %): the surfaces \"{}\" and \
                 \"{}\" under this tag look like two materials",
                material.name,
                100.0 * rms,
                100.0 * typical,
                capture.surfaces[bright].name,
                capture.surfaces[dark].name
            ),
            None => format!(
                "\"{}\" fits badly (error {:.0} %, elsewhere {:.0} %): its reflectance seems to \
                 vary over {}; tag it as textured, or give its parts their own materials",
                material.name,
                100.0 * rms,
                100.0 * typical,
                surfaces_of(problem, index)
            ),
        });
    }
    if problem.options().robust == 0.0 {
        let tail = heavy_tail(problem, fitted);
        if tail > HEAVY_TAIL {
            warnings.push(format!(
                "{:.0} % of the samples fit far worse than the rest: if cameras or geometry are \
                 off by some pixels, or surfaces textured, joint.robust = 2.5 makes them count \
                 less",
                100.0 * tail
            ));
        }
    }
    warnings
}

fn surfaces_of(problem: &Problem, material: usize) -> String {
    let capture = problem.capture();
    let names: Vec<String> = capture.materials[material]
        .surfaces
        .iter()
        .map(|&surface| format!("\"{}\"", capture.surfaces[surface].name))
        .collect();
    names.join(", ")
}

/// The surfaces of a material whose residuals are most different, if they are.
fn apart(problem: &Problem, fitted: &Fitted, material: usize) -> Option<(usize, usize)> {
    let surfaces = &problem.capture().materials[material].surfaces;
    let mut means: Vec<(f64, usize)> = surfaces
        .iter()
        .filter_map(|&surface| {
            let (mut sum, mut count) = (0.0, 0.0);
            for row in problem.rows_of(material) {
                if problem.data.cloud.samples[problem.rows.sample[row]].surface == surface {
                    sum += fitted.channels.iter().map(|fit| fit.residuals[row]).sum::<f64>();
                    count += fitted.channels.len() as f64;
                }
            }
            (count > 0.0).then(|| (sum / count, surface))
        })
        .collect();
    means.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (bright, dark) = (means.first()?, means.last()?);
    (dark.0 - bright.0 > APART).then_some((dark.1, bright.1))
}

/// The part of the rows whose residual is beyond four robust deviations of their material.
fn heavy_tail(problem: &Problem, fitted: &Fitted) -> f64 {
    let (mut beyond, mut all) = (0usize, 0usize);
    for material in 0..problem.materials() {
        if problem.capture().materials[material].textured {
            continue;
        }
        let rows: Vec<usize> = problem.rows_of(material).collect();
        for fit in &fitted.channels {
            let limit = 4.0 * robust_deviation(rows.iter().map(|&row| fit.residuals[row]));
            beyond += rows.iter().filter(|&&row| fit.residuals[row].abs() > limit).count();
            all += rows.len();
        }
    }
    beyond as f64 / all.max(1) as f64
}
