//! The files of a written capture: names of photographs, cameras, and the mesh with its material
//! library.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::Shot;
use crate::geometry::mesh::Mesh;
use crate::io::obj::Geometry;
use crate::io::{Error, atomic, inside, raw};
use crate::scene::Camera;

/// A path below `images` for each shot, all different also where case does not count.
pub(super) fn names(shots: &[Shot]) -> Vec<String> {
    let mut taken = HashSet::new();
    shots
        .iter()
        .map(|shot| {
            let tail = inside::tail(&shot.name);
            let tail = tail.strip_prefix("images/").unwrap_or(&tail);
            let (stem, own) = match tail.rsplit_once('.') {
                Some((stem, own)) if !stem.is_empty() && !own.contains('/') && own.len() <= 4 => {
                    (stem, own)
                }
                _ => (tail, ""),
            };
            let stem = if stem.is_empty() { "image" } else { stem };
            let actual = shot.image.as_deref().and_then(Path::extension);
            let extension = actual.map_or(own.into(), |own| own.to_string_lossy());
            // "img.001" found as img.001.png keeps its dot.
            let is_image = ["exr", "hdr", "png", "jpg", "jpeg", "tif", "tiff"]
                .contains(&own.to_lowercase().as_str())
                || raw::is_raw(Path::new(tail));
            let stem = if is_image || own.is_empty() { stem.to_owned() } else { tail.to_owned() };
            let whole = |number: usize| {
                let number = if number == 1 { String::new() } else { format!("_{number}") };
                let dot = if extension.is_empty() { "" } else { "." };
                format!("images/{stem}{number}{dot}{extension}")
            };
            let free = (1..).map(whole).find(|name| taken.insert(name.to_lowercase()));
            free.unwrap_or_default()
        })
        .collect()
}

/// The camera file. With `as_srgb` it says that single photographs are radiance by that curve.
pub(super) fn cameras(shots: &[Shot], names: &[String], as_srgb: bool) -> Value {
    let first = lens(&shots[0].camera);
    let is_shared = shots.iter().all(|shot| lens(&shot.camera) == first);
    let mut root = if is_shared { first } else { Map::new() };
    let frames = shots.iter().zip(names).map(|(shot, name)| {
        let mut frame = if is_shared { Map::new() } else { lens(&shot.camera) };
        frame.insert("file_path".into(), json!(name));
        let is_taken = as_srgb && shot.is_single_code();
        let is_shown = shot.image.is_some() && !shot.is_measurement && !is_taken;
        let looks_shown = shot.image.is_none()
            && !name.to_lowercase().ends_with(".exr")
            && !name.to_lowercase().ends_with(".hdr");
        if is_shown || looks_shown {
            frame.insert("hdr".into(), json!(false));
        }
        if !shot.orientation.is_upright() {
            frame.insert("orientation".into(), json!(shot.orientation.exif()));
        }
        if let Some(mask) = shot.mask.as_deref() {
            frame.insert("mask_path".into(), json!(mask_name(name, mask)));
        }
        let (rotation, position) = (shot.camera.world_from_camera, shot.camera.position);
        let row = |row: usize| {
            let axes = rotation.row(row);
            json!([axes.x, axes.y, axes.z, position[row]])
        };
        let matrix = json!([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]);
        frame.insert("transform_matrix".into(), matrix);
        Value::Object(frame)
    });
    root.insert("frames".into(), frames.collect());
    if as_srgb && shots.iter().any(Shot::is_single_code) {
        root.insert("response".into(), json!("srgb"));
    }
    Value::Object(root)
}

/// Where the mask of a photograph lies in a capture: by COLMAP's rule, with its own extension.
pub(super) fn mask_name(photograph: &str, mask: &Path) -> String {
    let below = photograph.strip_prefix("images/").unwrap_or(photograph);
    let own = mask.extension().map_or("png".into(), |own| own.to_string_lossy());
    format!("masks/{below}.{own}")
}

/// Size, focal lengths, principal point and distortion in nerfstudio's words.
fn lens(camera: &Camera) -> Map<String, Value> {
    let distortion = &camera.distortion;
    let mut map = Map::new();
    let mut put = |key: &str, value: Value| drop(map.insert(key.to_owned(), value));
    let is_rational = distortion.denominator != [0.0; 3];
    let model = match (distortion.is_none(), is_rational) {
        (true, _) => "PINHOLE",
        (false, true) => "FULL_OPENCV",
        (false, false) => "OPENCV",
    };
    put("camera_model", json!(model));
    put("w", json!(camera.width));
    put("h", json!(camera.height));
    put("fl_x", json!(camera.focal_px.x));
    put("fl_y", json!(camera.focal_px.y));
    put("cx", json!(camera.principal_px.x));
    put("cy", json!(camera.principal_px.y));
    if !distortion.is_none() {
        let [k1, k2, k3, k4] = distortion.radial;
        let [p1, p2] = distortion.tangential;
        let [d4, d5, d6] = distortion.denominator;
        let terms = [("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2), ("k3", k3)];
        terms.into_iter().for_each(|(key, value)| put(key, json!(value)));
        // OpenCV numbers the divisor on from k3; polynomial models have a fourth term instead.
        if is_rational {
            let divisor = [("k4", d4), ("k5", d5), ("k6", d6)];
            divisor.into_iter().for_each(|(key, value)| put(key, json!(value)));
        } else if k4 != 0.0 {
            put("k4", json!(k4));
        }
    }
    map
}

pub(super) fn write_mesh(folder: &Path, geometry: &Geometry) -> Result<(), Error> {
    let names: Vec<String> = unique(geometry.surfaces.iter().map(|surface| surface.name.as_str()));
    let mut library = String::new();
    for (name, is_specular) in names.iter().zip(&geometry.specular) {
        let shine = if *is_specular { "illum 2\nKs 0.2 0.2 0.2\nNs 50\n" } else { "illum 1\n" };
        let _ = write!(library, "newmtl {name}\nKd 0.5 0.5 0.5\n{shine}\n");
    }
    atomic::write_bytes(&folder.join("scene.mtl"), library.as_bytes())?;
    let mesh = &geometry.mesh;
    atomic::write(&folder.join("scene.obj"), |out| {
        writeln!(out, "mtllib scene.mtl")?;
        for p in &mesh.positions {
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        let mut number = 0;
        for (surface, name) in names.iter().enumerate() {
            let textured = geometry.surfaces[surface].has_texcoords && !mesh.texcoords.is_empty();
            writeln!(out, "usemtl {name}")?;
            for polygon in polygons(mesh, surface as u32) {
                let mut line = String::from("f");
                for (triangle, corner) in polygon {
                    let vertex = mesh.triangles[triangle][corner] + 1;
                    if textured {
                        let texcoord = mesh.texcoords[triangle][corner];
                        writeln!(out, "vt {} {}", texcoord.x, texcoord.y)?;
                        number += 1;
                        let _ = write!(line, " {vertex}/{number}");
                    } else {
                        let _ = write!(line, " {vertex}");
                    }
                }
                writeln!(out, "{line}")?;
            }
        }
        Ok(())
    })
}

/// Names that an OBJ file can hold, all different.
fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut taken = HashSet::new();
    names
        .map(|name| {
            let plain: String =
                name.chars().map(|c| if c.is_control() || c == '\\' { '_' } else { c }).collect();
            let plain = plain.split_whitespace().collect::<Vec<_>>().join(" ");
            let plain = if plain.is_empty() { "surface".to_owned() } else { plain };
            let numbered = |number: usize| match number {
                1 => plain.clone(),
                number => format!("{plain}_{number}"),
            };
            let free = (1..).map(numbered).find(|name| taken.insert(name.clone()));
            free.unwrap_or_default()
        })
        .collect()
}

/// The outlines of a surface's polygons as triangles and their corners: one outline a polygon
/// where its triangles make a simple one, else a triangle each.
fn polygons(mesh: &Mesh, surface: u32) -> Vec<Vec<(usize, usize)>> {
    let own: Vec<usize> =
        (0..mesh.triangles.len()).filter(|&t| mesh.surface[t] == surface).collect();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for triangle in own {
        match groups.last_mut() {
            Some(group) if mesh.polygon[group[0]] == mesh.polygon[triangle] => group.push(triangle),
            _ => groups.push(vec![triangle]),
        }
    }
    let each = |group: &[usize]| -> Vec<Vec<(usize, usize)>> {
        group.iter().map(|&triangle| (0..3).map(|corner| (triangle, corner)).collect()).collect()
    };
    groups
        .iter()
        .flat_map(|group| match group.len() {
            1 => each(group),
            _ => outline(mesh, group).map_or_else(|| each(group), |outline| vec![outline]),
        })
        .collect()
}

/// The corners around some triangles, if each is passed once and texture coordinates agree.
fn outline(mesh: &Mesh, group: &[usize]) -> Option<Vec<(usize, usize)>> {
    let corners =
        || group.iter().flat_map(|&triangle| (0..3).map(move |corner| (triangle, corner)));
    let vertex = |(triangle, corner): (usize, usize)| mesh.triangles[triangle][corner];
    let after = |(triangle, corner): (usize, usize)| (triangle, (corner + 1) % 3);
    let edges: HashSet<(u32, u32)> =
        corners().map(|corner| (vertex(corner), vertex(after(corner)))).collect();
    let mut next: HashMap<u32, (usize, usize)> = HashMap::new();
    for corner in corners() {
        let (from, to) = (vertex(corner), vertex(after(corner)));
        if !edges.contains(&(to, from)) && next.insert(from, corner).is_some() {
            return None;
        }
    }
    // Corners inside would be lost, and so would seams of the unwrap.
    let mut coordinates = HashMap::new();
    for corner in corners() {
        let texcoord = mesh.texcoords.get(corner.0).map(|own| own[corner.1]);
        next.get(&vertex(corner))?;
        if *coordinates.entry(vertex(corner)).or_insert(texcoord) != texcoord {
            return None;
        }
    }
    let start = vertex((group[0], 0));
    let (mut outline, mut at) = (Vec::new(), start);
    loop {
        let corner = *next.get(&at)?;
        outline.push(corner);
        at = vertex(after(corner));
        if at == start {
            return (outline.len() == next.len() && outline.len() == group.len() + 2)
                .then_some(outline);
        }
        if outline.len() > next.len() {
            return None;
        }
    }
}
