//! The device of `wgpu` that stands for a graphics card, and work that is handed over to it.

use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;

use bytemuck::Pod;
use wgpu::{
    Adapter, Backends, BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout,
    BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType, Buffer, BufferBindingType,
    BufferDescriptor, BufferUsages, CommandEncoder, CommandEncoderDescriptor,
    ComputePassDescriptor, ComputePipeline, Device, DeviceDescriptor, DeviceType, Instance,
    InstanceDescriptor, Limits, MapMode, PipelineLayout, PipelineLayoutDescriptor, PollType, Queue,
    ShaderStages,
};

use crate::watch::Cancelled;

/// Which devices count as graphics cards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adapters {
    /// Those that are none in software.
    Cards,
    /// Those in software alone, for tests: they are slower than our own tracer.
    Software,
}

/// Why there is no card.
#[derive(Debug, thiserror::Error)]
pub enum NoCard {
    #[error("no graphics card with a driver for Vulkan, Metal or Direct3D 12 was found")]
    NoAdapter,
    #[error("the graphics card {name} cannot be used: {reason}")]
    Refused { name: String, reason: String },
}

/// A part of a scene is larger than a card takes at once.
#[derive(Debug, thiserror::Error)]
#[error("{what} of the scene take {} MB, more than the {} MB that the card takes at once", bytes >> 20, most >> 20)]
pub struct TooLarge {
    pub what: &'static str,
    pub bytes: u64,
    pub most: u64,
}

/// Why a card did not end its work.
#[derive(Debug, thiserror::Error)]
pub enum Failed {
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    #[error("{0}")]
    Device(String),
    #[error("{0}")]
    Cancelled(Cancelled),
}

/// The longest that a dispatch may take before the card counts as lost.
const LOST: Duration = Duration::from_secs(60);

/// A device with its queue of work.
pub struct Gpu {
    /// That of the adapter and of the interface by which it is reached.
    pub name: String,
    pub device: Device,
    pub queue: Queue,
    limits: Limits,
    /// What went wrong on the card, as its driver tells it.
    failure: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// The best adapter's. Takes up to seconds.
    pub fn find(adapters: Adapters) -> Result<Self, NoCard> {
        let instance = Instance::new(InstanceDescriptor {
            backends: Backends::VULKAN | Backends::METAL | Backends::DX12,
            ..InstanceDescriptor::new_without_display_handle()
        });
        let found = pollster::block_on(instance.enumerate_adapters(Backends::all()));
        let rank = |adapter: &Adapter| match (adapters, adapter.get_info().device_type) {
            (Adapters::Cards, DeviceType::DiscreteGpu) => Some(0),
            (Adapters::Cards, DeviceType::VirtualGpu) => Some(1),
            (Adapters::Cards, DeviceType::IntegratedGpu) => Some(2),
            (Adapters::Software, DeviceType::Cpu) => Some(0),
            _ => None,
        };
        let ranked = found.into_iter().filter_map(|adapter| Some((rank(&adapter)?, adapter)));
        let (_, adapter) = ranked.min_by_key(|(rank, _)| *rank).ok_or(NoCard::NoAdapter)?;
        Self::new(&adapter)
    }

    fn new(adapter: &Adapter) -> Result<Self, NoCard> {
        let info = adapter.get_info();
        let name = format!("{} ({})", info.name, info.backend);
        let refused = |reason: String| NoCard::Refused { name: name.clone(), reason };
        let limits = adapter.limits();
        if limits.max_storage_buffers_per_shader_stage < 8 {
            return Err(refused("its shaders read too few buffers".to_owned()));
        }
        let descriptor = DeviceDescriptor {
            label: Some("lobelia"),
            required_limits: limits.clone(),
            ..DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| refused(error.to_string()))?;
        let failure = Arc::new(Mutex::new(None));
        let (of_errors, of_loss) = (failure.clone(), failure.clone());
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            note(&of_errors, error.to_string());
        }));
        device.set_device_lost_callback(move |_, message| note(&of_loss, message));
        Ok(Self { name, device, queue, limits, failure })
    }

    /// The largest buffer that a shader reads or writes.
    pub fn most_bytes(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size)
    }

    /// What the driver complained of since the last time.
    pub fn check(&self) -> Result<(), Failed> {
        let complaint = self.failure.lock().unwrap_or_else(PoisonError::into_inner).take();
        complaint.map_or(Ok(()), |complaint| Err(Failed::Device(complaint)))
    }

    /// One uniform buffer, some that shaders read, and one that they write, in the order of their
    /// bindings.
    pub fn layout(&self, label: &str, read: u32) -> BindGroupLayout {
        let entry = |binding: u32| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer {
                ty: match binding {
                    0 => BufferBindingType::Uniform,
                    _ => BufferBindingType::Storage { read_only: binding <= read },
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let entries: Vec<BindGroupLayoutEntry> = (0..read + 2).map(entry).collect();
        self.device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        })
    }

    /// For shaders whose buffers are all of one layout.
    pub fn pipeline_layout(&self, layout: &BindGroupLayout) -> PipelineLayout {
        self.device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(layout)],
            ..PipelineLayoutDescriptor::default()
        })
    }

    /// Buffers in the order of a layout.
    fn group(&self, layout: &BindGroupLayout, buffers: &[&Buffer]) -> BindGroup {
        let resources = buffers.iter().map(|buffer| buffer.as_entire_binding());
        let entries: Vec<BindGroupEntry> = resources
            .zip(0..)
            .map(|(resource, binding)| BindGroupEntry { binding, resource })
            .collect();
        self.device.create_bind_group(&BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        })
    }

    pub fn buffer(&self, label: &str, size: u64, usage: BufferUsages) -> Buffer {
        self.device.create_buffer(&BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    /// A uniform buffer with some parameters.
    pub fn uniform<T: Pod>(&self, values: &T) -> Buffer {
        self.filled("parameters", std::slice::from_ref(values), BufferUsages::UNIFORM)
    }

    /// A buffer that shaders read some values from.
    pub fn table<T: Pod>(&self, label: &str, values: &[T]) -> Buffer {
        self.filled(label, values, BufferUsages::STORAGE)
    }

    fn filled<T: Pod>(&self, label: &str, values: &[T], usage: BufferUsages) -> Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        // A binding must not be empty.
        let size = (bytes.len() as u64).max(16);
        let buffer = self.buffer(label, size, usage | BufferUsages::COPY_DST);
        if !bytes.is_empty() {
            self.queue.write_buffer(&buffer, 0, bytes);
        }
        buffer
    }

    /// Hands over one dispatch of `groups` groups of threads, with the buffers of a layout.
    pub fn dispatch(
        &self,
        pipeline: &ComputePipeline,
        (layout, buffers): (&BindGroupLayout, &[&Buffer]),
        [across, down]: [usize; 2],
    ) {
        let group = self.group(layout, buffers);
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor::default());
        let mut work = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        work.set_pipeline(pipeline);
        work.set_bind_group(0, &group, &[]);
        work.dispatch_workgroups(across as u32, down as u32, 1);
        drop(work);
        self.submit(encoder);
    }

    /// Sets the first `bytes` of a buffer to 0.
    pub fn clear(&self, buffer: &Buffer, bytes: u64) {
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor::default());
        encoder.clear_buffer(buffer, 0, Some(bytes));
        self.submit(encoder);
    }

    fn submit(&self, encoder: CommandEncoder) {
        self.queue.submit([encoder.finish()]);
    }

    /// Waits for all work that was submitted.
    pub fn wait(&self) -> Result<(), Failed> {
        let poll = PollType::Wait { submission_index: None, timeout: Some(LOST) };
        let polled = self.device.poll(poll);
        self.check()?;
        polled.map_err(|error| Failed::Device(error.to_string())).map(|_| ())
    }

    /// The first `bytes` of a buffer, by way of one that can be read.
    pub fn read<T: Pod>(
        &self,
        buffer: &Buffer,
        readable: &Buffer,
        bytes: u64,
    ) -> Result<Vec<T>, Failed> {
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, readable, 0, bytes);
        self.submit(encoder);
        let (sender, receiver) = mpsc::channel();
        readable.slice(..bytes).map_async(MapMode::Read, move |mapped| {
            // Nobody listens where the wait below failed.
            let _ = sender.send(mapped);
        });
        self.wait()?;
        let failed = |error: &dyn std::fmt::Display| Failed::Device(error.to_string());
        receiver.recv().map_err(|e| failed(&e))?.map_err(|e| failed(&e))?;
        let values = {
            let view = readable.slice(..bytes).get_mapped_range().map_err(|e| failed(&e))?;
            bytemuck::pod_collect_to_vec::<u8, T>(&view)
        };
        readable.unmap();
        Ok(values)
    }
}

/// Keeps the first complaint.
fn note(failure: &Mutex<Option<String>>, complaint: String) {
    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(complaint);
}
