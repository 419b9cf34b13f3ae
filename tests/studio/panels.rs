//! Every panel, page and dialog beside a stored picture, in `tests/snapshots`; see `pictures.rs`.
//!
//! The results are those of the published method on few samples: they do not change with the joint
//! solve. What tells times, paths or memory of this machine is painted over before pictures are
//! compared.

use std::path::Path;

use eframe::egui::{self, Key, Modifiers, Rect, pos2};
use egui_kittest::kittest::Queryable as _;
use egui_kittest::try_image_snapshot_options;
use image::{Rgba, RgbaImage};

use crate::Window;
use crate::pictures::{folder, is_comparable, options};
use crate::runs::with_options;

const NONE: Modifiers = Modifiers::NONE;
const WIDTH: f32 = 1100.0;
const HEIGHT: f32 = 700.0;

/// Panels by the workspace's part that they stand in. `View`, `Panels` must have no other.
const RIGHT: [&str; 6] = ["tags", "known light", "charts", "run", "inspector", "relight"];
const LOWER: [&str; 8] = [
    "convergence",
    "error per sample",
    "samples",
    "lights",
    "materials",
    "compare",
    "masks",
    "log",
];
const STUDY: [&str; 2] = ["speed and accuracy", "stability"];
/// Stored with the whole window, in `pictures.rs` and here.
const OTHERS: [&str; 2] = ["outliner", "3D view"];

/// What the names of pictures in the light theme end in.
const LIGHT: &str = " light";
/// Panels that are stored in the dark theme alone: their parts are those of others.
const AS_IN_THE_DARK: [&str; 3] = ["samples", "materials", "log"];

/// Lines of the log begin with seconds.
const LINE_OF_LOG: &str = " s  ";

/// Texts whose numbers or paths differ from run to run, by a part of them.
const VARIABLE: [&str; 8] = [
    "Opened /",
    " of memory",
    "samples 0.",
    "samples 1.",
    "/corner",
    "llvmpipe",
    "runs, about ",
    LINE_OF_LOG,
];

/// The example with results of the published method.
fn with_results(home: &Path) -> Window {
    let options = serde_json::json!({
        "general": {"method": "paper"},
        "samples": {"count": "300", "min_per_material": "20"},
        "lobes": {"mask_px": "24"},
    });
    let file = with_options(home, &options);
    let mut window = Window::at(home, Some(&file));
    window.wait_for("Photographs (6)");
    window.harness.set_size(egui::vec2(WIDTH, HEIGHT));
    window.key(Modifiers::COMMAND, Key::R);
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    while !window.harness.state().is_drawn() {
        window.harness.run_steps(1);
        window.harness.render().expect("a picture");
    }
    // A workspace whose panels do not tell what the notices do.
    window.key(NONE, Key::F4);
    window.wait("the end of the notices", |window| !window.has_part("Done in "));
    window
}

/// A picture once nothing moves and nothing is awaited, what varies painted over.
fn picture(window: &mut Window, also: &[&str]) -> RgbaImage {
    window.harness.hover_at(pos2(0.7 * WIDTH, HEIGHT - 5.0));
    window.wait("rest", |window| !window.harness.state().is_busy());
    window.harness.run_steps(12);
    let mut picture = window.harness.render().expect("a picture");
    let varying = VARIABLE.iter().chain(also);
    let mut places: Vec<Rect> = Vec::new();
    for part in varying {
        for node in window.harness.query_all_by_label_contains(part) {
            // To the right of it, too: texts are shorter and longer.
            let mut place = node.rect();
            let right = place.right().max(place.left() + 320.0).min(WIDTH);
            place.max.x = if *part == LINE_OF_LOG { 0.73 * WIDTH } else { right };
            places.push(place);
        }
    }
    for place in places {
        let right = place.right();
        let place = Rect::from_min_max(place.min.floor(), pos2(right, place.bottom()).ceil());
        for y in place.top() as u32..(place.bottom() as u32).min(picture.height()) {
            for x in place.left() as u32..(right as u32).min(picture.width()) {
                picture.put_pixel(x, y, Rgba([90, 0, 90, 255]));
            }
        }
    }
    picture
}

fn part(picture: &RgbaImage, place: Rect) -> RgbaImage {
    let (x, y) = (place.left() as u32, place.top() as u32);
    let (width, height) = (place.width() as u32, place.height() as u32);
    image::imageops::crop_imm(picture, x, y, width, height).to_image()
}

/// What differs from its stored picture.
#[derive(Default)]
struct Differing(Vec<String>);

impl Differing {
    fn compare(&mut self, picture: &RgbaImage, name: &str) {
        let name = format!("panel-{}", name.replace(' ', "-").to_lowercase());
        let colours: std::collections::BTreeSet<[u8; 4]> =
            picture.pixels().map(|pixel| pixel.0).collect();
        assert!(colours.len() > 16, "{name} shows nothing");
        if let Err(error) = try_image_snapshot_options(picture, &name, &options(&folder())) {
            self.0.push(format!("{name}: {error}"));
        }
    }

    fn tell(self) {
        assert!(self.0.is_empty(), "{}", self.0.join("\n"));
    }
}

#[test]
fn every_panel_is_as_it_was_stored() {
    if !is_comparable() {
        return;
    }
    let home = tempfile::tempdir().unwrap();
    let mut window = with_results(home.path());
    let mut differing = Differing::default();
    window.click("View");
    window.harness.run_steps(5);
    window.click("Panels");
    window.harness.run_steps(5);
    let mut listed: Vec<String> = window
        .labels("Show ")
        .into_iter()
        .filter_map(|text| Some(text.strip_prefix("Show ")?.to_owned()))
        .filter(|name| name != "all surfaces")
        .collect();
    listed.sort();
    listed.dedup();
    let mut known: Vec<String> =
        [&RIGHT[..], &LOWER, &STUDY, &OTHERS].concat().into_iter().map(str::to_owned).collect();
    known.sort();
    assert_eq!(listed, known, "a panel has no stored picture");
    window.key(NONE, Key::Escape);
    window.key(NONE, Key::Escape);

    let (top, bottom) = (28.0, HEIGHT - 28.0);
    let right = Rect::from_min_max(pos2((0.73 * WIDTH).ceil(), top), pos2(WIDTH, bottom));
    let lower_top = (top + 0.58 * (bottom - top)).floor();
    let lower = Rect::from_min_max(
        pos2((0.185 * WIDTH).ceil(), lower_top),
        pos2((0.73 * WIDTH).floor(), bottom),
    );
    let outliner = Rect::from_min_max(pos2(0.0, top), pos2((0.185 * WIDTH).floor(), bottom));
    window.submenu("View", "Panels", "Show samples");
    window.click("samples row 7");
    for end in ["", LIGHT] {
        if end == LIGHT {
            window.menu("View", "Light theme");
        }
        for (names, place) in [(&RIGHT[..], right), (&LOWER, lower)] {
            for name in names.iter().filter(|name| end != LIGHT || !AS_IN_THE_DARK.contains(name)) {
                window.submenu("View", "Panels", &format!("Show {name}"));
                if *name == "compare" {
                    window.wait("what a viewer sees", |window| window.has_part("FLIP 0."));
                }
                let picture = picture(&mut window, &[]);
                differing.compare(&part(&picture, place), &format!("{name}{end}"));
            }
        }
        let whole = picture(&mut window, &[]);
        differing.compare(&part(&whole, outliner), &format!("outliner{end}"));
    }
    window.menu("View", "Dark theme");
    for name in STUDY {
        window.submenu("View", "Panels", &format!("Show {name}"));
        let picture = picture(&mut window, &[]);
        differing.compare(
            &part(&picture, Rect::from_min_max(pos2(0.0, top), pos2(WIDTH, bottom))),
            name,
        );
    }
    differing.tell();
}

#[test]
fn every_page_and_dialog_is_as_it_was_stored() {
    if !is_comparable() {
        return;
    }
    let home = tempfile::tempdir().unwrap();
    let mut differing = Differing::default();
    let mut window = Window::new();
    window.harness.set_size(egui::vec2(WIDTH, HEIGHT));
    window.step();
    let start = picture(&mut window, &[]);
    differing.compare(&start, "start");
    window.menu("View", "Light theme");
    let start = picture(&mut window, &[]);
    differing.compare(&start, "start light");
    window.click("Import…");
    let import = picture(&mut window, &[]);
    differing.compare(&import, "import light");
    window.menu("View", "Dark theme");
    let import = picture(&mut window, &[]);
    differing.compare(&import, "import");
    drop(window);

    let mut window = with_results(home.path());
    let middle =
        Rect::from_center_size(pos2(0.5 * WIDTH, 0.5 * HEIGHT), egui::vec2(680.0, HEIGHT - 56.0));
    for end in ["", LIGHT] {
        if end == LIGHT {
            window.menu("View", "Light theme");
        }
        for (menu, entry, name, title) in [
            ("File", "Export scene…", "export", "Export scene"),
            ("Relight", "Render to files…", "render", "Render pictures"),
            ("Edit", "Assign material…", "assign", "Assign material"),
            ("Help", "Keyboard shortcuts", "shortcuts", "Keyboard shortcuts"),
        ] {
            // Only surfaces that are selected can be assigned.
            let selects = if name == "assign" { NONE } else { Modifiers::ALT };
            window.key(selects, Key::A);
            window.menu(menu, entry);
            assert!(window.has(title), "{entry} opens nothing");
            let shown = picture(&mut window, &["Folder", "/coarse"]);
            differing.compare(&part(&shown, middle), &format!("{name}{end}"));
            window.key(NONE, Key::Escape);
        }
        window.key(Modifiers::COMMAND, Key::P);
        window.harness.event(egui::Event::Text("light".to_owned()));
        let palette = picture(&mut window, &[]);
        differing.compare(&part(&palette, middle), &format!("palette{end}"));
        window.key(NONE, Key::Escape);
    }
    differing.tell();
}

#[test]
fn the_open_tab_is_in_sight() {
    let mut window = Window::with_example();
    // What 1280x720 holds at twice the size of text.
    window.harness.set_size(egui::vec2(640.0, 360.0));
    window.key(NONE, Key::F3);
    window.harness.run_steps(5);
    // In the bar of tabs on the right: toolbar and menu have a "Run" too.
    let in_bar = |window: &Window, label: &str| {
        let bar = window.node("Known light").rect();
        let found = window.harness.query_all_by_label(label).map(|node| node.rect());
        found.into_iter().find(|rect| bar.y_range().contains(rect.center().y))
    };
    let tab = in_bar(&window, "Run").expect("a tab");
    let right = in_bar(&window, "Scroll tabs right").map_or(640.0, |arrow| arrow.left());
    assert!(tab.right() <= right + 1.0, "{tab:?} beside {right}");
    // A hand may scroll it away.
    let left = in_bar(&window, "Scroll tabs left").expect("scrolled");
    window.harness.hover_at(left.center());
    for pressed in [true, false] {
        let (button, modifiers) = (egui::PointerButton::Primary, NONE);
        let pos = left.center();
        window.harness.event(egui::Event::PointerButton { pos, button, pressed, modifiers });
    }
    window.harness.run_steps(30);
    let moved = in_bar(&window, "Run").expect("a tab").left() - tab.left();
    assert!(moved > 10.0, "{moved}");
}
