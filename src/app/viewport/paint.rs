//! One frame: draws the scene off screen within egui's encoder, then copies it into the window.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};

use eframe::egui_wgpu::{CallbackResources, CallbackTrait, ScreenDescriptor};
use eframe::{egui, wgpu};

use crate::app::viewport::content::ViewSettings;
use crate::app::viewport::gpu::{Globals, LOBE_VERTICES, Pipelines};
use crate::app::viewport::targets::Targets;

/// Instances or vertices, with their number.
pub type Batch = Option<(wgpu::Buffer, u32)>;

/// Handles on what a frame draws; cheap to clone.
#[derive(Clone)]
pub struct Items {
    pub globals: wgpu::BindGroup,
    /// In parts of whole triangles.
    pub mesh: Vec<(wgpu::Buffer, u32)>,
    pub mesh_group: wgpu::BindGroup,
    /// The wireframe or the outline of a selection is wanted.
    pub edges: bool,
    /// The photograph that is looked through, or pictures of the relit scene, each over a part of
    /// the width.
    pub pictures: Vec<(wgpu::BindGroup, [f32; 2])>,
    pub lines: [Batch; 3],
    pub lobes: Batch,
    pub thumbs: Batch,
    pub discs: Batch,
    pub points: Batch,
    pub background: wgpu::Color,
}

/// A photograph's depth map, to be drawn once.
#[derive(Clone)]
pub struct DepthMap {
    pub globals: wgpu::BindGroup,
    pub view: wgpu::TextureView,
    /// Set once it is drawn.
    pub done: Arc<AtomicBool>,
}

/// What a picture shows, to tell whether it still holds.
pub type Shown = (Globals, u64, ViewSettings, f32, usize);

/// What the picture off screen shows. It is set when the picture is drawn, since egui may throw
/// a frame away before it comes to that.
#[derive(Clone, Default)]
pub struct Drawn(Arc<Mutex<Option<Shown>>>);

impl Drawn {
    pub fn is(&self, shown: &Shown) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).as_ref() == Some(shown)
    }

    fn set(&self, shown: Shown) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(shown);
    }
}

/// What egui calls back for.
pub struct Paint {
    pub pipelines: Arc<Pipelines>,
    pub targets: Arc<Targets>,
    /// `None` where the picture of the frame before still holds.
    pub items: Option<(Items, Shown)>,
    pub drawn: Drawn,
    pub mesh: Vec<(wgpu::Buffer, u32)>,
    pub depth_map: Option<DepthMap>,
}

impl CallbackTrait for Paint {
    fn prepare(
        &self,
        _device: &wgpu::Device,
        _queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        _resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if let Some(map) = &self.depth_map {
            self.draw_depth(encoder, map);
        }
        if let Some((items, shown)) = &self.items {
            self.draw(encoder, items);
            self.drawn.set(shown.clone());
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        _resources: &CallbackResources,
    ) {
        pass.set_pipeline(&self.pipelines.blit);
        pass.set_bind_group(0, &self.targets.finished, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl Paint {
    fn draw_depth(&self, encoder: &mut wgpu::CommandEncoder, map: &DepthMap) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("depth of a photograph"),
            color_attachments: &[],
            depth_stencil_attachment: Some(cleared(&map.view, wgpu::StoreOp::Store)),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipelines.depth);
        pass.set_bind_group(0, &map.globals, &[]);
        for (vertices, count) in &self.mesh {
            pass.set_vertex_buffer(0, vertices.slice(..));
            pass.draw(0..*count, 0..1);
        }
        map.done.store(true, Relaxed);
    }

    fn draw(&self, encoder: &mut wgpu::CommandEncoder, items: &Items) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("viewport"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.targets.color,
                depth_slice: None,
                resolve_target: Some(&self.targets.resolved),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(items.background),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            depth_stencil_attachment: Some(cleared(&self.targets.depth, wgpu::StoreOp::Discard)),
            ..Default::default()
        });
        let pipelines = &*self.pipelines;
        pass.set_bind_group(0, &items.globals, &[]);
        pass.set_pipeline(&pipelines.fill);
        pass.set_bind_group(1, &items.mesh_group, &[]);
        for (vertices, count) in &items.mesh {
            pass.set_vertex_buffer(0, vertices.slice(..));
            pass.draw(0..*count, 0..1);
        }
        let [width, height] = self.targets.size;
        for (picture, part) in &items.pictures {
            let [left, right] = part.map(|part| ((part * width as f32).round() as u32).min(width));
            if left < right {
                pass.set_scissor_rect(left, 0, right - left, height);
                pass.set_pipeline(&pipelines.picture);
                pass.set_bind_group(1, picture, &[]);
                pass.draw(0..4, 0..1);
            }
        }
        pass.set_scissor_rect(0, 0, width, height);
        if items.edges {
            pass.set_pipeline(&pipelines.wire);
            pass.set_bind_group(1, &items.mesh_group, &[]);
            for (vertices, count) in &items.mesh {
                pass.set_vertex_buffer(0, vertices.slice(..));
                pass.draw(0..*count, 0..1);
            }
        }
        pass.set_bind_group(1, &items.mesh_group, &[]);
        let mut instances = |pipeline: &wgpu::RenderPipeline, batch: &Batch, vertices: u32| {
            if let Some((buffer, count)) = batch {
                pass.set_pipeline(pipeline);
                pass.set_vertex_buffer(0, buffer.slice(..));
                pass.draw(0..vertices, 0..*count);
            }
        };
        instances(&pipelines.lobes, &items.lobes, LOBE_VERTICES);
        instances(&pipelines.thumbs, &items.thumbs, 6);
        for lines in &items.lines {
            instances(&pipelines.lines, lines, 4);
        }
        instances(&pipelines.points, &items.points, 4);
        instances(&pipelines.discs, &items.discs, 4);
    }
}

fn cleared(
    view: &wgpu::TextureView,
    store: wgpu::StoreOp,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store }),
        stencil_ops: None,
    }
}
