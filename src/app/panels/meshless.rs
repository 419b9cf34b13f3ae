//! What can be done about a capture that has cameras and no mesh.

use eframe::egui;

use super::modal::ask;
use crate::app::actions::{Action, ImportAction, NewAction, PathRequest};
use crate::app::state::State;
use crate::app::theme;

pub fn meshless_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let Some(folder) = state.dialogs.meshless.clone() else { return };
    let (answer, left) = ask(ctx, "This capture has no mesh", 480.0, |ui| {
        ui.label(format!("{} has photographs with cameras, and no geometry.", folder.display()));
        ui.label("A reconstruction needs the surfaces that the photographs show.");
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            let text = egui::RichText::new("Draw it on the photographs");
            let draw = egui::Button::new(text.color(egui::Color32::WHITE)).fill(theme::ACCENT);
            let help = "Go to the Model page: rooms, boxes and polygons by their edges and corners";
            if ui.add(draw).on_hover_text(help).clicked() {
                return Some(vec![Action::New(NewAction::Model(folder.clone()))]);
            }
            let help = "Go to the import page with these cameras, and choose a mesh (OBJ, glTF, PLY, \
                        STL) for them";
            if ui.button("Import a mesh…").on_hover_text(help).clicked() {
                let cameras = folder.join("transforms.json");
                return Some(vec![
                    Action::Import(ImportAction::Show(Some(cameras))),
                    Action::Ask(PathRequest::ImportMesh),
                ]);
            }
            let cancel = ui.button("Cancel").on_hover_text("Leave it as it is (Esc)");
            cancel.clicked().then(Vec::new)
        })
        .inner
    });
    if answer.is_some() || left {
        state.dialogs.meshless = None;
        actions.extend(answer.into_iter().flatten());
    }
}
