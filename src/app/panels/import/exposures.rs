//! Exposure series: which photographs belong together, and the camera's response.

use eframe::egui;
use egui_plot::{Corner, Legend, Line, LineStyle, Plot, PlotPoints, uniform_grid_spacer};

use crate::app::import::ImportPage;
use crate::app::panels::numbers::{counted, short};
use crate::app::theme::{CHANNEL_NAMES, channel_color};
use crate::exposures::{KNOTS, Response};
use crate::io::brackets::{self, Found};
use crate::io::import::Import;

pub fn exposures_ui(ui: &mut egui::Ui, page: &ImportPage) {
    let Some(import) = page.import.as_ref().filter(|import| !import.series.is_empty()) else {
        ui.centered_and_justified(|ui| {
            ui.weak(
                "No exposure series was found: photographs beside those of the cameras that their \
                 EXIF data, or the times given, show to be exposures of one view.",
            )
        });
        return;
    };
    let found = match &page.found {
        Some(Ok(found)) if found.shifts.len() == import.series.len() => Some(found.as_ref()),
        _ => None,
    };
    let height = if page.merge { (0.4 * ui.available_height()).max(80.0) } else { f32::INFINITY };
    egui::ScrollArea::vertical()
        .id_salt("series")
        .max_height(height)
        .auto_shrink([false, true])
        .show(ui, |ui| {
            for index in 0..import.series.len() {
                series(ui, import, index, found);
            }
        });
    if !page.merge {
        return;
    }
    ui.separator();
    match (&page.found, found) {
        (_, Some(found)) => {
            for warning in &found.warnings {
                let text = egui::RichText::new(warning).color(ui.visuals().warn_fg_color);
                ui.add(egui::Label::new(text).wrap());
            }
            response(ui, &found.checked.response);
        }
        (Some(Err(problem)), _) => {
            let text = egui::RichText::new(problem).color(ui.visuals().error_fg_color);
            ui.add(egui::Label::new(text).wrap().selectable(true));
        }
        _ => {
            ui.weak("The response is being recovered from the exposures…");
        }
    }
}

fn series(ui: &mut egui::Ui, import: &Import, index: usize, found: Option<&Found>) {
    let view = &import.series[index];
    let series = &view.series;
    let title = format!(
        "{}: {}",
        import.shots[view.shot].name,
        counted(series.files.len(), "exposure", "exposures")
    );
    egui::CollapsingHeader::new(title).id_salt(("series", index)).default_open(index < 3).show(
        ui,
        |ui| {
            egui::Grid::new(("exposures", index)).num_columns(4).striped(true).show(ui, |ui| {
                let mut order: Vec<usize> = (0..series.files.len()).collect();
                order.sort_by(|a, b| series.seconds[*a].total_cmp(&series.seconds[*b]));
                for exposure in order {
                    row(ui, import, (index, exposure), found);
                    ui.end_row();
                }
            });
        },
    );
}

fn row(
    ui: &mut egui::Ui,
    import: &Import,
    (index, exposure): (usize, usize),
    found: Option<&Found>,
) {
    let series = &import.series[index].series;
    let file = &series.files[exposure];
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    ui.label(name).on_hover_text(file.display().to_string());
    ui.monospace(brackets::time(series.seconds[exposure]))
        .on_hover_text("Exposure time times the factors of aperture and sensitivity");
    let is_reference = exposure == series.reference;
    ui.weak(if is_reference { "the camera's own" } else { "" });
    let Some(found) = found else { return };
    let mut notes = Vec::new();
    let [x, y] = found.shifts[index][exposure];
    if [x, y] != [0, 0] {
        notes.push(format!("moved by {x}, {y} px"));
    }
    let link = found.checked.links[index].iter().find(|link| link.exposures[1] == exposure);
    if let Some(link) = link {
        let measured = link.measured_stops.map(|own| format!(" ({own:.2} by its pixels)"));
        notes.push(format!("{:.2} stops more{}", link.stated_stops, measured.unwrap_or_default()));
    }
    if !found.checked.trusted[index][exposure] {
        notes.push("left out".to_owned());
    }
    ui.weak(notes.join(", "));
}

fn response(ui: &mut egui::Ui, response: &Response) {
    if let Response::Linear { .. } = response {
        ui.label("Response: linear, codes are proportional to exposure");
    } else {
        ui.label("Response of the camera, recovered from the exposures");
    }
    let dark = ui.visuals().dark_mode;
    let points = |channel: usize| -> PlotPoints<'static> {
        (0..KNOTS)
            .map(|code| [code as f64, response.ln_exposure(channel, code as f32)])
            .filter(|point| point[1].is_finite())
            .map(|[code, ln]| [code, ln / std::f64::consts::LN_2])
            .collect()
    };
    let lines: Vec<Line<'static>> = CHANNEL_NAMES
        .iter()
        .enumerate()
        .map(|(channel, name)| {
            let style =
                [LineStyle::Solid, LineStyle::dashed_dense(), LineStyle::dotted_dense()][channel];
            Line::new(*name, points(channel))
                .color(channel_color(channel, dark))
                .style(style)
                // Where they lie on one another, each shows beside the next.
                .width([4.0, 2.5, 1.5][channel])
        })
        .collect();
    let plot = Plot::new("response")
        .legend(Legend::default().position(Corner::RightBottom))
        .x_axis_label("code (8 bits)")
        .y_axis_label("exposure (stops from code 128)")
        .x_grid_spacer(uniform_grid_spacer(|_| [128.0, 64.0, 32.0]))
        .y_grid_spacer(uniform_grid_spacer(|_| [8.0, 4.0, 2.0]))
        .grid_spacing(8.0..=100.0)
        .include_x(0.0)
        .include_x(255.0)
        .allow_scroll(false)
        .label_formatter(|position| {
            use egui_plot::HoverPosition::NearDataPoint;
            match position {
                NearDataPoint { plot_name, position, .. } => Some(format!(
                    "{plot_name}\ncode {:.0}\n{} stops",
                    position.x,
                    short(position.y)
                )),
                _ => None,
            }
        });
    let shown = plot.show(ui, |plot| {
        for line in lines {
            plot.line(line);
        }
    });
    let name = "Response of red, green and blue";
    shown.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, name));
}
