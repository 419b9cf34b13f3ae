//! Every file of tests/data, and of the folders in LOBELIA_BAD_FILES (separated by `:`), which
//! may be damaged: reading ends with a message that names the file, or with a value; without a
//! panic and without hanging.

use std::path::{Path, PathBuf};

use lobelia::io::{Error, hdr, import, mesh, mtl, obj, photograph, picture, transforms};
use lobelia::watch::Watch;

use crate::{data, folder, put};

/// Reads the file as what it claims to be; the message where that fails.
fn read(file: &Path) -> Option<String> {
    let extension = file.extension()?.to_string_lossy().to_lowercase();
    let outcome: Result<(), Error> = match extension.as_str() {
        "exr" => picture::read(file).map(drop),
        "tif" | "tiff" => {
            assert!(picture::read(file).is_err(), "{} is taken for radiance", file.display());
            exposure(file)
        }
        "hdr" => picture::read(file).and_then(|_| hdr::dimensions(file)).map(drop),
        "png" | "jpg" | "jpeg" => picture::dimensions(file).and_then(|_| exposure(file)),
        "dng" => exposure(file),
        "obj" => obj::load(file).map(drop),
        "mtl" => mtl::read(file).map(drop),
        "gltf" | "glb" | "ply" | "stl" => mesh::load(file).map(drop),
        "sfm" | "csv" | "xml" | "out" => {
            import::read(file, &import::Options::default(), &Watch::new()).map(drop)
        }
        "json" => transforms::read(file, transforms::Images::Optional)
            .and_then(|_| transforms::read(file, transforms::Images::Needed))
            .map(drop),
        _ => return None,
    };
    let text = outcome.err()?.to_string();
    let name = file.file_name()?.to_string_lossy();
    assert!(text.contains(&*name), "the message does not name {name}: {text}");
    Some(text)
}

/// Reads the file as one exposure of a series.
fn exposure(file: &Path) -> Result<(), Error> {
    photograph::shot(file)?;
    let photo = photograph::read(file)?;
    assert_eq!(photo.codes.len(), photo.width * photo.height);
    Ok(())
}

fn files_below(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { files_below(&path, files) } else { files.push(path) }
    }
    files.sort();
}

#[test]
fn damaged_files_end_in_a_message() {
    let mut files = Vec::new();
    files_below(&data(""), &mut files);
    if let Ok(further) = std::env::var("LOBELIA_BAD_FILES") {
        further.split(':').for_each(|folder| files_below(Path::new(folder), &mut files));
    }
    assert!(files.len() > 90);
    let mut refused = 0;
    for file in &files {
        let outcome = read(file);
        refused += usize::from(outcome.is_some());
        if let Some(message) = outcome {
            println!("{message}");
        }
    }
    println!("{refused} of {} files refused", files.len());
}

#[test]
fn every_beginning_of_a_sound_file_ends_in_a_message() {
    let folder = folder();
    let sound = [
        "formats/exr/exrs_f16_zip.exr",
        "formats/exr/exrs_f32_dwab.exr",
        "formats/hdr/rgbr4x4.hdr",
        "formats/obj/tobj_cornell_box.obj",
        "bad/transforms/own_scaled_rot.json",
    ];
    for path in sound {
        let bytes = std::fs::read(data(path)).unwrap();
        for step in 0..60 {
            let length = bytes.len() * step / 60;
            let file = put(
                folder.path(),
                Path::new(path).file_name().unwrap().to_str().unwrap(),
                &bytes[..length],
            );
            read(&file);
        }
        // One changed byte anywhere: a header that lies.
        for step in 0..400 {
            let mut changed = bytes.clone();
            let place = (step * 7919) % changed.len().min(1200);
            changed[place] = changed[place].wrapping_add(1 + (step % 255) as u8);
            let file = put(
                folder.path(),
                Path::new(path).file_name().unwrap().to_str().unwrap(),
                &changed,
            );
            read(&file);
        }
    }
}

#[test]
fn sound_files_are_read() {
    let refused_for_cause =
        ["11.deep.exr", "number_formats.obj", "point_cloud.obj", "validator_valid.gltf"];
    let mut files = Vec::new();
    files_below(&data("formats"), &mut files);
    for file in files {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        let refusal = read(&file);
        assert_eq!(
            refusal.is_some(),
            refused_for_cause.contains(&name.as_str()),
            "{name}: {refusal:?}"
        );
    }
}
