//! `lobelia masks`: what it writes, and what it leaves alone.

use std::fs;
use std::path::Path;

use crate::{Run, example, lobelia};

fn masks(capture: &Path, more: &[&str]) -> Run {
    Run::of(lobelia().args(["masks", "--quiet"]).args(more).arg(capture))
}

/// A copy of the example with a black square in one of its photographs.
fn spoilt() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(&example(), folder.path());
    let images = folder.path().join("images");
    let mut files: Vec<_> = fs::read_dir(images).unwrap().map(|own| own.unwrap().path()).collect();
    files.sort();
    let image = lobelia::io::exr::read(&files[0]).unwrap();
    let (width, mut pixels) = (image.width, image.pixels);
    let (left, top, side) = (width / 2, image.height / 2, image.height / 6);
    for (y, x) in (top..top + side).flat_map(|y| (left..left + side).map(move |x| (y, x))) {
        pixels[y * width + x] = [0.0; 3];
    }
    lobelia::io::exr::write_rgb(&files[0], width, image.height, &pixels).unwrap();
    folder
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let own = entry.unwrap().path();
        let to = to.join(own.file_name().unwrap());
        if own.is_dir() {
            copy(&own, &to);
        } else {
            fs::copy(&own, &to).unwrap();
        }
    }
}

#[test]
fn masks_are_written_found_and_kept() {
    let folder = spoilt();
    let capture = folder.path();
    let first = masks(capture, &[]).succeeds().out;
    let own: Vec<_> = fs::read_dir(capture.join("masks")).unwrap().collect();
    assert_eq!(own.len(), first.lines().count(), "{first}");
    // The square is a 36th of the height squared; little else may be masked.
    let share = |line: &str| -> f64 {
        line.split(": ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
    };
    let shares: Vec<f64> = first.lines().map(share).collect();
    assert!(shares[0] > 1.5 && shares[0] < 4.0, "{first}");
    assert!(shares[1..].iter().all(|share| *share < 1.5), "{first}");
    let info = Run::of(lobelia().arg("info").arg(capture)).succeeds().out;
    assert!(info.contains(" masked ("), "{info}");
    // A mask that was painted since stays, unless it is to be replaced.
    let painted = own[0].as_ref().unwrap().path();
    fs::copy(own[1].as_ref().unwrap().path(), &painted).unwrap();
    let before = fs::read(&painted).unwrap();
    let second = masks(capture, &[]).succeeds().out;
    assert!(second.lines().all(|line| line.contains("is kept")), "{second}");
    assert_eq!(fs::read(&painted).unwrap(), before);
    let third = masks(capture, &["--replace", "--threads", "1"]).succeeds().out;
    assert_eq!(third, first, "masks that are there do not change what is suggested");
}

#[test]
fn masks_go_elsewhere_and_the_capture_stays_as_it_is() {
    let folder = spoilt();
    let out = tempfile::tempdir().unwrap();
    let place = out.path().join("new");
    masks(folder.path(), &["--out", place.to_str().unwrap(), "--threshold", "0.5"]).succeeds();
    assert!(fs::read_dir(&place).unwrap().count() > 2);
    assert!(!folder.path().join("masks").exists());
    masks(folder.path(), &["--threshold", "9"]).fails(1, &["--threshold", "-1 to 3"]);
    masks(&folder.path().join("nothing"), &[]).fails(1, &["nothing"]);
}
