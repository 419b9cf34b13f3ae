//! The model as OBJ, MTL and EXR textures: `scene.obj`, `scene.mtl` and `textures/`.
//!
//! `Kd`, `Ks` and `Ns` are ρ_d, ρ_s and n as they stand. Programs differ in how they normalise
//! the lobe of `Ns`; ours is (n+2)/2π.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::Path;

use super::super::{Error, atomic, exr};
use super::file_name;
use crate::render::looks::BrdfF32;
use crate::render::model::{Model, Part, PartLook};
use crate::scene::Gloss;
use crate::scene::gloss::fresnel;
use crate::watch::Watch;

pub fn write(folder: &Path, model: &Model, watch: &Watch) -> Result<(), Error> {
    let textures = write_maps(folder, model, watch)?;
    // Of parts with the same look the first has the material. No line breaks within a name.
    let one_line = |name: &str| name.replace(['\n', '\r'], " ");
    atomic::write(&folder.join("scene.mtl"), |out| {
        writeln!(
            out,
            "# Kd, Ks and Ns: diffuse and specular reflectance, modified Phong exponent"
        )?;
        for (part, texture) in model.parts.iter().zip(&textures) {
            writeln!(out, "\nnewmtl {}", one_line(&part.name))?;
            match &part.look {
                PartLook::Plain(brdf) | PartLook::Textured(brdf, _) => write_brdf(out, brdf)?,
                PartLook::Shining(_) => writeln!(out, "Kd 0 0 0\nKe 1 1 1\nillum 1")?,
            }
            if let Some(texture) = texture {
                let keyword = match part.look {
                    PartLook::Shining(_) => "map_Ke",
                    _ => "map_Kd",
                };
                writeln!(out, "{keyword} {texture}")?;
            }
        }
        Ok(())
    })?;
    atomic::write(&folder.join("scene.obj"), |out| {
        writeln!(out, "# metres, z up\nmtllib scene.mtl")?;
        let (mut vertices, mut coordinates) = (1, 1);
        for part in &model.parts {
            let name = one_line(&part.name);
            writeln!(out, "o {name}")?;
            for p in &part.positions {
                writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
            }
            for uv in &part.texcoords {
                writeln!(out, "vt {} {}", uv.x, uv.y)?;
            }
            writeln!(out, "usemtl {name}")?;
            for triangle in &part.triangles {
                let [a, b, c] = triangle.map(|vertex| {
                    let v = vertices + vertex;
                    if part.texcoords.is_empty() {
                        format!("{v}")
                    } else {
                        format!("{v}/{}", coordinates + vertex)
                    }
                });
                writeln!(out, "f {a} {b} {c}")?;
            }
            vertices += part.positions.len() as u32;
            coordinates += part.texcoords.len() as u32;
        }
        Ok(())
    })
}

fn write_brdf(out: &mut impl Write, brdf: &BrdfF32) -> std::io::Result<()> {
    let [r, g, b] = brdf.diffuse;
    writeln!(out, "Kd {r} {g} {b}")?;
    if let Some(roughness) = brdf.coat {
        let at_normal = fresnel(1.0);
        let exponent = Gloss::Coat { roughness: roughness.into() }.exponent();
        return writeln!(out, "Ks {at_normal} {at_normal} {at_normal}\nNs {exponent}\nillum 2");
    }
    if brdf.specular.iter().any(|&value| value > 0.0) {
        let [r, g, b] = brdf.specular;
        writeln!(out, "Ks {r} {g} {b}\nNs {}\nillum 2", brdf.exponent)
    } else {
        writeln!(out, "Ks 0 0 0\nillum 1")
    }
}

/// Writes `textures/NAME.exr` for every part with a map, and gives their paths below `folder`.
pub(super) fn write_maps(
    folder: &Path,
    model: &Model,
    watch: &Watch,
) -> Result<Vec<Option<String>>, Error> {
    let mut taken = BTreeSet::new();
    let write = |part: &Part| {
        watch.check()?;
        let Some(map) = part.map() else { return Ok(None) };
        let path = format!("textures/{}.exr", file_name(&part.name, &mut taken));
        exr::write_rgb(&folder.join(&path), map.width, map.height, &map.texels)?;
        Ok(Some(path))
    };
    model.parts.iter().map(write).collect()
}

/// Names of files for parts, as [`write_maps`] would give them.
pub(super) fn file_names(model: &Model) -> BTreeMap<usize, String> {
    let mut taken = BTreeSet::new();
    let name = |(index, part): (usize, &Part)| (index, file_name(&part.name, &mut taken));
    model.parts.iter().enumerate().map(name).collect()
}
