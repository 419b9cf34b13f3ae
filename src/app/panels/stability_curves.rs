//! Error against severity: a chart for each degradation, with a sentence about it.

use eframe::egui::{self, Align2, RichText, Sense};
use egui_plot::{AxisHints, FilledArea, Line, MarkerShape, Plot, PlotPoint, Points, Text};

use super::numbers::short;
use super::study::{grid_color, ink, logarithmic, point_ui, power, variant_ink, whole};
use crate::study::report;
use crate::study::stability::Variant;
use crate::study::stability_chart::{DegradationCurves, levels, number_of};

/// Of a chart.
const HEIGHT: f32 = 208.0;
const NARROWEST: f32 = 260.0;

pub fn curves_ui(ui: &mut egui::Ui, curves: &DegradationCurves) {
    let all: Vec<&DegradationCurves> = curves.chunk_by(|a, b| a.0 == b.0).collect();
    let columns = ((ui.available_width() / NARROWEST) as usize).clamp(1, 2).min(all.len().max(1));
    legend_ui(ui, curves);
    for row in all.chunks(columns) {
        ui.columns(columns, |cells| {
            for (cell, curves) in cells.iter_mut().zip(row) {
                // Text that fills a column would be justified.
                cell.vertical(|ui| one_ui(ui, curves));
            }
        });
        ui.add_space(8.0);
    }
}

/// How the points of a way are drawn, and what it is called for short.
fn look(variant: Variant) -> (MarkerShape, &'static str) {
    match variant {
        Variant::Joint => (MarkerShape::Circle, "joint"),
        Variant::Bare => (MarkerShape::Square, "bare"),
        Variant::Paper => (MarkerShape::Up, "paper"),
    }
}

/// One for all charts, where it hides no line.
fn legend_ui(ui: &mut egui::Ui, curves: &DegradationCurves) {
    let dark = ui.visuals().dark_mode;
    ui.horizontal_wrapped(|ui| {
        for variant in Variant::ALL
            .into_iter()
            .filter(|variant| curves.iter().any(|(_, own, _)| own == variant))
        {
            let (rect, _) = ui.allocate_exact_size(egui::vec2(12.0, 12.0), Sense::hover());
            let (middle, color) = (rect.center(), ink(variant_ink(variant), dark));
            let (shape, name) = look(variant);
            match shape {
                MarkerShape::Up => {
                    let corners = [(0.0, -5.0), (5.0, 4.0), (-5.0, 4.0)];
                    let corners = corners.map(|(x, y)| middle + egui::vec2(x, y)).to_vec();
                    let none = egui::Stroke::NONE;
                    ui.painter().add(egui::Shape::convex_polygon(corners, color, none));
                }
                MarkerShape::Square => {
                    let square = egui::Rect::from_center_size(middle, egui::Vec2::splat(8.0));
                    ui.painter().rect_filled(square, 0.0, color);
                }
                _ => {
                    ui.painter().circle_filled(middle, 4.5, color);
                }
            }
            ui.label(name).on_hover_text(format!(
                "{}: the line is the median over the seeds, the band from lowest to highest",
                variant.name()
            ));
        }
        ui.weak("band: lowest to highest over seeds, star: breaks");
    });
}

/// A place of a line: step, lowest, median and highest error.
type Step = (f64, [f64; 3]);

fn one_ui(ui: &mut egui::Ui, curves: &DegradationCurves) {
    let degradation = curves[0].0;
    let levels = levels(curves);
    let dark = ui.visuals().dark_mode;
    let text = ui.visuals().strong_text_color();
    let name = |step: f64| match step as usize {
        0 => "as it is".to_owned(),
        step => levels.get(step - 1).map_or(String::new(), |level| number_of(*level)),
    };
    let line = |of: usize| -> Vec<Step> {
        let curve = &curves[of].2;
        let clean = curve.clean.map(|clean| (0.0, [clean; 3]));
        let worse = curve.steps.iter().filter_map(|(level, errors)| {
            let step = levels.iter().position(|own| own == level)?;
            Some((1.0 + step as f64, (*errors)?))
        });
        clean.into_iter().chain(worse).filter(|(_, errors)| errors[0] > 0.0).collect()
    };
    let lines: Vec<(Variant, Vec<Step>)> =
        (0..curves.len()).map(|of| (curves[of].1, line(of))).collect();
    let breaks = |of: usize| -> Option<[f64; 2]> {
        let (broken, (_, line)) = (curves[of].2.breaks_at?, &lines[of]);
        let step = 1.0 + levels.iter().position(|level| *level == broken)? as f64;
        let (_, errors) = line.iter().find(|(own, _)| *own == step)?;
        Some([step, errors[1].log10()])
    };
    ui.strong(degradation.title());
    let names = name;
    let plot = Plot::new(("stability", degradation.title()))
        .height(HEIGHT)
        .y_axis_label("error of reflectance (log)")
        .custom_x_axes(vec![
            AxisHints::new_x()
                .label(degradation.unit())
                .formatter(move |mark, _| names(mark.value))
                .label_spacing(egui::Rangef::new(12.0, 24.0)),
        ])
        .y_axis_formatter(|mark, _| power(mark))
        .x_grid_spacer(whole)
        .y_grid_spacer(logarithmic)
        .grid_color(grid_color(ui))
        .grid_fade(0.0)
        .include_x(-0.3)
        .include_x(levels.len() as f64 + 0.4)
        .set_margin_fraction(egui::vec2(0.02, 0.22))
        .label_formatter(|_| None)
        .allow_scroll(false)
        .show(ui, |plot| {
            for (of, (variant, line)) in lines.iter().enumerate() {
                let color = ink(variant_ink(*variant), dark);
                let at = |which: usize| -> Vec<f64> {
                    line.iter().map(|(_, errors)| errors[which].log10()).collect()
                };
                let steps: Vec<f64> = line.iter().map(|(step, _)| *step).collect();
                let area = FilledArea::new("", &steps, &at(0), &at(2))
                    .fill_color(color.gamma_multiply(0.22))
                    .allow_hover(false);
                plot.add(area);
                let line = || -> Vec<[f64; 2]> {
                    line.iter().map(|(step, errors)| [*step, errors[1].log10()]).collect()
                };
                let (shape, name) = look(*variant);
                plot.line(Line::new(name, line()).color(color).width(1.8).allow_hover(false));
                let points = Points::new(name, line()).shape(shape).color(color).radius(4.0);
                plot.points(points.allow_hover(false));
                if let Some([x, y]) = breaks(of) {
                    let star = Points::new("", vec![[x, y]])
                        .shape(MarkerShape::Asterisk)
                        .color(text)
                        .radius(8.0)
                        .allow_hover(false);
                    plot.points(star);
                    let word = RichText::new("breaks\n").color(text).size(12.0);
                    let word = Text::new("", PlotPoint::new(x, y), word);
                    plot.text(word.anchor(Align2::CENTER_BOTTOM).allow_hover(false));
                }
            }
        });
    for (variant, line) in &lines {
        for (step, [low, median, high]) in line {
            let at = PlotPoint::new(*step, median.log10());
            let pixel = plot.transform.position_from_point(&at);
            let what = match *step as usize {
                0 => "the capture as it is".to_owned(),
                index => {
                    levels.get(index - 1).map_or(String::new(), |level| degradation.step(*level))
                }
            };
            let name = format!("{}, {what}: error {}", variant.name(), short(*median));
            let id = (variant.name(), *step as usize);
            let point = point_ui(ui, &plot.response, pixel, id, &name, Sense::hover());
            if let Some(point) = point {
                point.on_hover_text(format!(
                    "{name}\nover seeds {} to {}",
                    short(*low),
                    short(*high)
                ));
            }
        }
    }
    ui.add(egui::Label::new(report::sentence(curves)).wrap());
    let is_broken = curves
        .iter()
        .any(|(_, variant, curve)| *variant == Variant::Joint && curve.breaks_at.is_some());
    if is_broken {
        ui.add(egui::Label::new(RichText::new(report::advice(degradation)).weak()).wrap());
    }
}
