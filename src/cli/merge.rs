//! `lobelia merge FILES… --out FILE`.

use std::path::PathBuf;

use anyhow::{Context, anyhow};
use clap::ArgMatches;

use crate::cli::print::{note_line, say, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::exposures::options::ResponseKind;
use crate::exposures::{MergeOptions, Response};
use crate::io;
use crate::io::brackets::{self, Series};
use crate::io::grouping;
use crate::worker::{Command, JobEvent, MergeReport, Merging, Place, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let files: Vec<PathBuf> = matches.get_many("files").unwrap_or_default().cloned().collect();
    let out = arguments::required_path(matches, "out");
    let mut options = MergeOptions::default();
    arguments::apply_merge(matches, &mut options)?;
    options.check_corners().map_err(|problem| anyhow!(problem))?;
    let times = matches.get_one::<String>("times");
    let times = times.map(|text| grouping::read_times(text)).transpose()?;
    let known = matches.get_one::<PathBuf>("response");
    let response = known
        .map(|file| match file.to_str() {
            Some("srgb") => Ok(Response::srgb()),
            _ => io::response::read(file),
        })
        .transpose()?;
    let series = grouping::group(&files, times.as_ref(), matches.get_flag("one"))?;
    if response.is_none() && options.response != ResponseKind::Linear {
        check(&series)?;
    }
    let is_file = out.extension().is_some_and(|own| own.eq_ignore_ascii_case("exr"));
    let place = match series.len() {
        1 if is_file => Place::File(out.clone()),
        count if is_file => {
            return Err(anyhow!(
                "{}: the files are {count} series ({}), which are several images. Give a folder \
                 with --out, or --one if they are exposures of one view",
                out.display(),
                listed(&series)
            )
            .into());
        }
        _ => Place::Folder(out.clone()),
    };
    let folder = match &place {
        Place::File(file) => file.parent().filter(|folder| !folder.as_os_str().is_empty()),
        Place::Folder(folder) => Some(folder.as_path()),
    };
    io::export::check_folder(folder.unwrap_or(std::path::Path::new(".")))?;
    job::catch_interrupts()?;
    let mut display = Display::new(matches.get_flag("quiet"));
    let mut worker = Worker::start(|| ()).context("the worker thread cannot be started")?;

    display.stage("merge");
    let curve = matches.get_one::<PathBuf>("curve").cloned();
    let merging = Merging { series, response, options, place, curve };
    let command = Command::Merge(Box::new(merging));
    let JobEvent::Merged(report) = job::wait(&mut worker, command, &mut display)? else {
        return Ok(());
    };
    display.clear();
    for warning in &report.found.warnings {
        note_line!("warning: {warning}");
    }
    print(&report);
    Ok(())
}

fn listed(series: &[Series]) -> String {
    let first = |series: &Series| format!("{} files with {}", series.files.len(), series.name());
    series.iter().take(4).map(first).collect::<Vec<_>>().join(", ")
}

/// A series of one exposure is a slip more often than not, and determines no response; RAW files
/// need none.
fn check(series: &[Series]) -> Result<(), Ending> {
    let is_raw = |series: &Series| series.files.iter().all(|file| io::raw::is_raw(file));
    match series.iter().find(|series| series.files.len() < 2 && !is_raw(series)) {
        None => Ok(()),
        Some(single) => Err(anyhow!(
            "{}: this exposure is alone; a series needs two. The files were grouped to {}. Give \
             all exposures of the view, --one if the files are one series, or the response \
             (--response) if there are no more",
            single.files[0].display(),
            listed(series)
        )
        .into()),
    }
}

fn print(report: &MergeReport) {
    let checked = &report.found.checked;
    match &checked.response {
        Response::Linear { .. } => say_line!("response: linear"),
        Response::Curve(knots) => {
            let stops = knots.map(|knots| (knots[250] - knots[5]) / std::f64::consts::LN_2);
            say_line!(
                "response: {:.1} / {:.1} / {:.1} stops from code 5 to 250",
                stops[0],
                stops[1],
                stops[2]
            );
        }
    }
    for (index, (series, written)) in std::iter::zip(&report.series, &report.written).enumerate() {
        say_line!(
            "{}: {}×{}, {} exposures; {} pixels too bright and {} too dark in all of them",
            written.file.display(),
            written.width,
            written.height,
            checked.trusted[index].iter().filter(|trusted| **trusted).count(),
            written.too_bright,
            written.too_dark,
        );
        for (exposure, file) in series.files.iter().enumerate() {
            let [x, y] = report.found.shifts[index][exposure];
            say!("  {}  {}", file.display(), brackets::time(series.seconds[exposure]));
            if [x, y] != [0, 0] {
                say!(", moved by {x}, {y} px");
            }
            let link = checked.links[index].iter().find(|link| link.exposures[1] == exposure);
            if let Some(link) = link {
                say!(", {:.2} stops more", link.stated_stops);
                if let Some(measured) = link.measured_stops {
                    say!(" ({measured:.2} by its pixels)");
                }
            }
            if !checked.trusted[index][exposure] {
                say!(", left out");
            }
            say_line!();
        }
    }
}
