//! Rays per second, and where Embree 3 is installed, how we compare with it.
//!
//! `cargo bench --bench rays` times our calls with Criterion, then traces the same rays with
//! Embree's single-ray calls (`rtcIntersect1`, `rtcOccluded1`, one thread, default build
//! quality), ours and theirs in turn, and prints the least times over the rounds. Hit
//! counts must agree. Without `libembree3.so.3` only ours are timed. `LOBELIA_RAYS_ROUNDS=n` sets
//! the rounds, and `cargo bench --bench rays -- none` skips Criterion's part.

mod rays {
    pub mod embree;
    pub mod scene;
}

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::Criterion;
use lobelia::geometry::bvh::{Ray, RayCaster};

use rays::embree::Embree;
use rays::scene::{RaySet, Scene};

fn main() {
    let scene = Scene::new();
    let start = Instant::now();
    let caster = RayCaster::build(&scene.positions, &scene.triangles);
    println!("{} triangles, tree built in {:.0?}", scene.triangles.len(), start.elapsed());
    let sets = scene.ray_sets(&caster);

    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1))
        .configure_from_args();
    for set in &sets {
        criterion.bench_function(&format!("{} closest", set.name), |bencher| {
            bencher.iter(|| count_closest(&caster, &set.rays));
        });
        criterion.bench_function(&format!("{} occluded", set.name), |bencher| {
            bencher.iter(|| count_occluded(&caster, &set.rays));
        });
    }
    criterion.final_summary();

    match Embree::load(&scene.positions, &scene.triangles) {
        Ok(embree) => compare(&caster, &embree, &sets),
        Err(error) => println!("rays: no Embree to compare with ({error})"),
    }
}

fn count_closest(caster: &RayCaster, rays: &[Ray]) -> usize {
    rays.iter().filter(|ray| black_box(caster.closest(ray)).is_some()).count()
}

fn count_occluded(caster: &RayCaster, rays: &[Ray]) -> usize {
    rays.iter().filter(|ray| caster.occluded(ray)).count()
}

/// Rays that are timed at a time, ours and theirs in turn: so few that a busy machine disturbs
/// both alike, and in some round neither.
const CHUNK: usize = 4096;

fn compare(caster: &RayCaster, embree: &Embree, sets: &[RaySet]) {
    let rounds = std::env::var("LOBELIA_RAYS_ROUNDS").ok().and_then(|n| n.parse().ok());
    for set in sets {
        type Count<'a> = &'a dyn Fn(&[Ray]) -> usize;
        let calls: [(&str, [Count; 2]); 2] = [
            ("closest", [&|rays| count_closest(caster, rays), &|rays| embree.count_closest(rays)]),
            (
                "occluded",
                [&|rays| count_occluded(caster, rays), &|rays| embree.count_occluded(rays)],
            ),
        ];
        for (call, counters) in calls {
            let mut least = vec![[f64::INFINITY; 2]; set.rays.len().div_ceil(CHUNK)];
            let mut counts = [0; 2];
            for round in 0..rounds.unwrap_or(9) {
                for (chunk, least) in set.rays.chunks(CHUNK).zip(&mut least) {
                    for who in [round % 2, 1 - round % 2] {
                        let start = Instant::now();
                        let count = black_box(counters[who](chunk));
                        least[who] = least[who].min(start.elapsed().as_secs_f64());
                        counts[who] += if round == 0 { count } else { 0 };
                    }
                }
            }
            let [our_ns, their_ns] = [0, 1].map(|who| {
                let seconds: f64 = least.iter().map(|chunk| chunk[who]).sum();
                seconds * 1e9 / set.rays.len() as f64
            });
            println!(
                "rays: {} {call} {our_ns:.0} ns, Embree {their_ns:.0} ns, ratio {:.2} (hits {} and {})",
                set.name,
                our_ns / their_ns,
                counts[0],
                counts[1],
            );
            // Rays that graze an edge may be counted otherwise: Embree's default is not watertight.
            let difference = counts[0].abs_diff(counts[1]);
            assert!(difference * 10_000 <= set.rays.len(), "hit counts differ by {difference}");
        }
    }
}
