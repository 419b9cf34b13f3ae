//! Light and reflectance solved in turns, both half steps lowering Σ (L̂/L − 1)².

use faer::Mat;
use lobelia::reconstruct::joint::system::{Objective, Rows};
use lobelia::solve::bounded::{BoundedOptions, BoundedProblem, Bounds, bounded_least_squares};
use lobelia::watch::Watch;

use crate::scenes::{Recipe, Scene, mean_difference, product, reflectances};

struct Turn {
    reflectance: Vec<f64>,
    /// Root mean square of L̂/L − 1.
    rms: f64,
}

/// E ≥ 0 for the present ρ, then every ρ in closed form for that E, over and over.
fn alternate(scene: &Scene, rows: &Rows, start: f64, turns: usize) -> Vec<Turn> {
    let count = scene.material.len();
    let radiance: Vec<f64> = rows.log_radiance[0].iter().map(|log| log.exp()).collect();
    let base = &scene.design.base[0];
    let mut reflectance = vec![start; scene.reflectance.len()];
    let mut emission = vec![0.0; scene.design.columns()];
    let mut done = Vec::new();
    for _ in 0..turns {
        let gain: Vec<f64> =
            (0..count).map(|i| reflectance[scene.material[i]] / radiance[i]).collect();
        let matrix = Mat::from_fn(count, emission.len(), |i, j| {
            gain[i] * f64::from(scene.design.diffuse[(i, j)])
        });
        let target: Vec<f64> = (0..count).map(|i| 1.0 - gain[i] * base[i]).collect();
        let problem = BoundedProblem {
            matrix: matrix.as_ref(),
            target: &target,
            weights: None,
            bounds: Bounds::NonNegative,
            ridge: 0.0,
        };
        let options = BoundedOptions::default();
        emission = bounded_least_squares(&problem, Some(&emission), &options, &Watch::new())
            .expect("all is finite")
            .x;
        let light: Vec<f64> = product(&scene.design.diffuse, &emission)
            .iter()
            .zip(base)
            .map(|(d, b)| d + b)
            .collect();
        for (m, rho) in reflectance.iter_mut().enumerate() {
            let ratios =
                (0..count).filter(|&i| scene.material[i] == m).map(|i| light[i] / radiance[i]);
            let (sum, squares) = ratios.fold((0.0, 0.0), |(s, q), x| (s + x, q + x * x));
            *rho = (sum / squares).min(1.0);
        }
        let square =
            |i: usize| (reflectance[scene.material[i]] * light[i] / radiance[i] - 1.0).powi(2);
        let rms = ((0..count).map(square).sum::<f64>() / count as f64).sqrt();
        done.push(Turn { reflectance: reflectance.clone(), rms });
    }
    done
}

/// The measured trap: RMS stands still, reflectances still stand near their start, and the
/// optimum, which more than a thousand turns later is reached, is elsewhere. Stopping on the
/// change of RMS alone therefore returns the start.
#[test]
fn alternation_stands_still_near_its_start_and_ends_at_the_joint_optimum() {
    // A light room, so that the grey world's 1/3 is far off, and a scale that only a fifth of the
    // light tells.
    let reflectance = vec![0.85, 0.5, 0.7, 0.4, 0.8, 0.6];
    let scene = Recipe { reflectance, base: 0.2, ..Recipe::default() }.make();
    let rows = scene.seen(&scene.noise(7, 0.05));
    let joint = scene.fit(&rows, &scene.held(Objective::Relative), &scene.start(0.5));
    let optimum = reflectances(&joint.state);
    let start = 1.0 / 3.0;
    let turns = alternate(&scene, &rows, start, 1500);
    let away = |turn: usize| mean_difference(&turns[turn - 1].reflectance, &optimum);
    let rms = |turn: usize| turns[turn - 1].rms;
    let joint_rms = (2.0 * joint.value / scene.material.len() as f64).sqrt();
    for turn in [1, 2, 3, 7, 8, 30, 100, 300, 600, 1000, 1500] {
        println!("{turn}: rms {:.6}, ρ off by {:.6}", rms(turn), away(turn));
    }
    println!("joint: rms {joint_rms:.6}, {optimum:.3?}");

    let start_away = mean_difference(&vec![start; optimum.len()], &optimum);
    assert!(rms(7) - rms(8) < 0.01 * rms(7), "{} then {}", rms(7), rms(8));
    assert!(away(8) > 0.8 * start_away, "{} of {start_away}", away(8));
    assert!(turns.windows(2).all(|pair| pair[1].rms <= pair[0].rms * (1.0 + 1e-12)));
    // The limit: what is left after 1500 turns is a hundredth of what the start was off by, and
    // the alternation, which only falls, has not passed below the optimum.
    assert!(away(1500) < 0.01 * start_away, "{}", away(1500));
    assert!((1.0 - 1e-9..1.0 + 1e-4).contains(&(rms(1500) / joint_rms)), "{}", rms(1500));
}
