//! The selected thing: its sketch, what it stands on, its numbers and surfaces.

use eframe::egui::{self, ComboBox, DragValue};

use super::{Proposal, diagram, surfaces, tools};
use crate::app::actions::{Action, ModelAction, ToEdges};
use crate::app::entry::{self, Unit};
use crate::app::modelling::ModelPage;
use crate::app::panels::numbers::named;
use crate::model::things::{Kind, parameters};
use crate::model::{Estimate, Model, Opening, Shape, Side, Support, Thing};

/// Most corners that are offered; more are read from files.
const MOST_CORNERS: usize = 64;

pub fn thing_ui(
    ui: &mut egui::Ui,
    page: &mut ModelPage,
    model: &Model,
    index: usize,
    actions: &mut Vec<Action>,
) -> Proposal {
    let own = &model.things[index];
    let buttons = [
        ("Duplicate", "A twin without strokes (Shift+D)", Action::Model(ModelAction::Duplicate)),
        ("Remove", "With the strokes about it (Delete)", Action::Model(ModelAction::Remove)),
    ];
    let kind = own.shape.name();
    tools::heading_ui(ui, &format!("{} ({kind})", own.id), &buttons, actions);
    diagram::diagram_ui(ui, page, model, index);
    fit_ui(ui, page, actions);
    ui.add_space(4.0);
    let mut edited = own.clone();
    let mut name = None;
    egui::Grid::new("model thing").num_columns(2).spacing([8.0, 4.0]).show(ui, |ui| {
        let proposals = [
            name_ui(ui, model, &mut edited),
            corners_ui(ui, &mut edited),
            support_ui(ui, model, index, &mut edited),
        ];
        name = proposals.into_iter().flatten().next();
    });
    let name = name.or_else(|| openings_ui(ui, &mut edited));
    let name = name.or_else(|| numbers_ui(ui, page, index, &mut edited));
    let name = name.or_else(|| surfaces::surfaces_ui(ui, &mut edited));
    let name = name.filter(|_| edited != *own)?;
    let mut changed = model.clone();
    let place = changed.change_thing(index, edited);
    if place != index {
        page.selected = crate::app::modelling::tool::Selected::Thing(place);
        page.tool = crate::app::modelling::tool::Tool::Select;
    }
    Some((name, changed))
}

fn fit_ui(ui: &mut egui::Ui, page: &ModelPage, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let help = "Move it until its outline lies on the lines of the photographs; the strokes about \
                    it move with it (E)";
        tools::to_edges_ui(ui, page, ("Fit to edges", help), ToEdges::Selected, actions);
    });
}

fn name_ui(ui: &mut egui::Ui, model: &Model, own: &mut Thing) -> Option<String> {
    let help = "Names its surfaces, too: without a full stop, different from others";
    own.id = tools::name_ui(ui, model, &own.id, help)?;
    Some("rename".to_owned())
}

fn corners_ui(ui: &mut egui::Ui, own: &mut Thing) -> Option<String> {
    let mut changed = false;
    match &mut own.shape {
        Shape::Room { corners, rectilinear, .. } => {
            ui.weak("Floor corners");
            ui.horizontal(|ui| {
                let least = if *rectilinear { 4 } else { 3 };
                changed |= count_ui(ui, corners, least, if *rectilinear { 2 } else { 1 });
                let help = "Walls run along x and y in turn, the first along x";
                changed |= ui.checkbox(rectilinear, "Right angles").on_hover_text(help).changed();
                if *rectilinear && *corners % 2 == 1 {
                    *corners += 1;
                }
                *corners = (*corners).max(if *rectilinear { 4 } else { 3 });
            });
            ui.end_row();
        }
        Shape::Prism { corners } | Shape::Polygon { corners } => {
            ui.weak("Corners");
            ui.horizontal(|ui| changed |= count_ui(ui, corners, 3, 1));
            ui.end_row();
        }
        Shape::Box { .. } | Shape::Cylinder => {}
    }
    changed.then(|| "corners".to_owned())
}

fn count_ui(ui: &mut egui::Ui, count: &mut usize, least: usize, step: usize) -> bool {
    let before = *count;
    let fewer = ui.add_enabled(*count >= least + step, egui::Button::new("−").small());
    let fewer = fewer
        .on_hover_text("Fewer corners; strokes about the last go with them")
        .on_disabled_hover_text(format!("It has at least {least} corners"));
    if named(fewer, "Fewer corners".to_owned()).clicked() {
        *count -= step;
    }
    ui.label(count.to_string());
    let more = ui.add_enabled(*count + step <= MOST_CORNERS, egui::Button::new("+").small());
    let more = more
        .on_hover_text("More corners")
        .on_disabled_hover_text(format!("It has at most {MOST_CORNERS} corners"));
    if named(more, "More corners".to_owned()).clicked() {
        *count += step;
    }
    *count != before
}

/// What the thing may stand on, lie in, or be flush with.
fn support_ui(ui: &mut egui::Ui, model: &Model, index: usize, own: &mut Thing) -> Option<String> {
    if matches!(own.shape, Shape::Room { .. }) {
        return None;
    }
    let hosts = || (0..model.things.len()).filter(|host| model.can_carry(*host, index));
    let sides = || -> Vec<Side> {
        let of = |thing: usize| {
            (0..model.things[thing].shape.sides()).map(move |index| Side { thing, index })
        };
        hosts().flat_map(of).collect()
    };
    let before = own.clone();
    let is_polygon = matches!(own.shape, Shape::Polygon { .. });
    ui.weak(if is_polygon { "Lies" } else { "Stands on" });
    let name = |on: Support| match on {
        Support::Floor => "the floor".to_owned(),
        Support::Top(host) => format!("top of {}", model.things[host].id),
        Support::Side(side) => format!("in {}", tools::side_name(model, side)),
        Support::Free => "free, in a plane of its own".to_owned(),
    };
    let mut choices = vec![Support::Floor];
    choices.extend(hosts().filter(|host| model.things[*host].shape.has_top()).map(Support::Top));
    if is_polygon {
        choices.push(Support::Free);
        choices.extend(sides().into_iter().map(Support::Side));
    }
    ComboBox::from_id_salt("model support")
        .selected_text(name(own.on))
        .width(ui.available_width())
        .truncate()
        .show_ui(ui, |ui| {
            for choice in choices {
                ui.selectable_value(&mut own.on, choice, name(choice));
            }
        })
        .response
        .accessible_name("What it stands on")
        .on_hover_text("Exact: its corners lie there whatever the strokes say");
    ui.end_row();
    if let Shape::Box { flush } = &mut own.shape {
        ui.weak("Flush with");
        let name = |flush: Option<Side>| match flush {
            None => "nothing".to_owned(),
            Some(side) => tools::side_name(model, side),
        };
        ComboBox::from_id_salt("model flush")
            .selected_text(name(*flush))
            .width(ui.available_width())
            .truncate()
            .show_ui(ui, |ui| {
                for choice in std::iter::once(None).chain(sides().into_iter().map(Some)) {
                    ui.selectable_value(flush, choice, name(choice));
                }
            })
            .response
            .accessible_name("What it is flush with")
            .on_hover_text("Side 1, from bottom1 to bottom2, lies in this wall or side");
        ui.end_row();
    }
    (*own != before).then(|| "support".to_owned())
}

/// Windows and doors of a room.
fn openings_ui(ui: &mut egui::Ui, own: &mut Thing) -> Option<String> {
    let Shape::Room { corners, openings, .. } = &mut own.shape else { return None };
    let (mut name, mut gone) = (None, None);
    for (index, opening) in openings.iter_mut().enumerate() {
        ui.horizontal(|ui| {
            ui.label(&opening.id);
            ui.weak("in wall");
            let mut wall = opening.wall + 1;
            let field = DragValue::new(&mut wall).range(1..=*corners);
            let help = "Wall 1 runs from floor1 to floor2";
            let response = entry::number(ui, field, Unit::Plain);
            let label = format!("Wall of {}", opening.id);
            if response.accessible_name(label).on_hover_text(help).changed() {
                opening.wall = wall - 1;
                name = Some("wall of an opening".to_owned());
            }
            let help = format!("Remove {}", opening.id);
            let remove = ui.small_button("Remove").on_hover_text(&help);
            if named(remove, help).clicked() {
                gone = Some(index);
            }
        });
    }
    if let Some(index) = gone {
        openings.remove(index);
        name = Some("remove opening".to_owned());
    }
    let help = "A window or a door: a rectangular hole in a wall";
    if ui.small_button("Add opening").on_hover_text(help).clicked() {
        let is_free = |id: &String| openings.iter().all(|other| other.id != *id);
        let id = (1..).map(|number| format!("opening{number}-")).find(is_free).unwrap_or_default();
        openings.push(Opening { id, wall: 0 });
        name = Some("add opening".to_owned());
    }
    name
}

/// The numbers: as they are solved, or typed and held.
fn numbers_ui(
    ui: &mut egui::Ui,
    page: &ModelPage,
    index: usize,
    own: &mut Thing,
) -> Option<String> {
    let reports = page.solution().map_or(&[][..], |solution| &solution.things);
    let solved = page.solved.as_ref().and_then(|solved| solved.model.things.get(index));
    let is_same = solved.is_some_and(|other| other.shape == own.shape && other.on == own.on);
    let report = reports.iter().find(|report| report.thing == index && is_same);
    let mut name = None;
    ui.add_space(4.0);
    ui.strong("Numbers");
    egui::Grid::new("model numbers of thing").num_columns(3).spacing([8.0, 3.0]).show(ui, |ui| {
        for parameter in parameters(own) {
            let solved = report
                .and_then(|report| report.numbers.iter().find(|own| own.name == parameter.name));
            let place = own.held.iter().position(|(held, _)| *held == parameter.name);
            let mut is_held = place.is_some();
            let help = "Held at the typed number; otherwise the strokes determine it";
            let label = format!("Hold {}", parameter.name);
            if ui
                .checkbox(&mut is_held, parameter.name.as_str())
                .on_hover_text(help)
                .accessible_name(label)
                .changed()
            {
                name = Some(format!("hold {}", parameter.name));
                match place {
                    Some(place) => drop(own.held.remove(place)),
                    None => {
                        let value = solved.map_or(start(parameter.kind), |own| own.value);
                        own.held.push((parameter.name.clone(), value));
                    }
                }
            }
            match place.filter(|_| is_held) {
                Some(place) => {
                    let value = &mut own.held[place].1;
                    if number_ui(ui, &parameter.name, parameter.kind, value) {
                        name = Some(parameter.name.clone());
                    }
                    ui.weak("typed");
                }
                None => drop(solved_ui(ui, parameter.kind, solved)),
            }
            ui.end_row();
        }
    });
    name
}

fn start(kind: Kind) -> f64 {
    if kind == Kind::Length { 1.0 } else { 0.0 }
}

fn number_ui(ui: &mut egui::Ui, name: &str, kind: Kind, value: &mut f64) -> bool {
    let mut shown = if kind == Kind::Yaw { value.to_degrees() } else { *value };
    let field = DragValue::new(&mut shown).range(-1e5..=1e5).max_decimals(4);
    let (field, unit) = match kind {
        Kind::Yaw => (field.speed(0.2).suffix("°"), Unit::Angle),
        Kind::Ratio => (field.speed(0.01), Unit::Plain),
        Kind::Length | Kind::Coordinate(_) => (field.speed(0.005).suffix(" m"), Unit::Length),
    };
    let response = entry::number(ui, field, unit).accessible_name(name).on_hover_text(name);
    if response.changed() {
        *value = if kind == Kind::Yaw { shown.to_radians() } else { shown };
    }
    response.changed()
}

/// A solved number with its standard error.
fn solved_ui(ui: &mut egui::Ui, kind: Kind, own: Option<&Estimate>) -> egui::Response {
    let Some(own) = own else { return ui.weak("open") };
    let (factor, unit) = match kind {
        Kind::Yaw => (180.0 / std::f64::consts::PI, "°"),
        Kind::Ratio => (1.0, ""),
        Kind::Length | Kind::Coordinate(_) => (1.0, " m"),
    };
    ui.label(format!("{:.3}{unit}", factor * own.value));
    match own.sd {
        Some(sd) => {
            let text = format!("± {:.3}{unit}", factor * sd);
            ui.weak(text).on_hover_text("Standard error")
        }
        None => ui.weak(""),
    }
}
