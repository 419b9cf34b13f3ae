//! Parameters of things from the positions of their corners.

use glam::{DVec2, DVec3};

use crate::model::unknowns::State;
use crate::model::{Model, Place, Shape, Side, Stroke, Support, things};

/// Sets the parameters of a thing from its corners in the relaxed form, where it has one, or else
/// from the rays of its picks; typed numbers stay as they were typed. `false` where too little is
/// known of it.
pub fn set(model: &Model, state: &mut State, index: usize, corners: &[Option<DVec3>]) -> bool {
    let thing = &model.things[index];
    let known: Option<Vec<DVec3>> = match &thing.shape {
        Shape::Room { corners: count, .. } => corners[..2 * count].iter().copied().collect(),
        _ => corners.iter().copied().collect(),
    };
    let values = match (&thing.shape, known) {
        (Shape::Cylinder, _) => cylinder(model, state, index),
        (Shape::Polygon { .. }, _) if matches!(thing.on, Support::Side(_)) => {
            in_side(model, state, index)
        }
        (Shape::Room { rectilinear, .. }, Some(known)) => {
            room(model, state, index, &known, *rectilinear)
        }
        (Shape::Box { flush: None }, Some(known)) => Some(free_box(&known)),
        (Shape::Box { flush: Some(side) }, Some(known)) => flush_box(model, state, *side, &known),
        (Shape::Prism { corners: count }, Some(known)) => {
            let mut values: Vec<f64> = known[..*count].iter().flat_map(|c| [c.x, c.y]).collect();
            values.push(known[*count].z - known[0].z);
            Some(values)
        }
        (Shape::Polygon { .. }, Some(known)) if thing.on == Support::Free => {
            Some(free_polygon(&known))
        }
        (Shape::Polygon { .. }, Some(known)) => {
            Some(known.iter().flat_map(|corner| [corner.x, corner.y]).collect())
        }
        (_, None) => None,
    };
    let Some(mut values) = values else { return false };
    for (value, parameter) in values.iter_mut().zip(things::parameters(thing)) {
        if let Some((_, held)) = thing.held.iter().find(|(name, _)| *name == parameter.name) {
            *value = *held;
        }
    }
    state.things[index] = Some(values);
    true
}

fn free_box(corners: &[DVec3]) -> Vec<f64> {
    let (width, depth) = ((corners[1] - corners[0]), (corners[3] - corners[0]));
    let (width, depth) = (width.truncate(), depth.truncate());
    // The nearest right angle; numbered clockwise, depth comes out negative.
    let turned = -depth.perp();
    let along = if turned.dot(width) >= 0.0 { width + turned } else { width };
    let x = if along.length() > 0.0 { along.normalize_or_zero() } else { DVec2::X };
    let middle = corners[0].truncate() + 0.5 * (width + depth);
    let height = corners[4].z - corners[0].z;
    vec![middle.x, middle.y, x.y.atan2(x.x), width.dot(x), depth.dot(x.perp()), height]
}

fn flush_box(model: &Model, state: &State, side: Side, corners: &[DVec3]) -> Option<Vec<f64>> {
    let (from, along) = wall(model, state, side)?;
    let at = |corner: usize| (corners[corner] - from).truncate();
    let start = at(1).dot(along);
    let out = DVec2::new(along.y, -along.x);
    let height = corners[4].z - corners[0].z;
    Some(vec![start, at(0).dot(along) - start, (at(2) - at(1)).dot(out), height])
}

fn room(
    model: &Model,
    state: &State,
    index: usize,
    corners: &[DVec3],
    rectilinear: bool,
) -> Option<Vec<f64>> {
    let Shape::Room { openings, .. } = &model.things[index].shape else { return None };
    let count = corners.len() / 2;
    let mut values: Vec<f64> = if rectilinear {
        // Corner 2k has x and y of its own; see the order in `things`.
        let even = (0..count / 2).map(|k| corners[(2 * k + count - 1) % count].x);
        even.chain((0..count / 2).map(|k| corners[2 * k].y)).collect()
    } else {
        corners[..count].iter().flat_map(|corner| [corner.x, corner.y]).collect()
    };
    values.push(corners[count].z - corners[0].z);
    for (number, opening) in openings.iter().enumerate() {
        let next = (opening.wall + 1) % count;
        let (from, to) = (corners[next], corners[opening.wall]);
        let along = (to - from).truncate().normalize_or_zero();
        let places: Vec<Option<DVec2>> = (0..4)
            .map(|corner| {
                let at = Place::Corner { thing: index, corner: 2 * count + 4 * number + corner };
                seen_in(model, state, at, from, along)
            })
            .collect();
        let mean = |corners: [usize; 2], axis: usize| {
            let known = corners.iter().filter_map(|&corner| places[corner]).map(|p| p[axis]);
            let known: Vec<f64> = known.collect();
            (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
        };
        let (left, right) = (mean([0, 3], 0), mean([1, 2], 0));
        let (bottom, top) = (mean([0, 1], 1), mean([2, 3], 1));
        let (left, bottom) = (left.unwrap_or(0.0), bottom.unwrap_or(0.0));
        let size = |end: Option<f64>, start: f64| end.map_or(1.0, |end| end - start);
        values.extend([left, bottom, size(right, left), size(top, bottom)]);
    }
    Some(values)
}

fn free_polygon(corners: &[DVec3]) -> Vec<f64> {
    let mut values: Vec<f64> = corners[..3].iter().flat_map(|corner| corner.to_array()).collect();
    let (u, v) = (corners[1] - corners[0], corners[2] - corners[0]);
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let determinant = uu * vv - uv * uv;
    for corner in &corners[3..] {
        let own = *corner - corners[0];
        let (a, b) = (own.dot(u), own.dot(v));
        let solved = if determinant > 1e-12 * uu * vv {
            [(a * vv - b * uv) / determinant, (b * uu - a * uv) / determinant]
        } else {
            [0.0; 2]
        };
        values.extend(solved);
    }
    values
}

/// Each corner where its picks' rays meet the side that it lies in.
fn in_side(model: &Model, state: &State, index: usize) -> Option<Vec<f64>> {
    let Support::Side(side) = model.things[index].on else { return None };
    let (from, along) = wall(model, state, side)?;
    let count = things::corner_names(&model.things[index]).len();
    let mut values = Vec::with_capacity(2 * count);
    for corner in 0..count {
        let at = Place::Corner { thing: index, corner };
        values.extend(seen_in(model, state, at, from, along)?.to_array());
    }
    Some(values)
}

/// The left lower corner of a side as it is seen, and the unit direction to the right in plan.
fn wall(model: &Model, state: &State, side: Side) -> Option<(DVec3, DVec2)> {
    state.things[side.thing].as_ref()?;
    let corners = &state.corners(model)[side.thing];
    let count = model.things[side.thing].shape.sides();
    let (mut from, mut to) = (corners[side.index], corners[(side.index + 1) % count]);
    if matches!(model.things[side.thing].shape, Shape::Room { .. }) {
        (from, to) = (to, from);
    }
    Some((from, (to - from).truncate().normalize_or_zero()))
}

/// Metres along and up an upright plane at which a place is seen, in the mean over its picks.
fn seen_in(model: &Model, state: &State, at: Place, from: DVec3, along: DVec2) -> Option<DVec2> {
    let normal = DVec3::new(along.y, -along.x, 0.0);
    let mut found = Vec::new();
    for stroke in &model.strokes {
        let Stroke::Pick { photograph, at: own, pixel } = stroke else { continue };
        if *own != at {
            continue;
        }
        let Some((eye, ray)) = ray(model, state, *photograph, *pixel) else { continue };
        let distance = (from - eye).dot(normal) / ray.dot(normal);
        if distance.is_finite() && distance > 0.0 {
            let place = eye + ray * distance - from;
            found.push(DVec2::new(place.truncate().dot(along), place.z));
        }
    }
    (!found.is_empty()).then(|| found.iter().sum::<DVec2>() / found.len() as f64)
}

fn ray(model: &Model, state: &State, photograph: usize, pixel: DVec2) -> Option<(DVec3, DVec3)> {
    let (pose, lens) = state.camera(model, photograph)?;
    Some((pose.position, pose.world_from_camera * lens.ray(pixel)?))
}

/// The rays of the picks of a cylinder's bottom or top circle.
fn rim_rays(model: &Model, state: &State, index: usize, wanted: bool) -> Vec<(DVec3, DVec3)> {
    let rays = model.strokes.iter().filter_map(|stroke| match stroke {
        Stroke::Rim { photograph, thing, top, pixel } if *thing == index && *top == wanted => {
            ray(model, state, *photograph, *pixel)
        }
        _ => None,
    });
    rays.collect()
}

/// Where a ray is in plan when it is at a height.
fn at_height((eye, ray): (DVec3, DVec3), z: f64) -> Option<DVec2> {
    let distance = (z - eye.z) / ray.z;
    (distance.is_finite() && distance > 0.0).then(|| (eye + ray * distance).truncate())
}

/// A circle through the bottom's picks in the plane that it stands on; the height at which the
/// top's picks are as far from its axis.
fn cylinder(model: &Model, state: &State, index: usize) -> Option<Vec<f64>> {
    let held = |name: &str| model.things[index].held.iter().find(|own| own.0 == name);
    let held = |name: &str| held(name).map(|own| own.1);
    let low = match model.things[index].on {
        Support::Top(host) => *state.corners(model)[host].last().map(|corner| &corner.z)?,
        _ => 0.0,
    };
    let bottom: Vec<DVec2> = rim_rays(model, state, index, false)
        .into_iter()
        .filter_map(|ray| at_height(ray, low))
        .collect();
    let (middle, radius) = circle(&bottom)?;
    let middle = DVec2::new(held("x").unwrap_or(middle.x), held("y").unwrap_or(middle.y));
    let radius = held("radius").unwrap_or(radius);
    let top = rim_rays(model, state, index, true);
    let miss = |height: f64| -> f64 {
        top.iter()
            .map(|&ray| match at_height(ray, low + height) {
                Some(place) => (place.distance(middle) - radius).abs(),
                None => 10.0 * radius,
            })
            .sum()
    };
    // In steps first, since a ray meets the cylinder's surface twice.
    let steps = (1..=400).map(|k| 0.05 * f64::from(k) * radius);
    let best = steps.min_by(|a, b| miss(*a).total_cmp(&miss(*b))).unwrap_or(radius);
    let height = if top.is_empty() { radius } else { best };
    Some(vec![middle.x, middle.y, radius, height])
}

/// The circle with the least squared algebraic distances from three points or more.
fn circle(points: &[DVec2]) -> Option<(DVec2, f64)> {
    if points.len() < 3 {
        return None;
    }
    let mean = points.iter().sum::<DVec2>() / points.len() as f64;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    let mut right = DVec2::ZERO;
    let mut squares = 0.0;
    for point in points {
        let own = *point - mean;
        let square = own.length_squared();
        (xx, xy, yy) = (xx + own.x * own.x, xy + own.x * own.y, yy + own.y * own.y);
        right += 0.5 * square * own;
        squares += square;
    }
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-9 * (xx + yy) * (xx + yy) {
        return None;
    }
    let middle = DVec2::new(right.x * yy - right.y * xy, right.y * xx - right.x * xy) / determinant;
    let radius = (squares / points.len() as f64 + middle.length_squared()).sqrt();
    Some((mean + middle, radius))
}

/// The angle about a cylinder's axis at which each rim was picked.
pub fn set_angles(model: &Model, state: &mut State) {
    let values = state.constants();
    for (index, stroke) in model.strokes.iter().enumerate() {
        let Stroke::Rim { photograph, thing, top, pixel } = stroke else { continue };
        if state.things[*thing].is_none() {
            continue;
        }
        let rims = things::rims(&model.things, *thing, &values);
        let Some((circles, _)) = rims else { continue };
        let [x, y, z] = &circles[usize::from(*top)];
        let ray = ray(model, state, *photograph, *pixel);
        if let Some(place) = ray.and_then(|ray| at_height(ray, z.value)) {
            state.angles[index] = (place.y - y.value).atan2(place.x - x.value);
        }
    }
}
