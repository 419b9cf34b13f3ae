//! The whole reconstruction: the shipped example, and full captures where `LOBELIA_CAPTURES`
//! names their folder.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use lobelia::io::capture;
use lobelia::reconstruct::{Options, run};
use lobelia::scene::Capture;
use lobelia::watch::Watch;

fn load(folder: &Path) -> Option<Capture> {
    folder.is_dir().then(|| capture::load(folder, &Watch::new()).expect("the capture is sound"))
}

fn whole(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("reconstruct");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.measurement_time(Duration::from_secs(10));
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/examples/corner");
    if let Some(capture) = load(&example) {
        group.bench_function("example", |b| b.iter(|| once(&capture, &Options::default())));
    }
    let Some(captures) = std::env::var_os("LOBELIA_CAPTURES").map(PathBuf::from) else {
        println!(
            "reconstruct: LOBELIA_CAPTURES names no folder, so the full captures are left out"
        );
        return;
    };
    // The paper's size: 3400 samples, 130 lights, 600 lobes, three channels.
    if let Some(capture) = load(&captures.join("corner-diffuse")) {
        group.bench_function("corner-diffuse", |b| b.iter(|| once(&capture, &Options::default())));
    }
    group.finish();
    if let Some(capture) = load(&captures.join("large")) {
        let mut options = Options::default();
        options.samples.count = 20_000;
        let began = Instant::now();
        let samples = once(&capture, &options);
        println!(
            "reconstruct/large: {samples} samples, {} triangles, {} images, {:.1} s in one run",
            capture.mesh.triangles.len(),
            capture.measurements().count(),
            began.elapsed().as_secs_f64()
        );
    }
}

fn once(capture: &Capture, options: &Options) -> usize {
    let done = run(black_box(capture), options, &Watch::new(), &|_| ()).expect("it reconstructs");
    done.samples.samples.len()
}

criterion_group!(benches, whole);
criterion_main!(benches);
