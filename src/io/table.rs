//! The tables of a solution as CSV: `samples.csv` and `convergence.csv`.
//!
//! Numbers are written in the shortest form that reads back as the same number; one that is not
//! finite leaves its cell empty.

use std::io::Write;
use std::path::Path;

use super::{Error, atomic};
use crate::math::rgb::{CHANNELS, Rgb};

/// A sample: where it is, what was seen there and what the solution says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleRow {
    /// In metres.
    pub position: [f64; 3],
    pub normal: [f64; 3],
    pub material: String,
    /// The number of photographs that see it.
    pub views: usize,
    pub observed: Rgb,
    pub computed: Rgb,
    pub relative_error: Rgb,
    /// The part of the computed radiance that comes from photographed surfaces.
    pub photographed: Rgb,
    /// The part that comes from virtual lights.
    pub virtual_lights: Rgb,
    pub weight: f64,
}

/// An iteration of the refinement.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ConvergenceRow {
    pub iteration: usize,
    pub rms: Rgb,
    pub relative_rms: Rgb,
    /// What the method minimises; cells are empty where it has no such number.
    pub objective: Option<Rgb>,
    /// Of any reflectance since the iteration before.
    pub largest_change: f64,
    /// Since the start of the refinement.
    pub elapsed_secs: f64,
}

const SAMPLE_COLUMNS: &str = "x_m,y_m,z_m,nx,ny,nz,material,views,observed_r,observed_g,\
    observed_b,computed_r,computed_g,computed_b,relative_error_r,relative_error_g,\
    relative_error_b,photographed_r,photographed_g,photographed_b,virtual_r,virtual_g,virtual_b,\
    weight";
// The time comes last: without it, the table is the same for every run.
const CONVERGENCE_COLUMNS: &str = "iteration,rms_r,rms_g,rms_b,relative_rms_r,relative_rms_g,\
    relative_rms_b,objective_r,objective_g,objective_b,largest_change,elapsed_s";

pub fn write_samples(file: &Path, rows: &[SampleRow]) -> Result<(), Error> {
    atomic::write(file, |out| {
        writeln!(out, "{SAMPLE_COLUMNS}")?;
        for row in rows {
            let place = numbers(row.position.iter().chain(&row.normal));
            let radiance = [
                row.observed,
                row.computed,
                row.relative_error,
                row.photographed,
                row.virtual_lights,
            ];
            let radiance = numbers(radiance.iter().flatten().chain([&row.weight]));
            writeln!(out, "{place},{},{},{radiance}", quoted(&row.material), row.views)?;
        }
        Ok(())
    })
}

pub fn write_convergence(file: &Path, rows: &[ConvergenceRow]) -> Result<(), Error> {
    atomic::write(file, |out| {
        writeln!(out, "{CONVERGENCE_COLUMNS}")?;
        for row in rows {
            let objective = row.objective.unwrap_or([f64::NAN; CHANNELS]);
            let errors = row.rms.iter().chain(&row.relative_rms).chain(&objective);
            let cells = errors.chain([&row.largest_change, &row.elapsed_secs]);
            writeln!(out, "{},{}", row.iteration, numbers(cells))?;
        }
        Ok(())
    })
}

fn numbers<'a>(values: impl Iterator<Item = &'a f64>) -> String {
    let cell = |value: &f64| if value.is_finite() { value.to_string() } else { String::new() };
    values.map(cell).collect::<Vec<_>>().join(",")
}

/// A cell as RFC 4180 wants it.
pub(super) fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
