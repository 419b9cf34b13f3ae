//! Pictures that are written look as the 3D view does.

use std::fs;

use eframe::egui;

use crate::Window;
use crate::relighting::relit;

const NONE: egui::Modifiers = egui::Modifiers::NONE;

/// Mean code of each channel over the middle of a picture, a part of its sides long.
pub fn middle(
    picture: &image::RgbImage,
    (x, y): (f32, f32),
    (width, height): (f32, f32),
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let (columns, rows) = (width as u32, height as u32);
    for row in 0..rows {
        for column in 0..columns {
            let at = |from: f32, size: f32, index: u32| (from - 0.5 * size) as u32 + index;
            let pixel = picture.get_pixel(at(x, width, column), at(y, height, row));
            for (sum, value) in sum.iter_mut().zip(pixel.0) {
                *sum += f64::from(value);
            }
        }
    }
    sum.map(|sum| sum / f64::from(columns * rows))
}

fn expose(window: &mut Window, stops: &str) {
    window.click("Exposure");
    window.key(egui::Modifiers::COMMAND, egui::Key::A);
    window.harness.event(egui::Event::Text(stops.to_owned()));
    window.step();
    window.key(NONE, egui::Key::Enter);
}

#[test]
fn a_picture_is_written_as_it_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    // Dark, as nobody would expose by itself.
    expose(&mut window, "-2,5");
    let view = window.node("Viewport").rect();
    window.harness.hover_at(view.center());
    window.key(NONE, egui::Key::Num0);
    for _ in 0..6 {
        if !window.has_part("000.exr ×") {
            window.key(NONE, egui::Key::Tab);
        }
    }
    assert!(window.has_part("000.exr ×"), "looked through");
    window.wait("a clear picture", |window| {
        let paths = window.labels("paths a pixel").concat();
        let number: String = paths.chars().filter(char::is_ascii_digit).skip(1).collect();
        number.parse().is_ok_and(|paths: u32| paths >= 16)
    });
    let seen = image::DynamicImage::ImageRgba8(window.harness.render().unwrap()).into_rgb8();

    let pictures = folder.path().join("pictures");
    window.click("Render to files…");
    window.write("Folder", pictures.to_str().unwrap());
    window.click_front("Render");
    window.wait("the first picture", |window| window.has_part("2 of 6"));
    assert!(window.has_part(" left"), "the time left is known once a picture is done");
    window.click("Stop");
    window.wait_for("Rendering was stopped.");
    assert!(fs::metadata(pictures.join("000.exr")).is_ok());
    // The view sets the edits into the photograph, which is the composite.
    let written = image::open(pictures.join("000-composite.png")).unwrap().into_rgb8();

    // The photograph fills the view as far as its shape lets it.
    let size = (written.width() as f32, written.height() as f32);
    let scale = (view.width() / size.0).min(view.height() / size.1);
    let (part, at) = (0.4, (view.center().x, view.center().y));
    let shown = middle(&seen, at, (part * scale * size.0, part * scale * size.1));
    let on_disk = middle(&written, (0.5 * size.0, 0.5 * size.1), (part * size.0, part * size.1));
    for (shown, on_disk) in shown.into_iter().zip(on_disk) {
        assert!((shown - on_disk).abs() < 2.0, "{shown} in the view, {on_disk} in the file");
    }
}

#[test]
fn the_current_view_is_rendered_as_it_was_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    let view = window.node("Viewport").rect();
    let pictures = folder.path().join("pictures");
    window.key(NONE, egui::Key::F12);
    assert!(window.has("All 6 photographs"));
    window.click("Current view");
    for (field, number) in [("Width of the picture", "200"), ("Paths a pixel", "4")] {
        window.click(field);
        window.key(egui::Modifiers::COMMAND, egui::Key::A);
        window.harness.event(egui::Event::Text(number.to_owned()));
        window.step();
        window.key(NONE, egui::Key::Enter);
    }
    window.click("Layers in the EXR");
    window.write("Folder", pictures.to_str().unwrap());
    window.click_front("Render");
    window.wait("the picture", |window| !window.harness.state().is_busy());
    let written = image::open(pictures.join("view.png")).unwrap().into_rgb8();
    let height = (200.0 * view.height() / view.width()).round();
    assert_eq!(written.width(), 200);
    assert!((written.height() as f32 - height).abs() <= 2.0, "{} and {height}", written.height());
    let names: Vec<_> =
        fs::read_dir(&pictures).unwrap().map(|file| file.unwrap().file_name()).collect();
    assert_eq!(names.len(), 2, "{names:?}");
    let exr = exr::meta::MetaData::read_from_file(pictures.join("view.exr"), false).unwrap();
    let channels: Vec<String> = exr
        .headers
        .iter()
        .flat_map(|own| &own.channels.list)
        .map(|own| own.name.to_string())
        .collect();
    assert_eq!(channels, ["A", "B", "G", "R"]);
}

#[test]
fn the_scene_is_exported_from_the_window() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    let scene = folder.path().join("scene");
    window.menu("File", "Export scene…");
    window.click("OBJ");
    window.click("Samples and lights");
    window.write("Folder", scene.to_str().unwrap());
    window.click_front("Export");
    window.wait("the end of the export", |window| !window.harness.state().is_busy());
    for file in ["scene.glb", "obj", "samples.ply"] {
        assert!(scene.join(file).exists(), "{file}");
    }
    assert!(!scene.join("mitsuba").exists(), "that was not asked for");

    // A file in the place of the folder is told where it was chosen.
    window.menu("File", "Export scene…");
    window.write("Folder", scene.join("scene.glb").to_str().unwrap());
    window.click_front("Export");
    assert!(window.has_part("a file is there and no folder"));
    window.click("Light probe");
    assert!(window.has("Probe width"));
    window.key(NONE, egui::Key::Escape);
    assert!(!window.has("Probe width"));
}
