//! How soon a change to a recovered scene is seen: from the wish to the first, quarter-resolution
//! picture of a view of 704×432 pixels, in the shipped example, or in every capture named in
//! `LOBELIA_RELIT` (folders, separated by colons).

use std::hint::black_box;
use std::path::PathBuf;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DVec2, Vec3};
use lobelia::io;
use lobelia::reconstruct::{self, Options};
use lobelia::render::edits::{AddedLight, Edits, Shape};
use lobelia::render::scene::Solved;
use lobelia::scene::{Camera, Capture, Emitter};
use lobelia::watch::Watch;
use lobelia::worker::{
    Command, JobEvent, LatestRequest, PreviewRequest, Relighting, Relit, Worker,
};

const SIZE: (usize, usize) = (704, 432);

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

fn with_lamp(capture: &Capture, step: usize) -> Edits {
    let (low, high) = capture.mesh.bounds().unwrap_or_default();
    let center = 0.5 * (low + high) + Vec3::X * 1e-3 * step as f32;
    let shape = Shape::Emitter(Emitter::Sphere { center, radius_m: 0.05 });
    let lamp = AddedLight { name: "lamp".into(), shape, emission: [5.0; 3] };
    Edits { lights: vec![lamp], ..Edits::default() }
}

fn first(worker: &Worker, number: u64) -> Arc<Relit> {
    loop {
        match worker.events().recv().expect("the worker lives").what {
            JobEvent::Relit(relit) if relit.number == number => return relit,
            JobEvent::Failed(text) => panic!("{text}"),
            _ => {}
        }
    }
}

fn relight(criterion: &mut Criterion) {
    for folder in captures() {
        let capture = io::capture::load(&folder, &Watch::new()).expect("a sound capture");
        let capture = Arc::new(capture);
        let mut options = Options::default();
        options.set("joint", "light_sets", "1").expect("an option");
        let whole = reconstruct::run(&capture, &options, &Watch::new(), &|_| ()).expect("a result");
        let solved = Arc::new(Solved::from(&whole));
        let mut worker = Worker::start(|| ()).expect("a thread");
        let latest = LatestRequest::default();
        let relighting = Relighting { capture: capture.clone(), solved, latest: latest.clone() };
        worker.send(Command::Relight(relighting));
        let camera = view(&capture);
        let mut step = 0;
        let mut request = || {
            step += 1;
            let edits = Arc::new(with_lamp(&capture, step));
            latest.put(PreviewRequest { edits, camera, photograph: None, before: false })
        };
        // What is prepared once.
        first(&worker, request());
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        criterion.bench_function(&format!("first picture after an edit/{name}"), |bencher| {
            bencher.iter(|| black_box(first(&worker, request())));
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = relight
}
criterion_main!(benches);
