//! The view of the capture and of what the reconstruction found.
//!
//! The scene is drawn off screen (`targets`) within egui's encoder (`paint`) and copied into the
//! window. `scene` holds what lies on the GPU and brings it up to date when a shared product
//! changes; what is heavy to prepare is prepared in the `background`. Selecting happens on the
//! CPU (`picking`), with the rays that the reconstruction uses.

mod axes;
mod background;
mod camera;
mod content;
mod gpu;
mod input;
mod legend;
mod marks;
mod paint;
mod palette;
mod photographs;
mod picking;
mod projection;
mod samples;
mod scene;
mod surfaces;
mod targets;
mod texels;
mod toolbar;

use std::sync::Arc;

use eframe::egui::{self, Color32, Response, Sense, Ui};
use eframe::{egui_wgpu, wgpu};
use glam::{Vec2, Vec3};

pub use camera::{Side, ViewCamera};
pub use content::{
    Content, Hovered, SampleColor, Shading, ToneMapping, ViewSettings, ViewportEvent,
};
pub use palette::{magnitude, material_color, signed};

use gpu::Globals;
use paint::{Drawn, Items, Paint};
use picking::Picker;
use projection::{Placement, Projection};
use scene::{Look, Scene};
use targets::Targets;

/// Of the radiance that nine tenths of the pixels stay below, what part of white it becomes.
const BRIGHT_PART: f32 = 0.7;

/// The viewport with its view; one per window.
pub struct Viewport {
    pub settings: ViewSettings,
    camera: ViewCamera,
    /// The photograph that is looked through, and how it is placed.
    through: Option<usize>,
    placement: Placement,
    framing: Option<Framing>,
    boxing: Boxing,
    scene: Scene,
    targets: Option<Arc<Targets>>,
    /// What the picture on hand shows.
    drawn: Drawn,
    /// Depth maps that had been drawn when the next frame was last asked for.
    depth_maps: Option<usize>,
    hovered: Option<Hovered>,
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
            boxing: Boxing::Off,
            scene,
            targets: None,
            drawn: Drawn::default(),
            depth_maps: None,
            hovered: None,
            selected_before: None,
        }
    }

    /// Draws into the rest of `ui` and tells what the hand did.
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
        let look = look(ui);
        if self.scene.sync(content, &self.settings, &look, ui.ctx()) {
            self.through = None;
            self.framing = Some(Framing::All);
        }
        self.follow(content);
        if content.capture.is_some() {
            input::navigate(self, ui, &response, content);
            input::photograph_keys(self, ui, &response, content, &mut events);
        }
        self.frame(content, size);
        let projection = self.projection(size);
        input::select(self, ui, &response, content, &projection, &mut events);
        self.hover(&response, content, &projection);
        self.draw(ui, &response, content, &look, &projection);
        self.overlay(ui, &response, content, &projection);
        events
    }

    /// The value under the cursor as of the last frame, for the status bar.
    pub fn hovered(&self) -> Option<&Hovered> {
        self.hovered.as_ref()
    }

    /// Shows everything.
    pub fn frame_all(&mut self) {
        self.framing = Some(Framing::All);
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

    /// The free view.
    pub fn camera(&self) -> &ViewCamera {
        &self.camera
    }

    /// Puts the free view somewhere, as a project remembers it.
    pub fn set_camera(&mut self, camera: ViewCamera) {
        self.camera = camera;
        self.framing = None;
    }

    /// The factor that brings radiance to the screen's 0 to 1, for pictures beside the viewport.
    pub fn exposure(&self) -> f32 {
        self.settings.exposure_ev.exp2() * BRIGHT_PART / self.scene.bright
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
            Framing::Selection => selected_box(capture, content),
            Framing::All => None,
        };
        let (low, high) = selection.or_else(|| capture.mesh.bounds()).unwrap_or(self.scene.bounds);
        input::leave_photograph(self, content);
        let least = 0.1 * self.scene.ball().1;
        self.camera.frame(0.5 * (low + high), (0.5 * (high - low).length()).max(least), size);
    }

    fn hover(&mut self, response: &Response, content: &Content, projection: &Projection) {
        self.hovered = None;
        let Some(position) = response.hover_pos().filter(|_| response.contains_pointer()) else {
            return;
        };
        let Some((capture, caster)) = self.scene.capture.as_ref().zip(self.scene.caster.as_ref())
        else {
            return;
        };
        let picker = Picker { capture, caster, hidden: &content.hidden_surfaces };
        let local = position - response.rect.min;
        let preferred = self.through.or(content.selected_photograph);
        self.hovered = picker.value(projection, Vec2::new(local.x, local.y), preferred);
    }

    fn draw(
        &mut self,
        ui: &Ui,
        response: &Response,
        content: &Content,
        look: &Look,
        projection: &Projection,
    ) {
        let scale = ui.ctx().pixels_per_point();
        let most = self.scene.device.limits().max_texture_dimension_2d;
        let pixels = |points: f32| ((points * scale).round() as u32).clamp(1, most);
        let size = [pixels(projection.size.x), pixels(projection.size.y)];
        let targets = match self.targets.take().filter(|targets| targets.size == size) {
            Some(targets) => targets,
            None => {
                self.drawn = Drawn::default();
                Arc::new(Targets::new(&self.scene.device, &self.scene.pipelines, size))
            }
        };
        self.targets = Some(targets.clone());

        let depth_map = self.scene.next_depth_map();
        // One a frame; a frame that did not draw its own is no reason for the next.
        let done = depth_map.as_ref().map(|_| self.scene.layers.depth_maps());
        if depth_map.is_some() && done != self.depth_maps {
            ui.ctx().request_repaint();
        }
        self.depth_maps = done;
        let picture = self
            .through
            .filter(|_| self.settings.look_through_opacity > 0.0)
            .and_then(|photograph| self.scene.picture(photograph, ui.ctx()));
        let globals = self.globals(content, look, projection, scale, size);
        let now = (
            globals,
            self.scene.version,
            self.settings.clone(),
            look.background,
            picture.is_some(),
        );
        let items = (!self.drawn.is(&now)).then(|| {
            self.scene.write_globals(&globals);
            (self.items(content, look, picture), now)
        });
        let paint = Paint {
            pipelines: self.scene.pipelines.clone(),
            targets,
            items,
            drawn: self.drawn.clone(),
            mesh: self.scene.mesh.clone(),
            depth_map,
        };
        ui.painter_at(response.rect)
            .add(egui_wgpu::Callback::new_paint_callback(response.rect, paint));
    }

    fn items(&self, content: &Content, look: &Look, picture: Option<wgpu::BindGroup>) -> Items {
        let (scene, settings) = (&self.scene, &self.settings);
        let when = |wanted: bool, batch: &paint::Batch| batch.clone().filter(|_| wanted);
        let grey = f64::from(look.background);
        Items {
            globals: scene.globals.clone(),
            mesh: scene.mesh.clone(),
            mesh_group: scene.mesh_group.clone(),
            edges: settings.wireframe || !content.selected_surfaces.is_empty(),
            picture,
            lines: [
                when(settings.grid && self.through.is_none(), &scene.grid),
                when(settings.cameras && self.through.is_none(), &scene.frusta),
                when(settings.lights, &scene.light_lines),
            ],
            lobes: when(settings.lobes, &scene.lobes),
            discs: when(settings.lights, &scene.discs),
            points: when(settings.samples, &scene.points),
            background: wgpu::Color { r: grey, g: grey, b: grey, a: 1.0 },
        }
    }

    fn globals(
        &self,
        content: &Content,
        look: &Look,
        projection: &Projection,
        scale: f32,
        size: [u32; 2],
    ) -> Globals {
        let ball = self.scene.ball();
        let with = |v: Vec3, w: f32| v.extend(w).to_array();
        let index = |index: Option<usize>| index.map_or(u32::MAX, |index| index as u32);
        let mut globals = Globals {
            clip_from_world: projection.matrix().to_cols_array_2d(),
            eye: with(projection.eye, f32::from(u8::from(projection.orthographic))),
            right: with(projection.right, ball.1),
            up: with(projection.up, scale),
            forward: with(projection.forward, self.settings.look_through_opacity),
            accent: look.accent,
            wire: look.wire,
            screen: [size[0] as f32, size[1] as f32, self.exposure(), self.scene.bright],
            ..Globals::default()
        };
        if let Some((corner, extent)) = projection.picture {
            let low = corner / projection.size * 2.0 - 1.0;
            let high = (corner + extent) / projection.size * 2.0 - 1.0;
            globals.picture = [low.x, -low.y, high.x, -high.y];
        }
        let count = match (&self.scene.capture, self.settings.shading) {
            (Some(capture), Shading::Photograph) => self.scene.layers.candidates(
                capture,
                projection,
                ball,
                self.through.or(content.selected_photograph),
                &mut globals.candidates,
            ),
            _ => 0,
        };
        globals.choice = [
            self.settings.shading as u32,
            self.settings.tone_mapping as u32,
            count as u32,
            index(content.selected_sample),
        ];
        globals.more = [index(content.selected_light), u32::from(self.settings.wireframe), 0, 0];
        globals
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
        let has_toolbar_room = rect.width() > 240.0 && rect.height() > 120.0;
        if has_toolbar_room {
            toolbar::show(self, ui, rect, content);
            legend::show(self, ui, rect, content);
            if let Some(side) = axes::show(ui, rect, p) {
                input::leave_photograph(self, content);
                self.camera.turn_to(side);
                ui.ctx().request_repaint();
            }
        }
    }
}

/// The box around what is selected.
fn selected_box(capture: &crate::scene::Capture, content: &Content) -> Option<(Vec3, Vec3)> {
    let mesh = &capture.mesh;
    let corners = (0..mesh.triangles.len())
        .filter(|&triangle| content.selected_surfaces.contains(&(mesh.surface[triangle] as usize)))
        .flat_map(|triangle| mesh.corners(triangle));
    let sample = content
        .samples
        .as_ref()
        .zip(content.selected_sample)
        .and_then(|(cloud, index)| Some(cloud.samples.get(index)?.position));
    let light =
        content.lights.as_ref().zip(content.selected_light).and_then(|((lights, _), index)| {
            Some(marks::placed(Some(capture), lights, lights.lights.get(index)?).0)
        });
    let mut points = corners.chain(sample).chain(light);
    let first = points.next()?;
    Some(points.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
}

/// The theme's colours for the shaders.
fn look(ui: &Ui) -> Look {
    let visuals = ui.visuals();
    let rgba = |color: Color32, alpha: f32| {
        let [r, g, b, _] = color.to_array().map(|v| f32::from(v) / 255.0);
        [r, g, b, alpha]
    };
    let (wire, line, background) = if visuals.dark_mode { (20, 170, 0.16) } else { (20, 90, 0.86) };
    // Orange stands out from photographs and from every scale but the signed one.
    let accent = Color32::from_rgb(255, 140, 26);
    Look {
        accent: rgba(accent, 1.0),
        wire: rgba(Color32::from_gray(wire), 0.55),
        line: rgba(Color32::from_gray(line), 0.6),
        background,
    }
}
