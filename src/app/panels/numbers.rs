//! The format of numbers, colours and names, the same in every panel.

use std::time::Duration;

use eframe::egui::{self, Color32, Sense, Stroke, StrokeKind, vec2};

use crate::app::project::Project;
use crate::app::viewport::material_color;
use crate::math::rgb::{Radiance, Rgb};

/// A number in at most about seven characters.
pub fn short(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if !value.is_finite() {
        "not finite".to_owned()
    } else if !(1e-3..1e5).contains(&size) {
        format!("{value:.2e}")
    } else if size < 10.0 {
        format!("{value:.3}")
    } else if size < 1000.0 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    }
}

pub fn rgb(values: Rgb) -> String {
    values.map(short).join(" / ")
}

/// Seconds as a person says them.
pub fn duration(secs: f64) -> String {
    // Rounded first: 119.7 s are two minutes, not 1 min 60 s.
    let whole = secs.round() as u64;
    if secs < 9.95 {
        format!("{secs:.1} s")
    } else if whole < 100 {
        format!("{whole} s")
    } else {
        format!("{} min {:02} s", whole / 60, whole % 60)
    }
}

/// How long ago something was.
pub fn ago(elapsed: Duration) -> String {
    let minutes = elapsed.as_secs() / 60;
    match minutes {
        0 => "just now".to_owned(),
        1..60 => format!("{} ago", counted(minutes as usize, "minute", "minutes")),
        60..1440 => format!("{} ago", counted(minutes as usize / 60, "hour", "hours")),
        _ => format!("{} ago", counted(minutes as usize / 1440, "day", "days")),
    }
}

/// A count with thousands set apart.
pub fn count(value: usize) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('\u{a0}');
        }
        text.push(digit);
    }
    text
}

pub fn counted(value: usize, one: &str, many: &str) -> String {
    format!("{} {}", count(value), if value == 1 { one } else { many })
}

/// Radiance on the screen; `exposure` is the factor to its 0 to 1.
pub fn exposed(radiance: Radiance, exposure: f32) -> Color32 {
    let [r, g, b] = radiance.map(|value| (value * exposure).clamp(0.0, 1.0));
    egui::Rgba::from_rgb(r, g, b).into()
}

/// A linear reflectance as the screen shows it.
pub fn reflectance_color(diffuse: Rgb) -> Color32 {
    let [r, g, b] = diffuse.map(|value| value.clamp(0.0, 1.0) as f32);
    egui::Rgba::from_rgb(r, g, b).into()
}

/// Radiances with their brightest channel at full, for a hue.
pub fn emission_color(emission: Rgb) -> Color32 {
    let largest = emission.into_iter().fold(0.0, f64::max);
    if largest > 0.0 {
        reflectance_color(emission.map(|value| value / largest))
    } else {
        Color32::BLACK
    }
}

/// The colour of a material of the edited list; grey for one that has no surfaces.
pub fn list_color(project: &Project, material: usize) -> Color32 {
    let is_found = project.edit().reconstructed(material).is_some();
    if is_found { material_color(material) } else { Color32::from_gray(128) }
}

/// A number with so many decimals, never as a negative zero.
pub fn fixed(value: f32, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.starts_with('-') && text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.'));
    if is_zero { text[1..].to_owned() } else { text }
}

/// A position or direction.
pub fn triple(v: glam::Vec3, decimals: usize) -> String {
    [v.x, v.y, v.z].map(|value| fixed(value, decimals)).join(" ")
}

/// A check mark, painted: not every font has one.
pub fn check_mark(ui: &mut egui::Ui) {
    let (rect, response) = ui.allocate_exact_size(vec2(14.0, 14.0), Sense::hover());
    let stroke = Stroke::new(2.0, ui.visuals().text_color());
    let at = |x: f32, y: f32| rect.min + vec2(x, y);
    let corners = vec![at(2.0, 7.5), at(5.5, 11.0), at(12.0, 3.5)];
    ui.painter().add(egui::Shape::line(corners, stroke));
    response.on_hover_text("Done");
}

/// Selectable text that begins at the left of a row it fills.
pub fn left(text: impl Into<egui::WidgetText>) -> (egui::WidgetText, egui::Atom<'static>) {
    (text.into(), egui::Atom::grow())
}

/// Gives a button a name of its own, for those who do not see what stands beside it.
pub fn named(button: egui::Response, name: String) -> egui::Response {
    button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, button.enabled(), &name));
    button
}

/// A small filled square.
pub fn swatch(ui: &mut egui::Ui, color: Color32) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(vec2(12.0, 12.0), Sense::hover());
    let edge = Stroke::new(1.0, ui.visuals().widgets.noninteractive.bg_stroke.color);
    ui.painter().rect(rect, 2.0, color, edge, StrokeKind::Inside);
    response
}

/// A label that is cut rather than wrapped, its whole text on hover.
pub fn cut(ui: &mut egui::Ui, text: impl Into<egui::WidgetText>) -> egui::Response {
    ui.add(egui::Label::new(text).truncate())
}

/// Shows what needs a height, in points; in a lower panel it is scrolled instead of squeezed.
pub fn at_least(ui: &mut egui::Ui, height: f32, add: impl FnOnce(&mut egui::Ui)) {
    if ui.available_height() >= height {
        return add(ui);
    }
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.allocate_ui(egui::vec2(ui.available_width(), height), add);
    });
}

/// A grey line in place of what is not there yet.
pub fn empty(ui: &mut egui::Ui, text: &str) {
    ui.add_space(8.0);
    ui.weak(text);
}

/// Says that what is shown belongs to other tags or options.
pub fn outdated(ui: &mut egui::Ui, project: &Project) {
    if project.run.is_none() && project.is_outdated() {
        let color = ui.visuals().warn_fg_color;
        ui.colored_label(color, "Outdated").on_hover_text(
            "Tags or options were changed since these numbers were found. Run again to renew them.",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_short_and_legible() {
        assert_eq!(
            [0.0, 0.12345, -12.345, 1234.6, 123456.0, 1e-5, f64::NAN].map(short),
            ["0", "0.123", "-12.3", "1235", "1.23e5", "1.00e-5", "not finite"]
        );
        assert_eq!([7, 1234, 1234567].map(count), ["7", "1\u{a0}234", "1\u{a0}234\u{a0}567"]);
        assert_eq!([3.12, 42.0, 125.0].map(duration), ["3.1 s", "42 s", "2 min 05 s"]);
        assert_eq!([9.97, 99.6, 119.7].map(duration), ["10 s", "1 min 40 s", "2 min 00 s"]);
        let ago = |secs| ago(Duration::from_secs(secs));
        assert_eq!(
            [5, 60, 7300, 200_000].map(ago),
            ["just now", "1 minute ago", "2 hours ago", "2 days ago"]
        );
    }
}
