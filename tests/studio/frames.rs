//! What the window's own work takes of a frame in a large scene: 20 objects of 200,000 triangles set
//! into a capture of 24 photographs. No test asserts a time, so this one is run by hand:
//! `cargo nextest run --release --test studio --run-ignored only frames --no-capture`.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Instant;

use eframe::egui::{self, Key, Modifiers, PointerButton};

use crate::{Dropped, Window, example};

const OBJECTS: usize = 20;
const NONE: Modifiers = Modifiers::NONE;

/// A ball of 200,000 triangles, as binary PLY.
fn ball(file: &Path) {
    const COLUMNS: u32 = 500;
    const ROWS: u32 = 200;
    let mut out = std::io::BufWriter::new(fs::File::create(file).unwrap());
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        COLUMNS * (ROWS + 1),
        2 * COLUMNS * ROWS
    )
    .unwrap();
    for row in 0..=ROWS {
        let polar = std::f32::consts::PI * row as f32 / ROWS as f32;
        for column in 0..COLUMNS {
            let around = std::f32::consts::TAU * column as f32 / COLUMNS as f32;
            let place = [polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos()];
            place.iter().for_each(|value| out.write_all(&value.to_le_bytes()).unwrap());
        }
    }
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let at = |row: u32, column: u32| (row * COLUMNS + column % COLUMNS) as i32;
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column + 1), at(row + 1, column)];
            for triangle in [[a, d, c], [a, c, b]] {
                out.write_all(&[3]).unwrap();
                triangle.iter().for_each(|index| out.write_all(&index.to_le_bytes()).unwrap());
            }
        }
    }
}

/// The example with 24 photographs, and edits that set the objects into it.
fn scene(folder: &Path) {
    fs::create_dir_all(folder.join("images")).unwrap();
    for file in ["scene.obj", "scene.mtl", "tags.json"] {
        fs::copy(example().join(file), folder.join(file)).unwrap();
    }
    let text = fs::read_to_string(example().join("transforms.json")).unwrap();
    let mut cameras: serde_json::Value = serde_json::from_str(&text).unwrap();
    let frames = cameras["frames"].as_array().unwrap().clone();
    let mut all = Vec::new();
    for index in 0..24 {
        let from = example().join(format!("images/00{}.exr", index % 6));
        let name = format!("images/{index:03}.exr");
        fs::copy(from, folder.join(&name)).unwrap();
        let mut frame = frames[index % 6].clone();
        frame["file_path"] = name.into();
        all.push(frame);
    }
    cameras["frames"] = all.into();
    fs::write(folder.join("transforms.json"), cameras.to_string()).unwrap();
    let objects: Vec<serde_json::Value> = (0..OBJECTS)
        .map(|index| {
            ball(&folder.join(format!("ball{index}.ply")));
            let (x, y) = (0.4 + 0.6 * (index % 5) as f64, 0.5 + 0.7 * (index / 5) as f64);
            serde_json::json!({"mesh": format!("ball{index}.ply"), "name": format!("ball {index}"),
                "world_from_object": [[0.2, 0, 0, x], [0, 0.2, 0, y], [0, 0, 0.2, 1.0], [0, 0, 0, 1]]})
        })
        .collect();
    let edits = serde_json::json!({ "objects": objects });
    fs::write(folder.join("edits.json"), edits.to_string()).unwrap();
}

/// Milliseconds that every frame took from the input to the list of shapes: all that the window does
/// besides drawing. What the test's harness does with the tree of widgets is not in it. The harness
/// hands over one event a frame, so that one of its steps is a frame or several.
#[derive(Clone, Default)]
struct Clock(Arc<Mutex<Frames>>);

#[derive(Default)]
struct Frames {
    pass_began: Option<Instant>,
    /// With their numbers.
    frames: Vec<(u64, f64)>,
}

impl Clock {
    fn of(window: &Window) -> Self {
        let clock = Self::default();
        let (begins, ends) = (clock.clone(), clock.clone());
        let ctx = &window.harness.ctx;
        ctx.on_begin_pass(
            "clock",
            Arc::new(move |_| begins.frames().pass_began = Some(Instant::now())),
        );
        ctx.on_end_pass(
            "clock",
            Arc::new(move |ui| {
                let frames = &mut *ends.frames();
                let ms = 1e3 * frames.pass_began.expect("a pass began").elapsed().as_secs_f64();
                let number = ui.ctx().cumulative_frame_nr();
                match frames.frames.last_mut() {
                    // The layout was done once more.
                    Some((of, sum)) if *of == number => *sum += ms,
                    _ => frames.frames.push((number, ms)),
                }
            }),
        );
        clock
    }

    fn frames(&self) -> MutexGuard<'_, Frames> {
        self.0.lock().unwrap()
    }

    /// Tells how long the frames since the last time took, at most and in the median.
    fn tell(&self, what: &str) {
        let frames = std::mem::take(&mut self.frames().frames);
        let mut ms: Vec<f64> = frames.into_iter().map(|(_, ms)| ms).collect();
        ms.sort_by(f64::total_cmp);
        let (middle, longest) = (ms[ms.len() / 2], ms[ms.len() - 1]);
        println!(
            "{what:28} {:4} frames, median {middle:6.2} ms, longest {longest:6.2} ms",
            ms.len()
        );
    }
}

#[test]
#[ignore = "tells times, by hand"]
fn frames_of_a_large_scene() {
    let folder = tempfile::tempdir().unwrap();
    scene(&folder.path().join("large"));
    let mut window = Window::at(&folder.path().join("home"), Some(&folder.path().join("large")));
    window.wait_for("Photographs (24)");
    window.key(NONE, Key::F5);
    for _ in 0..40 {
        window.harness.run_steps(1);
        window.harness.render().expect("a picture");
    }
    let clock = Clock::of(&window);
    let edits = folder.path().join("large/edits.json");
    window.harness.input_mut().dropped_files.push(std::sync::Arc::new(Dropped(edits)));
    for _ in 0..100_000 {
        window.harness.run_steps(1);
        if window.has_part("ball 19") {
            break;
        }
    }
    clock.tell("while the objects are read");
    window.harness.run_steps(60);
    clock.frames().frames.clear();
    let view = window.node("Viewport").rect();
    let at = |part: f32| view.lerp_inside(egui::vec2(0.3 + 0.4 * part, 0.6 - 0.2 * part));
    for step in 0..60 {
        window.harness.hover_at(at(step as f32 / 60.0));
        window.harness.run_steps(1);
    }
    clock.tell("hover");
    for step in 0..20 {
        let pos = at(step as f32 / 20.0);
        for pressed in [true, false] {
            let button = PointerButton::Primary;
            window.harness.hover_at(pos);
            window.harness.event(egui::Event::PointerButton {
                pos,
                button,
                pressed,
                modifiers: NONE,
            });
            window.harness.run_steps(1);
        }
        window.harness.run_steps(1);
    }
    clock.tell("click");
    let name = window.labels("ball 7").first().expect("listed").clone();
    window.click(&name);
    clock.frames().frames.clear();
    for (what, modifiers) in [("drag (G)", NONE), ("drag with Ctrl (snap)", Modifiers::COMMAND)] {
        window.harness.hover_at(at(0.0));
        window.harness.run_steps(2);
        window.harness.key_press(Key::G);
        window.harness.run_steps(1);
        window.harness.event(egui::Event::ModifiersChanged(modifiers));
        for step in 0..60 {
            window.harness.hover_at(at(step as f32 / 60.0));
            window.harness.run_steps(1);
        }
        window.harness.event(egui::Event::ModifiersChanged(NONE));
        window.harness.key_press(Key::Enter);
        window.harness.run_steps(1);
        clock.tell(what);
    }
    for _ in 0..10 {
        window.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.harness.run_steps(1);
        window.harness.run_steps(1);
    }
    clock.tell("undo");
}
