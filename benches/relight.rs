//! How soon a change to a recovered scene is seen in a view of 1280×720 pixels, in the shipped
//! example, or in every capture named in `LOBELIA_RELIT` (folders, separated by colons):
//!
//! - a lamp's strength, for which layers are recombined, against the same picture traced anew;
//! - a lamp's place: the first picture, for which its layer alone is traced;
//! - with `LOBELIA_ERRORS` set, until that picture's root mean square error is 5 % of its mean, against
//!   256 paths a pixel.
//!
//! `LOBELIA_ENGINE=card` traces on a graphics card; retracing is on the processor in any case.

use std::hint::black_box;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DVec2, Vec3};
use lobelia::geometry::bvh::RayCaster;
use lobelia::io;
use lobelia::math::rgb::Radiance;
use lobelia::options::OptionValue;
use lobelia::reconstruct::{self, Options};
use lobelia::render::edits::{AddedLight, Edits, Shape};
use lobelia::render::preview::{Asked, Picture, Preview};
use lobelia::render::scene::{Geometry, Scene, Solved};
use lobelia::render::{Engine, RenderOptions, render};
use lobelia::scene::{Camera, Capture, Emitter, Views};
use lobelia::watch::Watch;
use lobelia::worker::engine::{self, Chosen};

const SIZE: (usize, usize) = (1280, 720);
/// The error at which the clock is stopped, relative to the mean.
const ERROR: f64 = 0.05;

fn captures() -> Vec<PathBuf> {
    let named = std::env::var_os("LOBELIA_RELIT");
    named.map_or_else(
        || vec![PathBuf::from("assets/examples/corner")],
        |named| std::env::split_paths(&named).collect(),
    )
}

/// The first photograph's camera with the size of a view.
fn view(capture: &Capture) -> Camera {
    let Camera { focal_px, height, world_from_camera, position, .. } =
        capture.photographs[0].camera;
    let size = DVec2::new(SIZE.0 as f64, SIZE.1 as f64);
    let focal_px = focal_px * size.y / height as f64;
    Camera::new(SIZE, focal_px, 0.5 * size, Default::default(), world_from_camera, position)
}

/// A lamp in the middle of the scene, a few steps of a millimetre from there.
fn with_lamp(capture: &Capture, place: usize, strength: f64) -> Edits {
    let (low, high) = capture.mesh.bounds().unwrap_or_default();
    let center = 0.5 * (low + high) + Vec3::X * 1e-3 * place as f32;
    let radius_m = 0.02 * (high - low).length();
    let shape = Shape::Emitter(Emitter::Sphere { center, radius_m });
    let lamp = AddedLight { name: "lamp".into(), shape, emission: [strength; 3], is_on: true };
    Edits { lights: vec![lamp], ..Edits::default() }
}

fn ask(preview: &mut Preview, camera: Camera, edits: &Edits) {
    let edits = Arc::new(edits.clone());
    preview.ask(Asked { edits, camera, photograph: None, before: false });
}

/// Traces until a picture will do.
fn until(preview: &mut Preview, will_do: impl Fn(&Picture) -> bool) -> Picture {
    loop {
        if let Some(picture) = preview.picture().filter(&will_do) {
            return picture;
        }
        let plan = preview.plan().expect("there is more to trace");
        preview.trace(&plan, &Watch::new()).expect("not cancelled");
    }
}

fn brightness((radiance, _): &(Radiance, f32)) -> f64 {
    radiance.iter().map(|&value| f64::from(value)).sum()
}

/// Root mean square difference of two pictures, relative to the mean of the second.
fn error(picture: &Picture, truth: &Picture) -> f64 {
    let (mut squares, mut sum) = (0.0, 0.0);
    let step = truth.width / picture.width;
    for (index, truth_pixel) in truth.after.iter().enumerate() {
        let (x, y) = (index % truth.width / step, index / truth.width / step);
        if x < picture.width && y < picture.height {
            let found = brightness(&picture.after[y * picture.width + x]);
            squares += (found - brightness(truth_pixel)).powi(2);
        }
        sum += brightness(truth_pixel);
    }
    let count = truth.after.len() as f64;
    (squares / count).sqrt() / (sum / count)
}

/// Processor time of this program so far, of all threads.
fn processor_secs() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name, which is in brackets: fields 14 and 15, in hundredths of a second.
    let rest = text.rsplit(')').next().unwrap_or_default();
    let ticks = rest.split_whitespace().skip(11).take(2).filter_map(|n| n.parse::<f64>().ok());
    ticks.sum::<f64>() / 100.0
}

struct Began {
    at: Instant,
    processor_secs: f64,
}

impl Began {
    fn now() -> Self {
        Self { at: Instant::now(), processor_secs: processor_secs() }
    }
}

/// The least time by the clock, and the mean of the processor's, which a busy machine does not
/// lengthen.
struct Least {
    least: Duration,
    processor_secs: f64,
    count: usize,
}

impl Least {
    fn new() -> Self {
        Self { least: Duration::MAX, processor_secs: 0.0, count: 0 }
    }

    fn add(&mut self, began: &Began) {
        self.least = self.least.min(began.at.elapsed());
        self.processor_secs += processor_secs() - began.processor_secs;
        self.count += 1;
    }

    fn mean_secs(&self) -> f64 {
        self.processor_secs / self.count.max(1) as f64
    }
}

impl std::fmt::Display for Least {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (least, mean) = (1e3 * self.least.as_secs_f64(), 1e3 * self.mean_secs());
        write!(out, "{least:.0} ms ({mean:.0} ms of the processor)")
    }
}

fn relight(criterion: &mut Criterion) {
    // `cargo test` runs benches, too, to see that they start.
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    for folder in captures() {
        let capture = io::capture::load(&folder, &Watch::new()).expect("a sound capture");
        let mut options = Options::default();
        options.set("joint", "light_sets", "1").expect("an option");
        let whole = reconstruct::run(&capture, &options, &Watch::new(), &|_| ()).expect("a result");
        let solved = Solved::new(&capture, &whole);
        let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
        let views = Views::new(&capture, &caster, &Watch::new()).expect("not cancelled");
        let camera = view(&capture);
        let name = std::env::var("LOBELIA_ENGINE").unwrap_or_else(|_| "processor".to_owned());
        let engine = Engine::parse(&name).expect("auto, processor or card");
        let Chosen { tracer, reason } = engine::tracer(engine);
        assert!(engine != Engine::Card || reason.is_none(), "{reason:?}");
        println!("traced by {}", tracer.name());
        let mut preview = Preview::by(tracer, &views, &solved);
        // A lamp that adds about as much light as there is.
        ask(&mut preview, camera, &with_lamp(&capture, 0, 1.0));
        let part = |picture: &Picture| picture.after.iter().map(brightness).sum::<f64>();
        let (mut off, mut lit) = (Edits::default(), with_lamp(&capture, 0, 1.0));
        lit.original_light = 0.0;
        off.surroundings = lit.surroundings;
        let of_lamp = {
            ask(&mut preview, camera, &lit);
            part(&until(&mut preview, |_| true))
        };
        let of_rest = {
            ask(&mut preview, camera, &off);
            part(&until(&mut preview, |_| true))
        };
        let strength = of_rest / of_lamp;

        ask(&mut preview, camera, &with_lamp(&capture, 0, strength));
        until(&mut preview, |picture| picture.width == SIZE.0 && picture.paths >= 4);
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut group = criterion.benchmark_group(name.as_str());
        group.sample_size(10).warm_up_time(Duration::from_millis(500));
        let mut step = 0;
        let (mut mixed, mut moved, mut whole) = (Least::new(), Least::new(), Least::new());
        group.bench_function("recombine", |bencher| {
            bencher.iter(|| {
                let began = Began::now();
                step += 1;
                let factor = 1.0 + 0.01 * f64::from(step % 50);
                ask(&mut preview, camera, &with_lamp(&capture, 0, strength * factor));
                let picture = black_box(preview.picture().expect("its layers are there"));
                assert_eq!(picture.traced, 0);
                mixed.add(&began);
            });
        });
        group.bench_function("first picture of a moved light", |bencher| {
            bencher.iter(|| {
                let began = Began::now();
                step += 1;
                let edits = with_lamp(&capture, 1 + step as usize % 50, strength);
                ask(&mut preview, camera, &edits);
                black_box(until(&mut preview, |_| true));
                moved.add(&began);
            });
        });
        let edits = with_lamp(&capture, 0, strength);
        let geometry = Geometry::new(&capture, &solved, &edits);
        let places = [camera.position.as_vec3()];
        let scene = Scene::new(&views, &geometry, &solved, &edits, &places);
        let options = RenderOptions { spp: 4, ..RenderOptions::default() };
        group.bench_function("retrace", |bencher| {
            bencher.iter(|| {
                let began = Began::now();
                let film = render(&scene, &camera, &options, &Watch::new(), &|_| ());
                black_box(film.expect("not cancelled"));
                whole.add(&began);
            });
        });
        group.finish();
        println!(
            "{name}: recombine {mixed}, first picture of a moved light {moved}, retrace {whole}; \
             against retrace {:.4} and {:.3} of the processor time",
            mixed.mean_secs() / whole.mean_secs(),
            moved.mean_secs() / whole.mean_secs(),
        );
        if std::env::var_os("LOBELIA_ERRORS").is_some() {
            errors(&name, &mut preview, &capture, camera, strength);
        }
    }
}

/// Prints how the error of a moved light's picture falls with the processor's time and the clock's.
fn errors(name: &str, preview: &mut Preview, capture: &Capture, camera: Camera, strength: f64) {
    let edits = with_lamp(capture, 200, strength);
    ask(preview, camera, &edits);
    let truth = until(preview, |picture| picture.is_done);
    // Elsewhere and back: its layer is traced anew, beside that of the recovered light, which is
    // as clear as it was.
    ask(preview, camera, &with_lamp(capture, 100, strength));
    until(preview, |picture| picture.width == SIZE.0);
    let began = Began::now();
    ask(preview, camera, &edits);
    report(&format!("{name}: error of a moved light's picture"), preview, &truth, &began);
    // The same of a whole view, of which nothing is known.
    let mut fresh = camera;
    fresh.position += glam::DVec3::splat(1e-9);
    let began = Began::now();
    ask(preview, fresh, &edits);
    report(&format!("{name}: error of a new view"), preview, &truth, &began);
}

/// Traces until the error is small or paths are many, and prints how it fell since `began`.
fn report(what: &str, preview: &mut Preview, truth: &Picture, began: &Began) {
    let mut line = what.to_owned();
    loop {
        let plan = preview.plan().expect("there is more to trace");
        preview.trace(&plan, &Watch::new()).expect("not cancelled");
        let seconds = processor_secs() - began.processor_secs;
        let elapsed = began.at.elapsed().as_secs_f64();
        let Some(picture) = preview.picture() else { continue };
        let error = error(&picture, truth);
        line += &format!(", {error:.3} at {elapsed:.2} s ({seconds:.2} s of the processor)");
        if error <= ERROR || picture.paths >= 64 {
            break;
        }
    }
    println!("{line}");
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = relight
}
criterion_main!(benches);
