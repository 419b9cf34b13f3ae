use std::path::Path;

use serde_json::Value;

use crate::determinism::contents;
use crate::files::{keys, triple};
use crate::{Run, Table, example, files_below, json, lobelia};

/// The example with default options, to which everything below refers.
#[test]
fn by_default_the_example_is_solved_with_intervals_and_alike_on_any_threads() {
    let folder = tempfile::tempdir().unwrap();
    let run = |threads: &str| {
        let out = folder.path().join(threads);
        let mut command = lobelia();
        command.arg("reconstruct").arg(example()).arg("--out").arg(&out);
        Run::of(command.args(["--threads", threads])).succeeds();
        out
    };
    let (out, other) = (run("1"), run("2"));
    for ((name, left), (other, right)) in contents(&out).into_iter().zip(contents(&other)) {
        assert_eq!(name, other);
        assert!(left == right, "{name} differs");
    }
    assert_eq!(
        files_below(&out),
        ["convergence.csv", "lights.json", "samples.csv", "solution.json"]
    );
    the_summary_has_intervals(&json(&out.join("solution.json")));
    the_tables_agree_with_the_summary(&out);
    the_lights_are_those_of_the_summary(&out);
    the_truth_is_near(&out);
}

fn the_summary_has_intervals(solution: &Value) {
    assert_eq!(solution["method"], "joint");
    assert_eq!(solution["stopped"], "the objective's gradient vanishes");
    assert_eq!(solution["warnings"], serde_json::json!([]));
    for material in solution["materials"].as_array().unwrap() {
        let diffuse = triple(&material["diffuse"]);
        for (channel, diffuse) in diffuse.into_iter().enumerate() {
            let [low, high] =
                [0, 1].map(|k| material["diffuse_interval"][channel][k].as_f64().expect("a bound"));
            assert!(0.0 < low && low < diffuse && diffuse < high && high <= 1.0, "{material}");
        }
        assert_eq!(material["identified"], serde_json::json!([true, true, true]));
        for absent in ["specular", "specular_interval", "exponent", "exponent_interval"] {
            assert!(material[absent].is_null(), "{absent}: {material}");
        }
    }
    let light = &solution["light_model"];
    keys(light, &["world", "light_sets", "lamps", "sun", "notes"]);
    assert_eq!((&light["world"], &light["sun"]), (&"room".into(), &false.into()));
    assert_eq!(light["light_sets"], 6);
    let scale = &solution["scale"];
    keys(scale, &["singular_value", "log_rms", "log_sd"]);
    for name in ["singular_value", "log_rms", "log_sd"] {
        assert!(triple(&scale[name]).iter().all(|&v| v > 0.0), "{scale}");
    }
    // The rows held out are others than those fitted, so their errors differ by chance, too.
    let held_out = triple(&solution["rms"]["held_out"]);
    let fitted = triple(&scale["log_rms"]);
    let is_likely = |(out, fitted): (&f64, f64)| *out > 0.8 * fitted && *out < 0.04;
    assert!(held_out.iter().zip(fitted).all(is_likely), "{held_out:?} {fitted:?}");
}

fn the_tables_agree_with_the_summary(out: &Path) {
    let solution = json(&out.join("solution.json"));
    let convergence = Table::read(&out.join("convergence.csv"));
    assert_eq!(convergence.rows.len() as u64, solution["iterations"].as_u64().unwrap());
    let last = convergence.rows.len() - 1;
    for (channel, name) in ["r", "g", "b"].into_iter().enumerate() {
        let relative = convergence.number(last, &format!("relative_rms_{name}"));
        assert_eq!(relative, triple(&solution["rms"]["relative_final"])[channel]);
        for row in 0..=last {
            assert!(convergence.number(row, &format!("objective_{name}")) > 0.0);
        }
    }
    let samples = Table::read(&out.join("samples.csv"));
    assert_eq!(samples.rows.len() as u64, solution["scene"]["samples"].as_u64().unwrap());
    for row in 0..samples.rows.len() {
        for channel in ["r", "g", "b"] {
            let of = |name: &str| samples.number(row, &format!("{name}_{channel}"));
            let (computed, sum) = (of("computed"), of("photographed") + of("virtual"));
            assert!((computed - sum).abs() <= 1e-6 * computed, "{computed} is not {sum}");
        }
    }
}

fn the_lights_are_those_of_the_summary(out: &Path) {
    let solution = json(&out.join("solution.json"));
    let lights = json(&out.join("lights.json"));
    let lights = lights["lights"].as_array().unwrap();
    let count = |name: &str| solution["scene"][name].as_u64().unwrap() as usize;
    assert_eq!(lights.len(), count("virtual_lights"));
    let of_kind = |kind: &str| lights.iter().filter(|light| light["kind"] == kind).count();
    let lamps = of_kind("lamp");
    assert_eq!(solution["light_model"]["lamps"], lamps);
    assert!(lamps > 0 && lamps + of_kind("sphere") + of_kind("surface") == lights.len());
    let lobes = lights.iter().flat_map(|light| light["lobes"].as_array().unwrap());
    let emissions: Vec<[f64; 3]> = lobes.map(|lobe| triple(&lobe["emission"])).collect();
    assert!(emissions.iter().flatten().all(|&v| v >= 0.0));
    // The lobes of lamps that send nothing are left out.
    assert!(emissions.len() <= count("candidate_lobes"));
    let active = emissions.iter().filter(|emission| emission.iter().any(|&v| v > 0.0)).count();
    assert_eq!(active, count("active_lobes"));
}

fn the_truth_is_near(out: &Path) {
    let file = out.join("score.json");
    let mut command = lobelia();
    command.arg("score").arg(example()).arg(out).arg("--json").arg(&file);
    Run::of(&mut command).succeeds();
    let score = json(&file);
    let mean = score["raw"]["mean_diffuse"].as_f64().unwrap();
    assert!(mean <= 0.04, "{mean}");
    let intervals = &score["intervals"];
    assert_eq!((&intervals["of"], &intervals["without"]), (&18.into(), &0.into()));
    // At 95 %, with errors common to a channel: most are inside.
    assert!(intervals["inside"].as_u64().unwrap() >= 15, "{intervals}");
    assert!(intervals["mean_half_width"].as_f64().unwrap() < 0.15, "{intervals}");
}
