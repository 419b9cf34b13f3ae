//! `lobelia import SOURCE --out CAPTURE`.

use std::path::PathBuf;

use anyhow::{Context, anyhow, bail};
use clap::ArgMatches;

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::exposures::MergeOptions;
use crate::io::import::{self, Axis, Copying, Options, Shot, Surfaces, Unit, Writing};
use crate::worker::{Command, JobEvent, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let source = arguments::required_path(matches, "source");
    let folder = arguments::required_path(matches, "out");
    let options = options(matches)?;
    import::check_folder(&folder, false)?;
    let merge = merging(matches)?;
    job::catch_interrupts()?;
    let mut display = Display::new(matches.get_flag("quiet"));
    let mut worker = Worker::start(|| ()).context("the worker thread cannot be started")?;
    display.stage("read");
    let command = Command::Import { source, options: Box::new(options) };
    let JobEvent::Imported(import) = job::wait(&mut worker, command, &mut display)? else {
        return Ok(());
    };
    if merge.is_some() && import.series.is_empty() {
        return Err(anyhow!(
            "--series: no photograph is one of several exposures by its EXIF times. Give the times \
             with --times, or leave out --series"
        )
        .into());
    }
    display.stage("write");
    let copying = if matches.get_flag("link") { Copying::Link } else { Copying::Copy };
    let as_srgb = matches.get_flag("srgb");
    let writing = Box::new(Writing { copying, replace: false, merge, as_srgb });
    let command = Command::WriteCapture { import: import.clone(), folder: folder.clone(), writing };
    let written = match job::wait(&mut worker, command, &mut display)? {
        JobEvent::CaptureWritten(_, written) => written,
        // Somebody else has written there meanwhile.
        _ => return Ok(import::check_folder(&folder, false)?),
    };
    display.clear();
    for warning in import.warnings.iter().chain(&written.warnings) {
        note_line!("warning: {warning}");
    }
    for line in import.summary() {
        say_line!("{line}");
    }
    let measured = import.shots.iter().any(|shot| shot.is_measurement);
    let found = import.shots.iter().any(|shot| shot.image.is_some());
    let is_taken = as_srgb && import.shots.iter().any(Shot::is_single_code);
    if found && !measured && written.found.is_none() && !is_taken {
        note_line!("warning: {}", import::NOTHING_MEASURED);
    }
    say_line!("written to {}", folder.display());
    Ok(())
}

/// How exposure series are merged, where that was asked for.
fn merging(matches: &ArgMatches) -> anyhow::Result<Option<MergeOptions>> {
    let mut options = MergeOptions::default();
    arguments::apply_merge(matches, &mut options)?;
    if !matches.get_flag("series") {
        return Ok(None);
    }
    options.check_corners().map_err(|problem| anyhow!(problem))?;
    Ok(Some(options))
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
        surfaces: match matches.get_flag("regions") {
            true => Surfaces::Regions,
            false => text("surfaces").and_then(Surfaces::of).unwrap_or_default(),
        },
        undistorted: matches.get_flag("undistorted"),
        undo_applied: matches.get_flag("undo-applied-transform"),
        times: text("times").map(str::to_owned),
    })
}
