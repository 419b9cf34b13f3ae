//! The visible outline of a thing in a photograph: points on its edges that no face hides.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::geometry::bvh::{Ray, RayCaster};
use crate::model::jet::{Jet, Jet3, position};
use crate::model::unknowns::{State, Unknowns};
use crate::model::{Model, Optic, Pose, things};

/// Between places along an edge, in pixels, and most of them on one.
const APART_PX: f64 = 4.0;
const MOST: f64 = 400.0;
/// Places on an edge of which an end lies behind the camera, and on a circle.
const UNCLEAR: usize = 100;
const AROUND: usize = 96;
/// What lies nearer before a place, as a part of the distance, is the thing's own face.
const OWN_SURFACE: f64 = 4e-3;

/// A straight part of an outline, or the tangent of a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// Between two corners of the thing.
    Edge([usize; 2]),
    /// Touches a cylinder's bottom or top circle at an angle.
    Rim { top: bool, angle: f64 },
    /// Upright on a cylinder's side, at an angle.
    Upright { angle: f64 },
}

/// A place on the outline that a photograph shows.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Index into `Model::photographs`.
    pub photograph: usize,
    /// Where on the thing.
    pub part: Part,
    /// In the photograph.
    pub pixel: DVec2,
    /// Of the outline there, a unit vector.
    pub direction: DVec2,
}

/// A thing's corners and circles with derivatives.
pub struct Solid {
    corners: Vec<Jet3>,
    circles: Option<([Jet3; 2], Jet)>,
}

impl Solid {
    /// As it is in a state.
    pub fn new(model: &Model, state: &State, unknowns: &Unknowns, thing: usize) -> Self {
        let values = unknowns.jets(state);
        Self {
            corners: things::corners(&model.things, thing, &values),
            circles: things::rims(&model.things, thing, &values),
        }
    }

    /// Points whose places tell all numbers of the thing.
    pub fn points(&self) -> Vec<Jet3> {
        let angles = [0.0, 0.25, 0.5, 0.75].map(|part| TAU * part);
        let uprights = angles.iter().filter_map(|&angle| self.ends(Part::Upright { angle }));
        self.corners.iter().cloned().chain(uprights.flatten()).collect()
    }

    /// Two points that a part runs through; a tangent touches the circle in their middle.
    pub fn ends(&self, part: Part) -> Option<[Jet3; 2]> {
        let on_circle = |top: bool, angle: f64| -> Option<Jet3> {
            let (circles, radius) = self.circles.as_ref()?;
            let [x, y, z] = &circles[usize::from(top)];
            Some([x + &(radius * angle.cos()), y + &(radius * angle.sin()), z.clone()])
        };
        match part {
            Part::Edge([a, b]) => {
                Some([self.corners.get(a)?.clone(), self.corners.get(b)?.clone()])
            }
            Part::Upright { angle } => Some([on_circle(false, angle)?, on_circle(true, angle)?]),
            Part::Rim { top, angle } => {
                let [x, y, z] = on_circle(top, angle)?;
                let radius = &self.circles.as_ref()?.1;
                let (along_x, along_y) = (radius * -angle.sin(), radius * angle.cos());
                let end = |half: f64| {
                    let half = half * std::f64::consts::PI / AROUND as f64;
                    [&x + &(&along_x * half), &y + &(&along_y * half), z.clone()]
                };
                Some([end(-1.0), end(1.0)])
            }
        }
    }

    /// The parts that a camera may see.
    fn parts(&self, model: &Model, thing: usize, camera: DVec3) -> Vec<Part> {
        let mut parts: Vec<Part> =
            things::edges(&model.things[thing]).into_iter().map(Part::Edge).collect();
        if let Some((circles, radius)) = &self.circles {
            for top in [false, true] {
                let angle = |k: usize| k as f64 * TAU / AROUND as f64;
                parts.extend((0..AROUND).map(|k| Part::Rim { top, angle: angle(k) }));
            }
            let away = camera.truncate() - position(&circles[0]).truncate();
            let opening = (radius.value / away.length()).acos();
            if opening.is_finite() {
                let middle = away.to_angle();
                parts.extend([-1.0, 1.0].map(|s| Part::Upright { angle: middle + s * opening }));
            }
        }
        parts
    }
}

/// The places of a thing's outline that photographs show and `caster` does not hide.
pub fn places(
    model: &Model,
    state: &State,
    thing: usize,
    caster: Option<&RayCaster>,
) -> Vec<Place> {
    let solid = Solid::new(model, state, &Unknowns::none(model, state), thing);
    let mut list = Vec::new();
    for (photograph, own) in model.photographs.iter().enumerate() {
        let Some((pose, lens)) = state.camera(model, photograph) else { continue };
        let size = DVec2::new(own.size.0 as f64, own.size.1 as f64);
        for part in solid.parts(model, thing, pose.position) {
            let Some(ends) = solid.ends(part) else { continue };
            let ends = ends.each_ref().map(position);
            for (place, [before, after]) in along(&pose, &lens, part, ends) {
                let project = |point| Some(pose.project(&lens, point)?.pixel);
                let Some(pixel) = project(place) else { continue };
                let is_inside = pixel.cmpge(DVec2::ZERO).all() && pixel.cmple(size).all();
                if !is_inside || is_hidden(caster, pose.position, place) {
                    continue;
                }
                let (Some(a), Some(b)) = (project(before), project(after)) else { continue };
                let Some(direction) = (b - a).try_normalize() else { continue };
                list.push(Place { photograph, part, pixel, direction });
            }
        }
    }
    list
}

/// Places along a part, each with one before and one behind it.
fn along(
    pose: &Pose,
    lens: &Optic,
    part: Part,
    [a, b]: [DVec3; 2],
) -> impl Iterator<Item = (DVec3, [DVec3; 2])> {
    let ends = [a, b].map(|end| pose.project(lens, end));
    let count = match (part, ends) {
        (Part::Rim { .. }, _) => 1,
        (_, [Some(a), Some(b)]) => (a.pixel.distance(b.pixel) / APART_PX).clamp(1.0, MOST) as usize,
        _ => UNCLEAR,
    };
    let at = move |place: f64| a.lerp(b, place / count as f64);
    (0..count).map(move |k| {
        let k = k as f64;
        (at(k + 0.5), [at(k + 0.25), at(k + 0.75)])
    })
}

fn is_hidden(caster: Option<&RayCaster>, camera: DVec3, place: DVec3) -> bool {
    let way = place - camera;
    let distance = way.length();
    caster.is_some_and(|caster| {
        caster.occluded(&Ray {
            origin: camera.as_vec3(),
            direction: way.normalize_or_zero().as_vec3(),
            t_min: 0.0,
            t_max: ((1.0 - OWN_SURFACE) * distance) as f32,
        })
    })
}
