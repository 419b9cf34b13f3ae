//! What a run takes of memory: foreseen, told, and measured.

use std::fs;
use std::path::Path;

use lobelia::io::exr;
use serde_json::{Value, json};

use super::{COARSE, Run, example, lobelia};

/// Makes the example's photographs so many times as wide and high.
fn enlarge(folder: &Path, factor: usize) {
    let from = example();
    fs::create_dir(folder.join("images")).unwrap();
    for name in ["scene.obj", "scene.mtl", "tags.json"] {
        if from.join(name).is_file() {
            fs::copy(from.join(name), folder.join(name)).unwrap();
        }
    }
    let text = fs::read_to_string(from.join("transforms.json")).unwrap();
    let mut cameras: Value = serde_json::from_str(&text).unwrap();
    for key in ["fl_x", "fl_y", "cx", "cy", "w", "h"] {
        let value = cameras[key].as_f64().unwrap() * factor as f64;
        cameras[key] = if key.len() == 1 { json!(value as u64) } else { json!(value) };
    }
    for frame in cameras["frames"].as_array().unwrap() {
        let name = frame["file_path"].as_str().unwrap();
        let picture = exr::read(&from.join(name)).unwrap();
        let (width, height) = (picture.width * factor, picture.height * factor);
        let pixel = |index: usize| {
            let (x, y) = (index % width / factor, index / width / factor);
            picture.pixels[y * picture.width + x]
        };
        let pixels: Vec<_> = (0..width * height).map(pixel).collect();
        exr::write_rgb(&folder.join(name), width, height, &pixels).unwrap();
    }
    fs::write(folder.join("transforms.json"), cameras.to_string()).unwrap();
}

/// Of a line of the run, the size that stands behind some words.
fn size(run: &Run, words: &str) -> f64 {
    let text = format!("{}\n{}", run.err, run.out);
    let line = text.lines().find_map(|line| line.split_once(words));
    let rest = line.unwrap_or_else(|| panic!("no \"{words}\" in {text}")).1.trim();
    rest.split(' ').next().unwrap().parse().unwrap()
}

/// Photographs of 46 million pixels: more than are held whole, and than stay in memory.
#[cfg(target_os = "linux")]
#[test]
fn a_run_takes_no_more_than_was_foreseen() {
    let folder = tempfile::tempdir().unwrap();
    enlarge(folder.path(), 10);
    let out = folder.path().join("out");
    let mut command = lobelia();
    command.arg("reconstruct").arg(folder.path()).arg("--out").arg(&out).args(COARSE);
    let run = Run::of(&mut command);
    assert_eq!(run.code, Some(0), "{run:?}");
    let (foreseen, taken) = (size(&run, "memory: up to"), size(&run, "memory at the peak:"));
    let in_files = size(&run, "; beside it");
    assert!(taken <= foreseen + in_files, "{taken} GB, and {foreseen} + {in_files} were foreseen");
    // And it is no idle bound.
    assert!(foreseen <= 3.0 * taken, "{taken} GB were taken, and {foreseen} foreseen");
    // A pixel took 58 bytes once, which would be 2.5 GB.
    assert!(taken < 1.2, "{taken} GB");
}
