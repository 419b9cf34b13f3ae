//! Samples the direction in which a path continues.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::math::rgb::Radiance;
use crate::math::sampling::{Frame, square_to_cosine_hemisphere};
use crate::render::looks::BrdfF32;
use crate::scene::Viewing;

/// A direction in which light may have come, with the reflectance times cosine over its density,
/// and that density; `None` where the lobe points into the surface, or nothing is reflected.
pub fn scatter(brdf: &BrdfF32, viewing: Viewing, square: Vec2) -> Option<(Vec3, Radiance, f32)> {
    let normal = viewing.normal;
    let part = brdf.specular_part(viewing);
    if part == 0.0 {
        // Reflectance times cosine over density is the reflectance.
        let local = square_to_cosine_hemisphere(square);
        let direction = Frame::about(normal).to_world(local);
        let cosine = direction.dot(normal);
        return (cosine > 0.0).then_some((direction, brdf.diffuse, cosine / PI));
    }
    // What the choice between the lobes leaves of the number is even in [0, 1) again.
    let direction = if square.x < part {
        brdf.sample_lobe(viewing, Vec2::new(square.x / part, square.y))
    } else {
        let rest = ((square.x - part) / (1.0 - part)).min(1.0 - f32::EPSILON);
        Frame::about(normal).to_world(square_to_cosine_hemisphere(Vec2::new(rest, square.y)))
    };
    let cosine = direction.dot(normal);
    if cosine <= 0.0 {
        return None;
    }
    let density = brdf.density(viewing, direction, cosine);
    let factor = cosine / density.max(f32::MIN_POSITIVE);
    let weight = brdf.value(viewing, direction).map(|value| value * factor);
    (density > 0.0).then_some((direction, weight, density))
}
