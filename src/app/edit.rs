//! What a user may change about a capture: tags and options. The type is small, so that every state
//! can be kept for undo.

mod charts;

use std::collections::BTreeSet;
use std::sync::Arc;

use serde_json::Value;

use super::change::Change;
use super::given::GivenLight;
use super::things::Things;
use crate::io::edits::Unread;
use crate::io::project::{self, Absent, Masks, Tag};
use crate::reconstruct::Options;
use crate::render::edits::Edits;
use crate::scene::charts::{LaidChart, surfaces};
use crate::scene::{Capture, Material, MaterialKind};

/// The edited state of a project.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edit {
    /// In the order of the list; a material without surfaces is kept here, and left out of what
    /// is reconstructed.
    pub materials: Vec<Material>,
    pub options: Options,
    /// Light that is known.
    pub given: Arc<GivenLight>,
    /// How the results are relit.
    pub relight: Arc<Edits>,
    /// What of that could not be read.
    pub unread: Arc<Vec<Unread>>,
    /// Surfaces that the project's tags name and the capture lacks.
    pub absent: Absent,
    /// What is left out of photographs.
    pub masks: Arc<Masks>,
    /// Charts in the photographs; their surfaces come after those of the files.
    pub charts: Arc<Vec<LaidChart>>,
    /// Charts of the project that could not be read; they are written back.
    pub unread_charts: Arc<Vec<Value>>,
}

impl Edit {
    /// The state of a capture as it was loaded.
    pub fn of(capture: &Capture, options: Options) -> Self {
        let given = Arc::new(GivenLight::of(capture));
        let (materials, charts) = (capture.materials.clone(), capture.charts.clone());
        Self { materials, charts, options, given, ..Self::default() }
    }

    /// The materials as a project file has them.
    pub fn tags(&self, loaded: &Capture) -> Vec<Tag> {
        let tag = |material: &Material| {
            let mut tag = Tag::of(material, loaded);
            tag.surfaces.extend(self.absent.get(&material.name).into_iter().flatten().cloned());
            tag
        };
        self.materials.iter().map(tag).collect()
    }

    /// Whether another state is reconstructed to the same results.
    pub fn same_reconstruction_inputs(&self, other: &Self) -> bool {
        self.materials == other.materials
            && self.options == other.options
            && self.given.lights == other.given.lights
            && self.given.environment == other.given.environment
            && self.masks == other.masks
            && (Arc::ptr_eq(&self.charts, &other.charts)
                || surfaces(&self.charts) == surfaces(&other.charts))
    }

    /// What can be moved in the 3D view.
    pub fn things(&self) -> Things {
        Things { edits: self.relight.clone(), given: self.given.clone() }
    }

    /// The capture with these tags: what loading it with such a tag file would give. Materials
    /// without surfaces are left out, as there.
    /// Photographs are those of an earlier state where their masks are as they were.
    pub fn capture(&self, loaded: &Capture, earlier: Option<(&Capture, &Self)>) -> Capture {
        let mut capture = project::tagged(&self.given.lit(loaded), &self.materials);
        let earlier = earlier.map(|(capture, edit)| (capture, &*edit.masks));
        project::put_masks(&mut capture, &self.masks, earlier);
        capture
    }

    /// The materials that no surface has, also none that the capture lacks at present.
    pub fn empty_materials(&self) -> Vec<usize> {
        let is_empty = |own: &Material| {
            own.surfaces.is_empty() && self.absent.get(&own.name).is_none_or(|own| own.is_empty())
        };
        let all = self.materials.iter().enumerate();
        all.filter(|(_, own)| is_empty(own)).map(|(index, _)| index).collect()
    }

    /// The index in the reconstructed capture of a material of the list; `None` for one without
    /// surfaces.
    pub fn reconstructed(&self, material: usize) -> Option<usize> {
        let own = self.materials.get(material)?;
        let before = &self.materials[..material];
        (!own.surfaces.is_empty())
            .then(|| before.iter().filter(|other| !other.surfaces.is_empty()).count())
    }

    /// The materials that are reconstructed, by their indices in the list.
    pub fn listed(&self) -> Vec<usize> {
        let materials = self.materials.iter().enumerate();
        materials.filter(|(_, own)| !own.surfaces.is_empty()).map(|(index, _)| index).collect()
    }

    /// The options of a run. Starts of materials that are left out would refer to nothing there.
    pub fn run_options(&self) -> Options {
        let mut options = self.options.clone();
        let is_left_out = |name: &str| {
            self.materials.iter().any(|own| own.name == name && own.surfaces.is_empty())
        };
        options.start.retain(|name, _| !is_left_out(name));
        options
    }

    /// Carries a change out, or says why it cannot be.
    pub fn apply(&mut self, change: &Change, loaded: &Capture) -> Result<(), String> {
        match change {
            Change::Assign { surfaces, material } => {
                self.assignable(surfaces, loaded)?;
                if *material < self.materials.len() {
                    self.take(surfaces, Some(*material));
                }
            }
            Change::Unassign { surfaces } => self.take(surfaces, None),
            Change::NewMaterial { surfaces } => {
                self.assignable(surfaces, loaded)?;
                self.materials.push(Material {
                    name: self.free_name("material"),
                    kind: MaterialKind::Diffuse,
                    surfaces: Vec::new(),
                    textured: false,
                    known_diffuse: None,
                    known_diffuse_sd: None,
                });
                self.take(surfaces, Some(self.materials.len() - 1));
            }
            Change::Rename { material, name } => self.rename(*material, name.trim())?,
            Change::Merge { from, into } => {
                let exist = from.max(into) < &self.materials.len();
                if from != into && exist {
                    let surfaces = std::mem::take(&mut self.materials[*from].surfaces);
                    self.materials[*into].surfaces.extend(surfaces);
                    if let Some(absent) = self.absent.remove(&self.materials[*from].name) {
                        let name = self.materials[*into].name.clone();
                        self.absent.entry(name).or_default().extend(absent);
                    }
                    self.remove(*from);
                }
            }
            Change::Delete { material } => {
                if *material < self.materials.len() {
                    self.remove(*material);
                }
            }
            Change::DeleteEmpty => {
                for material in self.empty_materials().into_iter().rev() {
                    self.remove(material);
                }
            }
            Change::Kind { material, kind } => {
                self.material(*material, |own| own.kind = *kind);
            }
            Change::Textured { material, textured } => {
                self.material(*material, |own| own.textured = *textured);
            }
            Change::Known { material, diffuse } => self.material(*material, |own| {
                own.known_diffuse = diffuse.map(|rgb| rgb.map(|value| value.clamp(0.0, 1.0)));
                if diffuse.is_none() {
                    own.known_diffuse_sd = None;
                }
            }),
            Change::KnownDeviation { material, deviation } => self.material(*material, |own| {
                own.known_diffuse_sd = deviation
                    .filter(|_| own.known_diffuse.is_some())
                    .map(|rgb| rgb.map(|value| value.max(0.0)));
            }),
            Change::Option { section, name, text } => {
                self.options.set(section, name, text).map_err(|error| error.to_string())?;
            }
            Change::ForgetStart { material } => {
                self.options.start.remove(material);
            }
            Change::DefaultOptions => self.options = Options::default(),
            Change::Options { options, .. } => self.options = (**options).clone(),
            Change::Given { given, .. } => {
                self.given = given.clone();
                // What shines is no material's any more.
                self.take(&given.luminaires(), None);
            }
            Change::Masks { masks, .. } => self.masks = masks.clone(),
            Change::Charts { charts, .. } => self.set_charts(charts, loaded),
            Change::Relight { edits, .. } => self.relight = edits.clone(),
            Change::Unread { edits, unread, .. } => {
                self.relight = edits.clone();
                self.unread = unread.clone();
            }
        }
        Ok(())
    }

    fn material(&mut self, index: usize, change: impl FnOnce(&mut Material)) {
        if let Some(material) = self.materials.get_mut(index) {
            change(material);
        }
    }

    /// The surfaces leave their materials and go to `target`.
    fn take(&mut self, surfaces: &BTreeSet<usize>, target: Option<usize>) {
        for (index, material) in self.materials.iter_mut().enumerate() {
            // Those that are there already keep their place.
            if Some(index) != target {
                material.surfaces.retain(|surface| !surfaces.contains(surface));
            }
        }
        if let Some(target) = target {
            let own = &mut self.materials[target].surfaces;
            let new: Vec<usize> =
                surfaces.iter().copied().filter(|surface| !own.contains(surface)).collect();
            own.extend(new);
        }
    }

    fn remove(&mut self, material: usize) {
        let gone = self.materials.remove(material);
        self.options.start.remove(&gone.name);
        self.absent.remove(&gone.name);
    }

    fn rename(&mut self, material: usize, name: &str) -> Result<(), String> {
        if name.is_empty() {
            return Err("A material needs a name.".to_owned());
        }
        let mut others = self.materials.iter().enumerate();
        if others.any(|(index, other)| index != material && other.name == name) {
            return Err(format!("Another material is named \"{name}\" already."));
        }
        let Some(own) = self.materials.get_mut(material) else { return Ok(()) };
        let old = std::mem::replace(&mut own.name, name.to_owned());
        if let Some(start) = self.options.start.remove(&old) {
            self.options.start.insert(name.to_owned(), start);
        }
        if let Some(absent) = self.absent.remove(&old) {
            self.absent.insert(name.to_owned(), absent);
        }
        Ok(())
    }

    fn assignable(&self, surfaces: &BTreeSet<usize>, loaded: &Capture) -> Result<(), String> {
        for &surface in surfaces {
            if let Some(light) = self.given.visible_with(surface) {
                return Err(format!(
                    "The surface \"{}\" belongs to the visible light \"{}\": no reflectance is \
                     estimated for it.",
                    loaded.surfaces[surface].name,
                    light.name()
                ));
            }
        }
        Ok(())
    }

    fn free_name(&self, base: &str) -> String {
        let taken = |name: &str| self.materials.iter().any(|material| material.name == name);
        let mut number = self.materials.len() + 1;
        while taken(&format!("{base} {number}")) {
            number += 1;
        }
        format!("{base} {number}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Role, Surface};

    /// Three surfaces, each with a material of its own.
    pub(super) fn capture() -> Capture {
        let surface = |index: usize| Surface {
            name: format!("s{index}"),
            role: Role::Material(index),
            has_texcoords: false,
        };
        let mut surfaces: Vec<Surface> = (0..3).map(surface).collect();
        let tags = crate::io::tags::from_surfaces(&mut surfaces, &[]);
        Capture { surfaces, materials: tags.materials, ..Capture::default() }
    }

    #[test]
    fn untouched_tags_give_the_capture_as_loaded() {
        let loaded = capture();
        let edited = Edit::of(&loaded, Options::default()).capture(&loaded, None);
        assert_eq!(edited.materials, loaded.materials);
        assert_eq!(edited.surfaces, loaded.surfaces);
    }

    #[test]
    fn materials_without_surfaces_are_left_out_of_what_is_reconstructed() {
        let loaded = capture();
        let mut edit = Edit::of(&loaded, Options::default());
        let surfaces = BTreeSet::from([0]);
        edit.apply(&Change::Assign { surfaces, material: 2 }, &loaded).unwrap();
        edit.apply(&Change::Unassign { surfaces: BTreeSet::from([1]) }, &loaded).unwrap();
        let edited = edit.capture(&loaded, None);
        assert_eq!(edited.materials.len(), 1);
        assert_eq!(edited.materials[0].surfaces, [2, 0]);
        let roles: Vec<Role> = edited.surfaces.iter().map(|surface| surface.role).collect();
        assert_eq!(roles, [Role::Material(0), Role::Untagged, Role::Material(0)]);
        assert_eq!([0, 1, 2].map(|m| edit.reconstructed(m)), [None, None, Some(0)]);
        assert_eq!(edit.listed(), [2]);
        edit.options.start = ["s0", "s2", "typo"].map(|name| (name.into(), [0.5; 3])).into();
        let starts: Vec<String> = edit.run_options().start.into_keys().collect();
        assert_eq!(starts, ["s2", "typo"], "a wrong name is still told");
        edit.apply(&Change::DefaultOptions, &loaded).unwrap();
        assert_eq!(edit.options, Options::default());
    }

    #[test]
    fn names_stay_unique_and_starts_follow_them() {
        let loaded = capture();
        let mut edit = Edit::of(&loaded, Options::default());
        edit.options.start.insert("s0".into(), [0.5; 3]);
        let rename = |material, name: &str| Change::Rename { material, name: name.into() };
        assert!(edit.apply(&rename(0, "s1"), &loaded).is_err());
        assert!(edit.apply(&rename(0, "  "), &loaded).is_err());
        edit.apply(&rename(0, "floor"), &loaded).unwrap();
        assert!(edit.options.start.contains_key("floor"));
        edit.apply(&Change::Merge { from: 0, into: 1 }, &loaded).unwrap();
        assert_eq!(edit.materials.len(), 2);
        assert_eq!(edit.materials[0].surfaces, [1, 0]);
        assert!(edit.options.start.is_empty());
    }

    #[test]
    fn a_luminaire_cannot_be_given_a_material() {
        let mut loaded = capture();
        loaded.surfaces[1].role = Role::Luminaire(0);
        loaded
            .lights
            .push(crate::scene::KnownLight::Visible { name: "lamp".into(), surfaces: vec![1] });
        let mut edit = Edit::of(&loaded, Options::default());
        let change = Change::Assign { surfaces: BTreeSet::from([1]), material: 0 };
        assert!(edit.apply(&change, &loaded).unwrap_err().contains("lamp"));
    }

    #[test]
    fn surfaces_that_shine_leave_their_materials_and_come_back_as_untagged() {
        let loaded = capture();
        let mut edit = Edit::of(&loaded, Options::default());
        let lights =
            |given: GivenLight| Change::Given { name: "lights", of: None, given: Arc::new(given) };
        edit.apply(&lights(edit.given.with_visible(&[1].into())), &loaded).unwrap();
        let lit = edit.capture(&loaded, None);
        let roles: Vec<Role> = lit.surfaces.iter().map(|surface| surface.role).collect();
        assert_eq!(roles, [Role::Material(0), Role::Luminaire(0), Role::Material(1)]);
        assert_eq!((lit.lights.len(), lit.materials.len()), (1, 2));
        assert!(!edit.same_reconstruction_inputs(&Edit::of(&loaded, Options::default())));
        edit.apply(&lights(edit.given.without(0)), &loaded).unwrap();
        assert_eq!(edit.capture(&loaded, None).surfaces[1].role, Role::Untagged);
    }
}
