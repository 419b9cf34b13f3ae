//! The study of speed: error against computing time, over a designed set of settings.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::io::records::cell;
use crate::io::{self, drawing, records};
use crate::options::OptionValue;
use crate::reconstruct::{Options, Quality};
use crate::study::measure::{Measured, measure};
use crate::study::runs::{self, Choice, Planned, Tell};
use crate::study::settings::{SETTINGS, Scope};
use crate::study::{Opened, Source, described, guarded, speed_chart};
use crate::watch::Watch;

/// What is run on what.
#[derive(Clone, Debug)]
pub struct Design {
    /// The captures.
    pub sources: Vec<Source>,
    /// What the settings are set upon.
    pub base: Options,
    /// Also run the base as it is.
    pub own: bool,
    /// Which settings are run.
    pub scope: Scope,
    /// Runs of each setting on each capture, with other seeds.
    pub repeats: usize,
}

/// The name of the base among the settings.
pub const OWN: &str = "your options";

/// One setting on one capture.
#[derive(Clone, Debug)]
pub struct Run {
    source: Source,
    /// The name of the setting.
    pub setting: &'static str,
    quality: Option<Quality>,
    /// From 0.
    pub repeat: usize,
    /// Those of the setting, with the seed of the repeat.
    pub options: Options,
}

/// The result of a run, a line of the table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Its name.
    pub capture: String,
    /// Its name.
    pub setting: String,
    /// `joint` or `paper`.
    pub method: String,
    /// `draft`, `standard` or `fine`, where it is one.
    pub quality: Option<String>,
    /// From 0.
    pub repeat: usize,
    /// The seed of the run.
    pub seed: usize,
    /// Threads that the run had.
    pub threads: usize,
    /// Why there is no result.
    pub failure: Option<String>,
    /// Seconds and errors.
    #[serde(flatten)]
    pub measured: Measured,
}

impl Planned for Run {
    type Row = Row;

    fn name(&self) -> String {
        format!("{} · {} · {}", self.source.name(), self.setting, self.repeat + 1)
    }

    fn key(&self) -> String {
        format!("{} {} {}", self.source.name(), self.repeat, described(&self.options))
    }
}

/// Every run: captures, repeats, settings. Repeats have other seeds and hold out other parts.
pub fn plan(design: &Design) -> Result<Vec<Run>, io::Error> {
    let mut plan = Vec::new();
    for source in &design.sources {
        for repeat in 0..design.repeats {
            let seed = 1 + repeat;
            if design.own {
                let mut options = design.base.clone();
                options.general.seed = seed;
                let source = source.clone();
                plan.push(Run { source, setting: OWN, quality: None, repeat, options });
            }
            for setting in SETTINGS.iter().filter(|setting| design.scope.has(setting)) {
                let options = setting.upon(&design.base, seed).map_err(|error| {
                    io::Error::Invalid(io::Fault::new(
                        Path::new(&source.name()),
                        setting.name,
                        error.to_string(),
                        "This is a fault of the program: please report it",
                    ))
                })?;
                let (source, quality) = (source.clone(), setting.quality());
                plan.push(Run { source, setting: setting.name, quality, repeat, options });
            }
        }
    }
    Ok(plan)
}

/// Carries out the runs of a plan that `choice` names.
pub fn carry_out(
    folder: Option<&Path>,
    plan: &[Run],
    choice: &Choice,
    watch: &Watch,
    tell: &Tell<Run>,
) -> Result<(), io::Error> {
    let opened: Mutex<Option<(Source, Opened)>> = Mutex::new(None);
    let perform = |run: &Run, watch: &Watch| {
        let mut opened = opened.lock().unwrap_or_else(PoisonError::into_inner);
        if opened.as_ref().is_none_or(|(source, _)| !source.is(&run.source)) {
            *opened = Some((run.source.clone(), run.source.open(watch)?));
        }
        let Some((_, (capture, truth))) = opened.as_ref() else {
            return Ok(Row::default());
        };
        let (options, truth) = (&run.options, truth.as_deref());
        let outcome = guarded(|| measure(capture, options, truth, Some(run.repeat), watch))?;
        let (measured, failure) = match outcome {
            Ok(measured) => (measured, None),
            Err(failure) => (Measured::default(), Some(failure)),
        };
        Ok(Row {
            capture: run.source.name(),
            setting: run.setting.to_owned(),
            method: run.options.general.method.text(),
            quality: run.quality.map(|quality| quality.text()),
            repeat: run.repeat + 1,
            seed: run.options.general.seed,
            threads: rayon::current_num_threads(),
            failure,
            measured,
        })
    };
    runs::carry_out(folder, plan, choice, watch, &perform, tell)
}

/// One setting on one capture over its repeats.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Place {
    /// Its name.
    pub setting: String,
    /// Whether it is the published method.
    pub is_paper: bool,
    /// `draft`, `standard` or `fine`, where it is one.
    pub quality: Option<String>,
    /// Repeats that have a result.
    pub runs: usize,
    /// Median of the repeats.
    pub seconds: f64,
    /// Median of the repeats, in MB.
    pub peak_mb: Option<f64>,
    /// Mean of the repeats, in the order of [`MEASURES`].
    pub errors: [Option<f64>; MEASURES.len()],
}

/// What is charted against seconds: columns of the table, and what they are called on an axis.
pub const MEASURES: [(&str, &str, &str); 5] = [
    ("error_raw", "Reflectance, raw", "mean absolute error of reflectance"),
    ("error_one_scale", "Reflectance, after one scale", "mean absolute error of reflectance"),
    ("blocks_relative_rms", "Samples of held-out blocks", "relative RMS of radiance"),
    ("photograph_relative_rms", "A held-out photograph, made anew", "relative RMS of radiance"),
    ("photograph_hdr_flip", "A held-out photograph, as seen", "mean HDR-FLIP"),
];

/// The settings on one capture.
pub fn places(rows: &[&Row]) -> Vec<Place> {
    let mut places: Vec<Place> = Vec::new();
    for row in rows.iter().filter(|row| row.failure.is_none()) {
        if places.iter().all(|place| place.setting != row.setting) {
            let runs: Vec<&Measured> = rows
                .iter()
                .filter(|other| other.setting == row.setting && other.failure.is_none())
                .map(|other| &other.measured)
                .collect();
            let mean = |of: &dyn Fn(&Measured) -> Option<f64>| {
                let values: Vec<f64> = runs.iter().filter_map(|run| of(run)).collect();
                (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
            };
            let mut seconds: Vec<f64> = runs.iter().map(|run| run.total_s).collect();
            seconds.sort_by(f64::total_cmp);
            places.push(Place {
                setting: row.setting.clone(),
                is_paper: row.method == "paper",
                quality: row.quality.clone(),
                runs: runs.len(),
                seconds: 0.5 * (seconds[(seconds.len() - 1) / 2] + seconds[seconds.len() / 2]),
                peak_mb: mean(&|run| run.peak_mb),
                errors: [
                    mean(&|run| run.error_raw),
                    mean(&|run| run.error_one_scale),
                    mean(&|run| run.held_out.blocks_relative_rms),
                    mean(&|run| run.held_out.photograph_relative_rms),
                    mean(&|run| run.held_out.photograph_hdr_flip),
                ],
            });
        }
    }
    places
}

/// The settings that ran on every capture, by geometric means: of seconds over all of them, of
/// each error over those that have it.
pub fn over_all(captures: &[Vec<Place>]) -> Vec<Place> {
    let Some((first, others)) = captures.split_first() else { return Vec::new() };
    let mean = |values: &[f64]| {
        let logs = values.iter().filter(|value| **value > 0.0).map(|value| value.ln());
        (!values.is_empty()).then(|| (logs.sum::<f64>() / values.len() as f64).exp())
    };
    let whole = |place: &Place| -> Option<Place> {
        let mut same = vec![place];
        for other in others {
            same.push(other.iter().find(|other| other.setting == place.setting)?);
        }
        let of = |value: &dyn Fn(&Place) -> Option<f64>| -> Vec<f64> {
            same.iter().filter_map(|place| value(place)).collect()
        };
        Some(Place {
            seconds: mean(&of(&|place| Some(place.seconds)))?,
            peak_mb: mean(&of(&|place| place.peak_mb)),
            errors: std::array::from_fn(|measure| mean(&of(&|place| place.errors[measure]))),
            runs: same.iter().map(|place| place.runs).sum(),
            ..place.clone()
        })
    };
    first.iter().filter_map(whole).collect()
}

/// Writes the tables and charts of what has been run into the folder.
pub fn collect(folder: &Path, plan: &[Run]) -> Result<Vec<String>, io::Error> {
    write(folder, &runs::collect(folder, plan), plan.len())
}

/// Writes `speed.csv`, `speed.json`, `front.csv` and the charts, and tells the fronts.
pub fn write(folder: &Path, rows: &[Row], planned: usize) -> Result<Vec<String>, io::Error> {
    let mut told = vec![format!("{} of {planned} runs are done", rows.len())];
    records::write(&folder.join("speed.json"), &rows)?;
    records::write_csv(
        &folder.join("speed.csv"),
        &COLUMNS,
        &rows.iter().map(cells).collect::<Vec<_>>(),
    )?;
    for row in rows {
        if let Some(failure) = &row.failure {
            told.push(format!("{}, {}: {failure}", row.capture, row.setting));
        }
    }
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.capture.as_str()) {
            names.push(&row.capture);
        }
    }
    let captures: Vec<Vec<Place>> = names
        .iter()
        .map(|name| places(&rows.iter().filter(|row| row.capture == *name).collect::<Vec<_>>()))
        .collect();
    let threads = rows.first().map_or(1, |row| row.threads);
    let mut fronts = Vec::new();
    let mut charted: Vec<(String, Vec<Place>)> =
        names.iter().map(|name| (*name).to_owned()).zip(captures.iter().cloned()).collect();
    if captures.len() > 1 {
        charted.push((format!("all {} captures", names.len()), over_all(&captures)));
    }
    for (name, places) in &charted {
        let file = if name.starts_with("all ") { "all" } else { name };
        drawing::write(folder, file, &speed_chart::chart(name, places, threads))?;
        for (measure, (column, ..)) in MEASURES.iter().enumerate() {
            for place in speed_chart::front_of(places, measure) {
                fronts.push(vec![
                    name.clone(),
                    (*column).to_owned(),
                    place.setting.clone(),
                    cell(Some(place.seconds)),
                    cell(place.errors[measure]),
                    cell(place.peak_mb),
                ]);
            }
        }
        told.extend(speed_chart::verdicts(name, places));
    }
    let columns = ["capture", "measure", "setting", "seconds", "error", "peak_mb"];
    records::write_csv(&folder.join("front.csv"), &columns, &fronts)?;
    told.push(format!(
        "{:24}{:24}{:32}{:>9}{:>10}",
        "capture", "measure", "front", "seconds", "error"
    ));
    for front in fronts.iter().filter(|front| !front[1].starts_with("photograph")) {
        let short = |text: &str| text.parse::<f64>().map_or(String::new(), |v| format!("{v:.4}"));
        told.push(format!(
            "{:24}{:24}{:32}{:>9}{:>10}",
            front[0],
            front[1],
            front[2],
            short(&front[3]),
            short(&front[4])
        ));
    }
    Ok(told)
}

const COLUMNS: [&str; 26] = [
    "capture",
    "setting",
    "method",
    "quality",
    "repeat",
    "seed",
    "threads",
    "samples",
    "lobes",
    "samples_s",
    "lights_s",
    "transport_s",
    "solve_s",
    "textures_s",
    "total_s",
    "peak_mb",
    "error_raw",
    "error_one_scale",
    "error_channel_scales",
    "half_width",
    "blocks_relative_rms",
    "photograph_relative_rms",
    "photograph_flip",
    "photograph_hdr_flip",
    "failure",
    "version",
];

fn cells(row: &Row) -> Vec<String> {
    let m = &row.measured;
    let number = |value: f64| cell(Some(value));
    let Measured { held_out, .. } = m;
    vec![
        row.capture.clone(),
        row.setting.clone(),
        row.method.clone(),
        row.quality.clone().unwrap_or_default(),
        row.repeat.to_string(),
        row.seed.to_string(),
        row.threads.to_string(),
        m.samples.to_string(),
        m.lobes.to_string(),
        number(m.samples_s),
        number(m.lights_s),
        number(m.transport_s),
        number(m.solve_s),
        number(m.textures_s),
        number(m.total_s),
        cell(m.peak_mb),
        cell(m.error_raw),
        cell(m.error_one_scale),
        cell(m.error_channel_scales),
        cell(m.half_width),
        cell(held_out.blocks_relative_rms),
        cell(held_out.photograph_relative_rms),
        cell(held_out.photograph_flip),
        cell(held_out.photograph_hdr_flip),
        row.failure.clone().unwrap_or_default(),
        env!("CARGO_PKG_VERSION").to_owned(),
    ]
}

/// Whether a place is one of the qualities.
pub fn quality_of(place: &Place) -> Option<Quality> {
    place.quality.as_deref().and_then(|name| Quality::parse(name).ok())
}
