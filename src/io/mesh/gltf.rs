//! glTF 2.0, as text with its buffers and as GLB: meshes and cameras of the default scene.
//!
//! The `gltf` crate reads and validates the document. The numbers of accessors are taken from the
//! buffers in `accessors`, checked, since the crate panics where a range is wrong. Surfaces are the
//! materials, or else the meshes, or as the caller wishes. Not read: compressed buffers, skins, morph targets.

mod accessors;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use base64::Engine;
use glam::{DMat4, DVec3, Vec2};
use gltf::mesh::Mode;
use gltf::{Document, Gltf, Node, Semantic};

use super::assemble::{Assembly, NAMELESS};
use super::{LARGEST, SurfacesBy, extension};
use crate::io::error::read_bounded;
use crate::io::obj::Geometry;
use crate::io::{Error, Fault, inside};
use crate::scene::Brdf;

/// More triangles are none: a mesh may stand in a thousand nodes.
const MOST_TRIANGLES: usize = 10_000_000;
const MOST_NODES: usize = 1_000_000;

/// A document with its buffers.
pub struct File {
    document: Document,
    buffers: Vec<Vec<u8>>,
}

/// A perspective camera that a node places.
#[derive(Clone, Debug)]
pub struct PlacedCamera {
    /// Of the node, or else of the camera.
    pub name: String,
    pub yfov: f64,
    pub aspect_ratio: Option<f64>,
    pub world_from_camera: DMat4,
}

/// Reads a file, and the buffers that lie beside it.
pub fn load(file: &Path) -> Result<File, Error> {
    let bytes = read_bounded(file, LARGEST)?;
    let folder = file.parent().unwrap_or(Path::new(""));
    parse(file, &bytes, &|uri| {
        let Some(path) = inside::join(folder, uri) else {
            return Err(invalid(
                file,
                "buffers",
                format!("the buffer \"{uri}\" lies outside of the file's folder"),
                "Export the mesh as .glb, which holds its buffers",
            ));
        };
        read_bounded(&path, LARGEST).map_err(|failure| {
            let problem = format!("a buffer of it cannot be read ({failure})");
            invalid(file, "buffers", problem, "Put its buffers beside it, or export it as .glb")
        })
    })
}

/// Reads the bytes of a file; `beside` gives the bytes of the buffers that it names.
pub fn parse(
    file: &Path,
    bytes: &[u8],
    beside: &dyn Fn(&str) -> Result<Vec<u8>, Error>,
) -> Result<File, Error> {
    caught(file, || {
        let Gltf { document, blob } = Gltf::from_slice(bytes).map_err(|failure| {
            let reason = failure.to_string();
            let reason = reason.chars().take(300).collect::<String>();
            let kind = if extension(file) == "glb" { "GLB" } else { "glTF" };
            let problem = format!("this is no valid {kind} that can be read ({reason})");
            invalid(file, "", problem, "Export it again as glTF 2.0 without compression")
        })?;
        let mut blob = blob;
        let mut buffers = Vec::new();
        for (index, buffer) in document.buffers().enumerate() {
            let data = match buffer.source() {
                gltf::buffer::Source::Bin => blob.take().ok_or_else(|| {
                    let place = format!("buffers[{index}]");
                    invalid(file, place, "the file holds no binary chunk", "Export it again")
                })?,
                gltf::buffer::Source::Uri(uri) => from_uri(file, index, uri, beside)?,
            };
            buffers.push(data);
        }
        Ok(File { document, buffers })
    })
}

fn from_uri(
    file: &Path,
    index: usize,
    uri: &str,
    beside: &dyn Fn(&str) -> Result<Vec<u8>, Error>,
) -> Result<Vec<u8>, Error> {
    let Some(data) = uri.strip_prefix("data:") else { return beside(&without_percent(uri)) };
    let text = data.split_once(";base64,").map(|(_, text)| text);
    let decoded =
        text.and_then(|text| base64::engine::general_purpose::STANDARD.decode(text.trim()).ok());
    decoded.ok_or_else(|| {
        let place = format!("buffers[{index}].uri");
        invalid(file, place, "the data in the file are no base64", "Export the mesh again")
    })
}

/// `%20` is a space.
fn without_percent(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let (mut out, mut at) = (Vec::with_capacity(bytes.len()), 0);
    while at < bytes.len() {
        let escaped = (bytes[at] == b'%')
            .then(|| bytes.get(at + 1..at + 3))
            .flatten()
            .and_then(|digits| std::str::from_utf8(digits).ok())
            .and_then(|digits| u8::from_str_radix(digits, 16).ok());
        out.push(escaped.unwrap_or(bytes[at]));
        at += if escaped.is_some() { 3 } else { 1 };
    }
    String::from_utf8_lossy(&out).into_owned()
}

fn invalid(
    file: &Path,
    place: impl Into<String>,
    problem: impl Into<String>,
    remedy: &str,
) -> Error {
    Error::Invalid(Fault::new(file, place, problem, remedy))
}

/// What the crate makes of a document that slipped through its validation is a message, too.
fn caught<T>(file: &Path, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        Err(invalid(file, "", "the file contradicts itself", "Export the mesh again"))
    })
}

impl File {
    /// The triangles of all meshes of the scene.
    pub fn geometry(&self, file: &Path, by: SurfacesBy) -> Result<Geometry, Error> {
        caught(file, || {
            let is_single = self.document.meshes().len() == 1;
            let mut reader =
                Reader { file, buffers: &self.buffers, by, is_single, notes: Vec::new() };
            let mut assembly = Assembly::new(Vec::new());
            let is_named = self
                .document
                .meshes()
                .flat_map(|mesh| mesh.primitives())
                .any(|p| p.material().index().is_some());
            for (node, world) in self.placed(file)? {
                reader.node(&node, world, is_named, &mut assembly)?;
            }
            let notes = std::mem::take(&mut reader.notes);
            let mut geometry = assembly.finish(file)?;
            geometry.warnings.extend(notes);
            if by == SurfacesBy::Materials {
                self.reflectances(file, &mut geometry);
            }
            Ok(geometry)
        })
    }

    /// What the materials reflect: the base colour as diffuse reflectance, of metals as specular.
    fn reflectances(&self, file: &Path, geometry: &mut Geometry) {
        for material in self.document.materials() {
            let Some(index) = material.index() else { continue };
            let name = material.name().map_or_else(|| format!("material_{index}"), str::to_owned);
            let surface = pbr_reflectance(&material.pbr_metallic_roughness());
            if material.pbr_metallic_roughness().base_color_texture().is_some() {
                geometry.image_notes.push(format!(
                    "{}: the image of the material \"{name}\" is not read; its base colour factor \
                     is taken as it is.",
                    file.display()
                ));
            }
            geometry.reflectances.insert(name, surface);
        }
    }

    /// Whether there are meshes.
    pub fn has_geometry(&self) -> bool {
        self.document.meshes().next().is_some()
    }

    /// The perspective cameras of the scene, and a word on those left out.
    pub fn cameras(&self, file: &Path) -> Result<(Vec<PlacedCamera>, Vec<String>), Error> {
        caught(file, || {
            let (mut cameras, mut orthographic) = (Vec::new(), 0);
            for (node, world) in self.placed(file)? {
                let Some(camera) = node.camera() else { continue };
                let gltf::camera::Projection::Perspective(lens) = camera.projection() else {
                    orthographic += 1;
                    continue;
                };
                let name = node.name().or(camera.name());
                cameras.push(PlacedCamera {
                    name: name.map_or_else(|| format!("camera_{}", camera.index()), str::to_owned),
                    yfov: lens.yfov().into(),
                    aspect_ratio: lens.aspect_ratio().map(f64::from),
                    world_from_camera: world,
                });
            }
            let mut notes = Vec::new();
            if orthographic > 0 {
                notes.push(format!(
                    "{}: {orthographic} orthographic cameras left out: photographs have perspective.",
                    file.display()
                ));
            }
            Ok((cameras, notes))
        })
    }

    /// The nodes of the scene with where they stand.
    fn placed(&self, file: &Path) -> Result<Vec<(Node<'_>, DMat4)>, Error> {
        let document = &self.document;
        let mut stack: Vec<(Node, DMat4)> = Vec::new();
        match document.default_scene().or_else(|| document.scenes().next()) {
            Some(scene) => stack.extend(scene.nodes().map(|node| (node, DMat4::IDENTITY))),
            None => {
                let children: std::collections::HashSet<usize> = document
                    .nodes()
                    .flat_map(|node| node.children().map(|child| child.index()))
                    .collect();
                let roots = document.nodes().filter(|node| !children.contains(&node.index()));
                stack.extend(roots.map(|node| (node, DMat4::IDENTITY)));
            }
        }
        stack.reverse();
        let mut visited = vec![false; document.nodes().len()];
        let mut placed = Vec::new();
        while let Some((node, parent)) = stack.pop() {
            // A node has one parent, so that there is no second visit, and no circle.
            if std::mem::replace(&mut visited[node.index()], true) || placed.len() >= MOST_NODES {
                let place = format!("nodes[{}]", node.index());
                let problem = "the node is its own ancestor, or has two parents";
                return Err(invalid(file, place, problem, "Export the scene again"));
            }
            let own = DMat4::from_cols_array_2d(
                &node.transform().matrix().map(|column| column.map(f64::from)),
            );
            let world = parent * own;
            let children: Vec<_> = node.children().map(|child| (child, world)).collect();
            stack.extend(children.into_iter().rev());
            placed.push((node, world));
        }
        Ok(placed)
    }
}

struct Reader<'a> {
    file: &'a Path,
    buffers: &'a [Vec<u8>],
    by: SurfacesBy,
    is_single: bool,
    notes: Vec<String>,
}

impl Reader<'_> {
    fn node(
        &mut self,
        node: &Node,
        world: DMat4,
        is_named: bool,
        assembly: &mut Assembly,
    ) -> Result<(), Error> {
        let Some(mesh) = node.mesh() else { return Ok(()) };
        let mirrors = world.determinant() < 0.0;
        for primitive in mesh.primitives() {
            let place = format!("meshes[{}].primitives[{}]", mesh.index(), primitive.index());
            let Some(positions) = primitive.get(&Semantic::Positions) else {
                self.notes
                    .push(format!("{}, {place}: no positions; left out.", self.file.display()));
                continue;
            };
            let positions = self.vectors::<3>(&positions, &place)?;
            let texcoords = match primitive.get(&Semantic::TexCoords(0)) {
                Some(accessor) => self.vectors::<2>(&accessor, &place)?,
                None => Vec::new(),
            };
            let indices = match primitive.indices() {
                Some(accessor) => self.indices(&accessor, &place)?,
                None => (0..positions.len() as u32).collect(),
            };
            let Some(triangles) = triangles(primitive.mode(), &indices) else {
                self.notes.push(format!(
                    "{}, {place}: points or lines are no surface; left out.",
                    self.file.display()
                ));
                continue;
            };
            if assembly.mesh.triangles.len() + triangles.len() > MOST_TRIANGLES {
                return Err(Error::TooLarge(Fault::new(
                    self.file,
                    place,
                    format!("the scene has more than {MOST_TRIANGLES} triangles"),
                    "Simplify it, or export fewer instances",
                )));
            }
            let surface = assembly.surface(&self.name(&primitive, node, is_named));
            let base = assembly.mesh.positions.len() as u32;
            assembly.mesh.positions.extend(positions.iter().map(|&position| {
                let position = DVec3::from(position.map(f64::from));
                world.transform_point3(position).as_vec3()
            }));
            for [a, b, c] in triangles {
                let own = if mirrors { [a, c, b] } else { [a, b, c] };
                let at = |index: u32| {
                    if (index as usize) < positions.len() { base + index } else { u32::MAX }
                };
                let texcoord = |index: u32| texcoords.get(index as usize).copied();
                let coordinates: Option<Vec<Vec2>> =
                    own.iter().map(|&index| texcoord(index).map(Vec2::from)).collect();
                assembly.face(&own.map(at), coordinates.as_deref(), surface);
            }
        }
        Ok(())
    }

    fn name(&self, primitive: &gltf::Primitive, node: &Node, is_named: bool) -> String {
        let mesh = node.mesh();
        let mesh = mesh.as_ref().and_then(gltf::Mesh::name);
        let own = match self.by {
            SurfacesBy::Materials => None,
            SurfacesBy::Groups => mesh.or(node.name()),
            SurfacesBy::Objects => node.name().or(mesh),
        };
        if let Some(own) = own {
            return own.to_owned();
        }
        let material = primitive.material();
        if let Some(index) = material.index() {
            return material.name().map_or_else(|| format!("material_{index}"), str::to_owned);
        }
        if is_named {
            return "no material".to_owned();
        }
        // A single mesh tells no surfaces apart, whatever its name.
        if self.is_single {
            return NAMELESS.to_owned();
        }
        mesh.or(node.name()).map_or_else(|| NAMELESS.to_owned(), str::to_owned)
    }
}

/// A material of base colour, metalness and roughness as diffuse reflectance and a lobe: of metals
/// the base colour is mirrored; what is no metal keeps it, and goes without the faint gloss that
/// all of them have in glTF. A roughness r is the width α = r² of a lobe about the half vector, there
/// as wide as Phong's with the exponent 2/α² − 2; about the mirror direction, which turns twice as
/// far, it is a quarter of that.
fn pbr_reflectance(own: &gltf::material::PbrMetallicRoughness) -> Brdf {
    let [red, green, blue, _] = own.base_color_factor();
    let metallic = f64::from(own.metallic_factor()).clamp(0.0, 1.0);
    let base = [red, green, blue].map(|value| f64::from(value).clamp(0.0, 1.0));
    if metallic == 0.0 {
        return Brdf::diffuse(base);
    }
    let alpha = f64::from(own.roughness_factor()).clamp(0.03, 1.0).powi(2);
    let exponent = (0.25 * (2.0 / (alpha * alpha) - 2.0)).max(1.0);
    let diffuse = base.map(|value| value * (1.0 - metallic));
    Brdf::phong(diffuse, base.map(|value| value * metallic), exponent)
}

/// The triangles of a primitive; `None` for points and lines.
fn triangles(mode: Mode, indices: &[u32]) -> Option<Vec<[u32; 3]>> {
    let windows = || indices.windows(3).enumerate();
    Some(match mode {
        Mode::Triangles => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        // Every second triangle of a strip runs the other way.
        Mode::TriangleStrip => windows()
            .map(|(index, t)| if index % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })
            .collect(),
        Mode::TriangleFan => windows().map(|(_, t)| [indices[0], t[1], t[2]]).collect(),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        assert_eq!(triangles(Mode::TriangleStrip, &[0, 1, 2, 3]).unwrap(), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(triangles(Mode::TriangleFan, &[0, 1, 2, 3]).unwrap(), [[0, 1, 2], [0, 2, 3]]);
        assert!(triangles(Mode::Lines, &[0, 1]).is_none());
        assert_eq!(without_percent("a%20b%zz.bin"), "a b%zz.bin");
    }
}
