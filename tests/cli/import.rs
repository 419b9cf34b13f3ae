use std::fs;
use std::path::{Path, PathBuf};

use lobelia::io::exr;

use crate::{Run, files_below, lobelia};

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
    assert_eq!(files.len(), 9, "{files:?}");
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
