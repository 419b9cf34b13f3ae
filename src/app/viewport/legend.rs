//! The legend of the colours, in the lower left corner.

use std::sync::Arc;

use eframe::egui::{self, Color32, Galley, Painter, Pos2, Rect, TextStyle, Ui, pos2, vec2};

use crate::app::viewport::content::{Content, SampleColor, Shading, ToneMapping};
use crate::app::viewport::neutral::neutral;
use crate::app::viewport::{MaterialColors, Viewport, palette};
use crate::math::rgb::srgb_code;
use crate::scene::{Capture, Role, Surface};

const BAR: egui::Vec2 = vec2(176.0, 10.0);
const GAP: f32 = 4.0;
/// Materials that are named; more would cover the view.
const MOST_NAMES: usize = 12;

/// One thing that colours say.
enum Entry {
    /// A bar with a title and the values at its ends.
    Bar {
        title: String,
        low: String,
        high: String,
        color: fn(f32) -> Color32,
    },
    /// A patch of a colour with its name.
    Patch {
        name: String,
        color: Color32,
    },
    Text(String),
}

/// `covered` is the lower end of the toolbar.
pub fn show(view: &Viewport, ui: &Ui, rect: Rect, covered: f32, content: &Content) {
    let painter = ui.painter_at(rect);
    let font = TextStyle::Small.resolve(ui.style());
    let text = ui.visuals().text_color();
    let lay = |text_of: &str| painter.layout_no_wrap(text_of.to_owned(), font.clone(), text);
    let line = lay("0").size().y;
    let height_of = |entry: &Entry| match entry {
        Entry::Bar { .. } => 2.0 * line + BAR.y + 2.0 * GAP,
        Entry::Patch { .. } | Entry::Text(_) => line + GAP,
    };
    let height_of_all = |entries: &[Entry]| entries.iter().map(height_of).sum::<f32>();
    // At least half of what the toolbar leaves stays the scene's.
    let free = rect.bottom() - covered;
    let room = (free - 36.0).min(0.5 * free);
    // Where there is no room for all, names go first and numbers stay.
    let mut names = MOST_NAMES;
    let mut entries = entries(view, content, names);
    while height_of_all(&entries) > room && names > 0 {
        names -= 1;
        entries = self::entries(view, content, names);
    }
    if height_of_all(&entries) > room {
        entries.retain(|entry| matches!(entry, Entry::Bar { .. }));
    }
    let height = height_of_all(&entries);
    if entries.is_empty() || height > room {
        return;
    }
    let width = entries.iter().fold(BAR.x, |width, entry| match entry {
        Entry::Bar { title, .. } => width.max(lay(title).size().x),
        Entry::Patch { name, .. } => width.max(lay(name).size().x + 16.0),
        Entry::Text(words) => width.max(lay(words).size().x),
    });
    let size = vec2(width + 16.0, height + 12.0);
    let low = pos2(rect.left() + 8.0, rect.bottom() - 8.0 - size.y);
    let fill = ui.visuals().window_fill.gamma_multiply(0.88);
    painter.rect_filled(Rect::from_min_size(low, size), 4.0, fill);
    let mut at = low + vec2(8.0, 8.0);
    for entry in &entries {
        draw(&painter, at, entry, &lay, line, text);
        at.y += height_of(entry);
    }
}

fn draw(
    painter: &Painter,
    at: Pos2,
    entry: &Entry,
    lay: &dyn Fn(&str) -> Arc<Galley>,
    line: f32,
    text: Color32,
) {
    match entry {
        Entry::Bar { title, low, high, color } => {
            painter.galley(at, lay(title), text);
            let bar = Rect::from_min_size(at + vec2(0.0, line + 2.0), BAR);
            let mut mesh = egui::Mesh::default();
            const STEPS: u32 = 32;
            for step in 0..=STEPS {
                let t = step as f32 / STEPS as f32;
                let x = bar.left() + t * bar.width();
                mesh.colored_vertex(pos2(x, bar.top()), color(t));
                mesh.colored_vertex(pos2(x, bar.bottom()), color(t));
                if step > 0 {
                    let k = 2 * step;
                    mesh.add_triangle(k - 2, k - 1, k);
                    mesh.add_triangle(k - 1, k, k + 1);
                }
            }
            painter.add(mesh);
            let under = at.y + line + BAR.y + GAP;
            painter.galley(pos2(at.x, under), lay(low), text);
            let high = lay(high);
            painter.galley(pos2(bar.right() - high.size().x, under), high, text);
        }
        Entry::Patch { name, color } => {
            let patch = Rect::from_min_size(at + vec2(0.0, 1.0), vec2(10.0, line - 2.0));
            painter.rect_filled(patch, 2.0, *color);
            painter.galley(at + vec2(16.0, 0.0), lay(name), text);
        }
        Entry::Text(words) => {
            painter.galley(at, lay(words), text);
        }
    }
}

fn entries(view: &Viewport, content: &Content, most_names: usize) -> Vec<Entry> {
    let settings = &view.settings;
    let Some(capture) = &content.capture else { return Vec::new() };
    let mut entries = Vec::new();
    let shows_samples = settings.samples && content.samples.is_some();
    // A photograph that is only displayed has no unit.
    let is_measured = match view.is_looking_through() {
        Some(index) => capture.photographs.get(index).is_some_and(|own| own.image.is_some()),
        None => {
            capture.photographs.iter().all(|own| own.display.is_none())
                || capture.measurements().next().is_some()
        }
    };
    let shows_photographs =
        settings.shading == Shading::Photograph || view.is_looking_through().is_some();
    let shows_radiance = shows_photographs && is_measured
        || (shows_samples && settings.sample_color == SampleColor::Radiance);
    let patch = |name: &str, color| Entry::Patch { name: name.to_owned(), color };
    let names = |capture: &Capture, colors: &MaterialColors| -> Vec<(String, Color32)> {
        let materials = capture.materials.iter().enumerate();
        materials.map(|(index, own)| (own.name.clone(), colors.of(index))).collect()
    };
    let of_surfaces =
        (settings.shading == Shading::Material).then(|| names(capture, &content.colors));
    // Samples keep the materials of their run, which the tags of now may number otherwise.
    let of_samples = content
        .of_results()
        .filter(|_| shows_samples && settings.sample_color == SampleColor::Material)
        .map(|of| names(of, &content.result_colors))
        .filter(|names| of_surfaces.as_ref() != Some(names));
    if let Some(names) = &of_surfaces {
        name_materials(&mut entries, names, most_names);
        if capture.surfaces.iter().any(|surface| surface.role == Role::Untagged) {
            entries.push(patch("striped: no material", Color32::from_rgb(176, 110, 164)));
        }
    }
    if let Some(names) = &of_samples {
        if of_surfaces.is_some() {
            entries.push(Entry::Text("Samples, as their run had it".to_owned()));
        }
        name_materials(&mut entries, names, most_names);
    }
    let is_luminaire = |surface: &Surface| matches!(surface.role, Role::Luminaire(_));
    if matches!(settings.shading, Shading::Material | Shading::Reflectance)
        && capture.surfaces.iter().any(is_luminaire)
    {
        entries.push(patch("luminaire", palette::LUMINAIRE));
    }
    if settings.shading == Shading::Reflectance {
        if view.scene.has_unknown_reflectance() {
            entries.push(patch("striped: none found", Color32::from_gray(117)));
        }
        let title = if content.solved.is_some() {
            "Diffuse reflectance per channel"
        } else {
            "Diffuse reflectance (none found yet)"
        };
        entries.push(Entry::Bar {
            title: title.to_owned(),
            low: "0".to_owned(),
            high: "1".to_owned(),
            color: encoded,
        });
    }
    if shows_radiance {
        let white = 1.0 / view.exposure();
        if settings.tone_mapping == ToneMapping::FalseColor {
            entries.push(Entry::Bar {
                title: "Luminance (photographs' unit, logarithmic)".to_owned(),
                low: number(white / 256.0),
                high: number(white * 4.0),
                color: palette::magnitude,
            });
            entries.push(patch("no measurement (saturated or invalid)", palette::INVALID));
        } else {
            let (high, color): (_, fn(f32) -> Color32) = match settings.tone_mapping {
                ToneMapping::Neutral => (2.0 * white, rolled_off),
                _ => (white, encoded),
            };
            entries.push(Entry::Bar {
                title: "Radiance (photographs' unit)".to_owned(),
                low: "0".to_owned(),
                high: number(high),
                color,
            });
        }
    }
    let shows_lobes = settings.lobes && settings.shading != Shading::Relit;
    if let Some(strongest) = view.scene.strongest_lobe.filter(|_| shows_lobes) {
        let longest = number(strongest);
        entries.push(Entry::Text(format!("Longest lobe: emission {longest} (length ~ root)")));
    }
    if let Some(scale) = view.scene.sample_scale.as_ref().filter(|_| shows_samples) {
        let end = |value: f32| {
            if scale.is_count {
                format!("{value:.0}")
            } else if scale.is_signed {
                format!("{value:+.2}")
            } else {
                number(value)
            }
        };
        entries.push(Entry::Bar {
            title: scale.title.clone(),
            low: end(scale.low),
            high: end(scale.high),
            color: if scale.is_signed {
                |t| palette::signed(2.0 * t - 1.0)
            } else {
                palette::magnitude
            },
        });
    } else if shows_samples && settings.sample_color == SampleColor::Error {
        entries.push(Entry::Text("Errors are unknown before a result".to_owned()));
    }
    entries
}

fn name_materials(entries: &mut Vec<Entry>, names: &[(String, Color32)], most: usize) {
    for (name, color) in names.iter().take(most) {
        entries.push(Entry::Patch { name: name.clone(), color: *color });
    }
    match names.len().saturating_sub(most) {
        0 => {}
        more if most == 0 => entries.push(Entry::Text(format!("{more} materials"))),
        more => entries.push(Entry::Text(format!("and {more} more"))),
    }
}

/// Linear light as the screen shows it.
fn encoded(t: f32) -> Color32 {
    Color32::from_gray(srgb_code(t))
}

/// Greys of PBR Neutral, up to where they are 0.96 of white.
fn rolled_off(t: f32) -> Color32 {
    encoded(neutral([2.0 * t; 3])[0])
}

/// A number with three digits.
fn number(value: f32) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 {
        "0".to_owned()
    } else if !(1e-3..1e5).contains(&magnitude) {
        format!("{value:.2e}")
    } else {
        let digits = (2 - magnitude.log10().floor() as i32).max(0) as usize;
        format!("{value:.digits$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in
            [(0.0, "0"), (1.0, "1.00"), (0.01234, "0.0123"), (123.4, "123"), (4.5e-5, "4.50e-5")]
        {
            assert_eq!(number(value), text);
        }
    }
}
