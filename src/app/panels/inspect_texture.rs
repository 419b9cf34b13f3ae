//! The recovered textures of a material (Section 5.5), displayed as pictures.

use std::sync::{Arc, Weak};

use eframe::egui::{self, Color32, ColorImage, TextureHandle, TextureOptions, vec2};

use super::numbers::{count, exposed};
use crate::app::entry::{self, Unit};
use crate::app::pending::Pending;
use crate::app::project::Project;
use crate::app::theme::ACCENT;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::reconstruct::textures::Texture;
use crate::render::scene::Solved;

/// Longest side of a picture, in pixels.
const LONGEST: usize = 384;
/// Pictures that are shown; more would be a wall.
const MOST: usize = 12;

/// A texture as small as it is shown.
struct Small {
    surface: usize,
    /// Of the texture itself, in texels.
    texels: [usize; 2],
    size: [usize; 2],
    /// The mean reflectance, and the part of it that was measured.
    pixels: Vec<(Radiance, f32)>,
    measured: f64,
}

/// The pictures of the material that is shown, until another one is.
#[derive(Default)]
pub struct TextureCache {
    of: Option<(Weak<Solved>, usize)>,
    answer: Option<Pending<Vec<Small>>>,
    small: Vec<Small>,
    /// As exposed now.
    shown: Option<(f32, bool)>,
    pictures: Vec<TextureHandle>,
    /// Stops that the reflectances are brightened by.
    exposure_ev: f32,
    /// Marks what no photograph measures.
    marks_unseen: bool,
}

/// The textures of a material of the results; nothing where it has none.
pub fn textures_ui(
    ui: &mut egui::Ui,
    project: &Project,
    material: usize,
    cache: &mut TextureCache,
) {
    let Some(solved) = &project.products.solved else { return };
    let number = solved.textures.iter().filter(|texture| texture.material == material).count();
    if number == 0 {
        return;
    }
    cache.prepare(solved, material, ui.ctx());
    ui.add_space(6.0);
    ui.weak("Texture").on_hover_text("Diffuse reflectance per texel (Section 5.5)");
    ui.horizontal_wrapped(|ui| {
        let sign = if cache.exposure_ev >= 0.0 { "+" } else { "" };
        let field = egui::DragValue::new(&mut cache.exposure_ev)
            .speed(0.05)
            .range(-4.0..=6.0)
            .fixed_decimals(1)
            .prefix(sign)
            .suffix(" EV");
        let help = "Brightens dark textures, here only; right-click to reset";
        let response = entry::number(ui, field, Unit::Plain)
            .accessible_name("Exposure of the texture")
            .on_hover_text(help);
        if response.secondary_clicked() {
            cache.exposure_ev = 0.0;
        }
        ui.toggle_value(&mut cache.marks_unseen, "Mark unmeasured").on_hover_text(
            "Mark texels that no photograph measures; their values are filled \
                 from their neighbours",
        );
    });
    if cache.answer.is_some() {
        ui.spinner();
        return;
    }
    cache.expose(ui.ctx());
    let width = ui.available_width().min(280.0);
    for (small, picture) in cache.small.iter().zip(&cache.pictures) {
        let surface = project.result_capture().surfaces.get(small.surface);
        let name = surface.map_or("", |surface| surface.name.as_str());
        let [w, h] = small.size.map(|side| side as f32);
        let factor = (width / w).min(220.0 / h);
        let image = egui::Image::new(picture)
            .fit_to_exact_size(vec2(w * factor, h * factor))
            .alt_text(format!("Texture of {name}"));
        ui.add(image).on_hover_text(format!("{name}, as it is unwrapped"));
        let [w, h] = small.texels.map(count);
        let measured = (100.0 * small.measured).round();
        ui.label(format!("{name}: {w} × {h} texels, {measured} % measured"));
    }
    if number > MOST {
        ui.weak(format!("and {} more", count(number - MOST)));
    }
}

impl TextureCache {
    /// Has the pictures made on a thread where another material is shown than before.
    fn prepare(&mut self, solved: &Arc<Solved>, material: usize, ctx: &egui::Context) {
        let is_known = self.of.as_ref().is_some_and(|(of, own)| {
            *own == material && std::ptr::eq(of.as_ptr(), Arc::as_ptr(solved))
        });
        if !is_known {
            self.of = Some((Arc::downgrade(solved), material));
            (self.shown, self.small, self.pictures) = (None, Vec::new(), Vec::new());
            let textures = solved.textures.clone();
            let work = move || {
                let own = textures.iter().filter(|texture| texture.material == material);
                own.take(MOST).map(small).collect()
            };
            // Where nothing comes there are no pictures, and the numbers above stay.
            self.answer = Some(Pending::start("texture", ctx, work));
        }
        if let Some(small) = Pending::take(&mut self.answer) {
            self.small = small;
        }
    }

    fn expose(&mut self, ctx: &egui::Context) {
        let wanted = (self.exposure_ev, self.marks_unseen);
        if self.shown == Some(wanted) {
            return;
        }
        self.shown = Some(wanted);
        let factor = self.exposure_ev.exp2();
        let picture = |small: &Small| {
            let pixels = small.pixels.iter().enumerate().map(|(index, (radiance, measured))| {
                let is_marked = self.marks_unseen && *measured < 0.5;
                let (x, y) = (index % small.size[0], index / small.size[0]);
                // Stripes, which no texture is taken for.
                if is_marked && (x + y) % 8 < 4 { ACCENT } else { exposed(*radiance, factor) }
            });
            let image = ColorImage::new(small.size, pixels.collect::<Vec<Color32>>());
            ctx.load_texture("texture", image, TextureOptions::LINEAR)
        };
        self.pictures = self.small.iter().map(picture).collect();
    }
}

/// Means over squares of texels.
fn small(texture: &Texture) -> Small {
    let [width, height] = [texture.unwrap.width, texture.unwrap.height];
    let step = width.max(height).div_ceil(LONGEST).max(1);
    let size = [width.div_ceil(step), height.div_ceil(step)];
    let pixel = |index: usize| {
        let (x, y) = (step * (index % size[0]), step * (index / size[0]));
        let (mut sum, mut seen, mut number) = ([0.0; CHANNELS], 0, 0);
        for row in y..(y + step).min(height) {
            for texel in row * width + x..row * width + (x + step).min(width) {
                for (sum, value) in sum.iter_mut().zip(texture.texels[texel]) {
                    *sum += value;
                }
                seen += usize::from(texture.seen[texel]);
                number += 1;
            }
        }
        (sum.map(|sum| sum / number.max(1) as f32), seen as f32 / number.max(1) as f32)
    };
    let measured = texture.seen.iter().filter(|seen| **seen).count() as f64;
    Small {
        surface: texture.surface,
        texels: [width, height],
        size,
        pixels: (0..size[0] * size[1]).map(pixel).collect(),
        measured: measured / texture.seen.len().max(1) as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::unwrap::Unwrap;

    #[test]
    fn pictures_are_means_and_tell_what_was_measured() {
        // 1001 by 2: steps of 3, the last column of two texels.
        let (width, height) = (1001, 2);
        let texels = (0..width * height).map(|k| [(k % width) as f32, 1.0, 0.0]).collect();
        let seen = (0..width * height).map(|k| k % width < 500).collect();
        let unwrap =
            Unwrap { triangles: Vec::new(), corners: Vec::new(), width, height, is_own: true };
        let small = small(&Texture { surface: 3, material: 0, unwrap, texels, seen });
        assert_eq!((small.surface, small.texels, small.size), (3, [1001, 2], [334, 1]));
        assert_eq!(small.pixels[0], ([1.0, 1.0, 0.0], 1.0));
        assert_eq!(small.pixels[333], ([999.5, 1.0, 0.0], 0.0));
        // Texels 498, 499 and 500.
        assert_eq!(small.pixels[166], ([499.0, 1.0, 0.0], 2.0 / 3.0));
        assert!((small.measured - 500.0 / 1001.0).abs() < 1e-12);
    }
}
