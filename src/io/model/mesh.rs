//! The faces of a model as files: OBJ with a material group for each surface, and binary glTF.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

use glam::{DVec3, Vec3};

use crate::geometry::mesh::Mesh;
use crate::io::export::glb;
use crate::io::obj::{self, Geometry};
use crate::io::{Error, Fault, atomic};
use crate::model::things::Face;
use crate::render::looks::BrdfF32;
use crate::render::model::{Model, Part, PartLook};
use crate::watch::Watch;

/// The reflectance that surfaces show before one is found.
const GREY: f32 = 0.5;
/// How an OBJ file begins that was written here.
const OWN: &str = "# made by lobelia model: metres, z up\n";

/// Writes `FILE.obj` and its library beside it, `FILE.mtl`: metres, z up, a group and a material
/// for each surface, by its id. Faces are counter-clockwise from where they are seen.
pub fn write_obj(file: &Path, faces: &[Face]) -> Result<(), Error> {
    let library = file.with_extension("mtl");
    let name = library.file_name().map_or_else(String::new, |own| own.to_string_lossy().into());
    let mut text = String::new();
    for surface in by_surface(faces).keys() {
        let _ = write!(text, "newmtl {surface}\nKd {GREY} {GREY} {GREY}\nillum 1\n\n");
    }
    atomic::write_bytes(&library, text.as_bytes())?;
    atomic::write_bytes(file, format!("{OWN}mtllib {name}\n{}", obj_text(faces)).as_bytes())
}

/// An error where the file is there and was not written by [`write_obj`]: a mesh of another program
/// must not be lost.
pub fn check_own(file: &Path) -> Result<(), Error> {
    if !file.exists() {
        return Ok(());
    }
    let unreadable = |source| Error::Read { file: file.to_owned(), source };
    let mut start = Vec::new();
    let opened = std::fs::File::open(file).map_err(unreadable)?;
    opened.take(OWN.len() as u64).read_to_end(&mut start).map_err(unreadable)?;
    if start == OWN.as_bytes() {
        return Ok(());
    }
    Err(Error::Invalid(Fault::new(
        file,
        "",
        "this mesh was not made from model.json, and would be written over",
        "Move it away, or name another file with --out",
    )))
}

/// The faces as triangles, each belonging to a surface.
pub fn geometry(file: &Path, faces: &[Face]) -> Result<Geometry, Error> {
    obj::parse(file, obj_text(faces).as_bytes())
}

/// Writes the faces as binary glTF, a mesh for each surface.
pub fn write_glb(file: &Path, name: &str, faces: &[Face]) -> Result<(), Error> {
    let Geometry { mesh, surfaces, .. } = geometry(file, faces)?;
    let parts = (0..surfaces.len()).map(|index| part(&mesh, index as u32, &surfaces[index].name));
    let (low, high) = mesh.bounds().unwrap_or_default();
    let model = Model {
        parts: parts.collect(),
        recovered: Vec::new(),
        added: Vec::new(),
        shell: None,
        cameras: Vec::new(),
        middle: 0.5 * (low + high),
        radius_m: 0.5 * (high - low).length(),
    };
    glb::write(file, name, &model, &Watch::new())
}

fn part(mesh: &Mesh, surface: u32, name: &str) -> Part {
    let (mut positions, mut triangles) = (Vec::<Vec3>::new(), Vec::new());
    for triangle in (0..mesh.triangles.len()).filter(|&own| mesh.surface[own] == surface) {
        let first = positions.len() as u32;
        positions.extend(mesh.corners(triangle));
        triangles.push([first, first + 1, first + 2]);
    }
    Part {
        name: name.to_owned(),
        material: name.to_owned(),
        positions,
        texcoords: Vec::new(),
        triangles,
        look: PartLook::Plain(BrdfF32 { diffuse: [GREY; 3], ..BrdfF32::default() }),
        is_counted: false,
    }
}

fn by_surface(faces: &[Face]) -> BTreeMap<&str, Vec<&Vec<DVec3>>> {
    let mut surfaces: BTreeMap<&str, Vec<&Vec<DVec3>>> = BTreeMap::new();
    for face in faces {
        surfaces.entry(&face.surface).or_default().extend(&face.polygons);
    }
    surfaces
}

fn obj_text(faces: &[Face]) -> String {
    let mut text = String::new();
    let mut count = 0;
    for (surface, polygons) in by_surface(faces) {
        let _ = writeln!(text, "g {surface}\nusemtl {surface}");
        // Corners that faces of one surface share are written once.
        let mut known: BTreeMap<[u64; 3], usize> = BTreeMap::new();
        let mut outlines = String::new();
        for polygon in polygons {
            outlines.push('f');
            for corner in polygon {
                let index =
                    *known.entry(corner.to_array().map(f64::to_bits)).or_insert_with(|| {
                        let _ = writeln!(text, "v {} {} {}", corner.x, corner.y, corner.z);
                        count += 1;
                        count
                    });
                let _ = write!(outlines, " {index}");
            }
            outlines.push('\n');
        }
        text += &outlines;
    }
    text
}
