//! The off-screen render targets: egui's own pass has no depth buffer and too few samples.

use eframe::wgpu;

use crate::app::viewport::gpu::{Pipelines, bind};

/// Colours are encoded for the screen by the shaders, as egui's are.
pub const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Samples per pixel.
pub const SAMPLES: u32 = 4;

pub struct Targets {
    pub size: [u32; 2],
    pub color: wgpu::TextureView,
    pub resolved: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    /// Binds the finished picture for the copy into the window.
    pub finished: wgpu::BindGroup,
}

impl Targets {
    pub fn new(device: &wgpu::Device, pipelines: &Pipelines, size: [u32; 2]) -> Self {
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let bound = attachment | wgpu::TextureUsages::TEXTURE_BINDING;
        let resolved = view(device, size, COLOR, 1, bound);
        let finished =
            bind(device, &pipelines.blit_layout, &[wgpu::BindingResource::TextureView(&resolved)]);
        Self {
            size,
            color: view(device, size, COLOR, SAMPLES, attachment),
            depth: view(device, size, DEPTH, SAMPLES, attachment),
            resolved,
            finished,
        }
    }
}

fn view(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("viewport target"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
