//! Wavefront OBJ: the partial geometry.
//!
//! `tobj` reads the numbers. Before that the text is brought into a form in which it can do no
//! harm ([`digest`]): one bad byte, a `\` at a line's end, a line element or a comment behind a
//! face would make it refuse the file, and it forgets the name of a material that no library
//! defines. Faces come back as polygons and are triangulated here, since a fan is wrong for a
//! concave one.
//!
//! A polygon that is bent by more than [`BENT`] is numbered as one polygon a triangle, so that
//! polygons are planar as `Mesh::polygon` promises.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec2, Vec3};

use super::error::read_bounded;
use super::mtl::{self, split_keyword};
use super::polygon::{self, Shape};
use super::{Error, Fault};
use crate::geometry::mesh::Mesh;
use crate::scene::{Role, Surface};

/// Ten million triangles are about 500 MB of text.
const LARGEST: u64 = 1 << 30;
/// Coordinates beyond this, in metres, are as broken as NaN: their products overflow.
const FARTHEST: f32 = 1e9;
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
    pub warnings: Vec<String>,
    /// What could not be read of the material libraries: of interest without tags only.
    pub library_warnings: Vec<String>,
}

/// Reads a mesh and the material libraries it names.
pub fn load(file: &Path) -> Result<Geometry, Error> {
    let bytes = read_bounded(file, LARGEST)?;
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
    let text = String::from_utf8_lossy(&bytes);
    let digest = digest(&text);
    if digest.face_lines.is_empty() {
        return Err(no_faces(file, &digest));
    }
    let models = parse(&digest).map_err(|failure| locate(file, &text, &failure.to_string()))?;
    let mut geometry = Builder::new(file, &text, &digest).build(&models)?;
    (geometry.specular, geometry.library_warnings) = read_libraries(file, &digest);
    Ok(geometry)
}

/// An OBJ text in the form that `tobj` reads safely, and what it would have lost.
#[derive(Default)]
struct Digest {
    text: String,
    /// Names of the surfaces; the text says `usemtl` and the index.
    surfaces: Vec<String>,
    /// Line of each face in the original file, counted from 1.
    face_lines: Vec<u32>,
    /// Whether each face has texture coordinates at every corner.
    face_textured: Vec<bool>,
    libraries: Vec<String>,
    vertices: usize,
    /// Faces of one or two corners, and the line of the first.
    too_small: Tally,
}

/// How many, and the line of the first.
#[derive(Clone, Copy, Default)]
struct Tally {
    count: usize,
    first_line: u32,
}

impl Tally {
    fn add(&mut self, line: u32) {
        if self.count == 0 {
            self.first_line = line;
        }
        self.count += 1;
    }

    /// "1 face" or "3 faces".
    fn faces(&self) -> String {
        format!("{} {}", self.count, if self.count == 1 { "face" } else { "faces" })
    }
}

fn digest(text: &str) -> Digest {
    let mut digest = Digest { text: String::with_capacity(text.len()), ..Default::default() };
    // The library is ours: it names every surface by its index.
    digest.text += "mtllib surfaces\n";
    let mut known: HashMap<String, usize> = HashMap::new();
    let (mut material, mut object) = (String::new(), String::new());
    // The surface that the next face belongs to, and the one the text last named.
    let (mut current, mut written): (Option<usize>, Option<usize>) = (None, None);
    for_each_line(text, |number, line| {
        let (keyword, rest) = split_keyword(line);
        match keyword {
            "v" | "vt" => {
                digest.text += keyword;
                // A fourth number is a weight and more are a colour, of no meaning here. What is
                // no number becomes NaN, which matters only if a face uses it.
                let wanted = if keyword == "v" { 3 } else { 2 };
                let mut values = rest.split('#').next().unwrap_or("").split_ascii_whitespace();
                for index in 0..wanted {
                    let word = values.next().unwrap_or(if index == 1 && wanted == 2 {
                        "0"
                    } else {
                        "nan"
                    });
                    digest.text.push(' ');
                    digest.text += if word.parse::<f32>().is_ok() { word } else { "nan" };
                }
                digest.text.push('\n');
                digest.vertices += usize::from(keyword == "v");
            }
            "f" => {
                let corners = rest.split('#').next().unwrap_or("");
                let (mut count, mut textured) = (0, true);
                for word in corners.split_ascii_whitespace() {
                    count += 1;
                    let mut parts = word.split('/').skip(1);
                    textured &= parts.next().is_some_and(|part| !part.is_empty() && part != "0");
                }
                if count < 3 {
                    digest.too_small.add(number);
                    return;
                }
                let surface = *current.get_or_insert_with(|| {
                    let name = [material.as_str(), object.as_str(), "default"]
                        .into_iter()
                        .find(|name| !name.is_empty())
                        .unwrap_or_default();
                    *known.entry(name.to_owned()).or_insert_with(|| {
                        digest.surfaces.push(name.to_owned());
                        digest.surfaces.len() - 1
                    })
                });
                if written != Some(surface) {
                    digest.text += &format!("usemtl {surface}\n");
                    written = Some(surface);
                }
                digest.text += "f ";
                digest.text += corners;
                digest.text.push('\n');
                digest.face_lines.push(number);
                digest.face_textured.push(textured);
            }
            "usemtl" => {
                material = rest.to_owned();
                current = None;
            }
            "o" | "g" => {
                object = rest.to_owned();
                current = None;
            }
            "mtllib" => digest.libraries.push(rest.to_owned()),
            _ => {}
        }
    });
    digest
}

/// Calls `visit` with every line and its number; lines that end in `\` are joined with the next.
fn for_each_line(text: &str, mut visit: impl FnMut(u32, &str)) {
    let mut joined = String::new();
    let mut start = 0;
    for (index, line) in text.lines().enumerate() {
        let trimmed = line.trim_end();
        let is_comment = joined.is_empty() && trimmed.trim_start().starts_with('#');
        match trimmed.strip_suffix('\\') {
            Some(part) if !is_comment => {
                if joined.is_empty() {
                    start = index;
                }
                joined += part;
                joined.push(' ');
            }
            _ if joined.is_empty() => visit(index as u32 + 1, line),
            _ => {
                joined += line;
                visit(start as u32 + 1, &joined);
                joined.clear();
            }
        }
    }
    if !joined.is_empty() {
        visit(start as u32 + 1, &joined);
    }
}

fn parse(digest: &Digest) -> Result<Vec<tobj::Mesh>, tobj::LoadError> {
    let library = |_: &Path| {
        let names = 0..digest.surfaces.len();
        let material =
            |index: usize| tobj::Material { name: index.to_string(), ..Default::default() };
        Ok((
            names.clone().map(material).collect(),
            names.map(|index| (index.to_string(), index)).collect(),
        ))
    };
    let (models, _) =
        tobj::load_obj_buf(&mut digest.text.as_bytes(), &tobj::LoadOptions::default(), library)?;
    Ok(models.into_iter().map(|model| model.mesh).collect())
}

/// Turns `tobj`'s polygons into the mesh.
struct Builder<'a> {
    file: &'a Path,
    text: &'a str,
    digest: &'a Digest,
    mesh: Mesh,
    triangle_texcoords: Vec<[Vec2; 3]>,
    /// For each surface: textured polygons, all polygons.
    textured: Vec<(usize, usize)>,
    polygons: u32,
    corners: Vec<DVec3>,
    triangles: Vec<[usize; 3]>,
    patience: u64,
    broken: Tally,
    flat: Tally,
    crossed: Tally,
    broken_texcoords: Tally,
}

impl<'a> Builder<'a> {
    fn new(file: &'a Path, text: &'a str, digest: &'a Digest) -> Self {
        Self {
            file,
            text,
            digest,
            mesh: Mesh::default(),
            triangle_texcoords: Vec::new(),
            textured: vec![(0, 0); digest.surfaces.len()],
            polygons: 0,
            corners: Vec::new(),
            triangles: Vec::new(),
            patience: PATIENCE,
            broken: Tally::default(),
            flat: Tally::default(),
            crossed: Tally::default(),
            broken_texcoords: Tally::default(),
        }
    }

    fn build(mut self, models: &[tobj::Mesh]) -> Result<Geometry, Error> {
        let mut face = 0;
        for model in models {
            let surface = model.material_id.unwrap_or(0);
            let base = self.mesh.positions.len();
            self.mesh.positions.extend(model.positions.chunks_exact(3).map(Vec3::from_slice));
            let (mut start, count) = (0, model.face_arities.len());
            // An empty list of arities means triangles throughout.
            let faces = if count == 0 { model.indices.len() / 3 } else { count };
            for index in 0..faces {
                let arity = if count == 0 { 3 } else { model.face_arities[index] as usize };
                self.add(model, start..start + arity, base, surface, face);
                start += arity;
                face += 1;
            }
        }
        self.finish()
    }

    fn add(
        &mut self,
        model: &tobj::Mesh,
        range: std::ops::Range<usize>,
        base: usize,
        surface: usize,
        face: usize,
    ) {
        let line = self.digest.face_lines[face];
        let vertices = &model.indices[range.clone()];
        let position = |vertex: u32| self.mesh.positions[base + vertex as usize];
        if vertices.iter().any(|&vertex| !is_usable(position(vertex))) {
            self.broken.add(line);
            return;
        }
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        corners.extend(vertices.iter().map(|&vertex| position(vertex).as_dvec3()));
        let mut triangles = std::mem::take(&mut self.triangles);
        triangles.clear();
        let shape = polygon::triangulate(&corners, &mut triangles, &mut self.patience);
        match shape {
            Shape::Flat => self.flat.add(line),
            Shape::Fan => self.crossed.add(line),
            Shape::Sound => {}
        }
        if shape != Shape::Flat {
            self.add_triangles(model, range, base, surface, face, &triangles);
        }
        // Kept for the next face: an allocation a face takes as long as the rest.
        (self.corners, self.triangles) = (corners, triangles);
    }

    fn add_triangles(
        &mut self,
        model: &tobj::Mesh,
        range: std::ops::Range<usize>,
        base: usize,
        surface: usize,
        face: usize,
        triangles: &[[usize; 3]],
    ) {
        let vertices = &model.indices[range.clone()];
        let first = self.mesh.triangles.len();
        let mut textured = self.digest.face_textured[face] && !model.texcoord_indices.is_empty();
        for triangle in triangles {
            let vertex = |corner: usize| (base + vertices[corner] as usize) as u32;
            self.mesh.triangles.push(triangle.map(vertex));
            self.mesh.surface.push(surface as u32);
            self.mesh.polygon.push(self.polygons);
            let texcoords = if textured {
                triangle.map(|corner| {
                    let index = model.texcoord_indices[range.start + corner] as usize;
                    Vec2::from_slice(&model.texcoords[2 * index..2 * index + 2])
                })
            } else {
                [Vec2::ZERO; 3]
            };
            if texcoords.iter().any(|texcoord| !texcoord.is_finite()) {
                self.broken_texcoords.add(self.digest.face_lines[face]);
                textured = false;
            }
            self.triangle_texcoords.push(texcoords);
        }
        self.polygons += 1;
        self.split_if_bent(first);
        self.textured[surface].0 += usize::from(textured);
        self.textured[surface].1 += 1;
    }

    fn split_if_bent(&mut self, first: usize) {
        let flat = self.mesh.normal(first);
        let last = self.mesh.triangles.len();
        if (first + 1..last).any(|triangle| self.mesh.normal(triangle).dot(flat) < BENT) {
            for triangle in first + 1..last {
                self.mesh.polygon[triangle] = self.polygons;
                self.polygons += 1;
            }
        }
    }

    fn finish(mut self) -> Result<Geometry, Error> {
        if self.mesh.triangles.is_empty() {
            return Err(self.nothing_left());
        }
        let warnings = self.warnings();
        let surfaces: Vec<Surface> = std::iter::zip(&self.digest.surfaces, &self.textured)
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
        warn(self.digest.too_small, "with fewer than three corners left out (the first is named).");
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

fn is_usable(position: Vec3) -> bool {
    position.is_finite() && position.abs().max_element() < FARTHEST
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

fn no_faces(file: &Path, digest: &Digest) -> Error {
    let problem = match digest.vertices {
        0 => "there is no geometry in the file".into(),
        count => format!("the file has {count} vertices but no faces of three or more corners"),
    };
    let remedy = "Export the mesh with its faces; a point cloud must be meshed first";
    Error::Invalid(Fault::new(file, "", problem, remedy))
}

/// The line of the first unusable vertex of the face on `face_line`, and what is wrong with it.
fn broken_vertex(text: &str, face_line: u32) -> Option<(u32, String)> {
    let mut vertices = Vec::new();
    let mut wanted = None;
    for_each_line(text, |number, line| {
        let (keyword, rest) = split_keyword(line);
        if keyword == "v" {
            let rest = rest.split('#').next().unwrap_or("");
            let problem = wrong_numbers(rest, 3).or_else(|| {
                let numbers = rest.split_ascii_whitespace().take(3);
                let is_broken = |word: &str| {
                    word.parse()
                        .is_ok_and(|value: f32| !value.is_finite() || value.abs() >= FARTHEST)
                };
                let word = numbers.clone().find(|word| is_broken(word))?;
                Some(format!("{} is no position in metres", shortened(word)))
            });
            vertices.push((number, problem));
        } else if number == face_line {
            let indices = rest.split_ascii_whitespace().filter_map(|word| vertex_index(word).ok());
            let before = vertices.len() as i64;
            let absolute = |index: i64| if index < 0 { before + index } else { index - 1 };
            wanted = Some(indices.map(absolute).collect::<Vec<_>>());
        }
    });
    let indices = wanted?.into_iter().filter_map(|index| usize::try_from(index).ok());
    let broken = |index: usize| {
        let (line, problem) = vertices.get(index)?;
        Some((*line, problem.clone()?))
    };
    indices.filter_map(broken).min_by_key(|(line, _)| *line)
}

fn vertex_index(word: &str) -> Result<i64, std::num::ParseIntError> {
    word.split('/').next().unwrap_or("").parse()
}

/// Finds what `tobj` refused, which does not say where.
fn locate(file: &Path, text: &str, reason: &str) -> Error {
    let (mut counts, mut found) = ([0_i64; 2], None);
    let mut totals = [0_i64; 2];
    for_each_line(text, |_, line| match split_keyword(line).0 {
        "v" => totals[0] += 1,
        "vt" => totals[1] += 1,
        _ => {}
    });
    for_each_line(text, |number, line| {
        if found.is_some() {
            return;
        }
        let (keyword, rest) = split_keyword(line);
        let rest = rest.split('#').next().unwrap_or("");
        let problem = match keyword {
            "v" => {
                counts[0] += 1;
                None
            }
            "vt" => {
                counts[1] += 1;
                None
            }
            "f" => wrong_face(rest, counts, totals),
            _ => None,
        };
        found = problem.map(|problem| (number, problem));
    });
    let remedy = "Correct that line, or export the mesh again";
    match found {
        Some((line, problem)) => {
            Error::Invalid(Fault::new(file, format!("line {line}"), problem, remedy))
        }
        None => Error::Invalid(Fault::new(
            file,
            "",
            format!("the mesh cannot be read ({reason})"),
            "Export it again as OBJ",
        )),
    }
}

fn wrong_numbers(rest: &str, wanted: usize) -> Option<String> {
    let words: Vec<&str> = rest.split_ascii_whitespace().take(3).collect();
    if words.len() < wanted {
        return Some(format!("{wanted} numbers are due here, and only {} are there", words.len()));
    }
    let wrong = words.into_iter().find(|word| word.parse::<f32>().is_err())?;
    let hint = if wrong.contains(',') { " (decimals need a point, not a comma)" } else { "" };
    Some(format!("\"{}\" is not a number{hint}", shortened(wrong)))
}

fn wrong_face(rest: &str, counts: [i64; 2], totals: [i64; 2]) -> Option<String> {
    if rest.split_ascii_whitespace().count() < 3 {
        return None;
    }
    for word in rest.split_ascii_whitespace() {
        for (part, (kind, column)) in
            word.split('/').zip([("vertex", 0), ("texture coordinate", 1)])
        {
            if part.is_empty() && column == 1 {
                continue;
            }
            let Ok(index) = part.parse::<i64>() else {
                return Some(format!("\"{}\" is no corner of a face", shortened(word)));
            };
            let is_absent_texcoord = column == 1 && (totals[1] == 0 || index == 0);
            let in_range = (1..=totals[column]).contains(&index)
                || (index < 0 && counts[column].checked_add(index).is_some_and(|first| first >= 0));
            if !in_range && !is_absent_texcoord {
                return Some(format!(
                    "the face names {kind} {index}, and the file has {} of them",
                    totals[column]
                ));
            }
        }
        if word.split('/').skip(2).any(|part| !part.is_empty() && part.parse::<i64>().is_err())
            || word.split('/').count() > 3
        {
            return Some(format!("\"{}\" is no corner of a face", shortened(word)));
        }
    }
    None
}

fn shortened(word: &str) -> String {
    word.chars().take(40).collect()
}

/// Which surfaces the libraries call specular. A library that cannot be read is no fault: its
/// materials count as diffuse.
fn read_libraries(file: &Path, digest: &Digest) -> (Vec<bool>, Vec<String>) {
    let folder = file.parent().unwrap_or(Path::new(""));
    let (mut specular, mut warnings) = (std::collections::HashSet::new(), Vec::new());
    for statement in &digest.libraries {
        // One name with spaces, or several names: only the folder can tell.
        let whole = folder.join(statement.replace('\\', "/"));
        let files: Vec<PathBuf> = if whole.is_file() {
            vec![whole]
        } else {
            let name = |word: &str| folder.join(word.replace('\\', "/"));
            statement.split_whitespace().map(name).collect()
        };
        for library in files {
            match mtl::read_specular(&library) {
                Ok(names) => specular.extend(names),
                Err(error) => warnings.push(format!(
                    "{error} Its materials count as diffuse; say in tags.json which are specular."
                )),
            }
        }
    }
    let is_specular = digest.surfaces.iter().map(|name| specular.contains(name)).collect();
    (is_specular, warnings)
}
