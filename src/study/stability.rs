//! The study of stability: error of the reflectances of each method as a capture is degraded.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::io::export::summary;
use crate::io::records::cell;
use crate::io::{self, atomic, drawing, records};
use crate::reconstruct::{self, Method, Options, Quality};
use crate::scene::Capture;
use crate::study::degradation::Degradation;
use crate::study::degrade::{Degraded, degrade};
use crate::study::reference::References;
use crate::study::runs::{self, Choice, Planned, Tell};
use crate::study::{Source, described, guarded, report, stability_chart};
use crate::watch::Watch;

/// A variant of the solve whose stability is compared: a method, with or without its robust parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// The joint solve as it is.
    Joint,
    /// Without the loss that makes outliers count less and the rejection of pixels beside edges.
    Bare,
    /// The published method.
    Paper,
}

impl Variant {
    /// All of them, in the order of tables and charts.
    pub const ALL: [Self; 3] = [Self::Joint, Self::Bare, Self::Paper];

    /// The name, in tables and charts.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Bare => "joint without its remedies",
            Self::Paper => "paper",
        }
    }

    /// The options of a run: `base` with the method and the seed set.
    pub fn options(self, base: &Options, seed: usize) -> Options {
        let mut options = base.clone();
        options.general.seed = seed;
        options.general.method = Method::Joint;
        match self {
            Self::Joint => {}
            Self::Bare => {
                options.joint.robust = 0.0;
                options.samples.reject_edges = false;
            }
            Self::Paper => options.general.method = Method::Paper,
        }
        options
    }
}

/// The design of a study: the degradations with their levels, and the variants to run on each.
#[derive(Clone, Debug)]
pub struct Design {
    /// The capture.
    pub source: Source,
    /// Options that all runs share.
    pub base: Options,
    /// Each degradation with its levels.
    pub degradations: Vec<(Degradation, Vec<f64>)>,
    /// What is run on every degradation.
    pub variants: Vec<Variant>,
    /// Runs of each, with seeds from 1.
    pub seeds: usize,
}

impl Design {
    /// All degradations and variants; the quick study takes every second level, at the quality
    /// `draft`.
    pub fn of_all(source: Source, quick: bool, seeds: usize) -> Self {
        let every = if quick { 2 } else { 1 };
        let steps = |degradation: Degradation| {
            degradation.levels().iter().copied().step_by(every).collect()
        };
        Self {
            source,
            base: Options::of_quality(if quick { Quality::Draft } else { Quality::Standard }),
            degradations: Degradation::ALL
                .into_iter()
                .map(|degradation| (degradation, steps(degradation)))
                .collect(),
            variants: Variant::ALL.to_vec(),
            seeds,
        }
    }
}

/// One variant on a capture with one degradation.
#[derive(Clone, Debug)]
pub struct Run {
    capture: String,
    /// `None` for the capture as it is.
    degradation: Option<(Degradation, f64)>,
    variant: Variant,
    seed: usize,
    /// Those of the variant, before they are degraded.
    pub options: Options,
}

/// The result of a run, a line of the table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Its name.
    pub capture: String,
    /// Title of the degradation; empty for the capture as it is.
    #[serde(rename = "harm")]
    pub degradation: String,
    /// In the unit of the degradation; 0 for the capture as it is.
    pub level: f64,
    /// Name of the variant.
    #[serde(rename = "way")]
    pub variant: String,
    /// The seed of the run.
    pub seed: usize,
    /// Mean absolute error of the diffuse reflectances: against the truth, or without one what is
    /// to be expected of the capture as it is and what the degradation adds.
    pub error: Option<f64>,
    /// The same after the one factor on all reflectances that makes it least.
    pub error_one_scale: Option<f64>,
    /// Of all stages.
    pub seconds: f64,
    /// Whether every number of the result is finite.
    pub finite: bool,
    /// Why there is no error.
    pub failure: Option<String>,
}

impl Planned for Run {
    type Row = Row;

    fn name(&self) -> String {
        let degradation = match self.degradation {
            Some((degradation, level)) => format!("{} {level}", degradation.title()),
            None => "as it is".to_owned(),
        };
        format!("{degradation} · {} · {}", self.variant.name(), self.seed)
    }

    fn key(&self) -> String {
        format!("{} {:?} {}", self.capture, self.degradation, described(&self.options))
    }
}

/// Every run: the capture as it is, then every degradation by its levels; each with every variant
/// and seed.
pub fn plan(design: &Design) -> Vec<Run> {
    let steps =
        |(degradation, levels): &(Degradation, Vec<f64>)| -> Vec<Option<(Degradation, f64)>> {
            levels.iter().map(|&level| Some((*degradation, level))).collect()
        };
    let degradations = std::iter::once(None).chain(design.degradations.iter().flat_map(steps));
    let capture = design.source.name();
    let run = |degradation, variant: Variant, seed| Run {
        capture: capture.clone(),
        degradation,
        variant,
        seed,
        options: variant.options(&design.base, seed),
    };
    degradations
        .flat_map(|degradation| design.variants.iter().map(move |&variant| (degradation, variant)))
        .flat_map(|(degradation, variant)| {
            (1..=design.seeds).map(move |seed| (degradation, variant, seed))
        })
        .map(|(degradation, variant, seed)| run(degradation, variant, seed))
        .collect()
}

/// Carries out the runs of a design's plan that `choice` names.
pub fn carry_out(
    folder: Option<&Path>,
    design: &Design,
    plan: &[Run],
    choice: &Choice,
    watch: &Watch,
    tell: &Tell<Run>,
) -> Result<(), io::Error> {
    let (capture, truth) = design.source.open(watch)?;
    // Before the runs, which wait for nothing but their own loops.
    let references = References::new(&capture, truth.as_deref(), design, watch)?;
    let perform = |run: &Run, watch: &Watch| {
        let reference = references.of(run.variant);
        let mut row = Row {
            capture: capture.name.clone(),
            degradation: run
                .degradation
                .map_or_else(String::new, |(degradation, _)| degradation.title().to_owned()),
            level: run.degradation.map_or(0.0, |(_, level)| level),
            variant: run.variant.name().to_owned(),
            seed: run.seed,
            ..Row::default()
        };
        let outcome = guarded(|| {
            let options = &run.options;
            let worse = match run.degradation {
                Some((degradation, level)) => {
                    degrade(&capture, options, degradation, level, run.seed as u64, watch)?
                }
                None => Degraded {
                    capture: Capture::clone(&capture),
                    options: options.clone(),
                    cut: Vec::new(),
                },
            };
            let whole = reconstruct::run(&worse.capture, &worse.options, watch, &|_| ())?;
            let solution = summary(&worse.capture, &worse.options, &whole, 0.0);
            Ok((solution, whole.solution.is_usable(), worse.cut))
        })?;
        match (outcome, reference) {
            (Ok((solution, finite, cut)), Ok(reference)) => {
                row.finite = finite;
                row.seconds = solution.seconds.total;
                let errors = reference.errors(&solution, &cut);
                row.error = errors.map(|[raw, _]| raw);
                row.error_one_scale = errors.map(|[_, scaled]| scaled);
                if errors.is_none() {
                    row.failure = Some("no material was estimated".to_owned());
                }
            }
            (Err(failure), _) => row.failure = Some(failure),
            (_, Err(failure)) => row.failure = Some(failure.to_owned()),
        }
        Ok(row)
    };
    runs::carry_out(folder, plan, choice, watch, &perform, tell)
}

/// Error against severity, of one variant under one degradation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DegradationCurve {
    /// Title of the degradation.
    #[serde(rename = "harm")]
    pub degradation: &'static str,
    /// Name of the variant.
    #[serde(rename = "way")]
    pub variant: &'static str,
    /// Median error on the capture as it is.
    pub clean: Option<f64>,
    /// Per step: its level, lowest, median and highest error over the seeds.
    pub steps: Vec<(f64, Option<[f64; 3]>)>,
    /// The first level whose error is over twice the clean one.
    pub breaks_at: Option<f64>,
}

/// A variant is said to break where its error is more than this many times that on the capture as
/// it is.
pub const BREAKS: f64 = 2.0;

/// Lowest, median and highest error of the rows of one variant, degradation and level.
fn spread(rows: &[Row], degradation: &str, variant: Variant, level: f64) -> Option<[f64; 3]> {
    let mut errors: Vec<f64> = rows
        .iter()
        .filter(|row| {
            row.degradation == degradation && row.variant == variant.name() && row.level == level
        })
        .filter_map(|row| row.error)
        .collect();
    errors.sort_by(f64::total_cmp);
    let (low, high) = (*errors.first()?, *errors.last()?);
    Some([low, 0.5 * (errors[(errors.len() - 1) / 2] + errors[errors.len() / 2]), high])
}

/// The curve of every degradation and variant that was run.
pub fn curves(rows: &[Row]) -> Vec<(Degradation, Variant, DegradationCurve)> {
    let mut curves = Vec::new();
    for degradation in Degradation::ALL {
        for variant in Variant::ALL {
            let clean = spread(rows, "", variant, 0.0);
            // What was not run yet has not broken.
            let was_run = |row: &&Row| {
                row.degradation == degradation.title() && row.variant == variant.name()
            };
            let mut levels: Vec<f64> = rows.iter().filter(was_run).map(|row| row.level).collect();
            levels.sort_by(f64::total_cmp);
            levels.dedup();
            let steps: Vec<(f64, Option<[f64; 3]>)> = levels
                .into_iter()
                .map(|level| (level, spread(rows, degradation.title(), variant, level)))
                .collect();
            let has_broken = |step: &&(f64, Option<[f64; 3]>)| match (step.1, clean) {
                (Some([_, median, _]), Some([_, clean, _])) => median > BREAKS * clean,
                (None, _) => true,
                _ => false,
            };
            let curve = DegradationCurve {
                degradation: degradation.title(),
                variant: variant.name(),
                clean: clean.map(|[_, median, _]| median),
                breaks_at: steps.iter().find(has_broken).map(|(level, _)| *level),
                steps,
            };
            if !curve.steps.is_empty() {
                curves.push((degradation, variant, curve));
            }
        }
    }
    curves
}

/// Writes the report, tables and charts of what has been run into the folder.
pub fn collect(folder: &Path, capture: &str, plan: &[Run]) -> Result<Vec<String>, io::Error> {
    write(folder, capture, &runs::collect(folder, plan), plan.len())
}

/// Writes `stability.csv`, `stability.json`, `breaks.csv`, the chart and the report.
pub fn write(
    folder: &Path,
    capture: &str,
    rows: &[Row],
    planned: usize,
) -> Result<Vec<String>, io::Error> {
    records::write(&folder.join("stability.json"), &rows)?;
    let columns = [
        "capture",
        "harm",
        "level",
        "way",
        "seed",
        "error",
        "error_one_scale",
        "seconds",
        "finite",
        "failure",
        "version",
    ];
    let cells = |row: &Row| {
        vec![
            row.capture.clone(),
            row.degradation.clone(),
            row.level.to_string(),
            row.variant.clone(),
            row.seed.to_string(),
            cell(row.error),
            cell(row.error_one_scale),
            cell(Some(row.seconds)),
            row.finite.to_string(),
            row.failure.clone().unwrap_or_default(),
            env!("CARGO_PKG_VERSION").to_owned(),
        ]
    };
    let table: Vec<_> = rows.iter().map(cells).collect();
    records::write_csv(&folder.join("stability.csv"), &columns, &table)?;
    let curves = curves(rows);
    let breaks: Vec<_> = curves
        .iter()
        .map(|(_, _, curve)| {
            vec![
                curve.degradation.to_owned(),
                curve.variant.to_owned(),
                cell(curve.clean),
                cell(curve.breaks_at),
                cell(curve.steps.last().and_then(|(_, errors)| errors.map(|[_, m, _]| m))),
            ]
        })
        .collect();
    let columns = ["harm", "way", "clean_error", "breaks_at", "error_at_the_last_step"];
    records::write_csv(&folder.join("breaks.csv"), &columns, &breaks)?;
    drawing::write(folder, "stability", &stability_chart::chart(capture, &curves))?;
    let page = report::page(capture, rows, &curves);
    atomic::write_bytes(&folder.join("report.html"), page.as_bytes())?;

    let mut told = vec![format!("{} of {planned} runs are done", rows.len())];
    told.push(report::soundness(rows));
    told.push(format!(
        "{:30}{:>16}{:>28}{:>16}",
        "breaks at", "joint", "without its remedies", "paper"
    ));
    for of_degradation in curves.chunk_by(|a, b| a.0 == b.0) {
        let at = |variant: Variant| {
            let found = of_degradation.iter().find(|(_, w, _)| *w == variant);
            found
                .and_then(|(_, _, c)| c.breaks_at)
                .map_or("-".to_owned(), |level| level.to_string())
        };
        let [joint, bare, paper] = Variant::ALL.map(at);
        told.push(format!(
            "{:30}{joint:>16}{bare:>28}{paper:>16}",
            of_degradation[0].2.degradation
        ));
    }
    Ok(told)
}
