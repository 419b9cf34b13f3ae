//! The surfaces of a thing: the names of its faces, and which of them belong to the mesh.

use eframe::egui;

use crate::model::Thing;
use crate::model::things::face_names;

pub fn surfaces_ui(ui: &mut egui::Ui, own: &mut Thing) -> Option<String> {
    let mut name = None;
    let heading = egui::CollapsingHeader::new("Surfaces").id_salt("model surfaces");
    heading.show(ui, |ui| {
        let mut is_one = own.surfaces.all.is_some();
        let help = "All faces belong to one surface; else each is a surface of its own";
        if ui.checkbox(&mut is_one, "One surface").on_hover_text(help).changed() {
            own.surfaces.all = is_one.then(|| own.id.clone());
            name = Some("surfaces".to_owned());
        }
        if let Some(all) = &mut own.surfaces.all {
            let mut text = all.clone();
            let field = egui::TextEdit::singleline(&mut text).desired_width(f32::INFINITY);
            let help = "The surface's name, as tags refer to it";
            let response = ui.add(field).on_hover_text(help).accessible_name("Surface");
            if response.changed() && is_name(&text) {
                *all = text;
                name = Some("name of surface".to_owned());
            }
        }
        egui::Grid::new("model faces").num_columns(2).spacing([8.0, 3.0]).show(ui, |ui| {
            for face in face_names(own) {
                let surface = own.surfaces.of(&own.id, &face);
                // What others hide is there only where it is named.
                let is_hidden =
                    face == "bottom" && !own.surfaces.named.iter().any(|(other, _)| *other == face);
                let mut is_there = surface.is_some() && !is_hidden;
                let label = format!("Face {face}");
                let help = "Whether this face belongs to the mesh; others hide what it covers";
                if ui
                    .checkbox(&mut is_there, face.as_str())
                    .on_hover_text(help)
                    .accessible_name(label)
                    .changed()
                {
                    own.surfaces.named.retain(|(other, _)| *other != face);
                    if face == "bottom" && is_there {
                        let surface = own.surfaces.of(&own.id, &face);
                        own.surfaces.named.push((face.clone(), surface));
                    } else if face != "bottom" && !is_there {
                        own.surfaces.named.push((face.clone(), None));
                    }
                    name = Some(format!("face {face}"));
                }
                match surface.filter(|_| is_there) {
                    Some(surface) => {
                        let mut text = surface.clone();
                        let field =
                            egui::TextEdit::singleline(&mut text).desired_width(f32::INFINITY);
                        let help = "The surface that the face belongs to";
                        let response = ui
                            .add(field)
                            .on_hover_text(help)
                            .accessible_name(format!("Surface of {face}"));
                        if response.changed() && is_name(&text) {
                            own.surfaces.named.retain(|(other, _)| *other != face);
                            own.surfaces.named.push((face.clone(), Some(text)));
                            name = Some(format!("surface of {face}"));
                        }
                    }
                    None => drop(ui.weak("not in the mesh")),
                }
                ui.end_row();
            }
        });
    });
    name
}

/// Names of surfaces stand in the mesh's file, where spaces separate.
fn is_name(text: &str) -> bool {
    !text.is_empty() && !text.chars().any(|own| own.is_whitespace() || own.is_control())
}
