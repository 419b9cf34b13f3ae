//! Error against iteration (Fig. 12), updated during a run.

use eframe::egui;
use egui_plot::{Corner, GridInput, GridMark, Legend, Line, LineStyle, Plot, PlotPoints, Points};

use super::context::Context;
use super::numbers::{at_least, counted, empty, outdated};
use super::sample_errors::save_menu;
use crate::app::actions::Plotted;
use crate::app::theme::{CHANNEL_NAMES, channel_color};
use crate::math::rgb::Rgb;
use crate::reconstruct::solution::Iteration;

pub struct State {
    logarithmic: bool,
    what: What,
}

impl Default for State {
    fn default() -> Self {
        Self { logarithmic: true, what: What::Relative }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum What {
    Relative,
    Absolute,
    Objective,
}

impl What {
    const ALL: [(Self, &'static str, &'static str); 3] = [
        (
            Self::Relative,
            "Relative RMS",
            "Root mean square of computed minus measured radiance, over the measured",
        ),
        (
            Self::Absolute,
            "Absolute RMS",
            "Root mean square of computed minus measured radiance, in the photographs' unit",
        ),
        (
            Self::Objective,
            "Objective",
            "The objective of the joint method; the paper's alternation has none",
        ),
    ];

    fn values(self, iteration: &Iteration) -> Option<Rgb> {
        match self {
            Self::Relative => Some(iteration.rms.relative.map(|value| 100.0 * value)),
            Self::Absolute => Some(iteration.rms.absolute),
            Self::Objective => iteration.objective,
        }
    }

    fn axis(self) -> &'static str {
        match self {
            Self::Relative => "relative RMS (%)",
            Self::Absolute => "absolute RMS (radiance)",
            Self::Objective => "objective",
        }
    }
}

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    at_least(ui, 150.0, |ui| convergence_ui(ui, context, state));
}

fn convergence_ui(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, actions, .. } = context;
    ui.horizontal_wrapped(|ui| {
        for (what, text, help) in What::ALL {
            ui.selectable_value(&mut state.what, what, text).on_hover_text(help);
        }
        ui.checkbox(&mut state.logarithmic, "Log axis").on_hover_text("Powers of ten upwards");
        if !project.products.iterations.is_empty() {
            save_menu(ui, Plotted::Convergence, actions);
        }
        outdated(ui, project);
    });
    let iterations = &project.products.iterations;
    if iterations.is_empty() {
        let running = project.run.is_some();
        empty(
            ui,
            if running {
                "The first iteration is on its way."
            } else {
                "Run to see how the error falls."
            },
        );
        return;
    }
    let points = |channel: usize| -> PlotPoints<'static> {
        let height = |value: f64| {
            if state.logarithmic { (value > 0.0).then(|| value.log10()) } else { Some(value) }
        };
        iterations
            .iter()
            .filter_map(|iteration| {
                let value = state.what.values(iteration)?[channel];
                Some([iteration.index as f64, height(value)?])
            })
            .collect()
    };
    let logarithmic = state.logarithmic;
    let value = move |height: f64| if logarithmic { 10f64.powf(height) } else { height };
    let dark = ui.visuals().dark_mode;
    let last = iterations.last().and_then(|iteration| state.what.values(iteration));
    let text = last.map_or_else(String::new, |rgb| {
        format!(
            "{}, {} {}",
            counted(iterations.len(), "iteration", "iterations"),
            super::numbers::rgb(rgb),
            state.what.axis()
        )
    });
    ui.weak(text);
    // A low plot has no room for a label along its side; the line above says what it is.
    let is_low = ui.available_height() < 150.0;
    let plot = Plot::new(("convergence", state.what as u8, logarithmic))
        .legend(Legend::default().position(Corner::RightTop))
        .include_x(1.0)
        .include_x(4.0)
        .x_axis_label(if is_low { "" } else { "iteration" })
        .y_axis_label(if is_low { "" } else { state.what.axis() })
        .y_axis_formatter(move |mark, _| axis_value(value(mark.value), mark.step_size))
        .x_axis_formatter(|mark, _| {
            if mark.value.fract() == 0.0 { format!("{}", mark.value) } else { String::new() }
        })
        .label_formatter(move |position| {
            use egui_plot::HoverPosition::NearDataPoint;
            match position {
                NearDataPoint { plot_name, position, .. } => Some(format!(
                    "{plot_name}\niteration {:.0}\n{}",
                    position.x,
                    super::numbers::short(value(position.y))
                )),
                _ => None,
            }
        })
        .allow_scroll(false);
    let plot = if logarithmic { plot.y_grid_spacer(decades) } else { plot };
    plot.show(ui, |plot| {
        for (channel, name) in CHANNEL_NAMES.iter().enumerate() {
            let style =
                [LineStyle::Solid, LineStyle::dashed_dense(), LineStyle::dotted_dense()][channel];
            let line = Line::new(*name, points(channel))
                .color(channel_color(channel, dark))
                .style(style)
                .width(2.0);
            plot.line(line);
            let dots =
                Points::new(*name, points(channel)).color(channel_color(channel, dark)).radius(2.5);
            plot.points(dots);
        }
    });
}

/// What is written at a mark of the axis.
fn axis_value(value: f64, step: f64) -> String {
    if step == UNLABELLED {
        return String::new();
    }
    // Powers of ten come back from their logarithms a little off.
    let text = super::numbers::short(value);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// The step of marks that get no number.
const UNLABELLED: f64 = 0.123;

/// Marks at whole multiples of powers of ten, on an axis of their logarithms.
fn decades(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    if !(low.is_finite() && high.is_finite()) || high - low > 40.0 {
        return Vec::new();
    }
    // Within one decade every multiple has room for its number.
    let few = high - low > 1.2;
    let narrow = high - low < 0.25;
    let mut marks = Vec::new();
    for decade in low.floor() as i64..=high.ceil() as i64 {
        let parts = if narrow { 100 } else { 10 };
        for part in parts / 10..parts {
            let value = decade as f64 + (10.0 * part as f64 / parts as f64).log10();
            let whole = part * 10 % parts == 0;
            let multiple = part * 10 / parts;
            let labelled = if narrow {
                part % 5 == 0
            } else {
                whole && (!few || matches!(multiple, 1 | 2 | 5))
            };
            let step = if !labelled {
                UNLABELLED
            } else if multiple == 1 && whole {
                1.0
            } else {
                0.4
            };
            if value >= low && value <= high {
                marks.push(GridMark { value, step_size: step });
            }
        }
    }
    marks
}
