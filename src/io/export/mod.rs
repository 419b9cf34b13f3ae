//! A reconstruction as files: `solution.json`, `lights.json`, `samples.csv`, `convergence.csv`
//! and the textures.

pub mod elsewhere;
pub mod glb;
pub mod lights;
pub mod mitsuba;
pub mod pictures;
pub mod ply;
pub mod points;
pub mod wavefront;

#[cfg(test)]
pub(crate) mod fixture;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::io::{ErrorKind, Write};
use std::path::Path;

use glam::Vec3;

use super::solution::{self, Intervals, Material, Scale, Scene, Seconds};
use super::table::{self, ConvergenceRow, SampleRow};
use super::{Error, Fault, atomic, exr};
use crate::geometry::mesh::Mesh;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::options::OptionValue;
use crate::reconstruct::gain::GainUse;
use crate::reconstruct::materials::Materials;
use crate::reconstruct::solution::Iteration;
use crate::reconstruct::textures::Texture;
use crate::reconstruct::{Options, Reconstruction, Stage, emission};
use crate::scene::{Capture, Gloss, MaterialKind, Optics};
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
    lights::file(capture, reconstruction).write(&folder.join("lights.json"))?;
    watch.tick()?;
    let rows = sample_rows(capture, options, reconstruction);
    table::write_samples(&folder.join("samples.csv"), &rows)?;
    watch.tick()?;
    table::write_convergence(
        &folder.join("convergence.csv"),
        &convergence_rows(&reconstruction.solution.iterations),
    )?;
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

/// `solution.json` of a reconstruction.
pub fn summary(
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
    let Materials { reflectances, certainty } = reconstruction.materials(capture);
    let material = |index: usize| {
        let material = &capture.materials[index];
        let reflectance = reflectances[index];
        let is_specular = material.kind == MaterialKind::Specular;
        let gloss = reflectance.filter(|_| is_specular).and_then(|r| r.gloss());
        let (model, exponent, roughness) = match gloss {
            Some((Gloss::Phong { exponent }, _)) => (Some("phong"), Some(exponent), None),
            Some((Gloss::Coat { roughness }, _)) => (Some("coated"), None, Some(roughness)),
            None => (None, None, None),
        };
        let optics = result.optics.get(index).copied().unwrap_or_default();
        let (model, mirrored) = match optics {
            Optics::Opaque => (model, None),
            Optics::Mirror(reflected) => (Some("mirror"), Some(reflected.map(f64::from))),
            Optics::Glass => (Some("glass"), None),
        };
        let is_known = material.is_exactly_known() && result.certainty.is_some();
        let known = material.known_diffuse.filter(|_| is_known);
        // A material without a reflectance has nothing to be certain of.
        let certainty = certainty.get(index).copied().flatten().filter(|_| reflectance.is_some());
        Material {
            name: material.name.clone(),
            kind: if is_specular { "specular" } else { "diffuse" }.to_owned(),
            surfaces: material.surfaces.iter().map(|&s| capture.surfaces[s].name.clone()).collect(),
            diffuse: reflectance.map(|r| known.unwrap_or(r.diffuse)),
            specular: reflectance
                .filter(|r| is_specular && r.coat.is_none())
                .map(|r| r.specular)
                .or(mirrored),
            exponent,
            model: model.map(str::to_owned),
            roughness,
            roughness_interval: roughness.and(certainty).and_then(|c| c.roughness),
            diffuse_interval: certainty.and_then(|c| match known {
                Some(known) => intervals(known.map(|value| Some([value; 2]))),
                None => intervals(c.diffuse),
            }),
            specular_interval: certainty
                .filter(|_| is_specular)
                .and_then(|c| intervals(c.specular)),
            exponent_interval: exponent.and(certainty).and_then(|c| c.exponent),
            identified: certainty.map(|c| c.identified),
            samples: counts[index],
        }
    };
    let spent = reconstruction.spent();
    let [samples, lights, transport, solve, textures] = spent;
    let total = load_secs + spent.iter().sum::<f64>();
    let kept = Stage::ALL.into_iter().filter(|stage| reconstruction.kept[*stage as usize]);
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
            held_out: result.certainty.as_ref().and_then(|certainty| certainty.held_out),
        },
        light_model: Some(lights::model(reconstruction)),
        scale: result.certainty.as_ref().map(|certainty| Scale {
            singular_value: certainty.scale.singular_value,
            log_rms: certainty.scale.log_rms,
            log_sd: certainty.scale.log_sd,
        }),
        selection: result
            .certainty
            .as_ref()
            .and_then(|certainty| certainty.selection.as_ref())
            .map(|selection| lights::selection(capture, selection)),
        photographs: reconstruction
            .gains
            .iter()
            .map(|own| solution::Photograph {
                name: capture.photographs[own.photograph].name.clone(),
                gain: own.gain,
                gain_log_sd: own.log_sd,
                applied: options.photographs.gain == GainUse::Apply && own.is_significant(),
                samples: own.samples,
            })
            .collect(),
        iterations: result.iterations.len(),
        stopped: result.stopped.describe().to_owned(),
        seconds: Seconds { load: load_secs, samples, lights, transport, solve, textures, total },
        kept_stages: kept.map(|stage| stage.name().to_owned()).collect(),
        warnings: capture.warnings.iter().chain(&reconstruction.warnings).cloned().collect(),
        ..solution::Solution::new(options.general.method.text())
    }
}

/// `None` where no channel has one.
fn intervals(channels: Intervals) -> Option<Intervals> {
    channels.iter().any(Option::is_some).then_some(channels)
}

/// The samples as a table: where they are, and what is measured and computed there.
pub fn sample_rows(
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

/// Iterations as a table.
pub fn convergence_rows(iterations: &[Iteration]) -> Vec<ConvergenceRow> {
    let row = |iteration: &Iteration| ConvergenceRow {
        iteration: iteration.index,
        rms: iteration.rms.absolute,
        relative_rms: iteration.rms.relative,
        objective: iteration.objective,
        largest_change: iteration.change,
        elapsed_secs: iteration.elapsed_secs,
    };
    iterations.iter().map(row).collect()
}

fn numbers(v: Vec3) -> Rgb {
    v.to_array().map(f64::from)
}

/// A file name for a surface: what no file system minds, and not used before.
pub(super) fn file_name(surface: &str, taken: &mut BTreeSet<String>) -> String {
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
