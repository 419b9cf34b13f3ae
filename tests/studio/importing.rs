//! The import page.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use eframe::egui::{self, Key, Modifiers};
use egui_kittest::kittest::NodeT;
use image::RgbImage;
use lobelia::io::exr;

use crate::{Dropped, Window};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/import").join(name)
}

/// The photographs of the COLMAP model of the tests.
fn photographs(folder: &Path) {
    fs::create_dir_all(folder.join("sub folder")).unwrap();
    for number in 1..=6 {
        let file = folder.join(format!("sub folder/{number} ä.exr"));
        let pixels: Vec<[f32; 3]> =
            (0..160 * 120).map(|index| [(index % 160) as f32 / 160.0; 3]).collect();
        exr::write_rgb(&file, 160, 120, &pixels).unwrap();
    }
}

impl Window {
    /// A window with the import page open.
    fn importing() -> Self {
        let mut window = Self::new();
        window.step();
        window.key(Modifiers::COMMAND, Key::I);
        assert!(window.has("Write capture and open"));
        window
    }

    /// Types a path into a field of the page, and Enter.
    fn choose(&mut self, field: &str, path: &Path) {
        self.write(field, path.to_str().unwrap());
        self.key(Modifiers::NONE, Key::Enter);
    }

    /// Clicks what can be clicked only once work is done.
    fn write_capture(&mut self) {
        self.wait("the end of the work", |window| {
            let button = window.node("Write capture and open");
            !button.accesskit_node().is_disabled()
        });
        self.click("Write capture and open");
    }
}

fn with_model(photos: &Path, out: &Path) -> Window {
    let mut window = Window::importing();
    window.choose("Image folder", photos);
    window.choose("Mesh file", &data("boxes_binary.stl"));
    window.choose("New capture", out);
    window.choose("Cameras", &data("colmap_text"));
    window.wait("the model", |window| {
        window.has_part("COLMAP: 6 cameras, 6 photographs, 6 of them radiance")
    });
    window
}

#[test]
fn a_colmap_model_is_checked_and_becomes_an_open_capture() {
    let folder = tempfile::tempdir().unwrap();
    let (photos, out) = (folder.path().join("photos"), folder.path().join("made"));
    photographs(&photos);
    let mut window = with_model(&photos, &out);
    assert!(window.has_part("24 triangles in 12 surfaces"));
    assert!(window.has_part("triangles without area left out"));
    window.wait("the view of the mesh", |window| window.has("Viewport"));
    // Centimetres taken for metres show in the size, and in words.
    window.wait("the size", |window| window.has_part(" m") && !window.has_part("Unusually"));
    window.click("Photographs");
    window.wait("the points", |window| window.has_part("12 points: median residual"));
    assert!(window.has("Photograph with the mesh over it") && window.has("1 of 6"));
    window.key(Modifiers::NONE, Key::ArrowRight);
    window.wait("the next photograph", |window| window.has("2 of 6"));
    window.key(Modifiers::NONE, Key::ArrowLeft);
    window.key(Modifiers::NONE, Key::ArrowLeft);
    window.wait("the last photograph", |window| window.has("6 of 6"));
    assert!(!out.exists());
    window.write_capture();
    window.wait_for("Photographs (6)");
    assert!(out.join("transforms.json").is_file() && out.join("scene.obj").is_file());
    assert!(!window.has("Write capture and open"));
}

#[test]
fn a_capture_without_a_mesh_leads_on() {
    let folder = tempfile::tempdir().unwrap();
    let (photos, out) = (folder.path().join("photos"), folder.path().join("made"));
    photographs(&photos);
    let mut window = Window::importing();
    window.choose("Image folder", &photos);
    window.choose("New capture", &out);
    // A mesh alone is no capture, and the button says why.
    window.choose("Mesh file", &data("boxes_binary.stl"));
    window.wait("the mesh", |window| window.has_part("24 triangles"));
    assert!(window.node("Write capture and open").accesskit_node().is_disabled());
    window.node("Mesh file").focus();
    window.step();
    window.key(Modifiers::COMMAND, Key::A);
    window.key(Modifiers::NONE, Key::Backspace);
    window.key(Modifiers::NONE, Key::Enter);
    window.choose("Cameras", &data("colmap_text"));
    window.wait("the cameras", |window| window.has_part("COLMAP: 6 cameras"));
    window.write_capture();
    window.wait_for("This capture has no mesh");
    assert!(out.join("transforms.json").is_file() && !out.join("scene.obj").exists());
    // On to another file, with the cameras as they are.
    window.click("Import a mesh…");
    window.write("Path", data("boxes_binary.stl").to_str().unwrap());
    window.click("Choose");
    window.wait("mesh and cameras", |window| {
        window.has_part("transforms.json: 6 cameras") && window.has_part("24 triangles")
    });
    // Or on to drawing, with the cameras and their metres.
    let mut window = Window::at(&folder.path().join("home"), Some(&out));
    window.wait_for("This capture has no mesh");
    window.click("Draw it on the photographs");
    window.wait("the Model page", |window| window.has_part("the cameras stand as they were found"));
    let model = lobelia::io::model::open(&out).unwrap().model;
    assert!(model.found_in_metres);
    let cameras = lobelia::io::transforms::read(
        &out.join("transforms.json"),
        lobelia::io::transforms::Images::Needed,
    );
    for (photograph, frame) in model.photographs.iter().zip(cameras.unwrap().frames) {
        let found = photograph.found.expect("placed as its camera is");
        assert!(found.pose.position.distance(frame.camera.position) < 1e-12);
    }
}

#[test]
fn a_length_that_is_measured_sets_the_scale() {
    let folder = tempfile::tempdir().unwrap();
    let (photos, out) = (folder.path().join("photos"), folder.path().join("made"));
    photographs(&photos);
    let mut window = with_model(&photos, &out);
    window.click("Photographs");
    window.wait("the points", |window| window.has_part("12 points: median residual"));
    window.click("Measure");
    assert!(window.has_part("Click a place"));
    let length = |window: &Window| -> Option<f64> {
        let text = window.labels("Measured: ").pop()?;
        text.trim_start_matches("Measured: ").trim_end_matches(" m").parse().ok()
    };
    let picture = window.node("Photograph with the mesh over it").rect();
    let at = |window: &mut Window, x: f32, y: f32| {
        let place = picture.min + egui::vec2(x, y) * picture.size();
        window.harness.hover_at(place);
        for pressed in [true, false] {
            let button = egui::PointerButton::Primary;
            let modifiers = Modifiers::NONE;
            window.harness.event(egui::Event::PointerButton {
                pos: place,
                button,
                pressed,
                modifiers,
            });
            window.step();
        }
    };
    at(&mut window, 0.001, 0.001);
    assert!(window.has_part("neither a point nor the mesh"));
    at(&mut window, 0.4, 0.6);
    assert!(window.has_part("Click the other end"));
    at(&mut window, 0.6, 0.7);
    let before = length(&window).expect("a length");
    assert!(window.node("Set the scale").accesskit_node().is_disabled());
    window.write("in truth", &format!("{} cm", 250.0 * before));
    window.key(Modifiers::NONE, Key::Enter);
    window.click("Set the scale");
    window.wait("the new scale", |window| {
        length(window).is_some_and(|now| (now / before - 2.5).abs() < 0.02)
    });
    window.wait("the points again", |window| window.has_part("12 points: median residual"));
    window.write_capture();
    window.wait_for("Photographs (6)");
    let cameras = |file: &Path| {
        let images = lobelia::io::transforms::Images::Needed;
        let read = lobelia::io::transforms::read(file, images).unwrap();
        read.frames.iter().map(|own| own.camera.position).collect::<Vec<_>>()
    };
    let scaled = cameras(&out.join("transforms.json"));
    let options = lobelia::io::import::Options { images: vec![photos], ..Default::default() };
    let watch = lobelia::watch::Watch::new();
    let plain = lobelia::io::import::read(&data("colmap_text"), &options, &watch).unwrap();
    for (scaled, shot) in scaled.iter().zip(&plain.shots) {
        assert!((*scaled - 2.5 * shot.camera.position).length() < 0.02 * scaled.length());
    }
}

#[test]
fn a_wrong_path_gives_the_terminals_text() {
    let wrong = data("nowhere");
    let folder = tempfile::tempdir().unwrap();
    let terminal = Command::new(env!("CARGO_BIN_EXE_lobelia"))
        .arg("import")
        .arg(&wrong)
        .arg("--out")
        .arg(folder.path().join("out"))
        .output();
    let printed = String::from_utf8(terminal.unwrap().stderr).unwrap();
    let text = printed.trim().split_once("error: ").expect("an error").1.to_owned();
    let mut window = Window::importing();
    // By our own dialog, as where the system has none.
    window.click("Cameras: File…");
    window.write("Path", wrong.to_str().unwrap());
    window.click("Choose");
    window.wait_for(&text);
    assert!(window.node("Write capture and open").accesskit_node().is_disabled());
    // Another choice takes its place.
    window.choose("Cameras", &data("cameras.gltf"));
    window.wait("the other problem", |window| !window.has(&text));
}

#[test]
fn a_capture_that_is_there_is_replaced_only_after_asking() {
    let folder = tempfile::tempdir().unwrap();
    let (photos, out) = (folder.path().join("photos"), folder.path().join("made"));
    photographs(&photos);
    fs::create_dir(&out).unwrap();
    fs::write(out.join("tags.json"), "{}").unwrap();
    let mut window = with_model(&photos, &out);
    window.write_capture();
    window.wait_for("Replace the capture?");
    window.click("Cancel");
    assert_eq!(fs::read_dir(&out).unwrap().count(), 1, "nothing is written yet");
    // A folder with other things in it is not replaced at all.
    fs::write(out.join("diary.txt"), "dear diary").unwrap();
    window.write_capture();
    window.wait_for("The capture cannot be written");
    assert!(window.has_part("the folder is not empty"));
    window.click("Dismiss");
    fs::remove_file(out.join("diary.txt")).unwrap();
    window.write_capture();
    window.wait_for("Replace the capture?");
    window.click("Replace");
    window.wait_for("Photographs (6)");
    assert!(out.join("scene.obj").is_file() && !out.join("tags.json").exists());
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().flatten().collect();
    assert_eq!(left.len(), 2, "nothing is left beside: {left:?}");
}

/// Radiance over three decades, from left to right.
fn radiance(u: f64, v: f64) -> f64 {
    (-3.5 + 6.0 * u + 0.8 * v).exp()
}

const TIMES: [f64; 3] = [0.0625, 0.25, 1.0];

/// Three exposures of each of some views with gamma 2.2, their cameras, and a table of the times.
fn series(folder: &Path, views: usize, size: (u32, u32)) {
    let (width, height) = size;
    let mut table = String::new();
    let mut frames = Vec::new();
    for view in 0..views {
        for (index, time) in TIMES.into_iter().enumerate() {
            let picture = RgbImage::from_fn(width, height, |x, y| {
                let (u, v) = (f64::from(x) / f64::from(width), f64::from(y) / f64::from(height));
                let code = 255.0 * (radiance(u, v) * time).powf(1.0 / 2.2);
                image::Rgb([code.round().clamp(0.0, 255.0) as u8; 3])
            });
            let name = format!("{view:02}_e{index}.png");
            picture.save(folder.join(&name)).unwrap();
            table += &format!("{name},{time}\n");
        }
        let x = view as f64;
        frames.push(serde_json::json!({
            "file_path": format!("{view:02}_e1.png"),
            "transform_matrix": [[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 3], [0, 0, 0, 1]],
        }));
    }
    let cameras = serde_json::json!({
        "camera_model": "PINHOLE", "w": width, "h": height, "fl_x": width, "fl_y": width,
        "cx": f64::from(width) / 2.0, "cy": f64::from(height) / 2.0, "frames": frames,
    });
    fs::write(folder.join("transforms.json"), cameras.to_string()).unwrap();
    fs::write(folder.join("times.csv"), table).unwrap();
    fs::write(folder.join("scene.obj"), "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n").unwrap();
}

#[test]
fn exposure_series_show_their_response_and_become_radiance() {
    let folder = tempfile::tempdir().unwrap();
    let (photos, out) = (folder.path().join("photos"), folder.path().join("made"));
    fs::create_dir(&photos).unwrap();
    series(&photos, 2, (60, 40));
    let mut window = Window::importing();
    window.choose("Cameras", &photos.join("transforms.json"));
    window.choose("New capture", &out);
    window.wait("the cameras", |window| window.has_part("transforms.json: 2 cameras"));
    window.click("Exposures");
    assert!(window.has_part("No exposure series was found"));
    window.choose("Times", &photos.join("times.csv"));
    window.wait_for("Merge 2 series to radiance");
    window.click("Merge 2 series to radiance");
    window.wait_for("Response of red, green and blue");
    assert!(window.has_part("2.00 stops more"));
    window.write_capture();
    window.wait_for("Photographs (2)");
    let merged = exr::read(&out.join("images/00_e1.exr")).unwrap();
    let mut ratios: Vec<f64> = merged
        .pixels
        .iter()
        .enumerate()
        .filter(|(_, pixel)| pixel[1].is_finite())
        .map(|(index, pixel)| {
            let (x, y) = ((index % 60) as f64 / 60.0, (index / 60) as f64 / 40.0);
            f64::from(pixel[1]) / radiance(x, y)
        })
        .collect();
    assert!(ratios.len() > 2000);
    ratios.sort_by(f64::total_cmp);
    let (middle, high) = (ratios[ratios.len() / 2], ratios[ratios.len() * 9 / 10]);
    assert!((high / middle - 1.0).abs() < 0.05, "{middle} {high}");
}

#[test]
fn work_on_the_page_is_cancelled() {
    let folder = tempfile::tempdir().unwrap();
    series(folder.path(), 4, (900, 600));
    let mut window = Window::importing();
    window.choose("Cameras", &folder.path().join("transforms.json"));
    window.choose("Times", &folder.path().join("times.csv"));
    window.wait_for("Merge 4 series to radiance");
    window.click("Exposures");
    // In one frame: the job cannot have ended by then.
    window.node("Merge 4 series to radiance").click();
    window.wait_for("Recovering the response");
    window.node("Cancel").click();
    window.wait_for("Recovering the response was cancelled.");
    assert!(!window.has("Response of red, green and blue"));
    // The page lives on: asked again, it answers.
    for _ in 0..2 {
        window.click("Merge 4 series to radiance");
    }
    window.wait_for("Response of red, green and blue");
}

#[test]
fn what_other_programs_wrote_opens_the_page_when_it_is_dropped() {
    for name in ["colmap_text", "meshroom_1.2.6.sfm", "metashape.xml", "boxes_scene.glb"] {
        let mut window = Window::new();
        window.step();
        window.harness.input_mut().dropped_files.push(Arc::new(Dropped(data(name))));
        window.wait_for("Write capture and open");
        let value = window.node("Cameras").accesskit_node().value().unwrap_or_default();
        assert!(value.ends_with(name), "{value}");
    }
    // A capture is opened as before.
    let mut window = Window::new();
    window.step();
    window.harness.input_mut().dropped_files.push(Arc::new(Dropped(crate::example())));
    window.wait_for("Photographs (6)");
}

#[test]
fn the_page_leaves_the_project_behind_it_alone() {
    let mut window = Window::with_example();
    window.menu("File", "Import…");
    assert!(window.has("Write capture and open"));
    // A key of the 3D view does nothing here.
    window.key(Modifiers::NONE, Key::A);
    window.choose("Cameras", &data("colmap_text"));
    window.wait("the model", |window| window.has_part("COLMAP: 6 cameras"));
    window.click("Close");
    assert!(window.has("Photographs (6)"));
    // What was chosen stays.
    window.key(Modifiers::COMMAND, Key::I);
    assert!(window.has_part("COLMAP: 6 cameras"));
    window.click("Inspect");
    assert!(window.has("Photographs (6)") && !window.has("Write capture and open"));
}
