//! STL: triangles without any structure, as binary or as text.
//!
//! Read here rather than by a crate: those reserve memory for as many triangles as the header
//! claims.

use std::path::Path;

use glam::Vec3;

use super::assemble::{Assembly, NAMELESS};
use crate::io::obj::Geometry;
use crate::io::{Error, Fault};

/// Bytes of header and count, and of a triangle.
const HEADER: usize = 84;
const RECORD: usize = 50;

/// Reads the bytes of an STL file; `file` is for messages.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Geometry, Error> {
    // Binary files may begin with "solid" too: a length that agrees with the count tells.
    let claimed = bytes
        .get(80..HEADER)
        .map(|count| u32::from_le_bytes([count[0], count[1], count[2], count[3]]));
    let fits = claimed.is_some_and(|count| {
        bytes.len() as u64 == HEADER as u64 + u64::from(count) * RECORD as u64
    });
    let is_text = bytes.trim_ascii_start().starts_with(b"solid") && !fits;
    if is_text { text(file, bytes) } else { binary(file, bytes, claimed) }
}

fn binary(file: &Path, bytes: &[u8], claimed: Option<u32>) -> Result<Geometry, Error> {
    let Some(claimed) = claimed else {
        return Err(Error::Invalid(Fault::new(
            file,
            "",
            "the file is too short to be an STL mesh",
            "Copy or export it again",
        )));
    };
    let records = bytes[HEADER..].chunks_exact(RECORD);
    let there = records.len().min(claimed as usize);
    let mut positions = Vec::with_capacity(3 * there);
    for record in records.take(claimed as usize) {
        // The normal in front is often wrong; winding says the same.
        for corner in record[12..48].chunks_exact(12) {
            let number = |at: usize| {
                f32::from_le_bytes([corner[at], corner[at + 1], corner[at + 2], corner[at + 3]])
            };
            positions.push(Vec3::new(number(0), number(4), number(8)));
        }
    }
    if there < claimed as usize {
        return Err(Error::Invalid(Fault::new(
            file,
            format!("byte {}", bytes.len()),
            format!("the file claims {claimed} triangles and holds {there}"),
            "The file seems to be cut off: copy or export it again",
        )));
    }
    assemble(file, positions, &[(0, NAMELESS.to_owned())])
}

fn text(file: &Path, bytes: &[u8]) -> Result<Geometry, Error> {
    let text = String::from_utf8_lossy(bytes);
    let mut positions: Vec<Vec3> = Vec::new();
    // Where each solid begins.
    let mut solids: Vec<(usize, String)> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("solid") => {
                let name = words.collect::<Vec<_>>().join(" ");
                solids.push((positions.len(), name));
            }
            Some("vertex") => {
                let number = |word: Option<&str>| word.and_then(|word| word.parse::<f32>().ok());
                let (x, y, z) = (number(words.next()), number(words.next()), number(words.next()));
                let (Some(x), Some(y), Some(z)) = (x, y, z) else {
                    return Err(Error::Invalid(Fault::new(
                        file,
                        format!("line {}", index + 1),
                        "a vertex needs three numbers",
                        "Correct that line, or export the mesh again",
                    )));
                };
                positions.push(Vec3::new(x, y, z));
            }
            Some("endloop") if !positions.len().is_multiple_of(3) => {
                return Err(Error::Invalid(Fault::new(
                    file,
                    format!("line {}", index + 1),
                    "a face of an STL mesh has three vertices",
                    "Correct that face, or export the mesh again",
                )));
            }
            _ => {}
        }
    }
    // One solid is the whole, whatever its name: it tells no surfaces apart.
    if solids.len() == 1 {
        solids[0].1 = NAMELESS.to_owned();
    }
    for (index, (_, name)) in solids.iter_mut().enumerate() {
        if name.is_empty() {
            *name = format!("solid_{}", index + 1);
        }
    }
    assemble(file, positions, &solids)
}

fn assemble(
    file: &Path,
    positions: Vec<Vec3>,
    solids: &[(usize, String)],
) -> Result<Geometry, Error> {
    let count = positions.len() / 3;
    let mut assembly = Assembly::new(positions);
    for (index, (start, name)) in solids.iter().enumerate() {
        let end = solids.get(index + 1).map_or(count, |(next, _)| next / 3);
        let surface = assembly.surface(name);
        for face in start / 3..end {
            let first = 3 * face as u32;
            assembly.face(&[first, first + 1, first + 2], None, surface);
        }
    }
    assembly.finish(file)
}
