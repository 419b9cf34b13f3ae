//! Each photograph with the mesh's edges as its camera sees them, and the points of a COLMAP
//! model, observed against projected: a wrong lens, axis or unit shows here.

use std::sync::Arc;

use eframe::egui::{
    self, Color32, ColorImage, ComboBox, Key, Modifiers, Pos2, Rect, Sense, Stroke, pos2, vec2,
};

use super::measure;
use crate::app::import::ImportPage;
use crate::app::panels::numbers::counted;
use crate::io::import::ShotCheck;

/// Orange as what is selected in the 3D view, blue and magenta beside it: told apart by any eye.
const EDGE: Color32 = Color32::from_rgb(255, 150, 30);
const OBSERVED: Color32 = Color32::from_rgb(64, 220, 255);
const PROJECTED: Color32 = Color32::from_rgb(255, 80, 200);
/// Marks that a screen can show.
const MOST_MARKS: usize = 4000;

pub fn photographs_ui(ui: &mut egui::Ui, page: &mut ImportPage) {
    let Some(import) = page.import.clone() else {
        ui.centered_and_justified(|ui| {
            ui.weak("Choose cameras: their photographs are shown here with the mesh over them.")
        });
        return;
    };
    let count = import.shots.len();
    if count == 0 {
        ui.centered_and_justified(|ui| ui.weak("There are no cameras in what was chosen."));
        return;
    }
    let typing = ui.ctx().text_edit_focused() || page.replace.is_some();
    let step = |ui: &egui::Ui, keys: [Key; 2]| {
        !typing && keys.iter().any(|key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, *key)))
    };
    let back = step(ui, [Key::ArrowLeft, Key::ArrowUp]);
    let on = step(ui, [Key::ArrowRight, Key::ArrowDown]);
    ui.horizontal_wrapped(|ui| {
        let previous = ui.button("<").on_hover_text("The photograph before (left arrow)");
        let back =
            back | super::super::numbers::named(previous, "Previous photograph".into()).clicked();
        let name = |index: usize| import.shots[index].name.as_str();
        let width = (0.42 * ui.available_width()).clamp(120.0, 260.0);
        ComboBox::from_id_salt("import photograph")
            .selected_text(name(page.shot.min(count - 1)))
            .width(width)
            .truncate()
            .show_ui(ui, |ui| {
                for index in 0..count {
                    ui.selectable_value(&mut page.shot, index, name(index));
                }
            })
            .response
            .accessible_name("Photograph")
            .on_hover_text("The photograph that is shown (arrow keys go on and back)");
        let next = ui.button(">").on_hover_text("The next photograph (right arrow)");
        let on = on | super::super::numbers::named(next, "Next photograph".into()).clicked();
        if back {
            page.shot = (page.shot + count - 1) % count;
        }
        if on {
            page.shot = (page.shot + 1) % count;
        }
        ui.weak(format!("{} of {count}", page.shot + 1));
        let overlays = &mut page.overlays;
        ui.toggle_value(&mut overlays.edges, "Edges")
            .on_hover_text("The mesh's edges, drawn with the imported camera and its lens");
        ui.toggle_value(&mut overlays.hidden, "Hidden edges")
            .on_hover_text("Edges behind other surfaces, too");
        if !import.points.is_empty() {
            ui.toggle_value(&mut overlays.points, "Points").on_hover_text(
                "COLMAP's points: a blue ring where one was observed, a magenta line to where the \
                 imported camera puts it",
            );
        }
        ui.toggle_value(&mut page.measuring.is_on, "Measure").on_hover_text(
            "Measure between two places that are clicked, and set the scale by what that is in \
             truth",
        );
    });
    if page.measuring.is_on {
        measure::measure_ui(ui, page);
    }
    let Some(check) = page.check.clone().filter(|check| check.shot == page.shot) else {
        ui.centered_and_justified(|ui| ui.weak("Reading the photograph…"));
        return;
    };
    if !check.marks.is_empty() {
        let unseen = check.marks.iter().filter(|mark| mark.projected.is_none()).count();
        let unseen = match unseen {
            0 => String::new(),
            some => format!("; {some} outside the picture"),
        };
        ui.label(format!(
            "{}: median residual {:.2} px, worst {:.2} px{unseen}",
            counted(check.marks.len(), "point", "points"),
            check.median_px,
            check.worst_px
        ))
        .on_hover_text("Distance of each projected point from where it was observed");
    }
    draw(ui, page, &check);
}

fn draw(ui: &mut egui::Ui, page: &mut ImportPage, check: &Arc<ShotCheck>) {
    let Some(camera) = page.import.as_ref().and_then(|own| own.shots.get(check.shot)) else {
        return;
    };
    let camera = camera.camera;
    let room = ui.available_rect_before_wrap();
    let size = vec2(camera.width as f32, camera.height as f32);
    let scale = (room.width() / size.x).min(room.height() / size.y).max(1e-3);
    let rect = Rect::from_center_size(room.center(), size * scale);
    let response = ui.allocate_rect(rect, Sense::click());
    let name = "Photograph with the mesh over it";
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, name));
    let painter = ui.painter_at(rect);
    match &check.picture {
        Some(Ok(shown)) => {
            let is_old = page.texture.as_ref().is_none_or(|(of, _)| !Arc::ptr_eq(of, check));
            if is_old {
                let pixels = shown.pixels.iter().map(|[r, g, b]| Color32::from_rgb(*r, *g, *b));
                let image = ColorImage::new([shown.width, shown.height], pixels.collect());
                let options = egui::TextureOptions::LINEAR;
                let texture = ui.ctx().load_texture("import photograph", image, options);
                page.texture = Some((check.clone(), texture));
            }
            if let Some((_, texture)) = &page.texture {
                // Pixels beyond the last whole square are not shown, and not stretched into.
                let covered =
                    vec2((shown.width * shown.step) as f32, (shown.height * shown.step) as f32)
                        * scale;
                let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
                let place = Rect::from_min_size(rect.min, covered.min(rect.size()));
                painter.image(texture.id(), place, whole, Color32::WHITE);
            }
        }
        Some(Err(_)) | None => {
            painter.rect_filled(rect, 0.0, ui.visuals().extreme_bg_color);
            let text = match &check.picture {
                Some(Err(problem)) => problem.as_str(),
                _ => "The photograph was not found; this is what its camera sees.",
            };
            let label = egui::Label::new(egui::RichText::new(text).weak()).wrap();
            ui.put(rect.shrink2(vec2(0.2, 0.4) * rect.size()), label);
        }
    }
    measure::click(ui, page, &response, (rect, scale));
    let at = |p: glam::Vec2| rect.min + vec2(p.x, p.y) * scale;
    let line = |points: &[glam::Vec2]| points.iter().map(|p| at(*p)).collect::<Vec<Pos2>>();
    let overlays = page.overlays;
    let under = Stroke::new(3.2, Color32::from_black_alpha(70));
    let drawn = |hidden: bool| check.strokes.iter().filter(move |own| own.is_hidden == hidden);
    if overlays.edges && overlays.hidden {
        for stroke in drawn(true) {
            painter.line(line(&stroke.points), Stroke::new(1.0, EDGE.gamma_multiply(0.4)));
        }
    }
    if overlays.edges {
        // A dark rim keeps them visible on bright walls; many of them need none.
        if check.strokes.len() < 4000 {
            for stroke in drawn(false) {
                painter.line(line(&stroke.points), under);
            }
        }
        for stroke in drawn(false) {
            painter.line(line(&stroke.points), Stroke::new(1.6, EDGE));
        }
    }
    if overlays.points {
        let step = check.marks.len().div_ceil(MOST_MARKS).max(1);
        for mark in check.marks.iter().step_by(step) {
            let observed = at(mark.observed);
            painter.circle_stroke(observed, 3.5, Stroke::new(1.2, OBSERVED));
            if let Some(projected) = mark.projected {
                let to = at(projected);
                painter.line_segment([observed, to], Stroke::new(1.5, PROJECTED));
                painter.circle_filled(to, 1.5, PROJECTED);
            }
        }
    }
    measure::draw(&painter, page, &camera, (rect, scale));
}
