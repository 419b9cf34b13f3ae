//! The one rule by which a part of a model comes in or goes: paired cross-validation over blocks.
//!
//! Each model predicts blocks that it was not fitted to. What is compared is how much better one
//! predicts each block, since blocks differ far more among each other than models do. A part comes
//! in where the error falls by more than one standard error of the difference, and goes where it
//! does not rise by more.

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::Error;
use crate::reconstruct::joint::blocks;
use crate::reconstruct::joint::fit::{Fitted, ROUGH, descend, fit, starts_beside};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::sun::Directions;
use crate::reconstruct::joint::system::Fit;
use crate::reconstruct::joint::terms::loss;
use crate::reconstruct::solution::{Trial, TrialPart};

/// Folds in which every block is held out once.
const FOLDS: usize = 4;
/// By how much the variance of a difference is larger than if the fits of the folds had no rows in
/// common: 1 + K/(K − 1), for K folds (Nadeau and Bengio 2003, the corrected resampled t-test).
const SHARED_ROWS: f64 = 1.0 + FOLDS as f64 / (FOLDS - 1) as f64;
/// [`blocks::deal`]'s purpose of these folds.
const PURPOSE: u64 = 0;

/// A fit and what it makes of blocks that were held out.
#[derive(Clone)]
pub struct Validated {
    pub fitted: Fitted,
    /// The fits without each of the folds, from which those of a later model start.
    folds: Vec<Fitted>,
    /// Per row its weight times the robust loss of its prediction, all channels together.
    pub losses: Vec<f64>,
}

impl Validated {
    /// The same without the fits of the folds, which take memory, for a model that no later one starts from.
    pub fn without_folds(self) -> Self {
        Self { folds: Vec::new(), ..self }
    }
}

/// The difference of two models' errors in held-out blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairedCv {
    /// Roots of the mean losses of the two.
    pub before: f64,
    pub after: f64,
    /// after/before − 1.
    pub change: f64,
    /// Of `change`, from the differences of the blocks, enlarged where these are few (`student_quantile`);
    /// infinite where there are fewer than two, of all or of those that a sun reaches.
    pub standard_error: f64,
}

impl PairedCv {
    /// Whether the error falls by more than its standard error.
    pub fn is_better(&self) -> bool {
        self.is_better_beyond(1.0)
    }

    /// Whether it falls by more than so many standard errors.
    pub fn is_better_beyond(&self, standard_errors: f64) -> bool {
        -self.change > standard_errors * self.standard_error
    }

    /// What it says of a part of a model.
    pub fn trial(&self, part: TrialPart) -> Trial {
        Trial {
            part,
            before: self.before,
            after: self.after,
            change: self.change,
            standard_error: Some(self.standard_error).filter(|error| error.is_finite()),
            supported: self.is_better(),
        }
    }

    /// From the weight and the two losses of every block. The first stratum has the blocks that are
    /// reached by a sun which only one of the models has, the second all others.
    fn of_strata([mut reached, mut others]: [Vec<[f64; 3]>; 2]) -> Self {
        // The variance of a single block is unknown.
        if others.len() == 1 {
            reached.append(&mut others);
        }
        let strata = [reached, others];
        let all = strata.concat();
        let sum = |blocks: &[[f64; 3]], k: usize| blocks.iter().map(|block| block[k]).sum::<f64>();
        let weight = sum(&all, 0).max(f64::MIN_POSITIVE);
        let (before, after) = (sum(&all, 1) / weight, sum(&all, 2) / weight);
        // The variance of a ratio of sums, since blocks differ in weight, and its degrees of freedom.
        let variance = |blocks: &[[f64; 3]]| -> [f64; 2] {
            let weight = sum(blocks, 0).max(f64::MIN_POSITIVE);
            let fall = (sum(blocks, 1) - sum(blocks, 2)) / weight;
            let squares: f64 =
                blocks.iter().map(|block| (block[1] - block[2] - fall * block[0]).powi(2)).sum();
            let count = blocks.len() as f64;
            [squares * count / (count - 1.0), count - 1.0]
        };
        let variances: Vec<[f64; 2]> = strata
            .iter()
            .filter(|blocks| !blocks.is_empty())
            .map(|blocks| variance(blocks))
            .collect();
        let of_fall = variances.iter().map(|[variance, _]| variance).sum::<f64>().sqrt() / weight;
        let of_fall = of_fall * student_quantile(&variances);
        // Fits that share most of their rows err alike.
        let of_fall = of_fall * SHARED_ROWS.sqrt();
        // The change of the root is the fall divided by this, so that either is significant alike.
        let per_change = before + (before * after).sqrt();
        Self {
            before: before.sqrt(),
            after: after.sqrt(),
            change: if before > 0.0 { (after / before).sqrt() - 1.0 } else { 0.0 },
            // One block says nothing of how alike others would be.
            standard_error: if all.len() < 2 || strata[0].len() == 1 || per_change <= 0.0 {
                f64::INFINITY
            } else {
                of_fall / per_change
            },
        }
    }
}

/// The quantile of Student's t at the probability up to which a normal distribution has its mean plus one
/// standard deviation: by so much a standard error from few blocks is enlarged. Computed by the expansion of
/// Cornish and Fisher (Abramowitz and Stegun 26.7.5), with the degrees of freedom of Welch and Satterthwaite.
/// `strata` has the variance and the degrees of freedom of each stratum.
fn student_quantile(strata: &[[f64; 2]]) -> f64 {
    let variance: f64 = strata.iter().map(|[variance, _]| variance).sum();
    let inverse: f64 = strata
        .iter()
        .filter(|[part, _]| *part > 0.0)
        .map(|[part, degrees]| (part / variance).powi(2) / degrees)
        .sum();
    1.0 + inverse / 2.0 + inverse.powi(2) / 4.0 + inverse.powi(3) / 16.0
}

/// Compares two models of one problem.
pub fn compare(problem: &Problem, before: &Validated, after: &Validated) -> PairedCv {
    let mut of_block = vec![[0.0; 3]; problem.block_count()];
    for (row, &weight) in problem.weights.iter().enumerate() {
        let sums = &mut of_block[problem.block[row]];
        sums[0] += CHANNELS as f64 * weight;
        sums[1] += before.losses[row];
        sums[2] += after.losses[row];
    }
    let is_reached = reached(problem, before, after);
    let (mut lit, mut others) = (Vec::new(), Vec::new());
    for (sums, is_reached) in of_block.into_iter().zip(is_reached) {
        if sums[0] > 0.0 {
            if is_reached { &mut lit } else { &mut others }.push(sums);
        }
    }
    PairedCv::of_strata([lit, others])
}

/// Per block whether a sun that only one of two models has reaches it: blocks that it does not
/// reach say nothing of how equally it helps those that it does.
fn reached(problem: &Problem, before: &Validated, after: &Validated) -> Vec<bool> {
    let mut reached = vec![false; problem.block_count()];
    let suns = [before, after].map(|model| model.fitted.model.sun());
    if let [Some(sun), None] | [None, Some(sun)] = suns {
        for (row, &block) in problem.block.iter().enumerate() {
            reached[block] |= problem.weights[row] > 0.0 && sun.coupling[(row, 0)] > 0.0;
        }
    }
    reached
}

/// Fits the rows without one fold at a time, and predicts its rows. Where an earlier model that is much
/// like this one is given, its folds are where these fits start.
///
/// # Errors
/// If it is cancelled, or if the bounded least squares of a step fails.
pub fn validate(
    problem: &Problem,
    fitted: Fitted,
    earlier: Option<&Validated>,
) -> Result<Validated, Error> {
    let earlier = earlier.filter(|earlier| fitted.is_like(&earlier.fitted));
    validate_by(problem, fitted, |fitted, blind, fold| {
        let before = earlier.and_then(|earlier| Some((&earlier.fitted, earlier.folds.get(fold)?)));
        let starts = match before {
            Some((whole, part)) => starts_beside(problem, fitted, whole, part),
            None => fitted.starts(),
        };
        let Fitted { model, rows, design, .. } = fitted;
        let channels =
            descend(blind, model, design, &blind.weights, starts, ROUGH, |_| Vec::new())?;
        Ok(Fitted { model: model.clone(), rows: rows.clone(), design: design.clone(), channels })
    })
}

/// The same for a model with a sun that was found: a direction that was found with the rows that judge
/// it would be judged too well, so that it is looked for without them.
///
/// # Errors
/// As [`validate`].
pub fn validate_sun(
    problem: &Problem,
    fitted: Fitted,
    directions: &Directions,
) -> Result<Validated, Error> {
    let Some(slot) = fitted.model.sun().map(|sun| sun.slot) else {
        return validate(problem, fitted, None);
    };
    validate_by(problem, fitted, |fitted, blind, _| {
        let without = fit(blind, &fitted.model.without(slot), Some(fitted), ROUGH)?;
        let (starts, _) = directions.first(blind, &without);
        match directions.add(blind, &without, &starts)? {
            Some(with) => directions.settle(blind, with),
            None => Ok(without),
        }
    })
}

/// Predicts every fold's rows by the `refit` of a model to the problem without them.
fn validate_by<'a>(
    problem: &Problem<'a>,
    fitted: Fitted,
    refit: impl Fn(&Fitted, &Problem<'a>, usize) -> Result<Fitted, Error> + Sync,
) -> Result<Validated, Error> {
    let fold = blocks::deal(problem.block_count(), FOLDS, PURPOSE);
    let is_held = |row: usize, held: usize| fold[problem.block[row]] == held;
    let folds: Vec<Fitted> = (0..FOLDS)
        .into_par_iter()
        .map(|held| {
            let weights = kept_weights(problem, |row| is_held(row, held));
            refit(&fitted, &problem.with_weights(weights), held)
        })
        .collect::<Result<_, Error>>()?;
    let loss_of = |row: usize| row_loss(problem, &folds[fold[problem.block[row]]].channels, row);
    let losses = (0..problem.weights.len()).map(loss_of).collect();
    Ok(Validated { fitted, folds, losses })
}

/// The weights of the rows, 0 for those that are held out.
fn kept_weights(problem: &Problem, is_held: impl Fn(usize) -> bool) -> Vec<f64> {
    let weights = problem.weights.iter().enumerate();
    weights.map(|(row, &weight)| if is_held(row) { 0.0 } else { weight }).collect()
}

/// Root mean square of log(computed/measured) of rows that are held out of a fit, per channel;
/// `None` without such rows.
///
/// # Errors
/// As [`validate`].
pub fn held_out_error(
    problem: &Problem,
    fitted: &Fitted,
    is_held: impl Fn(usize) -> bool,
) -> Result<Option<Rgb>, Error> {
    let (model, design, starts) = (&fitted.model, &fitted.design, fitted.starts());
    let weights = kept_weights(problem, &is_held);
    let fits = descend(problem, model, design, &weights, starts, ROUGH, |_| Vec::new())?;
    let (mut sums, mut total) = ([0.0; CHANNELS], 0.0);
    for row in (0..problem.weights.len()).filter(|&row| is_held(row)) {
        let weight = problem.weights[row];
        total += weight;
        for (sum, fit) in sums.iter_mut().zip(&fits) {
            *sum += weight * fit.residuals[row].powi(2);
        }
    }
    Ok((total > 0.0).then(|| sums.map(|sum| (sum / total).sqrt())))
}

fn row_loss(problem: &Problem, fits: &[Fit], row: usize) -> f64 {
    let weight = problem.weights[row];
    // Not even an infinity counts where there is no weight.
    if weight <= 0.0 {
        return 0.0;
    }
    let robust = problem.priors.robust[problem.rows.material[row]];
    weight * fits.iter().map(|fit| loss(fit.residuals[row], robust)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_paired_and_their_error_is_that_of_their_mean() {
        // Equal weights: the fall is the mean of 0.2, 0.4, 0.6, its error 0.2/√3 by hand, times √(7/3)
        // for four folds and 1.3203 for two degrees of freedom.
        let blocks = [[1.0, 1.0, 0.8], [1.0, 9.0, 8.6], [1.0, 2.0, 1.4]];
        let change = PairedCv::of_strata([blocks.to_vec(), Vec::new()]);
        assert!((change.before - 4.0f64.sqrt()).abs() < 1e-12);
        assert!((change.change - ((3.6f64 / 4.0).sqrt() - 1.0)).abs() < 1e-12);
        let of_fall = 0.2 / 3.0f64.sqrt() * (7.0f64 / 3.0).sqrt() * 1.320_312_5;
        let of_root = of_fall / (4.0 + (4.0f64 * 3.6).sqrt());
        assert!((change.standard_error - of_root).abs() < 1e-12, "{change:?}");
        // However different the blocks are, all of them fell.
        assert!(change.is_better());
        let mixed = PairedCv::of_strata([
            vec![[1.0, 1.0, 0.5], [1.0, 1.0, 1.4], [1.0, 1.0, 1.0]],
            Vec::new(),
        ]);
        assert!(mixed.change < 0.0 && !mixed.is_better(), "{mixed:?}");
        for few in [&blocks[..1], &[], &[[1.0, 0.0, 0.0]; 3]] {
            let none = PairedCv::of_strata([few.to_vec(), Vec::new()]);
            assert!(!none.is_better(), "{none:?}");
        }
    }

    /// How many standard errors the fall of the mean loss is, and the change of its root, is one number.
    #[test]
    fn a_large_fall_is_as_certain_as_the_fall_of_the_mean_loss() {
        // Falls 4 and 2, mean 3 ± 1, times √(7/3) and 1.8125 for one degree of freedom, by hand.
        let blocks = vec![[1.0, 5.0, 1.0], [1.0, 2.5, 0.5]];
        let change = PairedCv::of_strata([blocks, Vec::new()]);
        let expected = 3.0 / (7.0f64 / 3.0).sqrt() / 1.8125;
        assert!((-change.change / change.standard_error - expected).abs() < 1e-12, "{change:?}");
    }

    /// A light that reaches three of a hundred blocks and halves the error of each.
    #[test]
    fn what_helps_every_block_that_it_reaches_is_certain_however_few_these_are() {
        let reached = vec![[1.0, 2.0, 1.0]; 3];
        let others = vec![[1.0, 1.0, 1.0]; 97];
        let by_strata = PairedCv::of_strata([reached.clone(), others.clone()]);
        assert!(by_strata.standard_error < 1e-12, "{by_strata:?}");
        let together = PairedCv::of_strata([[reached, others.clone()].concat(), Vec::new()]);
        assert!((by_strata.change - together.change).abs() < 1e-12);
        // √(3 · 0.97 · 100/99) blocks' worth of 3, by hand, times √(7/3), for 99 degrees of freedom.
        let of_fall = (3.0 * 0.97 * 100.0f64 / 99.0 * 7.0 / 3.0).sqrt() / 100.0;
        let of_fall =
            of_fall * (1.0 + 0.5 / 99.0 + 0.25 / 99.0f64.powi(2) + 99.0f64.powi(-3) / 16.0);
        let of_root = of_fall / (1.03 + 1.03f64.sqrt());
        assert!((together.standard_error - of_root).abs() < 1e-12, "{together:?}");
        // One block alone says nothing of how alike others would be.
        let one = PairedCv::of_strata([vec![[1.0, 2.0, 1.0]], others]);
        assert!(!one.is_better(), "{one:?}");
    }

    #[test]
    fn the_quantile_is_that_of_student() {
        // Quantiles of Student's t at 0.84134, by numerical integration of its density.
        for (degrees, quantile) in [(1.0, 1.8373), (2.0, 1.3213), (3.0, 1.1969), (10.0, 1.0526)] {
            let found = student_quantile(&[[0.3, degrees]]);
            assert!((found / quantile - 1.0).abs() < 0.015, "{degrees}: {found}");
        }
        // Two strata of equal variance and degrees of freedom have twice as many together.
        assert!(
            (student_quantile(&[[0.3, 5.0]; 2]) - student_quantile(&[[0.3, 10.0]])).abs() < 1e-12
        );
        assert!((student_quantile(&[[0.0, 5.0]]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_single_block_that_a_sun_does_not_reach_is_taken_with_the_others() {
        let reached = vec![[1.0, 2.0, 1.0]; 3];
        let with = PairedCv::of_strata([reached.clone(), vec![[1.0, 2.0, 1.0]]]);
        assert_eq!(with, PairedCv::of_strata([[reached, vec![[1.0, 2.0, 1.0]]].concat(), vec![]]));
    }
}
