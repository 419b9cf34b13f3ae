//! Thumbnails of the photographs; a click shows one.

use eframe::egui::{self, Align2, Color32, FontId, Pos2, Rect, Sense, Stroke as Line, pos2, vec2};

use crate::app::modelling::{ModelPage, Picture};
use crate::app::theme;
use crate::model::Model;

const HEIGHT: f32 = 64.0;

pub fn thumbs_ui(ui: &mut egui::Ui, page: &mut ModelPage, model: &Model) {
    ui.add_space(2.0);
    egui::ScrollArea::horizontal().auto_shrink(false).show(ui, |ui| {
        ui.horizontal(|ui| {
            for index in 0..model.photographs.len() {
                thumb_ui(ui, page, model, index);
            }
        });
    });
}

fn thumb_ui(ui: &mut egui::Ui, page: &mut ModelPage, model: &Model, index: usize) {
    let photograph = &model.photographs[index];
    let (width, height) = (photograph.size.0 as f32, photograph.size.1 as f32);
    let size = vec2((HEIGHT * width / height).clamp(24.0, 3.0 * HEIGHT), HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let label = format!("Photograph {}", photograph.name);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &label));
    let strokes = model.strokes.iter().filter(|own| own.photograph() == Some(index)).count();
    let report = page
        .solution()
        .and_then(|own| own.photographs.iter().find(|own| own.photograph == index))
        .map(|own| own.rms_px);
    let painter = ui.painter_at(rect.expand(2.0));
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let mut problem = None;
    match page.pictures.small(index) {
        Some(Picture::Shown(texture, _)) => {
            let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            painter.image(texture.id(), rect, whole, Color32::WHITE);
        }
        Some(Picture::Failed(text)) => {
            let font = FontId::proportional(22.0);
            let color = ui.visuals().error_fg_color;
            painter.text(rect.center(), Align2::CENTER_CENTER, "!", font, color);
            problem = Some(text.clone());
        }
        None => {}
    }
    // What is known of its camera, on a dark ground.
    let bar = Rect::from_min_max(pos2(rect.min.x, rect.max.y - 15.0), rect.max);
    painter.rect_filled(bar, 0.0, Color32::from_black_alpha(170));
    let text = match report {
        Some(_) if strokes == 0 => "found".to_owned(),
        Some(off) => format!("{off:.2} px"),
        None if strokes == 0 => "nothing drawn".to_owned(),
        None => "not placed".to_owned(),
    };
    let font = FontId::proportional(11.0);
    let galley = painter.layout_no_wrap(text.clone(), font, Color32::WHITE);
    let place = Align2::CENTER_CENTER.anchor_size(bar.center(), galley.size());
    painter.galley(place.min, galley, Color32::WHITE);
    let is_on = index == page.shown;
    let edge = match is_on {
        true => Line::new(2.5, theme::ACCENT),
        false if response.hovered() => Line::new(1.5, ui.visuals().strong_text_color()),
        false => Line::new(1.0, ui.visuals().widgets.noninteractive.bg_stroke.color),
    };
    painter.rect_stroke(rect, 2.0, edge, egui::StrokeKind::Outside);
    let mut help = format!("{}\n{strokes} strokes, {text} (PageUp, PageDown)", photograph.name);
    if let Some(problem) = problem {
        help.push_str(&format!("\n{problem}"));
    }
    if response.on_hover_text(help).clicked() {
        page.show(index);
    }
}
