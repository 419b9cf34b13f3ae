//! Builds a render pipeline.

use eframe::wgpu;

use crate::app::viewport::targets::{COLOR, DEPTH, SAMPLES};

pub fn layout(
    device: &wgpu::Device,
    visibility: wgpu::ShaderStages,
    types: &[wgpu::BindingType],
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = types
        .iter()
        .enumerate()
        .map(|(index, ty)| wgpu::BindGroupLayoutEntry {
            binding: index as u32,
            visibility,
            ty: *ty,
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("viewport"),
        entries: &entries,
    })
}

pub fn texture(
    sample_type: wgpu::TextureSampleType,
    view_dimension: wgpu::TextureViewDimension,
) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

pub fn vertices<'a, T>(
    attributes: &'a [wgpu::VertexAttribute],
    step_mode: wgpu::VertexStepMode,
) -> wgpu::VertexBufferLayout<'a> {
    let array_stride = size_of::<T>() as u64;
    let read: u64 = attributes.iter().map(|attribute| attribute.format.size()).sum();
    assert_eq!(read, array_stride, "the attributes are the fields of the structure");
    wgpu::VertexBufferLayout { array_stride, step_mode, attributes }
}

/// What a pipeline draws.
#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    /// Triangles that hide what is behind.
    Solid,
    /// The edges of what is drawn already.
    Wire,
    /// Depth only, once.
    Depth,
    /// A quad over everything so far.
    Overlay,
    /// Translucent quads in the scene, that write no depth.
    Strip,
    /// Into the window.
    Window(wgpu::TextureFormat),
}

pub fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    groups: &[&wgpu::BindGroupLayout],
    buffers: &[wgpu::VertexBufferLayout],
    kind: Kind,
) -> wgpu::RenderPipeline {
    let groups: Vec<_> = groups.iter().map(|group| Some(*group)).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("viewport"),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    let buffers: Vec<_> = buffers.iter().cloned().map(Some).collect();
    let (vertex, fragment) = match kind {
        Kind::Depth => ("bare", None),
        Kind::Wire => ("corner", Some("wire")),
        Kind::Window(format) if format.is_srgb() => ("corner", Some("decoded")),
        Kind::Window(_) => ("corner", Some("plain")),
        _ => ("corner", Some("fill")),
    };
    let (format, samples) = match kind {
        Kind::Window(format) => (format, 1),
        Kind::Depth => (COLOR, 1),
        _ => (COLOR, SAMPLES),
    };
    let is_opaque = matches!(kind, Kind::Solid | Kind::Window(_));
    let target = Some(wgpu::ColorTargetState {
        format,
        blend: (!is_opaque).then_some(wgpu::BlendState::ALPHA_BLENDING),
        write_mask: wgpu::ColorWrites::ALL,
    });
    let compare = match kind {
        Kind::Overlay => wgpu::CompareFunction::Always,
        _ => wgpu::CompareFunction::LessEqual,
    };
    let depth = wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(matches!(kind, Kind::Solid | Kind::Depth)),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    };
    let strip = matches!(kind, Kind::Overlay | Kind::Strip);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("viewport"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: Default::default(),
            buffers: &buffers,
        },
        primitive: wgpu::PrimitiveState {
            topology: if strip {
                wgpu::PrimitiveTopology::TriangleStrip
            } else {
                wgpu::PrimitiveTopology::TriangleList
            },
            ..Default::default()
        },
        depth_stencil: (!matches!(kind, Kind::Window(_))).then_some(depth),
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: fragment.map(|entry_point| wgpu::FragmentState {
            module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            targets: std::slice::from_ref(&target),
        }),
        multiview_mask: None,
        cache: None,
    })
}
