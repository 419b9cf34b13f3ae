//! The fits on the way, told as iterations.

use std::cell::RefCell;
use std::time::Instant;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::solution::{Iteration, Rms};

/// The fits on the way, as iterations: each with a light model that has grown.
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
        let iteration = Iteration {
            index: self.iterations.borrow().len() + 1,
            // A search may look at some samples only.
            rms: rms(problem, fitted),
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

/// RMS over the problem's rows, each counted by its share of its sample.
fn rms(problem: &Problem, fitted: &Fitted) -> Rms {
    let equations = problem.data.equations;
    let mut rms = Rms::default();
    let mut shares = 0.0;
    for (&equation, computed) in problem.equation.iter().zip(computed(problem, fitted)) {
        let row = &equations.rows[equation];
        shares += row.share;
        for (c, computed) in computed.into_iter().enumerate() {
            let difference = row.radiance[c] - computed;
            rms.absolute[c] += row.share * difference.powi(2);
            let relative = difference / row.radiance[c].max(equations.dark(c));
            rms.relative[c] += row.share * relative.powi(2);
        }
    }
    let root = |sum: f64| (sum / f64::max(shares, f64::MIN_POSITIVE)).sqrt();
    Rms { absolute: rms.absolute.map(root), relative: rms.relative.map(root) }
}
