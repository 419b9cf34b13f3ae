//! The command palette, which finds every command by a few letters of its name.

use eframe::egui::{self, Align2, Key, Modifiers};

use crate::app::actions::Action;
use crate::app::commands;
use crate::app::state::State;

pub fn palette_ui(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let Some(mut palette) = state.dialogs.palette.take() else { return };
    let key = |key| ctx.input_mut(|input| input.consume_key(Modifiers::NONE, key));
    let (down, up, enter) = (key(Key::ArrowDown), key(Key::ArrowUp), key(Key::Enter));
    let mut open = !key(Key::Escape);
    let mut entries: Vec<(String, &str, Option<String>, Action)> = commands::all()
        .iter()
        .filter(|command| command.is_enabled(state))
        .filter(|command| command.action != Action::ShowPalette)
        .map(|command| {
            let key = command.key.as_ref().map(|key| ctx.format_shortcut(key));
            let name = format!("{}: {}", command.menu.name(), command.label(state));
            (name, command.help, key, command.action.clone())
        })
        .collect();
    for path in &state.settings.recent {
        let name = format!("Open {}", path.display());
        entries.push((name, "Recently open", None, Action::Open(path.clone())));
    }
    entries.retain(|(name, ..)| matches(name, &palette.text));
    if down {
        palette.chosen += 1;
    }
    if up {
        palette.chosen = palette.chosen.saturating_sub(1);
    }
    palette.chosen = palette.chosen.min(entries.len().saturating_sub(1));
    let mut chosen = enter.then_some(palette.chosen);
    let width = (ctx.content_rect().width() - 60.0).min(520.0);
    let area = egui::Area::new(egui::Id::unique("palette"))
        .order(egui::Order::Foreground)
        .anchor(Align2::CENTER_TOP, [0.0, 60.0]);
    let response = area.show(ctx, |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_width(width);
            let field = egui::TextEdit::singleline(&mut palette.text)
                .hint_text("Search commands")
                .desired_width(f32::INFINITY);
            let response = ui.add(field).on_hover_text("Search commands");
            response.request_focus();
            if response.changed() {
                palette.chosen = 0;
            }
            // Ten of them, as far as the window has room.
            let row = ui.spacing().interact_size.y + ui.spacing().item_spacing.y;
            let height = (ctx.content_rect().height() - 130.0).clamp(80.0, 10.0 * row);
            egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(
                ui,
                |ui| {
                    for (index, (name, help, key, _)) in entries.iter().enumerate() {
                        let selected = index == palette.chosen;
                        let mut button = egui::Button::selectable(selected, name.as_str())
                            .truncate()
                            .min_size(egui::vec2(ui.available_width(), 0.0));
                        if let Some(key) = key {
                            button = button.shortcut_text(key.as_str());
                        }
                        let response = ui.add(button).on_hover_text(*help);
                        if selected && (down || up) {
                            response.scroll_to_me(None);
                        }
                        if response.clicked() {
                            chosen = Some(index);
                        }
                    }
                    if entries.is_empty() {
                        ui.weak("Nothing that can be done now has this name.");
                    }
                },
            );
        });
    });
    let beside = ctx.input(|input| {
        input.pointer.any_pressed()
            && input.pointer.interact_pos().is_some_and(|at| !response.response.rect.contains(at))
    });
    if let Some(index) = chosen {
        actions.extend(entries.into_iter().nth(index).map(|(.., action)| action));
        open = false;
    }
    if open && !beside {
        state.dialogs.palette = Some(palette);
    }
}

/// Whether every word that was typed is in the name.
fn matches(name: &str, typed: &str) -> bool {
    let name = name.to_lowercase();
    typed.to_lowercase().split_whitespace().all(|word| name.contains(word))
}
