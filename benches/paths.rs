//! Paths per second of pictures, beside Mitsuba 3 on the same exported scene, of the same depth and
//! number of paths.
//!
//!     LOBELIA_CAPTURES=... LOBELIA_PYTHON=/path/to/python cargo bench --bench paths
//!
//! prints a line such as `paths corner-diffuse 640x480, 32 a pixel: 2.0 M/s, Mitsuba llvm_ad_rgb
//! 3.0 M/s, ratio 0.67 (by processor time 0.70)`: ours and theirs in turn, the best of three each.
//! On a busy machine the second ratio is the one to look at. Without LOBELIA_CAPTURES the shipped
//! example is rendered; Mitsuba is left out where LOBELIA_PYTHON (default `python3`) cannot import
//! it. Its first picture, for which it compiles, does not count.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::Instant;

use lobelia::geometry::bvh::RayCaster;
use lobelia::io::{capture, export::mitsuba};
use lobelia::reconstruct::{Options, run};
use lobelia::render::edits::Edits;
use lobelia::render::model::Model;
use lobelia::render::scene::{Geometry, Scene, Solved};
use lobelia::render::{RenderOptions, render};
use lobelia::scene::Views;
use lobelia::watch::Watch;

const SPP: usize = 32;
const ROUNDS: usize = 3;

/// Answers every line on stdin with the seconds of a picture, by the clock and of the processor.
const PEER: &str = r#"
import sys, time
sys.path.insert(0, sys.argv[1])
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
import drjit as dr
import lobelia_mitsuba
scene = mi.load_file(sys.argv[1] + "/recovered.xml")
def once(seed):
    wall, used = time.perf_counter(), time.process_time()
    dr.eval(mi.render(scene, sensor=0, spp=int(sys.argv[2]), seed=seed))
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
    let solved = Solved::from(&run(&capture, &options, &watch, &|_| ()).expect("it reconstructs"));
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(&capture, &caster, &watch).expect("not cancelled");
    let edits = Edits::default();
    let geometry = Geometry::new(&capture, &edits);
    let scene = Scene::new(&views, &geometry, &solved, &edits, &[]);
    let model = Model::new(&scene, &views, &solved, &edits, &watch).expect("not cancelled");
    let options = RenderOptions { spp: SPP, ..RenderOptions::default() };
    let place = tempfile::tempdir().expect("a temporary folder");
    mitsuba::write(place.path(), &model, options.reflections, &watch).expect("it can be written");

    let mut peer = Peer::start(place.path());
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
        "paths {} {}x{}, {SPP} a pixel: {:.2} M/s",
        capture.name,
        camera.width,
        camera.height,
        paths / ours[0]
    );
    if peer.is_some() {
        println!(
            ", Mitsuba llvm_ad_rgb {:.2} M/s, ratio {:.2} (by processor time {:.2})",
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
    fn start(folder: &Path) -> Option<Self> {
        let python = std::env::var_os("LOBELIA_PYTHON").unwrap_or("python3".into());
        let mut process = Command::new(python)
            .arg("-c")
            .arg(PEER)
            .arg(folder)
            .arg(SPP.to_string())
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
