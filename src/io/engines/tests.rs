//! Engines that are shell scripts: what works, fails, hangs, or is nonsense.

use std::cell::RefCell;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use glam::DVec3;

use super::*;
use crate::io::exr;
use crate::model::FoundCameras;

/// A folder with programs, and photographs in it.
struct Bench {
    folder: tempfile::TempDir,
    photographs: Vec<Subject>,
}

impl Bench {
    /// Three photographs of radiance of 80 by 60 pixels.
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let photographs = (0..3)
            .map(|index| {
                let file = folder.path().join(format!("ä {index}.exr"));
                exr::write_rgb(&file, 80, 60, &vec![[0.25 * index as f32; 3]; 80 * 60]).unwrap();
                let orientation = Orientation::default();
                Subject { file, orientation, size: (80, 60), focal_px: Some(70.0) }
            })
            .collect();
        Self { folder, photographs }
    }

    fn put(&self, name: &str, script: &str) -> PathBuf {
        let file = self.folder.path().join("bin").join(name);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(&file, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
        file
    }

    /// A Python that has openmvg-rs, which does what a script says: `$3` is the folder of the
    /// pictures, `$4` where the result goes.
    fn python(&self, script: &str) {
        let question = "if [ \"$1\" = -c ]; then echo modules openmvg_rs; exit; fi";
        self.put("python3", &format!("{question}\n{script}"));
    }

    fn search(&self) -> Search {
        let path = self.folder.path().join("bin").into_os_string();
        let places = Places { path, environment: None };
        Search { engine: Some(Engine::OpenMvg), places, ..Search::default() }
    }

    fn find(&self, watch: &Watch) -> (Result<FoundCameras, Error>, Vec<Told>) {
        let told = RefCell::new(Vec::new());
        let tell = |own| told.borrow_mut().push(own);
        let found = find(&self.photographs, &self.search(), watch, &tell);
        (found, told.into_inner())
    }

    #[track_caller]
    fn fails(&self, parts: &[&str]) {
        let (found, _) = self.find(&Watch::new());
        let text = found.unwrap_err().to_string();
        for part in parts {
            assert!(text.contains(part), "\"{part}\" is missing in: {text}");
        }
    }
}

/// Writes a model with cameras at x = 0, 1, … that look along y, and one point that all see.
fn model(images: &[&str]) -> String {
    let mut poses = String::new();
    for (index, name) in images.iter().enumerate() {
        // COLMAP's axes: y down, z ahead; a quarter turn about x.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        poses += &format!("{} {half} {half} 0 0 -{index} 0 0 1 {name}\\n40 30 0\\n", index + 1);
    }
    let track: String = (1..=images.len()).map(|id| format!(" {id} 0")).collect();
    format!(
        "d=\"$4/sparse/0\"; mkdir -p \"$d\"\n\
         printf '1 RADIAL 80 60 70 40 30 0.01 0\\n' > \"$d/cameras.txt\"\n\
         printf '{poses}' > \"$d/images.txt\"\n\
         printf '0 0 4 0 9 9 9 0.5{track}\\n' > \"$d/points3D.txt\""
    )
}

#[test]
fn an_engine_places_the_photographs_that_it_can() {
    let bench = Bench::new();
    let ours = "ls \"$3\"; echo 'step: Matching pairs [1/3]'; echo 'step: Matching pairs [3/3]'";
    bench.python(&format!("{ours}\n{}", model(&["000000.jpg", "000002.jpg"])));
    let watch = Watch::new();
    let (found, told) = bench.find(&watch);
    let found = found.unwrap();
    assert_eq!((found.placed(), found.engine.as_str()), (2, "openmvg-rs"));
    assert!(found.cameras[1].is_none());
    let camera = found.cameras[2].as_ref().unwrap();
    assert!((camera.position - DVec3::X).length() < 1e-12);
    assert!((camera.world_from_camera.z_axis + DVec3::Y).length() < 1e-12);
    assert_eq!((camera.width, camera.focal_px.x, camera.distortion.radial[0]), (80, 70.0, 0.01));
    assert_eq!(found.points.len(), 1);
    assert_eq!(found.points[0].photographs, [0, 2]);
    let line = |text: &str| Told::Line(text.to_owned());
    for own in ["000000.jpg", "000001.jpg", "000002.jpg"] {
        assert!(told.contains(&line(own)), "{told:?}");
    }
    assert!(told.contains(&Told::Step("Matching pairs".to_owned())));
}

#[test]
fn large_and_turned_photographs_come_back_in_their_own_pixels() {
    let mut bench = Bench::new();
    // 6403 pixels become 2134 of three, and one is left over: at the left, once it is turned.
    let file = bench.folder.path().join("long.exr");
    exr::write_rgb(&file, 6403, 30, &vec![[0.5; 3]; 6403 * 30]).unwrap();
    let orientation = Orientation::of(3).unwrap();
    bench.photographs[2] = Subject { file, orientation, size: (6403, 30), focal_px: None };
    let long = model(&["000000.jpg", "000002.jpg"])
        .replace("0 0 1 000002", "0 0 2 000002")
        .replace("0.01 0\\n", "0.01 0\\n2 RADIAL 2134 10 2000 1000 4 0 0\\n");
    bench.python(&long);
    let found = bench.find(&Watch::new()).0.unwrap();
    let camera = found.cameras[2].as_ref().unwrap();
    assert_eq!((camera.width, camera.height, camera.focal_px.x), (6403, 30, 6000.0));
    assert_eq!(camera.principal_px.to_array(), [3001.0, 12.0]);
}

#[test]
fn what_is_missing_is_told_with_the_line_that_installs_it() {
    let bench = Bench::new();
    let nothing = Places { path: bench.folder.path().into(), environment: Some("/e n".into()) };
    assert!(look(&nothing).iter().all(|own| own.program.is_none()));
    let search = |engine| Search { engine, places: nothing.clone(), ..Search::default() };
    let text = |engine| choose(&search(engine)).unwrap_err().to_string();
    assert!(text(None).contains("no engine"), "{}", text(None));
    let line = "python3 -m venv \"/e n\" && \"/e n/bin/pip\" install pycolmap";
    assert!(text(Some(Engine::PyColmap)).contains(line), "{}", text(Some(Engine::PyColmap)));
    assert!(text(Some(Engine::Colmap)).contains("sudo apt install colmap"));
    // A program and a module are found; the module's environment comes before the path.
    bench.python("");
    let colmap = bench.put("colmap", "");
    let found = look(&bench.search().places);
    let programs: Vec<_> = found.iter().map(|own| own.program.clone()).collect();
    assert_eq!(programs, [Some(colmap.with_file_name("python3")), None, Some(colmap)]);
    assert_eq!(choose(&Search { engine: None, ..bench.search() }).unwrap().engine, Engine::OpenMvg);
}

#[test]
fn engines_that_fail_are_told_in_their_words() {
    let bench = Bench::new();
    bench.python("echo 'Traceback'; echo 'error: DatasetError: no disk.' >&2; exit 3");
    bench.fails(&["openmvg-rs: it stopped with an error: DatasetError: no disk (exit code 3)"]);
    bench.python("echo 'error: NoReconstructionError: nothing'; exit 3");
    bench.fails(&["found no photographs that show the same points", "lines and corners"]);
    bench.python("kill -9 $$");
    bench.fails(&["ended by the system"]);
    bench.python("exit 0");
    bench.fails(&["without writing any camera"]);
    let mut bench = bench;
    bench.photographs.truncate(1);
    bench.fails(&["two photographs or more"]);
}

#[test]
fn nonsense_is_refused() {
    let bench = Bench::new();
    let good = model(&["000000.jpg", "000002.jpg"]);
    for (old, new, parts) in [
        ("1 RADIAL", "1 RIDDLE", ["cannot be read", "RIDDLE"]),
        ("000002", "000009", ["", "it"]),
        ("000002", "000000", ["", "it"]),
        (" 70 40", " 700000 40", ["focal length of 700000 px", "no lens"]),
        (" 70 40", " nan 40", ["cannot be read", ""]),
        ("0 0 -1 0 0 1", "0 0 -0 0 0 1", ["in one place", ""]),
        ("0 0 -1 0 0 1", "0 0 -inf 0 0 1", ["", "it"]),
    ] {
        assert!(good.contains(old), "{old}");
        bench.python(&good.replace(old, new));
        bench.fails(&parts);
    }
    bench.python("mkdir -p \"$4/sparse/0\"; head -c 3000 /dev/urandom | tee \"$4/sparse/0/cameras.bin\" > \"$4/sparse/0/images.bin\"");
    bench.fails(&["cannot be read"]);
}

#[test]
fn silence_ends_an_engine_and_all_that_it_has_started() {
    let bench = Bench::new();
    let mark = bench.folder.path().join("alive");
    let loops = format!("(while :; do date > '{}'; sleep 0.05; done) &\nwait", mark.display());
    bench.python(&loops);
    let search = Search { silence: Duration::from_millis(400), ..bench.search() };
    let began = Instant::now();
    let found = find(&bench.photographs, &search, &Watch::new(), &|_| ());
    let text = found.unwrap_err().to_string();
    assert!(text.contains("written nothing for"), "{text}");
    assert!(began.elapsed() < Duration::from_secs(20));
    assert_ended(&mark);
}

#[test]
fn a_cancelled_engine_ends_with_all_that_it_has_started() {
    let bench = Bench::new();
    let mark = bench.folder.path().join("alive");
    let loops =
        format!("(while :; do date > '{}'; echo line; sleep 0.05; done) &\nwait", mark.display());
    bench.python(&loops);
    let watch = Watch::new();
    let tell = |told| {
        if told == Told::Line("line".to_owned()) {
            watch.cancel();
        }
    };
    let found = find(&bench.photographs, &bench.search(), &watch, &tell);
    assert!(matches!(found, Err(Error::Cancelled(_))), "{found:?}");
    assert_ended(&mark);
}

/// Nothing writes the file any more.
fn assert_ended(mark: &Path) {
    assert!(mark.is_file());
    std::thread::park_timeout(Duration::from_millis(200));
    fs::remove_file(mark).unwrap();
    std::thread::park_timeout(Duration::from_millis(400));
    assert!(!mark.exists());
}
