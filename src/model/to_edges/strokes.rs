//! Strokes that follow a thing which was moved.

use glam::{DVec2, DVec3};

use crate::model::jet::position;
use crate::model::unknowns::{State, Unknowns};
use crate::model::{Model, Optic, Place, Pose, Stroke, things};

/// The model with the strokes about a thing where its corners, edges and circles are in `after`:
/// marks on what they mark, pieces of edges as far along their edges as they were. Lines that were
/// found to be its edges are gone. What was typed stays. `before` is what the strokes were solved to.
pub fn follow(model: &Model, before: &State, after: &State, thing: usize) -> Model {
    let mut moved = model.clone();
    let [old, new] = [before, after].map(|state| state.corners(model));
    let circles = circles(model, after, thing);
    for (index, stroke) in moved.strokes.iter_mut().enumerate() {
        let camera = stroke.photograph().and_then(|own| after.camera(model, own));
        let Some((pose, lens)) = camera else { continue };
        let shown = |point: DVec3| Some(pose.project(&lens, point)?.pixel);
        match stroke {
            Stroke::Pick { at: Place::Corner { thing: own, corner }, pixel, .. } => {
                if *own == thing
                    && let Some(seen) = shown(new[thing][*corner])
                {
                    *pixel = seen;
                }
            }
            Stroke::Edge { between, from, to, .. } => {
                let corner = |place: &Place| match place {
                    Place::Corner { thing: own, corner } if *own == thing => Some(*corner),
                    _ => None,
                };
                let [Some(a), Some(b)] = between.each_ref().map(corner) else { continue };
                for end in [from, to] {
                    let part = part(&pose, &lens, [old[thing][a], old[thing][b]], *end);
                    let place = part.map(|part| new[thing][a].lerp(new[thing][b], part));
                    if let Some(seen) = place.and_then(shown) {
                        *end = seen;
                    }
                }
            }
            Stroke::Rim { thing: own, top, pixel, .. } if *own == thing => {
                let Some((middles, radius)) = &circles else { continue };
                let angle = DVec2::from_angle(before.angles[index]);
                let place = middles[usize::from(*top)] + *radius * angle.extend(0.0);
                if let Some(seen) = shown(place) {
                    *pixel = seen;
                }
            }
            _ => {}
        }
    }
    moved.forget_found(Some(thing));
    moved
}

fn circles(model: &Model, state: &State, thing: usize) -> Option<([DVec3; 2], f64)> {
    let values = Unknowns::none(model, state).jets(state);
    let (middles, radius) = things::rims(&model.things, thing, &values)?;
    Some((middles.each_ref().map(position), radius.value))
}

/// How far along the line between two points, as a part of it, a pixel's ray comes nearest to it.
fn part(pose: &Pose, lens: &Optic, [a, b]: [DVec3; 2], pixel: DVec2) -> Option<f64> {
    let ray = pose.world_from_camera * lens.ray(pixel)?;
    let (along, from) = (b - a, a - pose.position);
    // Both as seen along the ray.
    let flat = |vector: DVec3| vector - ray * vector.dot(ray);
    let (along, from) = (flat(along), flat(from));
    let square = along.length_squared();
    (square > 1e-18).then(|| -from.dot(along) / square)
}
