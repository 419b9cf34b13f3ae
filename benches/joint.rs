//! The joint problem (light and reflectances together) of three channels at the paper's size:
//! 3400 rows, 600 lobes, six materials, noise 5 %.
//!
//!     cargo bench --bench joint
//!
//! prints, besides Criterion's lines, one line for each objective and ridge such as `joint log,
//! ridge 0: 3 x 3400x600 in 0.20 s side by side, 0.35 s one after another, 12 10 11 steps, 150 of
//! 1800 lobes lit, slope 1e-8`. The bar is 0.3 s.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, SamplingMode};
use lobelia::reconstruct::joint::system::{Fit, Objective, Rows};
use rayon::prelude::*;

#[expect(dead_code, reason = "the tests use more of it")]
#[path = "../tests/joint/scenes.rs"]
mod scenes;

use scenes::{Recipe, Scene};

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let mut group = criterion.benchmark_group("joint");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.measurement_time(Duration::from_secs(5));
    // A scene of its own for every channel.
    let channels: Vec<(Scene, Rows)> = (1..=3)
        .map(|seed| {
            let size =
                Recipe { seed, rows: 3400, lights: 100, lobes_per_light: 6, ..Recipe::default() };
            let scene = size.make();
            let rows = scene.seen(&scene.noise(seed, 0.05));
            (scene, rows)
        })
        .collect();
    let objectives = [("log", Objective::Log), ("relative", Objective::Relative)];
    for ((name, objective), ridge) in objectives.into_iter().flat_map(|o| [(o, 3e-3), (o, 0.0)]) {
        let name = format!("{name}, ridge {ridge}");
        let all = || {
            channels.par_iter().map(|channel| solve(channel, objective, ridge)).collect::<Vec<_>>()
        };
        group.bench_function(&name, |bencher| bencher.iter(|| black_box(all())));
        let began = Instant::now();
        let fits: Vec<Fit> =
            channels.iter().map(|channel| solve(channel, objective, ridge)).collect();
        let alone = began.elapsed().as_secs_f64();
        let together = (0..5).map(|_| {
            let began = Instant::now();
            black_box(all());
            began.elapsed().as_secs_f64()
        });
        let together = together.fold(f64::INFINITY, f64::min);
        let steps: Vec<String> = fits.iter().map(|fit| fit.iterations.to_string()).collect();
        let lit = fits.iter().flat_map(|fit| &fit.state.emission).filter(|e| **e > 0.0).count();
        println!(
            "joint {name}: 3 x 3400x600 in {together:.2} s side by side, {alone:.2} s one after another, \
             {} steps, {lit} of 1800 lobes lit, slope {:.0e}",
            steps.join(" "),
            fits.iter().map(|fit| fit.kkt_residual).fold(0.0, f64::max)
        );
    }
    group.finish();
    criterion.final_summary();
}

fn solve((scene, rows): &(Scene, Rows), objective: Objective, ridge: f64) -> Fit {
    let mut held = scene.held(objective);
    held.ridge.fill(ridge);
    scene.fit(rows, &held, &scene.start(1.0 / 3.0))
}
