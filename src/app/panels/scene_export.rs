//! Export of the recovered scene: the dialog for formats, light probe and folder.

use eframe::egui::{self, DragValue, Key};

use super::modal::{ask, folder_ui};
use crate::app::actions::{Action, ExportAction, PathRequest};
use crate::app::entry::{self, Unit};
use crate::app::export_question::ExportQuestion;
use crate::app::state::State;
use crate::app::theme;
use crate::io::export::elsewhere::Format;

/// Name, and what is written.
fn words(format: Format) -> (&'static str, &'static str) {
    match format {
        Format::Glb => ("glTF", "scene.glb: geometry, materials, textures, lights and cameras"),
        Format::Obj => ("OBJ", "obj/: mesh and materials with EXR textures"),
        Format::Mitsuba => ("Mitsuba 3", "mitsuba/: scenes, and a script that renders them"),
        Format::Blender => {
            ("Blender", "blender/: glTF, world and cameras, and a script to open it")
        }
        Format::Probe => ("Light probe", "probe.exr: the light that arrives at a point"),
        Format::Ply => ("Samples and lights", "PLY and CSV tables for plots and point viewers"),
    }
}

const ORDER: [Format; 6] =
    [Format::Glb, Format::Blender, Format::Obj, Format::Mitsuba, Format::Probe, Format::Ply];

pub fn scene_export_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let Some(own) = &mut state.dialogs.scene_export else { return };
    let ((), left) = ask(ctx, "Export scene", 520.0, |ui| {
        let height = (ui.ctx().content_rect().height() - 190.0).max(80.0);
        egui::ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
            ui.label("The recovered scene as it is relit, for other programs.");
            ui.add_space(4.0);
            for format in ORDER {
                let (name, help) = words(format);
                ui.horizontal(|ui| {
                    let mut is_on = own.formats.contains(&format);
                    if ui.checkbox(&mut is_on, name).on_hover_text(help).changed() {
                        own.formats.retain(|other| *other != format);
                        own.formats.extend(is_on.then_some(format));
                    }
                    ui.add(egui::Label::new(egui::RichText::new(help).weak()).truncate());
                });
            }
            if own.has_probe() {
                probe_ui(ui, own);
            }
        });
        ui.add_space(6.0);
        let help = "It is made where it is missing; files of the same names are replaced";
        let folder = folder_ui(ui, &mut own.folder, help, PathRequest::SceneFolder, actions);
        if !std::mem::replace(&mut own.is_focused, true) {
            folder.request_focus();
        }
        if folder.changed() {
            own.problem = None;
        }
        let entered = folder.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        if let Some(problem) = &own.problem {
            ui.colored_label(ui.visuals().error_fg_color, problem);
        }
        ui.add_space(6.0);
        ui.horizontal(|ui| {
            let obstacle = own.obstacle();
            let text = egui::RichText::new("Export").color(egui::Color32::WHITE);
            let button = egui::Button::new(text).fill(theme::ACCENT);
            let response = ui
                .add_enabled(obstacle.is_none(), button)
                .on_hover_text("Write the files (Enter)")
                .on_disabled_hover_text(obstacle.unwrap_or_default());
            if response.clicked() || entered && obstacle.is_none() {
                actions.push(Action::ExportScene(ExportAction::Start));
            }
            if ui.button("Cancel").on_hover_text("Leave it (Esc)").clicked() {
                actions.push(Action::ExportScene(ExportAction::Leave));
            }
            if let Some(obstacle) = obstacle {
                ui.weak(obstacle);
            }
        });
    });
    if left {
        actions.push(Action::ExportScene(ExportAction::Leave));
    }
}

/// Size, paths and place of the light probe, which is Blender's world, too.
fn probe_ui(ui: &mut egui::Ui, own: &mut ExportQuestion) {
    ui.add_space(4.0);
    egui::Grid::new("probe").num_columns(2).spacing([12.0, 4.0]).show(ui, |ui| {
        ui.weak("Probe width");
        let field = DragValue::new(&mut own.probe.width).range(16..=8192).suffix(" px");
        entry::number(ui, field, Unit::Plain)
            .accessible_name("Probe width")
            .on_hover_text("Pixels across; half as many down");
        ui.end_row();
        ui.weak("Paths a pixel");
        let field = DragValue::new(&mut own.probe.spp).range(1..=65536);
        entry::number(ui, field, Unit::Plain)
            .accessible_name("Paths a pixel of the probe")
            .on_hover_text("More take longer, and leave less noise");
        ui.end_row();
        ui.weak("Place");
        ui.horizontal(|ui| {
            let mut is_chosen = own.probe_at.is_some();
            let help = "Otherwise it is between the first camera and the surface in the middle \
                 of its picture";
            if ui.checkbox(&mut is_chosen, "At").on_hover_text(help).changed() {
                own.probe_at = is_chosen.then_some(own.middle);
            }
            for (value, axis) in own.probe_at.iter_mut().flat_map(|at| {
                let [x, y, z] = at.as_mut();
                [(x, "X"), (y, "Y"), (z, "Z")]
            }) {
                let field = DragValue::new(value).speed(0.01).max_decimals(3).suffix(" m");
                entry::number(ui, field, Unit::Length)
                    .accessible_name(format!("Probe {axis}"))
                    .on_hover_text(format!("Place of the probe along {axis}, metres"));
            }
        });
        ui.end_row();
    });
}
