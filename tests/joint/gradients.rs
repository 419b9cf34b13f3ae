//! What a fit says of itself, checked with the objective written once more from its definition
//! and with its finite differences.

use lobelia::reconstruct::joint::system::{Design, Fit, Objective, Rows, State};

use crate::golden::problems;
use crate::scenes::{Held, Recipe};

/// Half the sum of weighted losses, of the ridge and of the anchors.
struct Definition<'a> {
    rows: &'a Rows,
    design: &'a Design,
    held: &'a Held,
    /// Whose reflectances set the unit of the ridge.
    start: &'a State,
}

impl Definition<'_> {
    fn value(&self, state: &State) -> f64 {
        let (rows, design, held) = (self.rows, self.design, self.held);
        let mut twice = 0.0;
        for i in 0..rows.material.len() {
            let m = rows.material[i];
            let mut computed = design.base[0][i];
            for (j, emission) in state.emission.iter().enumerate() {
                computed += emission * f64::from(design.diffuse[(i, j)]);
            }
            computed *= state.log_diffuse[m].exp();
            if let Some(glossy) = rows.glossy[i] {
                let mut lobe = design.specular_base[0][glossy];
                for (j, emission) in state.emission.iter().enumerate() {
                    lobe += emission * f64::from(design.specular[(glossy, j)]);
                }
                computed += state.specular[m] * lobe;
            }
            let ratio = computed / rows.log_radiance[0][i].exp();
            let residual = match held.objective {
                Objective::Log => ratio.ln(),
                Objective::Relative => ratio - 1.0,
            };
            let robust = held.robust[m];
            let loss = if robust.is_finite() {
                robust.powi(2) * (1.0 + (residual / robust).powi(2)).ln()
            } else {
                residual.powi(2)
            };
            twice += held.weights[i] * loss;
        }
        let square = |i: usize, j: usize| {
            let start = self.start.log_diffuse[rows.material[i]];
            let unit = (start - rows.log_radiance[0][i]).exp();
            held.weights[i] * (f64::from(design.diffuse[(i, j)]) * unit).powi(2)
        };
        let square = |j: usize| (0..rows.material.len()).map(|i| square(i, j)).sum::<f64>();
        let is_paired = |j: usize| held.pairs.iter().any(|pair| pair.columns.contains(&j));
        let paired = (0..state.emission.len()).filter(|&j| is_paired(j));
        let unit = paired.map(|j| square(j).sqrt()).sum::<f64>().powi(2);
        let off = |j: usize| state.emission[j] - held.centre[j];
        let mut drawn = 0.0;
        for j in 0..state.emission.len() {
            drawn += held.ridge[j] * square(j) * off(j).powi(2);
        }
        for pair in &held.pairs {
            let [a, b] = pair.columns;
            drawn += unit * pair.weight * (off(a) - off(b)).powi(2);
        }
        if held.relative_ridge {
            let whole: f64 = held.weights.iter().sum();
            let level: f64 =
                state.emission.iter().enumerate().map(|(j, e)| square(j).sqrt() * e).sum();
            drawn *= whole / (level.powi(2) + 1e-4 * whole);
        }
        twice += drawn;
        for anchor in &held.anchors {
            let terms = anchor.combination.iter().zip(&state.log_diffuse).map(|(c, u)| c * u);
            twice += anchor.weight * (terms.sum::<f64>() - anchor.target).powi(2);
        }
        0.5 * twice
    }

    /// The largest slope that a step within the box could follow down, as a cosine: the
    /// derivative over the square root of curvature times twice the value.
    fn steepest(&self, state: &State) -> f64 {
        const STEP: f64 = 1e-5;
        let here = self.value(state);
        let slope = |change: &dyn Fn(&mut State, f64)| {
            let mut ends = [STEP, -STEP].map(|step| {
                let mut moved = state.clone();
                change(&mut moved, step);
                self.value(&moved)
            });
            ends.iter_mut().for_each(|value| *value -= here);
            let curvature = (ends[0] + ends[1]) / STEP.powi(2);
            (ends[0] - ends[1]) / (2.0 * STEP) / (curvature * 2.0 * here).sqrt()
        };
        // At a bound only a slope into the box counts.
        let counted = |slope: f64, at_lower: bool, at_upper: bool| {
            if (at_lower && slope > 0.0) || (at_upper && slope < 0.0) { 0.0 } else { slope.abs() }
        };
        let mut steepest = 0.0f64;
        for j in 0..state.emission.len() {
            let slope = slope(&|state, step| state.emission[j] += step);
            steepest = steepest.max(counted(slope, state.emission[j] == 0.0, false));
        }
        for m in 0..state.log_diffuse.len() {
            let at_upper = state.log_diffuse[m] == self.held.upper[m];
            if self.held.known[m].is_none() {
                let slope = slope(&|state, step| state.log_diffuse[m] += step);
                steepest = steepest.max(counted(slope, false, at_upper));
            }
            if (0..self.rows.material.len())
                .any(|i| self.rows.material[i] == m && self.rows.glossy[i].is_some())
            {
                let slope = slope(&|state, step| state.specular[m] += step);
                let (dark, full) = (state.specular[m] == 0.0, state.specular[m] == 1.0);
                steepest = steepest.max(counted(slope, dark, full));
            }
        }
        steepest
    }

    fn check(&self, name: &str, fit: &Fit) {
        let (value, steepest) = (self.value(&fit.state), self.steepest(&fit.state));
        println!("{name}: slope {:.1e} said, {steepest:.1e} found", fit.kkt_residual);
        assert!((fit.value / value - 1.0).abs() < 1e-12, "{name}: {} for {value}", fit.value);
        assert!(
            fit.kkt_residual <= 1e-6,
            "{name}: {:.1e} is left by its own account",
            fit.kkt_residual
        );
        assert!(steepest <= 1e-6, "{name}: {steepest:.1e} is left");
        // What it says is what is there. 1e-8 is the differences' own error; ridge and anchors are
        // in the value here and not in its residuals.
        assert!(
            fit.kkt_residual < 2.5 * steepest + 1e-8 && steepest < 2.5 * fit.kkt_residual + 1e-8,
            "{name}"
        );
    }
}

#[test]
fn fits_are_optimal_and_say_so_rightly() {
    for objective in [Objective::Log, Objective::Relative] {
        for problem in problems(objective) {
            let definition = Definition {
                rows: &problem.rows,
                design: &problem.design,
                held: &problem.held,
                start: &problem.start,
            };
            definition.check(&problem.name, &problem.fit());
        }
    }
}

#[test]
fn fits_with_a_weak_scale_are_optimal() {
    for objective in [Objective::Log, Objective::Relative] {
        for seed in 1..=5 {
            let recipe = Recipe { seed, base: 0.05, lights: 20, ..Recipe::default() };
            let scene = recipe.make();
            let rows = scene.seen(&scene.noise(seed, 0.05));
            let (held, start) = (scene.held(objective), scene.start(0.3));
            let fit = scene.fit(&rows, &held, &start);
            let definition =
                Definition { rows: &rows, design: &scene.design, held: &held, start: &start };
            definition.check(&format!("{objective:?}, scene {seed}"), &fit);
        }
    }
}
