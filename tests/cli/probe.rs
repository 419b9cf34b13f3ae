//! `lobelia probe`: a mirror ball in a room, rendered by Mitsuba (`tests/golden/ball/make.py`), beside
//! the true panorama at its place.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use lobelia::io::exr;
use serde_json::Value;

use crate::{Run, lobelia};

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/ball")
}

/// The photographs of the ball with its outlines, as arguments.
fn views(which: &[usize]) -> Vec<String> {
    let text = std::fs::read_to_string(golden().join("ball.json")).unwrap();
    let ball: Value = serde_json::from_str(&text).unwrap();
    let one = |index: &usize| {
        let name = format!("{index}.exr");
        let outline = ball["outlines"][&name].as_array().unwrap();
        let points = outline.iter().map(|point| format!("{},{}", point[0], point[1]));
        let head = ["--image".to_owned(), name, "--outline".to_owned()];
        head.into_iter().chain(points).collect::<Vec<_>>()
    };
    which.iter().flat_map(one).collect()
}

fn probe(views: &[String], out: &Path, more: &[&str]) -> Run {
    let mut command = lobelia();
    command.args(["probe", "--quiet", "--out"]).arg(out).args(views).args(more);
    Run::of(command.arg("--").arg(golden()))
}

const REFLECTANCE: [&str; 2] = ["--reflectance", "0.9,0.85,0.8"];

#[test]
fn a_mirror_ball_shows_the_radiance_of_the_true_panorama() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("probe.exr");
    let truth = golden().join("truth.exr");
    let more = ["--width", "96", "--radius", "0.05", "--compare", truth.to_str().unwrap()];
    let run = probe(&views(&[0, 1, 2]), &out, &[&REFLECTANCE[..], &more].concat()).succeeds();
    let (found, expected) = (exr::read(&out).unwrap(), exr::read(&truth).unwrap());
    assert_eq!((found.width, found.height), (96, 48));
    assert_eq!((found.width, found.height), (expected.width, expected.height));
    let (mut near, mut total) = (0.0, 0.0);
    for (index, (own, truth)) in std::iter::zip(&found.pixels, &expected.pixels).enumerate() {
        let angle = (((index / 96) as f64 + 0.5) / 48.0 * PI).sin();
        let sum = |pixel: &[f32; 3]| pixel.iter().map(|&v| f64::from(v)).sum::<f64>();
        total += angle;
        near += if (sum(own) / sum(truth) - 1.0).abs() <= 0.05 { angle } else { 0.0 };
    }
    // The rest is at edges: the ball of 118 pixels blurs them by one to two texels, and its sides see
    // them from elsewhere than its middle does.
    assert!(near / total > 0.85, "{}", near / total);
    assert!(exr::read_channel(&out, "seen").unwrap().unwrap().iter().all(|seen| *seen == 1.0));
    // Its place, three times, and what the comparison says.
    assert_eq!(
        run.out.matches("its middle is at 0.300, -0.200, 1.100 m").count(),
        3,
        "{}",
        run.out
    );
    let told = format!("{:.1} %", 100.0 * near / total);
    assert!(run.out.contains(&format!("beside the other probe: {told}")), "{told}: {}", run.out);
    assert!(run.out.contains("differ by 1.") && run.err.is_empty(), "{} {}", run.out, run.err);
}

#[test]
fn one_photograph_shows_all_but_what_is_behind_the_ball() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("probe.exr");
    probe(&views(&[0]), &out, &[&REFLECTANCE[..], &["--width", "96"]].concat()).succeeds();
    let seen = exr::read_channel(&out, "seen").unwrap().unwrap();
    let found = exr::read(&out).unwrap();
    let dark = |index: usize| found.pixels[index] == [0.0; 3];
    assert!(seen.iter().enumerate().all(|(index, seen)| dark(index) == (*seen == 0.0)));
    assert!((1..seen.len() / 10).contains(&seen.iter().filter(|seen| **seen == 0.0).count()));
}

#[test]
fn what_is_no_ball_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("probe.exr");
    let fails = |views: &[String], more: &[&str], words: &[&str]| {
        let run = probe(views, &out, more);
        assert_ne!(run.code, Some(0), "{}", run.out);
        words.iter().for_each(|word| assert!(run.err.contains(word), "{word}: {}", run.err));
        assert!(!out.exists());
    };
    let mut off = views(&[0]);
    off[4] = "5,5".to_owned();
    fails(&off, &REFLECTANCE, &["0.exr", "not on the outline of one ball", "off by"]);
    fails(&off[..5], &REFLECTANCE, &["three points"]);
    off[4] = "5".to_owned();
    fails(&off, &REFLECTANCE, &["\"5\"", "no position"]);
    let twice = [views(&[0]), vec!["--image".to_owned(), "1.exr".to_owned()]].concat();
    fails(&twice, &REFLECTANCE, &["2 --image and 1 --outline"]);
    let mut other = views(&[0]);
    other[1] = "9.exr".to_owned();
    fails(&other, &REFLECTANCE, &["9.exr"]);
    fails(&views(&[0]), &["--reflectance", "1.2"], &["one number above 0"]);
    fails(&views(&[0]), &[&REFLECTANCE[..], &["--radius", "0"]].concat(), &["--radius"]);
}
