//! What a user changes of a recovered scene: its light, its materials, lights and objects that are
//! set into it.

use std::collections::BTreeMap;

use crate::geometry::mesh::Mesh;
use crate::math::rgb::Rgb;
use crate::reconstruct::equations::Reflectance;
use crate::scene::{Dome, Emitter};

/// Changes to a recovered scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Edits {
    /// Factor on all of the recovered light; 0 turns it off.
    pub original_light: f64,
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
}

#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    Emitter(Emitter),
    /// All around, infinitely far away.
    Dome(Dome),
}

/// An object that was not there, in the capture's coordinates.
#[derive(Clone, Debug, Default)]
pub struct Object {
    pub name: String,
    pub mesh: Mesh,
    /// One per surface of its mesh.
    pub reflectances: Vec<Reflectance>,
}

impl PartialEq for Object {
    fn eq(&self, other: &Self) -> bool {
        let Mesh { positions, triangles, surface, .. } = &self.mesh;
        self.name == other.name
            && self.reflectances == other.reflectances
            && *positions == other.mesh.positions
            && *triangles == other.mesh.triangles
            && *surface == other.mesh.surface
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
