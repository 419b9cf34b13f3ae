//! A graphics card as a tracer.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::{Duration, Instant};

use wgpu::{
    Adapter, Backends, BindGroupDescriptor, BindGroupEntry, BindGroupLayout,
    BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType, Buffer, BufferBindingType,
    BufferDescriptor, BufferUsages, CommandEncoderDescriptor, ComputePassDescriptor,
    ComputePipeline, Device, DeviceDescriptor, DeviceType, Instance, InstanceDescriptor, Limits,
    MapMode, PipelineLayout, PipelineLayoutDescriptor, PollType, Queue, ShaderStages,
};

use super::parameters::Parameters;
use super::shader::{GROUP, Needs};
use super::upload::{TooLarge, Uploaded};
use crate::render::film::{STRIP, SurfaceFilm};
use crate::render::packed::Occurring;
use crate::render::tiles::Tile;
use crate::render::tracer::{Processor, Tracer};
use crate::render::{Exposure, PASS, Pass};
use crate::watch::{Cancelled, Watch};

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

/// A graphics card that traces paths, one pass after the other, for whoever shares it.
pub struct Card {
    name: String,
    device: Device,
    queue: Queue,
    limits: Limits,
    layout: BindGroupLayout,
    pipeline_layout: PipelineLayout,
    state: Mutex<State>,
    /// What went wrong on the card, as its driver tells it.
    failure: Arc<Mutex<Option<String>>>,
}

#[derive(Default)]
struct State {
    uploaded: Option<Uploaded>,
    pipelines: HashMap<Needs, ComputePipeline>,
    film: Option<Film>,
    /// Paths that the card traced in a second of late.
    pace: f64,
    /// Why the processor traces instead.
    trouble: Option<String>,
}

/// Sums of a tile, on the card and where they can be read.
struct Film {
    bytes: u64,
    sums: Buffer,
    readable: Buffer,
}

#[derive(Debug, thiserror::Error)]
enum Failed {
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    #[error("{0}")]
    Device(String),
    #[error("{0}")]
    Cancelled(Cancelled),
}

/// The paths that a card is taken to trace in a second before it was timed: so few that none takes
/// long for the first ones.
const FIRST_PACE: f64 = 1e6;
/// Work is handed over in parts of this length: systems end a dispatch that takes a second or two,
/// and a window that the same card draws waits for it.
const DISPATCH: Duration = Duration::from_millis(40);
/// Time between two looks at noise and clock.
const AT_ONCE_SECS: f64 = 0.5;
/// The most memory for the sums of a tile.
const MOST_FILM_BYTES: u64 = 64 << 20;
/// The longest that a dispatch may take before the card counts as lost.
const LOST: Duration = Duration::from_secs(60);

impl Card {
    /// The best one. Takes up to seconds.
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
        if limits.max_storage_buffers_per_shader_stage < 7 {
            return Err(refused("its shaders read too few buffers".to_owned()));
        }
        let descriptor = DeviceDescriptor {
            label: Some("paths"),
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
        let entry = |binding: u32| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer {
                ty: match binding {
                    0 => BufferBindingType::Uniform,
                    1..=6 => BufferBindingType::Storage { read_only: true },
                    _ => BufferBindingType::Storage { read_only: false },
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("paths"),
            entries: &std::array::from_fn::<_, 8, _>(|binding| entry(binding as u32)),
        });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("paths"),
            bind_group_layouts: &[Some(&layout)],
            ..PipelineLayoutDescriptor::default()
        });
        let state = Mutex::new(State { pace: FIRST_PACE, ..State::default() });
        Ok(Self { name, device, queue, limits, layout, pipeline_layout, state, failure })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What the driver complained of since the last time.
    fn check(&self) -> Result<(), Failed> {
        let complaint = self.failure.lock().unwrap_or_else(PoisonError::into_inner).take();
        complaint.map_or(Ok(()), |complaint| Err(Failed::Device(complaint)))
    }

    fn trace_tiles(
        &self,
        pass: &Pass,
        surfaces: &mut SurfaceFilm,
        exposures: &mut [Exposure],
        watch: &Watch,
    ) -> Result<(), Failed> {
        let state = &mut *self.state();
        let queues = (&self.device, &self.queue);
        let uploaded = Uploaded::new(state.uploaded.take(), pass, queues, &self.limits)?;
        let needs = Needs::new(Occurring::new(pass), uploaded.trees.stack_size);
        let pipeline = state
            .pipelines
            .entry(needs)
            .or_insert_with(|| needs.pipeline(&self.device, &self.pipeline_layout))
            .clone();
        self.check()?;
        let parameters = Parameters::new(pass, &uploaded.trees, &uploaded.tables.places);
        let pixel_bytes = 16 * Tile::sums(pass.scene.layers) as u64;
        let most_bytes = MOST_FILM_BYTES.min(self.limits.max_storage_buffer_binding_size);
        let mut traced = Ok(());
        loop {
            // No more than what one path of each pixel takes the length of a dispatch for.
            let in_time = (state.pace * DISPATCH.as_secs_f64()) as usize;
            let most = in_time.min((most_bytes / pixel_bytes) as usize);
            let Some(tile) = pass.next_tile(surfaces, exposures, most) else { break };
            let bytes = pixel_bytes * tile.pixels.len() as u64;
            let film = match state.film.take() {
                Some(film) if film.bytes >= bytes => film,
                _ => self.film(bytes),
            };
            let film = state.film.insert(film);
            let job = Job {
                card: self,
                pipeline: &pipeline,
                uploaded: &uploaded,
                film,
                bytes,
                parameters,
            };
            let sums = match job.sums(&tile, &mut state.pace, watch) {
                Ok(sums) => sums,
                Err(failed) => {
                    traced = Err(failed);
                    break;
                }
            };
            pass.add(surfaces, exposures, &tile, &sums);
            let strips = tile.pixels.len().div_ceil(STRIP);
            let ticks = strips * tile.paths.len().div_ceil(PASS);
            if let Err(cancelled) = watch.advance(ticks as u64) {
                traced = Err(Failed::Cancelled(cancelled));
                break;
            }
        }
        state.uploaded = Some(uploaded);
        traced
    }

    fn film(&self, bytes: u64) -> Film {
        let buffer = |usage| {
            self.device.create_buffer(&BufferDescriptor {
                label: Some("sums"),
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        };
        let sums = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST);
        Film { bytes, sums, readable: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST) }
    }
}

/// Keeps the first complaint.
fn note(failure: &Mutex<Option<String>>, complaint: String) {
    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(complaint);
}

/// A tile's way over the card.
struct Job<'a> {
    card: &'a Card,
    pipeline: &'a ComputePipeline,
    uploaded: &'a Uploaded,
    film: &'a Film,
    /// Of the film those of the tile.
    bytes: u64,
    parameters: Parameters,
}

impl Job<'_> {
    fn sums(&self, tile: &Tile, pace: &mut f64, watch: &Watch) -> Result<Vec<[f32; 4]>, Failed> {
        let Self { card, film, bytes, .. } = self;
        let Card { device, queue, .. } = card;
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        encoder.clear_buffer(&film.sums, 0, Some(*bytes));
        queue.submit([encoder.finish()]);
        let mut done = tile.paths.start;
        while done < tile.paths.end {
            watch.check().map_err(Failed::Cancelled)?;
            let pixels = tile.pixels.len() as f64;
            let most = (*pace * DISPATCH.as_secs_f64() / pixels).max(1.0) as usize;
            let paths = done..(done + most).min(tile.paths.end);
            let began = Instant::now();
            self.dispatch(tile, &paths)?;
            let took = began.elapsed().as_secs_f64().max(1e-4);
            // It may be new to the shader, or not yet at full speed.
            let found = pixels * paths.len() as f64 / took;
            *pace = found.clamp(0.5 * *pace, 4.0 * *pace);
            done = paths.end;
        }
        self.read()
    }

    fn dispatch(&self, tile: &Tile, paths: &Range<usize>) -> Result<(), Failed> {
        let Self { card, pipeline, uploaded, film, parameters, .. } = self;
        let Card { device, queue, layout, .. } = card;
        let uniform = device.create_buffer(&BufferDescriptor {
            label: Some("parameters"),
            size: size_of::<Parameters>() as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&parameters.of_tile(tile, paths)));
        let [tree, triangles, small, large, choices, photographs] = uploaded.buffers();
        let bound = [&uniform, tree, triangles, small, large, choices, photographs, &film.sums];
        let entries: Vec<BindGroupEntry> = bound
            .iter()
            .zip(0..)
            .map(|(buffer, binding)| BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = device.create_bind_group(&BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        });
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        let mut work = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        work.set_pipeline(pipeline);
        work.set_bind_group(0, &group, &[]);
        work.dispatch_workgroups(tile.pixels.len().div_ceil(GROUP) as u32, 1, 1);
        drop(work);
        queue.submit([encoder.finish()]);
        self.wait()
    }

    fn wait(&self) -> Result<(), Failed> {
        let poll = PollType::Wait { submission_index: None, timeout: Some(LOST) };
        let polled = self.card.device.poll(poll);
        self.card.check()?;
        polled.map_err(|error| Failed::Device(error.to_string())).map(|_| ())
    }

    fn read(&self) -> Result<Vec<[f32; 4]>, Failed> {
        let &Self { card, film, bytes, .. } = self;
        let mut encoder = card.device.create_command_encoder(&CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&film.sums, 0, &film.readable, 0, bytes);
        card.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        film.readable.slice(..bytes).map_async(MapMode::Read, move |mapped| {
            // Nobody listens where the wait below failed.
            let _ = sender.send(mapped);
        });
        self.wait()?;
        let failed = |error: &dyn std::fmt::Display| Failed::Device(error.to_string());
        receiver.recv().map_err(|e| failed(&e))?.map_err(|e| failed(&e))?;
        let sums = {
            let view = film.readable.slice(..bytes).get_mapped_range().map_err(|e| failed(&e))?;
            bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(&view)
        };
        film.readable.unmap();
        Ok(sums)
    }
}

impl Tracer for Card {
    fn name(&self) -> String {
        match self.state().trouble {
            Some(_) => Processor.name(),
            None => self.name.clone(),
        }
    }

    /// Why the processor traces in its place.
    fn trouble(&self) -> Option<String> {
        self.state().trouble.clone()
    }

    fn paths_at_once(&self, pixels: usize) -> usize {
        let passes = self.state().pace * AT_ONCE_SECS / (pixels.max(1) * PASS) as f64;
        (passes as usize).clamp(1, 256) * PASS
    }

    fn trace(
        &self,
        pass: &Pass,
        surfaces: &mut SurfaceFilm,
        exposures: &mut [Exposure],
        watch: &Watch,
    ) -> Result<(), Cancelled> {
        if self.state().trouble.is_none() {
            match self.trace_tiles(pass, surfaces, exposures, watch) {
                Ok(()) => return Ok(()),
                Err(Failed::Cancelled(cancelled)) => return Err(cancelled),
                Err(failed) => {
                    let state = &mut *self.state();
                    *state = State { trouble: Some(failed.to_string()), ..State::default() };
                }
            }
        }
        // Strips that the card ended stay, and the processor goes on.
        pass.trace(surfaces, exposures, watch)
    }
}
