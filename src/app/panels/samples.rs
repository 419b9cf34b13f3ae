//! The table of samples.

use std::sync::Arc;

use eframe::egui;

use super::context::Context;
use super::numbers::{count, empty, fixed, outdated, rgb, short, swatch};
use super::table::{Head, Rows, TableState, head, table_ui};
use crate::app::actions::{Action, Select};

const HEADS: [Head; 9] = [
    head("#", 44.0, "The sample's number"),
    head("Material", 84.0, "The material of the surface it lies on"),
    head("x (m)", 50.0, "Position along x, in metres"),
    head("y (m)", 50.0, "Position along y, in metres"),
    head("z (m)", 50.0, "Position along z, in metres"),
    head("Views", 46.0, "Photographs that show it"),
    head("Error (ln)", 66.0, "Mean over the channels of ln(computed / measured)"),
    head("Measured R / G / B", 138.0, "Measured radiance, in the photographs' unit"),
    head("Computed R / G / B", 138.0, "Computed radiance, in the photographs' unit"),
];

pub type State = TableState;

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, actions, .. } = context;
    let Some(cloud) = &project.products.samples else {
        empty(ui, "Samples are placed by the first stage of a run.");
        return;
    };
    let samples = &cloud.samples;
    let derived = project.products.derived.as_deref().filter(|d| d.samples.len() == samples.len());
    ui.horizontal(|ui| {
        ui.label(format!("{} samples, {:.3} m apart", count(samples.len()), cloud.spacing_m));
        outdated(ui, project);
        if derived.is_none() {
            ui.weak("Errors come with the solution.");
        }
    });
    let materials = &project.result_capture().materials;
    let name = |index: usize| {
        materials.get(samples[index].material).map_or("", |material| material.name.as_str())
    };
    let mean = |rgb: [f64; 3]| rgb.iter().sum::<f64>();
    let measured = |index: usize| match derived {
        Some(derived) => derived.samples[index].observed,
        None => samples[index].radiance.map(f64::from),
    };
    let compare = |column: usize, a: usize, b: usize| {
        let by = |value: &dyn Fn(usize) -> f64| value(a).total_cmp(&value(b));
        let position = |axis: usize| by(&|index| f64::from(samples[index].position[axis]));
        let of_derived =
            |value: &dyn Fn(usize) -> f64| if derived.is_some() { by(value) } else { a.cmp(&b) };
        let error = |index: usize| derived.map_or(0.0, |d| d.samples[index].log_error.abs());
        let computed = |index: usize| derived.map_or(0.0, |d| mean(d.samples[index].computed));
        match column {
            1 => name(a).cmp(name(b)),
            2..=4 => position(column - 2),
            5 => samples[a].views.len().cmp(&samples[b].views.len()),
            6 => of_derived(&error),
            7 => by(&|index| mean(measured(index))),
            8 => of_derived(&computed),
            _ => a.cmp(&b),
        }
    };
    let identity =
        Arc::as_ptr(cloud) as usize ^ derived.map_or(0, |d| std::ptr::from_ref(d) as usize);
    let rows = Rows {
        identity,
        count: samples.len(),
        selected: project.selection.sample,
        compare: &compare,
    };
    let colors = project.result_colors();
    let clicked = table_ui(ui, "samples", state, &HEADS, &rows, |ui, index, column| {
        let sample = &samples[index];
        match column {
            0 => {
                ui.label(index.to_string());
            }
            1 => {
                swatch(ui, colors.of(sample.material));
                ui.label(name(index));
            }
            2..=4 => {
                ui.label(fixed(sample.position[column - 2], 3));
            }
            5 => {
                ui.label(sample.views.len().to_string());
            }
            7 => {
                ui.label(rgb(measured(index)));
            }
            _ => {
                let text = derived.map_or_else(String::new, |derived| {
                    let numbers = &derived.samples[index];
                    if column == 6 { short(numbers.log_error) } else { rgb(numbers.computed) }
                });
                ui.label(text);
            }
        }
    });
    if let Some(sample) = clicked {
        actions.push(Action::Select(Select::Sample(sample)));
    }
}
