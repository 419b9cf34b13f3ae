//! Names of keys in texts, as they are labelled on keyboards of this system; and which keys are which.

use eframe::egui;

/// Whether it is one of F1 to F35, which write nothing into a field.
pub fn is_function(key: egui::Key) -> bool {
    (egui::Key::F1..=egui::Key::F35).contains(&key)
}

/// A text that names keys as Linux and Windows do; on macOS Ctrl is ⌘ (or Cmd, where no font has
/// that), except in a terminal's Ctrl-C.
pub fn named(ctx: &egui::Context, text: &str) -> String {
    if ctx.os().is_mac() {
        let key = ctx.format_modifiers(egui::Modifiers::COMMAND);
        text.replace("Ctrl-C", "Control-C").replace("Ctrl", &key)
    } else {
        text.to_owned()
    }
}
