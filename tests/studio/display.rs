//! Photographs of 8 bits: seen as they are, and taken for radiance at a click.

use std::fs;
use std::path::Path;

use eframe::egui;
use lobelia::io::exr;
use lobelia::math::rgb::srgb_code;

use crate::rendering::middle;
use crate::{Window, example};

const NONE: egui::Modifiers = egui::Modifiers::NONE;

/// The example as a camera of 8 bits would have taken it.
fn of_eight_bits(folder: &Path) {
    fs::create_dir_all(folder.join("images")).unwrap();
    for file in ["scene.obj", "scene.mtl", "tags.json"] {
        fs::copy(example().join(file), folder.join(file)).unwrap();
    }
    for index in 0..6 {
        let name = format!("images/00{index}");
        let picture = exr::read(&example().join(format!("{name}.exr"))).unwrap();
        let pixels =
            picture.pixels.iter().flat_map(|pixel| pixel.map(|value| srgb_code(0.4 * value)));
        let (width, height) = (picture.width as u32, picture.height as u32);
        let picture = image::RgbImage::from_raw(width, height, pixels.collect()).unwrap();
        picture.save(folder.join(format!("{name}.png"))).unwrap();
    }
    let cameras = fs::read_to_string(example().join("transforms.json")).unwrap();
    fs::write(folder.join("transforms.json"), cameras.replace(".exr", ".png")).unwrap();
}

#[test]
fn photographs_of_eight_bits_are_seen_as_they_are_and_become_radiance() {
    let folder = tempfile::tempdir().unwrap();
    let capture = folder.path().join("corner");
    of_eight_bits(&capture);
    let mut window = Window::at(&folder.path().join("home"), Some(&capture));
    window.wait_for("No photograph measures radiance");
    // Nothing is measured, and nothing hides that: the geometry wears them all the same.
    let view = window.node("Viewport").rect();
    window.harness.hover_at(view.center());
    window.key(NONE, egui::Key::Num0);
    window.key(NONE, egui::Key::Tab);
    window.wait_for("Shown as it is displayed: this photograph measures no radiance");
    let name = (0..6).find(|index| window.has_part(&format!("00{index}.png ×")));
    let name = format!("images/00{}.png", name.expect("looked through"));
    let taken = image::open(capture.join(&name)).unwrap().into_rgb8();
    let size = (taken.width() as f32, taken.height() as f32);
    let scale = (view.width() / size.0).min(view.height() / size.1);
    let (part, at) = (0.3, (view.center().x, view.center().y));
    let expected = middle(&taken, (0.5 * size.0, 0.5 * size.1), (part * size.0, part * size.1));
    let mut shown = [0.0; 3];
    for _ in 0..200 {
        window.step();
        let seen = image::DynamicImage::ImageRgba8(window.harness.render().unwrap()).into_rgb8();
        shown = middle(&seen, at, (part * scale * size.0, part * scale * size.1));
        if shown.iter().zip(expected).all(|(shown, own)| (shown - own).abs() < 2.0) {
            break;
        }
    }
    for (shown, own) in shown.into_iter().zip(expected) {
        assert!((shown - own).abs() < 2.0, "{shown} in the view, {own} in the file");
    }
    window.key(NONE, egui::Key::Num0);

    let before = fs::read(capture.join("transforms.json")).unwrap();
    window.click("Take for radiance (sRGB)");
    window.wait("radiance", |window| {
        !window.has("No photograph measures radiance") && !window.harness.state().is_busy()
    });
    assert!(window.has_part("Opened with"), "what that means is told");
    let cameras = fs::read_to_string(capture.join("transforms.json")).unwrap();
    assert!(cameras.contains("\"response\": \"srgb\""), "{cameras}");
    assert_eq!(fs::read(capture.join("transforms.json~")).unwrap(), before);
    window.key(NONE, egui::Key::F3);
    assert!(!window.has("No photograph of the capture measures radiance."));
}
