//! Pictures of a recovered scene, as it is and with other light, materials and objects (Section 6).

pub mod added;
mod asked;
pub mod composite;
pub mod denoise;
pub mod edits;
pub mod film;
mod finer;
mod grid;
pub mod groups;
pub mod layers;
mod light;
pub mod lights;
pub mod looks;
pub mod model;
pub mod packed;
pub mod path;
pub mod preview;
pub mod probe;
mod scatter;
pub mod scene;
mod sky;
pub mod tiles;
pub mod tracer;
pub mod view;

use std::ops::Range;
use std::time::{Duration, Instant};

use glam::DVec2;
use rayon::prelude::*;

use crate::geometry::bvh::Ray;
use crate::math::rgb::CHANNELS;
use crate::scene::Camera;
use crate::watch::{Cancelled, Watch};
use crate::{choices, options};

use film::{Buffer, Film, LightFilm, STRIP, SURFACE_STRIDE, SurfaceFilm};
use path::{Sequence, Sought};
use scene::Scene;
use tracer::{Processor, Tracer};

choices! {
    /// What traces the paths of pictures.
    Engine {
        /// A graphics card where there is one, and else the processor.
        Auto = "auto",
        /// The same seed gives the same picture, to the byte.
        Processor = "processor",
        /// A graphics card; an error where there is none.
        Card = "card",
    }
}

options! {
    /// How pictures are made.
    RenderOptions in "render" {
        /// Paths per pixel at most.
        spp: usize = 64, Some((1.0, 1e6)), "";
        /// Relative noise of the whole picture at which to stop earlier; auto: never.
        noise: Option<f64> = None, Some((1e-5, 1.0)), "";
        /// Time per picture after which to stop earlier; auto: never. Another machine, or the
        /// same at another time, then makes another picture.
        time: Option<f64> = None, Some((0.01, 1e6)), "s";
        /// Reflections that a path goes through at most.
        reflections: usize = 16, Some((1.0, 1000.0)), "";
        /// Denoise by averaging neighbours whose normals, distances and albedos are similar; with
        /// false every pixel is the mean of its own paths.
        denoise: bool = true, None, "";
        /// Seed of all random numbers.
        seed: usize = 1, Some((0.0, 1e15)), "";
        /// What traces the paths: a graphics card (card), the processor, or a card where there is one
        /// (auto). Pictures of a card have the same means, but are not the same to the byte.
        engine: Engine = Engine::Auto, None, "";
    }
}

/// Paths per pixel between looks at clock and noise; even, see [`Film::noise`].
pub const PASS: usize = 4;

/// Traces paths for every pixel of a camera on this processor. The same scene, options and seed give
/// the same numbers on any number of threads. `on_pass` sees what there is after each pass.
pub fn render(
    scene: &Scene,
    camera: &Camera,
    options: &RenderOptions,
    watch: &Watch,
    on_pass: &dyn Fn(&Film),
) -> Result<Film, Cancelled> {
    render_by(&Processor, scene, camera, options, watch, on_pass)
}

/// The same by a tracer.
pub fn render_by(
    tracer: &dyn Tracer,
    scene: &Scene,
    camera: &Camera,
    options: &RenderOptions,
    watch: &Watch,
    on_pass: &dyn Fn(&Film),
) -> Result<Film, Cancelled> {
    let mut film = Film::new(camera.width, camera.height, scene.layers);
    let sought = scene.all_lights();
    let passes = options.spp.div_ceil(PASS);
    watch.begin((passes * (camera.width * camera.height).div_ceil(STRIP)) as u64);
    let began = Instant::now();
    while film.paths < options.spp {
        let more = tracer.paths_at_once(camera.width * camera.height);
        let upto = (film.paths + more).min(options.spp);
        let all = Exposure { film: &mut film.light, layers: 0..scene.layers + 1 };
        let pass = Pass { scene, camera, options, sought: &sought, upto };
        tracer.trace(&pass, &mut film.surfaces, &mut [all], watch)?;
        film.paths = upto;
        on_pass(&film);
        let is_late = options.time.is_some_and(|s| began.elapsed() >= Duration::from_secs_f64(s));
        // The noise is estimated over all pixels, so only where a limit is set.
        let is_clear =
            options.noise.is_some_and(|limit| film.noise().is_some_and(|noise| noise <= limit));
        if is_late || is_clear {
            break;
        }
    }
    Ok(if options.denoise { denoise::denoised(&film, tracer) } else { film })
}

/// A film that paths add to, and which of the scene's layers it holds.
pub struct Exposure<'a> {
    pub film: &'a mut LightFilm,
    pub layers: Range<usize>,
}

/// Paths that are to be traced through every pixel of a camera.
pub struct Pass<'a> {
    pub scene: &'a Scene<'a>,
    pub camera: &'a Camera,
    pub options: &'a RenderOptions,
    pub sought: &'a Sought,
    /// The number of paths that every pixel has afterwards.
    pub upto: usize,
}

/// What one task adds to.
struct Strip<'a> {
    /// Of its first pixel.
    first: usize,
    /// Paths of the surfaces, and their numbers.
    surfaces: (&'a mut u32, &'a mut [f32]),
    /// The same of every film.
    films: Vec<(&'a mut u32, &'a mut [f32])>,
}

impl Pass<'_> {
    /// Adds to films of the camera's size, all of which have the same numbers of paths. A layer's
    /// numbers do not depend on which others are traced with it. When it is cancelled, the strips
    /// that are done stay, and a further pass goes on with the others.
    pub fn trace(
        &self,
        surfaces: &mut SurfaceFilm,
        exposures: &mut [Exposure],
        watch: &Watch,
    ) -> Result<(), Cancelled> {
        let shapes: Vec<(Range<usize>, usize, usize)> = exposures
            .iter()
            .map(|e| (e.layers.clone(), e.film.summed(), e.film.layers() * CHANNELS + 1))
            .collect();
        let mut strips: Vec<Strip> = surfaces
            .strips_mut()
            .enumerate()
            .map(|(index, surfaces)| Strip { first: index * STRIP, surfaces, films: Vec::new() })
            .collect();
        for exposure in exposures {
            for (strip, part) in strips.iter_mut().zip(exposure.film.strips_mut()) {
                strip.films.push(part);
            }
        }
        strips.into_par_iter().try_for_each(|strip| {
            watch.tick()?;
            self.trace_strip(strip, &shapes);
            Ok(())
        })
    }

    fn trace_strip(&self, mut strip: Strip, shapes: &[(Range<usize>, usize, usize)]) {
        let Self { scene, camera, options, sought, upto } = *self;
        let done = strip.films.first().map_or(upto, |(paths, _)| **paths as usize);
        debug_assert!(strip.films.iter().all(|(paths, _)| **paths as usize == done));
        if done >= upto {
            return;
        }
        let seen = *strip.surfaces.0 as usize;
        let mut buffer = Buffer::new(scene.layers);
        let surfaces = strip.surfaces.1.chunks_exact_mut(SURFACE_STRIDE);
        for (within, surface) in surfaces.enumerate() {
            let pixel = strip.first + within;
            let corner = DVec2::new((pixel % camera.width) as f64, (pixel / camera.width) as f64);
            for index in done..upto {
                let mut sequence = Sequence::new(options.seed as u64, pixel as u64, index as u64);
                let place = corner + sequence.point().as_dvec2();
                // Beyond where the lens is defined nothing is seen.
                let Some(direction) = camera.direction(place) else { continue };
                let ray = Ray {
                    origin: camera.position.as_vec3(),
                    direction: direction.as_vec3(),
                    t_min: 0.0,
                    t_max: f32::INFINITY,
                };
                let most = options.reflections;
                let first = scene.trace(ray, most, &mut sequence, sought, buffer.clear());
                buffer.take(index as u64, first, index >= seen);
            }
            for ((_, values), (layers, summed, stride)) in strip.films.iter_mut().zip(shapes) {
                let values = &mut values[within * stride..(within + 1) * stride];
                buffer.give(values, layers.clone(), *summed);
            }
            buffer.finish(surface);
        }
        *strip.surfaces.0 = upto.max(seen) as u32;
        for (paths, _) in &mut strip.films {
            **paths = upto as u32;
        }
    }
}
