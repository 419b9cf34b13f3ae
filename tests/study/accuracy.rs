//! Captures of known truth may come out no worse than 1.5 times what `assets/study/captures.toml`
//! says of them, each and all together; furnished rooms twice that. `LOBELIA_ACCURACY` names the folder
//! of captures.

use std::path::{Path, PathBuf};

use lobelia::io::export::summary;
use lobelia::io::{capture, solution::Solution, truth::Truth};
use lobelia::reconstruct::{self, Options};
use lobelia::study::score::{self, Intervals, Score};
use lobelia::watch::Watch;

/// By how much an error may grow.
const LIMIT: f64 = 1.5;
/// By how much that of a furnished room may: a common scale that is 4 % off makes 0.01 of it.
const FURNISHED_LIMIT: f64 = 2.0;
/// Below it an error is decided by which lamps the search happens to find: a smaller one of today
/// counts as this.
const CHANCE: f64 = 0.01;
/// A material of a furnished room counts if at least this part of all pixels shows it.
const SEEN: f64 = 0.01;

/// Name, whether it sets constants, and today's error of every capture of one kind in the file.
fn captures(kind: &str) -> Vec<(String, bool, f64)> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/study/captures.toml");
    let table: toml::Table = std::fs::read_to_string(file).unwrap().parse().unwrap();
    let entries = table[kind].as_array().unwrap();
    let entry = |entry: &toml::Value| {
        let name = entry["name"].as_str().unwrap().to_owned();
        let sets = !entry["sets"].as_array().unwrap().is_empty();
        (name, sets, entry["error"].as_float().unwrap())
    };
    entries.iter().map(entry).collect()
}

#[test]
fn captures_are_named_once_and_some_only_judge() {
    let captures = captures("capture");
    let mut names: Vec<&String> = captures.iter().map(|(name, ..)| name).collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), captures.len());
    let judging = captures.iter().filter(|(_, sets, _)| !sets).count();
    assert!(judging >= captures.len() / 2, "{judging} of {} judge", captures.len());
    let mean = captures.iter().map(|(.., error)| error).sum::<f64>() / captures.len() as f64;
    assert!(mean <= 0.015, "{mean}");
}

/// The folder of captures, unless the checks with it are not made.
fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("LOBELIA_ACCURACY").map(PathBuf::from);
    if folder.is_none() {
        crate::skip::skip("LOBELIA_ACCURACY names no folder of captures");
    }
    folder
}

/// The solution of a capture.
fn solved(folder: &Path, options: &Options) -> Solution {
    let capture = capture::load(folder, &Watch::new()).unwrap();
    let whole = reconstruct::run(&capture, options, &Watch::new(), &|_| ()).unwrap();
    summary(&capture, options, &whole, 0.0)
}

/// The solution with the default options and another seed, compared with the truth.
fn scored(folder: &Path, seed: Option<usize>) -> Score {
    let mut options = Options::default();
    options.general.seed = seed.unwrap_or(options.general.seed);
    let truth = Truth::read(&folder.join("truth.json")).unwrap();
    score::compare(&solved(folder, &options), &truth)
}

/// The mean absolute error of the diffuse reflectances of a furnished room, weighted by the pixels that
/// show each material, as its `truth.json` counts them.
fn error_by_area(folder: &Path, solution: &Solution) -> f64 {
    let text = std::fs::read_to_string(folder.join("truth.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&text).unwrap();
    let materials = truth["materials"].as_object().unwrap();
    let seen = |name: &str| materials[name]["seen_px"].as_f64().unwrap_or(0.0);
    let all: f64 = materials.keys().map(|name| seen(name)).sum();
    let (mut sum, mut weight) = (0.0, 0.0);
    for material in &solution.materials {
        let groups =
            material.surfaces.iter().filter_map(|surface| truth["groups"][surface].as_str());
        let mut names: Vec<&str> = groups.collect();
        names.dedup();
        let [name] = names[..] else { continue };
        if seen(name) < SEEN * all {
            continue;
        }
        let estimated = material.diffuse.unwrap_or_default();
        for (channel, value) in estimated.into_iter().enumerate() {
            let known = materials[name]["rho_d"][channel].as_f64().unwrap();
            sum += seen(name) * (value - known).abs();
            weight += seen(name);
        }
    }
    sum / weight
}

/// Furnished rooms by others, which have much more detail than the captures that were made here.
#[test]
fn no_furnished_room_comes_out_much_worse_than_today() {
    let Some(folder) = folder() else { return };
    let mut options = Options::default();
    options.textures.enabled = false;
    for (name, _, today) in captures("furnished") {
        let folder = folder.join(&name);
        let error = error_by_area(&folder, &solved(&folder, &options));
        println!("{name}: {error:.4}, {today:.4} today");
        assert!(error <= FURNISHED_LIMIT * today.max(CHANCE), "{name}: {error}, {today} today");
    }
}

/// In a room with a glossy floor the search can end in a wrong minimum, and whether it does depends on
/// the seed. With two of these seeds it once did (errors of 0.15 and 0.11); with the third, more rounds
/// of the search led into one. Today's errors are 0.011, 0.031 and 0.013. Most of them is the common scale,
/// which differs from seed to seed by 3.5 % (standard deviation of nine). So the mean of the errors is
/// bounded, and for every seed the error after one common scale.
#[test]
fn a_glossy_room_comes_out_right_by_any_seed() {
    let Some(folder) = folder() else { return };
    let seeds = [3, 5, 9];
    let mut sum = 0.0;
    for seed in seeds {
        let score = scored(&folder.join("corner-glossy"), Some(seed));
        let error = score.raw.unwrap().mean_diffuse;
        let scaled = score.common_scale.unwrap().errors.mean_diffuse;
        println!("seed {seed}: {error:.4}, {scaled:.4} after one common scale");
        sum += error;
        assert!(scaled <= 0.0154, "seed {seed}: {scaled} after one common scale");
        let Intervals { inside, of, .. } = score.intervals;
        assert!(of > 0 && 10 * inside >= 9 * of, "seed {seed}: {inside} of {of}");
    }
    let mean = sum / seeds.len() as f64;
    assert!(mean <= LIMIT * 0.0154, "{mean}");
}

#[test]
fn no_capture_comes_out_much_worse_than_today() {
    let Some(folder) = folder() else { return };
    let mut worse = Vec::new();
    let (mut now, mut before) = (0.0, 0.0);
    for (name, _, today) in captures("capture") {
        let error = scored(&folder.join(&name), None).raw.unwrap().mean_diffuse;
        println!("{name}: {error:.4}, {today:.4} today");
        (now, before) = (now + error, before + today);
        if error > LIMIT * today.max(CHANCE) {
            worse.push((name, error, today));
        }
    }
    assert!(worse.is_empty(), "{worse:?}");
    assert!(now <= LIMIT * before, "{now} in all, {before} today");
}
