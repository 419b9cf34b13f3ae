//! One sample: its position, the photographs that show it, and the lights from which its light
//! comes.

use std::sync::{Arc, Weak};

use eframe::egui::{self, Color32, ColorImage, TextureHandle, TextureOptions, vec2};

use super::extents::{ExtentCache, Extents};
use super::inspect_light::MaskCache;
use super::inspect_texture::TextureCache;
use super::inspector::facts;
use super::numbers::{counted, exposed, rgb, short, swatch, triple};
use crate::app::actions::{Action, Select};
use crate::app::derived::{irradiance_of, kind_name};
use crate::app::project::Project;
use crate::app::viewport::INVALID;
use crate::math::rgb::Rgb;
use crate::reconstruct::Reconstruction;
use crate::reconstruct::samples::{SampleCloud, View};
use crate::scene::Image;

/// Pixels around the sample to each side.
const AROUND: isize = 15;
/// Side of a crop on the screen.
const SHOWN: f32 = 62.0;

/// What is worked out for the selection that is shown, until it changes.
#[derive(Default)]
pub struct CropCache {
    /// The sample, its cloud, and the result, which comes later.
    of: Option<(usize, Weak<SampleCloud>, Option<Weak<Reconstruction>>)>,
    /// Factor from radiance to the screen's 0 to 1, as in the 3D view; and that of the crops.
    pub exposure: f32,
    exposed: f32,
    crops: Vec<(usize, TextureHandle)>,
    sources: Option<(Rgb, Vec<(usize, Rgb)>)>,
    extents: ExtentCache,
    pub mask: MaskCache,
    pub texture: TextureCache,
    /// How many samples each photograph sees.
    seen: Option<(Weak<SampleCloud>, Vec<usize>)>,
}

/// Whether it is the very product; a `Weak` keeps its address from being used again.
fn is<T>(known: &Weak<T>, now: &Arc<T>) -> bool {
    std::ptr::eq(known.as_ptr(), Arc::as_ptr(now))
}

impl CropCache {
    /// How large the geometry and each surface are, once that is known.
    pub fn extents(&mut self, ctx: &egui::Context, project: &Project) -> Option<&Extents> {
        self.extents.of(ctx, &project.loaded)
    }

    pub fn samples_seen(&mut self, cloud: &Arc<SampleCloud>, photograph: usize) -> usize {
        if self.seen.as_ref().is_none_or(|(of, _)| !is(of, cloud)) {
            let mut counts = Vec::new();
            for view in &cloud.views {
                counts.resize(counts.len().max(view.photograph + 1), 0);
                counts[view.photograph] += 1;
            }
            self.seen = Some((Arc::downgrade(cloud), counts));
        }
        let counts = self.seen.as_ref().map(|(_, counts)| counts.as_slice()).unwrap_or_default();
        counts.get(photograph).copied().unwrap_or(0)
    }

    fn fill(
        &mut self,
        ctx: &egui::Context,
        project: &Project,
        (sample, cloud): (usize, &Arc<SampleCloud>),
        views: &[View],
    ) {
        let whole = project.products.whole.as_ref();
        let is_known = self.of.as_ref().is_some_and(|(known, of, result)| {
            let same_result = match (result, whole) {
                (Some(known), Some(whole)) => is(known, whole),
                (known, whole) => known.is_none() && whole.is_none(),
            };
            *known == sample && is(of, cloud) && same_result
        });
        if is_known && self.exposed == self.exposure {
            return;
        }
        if !is_known {
            self.of = Some((sample, Arc::downgrade(cloud), whole.map(Arc::downgrade)));
            self.sources = whole.map(|whole| irradiance_of(whole, sample));
        }
        self.exposed = self.exposure;
        self.crops = views
            .iter()
            .take(24)
            .filter_map(|view| {
                let image = project.loaded.photographs.get(view.photograph)?.image.as_ref()?;
                let name = format!("crop {sample} {}", view.photograph);
                let crop = crop(image, view, self.exposure);
                let texture = ctx.load_texture(name, crop, TextureOptions::NEAREST);
                Some((view.photograph, texture))
            })
            .collect();
    }
}

pub fn sample_ui(
    ui: &mut egui::Ui,
    project: &Project,
    index: usize,
    crops: &mut CropCache,
    actions: &mut Vec<Action>,
) {
    let Some(cloud) = &project.products.samples else { return };
    let Some(sample) = cloud.samples.get(index) else { return };
    let views = &cloud.views[sample.views.clone()];
    ui.heading(format!("Sample {index}"));
    let capture = project.result_capture();
    ui.horizontal(|ui| {
        swatch(ui, project.result_colors().of(sample.material));
        let material = capture.materials.get(sample.material);
        ui.label(material.map_or("", |material| material.name.as_str()));
        let surface = capture.surfaces.get(sample.surface);
        ui.weak(surface.map_or("", |surface| surface.name.as_str()));
    });
    let (p, n) = (sample.position, sample.normal);
    let mut rows = vec![("Position", format!("{} m", triple(p, 3))), ("Normal", triple(n, 3))];
    let derived = project.products.derived.as_ref().and_then(|d| d.samples.get(index));
    match derived {
        Some(numbers) => {
            rows.push(("Measured", rgb(numbers.observed)));
            rows.push(("Computed", rgb(numbers.computed)));
            rows.push(("Error (ln)", short(numbers.log_error)));
        }
        None => rows.push(("Measured", rgb(sample.radiance.map(f64::from)))),
    }
    facts(ui, "sample", &rows);
    crops.fill(ui.ctx(), project, (index, cloud), views);
    ui.add_space(6.0);
    ui.weak(format!("Seen by {}", counted(views.len(), "photograph", "photographs")));
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for (photograph, texture) in &crops.crops {
            let name = project.loaded.photographs.get(*photograph).map_or("", |p| p.name.as_str());
            let view = views.iter().find(|view| view.photograph == *photograph);
            let radiance = view.map_or_else(String::new, |v| rgb(v.radiance.map(f64::from)));
            let image = egui::Image::new(texture)
                .fit_to_exact_size(vec2(SHOWN, SHOWN))
                .alt_text(format!("Crop of {name}"))
                .sense(egui::Sense::click());
            let response = ui.add(image).on_hover_text(format!("{name}, radiance {radiance}"));
            let dot = egui::Stroke::new(1.0, Color32::WHITE);
            ui.painter().circle_stroke(response.rect.center(), 4.0, dot);
            if response.clicked() {
                actions.push(Action::Select(Select::Photograph(*photograph)));
            }
        }
    });
    ui.add_space(6.0);
    match (&crops.sources, project.products.whole.as_deref()) {
        (Some((geometry, lights)), Some(whole)) => {
            sources(ui, whole, geometry, lights, actions);
        }
        _ => {
            ui.weak("Where its light comes from is known after a run.");
        }
    }
}

/// Shares of the irradiance, by source.
fn sources(
    ui: &mut egui::Ui,
    whole: &Reconstruction,
    geometry: &Rgb,
    lights: &[(usize, Rgb)],
    actions: &mut Vec<Action>,
) {
    let total = |rgb: &Rgb| rgb.iter().sum::<f64>();
    let all = total(geometry) + lights.iter().map(|(_, rgb)| total(rgb)).sum::<f64>();
    let part = |rgb: &Rgb| if all > 0.0 { total(rgb) / all } else { 0.0 };
    ui.weak("Where its light comes from");
    share(ui, part(geometry), |ui| {
        ui.label("known geometry")
            .on_hover_text("Surfaces of the capture, those that no photograph shows included");
    });
    for (light, sum) in lights.iter().take(8) {
        share(ui, part(sum), |ui| {
            let text = format!("{} {light}", kind_name(whole.lights.lights[*light].kind));
            if ui.link(text).on_hover_text("Select this light").clicked() {
                actions.push(Action::Select(Select::Light(*light)));
            }
        });
    }
    let rest: f64 = lights.iter().skip(8).map(|(_, rgb)| part(rgb)).sum();
    if rest > 0.0 {
        share(ui, rest, |ui| {
            ui.label(format!("{} other lights", lights.len() - 8));
        });
    }
}

fn share(ui: &mut egui::Ui, part: f64, name: impl FnOnce(&mut egui::Ui)) {
    ui.horizontal_wrapped(|ui| {
        let width = (0.17 * ui.available_width()).clamp(24.0, 60.0);
        let bar = egui::ProgressBar::new(part as f32).desired_width(width).desired_height(8.0);
        ui.add(bar);
        ui.label(format!("{:.1} %", 100.0 * part));
        name(ui);
    });
}

/// The pixels around a view at an exposure; those that are no measurement in their own colour.
fn crop(image: &Image, view: &View, exposure: f32) -> ColorImage {
    let [x, y] = view.pixel.map(|value| value as isize);
    let side = (2 * AROUND + 1) as usize;
    let mut pixels = Vec::with_capacity(side * side);
    for row in y - AROUND..=y + AROUND {
        for column in x - AROUND..=x + AROUND {
            let inside = row >= 0
                && column >= 0
                && (row as usize) < image.height()
                && (column as usize) < image.width();
            pixels.push(match inside.then(|| image.radiance(column as usize, row as usize)) {
                None => Color32::BLACK,
                Some(None) => INVALID,
                Some(Some(radiance)) => exposed(radiance, exposure),
            });
        }
    }
    ColorImage::new([side, side], pixels)
}
