//! Samples and tags that do not fit, found and told.

use crate::reconstruct::joint::fit::{Fits, Fitter};

/// A sample is taken to emit light when it is brighter than computed by this factor in every
/// channel: while lamps are still to be found, whose light looks like that nearby, and with them.
pub const EMITS_CLEARLY: f64 = 4.0;
pub const EMITS: f64 = 1.5;
/// It is brighter, too, by this many of its material's own deviations.
const EMITS_DEVIATIONS: f64 = 4.0;
/// Fewer such samples of a surface are not worth a word.
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

/// Drops samples that emit light of their own, and says where they are.
pub fn drop_emitters(fitter: &mut Fitter, fits: &Fits, factor: f64) -> Vec<String> {
    let capture = fitter.data.views.capture;
    let mut of_surface = vec![0usize; capture.surfaces.len()];
    let mut dropped = Vec::new();
    for material in 0..fitter.rows.materials {
        // A highlight is as bright.
        if fitter.is_specular(material) {
            continue;
        }
        let rows: Vec<usize> = rows_of(fitter, material).collect();
        let limit = fits
            .iter()
            .map(|fit| EMITS_DEVIATIONS * deviation(rows.iter().map(|&r| fit.residuals[r])))
            .fold(factor.ln(), f64::max);
        for row in rows {
            if fits.iter().all(|fit| -fit.residuals[row] > limit) {
                let sample = fitter.rows.sample[row];
                of_surface[fitter.data.cloud.samples[sample].surface] += 1;
                dropped.push(row);
            }
        }
    }
    let mut warnings = Vec::new();
    for row in dropped {
        let surface = fitter.data.cloud.samples[fitter.rows.sample[row]].surface;
        if of_surface[surface] >= ENOUGH_EMITTERS {
            fitter.weights[row] = 0.0;
        }
    }
    for (surface, count) in of_surface.into_iter().enumerate() {
        if count >= ENOUGH_EMITTERS {
            warnings.push(format!(
                "{count} samples on \"{}\" are far brighter than light falling on them explains \
                 and are left out: if something shines there, model it and tag it as a visible \
                 light",
                capture.surfaces[surface].name
            ));
        }
    }
    warnings
}

/// What the residuals say about the tags.
pub fn examine(fitter: &Fitter, fits: &Fits) -> Vec<String> {
    let capture = fitter.data.views.capture;
    let mut warnings = Vec::new();
    let rms: Vec<Option<f64>> = (0..fitter.rows.materials)
        .map(|material| {
            let (mut sum, mut count) = (0.0, 0.0);
            for row in rows_of(fitter, material) {
                sum += fits.iter().map(|fit| fit.residuals[row].powi(2)).sum::<f64>();
                count += fits.len() as f64;
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
                "the known reflectance of \"{}\" rests on a material that the light does not \
                 explain well (error {:.0} %): its own error goes to all the others; pin a \
                 uniform, well lit material instead",
                material.name,
                100.0 * rms
            ));
        }
        if material.textured || !stands_out {
            continue;
        }
        warnings.push(match apart(fitter, fits, index) {
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
                surfaces_of(fitter, index)
            ),
        });
    }
    if fitter.options.robust == 0.0 {
        let tail = heavy_tail(fitter, fits);
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

fn rows_of<'a>(fitter: &'a Fitter, material: usize) -> impl Iterator<Item = usize> + 'a {
    (0..fitter.rows.sample.len())
        .filter(move |&row| fitter.rows.material[row] == material && fitter.weights[row] > 0.0)
}

fn surfaces_of(fitter: &Fitter, material: usize) -> String {
    let capture = fitter.data.views.capture;
    let names: Vec<String> = capture.materials[material]
        .surfaces
        .iter()
        .map(|&surface| format!("\"{}\"", capture.surfaces[surface].name))
        .collect();
    names.join(", ")
}

/// Median absolute deviation from 0, as the standard deviation of a normal distribution.
pub fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).map_or(0.0, |median| 1.4826 * median)
}

/// The surfaces of a material whose residuals are most different, if they are.
fn apart(fitter: &Fitter, fits: &Fits, material: usize) -> Option<(usize, usize)> {
    let surfaces = &fitter.data.views.capture.materials[material].surfaces;
    let mut means: Vec<(f64, usize)> = surfaces
        .iter()
        .filter_map(|&surface| {
            let (mut sum, mut count) = (0.0, 0.0);
            for row in rows_of(fitter, material) {
                if fitter.data.cloud.samples[fitter.rows.sample[row]].surface == surface {
                    sum += fits.iter().map(|fit| fit.residuals[row]).sum::<f64>();
                    count += fits.len() as f64;
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
fn heavy_tail(fitter: &Fitter, fits: &Fits) -> f64 {
    let (mut beyond, mut all) = (0usize, 0usize);
    for material in 0..fitter.rows.materials {
        if fitter.data.views.capture.materials[material].textured {
            continue;
        }
        let rows: Vec<usize> = rows_of(fitter, material).collect();
        for fit in fits {
            let limit = 4.0 * deviation(rows.iter().map(|&row| fit.residuals[row]));
            beyond += rows.iter().filter(|&&row| fit.residuals[row].abs() > limit).count();
            all += rows.len();
        }
    }
    beyond as f64 / all.max(1) as f64
}
