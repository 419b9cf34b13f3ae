//! The numbers of the selected added light or object.

use eframe::egui::{self, DragValue};
use glam::{DAffine3, DMat3, DQuat, DVec3, EulerRot, Vec3};

use super::fields::{angle, direction_ui, length, position, triple};
use super::numbers::short;
use super::relight::{Proposal, State};
use crate::app::actions::{Action, Relight};
use crate::app::entry::{self, Unit};
use crate::app::project::Project;
use crate::app::relight::{self, Added, Motion, strength_and_colour};
use crate::math::blackbody::blackbody;
use crate::math::rgb::Rgb;
use crate::render::edits::{AddedLight, Edits, Object, Shape};
use crate::scene::{Brdf, Dome, Emitter};

/// The selected one's numbers.
pub fn added_ui(
    ui: &mut egui::Ui,
    project: &Project,
    state: &mut State,
    actions: &mut Vec<Action>,
) -> Option<Proposal> {
    let edits = &project.edit().relight;
    let item = project.selection.added.filter(|item| relight::exists(edits, *item))?;
    ui.separator();
    ui.horizontal_wrapped(|ui| {
        for (name, help, what) in [
            ("Duplicate", "Make a twin (Shift+D)", Relight::Duplicate),
            ("Drop to surface", "Put it on the surface below it (End)", Relight::Drop),
            ("Remove", "Take it away (Delete)", Relight::Remove),
        ] {
            if ui.small_button(name).on_hover_text(help).clicked() {
                actions.push(Action::Relight(what));
            }
        }
    });
    let mut changed: Option<(&'static str, Edits)> = None;
    match item {
        Added::Light(index) => {
            let mut light = edits.lights[index].clone();
            let others = edits.lights.iter().enumerate();
            let others = others.filter(|(k, _)| *k != index).map(|(_, other)| other.name.as_str());
            if let Some(name) = name_ui(ui, &mut light.name, others)
                .or_else(|| light_ui(ui, &mut light, index, state))
            {
                let mut edits = (**edits).clone();
                edits.lights[index] = light;
                changed = Some((name, edits));
            }
        }
        Added::Object(index) => {
            let mut object = edits.objects[index].clone();
            let others = edits.objects.iter().enumerate();
            let others = others.filter(|(k, _)| *k != index).map(|(_, other)| other.name.as_str());
            if let Some(name) =
                name_ui(ui, &mut object.name, others).or_else(|| object_ui(ui, &mut object))
            {
                let mut edits = (**edits).clone();
                edits.objects[index] = object;
                changed = Some((name, edits));
            }
        }
        Added::Known(_) => {}
    }
    changed.map(|(name, edits)| (name, Some(item), edits))
}

/// A name that no other has; what undo calls the change where there is one.
pub(super) fn name_ui<'a>(
    ui: &mut egui::Ui,
    name: &mut String,
    others: impl Iterator<Item = &'a str>,
) -> Option<&'static str> {
    let mut text = name.clone();
    let response = ui.horizontal(|ui| {
        let label = ui.label("Name");
        let field = egui::TextEdit::singleline(&mut text).desired_width(f32::INFINITY);
        ui.add(field).labelled_by(label.id).on_hover_text("Names its layer in rendered pictures")
    });
    let is_free = !text.trim().is_empty() && !others.into_iter().any(|other| other == text);
    (response.inner.changed() && is_free).then(|| {
        *name = text;
        "rename"
    })
}

fn light_ui(
    ui: &mut egui::Ui,
    light: &mut AddedLight,
    index: usize,
    state: &mut State,
) -> Option<&'static str> {
    let mut change = None;
    egui::Grid::new("added light").num_columns(2).spacing([12.0, 4.0]).show(ui, |ui| {
        match &mut light.shape {
            Shape::Dome(dome) => {
                let mut factor = light.emission[0];
                let speed = 0.01 * factor.max(1e-3);
                ui.weak("Factor");
                let field = DragValue::new(&mut factor).range(0.0..=1e9).speed(speed);
                let response = entry::number(ui, field, Unit::Plain);
                if response.on_hover_text("Factor on the image's radiance").changed() {
                    light.emission = [factor; 3];
                    change = Some("brightness of light");
                }
                ui.end_row();
                ui.weak("Turn");
                if turn_ui(ui, dome) {
                    change = Some("rotate");
                }
                ui.end_row();
                ui.weak("Image");
                let file = dome.file.file_name().unwrap_or_default().to_string_lossy();
                super::numbers::cut(ui, file.as_ref())
                    .on_hover_text(dome.file.display().to_string());
                ui.end_row();
            }
            Shape::Emitter(emitter) => {
                change = emission_ui(
                    ui,
                    &mut light.emission,
                    emitter.quantity(),
                    index,
                    &mut state.kelvin,
                );
                change = change.or(emitter_ui(ui, emitter));
            }
        }
    });
    change
}

/// The angle by which a dome is turned about the vertical; whether it was changed.
pub(super) fn turn_ui(ui: &mut egui::Ui, dome: &mut Dome) -> bool {
    // Without what single precision leaves behind the tenth of a degree.
    let mut degrees = (1e3 * f64::from(dome.turn.to_degrees())).round() / 1e3;
    let field = DragValue::new(&mut degrees).speed(0.5).max_decimals(1).suffix("°");
    let response = entry::number(ui, field, Unit::Angle)
        .accessible_name("Turn of the dome")
        .on_hover_text("About the vertical, counter-clockwise seen from above; R in the 3D view");
    if response.changed() {
        dome.turn = (degrees.to_radians() as f32).rem_euclid(std::f32::consts::TAU);
    }
    response.changed()
}

/// The units of what tells a light's strength; radiance is in the photographs' own unit, here U.
fn unit(quantity: &str) -> &'static str {
    match quantity {
        "radiance" => "U",
        "intensity" => "U m²",
        _ => "U sr",
    }
}

pub(super) fn emission_ui(
    ui: &mut egui::Ui,
    emission: &mut Rgb,
    quantity: &'static str,
    index: usize,
    chosen: &mut Option<(usize, f64)>,
) -> Option<&'static str> {
    let (strength, colour) = strength_and_colour(*emission);
    let mut change = None;
    ui.weak(capital(quantity));
    let mut edited = strength;
    let field = DragValue::new(&mut edited)
        .range(1e-9..=1e12)
        .speed(0.01 * strength.max(1e-6))
        .custom_formatter(|value, _| short(value))
        .suffix(format!(" {}", unit(quantity)));
    let help = format!(
        "{} of its strongest channel. U is the unit of the photographs' radiance",
        capital(quantity)
    );
    if entry::number(ui, field, Unit::Plain).on_hover_text(help).changed() {
        *emission = colour.map(|value| value * edited);
        change = Some("brightness of light");
    }
    ui.end_row();
    ui.weak("Colour");
    ui.horizontal(|ui| {
        let mut picked = colour.map(|value| value as f32);
        let is_picked = ui
            .color_edit_button_rgb(&mut picked)
            .accessible_name("Colour of the light")
            .on_hover_text("Pick its colour")
            .changed();
        if is_picked {
            let largest = picked.into_iter().fold(1e-6, f32::max);
            *emission = picked.map(|value| strength * f64::from(value / largest));
            *chosen = None;
            change = Some("colour of light");
        }
        let known = chosen.filter(|(of, _)| *of == index).map(|(_, kelvin)| kelvin);
        let mut kelvin = known.unwrap_or(4000.0);
        let slider = egui::Slider::new(&mut kelvin, 1500.0..=15000.0)
            .logarithmic(true)
            .max_decimals(0)
            .suffix(" K");
        ui.spacing_mut().slider_width = 84.0;
        let response = ui
            .add(slider)
            .accessible_name("Colour temperature")
            .on_hover_text("Gives it the colour of a glowing body: 2700 K a bulb, 6500 K daylight");
        if response.changed() {
            *chosen = Some((index, kelvin));
            *emission = blackbody(kelvin).map(|value| value * strength);
            change = Some("colour of light");
        }
    });
    ui.end_row();
    change
}

pub(super) fn emitter_ui(ui: &mut egui::Ui, emitter: &mut Emitter) -> Option<&'static str> {
    let mut change = None;
    let mut place = |ui: &mut egui::Ui, what: &str, value: &mut Vec3, name| {
        ui.weak(format!("{what}, m"));
        if let Some(new) = position(ui, what, *value) {
            *value = new;
            change = Some(name);
        }
        ui.end_row();
    };
    match emitter {
        Emitter::Rectangle { corners, normal } => {
            let middle = corners.iter().sum::<Vec3>() / 4.0;
            let mut moved = middle;
            place(ui, "Middle", &mut moved, "move");
            if moved != middle {
                *corners = corners.map(|corner| corner + (moved - middle));
            }
            let [mut width, mut height] =
                [corners[1].distance(corners[0]), corners[2].distance(corners[1])];
            let (old_width, old_height) = (width, height);
            let mut is_sized = false;
            for (name, value) in [("Width, m", &mut width), ("Height, m", &mut height)] {
                ui.weak(name);
                is_sized |= length(ui, name, value);
                ui.end_row();
            }
            if is_sized {
                let across = (corners[1] - corners[0]) / old_width.max(1e-6);
                let along = (corners[2] - corners[1]) / old_height.max(1e-6);
                let corner =
                    |x: f32, y: f32| moved + across * 0.5 * x * width + along * 0.5 * y * height;
                *corners =
                    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                change = Some("size of light");
            }
            ui.weak("Shines along");
            ui.label(super::numbers::triple(*normal, 2)).on_hover_text("Turn it with R");
            ui.end_row();
        }
        Emitter::Sphere { center, radius_m } => {
            place(ui, "Middle", center, "move");
            ui.weak("Radius, m");
            if length(ui, "Radius, m", radius_m) {
                change = Some("size of light");
            }
            ui.end_row();
        }
        Emitter::Point { position } => place(ui, "Position", position, "move"),
        Emitter::Spot { position, direction, inner_angle, outer_angle } => {
            place(ui, "Position", position, "move");
            if direction_ui(ui, direction) {
                change = Some("rotate");
            }
            for (name, value, help) in [
                ("Inner angle", &mut *inner_angle, "Within it, off its axis, the light is full"),
                ("Outer angle", &mut *outer_angle, "Beyond it, off its axis, there is none"),
            ] {
                ui.weak(name);
                if angle(ui, name, value, help) {
                    change = Some("angle of light");
                }
                ui.end_row();
            }
            *outer_angle = outer_angle.clamp(1e-3, std::f32::consts::PI);
            *inner_angle = inner_angle.clamp(0.0, *outer_angle);
        }
        Emitter::Sun { direction, angular_diameter } => {
            if direction_ui(ui, direction) {
                change = Some("rotate");
            }
            ui.weak("Diameter");
            let help = "Its angle across: 0.53° for the sun; larger ones make softer shadows";
            if angle(ui, "Diameter", angular_diameter, help) {
                *angular_diameter = angular_diameter.clamp(1e-4, 3.0);
                change = Some("size of light");
            }
            ui.end_row();
        }
    }
    change
}

fn object_ui(ui: &mut egui::Ui, object: &mut Object) -> Option<&'static str> {
    let mut change = None;
    let edits = Edits { objects: vec![object.clone()], ..Edits::default() };
    let item = Added::Object(0);
    egui::Grid::new("added object").num_columns(2).spacing([12.0, 4.0]).show(ui, |ui| {
        if let Some(middle) = relight::middle(&edits, item, Default::default()) {
            ui.weak("Middle, m");
            if let Some(to) = position(ui, "Middle", middle) {
                let moved = relight::moved(&edits, item, Motion::Move(to - middle));
                object.world_from_object = moved.objects[0].world_from_object;
                change = Some("move");
            }
            ui.end_row();
            if let Some((name, linear)) = turn_and_scale(ui, object.world_from_object.matrix3) {
                let (low, high) = object.mesh.bounds().unwrap_or_default();
                let inner = (0.5 * (low + high)).as_dvec3();
                let translation = middle.as_dvec3() - linear * inner;
                object.world_from_object = DAffine3 { matrix3: linear, translation };
                change = Some(name);
            }
        }
        for (name, reflectance) in &mut object.surfaces {
            ui.label(name.as_str());
            ui.end_row();
            if reflectance_ui(ui, name, reflectance) {
                change = Some("reflectance");
            }
        }
    });
    change
}

/// Turn in degrees about X, then Y, then Z, and size of an object; a mirrored or skewed placement
/// is shown without its mirror and skew, which stay until something is changed.
fn turn_and_scale(ui: &mut egui::Ui, linear: DMat3) -> Option<(&'static str, DMat3)> {
    let (scale, turn, _) = DAffine3::from_mat3(linear).to_scale_rotation_translation();
    let (z, y, x) = turn.to_euler(EulerRot::ZYX);
    // Without the minus of a zero that rounding left.
    let mut degrees = [x, y, z].map(|angle| (angle.to_degrees() * 1e6).round() / 1e6 + 0.0);
    let mut change = None;
    ui.weak("Turn");
    ui.horizontal(|ui| {
        let mut is_turned = false;
        for (value, axis) in degrees.iter_mut().zip(["X", "Y", "Z"]) {
            let field = DragValue::new(value).speed(0.5).max_decimals(1).suffix("°");
            is_turned |= entry::number(ui, field, Unit::Angle)
                .accessible_name(format!("Turn about {axis}"))
                .on_hover_text(format!("Turn about {axis}, degrees"))
                .changed();
        }
        if is_turned {
            let [x, y, z] = degrees.map(f64::to_radians);
            let turn = DQuat::from_euler(EulerRot::ZYX, z, y, x);
            change = Some(("rotate", DMat3::from_quat(turn) * DMat3::from_diagonal(scale)));
        }
    });
    ui.end_row();
    ui.weak("Scale");
    let size = scale.abs().element_product().cbrt();
    let mut edited = size;
    let field = DragValue::new(&mut edited).range(1e-6..=1e6).speed(0.01 * size).max_decimals(4);
    let is_scaled = entry::number(ui, field, Unit::Plain)
        .accessible_name("Scale of the object")
        .on_hover_text("Metres per unit of its file")
        .changed();
    if is_scaled {
        let linear = linear * DMat3::from_diagonal(DVec3::splat(edited / size));
        change = Some(("scale", linear));
    }
    ui.end_row();
    change
}

fn reflectance_ui(ui: &mut egui::Ui, name: &str, own: &mut Brdf) -> bool {
    let mut changed = false;
    for (what, values, help) in [
        ("diffuse", &mut own.diffuse, "Reflected to all sides"),
        ("specular", &mut own.specular, "Reflected about the mirror direction"),
    ] {
        ui.weak(capital(what));
        ui.horizontal(|ui| {
            let mut picked = values.map(|value| value as f32);
            let label = format!("{name}, {what} reflectance");
            let is_picked = ui
                .color_edit_button_rgb(&mut picked)
                .accessible_name(&label)
                .on_hover_text(help)
                .changed();
            if is_picked {
                *values = picked.map(|value| f64::from(value).clamp(0.0, 1.0));
                changed = true;
            }
            if let Some(edited) = triple(ui, &label, *values, 0.0..=1.0, 0.002) {
                *values = edited;
                changed = true;
            }
        });
        ui.end_row();
    }
    // No more is sent back than came.
    for (diffuse, specular) in own.diffuse.iter().zip(&mut own.specular) {
        *specular = specular.min(1.0 - diffuse);
    }
    if own.specular.iter().any(|&value| value > 0.0) {
        ui.weak("Exponent");
        let field = DragValue::new(&mut own.exponent).range(0.0..=1e6).speed(0.5);
        changed |= entry::number(ui, field, Unit::Plain)
            .accessible_name(format!("{name}, exponent"))
            .on_hover_text("Phong's n: larger ones make sharper reflections")
            .changed();
        ui.end_row();
    }
    changed
}

pub(super) fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
