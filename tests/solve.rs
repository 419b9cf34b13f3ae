//! Bounded least squares against SciPy's stored answers and against the optimality conditions,
//! computed here by plain loops that share nothing with the solver.

use faer::Mat;
use lobelia::math::sampling::Random;
use lobelia::solve::bounded::{
    BoundedError, BoundedOptions, BoundedProblem, BoundedSolution, Bounds, Path, PathChoice,
    bounded_least_squares,
};
use lobelia::watch::Watch;

const CHOICES: [PathChoice; 3] = [PathChoice::Auto, PathChoice::Gram, PathChoice::Columns];

/// A problem that owns its numbers.
struct Case {
    name: String,
    matrix: Mat<f64>,
    target: Vec<f64>,
    weights: Option<Vec<f64>>,
    bounds: Option<(Vec<f64>, Vec<f64>)>,
    ridge: f64,
}

impl Case {
    fn new(name: &str, matrix: Mat<f64>, target: Vec<f64>) -> Self {
        Self { name: name.into(), matrix, target, weights: None, bounds: None, ridge: 0.0 }
    }

    fn problem(&self) -> BoundedProblem<'_> {
        BoundedProblem {
            matrix: self.matrix.as_ref(),
            target: &self.target,
            weights: self.weights.as_deref(),
            bounds: match &self.bounds {
                None => Bounds::NonNegative,
                Some((lower, upper)) => Bounds::Between { lower, upper },
            },
            ridge: self.ridge,
        }
    }

    fn solve_with(&self, start: Option<&[f64]>, options: &BoundedOptions) -> BoundedSolution {
        bounded_least_squares(&self.problem(), start, options, &Watch::new())
            .unwrap_or_else(|error| panic!("{}: {error}", self.name))
    }

    fn solve(&self) -> BoundedSolution {
        self.solve_with(None, &BoundedOptions::default())
    }

    fn bound(&self, j: usize) -> (f64, f64) {
        self.bounds.as_ref().map_or((0.0, f64::INFINITY), |(lower, upper)| (lower[j], upper[j]))
    }

    fn weight(&self, i: usize) -> f64 {
        self.weights.as_ref().map_or(1.0, |weights| weights[i])
    }

    fn column_norm(&self, j: usize) -> f64 {
        let squares =
            (0..self.target.len()).map(|i| (self.weight(i) * self.matrix[(i, j)]).powi(2));
        squares.sum::<f64>().sqrt()
    }

    fn objective(&self, x: &[f64]) -> f64 {
        let rows = (0..self.target.len()).map(|i| {
            let row: f64 = x.iter().enumerate().map(|(j, x)| self.matrix[(i, j)] * x).sum();
            (self.weight(i) * (row - self.target[i])).powi(2)
        });
        let ridge = (0..x.len()).map(|j| (self.ridge * self.column_norm(j) * x[j]).powi(2));
        0.5 * (rows.sum::<f64>() + ridge.sum::<f64>())
    }

    /// The largest violation of the optimality conditions, per unit of column and of target.
    fn violation(&self, x: &[f64]) -> f64 {
        let residual: Vec<f64> = (0..self.target.len())
            .map(|i| {
                let row: f64 = x.iter().enumerate().map(|(j, x)| self.matrix[(i, j)] * x).sum();
                self.weight(i).powi(2) * (self.target[i] - row)
            })
            .collect();
        let squares = (0..self.target.len()).map(|i| (self.weight(i) * self.target[i]).powi(2));
        let scale = squares.sum::<f64>().sqrt();
        let mut worst: f64 = 0.0;
        for (j, &value) in x.iter().enumerate() {
            let (lower, upper) = self.bound(j);
            assert!(lower <= value && value <= upper, "{}: x[{j}] = {value}", self.name);
            let norm = self.column_norm(j);
            if norm == 0.0 || lower == upper {
                continue;
            }
            let product: f64 = (0..residual.len()).map(|i| self.matrix[(i, j)] * residual[i]).sum();
            let mut descent = product / norm - self.ridge.powi(2) * norm * value;
            if value == lower {
                descent = descent.max(0.0);
            }
            if value == upper {
                descent = descent.min(0.0);
            }
            worst = worst.max(descent.abs() / if scale > 0.0 { scale } else { 1.0 });
        }
        worst
    }

    fn assert_solved(&self, solution: &BoundedSolution) {
        let violation = self.violation(&solution.x);
        let name = &self.name;
        assert!(solution.x.iter().all(|x| x.is_finite()), "{name}: not finite");
        assert!(solution.converged, "{name}: not converged, kkt {:e}", solution.kkt_residual);
        // The default tolerance is 1e-12; this file sums in another order.
        assert!(violation <= 1.1e-12, "{name}: violation {violation:e}");
    }
}

fn random_matrix(rows: usize, columns: usize, seed: u64, centre: f32) -> Mat<f64> {
    let mut random = Random::new(seed, 1, 0);
    Mat::from_fn(rows, columns, |_, _| f64::from(random.uniform() - centre))
}

fn random_vector(length: usize, seed: u64, centre: f32) -> Vec<f64> {
    let mut random = Random::new(seed, 2, 0);
    (0..length).map(|_| f64::from(random.uniform() - centre)).collect()
}

fn numbers(value: &serde_json::Value, absent: f64) -> Vec<f64> {
    value.as_array().expect("an array").iter().map(|v| v.as_f64().unwrap_or(absent)).collect()
}

fn golden() -> Vec<(Case, serde_json::Value)> {
    let text = include_str!("golden/bounded/systems.json");
    let all: serde_json::Value = serde_json::from_str(text).expect("valid JSON");
    let cases = all["cases"].as_array().expect("cases").iter().map(|case| {
        let size = |name: &str| case[name].as_u64().expect("a size") as usize;
        let entries = numbers(&case["matrix"], 0.0);
        let matrix =
            Mat::from_fn(size("rows"), size("columns"), |i, j| entries[j * size("rows") + i]);
        let name = case["name"].as_str().expect("a name");
        let mut read = Case::new(name, matrix, numbers(&case["target"], 0.0));
        read.weights = case.get("weights").map(|weights| numbers(weights, 0.0));
        read.bounds = case.get("lower").map(|lower| {
            (numbers(lower, f64::NEG_INFINITY), numbers(&case["upper"], f64::INFINITY))
        });
        (read, case.clone())
    });
    cases.collect()
}

/// Cosine-like bumps on a line, `groups` bunches of near-duplicates `spread` apart.
fn bumps(rows: usize, groups: usize, per: usize, spread: f64) -> Mat<f64> {
    Mat::from_fn(rows, groups * per, |i, j| {
        let centre = (j / per) as f64 / groups as f64 + spread * (j % per) as f64;
        let distance = i as f64 / rows as f64 - centre;
        (-40.0 * distance * distance).exp()
    })
}

/// Systems that bring out every branch of the solver.
fn hard_cases() -> Vec<Case> {
    let mut cases: Vec<Case> = golden().into_iter().map(|(case, _)| case).collect();
    cases.push(Case::new("tall", random_matrix(400, 150, 3, 0.5), random_vector(400, 4, 0.5)));
    cases.push(Case::new("positive", random_matrix(300, 200, 5, 0.0), random_vector(300, 6, 0.0)));
    cases.push(Case::new("wide", random_matrix(50, 300, 7, 0.5), random_vector(50, 8, 0.5)));
    for spread in [1e-3, 1e-6, 1e-9, 1e-12, 0.0] {
        let name = format!("bumps {spread:e}");
        cases.push(Case::new(&name, bumps(300, 30, 5, spread), random_vector(300, 9, 0.0)));
        let mut boxed = Case::new(
            &format!("boxed {name}"),
            bumps(300, 30, 5, spread),
            random_vector(300, 9, 0.2),
        );
        boxed.bounds = Some((vec![-0.3; 150], vec![0.4; 150]));
        cases.push(boxed);
    }
    let mut ridge = Case::new("ridge", bumps(300, 30, 5, 1e-9), random_vector(300, 9, 0.0));
    ridge.ridge = 1e-3;
    cases.push(ridge);
    let mut weighted =
        Case::new("zero weights", random_matrix(80, 120, 10, 0.3), random_vector(80, 11, 0.2));
    weighted.weights = Some((0..80).map(|i| if i % 3 == 0 { 0.0 } else { i as f64 }).collect());
    cases.push(weighted);
    let mut fixed =
        Case::new("some fixed", random_matrix(60, 120, 12, 0.5), random_vector(60, 13, 0.5));
    let lower: Vec<f64> = (0..120).map(|j| f64::from(j % 3) - 1.0).collect();
    let upper = (0..120).map(|j| if j % 2 == 0 { lower[j] } else { lower[j] + 0.5 }).collect();
    fixed.bounds = Some((lower, upper));
    cases.push(fixed);
    let scales = Mat::from_fn(100, 40, |i, j| {
        10f64.powi(3 * (j as i32 % 11) - 15)
            * f64::from(Random::new(14, i as u64, j as u64).uniform())
    });
    cases.push(Case::new("column scales", scales, random_vector(100, 15, 0.0)));
    cases
}

#[test]
fn golden_systems_give_the_answers_of_scipy() {
    for (case, stored) in golden() {
        let expected = stored["objective"].as_f64().expect("a number");
        let x = numbers(&stored["x"], f64::NAN);
        let zero: f64 = case.objective(&vec![0.0; x.len()]);
        for choice in CHOICES {
            let solution = case.solve_with(None, &BoundedOptions { choice, ..Default::default() });
            case.assert_solved(&solution);
            let found = case.objective(&solution.x);
            assert!(
                (found - expected).abs() <= 1e-10 * expected + 1e-12 * zero,
                "{}: objective {found:e}, SciPy {expected:e}",
                case.name
            );
            let residual = (2.0 * found).sqrt();
            assert!((solution.residual_norm - residual).abs() <= 1e-6 * residual + 1e-12);
            if stored["unique"] == true {
                let largest = x.iter().fold(0.0f64, |most, x| most.max(x.abs()));
                for (found, expected) in solution.x.iter().zip(&x) {
                    assert!((found - expected).abs() <= 1e-7 * largest, "{}", case.name);
                }
            }
        }
    }
}

#[test]
fn every_kind_of_system_meets_the_optimality_conditions() {
    for case in hard_cases() {
        for choice in CHOICES {
            let solution = case.solve_with(None, &BoundedOptions { choice, ..Default::default() });
            case.assert_solved(&solution);
        }
    }
}

#[test]
fn small_integer_systems_full_of_ties_are_solved() {
    for seed in 0..4000 {
        let mut random = Random::new(seed, 3, 0);
        let (rows, columns) = (1 + random.below(12), 1 + random.below(24));
        let mut digit = |most: usize| random.below(2 * most + 1) as f64 - most as f64;
        let matrix = Mat::from_fn(rows, columns, |_, _| digit(2));
        let target = (0..rows).map(|_| digit(3)).collect();
        let mut case = Case::new(&format!("integers {seed}"), matrix, target);
        if seed % 2 == 1 {
            let lower: Vec<f64> = (0..columns).map(|_| digit(2)).collect();
            let upper = lower.iter().map(|lower| lower + (digit(3) + 2.0).max(0.0)).collect();
            case.bounds = Some((lower, upper));
        }
        if seed % 3 == 1 {
            case.weights = Some((0..rows).map(|_| digit(2).abs()).collect());
        }
        let choice = CHOICES[seed as usize % 3];
        let solution = case.solve_with(None, &BoundedOptions { choice, ..Default::default() });
        // The box may hold larger values than the target, so this file's scale is not fair here.
        assert!(solution.converged, "{}: kkt {:e}", case.name, solution.kkt_residual);
        assert!(case.violation(&solution.x) <= 1e-10, "{}", case.name);
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    // Large enough that work is shared out.
    let mut case = Case::new("threads", bumps(3000, 60, 4, 1e-4), random_vector(3000, 16, 0.1));
    case.weights = Some(random_vector(3000, 17, -0.1));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| case.solve())
    };
    let (one, two, three) = (on(1), on(2), on(3));
    let bits = |solution: &BoundedSolution| -> Vec<u64> {
        solution.x.iter().map(|x| x.to_bits()).collect()
    };
    assert_eq!(bits(&one), bits(&two));
    assert_eq!(bits(&one), bits(&three));
    assert_eq!(one, three);
    case.assert_solved(&one);
}

#[test]
fn a_start_changes_the_work_and_not_the_answer() {
    for case in hard_cases() {
        let cold = case.solve();
        let expected = case.objective(&cold.x);
        let zero = case.objective(&vec![0.0; cold.x.len()]);
        let disturbed: Vec<f64> =
            cold.x.iter().enumerate().map(|(j, x)| x * (1.0 + 0.1 * (j as f64).sin())).collect();
        let ones = vec![1.0; cold.x.len()];
        for start in [&cold.x, &disturbed, &ones] {
            let warm = case.solve_with(Some(start), &BoundedOptions::default());
            case.assert_solved(&warm);
            let found = case.objective(&warm.x);
            assert!((found - expected).abs() <= 1e-9 * expected + 1e-11 * zero, "{}", case.name);
        }
    }
    let case = Case::new("tall", random_matrix(400, 150, 3, 0.5), random_vector(400, 4, 0.5));
    let cold = case.solve();
    let warm = case.solve_with(Some(&cold.x), &BoundedOptions::default());
    assert!(warm.iterations <= 2 && warm.passes <= 2, "{} {}", warm.iterations, warm.passes);
    for (warm, cold) in warm.x.iter().zip(&cold.x) {
        assert!((warm - cold).abs() < 1e-12);
    }
}

#[test]
fn a_ridge_is_the_same_as_rows_below() {
    let mut case = Case::new("ridge", random_matrix(60, 20, 18, 0.4), random_vector(60, 19, 0.4));
    case.ridge = 0.3;
    let norms: Vec<f64> = (0..20).map(|j| case.column_norm(j)).collect();
    let below = Mat::from_fn(80, 20, |i, j| match i {
        i if i < 60 => case.matrix[(i, j)],
        i if i - 60 == j => 0.3 * norms[j],
        _ => 0.0,
    });
    let mut target = case.target.clone();
    target.resize(80, 0.0);
    let (with, rows) = (case.solve(), Case::new("rows", below, target).solve());
    case.assert_solved(&with);
    for (with, rows) in with.x.iter().zip(&rows.x) {
        assert!((with - rows).abs() < 1e-12);
    }
}

#[test]
fn strides_and_paths_are_as_asked() {
    let case = Case::new("columns", random_matrix(90, 130, 20, 0.4), random_vector(90, 21, 0.4));
    let rows_first = case.matrix.transpose().to_owned();
    let problem = BoundedProblem { matrix: rows_first.transpose(), ..case.problem() };
    let options = BoundedOptions::default();
    let other = bounded_least_squares(&problem, None, &options, &Watch::new()).expect("a solution");
    assert_eq!(other, case.solve());
    assert_eq!(other.path, Path::Columns);
    let gram = BoundedOptions { choice: PathChoice::Gram, ..options };
    assert_eq!(case.solve_with(None, &gram).path, Path::Gram);
}

#[test]
fn empty_systems_have_answers() {
    for (rows, columns) in [(0, 0), (0, 3), (4, 0), (1, 1), (1, 5)] {
        let case = Case::new("small", Mat::from_fn(rows, columns, |_, _| 2.0), vec![1.0; rows]);
        let solution = case.solve();
        case.assert_solved(&solution);
        assert_eq!(solution.x.len(), columns);
    }
    let nothing = Case::new("b = 0", random_matrix(9, 4, 22, 0.5), vec![0.0; 9]);
    assert_eq!(nothing.solve().x, vec![0.0; 4]);
}

#[test]
fn wrong_input_is_an_error_that_names_the_place() {
    let fresh = || Case::new("wrong", random_matrix(6, 4, 23, 0.5), random_vector(6, 24, 0.5));
    let error = |case: &Case, start: Option<&[f64]>| {
        bounded_least_squares(&case.problem(), start, &BoundedOptions::default(), &Watch::new())
            .expect_err("an error")
    };

    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut case = fresh();
        case.matrix[(5, 2)] = bad;
        assert!(matches!(error(&case, None), BoundedError::MatrixEntry { row: 5, column: 2, .. }));
        case.weights = Some(vec![1.0, 1.0, 1.0, 1.0, 1.0, 0.0]);
        assert!(matches!(error(&case, None), BoundedError::MatrixEntry { row: 5, column: 2, .. }));
        let mut case = fresh();
        case.target[3] = bad;
        assert!(matches!(error(&case, None), BoundedError::TargetEntry { row: 3, .. }));
        let mut case = fresh();
        case.weights = Some(vec![1.0, bad, 1.0, 1.0, 1.0, 1.0]);
        assert!(matches!(error(&case, None), BoundedError::Weight { row: 1, .. }));
        let start = [0.0, bad, 0.0, 0.0];
        assert!(matches!(error(&fresh(), Some(&start)), BoundedError::Start { column: 1, .. }));
    }
    let mut case = fresh();
    case.weights = Some(vec![-1.0; 6]);
    assert!(matches!(error(&case, None), BoundedError::Weight { row: 0, .. }));
    case.weights = Some(vec![1.0; 5]);
    assert!(matches!(error(&case, None), BoundedError::Dimension { what: "weights", .. }));
    let mut case = fresh();
    case.matrix[(0, 1)] = 1e200;
    assert_eq!(error(&case, None), BoundedError::ColumnTooLarge { column: 1 });
    let mut case = fresh();
    case.bounds = Some((vec![0.0; 4], vec![1.0, 1.0, f64::NAN, 1.0]));
    assert!(matches!(error(&case, None), BoundedError::Bounds { column: 2, .. }));
    case.bounds = Some((vec![0.0, 2.0, 0.0, 0.0], vec![1.0; 4]));
    assert!(matches!(error(&case, None), BoundedError::Bounds { column: 1, .. }));
    let mut case = fresh();
    case.ridge = f64::NAN;
    assert!(matches!(error(&case, None), BoundedError::Ridge(_)));
    case.target.push(0.0);
    assert!(matches!(error(&case, None), BoundedError::Dimension { what: "target", .. }));
}

#[test]
fn a_cancelled_watch_and_too_few_iterations_are_told() {
    let case = Case::new("tall", random_matrix(400, 150, 3, 0.5), random_vector(400, 4, 0.5));
    let watch = Watch::new();
    watch.cancel();
    let options = BoundedOptions::default();
    let cancelled = bounded_least_squares(&case.problem(), None, &options, &watch);
    assert!(matches!(cancelled, Err(BoundedError::Cancelled(_))));
    let short = case.solve_with(None, &BoundedOptions { max_iterations: 3, ..options });
    assert!(!short.converged);
    assert!(short.iterations <= 3 && case.violation(&short.x) > 1e-12);
    assert!(BoundedOptions { tolerance: f64::NAN, ..options }.check().is_err());
    assert!(BoundedOptions { max_iterations: 0, ..options }.check().is_err());
}
