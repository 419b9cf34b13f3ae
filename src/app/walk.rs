//! A long random walk through a project, beside a simple model of it. After every edit, undo, save
//! and reopening both must agree, and nothing that was saved may be lost.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use serde_json::json;

use super::change::Change;
use super::edit::Edit;
use super::gesture::Gesture;
use super::given::{self, GivenLight};
use super::project::Project;
use super::relight::{self, NewLight};
use crate::io::project::{self, ProjectFile, Relight};
use crate::io::{edits, tags};
use crate::math::sampling::Random;
use crate::scene::{Capture, KnownLight, MaterialKind, Role, Surface};

const ACTIONS: usize = 10_000;
const SURFACES: usize = 8;

/// What the model knows of a state: no more than a person would write down.
#[derive(Clone, Debug, PartialEq)]
struct Plain {
    /// Name, specular, textured, surfaces.
    materials: Vec<(String, bool, bool, BTreeSet<usize>)>,
    samples: usize,
    lights: Vec<String>,
    /// Of known lights: name and surfaces.
    known: Vec<(String, BTreeSet<usize>)>,
    /// Names of what could not be read.
    unread: Vec<String>,
}

impl Plain {
    fn of(edit: &Edit) -> Self {
        let materials = edit.materials.iter().map(|own| {
            let surfaces = own.surfaces.iter().copied().collect();
            (own.name.clone(), own.kind == MaterialKind::Specular, own.textured, surfaces)
        });
        Self {
            materials: materials.collect(),
            samples: edit.options.samples.count,
            lights: edit.relight.lights.iter().map(|light| light.name.clone()).collect(),
            known: edit.given.lights.iter().map(known).collect(),
            unread: edit.unread.iter().map(|part| part.name()).collect(),
        }
    }
}

fn known(light: &KnownLight) -> (String, BTreeSet<usize>) {
    (light.name().to_owned(), given::surfaces_of(light).iter().copied().collect())
}

/// Undo as it is explained to people.
struct Model {
    past: Vec<Plain>,
    now: Plain,
    future: Vec<Plain>,
    saved: Plain,
}

impl Model {
    fn step(&mut self, next: Plain) {
        if next != self.now {
            self.past.push(std::mem::replace(&mut self.now, next));
            self.future.clear();
        }
    }
}

pub(super) fn capture() -> Arc<Capture> {
    let surface = |index: usize| Surface {
        name: format!("s{index}"),
        role: Role::Material(index),
        has_texcoords: false,
    };
    let mut surfaces: Vec<Surface> = (0..SURFACES).map(surface).collect();
    let tags = tags::from_surfaces(&mut surfaces, &[]);
    Arc::new(Capture { surfaces, materials: tags.materials, ..Capture::default() })
}

pub(super) fn save(project: &Project, file: &Path) {
    let edit = project.edit();
    let stored = ProjectFile {
        capture: project.folder.clone(),
        tags: edit.tags(&project.loaded),
        lights: Some(edit.given.values(&project.loaded)),
        options: edit.options.clone(),
        relight: Relight::Edits(edit.relight.clone(), edit.unread.clone()),
        ..ProjectFile::default()
    };
    project::write_over(file, &stored).unwrap();
}

pub(super) fn open(file: &Path, loaded: &Arc<Capture>) -> Project {
    let stored = project::read(file).unwrap();
    let mut given = GivenLight::of(loaded);
    if let Some(values) = &stored.lights {
        let read = tags::stored_lights(file, values, loaded);
        (given.lights, given.unread) = (read.lights, read.unread);
    }
    let resolved = project::materials(&stored.tags, &given.lit(loaded));
    assert_eq!(resolved.warnings, [] as [String; 0]);
    let Relight::Stored(value) = stored.relight else { panic!("a file stores values") };
    let read = match value.is_null() {
        true => edits::StoredEdits::default(),
        false => edits::stored(file, &value, loaded).unwrap(),
    };
    let mut project = Project::new(stored.capture, loaded.clone(), 0.0);
    project.set_edit(Arc::new(Edit {
        materials: resolved.materials,
        options: stored.options,
        given: Arc::new(given),
        relight: Arc::new(read.edits),
        unread: Arc::new(read.unread),
        absent: resolved.absent,
        charts: project.edit().charts.clone(),
        unread_charts: project.edit().unread_charts.clone(),
        masks: Arc::new(stored.masks),
    }));
    project
}

pub(super) fn count_of(samples: usize) -> Change {
    Change::Option { section: "samples", name: "count", text: samples.to_string() }
}

/// Whether a surface is part of a lamp that photographs show: then it has no material.
fn shines(plain: &Plain, surface: usize) -> bool {
    plain.known.iter().any(|(_, surfaces)| surfaces.contains(&surface))
}

/// A surface belongs to one material at most.
fn take_away(plain: &mut Plain, surface: usize) {
    for (.., surfaces) in &mut plain.materials {
        surfaces.remove(&surface);
    }
}

/// A change, and what the model makes of it.
fn change(random: &mut Random, now: &Plain, edit: &Edit, loaded: &Capture) -> (Change, Plain) {
    let mut next = now.clone();
    let count = next.materials.len();
    let material = random.below(count);
    let surface = random.below(SURFACES);
    let change = match random.below(11) {
        0 if count > 0 && !shines(now, surface) => {
            take_away(&mut next, surface);
            next.materials[material].3.insert(surface);
            Change::Assign { surfaces: [surface].into(), material }
        }
        1 => {
            take_away(&mut next, surface);
            Change::Unassign { surfaces: [surface].into() }
        }
        2 if count > 2 => {
            next.materials.remove(material);
            Change::Delete { material }
        }
        3 if count > 0 => {
            let name = format!("name {}", random.below(1 << 20));
            next.materials[material].0.clone_from(&name);
            Change::Rename { material, name }
        }
        4 if count > 0 => {
            next.materials[material].1 ^= true;
            let kind = match next.materials[material].1 {
                true => MaterialKind::Specular,
                false => MaterialKind::Diffuse,
            };
            Change::Kind { material, kind }
        }
        5 if count > 0 => {
            next.materials[material].2 ^= true;
            Change::Textured { material, textured: next.materials[material].2 }
        }
        6 if count < SURFACES && !shines(now, surface) => {
            let taken = |name: &str| now.materials.iter().any(|own| own.0 == name);
            let numbers = (count + 1..).map(|number| format!("material {number}"));
            let name = numbers.into_iter().find(|name| !taken(name)).unwrap();
            take_away(&mut next, surface);
            next.materials.push((name, false, false, [surface].into()));
            Change::NewMaterial { surfaces: [surface].into() }
        }
        7 => {
            next.samples = 100 + random.below(900);
            count_of(next.samples)
        }
        8 if now.known.len() < 4 => {
            let given = match random.below(2) {
                0 => edit.given.with_shape(NewLight::Sphere, loaded),
                _ => {
                    take_away(&mut next, surface);
                    edit.given.with_visible(&[surface].into())
                }
            };
            next.known = given.lights.iter().map(known).collect();
            Change::Given { name: "known light", of: None, given: Arc::new(given) }
        }
        9 if !now.known.is_empty() => {
            let gone = random.below(now.known.len());
            next.known.remove(gone);
            let given = Arc::new(edit.given.without(gone));
            Change::Given { name: "no known light", of: None, given }
        }
        _ => {
            let edits = match next.lights.len() {
                0..6 => relight::with_light(&edit.relight, NewLight::Point, loaded, 1.0),
                lights => {
                    let gone = random.below(lights);
                    relight::without(&edit.relight, relight::Added::Light(gone))
                }
            };
            next.lights = edits.lights.iter().map(|light| light.name.clone()).collect();
            Change::Relight { name: "lights", of: None, edits: Arc::new(edits) }
        }
    };
    (change, next)
}

#[test]
fn a_project_agrees_with_a_plain_model_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("walk.lobelia");
    let start = json!({
        "capture": ".",
        "materials": [],
        "relight": {"objects": [{"name": "gone", "mesh": "gone.obj"}]},
    });
    std::fs::write(&file, start.to_string()).unwrap();
    let loaded = capture();
    let mut project = open(&file, &loaded);
    project.change(&Change::NewMaterial { surfaces: [0].into() }).unwrap();
    project.change(&Change::NewMaterial { surfaces: [1].into() }).unwrap();
    project.change(&Change::NewMaterial { surfaces: [2].into() }).unwrap();
    save(&project, &file);
    project = open(&file, &loaded);
    let now = Plain::of(project.edit());
    assert_eq!(now.unread, ["gone"]);
    let mut model = Model { past: Vec::new(), saved: now.clone(), now, future: Vec::new() };
    let mut random = Random::new(7, 0, 0);
    let mut presses = 0;
    for action in 0..ACTIONS {
        match random.below(100) {
            0..40 => {
                let (change, next) = change(&mut random, &model.now, project.edit(), &loaded);
                project.change(&change).unwrap();
                model.step(next);
            }
            40..55 => {
                // A number is dragged; the hand may give up.
                presses += 1;
                let gesture = Gesture::Press(presses);
                let mut next = model.now.clone();
                for _ in 0..1 + random.below(5) {
                    next.samples = 100 + random.below(900);
                    project.preview(&count_of(next.samples), gesture).unwrap();
                }
                if random.below(3) == 0 {
                    project.cancel_gesture();
                } else {
                    project.commit();
                    model.step(next);
                }
            }
            55..75 => {
                let told = project.undo().is_some();
                let former = model.past.pop();
                assert_eq!(told, former.is_some(), "action {action}");
                if let Some(former) = former {
                    model.future.push(std::mem::replace(&mut model.now, former));
                }
            }
            75..90 => {
                let told = project.redo().is_some();
                let later = model.future.pop();
                assert_eq!(told, later.is_some(), "action {action}");
                if let Some(later) = later {
                    model.past.push(std::mem::replace(&mut model.now, later));
                }
            }
            90..96 => {
                save(&project, &file);
                project.mark_saved();
                model.saved = model.now.clone();
            }
            _ => {
                // As after a crash: what was saved is there, steps are not.
                project = open(&file, &loaded);
                model.now = model.saved.clone();
                model.past.clear();
                model.future.clear();
            }
        }
        assert_eq!(Plain::of(project.edit()), model.now, "action {action}");
    }
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains("gone.obj"), "what could not be read was saved {ACTIONS} times");
}
