//! Bounded least squares on systems like those of the method, against SciPy's `nnls` in the
//! same run.
//!
//!     LOBELIA_PYTHON=/path/to/python cargo bench --bench bounded
//!
//! prints, besides Criterion's lines, one line for each size such as
//! `bounded 3400x600: 12.0 ms, SciPy nnls 260 ms, ratio 21.7, kkt 1e-15 vs 2e-15`. SciPy is
//! left out where LOBELIA_PYTHON (default `python3`) cannot import it. LOBELIA_BENCH_LARGE=1 adds
//! 20000x3000, where SciPy takes minutes. LOBELIA_BENCH_SYSTEMS names a folder of raw systems
//! to use instead of generated ones: `ROWSxCOLUMNS.A` (column-major) and `.b`, little-endian f64.

use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use criterion::Criterion;
use faer::MatRef;
use glam::DVec3;
use lobelia::math::sampling::Random;
use lobelia::solve::bounded::{
    BoundedOptions, BoundedProblem, BoundedSolution, Bounds, bounded_least_squares,
};
use lobelia::watch::Watch;

const LOBES_PER_LIGHT: usize = 6;

fn main() {
    let mut criterion =
        Criterion::default().measurement_time(Duration::from_secs(5)).configure_from_args();
    measure(&mut criterion, 3400, 600, 20);
    if std::env::var("LOBELIA_BENCH_LARGE").is_ok_and(|value| value == "1") {
        measure(&mut criterion, 20_000, 3000, 10);
    }
    criterion.final_summary();
}

fn measure(criterion: &mut Criterion, rows: usize, columns: usize, samples: usize) {
    let name = format!("{rows}x{columns}");
    let system = System::load(&name, rows, columns)
        .unwrap_or_else(|| System::generate(rows, columns / LOBES_PER_LIGHT));
    let mut group = criterion.benchmark_group("bounded");
    group.sample_size(samples);

    let answer = system.solve(&system.target, None);
    group.bench_function(format!("{name} cold"), |bencher| {
        bencher.iter(|| system.solve(&system.target, None));
    });
    // A colour channel, or a pass, later: the target changes by up to 3 percent, smoothly.
    let changed: Vec<f64> = (0..rows)
        .map(|i| system.target[i] * (1.0 + 0.03 * (i as f64 / rows as f64 * 20.0).sin()))
        .collect();
    group.bench_function(format!("{name} warm, target changed 3%"), |bencher| {
        bencher.iter(|| system.solve(&changed, Some(&answer.x)));
    });
    group.finish();

    // The best of as many as SciPy gets, some before it and some after it, so that other work on
    // the machine meets both.
    let best = |times: usize| (0..times).map(|_| system.time_once()).fold(f64::INFINITY, f64::min);
    let before = best(3);
    let peer = system.run_scipy();
    let ours = before.min(best(2));
    match peer {
        Some((seconds, kkt)) => println!(
            "bounded {name}: {:.1} ms, SciPy nnls {:.0} ms, ratio {:.1}, kkt {:.0e} vs {kkt:.0e}",
            1e3 * ours,
            1e3 * seconds,
            seconds / ours,
            answer.kkt_absolute,
        ),
        None => println!("bounded {name}: {:.1} ms, no SciPy found", 1e3 * ours),
    }
}

struct System {
    rows: usize,
    columns: usize,
    matrix: Vec<f64>,
    target: Vec<f64>,
}

impl System {
    fn load(name: &str, rows: usize, columns: usize) -> Option<Self> {
        let folder = std::env::var_os("LOBELIA_BENCH_SYSTEMS")?;
        let read = |ending: &str, length: usize| {
            let path = Path::new(&folder).join(format!("{name}.{ending}"));
            let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            assert_eq!(bytes.len(), 8 * length, "{}", path.display());
            let values = bytes.chunks_exact(8).map(|v| f64::from_le_bytes(v.try_into().unwrap()));
            values.collect::<Vec<f64>>()
        };
        let (matrix, target) = (read("A", rows * columns), read("b", rows));
        Some(Self { rows, columns, matrix, target })
    }

    /// Samples on three planes lit by lobes of power 20 of lights around, each row divided by
    /// its target, as the method does.
    fn generate(rows: usize, lights: usize) -> Self {
        let mut random = Random::new(1, 0, 0);
        let uniform = |random: &mut Random| f64::from(random.uniform());
        let samples: Vec<(DVec3, DVec3)> = (0..rows)
            .map(|_| {
                let face = random.below(3);
                let (u, v) = (2.0 * uniform(&mut random), 2.0 * uniform(&mut random));
                match face {
                    0 => (DVec3::new(0.0, u, v), DVec3::X),
                    1 => (DVec3::new(u, 0.0, v), DVec3::Y),
                    _ => (DVec3::new(u, v, 0.0), DVec3::Z),
                }
            })
            .collect();
        let columns = lights * LOBES_PER_LIGHT;
        let mut matrix = Vec::with_capacity(rows * columns);
        for _ in 0..lights {
            let direction = DVec3::from_array(std::array::from_fn(|_| normal(&mut random).abs()));
            let light = DVec3::ONE + 3.0 * direction.normalize_or_zero();
            for _ in 0..LOBES_PER_LIGHT {
                let aim = 2.0 * DVec3::from_array(std::array::from_fn(|_| uniform(&mut random)));
                let axis = (aim - light).normalize_or_zero();
                matrix.extend(samples.iter().map(|&(position, normal)| {
                    let view = (position - light).normalize_or_zero();
                    view.dot(axis).max(0.0).powi(20) * (-view.dot(normal)).max(0.0) * 0.3
                }));
            }
        }
        let mut target = vec![0.0; rows];
        for column in matrix.chunks_exact(rows) {
            if uniform(&mut random) < 0.15 {
                let emission = -3.0 * (1.0 - uniform(&mut random)).ln();
                target.iter_mut().zip(column).for_each(|(b, a)| *b += emission * a);
            }
        }
        target.iter_mut().for_each(|b| *b *= 1.0 + 0.01 * normal(&mut random));
        let weights: Vec<f64> = target.iter().map(|b| 1.0 / b.max(1e-6)).collect();
        for column in matrix.chunks_exact_mut(rows) {
            column.iter_mut().zip(&weights).for_each(|(a, w)| *a *= w);
        }
        target.iter_mut().zip(&weights).for_each(|(b, w)| *b *= w);
        Self { rows, columns, matrix, target }
    }

    fn solve(&self, target: &[f64], start: Option<&[f64]>) -> BoundedSolution {
        let problem = BoundedProblem {
            matrix: MatRef::from_column_major_slice(&self.matrix, self.rows, self.columns),
            target,
            weights: None,
            bounds: Bounds::NonNegative,
            ridge: 0.0,
        };
        let options = BoundedOptions::default();
        let solution = bounded_least_squares(&problem, start, &options, &Watch::new())
            .expect("the system is finite");
        assert!(solution.converged);
        solution
    }

    fn time_once(&self) -> f64 {
        let start = Instant::now();
        std::hint::black_box(self.solve(&self.target, None));
        start.elapsed().as_secs_f64()
    }

    /// Seconds (the best of a few) and KKT residual of SciPy's `nnls`. OpenBLAS threads that wait
    /// for a busy core can slow it down fivefold, so it also runs with one, and the faster counts.
    fn run_scipy(&self) -> Option<(f64, f64)> {
        let mut file = tempfile::NamedTempFile::new().ok()?;
        for values in [&self.matrix, &self.target] {
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            file.write_all(&bytes).ok()?;
        }
        let python = std::env::var("LOBELIA_PYTHON").unwrap_or_else(|_| "python3".into());
        let run = |blas_threads: Option<&str>| {
            let mut command = Command::new(&python);
            if let Some(threads) = blas_threads {
                command.env("OPENBLAS_NUM_THREADS", threads);
            }
            command.args(["-c", PEER]).arg(file.path());
            command.args([self.rows.to_string(), self.columns.to_string()]);
            let text = String::from_utf8(command.output().ok()?.stdout).ok()?;
            let mut numbers = text.split_whitespace().map(str::parse::<f64>);
            Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
        };
        let (one, all) = (run(Some("1"))?, run(None)?);
        Some(if one.0 < all.0 { one } else { all })
    }
}

const PEER: &str = "
import sys, time
import numpy as np
from scipy.optimize import nnls
m, n = int(sys.argv[2]), int(sys.argv[3])
z = np.fromfile(sys.argv[1])
A, b = z[:m * n].reshape(n, m).T.copy(), z[m * n:]
best = np.inf
for _ in range(5 if m * n < 10_000_000 else 1):
    t = time.perf_counter()
    x, _ = nnls(A, b, maxiter=50 * n)
    best = min(best, time.perf_counter() - t)
g = A.T @ (A @ x - b)
print(best, max(np.abs(g[x > 0]).max(initial=0), (-g).max()))
";

/// A standard normal number (Box and Muller 1958).
fn normal(random: &mut Random) -> f64 {
    let (u, v) = (f64::from(random.uniform()), f64::from(random.uniform()));
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
