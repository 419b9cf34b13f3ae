//! Relighting: the recovered light in parts, added lights and objects, changed materials, and
//! pictures.

use std::sync::{Arc, Weak};

use eframe::egui::{self, Button, DragValue};

use super::context::Context;
use super::fields::triple;
use super::numbers::{duration, emission_color, empty, named, reflectance_color, swatch};
use super::relight_added::added_ui;
use super::relight_list::{list_ui, solo_ui};
use crate::app::actions::{Action, PathRequest, Relight};
use crate::app::change::Change;
use crate::app::entry::{self, Unit};
use crate::app::jobs::Jobs;
use crate::app::keys;
use crate::app::project::Project;
use crate::app::relight::{Added, NewLight};
use crate::app::solo::{Alone, Solo, is_alone, toggled};
use crate::app::viewport::GizmoMode;
use crate::render::edits::{Edits, GREY, Override, Surroundings};
use crate::render::groups::{self, Group};
use crate::render::scene::Solved;

#[derive(Default)]
pub struct State {
    /// The parts of the recovered light, and of which.
    groups: Option<(Weak<Solved>, Vec<Group>)>,
    /// The temperature that was chosen last, by the added light.
    pub kelvin: Option<(usize, f64)>,
    /// The light that is seen alone, and how all were before.
    pub alone: Option<Alone>,
}

/// What stands beside the name of a part of the light: hue, switch, factor and Solo, in points.
const BESIDE_NAME: f32 = 172.0;

/// What a change is called, what it is of, and the edits as it makes them.
pub type Proposal = (&'static str, Option<Added>, Edits);

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, viewport, jobs, actions, .. } = context;
    let mode = &mut viewport.gizmo.mode;
    let edits = &project.edit().relight;
    let mut proposal: Option<Proposal> = None;
    ui.horizontal_wrapped(|ui| {
        ui.menu_button("Add light", |ui| {
            for kind in NewLight::ALL {
                if ui.button(kind.name()).on_hover_text(kind.help()).clicked() {
                    actions.push(Action::Relight(Relight::AddLight(kind)));
                    ui.close();
                }
            }
            let help = "Light from all around, from an image in latitude and longitude";
            if ui.button("Dome…").on_hover_text(help).clicked() {
                actions.push(Action::Ask(PathRequest::AddDome));
                ui.close();
            }
        })
        .response
        .on_hover_text("Set a light into the scene");
        let object = ui.button("Add object…").on_hover_text("Set a mesh (OBJ, glTF, PLY, STL) into the scene, in the colours that its file gives it");
        if object.clicked() {
            actions.push(Action::Ask(PathRequest::AddObject));
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.weak("Handles");
        for (kind, name, help) in GizmoMode::ALL {
            let help = keys::named(ui.ctx(), help);
            ui.selectable_value(mode, kind, name).on_hover_text(help);
        }
    });
    pictures_ui(ui, jobs, actions);
    ui.separator();
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let Some(solved) = &project.products.solved else {
            empty(ui, "Run first: there is no light to relight with yet. Lights and objects can be placed already.");
            ui.add_space(6.0);
            list_ui(ui, project, &[], &mut state.alone, actions);
            proposal = proposal.take().or(added_ui(ui, project, state, actions));
            return;
        };
        let groups = state.groups(project, solved).to_vec();
        let parts: Vec<String> = groups.iter().map(|group| group.name.clone()).collect();
        section(ui, "Added", true, |ui| {
            list_ui(ui, project, &parts, &mut state.alone, actions);
            proposal = proposal.take().or(added_ui(ui, project, state, actions));
        });
        section(ui, "Recovered light", true, |ui| {
            proposal = proposal.take().or(recovered_ui(ui, edits, &groups, &parts, &mut state.alone));
        });
        section(ui, "Materials", false, |ui| {
            proposal = proposal.take().or(materials_ui(ui, project));
        });
        section(ui, "Surroundings", false, |ui| {
            proposal = proposal.take().or(surroundings_ui(ui, edits));
        });
    });
    if let Some((name, of, edits)) = proposal {
        let edits = Arc::new(edits);
        actions.push(Action::Change(Change::Relight { name, of, edits }));
    }
}

impl State {
    fn groups(&mut self, project: &Project, solved: &Arc<Solved>) -> &[Group] {
        let is_known = self
            .groups
            .as_ref()
            .is_some_and(|(of, _)| std::ptr::eq(of.as_ptr(), Arc::as_ptr(solved)));
        if !is_known {
            let groups = groups::groups(project.result_capture(), solved);
            self.groups = Some((Arc::downgrade(solved), groups));
        }
        self.groups.as_ref().map_or(&[], |(_, groups)| groups)
    }
}

fn section(ui: &mut egui::Ui, title: &str, is_open: bool, show: impl FnOnce(&mut egui::Ui)) {
    egui::CollapsingHeader::new(title).default_open(is_open).show(ui, show);
}

/// A factor on light; 1 is as it was.
fn factor(ui: &mut egui::Ui, name: &str, value: f64) -> Option<f64> {
    let mut edited = value;
    let field =
        DragValue::new(&mut edited).range(0.0..=1e6).speed(0.01).max_decimals(3).prefix("× ");
    let response = entry::number(ui, field, Unit::Plain).accessible_name(format!("Factor on {name}")).on_hover_text(format!(
            "Factor on {name}: 1 is as recovered, 0 is off. Drag, or click to type; right-click to reset"
        ));
    if response.secondary_clicked() {
        return (value != 1.0).then_some(1.0);
    }
    (edited != value).then_some(edited)
}

fn recovered_ui(
    ui: &mut egui::Ui,
    edits: &Edits,
    groups: &[Group],
    parts: &[String],
    now: &mut Option<Alone>,
) -> Option<Proposal> {
    let mut proposal = None;
    ui.horizontal(|ui| {
        let value = edits.original_light;
        let mut is_on = value > 0.0;
        let box_ = ui.checkbox(&mut is_on, "All of it");
        if box_.on_hover_text("Turn all of the recovered light off and on").changed() {
            let value = if is_on { 1.0 } else { 0.0 };
            proposal =
                Some(("recovered light", None, Edits { original_light: value, ..edits.clone() }));
        }
        right(ui, |ui| {
            if let Some(value) = factor(ui, "all of the recovered light", value) {
                let edits = Edits { original_light: value, ..edits.clone() };
                proposal = Some(("recovered light", None, edits));
            }
        });
    });
    // In a narrow panel the controls have a row of their own, so that no name is cut.
    let name_width = |group: &Group| {
        let name = egui::WidgetText::from(group.name.as_str());
        let extend = Some(egui::TextWrapMode::Extend);
        name.into_galley(ui, extend, f32::INFINITY, egui::TextStyle::Button).size().x
    };
    let widest = groups.iter().map(name_width).fold(0.0, f32::max);
    let is_narrow = ui.available_width() < widest + BESIDE_NAME;
    for group in groups {
        let value = edits.groups.get(&group.name).copied().unwrap_or(1.0);
        let mut set = |value: f64| {
            let mut edits = edits.clone();
            if value == 1.0 {
                edits.groups.remove(&group.name);
            } else {
                edits.groups.insert(group.name.clone(), value);
            }
            proposal = Some(("group of lights", None, edits));
        };
        let solo = Solo::Recovered(group.name.clone());
        let mut is_soloed = false;
        let mut controls = |ui: &mut egui::Ui, set: &mut dyn FnMut(f64)| {
            right(ui, |ui| {
                let is_alone = is_alone(edits, now.as_ref(), &solo, parts);
                is_soloed = solo_ui(ui, &group.name, is_alone);
                if let Some(value) = factor(ui, &group.name, value) {
                    set(value);
                }
            });
        };
        ui.horizontal(|ui| {
            swatch(ui, emission_color(group.emission)).on_hover_text("The hue of its light");
            let mut is_on = value > 0.0;
            let help = match group.lights.len() {
                1 => "One recovered light".to_owned(),
                count => format!("{count} recovered lights"),
            };
            let box_ = ui.checkbox(&mut is_on, group.name.as_str());
            if box_.on_hover_text(format!("{help}; off and on")).changed() {
                set(if is_on { 1.0 } else { 0.0 });
            }
            if !is_narrow {
                controls(ui, &mut set);
            }
        });
        if is_narrow {
            ui.horizontal(|ui| controls(ui, &mut set));
        }
        if is_soloed {
            proposal = Some(("solo", None, toggled(edits, now, solo, parts)));
        }
    }
    proposal
}

fn right(ui: &mut egui::Ui, show: impl FnOnce(&mut egui::Ui)) {
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), show);
}

fn materials_ui(ui: &mut egui::Ui, project: &Project) -> Option<Proposal> {
    let edits = &project.edit().relight;
    let capture = project.result_capture();
    let solved = project.products.solved.as_ref()?;
    let mut proposal = None;
    for (material, found) in capture.materials.iter().zip(&solved.reflectances) {
        let found = found.map_or([GREY; 3], |found| found.diffuse);
        let change = edits.materials.get(&material.name);
        let diffuse = change.and_then(|change| change.diffuse);
        let mut set = |change: Option<Override>| {
            let mut edits = (**edits).clone();
            match change {
                Some(change) => edits.materials.insert(material.name.clone(), change),
                None => edits.materials.remove(&material.name),
            };
            proposal = Some(("material", None, edits));
        };
        ui.horizontal(|ui| {
            swatch(ui, reflectance_color(diffuse.unwrap_or(found)));
            let mut is_other = change.is_some();
            let box_ = ui.checkbox(&mut is_other, material.name.as_str());
            if box_.on_hover_text("Give it another reflectance while relighting").changed() {
                set(is_other.then(|| Override { diffuse: Some(found), ..Override::default() }));
            }
            if let (Some(change), Some(diffuse)) = (change, diffuse) {
                right(ui, |ui| {
                    let mut picked = diffuse.map(|value| value as f32);
                    let name = format!("Diffuse reflectance of {}", material.name);
                    let is_picked = ui
                        .color_edit_button_rgb(&mut picked)
                        .accessible_name(&name)
                        .on_hover_text(&name)
                        .changed();
                    if is_picked {
                        let diffuse = Some(picked.map(|value| f64::from(value).clamp(0.0, 1.0)));
                        set(Some(Override { diffuse, ..change.clone() }));
                    }
                });
            }
        });
        if let (Some(change), Some(diffuse)) = (change, diffuse) {
            ui.indent(("material", &material.name), |ui| {
                ui.horizontal(|ui| {
                    if let Some(diffuse) = triple(ui, "Diffuse", diffuse, 0.0..=1.0, 0.002) {
                        set(Some(Override { diffuse: Some(diffuse), ..change.clone() }));
                    }
                });
            });
        }
    }
    proposal
}

fn surroundings_ui(ui: &mut egui::Ui, edits: &Edits) -> Option<Proposal> {
    let mut next = edits.surroundings;
    ui.horizontal_wrapped(|ui| {
        let grey = match edits.surroundings {
            Surroundings::Albedo(albedo) => albedo,
            _ => GREY,
        };
        for (choice, name, help) in [
            (
                Surroundings::Auto,
                "Automatic",
                "A grey room around everything that returns added light, and none under a sky",
            ),
            (Surroundings::Open, "None", "Added light that leaves the geometry is gone"),
            (Surroundings::Albedo(grey), "Grey", "A room of a reflectance of your choice"),
        ] {
            ui.radio_value(&mut next, choice, name).on_hover_text(help);
        }
        if let Surroundings::Albedo(albedo) = &mut next {
            let field = DragValue::new(albedo).range(0.0..=1.0).speed(0.005);
            entry::number(ui, field, Unit::Plain)
                .accessible_name("Albedo of the surroundings")
                .on_hover_text("Fraction of added light that the unmodelled room reflects, 0 to 1");
        }
    });
    (next != edits.surroundings)
        .then(|| ("surroundings", None, Edits { surroundings: next, ..edits.clone() }))
}

fn pictures_ui(ui: &mut egui::Ui, jobs: &Jobs, actions: &mut Vec<Action>) {
    ui.horizontal_wrapped(|ui| {
        match jobs.rendered() {
            Some(progress) => {
                let bar = egui::ProgressBar::new(progress.part).desired_width(80.0);
                ui.add(bar).on_hover_text("Of the picture under way");
                let left = progress.left.map_or(String::new(), |left| {
                    format!(", {} left", duration(left.as_secs_f64()))
                });
                ui.label(format!("{} of {}{left}", progress.number, progress.count));
                if ui.button("Stop").on_hover_text("Stop rendering; whole pictures stay").clicked()
                {
                    actions.push(Action::Relight(Relight::StopRendering));
                }
            }
            None => {
                let help = "Pictures of the view or from the places of all photographs, and the edits set \
                            into the photographs: EXR with all radiance, PNG at the exposure and \
                            tone mapping of the 3D view (F12)";
                if ui.button("Render to files…").on_hover_text(help).clicked() {
                    actions.push(Action::Relight(Relight::AskPictures));
                }
            }
        }
        for (name, help, asked) in [
            ("Load edits…", "Add lights and objects of an edits.json", PathRequest::LoadEdits),
            ("Save edits…", "Write an edits.json for lobelia render", PathRequest::SaveEdits),
        ] {
            let button = named(ui.add(Button::new(name)), name.to_owned());
            if button.on_hover_text(help).clicked() {
                actions.push(Action::Ask(asked));
            }
        }
    });
    let relit = jobs.relit();
    let tracer = relit.map_or("processor", |relit| &relit.tracer);
    let no_card = relit.and_then(|relit| relit.no_card.as_ref());
    let no_card = no_card.map(|reason| format!(": {reason}")).unwrap_or_default();
    // Always one line, or what is below would jump away from under the pointer.
    ui.weak(match relit {
        Some(relit) => {
            let state = match (relit.is_done, relit.traced) {
                (true, _) => "done",
                (false, 0) => "recombined",
                (false, _) => "getting clearer",
            };
            format!("In the 3D view: {} paths a pixel, {state}", relit.paths)
        }
        None => "In the 3D view: no picture yet".to_owned(),
    })
    .on_hover_text(format!(
        "Every light is kept as a layer of its own. Strength, colour, on and off recombine the \
         layers; a light that is moved is traced anew alone; view, objects and materials change \
         all of them. Paths are traced by the {tracer}{no_card}",
    ));
}
