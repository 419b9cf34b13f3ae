//! Tests the cost of a frame with a large scene: a million triangles, 100,000 samples and 10,000
//! lobes.

use std::sync::Arc;
use std::time::{Duration, Instant};

use eframe::egui;
use egui_kittest::Harness;
use glam::{DMat3, DVec2, DVec3, Vec3};

use super::gpu::{Globals, Uploaded, uploaded};
use super::{Content, Viewport};
use crate::geometry::mesh::Mesh;
use crate::reconstruct::lights::{LightKind, VirtualLight, VirtualLights};
use crate::reconstruct::lobes::{Lobe, Lobes};
use crate::reconstruct::samples::{Sample, SampleCloud};
use crate::scene::{Camera, Capture, Distortion, Image, Photograph, Role, Surface};

/// Squares along a side of the ground: two triangles each.
const SIDE: usize = 708;
const SAMPLES: usize = 100_000;
const LIGHTS: usize = 1_000;
const LOBES: usize = 10_000;
const FRAMES: usize = 24;

struct Window {
    viewport: Viewport,
    content: Content,
    /// What `Viewport::show` took, and what had been uploaded after it.
    frames: Vec<(Duration, Uploaded)>,
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let began = Instant::now();
        self.viewport.show(ui, &self.content);
        self.frames.push((began.elapsed(), uploaded()));
    }
}

/// A place on hilly ground of 10 by 10 m.
fn ground(x: usize, y: usize, side: usize) -> Vec3 {
    let [u, v] = [x, y].map(|k| k as f32 / side as f32);
    Vec3::new(10.0 * u, 10.0 * v, 0.3 * (9.0 * u).sin() * (7.0 * v).cos())
}

fn capture() -> Capture {
    let corners = SIDE + 1;
    let positions = (0..corners * corners).map(|k| ground(k % corners, k / corners, SIDE));
    let mut triangles = Vec::new();
    for k in 0..SIDE * SIDE {
        let a = ((k / SIDE) * corners + k % SIDE) as u32;
        let (b, c, d) = (a + 1, a + corners as u32, a + corners as u32 + 1);
        triangles.extend([[a, b, d], [a, d, c]]);
    }
    let mesh = Mesh {
        positions: positions.collect(),
        surface: vec![0; triangles.len()],
        polygon: (0..triangles.len() as u32).collect(),
        texcoords: Vec::new(),
        triangles,
    };
    let (width, height) = (64, 48);
    // Looks down from 8 m.
    let camera = Camera::new(
        (width, height),
        DVec2::splat(60.0),
        DVec2::new(32.0, 24.0),
        Distortion::default(),
        DMat3::IDENTITY,
        DVec3::new(5.0, 5.0, 8.0),
    );
    let image = Image::new(width, height, vec![[0.5; 3]; width * height], None);
    let image = Some(Arc::new(image));
    let photograph = Photograph { name: "down".into(), camera, image, display: None };
    let surface = Surface { name: "ground".into(), role: Role::Untagged, has_texcoords: false };
    Capture {
        mesh: Arc::new(mesh),
        surfaces: vec![surface],
        photographs: vec![photograph],
        ..Capture::default()
    }
}

fn content() -> Content {
    let sample = |k: usize| Sample {
        position: ground(k % 317, k / 317, 316),
        normal: Vec3::Z,
        material: 0,
        surface: 0,
        views: 0..0,
        radiance: [0.5; 3],
    };
    let samples = (0..SAMPLES).map(sample).collect();
    let cloud = SampleCloud { spacing_m: 0.03, samples, ..SampleCloud::default() };
    let direction = |k: usize| {
        let (sin, cos) = (k as f32).sin_cos();
        Vec3::new(0.7 * cos, 0.7 * sin, -0.7).normalize_or_zero()
    };
    let light = |k: usize| {
        let position = Vec3::new(5.0, 5.0, 0.0) - 8.0 * direction(k);
        VirtualLight::disc(LightKind::Sphere, position, direction(k), 0.2)
    };
    let lights = VirtualLights {
        lights: (0..LIGHTS).map(light).collect(),
        spacing_m: 0.4,
        sphere_center: Vec3::new(5.0, 5.0, 0.0),
        sphere_radius_m: 8.0,
    };
    let each = LOBES / LIGHTS;
    let lobe = |k: usize| Lobe { light: k / each, direction: direction(k / each), exponent: 3.0 };
    let lobes = Lobes {
        lobes: (0..LOBES).map(lobe).collect(),
        first: (0..=LIGHTS).map(|light| each * light).collect(),
    };
    Content {
        capture: Some(Arc::new(capture())),
        samples: Some(Arc::new(cloud)),
        lights: Some((Arc::new(lights), Arc::new(lobes))),
        ..Content::default()
    }
}

#[test]
fn a_large_scene_is_uploaded_once_and_costs_a_frame_little() {
    let content = content();
    let triangles = content.capture.as_ref().map_or(0, |capture| capture.mesh.triangles.len());
    assert!(triangles > 1_000_000);
    // Small, so that a software adapter soon has it drawn.
    let mut window = Harness::builder().with_size([160.0, 120.0]).wgpu().build_eframe(|cc| {
        let render = cc.wgpu_render_state.as_ref().expect("the harness draws with wgpu");
        Window { viewport: Viewport::new(render), content, frames: Vec::new() }
    });
    window.state_mut().viewport.settings.wireframe = false;
    let deadline = Instant::now() + Duration::from_secs(120);
    while !window.state().viewport.is_ready() {
        assert!(Instant::now() < deadline, "the capture was never prepared");
        window.run_steps(1);
        window.render().expect("a picture");
    }
    window.run_steps(2);
    let before = uploaded();
    // Three corners of 16 bytes a triangle, 28 bytes a sample.
    assert!(before.bytes > (48 * triangles + 28 * SAMPLES) as u64, "{before:?}");

    window.state_mut().frames.clear();
    for _ in 0..FRAMES {
        let camera = *window.state().viewport.camera();
        let turned = super::ViewCamera { azimuth: camera.azimuth + 0.05, ..camera };
        window.state_mut().viewport.set_camera(turned);
        window.run_steps(1);
    }
    let frames = &window.state().frames;
    assert!(frames.len() >= FRAMES);
    // A turned view changes uniforms alone; no geometry is uploaded again.
    let (times, bytes) = (uploaded().times - before.times, uploaded().bytes - before.bytes);
    assert!(times >= FRAMES as u64 && times <= frames.len() as u64, "{times} uploads");
    assert_eq!(bytes, times * size_of::<Globals>() as u64);
    // A view that stays is sent nothing at all once its last turn is drawn.
    window.render().expect("a picture");
    let after = uploaded();
    window.run_steps(5);
    assert_eq!(uploaded(), after);

    let mut took: Vec<Duration> = window.state().frames.iter().map(|(took, _)| *took).collect();
    took.sort_unstable();
    let (median, longest) = (took[took.len() / 2], took[took.len() - 1]);
    println!("a frame of a million triangles: {median:?}, the longest {longest:?}");
}
