//! SciPy's `least_squares` on the same systems (see tests/golden/joint/README.md).

use faer::Mat;
use lobelia::reconstruct::joint::system::{
    Anchor, Channel, Design, Fit, Objective, Pair, Rows, State,
};
use lobelia::watch::Watch;
use serde::Deserialize;

use crate::scenes::{Held, largest_difference, reflectances};

#[derive(Deserialize)]
struct Golden {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    rows: usize,
    columns: usize,
    materials: usize,
    material: Vec<usize>,
    base: Vec<f64>,
    diffuse: Vec<f64>,
    glossy: Vec<Option<usize>>,
    specular: Vec<f64>,
    specular_base: Vec<f64>,
    radiance: Vec<f64>,
    weights: Vec<f64>,
    ridge: Vec<f64>,
    centre: Vec<f64>,
    relative_ridge: bool,
    known: Vec<Option<f64>>,
    upper: Vec<f64>,
    anchors: Vec<Pull>,
    start: Vec<f64>,
    pairs: Vec<Neighbours>,
    robust: Option<Vec<f64>>,
    answers: Answers,
}

#[derive(Deserialize)]
struct Pull {
    combination: Vec<f64>,
    target: f64,
    weight: f64,
}

#[derive(Deserialize)]
struct Neighbours {
    columns: [usize; 2],
    weight: f64,
}

#[derive(Deserialize)]
struct Answers {
    log: Answer,
    relative: Answer,
}

#[derive(Deserialize)]
struct Answer {
    value: f64,
    reflectance: Vec<f64>,
    specular: Vec<f64>,
    emission: Vec<f64>,
}

impl Case {
    fn rows(&self) -> Rows {
        Rows {
            sample: (0..self.rows).collect(),
            material: self.material.clone(),
            glossy: self.glossy.clone(),
            // `radiance` is πL.
            log_radiance: [self.radiance.iter().map(|l| l.ln()).collect(), vec![], vec![]],
            materials: self.materials,
        }
    }

    fn design(&self) -> Design {
        let shiny = self.specular_base.len();
        Design {
            diffuse: Mat::from_fn(self.rows, self.columns, |i, j| {
                self.diffuse[j * self.rows + i] as f32
            })
            .into(),
            base: [self.base.clone(), vec![], vec![]],
            specular: Mat::from_fn(shiny, self.columns, |i, j| self.specular[j * shiny + i] as f32)
                .into(),
            specular_base: [self.specular_base.clone(), vec![], vec![]],
            patches: Default::default(),
        }
    }

    fn held(&self, objective: Objective) -> Held {
        let anchor = |pull: &Pull| Anchor {
            combination: pull.combination.clone(),
            target: pull.target,
            weight: pull.weight,
        };
        let pair = |pair: &Neighbours| Pair { columns: pair.columns, weight: pair.weight };
        Held {
            objective,
            weights: self.weights.clone(),
            ridge: self.ridge.clone(),
            centre: self.centre.clone(),
            relative_ridge: self.relative_ridge,
            reference: self.start.iter().map(|rho| rho.ln()).collect(),
            known_specular: vec![None; self.materials],
            known: self.known.clone(),
            upper: self.upper.clone(),
            anchors: self.anchors.iter().map(anchor).collect(),
            pairs: self.pairs.iter().map(pair).collect(),
            robust: self.robust.clone().unwrap_or_else(|| vec![f64::INFINITY; self.materials]),
        }
    }

    fn start(&self) -> State {
        let glossy = |m| (0..self.rows).any(|i| self.material[i] == m && self.glossy[i].is_some());
        State {
            emission: vec![0.0; self.columns],
            log_diffuse: self.start.iter().map(|rho| rho.ln()).collect(),
            specular: (0..self.materials).map(|m| if glossy(m) { 0.1 } else { 0.0 }).collect(),
        }
    }
}

/// One system, ready to be solved.
pub struct Problem {
    pub name: String,
    pub rows: Rows,
    pub design: Design,
    pub held: Held,
    pub start: State,
    answer: Answer,
}

impl Problem {
    pub fn fit(&self) -> Fit {
        let channel = Channel { rows: &self.rows, design: &self.design, channel: 0 };
        channel.fit(&self.held.terms(), &self.start, &Watch::new()).expect("all is finite")
    }
}

pub fn problems(objective: Objective) -> Vec<Problem> {
    let text = include_str!("../golden/joint/systems.json");
    let golden: Golden = serde_json::from_str(text).expect("valid JSON");
    let problem = |case: Case| Problem {
        name: format!("{}, {objective:?}", case.name),
        rows: case.rows(),
        design: case.design(),
        held: case.held(objective),
        start: case.start(),
        answer: match objective {
            Objective::Log => case.answers.log,
            Objective::Relative => case.answers.relative,
        },
    };
    golden.cases.into_iter().map(problem).collect()
}

fn agrees(objective: Objective) {
    for problem in problems(objective) {
        let (fit, expected, name) = (problem.fit(), &problem.answer, &problem.name);
        let excess = fit.value / expected.value - 1.0;
        let diffuse = largest_difference(&reflectances(&fit.state), &expected.reflectance);
        let specular = largest_difference(&fit.state.specular, &expected.specular);
        let emission = largest_difference(&fit.state.emission, &expected.emission);
        println!(
            "{name}: objective {excess:+.1e}, ρ_d {diffuse:.1e}, ρ_s {specular:.1e}, \
             E {emission:.1e}, {} iterations, slope {:.1e}",
            fit.iterations, fit.kkt_residual
        );
        assert!(excess < 1e-6, "{name}: {} against {}", fit.value, expected.value);
        // Lower than the minimum would be another objective.
        assert!(excess > -1e-9, "{name}: {} against {}", fit.value, expected.value);
        assert!(diffuse < 1e-4, "{name}: {:?}", reflectances(&fit.state));
        assert!(specular < 1e-4, "{name}: {:?}", fit.state.specular);
    }
}

#[test]
fn log_objective_has_the_optimum_of_scipy() {
    agrees(Objective::Log);
}

#[test]
fn relative_objective_has_the_optimum_of_scipy() {
    agrees(Objective::Relative);
}
