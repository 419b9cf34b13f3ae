//! Rows that are wrong: Cauchy's loss, and weight 0.

use faer::Mat;
use lobelia::math::sampling::Random;
use lobelia::reconstruct::joint::system::{Objective, Rows, Terms};
use lobelia::watch::Watch;

use crate::golden::problems;
use crate::scenes::{Held, Recipe, mean_difference, reflectances, uniform};

#[test]
fn gross_outliers_move_least_squares_and_hardly_cauchy() {
    let scene = Recipe { rows: 600, ..Recipe::default() }.make();
    let errors = scene.noise(1, 0.05);
    // L̂/L − 1 never falls below −1, so that only rows that are too dark harm its squares.
    for (objective, sign) in
        [(Objective::Log, 1.0), (Objective::Log, -1.0), (Objective::Relative, -1.0)]
    {
        // 5 % of the rows are up to thirty times too bright or too dark.
        let mut random = Random::new(1, 4, 0);
        let mut spoilt = errors.clone();
        for error in spoilt.iter_mut().filter(|_| uniform(&mut random) < 0.05) {
            *error += sign * (2.0 + 1.4 * error.abs().min(0.1) / 0.1);
        }
        let moved = |robust: f64| {
            let fit = |errors: &[f64]| {
                let rows = scene.seen(errors);
                let mut held = scene.held(Objective::Log);
                held.robust.fill(robust);
                let log = scene.fit(&rows, &held, &scene.start(0.5));
                held.objective = objective;
                // From the logarithms' answer: Cauchy's loss of L̂/L − 1 has other minima, and a
                // dark start ends in one of them (ρ 0.04 for 0.6 here).
                reflectances(&scene.fit(&rows, &held, &log.state).state)
            };
            let (clean, hit) = (fit(&errors), fit(&spoilt));
            (mean_difference(&clean, &hit), mean_difference(&clean, &scene.reflectance))
        };
        // Two standard deviations of the noise.
        let (squares, cauchy) = (moved(f64::INFINITY), moved(0.1));
        println!(
            "{objective:?} {sign}: moved by, and error without outliers: {squares:.4?} {cauchy:.4?}"
        );
        assert!(squares.0 > 0.03, "{objective:?}: {squares:?}");
        assert!(cauchy.0 < 0.2 * squares.0, "{objective:?}: {cauchy:?} against {squares:?}");
        // Where nothing is wrong, it costs little.
        assert!(cauchy.1 < 1.5 * squares.1 + 0.01, "{objective:?}: {cauchy:?} against {squares:?}");
    }
}

/// Every third row has weight 0, some of them in glossy materials.
#[test]
fn held_out_rows_have_no_influence_whatever_they_say() {
    for objective in [Objective::Log, Objective::Relative] {
        for mut problem in problems(objective) {
            let out = |row: usize| row % 3 == 1;
            let count = problem.rows.material.len();
            (0..count).filter(|&row| out(row)).for_each(|row| problem.held.weights[row] = 0.0);
            let as_seen = problem.fit();
            let spoil = |rows: &mut Rows, log: f64| {
                (0..count).filter(|&row| out(row)).for_each(|row| rows.log_radiance[0][row] = log);
            };
            // Saturated, far brighter, unlit, infinite, black.
            for log in [3.0, 88.0, -100.0, f64::INFINITY, f64::NEG_INFINITY] {
                spoil(&mut problem.rows, log);
                let fit = problem.fit();
                let name = format!("{}, {log}", problem.name);
                assert_eq!(fit.state, as_seen.state, "{name}");
                assert_eq!(fit.value.to_bits(), as_seen.value.to_bits(), "{name}");
                assert_eq!(fit.kkt_residual.to_bits(), as_seen.kkt_residual.to_bits(), "{name}");
                assert_eq!(fit.iterations, as_seen.iterations, "{name}");
            }
        }
    }
}

/// In a coated room a lamp sent 3,000,000 times the radiance of the others away from all samples but a
/// few, to which it seemed to be brighter; unphotographed surfaces then reflected that light.
#[test]
fn a_lobe_that_hardly_any_row_sees_is_no_brighter_than_its_lamp() {
    let mut scene = Recipe::default().make();
    let lobe = scene.design.columns();
    let seen = |row: usize| if row == 0 { 1e-6f32 } else { 0.0 };
    let rows = scene.exact.len();
    let own = scene.design.diffuse.clone();
    let coupling = |i: usize, j: usize| if j < lobe { own[(i, j)] } else { seen(i) };
    scene.design.diffuse = Mat::from_fn(rows, lobe + 1, coupling).into();
    scene.design.specular = Mat::zeros(0, lobe + 1).into();
    let mut errors = vec![0.0; rows];
    errors[0] = 0.5;
    let seen = scene.seen(&errors);
    let mut held = scene.held(Objective::Log);
    let fit = |held: &Held, units: &[usize]| {
        let terms = Terms { ridge_units: units, ..held.terms() };
        let start = scene.start(0.5);
        let fit = scene.channel(&seen).fit(&terms, &start, &Watch::new()).expect("all is finite");
        fit.state.emission
    };
    held.ridge[lobe] = 1e-9;
    let by_own: Vec<usize> = (0..=lobe).collect();
    let mut by_lamp = by_own.clone();
    by_lamp[lobe] = 0;
    let [free, drawn] = [by_own, by_lamp].map(|units| fit(&held, &units)[lobe]);
    assert!(free > 1e4 && drawn < 1e-2 * free, "{free} {drawn}");
}
