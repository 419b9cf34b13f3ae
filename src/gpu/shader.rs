//! The shader, and its pipelines for what occurs in a scene.

use wgpu::{
    ComputePipeline, ComputePipelineDescriptor, Device, PipelineCompilationOptions, PipelineLayout,
    ShaderModuleDescriptor, ShaderRuntimeChecks, ShaderSource,
};

use crate::render::packed::Occurring;

/// Threads of a group, which trace a pixel each.
pub const GROUP: usize = 64;

/// Children that can be put aside are at least as many, so that few shaders are made.
const LEAST_STACK: usize = 32;

/// What a pipeline is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Needs {
    occurring: Occurring,
    stack: usize,
}

impl Needs {
    pub fn new(occurring: Occurring, stack_size: usize) -> Self {
        // One more than on the processor, where leaves are looked at before they are put aside.
        Self { occurring, stack: (stack_size + 1).next_power_of_two().max(LEAST_STACK) }
    }

    /// The text of the shader.
    pub fn source(&self) -> String {
        let parts = [
            include_str!("path.wgsl"),
            include_str!("sampling.wgsl"),
            include_str!("tree.wgsl"),
            include_str!("surfaces.wgsl"),
            include_str!("lights.wgsl"),
            include_str!("photographs.wgsl"),
        ];
        format!("const STACK: u32 = {}u;\n{}", self.stack, parts.join("\n"))
    }

    pub fn pipeline(&self, device: &Device, layout: &PipelineLayout) -> ComputePipeline {
        let descriptor = ShaderModuleDescriptor {
            label: Some("paths"),
            source: ShaderSource::Wgsl(self.source().into()),
        };
        let checks = ShaderRuntimeChecks {
            bounds_checks: false,
            force_loop_bounding: false,
            ..ShaderRuntimeChecks::checked()
        };
        // SAFETY: indices come from `render::packed`, which makes the tables together; the stack
        // has room for what the tree says; every loop ends, or the path does by its length.
        let module = unsafe { device.create_shader_module_trusted(descriptor, checks) };
        let Occurring { sky, photographed, glossy, glass, added, recovered } = self.occurring;
        let constants = [
            ("HAS_SKY", sky),
            ("HAS_PHOTOGRAPHS", photographed),
            ("IS_GLOSSY", glossy),
            ("HAS_GLASS", glass),
            ("HAS_ADDED", added),
            ("HAS_RECOVERED", recovered),
        ];
        let constants = constants.map(|(name, is_so)| (name, f64::from(u8::from(is_so))));
        device.create_compute_pipeline(&ComputePipelineDescriptor {
            label: Some("paths"),
            layout: Some(layout),
            module: &module,
            entry_point: Some("paths"),
            compilation_options: PipelineCompilationOptions {
                constants: &constants,
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        })
    }
}
