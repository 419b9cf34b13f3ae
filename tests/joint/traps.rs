//! Estimators that look right and are wrong, each on data made with known reflectances, over many
//! draws of the noise; and what no estimator can find.
//!
//! A bias is told from chance by its z-score, the mean over the draws in units of its standard
//! error: beyond 5 it is certain, and within 3.3 (1 in 1000) none is seen.

use faer::Mat;
use lobelia::reconstruct::joint::system::{Fit, Linearisation, Objective, Rows};
use lobelia::solve::bounded::{BoundedOptions, BoundedProblem, Bounds, bounded_least_squares};
use lobelia::watch::Watch;

use crate::scenes::{Held, Recipe, Scene, mean, mean_difference, reflectances, z_score};

const DRAWS: u64 = 24;
const CERTAIN: f64 = 5.0;
const CHANCE: f64 = 3.3;

/// min Σ w² (Y a − K E − I)² with a = 1/ρ ≥ 1, E ≥ 0 and w = 1/Y: linear and convex, but the
/// measured Y multiplies an unknown.
fn linear_reflectances(scene: &Scene, rows: &Rows) -> Vec<f64> {
    let (count, columns) = (scene.material.len(), scene.design.columns());
    let materials = scene.reflectance.len();
    let radiance: Vec<f64> = rows.log_radiance[0].iter().map(|log| log.exp()).collect();
    let matrix = Mat::from_fn(count, columns + materials, |i, j| {
        if j < columns {
            -f64::from(scene.design.diffuse[(i, j)])
        } else if scene.material[i] == j - columns {
            radiance[i]
        } else {
            0.0
        }
    });
    let weights: Vec<f64> = radiance.iter().map(|y| 1.0 / y).collect();
    let mut lower = vec![0.0; columns];
    lower.resize(columns + materials, 1.0);
    let problem = BoundedProblem {
        matrix: matrix.as_ref(),
        target: &scene.design.base[0],
        weights: Some(&weights),
        bounds: Bounds::Between { lower: &lower, upper: &vec![f64::INFINITY; lower.len()] },
        ridge: 0.0,
    };
    let options = BoundedOptions::default();
    let solved = bounded_least_squares(&problem, None, &options, &Watch::new());
    solved.expect("all is finite").x[columns..].iter().map(|a| 1.0 / a).collect()
}

/// The mean of log(estimated/true), in which the common scale is what is left.
fn log_bias(estimated: &[f64], truth: &[f64]) -> f64 {
    mean(&estimated.iter().zip(truth).map(|(e, t)| (e / t).ln()).collect::<Vec<_>>())
}

#[test]
fn linear_form_in_inverse_reflectance_is_biased() {
    let scene = Recipe { base: 0.15, rows: 1200, ..Recipe::default() }.make();
    let held = scene.held(Objective::Log);
    let (mut linear_error, mut log_error) = (Vec::new(), Vec::new());
    let (mut linear_bias, mut log_bias_of_fit) = (Vec::new(), Vec::new());
    for seed in 0..DRAWS {
        let rows = scene.seen(&scene.noise(seed, 0.05));
        let linear = linear_reflectances(&scene, &rows);
        let fitted = reflectances(&scene.fit(&rows, &held, &scene.start(0.5)).state);
        linear_error.push(mean_difference(&linear, &scene.reflectance));
        log_error.push(mean_difference(&fitted, &scene.reflectance));
        linear_bias.push(log_bias(&linear, &scene.reflectance));
        log_bias_of_fit.push(log_bias(&fitted, &scene.reflectance));
    }
    println!(
        "linear: err {:.4}, bias {:+.4} (z {:.1}); log: err {:.4}, bias {:+.4} (z {:.1})",
        mean(&linear_error),
        mean(&linear_bias),
        z_score(&linear_bias),
        mean(&log_error),
        mean(&log_bias_of_fit),
        z_score(&log_bias_of_fit)
    );
    // Upwards, as the noise shrinks 1/ρ.
    assert!(z_score(&linear_bias) > CERTAIN);
    // Not none for the logarithms, as E ≥ 0 lets noise only add light; but a tenth.
    assert!(mean(&log_bias_of_fit).abs() < 0.15 * mean(&linear_bias));
    assert!(mean(&linear_error) > 3.0 * mean(&log_error));
    // Without noise the linear form is right: it is the noise that misleads it.
    let clean = linear_reflectances(&scene, &scene.seen(&scene.noise(0, 0.0)));
    assert!(mean_difference(&clean, &scene.reflectance) < 1e-6, "{clean:?}");
}

/// A texture's reflectance here is its geometric mean.
#[test]
fn relative_residuals_are_biased_by_texture() {
    let scene = Recipe { rows: 1800, ..Recipe::default() }.make();
    let textured = |m: usize| m < 2;
    let biases = |objective: Objective, sd: f64| -> Vec<f64> {
        let held = scene.held(objective);
        let draw = |seed| {
            let mut errors = scene.noise(seed, 0.05);
            for ((error, texture), &m) in
                errors.iter_mut().zip(scene.noise(seed + 1000, sd)).zip(&scene.material)
            {
                *error += if textured(m) { texture } else { 0.0 };
            }
            let fit = scene.fit(&scene.seen(&errors), &held, &scene.start(0.5));
            log_bias(&reflectances(&fit.state)[..2], &scene.reflectance[..2])
        };
        (0..DRAWS).map(draw).collect()
    };
    for sd in [0.35, 0.5] {
        let (log, relative) = (biases(Objective::Log, sd), biases(Objective::Relative, sd));
        println!(
            "texture {sd}: log {:+.4} (z {:.1}), relative {:+.4} (z {:.1})",
            mean(&log),
            z_score(&log),
            mean(&relative),
            z_score(&relative)
        );
        assert!(z_score(&log).abs() < CHANCE);
        assert!(z_score(&relative).abs() > CERTAIN);
        assert!(mean(&relative).abs() > 4.0 * mean(&log).abs());
    }
}

/// The Jacobian's columns of log ρ with the lit columns projected out, as U diag(s) Vᵀ.
struct Projected {
    u: Mat<f64>,
    v: Mat<f64>,
    /// Falling.
    singular: Vec<f64>,
}

impl Projected {
    fn new(normal: &Linearisation, materials: usize) -> Self {
        let lit = normal.lit.len();
        let light = normal.jacobian.subcols(0, lit);
        let mut rest = normal.jacobian.subcols(lit, materials).to_owned();
        // Twice, so that rounding leaves nothing behind.
        let q = light.qr().compute_thin_Q();
        for _ in 0..2 {
            rest = &rest - &q * (q.transpose() * &rest);
        }
        let svd = rest.thin_svd().expect("all is finite");
        let singular = svd.S().column_vector().iter().copied().collect();
        Self { u: svd.U().to_owned(), v: svd.V().to_owned(), singular }
    }

    /// How much log ρ of a material moves with each row's weighted residual.
    fn influence(&self, material: usize) -> Vec<f64> {
        let part = |i: usize, k: usize| self.u[(i, k)] * self.v[(material, k)] / self.singular[k];
        let count = self.singular.len();
        (0..self.u.nrows()).map(|i| (0..count).map(|k| part(i, k)).sum()).collect()
    }
}

/// Standard deviations of every log ρ: as if rows were independent, and by blocks.
fn deviations(scene: &Scene, rows: &Rows, held: &Held, fit: &Fit) -> (Vec<f64>, Vec<f64>) {
    let normal = scene.channel(rows).linearisation(&held.terms(), fit);
    let materials = scene.reflectance.len();
    let projected = Projected::new(&normal, materials);
    let squares: f64 = normal.residual.iter().map(|r| r * r).sum();
    let variance = squares / (normal.residual.len() - normal.lit.len() - materials) as f64;
    let blocks = scene.block.iter().max().map_or(0, |last| last + 1);
    (0..materials)
        .map(|m| {
            let influence = projected.influence(m);
            let independent = influence.iter().map(|t| t * t * variance).sum::<f64>().sqrt();
            let mut sums = vec![0.0; blocks];
            for ((t, r), &block) in influence.iter().zip(&normal.residual).zip(&scene.block) {
                sums[block] += t * r;
            }
            (independent, sums.iter().map(|s| s * s).sum::<f64>().sqrt())
        })
        .unzip()
}

#[test]
fn independent_rows_make_intervals_too_narrow() {
    let scene = Recipe { rows: 1200, base: 0.3, ..Recipe::default() }.make();
    let held = scene.held(Objective::Log);
    let blocks = scene.block.iter().max().map_or(0, |last| last + 1);
    // Nominal 95 %: the share of reflectances within 1.96 deviations of the truth.
    let coverage = |block_sd: f64, row_sd: f64| {
        let (mut independent, mut sandwich, mut count) = (0.0, 0.0, 0.0);
        for seed in 0..40 {
            let of_blocks = scene.noise(seed + 1000, block_sd);
            assert!(blocks <= of_blocks.len());
            let mut errors = scene.noise(seed, row_sd);
            errors.iter_mut().zip(&scene.block).for_each(|(e, &block)| *e += of_blocks[block]);
            let rows = scene.seen(&errors);
            let fit = scene.fit(&rows, &held, &scene.start(0.5));
            let (iid, clustered) = deviations(&scene, &rows, &held, &fit);
            for (m, rho) in scene.reflectance.iter().enumerate() {
                let away = (fit.state.log_diffuse[m] - rho.ln()).abs();
                independent += f64::from(u8::from(away < 1.96 * iid[m]));
                sandwich += f64::from(u8::from(away < 1.96 * clustered[m]));
                count += 1.0;
            }
        }
        (independent / count, sandwich / count)
    };
    let (white_iid, white_sandwich) = coverage(0.0, 0.05);
    let (iid, sandwich) = coverage(0.05, 0.02);
    println!("independent rows: {white_iid:.2} and {white_sandwich:.2} by blocks");
    println!("correlated rows: {iid:.2} and {sandwich:.2} by blocks");
    // Where rows are independent, the covariance is right: it is the correlation that breaks it.
    assert!(white_iid > 0.85, "{white_iid}");
    assert!(iid < 0.8 && iid < white_iid - 0.1, "{iid}");
    assert!(sandwich > iid + 0.1, "{sandwich} against {iid}");
}

#[test]
fn common_scale_is_lost_without_interreflected_light() {
    let weakest = |base: f64, seed: u64| {
        let scene = Recipe { seed, base, ..Recipe::default() }.make();
        let rows = scene.seen(&scene.noise(seed, 0.05));
        let held = scene.held(Objective::Log);
        let fit = scene.fit(&rows, &held, &scene.start(0.3));
        let normal = scene.channel(&rows).linearisation(&held.terms(), &fit);
        let materials = scene.reflectance.len();
        let projected = Projected::new(&normal, materials);
        let last = materials - 1;
        // The part of the weakest direction that is the same for all.
        let common = (0..materials).map(|m| projected.v[(m, last)]).sum::<f64>().abs();
        println!("I_s {base}, scene {seed}: {:.2?}, common {common:.6}", projected.singular);
        let ratio = projected.singular[last] / projected.singular[last - 1];
        (projected.singular[last], ratio, common / (materials as f64).sqrt())
    };
    for seed in 1..=3 {
        let (_, ratio, common) = weakest(0.0, seed);
        assert!(ratio < 1e-6, "{ratio}");
        assert!(common > 1.0 - 1e-6, "{common}");
        let (half, half_ratio, half_common) = weakest(0.1, seed);
        let (whole, ratio, _) = weakest(0.2, seed);
        // It is the scale that I_s brings, and the more of it the better.
        assert!(half_common > 0.95, "{half_common}");
        assert!(half_ratio > 1e-2 && ratio > half_ratio, "{half_ratio} {ratio}");
        assert!(whole > 1.5 * half, "{half} {whole}");
    }
}

/// Dimmer light costs an absolute ridge less, and reflectances make up for it; relative to the light as
/// a whole the same emissions cost the same however bright they are.
#[test]
fn an_absolute_ridge_makes_reflectances_too_high() {
    let mut biases = [Vec::new(), Vec::new()];
    for seed in 0..DRAWS {
        let scene = Recipe { seed, lights: 20, ..Recipe::default() }.make();
        let rows = scene.seen(&scene.noise(seed, 0.02));
        for (biases, relative_ridge) in biases.iter_mut().zip([false, true]) {
            let plain = scene.held(Objective::Log);
            let ridge = vec![0.01; scene.design.columns()];
            let held = Held { ridge, relative_ridge, ..plain };
            let fit = scene.fit(&rows, &held, &scene.start(0.5));
            biases.push(log_bias(&reflectances(&fit.state), &scene.reflectance));
        }
    }
    let certainty = z_score(&biases[0]);
    let [absolute, relative] = biases.map(|of| mean(&of));
    println!("bias {absolute:.3} ({certainty:.1} standard errors), relative {relative:.3}");
    assert!(absolute > 0.0 && certainty > CERTAIN, "{absolute}, {certainty}");
    assert!(relative.abs() < 0.5 * absolute, "{relative} beside {absolute}");
}
