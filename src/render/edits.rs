//! What a user changes of a recovered scene: its light, its materials, lights and objects that are
//! set into it.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use glam::DAffine3;

use crate::geometry::mesh::Mesh;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::scene::Brdf;
use crate::scene::{Dome, Emitter};

/// Changes to a recovered scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Edits {
    /// Factor on all of the recovered light; 0 turns it off.
    pub original_light: f64,
    /// Further factors on parts of the recovered light, by the names that
    /// [`groups`](super::groups::groups) gives them.
    pub groups: BTreeMap<String, f64>,
    pub lights: Vec<AddedLight>,
    pub objects: Vec<Object>,
    /// By the name of the capture's material.
    pub materials: BTreeMap<String, Override>,
    pub surroundings: Surroundings,
}

impl Default for Edits {
    fn default() -> Self {
        Self {
            original_light: 1.0,
            groups: BTreeMap::new(),
            lights: Vec::new(),
            objects: Vec::new(),
            materials: BTreeMap::new(),
            surroundings: Surroundings::Auto,
        }
    }
}

/// A light that was not there.
#[derive(Clone, Debug, PartialEq)]
pub struct AddedLight {
    pub name: String,
    pub shape: Shape,
    /// Radiance, radiant intensity or irradiance (see [`Emitter::quantity`]); of a dome a factor.
    pub emission: Rgb,
    /// Turned off it sends nothing, and keeps its strength.
    pub is_on: bool,
}

impl AddedLight {
    /// What it sends: its emission, or nothing.
    pub fn sent(&self) -> Rgb {
        if self.is_on { self.emission } else { [0.0; CHANNELS] }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    Emitter(Emitter),
    /// All around, infinitely far away.
    Dome(Dome),
}

/// An object that was not there.
#[derive(Clone, Debug)]
pub struct Object {
    pub name: String,
    /// Where its mesh was read from; empty for one that is in no file.
    pub file: PathBuf,
    /// In its own coordinates.
    pub mesh: Arc<Mesh>,
    /// Names and reflectances of its mesh's surfaces.
    pub surfaces: Vec<(String, Brdf)>,
    /// Invertible.
    pub world_from_object: DAffine3,
}

impl Object {
    /// Its mesh in the capture's coordinates.
    pub fn placed(&self) -> Mesh {
        let mut mesh = (*self.mesh).clone();
        for position in &mut mesh.positions {
            *position = self.world_from_object.transform_point3(position.as_dvec3()).as_vec3();
        }
        if self.world_from_object.matrix3.determinant() < 0.0 {
            // Mirrored, triangles would turn their inner sides out.
            for triangle in &mut mesh.triangles {
                triangle.swap(1, 2);
            }
        }
        mesh
    }
}

impl PartialEq for Object {
    fn eq(&self, other: &Self) -> bool {
        let same_mesh = || {
            let (own, other) = (&*self.mesh, &*other.mesh);
            own.positions == other.positions
                && own.triangles == other.triangles
                && own.surface == other.surface
        };
        self.name == other.name
            && self.file == other.file
            && self.surfaces == other.surfaces
            && self.world_from_object == other.world_from_object
            && (Arc::ptr_eq(&self.mesh, &other.mesh) || same_mesh())
    }
}

/// Another reflectance for a material; what is `None` stays as it was recovered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Override {
    /// Takes the place of a texture, too.
    pub diffuse: Option<Rgb>,
    pub specular: Option<Rgb>,
    pub exponent: Option<f64>,
}

/// A diffuse grey box around everything, which returns added light as the parts of the room
/// would that nobody modelled. It has no part in the recovered light, which includes theirs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Surroundings {
    /// [`GREY`] in rooms, none under an open sky or an added dome.
    #[default]
    Auto,
    Open,
    Albedo(f64),
}

/// Mean reflectance of a furnished room.
pub const GREY: f64 = 0.5;
