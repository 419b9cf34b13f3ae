//! The view of the capture and of what the reconstruction found.
//!
//! The scene is drawn off screen (`targets`) within egui's encoder (`paint`) and copied into the
//! window. `scene` holds what lies on the GPU and brings it up to date when a shared product
//! changes; what is heavy to prepare is prepared in the `background`. Selecting happens on the
//! CPU (`picking`), with the rays that the reconstruction uses.

mod added;
mod axes;
mod background;
mod before;
mod camera;
mod charts;
mod content;
mod display;
mod frame;
mod gizmo;
mod gpu;
mod hovering;
mod input;
mod known;
mod legend;
mod marks;
mod masks;
mod neutral;
mod paint;
mod palette;
mod photographs;
mod picking;
mod pipeline;
mod projection;
mod ring;
mod samples;
mod scene;
mod surfaces;
mod targets;
mod texels;
mod thumbs;
mod toolbar;
#[cfg(test)]
mod traffic;

use std::sync::Arc;

use eframe::egui::{self, Response, Sense, Ui};
use eframe::egui_wgpu;
use glam::{Vec2, Vec3};

pub use camera::{Side, ViewCamera};
pub use content::{
    Content, Hovered, PictureValue, SampleColor, Shading, ToneMapping, ViewSettings, ViewportEvent,
};
pub use gizmo::Mode as GizmoMode;
pub use masks::{RADII as MASK_RADII, Tool as MaskTool};
pub use palette::{INVALID, MaterialColors, material_color, signed};

pub use crate::app::derived::Derived;
pub use crate::app::project::Focus;

use crate::geometry::bvh::Ray;
use crate::io::export::pictures::Development;
use crate::render::edits::Edits;
use crate::scene::{Camera, Capture};
use crate::worker::PreviewRequest;
use gizmo::Gizmo;
use paint::Drawn;
use projection::{Placement, Projection};
use scene::Scene;
use targets::Targets;

/// The viewport with its view; one per window.
pub struct Viewport {
    pub settings: ViewSettings,
    camera: ViewCamera,
    /// The photograph that is looked through, and how it is placed.
    through: Option<usize>,
    placement: Placement,
    framing: Option<Framing>,
    /// The camera was put where the next capture is to be seen from.
    placed: bool,
    boxing: Boxing,
    pub gizmo: Gizmo,
    /// What is drawn over the photograph that is looked through.
    pub masking: masks::Masking,
    /// The tool for the corners of charts.
    pub cornering: charts::Cornering,
    /// Shown without its bar and legend.
    pub is_preview: bool,
    /// The camera that the view was last seen by, where it has perspective.
    seen_by: Option<Camera>,
    scene: Scene,
    targets: Option<Arc<Targets>>,
    /// What the picture on hand shows.
    drawn: Drawn,
    /// Depth maps that had been drawn when the next frame was last asked for.
    depth_maps: Option<usize>,
    hovered: Option<Hovered>,
    /// What the picture has under the cursor.
    value: Option<PictureValue>,
    selected_before: Option<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Framing {
    All,
    Selection,
}

/// Selecting by a box: after B, and while it is dragged.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Boxing {
    Off,
    Armed,
    From(egui::Pos2),
}

impl Viewport {
    pub fn new(render: &egui_wgpu::RenderState) -> Self {
        let scene = Scene::new(render.device.clone(), render.queue.clone(), render.target_format);
        Self {
            settings: ViewSettings::default(),
            camera: ViewCamera::default(),
            through: None,
            placement: Placement::default(),
            framing: Some(Framing::All),
            placed: false,
            boxing: Boxing::Off,
            gizmo: Gizmo::default(),
            masking: masks::Masking::default(),
            cornering: charts::Cornering::default(),
            is_preview: false,
            seen_by: None,
            scene,
            targets: None,
            drawn: Drawn::default(),
            depth_maps: None,
            hovered: None,
            value: None,
            selected_before: None,
        }
    }

    /// Draws into the rest of `ui` and returns the user input.
    pub fn show(&mut self, ui: &mut Ui, content: &Content) -> Vec<ViewportEvent> {
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| {
            let role = egui::accesskit::Role::Canvas;
            egui::WidgetInfo::labeled(role, ui.is_enabled(), "Viewport")
        });
        let mut events = Vec::new();
        if rect.width() < 8.0 || rect.height() < 8.0 {
            return events;
        }
        let size = Vec2::new(rect.width(), rect.height());
        let look = frame::look(ui);
        if self.scene.sync(content, &self.settings, &look, ui.ctx()) {
            self.through = None;
            if !std::mem::take(&mut self.placed) {
                self.framing = Some(Framing::All);
            }
        }
        self.follow(content);
        let before = self.projection(size);
        let is_taken = content.capture.is_some()
            && gizmo::interact(self, ui, &response, content, &before, &mut events);
        if content.capture.is_some() {
            input::navigate(self, ui, &response, content);
            input::photograph_keys(self, ui, &response, content, &mut events);
            input::keep_tab(self, ui, &response);
        }
        self.frame(content, size);
        let projection = self.projection(size);
        let is_taken = is_taken
            || charts::interact(self, ui, &response, content, &projection, &mut events)
            || masks::interact(self, ui, &response, content, &projection, &mut events);
        if !is_taken {
            input::select(self, ui, &response, content, &projection, &mut events);
        }
        self.hover(&response, content, &projection);
        self.draw(ui, &response, content, &look, &projection);
        self.overlay(ui, &response, content, &projection);
        events
    }

    /// The value under the cursor as of the last frame, for the status bar.
    pub fn hovered(&self) -> Option<&Hovered> {
        self.hovered.as_ref()
    }

    /// What the picture that is shown has under the cursor.
    pub fn value(&self) -> Option<PictureValue> {
        self.value
    }

    /// Shows everything.
    pub fn frame_all(&mut self) {
        self.framing = Some(Framing::All);
        self.placed = false;
    }

    /// Shows what is selected, or everything where nothing is.
    pub fn frame_selection(&mut self) {
        self.framing = Some(Framing::Selection);
    }

    /// Takes a photograph's camera, or gives it back.
    pub fn look_through(&mut self, photograph: Option<usize>) {
        if self.through.is_none() || photograph.is_none() {
            self.placement = Placement::default();
        }
        self.through = photograph;
    }

    pub fn is_looking_through(&self) -> Option<usize> {
        self.through
    }

    /// Gives back what a capture took: its photographs, ray tree and textures.
    pub fn clear(&mut self) {
        self.scene.clear();
        self.through = None;
        self.boxing = Boxing::Off;
        self.masking.clear();
        self.cornering.clear();
        self.hovered = None;
        self.value = None;
        self.selected_before = None;
        self.placed = false;
        // Pictures of the size that the window may have no more.
        self.targets = None;
        self.drawn = Drawn::default();
    }

    /// Whether a box is about to be dragged or is, a stroke is drawn, or something is being moved: Esc
    /// ends that.
    pub fn is_at_work(&self) -> bool {
        self.boxing != Boxing::Off
            || self.gizmo.is_active()
            || self.masking.is_drawing()
            || self.cornering.is_at_work()
    }

    /// Whether a light or an object is being moved.
    pub fn is_moving(&self) -> bool {
        self.gizmo.is_active()
    }

    /// What is to be rendered for the viewport; `None` where it shows no rendering.
    pub fn request(&self, edits: &Arc<Edits>) -> Option<PreviewRequest> {
        let camera = self.seen_by.filter(|_| self.settings.shading == Shading::Relit)?;
        Some(PreviewRequest {
            edits: edits.clone(),
            camera,
            photograph: self.through,
            before: self.settings.before.is_some(),
        })
    }

    /// The camera of what is shown, and the photograph that is looked through; `None` before the
    /// first frame.
    pub fn seen(&self) -> Option<(Camera, Option<usize>)> {
        Some((self.seen_by?, self.through))
    }

    /// Radiance that is shown almost white at an exposure of 0.
    pub fn bright(&self) -> f32 {
        self.scene.bright
    }

    /// The place on the geometry right below another.
    pub fn below(&self, place: Vec3) -> Option<Vec3> {
        let direction = -Vec3::Z;
        let ray = Ray { origin: place, direction, t_min: 0.0, t_max: f32::INFINITY };
        let hit = self.scene.caster.as_ref()?.closest(&ray)?;
        Some(place + direction * hit.t)
    }

    /// The free view.
    pub fn camera(&self) -> &ViewCamera {
        &self.camera
    }

    /// Puts the free view somewhere, as a project remembers it.
    pub fn set_camera(&mut self, camera: ViewCamera) {
        self.camera = camera;
        self.framing = None;
        self.placed = true;
    }

    /// The factor that brings radiance to the screen's 0 to 1, for pictures beside the viewport.
    pub fn exposure(&self) -> f32 {
        self.settings.exposure_ev.exp2() * texels::BRIGHT_PART / self.scene.bright
    }

    /// How pictures are developed to look as they do here.
    pub fn development(&self) -> Development {
        display::development(self.exposure(), self.settings.tone_mapping)
    }

    /// Whether the geometry is there to be drawn.
    pub fn has_geometry(&self) -> bool {
        !self.scene.mesh.is_empty()
    }

    /// Whether the preparation of the capture has come as far as picking and colouring.
    pub fn is_ready(&self) -> bool {
        self.scene.caster.is_some() && self.scene.is_filled()
    }

    /// Another photograph selected elsewhere is looked through here, too.
    fn follow(&mut self, content: &Content) {
        let count = content.capture.as_ref().map_or(0, |capture| capture.photographs.len());
        if self.selected_before != content.selected_photograph {
            self.selected_before = content.selected_photograph;
            if self.through.is_some() && content.selected_photograph.is_some() {
                self.through = content.selected_photograph;
            }
        }
        self.through = self.through.filter(|photograph| *photograph < count);
    }

    fn projection(&self, size: Vec2) -> Projection {
        let ball = self.scene.ball();
        let photograph = self.through.and_then(|index| {
            self.scene.capture.as_ref().and_then(|capture| capture.photographs.get(index))
        });
        match photograph {
            Some(photograph) => {
                let range = photographs::range(photograph.camera.position.as_vec3(), ball);
                Projection::through(&photograph.camera, size, self.placement, range)
            }
            None => self.camera.projection(size, ball),
        }
    }

    fn frame(&mut self, content: &Content, size: Vec2) {
        let Some(framing) = self.framing.take() else { return };
        let Some(capture) = &content.capture else { return };
        let selection = match framing {
            Framing::Selection => marks::selected_box(capture, content),
            Framing::All => None,
        };
        let (low, high) = selection.or_else(|| capture.mesh.bounds()).unwrap_or(self.scene.bounds);
        input::leave_photograph(self, content);
        let least = 0.1 * self.scene.ball().1;
        self.camera.frame(0.5 * (low + high), (0.5 * (high - low).length()).max(least), size);
    }

    /// The layers that colour the mesh and are read under the cursor, in the order of trying.
    fn ranked(&self, capture: &Capture, content: &Content, projection: &Projection) -> Vec<usize> {
        let preferred = self.through.or(content.selected_photograph);
        self.scene.layers.ranked(capture, projection, self.scene.ball(), preferred)
    }

    /// What lies over the picture.
    fn overlay(&mut self, ui: &mut Ui, response: &Response, content: &Content, p: &Projection) {
        let rect = response.rect;
        if content.capture.is_none() {
            let font = egui::TextStyle::Heading.resolve(ui.style());
            let color = ui.visuals().weak_text_color();
            let text = "Drop a capture folder here";
            ui.painter_at(rect).text(rect.center(), egui::Align2::CENTER_CENTER, text, font, color);
            return;
        }
        if let Boxing::From(start) = self.boxing
            && let Some(end) = response.interact_pointer_pos()
        {
            let accent = ui.visuals().selection.stroke.color;
            let dragged = egui::Rect::from_two_pos(start, end);
            let painter = ui.painter_at(rect);
            painter.rect_filled(dragged, 0.0, accent.gamma_multiply(0.12));
            let stroke = egui::Stroke::new(1.0, accent);
            painter.rect_stroke(dragged, 0.0, stroke, egui::StrokeKind::Inside);
        }
        let shown = self.through.and_then(|index| content.capture.as_ref()?.photographs.get(index));
        if let Some(photograph) = shown.filter(|photograph| photograph.image.is_none()) {
            let text = match photograph.display {
                Some(_) => "Shown as it is displayed: this photograph measures no radiance",
                None => "Not shown: this photograph holds no radiance",
            };
            let text = egui::RichText::new(text)
                .background_color(ui.visuals().window_fill.gamma_multiply(0.88));
            let line = egui::vec2(rect.width(), 24.0);
            let place = egui::Align2::CENTER_BOTTOM.align_size_within_rect(line, rect);
            ui.put(place, egui::Label::new(text).selectable(false));
        }
        masks::draw(self, ui, response, content, p);
        charts::draw(self, ui, response, content, p);
        added::draw(self, ui, response, content, p);
        before::show(self, ui, response);
        let has_toolbar_room = rect.width() > 240.0 && rect.height() > 120.0;
        if has_toolbar_room {
            if !self.is_preview {
                let covered = toolbar::show(self, ui, rect, content);
                legend::show(self, ui, rect, covered, content);
            }
            if let Some(side) = axes::show(ui, rect, p) {
                input::leave_photograph(self, content);
                self.camera.turn_to(side);
                ui.ctx().request_repaint();
            }
        }
    }
}
