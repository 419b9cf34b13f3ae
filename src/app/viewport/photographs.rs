//! The photographs' textures and depth maps on the GPU.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use eframe::wgpu;
use glam::Vec3;

use crate::app::viewport::gpu::{CANDIDATES, Candidate, Globals, Pipelines, bind, note_upload};
use crate::app::viewport::paint::DepthMap;
use crate::app::viewport::projection::{Projection, Range, window};
use crate::app::viewport::targets::DEPTH;
use crate::app::viewport::texels;
use crate::scene::Capture;

/// Bytes that the photographs for the mesh may take.
const BUDGET: usize = 256 << 20;
/// Longest side of a photograph for the mesh.
const LONGEST: usize = 1024;
/// Layers that every adapter offers.
const MOST_LAYERS: usize = 256;

/// All photographs in one size, for colouring the mesh.
pub struct Layers {
    pub size: [usize; 2],
    /// The photograph of each layer.
    pub photographs: Vec<usize>,
    is_filled: Vec<bool>,
    has_depth: Vec<Arc<AtomicBool>>,
    colors: wgpu::Texture,
    depths: wgpu::Texture,
    pub colors_view: wgpu::TextureView,
    pub depths_view: wgpu::TextureView,
}

impl Layers {
    pub fn new(device: &wgpu::Device, capture: &Capture) -> Self {
        let mut all: Vec<usize> = capture.measurements().map(|(index, ..)| index).collect();
        // Where nothing measures radiance, the geometry wears what there is to display.
        if all.is_empty() {
            let is_displayed = |index: &usize| capture.photographs[*index].display.is_some();
            all = (0..capture.photographs.len()).filter(is_displayed).collect();
        }
        let step = all.len().div_ceil(MOST_LAYERS).max(1);
        let photographs: Vec<usize> = all.into_iter().step_by(step).collect();
        let shape = photographs.first().map_or([1, 1], |index| {
            let camera = &capture.photographs[*index].camera;
            [camera.width, camera.height]
        });
        // Eight bytes of colour and four of depth a texel.
        let texels = BUDGET / 12 / photographs.len().max(1);
        let ratio = shape[0].max(shape[1]) as f64 / shape[0].min(shape[1]).max(1) as f64;
        let longest = LONGEST.min((texels as f64 * ratio).sqrt() as usize);
        let size = texels::within(shape, longest.max(16));
        let make = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("photographs"),
                size: wgpu::Extent3d {
                    width: size[0] as u32,
                    height: size[1] as u32,
                    depth_or_array_layers: layers(photographs.len(), size),
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let colors = make(wgpu::TextureFormat::Rgba16Float, wgpu::TextureUsages::COPY_DST);
        let depths = make(DEPTH, wgpu::TextureUsages::RENDER_ATTACHMENT);
        let array = wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        };
        Self {
            size,
            is_filled: vec![false; photographs.len()],
            has_depth: photographs.iter().map(|_| Arc::default()).collect(),
            photographs,
            colors_view: colors.create_view(&array),
            depths_view: depths.create_view(&array),
            colors,
            depths,
        }
    }

    pub fn fill(&mut self, queue: &wgpu::Queue, photograph: usize, texels: &[u16]) {
        let Some(layer) = self.photographs.iter().position(|other| *other == photograph) else {
            return;
        };
        if texels.len() == 4 * self.size[0] * self.size[1] {
            write(queue, &self.colors, layer as u32, self.size, texels);
            self.is_filled[layer] = true;
        }
    }

    /// The next depth map that is to be drawn; one a frame, so that none is held up.
    pub fn next_depth_map(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        pipelines: &Pipelines,
        capture: &Capture,
        scene: (Vec3, f32),
    ) -> Option<DepthMap> {
        let layer = self.has_depth.iter().position(|has| !has.load(Relaxed))?;
        let camera = &capture.photographs[self.photographs[layer]].camera;
        let projection = Projection::image(camera, range(camera.position.as_vec3(), scene));
        let (buffer, globals) = pipelines.globals(device);
        let values = Globals {
            clip_from_world: projection.matrix().to_cols_array_2d(),
            ..Globals::default()
        };
        note_upload(size_of::<Globals>());
        queue.write_buffer(&buffer, 0, bytemuck::bytes_of(&values));
        let view = self.depths.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            base_array_layer: layer as u32,
            array_layer_count: Some(1),
            ..Default::default()
        });
        Some(DepthMap { globals, view, done: self.has_depth[layer].clone() })
    }

    /// Layers that hold their photograph by now, each with its index.
    pub fn filled(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let layers = self.photographs.iter().copied().enumerate();
        layers.filter(|(layer, _)| self.is_filled[*layer])
    }

    /// The photographs that are not there yet.
    pub fn missing(&self) -> Vec<usize> {
        let layers = self.photographs.iter().zip(&self.is_filled);
        layers.filter(|(_, is_filled)| !**is_filled).map(|(photograph, _)| *photograph).collect()
    }

    /// The mesh is another: all depth maps are drawn again.
    pub fn forget_depths(&mut self) {
        self.has_depth.fill_with(Arc::default);
    }

    /// The number of depth maps that have been drawn.
    pub fn depth_maps(&self) -> usize {
        self.has_depth.iter().filter(|has| has.load(Relaxed)).count()
    }

    /// Whether all photographs are there with their depth.
    pub fn is_complete(&self) -> bool {
        self.is_filled.iter().all(|done| *done) && self.depth_maps() == self.has_depth.len()
    }

    /// The layers of the photographs that may colour the mesh in a view, the likeliest first: the
    /// preferred one, then those taken from near the eye in the same direction.
    pub fn ranked(
        &self,
        capture: &Capture,
        projection: &Projection,
        scene: (Vec3, f32),
        preferred: Option<usize>,
    ) -> Vec<usize> {
        let mut ranked: Vec<(f32, usize)> = Vec::new();
        for (layer, photograph) in self.photographs.iter().enumerate() {
            if !self.is_filled[layer] {
                continue;
            }
            let camera = &capture.photographs[*photograph].camera;
            let forward = -camera.world_from_camera.z_axis.as_vec3();
            let away = camera.position.as_vec3().distance(projection.eye) / scene.1.max(1e-6);
            let mut score = away.min(4.0) + 2.0 * (1.0 - forward.dot(projection.forward));
            if preferred == Some(*photograph) {
                score = -1.0;
            }
            ranked.push((score, layer));
        }
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        ranked.truncate(CANDIDATES);
        ranked.into_iter().map(|(_, layer)| layer).collect()
    }

    /// What the shader has to know of layers.
    pub fn candidates(
        &self,
        capture: &Capture,
        scene: (Vec3, f32),
        layers: &[usize],
        candidates: &mut [Candidate],
    ) {
        for (slot, &layer) in candidates.iter_mut().zip(layers) {
            let camera = &capture.photographs[self.photographs[layer]].camera;
            let eye = camera.position.as_vec3();
            let range = range(eye, scene);
            let (low, high) = window(camera);
            let pixel_m = (high.y - low.y) / (camera.focal_px.y * self.size[1] as f64);
            *slot = Candidate {
                clip_from_world: Projection::image(camera, range).matrix().to_cols_array_2d(),
                eye: eye.extend(layer as f32).to_array(),
                range: [
                    range.near as f32,
                    range.far as f32,
                    f32::from(u8::from(self.has_depth[layer].load(Relaxed))),
                    3.0 * pixel_m as f32,
                ],
            };
        }
    }
}

/// Layers for so many photographs. On OpenGL one layer would become a plain texture, and squares in
/// multiples of six a cube, neither of which binds as an array.
fn layers(photographs: usize, [width, height]: [usize; 2]) -> u32 {
    let count = photographs.max(2) as u32;
    if width == height && count.is_multiple_of(6) { count + 1 } else { count }
}

/// Distances from an eye between which the scene lies.
pub fn range(eye: Vec3, (center, radius): (Vec3, f32)) -> Range {
    let far = eye.distance(center) + 3.0 * radius;
    Range { near: f64::from(2e-3 * radius).max(1e-4 * f64::from(far)), far: f64::from(far) }
}

/// A photograph in full, bound for drawing it.
pub fn picture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    pipelines: &Pipelines,
    size: [usize; 2],
    texels: &[u16],
) -> Option<wgpu::BindGroup> {
    if texels.is_empty() {
        return None;
    }
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("photograph"),
        size: wgpu::Extent3d {
            width: size[0] as u32,
            height: size[1] as u32,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    write(queue, &texture, 0, size, texels);
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let resources = [
        wgpu::BindingResource::TextureView(&view),
        wgpu::BindingResource::Sampler(&pipelines.near),
    ];
    Some(bind(device, &pipelines.picture_layout, &resources))
}

fn write(
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    layer: u32,
    [width, height]: [usize; 2],
    texels: &[u16],
) {
    note_upload(size_of_val(texels));
    queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
            aspect: wgpu::TextureAspect::All,
        },
        bytemuck::cast_slice(texels),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(8 * width as u32),
            rows_per_image: Some(height as u32),
        },
        wgpu::Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: 1 },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_never_taken_for_a_plain_texture_or_a_cube() {
        assert_eq!([0, 1, 2, 6].map(|count| layers(count, [640, 480])), [2, 2, 2, 6]);
        assert_eq!([5, 6, 7, 12].map(|count| layers(count, [512, 512])), [5, 7, 7, 13]);
        assert!(layers(MOST_LAYERS, [512, 512]) as usize <= MOST_LAYERS);
    }
}
