//! Paths per second of pictures, beside Mitsuba 3 on the same exported scene, of the same depth and
//! number of paths.
//!
//!     LOBELIA_CAPTURES=... LOBELIA_PYTHON=/path/to/python cargo bench --bench paths
//!
//! prints two lines such as `paths corner-diffuse 640x480, 32 a pixel, recovered light: 2.0 M/s,
//! Mitsuba llvm_ad_rgb 4.6 M/s, ratio 0.45 (by processor time 0.47)`: ours and theirs in turn, the
//! best of three each. On a busy machine the second ratio is the one to look at. The second line
//! is of the same room lit by one added panel alone, which Mitsuba's own plugins draw, so that
//! `scalar_rgb` can (a plugin in Python would be called ray by ray). Without LOBELIA_CAPTURES the
//! shipped example is rendered; Mitsuba is left out where LOBELIA_PYTHON (default `python3`) cannot
//! import it. Its first picture, for which it may compile, does not count.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::Instant;

use glam::Vec3;

use lobelia::geometry::bvh::RayCaster;
use lobelia::io::{capture, export::mitsuba};
use lobelia::reconstruct::{Options, run};
use lobelia::render::edits::{AddedLight, Edits, Shape, Surroundings};
use lobelia::render::model::Model;
use lobelia::render::scene::{Geometry, Scene, Solved};
use lobelia::render::{RenderOptions, render};
use lobelia::scene::{Capture, Emitter, Views};
use lobelia::watch::Watch;

const SPP: usize = 32;
const ROUNDS: usize = 3;

/// Answers every line on stdin with the seconds of a picture, by the clock and of the processor.
const PEER: &str = r#"
import sys, time
sys.path.insert(0, sys.argv[1])
import mitsuba as mi
variant = sys.argv[4]
mi.set_variant(variant)
if variant != "scalar_rgb":
    import drjit as dr
    import lobelia_mitsuba
scene = mi.load_file(sys.argv[1] + "/" + sys.argv[3])
def once(seed):
    wall, used = time.perf_counter(), time.process_time()
    picture = mi.render(scene, sensor=0, spp=int(sys.argv[2]), seed=seed)
    if variant != "scalar_rgb":
        dr.eval(picture)
        dr.sync_thread()
    return time.perf_counter() - wall, time.process_time() - used
once(0)
print("ready", flush=True)
for seed, _ in enumerate(sys.stdin):
    print(*once(seed + 1), flush=True)
"#;

fn main() {
    // `cargo test` runs benches, too, to see that they start.
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let folder = std::env::var_os("LOBELIA_CAPTURES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/examples/corner"),
        |captures| PathBuf::from(captures).join("corner-diffuse"),
    );
    let watch = Watch::new();
    let capture = capture::load(&folder, &watch).expect("the capture is sound");
    let mut options = Options::default();
    options.joint.light_sets = 1;
    let whole = run(&capture, &options, &watch, &|_| ()).expect("it reconstructs");
    let solved = Solved::new(&capture, &whole);
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(&capture, &caster, &watch).expect("not cancelled");
    compare(
        &views,
        &solved,
        &Edits::default(),
        "recovered light",
        ("recovered.xml", "llvm_ad_rgb"),
    );
    let edits = lit_by_a_panel(&capture);
    compare(&views, &solved, &edits, "one panel", ("added.xml", "scalar_rgb"));
}

/// Nothing but a panel of a quarter of the room's width below its top, facing down.
fn lit_by_a_panel(capture: &Capture) -> Edits {
    let places = &capture.mesh.positions;
    let low = places.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = places.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    let (middle, half) = (0.5 * (low + high), 0.125 * (high - low));
    let height = high.z - half.z;
    let corner = |x: f32, y: f32| Vec3::new(middle.x + x * half.x, middle.y + y * half.y, height);
    let corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    let shape = Shape::Emitter(Emitter::Rectangle { corners, normal: Vec3::NEG_Z });
    Edits {
        original_light: 0.0,
        surroundings: Surroundings::Open,
        lights: vec![AddedLight {
            name: "panel".to_owned(),
            shape,
            emission: [10.0; 3],
            is_on: true,
        }],
        ..Edits::default()
    }
}

/// Prints how fast we are on a scene, and how fast Mitsuba's variant is on its export.
fn compare(
    views: &Views,
    solved: &Solved,
    edits: &Edits,
    what: &str,
    (file, variant): (&str, &str),
) {
    let watch = Watch::new();
    let capture = views.capture;
    let geometry = Geometry::new(capture, solved, edits);
    let scene = Scene::new(views, &geometry, solved, edits, &[]);
    let model = Model::new(&scene, views, solved, edits, &watch).expect("not cancelled");
    let options = RenderOptions { spp: SPP, denoise: false, ..RenderOptions::default() };
    let place = tempfile::tempdir().expect("a temporary folder");
    mitsuba::write(place.path(), &model, options.reflections, &watch).expect("it can be written");

    let mut peer = Peer::start(place.path(), file, variant);
    let camera = capture.photographs[0].camera;
    let mut least = [[f64::INFINITY; 2]; 2];
    for round in 0..ROUNDS {
        let (began, used) = (Instant::now(), processor_secs());
        let options = RenderOptions { seed: 1 + round, ..options.clone() };
        render(&scene, &camera, &options, &watch, &|_| ()).expect("not cancelled");
        let ours = [began.elapsed().as_secs_f64(), processor_secs() - used];
        let theirs = peer.as_mut().and_then(Peer::once).unwrap_or([f64::INFINITY; 2]);
        for (least, seconds) in least.iter_mut().zip([ours, theirs]) {
            for (least, seconds) in least.iter_mut().zip(seconds) {
                *least = least.min(seconds);
            }
        }
    }
    let paths = (camera.width * camera.height * SPP) as f64 / 1e6;
    let [ours, theirs] = least;
    print!(
        "paths {} {}x{}, {SPP} a pixel, {what}: {:.2} M/s",
        capture.name,
        camera.width,
        camera.height,
        paths / ours[0]
    );
    if peer.is_some() {
        println!(
            ", Mitsuba {variant} {:.2} M/s, ratio {:.2} (by processor time {:.2})",
            paths / theirs[0],
            theirs[0] / ours[0],
            theirs[1] / ours[1]
        );
    } else {
        println!(", no Mitsuba found");
    }
}

/// Processor time of this program so far, of all threads.
fn processor_secs() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name, which is in brackets: fields 14 and 15, in hundredths of a second.
    let rest = text.rsplit(')').next().unwrap_or_default();
    let ticks = rest.split_whitespace().skip(11).take(2).filter_map(|n| n.parse::<f64>().ok());
    ticks.sum::<f64>() / 100.0
}

struct Peer {
    process: Child,
    answers: BufReader<ChildStdout>,
}

impl Peer {
    fn start(folder: &Path, file: &str, variant: &str) -> Option<Self> {
        let python = std::env::var_os("LOBELIA_PYTHON").unwrap_or("python3".into());
        let mut process = Command::new(python)
            .arg("-c")
            .arg(PEER)
            .arg(folder)
            .args([&SPP.to_string(), file, variant])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let answers = BufReader::new(process.stdout.take()?);
        let mut peer = Self { process, answers };
        (peer.line()? == "ready").then_some(peer)
    }

    fn line(&mut self) -> Option<String> {
        let mut line = String::new();
        self.answers.read_line(&mut line).ok()?;
        Some(line.trim().to_owned())
    }

    fn once(&mut self) -> Option<[f64; 2]> {
        writeln!(self.process.stdin.as_mut()?, "next").ok()?;
        let line = self.line()?;
        let mut numbers = line.split_whitespace().filter_map(|word| word.parse().ok());
        Some([numbers.next()?, numbers.next()?])
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It ends when nothing more can come.
        self.process.stdin = None;
        let _ = self.process.wait();
    }
}
