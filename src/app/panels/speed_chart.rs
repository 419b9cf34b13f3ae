//! A chart of error against seconds, whose points can be clicked.

use eframe::egui::{self, Align2, FontId, Sense, vec2};
use egui_plot::{Corner, Legend, Line, LineStyle, MarkerShape, Plot, PlotPoint, Points};

use super::numbers::{counted, duration, short};
use super::study::{grid_color, ink, logarithmic, point_ui, power};
use crate::io::drawing::Ink;
use crate::study::speed::{MEASURES, OWN, Place, quality_of};
use crate::study::speed_chart::front_of;

/// Draws the chart; gives the setting that was clicked.
pub fn chart_ui(
    ui: &mut egui::Ui,
    places: &[Place],
    measure: usize,
    in_use: Option<&str>,
) -> Option<String> {
    let at = |place: &Place| -> Option<[f64; 2]> {
        let error = place.errors[measure].filter(|error| *error > 0.0)?;
        (place.seconds > 0.0).then(|| [place.seconds.log10(), error.log10()])
    };
    let dark = ui.visuals().dark_mode;
    let text = ui.visuals().strong_text_color();
    let of = |is_paper: bool| -> Vec<[f64; 2]> {
        places.iter().filter(|place| place.is_paper == is_paper).filter_map(at).collect()
    };
    // Down to the next one's error only where its seconds are reached.
    let mut stairs: Vec<[f64; 2]> = Vec::new();
    for point in front_of(places, measure).into_iter().filter_map(at) {
        if let Some(&[_, above]) = stairs.last() {
            stairs.push([point[0], above]);
        }
        stairs.push(point);
    }
    let marked = |place: &&Place| quality_of(place).is_some() || place.setting == OWN;
    let (_, _, y_label) = MEASURES[measure];
    let plot = Plot::new(("seconds against error", measure))
        .legend(Legend::default().position(Corner::RightTop))
        .x_axis_label("seconds of the reconstruction (log)")
        .y_axis_label(format!("{y_label} (log)"))
        .x_axis_formatter(|mark, _| power(mark))
        .y_axis_formatter(|mark, _| power(mark))
        .x_grid_spacer(logarithmic)
        .y_grid_spacer(logarithmic)
        .grid_color(grid_color(ui))
        .grid_fade(0.0)
        .set_margin_fraction(egui::vec2(0.12, 0.14))
        .label_formatter(|_| None)
        .allow_scroll(false)
        .show(ui, |plot| {
            let line = Line::new("best for their time", stairs)
                .color(text)
                .width(1.4)
                .style(LineStyle::dashed_dense())
                .allow_hover(false);
            plot.line(line);
            for (name, is_paper, shape, series) in [
                ("joint (circles)", false, MarkerShape::Circle, 0),
                ("paper (triangles)", true, MarkerShape::Up, 1),
            ] {
                let points = of(is_paper);
                if !points.is_empty() {
                    let points = Points::new(name, points)
                        .shape(shape)
                        .color(ink(Ink::Series(series), dark))
                        .radius(4.5)
                        .allow_hover(false);
                    plot.points(points);
                }
            }
            for place in places.iter().filter(marked) {
                let Some([x, y]) = at(place) else { continue };
                let ring = Points::new("", vec![[x, y]])
                    .shape(MarkerShape::Circle)
                    .filled(false)
                    .color(text)
                    .radius(8.0)
                    .allow_hover(false);
                plot.points(ring);
            }
            let used = places.iter().find(|place| Some(place.setting.as_str()) == in_use);
            if let Some(at) = used.and_then(at) {
                let cross = Points::new("in use", vec![at])
                    .shape(MarkerShape::Plus)
                    .color(text)
                    .radius(12.0)
                    .allow_hover(false);
                plot.points(cross);
            }
        });
    let painter = ui.painter().with_clip_rect(plot.response.rect);
    for place in places.iter().filter(marked) {
        let Some([x, y]) = at(place) else { continue };
        let pixel = plot.transform.position_from_point(&PlotPoint::new(x, y));
        let font = FontId::proportional(12.5);
        let name = painter.layout_no_wrap(place.setting.clone(), font, text);
        // Left of and below the front is nothing else. Your own options may be a quality, so their
        // name stands above, and on the other side where there is room.
        let has_room = pixel.x + 9.0 + name.size().x < plot.response.rect.right();
        let (align, gap) = match (place.setting == OWN, has_room) {
            (true, true) => (Align2::LEFT_BOTTOM, vec2(9.0, -5.0)),
            (true, false) => (Align2::RIGHT_BOTTOM, vec2(-9.0, -5.0)),
            (false, _) => (Align2::RIGHT_TOP, vec2(-9.0, 5.0)),
        };
        painter.galley(align.anchor_size(pixel + gap, name.size()).min, name, text);
    }
    let mut clicked = None;
    for place in places {
        let Some([x, y]) = at(place) else { continue };
        let pixel = plot.transform.position_from_point(&PlotPoint::new(x, y));
        let name = format!(
            "{}: {}, error {}",
            place.setting,
            duration(place.seconds),
            short(place.errors[measure].unwrap_or_default())
        );
        let id = ("setting", &place.setting);
        let Some(point) = point_ui(ui, &plot.response, pixel, id, &name, Sense::click()) else {
            continue;
        };
        let memory = place.peak_mb.map_or(String::new(), |mb| format!(", {mb:.0} MB at most"));
        let help = format!(
            "{}, method {}\n{} s, {y_label} {}\n{}{memory}\nClick to set the run's options so",
            place.setting,
            if place.is_paper { "paper" } else { "joint" },
            short(place.seconds),
            short(place.errors[measure].unwrap_or_default()),
            counted(place.runs, "run", "runs"),
        );
        if point.on_hover_text(help).on_hover_cursor(egui::CursorIcon::PointingHand).clicked() {
            clicked = Some(place.setting.clone());
        }
    }
    clicked
}
