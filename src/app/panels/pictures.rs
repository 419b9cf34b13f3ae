//! Render to files: the dialog for views, size, number of paths, file kinds and folder.

use eframe::egui::{self, DragValue, Key};

use super::modal::{ask, buttons, folder_ui};
use super::numbers::counted;
use crate::app::actions::{Action, PathRequest, Relight};
use crate::app::entry::{self, Unit};
use crate::app::picture_choices::{PictureChoices, WIDTHS};
use crate::app::state::State;
use crate::io::exr::ColorSpace;

pub fn pictures_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let Some(project) = &state.project else { return };
    let photographs = project.result_capture().photographs.len();
    let (view, through) = match state.viewport.seen() {
        Some((_, through)) => (true, through.is_some()),
        None => (false, false),
    };
    let is_focused = std::mem::replace(&mut state.dialogs.pictures_focused, true);
    let Some(own) = &mut state.dialogs.pictures else { return };
    let (answer, left) = ask(ctx, "Render pictures", 520.0, |ui| {
        let height = (ui.ctx().content_rect().height() - 150.0).max(80.0);
        egui::ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
            egui::Grid::new("pictures").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
                views_ui(ui, own, photographs, view, through);
                quality_ui(ui, own);
                files_ui(ui, own, through);
            });
        });
        ui.add_space(6.0);
        let help = "A folder; it is made where it is missing";
        let response = folder_ui(ui, &mut own.folder, help, PathRequest::RenderTo, actions);
        if !is_focused {
            response.request_focus();
        }
        let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        ui.add_space(6.0);
        let is_ready = !own.folder.trim().is_empty() && (view || !own.is_view);
        buttons(ui, ("Render", "Begin (Enter)"), is_ready, entered)
    });
    match answer {
        Some(true) => {
            let choices = own.clone();
            actions.push(Action::Relight(Relight::Render(Box::new(choices))));
        }
        Some(false) => state.dialogs.pictures = None,
        None if left => state.dialogs.pictures = None,
        None => {}
    }
}

fn views_ui(
    ui: &mut egui::Ui,
    own: &mut PictureChoices,
    photographs: usize,
    has_view: bool,
    through: bool,
) {
    ui.weak("Views");
    ui.horizontal(|ui| {
        let all = format!("All {}", counted(photographs, "photograph", "photographs"));
        ui.radio_value(&mut own.is_view, false, all)
            .on_hover_text("One picture from the place of each photograph");
        ui.add_enabled_ui(has_view, |ui| {
            ui.radio_value(&mut own.is_view, true, "Current view")
                .on_hover_text("The 3D view, or the photograph in view")
                .on_disabled_hover_text("The 3D view has not been drawn yet");
        });
    });
    ui.end_row();
    ui.weak("Size");
    if own.is_view && !through {
        let field = DragValue::new(&mut own.width).range(WIDTHS).suffix(" px wide");
        entry::number(ui, field, Unit::Plain)
            .accessible_name("Width of the picture")
            .on_hover_text("Pixels across; the height follows the view's shape");
    } else {
        ui.horizontal(|ui| {
            for (step, name) in [(1, "Full"), (2, "Half"), (4, "Quarter")] {
                ui.selectable_value(&mut own.step, step, name)
                    .on_hover_text("Of the photographs' width and height");
            }
        });
    }
    ui.end_row();
}

fn quality_ui(ui: &mut egui::Ui, own: &mut PictureChoices) {
    ui.weak("Paths a pixel");
    let field = DragValue::new(&mut own.spp).range(1..=1_000_000);
    entry::number(ui, field, Unit::Plain)
        .accessible_name("Paths a pixel")
        .on_hover_text("At most; four times as many take four times as long and halve the noise");
    ui.end_row();
    ui.weak("Stop at noise");
    ui.horizontal(|ui| {
        let mut stops = own.noise.is_some();
        let help = "Stop earlier, once the noise before it is filtered is as low as this";
        let label = if stops { "" } else { "never" };
        let box_ = ui.checkbox(&mut stops, label);
        box_.widget_info(|| {
            egui::WidgetInfo::selected(egui::Role::CheckBox, true, stops, "Stop at noise")
        });
        if box_.on_hover_text(help).changed() {
            own.noise = stops.then_some(0.02);
        }
        if let Some(noise) = &mut own.noise {
            let mut percent = 100.0 * *noise;
            let field = DragValue::new(&mut percent).range(0.01..=100.0).speed(0.05).suffix(" %");
            if entry::number(ui, field, Unit::Plain)
                .accessible_name("Noise in percent")
                .on_hover_text("Of the whole picture's brightness")
                .changed()
            {
                *noise = percent / 100.0;
            }
        }
    });
    ui.end_row();
}

fn files_ui(ui: &mut egui::Ui, own: &mut PictureChoices, through: bool) {
    ui.weak("EXR colours");
    ui.horizontal(|ui| {
        for (space, name) in [(ColorSpace::Rec709, "Rec. 709"), (ColorSpace::AcesCg, "ACEScg")] {
            ui.radio_value(&mut own.color_space, space, name)
                .on_hover_text("Linear; the EXR files state their primaries and their white");
        }
    });
    ui.end_row();
    ui.weak("Files");
    ui.vertical(|ui| {
        ui.add_enabled(false, egui::Checkbox::new(&mut true, "EXR, linear radiance"))
            .on_disabled_hover_text("Always written");
        ui.checkbox(&mut own.has_layers, "Layers in the EXR")
            .on_hover_text("Each light, direct, indirect, albedo, normal and distance");
        ui.checkbox(&mut own.has_png, "PNG as the 3D view shows it")
            .on_hover_text("At its exposure and tone mapping");
        let has_photograph = own.step == 1 && (!own.is_view || through);
        ui.add_enabled(
            has_photograph,
            egui::Checkbox::new(&mut own.has_composite, "Edits set into the photographs"),
        )
        .on_hover_text("Also NAME-composite: the photograph with the difference that edits make")
        .on_disabled_hover_text("Only at the full size of a photograph");
    });
    ui.end_row();
}
