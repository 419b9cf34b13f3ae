//! `lobelia import SOURCE --out CAPTURE`.

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::ArgMatches;

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::io::import::{self, Axis, Copying, Import, Options, Unit};
use crate::worker::{Command, Happening, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let source = arguments::required_path(matches, "source");
    let folder = arguments::required_path(matches, "out");
    let options = options(matches)?;
    import::check_folder(&folder)?;
    job::catch_interrupts()?;
    let mut display = Display::new(matches.get_flag("quiet"));
    let mut worker = Worker::start(|| ()).context("the worker thread cannot be started")?;
    display.stage("read");
    let command = Command::Import { source, options: Box::new(options) };
    let Happening::Imported(import) = job::wait(&mut worker, command, &mut display)? else {
        return Ok(());
    };
    display.stage("write");
    let copying = if matches.get_flag("link") { Copying::Link } else { Copying::Copy };
    let command = Command::WriteCapture { import: import.clone(), folder: folder.clone(), copying };
    job::wait(&mut worker, command, &mut display)?;
    display.clear();
    for warning in &import.warnings {
        note_line!("warning: {warning}");
    }
    report(&import);
    say_line!("written to {}", folder.display());
    Ok(())
}

fn options(matches: &ArgMatches) -> anyhow::Result<Options> {
    let text = |name: &str| matches.get_one::<String>(name).map(String::as_str);
    let positive = |name: &str, default: f64, zero: bool| -> anyhow::Result<f64> {
        let value = matches.get_one::<f64>(name).copied().unwrap_or(default);
        if !value.is_finite() || value < 0.0 || (value == 0.0 && !zero) {
            bail!("--{name} {value}: give a positive number");
        }
        Ok(value)
    };
    let default = Options::default();
    let folders: Vec<PathBuf> =
        matches.get_many::<PathBuf>("images").unwrap_or_default().cloned().collect();
    for folder in &folders {
        if !folder.is_dir() {
            bail!("{}: --images must name a folder that exists", folder.display());
        }
    }
    Ok(Options {
        images: folders,
        mesh: matches.get_one::<PathBuf>("mesh").cloned(),
        unit: text("units").and_then(Unit::of).unwrap_or(default.unit),
        mesh_unit: text("mesh-units").and_then(Unit::of),
        scale: positive("scale", default.scale, false)?,
        up: text("up").and_then(Axis::of).unwrap_or(default.up),
        mesh_up: text("mesh-up").and_then(Axis::of),
        weld_m: positive("weld", default.weld_m, true)?,
        planar_angle: positive("planar-angle", default.planar_angle.to_degrees(), false)?
            .min(90.0)
            .to_radians(),
        regions: matches.get_flag("regions"),
        undistorted: matches.get_flag("undistorted"),
        undo_applied: matches.get_flag("undo-applied-transform"),
    })
}

fn report(import: &Import) {
    let shots = &import.shots;
    let found = shots.iter().filter(|shot| shot.image.is_some()).count();
    let measured = shots.iter().filter(|shot| shot.is_measurement).count();
    say_line!(
        "{}: {} cameras, {found} photographs, {measured} of them radiance",
        import.format,
        shots.len()
    );
    if let Some(geometry) = &import.geometry {
        let (triangles, surfaces) = (geometry.mesh.triangles.len(), geometry.surfaces.len());
        say_line!("mesh: {triangles} triangles in {surfaces} surfaces");
        if let Some((low, high)) = geometry.mesh.bounds() {
            let size = high - low;
            say_line!("size: {:.3} × {:.3} × {:.3} m", size.x, size.y, size.z);
        }
    }
    if let Some(check) = &import.reprojection {
        say_line!(
            "points: {} with {} observations, {:.3} px from them in the mean; against the model's \
             own figures {:.4} px at most, {:.4} px for 99 %",
            check.points,
            check.observations,
            check.mean_px,
            check.disagreement_px,
            check.disagreement_99_px
        );
    }
    if found > 0 && measured == 0 {
        note_line!(
            "warning: no photograph is linear radiance (OpenEXR or .hdr), so nothing can be \
             reconstructed from this capture yet"
        );
    }
}
