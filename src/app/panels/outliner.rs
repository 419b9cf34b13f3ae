//! The list of all photographs, surfaces, materials and lights.

use std::collections::BTreeMap;

use eframe::egui::{self, Button};

use super::context::Context;
use super::lights::UNSEEN;
use super::numbers::{count, counted, left, list_color, swatch};
use crate::app::actions::{Action, Mode, Select};
use crate::app::change::Change;
use crate::app::derived::kind_name;
use crate::app::keys;
use crate::app::panes::Pane;
use crate::app::project::{Focus, Project};
use crate::app::relight::Added;
use crate::app::viewport::Viewport;
use crate::scene::{Photograph, Role};

/// Longer lists are cut: the table below shows them whole.
const LONGEST: usize = 300;

#[derive(Default)]
pub struct State {
    search: String,
}

/// Surfaces that are being dragged onto a material.
pub struct DraggedSurfaces(pub std::collections::BTreeSet<usize>);

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, viewport, actions, .. } = context;
    let field = egui::TextEdit::singleline(&mut state.search).hint_text("Search");
    ui.add(field.desired_width(f32::INFINITY)).on_hover_text("Show only names that contain this");
    let wanted = state.search.trim().to_lowercase();
    let shown = |name: &str| wanted.is_empty() || name.to_lowercase().contains(&wanted);
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        photographs(ui, project, viewport, &shown, actions);
        surfaces(ui, project, &shown, actions);
        materials(ui, project, &shown, actions);
        known_lights(ui, project, &shown, actions);
        virtual_lights(ui, project, &shown, actions);
        added(ui, project, &shown, actions);
    });
}

fn section(
    ui: &mut egui::Ui,
    name: &str,
    number: usize,
    open: bool,
    body: impl FnOnce(&mut egui::Ui),
) {
    egui::CollapsingHeader::new(format!("{name} ({})", count(number)))
        .id_salt(name)
        .default_open(open)
        .show_unindented(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            body(ui);
        });
}

/// A row that can be selected; it fills the width and is cut at its end.
fn row(ui: &mut egui::Ui, selected: bool, text: impl Into<egui::WidgetText>) -> egui::Response {
    let width = ui.available_width();
    let button = Button::selectable(selected, left(text)).truncate();
    ui.add(button.min_size(egui::vec2(width, 0.0)))
}

fn photographs(
    ui: &mut egui::Ui,
    project: &Project,
    viewport: &Viewport,
    shown: &impl Fn(&str) -> bool,
    actions: &mut Vec<Action>,
) {
    let photographs = &project.loaded.photographs;
    section(ui, "Photographs", photographs.len(), true, |ui| {
        let named =
            photographs.iter().enumerate().filter(|(_, photograph)| shown(&photograph.name));
        for (index, photograph) in named.take(LONGEST) {
            let selected = project.selection.photograph == Some(index);
            let through = viewport.is_looking_through() == Some(index);
            let mut text = photograph.name.clone();
            if photograph.image.is_none() {
                text.push_str("  (shown only)");
            }
            if through {
                text.push_str("  (looking through)");
            }
            let response = row(ui, selected, text).on_hover_ui(|ui| {
                ui.label(use_of(photograph));
                ui.label("Double click to look through it");
            });
            if response.double_clicked() {
                actions.push(Action::LookThrough((!through).then_some(index)));
            } else if response.clicked() {
                actions.push(Action::Select(Select::Photograph(index)));
            }
        }
        cut_list(ui, photographs.len());
    });
}

/// Whether a photograph counts, and why not.
pub fn use_of(photograph: &Photograph) -> String {
    match &photograph.image {
        Some(image) => format!(
            "Measures radiance, {} × {} pixels, {} of them invalid or saturated, {} masked",
            image.width(),
            image.height(),
            count(image.invalid_count()),
            count(image.masked_count())
        ),
        None => {
            "Measures nothing: it holds values for display, or is marked as geometry only; shown \
                 as it is"
                .to_owned()
        }
    }
}

fn surfaces(
    ui: &mut egui::Ui,
    project: &Project,
    shown: &impl Fn(&str) -> bool,
    actions: &mut Vec<Action>,
) {
    let surfaces = &project.capture.surfaces;
    let (listed, colors) = (project.edit().listed(), project.colors());
    section(ui, "Surfaces", surfaces.len(), true, |ui| {
        let named = surfaces.iter().enumerate().filter(|(_, surface)| shown(&surface.name));
        for (index, surface) in named.take(LONGEST) {
            ui.horizontal(|ui| {
                let (color, tag) = match surface.role {
                    Role::Material(material) => {
                        let name = &project.edit().materials[listed[material]].name;
                        (Some(colors.of(material)), name.clone())
                    }
                    Role::Luminaire(light) => {
                        (None, format!("visible light {}", project.capture.lights[light].name()))
                    }
                    Role::Untagged => (None, "no material".to_owned()),
                };
                swatch(ui, color.unwrap_or(egui::Color32::TRANSPARENT));
                let hidden = project.selection.hidden.contains(&index);
                let selected = project.selection.surfaces.contains(&index);
                let mut text = egui::RichText::new(&surface.name);
                if hidden {
                    text = text.weak().strikethrough();
                } else if surface.role == Role::Untagged && !selected {
                    text = text.color(ui.visuals().warn_fg_color);
                }
                let width = ui.available_width();
                let button = Button::selectable(selected, left(text))
                    .truncate()
                    .min_size(egui::vec2(width, 0.0))
                    .sense(egui::Sense::click_and_drag());
                let response = ui.add(button);
                if response.drag_started() {
                    response.dnd_set_drag_payload(DraggedSurfaces(dragged(project, index)));
                }
                let help = format!(
                    "{tag}. Drag onto a material, or press M. Shift or Ctrl selects several."
                );
                let response = response.on_hover_text(keys::named(ui.ctx(), &help));
                if response.clicked() {
                    let modifiers = ui.input(|input| input.modifiers);
                    actions.push(Action::Select(if modifiers.shift {
                        let listed = surfaces.iter().enumerate();
                        let listed = listed.filter(|(_, surface)| shown(&surface.name));
                        let shown = listed.map(|(index, _)| index).take(LONGEST).collect();
                        Select::Extend { to: index, shown }
                    } else {
                        let mode = if modifiers.command { Mode::Toggle } else { Mode::Only };
                        Select::Surface { surface: index, mode }
                    }));
                }
            });
        }
        cut_list(ui, surfaces.len());
    });
}

/// A dragged surface takes the other selected ones along.
fn dragged(project: &Project, surface: usize) -> std::collections::BTreeSet<usize> {
    let selected = &project.selection.surfaces;
    if selected.contains(&surface) { selected.clone() } else { [surface].into() }
}

/// Takes surfaces that are dropped onto a material's row.
pub fn drop_on_material(response: &egui::Response, material: usize, actions: &mut Vec<Action>) {
    if response.dnd_hover_payload::<DraggedSurfaces>().is_some() {
        let painter = response.ctx.layer_painter(response.layer_id);
        let stroke = egui::Stroke::new(2.0, crate::app::theme::ACCENT);
        painter.rect_stroke(response.rect, 3.0, stroke, egui::StrokeKind::Inside);
    }
    if let Some(dropped) = response.dnd_release_payload::<DraggedSurfaces>() {
        let surfaces = dropped.0.clone();
        actions.push(Action::Change(Change::Assign { surfaces, material }));
    }
}

fn materials(
    ui: &mut egui::Ui,
    project: &Project,
    shown: &impl Fn(&str) -> bool,
    actions: &mut Vec<Action>,
) {
    let materials = &project.edit().materials;
    section(ui, "Materials", materials.len(), false, |ui| {
        let named = materials.iter().enumerate().filter(|(_, material)| shown(&material.name));
        for (index, material) in named.take(LONGEST) {
            ui.horizontal(|ui| {
                swatch(ui, list_color(project, index));
                let selected = project.selection.material == Some(index);
                let text = format!("{} ({})", material.name, count(material.surfaces.len()));
                let response =
                    row(ui, selected, text).on_hover_text("Drop surfaces here to assign them");
                drop_on_material(&response, index, actions);
                if response.clicked() {
                    actions.push(Action::Select(Select::Material(index)));
                }
            });
        }
        cut_list(ui, materials.len());
    });
}

fn known_lights(
    ui: &mut egui::Ui,
    project: &Project,
    shown: &impl Fn(&str) -> bool,
    actions: &mut Vec<Action>,
) {
    let lights = &project.edit().given.lights;
    if lights.is_empty() {
        return;
    }
    section(ui, "Known lights", lights.len(), false, |ui| {
        let named = lights.iter().enumerate().filter(|(_, light)| shown(light.name()));
        for (index, light) in named.take(LONGEST) {
            let item = Added::Known(index);
            let selected =
                project.selection.added == Some(item) && project.selection.focus == Focus::Added;
            let text = format!("{}  ({})", light.name(), light.kind());
            let response = row(ui, selected, text);
            if response.on_hover_text("Its numbers are in Known light").clicked() {
                actions.push(Action::Select(Select::Added(item)));
                actions.push(Action::ShowPane(Pane::KnownLight));
            }
        }
        cut_list(ui, lights.len());
    });
}

/// Lights and objects that were set into the scene.
fn added(
    ui: &mut egui::Ui,
    project: &Project,
    shown: &impl Fn(&str) -> bool,
    actions: &mut Vec<Action>,
) {
    let edits = &project.edit().relight;
    let lights = edits.lights.iter().enumerate();
    let lights = lights.map(|(index, light)| (Added::Light(index), light.name.as_str()));
    let objects = edits.objects.iter().enumerate();
    let objects = objects.map(|(index, object)| (Added::Object(index), object.name.as_str()));
    for (title, items) in
        [("Added lights", lights.collect::<Vec<_>>()), ("Added objects", objects.collect())]
    {
        if items.is_empty() {
            continue;
        }
        section(ui, title, items.len(), true, |ui| {
            for &(item, name) in items.iter().filter(|(_, name)| shown(name)).take(LONGEST) {
                let selected = project.selection.added == Some(item)
                    && project.selection.focus == Focus::Added;
                if row(ui, selected, name).on_hover_text("Its numbers are in Relight").clicked() {
                    actions.push(Action::Select(Select::Added(item)));
                    actions.push(Action::ShowPane(Pane::Relight));
                }
            }
            cut_list(ui, items.len());
        });
    }
}

fn virtual_lights(
    ui: &mut egui::Ui,
    project: &Project,
    shown: &impl Fn(&str) -> bool,
    actions: &mut Vec<Action>,
) {
    let Some((lights, _)) = &project.products.lights else { return };
    let mut kinds: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (index, light) in lights.lights.iter().enumerate() {
        kinds.entry(kind_name(light.kind)).or_default().push(index);
    }
    section(ui, "Virtual lights", lights.lights.len(), false, |ui| {
        for (kind, indices) in kinds {
            let title = counted(indices.len(), kind, &format!("{kind}s"));
            egui::CollapsingHeader::new(title).id_salt(kind).show(ui, |ui| {
                let named = indices.iter().filter(|index| shown(&format!("{kind} {index}")));
                for &index in named.take(LONGEST) {
                    let selected = project.selection.light == Some(index)
                        && project.selection.focus == Focus::Light;
                    let numbers = project.products.derived.as_ref();
                    let numbers = numbers.and_then(|derived| derived.lights.get(index));
                    let is_unseen = numbers.is_some_and(|numbers| numbers.is_unseen());
                    let mark = if is_unseen { "  (!) unseen" } else { "" };
                    let help = if is_unseen { UNSEEN } else { "Show it in the inspector" };
                    if row(ui, selected, format!("{kind} {index}{mark}"))
                        .on_hover_text(help)
                        .clicked()
                    {
                        actions.push(Action::Select(Select::Light(index)));
                    }
                }
                cut_list(ui, indices.len());
            });
        }
    });
}

fn cut_list(ui: &mut egui::Ui, number: usize) {
    if number > LONGEST {
        ui.weak(format!("{} in all: search to find others", count(number)));
    }
}
