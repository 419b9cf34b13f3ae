use super::*;

fn rosenbrock(x: &[f64]) -> f64 {
    x.windows(2).map(|x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2)).sum()
}

fn powell(x: &[f64]) -> f64 {
    (x[0] + 10.0 * x[1]).powi(2)
        + 5.0 * (x[2] - x[3]).powi(2)
        + (x[1] - 2.0 * x[2]).powi(4)
        + 10.0 * (x[0] - x[3]).powi(4)
}

/// Conditioned 1 : 100, minimum at 1 / (i + 1).
fn quadratic(x: &[f64]) -> f64 {
    let term = |(i, x): (usize, &f64)| {
        let weight = 100f64.powf(i as f64 / 9.0);
        weight * (x - 1.0 / (i as f64 + 1.0)).powi(2)
    };
    x.iter().enumerate().map(term).sum()
}

fn minimise(objective: fn(&[f64]) -> f64, start: &[f64], tolerance: f64) -> SubplexReport {
    let options = SubplexOptions { tolerance, max_evaluations: 1_000_000, ..Default::default() };
    let report = subplex(objective, start, &vec![0.5; start.len()], &options);
    assert_eq!(report.stopped, SubplexStop::Tolerance);
    assert_eq!(report.value, objective(&report.x));
    println!("{} dimensions: {:e} in {}", start.len(), report.value, report.evaluations);
    report
}

fn assert_near(found: &[f64], expected: impl Fn(usize) -> f64, tolerance: f64) {
    for (i, found) in found.iter().enumerate() {
        assert!((found - expected(i)).abs() < tolerance, "x[{i}] = {found}");
    }
}

#[test]
fn finds_the_minima_of_known_functions() {
    assert_near(&minimise(rosenbrock, &[-1.2, 1.0], 1e-8).x, |_| 1.0, 1e-6);
    // A long curved valley, which subspaces cut badly: NLopt takes 390 000 evaluations here.
    assert_near(&minimise(rosenbrock, &[-1.2, 1.0, -1.2, 1.0, -1.2, 1.0], 1e-9).x, |_| 1.0, 1e-4);
    // Flat to fourth order at the minimum, so values are near long before arguments.
    let flat = minimise(powell, &[3.0, -1.0, 0.0, 1.0], 1e-8);
    assert!(flat.value < 1e-10);
    assert_near(&flat.x, |_| 0.0, 1e-2);
    let bowl = minimise(quadratic, &[0.0; 10], 1e-8);
    assert_near(&bowl.x, |i| 1.0 / (i as f64 + 1.0), 1e-6);
}

#[test]
fn finds_a_minimum_on_the_edge_of_what_is_allowed() {
    // The bowl's middle, (1, 1/2, 1/3), is cut off at x₀ ≤ 0.8; NaN and +∞ stand for outside.
    for outside in [f64::NAN, f64::INFINITY] {
        let objective = |x: &[f64]| {
            if x[0] > 0.8 {
                return outside;
            }
            x.iter().enumerate().map(|(i, x)| (x - 1.0 / (i as f64 + 1.0)).powi(2)).sum()
        };
        let report = subplex(objective, &[0.0; 3], &[0.3; 3], &SubplexOptions::default());
        assert!(report.x[0] <= 0.8);
        assert_near(&report.x, |i| [0.8, 0.5, 1.0 / 3.0][i], 1e-3);
    }
}

#[test]
fn the_same_input_gives_the_same_search() {
    let record = || {
        let mut seen = Vec::new();
        let objective = |x: &[f64]| {
            seen.push(x.to_vec());
            rosenbrock(x)
        };
        subplex(objective, &[-1.2, 1.0, 0.3], &[0.1, 0.2, 0.3], &SubplexOptions::default());
        seen
    };
    assert_eq!(record(), record());
}

#[test]
fn limits_and_bad_input_are_told() {
    for max_evaluations in [1, 2, 3, 50, 51, 52] {
        let options = SubplexOptions { max_evaluations, ..Default::default() };
        let report = subplex(rosenbrock, &[-1.2, 1.0, 2.0], &[0.5; 3], &options);
        assert_eq!(report.stopped, SubplexStop::MaxEvaluations);
        // A simplex iteration that has begun is finished.
        assert!(report.evaluations < max_evaluations + 5);
        assert!(report.value <= rosenbrock(&[-1.2, 1.0, 2.0]));
    }
    let options = SubplexOptions::default();
    let nowhere = subplex(|_| f64::NAN, &[1.0, 2.0], &[0.5; 2], &options);
    assert_eq!((nowhere.x, nowhere.value), (vec![1.0, 2.0], f64::INFINITY));
    assert_eq!(nowhere.stopped, SubplexStop::Tolerance);
    for (start, steps) in [(vec![], vec![]), (vec![1.0], vec![0.0]), (vec![1.0], vec![f64::NAN])] {
        let report = subplex(rosenbrock, &start, &steps, &options);
        assert_eq!((report.stopped, report.x), (SubplexStop::BadInput, start));
    }
    assert!(SubplexOptions { max_subspace: 2, ..options }.check().is_err());
    assert!(SubplexOptions { tolerance: 0.0, ..options }.check().is_err());
}

#[test]
fn a_step_of_zero_keeps_a_coordinate() {
    let report = subplex(
        quadratic,
        &[0.25; 10],
        &[0.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5],
        &SubplexOptions::default(),
    );
    assert_eq!(report.x[0], 0.25);
    assert_near(&report.x[1..], |i| 1.0 / (i as f64 + 2.0), 1e-6);
}
