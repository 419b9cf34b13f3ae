//! What the import found, in the words of the terminal command.

use eframe::egui;

use crate::app::actions::{Action, ImportAction};
use crate::app::import::ImportPage;
use crate::io::import::{NOTHING_MEASURED, Shot};

pub fn found_ui(ui: &mut egui::Ui, page: &ImportPage, actions: &mut Vec<Action>) {
    ui.add_space(2.0);
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        if let Some(problem) = &page.problem {
            let color = ui.visuals().error_fg_color;
            ui.add(egui::Label::new(egui::RichText::new(problem).color(color)).wrap().selectable(true));
            ui.horizontal(|ui| {
                if ui.button("Read again").on_hover_text("Try once more").clicked() {
                    actions.push(Action::Import(ImportAction::Read));
                }
                if ui.button("Copy").on_hover_text("Copy this text to the clipboard").clicked() {
                    actions.push(Action::Copy(problem.clone()));
                }
            });
        }
        let Some(import) = &page.import else {
            if page.problem.is_none() {
                ui.weak("What was found will be listed here: cameras, photographs, triangles, what was left out.");
            }
            return;
        };
        let lines = import.summary();
        ui.horizontal(|ui| {
            ui.strong(lines.first().map_or("", String::as_str));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let button = ui.small_button("Read again").on_hover_text("Read all files anew");
                if button.clicked() {
                    actions.push(Action::Import(ImportAction::Read));
                }
            });
        });
        for line in lines.into_iter().skip(1) {
            ui.add(egui::Label::new(line).wrap().selectable(true));
        }
        let color = ui.visuals().warn_fg_color;
        let measured = import.shots.iter().any(|shot| shot.is_measurement);
        let found = import.shots.iter().any(|shot| shot.image.is_some());
        let merged = page.merge && !import.series.is_empty();
        let taken = page.as_srgb && import.shots.iter().any(Shot::is_single_code);
        let nothing = (found && !measured && !merged && !taken).then_some(NOTHING_MEASURED);
        for warning in nothing.into_iter().chain(import.warnings.iter().map(String::as_str)) {
            let text = egui::RichText::new(format!("Warning: {warning}")).color(color);
            ui.add(egui::Label::new(text).wrap().selectable(true));
        }
    });
}
