//! Computed over measured radiance of every sample (Fig. 14).

use std::sync::Arc;

use eframe::egui::{self, Color32};
use egui_plot::{HLine, Legend, Plot, PlotPoint, PlotPoints, Points, VLine};

use super::context::Context;
use super::numbers::{at_least, empty, outdated, short};
use crate::app::actions::{Action, PathRequest, PlotFile, Plotted, Select};
use crate::app::derived::Derived;

/// As many points a material are drawn at most; the worst are always among them.
const DRAWN: usize = 4000;
/// A click selects a point within so many pixels.
const REACH: f32 = 10.0;

pub struct State {
    before: bool,
    after: bool,
    /// Points of this run and of the one before.
    points: [Made; 2],
}

/// Points, and the numbers they were made of.
type Made = Option<(Arc<Derived>, Vec<Series>)>;

impl Default for State {
    fn default() -> Self {
        Self { before: false, after: true, points: [None, None] }
    }
}

/// The points of one material: place along the axis, error, sample.
struct Series {
    material: usize,
    points: Vec<PlotPoint>,
    samples: Vec<u32>,
}

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    at_least(ui, 124.0, |ui| sample_errors_ui(ui, context, state));
}

fn sample_errors_ui(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, actions, .. } = context;
    let Some(derived) = &project.products.derived else {
        empty(ui, "Run to see the error of every sample.");
        return;
    };
    ui.horizontal_wrapped(|ui| {
        ui.checkbox(&mut state.after, "This run").on_hover_text("Errors of the results shown");
        let before = project.products.before.is_some();
        ui.add_enabled(before, egui::Checkbox::new(&mut state.before, "Run before"))
            .on_hover_text("Errors of the run before this one, in grey")
            .on_disabled_hover_text("There was no run before this one.");
        save_menu(ui, Plotted::SampleErrors, actions);
        ui.label(format!("RMS of the logarithm {}", short(derived.log_rms)));
        if let Some(before) = &project.products.before {
            ui.weak(format!("(before {})", short(before.log_rms)));
        }
        outdated(ui, project);
    });
    let State { before: show_before, after: show_after, points } = state;
    let [own, earlier] = points;
    let all = made(own, derived);
    let before = project.products.before.as_ref().filter(|_| *show_before);
    let before = before.map(|before| made(earlier, before)).unwrap_or_default();
    let names = &project.result_capture().materials;
    let colors = project.result_colors();
    let grey = ui.visuals().weak_text_color().gamma_multiply(0.6);
    // A low plot has no room for labels along its sides, nor for the names of colours.
    let is_low = ui.available_height() < 160.0;
    let mut plot = Plot::new("sample errors");
    if !is_low {
        plot = plot
            .legend(Legend::default())
            .x_axis_label("sample, by material")
            .y_axis_label("ln(computed / measured)");
    }
    let plot = plot
        // Room for the legend.
        .include_x(1.16 * derived.samples.len() as f64)
        .allow_scroll(false)
        .label_formatter(|_| None)
        .show(ui, |plot| {
            plot.hline(HLine::new("", 0.0).color(grey).width(1.0).allow_hover(false));
            for one in before {
                plot.points(
                    Points::new("Run before", PlotPoints::Borrowed(&one.points))
                        .color(grey)
                        .radius(1.2)
                        .allow_hover(false),
                );
            }
            for one in all.iter().filter(|_| *show_after) {
                let name = names.get(one.material).map_or("", |material| material.name.as_str());
                plot.points(
                    Points::new(name, PlotPoints::Borrowed(&one.points))
                        .color(colors.of(one.material))
                        .radius(1.8)
                        .allow_hover(false),
                );
            }
            if let Some(place) = project.selection.sample.and_then(|sample| place(derived, sample))
            {
                plot.vline(VLine::new("", place.x).color(grey).width(1.0).allow_hover(false));
                plot.points(
                    Points::new("Selected", vec![[place.x, place.y]])
                        .color(selected_color(plot.ctx()))
                        .filled(false)
                        .radius(6.0)
                        .allow_hover(false),
                );
            }
        });
    let response = plot.response.on_hover_cursor(egui::CursorIcon::Crosshair);
    if response.clicked()
        && let Some(at) = response.interact_pointer_pos()
    {
        let points = all.iter().flat_map(|one| one.points.iter().zip(&one.samples));
        let nearest = points
            .map(|(point, sample)| {
                (plot.transform.position_from_point(point).distance(at), *sample)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, sample)) = nearest.filter(|(distance, _)| *distance <= REACH) {
            actions.push(Action::Select(Select::Sample(sample as usize)));
        }
    }
}

/// Saves a plot as a table or as a drawing.
pub fn save_menu(ui: &mut egui::Ui, plotted: Plotted, actions: &mut Vec<Action>) {
    ui.menu_button("Save plot", |ui| {
        for (kind, text, help) in PlotFile::ALL {
            if ui.button(text).on_hover_text(help).clicked() {
                actions.push(Action::Ask(PathRequest::SavePlot(plotted, kind)));
                ui.close();
            }
        }
    })
    .response
    .on_hover_text("Write this plot to a file");
}

fn selected_color(ctx: &egui::Context) -> Color32 {
    if ctx.global_style().visuals.dark_mode { Color32::WHITE } else { Color32::BLACK }
}

/// Where a sample stands in the plot, drawn or not.
fn place(derived: &Derived, sample: usize) -> Option<PlotPoint> {
    let along = *derived.place.get(sample)?;
    Some(PlotPoint::new(f64::from(along), derived.samples[sample].log_error))
}

fn made<'a>(points: &'a mut Made, derived: &Arc<Derived>) -> &'a [Series] {
    points.take_if(|(of, _)| !Arc::ptr_eq(of, derived));
    &points.get_or_insert_with(|| (derived.clone(), series(derived))).1
}

/// The points of every material. Of very many, an even choice and all that are far off.
fn series(derived: &Derived) -> Vec<Series> {
    let limit = 3.0 * derived.log_rms;
    derived
        .material_start
        .windows(2)
        .enumerate()
        .filter(|(_, range)| range[1] > range[0])
        .map(|(material, range)| {
            let step = (range[1] - range[0]).div_ceil(DRAWN).max(1);
            let mut one = Series { material, points: Vec::new(), samples: Vec::new() };
            for place in range[0]..range[1] {
                let sample = derived.by_material[place];
                let error = derived.samples[sample as usize].log_error;
                if error.abs() > limit || (place - range[0]).is_multiple_of(step) {
                    one.points.push(PlotPoint::new(place as f64, error));
                    one.samples.push(sample);
                }
            }
            one
        })
        .collect()
}
