//! A capture: the input of a reconstruction.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DMat3;

use crate::geometry::mesh::Mesh;
use crate::math::rgb::Rgb;
use crate::scene::charts::LaidChart;
use crate::scene::{Camera, Dome, Emitter, Image};

/// A partial geometric model with calibrated photographs of it and the artist's tags.
#[derive(Clone, Debug, Default)]
pub struct Capture {
    /// The folder's name.
    pub name: String,
    /// Shared by all states of the tags.
    pub mesh: Arc<Mesh>,
    /// One per `usemtl` group, indexed by `Mesh::surface`.
    pub surfaces: Vec<Surface>,
    pub photographs: Vec<Photograph>,
    pub materials: Vec<Material>,
    pub lights: Vec<KnownLight>,
    pub environment: Environment,
    /// Their surfaces and materials are the last ones of a capture as it was loaded.
    pub charts: Arc<Vec<LaidChart>>,
    /// What the pixels of the photographs were multiplied by after they were read, if anything.
    pub color_matrix: Option<DMat3>,
    /// Warnings of the readers: each names the problem, its place and its consequence.
    pub warnings: Vec<String>,
}

impl Capture {
    /// The colour matrix to read the photographs by: the present one, followed by `correction`.
    pub fn corrected_by(&self, correction: &DMat3) -> DMat3 {
        self.color_matrix.map_or(*correction, |own| *correction * own)
    }
}

/// A group of polygons that can be tagged.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    pub name: String,
    pub role: Role,
    /// The file gave texture coordinates for every polygon of the surface.
    pub has_texcoords: bool,
}

impl Surface {
    /// The material that it reflects as.
    pub fn material(&self) -> Option<usize> {
        match self.role {
            Role::Material(index) => Some(index),
            Role::Luminaire(_) | Role::Untagged => None,
        }
    }
}

/// The role of a surface in the reconstruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Reflects as `Capture::materials[index]`.
    Material(usize),
    /// Part of the visible luminaire `Capture::lights[index]`: its radiance is read from the
    /// photographs, no reflectance is estimated for it.
    Luminaire(usize),
    /// Named by no tag: it shades and gives light, but no reflectance is estimated for it.
    Untagged,
}

/// A photograph with its camera.
#[derive(Clone, Debug)]
pub struct Photograph {
    /// `file_path` as written in the camera file.
    pub name: String,
    pub camera: Camera,
    /// Linear radiance, or `None` where the photograph is no measurement (`"hdr": false`,
    /// `"use": "geometry"`).
    pub image: Option<Arc<Image>>,
    /// What is shown of one that is no measurement.
    pub display: Option<Display>,
}

/// A picture that is shown and measures nothing, such as a JPEG file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Display {
    pub file: PathBuf,
    /// EXIF's orientation: how its pixels are turned before they are those of the camera.
    pub orientation: u32,
}

/// One reflectance to be estimated, shared by the surfaces tagged with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    pub name: String,
    pub kind: MaterialKind,
    /// Indices into `Capture::surfaces`.
    pub surfaces: Vec<usize>,
    /// Diffuse reflectance varies over the surfaces; a texture is reconstructed (Section 5.5).
    pub textured: bool,
    /// A known diffuse reflectance, 0 to 1: held fixed.
    pub known_diffuse: Option<Rgb>,
    /// Standard deviation of the known diffuse reflectance, 0 or more. `None` where it is taken
    /// to be exact, and where none is known.
    pub known_diffuse_sd: Option<Rgb>,
}

impl Material {
    /// Whether its diffuse reflectance is known without a deviation.
    pub fn is_exactly_known(&self) -> bool {
        self.known_diffuse.is_some() && self.known_diffuse_sd.is_none()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialKind {
    Diffuse,
    /// Modified Phong (Eq. 12).
    Specular,
}

/// A known light, given in `tags.json` or in the studio.
#[derive(Clone, Debug, PartialEq)]
pub enum KnownLight {
    /// A luminaire seen in the photographs.
    Visible { name: String, surfaces: Vec<usize> },
    /// A light of known shape and place outside the photographs.
    Shape {
        name: String,
        emitter: Emitter,
        /// Radiance, radiant intensity or irradiance (see [`Emitter::quantity`]) in the capture's
        /// unit, 0 or more; `None` where it is to be solved for.
        emission: Option<Rgb>,
        /// The ratio of the channels of an unknown emission, 0 or more and not all 0; its scale
        /// means nothing. `None` with a known emission, and where the channels are independent.
        color: Option<Rgb>,
    },
    /// A known sky.
    Dome { name: String, dome: Dome },
}

impl KnownLight {
    pub fn name(&self) -> &str {
        match self {
            Self::Visible { name, .. } | Self::Shape { name, .. } | Self::Dome { name, .. } => name,
        }
    }

    /// The name of such a light in `tags.json`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Visible { .. } => "visible",
            Self::Shape { emitter, .. } => emitter.kind(),
            Self::Dome { .. } => "dome",
        }
    }
}

/// The world beyond the known geometry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Environment {
    Room,
    Open,
    #[default]
    Auto,
}

impl Environment {
    pub const ALL: [Self; 3] = [Self::Auto, Self::Room, Self::Open];

    /// As `tags.json` calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Room => "room",
            Self::Open => "open",
            Self::Auto => "auto",
        }
    }
}

impl Capture {
    /// The material of a triangle, if it has one.
    pub fn material_of(&self, triangle: u32) -> Option<usize> {
        match self.surfaces[self.mesh.surface[triangle as usize] as usize].role {
            Role::Material(material) => Some(material),
            _ => None,
        }
    }

    /// The photographs that are measurements, with their indices.
    pub fn measurements(&self) -> impl Iterator<Item = (usize, &Camera, &Arc<Image>)> {
        self.photographs
            .iter()
            .enumerate()
            .filter_map(|(index, p)| Some((index, &p.camera, p.image.as_ref()?)))
    }
}
