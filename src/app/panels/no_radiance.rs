//! What can be done about a capture none of whose photographs measures radiance.

use eframe::egui;

use crate::app::actions::Action;
use crate::app::project::Project;

/// Offers to take them for radiance, where there is nothing else to reconstruct from.
pub fn no_radiance_ui(ui: &mut egui::Ui, project: &Project, actions: &mut Vec<Action>) {
    let photographs = &project.loaded.photographs;
    let is_measured = photographs.iter().any(|own| own.image.is_some());
    if is_measured || !photographs.iter().any(|own| own.display.is_some()) {
        return;
    }
    egui::Frame::group(ui.style()).show(ui, |ui| {
        ui.set_width(ui.available_width());
        let color = ui.visuals().warn_fg_color;
        ui.colored_label(color, "No photograph measures radiance");
        ui.label(
            "They are shown as they are, and nothing can be reconstructed from them yet. If they \
             are JPEG, PNG or TIFF as a camera or a renderer writes them, the curve of sRGB gives \
             radiance by approximation; exposure series and RAW give it better.",
        );
        let help = "Write \"response\": \"srgb\" into transforms.json, and open the capture anew. \
                    The file as it was stays beside it as transforms.json~";
        if ui.button("Take for radiance (sRGB)").on_hover_text(help).clicked() {
            actions.push(Action::TakeAsSrgb);
        }
    });
    ui.add_space(6.0);
}
