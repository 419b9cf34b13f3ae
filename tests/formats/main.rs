//! What is read from files and written to them.

mod cameras; // projections against OpenCV, conventions of transforms.json
mod captures; // whole folders: sound, incomplete and contradictory ones
mod chart_tables; // charts of one's own
mod charts; // charts in tags.json: what is understood, refused, left out
mod corpus; // files of others: damaged ones end in a message, sound ones are read
mod edits; // edits.json: what is refused, and everything that can be said
mod images; // OpenEXR and Radiance: values, windows, claims that are too large
mod imports; // cameras of other programs, meshes, whole imports
mod masks; // masks by every name, alpha, and what is wrong with them
mod meshes; // OBJ: polygons, surfaces, broken vertices, large ones
mod mutations; // every reader on changed files, bounded
mod solved; // a written solution read back to be rendered
mod tags; // tags.json against the surfaces of a mesh
mod upright; // photographs that EXIF turns, and their cameras
mod writers; // round trips of what the program writes

use std::path::{Path, PathBuf};

/// A folder of tests/data.
fn data(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(path)
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn put(folder: &Path, name: &str, contents: impl AsRef<[u8]>) -> PathBuf {
    let file = folder.join(name);
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(&file, contents).unwrap();
    file
}

/// The message of an outcome that must be a failure, which must contain all of `parts`.
fn message<T, E: std::fmt::Display>(outcome: Result<T, E>, parts: &[&str]) -> String {
    let Err(error) = outcome else { panic!("no error, though {parts:?} was expected") };
    let text = error.to_string();
    for part in parts {
        assert!(text.contains(part), "\"{part}\" is missing in: {text}");
    }
    text
}
