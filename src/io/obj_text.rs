//! Parses the text of an OBJ file: numbers, faces and names, and the line of an error.

use std::collections::HashMap;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::mtl::split_keyword;
use super::surfaces::SurfacesBy;
use super::{Error, Fault};

/// Coordinates beyond this, in metres, are as broken as NaN: their products overflow.
const FARTHEST: f32 = 1e9;

/// What an OBJ text says.
#[derive(Default)]
pub(super) struct Parsed {
    /// NaN where the text has no number.
    pub(super) vertices: Vec<Vec3>,
    pub(super) texcoords: Vec<Vec2>,
    /// Names of the surfaces.
    pub(super) surfaces: Vec<String>,
    /// Those of three or more corners.
    pub(super) faces: Vec<Face>,
    /// Corners of all faces, one after the other.
    pub(super) corners: Vec<Corner>,
    pub(super) libraries: Vec<String>,
    /// Whether a face names a vertex or texture coordinate that is not there, or has a corner that
    /// is no number.
    pub(super) is_faulty: bool,
    /// Faces of one or two corners, and the line of the first.
    pub(super) too_small: Tally,
}

#[derive(Clone, Copy)]
pub(super) struct Face {
    /// Counted from 1.
    pub(super) line: u32,
    pub(super) surface: u32,
    /// The end of its corners, which begin where those of the face before end.
    pub(super) end: usize,
    /// Whether there are texture coordinates at every corner.
    pub(super) is_textured: bool,
}

/// A corner of a face, by positions in the lists.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Corner {
    pub(super) vertex: u32,
    /// [`NO_TEXCOORD`] where it has none.
    pub(super) texcoord: u32,
}

pub(super) const NO_TEXCOORD: u32 = u32::MAX;
/// A position that no list reaches: texts have fewer bytes.
const BEYOND: u32 = u32::MAX - 1;

/// How many, and the line of the first.
#[derive(Clone, Copy, Default)]
pub(super) struct Tally {
    pub(super) count: usize,
    pub(super) first_line: u32,
}

impl Tally {
    pub(super) fn add(&mut self, line: u32) {
        if self.count == 0 {
            self.first_line = line;
        }
        self.count += 1;
    }

    /// "1 face" or "3 faces".
    pub(super) fn faces(&self) -> String {
        format!("{} {}", self.count, if self.count == 1 { "face" } else { "faces" })
    }
}

/// Reads a text. Faces may name what comes after them.
pub(super) fn parse(text: &str, by: SurfacesBy) -> Parsed {
    let mut parsed = Parsed::default();
    let mut known: HashMap<String, u32> = HashMap::new();
    let (mut material, mut group, mut object) = (String::new(), String::new(), String::new());
    // Of groups and objects the one that the text named last.
    let mut last = String::new();
    // The surface that the next face belongs to.
    let mut current: Option<u32> = None;
    for_each_line(text, |number, line| {
        let (keyword, rest) = split_keyword(line);
        match keyword {
            "v" => parsed.vertices.push(Vec3::from_array(numbers(rest, [f32::NAN; 3]))),
            "vt" => parsed.texcoords.push(Vec2::from_array(numbers(rest, [f32::NAN, 0.0]))),
            "f" => {
                let corners = without_comment(rest).split_ascii_whitespace();
                let start = parsed.corners.len();
                let (mut is_textured, mut is_faulty) = (true, false);
                for word in corners {
                    let corner = corner(word, parsed.vertices.len(), parsed.texcoords.len());
                    is_faulty |= corner.is_none();
                    is_textured &= corner.is_some_and(|own| own.texcoord != NO_TEXCOORD);
                    parsed
                        .corners
                        .push(corner.unwrap_or(Corner { vertex: BEYOND, texcoord: NO_TEXCOORD }));
                }
                if parsed.corners.len() - start < 3 {
                    parsed.corners.truncate(start);
                    parsed.too_small.add(number);
                    return;
                }
                parsed.is_faulty |= is_faulty;
                let surface = *current.get_or_insert_with(|| {
                    let names = match by {
                        SurfacesBy::Materials => [&material, &last, &last],
                        SurfacesBy::Groups => [&group, &object, &material],
                        SurfacesBy::Objects => [&object, &group, &material],
                    };
                    let name = names
                        .map(String::as_str)
                        .into_iter()
                        .chain(["default"])
                        .find(|name| !name.is_empty())
                        .unwrap_or_default();
                    *known.entry(name.to_owned()).or_insert_with(|| {
                        parsed.surfaces.push(name.to_owned());
                        parsed.surfaces.len() as u32 - 1
                    })
                });
                let end = parsed.corners.len();
                parsed.faces.push(Face { line: number, surface, end, is_textured });
            }
            "usemtl" => {
                material = rest.to_owned();
                current = None;
            }
            "o" | "g" => {
                last = rest.to_owned();
                *(if keyword == "o" { &mut object } else { &mut group }) = last.clone();
                current = None;
            }
            "mtllib" => parsed.libraries.push(rest.to_owned()),
            _ => {}
        }
    });
    let (vertices, texcoords) = (parsed.vertices.len(), parsed.texcoords.len());
    let is_wrong = |own: &Corner| {
        // Without any texture coordinates, indices of them are not looked at.
        let is_texcoord = texcoords > 0 && own.texcoord != NO_TEXCOORD;
        own.vertex as usize >= vertices || (is_texcoord && own.texcoord as usize >= texcoords)
    };
    parsed.is_faulty |= parsed.corners.iter().any(is_wrong);
    parsed
}

fn without_comment(rest: &str) -> &str {
    rest.split('#').next().unwrap_or("")
}

/// The first numbers of a line, each as in `missing` where it has fewer, and NaN for what is no
/// number. A fourth number is a weight and more are a colour, of no meaning here.
fn numbers<const COUNT: usize>(rest: &str, missing: [f32; COUNT]) -> [f32; COUNT] {
    let mut words = without_comment(rest).split_ascii_whitespace();
    missing.map(|missing| words.next().map_or(missing, |word| word.parse().unwrap_or(f32::NAN)))
}

/// A corner `v`, `v/vt`, `v//vn` or `v/vt/vn` of a face behind so many vertices and texture
/// coordinates; `None` where it is no number.
fn corner(word: &str, vertices: usize, texcoords: usize) -> Option<Corner> {
    let mut parts = word.split('/');
    let mut index = |before: usize| match parts.next().unwrap_or("") {
        "" => Some(NO_TEXCOORD),
        part => {
            let index: i64 = part.parse().ok()?;
            if index == 0 {
                return Some(NO_TEXCOORD);
            }
            let start = if index < 0 { before as i64 } else { -1 };
            let place = start.checked_add(index).and_then(|place| u32::try_from(place).ok());
            Some(place.map_or(BEYOND, |place| place.min(BEYOND)))
        }
    };
    let (vertex, texcoord) = (index(vertices)?, index(texcoords)?);
    // Normals are not used, but have to be some.
    index(0)?;
    parts.all(str::is_empty).then_some(Corner { vertex, texcoord })
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

pub(super) fn is_usable(position: Vec3) -> bool {
    position.is_finite() && position.abs().max_element() < FARTHEST
}

/// The line of the first unusable vertex of the face on `face_line`, and what is wrong with it.
pub(super) fn broken_vertex(text: &str, face_line: u32) -> Option<(u32, String)> {
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

/// Finds the first wrong corner of a face, and says where and why.
pub(super) fn locate(file: &Path, text: &str, reason: &str) -> Error {
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
