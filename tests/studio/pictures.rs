//! The main window and the 3D view beside stored pictures, in `tests/snapshots`.
//!
//! Drawn by Mesa's software renderer, pictures are alike from machine to machine up to the rounding
//! of colours along edges. Tolerance: a pixel may differ by 0.6 (squared distance in YIQ, weighed as
//! egui_kittest does), and 60 of the 600,000 pixels of a window by more: the shortest word of a
//! label is more than that. Other renderers smooth edges otherwise: with them these tests fail, unless
//! LOBELIA_WITHOUT_PICTURES=1 says that they are to be left out, which `tests/run.sh` counts.
//! `UPDATE_SNAPSHOTS=1 cargo nextest run --release --test studio pictures panels` renews the pictures; look
//! at them before they are committed.

use std::panic;
use std::path::Path;
use std::time::{Duration, Instant};

use eframe::{egui, egui_wgpu, wgpu};
use egui_kittest::{SnapshotOptions, try_image_snapshot_options};
use image::{Rgba, RgbaImage};

use crate::skip::skip;
use crate::viewport::{picture, whole, window};
use crate::{Window, example};

const DIFFERENT_PIXELS: usize = 60;

pub fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots")
}

pub fn options(folder: &Path) -> SnapshotOptions {
    SnapshotOptions::new().threshold(0.6).max_failed_pixels(DIFFERENT_PIXELS).output_path(folder)
}

/// Whether pictures are to be compared. Where they are not drawn as the stored ones were, a test
/// fails, unless it was said that pictures are left out.
pub fn is_comparable() -> bool {
    let setup = egui_kittest::wgpu::default_wgpu_setup();
    let predictable = egui_wgpu::RendererOptions::PREDICTABLE;
    let render = panic::catch_unwind(panic::AssertUnwindSafe(|| {
        egui_kittest::wgpu::create_render_state(setup, predictable).adapter.get_info()
    }));
    let other = match render {
        Ok(info) if info.name.contains("llvmpipe") && info.backend == wgpu::Backend::Vulkan => {
            return true;
        }
        Ok(info) => format!("pictures are compared as lavapipe draws them, not {}", info.name),
        Err(_) => "there is no graphics adapter".to_owned(),
    };
    assert!(
        std::env::var_os("LOBELIA_WITHOUT_PICTURES").is_some(),
        "{other}. Install mesa-vulkan-drivers, or set LOBELIA_WITHOUT_PICTURES=1 to leave these \
         checks out"
    );
    skip(&other);
    false
}

/// The example in the workspace for tagging, whose panels say nothing about the machine.
fn example_open(theme: &str) -> Window {
    let home = tempfile::tempdir().expect("a temporary folder");
    let mut window = Window::at(home.path(), Some(&example()));
    window._folder = Some(home);
    window.wait_for("Photographs (6)");
    window.harness.set_size(egui::vec2(1000.0, 600.0));
    window.menu("View", if theme == "light" { "Light theme" } else { "Dark theme" });
    window.key(egui::Modifiers::NONE, egui::Key::F2);
    window.click("floor (1)");
    // Depth maps are drawn with the frames, one each.
    let limit = Instant::now() + Duration::from_secs(120);
    while !window.harness.state().is_drawn() {
        assert!(Instant::now() < limit, "the photographs were never drawn");
        window.harness.run_steps(1);
        look(&mut window);
    }
    window.harness.hover_at(egui::pos2(700.0, 595.0));
    window.harness.run_steps(8);
    window
}

fn look(window: &mut Window) -> RgbaImage {
    window.harness.render().expect("a picture")
}

#[test]
fn the_main_window_in_the_dark_theme() {
    if !is_comparable() {
        return;
    }
    let mut window = example_open("dark");
    let dark = look(&mut window);
    try_image_snapshot_options(&dark, "window-dark", &options(&folder())).unwrap();

    // The tolerance tells what it has to: a panel that is empty, a button, a word.
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        return;
    }
    let scratch = tempfile::tempdir().unwrap();
    let kept = folder().join("window-dark.png");
    std::fs::copy(kept, scratch.path().join("window-dark.png")).unwrap();
    for what in ["Viewport", "New material", "Specular", "Surfaces (6)"] {
        let place = window.node(what).rect();
        let mut broken = dark.clone();
        let behind = *dark.get_pixel(place.left() as u32 + 1, place.bottom() as u32 - 2);
        for (x, y, pixel) in broken.enumerate_pixels_mut() {
            if place.contains(egui::pos2(x as f32, y as f32)) {
                *pixel = Rgba(behind.0);
            }
        }
        let compared = try_image_snapshot_options(&broken, "window-dark", &options(scratch.path()));
        assert!(compared.is_err(), "nobody would see that \"{what}\" is missing");
    }
}

#[test]
fn the_main_window_in_the_light_theme() {
    if is_comparable() {
        let light = look(&mut example_open("light"));
        try_image_snapshot_options(&light, "window-light", &options(&folder())).unwrap();
    }
}

#[test]
fn the_view_with_what_was_found() {
    if !is_comparable() {
        return;
    }
    let mut window = window(whole());
    window.set_size(egui::vec2(800.0, 450.0));
    let found = picture(&mut window);
    try_image_snapshot_options(&found, "view-found", &options(&folder())).unwrap();
}
