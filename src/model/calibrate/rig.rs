//! The rotation in the world of the photographs that an engine placed. Since their relative poses
//! are known, strokes on all of them together determine it. One line along an axis in each of two
//! photographs is enough.

use faer::{Mat, Side};
use glam::{DMat3, DQuat, DVec2, DVec3};

use super::lines::Drawn;
use super::vanishing::Line;
use crate::model::unknowns::nearest_rotation;
use crate::model::{Model, Optic, Place, Shape, Stroke, Support, things};

/// Least angle between two planes, or two rays, of which the intersection is believed: its squared
/// sine, of 2°.
const DISTINCT: f64 = 1.2e-3;

/// A direction in the world, and the same as the engine has it: of unit length.
type Pair = (DVec3, DVec3);

/// The rotation from the engine's coordinates to the world that what is drawn tells; what it leaves
/// open is as in the guess.
pub(super) fn rotation(model: &Model, lenses: &[Optic], guess: &DMat3) -> DMat3 {
    let mut pairs = drawn(model, lenses, guess);
    if !pairs.iter().any(|own| own.0 == DVec3::Z) {
        pairs.extend(floor(model, lenses, guess).map(|up| (DVec3::Z, up)));
    }
    pairs.extend(positions(model, lenses));
    combined(&pairs, guess)
}

/// Directions of lines along the axes of the world, and of boxes whose yaw is held.
fn drawn(model: &Model, lenses: &[Optic], guess: &DMat3) -> Vec<Pair> {
    let mut axes: [Vec<Plane>; 3] = Default::default();
    let mut boxes: Vec<(DVec3, Vec<Plane>)> = Vec::new();
    let held = |thing: usize| {
        let own = &model.things[thing];
        let yaw = own.held.iter().find(|own| own.0 == "yaw").map(|own| own.1);
        yaw.filter(|_| matches!(own.shape, Shape::Box { .. }))
    };
    for thing in 0..model.things.len() {
        if let Some(yaw) = held(thing) {
            let x = DVec3::new(yaw.cos(), yaw.sin(), 0.0);
            let own = [x, DVec3::Z.cross(x)].map(|axis| (axis, Vec::new()));
            boxes.extend(own);
        }
    }
    for (index, photograph) in model.photographs.iter().enumerate() {
        let Some(found) = photograph.found else { continue };
        let lens = &lenses[photograph.lens];
        let on = Drawn::on(model, index, lens);
        let planes = |lines: Vec<Line>| {
            let planes = lines.into_iter();
            planes.map(|line| Plane::of(&line, lens, &found.pose.world_from_camera))
        };
        for (all, own) in axes.iter_mut().zip(on.of_world()) {
            all.extend(planes(own));
        }
        let mut list = boxes.iter_mut();
        for thing in (0..model.things.len()).filter(|thing| held(*thing).is_some()) {
            let [x, y, _] = on.of_box(thing);
            for own in [x, y] {
                if let Some((_, all)) = list.next() {
                    all.extend(planes(own));
                }
            }
        }
    }
    let world = DVec3::AXES.into_iter().zip(axes);
    let pair = |(axis, planes): (DVec3, Vec<Plane>)| {
        Some((axis, direction(&planes, guess.transpose() * axis)?))
    };
    world.chain(boxes).filter_map(pair).collect()
}

/// The plane of a line in a photograph and its camera, in the engine's coordinates.
struct Plane {
    /// As long as the line is wide, seen from the camera.
    normal: DVec3,
    /// From its beginning to its end; zero where it may run either way.
    heading: DVec3,
}

impl Plane {
    fn of(line: &Line, lens: &Optic, world_from_camera: &DMat3) -> Self {
        let ray = |at: DVec2| {
            let ray = DVec3::new(at.x, -at.y, -lens.focal_px);
            *world_from_camera * ray.normalize_or(DVec3::NEG_Z)
        };
        let (from, to) = (ray(line.from), ray(line.to));
        let heading = if line.is_directed { to - from } else { DVec3::ZERO };
        Self { normal: from.cross(to), heading }
    }
}

/// The direction that lies in all planes, towards where they head, or else towards `like`.
fn direction(planes: &[Plane], like: DVec3) -> Option<DVec3> {
    let mut moments = Mat::<f64>::zeros(3, 3);
    for plane in planes {
        for i in 0..3 {
            for j in 0..3 {
                moments[(i, j)] += plane.normal[i] * plane.normal[j];
            }
        }
    }
    let eigen = moments.self_adjoint_eigen(Side::Lower).ok()?;
    let value = |k: usize| eigen.S().column_vector()[k];
    if value(2) <= 0.0 || value(1) < DISTINCT * value(2) {
        return None;
    }
    let least = DVec3::new(eigen.U()[(0, 0)], eigen.U()[(1, 0)], eigen.U()[(2, 0)]);
    let vote: f64 = planes.iter().map(|plane| plane.heading.dot(least)).sum();
    let sign = if vote == 0.0 { least.dot(like) } else { vote };
    least.try_normalize().map(|own| own * sign.signum())
}

/// Up, from the outlines on the floor of things whose corners two photographs show.
fn floor(model: &Model, lenses: &[Optic], guess: &DMat3) -> Option<DVec3> {
    let mut up = DVec3::ZERO;
    for (thing, own) in model.things.iter().enumerate().filter(|own| own.1.on == Support::Floor) {
        let count = match own.shape {
            Shape::Room { corners, .. } | Shape::Prism { corners } | Shape::Polygon { corners } => {
                corners
            }
            Shape::Box { .. } => 4,
            Shape::Cylinder => 0,
        };
        let at = |corner| met(model, lenses, Place::Corner { thing, corner });
        let corners: Vec<DVec3> = (0..count).filter_map(at).collect();
        if corners.len() > 2 {
            let normal = things::normal(&corners);
            // The floor is seen from above, however its corners are numbered.
            up += normal * normal.dot(guess.transpose() * DVec3::Z).signum();
        }
    }
    up.try_normalize()
}

/// Directions between places of known position, where there are three.
fn positions(model: &Model, lenses: &[Optic]) -> Vec<Pair> {
    let known = model.strokes.iter().filter_map(|stroke| match stroke {
        Stroke::Position { at, position, .. } => Some((*position, met(model, lenses, *at)?)),
        _ => None,
    });
    let known: Vec<Pair> = known.collect();
    let [first, others @ ..] = &known[..] else { return Vec::new() };
    if others.len() < 2 {
        return Vec::new();
    }
    let pair =
        |own: &Pair| Some(((own.0 - first.0).try_normalize()?, (own.1 - first.1).try_normalize()?));
    others.iter().filter_map(pair).collect()
}

/// Where the rays of the photographs that show a place meet.
fn met(model: &Model, lenses: &[Optic], place: Place) -> Option<DVec3> {
    let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
    let mut rays: Vec<DVec3> = Vec::new();
    for stroke in &model.strokes {
        let Stroke::Pick { photograph, at, pixel } = stroke else { continue };
        let own = &model.photographs[*photograph];
        let (Some(found), true) = (own.found, *at == place) else { continue };
        let ray = found.pose.world_from_camera * lenses[own.lens].ray(*pixel)?;
        let across = DMat3::IDENTITY - DMat3::from_cols(ray * ray.x, ray * ray.y, ray * ray.z);
        matrix += across;
        right += across * found.pose.position;
        rays.push(ray);
    }
    let first = *rays.first()?;
    let is_wide = rays.iter().any(|ray| ray.cross(first).length_squared() > DISTINCT);
    let at = (is_wide && matrix.determinant() > 0.0).then(|| matrix.inverse() * right);
    at.filter(|at| at.is_finite())
}

/// The rotation that takes the second directions of pairs to the first ones.
fn combined(pairs: &[Pair], guess: &DMat3) -> DMat3 {
    let mut sum = DMat3::ZERO;
    let mut add = |(world, found): Pair| {
        sum += DMat3::from_cols(world * found.x, world * found.y, world * found.z);
    };
    for (index, own) in pairs.iter().enumerate() {
        add(*own);
        for other in &pairs[..index] {
            add((other.0.cross(own.0), other.1.cross(own.1)));
        }
    }
    let one = || {
        let (world, found) = pairs.first()?;
        let arc = DQuat::from_rotation_arc((*guess * *found).normalize_or(DVec3::Z), *world);
        Some(DMat3::from_quat(arc) * *guess)
    };
    let distinct = pairs.iter().any(|own| own.1.cross(pairs[0].1).length_squared() > DISTINCT);
    let several = if distinct { nearest_rotation(sum) } else { None };
    several.or_else(one).unwrap_or(*guess)
}
