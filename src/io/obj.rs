//! Wavefront OBJ: the partial geometry.
//!
//! A bad byte, a `\` at a line's end, a line element or a comment behind a face do no harm, and a
//! name that no library defines is a surface's name, too: files of many programs have such things.
//! Faces are triangulated here, since a fan is wrong for a concave one.
//!
//! A polygon that is bent by more than `BENT` is numbered as one polygon a triangle, so that
//! polygons are planar as `Mesh::polygon` promises.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec2};

use super::error::read_bounded;
use super::obj_text::{self, Corner, Face, Parsed, Tally, broken_vertex, is_usable, locate};
use super::polygon::{self, Shape};
use super::surfaces::SurfacesBy;
use super::{Error, Fault};
use super::{inside, mtl};
use crate::geometry::mesh::Mesh;
use crate::scene::{Brdf, Role, Surface};

/// Ten million triangles are about 500 MB of text.
const LARGEST: u64 = 1 << 30;
/// Cosine of the angle between two triangles of a polygon that counts as bent: 2°.
const BENT: f32 = 0.9994;
/// Point tests of the triangulation of all concave polygons: about a second.
const PATIENCE: u64 = 300_000_000;

/// The geometry as read, before any tag.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    pub mesh: Mesh,
    /// In order of first appearance; all `Untagged`.
    pub surfaces: Vec<Surface>,
    /// For each surface, whether the material library calls it specular.
    pub specular: Vec<bool>,
    /// What materials of the file reflect as it says, by the names of surfaces.
    pub reflectances: HashMap<String, Brdf>,
    pub warnings: Vec<String>,
    /// What could not be read of the material libraries: of interest without tags only.
    pub library_warnings: Vec<String>,
    /// Images of reflectance that are not read: of interest for objects only.
    pub image_notes: Vec<String>,
}

/// Reads a mesh and the material libraries it names.
pub fn load(file: &Path) -> Result<Geometry, Error> {
    read(file, SurfacesBy::default())
}

/// Reads a mesh whose surfaces are told apart as the caller wishes.
pub fn read(file: &Path, by: SurfacesBy) -> Result<Geometry, Error> {
    parse_by(file, &read_bounded(file, LARGEST)?, by)
}

/// Reads the bytes of a mesh; `file` is for messages, and libraries are looked for beside it.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Geometry, Error> {
    parse_by(file, bytes, SurfacesBy::default())
}

fn parse_by(file: &Path, bytes: &[u8], by: SurfacesBy) -> Result<Geometry, Error> {
    if bytes.starts_with(&[0xFE, 0xFF])
        || bytes.starts_with(&[0xFF, 0xFE])
        || bytes.iter().take(4096).any(|&byte| byte == 0)
    {
        return Err(Error::Invalid(Fault::new(
            file,
            "byte 0",
            "this is UTF-16 or binary data, not the plain text of an OBJ file",
            "Save it as UTF-8 text, or export it again as OBJ",
        )));
    }
    let text = String::from_utf8_lossy(bytes);
    let parsed = obj_text::parse(&text, by);
    if parsed.faces.is_empty() {
        return Err(no_faces(file, &parsed));
    }
    if parsed.is_faulty {
        return Err(locate(file, &text, "a face names a vertex that is not there"));
    }
    let mut geometry = Builder::new(file, &text, &parsed).build()?;
    let (libraries, warnings) = read_libraries(file, &parsed);
    geometry.library_warnings = warnings;
    let own = |name: &String| libraries.get(name);
    geometry.specular =
        parsed.surfaces.iter().map(|name| own(name).is_some_and(|own| own.is_specular)).collect();
    for name in &parsed.surfaces {
        let Some(material) = own(name) else { continue };
        geometry.reflectances.extend(material.reflectance.map(|own| (name.clone(), own)));
        if material.has_image {
            geometry.image_notes.push(format!(
                "{}: the image of the material \"{name}\" is not read; its Kd is taken as it is.",
                file.display()
            ));
        }
    }
    Ok(geometry)
}

/// Turns faces into the mesh.
struct Builder<'a> {
    file: &'a Path,
    text: &'a str,
    parsed: &'a Parsed,
    mesh: Mesh,
    /// For each vertex of the file, the run of faces that used it last and its number in the mesh
    /// then.
    numbers: Vec<(u32, u32)>,
    /// Counts runs of faces of one surface, from 1.
    run: u32,
    surface: u32,
    triangle_texcoords: Vec<[Vec2; 3]>,
    /// For each surface: textured polygons, all polygons.
    textured: Vec<(usize, usize)>,
    polygons: u32,
    vertices: Vec<u32>,
    corners: Vec<DVec3>,
    triangles: Vec<[usize; 3]>,
    patience: u64,
    broken: Tally,
    flat: Tally,
    crossed: Tally,
    broken_texcoords: Tally,
}

impl<'a> Builder<'a> {
    fn new(file: &'a Path, text: &'a str, parsed: &'a Parsed) -> Self {
        Self {
            file,
            text,
            parsed,
            mesh: Mesh::default(),
            numbers: vec![(0, 0); parsed.vertices.len()],
            run: 0,
            surface: u32::MAX,
            triangle_texcoords: Vec::new(),
            textured: vec![(0, 0); parsed.surfaces.len()],
            polygons: 0,
            vertices: Vec::new(),
            corners: Vec::new(),
            triangles: Vec::new(),
            patience: PATIENCE,
            broken: Tally::default(),
            flat: Tally::default(),
            crossed: Tally::default(),
            broken_texcoords: Tally::default(),
        }
    }

    fn build(mut self) -> Result<Geometry, Error> {
        let parsed = self.parsed;
        let mut start = 0;
        for face in &parsed.faces {
            let corners = &parsed.corners[start..face.end];
            start = face.end;
            if self.surface != face.surface {
                self.surface = face.surface;
                self.run += 1;
            }
            self.add(face, corners);
        }
        self.finish()
    }

    /// The number of a vertex in the mesh. Surfaces share none.
    fn number(&mut self, vertex: u32) -> u32 {
        let (run, number) = &mut self.numbers[vertex as usize];
        if *run != self.run {
            (*run, *number) = (self.run, self.mesh.positions.len() as u32);
            self.mesh.positions.push(self.parsed.vertices[vertex as usize]);
        }
        *number
    }

    fn add(&mut self, face: &Face, of_face: &[Corner]) {
        let line = face.line;
        let mut vertices = std::mem::take(&mut self.vertices);
        vertices.clear();
        vertices.extend(of_face.iter().map(|corner| self.number(corner.vertex)));
        let position = |vertex: &u32| self.mesh.positions[*vertex as usize];
        if vertices.iter().any(|vertex| !is_usable(position(vertex))) {
            self.broken.add(line);
            self.vertices = vertices;
            return;
        }
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        corners.extend(vertices.iter().map(|vertex| position(vertex).as_dvec3()));
        let mut triangles = std::mem::take(&mut self.triangles);
        triangles.clear();
        let shape = polygon::triangulate(&corners, &mut triangles, &mut self.patience);
        match shape {
            Shape::Flat => self.flat.add(line),
            Shape::Fan => self.crossed.add(line),
            Shape::Sound => {}
        }
        if shape != Shape::Flat {
            self.add_triangles(face, of_face, &vertices, &triangles);
        }
        // Kept for the next face: an allocation a face takes as long as the rest.
        (self.vertices, self.corners, self.triangles) = (vertices, corners, triangles);
    }

    fn add_triangles(
        &mut self,
        face: &Face,
        of_face: &[Corner],
        vertices: &[u32],
        triangles: &[[usize; 3]],
    ) {
        let parsed = self.parsed;
        let first = self.mesh.triangles.len();
        let mut textured = face.is_textured && !parsed.texcoords.is_empty();
        for triangle in triangles {
            self.mesh.triangles.push(triangle.map(|corner| vertices[corner]));
            self.mesh.surface.push(face.surface);
            self.mesh.polygon.push(self.polygons);
            let texcoords = if textured {
                triangle.map(|corner| parsed.texcoords[of_face[corner].texcoord as usize])
            } else {
                [Vec2::ZERO; 3]
            };
            if texcoords.iter().any(|texcoord| !texcoord.is_finite()) {
                self.broken_texcoords.add(face.line);
                textured = false;
            }
            self.triangle_texcoords.push(texcoords);
        }
        self.polygons += 1;
        split_if_bent(&mut self.mesh, first, &mut self.polygons);
        let (of_texture, all) = &mut self.textured[face.surface as usize];
        *of_texture += usize::from(textured);
        *all += 1;
    }

    fn finish(mut self) -> Result<Geometry, Error> {
        if self.mesh.triangles.is_empty() {
            return Err(self.nothing_left());
        }
        let warnings = self.warnings();
        let surfaces: Vec<Surface> = std::iter::zip(&self.parsed.surfaces, &self.textured)
            .map(|(name, &(textured, all))| Surface {
                name: name.clone(),
                role: Role::Untagged,
                has_texcoords: all > 0 && textured == all,
            })
            .collect();
        if surfaces.iter().any(|surface| surface.has_texcoords) {
            self.mesh.texcoords = self.triangle_texcoords;
            for (texcoords, &surface) in self.mesh.texcoords.iter_mut().zip(&self.mesh.surface) {
                if !surfaces[surface as usize].has_texcoords {
                    *texcoords = [Vec2::ZERO; 3];
                }
            }
        }
        if self.broken.count > 0 {
            drop_unused_positions(&mut self.mesh);
        }
        Ok(Geometry { mesh: self.mesh, surfaces, warnings, ..Default::default() })
    }

    fn nothing_left(&self) -> Error {
        if self.broken.count == 0 {
            return Error::Invalid(Fault::new(
                self.file,
                format!("line {}", self.flat.first_line),
                "no face of the mesh has any area",
                "Check the scale and the coordinates of the exported mesh",
            ));
        }
        let (line, problem) = broken_vertex(self.text, self.broken.first_line)
            .unwrap_or((self.broken.first_line, "a vertex of this face is broken".into()));
        Error::Invalid(Fault::new(
            self.file,
            format!("line {line}"),
            format!("{problem}, and no face of the mesh is free of such vertices"),
            "Export the mesh again, after removing or repairing broken vertices",
        ))
    }

    fn warnings(&self) -> Vec<String> {
        let name = self.file.display();
        let mut warnings = Vec::new();
        if self.broken.count > 0 {
            let vertex = broken_vertex(self.text, self.broken.first_line)
                .map_or(String::new(), |(line, problem)| {
                    format!(" (vertex of line {line}: {problem})")
                });
            warnings.push(format!(
                "{name}, line {}{vertex}: {} with broken vertices left out. They neither shade nor \
                 reflect: repair them if they matter.",
                self.broken.first_line,
                self.broken.faces(),
            ));
        }
        let mut warn = |tally: Tally, what: &str| {
            if tally.count > 0 {
                let (line, faces) = (tally.first_line, tally.faces());
                warnings.push(format!("{name}, line {line}: {faces} {what}"));
            }
        };
        warn(self.flat, "without area left out (the first is named).");
        warn(self.parsed.too_small, "with fewer than three corners left out (the first is named).");
        warn(
            self.crossed,
            "with an outline that crosses itself triangulated as a fan, which may cover too much. \
             Split such faces into simple ones.",
        );
        warn(
            self.broken_texcoords,
            "with texture coordinates that are no numbers: the surface is treated as not unwrapped.",
        );
        warnings.extend(self.far_from_origin());
        warnings
    }

    /// Single precision keeps seven digits, which map coordinates use up before the metre.
    fn far_from_origin(&self) -> Option<String> {
        let (low, high) = self.mesh.bounds()?;
        let spacing = low.abs().max(high.abs()).max_element() * f32::EPSILON;
        let size = (high - low).length();
        (spacing > 1e-4 * size).then(|| {
            format!(
                "{}: the mesh is {size:.3} m large but far from the origin, so its positions are \
                 rounded to {spacing:.1e} m. Move mesh and cameras towards the origin.",
                self.file.display()
            )
        })
    }
}

/// Numbers the triangles from `first` on, which are those of one polygon, as one polygon each where
/// they do not lie in one plane. `polygons` is the next number.
pub(super) fn split_if_bent(mesh: &mut Mesh, first: usize, polygons: &mut u32) {
    let flat = mesh.normal(first);
    let last = mesh.triangles.len();
    if (first + 1..last).any(|triangle| mesh.normal(triangle).dot(flat) < BENT) {
        for triangle in first + 1..last {
            mesh.polygon[triangle] = *polygons;
            *polygons += 1;
        }
    }
}

fn drop_unused_positions(mesh: &mut Mesh) {
    let mut renumbered = vec![u32::MAX; mesh.positions.len()];
    let mut kept = Vec::new();
    for vertex in mesh.triangles.iter_mut().flatten() {
        let number = &mut renumbered[*vertex as usize];
        if *number == u32::MAX {
            *number = kept.len() as u32;
            kept.push(mesh.positions[*vertex as usize]);
        }
        *vertex = *number;
    }
    mesh.positions = kept;
}

fn no_faces(file: &Path, parsed: &Parsed) -> Error {
    let problem = match parsed.vertices.len() {
        0 => "there is no geometry in the file".into(),
        count => format!("the file has {count} vertices but no faces of three or more corners"),
    };
    let remedy = "Export the mesh with its faces; a point cloud must be meshed first";
    Error::Invalid(Fault::new(file, "", problem, remedy))
}

/// The materials of the libraries. A library that cannot be read is no fault: its materials count as
/// diffuse.
fn read_libraries(
    file: &Path,
    parsed: &Parsed,
) -> (HashMap<String, mtl::LibraryMaterial>, Vec<String>) {
    let folder = file.parent().unwrap_or(Path::new(""));
    let (mut materials, mut warnings) = (HashMap::new(), Vec::new());
    for statement in &parsed.libraries {
        // One name with spaces, or several names: only the folder can tell.
        let whole = inside::join(folder, statement).filter(|whole| whole.is_file());
        let names: Vec<&str> = match whole {
            Some(_) => vec![statement],
            None => statement.split_whitespace().collect(),
        };
        for name in names {
            let Some(library) = inside::join(folder, name) else {
                warnings.push(format!(
                    "{}: the material library \"{name}\" lies outside of the mesh's folder and is \
                     not read. Its materials count as diffuse; copy it beside the mesh.",
                    file.display()
                ));
                continue;
            };
            match mtl::read(&library) {
                Ok(own) => materials.extend(own),
                Err(error) => warnings.push(format!(
                    "{error} Its materials count as diffuse; say in tags.json which are specular."
                )),
            }
        }
    }
    (materials, warnings)
}
