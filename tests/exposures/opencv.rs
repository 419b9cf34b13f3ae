//! The same exposures through OpenCV (tests/golden/exposures/make.py).

use std::path::{Path, PathBuf};

use lobelia::exposures::options::Weights;
use lobelia::exposures::response::recover;
use lobelia::exposures::{MergeOptions, Response, merge};
use lobelia::io::{exr, photograph};
use lobelia::watch::Watch;

use super::*;

const TIMES: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];
const SIDE: (usize, usize) = (48, 32);

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/exposures").join(name)
}

fn stack() -> Vec<Exposure> {
    let photo = photograph::read(&golden("exposures.png")).unwrap();
    let (width, height) = SIDE;
    assert_eq!((photo.width, photo.height), (width, height * TIMES.len()));
    let Codes::Eight(codes) = photo.codes else { panic!("8 bits") };
    std::iter::zip(codes.chunks(width * height), TIMES)
        .map(|(codes, seconds)| Exposure {
            width,
            height,
            codes: Codes::Eight(codes.to_vec()),
            seconds,
            shift: [0, 0],
        })
        .collect()
}

#[test]
fn the_response_is_that_of_opencv_on_the_same_pixels() {
    let stack = stack();
    // The grid of 70 pixels that createCalibrateDebevec looks at.
    let columns = (70.0 * SIDE.0 as f64 / SIDE.1 as f64).sqrt() as usize;
    let rows = 70 / columns;
    let steps = (SIDE.0 / columns, SIDE.1 / rows);
    let codes = (0..columns * rows)
        .flat_map(|index| {
            let x = steps.0 / 2 + index / rows * steps.0;
            let y = steps.1 / 2 + index % rows * steps.1;
            stack.iter().map(move |exposure| exposure.codes.at(y * SIDE.0 + x))
        })
        .collect();
    assert_eq!(columns * rows, 70);
    let readings = Readings { seconds: TIMES.to_vec(), codes };
    let own = recover(&[readings], &[vec![0; 5]], 10.0).unwrap();
    let theirs = lobelia::io::response::read(&golden("response.csv")).unwrap();
    for code in 0..256 {
        for channel in 0..3 {
            let [own, theirs] = [&own, &theirs].map(|r| r.ln_exposure(channel, code as f32));
            // OpenCV solves in single precision: NumPy in double precision is as far from it. No
            // pixel has codes below 33 or above 204, where smoothness alone holds the curve.
            let limit = if (33..=204).contains(&code) { 5e-3 } else { 1e-2 };
            assert!((own - theirs).abs() < limit, "{code}, channel {channel}: {own} {theirs}");
        }
    }
}

#[test]
fn radiance_is_that_of_opencv_with_the_same_response_and_weights() {
    let response = lobelia::io::response::read(&golden("response.csv")).unwrap();
    let options = MergeOptions { weights: Weights::Hat, ..MergeOptions::default() };
    let merged = merge(&stack(), &[true; 5], 2, &response, &options, &Watch::new()).unwrap();
    let theirs = exr::read(&golden("merged.exr")).unwrap();
    assert_eq!(merged.pixels.len(), theirs.pixels.len());
    for (own, theirs) in
        std::iter::zip(merged.pixels.iter().flatten(), theirs.pixels.iter().flatten())
    {
        // OpenCV adds logarithms up in single precision.
        assert!((own / theirs - 1.0).abs() < 1e-4, "{own} {theirs}");
    }
}

#[test]
fn radiance_by_both_on_their_own_differs_little() {
    let stack = stack();
    let checked = lobelia::exposures::times::recover_checked(&read(&stack), 10.0).unwrap();
    let options = MergeOptions::default();
    let merged = merge(&stack, &[true; 5], 2, &checked.response, &options, &Watch::new()).unwrap();
    let theirs = exr::read(&golden("merged.exr")).unwrap();
    for channel in 0..3 {
        let ratios: Vec<f64> = std::iter::zip(&merged.pixels, &theirs.pixels)
            .map(|(own, theirs)| f64::from(own[channel] / theirs[channel]))
            .collect();
        let scale = median(ratios.clone());
        let error = median(ratios.iter().map(|ratio| (ratio / scale - 1.0).abs()).collect());
        assert!(error < 0.02, "channel {channel}: {error}");
    }
}

#[test]
fn a_response_is_written_and_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("curve.csv");
    let response = lobelia::io::response::read(&golden("response.csv")).unwrap();
    lobelia::io::response::write(&file, &response).unwrap();
    let again = lobelia::io::response::read(&file).unwrap();
    for code in 0..256 {
        let [a, b] = [&response, &again].map(|r| r.ln_exposure(1, code as f32));
        assert!((a - b).abs() < 1e-12);
    }
    lobelia::io::response::draw(&file.with_extension("svg"), &response).unwrap();
    let drawing = std::fs::read_to_string(file.with_extension("svg")).unwrap();
    assert_eq!(drawing.matches("<polyline").count(), 3);
    // A linear response has no light at code 0.
    lobelia::io::response::write(&file, &Response::Linear { black: 0.0 }).unwrap();
    let linear = lobelia::io::response::read(&file).unwrap();
    assert!((linear.ln_exposure(0, 64.0) - 0.5_f64.ln()).abs() < 1e-12);
    let text = std::fs::read_to_string(golden("response.csv")).unwrap();
    for (wrong, part) in [
        (text.replacen("value", "code", 1), "line 1"),
        (text.lines().take(100).collect::<Vec<_>>().join("\n"), "rows are missing"),
        (text.replacen("\n3,", "\n3,-", 1), "line 5"),
        (text.replacen("\n200,", "\n200,1e-9,", 1), "line 202"),
    ] {
        std::fs::write(&file, wrong).unwrap();
        let message = lobelia::io::response::read(&file).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}
