//! Known lights: whether the capture is in a room or in the open, lights that photographs show, and
//! lights of known shape and position.

use std::sync::Arc;

use eframe::egui::{self, Button, Color32, DragValue, RichText};

use super::context::Context;
use super::fields::triple;
use super::numbers::{cut, emission_color, left, named, swatch};
use super::relight_added::{capital, emission_ui, emitter_ui, name_ui, turn_ui};
use crate::app::actions::{Action, Lighting, PathRequest, Relight, Select};
use crate::app::change::Change;
use crate::app::entry::{self, Unit};
use crate::app::given::{GivenLight, name_of, surfaces_of};
use crate::app::project::{Focus, Project};
use crate::app::relight::{Added, NewLight, strength_and_colour};
use crate::math::rgb::Rgb;
use crate::scene::{Emitter, Environment, KnownLight};

#[derive(Default)]
pub struct State {
    /// The temperature that was chosen last, by the light.
    kelvin: Option<(usize, f64)>,
}

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, actions, .. } = context;
    let given = &project.edit().given;
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        environment_ui(ui, given, actions);
        ui.separator();
        add_ui(ui, project, actions);
        list_ui(ui, project, actions);
        let Some(Added::Known(index)) = project.selection.added else { return };
        let Some(light) = given.lights.get(index) else { return };
        ui.separator();
        buttons_ui(ui, light, actions);
        let mut edited = light.clone();
        let others = given.lights.iter().enumerate();
        let others = others.filter(|(own, _)| *own != index).map(|(_, other)| other.name());
        let name = name_ui(ui, name_of(&mut edited), others)
            .or_else(|| light_ui(ui, project, &mut edited, index, state, actions));
        if let Some(name) = name {
            let mut given = (**given).clone();
            given.lights[index] = edited;
            actions.push(change(name, Some(Added::Known(index)), given));
        }
    });
}

fn change(name: &'static str, of: Option<Added>, given: GivenLight) -> Action {
    Action::Change(Change::Given { name, of, given: Arc::new(given) })
}

fn environment_ui(ui: &mut egui::Ui, given: &GivenLight, actions: &mut Vec<Action>) {
    ui.horizontal_wrapped(|ui| {
        ui.weak("Environment");
        for environment in Environment::ALL {
            let (text, help) = match environment {
                Environment::Auto => ("Auto", "The program decides by the geometry"),
                Environment::Room => ("Room", "Walls all around: light comes from near"),
                Environment::Open => ("Open", "In the open: light comes from the sky and the sun"),
            };
            let is_own = given.environment == environment;
            if ui.radio(is_own, text).on_hover_text(help).clicked() && !is_own {
                let given = GivenLight { environment, ..given.clone() };
                actions.push(change("change environment", None, given));
            }
        }
    });
}

fn add_ui(ui: &mut egui::Ui, project: &Project, actions: &mut Vec<Action>) {
    ui.horizontal_wrapped(|ui| {
        ui.menu_button("Add known light", |ui| {
            let mut entry = |ui: &mut egui::Ui, text: &str, help: &str, action: Action| {
                if ui.button(text).on_hover_text(help).clicked() {
                    actions.push(action);
                    ui.close();
                }
            };
            for kind in NewLight::ALL {
                entry(ui, kind.name(), kind.help(), Action::Lighting(Lighting::Add(kind)));
            }
            let help = "A sky that was photographed, in latitude and longitude (EXR, HDR)";
            entry(ui, "Sky…", help, Action::Ask(PathRequest::AddSky));
        })
        .response
        .on_hover_text("A light outside the photographs whose shape and place are known");
        let can = !project.selection.surfaces.is_empty();
        let visible = ui
            .add_enabled(can, Button::new("Selected surfaces shine"))
            .on_hover_text(
                "Make a visible light of the selected surfaces: its radiance is read from the \
                 photographs",
            )
            .on_disabled_hover_text("Select the surfaces of a lamp that photographs show first");
        if visible.clicked() {
            actions.push(Action::Lighting(Lighting::AddVisible));
        }
    });
}

fn list_ui(ui: &mut egui::Ui, project: &Project, actions: &mut Vec<Action>) {
    let given = &project.edit().given;
    if given.lights.is_empty() && given.unread.is_empty() {
        ui.weak(
            "None. Light that is not listed here is found by the run, also from outside the \
             photographs.",
        );
    }
    let selected = project.selection.added.filter(|_| project.selection.focus == Focus::Added);
    for (index, light) in given.lights.iter().enumerate() {
        let item = Added::Known(index);
        ui.horizontal(|ui| {
            swatch(ui, color_of(light));
            let text = format!("{}  ({})", light.name(), described(light));
            let width = ui.available_width();
            let button = Button::selectable(selected == Some(item), left(text)).truncate();
            let response = ui
                .add(button.min_size(egui::vec2(width, 0.0)))
                .on_hover_text("Select it: G, R and S move, rotate and scale it");
            if response.clicked() {
                actions.push(Action::Select(Select::Added(item)));
            }
        });
    }
    for (index, part) in given.unread.iter().enumerate() {
        let Some(problem) = &part.problem else { continue };
        let name = part.name();
        ui.horizontal(|ui| {
            swatch(ui, Color32::TRANSPARENT);
            let color = ui.visuals().warn_fg_color;
            let kind = if part.is_missing { "missing file" } else { "not read" };
            let text = RichText::new(format!("{name}  ({kind})")).color(color);
            ui.add(egui::Label::new(text).truncate()).on_hover_text(problem);
        });
        ui.horizontal(|ui| {
            if part.is_missing {
                let button = named(ui.small_button("Find…"), format!("Find {name}…"));
                if button.on_hover_text("Say where its file is now").clicked() {
                    actions.push(Action::Ask(PathRequest::FindLight(index)));
                }
            }
            let button = named(ui.small_button("Remove"), format!("Remove {name}"));
            if button.on_hover_text("Take it out of the project").clicked() {
                actions.push(Action::Lighting(Lighting::GiveUp(index)));
            }
        });
    }
}

fn described(light: &KnownLight) -> String {
    match light {
        KnownLight::Shape { emission: None, .. } => format!("{}, to be found", light.kind()),
        _ => light.kind().to_owned(),
    }
}

fn color_of(light: &KnownLight) -> Color32 {
    match light {
        KnownLight::Shape { emission, color, .. } => {
            emission.or(*color).map_or(Color32::TRANSPARENT, emission_color)
        }
        KnownLight::Visible { .. } | KnownLight::Dome { .. } => Color32::TRANSPARENT,
    }
}

fn buttons_ui(ui: &mut egui::Ui, light: &KnownLight, actions: &mut Vec<Action>) {
    ui.horizontal_wrapped(|ui| {
        let is_shape = matches!(light, KnownLight::Shape { .. });
        let is_placed = !matches!(
            light,
            KnownLight::Visible { .. }
                | KnownLight::Dome { .. }
                | KnownLight::Shape { emitter: Emitter::Sun { .. }, .. }
        );
        for (name, help, what, can) in [
            ("Duplicate", "Make a twin (Shift+D)", Relight::Duplicate, is_shape),
            ("Drop to surface", "Put it on the surface below it (End)", Relight::Drop, is_placed),
            ("Remove", "Take it away (Delete)", Relight::Remove, true),
        ] {
            let button = ui.add_enabled(can, Button::new(name).small()).on_hover_text(help);
            if button.on_disabled_hover_text("Such a light has no place of its own").clicked() {
                actions.push(Action::Relight(what));
            }
        }
    });
}

/// The numbers of a light; what undo calls the change where there is one.
fn light_ui(
    ui: &mut egui::Ui,
    project: &Project,
    light: &mut KnownLight,
    index: usize,
    state: &mut State,
    actions: &mut Vec<Action>,
) -> Option<&'static str> {
    match light {
        KnownLight::Visible { .. } => {
            visible_ui(ui, project, light, actions);
            None
        }
        KnownLight::Dome { dome, .. } => {
            let mut change = None;
            ui.horizontal(|ui| {
                ui.weak("Factor");
                let speed = 0.01 * dome.scale.max(1e-3);
                let field = DragValue::new(&mut dome.scale).range(1e-9..=1e9).speed(speed);
                let help = "Brings the image's values to the unit of the photographs";
                if entry::number(ui, field, Unit::Plain).on_hover_text(help).changed() {
                    change = Some("brightness of sky");
                }
                ui.weak("Turn");
                if turn_ui(ui, dome) {
                    change = Some("rotate");
                }
            });
            let file = dome.file.file_name().unwrap_or_default().to_string_lossy();
            cut(ui, file.as_ref()).on_hover_text(dome.file.display().to_string());
            change
        }
        KnownLight::Shape { emitter, emission, color, .. } => {
            let mut change = strength_ui(ui, emitter, emission, color);
            egui::Grid::new("known light").num_columns(2).spacing([12.0, 4.0]).show(ui, |ui| {
                if let Some(emission) = emission {
                    let own =
                        emission_ui(ui, emission, emitter.quantity(), index, &mut state.kelvin);
                    change = change.or(own);
                }
                change = change.or(emitter_ui(ui, emitter));
            });
            change
        }
    }
}

/// What is known of a light's strength.
fn strength_ui(
    ui: &mut egui::Ui,
    emitter: &Emitter,
    emission: &mut Option<Rgb>,
    color: &mut Option<Rgb>,
) -> Option<&'static str> {
    let mut change = None;
    let quantity = emitter.quantity();
    let mut is_known = emission.is_some();
    let help = format!(
        "{} as it was measured, in the unit of the photographs; otherwise the run finds it",
        capital(quantity)
    );
    if ui.checkbox(&mut is_known, format!("Known {quantity}")).on_hover_text(help).changed() {
        *emission = is_known.then_some(color.map_or([1.0; 3], |own| strength_and_colour(own).1));
        *color = None;
        change = Some("strength of known light");
    }
    if emission.is_none() {
        let mut has_color = color.is_some();
        let help = "The ratio of red, green and blue is known: the run finds one strength for all";
        if ui.checkbox(&mut has_color, "Known colour").on_hover_text(help).changed() {
            *color = has_color.then_some([1.0; 3]);
            change = Some("colour of known light");
        }
        if let Some(own) = color {
            ui.horizontal(|ui| {
                let mut picked = strength_and_colour(*own).1.map(|value| value as f32);
                let is_picked = ui
                    .color_edit_button_rgb(&mut picked)
                    .accessible_name("Pick the colour of the light")
                    .on_hover_text("Pick it, in linear values")
                    .changed();
                if is_picked && picked.iter().any(|&value| value > 0.0) {
                    *own = picked.map(f64::from);
                    change = Some("colour of known light");
                }
                if let Some(values) = triple(ui, "Colour of the light", *own, 0.0..=1e6, 0.01)
                    && values != [0.0; 3]
                {
                    *own = values;
                    change = Some("colour of known light");
                }
            });
        }
    }
    change
}

fn visible_ui(ui: &mut egui::Ui, project: &Project, light: &KnownLight, actions: &mut Vec<Action>) {
    let surfaces = surfaces_of(light);
    ui.weak("Its radiance is read from the photographs, and no reflectance is found for it.");
    let select = ui.button("Select surfaces").on_hover_text("Select the surfaces of this light");
    if select.clicked() {
        let surfaces = surfaces.iter().copied().collect();
        actions.push(Action::Select(Select::Surfaces { surfaces, add: false }));
    }
    let names: Vec<&str> = surfaces
        .iter()
        .take(40)
        .map(|&surface| project.loaded.surfaces[surface].name.as_str())
        .collect();
    ui.weak(names.join(", "));
}
