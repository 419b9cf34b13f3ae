//! PLY, as text and as binary of either byte order.
//!
//! Vertices with `x y z` and, where given, texture coordinates; faces of any size, with texture
//! coordinates by corner where given. A number of texture or material by face tells surfaces
//! apart. Read here rather than by a crate: those reserve memory for as many elements as the
//! header claims.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::assemble::{Assembly, NAMELESS};
use crate::io::obj::Geometry;
use crate::io::{Error, Fault};

/// A longer header is none.
const LONGEST_HEADER: usize = 1 << 20;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    Text,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scalar {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

#[derive(Debug)]
struct Property {
    name: String,
    scalar: Scalar,
    /// The type of the number of entries of a list.
    count: Option<Scalar>,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

/// Reads the bytes of a PLY file; `file` is for messages.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Geometry, Error> {
    let (encoding, elements, start) = header(file, bytes)?;
    let mut values = Values { file, bytes, at: start, encoding };
    let mut vertices = Vertices::default();
    let mut faces = Faces::default();
    for element in &elements {
        match element.name.as_str() {
            "vertex" => vertices.read(element, &mut values)?,
            "face" => faces.read(element, &mut values)?,
            "tristrips" => {
                return Err(Error::Unsupported(Fault::new(
                    file,
                    "element tristrips",
                    "triangle strips are not read",
                    "Save the mesh with faces, for example by MeshLab or Blender",
                )));
            }
            _ => skip(element, &mut values)?,
        }
    }
    assemble(file, vertices, &faces)
}

fn assemble(file: &Path, vertices: Vertices, faces: &Faces) -> Result<Geometry, Error> {
    let Vertices { positions, texcoords } = vertices;
    let mut assembly = Assembly::new(positions);
    let groups = faces.ends.iter().filter_map(|end| end.group);
    let is_grouped = groups.clone().min() != groups.max();
    let (mut corner, mut texcoord) = (0, 0);
    for end in &faces.ends {
        let corners = &faces.corners[corner..end.corner];
        let by_corner = &faces.texcoords[texcoord..end.texcoord];
        (corner, texcoord) = (end.corner, end.texcoord);
        let surface = match end.group.filter(|_| is_grouped) {
            Some(number) => assembly.surface(&format!("material_{number}")),
            None => assembly.surface(NAMELESS),
        };
        let own: Option<Vec<Vec2>> = if by_corner.len() == 2 * corners.len() {
            Some(by_corner.chunks_exact(2).map(Vec2::from_slice).collect())
        } else {
            corners.iter().map(|&vertex| texcoords.get(vertex as usize).copied()).collect()
        };
        assembly.face(corners, own.as_deref(), surface);
    }
    assembly.finish(file)
}

fn invalid(file: &Path, place: impl Into<String>, problem: impl Into<String>) -> Error {
    Error::Invalid(Fault::new(
        file,
        place,
        problem,
        "Copy the file again, or export it again as PLY",
    ))
}

/// The encoding, the elements, and where the data begin.
fn header(file: &Path, bytes: &[u8]) -> Result<(Encoding, Vec<Element>, usize), Error> {
    let (mut encoding, mut elements, mut at, mut number) = (None, Vec::<Element>::new(), 0, 0);
    loop {
        number += 1;
        let place = || format!("line {number}");
        let rest = &bytes[at.min(bytes.len())..bytes.len().min(LONGEST_HEADER)];
        let Some(length) = rest.iter().position(|&byte| byte == b'\n') else {
            // Old Macintosh line ends would hide the whole header in one line.
            return Err(invalid(file, place(), "the header of the PLY file does not end"));
        };
        let line = String::from_utf8_lossy(&rest[..length]);
        at += length + 1;
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["ply"] if number == 1 => {}
            _ if number == 1 => return Err(invalid(file, "line 1", "this is no PLY file")),
            ["format", name, _] => {
                encoding = Some(match *name {
                    "ascii" => Encoding::Text,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    other => {
                        let problem = format!("there is no PLY format \"{}\"", shortened(other));
                        return Err(invalid(file, place(), problem));
                    }
                });
            }
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    return Err(invalid(file, place(), "the number of elements is none"));
                };
                elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
            }
            ["property", rest @ ..] => {
                let property = property(rest)
                    .ok_or_else(|| invalid(file, place(), "this property is not understood"))?;
                let Some(element) = elements.last_mut() else {
                    return Err(invalid(file, place(), "a property comes before any element"));
                };
                element.properties.push(property);
            }
            ["end_header"] => break,
            _ => {}
        }
    }
    let Some(encoding) = encoding else {
        return Err(invalid(file, "header", "the header does not say which format follows"));
    };
    // Elements of no size would be read for ever.
    elements.retain(|element| !element.properties.is_empty());
    Ok((encoding, elements, at))
}

fn property(words: &[&str]) -> Option<Property> {
    match words {
        ["list", count, scalar, name] => Some(Property {
            name: (*name).to_owned(),
            scalar: scalar_of(scalar)?,
            count: Some(scalar_of(count).filter(|count| !matches!(count, Scalar::Float(_)))?),
        }),
        [scalar, name] => {
            Some(Property { name: (*name).to_owned(), scalar: scalar_of(scalar)?, count: None })
        }
        _ => None,
    }
}

fn scalar_of(name: &str) -> Option<Scalar> {
    Some(match name {
        "char" | "int8" => Scalar::Signed(1),
        "uchar" | "uint8" => Scalar::Unsigned(1),
        "short" | "int16" => Scalar::Signed(2),
        "ushort" | "uint16" => Scalar::Unsigned(2),
        "int" | "int32" => Scalar::Signed(4),
        "uint" | "uint32" => Scalar::Unsigned(4),
        "float" | "float32" => Scalar::Float(4),
        "double" | "float64" => Scalar::Float(8),
        _ => return None,
    })
}

/// The numbers behind the header, one after the other.
struct Values<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    at: usize,
    encoding: Encoding,
}

impl Values<'_> {
    fn next(&mut self, scalar: Scalar) -> Result<f64, Error> {
        if self.encoding == Encoding::Text {
            return self.next_word();
        }
        let (Scalar::Signed(size) | Scalar::Unsigned(size) | Scalar::Float(size)) = scalar;
        let Some(own) = self.bytes.get(self.at..self.at + size) else {
            return Err(self.cut_off());
        };
        self.at += size;
        let mut little = [0_u8; 8];
        for (index, &byte) in own.iter().enumerate() {
            let is_little = self.encoding == Encoding::Little;
            little[if is_little { index } else { size - 1 - index }] = byte;
        }
        let whole = u64::from_le_bytes(little);
        Ok(match scalar {
            Scalar::Unsigned(_) => whole as f64,
            Scalar::Signed(1) => f64::from(whole as u8 as i8),
            Scalar::Signed(2) => f64::from(whole as u16 as i16),
            Scalar::Signed(_) => f64::from(whole as u32 as i32),
            Scalar::Float(4) => f64::from(f32::from_bits(whole as u32)),
            Scalar::Float(_) => f64::from_bits(whole),
        })
    }

    fn next_word(&mut self) -> Result<f64, Error> {
        let rest = &self.bytes[self.at.min(self.bytes.len())..];
        let Some(start) = rest.iter().position(|byte| !byte.is_ascii_whitespace()) else {
            return Err(self.cut_off());
        };
        let end = rest[start..].iter().position(u8::is_ascii_whitespace);
        let word = &rest[start..end.map_or(rest.len(), |end| start + end)];
        let place = self.at + start;
        self.at += start + word.len();
        std::str::from_utf8(word).ok().and_then(|word| word.parse().ok()).ok_or_else(|| {
            let before = &self.bytes[..place];
            let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
            let word = String::from_utf8_lossy(word);
            let problem = format!("\"{}\" is not a number", shortened(&word));
            invalid(self.file, format!("line {line}"), problem)
        })
    }

    fn cut_off(&self) -> Error {
        let place = format!("byte {}", self.bytes.len());
        invalid(self.file, place, "the file ends before all that its header promises")
    }

    /// The entries of a list, one by one.
    fn list(&mut self, property: &Property, mut visit: impl FnMut(f64)) -> Result<(), Error> {
        let count = property.count.map_or(Ok(1.0), |count| self.next(count))?;
        if !(0.0..=4294967295.0).contains(&count) || count.fract() != 0.0 {
            let place = format!("byte {}", self.at);
            return Err(invalid(self.file, place, "a list has no such number of entries"));
        }
        for _ in 0..count as u64 {
            visit(self.next(property.scalar)?);
        }
        Ok(())
    }
}

fn shortened(word: &str) -> String {
    word.chars().take(40).collect()
}

fn skip(element: &Element, values: &mut Values) -> Result<(), Error> {
    for _ in 0..element.count {
        for property in &element.properties {
            values.list(property, |_| ())?;
        }
    }
    Ok(())
}

#[derive(Default)]
struct Vertices {
    positions: Vec<Vec3>,
    /// One a vertex, or none.
    texcoords: Vec<Vec2>,
}

impl Vertices {
    fn read(&mut self, element: &Element, values: &mut Values) -> Result<(), Error> {
        let names =
            [&["x"][..], &["y"], &["z"], &["s", "u", "texture_u"], &["t", "v", "texture_v"]];
        let roles: Vec<Option<usize>> = element
            .properties
            .iter()
            .map(|property| names.iter().position(|own| own.contains(&property.name.as_str())))
            .collect();
        if !(0..3).all(|axis| roles.contains(&Some(axis))) {
            return Err(invalid(values.file, "element vertex", "vertices need x, y and z"));
        }
        let has_texcoords = (3..5).all(|axis| roles.contains(&Some(axis)));
        for _ in 0..element.count {
            let mut own = [0.0; 5];
            for (property, role) in element.properties.iter().zip(&roles) {
                values.list(property, |value| {
                    if let Some(role) = role {
                        own[*role] = value as f32;
                    }
                })?;
            }
            self.positions.push(Vec3::new(own[0], own[1], own[2]));
            if has_texcoords {
                self.texcoords.push(Vec2::new(own[3], own[4]));
            }
        }
        Ok(())
    }
}

/// All faces: four numbers and a few bytes each, whatever their size.
#[derive(Default)]
struct Faces {
    corners: Vec<u32>,
    /// Two numbers a corner of those faces that have them.
    texcoords: Vec<f32>,
    ends: Vec<End>,
}

/// Where a face ends in the lists.
struct End {
    corner: usize,
    texcoord: usize,
    group: Option<i64>,
}

impl Faces {
    fn read(&mut self, element: &Element, values: &mut Values) -> Result<(), Error> {
        for _ in 0..element.count {
            let mut group = None;
            for property in &element.properties {
                match property.name.as_str() {
                    "vertex_indices" | "vertex_index" => values.list(property, |value| {
                        let is_index = (0.0..4294967295.0).contains(&value);
                        self.corners.push(if is_index { value as u32 } else { u32::MAX });
                    })?,
                    "texcoord" => {
                        values.list(property, |value| self.texcoords.push(value as f32))?;
                    }
                    "texnumber" | "material_index" | "material_indices" | "label" => {
                        values.list(property, |value| group = Some(value as i64))?;
                    }
                    _ => values.list(property, |_| ())?,
                }
            }
            let (corner, texcoord) = (self.corners.len(), self.texcoords.len());
            self.ends.push(End { corner, texcoord, group });
        }
        Ok(())
    }
}
