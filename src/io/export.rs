//! A reconstruction as files: `solution.json`, `lights.json`, `samples.csv`, `convergence.csv`
//! and the textures.

use std::collections::BTreeSet;
use std::io::{ErrorKind, Write};
use std::path::Path;

use glam::Vec3;

use super::solution::{self, Light, Lights, Lobe, Material, Scene, Seconds};
use super::table::{self, ConvergenceRow, SampleRow};
use super::{Error, Fault, atomic, exr};
use crate::geometry::mesh::Mesh;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::options::OptionValue;
use crate::reconstruct::lights::LightKind;
use crate::reconstruct::textures::{self, Texture};
use crate::reconstruct::{Options, Reconstruction, emission};
use crate::scene::{Capture, MaterialKind};
use crate::watch::Watch;

/// Whether a solution can be written into `folder`, to be asked before hours of work. Nothing
/// is left behind: a missing folder is made only when there is something to put there.
pub fn check_folder(folder: &Path) -> Result<(), Error> {
    let failed = |source| Error::Write { file: folder.to_owned(), source };
    if folder.exists() && !folder.is_dir() {
        let problem = "it cannot be written, since a file is there and no folder";
        let remedy = "Name another folder, or move the file away";
        return Err(Error::Invalid(Fault::new(folder, "", problem, remedy)));
    }
    let absolute = std::path::absolute(folder).map_err(failed)?;
    let nearest = absolute.ancestors().find(|path| path.exists()).unwrap_or(&absolute);
    tempfile::Builder::new()
        .prefix(".lobelia-")
        .suffix(".part")
        .tempfile_in(nearest)
        .and_then(tempfile::NamedTempFile::close)
        .map_err(failed)
}

/// Writes every file of a solution into `folder`, which is made when it is missing. The
/// summary, `solution.json`, comes last, and that of an earlier solution goes first: where it is,
/// the rest is, and of the same solution.
pub fn write(
    folder: &Path,
    capture: &Capture,
    options: &Options,
    reconstruction: &Reconstruction,
    load_secs: f64,
    watch: &Watch,
) -> Result<(), Error> {
    watch.begin(4 + reconstruction.textures.len() as u64);
    let summary_file = folder.join("solution.json");
    if let Err(source) = std::fs::remove_file(&summary_file)
        && ![ErrorKind::NotFound, ErrorKind::NotADirectory].contains(&source.kind())
    {
        return Err(Error::Write { file: summary_file, source });
    }
    lights(reconstruction).write(&folder.join("lights.json"))?;
    watch.tick()?;
    let rows = samples(capture, options, reconstruction);
    table::write_samples(&folder.join("samples.csv"), &rows)?;
    watch.tick()?;
    table::write_convergence(&folder.join("convergence.csv"), &convergence(reconstruction))?;
    watch.tick()?;
    let mut taken = BTreeSet::new();
    for texture in reconstruction.textures.iter() {
        let name = file_name(&capture.surfaces[texture.surface].name, &mut taken);
        write_texture(&folder.join("textures"), &name, &capture.mesh, texture)?;
        watch.tick()?;
    }
    summary(capture, options, reconstruction, load_secs).write(&summary_file)?;
    watch.tick()?;
    Ok(())
}

fn summary(
    capture: &Capture,
    options: &Options,
    reconstruction: &Reconstruction,
    load_secs: f64,
) -> solution::Solution {
    let result = &reconstruction.solution;
    let mut counts = vec![0; capture.materials.len()];
    for sample in &reconstruction.samples.samples {
        counts[sample.material] += 1;
    }
    let material = |index: usize| {
        let material = &capture.materials[index];
        let reflectance = result.reflectances[index];
        let is_specular = material.kind == MaterialKind::Specular;
        let textured = textures::mean_reflectance(&reconstruction.textures, index);
        Material {
            name: material.name.clone(),
            kind: if is_specular { "specular" } else { "diffuse" }.to_owned(),
            surfaces: material.surfaces.iter().map(|&s| capture.surfaces[s].name.clone()).collect(),
            diffuse: textured.or(reflectance.map(|r| r.diffuse)),
            specular: reflectance.filter(|_| is_specular).map(|r| r.specular),
            exponent: reflectance
                .filter(|r| is_specular && r.specular.iter().any(|&s| s > 0.0))
                .map(|r| r.exponent),
            samples: counts[index],
            ..Material::default()
        }
    };
    let [samples, lights, transport, solve, textures] = reconstruction.seconds;
    let total = load_secs + reconstruction.seconds.iter().sum::<f64>();
    let (first, last) = (result.iterations.first(), result.iterations.last());
    solution::Solution {
        materials: (0..capture.materials.len()).map(material).collect(),
        scene: Scene {
            triangles: capture.mesh.triangles.len(),
            surfaces: capture.surfaces.len(),
            images: capture.measurements().count(),
            samples: reconstruction.samples.samples.len(),
            virtual_lights: reconstruction.lights.lights.len(),
            candidate_lobes: reconstruction.lobes.lobes.len(),
            active_lobes: result.active_lobes(),
        },
        rms: solution::Rms {
            initial: first.map(|iteration| iteration.rms.absolute),
            final_: last.map(|iteration| iteration.rms.absolute),
            relative_final: last.map(|iteration| iteration.rms.relative),
            held_out: None,
        },
        iterations: result.iterations.len(),
        stopped: result.stopped.describe().to_owned(),
        seconds: Seconds { load: load_secs, samples, lights, transport, solve, textures, total },
        warnings: capture.warnings.iter().chain(&reconstruction.warnings).cloned().collect(),
        ..solution::Solution::new(options.general.method.text())
    }
}

fn lights(reconstruction: &Reconstruction) -> Lights {
    let light = |index: usize| {
        let light = &reconstruction.lights.lights[index];
        let lobe = |lobe: usize| {
            let shape = &reconstruction.lobes.lobes[lobe];
            Lobe {
                direction: numbers(shape.direction),
                exponent: f64::from(shape.exponent),
                emission: reconstruction.solution.emission[lobe],
            }
        };
        Light {
            kind: match light.kind {
                LightKind::Sphere => "sphere",
                LightKind::Surface => "surface",
            }
            .to_owned(),
            position: Some(numbers(light.position)),
            direction: None,
            normal: Some(numbers(light.normal)),
            area_m2: Some(f64::from(light.area_m2())),
            radius_m: Some(f64::from(light.radius_m)),
            lobes: reconstruction.lobes.of(index).map(lobe).collect(),
        }
    };
    Lights::new((0..reconstruction.lights.lights.len()).map(light).collect())
}

fn samples(
    capture: &Capture,
    options: &Options,
    reconstruction: &Reconstruction,
) -> Vec<SampleRow> {
    let (result, equations) = (&reconstruction.solution, &reconstruction.equations);
    let mut rows: Vec<SampleRow> = reconstruction
        .samples
        .samples
        .iter()
        .map(|sample| SampleRow {
            position: numbers(sample.position),
            normal: numbers(sample.normal),
            material: capture.materials[sample.material].name.clone(),
            views: sample.views.len(),
            ..SampleRow::default()
        })
        .collect();
    for (equation, computed) in equations.rows.iter().zip(&result.computed) {
        let Some(reflectance) = &result.reflectances[equation.material] else { continue };
        let row = &mut rows[equation.sample];
        let photographed = equations.photographed(equation, reflectance, &reconstruction.transport);
        for (c, &computed) in computed.iter().enumerate() {
            let photographed = photographed[c];
            let weight = emission::weight(
                equation.radiance[c],
                photographed,
                equations.dark(c),
                options.refine.weight_floor,
            );
            row.observed[c] += equation.share * equation.radiance[c];
            row.computed[c] += equation.share * computed;
            row.photographed[c] += equation.share * photographed;
            row.virtual_lights[c] += equation.share * (computed - photographed);
            row.weight += equation.share * weight / CHANNELS as f64;
        }
    }
    // Weights have the unit 1/radiance; what matters is how they compare.
    let mean = rows.iter().map(|row| row.weight).sum::<f64>() / rows.len().max(1) as f64;
    for row in &mut rows {
        row.relative_error = std::array::from_fn(|c| {
            (row.computed[c] - row.observed[c]) / row.observed[c].max(equations.dark(c))
        });
        row.weight /= if mean > 0.0 { mean } else { 1.0 };
    }
    rows
}

fn convergence(reconstruction: &Reconstruction) -> Vec<ConvergenceRow> {
    let row = |iteration: &crate::reconstruct::refine::Iteration| ConvergenceRow {
        iteration: iteration.index,
        rms: iteration.rms.absolute,
        relative_rms: iteration.rms.relative,
        elapsed_secs: iteration.elapsed_secs,
    };
    reconstruction.solution.iterations.iter().map(row).collect()
}

fn numbers(v: Vec3) -> Rgb {
    v.to_array().map(f64::from)
}

/// A file name for a surface: what no file system minds, and not used before.
fn file_name(surface: &str, taken: &mut BTreeSet<String>) -> String {
    let fine = |c: char| if c.is_alphanumeric() || "._-+".contains(c) { c } else { '_' };
    let base: String = surface.chars().map(fine).take(100).collect();
    let base = if base.trim_matches('.').is_empty() { "surface".to_owned() } else { base };
    // Case does not tell files apart everywhere.
    let mut name = base.clone();
    let mut number = 2;
    while !taken.insert(name.to_lowercase()) {
        name = format!("{base}-{number}");
        number += 1;
    }
    name
}

fn write_texture(folder: &Path, name: &str, mesh: &Mesh, texture: &Texture) -> Result<(), Error> {
    let seen: Vec<f32> = texture.seen.iter().map(|&seen| f32::from(u8::from(seen))).collect();
    let image = folder.join(format!("{name}.exr"));
    let (width, height) = (texture.unwrap.width, texture.unwrap.height);
    exr::write_rgb_with(&image, width, height, &texture.texels, &[("seen", &seen)])?;
    if texture.unwrap.is_own {
        return Ok(());
    }
    atomic::write(&folder.join(format!("{name}.obj")), |out| {
        writeln!(out, "# where {name}.exr lies on the surface; metres")?;
        writeln!(out, "usemtl {name}")?;
        let unwrap = &texture.unwrap;
        for (&triangle, corners) in unwrap.triangles.iter().zip(&unwrap.corners) {
            for (position, uv) in mesh.corners(triangle).iter().zip(corners) {
                writeln!(out, "v {} {} {}", position.x, position.y, position.z)?;
                writeln!(out, "vt {} {}", uv.x, uv.y)?;
            }
            writeln!(out, "f -3/-3 -2/-2 -1/-1")?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_harmless_and_unique() {
        let mut taken = BTreeSet::new();
        assert_eq!(file_name("wall left", &mut taken), "wall_left");
        assert_eq!(file_name("Wall/left", &mut taken), "Wall_left-2");
        assert_eq!(file_name("..", &mut taken), "surface");
        assert_eq!(file_name("../../etc/x", &mut taken), ".._.._etc_x");
        assert_eq!(file_name("", &mut taken), "surface-2");
        assert_eq!(file_name("Böden", &mut taken), "Böden");
    }
}
