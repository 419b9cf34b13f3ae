//! The viewport with the capture that comes with the program. Pictures are not compared with
//! stored ones: what is asked of a pixel is whether it is background, changed, or of a hue.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use eframe::egui;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use image::RgbaImage;
use lobelia::app::viewport::{
    Content, Derived, Focus, SampleColor, Shading, ToneMapping, Viewport, ViewportEvent,
};
use lobelia::reconstruct::{self, Options, Reconstruction};
use lobelia::render::scene::Solved;
use lobelia::scene::{Camera, Capture, Distortion, Image, Role};
use lobelia::watch::Watch;

/// A window with nothing but the viewport.
pub struct Probe {
    pub viewport: Viewport,
    pub content: Content,
    pub events: Vec<ViewportEvent>,
}

impl eframe::App for Probe {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.events.extend(self.viewport.show(ui, &self.content));
    }
}

pub type Window = Harness<'static, Probe>;

pub const SIZE: [f32; 2] = [800.0, 600.0];

pub fn window(content: Content) -> Window {
    let mut window = Harness::builder().with_size(SIZE).wgpu().build_eframe(|cc| {
        let render = cc.wgpu_render_state.as_ref().expect("the harness draws with wgpu");
        Probe { viewport: Viewport::new(render), content, events: Vec::new() }
    });
    if window.state().content.capture.is_some() {
        let deadline = Instant::now() + Duration::from_secs(120);
        while !window.state().viewport.is_ready() {
            assert!(Instant::now() < deadline, "the capture was never prepared");
            picture(&mut window);
        }
    }
    picture(&mut window);
    window
}

/// The window as it is after two more frames, which settle layout and tooltips.
pub fn picture(window: &mut Window) -> RgbaImage {
    window.run_steps(2);
    window.render().expect("a picture")
}

/// Keeps a picture for the eye, where a folder is given for them.
pub fn keep(picture: &RgbaImage, name: &str) {
    if let Some(folder) = std::env::var_os("LOBELIA_TEST_PICTURES") {
        picture.save(PathBuf::from(folder).join(format!("{name}.png"))).expect("a place to write");
    }
}

pub fn capture() -> Arc<Capture> {
    static CAPTURE: OnceLock<Arc<Capture>> = OnceLock::new();
    let load = || {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/examples/corner");
        Arc::new(lobelia::io::capture::load(&folder, &Watch::new()).expect("the example"))
    };
    CAPTURE.get_or_init(load).clone()
}

/// A coarse reconstruction of it.
fn reconstruction() -> &'static Reconstruction {
    static RECONSTRUCTION: OnceLock<Reconstruction> = OnceLock::new();
    RECONSTRUCTION.get_or_init(|| {
        let mut options = Options::default();
        options.samples.count = 400;
        options.lobes.mask_px = 24;
        options.general.method = reconstruct::Method::Paper;
        reconstruct::run(&capture(), &options, &Watch::new(), &|_| ()).expect("a reconstruction")
    })
}

pub fn bare() -> Content {
    Content { capture: Some(capture()), ..Content::default() }
}

pub fn whole() -> Content {
    let found = reconstruction();
    Content {
        derived: Some(Arc::new(Derived::of(found))),
        samples: Some(found.samples.clone()),
        lights: Some((found.lights.clone(), found.lobes.clone())),
        solution: Some(found.solution.clone()),
        solved: Some(Arc::new(Solved::new(&capture(), found))),
        ..bare()
    }
}

pub fn surface(name: &str) -> usize {
    capture().surfaces.iter().position(|surface| surface.name == name).expect("a surface")
}

/// The part of the picture's pixels that differ by more than a few levels.
fn changed(a: &RgbaImage, b: &RgbaImage) -> f64 {
    let differ = a
        .pixels()
        .zip(b.pixels())
        .filter(|(a, b)| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 6))
        .count();
    differ as f64 / f64::from(a.width() * a.height())
}

/// The same beside toolbar and legend, which change with the settings.
fn changed_in_view(a: &RgbaImage, b: &RgbaImage) -> f64 {
    let view = |picture: &RgbaImage| {
        image::imageops::crop_imm(picture, 330, 80, 800 - 330, 600 - 80).to_image()
    };
    changed(&view(a), &view(b))
}

/// The mean difference of one picture and another that is shifted by some pixels, in levels, away
/// from the edges and where the first is not background.
fn misfit(a: &RgbaImage, b: &RgbaImage, background: [u8; 4], shift: [i32; 2]) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for y in 100..500u32 {
        for x in 100..700u32 {
            let p = a.get_pixel(x, y).0;
            let q = b.get_pixel(x.wrapping_add_signed(shift[0]), y.wrapping_add_signed(shift[1])).0;
            if p != background {
                sum += (0..3).map(|c| f64::from(p[c].abs_diff(q[c]))).sum::<f64>() / 3.0;
                count += 1;
            }
        }
    }
    sum / f64::from(count)
}

/// What is drawn looking through the first photograph: it on the geometry, and it itself.
fn through(window: &mut Window) -> [RgbaImage; 2] {
    window.state_mut().viewport.look_through(Some(0));
    window.state_mut().viewport.settings.wireframe = false;
    let deadline = Instant::now() + Duration::from_secs(60);
    window.state_mut().viewport.settings.look_through_opacity = 0.0;
    let projected = picture(window);
    window.state_mut().viewport.settings.look_through_opacity = 1.0;
    // The photograph in full comes from the background: it has no dark spots where the geometry
    // hides things from it.
    let mut photograph = picture(window);
    while changed_in_view(&photograph, &projected) < 1e-4 {
        assert!(Instant::now() < deadline, "the photograph never came");
        photograph = picture(window);
    }
    [projected, photograph]
}

/// Where the geometry is seen it carries the same photograph at the same place.
fn assert_same_place([projected, photograph]: &[RgbaImage; 2]) {
    let background = projected.get_pixel(400, 3).0;
    let there = misfit(projected, photograph, background, [0, 0]);
    for shift in [[2, 0], [-2, 0], [0, 2], [0, -2]] {
        let beside = misfit(projected, photograph, background, shift);
        assert!(1.2 * there < beside, "{there} in place, {beside} at {shift:?}");
    }
}

fn part(picture: &RgbaImage, is: impl Fn([u8; 4]) -> bool) -> f64 {
    let count = picture.pixels().filter(|pixel| is(pixel.0)).count();
    count as f64 / f64::from(picture.width() * picture.height())
}

#[test]
fn without_a_capture_it_says_what_to_do() {
    let mut window = window(Content::default());
    let empty = picture(&mut window);
    keep(&empty, "empty");
    assert!(window.query_by_label("Viewport").is_some());
    let background = *empty.get_pixel(5, 5);
    let words = part(&empty, |pixel| pixel != background.0);
    assert!(words > 1e-3 && words < 0.1, "{words}");
}

#[test]
fn a_cleared_view_gives_the_capture_back() {
    let own = Arc::new(Capture::clone(&capture()));
    let held = Arc::downgrade(&own);
    let mut window = window(Content { capture: Some(own), ..Content::default() });
    window.state_mut().content = Content::default();
    window.state_mut().viewport.clear();
    let deadline = Instant::now() + Duration::from_secs(60);
    while held.strong_count() > 0 {
        // Without a frame, which would find that there is no capture any more.
        assert!(Instant::now() < deadline, "something keeps it");
        std::thread::yield_now();
    }
    let empty = picture(&mut window);
    let background = *empty.get_pixel(5, 5);
    assert!(part(&empty, |pixel| pixel != background.0) < 0.1);
}

#[test]
fn the_geometry_wears_the_photographs() {
    let mut window = window(bare());
    window.state_mut().viewport.settings.wireframe = false;
    let photographs = picture(&mut window);
    keep(&photographs, "photographs");
    let background = photographs.get_pixel(790, 400).0;
    assert!(part(&photographs, |pixel| pixel != background) > 0.2);
    window.state_mut().viewport.settings.shading = Shading::Plain;
    let plain = picture(&mut window);
    keep(&plain, "plain");
    assert!(changed(&photographs, &plain) > 0.1);
    // The example's second wall is red, which nothing of the plain view is.
    let colored = |[r, g, b, _]: [u8; 4]| r.max(g).max(b) - r.min(g).min(b) > 40;
    let more = part(&photographs, colored) - part(&plain, colored);
    assert!(more > 0.005, "{more}");
    window.state_mut().viewport.settings.shading = Shading::Material;
    window.state_mut().viewport.settings.wireframe = true;
    let materials = picture(&mut window);
    keep(&materials, "materials");
    assert!(changed(&materials, &plain) > 0.2);
}

#[test]
fn a_selected_surface_changes_colour_and_a_hidden_one_is_gone() {
    let mut window = window(bare());
    window.state_mut().viewport.settings.shading = Shading::Plain;
    let before = picture(&mut window);
    window.state_mut().content.selected_surfaces.insert(surface("floor"));
    let selected = picture(&mut window);
    keep(&selected, "selected");
    assert!(changed(&before, &selected) > 0.03);
    let orange = |[r, _, b, _]: [u8; 4]| i32::from(r) - i32::from(b) > 50;
    assert!(part(&selected, orange) > part(&before, orange) + 0.03);
    window.state_mut().content.selected_surfaces.clear();
    window.state_mut().content.hidden_surfaces.insert(surface("floor"));
    let hidden = picture(&mut window);
    keep(&hidden, "hidden");
    assert!(changed(&before, &hidden) > 0.03);
    assert!(changed(&selected, &hidden) > 0.03);
    window.state_mut().content.hidden_surfaces.clear();
    assert_eq!(changed(&before, &picture(&mut window)), 0.0, "and comes back as it was");
}

#[test]
fn an_edited_tag_keeps_the_geometry() {
    let mut window = window(bare());
    window.state_mut().viewport.settings.shading = Shading::Material;
    let before = picture(&mut window);
    let mut edited = Capture::clone(&capture());
    edited.surfaces[surface("floor")].role = Role::Untagged;
    window.state_mut().content.capture = Some(Arc::new(edited));
    window.run_steps(1);
    assert!(window.state().viewport.is_ready(), "nothing is prepared anew");
    let after = picture(&mut window);
    keep(&after, "untagged");
    assert!(changed(&before, &after) > 0.03);
}

#[test]
fn looking_through_a_photograph_shows_it_where_the_geometry_is() {
    let mut window = window(bare());
    let pictures = through(&mut window);
    keep(&pictures[0], "through-projected");
    keep(&pictures[1], "through-photograph");
    assert_same_place(&pictures);

    window.state_mut().viewport.settings.wireframe = true;
    window.state_mut().viewport.settings.look_through_opacity = 0.6;
    keep(&picture(&mut window), "through-wireframe");
    window.hover_at(egui::pos2(400.0, 300.0));
    window.run_steps(1);
    window.key_press(egui::Key::Tab);
    window.run_steps(2);
    assert_eq!(window.state().viewport.is_looking_through(), Some(1));
    assert_eq!(window.state().events, [ViewportEvent::PickPhotograph(1)]);
    window.key_press(egui::Key::Num0);
    window.run_steps(2);
    assert_eq!(window.state().viewport.is_looking_through(), None);
}

#[test]
fn a_photograph_of_a_distorting_lens_is_shown_to_its_rim() {
    let mut own = Capture::clone(&capture());
    for photograph in &mut own.photographs {
        let c = &photograph.camera;
        photograph.camera = Camera::new(
            (c.width, c.height),
            c.focal_px,
            c.principal_px,
            Distortion {
                radial: [-0.15, 0.02, 0.0, 0.0],
                tangential: [1e-3, -2e-3],
                ..Default::default()
            },
            c.world_from_camera,
            c.position,
        );
        let image = photograph.image.as_ref().expect("a measurement");
        let (width, height) = (image.width(), image.height());
        let mut pixels = image.pixels().collect::<Vec<_>>();
        for (index, pixel) in pixels.iter_mut().enumerate() {
            let (x, y) = (index % width, index / width);
            if x.min(y) < 4 || x + 4 >= width || y + 4 >= height {
                *pixel = [0.0, 10.0, 0.0];
            }
        }
        photograph.image = Some(Arc::new(Image::new(width, height, pixels, None)));
    }
    let mut window = window(Content { capture: Some(Arc::new(own)), ..Content::default() });
    let pictures = through(&mut window);
    keep(&pictures[0], "distorted-projected");
    keep(&pictures[1], "distorted-photograph");
    assert_same_place(&pictures);
    // The corners of a barrel stick out furthest.
    let green = |[r, g, b, _]: [u8; 4]| g > 150 && r < 80 && b < 80;
    for (x, y) in [(0, 100), (720, 100), (720, 520), (0, 520)] {
        let corner = image::imageops::crop_imm(&pictures[1], x, y, 80, 80).to_image();
        assert!(part(&corner, green) > 1e-3, "no rim near {x}, {y}");
    }
}

#[test]
fn a_photograph_without_radiance_says_that_it_is_not_shown() {
    let mut own = Capture::clone(&capture());
    own.photographs[1].image = None;
    let mut window = window(Content { capture: Some(Arc::new(own)), ..Content::default() });
    let words = "Not shown: this photograph holds no radiance";
    for (photograph, is_said) in [(0, false), (1, true)] {
        window.state_mut().viewport.look_through(Some(photograph));
        window.run_steps(2);
        assert_eq!(window.query_by_label(words).is_some(), is_said);
    }
}

#[test]
fn a_long_legend_is_shortened_and_stays() {
    let mut own = Capture::clone(&capture());
    for index in own.materials.len()..12 {
        let material = lobelia::scene::Material {
            name: format!("material {index}"),
            surfaces: Vec::new(),
            ..own.materials[0].clone()
        };
        own.materials.push(material);
    }
    let mut window = window(Content { capture: Some(Arc::new(own)), ..whole() });
    let settings = &mut window.state_mut().viewport.settings;
    settings.shading = Shading::Material;
    settings.sample_color = SampleColor::Views;
    settings.grid = false;
    let tall = picture(&mut window);
    window.set_size(egui::vec2(SIZE[0], 260.0));
    let short = picture(&mut window);
    keep(&tall, "legend-tall");
    keep(&short, "legend-short");
    // Its lower left corner is of the same colour, and not of the background's.
    let corner = |picture: &RgbaImage| *picture.get_pixel(11, picture.height() - 11);
    assert_eq!(corner(&tall), corner(&short));
    assert_ne!(corner(&tall), *tall.get_pixel(790, 590));
}

#[test]
fn what_was_found_is_drawn_and_explained() {
    let mut window = window(whole());
    let all = picture(&mut window);
    keep(&all, "whole");
    window.state_mut().viewport.settings.lights = false;
    window.state_mut().viewport.settings.lobes = false;
    let samples = picture(&mut window);
    keep(&samples, "samples-radiance");
    assert!(changed(&all, &samples) > 0.005);
    window.state_mut().viewport.settings.shading = Shading::Plain;
    let mut before = picture(&mut window);
    for (color, name) in [
        (SampleColor::Material, "samples-material"),
        (SampleColor::Error, "samples-error"),
        (SampleColor::Weight, "samples-weight"),
        (SampleColor::Views, "samples-views"),
    ] {
        window.state_mut().viewport.settings.sample_color = color;
        let now = picture(&mut window);
        keep(&now, name);
        assert!(changed_in_view(&before, &now) > 0.002, "{name}");
        before = now;
    }
    window.state_mut().content.selected_sample = Some(7);
    window.state_mut().content.focus = Focus::Sample;
    window.state_mut().viewport.frame_selection();
    let picked = picture(&mut window);
    keep(&picked, "picked-sample");
    assert!(part(&picked, |[r, g, b, _]| r > 230 && (100..180).contains(&g) && b < 90) > 1e-5);
    let settings = &mut window.state_mut().viewport.settings;
    settings.samples = false;
    window.state_mut().viewport.frame_all();
    let plain = picture(&mut window);
    window.state_mut().viewport.settings.shading = Shading::Reflectance;
    let reflectance = picture(&mut window);
    keep(&reflectance, "reflectance");
    assert!(changed_in_view(&plain, &reflectance) > 0.1);
    let settings = &mut window.state_mut().viewport.settings;
    settings.shading = Shading::Photograph;
    let photograph = picture(&mut window);
    window.state_mut().viewport.settings.tone_mapping = ToneMapping::FalseColor;
    let false_color = picture(&mut window);
    keep(&false_color, "false-colour");
    assert!(changed_in_view(&photograph, &false_color) > 0.1);
    // One box is orange, which the scale has not.
    let orange = |[r, g, _, _]: [u8; 4]| i32::from(r) - i32::from(g) > 40;
    assert!(part(&false_color, orange) < 0.5 * part(&photograph, orange));
}

#[test]
fn the_toolbar_is_found_by_its_labels() {
    let mut window = window(whole());
    for label in ["Wireframe", "Cameras", "Grid", "Samples", "Lights", "Lobes", "Exposure"] {
        assert!(window.query_by_label(label).is_some(), "{label}");
    }
    for label in ["Shading", "Tone mapping", "Sample colour", "View from the top (7)"] {
        assert!(window.query_by_label(label).is_some(), "{label}");
    }
    window.get_by_label("Grid").click();
    window.run_steps(2);
    assert!(!window.state().viewport.settings.grid);
    window.get_by_label("View from the top (7)").click();
    window.run_steps(2);
    let elevation = window.state().viewport.camera().elevation;
    assert!((elevation - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    keep(&picture(&mut window), "top");
}

#[test]
fn exposure_brightens_the_photographs() {
    let mut window = window(bare());
    let light = |picture: &RgbaImage| -> f64 {
        let sum: u64 =
            picture.pixels().map(|p| p.0[..3].iter().map(|v| u64::from(*v)).sum::<u64>()).sum();
        sum as f64
    };
    let normal = light(&picture(&mut window));
    window.state_mut().viewport.settings.exposure_ev = -3.0;
    let dark = picture(&mut window);
    window.ctx.set_theme(egui::Theme::Light);
    keep(&picture(&mut window), "light-theme");
    keep(&dark, "dark");
    assert!(light(&dark) < 0.97 * normal);
}

#[test]
fn the_selected_photograph_is_accented() {
    let mut window = window(bare());
    window.state_mut().viewport.settings.shading = Shading::Plain;
    let orange = |[r, g, b, _]: [u8; 4]| r > 200 && (90..190).contains(&g) && b < 110;
    let before = part(&picture(&mut window), orange);
    window.state_mut().content.selected_photograph = Some(0);
    let after = picture(&mut window);
    keep(&after, "selected-photograph");
    assert!(part(&after, orange) > before + 1e-4);
}
