//! A random walk through the window by its buttons, fields and keys, beside a plain model of what a
//! person expects: edit, undo, redo, save, close, a crash, recover and open again. What the panels
//! show, what the file holds and what the model says must agree after every action.
//!
//! `LOBELIA_WALK=10000` walks so many actions, and `LOBELIA_WALK_SEED=3` another way.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use eframe::egui::{self, Key, Modifiers, PointerButton};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use lobelia::math::sampling::Random;
use serde_json::{Value, json};

use crate::nothing_lost::json_of;
use crate::{Window, example};

const NONE: Modifiers = Modifiers::NONE;
const REDO: Modifiers = Modifiers { shift: true, ..Modifiers::COMMAND };
const SURFACES: [&str; 6] = ["floor", "wall1", "wall2", "box1", "box2", "box3"];
/// More of them would not be in sight.
const MOST_MATERIALS: usize = 8;
const MOST_LIGHTS: usize = 4;
/// Steps of undo that the window remembers.
const DEEPEST: usize = 500;
/// Where the outliner ends and where the panels on the right begin.
const OUTLINER_ENDS: f32 = 236.0;
const PANELS_BEGIN: f32 = 930.0;

fn number(variable: &str, otherwise: u64) -> u64 {
    std::env::var(variable).map_or(otherwise, |text| text.parse().expect("a number"))
}

/// What a person would write down of the project.
#[derive(Clone, Debug, Default, PartialEq)]
struct Plain {
    materials: Vec<Material>,
    /// Name, kind, and where its first coordinate was typed: that.
    lights: Vec<(String, &'static str, Option<f64>)>,
}

#[derive(Clone, Debug, PartialEq)]
struct Material {
    name: String,
    is_specular: bool,
    surfaces: BTreeSet<&'static str>,
}

impl Plain {
    fn take_away(&mut self, surface: &str) {
        for material in &mut self.materials {
            material.surfaces.retain(|own| *own != surface);
        }
    }

    fn name_of_material(&self) -> String {
        let is_free = |name: &String| self.materials.iter().all(|own| own.name != *name);
        let mut names = (self.materials.len() + 1..).map(|number| format!("material {number}"));
        names.find(is_free).expect("a free number")
    }

    fn name_of_light(&self, kind: &str) -> String {
        let is_free = |name: &String| self.lights.iter().all(|own| own.0 != *name);
        (1..).map(|number| format!("{kind} light {number}")).find(is_free).expect("a free number")
    }

    /// Whether a project's file says the same.
    fn is_in(&self, file: &Value) -> bool {
        let materials = file["materials"].as_array().expect("a list");
        let lights = file["relight"]["lights"].as_array().map_or(&[][..], Vec::as_slice);
        let is_material = |(own, stored): (&Material, &Value)| {
            let names = stored["surfaces"].as_array().expect("a list").iter();
            let surfaces: BTreeSet<&str> = names.filter_map(Value::as_str).collect();
            stored["name"] == own.name.as_str()
                && stored["specular"] == own.is_specular
                && own.surfaces == surfaces
        };
        let is_light = |(own, stored): (&(String, &str, Option<f64>), &Value)| {
            let x = stored["position"][0].as_f64();
            stored["name"] == own.0.as_str()
                && stored["kind"] == own.1
                && own.2.is_none_or(|own| x.is_some_and(|x| (x - own).abs() < 1e-6))
        };
        materials.len() == self.materials.len()
            && lights.len() == self.lights.len()
            && self.materials.iter().zip(materials).all(is_material)
            && self.lights.iter().zip(lights).all(is_light)
    }
}

/// The model: states, and the steps between them.
#[derive(Default)]
struct Model {
    past: Vec<Plain>,
    now: Plain,
    future: Vec<Plain>,
    saved: Plain,
    /// What may have been kept for recovery: all states since the last save.
    unsaved: Vec<Plain>,
    /// The latest state was kept, and is not saved.
    is_kept: bool,
}

impl Model {
    /// A step that can be undone.
    fn change(&mut self, by: impl FnOnce(&mut Plain)) {
        self.past.push(self.now.clone());
        by(&mut self.now);
        if self.past.len() > DEEPEST {
            self.past.remove(0);
        }
        self.future.clear();
        self.changed();
    }

    fn changed(&mut self) {
        self.unsaved.push(self.now.clone());
        self.is_kept = false;
    }

    fn save(&mut self) {
        self.saved = self.now.clone();
        self.unsaved.clear();
        self.is_kept = false;
    }

    /// Opened anew: nothing can be undone.
    fn open(&mut self, now: Plain) {
        *self = Self { now, saved: self.saved.clone(), ..Self::default() };
    }
}

struct Walk {
    home: PathBuf,
    file: PathBuf,
    window: Option<Window>,
    model: Model,
    random: Random,
}

impl Walk {
    fn window(&mut self) -> &mut Window {
        self.window.as_mut().expect("the window is open")
    }

    fn one_of(&mut self, count: usize) -> usize {
        self.random.below(count)
    }

    /// Opens the project; what a crash left is offered, and taken or not.
    fn open(&mut self) {
        let mut window = Window::at(&self.home, Some(&self.file));
        window.wait_for("Photographs (6)");
        window.wait("all of it", |window| !window.harness.state().is_busy());
        let is_offered = window.has("Recover");
        assert!(is_offered || !self.model.is_kept, "what was kept is not offered");
        assert!(!is_offered || !self.model.unsaved.is_empty(), "nothing was unsaved");
        let (was_kept, kept) = (self.model.is_kept, std::mem::take(&mut self.model.unsaved));
        let latest = self.model.now.clone();
        self.model.open(self.model.saved.clone());
        if is_offered && self.one_of(3) > 0 {
            window.click("Recover");
            window.wait("the work", |window| !window.harness.state().is_busy());
            window.wait_for("Photographs (6)");
            self.window = Some(window);
            let shown = self.shown();
            assert!(!was_kept || is_shown(&latest, &shown), "{shown:?} is not {latest:?}");
            let mut alike = if was_kept { vec![latest] } else { kept.clone() };
            alike.retain(|own| is_shown(own, &shown));
            assert!(!alike.is_empty(), "{shown:?} is none of {kept:?}");
            let is_clear = alike.iter().all(|own| *own == alike[0]);
            if !is_clear {
                // The panels do not show where lights stand, and which surfaces a material has.
                self.window().key(Modifiers::COMMAND, Key::S);
                let stored = json_of(&self.file);
                alike.retain(|own| own.is_in(&stored));
            }
            // A light that nobody moved may stand anywhere; one whose place is known tells more.
            let places = |own: &Plain| own.lights.iter().filter(|light| light.2.is_some()).count();
            let now = alike.into_iter().max_by_key(places);
            let now = now.unwrap_or_else(|| panic!("the saved file is none of {kept:?}"));
            self.model.open(now.clone());
            if is_clear {
                self.model.unsaved.push(now);
            } else {
                self.model.save();
            }
        } else {
            if is_offered {
                window.click("Discard");
            }
            self.window = Some(window);
        }
    }

    /// What the panels show: materials with their numbers of surfaces and kinds, and lights.
    fn shown(&mut self) -> Shown {
        let window = self.window();
        window.key(NONE, Key::F2);
        let rows = right_of(window, " (");
        let materials = rows.iter().filter_map(|text| text.strip_suffix(')')?.rsplit_once(" ("));
        let materials =
            materials.filter_map(|(name, count)| Some((name.to_owned(), count.parse().ok()?)));
        let materials: Vec<(String, usize)> = materials.collect();
        let mut kinds =
            [placed_right(window, "diffuse"), placed_right(window, "specular")].concat();
        kinds.retain(|(_, text)| text == "diffuse" || text == "specular");
        kinds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let specular = kinds.iter().map(|(_, text)| text == "specular").collect();
        window.key(NONE, Key::F5);
        let lights = right_of(window, "  (").into_iter().filter(|text| text.ends_with(')'));
        Shown { materials, specular, lights: lights.collect() }
    }

    fn check(&mut self, action: &str) {
        let shown = self.shown();
        assert!(is_shown(&self.model.now, &shown), "{action}: {shown:?}, not {:?}", self.model.now);
    }

    fn tag(&mut self) {
        self.window().key(NONE, Key::F2);
    }

    fn choose_material(&mut self) -> Option<usize> {
        let count = self.model.now.materials.len();
        if count == 0 {
            return None;
        }
        self.tag();
        let index = self.one_of(count);
        let Material { name, surfaces, .. } = &self.model.now.materials[index];
        let row = format!("{name} ({})", surfaces.len());
        click_right(self.window(), &row);
        Some(index)
    }

    fn choose_light(&mut self) -> Option<usize> {
        let count = self.model.now.lights.len();
        if count == 0 {
            return None;
        }
        self.window().key(NONE, Key::F5);
        let index = self.one_of(count);
        let (name, kind, _) = &self.model.now.lights[index];
        let row = format!("{name}  ({kind})");
        click_right(self.window(), &row);
        Some(index)
    }

    fn new_material(&mut self) {
        if self.model.now.materials.len() >= MOST_MATERIALS {
            return;
        }
        let surface = SURFACES[self.one_of(SURFACES.len())];
        self.tag();
        let window = self.window();
        let is_in_outliner = |node: &egui_kittest::Node| node.rect().right() < OUTLINER_ENDS;
        let row = window.harness.query_all_by_label(surface).rfind(is_in_outliner);
        row.expect("the surface is in the outliner").click();
        window.step();
        window.key(NONE, Key::N);
        self.model.change(|next| {
            next.take_away(surface);
            let name = next.name_of_material();
            let surfaces = BTreeSet::from([surface]);
            next.materials.push(Material { name, is_specular: false, surfaces });
        });
    }

    fn change_kind(&mut self) {
        let Some(index) = self.choose_material() else { return };
        let was_specular = self.model.now.materials[index].is_specular;
        click_right(self.window(), if was_specular { "Diffuse" } else { "Specular" });
        self.model.change(|next| next.materials[index].is_specular = !was_specular);
    }

    fn rename(&mut self) {
        let Some(index) = self.choose_material() else { return };
        let name = format!("name {}", self.one_of(1 << 20));
        let is_entered = self.one_of(2) == 0;
        let window = self.window();
        window.write("Name", &name);
        if is_entered {
            window.key(NONE, Key::Enter);
        } else {
            // What is being typed counts when something else is done.
            window.key(NONE, Key::F3);
        }
        self.model.change(|next| next.materials[index].name = name);
    }

    fn delete(&mut self) {
        let Some(index) = self.choose_material() else { return };
        click_right(self.window(), "Delete");
        self.model.change(|next| drop(next.materials.remove(index)));
    }

    fn add_light(&mut self) {
        if self.model.now.lights.len() >= MOST_LIGHTS {
            return;
        }
        let (kind, name) = [("point", "Point"), ("sun", "Sun")][self.one_of(2)];
        let window = self.window();
        window.key(NONE, Key::F5);
        window.menu("Add light", name);
        self.model.change(|next| next.lights.push((next.name_of_light(kind), kind, None)));
    }

    fn remove_light(&mut self) {
        let Some(index) = self.choose_light() else { return };
        click_right(self.window(), "Remove");
        self.model.change(|next| drop(next.lights.remove(index)));
    }

    fn move_light(&mut self) {
        let Some(index) = self.choose_light() else { return };
        if self.model.now.lights[index].1 != "point" {
            return;
        }
        let value = self.one_of(400);
        let window = self.window();
        if value.is_multiple_of(4) {
            // The hand gives a drag up.
            let place = window.node("Position, x").rect().center();
            window.harness.hover_at(place);
            window.harness.run_steps(1);
            button(window, place, true);
            for step in 1..5 {
                window.harness.hover_at(place + egui::vec2(9.0 * step as f32, 0.0));
                window.harness.run_steps(1);
            }
            window.key(NONE, Key::Escape);
            button(window, place + egui::vec2(36.0, 0.0), false);
            window.step();
            return;
        }
        window.click("Position, x");
        window.key(Modifiers::COMMAND, Key::A);
        window.harness.event(egui::Event::Text(format!("{value} cm")));
        window.step();
        window.key(NONE, Key::Enter);
        let x = f64::from(value as u32) / 100.0;
        if self.model.now.lights[index].2 != Some(x) {
            self.model.change(|next| next.lights[index].2 = Some(x));
        }
    }

    fn undo(&mut self) {
        self.window().key(Modifiers::COMMAND, Key::Z);
        if let Some(former) = self.model.past.pop() {
            let now = std::mem::replace(&mut self.model.now, former);
            self.model.future.push(now);
            self.model.changed();
        }
    }

    fn redo(&mut self) {
        self.window().key(REDO, Key::Z);
        if let Some(later) = self.model.future.pop() {
            let now = std::mem::replace(&mut self.model.now, later);
            self.model.past.push(now);
            self.model.changed();
        }
    }

    fn save(&mut self) {
        self.window().key(Modifiers::COMMAND, Key::S);
        self.model.save();
        self.check_file();
    }

    fn check_file(&self) {
        let stored = json_of(&self.file);
        assert!(self.model.saved.is_in(&stored), "{stored:#} is not {:?}", self.model.saved);
    }

    fn close(&mut self) {
        let answer = self.one_of(3);
        let is_changed = self.model.now != self.model.saved;
        let window = self.window();
        window.menu("File", "Close project");
        if window.has("Save changes?") {
            window.click_front(["Save", "Don't save", "Cancel"][answer]);
            if answer == 2 {
                return;
            }
            window.wait("the end", |window| window.has("Open example"));
            if answer == 0 {
                self.model.save();
            }
        } else {
            assert!(!is_changed, "it is not asked about: {:?}", self.model.now);
            assert!(window.has("Open example"));
        }
        self.window = None;
        // What was given up is not offered.
        self.model.unsaved.clear();
        self.model.is_kept = false;
        self.check_file();
        self.open();
    }

    /// As kill -9 leaves it: at once, or just after all was kept.
    fn crash(&mut self) {
        if self.one_of(2) == 0 {
            self.window().harness.state_mut().autosave();
            self.model.is_kept = self.model.now != self.model.saved;
        }
        self.window = None;
        self.check_file();
        self.open();
    }
}

#[derive(Debug)]
struct Shown {
    /// Names, and how many surfaces.
    materials: Vec<(String, usize)>,
    /// Which of them are specular.
    specular: Vec<bool>,
    lights: Vec<String>,
}

fn is_shown(plain: &Plain, shown: &Shown) -> bool {
    let materials = plain.materials.iter().map(|own| (own.name.clone(), own.surfaces.len()));
    let lights = plain.lights.iter().map(|(name, kind, _)| format!("{name}  ({kind})"));
    materials.eq(shown.materials.iter().cloned())
        && plain.materials.iter().map(|own| own.is_specular).eq(shown.specular.iter().copied())
        && lights.eq(shown.lights.iter().cloned())
}

/// Texts in the panels on the right that contain something, from above.
fn right_of(window: &Window, part: &str) -> Vec<String> {
    placed_right(window, part).into_iter().map(|(_, text)| text).collect()
}

/// The same with the height at which each stands.
fn placed_right(window: &Window, part: &str) -> Vec<(f32, String)> {
    let nodes = window.harness.query_all_by_label_contains(part);
    let nodes = nodes.filter(|node| node.rect().left() > PANELS_BEGIN);
    let text = |node: egui_kittest::Node| {
        let top = node.rect().top();
        let node = node.accesskit_node();
        Some((top, node.value().or(node.label())?))
    };
    let mut texts: Vec<(f32, String)> = nodes.filter_map(text).collect();
    texts.sort_by(|a, b| a.0.total_cmp(&b.0));
    texts
}

/// Clicks what has that label in the panels on the right.
fn click_right(window: &mut Window, label: &str) {
    window.harness.run_steps(2);
    let is_right = |node: &egui_kittest::Node| node.rect().left() > PANELS_BEGIN;
    let found = window.harness.query_all_by_label(label).rfind(is_right);
    found.unwrap_or_else(|| panic!("nothing on the right is labelled \"{label}\"")).click();
    window.step();
}

fn button(window: &mut Window, pos: egui::Pos2, pressed: bool) {
    let (button, modifiers) = (PointerButton::Primary, NONE);
    window.harness.event(egui::Event::PointerButton { pos, button, pressed, modifiers });
    window.harness.run_steps(1);
}

fn project(folder: &Path) -> (PathBuf, Plain) {
    let file = folder.join("walk.lobelia");
    let materials = ["floor", "wall1", "box1"].map(|name| Material {
        name: name.to_owned(),
        is_specular: false,
        surfaces: BTreeSet::from([name]),
    });
    let tags = materials
        .each_ref()
        .map(|own| json!({"name": own.name, "specular": false, "surfaces": own.surfaces}));
    let stored = json!({"version": 3, "capture": example(), "materials": tags});
    fs::write(&file, stored.to_string()).unwrap();
    (file, Plain { materials: materials.to_vec(), lights: Vec::new() })
}

#[test]
fn the_window_agrees_with_a_plain_model_of_it() {
    let actions = number("LOBELIA_WALK", 120);
    let folder = tempfile::tempdir().unwrap();
    let (file, start) = project(folder.path());
    let model = Model { now: start.clone(), saved: start, ..Model::default() };
    let random = Random::new(number("LOBELIA_WALK_SEED", 5), 0, 0);
    let home = folder.path().join("home");
    let mut walk = Walk { home, file, window: None, model, random };
    walk.open();
    walk.check("opened");
    for number in 0..actions {
        type Act = fn(&mut Walk);
        let (name, act): (&str, Act) = match walk.one_of(100) {
            0..10 => ("new material", Walk::new_material),
            10..20 => ("kind", Walk::change_kind),
            20..28 => ("name", Walk::rename),
            28..34 => ("delete", Walk::delete),
            34..42 => ("add light", Walk::add_light),
            42..47 => ("remove light", Walk::remove_light),
            47..56 => ("move light", Walk::move_light),
            56..72 => ("undo", Walk::undo),
            72..83 => ("redo", Walk::redo),
            83..92 => ("save", Walk::save),
            92..96 => ("close", Walk::close),
            _ => ("crash", Walk::crash),
        };
        act(&mut walk);
        walk.check(&format!("action {number}, {name}"));
    }
    walk.save();
}
