//! Section 5.3 and 5.4, Fig. 8: the iteration between emissions and reflectances, and its end.

use std::time::Instant;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::options;
use crate::reconstruct::emission::{self, EmissionOptions};
use crate::reconstruct::equations::{Equations, Reflectance};
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::options::Options;
use crate::reconstruct::reflectance;
use crate::reconstruct::transport::Transport;
use crate::scene::Capture;
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

/// Root mean square differences between computed and measured radiance, per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rms {
    /// In the photographs' unit of radiance.
    pub absolute: Rgb,
    /// Of the differences divided by the measured radiance.
    pub relative: Rgb,
}

impl Rms {
    /// One number for all channels: the root mean square of the absolute errors, each relative
    /// to its channel's mean radiance.
    pub fn total(&self, mean_radiance: &Rgb) -> f64 {
        let square = |c: usize| {
            if mean_radiance[c] > 0.0 { (self.absolute[c] / mean_radiance[c]).powi(2) } else { 0.0 }
        };
        ((0..CHANNELS).map(square).sum::<f64>() / CHANNELS as f64).sqrt()
    }

    /// The root mean square of the relative errors of all channels.
    pub fn total_relative(&self) -> f64 {
        (self.relative.iter().map(|value| value * value).sum::<f64>() / CHANNELS as f64).sqrt()
    }
}

/// One iteration of the refinement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Counted from 1.
    pub index: usize,
    pub rms: Rms,
    /// Largest change of any diffuse or specular reflectance since the iteration before.
    pub change: f64,
    /// Since the refinement began.
    pub elapsed_secs: f64,
}

/// Why the refinement stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    RmsConverged,
    /// The RMS error rose, absolute or relative, and neither fell; the iteration before is the
    /// result.
    RmsRose,
    IterationLimit,
    /// There is no sample, or none with a reflectance to estimate.
    NothingToSolve,
}

impl Stopped {
    pub fn describe(self) -> &'static str {
        match self {
            Self::RmsConverged => "rms change below threshold",
            Self::RmsRose => "rms rose, so the iteration before is kept",
            Self::IterationLimit => "iteration limit reached",
            Self::NothingToSolve => "nothing to solve",
        }
    }
}

/// Reflectances and emissions, with the report of how they were found.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Per material; `None` where it has no sample.
    pub reflectances: Vec<Option<Reflectance>>,
    /// E_ij per lobe and channel, in the photographs' unit of radiance.
    pub emission: Vec<Rgb>,
    pub iterations: Vec<Iteration>,
    pub stopped: Stopped,
    /// Computed radiance of each equation.
    pub computed: Vec<Rgb>,
    pub warnings: Vec<String>,
}

impl Solution {
    /// Whether every number of the result is finite and there is something in it.
    pub fn is_usable(&self) -> bool {
        let mut reflectances = self.reflectances.iter().flatten().peekable();
        reflectances.peek().is_some()
            && reflectances.all(|r| {
                r.diffuse.iter().chain(&r.specular).all(|v| v.is_finite()) && r.exponent.is_finite()
            })
            && self.emission.iter().flatten().all(|v| v.is_finite())
    }

    /// Lobes with any light in them.
    pub fn active_lobes(&self) -> usize {
        self.emission.iter().filter(|emission| emission.iter().any(|&e| e > 0.0)).count()
    }

    /// One line on how it went.
    pub fn brief(&self) -> String {
        let Some((first, last)) = self.iterations.first().zip(self.iterations.last()) else {
            return self.stopped.describe().to_owned();
        };
        let triple = |rgb: Rgb| rgb.map(|value| format!("{:.1}", 100.0 * value)).join(" / ");
        format!(
            "{} iterations ({}): relative RMS from {} % to {} % (R / G / B)",
            self.iterations.len(),
            self.stopped.describe(),
            triple(first.rms.relative),
            triple(last.rms.relative),
        )
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
    start: Vec<Option<Reflectance>>,
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
        emission: Vec::new(),
        iterations: Vec::new(),
        stopped: Stopped::IterationLimit,
        computed: Vec::new(),
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
            rms: rms(equations, &solution.computed),
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

/// RMS over all equations, each counted by its share.
fn rms(equations: &Equations, computed: &[Rgb]) -> Rms {
    let shares: f64 = equations.rows.iter().map(|row| row.share).sum();
    let mean = |difference: &dyn Fn(&Rgb, &Rgb, usize) -> f64| -> Rgb {
        std::array::from_fn(|c| {
            let sum: f64 = equations
                .rows
                .iter()
                .zip(computed)
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

fn largest_change(before: &[Option<Reflectance>], after: &[Option<Reflectance>]) -> f64 {
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
