//! The pipelines, made once, and the buffers that the shaders read in every frame.

use std::cell::Cell;

use bytemuck::{Pod, Zeroable};
use eframe::wgpu;
use wgpu::util::DeviceExt as _;

use crate::app::viewport::content::{Shading, ToneMapping};
use crate::app::viewport::pipeline::{Kind, layout, pipeline, texture, vertices};
use crate::app::viewport::{palette, surfaces};

/// Photographs that a fragment may ask for its colour.
pub const CANDIDATES: usize = 32;
const LOBE_RINGS: u32 = 6;
const LOBE_SEGMENTS: u32 = 10;
pub const LOBE_VERTICES: u32 = LOBE_RINGS * LOBE_SEGMENTS * 6;
/// Bits of a corner's tag that hold its surface; its edges follow.
pub const SURFACE_BITS: u32 = 26;

/// Numbers that the shaders share with the rest.
fn constants() -> String {
    [
        ("RINGS", LOBE_RINGS),
        ("SEGMENTS", LOBE_SEGMENTS),
        ("SURFACE_BITS", SURFACE_BITS),
        ("ROW", surfaces::WIDTH as u32),
        ("SELECTED", surfaces::SELECTED),
        ("HIDDEN", surfaces::HIDDEN),
        ("UNASSIGNED", surfaces::UNASSIGNED),
        ("UNKNOWN_REFLECTANCE", surfaces::UNKNOWN_REFLECTANCE),
        ("BY_PHOTOGRAPH", Shading::Photograph as u32),
        ("BY_MATERIAL", Shading::Material as u32),
        ("BY_REFLECTANCE", Shading::Reflectance as u32),
        ("PBR_NEUTRAL", ToneMapping::Neutral as u32),
        ("FALSE_COLOR", ToneMapping::FalseColor as u32),
    ]
    .map(|(name, value)| format!("const {name}: u32 = {value}u;\n"))
    .concat()
}

/// A type that shaders have, too. All of them are aligned to 16 bytes on both sides.
trait Shared {
    fn wgsl() -> String;
}

impl Shared for [f32; 4] {
    fn wgsl() -> String {
        "vec4<f32>".to_owned()
    }
}

impl Shared for [u32; 4] {
    fn wgsl() -> String {
        "vec4<u32>".to_owned()
    }
}

impl Shared for [[f32; 4]; 4] {
    fn wgsl() -> String {
        "mat4x4<f32>".to_owned()
    }
}

impl Shared for [Candidate; CANDIDATES] {
    fn wgsl() -> String {
        format!("array<Candidate, {CANDIDATES}>")
    }
}

/// A structure with its declaration for the shaders, so that the two cannot differ.
macro_rules! shared {
    ($(#[$about:meta])* $name:ident { $($(#[$note:meta])* $field:ident: $kind:ty,)* }) => {
        $(#[$about])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
        pub struct $name {
            $($(#[$note])* pub $field: $kind,)*
        }

        impl $name {
            fn declaration() -> String {
                let fields = [$(format!("{}: {},\n", stringify!($field), <$kind>::wgsl())),*];
                format!("struct {} {{\n{}}}\n", stringify!($name), fields.concat())
            }
        }
    };
}

shared! {
    /// A photograph that may colour the mesh.
    Candidate {
        clip_from_world: [[f32; 4]; 4],
        /// xyz: where the photograph was taken; w: its layer.
        eye: [f32; 4],
        /// x, y: near and far of its depth map; z: 1 once that is drawn; w: pixel size at 1 m.
        range: [f32; 4],
    }
}

shared! {
    /// What all shaders read.
    Globals {
        clip_from_world: [[f32; 4]; 4],
        /// xyz: the eye; w: 1 if orthographic.
        eye: [f32; 4],
        /// xyz: right; w: radius of the scene.
        right: [f32; 4],
        /// xyz: up; w: pixels of the screen per point.
        up: [f32; 4],
        /// xyz: forward; w: opacity of the photograph.
        forward: [f32; 4],
        accent: [f32; 4],
        wire: [f32; 4],
        /// The photograph's left, top, right and bottom in clip coordinates.
        picture: [f32; 4],
        /// x, y: size in pixels; z: exposure; w: radiance of 1 in the photographs' textures.
        screen: [f32; 4],
        /// Shading, tone mapping, number of candidates, picked sample.
        choice: [u32; 4],
        /// Picked light, 1 to draw the wireframe, unused.
        more: [u32; 4],
        candidates: [Candidate; CANDIDATES],
    }
}

/// A corner of a triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Corner {
    pub position: [f32; 3],
    /// The surface, then the edges as `mesh.wgsl` wants them.
    pub tagged: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Point {
    pub position: [f32; 3],
    pub color: [f32; 3],
    pub is_radiance: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Disc {
    pub center: [f32; 3],
    pub radius: f32,
    pub normal: [f32; 3],
    pub is_ball: u32,
    pub color: [f32; 3],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Line {
    pub from: [f32; 3],
    pub to: [f32; 3],
    pub color: [f32; 4],
    pub width: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct LobeShape {
    pub origin: [f32; 3],
    pub length: f32,
    pub axis: [f32; 3],
    pub exponent: f32,
    pub color: [f32; 3],
}

/// A photograph in the frustum of its camera: where its corner is, and its sides from there.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Thumb {
    /// Upper left.
    pub corner: [f32; 3],
    pub layer: u32,
    pub right: [f32; 3],
    pub down: [f32; 3],
    pub frame: [f32; 4],
    /// Of the frame, in points.
    pub width: f32,
}

/// Everything that does not depend on what is drawn.
pub struct Pipelines {
    pub globals_layout: wgpu::BindGroupLayout,
    pub mesh_layout: wgpu::BindGroupLayout,
    pub picture_layout: wgpu::BindGroupLayout,
    pub blit_layout: wgpu::BindGroupLayout,
    pub smooth: wgpu::Sampler,
    pub near: wgpu::Sampler,
    pub fill: wgpu::RenderPipeline,
    pub wire: wgpu::RenderPipeline,
    /// A photograph's depth map.
    pub depth: wgpu::RenderPipeline,
    pub picture: wgpu::RenderPipeline,
    pub points: wgpu::RenderPipeline,
    pub discs: wgpu::RenderPipeline,
    pub lines: wgpu::RenderPipeline,
    pub lobes: wgpu::RenderPipeline,
    pub thumbs: wgpu::RenderPipeline,
    pub blit: wgpu::RenderPipeline,
}

impl Pipelines {
    pub fn new(device: &wgpu::Device, window: wgpu::TextureFormat) -> Self {
        let both = wgpu::ShaderStages::VERTEX_FRAGMENT;
        let globals = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let float = wgpu::TextureSampleType::Float { filterable: true };
        let flat = |sample_type| texture(sample_type, wgpu::TextureViewDimension::D2);
        let array = |sample_type| texture(sample_type, wgpu::TextureViewDimension::D2Array);
        let globals_layout = layout(device, both, &[globals]);
        let mesh_layout = layout(
            device,
            both,
            &[
                flat(wgpu::TextureSampleType::Uint),
                array(float),
                sampler,
                // As numbers: OpenGL cannot read single texels of what is declared as depth.
                array(wgpu::TextureSampleType::Float { filterable: false }),
            ],
        );
        let fragment = wgpu::ShaderStages::FRAGMENT;
        let picture_layout = layout(device, fragment, &[flat(float), sampler]);
        let blit_layout = layout(device, fragment, &[flat(float)]);

        let common = [
            palette::wgsl(),
            constants(),
            Candidate::declaration(),
            Globals::declaration(),
            include_str!("common.wgsl").to_owned(),
        ]
        .concat();
        let shader = |text: &str| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("viewport"),
                source: wgpu::ShaderSource::Wgsl((common.clone() + text).into()),
            })
        };
        let mesh = shader(include_str!("mesh.wgsl"));
        let drawing = |module: &wgpu::ShaderModule, buffers: &[wgpu::VertexBufferLayout]| {
            pipeline(device, module, &[&globals_layout], buffers, Kind::Strip)
        };
        let corner = wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32];
        let corner = [vertices::<Corner>(&corner, wgpu::VertexStepMode::Vertex)];
        let each = wgpu::VertexStepMode::Instance;
        let point = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Uint32];
        let disc = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Float32, 2 => Float32x3, 3 => Uint32, 4 => Float32x3];
        let line = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Float32x3, 2 => Float32x4, 3 => Float32];
        let lobe = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Float32, 2 => Float32x3, 3 => Float32, 4 => Float32x3];
        let thumb = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Uint32, 2 => Float32x3, 3 => Float32x3, 4 => Float32x4,
            5 => Float32];
        let meshed = [&globals_layout, &mesh_layout];
        let lobes = shader(include_str!("lobes.wgsl"));
        let lobe = [vertices::<LobeShape>(&lobe, each)];
        let thumbs = shader(include_str!("thumbs.wgsl"));
        let thumb = [vertices::<Thumb>(&thumb, each)];
        let picture = shader(include_str!("picture.wgsl"));
        let blit = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("viewport blit"),
            source: wgpu::ShaderSource::Wgsl(include_str!("blit.wgsl").into()),
        });
        Self {
            fill: pipeline(device, &mesh, &meshed, &corner, Kind::Solid),
            wire: pipeline(device, &mesh, &meshed, &corner, Kind::Wire),
            depth: pipeline(device, &mesh, &[&globals_layout], &corner, Kind::Depth),
            picture: pipeline(
                device,
                &picture,
                &[&globals_layout, &picture_layout],
                &[],
                Kind::Overlay,
            ),
            points: drawing(
                &shader(include_str!("points.wgsl")),
                &[vertices::<Point>(&point, each)],
            ),
            discs: drawing(&shader(include_str!("discs.wgsl")), &[vertices::<Disc>(&disc, each)]),
            lines: drawing(&shader(include_str!("lines.wgsl")), &[vertices::<Line>(&line, each)]),
            lobes: pipeline(device, &lobes, &[&globals_layout], &lobe, Kind::Solid),
            thumbs: pipeline(device, &thumbs, &meshed, &thumb, Kind::Solid),
            blit: pipeline(device, &blit, &[&blit_layout], &[], Kind::Window(window)),
            globals_layout,
            mesh_layout,
            picture_layout,
            blit_layout,
            smooth: device.create_sampler(&wgpu::SamplerDescriptor {
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            near: device.create_sampler(&wgpu::SamplerDescriptor {
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
        }
    }

    /// A buffer of globals with the group that binds it.
    pub fn globals(&self, device: &wgpu::Device) -> (wgpu::Buffer, wgpu::BindGroup) {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("viewport globals"),
            size: size_of::<Globals>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = bind(device, &self.globals_layout, &[buffer.as_entire_binding()]);
        (buffer, group)
    }
}

thread_local! {
    static UPLOADED: Cell<Uploaded> = const { Cell::new(Uploaded { times: 0, bytes: 0 }) };
}

/// What was handed to the adapter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uploaded {
    pub times: u64,
    pub bytes: u64,
}

/// What this thread has handed to the adapter so far: vertices, instances, texels and globals.
#[cfg(test)]
pub fn uploaded() -> Uploaded {
    UPLOADED.get()
}

/// Every upload of the viewport is noted here.
pub fn note_upload(bytes: usize) {
    let Uploaded { times, bytes: before } = UPLOADED.get();
    UPLOADED.set(Uploaded { times: times + 1, bytes: before + bytes as u64 });
}

/// A buffer of vertices or instances with their number; `None` where there are none.
pub fn upload<T: Pod>(device: &wgpu::Device, items: &[T]) -> Option<(wgpu::Buffer, u32)> {
    let count = u32::try_from(items.len()).ok().filter(|count| *count > 0)?;
    let contents = bytemuck::cast_slice(items);
    if contents.len() as u64 > device.limits().max_buffer_size {
        return None;
    }
    note_upload(contents.len());
    let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("viewport"),
        contents,
        usage: wgpu::BufferUsages::VERTEX,
    });
    Some((buffer, count))
}

/// The mesh in as many buffers as it takes: the largest that a device allows may hold a part only.
pub fn upload_mesh(device: &wgpu::Device, corners: &[Corner]) -> Vec<(wgpu::Buffer, u32)> {
    let most = corners_in(device.limits().max_buffer_size);
    corners.chunks(most).filter_map(|part| upload(device, part)).collect()
}

/// Corners of the whole triangles that fit into a number of bytes.
fn corners_in(bytes: u64) -> usize {
    3 * (bytes / (3 * size_of::<Corner>() as u64)).clamp(1, u64::from(u32::MAX / 3)) as usize
}

/// Binds resources in their order.
pub fn bind(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource],
) -> wgpu::BindGroup {
    let entries: Vec<_> = resources
        .iter()
        .enumerate()
        .map(|(index, resource)| wgpu::BindGroupEntry {
            binding: index as u32,
            resource: resource.clone(),
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("viewport"),
        layout,
        entries: &entries,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_mesh_are_whole_triangles_within_the_limit() {
        for bytes in [256 << 20, 1 << 20, 100] {
            let corners = corners_in(bytes);
            assert!(corners.is_multiple_of(3) && corners * size_of::<Corner>() <= bytes as usize);
        }
    }
}
