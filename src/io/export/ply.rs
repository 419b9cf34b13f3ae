//! PLY, binary little-endian: points with any numbers, and meshes.

use std::io::Write;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::super::{Error, atomic};

/// Points with the same properties each, as other programs call them (x, y, z, nx, red, ...).
pub struct Points<'a> {
    pub comment: &'a str,
    /// Single-precision properties.
    pub floats: &'a [&'a str],
    /// Bytes, which follow them.
    pub bytes: &'a [&'a str],
    pub rows: Vec<(Vec<f32>, Vec<u8>)>,
}

pub fn write_points(file: &Path, points: &Points) -> Result<(), Error> {
    atomic::write(file, |out| {
        writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment {}", points.comment)?;
        writeln!(out, "element vertex {}", points.rows.len())?;
        for name in points.floats {
            writeln!(out, "property float {name}")?;
        }
        for name in points.bytes {
            writeln!(out, "property uchar {name}")?;
        }
        writeln!(out, "end_header")?;
        for (floats, bytes) in &points.rows {
            for value in floats {
                out.write_all(&value.to_le_bytes())?;
            }
            out.write_all(bytes)?;
        }
        Ok(())
    })
}

/// Triangles with texture coordinates, where there are any (v up).
pub fn write_mesh(
    file: &Path,
    positions: &[Vec3],
    texcoords: &[Vec2],
    triangles: &[[u32; 3]],
) -> Result<(), Error> {
    atomic::write(file, |out| {
        writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment metres, z up")?;
        writeln!(out, "element vertex {}", positions.len())?;
        let coordinates: &[&str] = if texcoords.is_empty() { &[] } else { &["u", "v"] };
        for name in ["x", "y", "z"].iter().chain(coordinates) {
            writeln!(out, "property float {name}")?;
        }
        writeln!(out, "element face {}", triangles.len())?;
        writeln!(out, "property list uchar int vertex_indices\nend_header")?;
        for (index, position) in positions.iter().enumerate() {
            for value in position.to_array() {
                out.write_all(&value.to_le_bytes())?;
            }
            for value in texcoords.get(index).into_iter().flat_map(|uv| uv.to_array()) {
                out.write_all(&value.to_le_bytes())?;
            }
        }
        for triangle in triangles {
            out.write_all(&[3])?;
            for vertex in triangle {
                out.write_all(&vertex.to_le_bytes())?;
            }
        }
        Ok(())
    })
}
