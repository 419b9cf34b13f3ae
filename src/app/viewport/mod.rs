//! The 3D view: a stand-in that keeps the place of the real one.

use std::collections::BTreeSet;
use std::sync::Arc;

use eframe::egui;
use glam::Vec3;

use crate::math::rgb::Radiance;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::Solution;
use crate::scene::Capture;

/// What there is to draw; all products are shared and read-only.
#[derive(Clone, Default)]
pub struct Content {
    pub capture: Option<Arc<Capture>>,
    pub samples: Option<Arc<SampleCloud>>,
    pub lights: Option<(Arc<VirtualLights>, Arc<Lobes>)>,
    /// Emission per lobe (R, G, B), where a solution (or an iteration) has it.
    pub solution: Option<Arc<Solution>>,
    pub selected_surfaces: BTreeSet<usize>,
    pub hidden_surfaces: BTreeSet<usize>,
    pub selected_sample: Option<usize>,
    pub selected_light: Option<usize>,
    pub selected_photograph: Option<usize>,
}

/// What the hand did in the viewport.
pub enum ViewportEvent {
    /// A surface was clicked (`None`: the background), with shift to add.
    PickSurface {
        surface: Option<usize>,
        add: bool,
    },
    /// Surfaces inside a dragged box.
    BoxSurfaces {
        surfaces: BTreeSet<usize>,
        add: bool,
    },
    PickSample(usize),
    PickLight(usize),
    PickPhotograph(usize),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shading {
    Photograph,
    Material,
    Reflectance,
    Plain,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SampleColor {
    Radiance,
    Material,
    Error,
    Weight,
    Views,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ToneMapping {
    Linear,
    Filmic,
    FalseColor,
}

#[derive(Clone, Debug, PartialEq)]
pub struct ViewSettings {
    pub shading: Shading,
    pub wireframe: bool,
    pub cameras: bool,
    pub samples: bool,
    pub sample_color: SampleColor,
    pub lights: bool,
    pub lobes: bool,
    pub grid: bool,
    pub exposure_ev: f32,
    pub tone_mapping: ToneMapping,
    pub look_through_opacity: f32,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            shading: Shading::Photograph,
            wireframe: false,
            cameras: true,
            samples: true,
            sample_color: SampleColor::Radiance,
            lights: true,
            lobes: true,
            grid: true,
            exposure_ev: 0.0,
            tone_mapping: ToneMapping::Filmic,
            look_through_opacity: 0.5,
        }
    }
}

/// What lies under the cursor.
#[derive(Clone, Debug, PartialEq)]
pub struct Hovered {
    pub surface: usize,
    pub position: Vec3,
    pub radiance: Option<Radiance>,
    pub material: Option<usize>,
}

pub struct Viewport {
    pub settings: ViewSettings,
    through: Option<usize>,
}

impl Viewport {
    pub fn new(_render: &eframe::egui_wgpu::RenderState) -> Self {
        Self { settings: ViewSettings::default(), through: None }
    }

    /// Draws into the rest of `ui` and tells what the hand did.
    pub fn show(&mut self, ui: &mut egui::Ui, _content: &Content) -> Vec<ViewportEvent> {
        let size = ui.available_size();
        let response = ui.allocate_response(size, egui::Sense::click_and_drag());
        response.widget_info(|| {
            egui::WidgetInfo::labeled(egui::accesskit::Role::Canvas, true, "viewport")
        });
        let visuals = ui.visuals();
        ui.painter().rect_filled(response.rect, 0.0, visuals.extreme_bg_color);
        let font = egui::TextStyle::Body.resolve(ui.style());
        let center = response.rect.center();
        ui.painter().text(
            center,
            egui::Align2::CENTER_CENTER,
            "viewport",
            font,
            visuals.weak_text_color(),
        );
        Vec::new()
    }

    /// The value under the cursor as of the last frame, for the status bar.
    pub fn hovered(&self) -> Option<&Hovered> {
        None
    }

    pub fn frame_all(&mut self) {}

    pub fn frame_selection(&mut self) {}

    pub fn look_through(&mut self, photograph: Option<usize>) {
        self.through = photograph;
    }

    pub fn is_looking_through(&self) -> Option<usize> {
        self.through
    }
}

/// Colour of a material by its index, colour-blind safe.
pub fn material_color(index: usize) -> egui::Color32 {
    const COLORS: [u32; 12] = [
        0xE69F00, 0x56B4E9, 0x009E73, 0xF0E442, 0x0072B2, 0xD55E00, 0xCC79A7, 0x999999, 0x332288,
        0x88CCEE, 0x882255, 0x44AA99,
    ];
    let [_, r, g, b] = COLORS[index % COLORS.len()].to_be_bytes();
    egui::Color32::from_rgb(r, g, b)
}
