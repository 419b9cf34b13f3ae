use std::fs;
use std::path::{Path, PathBuf};

use lobelia::io::exr;

use crate::{Run, files_below, lobelia, merge};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/import").join(name)
}

fn import(source: &Path, out: &Path) -> std::process::Command {
    let mut command = lobelia();
    command.arg("import").arg(source).arg("--out").arg(out);
    command
}

#[test]
fn a_model_photographs_and_a_mesh_become_a_capture() {
    let folder = tempfile::tempdir().unwrap();
    let (photographs, out) = (folder.path().join("my photos"), folder.path().join("new/capture"));
    fs::create_dir_all(photographs.join("sub folder")).unwrap();
    for number in 1..=6 {
        let file = photographs.join(format!("sub folder/{number} ä.exr"));
        exr::write_rgb(&file, 160, 120, &vec![[0.5; 3]; 160 * 120]).unwrap();
    }
    let mut command = import(&data("colmap_binary"), &out);
    command.arg("--images").arg(&photographs).arg("--mesh").arg(data("boxes_binary.stl"));
    let run = Run::of(command.args(["--units", "cm", "--up", "-y"])).succeeds();
    for part in ["COLMAP: 6 cameras, 6 photographs, 6 of them radiance", "24 triangles in 12", "px"]
    {
        assert!(run.out.contains(part), "{part}: {}", run.out);
    }
    let files = files_below(&out);
    assert_eq!(files.len(), 10, "{files:?}");
    assert!(files.contains(&"points.json".to_owned()), "{files:?}");
    assert!(files.contains(&"images/sub folder/1 ä.exr".to_owned()), "{files:?}");
    // What was written is a capture.
    let info = Run::of(lobelia().arg("info").arg(&out)).succeeds();
    assert!(info.out.contains("photographs: 6 (6 measure radiance)"), "{}", info.out);
    // It is not written over.
    Run::of(&mut import(&data("colmap_binary"), &out)).fails(1, &["capture", "not empty"]);
    assert_eq!(files_below(&out), files);
}

#[test]
fn what_cannot_be_imported_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let refused = |source: &Path, parts: &[&str]| {
        Run::of(&mut import(source, &out)).fails(1, parts);
        assert!(!out.exists());
    };
    refused(&folder.path().join("lost"), &["lost", "Check that it exists"]);
    refused(folder.path(), &["without cameras or mesh"]);
    let alembic = folder.path().join("sfm.abc");
    fs::write(&alembic, "Ogawa").unwrap();
    refused(&alembic, &["sfm.abc", "Alembic", "cameras.sfm"]);
    let mut wrong = import(&data("colmap_text"), &out);
    Run::of(wrong.args(["--up", "sideways"])).fails(2, &["--up"]);
    let mut wrong = import(&data("colmap_text"), &out);
    Run::of(wrong.args(["--scale", "0"])).fails(1, &["--scale", "positive"]);
    let mut wrong = import(&data("colmap_text"), &out);
    Run::of(wrong.args(["--images", "/nonexistent/photos"])).fails(1, &["/nonexistent/photos"]);
    assert!(!out.exists());
}

#[test]
fn exposures_that_exif_tells_of_are_merged_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let (photographs, out) = (folder.path().join("photos"), folder.path().join("capture"));
    fs::create_dir(&photographs).unwrap();
    merge::series(&photographs, 2600, 0, 1.0);
    merge::series(&photographs, 2603, 1, 0.5);
    let frame = |name: &str, x: f64| {
        serde_json::json!({
            "file_path": name,
            "transform_matrix": [[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 2], [0, 0, 0, 1]],
        })
    };
    let cameras = serde_json::json!({
        "w": 40, "h": 40, "fl_x": 40, "fl_y": 40, "cx": 20, "cy": 20,
        "frames": [frame("IMG_2601.jpg", 0.0), frame("IMG_2604.jpg", 1.0)],
    });
    let source = photographs.join("transforms.json");
    fs::write(&source, cameras.to_string()).unwrap();
    // Not asked for: as they are, with a word.
    let plain = folder.path().join("plain");
    let run = Run::of(&mut import(&source, &plain)).succeeds();
    assert!(run.out.contains("exposure series: 2, of 3 exposures"), "{}", run.out);
    assert!(run.err.contains("--series"), "{}", run.err);
    assert!(files_below(&plain).contains(&"images/IMG_2601.jpg".to_owned()));
    let mut command = import(&source, &out);
    let run = Run::of(command.args(["--series", "--merge.align", "false"])).succeeds();
    assert!(!run.err.contains("nothing can be reconstructed"), "{}", run.err);
    assert_eq!(
        files_below(&out),
        ["images/IMG_2601.exr", "images/IMG_2604.exr", "transforms.json"],
    );
    let pixels = ["IMG_2601", "IMG_2604"]
        .map(|name| exr::read(&out.join(format!("images/{name}.exr"))).unwrap().pixels);
    let mut ratios: Vec<f32> = std::iter::zip(&pixels[0], &pixels[1])
        .map(|(a, b)| b[1] / a[1])
        .filter(|ratio| ratio.is_finite())
        .collect();
    ratios.sort_by(f32::total_cmp);
    let middle = ratios[ratios.len() / 2];
    assert!((middle - 0.5).abs() < 0.02, "one scale for both: {middle}");
    // Without any series the request is an error.
    let lone = folder.path().join("lone");
    fs::create_dir(&lone).unwrap();
    fs::copy(photographs.join("IMG_2601.jpg"), lone.join("IMG_2601.jpg")).unwrap();
    fs::copy(&source, lone.join("transforms.json")).unwrap();
    let mut command = import(&lone.join("transforms.json"), &folder.path().join("none"));
    Run::of(command.arg("--series")).fails(1, &["--series", "--times"]);
    assert!(!folder.path().join("none").exists());
}
