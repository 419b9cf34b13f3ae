//! A field for a path: while nobody types in it, a path too long for it shows its end, which tells
//! one from another, behind an ellipsis.

use std::sync::Arc;

use eframe::egui::{self, FontSelection, Galley, Id, TextBuffer, TextEdit};

/// What an edit keeps free at both ends, in points.
const MARGIN: f32 = 4.0;

pub fn path_edit(ui: &mut egui::Ui, id: Id, text: &mut String) -> egui::Response {
    let room = ui.available_width() - 2.0 * MARGIN;
    let is_typed_in = ui.memory(|memory| memory.has_focus(id));
    let mut lay = |ui: &egui::Ui, text: &dyn TextBuffer, _: f32| {
        let whole = laid(ui, text.as_str().to_owned());
        if is_typed_in || whole.size().x <= room {
            return whole;
        }
        let ellipsis = laid(ui, "…".to_owned()).size().x;
        laid(ui, format!("…{}", end(&whole, text.as_str(), room - ellipsis)))
    };
    let edit = TextEdit::singleline(text).id(id).margin(egui::vec2(MARGIN, 2.0));
    ui.add(edit.desired_width(f32::INFINITY).layouter(&mut lay))
}

/// As much of the end of `text`, laid out in `whole`, as is no wider than `room`.
fn end<'a>(whole: &Galley, text: &'a str, room: f32) -> &'a str {
    let from = whole.size().x - room;
    let glyphs = whole.rows.iter().flat_map(|row| &row.glyphs);
    let left_out = glyphs.take_while(|glyph| glyph.pos.x < from).count();
    text.char_indices().nth(left_out).map_or("", |(start, _)| &text[start..])
}

fn laid(ui: &egui::Ui, text: String) -> Arc<Galley> {
    let font = FontSelection::Default.resolve(ui.style());
    let color = ui.visuals().widgets.inactive.text_color();
    ui.ctx().fonts_mut(|fonts| fonts.layout_no_wrap(text, font, color))
}
