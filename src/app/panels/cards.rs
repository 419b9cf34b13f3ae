//! Errors that stay until they are dismissed, and notices that disappear after a while.

use eframe::egui::{self, Align2};

use super::numbers::ago;
use crate::app::actions::Action;
use crate::app::state::State;
use crate::io::settings::LeftBehind;

pub fn cards_ui(ctx: &egui::Context, state: &State, actions: &mut Vec<Action>) {
    let screen = ctx.content_rect();
    let width = (screen.width() - 40.0).clamp(200.0, 460.0);
    let messages = &state.messages;
    if !messages.notices.is_empty() {
        area("notices", Align2::LEFT_BOTTOM, 12.0).show(ctx, |ui| {
            let width = width.min(206.0);
            ui.set_max_width(width);
            for (_, notice) in messages.notices.iter().rev().take(3).rev() {
                egui::Frame::popup(ui.style()).show(ui, |ui| {
                    ui.set_width(width);
                    ui.label(notice.as_str());
                });
            }
        });
    }
    // The start page shows them itself.
    let left_behind = state.left_behind.as_slice();
    let left_behind = if state.project.is_some() { left_behind } else { &[] };
    if !(messages.errors.is_empty() && left_behind.is_empty()) {
        area("errors", Align2::RIGHT_BOTTOM, -12.0).show(ctx, |ui| {
            ui.set_max_width(width);
            if messages.errors.len() > 3 {
                ui.label(format!("And {} more errors", messages.errors.len() - 3));
            }
            for (index, card) in messages.errors.iter().enumerate().rev().take(3) {
                error_card(ui, index, card, width, actions);
            }
            for left in left_behind.iter().take(3) {
                egui::Frame::popup(ui.style()).show(ui, |ui| {
                    ui.set_width(width);
                    left_behind_ui(ui, left, actions);
                });
            }
        });
    }
}

/// A corner of the window, above the status bar.
fn area(name: &str, corner: Align2, x: f32) -> egui::Area {
    let id = egui::Id::unique(("cards", name));
    egui::Area::new(id).order(egui::Order::Foreground).anchor(corner, [x, -40.0])
}

fn error_card(
    ui: &mut egui::Ui,
    index: usize,
    card: &crate::app::messages::ErrorCard,
    width: f32,
    actions: &mut Vec<Action>,
) {
    let color = ui.visuals().error_fg_color;
    let frame = egui::Frame::popup(ui.style()).stroke(egui::Stroke::new(1.5, color));
    frame.show(ui, |ui| {
        ui.set_width(width);
        ui.colored_label(color, egui::RichText::new(&card.title).strong());
        egui::ScrollArea::vertical().id_salt(("error", index)).max_height(160.0).show(ui, |ui| {
            ui.add(egui::Label::new(card.text.as_str()).wrap().selectable(true));
        });
        ui.horizontal(|ui| {
            if ui.button("Copy").on_hover_text("Copy this text to the clipboard").clicked() {
                actions.push(Action::Copy(format!("{}\n{}", card.title, card.text)));
            }
            if ui.button("Dismiss").on_hover_text("Take this card away").clicked() {
                actions.push(Action::DismissError(index));
            }
        });
    });
}

/// Offers unsaved work of a window that crashed.
pub fn left_behind_ui(ui: &mut egui::Ui, left: &LeftBehind, actions: &mut Vec<Action>) {
    let name = left.of.file_name().unwrap_or(left.of.as_os_str()).to_string_lossy();
    let kept = left.kept.and_then(|kept| kept.elapsed().ok());
    let when = kept.map_or_else(String::new, |kept| format!(", {}", ago(kept)));
    ui.label(format!("A window closed without saving. Its work on \"{name}\" was kept{when}."))
        .on_hover_text(left.of.display().to_string());
    ui.horizontal(|ui| {
        for (text, help, action) in [
            ("Recover", "Open the work that was kept", Action::Recover(left.file.clone())),
            ("Not now", "Offer it again at the next start", Action::NotNow(left.file.clone())),
            ("Discard", "Delete it for good", Action::Discard(left.file.clone())),
        ] {
            if ui.button(text).on_hover_text(help).clicked() {
                actions.push(action);
            }
        }
    });
}
