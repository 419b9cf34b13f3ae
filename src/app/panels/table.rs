//! A table of many rows, sorted by a click on a column's head. Only visible rows are laid out, and
//! the order is computed again only when the rows or the column change.

use std::cmp::Ordering;

use eframe::egui::{self, Align, Layout, Sense};
use egui_extras::{Column, TableBuilder};

#[derive(Default)]
pub struct TableState {
    /// Column, and whether the largest come first.
    sort: Option<(usize, bool)>,
    order: Vec<u32>,
    /// Of which rows and sorting the order is.
    order_of: Option<(usize, Option<(usize, bool)>)>,
    /// Scroll to the selected row.
    pub follow: bool,
}

pub struct Head {
    pub name: &'static str,
    pub help: &'static str,
    pub width: f32,
}

/// A column's head.
pub const fn head(name: &'static str, width: f32, help: &'static str) -> Head {
    Head { name, help, width }
}

pub struct Rows<'a> {
    /// Tells rows of different products apart.
    pub identity: usize,
    pub count: usize,
    pub selected: Option<usize>,
    /// Orders two rows by a column, smallest first.
    pub compare: &'a dyn Fn(usize, usize, usize) -> Ordering,
}

/// Draws the table; `cell` fills a row's column. Gives the row that was clicked.
pub fn table_ui(
    ui: &mut egui::Ui,
    name: &str,
    state: &mut TableState,
    heads: &[Head],
    rows: &Rows,
    mut cell: impl FnMut(&mut egui::Ui, usize, usize),
) -> Option<usize> {
    let key = (rows.identity ^ rows.count.rotate_left(32), state.sort);
    if state.order_of != Some(key) {
        state.order_of = Some(key);
        state.order = (0..rows.count as u32).collect();
        if let Some((column, largest_first)) = state.sort {
            state.order.sort_by(|a, b| {
                let order = (rows.compare)(column, *a as usize, *b as usize);
                if largest_first { order.reverse() } else { order }
            });
        }
    }
    let mut clicked = None;
    let height = ui.text_style_height(&egui::TextStyle::Body) + 2.0;
    let follow = std::mem::take(&mut state.follow)
        .then(|| state.order.iter().position(|row| Some(*row as usize) == rows.selected))
        .flatten();
    egui::ScrollArea::horizontal().id_salt((name, "across")).show(ui, |ui| {
        let mut builder = TableBuilder::new(ui)
            .id_salt(name)
            .striped(true)
            .sense(Sense::click())
            .auto_shrink(false)
            .cell_layout(Layout::left_to_right(Align::Center));
        for head in heads {
            builder = builder
                .column(Column::initial(head.width).at_least(28.0).resizable(true).clip(true));
        }
        if let Some(row) = follow {
            builder = builder.scroll_to_row(row, None);
        }
        builder
            .header(height + 4.0, |mut row| {
                for (column, head) in heads.iter().enumerate() {
                    row.col(|ui| header(ui, state, column, head));
                }
            })
            .body(|body| {
                body.rows(height, state.order.len(), |mut row| {
                    let index = state.order[row.index()] as usize;
                    row.set_selected(rows.selected == Some(index));
                    for column in 0..heads.len() {
                        row.col(|ui| {
                            ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Truncate);
                            ui.style_mut().interaction.selectable_labels = false;
                            cell(ui, index, column);
                        });
                    }
                    let response = row.response();
                    response.widget_info(|| {
                        let selected = rows.selected == Some(index);
                        // For those who do not see its place.
                        let name = format!("{name} row {index}");
                        egui::WidgetInfo::selected(egui::Role::Row, true, selected, name)
                    });
                    if response.clicked() {
                        clicked = Some(index);
                    }
                });
            });
    });
    clicked
}

fn header(ui: &mut egui::Ui, state: &mut TableState, column: usize, head: &Head) {
    let sorted = state.sort.filter(|(own, _)| *own == column).map(|(_, largest)| largest);
    let text = egui::RichText::new(head.name).strong();
    let button = egui::Button::new(text).frame(false).truncate();
    if let Some(largest_first) = sorted {
        sort_mark(ui, largest_first);
    }
    let help = format!("{}. Click to sort.", head.help);
    if ui.add(button).on_hover_text(help).clicked() {
        // Largest first, then smallest, then as they come.
        state.sort = match sorted {
            None => Some((column, true)),
            Some(true) => Some((column, false)),
            Some(false) => None,
        };
    }
}

/// A triangle that points the way the values grow.
fn sort_mark(ui: &mut egui::Ui, largest_first: bool) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(8.0, 8.0), Sense::hover());
    let (tip, base) =
        if largest_first { (rect.bottom(), rect.top()) } else { (rect.top(), rect.bottom()) };
    let corners = vec![
        egui::pos2(rect.left(), base),
        egui::pos2(rect.right(), base),
        egui::pos2(rect.center().x, tip),
    ];
    let color = ui.visuals().text_color();
    ui.painter().add(egui::Shape::convex_polygon(corners, color, egui::Stroke::NONE));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hundred_thousand_rows_are_laid_out_by_what_is_in_sight() {
        let ctx = egui::Context::default();
        let mut state = TableState { sort: Some((0, true)), ..TableState::default() };
        let values: Vec<f64> = (0..100_000u32).map(|i| f64::from(i * 7919 % 100_003)).collect();
        let compare = |_: usize, a: usize, b: usize| values[a].total_cmp(&values[b]);
        let rows = Rows { identity: 1, count: values.len(), selected: Some(3), compare: &compare };
        let heads = [head("Value", 80.0, "A number")];
        let mut laid_out = 0;
        let _ = ctx.run_ui(egui::RawInput::default(), |ui| {
            laid_out = 0;
            table_ui(ui, "test", &mut state, &heads, &rows, |ui, row, _| {
                laid_out += 1;
                ui.label(values[row].to_string());
            });
        });
        assert!(laid_out > 0 && laid_out < 2000, "{laid_out}");
        let order: Vec<f64> = state.order.iter().map(|&row| values[row as usize]).collect();
        assert!(order.windows(2).all(|pair| pair[0] >= pair[1]));
    }
}
