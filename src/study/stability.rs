//! The study of stability: how far each method's reflectances go wrong as a capture gets worse.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::io::export::summary;
use crate::io::records::cell;
use crate::io::solution::Solution;
use crate::io::truth::Truth;
use crate::io::{self, atomic, drawing, records};
use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::{self, Method, Options, Quality};
use crate::scene::Capture;
use crate::study::degrade::{Degraded, Harm, degrade};
use crate::study::runs::{self, Choice, Planned};
use crate::study::{described, guarded, report, stability_chart};
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

    fn options(self, quality: Quality, seed: usize) -> Options {
        let mut options = Options::of_quality(quality);
        options.general.seed = seed;
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

/// One method on a capture with one thing wrong.
pub struct Run {
    capture: PathBuf,
    /// `None` for the capture as it is.
    harm: Option<(Harm, f64)>,
    way: Way,
    seed: usize,
    quality: Quality,
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
        let (capture, harm) = (io::capture::name(&self.capture), self.harm);
        format!("{capture} {harm:?} {}", described(&self.way.options(self.quality, self.seed)))
    }
}

/// Every run: the capture as it is, then every harm by its steps; each by every way and seed.
pub fn plan(capture: &Path, quick: bool, seeds: usize) -> Vec<Run> {
    let steps = |harm: Harm| {
        let every = if quick { 2 } else { 1 };
        harm.levels().iter().step_by(every).map(move |&level| Some((harm, level)))
    };
    let harms = std::iter::once(None).chain(Harm::ALL.into_iter().flat_map(steps));
    let quality = if quick { Quality::Draft } else { Quality::Standard };
    harms
        .flat_map(|harm| {
            Way::ALL.into_iter().flat_map(move |way| {
                (1..=seeds).map(move |seed| Run {
                    capture: capture.to_owned(),
                    harm,
                    way,
                    seed,
                    quality,
                })
            })
        })
        .collect()
}

/// What results are held against.
struct Reference {
    /// Name of the true material, and its reflectance, of each surface that is known.
    surfaces: Vec<(String, String, Rgb)>,
    /// Error that the reference itself is expected to have.
    own_error: f64,
}

/// Carries out the runs of a plan that `choice` names.
pub fn carry_out(
    folder: &Path,
    plan: &[Run],
    choice: &Choice,
    watch: &Watch,
    say: &(dyn Fn(String) + Sync),
) -> Result<(), io::Error> {
    let Some(first) = plan.first() else { return Ok(()) };
    let capture = io::capture::load(&first.capture, watch)?;
    let truth = Truth::beside(&first.capture)?;
    let quality = first.quality;
    // Before the runs, which wait for nothing but their own loops.
    let reference = |way: Way| match &truth {
        Some(truth) => Ok(Ok(true_reference(&capture, truth))),
        None => guarded(|| own_reference(&capture, way, quality, watch)),
    };
    let references = Way::ALL.into_iter().map(reference).collect::<Result<Vec<_>, io::Error>>()?;
    let perform = |run: &Run, watch: &Watch| {
        let reference = &references[run.way as usize];
        let mut row = Row {
            capture: capture.name.clone(),
            harm: run.harm.map_or_else(String::new, |(harm, _)| harm.title().to_owned()),
            level: run.harm.map_or(0.0, |(_, level)| level),
            way: run.way.name().to_owned(),
            seed: run.seed,
            ..Row::default()
        };
        let outcome = guarded(|| {
            let options = run.way.options(quality, run.seed);
            let worse = match run.harm {
                Some((harm, level)) => {
                    degrade(&capture, &options, harm, level, run.seed as u64, watch)?
                }
                None => Degraded { capture: capture.clone(), options, cut: Vec::new() },
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
            (_, Err(failure)) => row.failure = Some(failure.clone()),
        }
        Ok(row)
    };
    runs::carry_out(folder, plan, choice, watch, &perform, say)
}

fn true_reference(capture: &Capture, truth: &Truth) -> Reference {
    let surfaces = capture.surfaces.iter().filter_map(|surface| {
        let (name, material) = truth.of_surface(&surface.name)?;
        Some((surface.name.clone(), name.to_owned(), material.rho_d))
    });
    Reference { surfaces: surfaces.collect(), own_error: 0.0 }
}

/// Mean absolute over half the width of a 95 % interval of the normal distribution.
const ERROR_PER_HALF_WIDTH: f64 = 0.798 / 1.96;

/// Without a truth: the way's own result on the capture as it is. Its error is taken to be what
/// the intervals of the joint method promise, and what it differs from that method's result.
fn own_reference(
    capture: &Capture,
    way: Way,
    quality: Quality,
    watch: &Watch,
) -> Result<Reference, reconstruct::Error> {
    let solve = |options: &Options| -> Result<Solution, reconstruct::Error> {
        let whole = reconstruct::run(capture, options, watch, &|_| ())?;
        Ok(summary(capture, options, &whole, 0.0))
    };
    let careful = solve(&Options::of_quality(Quality::Standard))?;
    let own = solve(&way.options(quality, 1))?;
    let widths: Vec<f64> = careful
        .materials
        .iter()
        .filter_map(|material| material.diffuse_interval)
        .flatten()
        .flatten()
        .map(|[low, high]| 0.5 * (high - low))
        .collect();
    let mean = widths.iter().sum::<f64>() / widths.len().max(1) as f64;
    let differs = Reference::of(&careful).errors(&own, &[]).map_or(0.0, |[raw, _]| raw);
    Ok(Reference { own_error: ERROR_PER_HALF_WIDTH * mean + differs, ..Reference::of(&own) })
}

impl Reference {
    fn of(solution: &Solution) -> Self {
        let surfaces = solution.materials.iter().flat_map(|material| {
            let diffuse = material.diffuse.filter(|_| material.samples > 0);
            material
                .surfaces
                .iter()
                .filter_map(move |surface| Some((surface.clone(), material.name.clone(), diffuse?)))
        });
        Self { surfaces: surfaces.collect(), own_error: 0.0 }
    }

    /// Mean absolute error over pairs of an estimated and a true material that share a surface,
    /// raw and after one scale. `cut` names new surfaces with the ones they were part of.
    fn errors(&self, solution: &Solution, cut: &[(String, String)]) -> Option<[f64; 2]> {
        let mut pairs: Vec<(usize, &str, Rgb, Rgb)> = Vec::new();
        for (index, material) in solution.materials.iter().enumerate() {
            let Some(diffuse) = material.diffuse.filter(|_| material.samples > 0) else {
                continue;
            };
            for surface in &material.surfaces {
                let old = cut.iter().find(|(new, _)| new == surface).map_or(surface, |(_, o)| o);
                let Some((_, name, truth)) = self.surfaces.iter().find(|(s, ..)| s == old) else {
                    continue;
                };
                if !pairs.iter().any(|(i, n, ..)| (*i, *n) == (index, name.as_str())) {
                    pairs.push((index, name, diffuse, *truth));
                }
            }
        }
        let values =
            || pairs.iter().flat_map(|(_, _, e, t)| (0..CHANNELS).map(move |c| (e[c], t[c])));
        let count = values().count();
        let logs: Vec<f64> =
            values().filter(|(e, t)| *e > 0.0 && *t > 0.0).map(|(e, t)| (t / e).ln()).collect();
        let scale = (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp();
        let mean = |scale: f64| {
            let sum: f64 = values().map(|(e, t)| (scale * e - t).abs()).sum();
            self.own_error + sum / count as f64
        };
        (count > 0).then(|| [mean(1.0), mean(scale)])
    }
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
            let was_run = |level: f64| {
                rows.iter().any(|row| {
                    row.harm == harm.title() && row.way == way.name() && row.level == level
                })
            };
            let levels = harm.levels().iter().copied().filter(|&level| was_run(level));
            let steps: Vec<(f64, Option<[f64; 3]>)> =
                levels.map(|level| (level, spread(rows, harm.title(), way, level))).collect();
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

/// Writes `stability.csv`, `stability.json`, `breaks.csv`, the chart and the report.
pub fn collect(folder: &Path, plan: &[Run]) -> Result<Vec<String>, io::Error> {
    let rows = runs::collect(folder, plan);
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
    let courses = courses(&rows);
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
    let capture = plan.first().map_or_else(String::new, |run| io::capture::name(&run.capture));
    drawing::write(folder, "stability", &stability_chart::chart(&capture, &courses))?;
    let page = report::page(&capture, &rows, &courses);
    atomic::write_bytes(&folder.join("report.html"), page.as_bytes())?;

    let mut told = vec![format!("{} of {} runs are done", rows.len(), plan.len())];
    told.push(report::soundness(&rows));
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
