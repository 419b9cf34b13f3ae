//! The model's faces over the photograph, in the colours of their materials.

use std::collections::BTreeMap;

use eframe::egui::{self, Color32, ColorImage, Key, Painter, Pos2, Rect, pos2, vec2};

use super::hands::is_asked;
use super::overlay::label;
use super::view::View;
use crate::app::modelling::ModelPage;
use crate::app::panels::materials::found;
use crate::app::panels::numbers::{list_color, reflectance_color};
use crate::app::project::Project;
use crate::app::viewport::material_color;
use crate::worker::Reprojection;

/// The key that shows faces as long as it is held, and what it does.
const KEY: Key = Key::W;
/// What a face that is seen from the side keeps of its colour.
const DARKEST: f32 = 0.45;

/// Whether the key is held; letters that are typed are not.
pub fn key_ui(ui: &egui::Ui, page: &mut ModelPage) {
    let is_free = !ui.ctx().text_edit_focused() && !is_asked(ui);
    let is_held = ui.input(|input| input.key_down(KEY) && input.modifiers.is_none());
    let is_held = is_free && is_held;
    if is_held != page.blink.is_held {
        page.blink.is_held = is_held;
        ui.ctx().request_repaint();
    }
}

/// Draws the faces; says whether they are to be seen.
pub fn faces_ui(
    painter: &Painter,
    page: &mut ModelPage,
    project: Option<&Project>,
    view: &View,
) -> bool {
    if !page.blink.is_shown() {
        return false;
    }
    let note = |text: &str| {
        let place = view.rect.center_bottom() - vec2(0.0, 12.0);
        label(painter, place, egui::Align2::CENTER_BOTTOM, text);
    };
    let Some(picture) = page.reprojection().cloned() else {
        match page.solved.is_some() {
            // The next frame asks for it; when it is there, its worker asks for a frame.
            true if !page.blink.is_awaited() => painter.ctx().request_repaint(),
            true => note("The faces are being drawn…"),
            false => note("Nothing is placed yet"),
        }
        return true;
    };
    if picture.pixels.iter().all(Option::is_none) {
        note(match picture.pixels.is_empty() {
            true => "This photograph is not placed yet, or the model has no face",
            false => "This photograph shows no face of the model",
        });
        return true;
    }
    let colors = project.filter(|own| own.folder == page.folder).map(colors).unwrap_or_default();
    let is_painted = |own: &(_, _, _)| {
        let (of, by, _): &(std::sync::Arc<Reprojection>, BTreeMap<String, Color32>, _) = own;
        std::sync::Arc::ptr_eq(of, &picture) && *by == colors
    };
    if !page.blink.painted.as_ref().is_some_and(is_painted) {
        let image = painted(&picture, &colors);
        let texture =
            painter.ctx().load_texture("model faces", image, egui::TextureOptions::NEAREST);
        page.blink.painted = Some((picture.clone(), colors, texture));
    }
    if let Some((_, _, texture)) = &page.blink.painted {
        let size = vec2(picture.width as f32, picture.height as f32) * picture.step as f32;
        let place = Rect::from_min_size(view.origin, view.scale * size);
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(texture.id(), place, whole, Color32::WHITE);
    }
    true
}

/// The colours of surfaces by their ids: the reflectances that a run has found, else the colours of
/// the materials that they are tagged with.
fn colors(project: &Project) -> BTreeMap<String, Color32> {
    let mut colors = BTreeMap::new();
    let is_solved = project.products.solved.is_some();
    for (index, material) in project.edit().materials.iter().enumerate() {
        let result = project.found_as(index).filter(|_| is_solved);
        let reflectance = result.and_then(|own| found(project, own).reflectance);
        let color = match reflectance {
            Some(own) => reflectance_color(own.diffuse),
            None => list_color(project, index),
        };
        for surface in &material.surfaces {
            colors.insert(project.capture.surfaces[*surface].name.clone(), color);
        }
    }
    colors
}

/// The picture, darker where faces look aside. Surfaces without a colour get one of their own.
fn painted(picture: &Reprojection, colors: &BTreeMap<String, Color32>) -> ColorImage {
    let own: Vec<Color32> = picture
        .surfaces
        .iter()
        .enumerate()
        .map(|(index, id)| colors.get(id).copied().unwrap_or_else(|| material_color(index)))
        .collect();
    let pixel = |own: &[Color32], seen: &Option<(u32, f32)>| match *seen {
        Some((surface, facing)) => {
            let factor = DARKEST + (1.0 - DARKEST) * facing;
            own[surface as usize].lerp_to_gamma(Color32::BLACK, 1.0 - factor)
        }
        None => Color32::TRANSPARENT,
    };
    let pixels = picture.pixels.iter().map(|seen| pixel(&own, seen)).collect();
    ColorImage::new([picture.width, picture.height], pixels)
}
