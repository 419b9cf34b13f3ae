//! Changes of the whole world, which photographs alone do not determine: shifts, turns, the scale.

use glam::DVec3;

use super::things::Kind;
use super::unknowns::{Owner, State, Unknowns};

/// A change of the whole world that photographs cannot tell.
#[derive(Clone, Copy)]
pub(super) enum Movement {
    Shift(usize),
    Turn(usize),
    Scale,
}

impl Movement {
    pub const ALL: [Self; 7] = [
        Self::Shift(0),
        Self::Shift(1),
        Self::Shift(2),
        Self::Turn(0),
        Self::Turn(1),
        Self::Turn(2),
        Self::Scale,
    ];

    /// How fast the unknown of column `j` changes with the movement.
    pub fn rate(self, unknowns: &Unknowns, state: &State, j: usize) -> f64 {
        let unknown = unknowns.list[j];
        let velocity = |at: DVec3| match self {
            Self::Shift(k) => DVec3::AXES[k],
            Self::Turn(k) => DVec3::AXES[k].cross(at),
            Self::Scale => at,
        };
        match unknown.owner {
            Owner::Lens(_) => 0.0,
            Owner::Photograph(index) => {
                let Some(pose) = state.poses[index] else { return 0.0 };
                match (self, unknown.part) {
                    (_, 3..) => velocity(pose.position)[unknown.part - 3],
                    (Self::Turn(k), part) => {
                        (pose.world_from_camera.transpose() * DVec3::AXES[k])[part]
                    }
                    _ => 0.0,
                }
            }
            Owner::Point(index) => state.points[index].map_or(0.0, |at| velocity(at)[unknown.part]),
            Owner::Stroke(_) => f64::from(matches!(self, Self::Turn(2))),
            Owner::Found => match (self, unknown.part) {
                (Self::Scale, 0) => 1.0,
                (Self::Turn(k), part @ 1..4) => f64::from(part == k + 1),
                (_, 4..) => velocity(state.found.shift)[unknown.part - 4],
                _ => 0.0,
            },
            Owner::Thing(index) => {
                let Some(values) = &state.things[index] else { return 0.0 };
                let value = values[unknown.part];
                match unknowns.kind(index, unknown.part) {
                    Kind::Ratio => 0.0,
                    Kind::Length => match self {
                        Self::Scale => value,
                        _ => 0.0,
                    },
                    Kind::Yaw => f64::from(matches!(self, Self::Turn(2))),
                    Kind::Coordinate(axis) => {
                        velocity(neighbours(unknowns, values, index, unknown.part))[axis]
                    }
                }
            }
        }
    }

    pub fn problem(self) -> &'static str {
        match self {
            Self::Shift(_) => "where the world's origin lies is open",
            Self::Turn(2) => "how the world is turned about the vertical is open",
            Self::Turn(_) => "which way is up is open",
            Self::Scale => "the scale is open",
        }
    }

    pub fn remedy(self) -> &'static str {
        match self {
            Self::Shift(_) => "Give one corner or point a known position",
            Self::Turn(2) => "Draw lines along x or y, or hold the yaw of a box",
            Self::Turn(_) => "Draw lines along z, or let a thing stand on the floor",
            Self::Scale => "Give a known length",
        }
    }
}

/// The position of which a coordinate is one: its neighbours in the list of parameters are the
/// others.
fn neighbours(unknowns: &Unknowns, values: &[f64], thing: usize, part: usize) -> DVec3 {
    let mut at = DVec3::ZERO;
    let Kind::Coordinate(own) = unknowns.kind(thing, part) else { return at };
    let suffix = unknowns.parameter_name(thing, part)[1..].to_owned();
    at[own] = values[part];
    for (other, value) in values.iter().enumerate() {
        let name = unknowns.parameter_name(thing, other);
        if let Kind::Coordinate(axis) = unknowns.kind(thing, other)
            && name[1..] == suffix
        {
            at[axis] = *value;
        }
    }
    at
}
