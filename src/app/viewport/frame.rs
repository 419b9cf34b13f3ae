//! Assembles a frame: the uniforms of the shaders, and the draw calls.

use std::sync::Arc;

use eframe::egui::{Color32, Response, Ui};
use eframe::{egui_wgpu, wgpu};
use glam::Vec3;

use crate::app::viewport::Viewport;
use crate::app::viewport::content::{Content, Shading};
use crate::app::viewport::gpu::Globals;
use crate::app::viewport::known::Look;
use crate::app::viewport::paint::{Batch, Drawn, Items, Paint};
use crate::app::viewport::projection::Projection;
use crate::app::viewport::targets::Targets;

impl Viewport {
    pub(super) fn draw(
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
        self.seen_by = projection.camera(size);

        let depth_map = self.scene.next_depth_map();
        // One a frame; a frame that did not draw its own is no reason for the next.
        let done = depth_map.as_ref().map(|_| self.scene.layers.depth_maps());
        if depth_map.is_some() && done != self.depth_maps {
            ui.ctx().request_repaint();
        }
        self.depth_maps = done;
        let pictures = self.pictures(ui);
        let globals = self.globals(content, look, projection, scale, size);
        let now =
            (globals, self.scene.version, self.settings.clone(), look.background, pictures.len());
        let items = (!self.drawn.is(&now)).then(|| {
            self.scene.write_globals(&globals);
            (self.items(content, look, pictures), now)
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

    /// The photograph that is looked through, or the relit scene.
    fn pictures(&mut self, ui: &Ui) -> Vec<(wgpu::BindGroup, [f32; 2])> {
        const WHOLE: [f32; 2] = [0.0, 1.0];
        if self.settings.shading == Shading::Relit {
            let Some((after, before)) = self.scene.relit.clone() else { return Vec::new() };
            return match before.zip(self.settings.before) {
                Some((before, part)) => vec![(before, [0.0, part]), (after, [part, 1.0])],
                None => vec![(after, WHOLE)],
            };
        }
        let through = self.through.filter(|_| self.settings.look_through_opacity > 0.0);
        let photograph = through.and_then(|index| self.scene.picture(index, ui.ctx()));
        photograph.map(|picture| (picture, WHOLE)).into_iter().collect()
    }

    fn items(
        &self,
        content: &Content,
        look: &Look,
        pictures: Vec<(wgpu::BindGroup, [f32; 2])>,
    ) -> Items {
        let (scene, settings) = (&self.scene, &self.settings);
        let when = |wanted: bool, batch: &Batch| batch.clone().filter(|_| wanted);
        let grey = f64::from(look.background);
        // Over a rendering only what was set into it and what is selected is of use.
        let bare = settings.shading == Shading::Relit && self.scene.relit.is_some();
        let has_cameras = settings.cameras && self.through.is_none() && !bare;
        Items {
            globals: scene.globals.clone(),
            mesh: scene.mesh.clone(),
            mesh_group: scene.mesh_group.clone(),
            edges: (settings.wireframe && !bare) || !content.selected_surfaces.is_empty(),
            pictures,
            lines: [
                when(settings.grid && self.through.is_none() && !bare, &scene.grid),
                when(has_cameras, &scene.frusta),
                when(settings.lights && !bare, &scene.light_lines),
            ],
            thumbs: when(has_cameras && settings.thumbnails, &scene.thumbs),
            lobes: when(settings.lobes && !bare, &scene.lobes),
            discs: when(settings.lights && !bare, &scene.discs),
            points: when(settings.samples && !bare, &scene.points),
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
        let is_relit = self.settings.shading == Shading::Relit;
        let opacity = if is_relit { 1.0 } else { self.settings.look_through_opacity };
        let mut globals = Globals {
            clip_from_world: projection.matrix().to_cols_array_2d(),
            eye: with(projection.eye, f32::from(u8::from(projection.orthographic))),
            right: with(projection.right, ball.1),
            up: with(projection.up, scale),
            forward: with(projection.forward, opacity),
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
        if is_relit {
            globals.picture = [-1.0, 1.0, 1.0, -1.0];
        }
        let mut layers = Vec::new();
        if let (Some(capture), Shading::Photograph) = (&self.scene.capture, self.settings.shading) {
            layers = self.ranked(capture, content, projection);
            self.scene.layers.candidates(capture, ball, &layers, &mut globals.candidates);
        }
        globals.choice = [
            self.settings.shading as u32,
            self.settings.tone_mapping as u32,
            layers.len() as u32,
            index(content.selected_sample),
        ];
        let wireframe = self.settings.wireframe && !(is_relit && self.scene.relit.is_some());
        globals.more = [index(content.selected_light), u32::from(wireframe), 0, 0];
        globals
    }
}

/// The theme's colours for the shaders.
pub fn look(ui: &Ui) -> Look {
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
        line: rgba(Color32::from_gray(line), 0.75),
        background,
    }
}
