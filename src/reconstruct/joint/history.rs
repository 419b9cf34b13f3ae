//! The fits on the way, told as iterations.

use std::cell::RefCell;
use std::time::Instant;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::equations::{Equation, Equations};
use crate::reconstruct::joint::certainty::Member;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::refine;
use crate::reconstruct::solution::Iteration;

/// The fits on the way, as iterations: each with a light model that has grown.
pub struct History<'a> {
    equations: &'a Equations,
    on_iteration: &'a dyn Fn(&Iteration),
    pub iterations: RefCell<Vec<Iteration>>,
    last: RefCell<Option<Member>>,
    began: Instant,
}

impl<'a> History<'a> {
    pub fn new(equations: &'a Equations, on_iteration: &'a dyn Fn(&Iteration)) -> Self {
        Self {
            equations,
            on_iteration,
            iterations: RefCell::default(),
            last: RefCell::default(),
            began: Instant::now(),
        }
    }

    /// Radiance per equation.
    pub fn computed(&self, fits: &Fits) -> Vec<Rgb> {
        computed(self.equations, fits)
    }

    pub fn push(&self, fitter: &Fitter, fits: &Fits) {
        let now = Member::of(fits);
        let change = self.last.borrow().as_ref().map_or(0.0, |before| {
            let mut largest = 0.0f64;
            for c in 0..CHANNELS {
                for material in (0..fitter.rows.materials).filter(|&m| fitter.measured[m]) {
                    let diffuse = |member: &Member| member.log_diffuse[c][material].exp();
                    let specular = |member: &Member| member.specular[c][material];
                    largest = largest
                        .max((diffuse(&now) - diffuse(before)).abs())
                        .max((specular(&now) - specular(before)).abs());
                }
            }
            largest
        });
        let iteration = Iteration {
            index: self.iterations.borrow().len() + 1,
            // Of the fitter's own: a search may look at some samples only.
            rms: refine::rms(fitter.data.equations, &computed(fitter.data.equations, fits)),
            objective: Some(std::array::from_fn(|c| fits[c].value)),
            change,
            elapsed_secs: self.began.elapsed().as_secs_f64(),
        };
        (self.on_iteration)(&iteration);
        self.iterations.borrow_mut().push(iteration);
        *self.last.borrow_mut() = Some(now);
    }
}

fn computed(equations: &Equations, fits: &Fits) -> Vec<Rgb> {
    let of = |(row, equation): (usize, &Equation)| {
        std::array::from_fn(|c| {
            let measured = equation.radiance[c].max(equations.dark(c));
            measured * fits[c].residuals[row].exp()
        })
    };
    equations.rows.iter().enumerate().map(of).collect()
}
