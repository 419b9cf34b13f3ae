//! A graphics card as a tracer.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use wgpu::{BindGroupLayout, Buffer, BufferUsages, ComputePipeline, PipelineLayout};

use super::denoise::Denoiser;
use super::device::{Adapters, Failed, Gpu, NoCard};
use super::parameters::Parameters;
use super::shader::{GROUP, Needs};
use super::upload::Uploaded;
use crate::render::denoise::{Guides, Light};
use crate::render::film::{STRIP, SurfaceFilm};
use crate::render::packed::{self, Occurring};
use crate::render::tiles::Tile;
use crate::render::tracer::{Processor, Tracer};
use crate::render::{Exposure, PASS, Pass};
use crate::watch::{Cancelled, Watch};

/// A graphics card that traces paths, one pass after the other, for whoever shares it.
pub struct Card {
    gpu: Gpu,
    layout: BindGroupLayout,
    pipeline_layout: PipelineLayout,
    /// Parts of Sobol's points.
    points: Buffer,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    uploaded: Option<Uploaded>,
    pipelines: HashMap<Needs, ComputePipeline>,
    film: Option<Film>,
    denoiser: Option<Denoiser>,
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

impl Card {
    /// The best one. Takes up to seconds.
    pub fn find(adapters: Adapters) -> Result<Self, NoCard> {
        let gpu = Gpu::find(adapters)?;
        let layout = gpu.layout("paths", 7);
        let pipeline_layout = gpu.pipeline_layout(&layout);
        let points = gpu.table("points", &packed::sobol());
        let state = Mutex::new(State { pace: FIRST_PACE, ..State::default() });
        Ok(Self { gpu, layout, pipeline_layout, points, state })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn trace_tiles(
        &self,
        pass: &Pass,
        surfaces: &mut SurfaceFilm,
        exposures: &mut [Exposure],
        watch: &Watch,
    ) -> Result<(), Failed> {
        let state = &mut *self.state();
        let uploaded = Uploaded::new(state.uploaded.take(), pass, &self.gpu)?;
        let needs = Needs::new(Occurring::new(pass), uploaded.trees.stack_size);
        let pipeline = state
            .pipelines
            .entry(needs)
            .or_insert_with(|| needs.pipeline(&self.gpu.device, &self.pipeline_layout))
            .clone();
        self.gpu.check()?;
        let parameters = Parameters::new(pass, &uploaded.trees, &uploaded.tables.places);
        let pixel_bytes = 16 * Tile::sums(pass.scene.layers) as u64;
        let most_bytes = MOST_FILM_BYTES.min(self.gpu.most_bytes());
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
        let buffer = |usage| self.gpu.buffer("sums", bytes, usage);
        let sums = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST);
        Film { bytes, sums, readable: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST) }
    }

    /// Ends the work on the card for good where it failed.
    fn done<T>(&self, result: Result<T, Failed>) -> Result<Option<T>, Cancelled> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(Failed::Cancelled(cancelled)) => Err(cancelled),
            Err(failed) => {
                let state = &mut *self.state();
                *state = State { trouble: Some(failed.to_string()), ..State::default() };
                Ok(None)
            }
        }
    }
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
        card.gpu.clear(&film.sums, *bytes);
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
        card.gpu.read(&film.sums, &film.readable, *bytes)
    }

    fn dispatch(&self, tile: &Tile, paths: &Range<usize>) -> Result<(), Failed> {
        let Self { card, pipeline, uploaded, film, parameters, .. } = self;
        let uniform = card.gpu.uniform(&parameters.of_tile(tile, paths));
        let [tree, triangles, small, large, choices, photographs] = uploaded.buffers();
        let buffers = [
            &uniform,
            tree,
            triangles,
            small,
            large,
            choices,
            photographs,
            &card.points,
            &film.sums,
        ];
        let groups = [tile.pixels.len().div_ceil(GROUP), 1];
        card.gpu.dispatch(pipeline, (&card.layout, &buffers), groups);
        card.gpu.wait()
    }
}

impl Tracer for Card {
    fn name(&self) -> String {
        match self.state().trouble {
            Some(_) => Processor.name(),
            None => self.gpu.name.clone(),
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
        let is_well = self.trouble().is_none();
        if is_well && self.done(self.trace_tiles(pass, surfaces, exposures, watch))?.is_some() {
            return Ok(());
        }
        // Strips that the card ended stay, and the processor goes on.
        pass.trace(surfaces, exposures, watch)
    }

    fn denoise(&self, guides: &Guides, light: Light) -> Light {
        if self.trouble().is_some() || !Denoiser::fits(&light, &self.gpu) {
            return Processor.denoise(guides, light);
        }
        let rows = {
            let state = &mut *self.state();
            let denoiser = state.denoiser.get_or_insert_with(|| Denoiser::new(&self.gpu));
            denoiser.filtered(&self.gpu, guides, &light)
        };
        match self.done(rows) {
            Ok(Some(rows)) => Light { rows, ..light },
            _ => Processor.denoise(guides, light),
        }
    }
}
