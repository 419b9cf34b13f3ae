//! Charts: grey cards, white tiles and colour charts in the photographs, and what is read of them.

use eframe::egui::{self, Button, DragValue, RichText};
use glam::DVec2;

use super::context::Context;
use super::fields::triple;
use super::numbers::{counted, cut, left, named, reflectance_color, rgb, swatch};
use crate::app::actions::{Action, Charting, NewChart, PathRequest};
use crate::app::charting::kind_name;
use crate::app::entry::{self, Unit};
use crate::app::jobs::ViewReading;
use crate::app::project::Project;
use crate::app::viewport::Viewport;
use crate::scene::charts::{Chart, ChartKind, LaidChart};

/// What a card that stands free is at first: A4.
const SIZE_M: DVec2 = DVec2::new(0.297, 0.21);

#[derive(Default)]
pub struct State {
    /// The selected chart while its numbers are dragged or typed, with what undo calls that.
    draft: Option<(usize, &'static str, Chart)>,
}

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, viewport, jobs, actions, .. } = context;
    let charts = jobs.charts.wanted(project).clone();
    let selected = project.selection.chart.filter(|&chart| chart < charts.len());
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.horizontal_wrapped(|ui| add_ui(ui, selected.is_some(), actions));
        list_ui(ui, &charts, selected, jobs.charts.is_placing(), actions);
        if project.opened.color_matrix.is_some() {
            ui.horizontal_wrapped(|ui| {
                ui.weak("Photographs are read by a colour matrix.");
                let help = "Leave colours as the camera recorded them: takes the matrix out of tags.json \
                            and reads the photographs anew. Results are discarded";
                if ui.button("Remove matrix").on_hover_text(help).clicked() {
                    actions.push(Action::Charting(Charting::Matrix(None)));
                }
            });
        }
        let Some(index) = selected else { return };
        ui.separator();
        let own = &charts[index];
        properties_ui(ui, index, &own.chart, state, actions);
        ui.separator();
        corners_ui(ui, project, viewport, &own.chart, actions);
        state_ui(ui, own, jobs.charts.is_placing());
        if let Some(read) = jobs.charts.reading(&own.chart) {
            ui.separator();
            readings_ui(ui, project, own, read, actions);
        }
    });
}

fn add_ui(ui: &mut egui::Ui, can_remove: bool, actions: &mut Vec<Action>) {
    ui.menu_button("Add chart", |ui| {
        for (text, help, new) in [
            ("Grey card", "A photographic grey card, of 18 %", NewChart::Grey),
            ("White tile", "A white tile or paper of known reflectance", NewChart::White),
            (
                "ColorChecker",
                "ColorChecker Classic, 24 patches: its grey ones settle the scale",
                NewChart::ColorChecker,
            ),
        ] {
            if ui.button(text).on_hover_text(help).clicked() {
                actions.push(Action::Charting(Charting::Add(new)));
                ui.close();
            }
        }
        let help = "A chart of your own: a CSV file with the reflectance of each patch";
        if ui.button("Table…").on_hover_text(help).clicked() {
            actions.push(Action::Ask(PathRequest::AddChartTable));
            ui.close();
        }
    })
    .response
    .on_hover_text("A surface of known reflectance in the photographs: it settles the scale");
    let remove = ui
        .add_enabled(can_remove, Button::new("Remove chart"))
        .on_hover_text("Take the selected chart away, with its surfaces and materials")
        .on_disabled_hover_text("Select a chart first");
    if remove.clicked() {
        actions.push(Action::Charting(Charting::Remove));
    }
}

fn list_ui(
    ui: &mut egui::Ui,
    charts: &[LaidChart],
    selected: Option<usize>,
    is_placing: bool,
    actions: &mut Vec<Action>,
) {
    if charts.is_empty() {
        ui.weak(
            "None. A card or chart of known reflectance in the photographs settles how bright all \
             materials are: add it, then click its four corners in a photograph.",
        );
    }
    let warning = ui.visuals().warn_fg_color;
    for (index, own) in charts.iter().enumerate() {
        let chart = &own.chart;
        ui.horizontal(|ui| {
            let middle = chart.table.patches.len() / 2;
            swatch(ui, reflectance_color(chart.table.patches[middle].reflectance));
            let count = counted(chart.views.len(), "photograph", "photographs");
            let text = format!("{}  ({}, {count})", chart.name, kind_name(chart));
            let is_fine = own.placed.is_ok() || is_placing || chart.views.is_empty();
            let text = match is_fine {
                true => RichText::new(text),
                false => RichText::new(text).color(warning),
            };
            let width = ui.available_width();
            let button = Button::selectable(selected == Some(index), left(text)).truncate();
            let response = ui
                .add(button.min_size(egui::vec2(width, 0.0)))
                .on_hover_text("Select it, and place its corners in the 3D view");
            if response.clicked() {
                actions.push(Action::Charting(Charting::Select(index)));
            }
        });
    }
}

/// What is known of the chart itself.
fn properties_ui(
    ui: &mut egui::Ui,
    index: usize,
    chart: &Chart,
    state: &mut State,
    actions: &mut Vec<Action>,
) {
    let draft = state.draft.take().filter(|(of, ..)| *of == index);
    let (mut name, mut edited) = match draft {
        Some((_, name, draft)) => (Some(name), draft),
        // Its corners go on changing meanwhile.
        None => (None, chart.clone()),
    };
    edited.views.clone_from(&chart.views);
    ui.horizontal(|ui| {
        let label = ui.label("Name");
        let field = egui::TextEdit::singleline(&mut edited.name).desired_width(f32::INFINITY);
        let help = "Of the surface and the material that the chart becomes";
        if ui.add(field).on_hover_text(help).labelled_by(label.id).changed() {
            name = Some("rename chart");
        }
    });
    if let [card] = edited.table.patches.as_mut_slice() {
        ui.horizontal_wrapped(|ui| {
            ui.label("Reflectance");
            if let Some(values) =
                triple(ui, "Reflectance of the card", card.reflectance, 0.0..=1.0, 0.002)
            {
                card.reflectance = values;
                name = Some("reflectance of chart");
            }
        });
        ui.horizontal_wrapped(|ui| {
            ui.label("Standard deviation");
            let what = "Standard deviation of the reflectance";
            if let Some(values) = triple(ui, what, card.sd, 0.0..=1.0, 0.001) {
                card.sd = values;
                name = Some("deviation of chart");
            }
        });
        if chart.kind == ChartKind::White {
            ui.weak("Whites differ: take both numbers from the data sheet of yours.");
        }
    } else {
        let patches = counted(edited.table.patches.len(), "patch", "patches");
        ui.weak(format!("{patches}; its grey patches settle the scale."));
    }
    size_ui(ui, &mut edited, &mut name);
    let Some(name) = name else { return };
    let is_in_hand = ui.ctx().text_edit_focused() || ui.input(|input| input.pointer.any_down());
    if is_in_hand {
        state.draft = Some((index, name, edited));
    } else if edited != *chart && !edited.name.trim().is_empty() {
        edited.name = edited.name.trim().to_owned();
        actions.push(Action::Charting(Charting::Change { name, chart: Box::new(edited) }));
    }
}

/// Whether the chart stands free, and then its size.
fn size_ui(ui: &mut egui::Ui, chart: &mut Chart, name: &mut Option<&'static str>) {
    ui.horizontal_wrapped(|ui| {
        let mut is_free = chart.size_m.is_some();
        let help = "It lies on no modelled surface: its position follows from its size and its corners \
                    in two photographs or more";
        if ui.checkbox(&mut is_free, "Stands free").on_hover_text(help).changed() {
            chart.size_m = is_free.then_some(SIZE_M);
            *name = Some("size of chart");
        }
        let Some(size_m) = &mut chart.size_m else { return };
        for (value, label, help) in [
            (&mut size_m.x, "1 to 2", "Length of the side from corner 1 to corner 2"),
            (&mut size_m.y, "2 to 3", "Length of the side from corner 2 to corner 3"),
        ] {
            ui.weak(label);
            let field = DragValue::new(value).speed(0.001).range(1e-3..=100.0).max_decimals(4);
            let response = entry::number(ui, field, Unit::Length);
            if response.accessible_name(help).on_hover_text(help).changed() {
                *name = Some("size of chart");
            }
        }
    });
}

/// The photographs that show its corners, and the tool that places them.
fn corners_ui(
    ui: &mut egui::Ui,
    project: &Project,
    view: &Viewport,
    chart: &Chart,
    actions: &mut Vec<Action>,
) {
    let is_active = view.cornering.is_active;
    let button = Button::selectable(is_active, "Place corners");
    let help = "Click the four corners in turn over the photograph; drag them to correct them. Esc \
                gives up, Backspace takes the last one back";
    if ui.add(button).on_hover_text(help).clicked() {
        actions.push(Action::Charting(Charting::Tool(!is_active)));
    }
    let shown = view.is_looking_through();
    let has_corners = shown.is_some_and(|own| chart.views.iter().any(|v| v.photograph == own));
    let hint = match (is_active, shown) {
        (false, _) => None,
        (true, None) => Some("Look through a photograph that shows it (0).".to_owned()),
        (true, Some(_)) if has_corners => {
            Some("Drag a corner to correct it; Tab shows the next photograph.".to_owned())
        }
        (true, Some(_)) => {
            let which = match chart.table.is_card() {
                true => "any corner first, then around the card",
                false => "clockwise from the corner of the first patch on",
            };
            Some(format!("Click corner {} of 4: {which}.", view.cornering.begun() + 1))
        }
    };
    if let Some(hint) = hint {
        ui.weak(hint);
    }
    for view in &chart.views {
        let Some(photograph) = project.loaded.photographs.get(view.photograph) else { continue };
        ui.horizontal(|ui| {
            let button = named(ui.small_button("Remove"), format!("Remove {}", photograph.name));
            if button.on_hover_text("Forget its corners in this photograph").clicked() {
                let photograph = view.photograph;
                actions.push(Action::Charting(Charting::RemoveCorners { photograph }));
            }
            let is_shown = shown == Some(view.photograph);
            let button = Button::selectable(is_shown, left(photograph.name.as_str())).truncate();
            let width = ui.available_width();
            let response = ui.add(button.min_size(egui::vec2(width, 0.0)));
            if response.on_hover_text("Look through this photograph").clicked() {
                actions.push(Action::LookThrough(Some(view.photograph)));
            }
        });
    }
}

/// Where the chart was found, or why it pins nothing.
fn state_ui(ui: &mut egui::Ui, own: &LaidChart, is_placing: bool) {
    if is_placing {
        ui.weak("Finding its position …");
        return;
    }
    match &own.placed {
        _ if own.chart.views.is_empty() => {
            ui.weak("It pins nothing yet: its corners are in no photograph.");
        }
        Err(problem) => {
            let color = ui.visuals().warn_fg_color;
            ui.colored_label(color, format!("It pins nothing: {problem}."));
        }
        Ok(placed) => {
            let middle = placed.corners.iter().sum::<glam::DVec3>() / 4.0;
            let known = own.surfaces().iter().filter(|own| own.known.is_some()).count();
            let pinned = counted(known, "known reflectance", "known reflectances");
            let place = super::numbers::triple(middle.as_vec3(), 3);
            ui.label(format!("{pinned}; its middle is at {place} m"));
            if own.chart.size_m.is_some() {
                let tilt = placed.tilt_sd.to_degrees();
                ui.label(format!("Its tilt is known to ± {tilt:.1}°")).on_hover_text(
                    "For corners that are off by one pixel. The standard deviation of its \
                     reflectance is enlarged by the reflectance times this angle in radians",
                );
            }
        }
    }
}

/// What was read of the patches in each photograph.
fn readings_ui(
    ui: &mut egui::Ui,
    project: &Project,
    own: &LaidChart,
    read: &[ViewReading],
    actions: &mut Vec<Action>,
) {
    for (view, read) in own.chart.views.iter().zip(read) {
        let Some(photograph) = project.loaded.photographs.get(view.photograph) else { continue };
        cut(ui, RichText::new(photograph.name.as_str()).strong());
        let (readings, fit) = match read {
            Ok(read) => read,
            Err(problem) => {
                // Said above where the chart pins nothing for that reason.
                if own.placed.is_ok() {
                    ui.colored_label(ui.visuals().warn_fg_color, problem);
                }
                continue;
            }
        };
        if let [card] = readings.as_slice() {
            let (spread, missing) = (100.0 * card.spread, 100.0 * card.missing);
            ui.label(format!("Radiance {}", rgb(card.mean)))
                .on_hover_text("Mean of its pixels: red, green and blue, linear");
            ui.label(format!("Spread {spread:.1} %, missing {missing:.1} %")).on_hover_text(
                "The deviation from light that changes evenly over the card, and the part of its pixels \
                 that is clipped or masked",
            );
        }
        let Some(fit) = fit else { continue };
        let [one, gains, matrix] = fit.mean_differences();
        ui.label(format!(
            "ΔE00 {one:.2}; {gains:.2} with a gain for each channel, {matrix:.2} with a matrix"
        ))
        .on_hover_text(
            "Mean colour difference (CIEDE2000) of the patches from their table, with one scale for the \
             three channels, with a scale each, and with the colour matrix that makes it least",
        );
        let use_matrix =
            named(ui.button("Use matrix"), format!("Use the colour matrix of {}", photograph.name));
        let help = "Read all photographs anew by this colour matrix, which tags.json will name. Tags and \
                    their undo stay; results are discarded";
        if use_matrix.on_hover_text(help).clicked() {
            actions.push(Action::Charting(Charting::Matrix(Some(fit.correction()))));
        }
        if fit.curve.is_better {
            let text = format!(
                "The photograph is not linear: reflectance goes with radiance to the power {:.2}",
                fit.curve.power
            );
            ui.colored_label(ui.visuals().warn_fg_color, text);
        }
    }
}
