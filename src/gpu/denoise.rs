//! Noise is taken out of pictures on the card, by the filter of
//! [`render::denoise`](crate::render::denoise).

use bytemuck::{Pod, Zeroable};
use wgpu::{
    BindGroupLayout, Buffer, BufferUsages, ComputePipeline, ComputePipelineDescriptor,
    PipelineCompilationOptions, ShaderModuleDescriptor, ShaderSource,
};

use super::device::{Failed, Gpu};
use crate::math::rgb::CHANNELS;
use crate::render::denoise::{Guides, Light, ROUNDS};

/// Pixels of a group of threads, across and down.
const GROUP: [usize; 2] = [32, 4];

/// As `Params` of `denoise.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    width: u32,
    height: u32,
    planes: u32,
    step: i32,
}

/// The shaders, and room for pictures, which grows with them.
pub struct Denoiser {
    layout: BindGroupLayout,
    smooth_variance: ComputePipeline,
    round: ComputePipeline,
    room: Option<Room>,
}

struct Room {
    /// Of the guides, and of the light.
    bytes: [u64; 2],
    guides: Buffer,
    /// Before a round and after it, by turns.
    light: [Buffer; 2],
    readable: Buffer,
}

impl Denoiser {
    pub fn new(gpu: &Gpu) -> Self {
        let layout = gpu.layout("denoise", 2);
        let pipeline_layout = gpu.pipeline_layout(&layout);
        let module = gpu.device.create_shader_module(ShaderModuleDescriptor {
            label: Some("denoise"),
            source: ShaderSource::Wgsl(include_str!("denoise.wgsl").into()),
        });
        let pipeline = |name| {
            gpu.device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some(name),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(name),
                compilation_options: PipelineCompilationOptions::default(),
                cache: None,
            })
        };
        let (smooth_variance, round) = (pipeline("smooth_variance"), pipeline("filtered"));
        Self { layout, smooth_variance, round, room: None }
    }

    /// Whether a card takes a picture at once.
    pub fn fits(light: &Light, gpu: &Gpu) -> bool {
        size_of_val(&*light.rows) as u64 <= gpu.most_bytes()
    }

    /// The rows of a picture with less noise.
    pub fn filtered(
        &mut self,
        gpu: &Gpu,
        guides: &Guides,
        light: &Light,
    ) -> Result<Vec<f32>, Failed> {
        let planes = CHANNELS * light.layers;
        let height = light.rows.len() / (light.width * (planes + 2)).max(1);
        if height == 0 {
            return Ok(light.rows.clone());
        }
        let bytes = [guides.rows(), &light.rows].map(|values| size_of_val(values) as u64);
        let room = match self.room.take() {
            Some(room) if room.bytes[0] >= bytes[0] && room.bytes[1] >= bytes[1] => room,
            _ => Room::new(gpu, bytes),
        };
        let room = self.room.insert(room);
        gpu.queue.write_buffer(&room.guides, 0, bytemuck::cast_slice(guides.rows()));
        gpu.queue.write_buffer(&room.light[0], 0, bytemuck::cast_slice(&light.rows));
        let groups = [light.width.div_ceil(GROUP[0]), height.div_ceil(GROUP[1])];
        let steps = (0..ROUNDS).map(|round| (&self.round, 1 << round));
        let mut last = 0;
        for (pipeline, step) in std::iter::once((&self.smooth_variance, 1)).chain(steps) {
            let uniform = gpu.uniform(&Parameters {
                width: light.width as u32,
                height: height as u32,
                planes: planes as u32,
                step,
            });
            let buffers = [&uniform, &room.guides, &room.light[last], &room.light[1 - last]];
            gpu.dispatch(pipeline, (&self.layout, &buffers), groups);
            last = 1 - last;
        }
        gpu.read(&room.light[last], &room.readable, bytes[1])
    }
}

impl Room {
    fn new(gpu: &Gpu, bytes: [u64; 2]) -> Self {
        let held = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let light = || gpu.buffer("light", bytes[1], held | BufferUsages::COPY_SRC);
        Self {
            bytes,
            guides: gpu.buffer("guides", bytes[0], held),
            light: [light(), light()],
            readable: gpu.buffer(
                "light",
                bytes[1],
                BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            ),
        }
    }
}
