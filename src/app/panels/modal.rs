//! The common parts of every dialog: the window in front of all others, its fields and its buttons.

use eframe::egui::{self, Id, Key};

use crate::app::actions::{Action, PathRequest};

/// A window in front of all others; gives whether it was left by Escape or a click beside it.
pub(super) fn ask<T>(
    ctx: &egui::Context,
    name: &str,
    width: f32,
    body: impl FnOnce(&mut egui::Ui) -> T,
) -> (T, bool) {
    let response = egui::Modal::new(Id::unique(("question", name))).show(ctx, |ui| {
        let width = width.min(ui.ctx().content_rect().width() - 60.0);
        ui.set_width(width);
        ui.heading(name);
        ui.add_space(6.0);
        body(ui)
    });
    let left = response.should_close();
    (response.inner, left)
}

/// A field for a path, ready to be typed in; says whether Enter was pressed there.
pub(super) fn path_field(
    ui: &mut egui::Ui,
    text: &mut String,
    focused: &mut bool,
    help: &str,
) -> bool {
    let label = ui.label("Path");
    let field = egui::TextEdit::singleline(text).desired_width(f32::INFINITY);
    let response = ui.add(field).on_hover_text(help).labelled_by(label.id);
    if !std::mem::replace(focused, true) {
        response.request_focus();
    }
    response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter))
}

/// A folder, and the button that chooses it.
pub(super) fn folder_ui(
    ui: &mut egui::Ui,
    folder: &mut String,
    help: &str,
    asked: PathRequest,
    actions: &mut Vec<Action>,
) -> egui::Response {
    let label = ui.label("Folder");
    ui.horizontal(|ui| {
        let room = ui.available_width() - 76.0;
        let field = egui::TextEdit::singleline(folder).desired_width(room);
        let response = ui.add(field).on_hover_text(help).labelled_by(label.id);
        if ui.button("Folder…").on_hover_text("Choose the folder").clicked() {
            actions.push(Action::Ask(asked));
        }
        response
    })
    .inner
}

/// The button that accepts and the one that does not; what was answered.
pub(super) fn buttons(
    ui: &mut egui::Ui,
    (accept, help): (&str, &str),
    enabled: bool,
    entered: bool,
) -> Option<bool> {
    ui.horizontal(|ui| {
        let text = egui::RichText::new(accept).color(egui::Color32::WHITE);
        let button = egui::Button::new(text).fill(crate::app::theme::ACCENT);
        let accepted = ui.add_enabled(enabled, button).on_hover_text(help);
        let accepted = accepted.on_disabled_hover_text("Fill in the fields above first.").clicked();
        let refused = ui.button("Cancel").on_hover_text("Leave it as it is (Esc)").clicked();
        if refused { Some(false) } else { (accepted || entered && enabled).then_some(true) }
    })
    .inner
}
