//! All positions by one linear system, for cameras of known rotation.
//!
//! Each ray then has a known direction in the world, and the condition that a point lies on it is
//! linear in the position of the camera and of the point. Corners are linear in relaxed parameters
//! of their things: here a box may be any parallelepiped. The constraints from the floor, the tops
//! of things and typed numbers are linear too. The system is homogeneous in the scale. The mean
//! distance of the picked points is set to 1, which also places them in front of the cameras.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use glam::{DMat3, DVec2, DVec3};

use crate::model::{Model, Optic, Place, Shape, Stroke, Support, things};

/// Weight of what was typed against a ray.
const TYPED: f64 = 30.0;
/// Weight of zero for each unknown, where nothing tells it.
const RIDGE: f64 = 1e-6;

/// A position as a sum of unknowns times vectors. Unknown 0 is the scale: 1 in metres.
type Expression = Vec<(usize, DVec3)>;

/// Positions in metres.
#[derive(Clone, Debug, Default)]
pub struct Placed {
    /// By photograph, where it was asked for.
    pub cameras: Vec<Option<DVec3>>,
    /// The corners of things, as far as they are linear; empty of others.
    pub corners: Vec<Vec<Option<DVec3>>>,
    /// By point, where it takes part.
    pub points: Vec<Option<DVec3>>,
    /// Metres in the unit of what an engine found, and its shift.
    pub found: Option<(f64, DVec3)>,
}

/// Places the photographs whose rotations are given, and the things and points that they see.
/// `found` turns what an engine found into the world: those photographs move together. `None` where
/// the system has no finite solution, or typed numbers put the world behind cameras.
pub fn place(
    model: &Model,
    lenses: &[Optic],
    rotations: &[Option<DMat3>],
    seen: &Seen,
    found: &DMat3,
) -> Option<Placed> {
    let system = Relaxed::new(model, rotations, seen, found);
    // A position that is known alone says where the origin lies, and nothing of the scale.
    let shift = only_position(model, seen);
    let mut rows: Vec<(Expression, f64)> = Vec::new();
    let mut depth: Expression = Vec::new();
    let mut count = 0.0;
    let ray = |photograph: usize, pixel: DVec2| {
        let lens = &lenses[model.photographs[photograph].lens];
        Some(rotations[photograph]? * lens.ray(pixel)?)
    };
    for stroke in &model.strokes {
        match stroke {
            Stroke::Pick { photograph, at, pixel } => {
                let Some(direction) = ray(*photograph, *pixel) else { continue };
                let Some(view) = system.view(*photograph, *at) else { continue };
                let first = direction.any_orthonormal_vector();
                for normal in [first, direction.cross(first)] {
                    rows.push((along(&view, normal), 0.0));
                }
                depth.extend(along(&view, direction));
                count += 1.0;
            }
            Stroke::Edge { photograph, between, from, to, .. } => {
                let rays = ray(*photograph, *from).zip(ray(*photograph, *to));
                let Some((a, b)) = rays else { continue };
                let normal = a.cross(b).normalize_or_zero();
                for place in between {
                    if let Some(view) = system.view(*photograph, *place) {
                        rows.push((along(&view, normal), 0.0));
                        depth.extend(along(&view, a));
                        count += 1.0;
                    }
                }
            }
            Stroke::Position { at, position, .. } => {
                let Some(mut place) = system.place(*at) else { continue };
                place.push((0, shift - *position));
                rows.extend(DVec3::AXES.map(|axis| (along(&place, axis * TYPED), 0.0)));
            }
            Stroke::Line { .. } | Stroke::Rim { .. } | Stroke::Length { .. } => {}
        }
    }
    if count == 0.0 {
        return None;
    }
    depth.iter_mut().for_each(|term| term.1 /= count);
    rows.push((depth, 1.0));
    let solution = least_squares(&rows, system.unknowns)?;
    let value = |expression: &Expression, scale: f64| -> DVec3 {
        expression.iter().map(|&(index, vector)| vector * (solution[index] * scale)).sum()
    };
    let scale = match system.found.filter(|_| model.scale_is_found()) {
        Some(first) => (solution[first] > 1e-9).then(|| 1.0 / solution[first])?,
        None => system.scale(model, &solution, &|place| Some(value(&system.place(place)?, 1.0)))?,
    };
    let cameras = system.cameras.iter().map(|own| Some(value(own.as_ref()?, scale) + shift));
    let found =
        system.found.map(|first| (solution[first] * scale, value(&free(first + 1), scale) + shift));
    let corners = |thing: usize| {
        let count = things::corner_names(&model.things[thing]).len();
        let corner =
            |corner| Some(value(&system.place(Place::Corner { thing, corner })?, scale) + shift);
        (0..count).map(corner).collect()
    };
    Some(Placed {
        found,
        cameras: cameras.collect(),
        corners: (0..model.things.len()).map(corners).collect(),
        points: (0..model.points.len())
            .map(|point| Some(value(&system.place(Place::Point(point))?, scale) + shift))
            .collect(),
    })
}

/// The known position where there is one alone, as far as the floor leaves it open; else zero.
fn only_position(model: &Model, seen: &Seen) -> DVec3 {
    let mut known = model.strokes.iter().filter_map(|stroke| match stroke {
        Stroke::Position { position, .. } => Some(*position),
        _ => None,
    });
    let (Some(only), None) = (known.next(), known.next()) else { return DVec3::ZERO };
    let things = model.things.iter().zip(&seen.things);
    let has_floor = things.into_iter().any(|(own, seen)| *seen && own.on != Support::Free);
    if has_floor { only.with_z(0.0) } else { only }
}

/// What takes part.
#[derive(Clone, Debug)]
pub struct Seen {
    /// By photograph.
    pub photographs: Vec<bool>,
    /// By thing.
    pub things: Vec<bool>,
    /// By point.
    pub points: Vec<bool>,
}

/// The relaxed parameters of everything.
struct Relaxed<'a> {
    model: &'a Model,
    unknowns: usize,
    cameras: Vec<Option<Expression>>,
    /// The first of four: the scale and the shift of what an engine found.
    found: Option<usize>,
    outlines: Vec<Option<Outline>>,
    /// The height of a thing above what it stands on: an unknown and its factor.
    heights: Vec<Option<(usize, f64)>>,
    points: Vec<Option<usize>>,
}

/// Corners in plan, or in space for what is free.
enum Outline {
    /// Each coordinate of each corner: unknown and factor.
    Flat(Vec<[(usize, f64); 2]>),
    /// A parallelogram: a corner, then the vectors of width and depth, each by two unknowns.
    Box([Expression; 3]),
    Free(usize),
}

impl<'a> Relaxed<'a> {
    fn new(model: &'a Model, rotations: &[Option<DMat3>], seen: &Seen, turn: &DMat3) -> Self {
        let mut unknowns = 1;
        let mut take = |count: usize| {
            unknowns += count;
            unknowns - count
        };
        let is_in = |index: usize| seen.photographs[index] && rotations[index].is_some();
        let pose = |index: usize| model.photographs[index].found.map(|own| own.pose);
        let count = model.photographs.len();
        let found = (0..count).any(|index| is_in(index) && pose(index).is_some()).then(|| take(4));
        let mut camera = |index: usize| match (pose(index), found) {
            (Some(pose), Some(first)) => {
                let mut place = free(first + 1);
                place.push((first, *turn * pose.position));
                place
            }
            _ => free(take(3)),
        };
        let cameras = (0..count).map(|index| is_in(index).then(|| camera(index))).collect();
        let (mut outlines, mut heights) = (Vec::new(), Vec::new());
        for (index, thing) in model.things.iter().enumerate() {
            let held = |name: &str| thing.held.iter().find(|own| own.0 == name).map(|own| own.1);
            let mut number = |name: &str| match held(name) {
                Some(value) => (0, value),
                None => (take(1), 1.0),
            };
            heights.push(match thing.shape {
                Shape::Polygon { .. } => None,
                _ => Some(number("height")),
            });
            let mut ring = |count: usize| {
                let corner = |i: usize| ["x", "y"].map(|axis| number(&format!("{axis}{}", i + 1)));
                (0..count).map(corner).collect::<Vec<_>>()
            };
            outlines.push(match &thing.shape {
                _ if !seen.things[index] => None,
                Shape::Room { corners, rectilinear: true, .. } => {
                    // x and y come in pairs; the walls' corners combine them.
                    let pairs = ring(corners / 2);
                    let half = corners / 2;
                    let at = |i: usize| [pairs[i.div_ceil(2) % half][0], pairs[i / 2][1]];
                    Some(Outline::Flat((0..*corners).map(at).collect()))
                }
                Shape::Room { corners, .. } | Shape::Prism { corners } => {
                    Some(Outline::Flat(ring(*corners)))
                }
                Shape::Polygon { corners } => match thing.on {
                    Support::Floor | Support::Top(_) => Some(Outline::Flat(ring(*corners))),
                    Support::Free => Some(Outline::Free(take(3 * corners))),
                    Support::Side(_) => None,
                },
                Shape::Box { .. } => Some(Outline::Box(parallelogram(held("yaw"), &mut take))),
                Shape::Cylinder => None,
            });
        }
        let points = seen.points.iter().map(|&seen| seen.then(|| take(3))).collect();
        Self { model, unknowns, cameras, found, outlines, heights, points }
    }

    /// A place; `None` where it takes no part, or is not linear.
    fn place(&self, place: Place) -> Option<Expression> {
        let (thing, corner) = match place {
            Place::Point(index) => return Some(free(self.points[index]?)),
            Place::Corner { thing, corner } => (thing, corner),
        };
        let own = &self.model.things[thing];
        let outline = self.outlines[thing].as_ref()?;
        let (count, mut expression) = match outline {
            Outline::Free(first) => return Some(free(first + 3 * corner)),
            Outline::Flat(ring) => {
                // Openings come after the corners of the room.
                let [x, y] = ring.get(corner % ring.len()).filter(|_| corner < 2 * ring.len())?;
                (ring.len(), vec![(x.0, DVec3::X * x.1), (y.0, DVec3::Y * y.1)])
            }
            Outline::Box([first, width, depth]) => {
                let mut sum = first.clone();
                if [1, 2].contains(&(corner % 4)) {
                    sum.extend(width);
                }
                if [2, 3].contains(&(corner % 4)) {
                    sum.extend(depth);
                }
                (4, sum)
            }
        };
        self.rise(own.on, &mut expression);
        if corner >= count {
            let (height, factor) = self.heights[thing]?;
            expression.push((height, DVec3::Z * factor));
        }
        Some(expression)
    }

    /// Adds the height of what something stands on.
    fn rise(&self, on: Support, expression: &mut Expression) {
        if let Support::Top(host) = on
            && let Some((height, factor)) = self.heights[host]
        {
            expression.push((height, DVec3::Z * factor));
            self.rise(self.model.things[host].on, expression);
        }
    }

    /// A place as seen from a camera: the vector from one to the other.
    fn view(&self, photograph: usize, place: Place) -> Option<Expression> {
        let camera = self.cameras[photograph].as_ref()?;
        let mut view = self.place(place)?;
        view.extend(camera.iter().map(|&(index, vector)| (index, -vector)));
        Some(view)
    }

    /// Metres for the unit of the solution.
    fn scale(
        &self,
        model: &Model,
        solution: &[f64],
        at: &dyn Fn(Place) -> Option<DVec3>,
    ) -> Option<f64> {
        let mut ratios = Vec::new();
        for stroke in &model.strokes {
            if let Stroke::Length { between: [a, b], length_m, .. } = stroke
                && let (Some(a), Some(b)) = (at(*a), at(*b))
                && a.distance(b) > 1e-9
            {
                ratios.push(length_m / a.distance(b));
            }
        }
        if ratios.is_empty() {
            return (solution[0] > 1e-9).then(|| 1.0 / solution[0]);
        }
        ratios.sort_by(f64::total_cmp);
        Some(ratios[ratios.len() / 2])
    }
}

fn parallelogram(yaw: Option<f64>, take: &mut impl FnMut(usize) -> usize) -> [Expression; 3] {
    let mut flat = || {
        let first = take(2);
        vec![(first, DVec3::X), (first + 1, DVec3::Y)]
    };
    let first = flat();
    let Some(yaw) = yaw else { return [first, flat(), flat()] };
    let (sin, cos) = yaw.sin_cos();
    let sides = take(2);
    [first, vec![(sides, DVec3::new(cos, sin, 0.0))], vec![(sides + 1, DVec3::new(-sin, cos, 0.0))]]
}

fn free(first: usize) -> Expression {
    DVec3::AXES.into_iter().enumerate().map(|(k, axis)| (first + k, axis)).collect()
}

/// The component along a vector.
fn along(expression: &Expression, vector: DVec3) -> Expression {
    // The factor stands in x, so that the type serves for both.
    expression.iter().map(|&(index, own)| (index, DVec3::X * own.dot(vector))).collect()
}

fn least_squares(rows: &[(Expression, f64)], unknowns: usize) -> Option<Vec<f64>> {
    let mut normal = Mat::<f64>::zeros(unknowns, unknowns);
    let mut right = Mat::<f64>::zeros(unknowns, 1);
    for (terms, target) in rows {
        for &(i, a) in terms {
            right[(i, 0)] += a.x * target;
            for &(j, b) in terms {
                normal[(i, j)] += a.x * b.x;
            }
        }
    }
    for i in 0..unknowns {
        normal[(i, i)] += RIDGE * RIDGE;
    }
    let solution = normal.llt(Side::Lower).ok()?.solve(&right);
    let values: Vec<f64> = (0..unknowns).map(|i| solution[(i, 0)]).collect();
    values.iter().all(|value| value.is_finite()).then_some(values)
}
