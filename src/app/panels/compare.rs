//! A photograph beside a rendering of the results from the same camera, and their difference.

use eframe::egui::{self, Color32, Rect, TextureHandle, pos2, vec2};

use super::compared::{ComparedPictures, Comparison, RANGE, Shown};
use super::context::Context;
use super::numbers::{at_least, rgb, short};
use crate::app::actions::Action;
use crate::math::rgb::{Radiance, luminance};
use crate::study::pictures::PictureScore;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Layout {
    #[default]
    Beside,
    Slider,
    Flip,
    Difference,
}

impl Layout {
    const ALL: [(Self, &'static str, &'static str); 4] = [
        (Self::Beside, "Side by side", "Photograph, render and difference"),
        (
            Self::Slider,
            "Slider",
            "The photograph left of a line that can be dragged, the render right",
        ),
        (Self::Flip, "Flip", "The render while the pointer is on the picture, else the photograph"),
        (Self::Difference, "Difference", "Rendering minus photograph"),
    ];
}

pub struct State {
    layout: Layout,
    /// Chosen here; else the selected photograph.
    photograph: Option<usize>,
    split: f32,
    /// Factor from radiance to the screen's 0 to 1, as in the 3D view.
    pub exposure: f32,
    pictures: ComparedPictures,
}

impl Default for State {
    fn default() -> Self {
        Self {
            layout: Layout::Beside,
            photograph: None,
            split: 0.5,
            exposure: 1.0,
            pictures: ComparedPictures::default(),
        }
    }
}

fn percent(part: f64) -> String {
    format!("{:.1} %", 100.0 * part)
}

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    at_least(ui, 200.0, |ui| compare_ui(ui, context, state));
}

fn compare_ui(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, viewport, jobs, actions, .. } = context;
    let picture = jobs.picture.as_ref();
    state.exposure = viewport.exposure();
    let capture = project.result_capture();
    let Some(results) = &project.products.whole else {
        ui.weak("Run to compare the photographs with renderings of the results.");
        return;
    };
    let measured: Vec<usize> = capture.measurements().map(|(index, ..)| index).collect();
    let wanted = state
        .photograph
        .or(project.selection.photograph)
        .filter(|index| measured.contains(index))
        .or(measured.first().copied());
    let Some(mut chosen) = wanted else { return };
    ui.horizontal_wrapped(|ui| {
        // A number and its name stay together.
        ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
        let name = |index: usize| capture.photographs[index].name.as_str();
        egui::ComboBox::from_id_salt("compared")
            .selected_text(name(chosen))
            .show_ui(ui, |ui| {
                for &index in &measured {
                    ui.selectable_value(&mut chosen, index, name(index));
                }
            })
            .response
            .on_hover_text("The photograph that is compared");
        for (layout, name, help) in Layout::ALL {
            ui.selectable_value(&mut state.layout, layout, name).on_hover_text(help);
        }
        if let Some(film) = picture.and_then(|picture| picture.film.as_ref()) {
            ui.separator();
            let shown = state.pictures.shown(results, chosen);
            if let Some(rms) = shown.and_then(|shown| shown.comparison.rms) {
                ui.label(format!("relative RMS {}", percent(rms))).on_hover_text(
                    "Root mean square of (render - photograph) / photograph, over all pixels that \
                     show known surfaces, noise included: how far the radiance is off",
                );
            }
            let picture = picture.filter(|picture| picture.photograph == chosen);
            scores_ui(ui, picture.and_then(|picture| picture.score.as_deref()));
            let noise = shown.and_then(|shown| shown.comparison.noise);
            let noise = noise.map_or(String::new(), |n| format!(", noise {}", percent(n)));
            ui.weak(format!("{} paths a pixel{noise}", film.paths));
        }
        if picture.is_some_and(|picture| !picture.is_done) {
            ui.spinner();
        }
    });
    if wanted != Some(chosen) {
        state.photograph = Some(chosen);
    }
    let Some(picture) = picture.filter(|picture| picture.photograph == chosen) else {
        actions.push(Action::Compare(chosen));
        return;
    };
    if picture.is_done && picture.film.is_none() {
        ui.weak("The picture could not be made; the message beside it says why.");
        return;
    }
    let State { layout, split, pictures, exposure, .. } = state;
    pictures.follow(ui.ctx(), capture, picture, *exposure);
    match pictures.shown(results, chosen) {
        Some(shown) => {
            let room = ui.available_size() - vec2(0.0, 20.0);
            pictures_ui(ui, *layout, split, shown, room);
        }
        None => drop(ui.weak("The first paths are being traced…")),
    }
}

/// What a viewer sees of the differences, once the picture is done.
fn scores_ui(ui: &mut egui::Ui, score: Option<&PictureScore>) {
    let Some(score) = score.filter(|score| score.pixels > 0) else { return };
    ui.label(format!("FLIP {:.3}", score.mean_hdr_flip)).on_hover_text(
        "Mean HDR-FLIP: how much a viewer sees change who flips between the photograph and the \
         finished render, at whichever exposure shows most. 0 is the same, 0.05 hard to see, 1 as \
         different as can be",
    );
    if let Some(psnr) = score.psnr_db {
        ui.label(format!("PSNR {psnr:.1} dB")).on_hover_text(
            "Peak signal-to-noise ratio of both as sRGB pictures whose brightest hundredth is \
             white: more is better, 40 dB is hard to tell apart. One dB says little about where \
             pictures differ; FLIP does",
        );
    }
}

fn pictures_ui(
    ui: &mut egui::Ui,
    layout: Layout,
    split: &mut f32,
    shown: &Shown,
    room: egui::Vec2,
) {
    let [photograph, render, difference] = &shown.pictures;
    let columns = if layout == Layout::Beside { 3.0 } else { 1.0 };
    let size = photograph.size_vec2();
    let scale = ((room.x - 8.0 * (columns - 1.0)) / columns / size.x).min(room.y / size.y);
    let size = size * scale.max(0.01);
    let picture = |ui: &mut egui::Ui, texture: &TextureHandle, name: &str| {
        ui.vertical(|ui| {
            ui.set_max_width(size.x);
            ui.weak(name);
            let image = egui::Image::new(texture).fit_to_exact_size(size).alt_text(name);
            values_ui(ui.add(image.sense(egui::Sense::hover())), &shown.comparison);
        });
    };
    let range = 100.0 * RANGE;
    let scale_of = if size.x > 180.0 {
        format!("-{range:.0} % blue to +{range:.0} % orange")
    } else {
        format!("Difference, ±{range:.0} %")
    };
    match layout {
        Layout::Beside => {
            ui.horizontal(|ui| {
                picture(ui, photograph, "Photograph");
                picture(ui, render, "Render");
                picture(ui, difference, &scale_of);
            });
        }
        Layout::Difference => picture(ui, difference, &scale_of),
        Layout::Flip => {
            let rect = Rect::from_min_size(ui.cursor().min + vec2(0.0, 20.0), size);
            let on = ui.rect_contains_pointer(rect);
            let (texture, name) = if on { (render, "Render") } else { (photograph, "Photograph") };
            picture(ui, texture, name);
        }
        Layout::Slider => {
            ui.weak("Photograph left, render right of the line");
            let (rect, response) = ui.allocate_exact_size(size, egui::Sense::click_and_drag());
            response.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::Slider, true, "Photograph or render")
            });
            if let Some(place) = response.interact_pointer_pos() {
                *split = ((place.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
            }
            let line = rect.left() + *split * rect.width();
            let all = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            let painter = ui.painter();
            painter.image(render.id(), rect, all, Color32::WHITE);
            let left = Rect::from_min_max(rect.min, pos2(line, rect.bottom()));
            let part = Rect::from_min_max(pos2(0.0, 0.0), pos2(*split, 1.0));
            painter.image(photograph.id(), left, part, Color32::WHITE);
            painter.vline(line, rect.y_range(), egui::Stroke::new(2.0, Color32::WHITE));
            values_ui(
                response.on_hover_cursor(egui::CursorIcon::ResizeHorizontal),
                &shown.comparison,
            );
        }
    }
}

/// What both pictures have at the pointer.
fn values_ui(response: egui::Response, shown: &Comparison) {
    let Some(at) = response.hover_pos() else { return };
    let part = (at - response.rect.min) / response.rect.size();
    let height = shown.values.len() / shown.width.max(1);
    let cell = |part: f32, count: usize| ((part * count as f32).max(0.0) as usize).min(count - 1);
    if shown.width == 0 || height == 0 {
        return;
    }
    let (x, y) = (cell(part.x, shown.width), cell(part.y, height));
    let Some((seen, made)) = shown.values.get(y * shown.width + x) else { return };
    response.on_hover_ui_at_pointer(|ui| {
        let line = |own: &Radiance| {
            let luminance = short(luminance(*own));
            format!("{}, luminance {luminance}", rgb(own.map(f64::from)))
        };
        egui::Grid::new("values").num_columns(2).spacing([8.0, 2.0]).show(ui, |ui| {
            ui.weak("Photograph");
            ui.label(seen.as_ref().map_or("saturated or invalid".to_owned(), line));
            ui.end_row();
            ui.weak("Render");
            ui.label(line(made));
            ui.end_row();
            if let Some(seen) = seen {
                ui.weak("Difference");
                let relative = std::array::from_fn(|c| {
                    100.0 * f64::from(made[c] - seen[c]) / f64::from(seen[c].max(f32::MIN_POSITIVE))
                });
                let [red, green, blue]: [f64; 3] = relative;
                ui.label(format!("{red:+.1} / {green:+.1} / {blue:+.1} %"));
                ui.end_row();
            }
        });
    });
}
