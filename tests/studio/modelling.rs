//! The Model page: a capture from photographs alone, by mouse and keys.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, pos2};
use egui_kittest::kittest::NodeT as _;
use glam::DVec2;
use lobelia::io::{exr, model as files};
use lobelia::model::{
    AdjustOptions, Model, Place, Shape, Solution, Stroke, Support, solve, things,
};
use serde_json::Value;

use crate::{Dropped, Window};

const NONE: Modifiers = Modifiers::NONE;
const VIEW: &str = "Photograph to draw on";
const USE: &str = "Use this model";

fn golden(name: &str) -> Model {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/model");
    files::read(&folder.join(name)).unwrap()
}

/// Photographs of the sizes that a model names, in a folder; their contents do not matter.
fn photographs(folder: &Path, model: &Model) -> Vec<PathBuf> {
    fs::create_dir_all(folder).unwrap();
    let write = |own: &lobelia::model::Photograph| {
        let file = folder.join(own.name.trim_start_matches("images/"));
        let (width, height) = own.size;
        let grey = |index: usize| [0.2 + 0.3 * (index % width) as f32 / width as f32; 3];
        let pixels: Vec<[f32; 3]> = (0..width * height).map(grey).collect();
        exr::write_rgb(&file, width, height, &pixels).unwrap();
        file
    };
    model.photographs.iter().map(write).collect()
}

/// A capture with photographs and a model.
pub fn capture(folder: &Path, model: &Model) -> PathBuf {
    let files = photographs(&folder.join("photographs"), model);
    let capture = folder.join("capture");
    files::new_capture(&capture, &files, &lobelia::watch::Watch::new()).unwrap();
    files::save(&capture, model).unwrap();
    capture
}

pub fn saved(capture: &Path) -> Model {
    files::read(&capture.join("model.json")).unwrap()
}

impl Window {
    /// A window with the Model page of a capture.
    pub fn modelling(home: &Path, capture: &Path) -> Self {
        let mut window = Self::at(home, Some(capture));
        window.wait_for(VIEW);
        window
    }

    /// Where a pixel of the photograph lies in the window, as the page fits it.
    pub fn pixel(&self, size: (usize, usize), pixel: DVec2) -> Pos2 {
        let rect = self.node(VIEW).rect();
        let (width, height) = (size.0 as f32, size.1 as f32);
        let scale = ((rect.width() - 20.0) / width).min((rect.height() - 20.0) / height);
        let corner = rect.center() - 0.5 * scale * eframe::egui::vec2(width, height);
        corner + scale * eframe::egui::vec2(pixel.x as f32, pixel.y as f32)
    }

    pub fn button(&mut self, pos: Pos2, pressed: bool) {
        let (button, modifiers) = (PointerButton::Primary, NONE);
        self.harness.event(Event::PointerButton { pos, button, pressed, modifiers });
        self.harness.run_steps(1);
    }

    pub fn to(&mut self, pos: Pos2) {
        self.harness.event(Event::PointerMoved(pos));
        self.harness.run_steps(1);
    }

    /// Presses at the first place, and releases at the last.
    pub fn drag(&mut self, places: &[Pos2]) {
        self.to(places[0]);
        self.button(places[0], true);
        for place in &places[1..] {
            self.to(*place);
        }
        self.button(places[places.len() - 1], false);
    }

    /// Clicks without waiting for anything.
    pub fn press(&mut self, label: &str) {
        self.node(label).click();
        self.harness.run_steps(2);
    }

    fn is_disabled(&self, label: &str) -> bool {
        self.node(label).accesskit_node().is_disabled()
    }

    /// Waits until the page has solved what is drawn.
    pub fn wait_solved(&mut self) {
        self.wait("the solution", |window| !window.harness.state().is_busy());
    }

    /// Waits until the model can be used.
    pub fn wait_usable(&mut self) {
        self.wait_solved();
        self.wait("a model to use", |window| !window.is_disabled(USE));
    }

    fn type_number(&mut self, label: &str, text: &str) {
        self.click(label);
        self.key(Modifiers::COMMAND, Key::A);
        self.harness.event(Event::Text(text.to_owned()));
        self.step();
        self.key(NONE, Key::Enter);
    }

    pub fn save_model(&mut self) {
        self.key(Modifiers::COMMAND, Key::S);
        assert!(self.has_part("Saved"), "{:?}", self.labels(" "));
    }
}

/// Adds the things of a model by the page's buttons and fields, in their order.
fn add_things(window: &mut Window, model: &Model) {
    for thing in &model.things {
        let (button, kind) = match thing.shape {
            Shape::Room { .. } => ("Room", "room"),
            Shape::Box { .. } => ("Box", "box"),
            _ => panic!("no such thing in these scenes"),
        };
        window.click(button);
        window.write("Name", &thing.id);
        assert!(window.has(&format!("{} ({kind})", thing.id)));
        if let Support::Top(host) = thing.on {
            window.click("What it stands on");
            window.click_front(&format!("top of {}", model.things[host].id));
        }
        for (name, value) in &thing.held {
            window.click(&format!("Hold {name}"));
            window.type_number(name, &value.to_string());
        }
        window.key(NONE, Key::V);
    }
}

/// The row of a thing in the list.
pub fn row(window: &mut Window, id: &str) {
    let own = window.labels(&format!("{id}  ")).into_iter().next();
    window.press(&own.unwrap_or_else(|| panic!("no row of {id}")));
}

/// Draws the strokes of a model with the mouse; what is typed is typed.
fn draw(window: &mut Window, model: &Model) {
    let mut selected = None;
    let mut shown = 0;
    // Points are numbered in the order in which they are drawn.
    let mut points: Vec<usize> = Vec::new();
    for stroke in &model.strokes {
        let size = model.photographs[0].size;
        if let Some(photograph) = stroke.photograph().filter(|own| *own != shown) {
            window.press(&format!("Photograph {}", model.photographs[photograph].name));
            shown = photograph;
        }
        let places = stroke.places().to_vec();
        let thing = places.iter().find_map(|place| match place {
            Place::Corner { thing, .. } => Some(*thing),
            Place::Point(_) => None,
        });
        let own = matches!(stroke, Stroke::Pick { .. } | Stroke::Edge { .. });
        if let Some(thing) = thing.filter(|own_thing| own && selected != Some(*own_thing)) {
            row(window, &model.things[thing].id);
            selected = Some(thing);
        }
        let corner = |place: &Place| match place {
            Place::Corner { thing, corner } => {
                things::corner_names(&model.things[*thing])[*corner].clone()
            }
            Place::Point(_) => panic!("it is no corner"),
        };
        match stroke {
            Stroke::Line { axis, from, to, .. } => {
                window.press(&format!("Line along {}", axis.name()));
                let ends = [*from, *to].map(|own| window.pixel(size, own));
                window.drag(&ends);
            }
            Stroke::Pick { at: Place::Point(point), pixel, .. } => {
                match points.iter().position(|own| own == point) {
                    Some(number) => row(window, &format!("p{}", number + 1)),
                    None => {
                        points.push(*point);
                        window.key(NONE, Key::V);
                        window.key(NONE, Key::P);
                    }
                }
                selected = None;
                let place = window.pixel(size, *pixel);
                window.drag(&[place]);
            }
            Stroke::Pick { at, pixel, .. } => {
                window.press(&format!("Corner {}", corner(at)));
                let place = window.pixel(size, *pixel);
                window.drag(&[place]);
            }
            Stroke::Edge { between, from, to, .. } => {
                let [a, b] = between.each_ref().map(corner);
                let label = [format!("Edge {a} to {b}"), format!("Edge {b} to {a}")]
                    .into_iter()
                    .find(|label| window.has(label));
                window.press(&label.unwrap_or_else(|| panic!("no edge {a} to {b}")));
                let ends = [*from, *to].map(|own| window.pixel(size, own));
                window.drag(&ends);
            }
            _ => {}
        }
    }
}

/// The place that a photograph shows of a corner: as it was picked.
fn picked(model: &Model, photograph: usize, place: Place) -> Option<DVec2> {
    match model.strokes[model.pick_of(photograph, place)?] {
        Stroke::Pick { pixel, .. } => Some(pixel),
        _ => None,
    }
}

/// Types positions and lengths: each is drawn between corners that a photograph shows.
fn type_known(window: &mut Window, model: &Model) {
    let size = model.photographs[0].size;
    for stroke in &model.strokes {
        let shows = |photograph: usize| -> Option<Vec<DVec2>> {
            stroke.places().iter().map(|place| picked(model, photograph, *place)).collect()
        };
        let found = (0..model.photographs.len()).find_map(|own| Some((own, shows(own)?)));
        match stroke {
            Stroke::Position { position, .. } => {
                let (photograph, pixels) = found.expect("a photograph that shows it");
                window.press(&format!("Photograph {}", model.photographs[photograph].name));
                window.key(NONE, Key::O);
                let place = window.pixel(size, pixels[0]);
                window.drag(&[place]);
                window.step();
                for (axis, value) in ["x", "y", "z"].into_iter().zip(position.to_array()) {
                    window.type_number(&format!("Position, {axis}"), &value.to_string());
                }
            }
            Stroke::Length { length_m, .. } => {
                let (photograph, pixels) = found.expect("a photograph that shows both");
                window.press(&format!("Photograph {}", model.photographs[photograph].name));
                window.key(NONE, Key::K);
                let ends = [pixels[0], pixels[1]].map(|own| window.pixel(size, own));
                window.drag(&ends);
                // The field has the focus: the number is typed at once.
                window.step();
                window.key(Modifiers::COMMAND, Key::A);
                window.harness.event(Event::Text(length_m.to_string()));
                window.step();
                window.key(NONE, Key::Enter);
            }
            _ => {}
        }
    }
}

/// Whether two strokes say the same, to a hundredth of a pixel; points may have other numbers.
fn is_same(a: &Stroke, b: &Stroke) -> bool {
    let pixels = |own: &Stroke| match own {
        Stroke::Line { from, to, .. } | Stroke::Edge { from, to, .. } => vec![*from, *to],
        Stroke::Pick { pixel, .. } | Stroke::Rim { pixel, .. } => vec![*pixel],
        _ => Vec::new(),
    };
    let corners = |own: &Stroke| {
        let mut places: Vec<Place> = own.places().to_vec();
        places.retain(|place| matches!(place, Place::Corner { .. }));
        places.sort();
        places
    };
    (a.name(), a.axis(), a.photograph(), corners(a))
        == (b.name(), b.axis(), b.photograph(), corners(b))
        && pixels(a).iter().zip(&pixels(b)).all(|(a, b)| a.distance(*b) < 0.01)
}

pub fn solved(model: &Model) -> Solution {
    solve(model, &AdjustOptions::default()).unwrap()
}

/// Draws everything of a scene by hand, and compares the cameras that are written with those that
/// the core finds by the stored strokes.
fn by_hand(name: &str) {
    let stored = golden(name);
    let folder = tempfile::tempdir().unwrap();
    let images = photographs(&folder.path().join("photographs"), &stored);
    let capture = folder.path().join("room");
    let mut window = Window::at(&folder.path().join("home"), None);
    window.step();
    for image in &images {
        window.harness.input_mut().dropped_files.push(Arc::new(Dropped(image.clone())));
    }
    window.step();
    window.write("Folder for the capture", capture.to_str().unwrap());
    window.click("Create");
    window.wait_for(VIEW);
    window.wait_solved();
    add_things(&mut window, &stored);
    draw(&mut window, &stored);
    type_known(&mut window, &stored);
    window.wait_usable();
    window.save_model();
    // All is there, to a thousandth of a pixel: places in the window have seven digits.
    let drawn = saved(&capture);
    assert_eq!(drawn.strokes.len(), stored.strokes.len());
    let by_hand = |model: &Model| -> Vec<Stroke> {
        let own = model.strokes.iter().filter(|stroke| stroke.photograph().is_some());
        own.cloned().collect()
    };
    for (own, stored) in by_hand(&drawn).iter().zip(&by_hand(&stored)) {
        assert!(is_same(own, stored), "{own:?} instead of {stored:?}");
    }
    let (own, core) = (solved(&drawn), solved(&stored));
    for (a, b) in own.cameras.iter().zip(&core.cameras) {
        let (a, b) = (a.unwrap(), b.unwrap());
        assert!(a.position.distance(b.position) < 2e-3, "{} {}", a.position, b.position);
        let turn = a.world_from_camera.transpose() * b.world_from_camera;
        let cosine = 0.5 * (turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0);
        assert!(cosine.clamp(-1.0, 1.0).acos().to_degrees() < 0.02);
        assert!((a.focal_px.x / b.focal_px.x - 1.0).abs() < 1e-3);
    }
    window.click(USE);
    window.wait_for(&format!("Photographs ({})", stored.photographs.len()));
    let file = fs::read_to_string(capture.join("transforms.json")).unwrap();
    let written: Value = serde_json::from_str(&file).unwrap();
    for (frame, camera) in written["frames"].as_array().unwrap().iter().zip(&own.cameras) {
        let x = frame["transform_matrix"][0][3].as_f64().unwrap();
        assert!((x - camera.unwrap().position.x).abs() < 1e-12);
    }
    assert!(capture.join("scene.obj").is_file());
}

#[test]
fn one_photograph_drawn_by_hand_gives_the_cores_camera() {
    by_hand("boxes-one.json");
}

#[test]
fn six_photographs_drawn_by_hand_give_the_cores_cameras() {
    by_hand("corner-diffuse.json");
}

/// A begun capture of one empty photograph.
pub fn empty(folder: &Path) -> PathBuf {
    let mut model = golden("boxes-one.json");
    (model.things, model.strokes) = Default::default();
    let capture = capture(folder, &model);
    fs::remove_file(capture.join("model.json")).unwrap();
    capture
}

pub const SIZE: (usize, usize) = (640, 480);

fn line(window: &mut Window, key: Key, from: [f64; 2], to: [f64; 2]) {
    window.key(NONE, key);
    assert!(window.has_part(&format!("Line along {}: drag", key.name().to_lowercase())));
    let ends = [from, to].map(|own| window.pixel(SIZE, DVec2::from(own)));
    let middle = ends[0].lerp(ends[1], 0.5);
    window.drag(&[ends[0], middle, pos2(middle.x + 3.0, middle.y), ends[1]]);
    window.key(NONE, Key::V);
}

#[test]
fn each_movement_of_the_hand_is_one_step_of_undo() {
    let folder = tempfile::tempdir().unwrap();
    let capture = empty(folder.path());
    let mut window = Window::modelling(&folder.path().join("home"), &capture);
    line(&mut window, Key::X, [100.0, 300.0], [400.0, 280.0]);
    line(&mut window, Key::Z, [200.0, 400.0], [205.0, 100.0]);
    // An end, by hand in several steps.
    let places = [[400.0, 280.0], [410.0, 270.0], [420.0, 260.0], [430.0, 255.0]]
        .map(|own| window.pixel(SIZE, DVec2::from(own)));
    window.drag(&places);
    let ends = |capture: &Path| -> Vec<DVec2> {
        let end = |stroke: &Stroke| match stroke {
            Stroke::Line { to, .. } => *to,
            other => panic!("{other:?}"),
        };
        saved(capture).strokes.iter().map(end).collect()
    };
    window.save_model();
    assert!(ends(&capture)[0].distance(DVec2::new(430.0, 255.0)) < 0.01);
    let command = Modifiers::COMMAND;
    window.key(command, Key::Z);
    assert!(window.has("Undone: move end"));
    window.save_model();
    assert!(ends(&capture)[0].distance(DVec2::new(400.0, 280.0)) < 0.01);
    window.key(command, Key::Z);
    window.save_model();
    assert_eq!(ends(&capture).len(), 1, "the line along z is one step");
    window.key(command | Modifiers::SHIFT, Key::Z);
    window.key(command | Modifiers::SHIFT, Key::Z);
    window.save_model();
    assert!(ends(&capture)[0].distance(DVec2::new(430.0, 255.0)) < 0.01);
    // Escape takes back what is under way, without a trace.
    let places = [[430.0, 255.0], [300.0, 300.0]].map(|own| window.pixel(SIZE, DVec2::from(own)));
    window.to(places[0]);
    window.button(places[0], true);
    window.to(places[1]);
    window.key(NONE, Key::Escape);
    window.button(places[1], false);
    window.save_model();
    assert!(ends(&capture)[0].distance(DVec2::new(430.0, 255.0)) < 0.01);
    window.key(command, Key::Z);
    window.save_model();
    assert!(ends(&capture)[0].distance(DVec2::new(400.0, 280.0)) < 0.01, "the step before");
    // Delete removes what is selected; its undo brings it back.
    let place = window.pixel(SIZE, DVec2::new(205.0, 100.0));
    window.drag(&[place]);
    window.key(NONE, Key::Delete);
    window.save_model();
    assert_eq!(ends(&capture).len(), 1);
    window.key(command, Key::Z);
    window.save_model();
    assert_eq!(ends(&capture).len(), 2);
}

#[test]
fn lines_come_to_lie_on_edges_of_the_photograph() {
    let folder = tempfile::tempdir().unwrap();
    let capture = empty(folder.path());
    // A floor that is brighter than the wall; their edge falls by a tenth.
    let edge = |x: f64| 240.0 + 0.1 * (x - 320.0);
    let bright = |index: usize| {
        let (x, y) = ((index % 640) as f64 + 0.5, (index / 640) as f64 + 0.5);
        [if y > edge(x) { 0.8 } else { 0.2 }; 3]
    };
    let pixels: Vec<[f32; 3]> = (0..640 * 480).map(bright).collect();
    exr::write_rgb(&capture.join("images/001.exr"), 640, 480, &pixels).unwrap();
    let mut window = Window::modelling(&folder.path().join("home"), &capture);
    window.wait_solved();
    let ends = [[120.0, edge(120.0) + 3.0], [520.0, edge(520.0) - 2.0]];
    line(&mut window, Key::X, ends[0], ends[1]);
    window.key(NONE, Key::S);
    line(&mut window, Key::X, ends[0], ends[1]);
    window.save_model();
    let off = |stroke: &Stroke| match stroke {
        Stroke::Line { from, to, .. } => [from, to].map(|end| (end.y - edge(end.x)).abs()),
        other => panic!("{other:?}"),
    };
    let strokes = saved(&capture).strokes;
    assert!(off(&strokes[0]).iter().all(|off| *off < 0.3), "{:?}", off(&strokes[0]));
    assert!(off(&strokes[1]).iter().all(|off| *off > 1.9), "{:?}", off(&strokes[1]));
}

#[test]
fn numbers_can_be_typed_and_corners_dragged() {
    let stored = golden("boxes-one.json");
    let folder = tempfile::tempdir().unwrap();
    let capture = capture(folder.path(), &stored);
    let mut window = Window::modelling(&folder.path().join("home"), &capture);
    window.wait_usable();
    row(&mut window, "cardboard1");
    window.key(NONE, Key::V);
    // A corner that no stroke shows lies where the solution has it; dragged, it is shown.
    let hidden = Place::Corner { thing: 1, corner: 3 };
    assert!(stored.pick_of(0, hidden).is_none(), "the scene has changed");
    let solution = solved(&stored);
    let at = solution.cameras[0].unwrap().project(solution.corners[1][3]).unwrap().0;
    let places = [at, at + DVec2::new(4.0, 1.0), at + DVec2::new(12.0, 2.0)]
        .map(|own| window.pixel(SIZE, own));
    window.drag(&places);
    window.save_model();
    let pixel = picked(&saved(&capture), 0, hidden).expect("the corner is shown now");
    assert!(pixel.distance(at + DVec2::new(12.0, 2.0)) < 0.01, "{pixel} {at}");
    window.key(Modifiers::COMMAND, Key::Z);
    // The height of a box, typed, is exact.
    row(&mut window, "cardboard1");
    window.click("Hold height");
    window.type_number("height", "55 cm");
    window.wait_solved();
    window.save_model();
    let held = saved(&capture).things[1].held.clone();
    assert_eq!(held, [("height".to_owned(), 0.55)]);
    window.key(Modifiers::COMMAND, Key::Z);
    window.save_model();
    assert_ne!(saved(&capture).things[1].held, held);
}

#[test]
fn a_photograph_that_cannot_be_read_hinders_no_other() {
    let mut model = golden("corner-diffuse.json");
    model.photographs.truncate(2);
    model.strokes.retain(|stroke| stroke.photograph().is_none_or(|own| own < 2));
    let folder = tempfile::tempdir().unwrap();
    let capture = capture(folder.path(), &model);
    let file = capture.join(&model.photographs[1].name);
    let bytes = fs::read(&file).unwrap();
    fs::write(&file, &bytes[..bytes.len() / 3]).unwrap();
    let mut window = Window::modelling(&folder.path().join("home"), &capture);
    window.wait_solved();
    assert!(window.has_part("Solved: strokes are off by"));
    window.key(NONE, Key::PageDown);
    window.wait("the reason", |window| window.has_part(file.to_str().unwrap()));
    assert!(!window.has_part("os error") && window.has_part("Solved: strokes are off by"));
    // What is no photograph is refused before anything is made.
    let letter = folder.path().join("letter.jpg");
    fs::write(&letter, "Dear").unwrap();
    let out = folder.path().join("out");
    window.key(Modifiers::COMMAND, Key::N);
    window.click("Add photographs…");
    window.write("Path", letter.to_str().unwrap());
    window.click_front("Add photographs");
    window.write("Folder for the capture", out.to_str().unwrap());
    window.click("Create");
    window.wait("the refusal", |window| window.has_part("this is no photograph that is read here"));
    assert!(!out.exists());
    window.click("Cancel");
    assert!(window.has(VIEW), "the page stays");
}

#[test]
fn strokes_that_contradict_each_other_are_told_and_nothing_is_written() {
    let mut model = golden("corner-diffuse.json");
    let mut turn = 0;
    for stroke in &mut model.strokes {
        if let Stroke::Pick { at: Place::Corner { thing: 1.., corner }, .. } = stroke {
            turn += 1;
            *corner = (*corner + turn * 3) % 8;
        }
    }
    let words = match solve(&model, &AdjustOptions::default()) {
        Err(error) => error.to_string(),
        Ok(solution) => solution.problems[0].to_string(),
    };
    let folder = tempfile::tempdir().unwrap();
    let capture = capture(folder.path(), &model);
    let cameras = fs::read(capture.join("transforms.json")).unwrap();
    let mut window = Window::modelling(&folder.path().join("home"), &capture);
    window.wait_solved();
    assert!(window.has_part(&words), "the core says: {words}");
    assert!(window.is_disabled(USE));
    window.key(Modifiers::COMMAND, Key::M);
    window.step();
    assert!(!capture.join("scene.obj").exists());
    assert_eq!(fs::read(capture.join("transforms.json")).unwrap(), cameras);
}

#[test]
fn what_is_ill_posed_is_told_in_the_cores_words() {
    let folder = tempfile::tempdir().unwrap();
    let capture = empty(folder.path());
    let mut window = Window::modelling(&folder.path().join("home"), &capture);
    line(&mut window, Key::X, [100.0, 300.0], [400.0, 280.0]);
    line(&mut window, Key::X, [100.0, 100.0], [400.0, 140.0]);
    window.wait_solved();
    assert!(window.has_part("the focal length is not determined"));
    assert!(window.is_disabled(USE));
}

#[test]
fn a_model_is_saved_asked_about_and_recovered() {
    let folder = tempfile::tempdir().unwrap();
    let capture = empty(folder.path());
    let home = folder.path().join("home");
    let mut window = Window::modelling(&home, &capture);
    line(&mut window, Key::X, [100.0, 300.0], [400.0, 280.0]);
    window.save_model();
    line(&mut window, Key::Y, [150.0, 200.0], [300.0, 280.0]);
    window.wait_solved();
    // As after a crash: nothing was asked.
    drop(window);
    assert_eq!(saved(&capture).strokes.len(), 1);
    let mut window = Window::modelling(&home, &capture);
    window.wait("the strokes", |window| window.has_part("Strokes that were not saved"));
    window.save_model();
    assert_eq!(saved(&capture).strokes.len(), 2);
    window.harness.state_mut().autosave();
    assert!(!capture.join("model.unsaved.json").exists());
    line(&mut window, Key::Z, [150.0, 300.0], [160.0, 80.0]);
    window.key(Modifiers::COMMAND, Key::W);
    assert!(window.has("Save changes?"));
    window.click("Don't save");
    assert!(window.has("New from photographs…"));
    drop(window);
    assert_eq!(saved(&capture).strokes.len(), 2);
    assert!(!capture.join("model.unsaved.json").exists());
    let mut window = Window::modelling(&home, &capture);
    window.wait_solved();
    assert!(!window.has_part("Strokes that were not saved"));
}

/// Tags and their undo stay with the surfaces when the model changes.
#[test]
fn tags_survive_a_change_of_the_model() {
    let stored = golden("boxes-artificial.json");
    let folder = tempfile::tempdir().unwrap();
    let capture = capture(folder.path(), &stored);
    let mut window = Window::modelling(&folder.path().join("home"), &capture);
    window.wait_usable();
    window.click(USE);
    window.wait_for("Photographs (3)");
    window.click("cardboard1");
    window.key(NONE, Key::N);
    window.wait_solved();
    let materials = |window: &Window| {
        let names = window.labels(" (1)");
        names.iter().filter(|name| name.starts_with("material ")).count()
    };
    let before = materials(&window);
    assert!(before > 0, "a material was made");
    window.key(NONE, Key::F7);
    window.wait_for(VIEW);
    row(&mut window, "cardboard1");
    window.click("Hold height");
    window.wait_usable();
    window.click(USE);
    window.wait("the capture", |window| {
        window.has("Photographs (3)") && !window.harness.state().is_busy()
    });
    assert_eq!(materials(&window), before);
    window.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(materials(&window), before - 1, "the undo of tags is there, too");
}
