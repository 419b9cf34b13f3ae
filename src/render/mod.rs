//! Pictures of a recovered scene, as it is and with other light, materials and objects (Section 6).

pub mod added;
pub mod composite;
pub mod denoise;
pub mod edits;
pub mod film;
pub mod groups;
pub mod lights;
pub mod looks;
pub mod model;
pub mod path;
pub mod probe;
pub mod scene;

use std::time::{Duration, Instant};

use glam::DVec2;
use rayon::prelude::*;

use crate::geometry::bvh::Ray;
use crate::options;
use crate::scene::Camera;
use crate::watch::{Cancelled, Watch};

use film::{Buffer, Film, Pixel};
use path::Sequence;
use scene::Scene;

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
        /// Take noise out where normals, distances and albedos say that neighbours are lit alike;
        /// false for pixels that are means of their own paths.
        denoise: bool = true, None, "";
        /// Seed of all random numbers.
        seed: usize = 1, Some((0.0, 1e15)), "";
    }
}

/// Paths per pixel between looks at clock and noise; even, see [`Film::noise`].
const PASS: usize = 4;

/// Traces paths for every pixel of a camera. The same scene, options and seed give the same
/// numbers on any number of threads. `on_pass` sees what there is after each pass.
pub fn render(
    scene: &Scene,
    camera: &Camera,
    options: &RenderOptions,
    watch: &Watch,
    on_pass: &dyn Fn(&Film),
) -> Result<Film, Cancelled> {
    let mut film = Film::new(camera.width, camera.height, 1 + scene.added.len());
    let passes = options.spp.div_ceil(PASS);
    watch.begin((passes * camera.height) as u64);
    let began = Instant::now();
    while film.paths < options.spp {
        let count = PASS.min(options.spp - film.paths);
        add_paths(scene, camera, options, &mut film, count, watch)?;
        on_pass(&film);
        let is_late = options.time.is_some_and(|s| began.elapsed() >= Duration::from_secs_f64(s));
        // The noise is estimated over all pixels, so only where a limit is set.
        let is_clear =
            options.noise.is_some_and(|limit| film.noise().is_some_and(|noise| noise <= limit));
        if is_late || is_clear {
            break;
        }
    }
    Ok(if options.denoise { denoise::denoised(&film) } else { film })
}

/// Traces `count` more paths for every pixel of a film of the camera's size. A film that this was
/// cancelled for holds some of them only, and is of no use any more.
pub fn add_paths(
    scene: &Scene,
    camera: &Camera,
    options: &RenderOptions,
    film: &mut Film,
    count: usize,
    watch: &Watch,
) -> Result<(), Cancelled> {
    let (width, done, layers) = (film.width, film.paths, film.layers());
    let (stride, rows) = film.rows();
    let rows: Vec<_> = rows.collect();
    rows.into_par_iter().try_for_each(|(y, row)| {
        watch.tick()?;
        let mut buffer = Buffer::new(layers);
        for (x, values) in row.chunks_exact_mut(stride).enumerate() {
            let mut pixel = Pixel::new(values);
            for index in done..done + count {
                let index = index as u64;
                let mut sequence =
                    Sequence::new(options.seed as u64, (y * width + x) as u64, index);
                let place = DVec2::new(x as f64, y as f64) + sequence.point().as_dvec2();
                // Beyond where the lens is defined nothing is seen.
                let Some(direction) = camera.direction(place) else { continue };
                let ray = Ray {
                    origin: camera.position.as_vec3(),
                    direction: direction.as_vec3(),
                    t_min: 0.0,
                    t_max: f32::INFINITY,
                };
                let most = options.reflections;
                let first = scene.trace(ray, most, &mut sequence, buffer.clear());
                pixel.add(index, first, &buffer);
            }
        }
        Ok(())
    })?;
    film.paths += count;
    Ok(())
}
