//! The guide in a window of its own.

use eframe::egui::{self, Button, RichText, TextStyle};

use super::numbers::left;
use crate::app::guide::{Block, GuideView, Page, Span, linked, pages, plain};
use crate::app::keys;
use crate::app::state::State;

pub fn guide_ui(ctx: &egui::Context, state: &mut State) {
    let html = &state.guide_html;
    let Some(view) = &mut state.dialogs.guide else { return };
    // Between the menu and the status bar.
    let room = ctx.content_rect().shrink2(egui::vec2(4.0, 0.0));
    let room =
        egui::Rect::from_x_y_ranges(room.x_range(), room.top() + 30.0..=room.bottom() - 30.0);
    let screen = room.size();
    let mut is_open = true;
    egui::Window::new("Guide")
        .open(&mut is_open)
        .default_pos([244.0, 56.0])
        .default_size([760.0f32.min(screen.x - 56.0), 480.0f32.min(screen.y - 40.0)])
        .max_size([screen.x - 12.0, screen.y - 40.0])
        .constrain_to(room)
        .min_width(260.0)
        .resizable(true)
        .show(ctx, |ui| {
            ui.horizontal(|ui| {
                let field = egui::TextEdit::singleline(&mut view.search)
                    .hint_text("Search the guide")
                    .desired_width(180.0);
                let help = "Show the pages that have this in them";
                view.follow |= ui.add(field).on_hover_text(help).changed();
                if let Some(html) = html {
                    let help = "Open the guide in the browser, with its pictures";
                    if ui.button("Browser").on_hover_text(help).clicked() {
                        let url = format!("file://{}", html.display());
                        ui.ctx().open_url(egui::OpenUrl::new_tab(url));
                    }
                }
            });
            ui.separator();
            let wanted = view.search.trim().to_lowercase();
            let is_narrow = ui.available_width() < 420.0;
            let height = ui.available_height().max(120.0);
            if is_narrow {
                list_ui(ui, view, &wanted, 0.3 * height);
                ui.separator();
                page_ui(ui, view, &wanted);
            } else {
                ui.horizontal_top(|ui| {
                    ui.allocate_ui(egui::vec2(190.0, height), |ui| {
                        ui.vertical(|ui| list_ui(ui, view, &wanted, height));
                    });
                    ui.separator();
                    ui.vertical(|ui| page_ui(ui, view, &wanted));
                });
            }
        });
    if !is_open {
        state.dialogs.guide = None;
    }
}

fn has(page: &Page, wanted: &str) -> bool {
    wanted.is_empty() || page.blocks.iter().any(|block| block.has(wanted))
}

fn list_ui(ui: &mut egui::Ui, view: &mut GuideView, wanted: &str, height: f32) {
    let list = egui::ScrollArea::vertical().id_salt("pages").auto_shrink([false, true]);
    list.max_height(height).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        let mut found = false;
        for (index, page) in pages().iter().enumerate().filter(|(_, page)| has(page, wanted)) {
            found = true;
            let width = ui.available_width();
            let button = Button::selectable(view.page == index, left(page.title.as_str()));
            let response = ui.add(button.truncate().min_size(egui::vec2(width, 0.0)));
            if response.on_hover_text("Read this page").clicked() {
                view.turn(index);
            }
        }
        if !found {
            ui.weak("No page has this in it.");
        }
    });
}

fn page_ui(ui: &mut egui::Ui, view: &mut GuideView, wanted: &str) {
    let Some(page) = pages().get(view.page) else { return };
    let mut area = egui::ScrollArea::vertical().id_salt(("page", view.page)).auto_shrink(false);
    if std::mem::take(&mut view.is_new) {
        area = area.vertical_scroll_offset(0.0);
    }
    let mut follow = std::mem::take(&mut view.follow) && !wanted.is_empty();
    let mut next = None;
    area.show(ui, |ui| {
        ui.set_max_width(ui.available_width() - 8.0);
        for (index, block) in page.blocks.iter().enumerate() {
            let is_found = !wanted.is_empty() && block.has(wanted);
            let own = ui.push_id(index, |ui| {
                let fill = ui.visuals().selection.bg_fill.gamma_multiply(0.25);
                let fill = if is_found { fill } else { egui::Color32::TRANSPARENT };
                egui::Frame::new().fill(fill).show(ui, |ui| next = next.or(block_ui(ui, block)));
            });
            if is_found && std::mem::take(&mut follow) {
                own.response.scroll_to_me(Some(egui::Align::Min));
            }
        }
    });
    if let Some(next) = next {
        view.search.clear();
        view.turn(next);
    }
}

/// Shows a part of a page; the page that was clicked on in it.
fn block_ui(ui: &mut egui::Ui, block: &Block) -> Option<usize> {
    match block {
        Block::Heading(level, spans) => {
            let size = match level {
                1 => 20.0,
                2 => 16.0,
                _ => 14.0,
            };
            if *level > 1 {
                ui.add_space(6.0);
            }
            ui.label(RichText::new(plain(spans)).size(size).strong());
            None
        }
        Block::Text(spans) => {
            let next = spans_ui(ui, spans);
            ui.add_space(4.0);
            next
        }
        Block::Item(depth, mark, spans) => {
            let indent = 14.0 * *depth as f32;
            ui.horizontal_top(|ui| {
                ui.add_space(indent - 10.0);
                ui.allocate_ui(egui::vec2(18.0, 0.0), |ui| {
                    ui.set_min_width(18.0);
                    ui.label(mark.as_str());
                });
                ui.vertical(|ui| spans_ui(ui, spans)).inner
            })
            .inner
        }
        Block::Code(text) => {
            let fill = ui.visuals().extreme_bg_color;
            egui::Frame::new().fill(fill).inner_margin(6.0).show(ui, |ui| {
                egui::ScrollArea::horizontal().show(ui, |ui| {
                    let text = RichText::new(text.as_str()).monospace();
                    ui.add(egui::Label::new(text).extend().selectable(true));
                });
            });
            ui.add_space(4.0);
            None
        }
        Block::Table(rows) => {
            let mut next = None;
            let columns = rows.first().map_or(1, Vec::len).max(1);
            let width = (ui.available_width() / columns as f32 - 12.0).max(90.0);
            egui::ScrollArea::horizontal().show(ui, |ui| {
                let grid = egui::Grid::new("table").num_columns(columns).striped(true);
                grid.spacing([12.0, 4.0]).max_col_width(width).show(ui, |ui| {
                    for row in rows {
                        for cell in row {
                            ui.vertical(|ui| {
                                ui.set_max_width(width);
                                next = next.or(spans_ui(ui, cell));
                            });
                        }
                        ui.end_row();
                    }
                });
            });
            ui.add_space(4.0);
            next
        }
    }
}

/// A text with its looks and links; the page that was clicked on in it.
fn spans_ui(ui: &mut egui::Ui, spans: &[Span]) -> Option<usize> {
    let mut next = None;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 0.0;
        for span in spans {
            let mut text = RichText::new(keys::named(ui.ctx(), &span.text));
            if span.is_strong {
                text = text.strong();
            }
            if span.is_code {
                text = text.text_style(TextStyle::Monospace);
            }
            match &span.link {
                None => drop(ui.label(text)),
                Some(link) => match linked(link) {
                    Some(page) => {
                        if ui.link(text).on_hover_text(pages()[page].title.as_str()).clicked() {
                            next = Some(page);
                        }
                    }
                    None if link.starts_with("http") => drop(ui.hyperlink_to(text, link.as_str())),
                    None => drop(ui.label(text)),
                },
            }
        }
    });
    next
}
