//! Geometry in any of the formats that are read: OBJ, glTF and GLB, PLY, STL.
//!
//! Meshes without groups of their own come as surfaces of connected planar regions, so that a
//! raw scan can be tagged.

mod assemble;
pub mod gltf;
pub mod ply;
pub mod regions;
pub mod stl;
pub mod weld;

use std::path::Path;

use super::error::read_bounded;
use super::obj::{self, Geometry};
use super::{Error, Fault};

pub use super::surfaces::SurfacesBy;

/// Ten million triangles are about 500 MB.
pub(crate) const LARGEST: u64 = 1 << 30;
/// The formats by the extension of their files.
pub const EXTENSIONS: [&str; 5] = ["obj", "glb", "gltf", "ply", "stl"];

/// Whether a file's name says that it is a mesh.
pub fn is_mesh(file: &Path) -> bool {
    EXTENSIONS.contains(&extension(file).as_str())
}

pub(super) fn extension(file: &Path) -> String {
    file.extension().map_or_else(String::new, |own| own.to_string_lossy().to_lowercase())
}

/// Reads a mesh, in whatever format its name or its first bytes say.
pub fn load(file: &Path) -> Result<Geometry, Error> {
    let mut geometry = read(file, SurfacesBy::default())?;
    if extension(file) == "obj" {
        return Ok(geometry);
    }
    weld::exactly(&mut geometry.mesh);
    if geometry.surfaces.len() == 1 && geometry.surfaces[0].name == assemble::NAMELESS {
        regions::split(&mut geometry, &regions::Options::default());
    }
    Ok(geometry)
}

/// Reads a mesh as the file has it: no vertices are joined, no surfaces made.
pub fn read(file: &Path, by: SurfacesBy) -> Result<Geometry, Error> {
    match extension(file).as_str() {
        "obj" => obj::read(file, by),
        "ply" => ply::parse(file, &read_bounded(file, LARGEST)?),
        "stl" => stl::parse(file, &read_bounded(file, LARGEST)?),
        "glb" | "gltf" => gltf::load(file)?.geometry(file, by),
        _ => Err(Error::Unsupported(Fault::new(
            file,
            "",
            "meshes of this format are not read",
            "Export the geometry as OBJ, glTF, PLY or STL",
        ))),
    }
}

/// Whether nothing in the file told surfaces apart.
pub(super) fn is_without_surfaces(geometry: &Geometry) -> bool {
    geometry.surfaces.len() == 1
        && ["default", assemble::NAMELESS].contains(&geometry.surfaces[0].name.as_str())
}
