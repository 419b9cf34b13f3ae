//! The bar over the 3D view: what is shown, and the exposure.

use eframe::egui::{self, ComboBox, DragValue, Rect, Ui, UiBuilder, vec2};

use crate::app::entry::{self, Unit};
use crate::app::viewport::Viewport;
use crate::app::viewport::content::{Content, SampleColor, Shading, ToneMapping};
use crate::app::viewport::input;

/// Left free at the right for the ball of axes.
const MARGIN: f32 = 100.0;
/// In a narrower or lower view the switches are in a menu, or they would cover it.
const NARROW: f32 = 430.0;
const LOW: f32 = 240.0;

/// Gives the lower end of what is covered.
pub fn show(view: &mut Viewport, ui: &mut Ui, rect: Rect, content: &Content) -> f32 {
    let is_narrow = rect.width() < NARROW || rect.height() < LOW;
    let place = Rect::from_min_size(
        rect.min + vec2(8.0, 8.0),
        vec2((rect.width() - MARGIN - 8.0).max(120.0), rect.height() - 16.0),
    );
    let mut ui = ui.new_child(UiBuilder::new().id_salt("toolbar").max_rect(place));
    ui.set_clip_rect(rect);
    let fill = ui.visuals().window_fill.gamma_multiply(0.88);
    let frame = egui::Frame::new().fill(fill).corner_radius(4.0).inner_margin(4.0);
    let shown = frame.show(&mut ui, |ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        ui.horizontal_wrapped(|ui| {
            shading(view, ui);
            exposure(view, ui);
            if is_narrow && view.settings.shading != Shading::Relit {
                let help = "What is drawn beside the geometry";
                ui.menu_button("Show", |ui| switches(view, ui, content))
                    .response
                    .on_hover_text(help);
                sample_color(view, ui, content);
            }
            if view.is_looking_through().is_some() {
                looking_through(view, ui, content);
            }
        });
        if view.settings.shading == Shading::Relit {
            ui.horizontal_wrapped(|ui| relit(view, ui, content));
        } else if !is_narrow {
            ui.horizontal_wrapped(|ui| {
                switches(view, ui, content);
                sample_color(view, ui, content);
            });
        }
    });
    shown.response.rect.bottom()
}

fn shading(view: &mut Viewport, ui: &mut Ui) {
    let now = view.settings.shading;
    ComboBox::from_id_salt("shading")
        .selected_text(now.name())
        .width(108.0)
        .show_ui(ui, |ui| {
            for shading in Shading::ALL {
                ui.selectable_value(&mut view.settings.shading, shading, shading.name())
                    .on_hover_text(shading.help());
            }
        })
        .response
        .accessible_name("Shading")
        .on_hover_text(format!("What colours the geometry\n{}", now.help()));
    let now = view.settings.tone_mapping;
    ComboBox::from_id_salt("tone mapping")
        .selected_text(now.name())
        .width(96.0)
        .show_ui(ui, |ui| {
            for tone in ToneMapping::ALL {
                ui.selectable_value(&mut view.settings.tone_mapping, tone, tone.name())
                    .on_hover_text(tone.help());
            }
        })
        .response
        .accessible_name("Tone mapping")
        .on_hover_text(format!("How radiance becomes a colour on screen\n{}", now.help()));
}

fn exposure(view: &mut Viewport, ui: &mut Ui) {
    let sign = if view.settings.exposure_ev >= 0.0 { "+" } else { "" };
    let field = DragValue::new(&mut view.settings.exposure_ev)
        .speed(0.05)
        .range(-20.0..=20.0)
        .fixed_decimals(1)
        .prefix(sign)
        .suffix(" EV");
    let response = entry::number(ui, field, Unit::Plain).accessible_name("Exposure").on_hover_text(
        "Exposure of all radiance in stops; 0 suits the photographs. Drag, or click to \
             type; right-click to reset",
    );
    if response.secondary_clicked() {
        view.settings.exposure_ev = 0.0;
    }
}

fn opacity(view: &mut Viewport, ui: &mut Ui) {
    let mut percent = 100.0 * view.settings.look_through_opacity;
    let slider = egui::Slider::new(&mut percent, 0.0..=100.0).fixed_decimals(0).suffix(" %");
    ui.spacing_mut().slider_width = 72.0;
    ui.add(slider)
        .accessible_name("Photograph opacity")
        .on_hover_text("Opacity of the photograph over the geometry");
    view.settings.look_through_opacity = percent / 100.0;
}

fn looking_through(view: &mut Viewport, ui: &mut Ui, content: &Content) {
    if view.settings.shading != Shading::Relit {
        opacity(view, ui);
    }
    let name = view
        .is_looking_through()
        .zip(content.capture.as_ref())
        .and_then(|(index, capture)| Some(capture.photographs.get(index)?.name.clone()))
        .unwrap_or_default();
    let short = name.rsplit('/').next().unwrap_or_default().to_owned();
    let help = format!("{name}\nClick to leave the photograph (0); Tab goes to the next");
    if ui.button(format!("{short} ×")).on_hover_text(help).clicked() {
        input::leave_photograph(view, content);
    }
}

/// What a rendering is compared with, and how far it has come.
fn relit(view: &mut Viewport, ui: &mut Ui, content: &Content) {
    let mut is_split = view.settings.before.is_some();
    let help = "The scene as it was left of a line that can be dragged, and as it is relit right; \
                through a photograph: the photograph left";
    if ui.toggle_value(&mut is_split, "Before | after").on_hover_text(help).changed() {
        view.settings.before = is_split.then_some(0.5);
    }
    let state = match (&content.relit, view.camera().orthographic && view.through.is_none()) {
        (_, true) => "Renderings have perspective: press 5".to_owned(),
        (None, _) if content.solved.is_none() => "Run first".to_owned(),
        (None, _) => "Preparing…".to_owned(),
        (Some(relit), _) => format!("{} paths a pixel", relit.paths),
    };
    ui.weak(state);
    if let Some(status) = view.gizmo.status() {
        ui.separator();
        ui.label(status);
    }
}

fn switches(view: &mut Viewport, ui: &mut Ui, content: &Content) {
    let settings = &mut view.settings;
    let (has_samples, has_lights) = (content.samples.is_some(), content.lights.is_some());
    let has_cameras = settings.cameras;
    let none = "There are none before a reconstruction has begun";
    for (shown, name, help, is_there, why_not) in [
        (&mut settings.wireframe, "Wireframe", "Edges of the geometry's polygons", true, ""),
        (&mut settings.cameras, "Cameras", "Where the photographs were taken", true, ""),
        (
            &mut settings.thumbnails,
            "Thumbnails",
            "The photographs in their cameras; a double click looks through one",
            has_cameras,
            "The cameras are not shown",
        ),
        (&mut settings.grid, "Grid", "The ground, a line every metre", true, ""),
        (&mut settings.samples, "Samples", "Points whose radiance is explained", has_samples, none),
        (&mut settings.lights, "Lights", "Virtual lights and lamps", has_lights, none),
        (
            &mut settings.lobes,
            "Lobes",
            "Where lights shine, as long as the square root of the emission",
            has_lights,
            none,
        ),
    ] {
        // By itself, not in a space of its own, which would not go on in the next row.
        let switch = egui::Button::selectable(*shown, name).wrap_mode(egui::TextWrapMode::Extend);
        let switch = ui
            .add_enabled(is_there, switch)
            .on_hover_text(help)
            .on_disabled_hover_text(format!("{help}. {why_not}."));
        *shown ^= switch.clicked();
    }
}

fn sample_color(view: &mut Viewport, ui: &mut Ui, content: &Content) {
    let settings = &mut view.settings;
    if content.samples.is_some() && settings.samples {
        let now = settings.sample_color;
        ComboBox::from_id_salt("sample colour")
            .selected_text(now.name())
            .width(80.0)
            .show_ui(ui, |ui| {
                for color in SampleColor::ALL {
                    ui.selectable_value(&mut settings.sample_color, color, color.name())
                        .on_hover_text(color.help());
                }
            })
            .response
            .accessible_name("Sample colour")
            .on_hover_text(format!("What colours the samples\n{}", now.help()));
    }
}
