//! Options of an import.

use std::path::PathBuf;

use glam::{DMat3, DVec3};

use crate::io::mesh::SurfacesBy;

/// What a user may say about the files.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Folders in which the photographs are looked for, besides the source's own.
    pub images: Vec<PathBuf>,
    pub mesh: Option<PathBuf>,
    /// Of the source's coordinates.
    pub unit: Unit,
    /// Of the mesh's, where it is another.
    pub mesh_unit: Option<Unit>,
    /// Multiplies cameras and mesh: for sources without a unit.
    pub scale: f64,
    /// What is up in the source; it is turned so that +z is up.
    pub up: Axis,
    /// What is up in the mesh, where it is another.
    pub mesh_up: Option<Axis>,
    /// Vertices no farther apart than this become one, in metres of the capture.
    pub weld_m: f64,
    /// Largest angle within a planar region, in radians, where surfaces are made of regions.
    pub planar_angle: f64,
    pub surfaces: Surfaces,
    /// The photographs are undistorted already: the lens's distortion is left out.
    pub undistorted: bool,
    /// Undo nerfstudio's `applied_transform` and `applied_scale`.
    pub undo_applied: bool,
    /// Exposure times of series, where EXIF does not say them: a list, or the name of a table
    /// (see [`crate::io::grouping::read_times`]).
    pub times: Option<String>,
}

/// What the surfaces of the capture are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Surfaces {
    /// Materials, or else groups or objects, or else planar regions.
    #[default]
    Auto,
    Materials,
    Groups,
    Objects,
    /// Connected planar regions, even where the mesh names its own.
    Regions,
}

impl Surfaces {
    pub const NAMES: [(&'static str, Self); 5] = [
        ("auto", Self::Auto),
        ("materials", Self::Materials),
        ("groups", Self::Groups),
        ("objects", Self::Objects),
        ("regions", Self::Regions),
    ];

    pub fn of(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(own, _)| *own == name).map(|(_, surfaces)| *surfaces)
    }

    pub(super) fn by(self) -> SurfacesBy {
        match self {
            Self::Auto | Self::Materials | Self::Regions => SurfacesBy::Materials,
            Self::Groups => SurfacesBy::Groups,
            Self::Objects => SurfacesBy::Objects,
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            images: Vec::new(),
            mesh: None,
            unit: Unit(1.0),
            mesh_unit: None,
            scale: 1.0,
            up: Axis::Z,
            mesh_up: None,
            weld_m: 0.0,
            planar_angle: 15_f64.to_radians(),
            surfaces: Surfaces::default(),
            undistorted: false,
            undo_applied: false,
            times: None,
        }
    }
}

/// Metres in a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit(pub f64);

impl Unit {
    pub const NAMES: [(&'static str, f64); 6] =
        [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("km", 1000.0), ("in", 0.0254), ("ft", 0.3048)];

    pub fn of(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(own, _)| *own == name).map(|(_, metres)| Self(*metres))
    }
}

/// A direction along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    X,
    Y,
    Z,
    MinusX,
    MinusY,
    MinusZ,
}

impl Axis {
    pub const NAMES: [(&'static str, Self); 6] = [
        ("x", Self::X),
        ("y", Self::Y),
        ("z", Self::Z),
        ("-x", Self::MinusX),
        ("-y", Self::MinusY),
        ("-z", Self::MinusZ),
    ];

    pub fn of(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(own, _)| *own == name).map(|(_, axis)| *axis)
    }

    /// The rotation that turns this direction to +z: a quarter turn about an axis, or half a one.
    pub(super) fn to_z(self) -> DMat3 {
        let columns = |x: DVec3, y: DVec3, z: DVec3| DMat3::from_cols(x, y, z);
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        match self {
            Self::Z => DMat3::IDENTITY,
            Self::Y => columns(x, z, -y),
            Self::MinusY => columns(x, -z, y),
            Self::X => columns(z, y, -x),
            Self::MinusX => columns(-z, y, x),
            Self::MinusZ => columns(x, -y, -z),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_is_turned_up() {
        let ups = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z];
        for ((_, axis), up) in Axis::NAMES.iter().zip(ups) {
            assert_eq!(axis.to_z() * up, DVec3::Z, "{axis:?}");
            assert_eq!(axis.to_z().determinant(), 1.0, "{axis:?}");
        }
    }
}
