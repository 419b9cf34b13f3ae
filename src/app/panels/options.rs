//! Controls for every option, generated from its declaration.

use eframe::egui;

use super::numbers::named;
use crate::app::actions::Action;
use crate::app::change::Change;
use crate::app::entry::{self, Unit};
use crate::app::project::Project;
use crate::options::{Declaration, Kind};
use crate::reconstruct::Options;

/// Room for the button that resets an option.
const RESET: f32 = 56.0;

/// What the sections of options are called.
pub fn section_title(section: &str) -> &str {
    match section {
        "general" => "General",
        "photographs" => "Photographs",
        "samples" => "Samples",
        "lights" => "Virtual lights",
        "lobes" => "Lobes",
        "transport" => "Transport",
        "joint" => "Joint solve",
        "refine" => "Alternation",
        "gloss" => "Gloss",
        "textures" => "Textures",
        other => other,
    }
}

/// Whether a section's options matter to the method that is chosen.
pub fn is_used(section: &str, options: &Options) -> bool {
    let joint = options.get("general", "method").as_deref() == Some("joint");
    match section {
        "joint" => joint,
        "lights" | "lobes" | "refine" => !joint,
        _ => true,
    }
}

/// One option: name, control, reset. A changed value is marked.
pub fn option_ui(
    ui: &mut egui::Ui,
    project: &Project,
    declaration: &Declaration,
    actions: &mut Vec<Action>,
) {
    let Declaration { section, name, .. } = *declaration;
    let Some(text) = project.edit().options.get(section, name) else { return };
    if let Some(text) = choice_row(ui, declaration, &text) {
        actions.push(Action::Change(Change::Option { section, name, text }));
    }
}

/// The row of one option whose value is `text`; the new value where it was changed.
pub fn choice_row(ui: &mut egui::Ui, declaration: &Declaration, text: &str) -> Option<String> {
    let changed = text != declaration.default;
    let mut new = None;
    let help = help(declaration);
    ui.horizontal(|ui| {
        let title = title(declaration.name);
        let mark = if changed {
            egui::RichText::new(format!("{title} *")).strong()
        } else {
            egui::RichText::new(&title)
        };
        let width = (0.42 * ui.available_width()).min(118.0);
        let size = egui::vec2(width, ui.spacing().interact_size.y);
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        let label = ui.allocate_ui_with_layout(size, layout, |ui| {
            ui.set_min_width(size.x);
            ui.add(egui::Label::new(mark).truncate()).on_hover_text(&help)
        });
        let label = label.inner;
        let response = control(ui, declaration, text, changed, &mut new);
        if let Some(response) = response {
            response.on_hover_text(&help).labelled_by(label.id);
        }
        if !declaration.unit.is_empty() {
            ui.add(egui::Label::new(egui::RichText::new(declaration.unit).weak()).truncate());
        }
        if changed {
            let default = &declaration.default;
            let reset =
                ui.small_button("Reset").on_hover_text(format!("Reset {title} to {default}"));
            if named(reset, format!("Reset {title}")).clicked() {
                new = Some(default.clone());
            }
        }
    });
    new
}

fn control(
    ui: &mut egui::Ui,
    declaration: &Declaration,
    text: &str,
    changed: bool,
    new: &mut Option<String>,
) -> Option<egui::Response> {
    match declaration.kind {
        Kind::Switch => {
            let mut on = text == "true";
            let response = ui.add(egui::Checkbox::without_text(&mut on));
            if response.changed() {
                *new = Some(on.to_string());
            }
            Some(response)
        }
        Kind::Choice(names) => {
            let combo =
                egui::ComboBox::from_id_salt((declaration.section, declaration.name)).truncate();
            // The reset stands beside it.
            let room = ui.available_width() - if changed { RESET } else { 0.0 };
            let shown = combo.selected_text(text).width(room.min(110.0)).show_ui(ui, |ui| {
                for name in names {
                    if ui.selectable_label(text == *name, *name).clicked() && text != *name {
                        *new = Some((*name).to_owned());
                    }
                }
            });
            Some(shown.response)
        }
        Kind::Integer => {
            let response = number(ui, declaration, text, true)?;
            if let Some(value) = response.1 {
                *new = Some(format!("{value:.0}"));
            }
            Some(response.0)
        }
        Kind::Number => {
            let response = number(ui, declaration, text, false)?;
            if let Some(value) = response.1 {
                *new = Some(value.to_string());
            }
            Some(response.0)
        }
        Kind::NumberOrAuto => {
            let mut auto = text == "auto";
            let switch = ui.checkbox(&mut auto, "auto").on_hover_text("Let the program choose");
            switch.widget_info(|| {
                let name = format!("{}, auto", title(declaration.name));
                egui::WidgetInfo::selected(egui::Role::CheckBox, true, auto, name)
            });
            if switch.changed() {
                let (low, high) = declaration.range.unwrap_or((0.0, 1.0));
                let value = if low <= 0.1 && 0.1 <= high { 0.1 } else { low };
                *new = Some(if auto { "auto".to_owned() } else { value.to_string() });
            }
            if text == "auto" {
                return None;
            }
            let response = number(ui, declaration, text, false)?;
            if let Some(value) = response.1 {
                *new = Some(value.to_string());
            }
            Some(response.0)
        }
    }
}

/// A slider where the range is one that a hand can cover, else a draggable number; with the new
/// value, if any.
fn number(
    ui: &mut egui::Ui,
    declaration: &Declaration,
    text: &str,
    whole: bool,
) -> Option<(egui::Response, Option<f64>)> {
    let before: f64 = text.parse().ok()?;
    let unit = if declaration.unit == "m" { Unit::Length } else { Unit::Plain };
    let (low, high) = declaration.range.unwrap_or((f64::MIN, f64::MAX));
    let mut value = before;
    // At a large scale there is no room for a slider and a reset beside it.
    let narrow = ui.available_width() > 150.0 && high - low <= if whole { 40.0 } else { 3.0 };
    let response = if narrow {
        // Only values that the user sets are rounded and kept within the range.
        let slider =
            egui::Slider::new(&mut value, low..=high).clamping(egui::SliderClamping::Edits);
        ui.spacing_mut().slider_width = 60.0;
        let slider = if whole { slider.integer() } else { slider };
        entry::slider(ui, slider, Unit::Plain)
    } else {
        let speed =
            if whole { (0.01 * before.abs()).max(0.2) } else { (0.01 * before.abs()).max(1e-4) };
        let field = egui::DragValue::new(&mut value).range(low..=high).speed(speed);
        let field = if whole { field.max_decimals(0) } else { field.max_decimals(6) };
        entry::number(ui, field, unit)
    };
    if whole {
        value = value.round();
    }
    let changed = response.changed() && value != before;
    Some((response, changed.then_some(value)))
}

/// An option's name as words.
pub fn title(name: &str) -> String {
    let words = name
        .trim_end_matches("_px")
        .trim_end_matches("_m")
        .trim_end_matches("_secs")
        .replace('_', " ");
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn help(declaration: &Declaration) -> String {
    let mut help = declaration.help.clone();
    if let Some((low, high)) = declaration.range {
        help.push_str(&format!(" From {low} to {high}"));
        if !declaration.unit.is_empty() {
            help.push_str(&format!(" {}", declaration.unit));
        }
        help.push('.');
    }
    help.push_str(&format!(" Default {}.", declaration.default));
    help.push_str(&format!(" In the terminal --{}", declaration.flag()));
    help
}
