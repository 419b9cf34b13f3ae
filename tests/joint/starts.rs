//! Whatever reflectances the descent starts from, it ends at the same ones.

use lobelia::math::sampling::Random;
use lobelia::reconstruct::joint::system::Objective;

use crate::scenes::{Recipe, largest_difference, reflectances, uniform};

fn starts_agree(objective: Objective) {
    for seed in 1..=4 {
        let scene = Recipe { seed, base: 0.15, ..Recipe::default() }.make();
        let rows = scene.seen(&scene.noise(seed, 0.05));
        let held = scene.held(objective);
        let grey = scene.fit(&rows, &held, &scene.start(0.5));
        let mut random = Random::new(seed, 3, 0);
        for trial in 0..10 {
            let mut start = scene.start(0.5);
            let mut draw = || (0.1 + 0.85 * uniform(&mut random)).ln();
            start.log_diffuse.iter_mut().for_each(|u| *u = draw());
            // Every second start is lit, too.
            if trial % 2 == 1 {
                start.emission.iter_mut().for_each(|e| *e = -draw());
            }
            let fit = scene.fit(&rows, &held, &start);
            let away = largest_difference(&reflectances(&fit.state), &reflectances(&grey.state));
            println!("{objective:?} {seed} {trial}: {away:.1e} in {} steps", fit.iterations);
            assert!(away < 1e-5, "{objective:?}, scene {seed}, start {trial}: {away:.1e}");
            let excess = (fit.value / grey.value - 1.0).abs();
            assert!(excess < 1e-8, "{objective:?}, scene {seed}, start {trial}: {excess:.1e}");
        }
    }
}

#[test]
fn random_starts_end_at_one_log_optimum() {
    starts_agree(Objective::Log);
}

#[test]
fn random_starts_end_at_one_relative_optimum() {
    starts_agree(Objective::Relative);
}
