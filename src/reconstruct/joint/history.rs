//! The intermediate fits of a solve, recorded as iterations.

use std::cell::RefCell;
use std::time::Instant;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::refine;
use crate::reconstruct::solution::Iteration;

/// The intermediate fits as iterations; each has a light model with more parts than the one before.
pub struct History<'a> {
    on_iteration: &'a dyn Fn(&Iteration),
    pub iterations: RefCell<Vec<Iteration>>,
    last: RefCell<Option<Fitted>>,
    began: Instant,
}

impl<'a> History<'a> {
    pub fn new(on_iteration: &'a dyn Fn(&Iteration)) -> Self {
        Self {
            on_iteration,
            iterations: RefCell::default(),
            last: RefCell::default(),
            began: Instant::now(),
        }
    }

    pub fn push(&self, problem: &Problem, fitted: &Fitted) {
        let change = self.last.borrow().as_ref().map_or(0.0, |before| {
            let measured = (0..problem.materials()).filter(|&m| problem.priors.measured[m]);
            measured
                .flat_map(|m| {
                    let (now, then) = (fitted.log_diffuse(m), before.log_diffuse(m));
                    let (gloss, before) = (fitted.specular(m), before.specular(m));
                    (0..CHANNELS).flat_map(move |c| {
                        [(now[c].exp() - then[c].exp()).abs(), (gloss[c] - before[c]).abs()]
                    })
                })
                .fold(0.0, f64::max)
        });
        // A search may look at some samples only.
        let equations = problem.data.equations;
        let rows = problem.equation.iter().map(|&equation| &equations.rows[equation]);
        let computed = computed(problem, fitted);
        let iteration = Iteration {
            index: self.iterations.borrow().len() + 1,
            rms: refine::rms(equations, rows.zip(&computed)),
            objective: Some(std::array::from_fn(|c| fitted.channels[c].value)),
            change,
            elapsed_secs: self.began.elapsed().as_secs_f64(),
        };
        (self.on_iteration)(&iteration);
        self.iterations.borrow_mut().push(iteration);
        self.last.replace(Some(fitted.clone()));
    }
}

/// Computed radiance per row.
pub fn computed(problem: &Problem, fitted: &Fitted) -> Vec<Rgb> {
    let equations = problem.data.equations;
    let of = |(row, &equation): (usize, &usize)| {
        std::array::from_fn(|c| {
            let measured = equations.rows[equation].radiance[c].max(equations.dark(c));
            measured * fitted.channels[c].residuals[row].exp()
        })
    };
    problem.equation.iter().enumerate().map(of).collect()
}
