//! Paths per second of pictures on a graphics card beside the processor, on recovered captures.
//!
//!     cargo bench --bench card -- [--software] CAPTURE SOLUTION [CAPTURE SOLUTION ...]
//!
//! prints of each capture, as it is and with an added lamp, the rates of both, how long each takes to
//! take out the noise, and by how many standard errors the means of their pictures differ: as a whole
//! and at most over 64 blocks of pixels and three channels, of which one in ten captures may pass 3.5 by chance. `--software`
//! takes an adapter in software where there is no card. Solutions are folders that `lobelia
//! reconstruct` wrote.

#[cfg(not(feature = "gpu"))]
fn main() {}

#[cfg(feature = "gpu")]
fn main() {
    card::main();
}

#[cfg(feature = "gpu")]
mod card {
    use std::path::{Path, PathBuf};
    use std::time::Instant;

    use glam::Vec3;

    use lobelia::geometry::bvh::RayCaster;
    use lobelia::gpu::{Adapters, Card};
    use lobelia::io::{capture, solved};
    use lobelia::math::rgb::Radiance;
    use lobelia::render::denoise::denoised;
    use lobelia::render::edits::{AddedLight, Edits, Shape};
    use lobelia::render::film::Film;
    use lobelia::render::scene::{Geometry, Scene};
    use lobelia::render::tracer::{Processor, Tracer};
    use lobelia::render::{RenderOptions, render_by};
    use lobelia::scene::{Camera, Capture, Emitter, Views};
    use lobelia::watch::Watch;

    /// Paths per pixel on the processor and on the card.
    const PATHS: [usize; 2] = [16, 256];
    const ROUNDS: usize = 3;
    /// Blocks of pixels along a side of the picture.
    const BLOCKS: usize = 8;

    pub fn main() {
        // `cargo test` runs benches, too, to see that they start.
        if std::env::args().any(|argument| argument == "--test") {
            return;
        }
        let mut arguments: Vec<String> = std::env::args().skip(1).collect();
        arguments.retain(|argument| argument != "--bench");
        let is_software = arguments.iter().any(|argument| argument == "--software");
        arguments.retain(|argument| argument != "--software");
        let adapters = if is_software { Adapters::Software } else { Adapters::Cards };
        let began = Instant::now();
        let card = match Card::find(adapters) {
            Ok(card) => card,
            Err(reason) => return println!("{reason}"),
        };
        println!("{}, found in {:.2} s", card.name(), began.elapsed().as_secs_f64());
        for pair in arguments.chunks_exact(2) {
            compare(&card, Path::new(&pair[0]), &PathBuf::from(&pair[1]), is_software);
        }
    }

    fn compare(card: &Card, folder: &Path, solution: &Path, is_software: bool) {
        let watch = Watch::new();
        let capture = capture::load(folder, &watch).expect("the capture is sound");
        let solved = solved::read(solution, &capture).expect("the solution is sound");
        let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
        let views = Views::new(&capture, &caster, &watch).expect("not cancelled");
        let camera = capture.photographs[0].camera;
        let camera = if is_software { camera.reduced(4) } else { camera };
        let lit = with_a_lamp(&capture);
        for (what, edits) in [("as it is", Edits::default()), ("with a lamp", lit)] {
            let geometry = Geometry::new(&capture, &solved, &edits);
            let places = [camera.position.as_vec3()];
            let scene = Scene::new(&views, &geometry, &solved, &edits, &places);
            let began = Instant::now();
            picture(card, &scene, &camera, 2, 99);
            let first = began.elapsed().as_secs_f64();
            let paths = if is_software { [PATHS[0], 32] } else { PATHS };
            let (slow, by_processor) = timed(&Processor, &scene, &camera, paths[0]);
            let (fast, by_card) = timed(card, &scene, &camera, paths[1]);
            let [clear_slow, clear_fast] =
                [&Processor as &dyn Tracer, card].map(|tracer| denoised_secs(&by_card, tracer));
            let (whole, most) = differences(&by_processor, &by_card, &camera);
            println!(
                "card {} {}x{} {what}: {:.1} M/s, processor {:.2} M/s, ratio {:.1}; first picture \
                 {first:.2} s; differs by {whole:.1} standard errors, at most {most:.1}; noise taken \
                 out in {:.1} ms, processor {:.1} ms{}",
                capture.name,
                camera.width,
                camera.height,
                fast / 1e6,
                slow / 1e6,
                fast / slow,
                1e3 * clear_fast,
                1e3 * clear_slow,
                card.trouble().map_or(String::new(), |trouble| format!("; FAILED: {trouble}")),
            );
        }
    }

    fn picture(
        tracer: &dyn Tracer,
        scene: &Scene,
        camera: &Camera,
        spp: usize,
        seed: usize,
    ) -> Film {
        let options = RenderOptions { spp, seed, denoise: false, ..RenderOptions::default() };
        render_by(tracer, scene, camera, &options, &Watch::new(), &|_| ()).expect("not cancelled")
    }

    /// The best of some rounds in paths per second, and the last picture.
    fn timed(tracer: &dyn Tracer, scene: &Scene, camera: &Camera, spp: usize) -> (f64, Film) {
        let paths = (camera.width * camera.height * spp) as f64;
        let mut best = 0.0f64;
        let mut last = None;
        for round in 0..ROUNDS {
            let began = Instant::now();
            last = Some(picture(tracer, scene, camera, spp, 1 + round));
            best = best.max(paths / began.elapsed().as_secs_f64());
        }
        (best, last.expect("there are rounds"))
    }

    /// The best of some rounds.
    fn denoised_secs(film: &Film, tracer: &dyn Tracer) -> f64 {
        let times = (0..ROUNDS).map(|_| {
            let began = Instant::now();
            denoised(film, tracer);
            began.elapsed().as_secs_f64()
        });
        times.fold(f64::INFINITY, f64::min)
    }

    /// By how many standard errors the means of pictures differ, as a whole and at most in a block;
    /// the larger of the channels.
    fn differences(a: &Film, b: &Film, camera: &Camera) -> (f64, f64) {
        let (a, b) = (a.beauty(), b.beauty());
        let mut most = [0.0f64; 2];
        for channel in 0..3 {
            most[0] = most[0].max(errors((0..a.len()).map(|k| (&a[k], &b[k])), channel));
            for block in 0..BLOCKS * BLOCKS {
                let within = |k: &usize| {
                    let (x, y) = (k % camera.width, k / camera.width);
                    BLOCKS * (BLOCKS * y / camera.height) + BLOCKS * x / camera.width == block
                };
                let pairs = (0..a.len()).filter(within).map(|k| (&a[k], &b[k]));
                most[1] = most[1].max(errors(pairs, channel));
            }
        }
        (most[0], most[1])
    }

    fn errors<'a>(
        pairs: impl Iterator<Item = (&'a Radiance, &'a Radiance)>,
        channel: usize,
    ) -> f64 {
        let values: Vec<f64> =
            pairs.map(|(a, b)| f64::from(a[channel]) - f64::from(b[channel])).collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
        if variance > 0.0 { mean.abs() / (variance / count).sqrt() } else { 0.0 }
    }

    /// A ball above the middle of the room.
    fn with_a_lamp(capture: &Capture) -> Edits {
        let (low, high) = capture.mesh.bounds().expect("there is geometry");
        let center = 0.5 * (low + high) + 0.2 * (high - low) * Vec3::Z;
        let radius_m = 0.02 * (high - low).length();
        let light = AddedLight {
            name: "lamp".to_owned(),
            shape: Shape::Emitter(Emitter::Sphere { center, radius_m }),
            emission: [30.0, 25.0, 20.0],
            is_on: true,
        };
        Edits { lights: vec![light], ..Edits::default() }
    }
}
