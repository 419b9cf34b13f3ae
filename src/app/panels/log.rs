//! The log, newest entry last.

use eframe::egui;

use super::context::Context;
use crate::app::actions::Action;
use crate::app::messages::Level;

#[derive(Default)]
pub struct State {
    warnings_only: bool,
}

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { messages, actions, .. } = context;
    ui.horizontal(|ui| {
        ui.checkbox(&mut state.warnings_only, "Warnings and errors only")
            .on_hover_text("Leave out messages about progress");
        if ui.button("Copy log").on_hover_text("Copy all lines to the clipboard").clicked() {
            let lines: Vec<String> = messages
                .log
                .iter()
                .map(|line| format!("{:8.2} s  {:?}  {}", line.secs, line.level, line.text))
                .collect();
            actions.push(Action::Copy(lines.join("\n")));
        }
    });
    let lines: Vec<_> = messages
        .log
        .iter()
        .filter(|line| !state.warnings_only || line.level != Level::Info)
        .collect();
    let row = ui.text_style_height(&egui::TextStyle::Body);
    egui::ScrollArea::vertical().auto_shrink(false).stick_to_bottom(true).show_rows(
        ui,
        row,
        lines.len(),
        |ui, rows| {
            for line in &lines[rows] {
                let text = format!("{:7.1} s  {}", line.secs, line.text.replace('\n', " "));
                let color = match line.level {
                    Level::Info => ui.visuals().text_color(),
                    Level::Warning => ui.visuals().warn_fg_color,
                    Level::Error => ui.visuals().error_fg_color,
                };
                let label = egui::RichText::new(text).color(color);
                ui.add(egui::Label::new(label).truncate()).on_hover_text(line.text.as_str());
            }
        },
    );
}
