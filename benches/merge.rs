//! Recovering a response and merging a series, against OpenCV on the same codes in the same run.
//!
//!     LOBELIA_PYTHON=/path/to/python cargo bench --bench merge
//!
//! prints one line a stack such as `merge 9 x 768x512: response 40 ms, merge 15 ms; OpenCV 300
//! and 400 ms, ratio 12.7; median difference 1.0 / 1.1 / 1.2 %`. OpenCV is left out where
//! LOBELIA_PYTHON (default `python3`) cannot import cv2. LOBELIA_BRACKETS names further folders
//! of exposures with `exposures.csv`, divided by colons. The difference is of radiance after one
//! scale a channel, with the triangle weights on both sides.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use lobelia::exposures::options::Weights;
use lobelia::exposures::times::recover_checked;
use lobelia::exposures::{Codes, Exposure, MergeOptions, merge, samples};
use lobelia::io::{grouping, photograph};
use lobelia::math::sampling::Random;
use lobelia::watch::Watch;

const PEER: &str = r#"
import sys, time, numpy as np, cv2
folder, count, height, width = sys.argv[1], *map(int, sys.argv[2:5])
codes = np.fromfile(folder + "/codes", np.uint8).reshape(count, height, width, 3)
stack = [np.ascontiguousarray(e) for e in codes]
times = np.fromfile(folder + "/times", np.float32)
def best(f, n=3):
    seconds = []
    for _ in range(n):
        begin = time.perf_counter(); result = f(); seconds.append(time.perf_counter() - begin)
    return min(seconds), result
a, curve = best(lambda: cv2.createCalibrateDebevec(70, 10).process(stack, times))
b, merged = best(lambda: cv2.createMergeDebevec().process(stack, times, curve))
merged.astype(np.float32).tofile(folder + "/merged")
print(a, b)
"#;

fn main() {
    let times: Vec<f64> = (-6..=2).map(|k| f64::from(k).exp2()).collect();
    measure("generated", &generate(768, 512, &times));
    let folders = std::env::var("LOBELIA_BRACKETS").unwrap_or_default();
    for folder in folders.split(':').filter(|folder| !folder.is_empty()) {
        measure(folder, &load(Path::new(folder)));
    }
}

fn measure(name: &str, exposures: &[Exposure]) {
    let options = MergeOptions { weights: Weights::Hat, ..MergeOptions::default() };
    let reference = exposures.len() / 2;
    let recover = || {
        let readings = samples::read(exposures, reference, options.pixels, 0);
        recover_checked(&[readings], options.smoothness).expect("a response")
    };
    let checked = recover();
    let all = vec![true; exposures.len()];
    let run = || {
        merge(exposures, &all, reference, &checked.response, &options, &Watch::new())
            .expect("not cancelled")
    };
    let best = |work: &dyn Fn()| {
        (0..5)
            .map(|_| {
                let begin = Instant::now();
                work();
                begin.elapsed().as_secs_f64()
            })
            .fold(f64::INFINITY, f64::min)
    };
    let response_secs = best(&|| drop(recover()));
    let merge_secs = best(&|| drop(run()));
    let merged = run();
    let (width, height) = (merged.width, merged.height);
    let title = format!("merge {name}, {} x {width}x{height}", exposures.len());
    let own = format!("response {:.0} ms, merge {:.1} ms", 1e3 * response_secs, 1e3 * merge_secs);
    match opencv(exposures) {
        None => println!("{title}: {own}; no OpenCV found"),
        Some((calibrate, peer, theirs)) => {
            let differences: Vec<String> = (0..3)
                .map(|channel| {
                    let ratios = merged
                        .pixels
                        .iter()
                        .zip(theirs.chunks_exact(3))
                        .map(|(own, theirs)| f64::from(own[channel] / theirs[channel]))
                        .filter(|ratio| ratio.is_finite());
                    let mut ratios: Vec<f64> = ratios.collect();
                    let scale = median(&mut ratios);
                    let mut errors: Vec<f64> =
                        ratios.iter().map(|ratio| (scale / ratio - 1.0).abs()).collect();
                    format!("{:.1}", 100.0 * median(&mut errors))
                })
                .collect();
            println!(
                "{title}: {own}; OpenCV {:.0} and {:.0} ms, ratio {:.1}; median difference {} %",
                1e3 * calibrate,
                1e3 * peer,
                (calibrate + peer) / (response_secs + merge_secs),
                differences.join(" / ")
            );
        }
    }
}

fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Seconds for the response and the merge, and the radiance, red first.
fn opencv(exposures: &[Exposure]) -> Option<(f64, f64, Vec<f32>)> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let codes: Vec<u8> = exposures
        .iter()
        .flat_map(|exposure| match &exposure.codes {
            Codes::Eight(codes) => codes.as_flattened(),
            Codes::Sixteen(_) => panic!("OpenCV's Debevec reads 8 bits"),
        })
        .copied()
        .collect();
    std::fs::write(folder.path().join("codes"), codes).expect("written");
    let times: Vec<u8> =
        exposures.iter().flat_map(|exposure| (exposure.seconds as f32).to_le_bytes()).collect();
    std::fs::write(folder.path().join("times"), times).expect("written");
    let python = std::env::var("LOBELIA_PYTHON").unwrap_or_else(|_| "python3".into());
    let first = &exposures[0];
    let sizes = [exposures.len(), first.height, first.width].map(|number| number.to_string());
    let output =
        Command::new(python).arg("-c").arg(PEER).arg(folder.path()).args(sizes).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let mut numbers = text.split_whitespace().map(|word| word.parse::<f64>());
    let (calibrate, merge) = (numbers.next()?.ok()?, numbers.next()?.ok()?);
    let bytes = std::fs::read(folder.path().join("merged")).ok()?;
    let merged = bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    Some((calibrate, merge, merged))
}

fn load(folder: &Path) -> Vec<Exposure> {
    let table = folder.join("exposures.csv");
    let text = std::fs::read_to_string(&table).expect("exposures.csv");
    let files: Vec<_> = text
        .lines()
        .skip(1)
        .filter_map(|line| line.split_once(','))
        .map(|(name, _)| folder.join(name))
        .collect();
    let times = grouping::read_times(&table.to_string_lossy()).expect("a table");
    let series = grouping::group(&files, Some(&times), true).expect("a series").remove(0);
    std::iter::zip(series.files, series.seconds)
        .map(|(file, seconds)| {
            let photo = photograph::read(&file).expect("a photograph");
            let photograph::Photo { width, height, codes } = photo;
            Exposure { width, height, codes, seconds, shift: [0, 0] }
        })
        .collect()
}

/// A scene of about five decades through gamma 2.2, with noise.
fn generate(width: usize, height: usize, times: &[f64]) -> Vec<Exposure> {
    times
        .iter()
        .enumerate()
        .map(|(index, &seconds)| {
            let mut random = Random::new(1, index as u64, 0);
            let codes = (0..width * height)
                .map(|pixel| {
                    let u = (pixel % width) as f64 / width as f64;
                    let v = (pixel / width) as f64 / height as f64;
                    let ln = -5.0 + 10.0 * u + 0.4 * (40.0 * v + 9.0 * u).sin();
                    [0.0, 0.3, -0.2].map(|shift| {
                        let noise = 2.0 * f64::from(random.uniform() - 0.5);
                        let code = 255.0 * ((ln + shift * v).exp() * seconds).powf(1.0 / 2.2);
                        (code + noise).round().clamp(0.0, 255.0) as u8
                    })
                })
                .collect();
            Exposure { width, height, codes: Codes::Eight(codes), seconds, shift: [0, 0] }
        })
        .collect()
}
