//! Luminaires of known shape and place outside the photographs, and the light that they send to
//! a surface point past the known geometry.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::math::sampling::{
    Frame, Random, square_to_cosine_hemisphere, square_to_uniform_cone, stratified,
};
use crate::scene::{SurfacePoint, Views};

/// A luminaire of known shape and place. It is no obstacle to other light, and known geometry
/// that lies in it or in front of it shades it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emitter {
    /// A planar quadrilateral that emits the same radiance everywhere and into every direction
    /// on the side of its normal, and nothing on the other side.
    Rectangle {
        /// In order around the edge, either way round. Any simple quadrilateral will do.
        corners: [Vec3; 4],
        /// Unit normal of their plane.
        normal: Vec3,
    },
    /// The same radiance everywhere and into every direction.
    Sphere { center: Vec3, radius_m: f32 },
    /// The same radiant intensity into every direction.
    Point { position: Vec3 },
    /// A radiant intensity that is full within `inner_angle` of the axis and 0 beyond
    /// `outer_angle`. Between them it falls by t² (3 − 2t), where t goes from 0 to 1 linearly in
    /// the cosine of the angle off the axis.
    Spot {
        position: Vec3,
        /// Unit axis, away from the light.
        direction: Vec3,
        /// Radians, 0 to `outer_angle`.
        inner_angle: f32,
        /// Radians, 0 to π.
        outer_angle: f32,
    },
    /// A disc of even radiance, infinitely far away.
    Sun {
        /// The unit direction in which its light travels.
        direction: Vec3,
        /// Radians, 0 to π.
        angular_diameter: f32,
    },
}

/// One direction from which a luminaire's light reaches a surface point.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Unit, away from the surface point.
    pub direction: Vec3,
    /// Where the light leaves the luminaire; `None` for one that is infinitely far away.
    pub target: Option<Vec3>,
    /// The cosine at the surface point, above 0.
    pub cosine: f32,
    /// What the direction stands for, per unit of the luminaire's strength: of a radiance the
    /// inverse of the density by solid angle, in sr; of an intensity 1/d² in 1/m²; of an
    /// irradiance a number.
    pub strength: f32,
}

impl Arrival {
    fn above(
        point: SurfacePoint,
        direction: Vec3,
        target: Option<Vec3>,
        strength: f32,
    ) -> Option<Self> {
        let cosine = direction.dot(point.normal);
        (cosine > 0.0).then_some(Self { direction, target, cosine, strength })
    }

    /// Whether nothing of the known geometry is in the way.
    pub fn is_free(&self, views: &Views, point: SurfacePoint) -> bool {
        match self.target {
            Some(target) => views.is_free(point, target),
            None => !views.caster.occluded(&views.ray(point, self.direction)),
        }
    }
}

impl Emitter {
    /// What the sun measures across, seen from the earth, in radians.
    pub const SUN_DIAMETER: f32 = 0.0093;

    /// Its middle, and the radius of a ball that looks about as large; for a sun, which has no
    /// place, the origin and 0.
    pub fn extent(&self) -> (Vec3, f32) {
        match *self {
            Self::Rectangle { corners, .. } => {
                let middle = corners.iter().sum::<Vec3>() / 4.0;
                let diagonals = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
                (middle, (0.5 * diagonals.length() / PI).sqrt())
            }
            Self::Sphere { center, radius_m } => (center, radius_m),
            Self::Point { position } | Self::Spot { position, .. } => (position, 0.0),
            Self::Sun { .. } => (Vec3::ZERO, 0.0),
        }
    }

    /// Area that it shines from, in m²; of a ball its cross section, 0 without extent.
    pub fn area_m2(&self) -> f32 {
        match self {
            Self::Rectangle { corners, .. } => Quadrilateral::of(corners).areas_m2.iter().sum(),
            Self::Sphere { radius_m, .. } => PI * radius_m * radius_m,
            Self::Point { .. } | Self::Spot { .. } | Self::Sun { .. } => 0.0,
        }
    }

    /// What the artist calls such a light in `tags.json`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Rectangle { .. } => "rectangle",
            Self::Sphere { .. } => "sphere",
            Self::Point { .. } => "point",
            Self::Spot { .. } => "spot",
            Self::Sun { .. } => "sun",
        }
    }

    /// The quantity in which its strength is given: `radiance`, `intensity` (radiant, on the axis
    /// of a spot) or `irradiance` (of a surface that faces a sun).
    pub fn quantity(&self) -> &'static str {
        match self {
            Self::Rectangle { .. } | Self::Sphere { .. } => "radiance",
            Self::Point { .. } | Self::Spot { .. } => "intensity",
            Self::Sun { .. } => "irradiance",
        }
    }

    /// Irradiance of a surface point per unit of the light's radiance (in sr), intensity (in sr/m²)
    /// or irradiance (without unit), with the shadows that the known geometry casts. `side`² shadow
    /// rays are spread over the light, or a single one is cast where it is a point. An estimate
    /// without bias: its expectation is exact whatever the number of rays. Zero where the light is
    /// below the horizon of the surface point.
    ///
    /// Inside a sphere the surface point is surrounded by its light: π where nothing shades it.
    pub fn irradiance(
        &self,
        views: &Views,
        point: SurfacePoint,
        side: usize,
        random: &mut Random,
    ) -> f32 {
        // A single ray where all go the same way.
        let side = if matches!(self, Self::Point { .. } | Self::Spot { .. }) { 1 } else { side };
        mean(side, random, |square| {
            let Some(arrival) = self.arrival(point, views.offset_m, square) else { return 0.0 };
            if arrival.is_free(views, point) { arrival.cosine * arrival.strength } else { 0.0 }
        })
    }

    /// The light that a point of the unit square stands for, above a surface point's horizon. The
    /// mean of its cosine times strength over the square is the irradiance without shadows. Lights
    /// nearer than `least_m` count as that far away, so that one that touches a surface point does
    /// not make it infinitely bright.
    pub fn arrival(&self, point: SurfacePoint, least_m: f32, square: Vec2) -> Option<Arrival> {
        let least = (least_m * least_m).max(f32::MIN_POSITIVE);
        let to = |target: Vec3, strength: f32| {
            let direction = (target - point.position).normalize_or_zero();
            Arrival::above(point, direction, Some(target), strength)
        };
        match self {
            Self::Rectangle { corners, normal } => {
                let (target, area_m2) = Quadrilateral::of(corners).point(square);
                let offset = target - point.position;
                // The distance times the cosine at the light, whose back is dark.
                let facing = -offset.dot(*normal);
                if facing <= 0.0 {
                    return None;
                }
                let reach = offset.length_squared().max(least);
                to(target, area_m2 * facing / reach / reach.sqrt())
            }
            Self::Sphere { center, radius_m } => {
                let axis = center - point.position;
                let (distance_squared, radius_squared) = (axis.length_squared(), radius_m.powi(2));
                if distance_squared <= radius_squared {
                    // Surrounded by light, as far as to where a direction leaves the sphere.
                    let local = square_to_cosine_hemisphere(square);
                    let direction = Frame::about(point.normal).to_world(local);
                    let along = axis.dot(direction);
                    let beyond = along * along + radius_squared - distance_squared;
                    let target = point.position + direction * (along + beyond.max(0.0).sqrt());
                    // As rounded here, so that cosine times strength is π to the last digit.
                    let strength = PI / direction.dot(point.normal);
                    return Arrival::above(point, direction, Some(target), strength);
                }
                let sine_squared = radius_squared / distance_squared;
                // One minus the cosine of the cone that holds the sphere, without cancellation.
                let cap = sine_squared / (1.0 + (1.0 - sine_squared).sqrt());
                let distance = distance_squared.sqrt();
                let local = square_to_uniform_cone(square, cap);
                let off_axis = distance_squared * local.truncate().length_squared();
                // Up to where the ray enters: the far side is hidden by the sphere.
                let half_chord = (radius_squared - off_axis).max(0.0).sqrt();
                let entry = (distance * local.z - half_chord).max(0.0);
                let direction = Frame::about(axis / distance).to_world(local);
                let target = point.position + direction * entry;
                Arrival::above(point, direction, Some(target), 2.0 * PI * cap)
            }
            Self::Point { position } => {
                to(*position, 1.0 / (position - point.position).length_squared().max(least))
            }
            Self::Spot { position, direction, inner_angle, outer_angle } => {
                let offset = point.position - position;
                let cosine = offset.normalize_or_zero().dot(*direction);
                let falloff = falloff(cosine, *inner_angle, *outer_angle);
                if falloff == 0.0 {
                    return None;
                }
                to(*position, falloff / offset.length_squared().max(least))
            }
            Self::Sun { direction, angular_diameter } => {
                // 1 − cos x = 2 sin²(x/2), of half the diameter.
                let cap = 2.0 * (0.25 * angular_diameter).sin().powi(2);
                let frame = Frame::about(-*direction);
                let towards = frame.to_world(square_to_uniform_cone(square, cap));
                // The mean cosine over the disc is 1 − cap/2 on a surface that faces it, whose
                // irradiance is the unit.
                Arrival::above(point, towards, None, 1.0 / (1.0 - 0.5 * cap))
            }
        }
    }

    /// Where a ray from a surface point meets the light's shining side, and the strength with which
    /// [`arrival`](Self::arrival) stands for that direction: its inverse is the density by solid
    /// angle. `None` for lights without extent, and for a sun.
    pub fn met(&self, point: SurfacePoint, direction: Vec3) -> Option<(f32, f32)> {
        match self {
            Self::Rectangle { corners, normal } => {
                let facing = -direction.dot(*normal);
                if facing <= 0.0 {
                    return None;
                }
                let panel = Quadrilateral::of(corners);
                let distance = (point.position - corners[0]).dot(*normal) / facing;
                let half = panel.half_with(point.position + direction * distance, *normal)?;
                (distance > 0.0).then(|| {
                    (distance, 2.0 * panel.areas_m2[half] * facing / (distance * distance))
                })
            }
            Self::Sphere { center, radius_m } => {
                let axis = center - point.position;
                let along = axis.dot(direction);
                let (distance_squared, radius_squared) = (axis.length_squared(), radius_m.powi(2));
                let half_chord_squared = along * along + radius_squared - distance_squared;
                if half_chord_squared < 0.0 {
                    return None;
                }
                let half_chord = half_chord_squared.sqrt();
                if distance_squared <= radius_squared {
                    let cosine = direction.dot(point.normal);
                    return (cosine > 0.0).then(|| (along + half_chord, PI / cosine));
                }
                let sine_squared = radius_squared / distance_squared;
                let cap = sine_squared / (1.0 + (1.0 - sine_squared).sqrt());
                (along > 0.0).then_some((along - half_chord, 2.0 * PI * cap))
            }
            Self::Point { .. } | Self::Spot { .. } | Self::Sun { .. } => None,
        }
    }

    /// Unit direction from a position to the light's middle; +z for a light that is there.
    pub fn direction_from(&self, position: Vec3) -> Vec3 {
        let middle = match self {
            Self::Rectangle { corners, .. } => Quadrilateral::of(corners).middle(),
            Self::Sphere { center, .. } => *center,
            Self::Point { position } | Self::Spot { position, .. } => *position,
            Self::Sun { direction, .. } => return -*direction,
        };
        (middle - position).normalize_or(Vec3::Z)
    }
}

/// The mean of a function over `side`² stratified points of the unit square.
fn mean(side: usize, random: &mut Random, value: impl FnMut(Vec2) -> f32) -> f32 {
    let side = side.max(1);
    let sum: f64 = stratified(side, random).map(value).map(f64::from).sum();
    (sum / (side * side) as f64) as f32
}

/// The part of a spot's intensity that leaves in a direction with that cosine to its axis.
fn falloff(cosine: f32, inner_angle: f32, outer_angle: f32) -> f32 {
    let (full, none) = (inner_angle.cos(), outer_angle.cos());
    if cosine >= full {
        return 1.0;
    }
    if cosine <= none {
        return 0.0;
    }
    let t = (cosine - none) / (full - none);
    t * t * (3.0 - 2.0 * t)
}

/// A quadrilateral, cut into two triangles along the diagonal between its first and third corner.
pub struct Quadrilateral {
    pub corners: [Vec3; 4],
    /// Of the triangle with the second corner and of that with the fourth.
    pub areas_m2: [f32; 2],
}

impl Quadrilateral {
    /// Of corners in order around the edge.
    pub fn of(&[a, b, c, d]: &[Vec3; 4]) -> Self {
        let across = |a: Vec3, b: Vec3, c: Vec3| (b - a).cross(c - a);
        // Where a corner points inwards, only the diagonal from there lies inside: the triangles
        // beside the other one turn opposite ways.
        let [a, b, c, d] =
            if across(a, b, c).dot(across(a, c, d)) < 0.0 { [b, c, d, a] } else { [a, b, c, d] };
        let areas_m2 = [across(a, b, c), across(a, c, d)].map(|across| 0.5 * across.length());
        Self { corners: [a, b, c, d], areas_m2 }
    }

    /// Maps [0, 1]² onto it, half of the square onto each triangle, with the area in m² that the
    /// square stands for there. On a parallelogram the map is affine, which keeps strata whole.
    fn point(&self, square: Vec2) -> (Vec3, f32) {
        let [a, b, c, d] = self.corners;
        if square.x > square.y {
            (a + square.x * (b - a) + square.y * (c - b), 2.0 * self.areas_m2[0])
        } else {
            (a + square.y * (d - a) + square.x * (c - d), 2.0 * self.areas_m2[1])
        }
    }

    /// Which of the triangles holds a point of its plane: 0 or 1.
    fn half_with(&self, point: Vec3, normal: Vec3) -> Option<usize> {
        let [a, b, c, d] = self.corners;
        let holds = |corners: [Vec3; 3]| {
            let side = |i: usize| {
                let (from, to) = (corners[i], corners[(i + 1) % 3]);
                (to - from).cross(point - from).dot(normal)
            };
            let sides = [side(0), side(1), side(2)];
            sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0)
        };
        [[a, b, c], [a, c, d]].into_iter().position(holds)
    }

    /// The centre of its area.
    fn middle(&self) -> Vec3 {
        let [a, b, c, d] = self.corners;
        let [first, second] = self.areas_m2;
        let share = second / (first + second).max(f32::MIN_POSITIVE);
        ((a + b + c) / 3.0).lerp((a + c + d) / 3.0, share)
    }
}
