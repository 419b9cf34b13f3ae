//! The ring that turns a dome about the vertical. A dome has no centre that could be moved or
//! rotated about freely.

use glam::{Quat, Vec2, Vec3};

use crate::app::viewport::projection::Projection;
use crate::scene::Dome;

/// The axis that a dome turns about.
pub const UP: usize = 2;
/// Points from the middle to the ring.
const RADIUS: f32 = 64.0;

/// The ring by which a dome is turned, in points on the screen that lie close together; the first
/// is where the middle of its image lies.
pub fn places(projection: &Projection, middle: Vec3, dome: &Dome) -> impl Iterator<Item = Vec2> {
    const PARTS: usize = 96;
    let center = projection.project(middle);
    let aside = projection.project(middle + projection.right);
    let per_metre = center.zip(aside).map_or(1.0, |(center, aside)| aside.distance(center));
    let (towards, radius) = (dome.middle(), RADIUS / per_metre.max(1e-6));
    let place = move |part: usize| {
        let angle = part as f32 / PARTS as f32 * std::f32::consts::TAU;
        projection.project(middle + Quat::from_rotation_z(angle) * towards * radius)
    };
    (0..PARTS).filter_map(place)
}
