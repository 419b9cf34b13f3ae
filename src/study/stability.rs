//! The study of stability: how far each method's reflectances go wrong as a capture gets worse.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::io::export::summary;
use crate::io::records::cell;
use crate::io::{self, atomic, drawing, records};
use crate::reconstruct::{self, Method, Options, Quality};
use crate::scene::Capture;
use crate::study::degrade::{Degraded, degrade};
use crate::study::harm::Harm;
use crate::study::reference::References;
use crate::study::runs::{self, Choice, Planned, Tell};
use crate::study::{Source, described, guarded, report, stability_chart};
use crate::watch::Watch;

/// A method, with or without what makes it bear bad input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    Joint,
    /// Without the loss that makes outliers count less and the rejection of pixels beside edges.
    Bare,
    Paper,
}

impl Way {
    pub const ALL: [Self; 3] = [Self::Joint, Self::Bare, Self::Paper];

    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Bare => "joint without its remedies",
            Self::Paper => "paper",
        }
    }

    /// The method upon what else is set.
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

/// What is made worse, how far, and what is run on it.
#[derive(Clone, Debug)]
pub struct Design {
    pub source: Source,
    /// What the ways are set upon.
    pub base: Options,
    /// Every harm with its steps.
    pub harms: Vec<(Harm, Vec<f64>)>,
    pub ways: Vec<Way>,
    pub seeds: usize,
}

impl Design {
    /// All harms by all ways; the quick study takes every second step, at the quality `draft`.
    pub fn of_all(source: Source, quick: bool, seeds: usize) -> Self {
        let every = if quick { 2 } else { 1 };
        let steps = |harm: Harm| harm.levels().iter().copied().step_by(every).collect();
        Self {
            source,
            base: Options::of_quality(if quick { Quality::Draft } else { Quality::Standard }),
            harms: Harm::ALL.into_iter().map(|harm| (harm, steps(harm))).collect(),
            ways: Way::ALL.to_vec(),
            seeds,
        }
    }
}

/// One method on a capture with one thing wrong.
#[derive(Clone, Debug)]
pub struct Run {
    capture: String,
    /// `None` for the capture as it is.
    harm: Option<(Harm, f64)>,
    way: Way,
    seed: usize,
    pub options: Options,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub capture: String,
    /// Empty for the capture as it is.
    pub harm: String,
    pub level: f64,
    pub way: String,
    pub seed: usize,
    /// Mean absolute error of the diffuse reflectances: against the truth, or without one what is
    /// to be expected of the capture as it is and what the harm adds.
    pub error: Option<f64>,
    /// After the one factor that fits best.
    pub error_one_scale: Option<f64>,
    pub seconds: f64,
    /// Whether every number of the result is finite.
    pub finite: bool,
    pub failure: Option<String>,
}

impl Planned for Run {
    type Row = Row;

    fn name(&self) -> String {
        let harm = match self.harm {
            Some((harm, level)) => format!("{} {level}", harm.title()),
            None => "as it is".to_owned(),
        };
        format!("{harm} · {} · {}", self.way.name(), self.seed)
    }

    fn key(&self) -> String {
        format!("{} {:?} {}", self.capture, self.harm, described(&self.options))
    }
}

/// Every run: the capture as it is, then every harm by its steps; each by every way and seed.
pub fn plan(design: &Design) -> Vec<Run> {
    let steps = |(harm, levels): &(Harm, Vec<f64>)| -> Vec<Option<(Harm, f64)>> {
        levels.iter().map(|&level| Some((*harm, level))).collect()
    };
    let harms = std::iter::once(None).chain(design.harms.iter().flat_map(steps));
    let capture = design.source.name();
    let run = |harm, way: Way, seed| Run {
        capture: capture.clone(),
        harm,
        way,
        seed,
        options: way.options(&design.base, seed),
    };
    harms
        .flat_map(|harm| design.ways.iter().map(move |&way| (harm, way)))
        .flat_map(|(harm, way)| (1..=design.seeds).map(move |seed| (harm, way, seed)))
        .map(|(harm, way, seed)| run(harm, way, seed))
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
        let reference = references.of(run.way);
        let mut row = Row {
            capture: capture.name.clone(),
            harm: run.harm.map_or_else(String::new, |(harm, _)| harm.title().to_owned()),
            level: run.harm.map_or(0.0, |(_, level)| level),
            way: run.way.name().to_owned(),
            seed: run.seed,
            ..Row::default()
        };
        let outcome = guarded(|| {
            let options = &run.options;
            let worse = match run.harm {
                Some((harm, level)) => {
                    degrade(&capture, options, harm, level, run.seed as u64, watch)?
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

/// How a way did under one harm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Course {
    pub harm: &'static str,
    pub way: &'static str,
    /// Median error on the capture as it is.
    pub clean: Option<f64>,
    /// Per step: its level, lowest, median and highest error over the seeds.
    pub steps: Vec<(f64, Option<[f64; 3]>)>,
    /// The first level whose error is over twice the clean one.
    pub breaks_at: Option<f64>,
}

/// An error this much larger than on the capture as it is means that a method has broken.
pub const BREAKS: f64 = 2.0;

/// Lowest, median and highest error of the rows of one way, harm and level.
fn spread(rows: &[Row], harm: &str, way: Way, level: f64) -> Option<[f64; 3]> {
    let mut errors: Vec<f64> = rows
        .iter()
        .filter(|row| row.harm == harm && row.way == way.name() && row.level == level)
        .filter_map(|row| row.error)
        .collect();
    errors.sort_by(f64::total_cmp);
    let (low, high) = (*errors.first()?, *errors.last()?);
    Some([low, 0.5 * (errors[(errors.len() - 1) / 2] + errors[errors.len() / 2]), high])
}

/// The course of every harm and way that was run.
pub fn courses(rows: &[Row]) -> Vec<(Harm, Way, Course)> {
    let mut courses = Vec::new();
    for harm in Harm::ALL {
        for way in Way::ALL {
            let clean = spread(rows, "", way, 0.0);
            // What was not run yet has not broken.
            let was_run = |row: &&Row| row.harm == harm.title() && row.way == way.name();
            let mut levels: Vec<f64> = rows.iter().filter(was_run).map(|row| row.level).collect();
            levels.sort_by(f64::total_cmp);
            levels.dedup();
            let steps: Vec<(f64, Option<[f64; 3]>)> = levels
                .into_iter()
                .map(|level| (level, spread(rows, harm.title(), way, level)))
                .collect();
            let has_broken = |step: &&(f64, Option<[f64; 3]>)| match (step.1, clean) {
                (Some([_, median, _]), Some([_, clean, _])) => median > BREAKS * clean,
                (None, _) => true,
                _ => false,
            };
            let course = Course {
                harm: harm.title(),
                way: way.name(),
                clean: clean.map(|[_, median, _]| median),
                breaks_at: steps.iter().find(has_broken).map(|(level, _)| *level),
                steps,
            };
            if !course.steps.is_empty() {
                courses.push((harm, way, course));
            }
        }
    }
    courses
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
            row.harm.clone(),
            row.level.to_string(),
            row.way.clone(),
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
    let courses = courses(rows);
    let breaks: Vec<_> = courses
        .iter()
        .map(|(_, _, course)| {
            vec![
                course.harm.to_owned(),
                course.way.to_owned(),
                cell(course.clean),
                cell(course.breaks_at),
                cell(course.steps.last().and_then(|(_, errors)| errors.map(|[_, m, _]| m))),
            ]
        })
        .collect();
    let columns = ["harm", "way", "clean_error", "breaks_at", "error_at_the_last_step"];
    records::write_csv(&folder.join("breaks.csv"), &columns, &breaks)?;
    drawing::write(folder, "stability", &stability_chart::chart(capture, &courses))?;
    let page = report::page(capture, rows, &courses);
    atomic::write_bytes(&folder.join("report.html"), page.as_bytes())?;

    let mut told = vec![format!("{} of {planned} runs are done", rows.len())];
    told.push(report::soundness(rows));
    told.push(format!(
        "{:30}{:>16}{:>28}{:>16}",
        "breaks at", "joint", "without its remedies", "paper"
    ));
    for of_harm in courses.chunk_by(|a, b| a.0 == b.0) {
        let at = |way: Way| {
            let found = of_harm.iter().find(|(_, w, _)| *w == way);
            found
                .and_then(|(_, _, c)| c.breaks_at)
                .map_or("-".to_owned(), |level| level.to_string())
        };
        let [joint, bare, paper] = Way::ALL.map(at);
        told.push(format!("{:30}{joint:>16}{bare:>28}{paper:>16}", of_harm[0].2.harm));
    }
    Ok(told)
}
