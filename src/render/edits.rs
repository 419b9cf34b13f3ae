//! The edits of a recovered scene: changes of its light and materials, and added lights and
//! objects.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, Vec3};

use crate::geometry::bvh::Ray;
use crate::geometry::mesh::Mesh;
use crate::geometry::solid::Solid;
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
    pub mesh: Arc<Solid>,
    /// Names and reflectances of its mesh's surfaces.
    pub surfaces: Vec<(String, Brdf)>,
    /// Invertible.
    pub world_from_object: DAffine3,
}

impl Object {
    /// Its mesh in the capture's coordinates.
    pub fn placed(&self) -> Mesh {
        let mut mesh = Mesh::clone(&self.mesh);
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

impl Object {
    /// How far along a ray in the capture it is met, in metres: its mesh, or as long as that is not
    /// [prepared](Solid::prepare), the box around it.
    pub fn met_m(&self, ray: &Ray) -> Option<f32> {
        let inverse = self.world_from_object.inverse();
        let origin = inverse.transform_point3(ray.origin.as_dvec3()).as_vec3();
        let along = inverse.transform_vector3(ray.direction.as_dvec3()).as_vec3();
        let unit = along.length();
        let direction = along / unit;
        let (t_min, t_max) = (ray.t_min * unit, ray.t_max * unit);
        let t = match self.mesh.caster() {
            Some(caster) => caster.closest(&Ray { origin, direction, t_min, t_max })?.t,
            None => {
                let (low, high) = self.mesh.bounds()?;
                let (a, b) = ((low - origin) / direction, (high - origin) / direction);
                let enters = a.min(b).max_element().max(t_min);
                (enters <= a.max(b).min_element().min(t_max)).then_some(enters)?
            }
        };
        Some(t / unit)
    }

    /// How far it reaches from a point of the capture against a direction, 0 or more.
    pub fn reach_m(&self, from: Vec3, normal: Vec3) -> f32 {
        let DAffine3 { matrix3, translation } = self.world_from_object;
        let normal = normal.as_dvec3();
        // The same in the object's coordinates: no corner has to be placed.
        let (across, offset) =
            (matrix3.transpose() * normal, (from.as_dvec3() - translation).dot(normal));
        let positions = self.mesh.positions.iter();
        let reach =
            positions.map(|place| offset - place.as_dvec3().dot(across)).fold(0.0, f64::max);
        reach as f32
    }
}

impl PartialEq for Object {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
            && self.file == other.file
            && self.surfaces == other.surfaces
            && self.world_from_object == other.world_from_object
            && (Arc::ptr_eq(&self.mesh, &other.mesh) || **self.mesh == **other.mesh)
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
