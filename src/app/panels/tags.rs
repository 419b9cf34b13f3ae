//! Tagging: which surfaces share a material, and the properties of the material.

use std::collections::BTreeSet;

use eframe::egui::{self, Button};

use super::context::Context;
use super::fields::triple;
use super::numbers::{counted, left, list_color, named, swatch};
use super::outliner::drop_on_material;
use crate::app::actions::{Action, Select};
use crate::app::change::Change;
use crate::app::project::Project;
use crate::scene::{Material, MaterialKind, Role};

#[derive(Default)]
pub struct State {
    /// The material whose name is being typed, and what was typed.
    rename: Option<(usize, String)>,
    /// The material that the list was last scrolled to.
    followed: Option<usize>,
}

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, actions, .. } = context;
    let selected = &project.selection.surfaces;
    ui.horizontal_wrapped(|ui| {
        let new = ui
            .button("New material")
            .on_hover_text("Make a material; the selected surfaces, if any, become its own (N)");
        if new.clicked() {
            actions.push(Action::NewMaterialOfSelection);
        }
        let label = counted(selected.len(), "surface selected", "surfaces selected");
        ui.weak(if selected.is_empty() {
            "Select surfaces to assign them".to_owned()
        } else {
            label
        });
        let empty = project.edit().empty_materials().len();
        if empty > 0 {
            let text = format!("Remove {}", counted(empty, "empty material", "empty materials"));
            let help = "Take materials away that no surface has";
            if ui.button(text).on_hover_text(help).clicked() {
                actions.push(Action::Change(Change::DeleteEmpty));
            }
        }
    });
    let chosen = project.selection.material.filter(|&m| m < project.edit().materials.len());
    let is_new = chosen.is_some() && std::mem::replace(&mut state.followed, chosen) != chosen;
    // However many materials there are, the properties of the chosen one stay in sight.
    let height = ui.available_height();
    let list = egui::ScrollArea::vertical().id_salt("materials").auto_shrink([false, true]);
    list.max_height(if chosen.is_some() { 0.5 * height } else { height }).show(ui, |ui| {
        for (index, material) in project.edit().materials.iter().enumerate() {
            let row = ui.scope(|ui| entry(ui, project, index, material, actions));
            if is_new && chosen == Some(index) {
                row.response.scroll_to_me(None);
            }
        }
        ui.add_space(4.0);
        unassigned(ui, project, actions);
    });
    ui.separator();
    egui::ScrollArea::vertical().id_salt("properties").auto_shrink(false).show(
        ui,
        |ui| match chosen {
            Some(index) => properties(ui, project, index, state, actions),
            None => {
                ui.weak("Choose a material above to see and change its properties.");
            }
        },
    );
}

fn entry(
    ui: &mut egui::Ui,
    project: &Project,
    index: usize,
    material: &Material,
    actions: &mut Vec<Action>,
) {
    ui.horizontal(|ui| {
        swatch(ui, list_color(project, index));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let selected = &project.selection.surfaces;
            let assign = ui
                .add_enabled(!selected.is_empty(), Button::new("Assign").small())
                .on_hover_text(format!("Give the selected surfaces the material {}", material.name))
                .on_disabled_hover_text("Select surfaces first");
            let assign = named(assign, format!("Assign {}", material.name));
            if assign.clicked() {
                let change = Change::Assign { surfaces: selected.clone(), material: index };
                actions.push(Action::Change(change));
            }
            let mut kind = match material.kind {
                MaterialKind::Diffuse => "diffuse",
                MaterialKind::Specular => "specular",
            }
            .to_owned();
            if material.known_diffuse.is_some() {
                kind.push_str(", known");
            }
            // At a large scale the name needs the room.
            if ui.available_width() > 140.0 {
                ui.weak(kind);
            }
            let width = ui.available_width();
            let is_selected = project.selection.material == Some(index);
            let whole = format!("{} ({})", material.name, material.surfaces.len());
            let text = if width > 110.0 { whole.as_str() } else { &material.name };
            let button = Button::selectable(is_selected, left(text)).truncate();
            let help = "Choose this material, or drop surfaces here";
            let response = ui
                .add(button.min_size(egui::vec2(width, 0.0)))
                .on_hover_text(format!("{}\n{help}", material.name));
            drop_on_material(&response, index, actions);
            if response.clicked() {
                actions.push(Action::Select(Select::Material(index)));
            }
        });
    });
}

/// Surfaces without a material stand apart: nothing is estimated there.
fn unassigned(ui: &mut egui::Ui, project: &Project, actions: &mut Vec<Action>) {
    let surfaces = project.capture.surfaces.iter().enumerate();
    let untagged: BTreeSet<usize> = surfaces
        .filter(|(_, surface)| surface.role == Role::Untagged)
        .map(|(index, _)| index)
        .collect();
    if untagged.is_empty() {
        return;
    }
    let color = ui.visuals().warn_fg_color;
    ui.horizontal(|ui| {
        let text = counted(untagged.len(), "surface has no material", "surfaces have no material");
        ui.colored_label(color, text)
            .on_hover_text("They shade and give light, but no reflectance is estimated for them");
        if ui.small_button("Select them").on_hover_text("Select all of these surfaces").clicked() {
            let surfaces = untagged.clone();
            actions.push(Action::Select(Select::Surfaces { surfaces, add: false }));
        }
    });
    let names: Vec<&str> =
        untagged.iter().take(12).map(|&s| project.capture.surfaces[s].name.as_str()).collect();
    ui.weak(names.join(", "));
}

fn properties(
    ui: &mut egui::Ui,
    project: &Project,
    index: usize,
    state: &mut State,
    actions: &mut Vec<Action>,
) {
    let material = &project.edit().materials[index];
    let mut changes = Vec::new();
    let mut change = |change: Change| changes.push(Action::Change(change));
    name(ui, index, material, state, &mut change);
    ui.horizontal_wrapped(|ui| {
        ui.label("Kind");
        for (kind, text, help) in [
            (MaterialKind::Diffuse, "Diffuse", "Looks the same from everywhere"),
            (
                MaterialKind::Specular,
                "Specular",
                "Diffuse with a Phong lobe about the mirror direction",
            ),
        ] {
            let response = ui.radio(material.kind == kind, text).on_hover_text(help);
            if response.clicked() && material.kind != kind {
                change(Change::Kind { material: index, kind });
            }
        }
    });
    let mut textured = material.textured;
    let response = ui.checkbox(&mut textured, "Textured").on_hover_text(
        "The diffuse reflectance varies over the surfaces: a map of it is reconstructed",
    );
    if response.changed() {
        change(Change::Textured { material: index, textured });
    }
    known(ui, index, material, &mut change);
    ui.add_space(4.0);
    ui.horizontal_wrapped(|ui| {
        let label = "Merge into…";
        ui.add_enabled_ui(project.edit().materials.len() > 1, |ui| {
            ui.menu_button(label, |ui| {
                for (into, other) in project.edit().materials.iter().enumerate() {
                    if into != index && ui.button(other.name.as_str()).clicked() {
                        change(Change::Merge { from: index, into });
                        ui.close();
                    }
                }
            })
            .response
            .on_hover_text("Give all its surfaces to another material")
            .on_disabled_hover_text("There is no other material to merge into.");
        });
        if ui.button("Delete").on_hover_text("Its surfaces become unassigned").clicked() {
            change(Change::Delete { material: index });
        }
        let own: BTreeSet<usize> = material.surfaces.iter().copied().collect();
        let select = ui
            .add_enabled(!own.is_empty(), Button::new("Select surfaces"))
            .on_disabled_hover_text("No surface has this material.");
        if select.on_hover_text("Select the surfaces of this material").clicked() {
            actions.push(Action::Select(Select::Surfaces { surfaces: own, add: false }));
        }
    });
    actions.append(&mut changes);
    ui.add_space(4.0);
    let names: Vec<&str> = material
        .surfaces
        .iter()
        .take(40)
        .map(|&surface| project.capture.surfaces[surface].name.as_str())
        .collect();
    ui.weak(if names.is_empty() { "No surface has it".to_owned() } else { names.join(", ") });
}

fn name(
    ui: &mut egui::Ui,
    index: usize,
    material: &Material,
    state: &mut State,
    change: &mut impl FnMut(Change),
) {
    ui.horizontal(|ui| {
        let label = ui.label("Name");
        let mut text = match &state.rename {
            Some((renamed, text)) if *renamed == index => text.clone(),
            _ => material.name.clone(),
        };
        let field = egui::TextEdit::singleline(&mut text).desired_width(f32::INFINITY);
        let response = ui
            .add(field)
            .on_hover_text("Every material has a name of its own")
            .labelled_by(label.id);
        if response.changed() {
            state.rename = Some((index, text.clone()));
        }
        if response.lost_focus()
            && let Some((renamed, text)) = state.rename.take()
            && renamed == index
            && text.trim() != material.name
        {
            change(Change::Rename { material: index, name: text });
        }
    });
}

fn known(ui: &mut egui::Ui, index: usize, material: &Material, change: &mut impl FnMut(Change)) {
    let mut is_known = material.known_diffuse.is_some();
    let response = ui.checkbox(&mut is_known, "Known reflectance").on_hover_text(
        "Hold the diffuse reflectance at a measured value: it fixes the scale of all others",
    );
    if response.changed() {
        let diffuse = is_known.then_some([0.5; 3]);
        change(Change::Known { material: index, diffuse });
    }
    let Some(diffuse) = material.known_diffuse else { return };
    ui.indent("known", |ui| {
        ui.horizontal(|ui| {
            let mut picked = diffuse.map(|value| value as f32);
            let changed = ui
                .color_edit_button_rgb(&mut picked)
                .accessible_name("Pick the known reflectance")
                .on_hover_text("Pick it, in linear values")
                .changed();
            if changed {
                let diffuse = Some(picked.map(f64::from));
                change(Change::Known { material: index, diffuse });
            }
            if let Some(values) = triple(ui, "Known reflectance", diffuse, 0.0..=1.0, 0.002) {
                change(Change::Known { material: index, diffuse: Some(values) });
            }
        });
        let mut uncertain = material.known_diffuse_sd.is_some();
        let response = ui
            .checkbox(&mut uncertain, "Standard deviation")
            .on_hover_text("How far the true value may be off; without it the value is exact");
        if response.changed() {
            let deviation = uncertain.then_some([0.02; 3]);
            change(Change::KnownDeviation { material: index, deviation });
        }
        if let Some(deviation) = material.known_diffuse_sd {
            ui.horizontal(|ui| {
                if let Some(values) = triple(ui, "Standard deviation", deviation, 0.0..=1.0, 0.002)
                {
                    let deviation = Some(values);
                    change(Change::KnownDeviation { material: index, deviation });
                }
            });
        }
    });
}
