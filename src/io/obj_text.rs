//! The text of an OBJ file: brought into a form that `tobj` reads safely, and searched for the
//! line of a fault, which `tobj` does not tell.

use std::collections::HashMap;
use std::path::Path;

use glam::Vec3;

use super::mtl::split_keyword;
use super::surfaces::SurfacesBy;
use super::{Error, Fault};

/// Coordinates beyond this, in metres, are as broken as NaN: their products overflow.
const FARTHEST: f32 = 1e9;

/// An OBJ text in the form that `tobj` reads safely, and what it would have lost.
#[derive(Default)]
pub(super) struct Digest {
    pub(super) text: String,
    /// Names of the surfaces; the text says `usemtl` and the index.
    pub(super) surfaces: Vec<String>,
    /// Line of each face in the original file, counted from 1.
    pub(super) face_lines: Vec<u32>,
    /// Whether each face has texture coordinates at every corner.
    pub(super) face_textured: Vec<bool>,
    pub(super) libraries: Vec<String>,
    pub(super) vertices: usize,
    /// Whether a face names a vertex before the first, or one with a number of more digits than
    /// any file has vertices: `tobj` multiplies such numbers, and they overflow.
    pub(super) beyond_reach: bool,
    /// Faces of one or two corners, and the line of the first.
    pub(super) too_small: Tally,
}

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

pub(super) fn digest(text: &str, by: SurfacesBy) -> Digest {
    let mut digest = Digest { text: String::with_capacity(text.len()), ..Default::default() };
    // The library is ours: it names every surface by its index.
    digest.text += "mtllib surfaces\n";
    let mut known: HashMap<String, usize> = HashMap::new();
    let (mut material, mut group, mut object) = (String::new(), String::new(), String::new());
    // Of groups and objects the one that the text named last.
    let mut last = String::new();
    // The surface that the next face belongs to, and the one the text last named.
    let (mut current, mut written): (Option<usize>, Option<usize>) = (None, None);
    let (mut texcoords, mut texcoord_beyond_reach) = (0, false);
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
                *(if keyword == "v" { &mut digest.vertices } else { &mut texcoords }) += 1;
            }
            "f" => {
                let corners = rest.split('#').next().unwrap_or("");
                let (mut count, mut textured, mut beyond_reach) = (0, true, [false; 2]);
                for word in corners.split_ascii_whitespace() {
                    count += 1;
                    let mut parts = word.split('/');
                    let vertex = parts.next().unwrap_or("");
                    beyond_reach[0] |= is_beyond_reach(vertex, digest.vertices);
                    let texcoord = parts.next().unwrap_or("");
                    beyond_reach[1] |= is_beyond_reach(texcoord, texcoords);
                    textured &= !texcoord.is_empty() && texcoord != "0";
                }
                if count < 3 {
                    digest.too_small.add(number);
                    return;
                }
                digest.beyond_reach |= beyond_reach[0];
                texcoord_beyond_reach |= beyond_reach[1];
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
                last = rest.to_owned();
                *(if keyword == "o" { &mut object } else { &mut group }) = last.clone();
                current = None;
            }
            "mtllib" => digest.libraries.push(rest.to_owned()),
            _ => {}
        }
    });
    // Without any they are not looked at.
    digest.beyond_reach |= texcoord_beyond_reach && texcoords > 0;
    digest
}

/// Whether an index of a face leads before the first of the vertices, or has too many digits.
fn is_beyond_reach(part: &str, vertices_before: usize) -> bool {
    const DIGITS: usize = 11;
    part.len() > DIGITS
        || (part.starts_with('-')
            && part.parse::<i64>().is_ok_and(|index| vertices_before as i64 + index < 0))
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

/// Finds what `tobj` refused, which does not say where.
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
