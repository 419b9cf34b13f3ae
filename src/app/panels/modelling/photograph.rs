//! The bar above the photograph, and the numbers of its lens.

use eframe::egui::{self, DragValue};

use super::Proposal;
use crate::app::entry::{self, Unit};
use crate::app::keys;
use crate::app::modelling::{ModelPage, Placement};
use crate::model::Model;

/// What to do now, and what is drawn over the photograph.
pub fn bar_ui(ui: &mut egui::Ui, page: &mut ModelPage, model: &Model) {
    ui.horizontal(|ui| {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if ui.small_button("Fit").on_hover_text("Show the whole photograph (Home)").clicked() {
                page.placement = Placement::default();
            }
            let help = keys::named(
                ui.ctx(),
                "Lines come to lie on the line or edge of the photograph that is nearest, corners \
                 where two lines cross (S). Hold Ctrl to draw as the hand does.",
            );
            ui.toggle_value(&mut page.snaps, "Snap").on_hover_text(help);
            let overlays = &mut page.overlays;
            ui.toggle_value(&mut overlays.lines, "Lines")
                .on_hover_text("Lines that were found in this photograph: strokes snap to them");
            if !model.found_points.is_empty() {
                ui.toggle_value(&mut overlays.points, "Points")
                    .on_hover_text("Points that the engine has found, where the camera sees them");
            }
            let help = "The model's faces over the photograph, in the colours of their materials. \
                        Hold W to see faces in place of the photograph, or the other way round.";
            ui.toggle_value(&mut page.blink.is_on, "Faces").on_hover_text(help);
            ui.toggle_value(&mut overlays.hidden, "Hidden")
                .on_hover_text("Edges behind other faces, dashed");
            ui.toggle_value(&mut overlays.model, "Model")
                .on_hover_text("The solved things as the solved camera sees them");
            ui.toggle_value(&mut overlays.strokes, "Strokes")
                .on_hover_text("What was drawn on this photograph");
        });
    });
    // A row of its own: beside the switches a small window would cut it.
    ui.label(page.tool.hint(model));
    ui.add_space(2.0);
}

/// How to begin, and the lens of the photograph.
pub fn photograph_ui(ui: &mut egui::Ui, page: &ModelPage, model: &Model) -> Proposal {
    if model.strokes.len() < 12 && !page.solution().is_some_and(|own| own.is_usable()) {
        ui.strong("How to begin");
        for step in [
            "1. Find cameras (at the left), or draw lines along two axes of the room (X, Y, Z), two or more of each, along edges \
             that converge.",
            "2. Add a room or a box (R, B) and click its corners; do the same in the other \
             photographs.",
            "3. Say where the origin is (O), and one length that you know (K).",
            "4. Correct the strokes with large errors, and use the model.",
        ] {
            ui.label(step);
        }
        ui.weak("A box of which six corners are seen needs no lines.");
        ui.add_space(6.0);
    }
    let photograph = &model.photographs[page.shown];
    let index = photograph.lens;
    ui.strong(format!("Lens of {}", photograph.name));
    let sharing = model.photographs.iter().filter(|own| own.lens == index).count();
    if sharing > 1 {
        ui.weak(format!("{sharing} photographs share it."));
    }
    let mut edited = model.clone();
    let mut name = None;
    let report = page.solution().and_then(|own| own.lenses.iter().find(|own| own.lens == index));
    egui::Grid::new("model lens").num_columns(2).spacing([8.0, 4.0]).show(ui, |ui| {
        let lens = &mut edited.lenses[index];
        ui.weak("Focal length");
        let solved = report.and_then(|own| own.numbers.iter().find(|own| own.name == "focal_px"));
        match solved {
            Some(own) => {
                let sd = own.sd.map_or(String::new(), |sd| format!(" ± {sd:.1}"));
                ui.label(format!("{:.1}{sd} px", own.value))
            }
            None => ui.weak("not solved yet"),
        };
        ui.end_row();
        ui.weak("To begin with");
        ui.horizontal(|ui| {
            let mut is_known = lens.focal_px.is_some();
            let help = "A start value, from EXIF or typed; otherwise it follows from the lines";
            if ui
                .checkbox(&mut is_known, "")
                .on_hover_text(help)
                .accessible_name("Focal length is known")
                .changed()
            {
                let solved = solved.map(|own| own.value);
                let guess = photograph.size.0.max(photograph.size.1) as f64;
                lens.focal_px = is_known.then(|| solved.unwrap_or(guess));
                lens.fit.focal |= !is_known;
                name = Some("focal length".to_owned());
            }
            match &mut lens.focal_px {
                Some(focal) => {
                    let field = DragValue::new(focal).speed(1.0).range(1.0..=1e6).suffix(" px");
                    let response = entry::number(ui, field.max_decimals(1), Unit::Plain);
                    let help = "Focal length in pixels of the photograph";
                    if response.accessible_name("Focal length").on_hover_text(help).changed() {
                        name = Some("focal length".to_owned());
                    }
                }
                None => drop(ui.weak("unknown")),
            }
        });
        ui.end_row();
        ui.weak("Adjusted");
        ui.vertical(|ui| {
            let fit = &mut lens.fit;
            for (own, text, help) in [
                (&mut fit.focal, "Focal length", "Off: it is held at the number above"),
                (&mut fit.principal, "Principal point", "Needs many strokes, on all three axes"),
                (&mut fit.k1, "Distortion k1", "Needs strokes near the image's border"),
                (&mut fit.k2, "Distortion k2", "Needs many strokes near the image's border"),
            ] {
                if ui.checkbox(own, text).on_hover_text(help).changed() {
                    name = Some(format!("adjusting the {}", text.to_lowercase()));
                }
            }
        });
        ui.end_row();
    });
    if sharing > 1 {
        let help = "Give this photograph a lens of its own: another zoom, or another camera";
        if ui.small_button("Lens of its own").on_hover_text(help).clicked() {
            let mut lens = edited.lenses[index].clone();
            let is_free = |id: &String| model.lenses.iter().all(|other| other.id != *id);
            lens.id = (2..).map(|own| format!("lens{own}")).find(is_free).unwrap_or_default();
            edited.lenses.push(lens);
            edited.photographs[page.shown].lens = edited.lenses.len() - 1;
            name = Some("lens of its own".to_owned());
        }
    }
    ui.add_space(6.0);
    // Without a start value only the strokes tell the focal length.
    let lens = &mut edited.lenses[index];
    lens.fit.focal |= lens.focal_px.is_none();
    Some((name?, edited))
}
