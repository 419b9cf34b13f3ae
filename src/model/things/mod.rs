//! Things: the parametric shapes that a person models over photographs.
//!
//! The corners of a thing follow from a few parameters, so that its constraints hold exactly: walls
//! and edges are vertical, a box has right angles and stands on the floor or on another thing, a
//! poster lies in its wall. The floor is the plane z = 0; z is up.

mod faces;
mod outline;
mod shape;

pub(super) use faces::normal;
pub use faces::{Face, faces};
pub use outline::{edges, face_names};
pub use shape::{Kind, Parameter, corner_names, corners, parameters, rims};

/// Something with corners and faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Thing {
    /// Its name in strokes and surfaces: not empty, without a full stop, different from others.
    pub id: String,
    /// What it is.
    pub shape: Shape,
    /// What it stands on or lies in.
    pub on: Support,
    /// Parameters that were typed, by name ([`parameters`]): metres, radians. They are held.
    pub held: Vec<(String, f64)>,
    /// What its faces are called.
    pub surfaces: Surfaces,
}

/// The shape of a thing.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the variants say what their fields are")]
pub enum Shape {
    /// Floor, walls and ceiling of a room, seen from inside. It stands on the floor.
    Room {
        /// Corners of the floor, 3 or more; even and 4 or more where `rectilinear`.
        corners: usize,
        /// Walls run along x and y in turn, the first from `floor1` to `floor2` along x.
        rectilinear: bool,
        openings: Vec<Opening>,
    },
    /// A rectangular box, upright.
    Box {
        /// Side 1, from `bottom1` to `bottom2`, lies in this side of another thing.
        flush: Option<Side>,
    },
    /// An upright prism over a polygon of 3 or more corners.
    Prism { corners: usize },
    /// An upright cylinder.
    Cylinder,
    /// A flat polygon of 3 or more corners.
    Polygon { corners: usize },
}

/// A rectangular hole in the wall of a room: a window or a door.
#[derive(Clone, Debug, PartialEq)]
pub struct Opening {
    /// Its name within the room, without a full stop.
    pub id: String,
    /// The wall, from 0.
    pub wall: usize,
}

/// An upright side of a thing: of a room wall `index` (from 0), between its floor's corners
/// `index` and `index + 1`; of a box or prism the same of its bottom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// Index into `Model::things`.
    pub thing: usize,
    /// Counted from 0.
    pub index: usize,
}

/// What a thing stands on or lies in. Things are listed before those that they carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Support {
    /// The plane z = 0.
    Floor,
    /// The top of a box, prism or cylinder, by its index.
    Top(usize),
    /// A wall or side: for polygons only.
    Side(Side),
    /// Nothing: for polygons only, which then lie in a plane of their own.
    Free,
}

/// The surfaces that a thing's faces belong to, each a stable id that can be tagged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surfaces {
    /// The surface of all faces that are not named below; `None` gives each face its own,
    /// `thing.face`.
    pub all: Option<String>,
    /// Faces by name, with their surface; `None` leaves the face out of the mesh.
    pub named: Vec<(String, Option<String>)>,
}

impl Surfaces {
    /// The surface of a face; `None` where the face is left out.
    pub fn of(&self, thing: &str, face: &str) -> Option<String> {
        match self.named.iter().find(|(name, _)| name == face) {
            Some((_, surface)) => surface.clone(),
            None => Some(self.all.clone().unwrap_or_else(|| format!("{thing}.{face}"))),
        }
    }
}

impl Shape {
    /// What the shape is called in files and messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Room { .. } => "room",
            Self::Box { .. } => "box",
            Self::Prism { .. } => "prism",
            Self::Cylinder => "cylinder",
            Self::Polygon { .. } => "polygon",
        }
    }

    /// The number of upright sides that others can lie in.
    pub fn sides(&self) -> usize {
        match self {
            Self::Room { corners, .. } | Self::Prism { corners } => *corners,
            Self::Box { .. } => 4,
            Self::Cylinder | Self::Polygon { .. } => 0,
        }
    }

    /// Whether something can stand on it.
    pub fn has_top(&self) -> bool {
        matches!(self, Self::Box { .. } | Self::Prism { .. } | Self::Cylinder)
    }
}
