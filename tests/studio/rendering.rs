//! Pictures that are written look as the 3D view does.

use std::fs;

use eframe::egui;
use egui_kittest::Node;
use egui_kittest::kittest::{NodeT as _, Queryable as _};

use crate::Window;
use crate::relighting::relit;
use crate::viewport::keep;

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

/// A number typed into a field that shows one.
fn number(window: &mut Window, field: &str, text: &str) {
    // The text beside it may have the same label.
    let is_field = |node: &Node| node.accesskit_node().role() == egui::accesskit::Role::SpinButton;
    window.harness.query_all_by_label(field).find(is_field).expect("a field").click();
    window.step();
    window.key(egui::Modifiers::COMMAND, egui::Key::A);
    window.harness.event(egui::Event::Text(text.to_owned()));
    window.step();
    window.key(NONE, egui::Key::Enter);
}

/// Mean over pixels and channels of how far two pictures differ, in codes of 255: over the band of the
/// view that neither the toolbar above nor the legend below covers, where they lie on each other
/// best within a pixel. Where nothing is, a file is black and the view has the window's grey: that is
/// left out.
fn off(seen: &image::RgbImage, view: egui::Rect, written: &image::RgbImage) -> f64 {
    let (width, height) = (written.width() as i32, written.height() as i32);
    let corner = view.center() - 0.5 * egui::vec2(width as f32, height as f32);
    let (left, top) = (corner.x.round() as i32, corner.y.round() as i32);
    let columns = 0.max(view.left().ceil() as i32 + 2 - left)
        ..width.min(view.right().floor() as i32 - 2 - left);
    let rows = 3 * height / 10..65 * height / 100;
    let off = |dx: i32, dy: i32| {
        let (mut sum, mut count) = (0u64, 0u64);
        for y in rows.clone() {
            for x in columns.clone() {
                let own = written.get_pixel(x as u32, y as u32);
                if own.0 == [0; 3] {
                    continue;
                }
                let shown = seen.get_pixel((left + x + dx) as u32, (top + y + dy) as u32);
                sum += (0..3).map(|c| u64::from(own.0[c].abs_diff(shown.0[c]))).sum::<u64>();
                count += 3;
            }
        }
        assert!(count > 50_000, "{count} values are no picture");
        sum as f64 / count as f64
    };
    let places = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy)));
    places.map(|(dx, dy)| off(dx, dy)).fold(f64::INFINITY, f64::min)
}

/// The window as it is drawn, once the view's picture is clear.
fn seen(window: &mut Window) -> image::RgbImage {
    window.wait("a clear picture", |window| {
        let labels = window.labels("paths a pixel, ");
        let paths = labels.first().and_then(|text| text.strip_prefix("In the 3D view: "));
        let paths = paths.and_then(|text| text.split(' ').next()?.parse().ok());
        paths.is_some_and(|paths: u32| paths >= 16)
    });
    window.harness.run_steps(4);
    image::DynamicImage::ImageRgba8(window.harness.render().unwrap()).into_rgb8()
}

#[test]
fn a_picture_of_the_view_is_its_screenshot_pixel_by_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    let view = window.node("Viewport").rect();
    window.key(egui::Modifiers::ALT, egui::Key::A);
    for (tones, stops) in [("Linear", "-1"), ("PBR Neutral", "0,5")] {
        if !window.has(tones) {
            window.click("Tone mapping");
            window.click_front(tones);
        }
        expose(&mut window, stops);
        let seen = seen(&mut window);
        let pictures = folder.path().join(tones);
        window.key(NONE, egui::Key::F12);
        window.click("Current view");
        number(&mut window, "Width of the picture", &view.width().round().to_string());
        number(&mut window, "Paths a pixel", "16");
        window.write("Folder", pictures.to_str().unwrap());
        window.click_front("Render");
        window.wait("the picture", |window| !window.harness.state().is_busy());
        let written = image::open(pictures.join("view.png")).unwrap().into_rgb8();
        keep(&image::DynamicImage::ImageRgb8(seen.clone()).into_rgba8(), &format!("{tones} seen"));
        keep(&image::DynamicImage::ImageRgb8(written.clone()).into_rgba8(), tones);
        let off = off(&seen, view, &written);
        println!("{tones} at {stops} EV: {off:.3} of 255");
        assert!(off < 2.0, "{tones} at {stops} EV: {off} of 255");
        // An exposure that is a fifth of a stop off would be told.
        let brighter = image::RgbImage::from_fn(written.width(), written.height(), |x, y| {
            let own = written.get_pixel(x, y).0;
            image::Rgb(own.map(|code| (f32::from(code) * 1.065).min(255.0) as u8))
        });
        assert!(self::off(&seen, view, &brighter) > 2.0);
    }
}

#[test]
fn a_composite_is_the_view_through_its_photograph_pixel_by_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    window.menu("Add light", "Sphere");
    number(&mut window, "Factor on all of the recovered light", "0,4");
    window.harness.hover_at(window.node("Viewport").rect().center());
    window.key(NONE, egui::Key::Num0);
    for _ in 0..6 {
        if !window.has_part("000.exr ×") {
            window.key(NONE, egui::Key::Tab);
        }
    }
    assert!(window.has_part("000.exr ×"), "looked through");
    // A pixel of the window for each of the photograph.
    let cameras = fs::read_to_string(crate::example().join("transforms.json")).unwrap();
    let cameras: serde_json::Value = serde_json::from_str(&cameras).unwrap();
    let side = |name: &str| cameras[name].as_f64().unwrap() as f32;
    let size = egui::vec2(side("w"), side("h"));
    let mut whole = egui::vec2(1280.0, 720.0);
    for _ in 0..12 {
        let view = window.node("Viewport").rect().size();
        whole.y += size.y - view.y;
        // The view is wider than the photograph.
        whole.x += (size.x + 60.0 - view.x).max(0.0);
        window.harness.set_size(whole.round());
        window.harness.run_steps(3);
    }
    let view = window.node("Viewport").rect();
    assert!((view.height() - size.y).abs() < 1.5 && view.width() >= size.x, "{view:?} {size:?}");
    window.key(egui::Modifiers::ALT, egui::Key::A);
    let seen = seen(&mut window);
    let pictures = folder.path().join("pictures");
    window.key(NONE, egui::Key::F12);
    window.click("Current view");
    number(&mut window, "Paths a pixel", "16");
    window.write("Folder", pictures.to_str().unwrap());
    window.click_front("Render");
    window.wait("the picture", |window| !window.harness.state().is_busy());
    let written = image::open(pictures.join("000-composite.png")).unwrap().into_rgb8();
    keep(&image::DynamicImage::ImageRgb8(seen.clone()).into_rgba8(), "composite seen");
    keep(&image::DynamicImage::ImageRgb8(written.clone()).into_rgba8(), "composite");
    let (alone, plain) = (off(&seen, view, &written), pictures.join("000.png"));
    println!("composite: {alone:.3} of 255");
    assert!(alone < 2.0, "{alone} of 255");
    // The rendering without the photograph is another picture.
    let plain = off(&seen, view, &image::open(plain).unwrap().into_rgb8());
    assert!(plain > alone, "{plain} and {alone}");
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
    for (field, text) in [("Width of the picture", "200"), ("Paths a pixel", "4")] {
        number(&mut window, field, text);
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
