//! Section 5.3 and 5.4, Fig. 8: the iteration between emissions and reflectances, and its end.

use std::time::Instant;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::options;
use crate::reconstruct::emission::{self, EmissionOptions};
use crate::reconstruct::equations::{Equation, Equations};
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::options::Options;
use crate::reconstruct::reflectance;
use crate::reconstruct::solution::{Iteration, Rms, Solution, Stopped};
use crate::reconstruct::transport::Transport;
use crate::scene::{Brdf, Capture};
use crate::solve::bounded::BoundedError;
use crate::watch::Watch;

options! {
    /// The paper's alternation (Sections 5.2 to 5.4).
    RefineOptions in "refine" {
        /// The iteration stops when RMS before − RMS now < tolerance × RMS before (Section 5.4)
        /// for both the absolute and the relative error. When one then rises by as much, which
        /// the two half steps do not rule out, the iteration before is the result.
        rms_tolerance: f64 = 0.01, Some((0.0, 1.0)), "";
        /// Iterations at most; the first uses the initial reflectances.
        max_iterations: usize = 50, Some((1.0, 1e6)), "";
        /// Eq. 9 is weighted by 1/(L − L⁺), but by no more than 1/(this × L).
        weight_floor: f64 = 0.1, Some((1e-6, 1.0)), "";
        /// Ridge on the emissions, relative to their columns' norms (0 in the paper).
        ridge: f64 = 0.0, Some((0.0, 1.0)), "";
    }
}

/// RMS errors, relative to the mean radiance, below which changes are rounding.
const ROUNDING: f64 = 1e-6;

#[expect(clippy::too_many_arguments, reason = "every product of the stages before is needed")]
/// Alternates between Eq. 9 and Eq. 13 from the given reflectances until the RMS error settles.
pub fn refine(
    capture: &Capture,
    equations: &Equations,
    lobes: &Lobes,
    transport: &Transport,
    start: Vec<Option<Brdf>>,
    all_options: &Options,
    on_iteration: &dyn Fn(&Iteration),
    watch: &Watch,
) -> Result<Solution, BoundedError> {
    let began = Instant::now();
    let options = &all_options.refine;
    let emission_options =
        EmissionOptions { weight_floor: options.weight_floor, ridge: options.ridge };
    let mut solution = Solution {
        reflectances: start,
        optics: Vec::new(),
        emission: Vec::new(),
        iterations: Vec::new(),
        stopped: Stopped::IterationLimit,
        computed: Vec::new(),
        certainty: None,
        notes: Vec::new(),
        warnings: Vec::new(),
    };
    if equations.rows.is_empty() {
        solution.emission = vec![[0.0; CHANNELS]; lobes.lobes.len()];
        solution.stopped = Stopped::NothingToSolve;
        return Ok(solution);
    }
    watch.begin(options.max_iterations as u64);
    let mut unconverged = [false; CHANNELS];
    for index in 1..=options.max_iterations {
        let before = solution.clone();
        if index > 1 {
            reflectance::update(
                capture,
                equations,
                &mut solution.reflectances,
                &solution.emission,
                lobes,
                transport,
                &all_options.gloss,
                watch,
            )
            .map_err(BoundedError::from)?;
        }
        let warm = (index > 1).then_some(solution.emission.as_slice());
        let emissions = emission::solve(
            equations,
            &solution.reflectances,
            lobes,
            transport,
            &emission_options,
            warm,
            watch,
        )?;
        solution.emission = emissions.emission;
        unconverged = emissions.unconverged;
        solution.computed = reflectance::computed(
            equations,
            &solution.reflectances,
            &solution.emission,
            lobes,
            transport,
        );
        let iteration = Iteration {
            index,
            rms: rms(equations, equations.rows.iter().zip(&solution.computed)),
            objective: None,
            change: largest_change(&before.reflectances, &solution.reflectances),
            elapsed_secs: began.elapsed().as_secs_f64(),
        };
        on_iteration(&iteration);
        watch.tick().map_err(BoundedError::from)?;
        // Absolute errors are those of the brightest samples, while Eq. 9 weighs all alike: both
        // must have settled.
        let falls = solution.iterations.last().map(|last| {
            let mean = &equations.mean_radiance;
            let fall = |old: f64, new: f64| (old - new) / old.max(ROUNDING);
            [
                fall(last.rms.total(mean), iteration.rms.total(mean)),
                fall(last.rms.total_relative(), iteration.rms.total_relative()),
            ]
        });
        match falls {
            Some(falls) if falls.iter().all(|&fall| fall < options.rms_tolerance) => {
                if falls.iter().any(|&fall| fall < -options.rms_tolerance) {
                    solution = before;
                    solution.stopped = Stopped::RmsRose;
                } else {
                    solution.iterations.push(iteration);
                    solution.stopped = Stopped::RmsConverged;
                }
                break;
            }
            _ => solution.iterations.push(iteration),
        }
    }
    for (channel, _) in unconverged.iter().enumerate().filter(|(_, unmet)| **unmet) {
        solution.warnings.push(format!(
            "the bounded least squares of the {} channel stopped short of its optimum",
            ["red", "green", "blue"][channel]
        ));
    }
    Ok(solution)
}

/// RMS over equations with the radiance that was computed for each, counted by their shares.
pub(super) fn rms<'a>(
    equations: &Equations,
    rows: impl Iterator<Item = (&'a Equation, &'a Rgb)> + Clone,
) -> Rms {
    let shares: f64 = rows.clone().map(|(row, _)| row.share).sum();
    let mean = |difference: &dyn Fn(&Rgb, &Rgb, usize) -> f64| -> Rgb {
        std::array::from_fn(|c| {
            let sum: f64 = rows
                .clone()
                .map(|(row, computed)| row.share * difference(&row.radiance, computed, c).powi(2))
                .sum();
            (sum / shares).sqrt()
        })
    };
    Rms {
        absolute: mean(&|measured, computed, c| measured[c] - computed[c]),
        relative: mean(&|measured, computed, c| {
            (measured[c] - computed[c]) / measured[c].max(equations.dark(c))
        }),
    }
}

fn largest_change(before: &[Option<Brdf>], after: &[Option<Brdf>]) -> f64 {
    before
        .iter()
        .flatten()
        .zip(after.iter().flatten())
        .flat_map(|(a, b)| {
            (0..CHANNELS).flat_map(move |c| {
                [(a.diffuse[c] - b.diffuse[c]).abs(), (a.specular[c] - b.specular[c]).abs()]
            })
        })
        .fold(0.0, f64::max)
}
