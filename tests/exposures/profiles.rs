//! ICC profiles of JPEG, PNG and TIFF, against colour-science (`tests/golden/profiles/make.py`).

use std::path::{Path, PathBuf};

use lobelia::exposures::{MergeOptions, Merged, Response};
use lobelia::io::brackets::{self, Found, Series};
use lobelia::io::{Error, profile};
use lobelia::watch::Watch;
use serde_json::Value;

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/profiles").join(name)
}

fn series(name: &str) -> Series {
    Series { files: vec![golden(name)], seconds: vec![1.0], reference: 0 }
}

fn merged(series: &[Series]) -> Result<(Vec<Merged>, Found), Error> {
    let mut merged = Vec::new();
    let (options, watch) = (MergeOptions::default(), Watch::default());
    let found = brackets::merge_all(series, Some(Response::srgb()), &options, &watch, |_, one| {
        merged.push(one);
        Ok(())
    })?;
    Ok((merged, found))
}

#[test]
fn colours_are_those_of_colour_science_in_rec_709() {
    let text = std::fs::read_to_string(golden("expected.json")).unwrap();
    let expected: Value = serde_json::from_str(&text).unwrap();
    let block = expected["block"].as_u64().unwrap() as usize;
    let spaces = expected["spaces"].as_object().unwrap();
    assert_eq!(spaces.len(), 3);
    for (name, space) in spaces {
        let rec_709 = space["rec709"].as_array().unwrap();
        let file = space["file"].as_str().unwrap();
        // Codes of a JPEG are off by one or two at times, those of the others exact; the crate's powers
        // are, to about 3e-4.
        for (kind, tolerance) in [("png", 5e-4), ("tif", 5e-4), ("jpg", 0.03)] {
            let (pictures, found) = merged(&[series(&format!("{file}.{kind}"))]).unwrap();
            assert!(found.warnings.is_empty(), "{:?}", found.warnings);
            let at = |patch: usize| {
                let x = patch * block + block / 2;
                pictures[0].pixels[block / 2 * pictures[0].width + x].map(f64::from)
            };
            // The first patch, a grey of code 128, is what has a radiance of 1.
            let unit = rec_709[0][0].as_f64().unwrap();
            assert!((at(0)[0] - 1.0).abs() < tolerance, "{name} {kind}: {:?}", at(0));
            for (patch, rgb) in rec_709.iter().enumerate() {
                let rgb = [0, 1, 2].map(|k| rgb[k].as_f64().unwrap() / unit);
                let largest = rgb.iter().copied().fold(0.0, f64::max);
                for (found, expected) in std::iter::zip(at(patch), rgb) {
                    let off = (found - expected.max(0.0)).abs() / largest;
                    assert!(off < tolerance, "{name} {kind} {patch}: {:?} for {rgb:?}", at(patch));
                }
            }
        }
    }
}

#[test]
fn profiles_that_cannot_be_used_are_named_and_the_colours_left() {
    for (name, reason) in [("no-curves.tif", "it is a table"), ("cut.tif", "it is damaged")] {
        assert!(profile::read(&golden(name)).unwrap().unwrap().is_err(), "{name}");
        let (pictures, found) = merged(&[series(name)]).unwrap();
        let said = found.warnings.join("\n");
        assert!(said.contains(name) && said.contains(reason), "{said}");
        // IEC 61966-2-1, relative to the code 128.
        let linear = |code: f64| ((code / 255.0 + 0.055) / 1.055).powf(2.4);
        let pixel = pictures[0].pixels[0];
        for (found, code) in std::iter::zip(pixel, [128.0, 90.0, 60.0]) {
            let expected = linear(code) / linear(128.0);
            assert!((f64::from(found) / expected - 1.0).abs() < 1e-3, "{pixel:?}");
        }
    }
}

#[test]
fn photographs_of_two_curves_are_not_read_by_one() {
    let error = merged(&[series("p3.png"), series("adobe.png")]).unwrap_err().to_string();
    assert!(error.contains("adobe.png") && error.contains("p3.png"), "{error}");
    assert!(error.contains("Convert all to one profile"), "{error}");
}
