//! One virtual light: the directions in which it meets known surfaces (Fig. 6), its lobes, and the
//! samples that it lights.

use std::sync::{Arc, Weak};

use eframe::egui::{
    self, Color32, ColorImage, Pos2, Sense, Stroke, TextureHandle, TextureOptions, pos2, vec2,
};
use glam::{Vec2, Vec2Swizzles};

use super::inspector::facts;
use super::lights::{name, place, unseen_ui};
use super::numbers::{count, emission_color, rgb, short, swatch, triple};
use crate::app::actions::Action;
use crate::app::jobs::Coverage;
use crate::app::project::Project;
use crate::math::sampling::{Frame, disc_to_square, square_to_disc, uniform_hemisphere_to_disc};
use crate::reconstruct::Method;
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::reconstruct::lobes::{CoverageMask, Lobes};

/// The mask that is shown.
#[derive(Default)]
pub struct MaskCache {
    of: Option<(Weak<Vec<Option<CoverageMask>>>, usize)>,
    texture: Option<TextureHandle>,
}

pub fn light_ui(
    ui: &mut egui::Ui,
    project: &Project,
    index: usize,
    coverage: Option<&Coverage>,
    cache: &mut MaskCache,
    actions: &mut Vec<Action>,
) {
    let Some((lights, lobes)) = &project.products.lights else { return };
    let Some(light) = lights.lights.get(index) else { return };
    ui.heading(format!("{} {index}", name(project, light)));
    let mut rows = vec![("Position", place(light))];
    if light.radius_m > 0.0 {
        rows.push(("Radius", format!("{:.3} m", light.radius_m)));
    }
    if light.half_angle > 0.0 {
        rows.push(("Half angle", format!("{:.2}°", light.half_angle.to_degrees())));
    }
    let numbers = project.products.derived.as_ref().and_then(|d| d.lights.get(index));
    if let Some(numbers) = numbers {
        rows.push(("Share of virtual light", format!("{} %", short(100.0 * numbers.share))));
        rows.push(("Lit samples", count(numbers.lit_samples)));
        rows.push(("Lobes lit", format!("{} of {}", numbers.lit_lobes, numbers.lobes)));
    }
    facts(ui, "light", &rows);
    if light.kind == LightKind::Sphere {
        mask_ui(ui, project, (index, light, lobes), coverage, cache, actions);
    }
    ui.add_space(6.0);
    ui.weak("Lobes, by emission (red / green / blue)").on_hover_text(
        "Those that light no sample come last: the photographs do not determine them",
    );
    let solution = project.products.solution.as_deref();
    let emission = |lobe: usize| {
        solution.and_then(|solution| solution.emission.get(lobe).copied()).unwrap_or_default()
    };
    let mut own: Vec<usize> = lobes.of(index).collect();
    let unseen = project.products.derived.as_ref().map_or(&[][..], |derived| &derived.unseen);
    let is_unseen = |lobe: usize| unseen.get(lobe).copied().unwrap_or(false);
    own.sort_by(|a, b| {
        let sums = [a, b].map(|lobe| emission(*lobe).iter().sum::<f64>());
        is_unseen(*a).cmp(&is_unseen(*b)).then(sums[1].total_cmp(&sums[0]))
    });
    for lobe in own.iter().take(40) {
        let direction = lobes.lobes[*lobe].direction;
        ui.horizontal_wrapped(|ui| {
            swatch(ui, emission_color(emission(*lobe)));
            ui.label(rgb(emission(*lobe)));
            if is_unseen(*lobe) {
                unseen_ui(ui);
            }
            ui.weak(format!("along {}", triple(direction, 2)));
        });
    }
    if own.len() > 40 {
        ui.weak(format!("and {} more", count(own.len() - 40)));
    }
    if ui.button("Frame").on_hover_text("Show it in the 3D view (F)").clicked() {
        actions.push(Action::FrameSelection);
    }
}

/// Side of the mask on the screen.
const SHOWN: f32 = 150.0;
const SEEN: Color32 = Color32::from_gray(150);
const UNSEEN: Color32 = Color32::from_gray(60);

/// The hemisphere of a light as a disc of equal areas: light where its rays meet photographed
/// surfaces, with the regions that may have a lobe, and the lobes.
fn mask_ui(
    ui: &mut egui::Ui,
    project: &Project,
    (index, light, lobes): (usize, &VirtualLight, &Lobes),
    coverage: Option<&Coverage>,
    cache: &mut MaskCache,
    actions: &mut Vec<Action>,
) {
    let Some((lights, _)) = &project.products.lights else { return };
    ui.add_space(6.0);
    ui.weak("Photographed surfaces in its hemisphere").on_hover_text(
        "Its hemisphere as a disc, the middle along its normal: bright where its rays meet \
         photographed surfaces, rings where its lobes point",
    );
    let Some(coverage) = coverage.filter(|coverage| Arc::ptr_eq(&coverage.of, lights)) else {
        actions.push(Action::Cover);
        return;
    };
    let Some(masks) = &coverage.masks else {
        ui.spinner();
        return;
    };
    let Some(Some(mask)) = masks.get(index) else { return };
    let is_known = cache
        .of
        .as_ref()
        .is_some_and(|(of, own)| *own == index && std::ptr::eq(of.as_ptr(), Arc::as_ptr(masks)));
    if !is_known {
        cache.of = Some((Arc::downgrade(masks), index));
        let texture = ui.ctx().load_texture("mask", disc(mask), TextureOptions::LINEAR);
        cache.texture = Some(texture);
    }
    let Some(texture) = &cache.texture else { return };
    let (rect, response) = ui.allocate_exact_size(vec2(SHOWN, SHOWN), Sense::hover());
    let part = mask.pixels.iter().filter(|set| **set).count() as f64;
    let part = 100.0 * part / mask.pixels.len().max(1) as f64;
    let tip = format!("Photographed surfaces are in {} % of its hemisphere", short(part));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, tip.as_str()));
    response.on_hover_text(&tip);
    let whole = egui::Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let painter = ui.painter_at(rect);
    painter.image(texture.id(), rect, whole, Color32::WHITE);
    let at = |disc: Vec2| -> Pos2 { rect.center() + vec2(disc.x, disc.y) * (0.5 * SHOWN) };
    let grid = grid(project, lobes.of(index).len());
    let thin = Stroke::new(1.0, ui.visuals().panel_fill);
    for line in 1..grid {
        let fixed = line as f32 / grid as f32;
        for turned in [false, true] {
            let points = (0..=24).map(|step| {
                let along = step as f32 / 24.0;
                let square = Vec2::new(fixed, along);
                at(square_to_disc(if turned { square.yx() } else { square }))
            });
            painter.line(points.collect(), thin);
        }
    }
    let solution = project.products.solution.as_deref();
    let frame = Frame::about(light.normal);
    for lobe in lobes.of(index) {
        let direction = lobes.lobes[lobe].direction;
        let local = glam::Vec3::new(
            direction.dot(frame.tangent),
            direction.dot(frame.bitangent),
            direction.dot(frame.normal),
        );
        let emission = solution.and_then(|s| s.emission.get(lobe).copied()).unwrap_or_default();
        let place = at(uniform_hemisphere_to_disc(local));
        painter.circle(place, 4.0, emission_color(emission), Stroke::new(1.0, Color32::WHITE));
    }
}

/// Regions along a side, by which the lights' lobes were chosen.
fn grid(project: &Project, lobes: usize) -> usize {
    let Some((edit, _)) = &project.products.of else { return 1 };
    let options = edit.run_options();
    match options.general.method {
        Method::Paper => options.lobes.grid,
        Method::Joint if lobes <= options.joint.coarse_grid.pow(2) => options.joint.coarse_grid,
        Method::Joint => options.joint.fine_grid,
    }
}

fn disc(mask: &CoverageMask) -> ColorImage {
    let side = mask.side.max(1);
    let mut pixels = Vec::with_capacity(side * side);
    for y in 0..side {
        for x in 0..side {
            let place = (Vec2::new(x as f32, y as f32) + 0.5) / side as f32 * 2.0 - 1.0;
            if place.length_squared() > 1.0 {
                pixels.push(Color32::TRANSPARENT);
                continue;
            }
            let square = disc_to_square(place) * side as f32;
            let [u, v] = square.to_array().map(|at| (at as usize).min(side - 1));
            pixels.push(if mask.pixels[v * side + u] { SEEN } else { UNSEEN });
        }
    }
    ColorImage::new([side, side], pixels)
}
