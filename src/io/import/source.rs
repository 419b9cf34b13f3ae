//! Recognises the format of a source, by the names of its files or else by their contents.

use std::path::{Path, PathBuf};

use super::colmap;
use super::format::{Format, Sign};
use crate::io::error::read_bounded;
use crate::io::mesh::{self, extension};
use crate::io::{Error, Fault, capture, json};

/// Camera files are smaller, but for the points that some hold.
pub(super) const LARGEST: u64 = 1 << 30;

/// Formats whose cameras are in one file. Of several in a folder the first of this list is read.
const FORMATS: &[&Format] = &[
    &super::alicevision::FORMAT,
    &super::opensfm::FORMAT,
    &super::bundler::FORMAT,
    &super::metashape::FORMAT,
    &super::reality_capture::FORMAT,
];

/// A source and the file or folder to read.
pub(super) enum Source {
    Colmap(PathBuf),
    Transforms(Vec<PathBuf>),
    Cameras(&'static Format, PathBuf),
    Gltf(PathBuf),
    Mesh(PathBuf),
}

/// Where a COLMAP model lies in a folder.
const MODELS: [&str; 6] =
    ["", "sparse/0", "sparse", "colmap/sparse/0", "dense/0/sparse", "dense/sparse"];

/// Formats that are known by name and not read, with what to do instead.
const FOREIGN: [(&str, &str, &str); 8] = [
    ("abc", "Alembic", "Export cameras.sfm (Meshroom: ConvertSfMFormat to sfm or json)"),
    ("mvs", "OpenMVS", "Import the COLMAP or OpenMVG model that it was made from"),
    ("nvm", "VisualSFM", "Export the model as Bundler .out"),
    ("psx", "a Metashape project", "Export its cameras as XML (File, Export, Export Cameras)"),
    ("rcproj", "a RealityCapture project", "Export \"Internal/External camera parameters\" as CSV"),
    ("fbx", "FBX", "Export cameras and mesh as glTF"),
    ("usd", "USD", "Export cameras and mesh as glTF"),
    ("blend", "a Blender file", "Export cameras and mesh as glTF"),
];

/// Says what a path is.
pub(super) fn detect(path: &Path) -> Result<Source, Error> {
    let metadata =
        std::fs::metadata(path).map_err(|source| Error::Read { file: path.to_owned(), source })?;
    if metadata.is_dir() { in_folder(path) } else { of_file(path) }
}

/// Whether a path looks like something to import rather than to open: by names alone, so that it is
/// known at once.
pub fn is_foreign(path: &Path) -> bool {
    let name = |path: &Path| path.file_name().map(|own| own.to_string_lossy().into_owned());
    let is_source = |path: &Path| {
        let is_capture = ["scene.obj", "tags.json", "transforms.json"]
            .iter()
            .any(|own| name(path).as_deref() == Some(own));
        !is_capture && of_kind(path)
    };
    let has_mesh = |folder: &Path| capture::find_geometry(folder).is_ok();
    if path.is_file() {
        if name(path).as_deref() == Some("transforms.json") {
            return !path.parent().is_some_and(has_mesh);
        }
        return is_source(path);
    }
    if path.join("transforms.json").is_file() {
        return !has_mesh(path);
    }
    if MODELS.iter().any(|place| colmap::is_model(&path.join(place))) {
        return true;
    }
    let entries = std::fs::read_dir(path).into_iter().flatten();
    entries.flatten().map(|entry| entry.path()).any(|file| {
        file.is_file()
            && is_source(&file)
            && (!mesh::is_mesh(&file) || ["glb", "gltf"].contains(&extension(&file).as_str()))
    })
}

/// Whether a file's name is one that cameras or meshes of other programs have.
fn of_kind(file: &Path) -> bool {
    let stem =
        file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    match extension(file).as_str() {
        "glb" | "gltf" | "obj" | "ply" | "stl" => true,
        "json" => stem.starts_with("transforms") || stem == "reconstruction",
        "bin" | "txt" => ["cameras", "images", "points3D"].contains(&stem.as_str()),
        own => {
            let mut foreign = FOREIGN.iter().map(|(foreign, ..)| *foreign);
            ends().any(|end| end == own) || foreign.any(|end| end == own)
        }
    }
}

/// The ends of names that files of the formats have.
fn ends() -> impl Iterator<Item = &'static str> {
    FORMATS.iter().flat_map(|format| format.signs).filter_map(|sign| match sign {
        Sign::End(end) | Sign::Text(end, ..) => Some(*end),
        Sign::Json(_) => None,
    })
}

fn of_file(file: &Path) -> Result<Source, Error> {
    let own = file.to_owned();
    let stem =
        file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let extension = extension(file);
    if ["bin", "txt"].contains(&extension.as_str())
        && ["cameras", "images", "points3D"].contains(&stem.as_str())
    {
        return Ok(Source::Colmap(file.parent().unwrap_or(Path::new("")).to_owned()));
    }
    if let Some((_, name, remedy)) = FOREIGN.iter().find(|(own, ..)| *own == extension) {
        let problem = format!("this is {name}, which is not read");
        return Err(Error::Unsupported(Fault::new(file, "", problem, *remedy)));
    }
    Ok(match extension.as_str() {
        "glb" | "gltf" => Source::Gltf(own),
        "obj" | "ply" | "stl" => Source::Mesh(own),
        "json" => of_json(file)?,
        end => return of_end(file, end),
    })
}

fn of_end(file: &Path, end: &str) -> Result<Source, Error> {
    let mut what = "no camera file or mesh that is known";
    for format in FORMATS {
        for sign in format.signs {
            let is_it = match sign {
                Sign::End(own) => *own == end,
                Sign::Text(own, is_it, without) if *own == end => {
                    what = without;
                    is_it(&beginning(file)?)
                }
                Sign::Text(..) | Sign::Json(_) => false,
            };
            if is_it {
                return Ok(Source::Cameras(format, file.to_owned()));
            }
        }
    }
    Err(unknown(file, what))
}

fn of_json(file: &Path) -> Result<Source, Error> {
    let value = json::read(file)?;
    let is_it = |sign: &Sign| matches!(sign, Sign::Json(is_it) if is_it(&value));
    let format = FORMATS.iter().find(|format| format.signs.iter().any(is_it));
    Ok(match format {
        Some(format) => Source::Cameras(format, file.to_owned()),
        // Whatever else it is, the reader's message says what is missing.
        None => Source::Transforms(vec![file.to_owned()]),
    })
}

fn beginning(file: &Path) -> Result<String, Error> {
    Ok(String::from_utf8_lossy(&read_bounded(file, LARGEST)?).into_owned())
}

fn unknown(path: &Path, what: &str) -> Error {
    Error::Unsupported(Fault::new(
        path,
        "",
        format!("this is {what}"),
        "Give a COLMAP model's folder, transforms.json, cameras.sfm, a RealityCapture CSV, a \
         Metashape XML, bundle.out, reconstruction.json, glTF, or a mesh",
    ))
}

/// The first kind of source that a folder holds.
fn in_folder(folder: &Path) -> Result<Source, Error> {
    for place in MODELS {
        let model = if place.is_empty() { folder.to_owned() } else { folder.join(place) };
        if colmap::is_model(&model) {
            return Ok(Source::Colmap(model));
        }
    }
    let entries = std::fs::read_dir(folder)
        .map_err(|source| Error::Read { file: folder.to_owned(), source })?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    let named =
        |wanted: &str| files.iter().find(|file| file.file_name().is_some_and(|n| n == wanted));
    if let Some(file) = named("transforms.json") {
        return Ok(Source::Transforms(vec![file.clone()]));
    }
    // NeRF-synthetic: transforms_train.json, transforms_val.json, transforms_test.json.
    let parts: Vec<PathBuf> = files
        .iter()
        .filter(|file| extension(file) == "json")
        .filter(|file| {
            file.file_name().is_some_and(|n| n.to_string_lossy().starts_with("transforms"))
        })
        .cloned()
        .collect();
    if !parts.is_empty() {
        return Ok(Source::Transforms(parts));
    }
    if let Some(file) = named("reconstruction.json") {
        return of_file(file);
    }
    for kind in ends().chain(["glb", "gltf"]) {
        for file in files.iter().filter(|file| extension(file) == kind) {
            if let Ok(source) = of_file(file) {
                return Ok(source);
            }
        }
    }
    match files.iter().find(|file| mesh::is_mesh(file)) {
        Some(file) => Ok(Source::Mesh(file.clone())),
        None => Err(unknown(folder, "a folder without cameras or mesh")),
    }
}
