//! Writes plots to files: as a table of their numbers, or as a drawing.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::actions::{PathRequest, PlotFile, Plotted};
use super::asking;
use super::derived::Derived;
use super::project::Project;
use super::state::State;
use crate::io::drawing::{Form, Ink, svg};
use crate::io::{atomic, export, table};
use crate::math::rgb::Rgb;
use crate::reconstruct::solution::Iteration;
use crate::study::chart::{self, Chart, Panel, Point, Scale, Series};

/// Writes a plot; a file that is there is replaced only when that was agreed to.
pub fn save(state: &mut State, plotted: Plotted, kind: PlotFile, path: PathBuf, replace: bool) {
    let path = if kind.is_end_of(&path) { path } else { path.with_added_extension(kind.end()) };
    if !replace {
        asking::ask_before_replacing(
            state,
            PathRequest::SavePlot(plotted, kind),
            path.clone(),
            path,
        );
        return;
    }
    let Some(project) = &state.project else { return };
    let told = format!("Writing the plot to {}", path.display());
    let Some(write) = writing(project, plotted, kind, path) else {
        state.messages.notice("There is nothing to plot yet.");
        return;
    };
    state.writer.send(write);
    state.messages.notice(told);
}

type Write = Box<dyn FnOnce() -> Result<(), String> + Send>;

fn writing(project: &Project, plotted: Plotted, kind: PlotFile, path: PathBuf) -> Option<Write> {
    let products = &project.products;
    let failed = |error: crate::io::Error| format!("The plot cannot be saved: {error}");
    Some(match (plotted, kind) {
        (Plotted::Convergence, _) if products.iterations.is_empty() => return None,
        (Plotted::Convergence, PlotFile::Csv) => {
            let rows = export::convergence_rows(&products.iterations);
            Box::new(move || table::write_convergence(&path, &rows).map_err(failed))
        }
        (Plotted::Convergence, PlotFile::Svg) => {
            let chart = convergence(&products.iterations);
            Box::new(move || write_chart(&path, &chart).map_err(failed))
        }
        (Plotted::SampleErrors, PlotFile::Csv) => {
            let (whole, (edit, capture)) = (products.whole.clone()?, products.of.clone()?);
            Box::new(move || {
                let rows = export::sample_rows(&capture, &edit.options, &whole);
                table::write_samples(&path, &rows).map_err(failed)
            })
        }
        (Plotted::SampleErrors, PlotFile::Svg) => {
            let derived = products.derived.clone()?;
            let materials = &project.result_capture().materials;
            let names = materials.iter().map(|material| material.name.clone()).collect();
            Box::new(move || write_chart(&path, &sample_errors(&derived, names)).map_err(failed))
        }
    })
}

fn write_chart(path: &Path, chart: &Chart) -> Result<(), crate::io::Error> {
    atomic::write_bytes(path, svg(&chart::draw(chart)).as_bytes())
}

/// The error against the iteration, a series for each channel.
fn convergence(iterations: &[Iteration]) -> Chart {
    let panel = |title: &str, y_label: &str, value: &dyn Fn(&Iteration) -> Rgb| {
        let series = ["red", "green", "blue"].into_iter().enumerate().map(|(channel, name)| {
            let points = iterations.iter().enumerate().map(|(x, iteration)| Point {
                x: x as f64,
                y: value(iteration)[channel],
                ..Point::default()
            });
            Series {
                name: name.to_owned(),
                ink: Ink::Series(channel),
                form: [Form::Circle, Form::Square, Form::Triangle][channel],
                filled: true,
                line: true,
                points: points.filter(|point| point.y > 0.0).collect(),
            }
        });
        Panel {
            title: title.to_owned(),
            x_label: "iteration".to_owned(),
            y_label: y_label.to_owned(),
            x: Scale::Steps(iterations.iter().map(|own| own.index.to_string()).collect()),
            series: series.collect(),
            front: Vec::new(),
        }
    };
    Chart {
        title: "Convergence".to_owned(),
        notes: vec!["Root mean square of computed minus measured radiance.".to_owned()],
        panels: vec![
            panel("Relative RMS", "%", &|own| own.rms.relative.map(|value| 100.0 * value)),
            panel("Absolute RMS", "radiance", &|own| own.rms.absolute),
        ],
        columns: 2,
        size: [420.0, 280.0],
    }
}

/// Points of a material that are drawn at most.
const DRAWN: usize = 600;

/// Computed over measured radiance of the samples, by material.
fn sample_errors(derived: &Arc<Derived>, names: Vec<String>) -> Chart {
    let series = derived.material_start.windows(2).enumerate().map(|(material, range)| {
        let count = (range[1] - range[0]).max(1);
        let step = count.div_ceil(DRAWN).max(1);
        let points = (range[0]..range[1]).step_by(step).map(|place| {
            let sample = &derived.samples[derived.by_material[place] as usize];
            let along = (place - range[0]) as f64 / count as f64 - 0.5;
            Point {
                x: material as f64 + 0.7 * along,
                y: sample.log_error.exp(),
                ..Point::default()
            }
        });
        Series {
            name: names.get(material).cloned().unwrap_or_default(),
            ink: Ink::Series(material),
            form: Form::Circle,
            filled: true,
            line: false,
            points: points.collect(),
        }
    });
    let series: Vec<Series> = series.filter(|own| !own.points.is_empty()).collect();
    let rms = format!("{:.4}", derived.log_rms);
    Chart {
        title: "Error of every sample".to_owned(),
        notes: vec![format!("Root mean square of the natural logarithm: {rms}.")],
        panels: vec![Panel {
            title: String::new(),
            x_label: "material".to_owned(),
            y_label: "computed / measured radiance".to_owned(),
            x: Scale::Steps(names),
            series,
            front: Vec::new(),
        }],
        columns: 1,
        size: [880.0, 360.0],
    }
}
