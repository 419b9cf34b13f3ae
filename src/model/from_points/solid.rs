//! An upright box around points on its faces.

use glam::{DVec2, DVec3};

use super::plane::{self, Plane, dense, ends, median, rectangle};

/// As many planes are looked for.
const MOST_PLANES: usize = 6;
/// A plane has this part of the points, and at least so many.
const LEAST_PART: f64 = 0.05;
const LEAST: usize = 10;
/// The sine of the angle by which planes may be off from right angles at first: 12°.
const OFF_RIGHT: f64 = 0.21;
/// The cosine of the angle by which up may be wrong where it is guessed: 40°.
const ABOUT_UP: f64 = 0.77;
/// Rounds in which points are given to faces, and faces fitted to points.
const ROUNDS: usize = 5;

/// A box, by its corners as [`corner_names`](crate::model::things::corner_names) has them.
#[derive(Debug)]
pub struct Solid {
    pub corners: Vec<DVec3>,
    /// The points that lie on it, by index.
    pub on: Vec<usize>,
    /// How far they are from its faces: root mean square.
    pub off: f64,
}

/// What is known before.
pub struct Known<'a> {
    /// Up, exactly or about.
    pub up: DVec3,
    pub is_up_told: bool,
    /// Where the camera stands.
    pub eye: DVec3,
    /// How far points may be from the faces that they lie on.
    pub reach: f64,
    /// The height of what stands below a place, where that is known; the second is the height above
    /// which all that is seen lies.
    pub floor: &'a dyn Fn(DVec2, f64) -> Option<f64>,
}

/// Why points show no box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoBox {
    /// No two faces, or not at right angles.
    Shapeless,
    /// One face alone.
    Flat,
    /// Nothing tells where it ends below.
    Bottomless,
}

/// A plane with the points on it.
type Found = (Plane, Vec<usize>);

/// A face that is seen: how far along its axis it lies, and its points.
#[derive(Clone, Debug)]
struct Face {
    at: f64,
    on: Vec<usize>,
}

/// The box while it is fitted: its axes, of which the last is up, and the face of each that is
/// seen. `base` is the height of what it stands on, where points show that.
struct Fit<'a> {
    points: &'a [DVec3],
    known: &'a Known<'a>,
    axes: [DVec3; 3],
    faces: [Option<Face>; 3],
    base: Option<f64>,
}

/// The box that points lie on, or why there is none.
pub fn solid(points: &[DVec3], known: &Known) -> Result<Solid, NoBox> {
    let planes = planes(points, known.reach);
    let mut fit = Fit::start(points, known, &planes).ok_or(NoBox::Shapeless)?;
    for _ in 0..ROUNDS {
        fit.turn();
        let bounds = fit.bounds()?;
        fit.gather(&bounds);
    }
    let [low, high] = fit.bounds()?;
    if (high - low).min_element() <= known.reach {
        return Err(NoBox::Flat);
    }
    let ring = |z: f64| {
        let around = [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)];
        around.map(|(x, y)| x * fit.axes[0] + y * fit.axes[1] + z * fit.axes[2])
    };
    let faces = fit.faces.iter().enumerate();
    let faces = faces.filter_map(|(axis, own)| Some((axis, own.as_ref()?)));
    let off: Vec<f64> = faces
        .clone()
        .flat_map(|(axis, own)| own.on.iter().map(move |&index| (axis, own.at, index)))
        .map(|(axis, at, index)| (fit.along(axis, index) - at).powi(2))
        .collect();
    Ok(Solid {
        corners: [ring(low.z), ring(high.z)].concat(),
        on: faces.flat_map(|(_, own)| own.on.iter().copied()).collect(),
        off: (off.iter().sum::<f64>() / off.len().max(1) as f64).sqrt(),
    })
}

/// Planes that many points lie on, those of most points first.
fn planes(points: &[DVec3], reach: f64) -> Vec<Found> {
    let least = LEAST.max((LEAST_PART * points.len() as f64) as usize);
    let mut rest: Vec<usize> = (0..points.len()).collect();
    let mut planes: Vec<Found> = Vec::new();
    while planes.len() < MOST_PLANES {
        let own: Vec<DVec3> = rest.iter().map(|&index| points[index]).collect();
        let Some((plane, on)) = plane::most(&own, reach).filter(|own| own.1.len() >= least) else {
            break;
        };
        planes.push((plane, on.iter().map(|&own| rest[own]).collect()));
        rest.retain(|&index| plane.distance(points[index]).abs() >= reach);
    }
    planes.sort_by_key(|own| std::cmp::Reverse(own.1.len()));
    planes
}

/// Up, by the planes: the normal of one that is about level, or at right angles to the normals of
/// two that are about upright.
fn upwards(planes: &[Found], guess: DVec3) -> DVec3 {
    let normals: Vec<DVec3> = planes.iter().map(|own| own.0.normal).collect();
    let pairs = normals.iter().enumerate().flat_map(|(index, a)| {
        let others = normals[index + 1..].iter().filter(|b| a.dot(**b).abs() < OFF_RIGHT);
        others.map(|b| a.cross(*b).normalize_or_zero())
    });
    let all = normals.iter().copied().chain(pairs);
    let up = all.map(|own| own * own.dot(guess).signum()).find(|own| own.dot(guess) > ABOUT_UP);
    up.unwrap_or(guess)
}

impl<'a> Fit<'a> {
    fn start(points: &'a [DVec3], known: &'a Known, planes: &[Found]) -> Option<Self> {
        let up = match known.is_up_told {
            true => known.up,
            false => upwards(planes, known.up),
        };
        let level = |own: &&Found| own.0.normal.cross(up).length() < OFF_RIGHT;
        let level: Vec<&Found> = planes.iter().filter(level).collect();
        let upright = |own: &&Found| own.0.normal.dot(up).abs() < OFF_RIGHT;
        let upright: Vec<&Found> = planes.iter().filter(upright).collect();
        let x = match (upright.first(), level.first()) {
            (Some((plane, _)), _) => plane.normal.reject_from(up).try_normalize()?,
            (None, Some((_, on))) => by_outline(points, on, up)?,
            (None, None) => return None,
        };
        let axes = [x, up.cross(x), up];
        let mut fit = Self { points, known, axes, faces: Default::default(), base: None };
        for (axis, way) in axes.into_iter().enumerate().take(2) {
            let across = |own: &&&Found| own.0.normal.cross(way).length() < 2.0 * OFF_RIGHT;
            fit.faces[axis] = upright.iter().find(across).map(|own| fit.face(axis, &own.1));
        }
        // What is level above the middle of the sides is the top; below, what the box stands on.
        // Without sides, the top is the highest.
        let sides = fit.faces.iter().flatten();
        let heights = sides.flat_map(|own| &own.on).map(|&index| fit.along(2, index)).collect();
        let levels = level.iter().map(|own| fit.face(2, &own.1));
        let levels: Vec<Face> = levels.filter(|own| own.at < known.eye.dot(up)).collect();
        let middle = match upright.is_empty() {
            false => median(heights),
            true => levels.iter().map(|own| own.at).fold(f64::NEG_INFINITY, f64::max) - known.reach,
        };
        fit.base = levels.iter().find(|own| own.at <= middle).map(|own| own.at);
        fit.faces[2] = levels.into_iter().find(|own| own.at > middle);
        Some(fit)
    }

    /// How far along an axis a point lies.
    fn along(&self, axis: usize, point: usize) -> f64 {
        self.points[point].dot(self.axes[axis])
    }

    fn face(&self, axis: usize, on: &[usize]) -> Face {
        let at = median(on.iter().map(|&index| self.along(axis, index)).collect());
        Face { at, on: on.to_vec() }
    }

    /// Turns the box about the vertical, to where the points of its sides are least far from them.
    fn turn(&mut self) {
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for axis in 0..2 {
            let Some(face) = &self.faces[axis] else { continue };
            let places: Vec<DVec2> = face
                .on
                .iter()
                .map(|&index| DVec2::new(self.along(0, index), self.along(1, index)))
                // Those of the second side as if they lay on the first.
                .map(|own| if axis == 0 { own } else { -own.perp() })
                .collect();
            let middle = places.iter().sum::<DVec2>() / places.len().max(1) as f64;
            for own in &places {
                let from = *own - middle;
                xx += from.x * from.x;
                xy += from.x * from.y;
                yy += from.y * from.y;
            }
        }
        if yy <= 0.0 {
            return;
        }
        // Along the sides the points are spread most.
        let most = DVec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy));
        let normal = -most.perp();
        let normal = normal * normal.x.signum();
        let [x, y, up] = self.axes;
        let x = (normal.x * x + normal.y * y).normalize_or(x);
        self.axes = [x, up.cross(x), up];
        for axis in 0..3 {
            let moved = self.faces[axis].as_ref().map(|own| self.face(axis, &own.on));
            self.faces[axis] = moved;
        }
    }

    /// From where to where the box goes along its axes: to the faces that are seen, and else as far as
    /// the points of the others.
    fn bounds(&self) -> Result<[DVec3; 2], NoBox> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for axis in 0..3 {
            let Some(face) = &self.faces[axis] else { continue };
            let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
            let at =
                |&index: &usize| DVec2::new(self.along(first, index), self.along(second, index));
            let flat: Vec<DVec2> = face.on.iter().map(at).collect();
            let flat: Vec<DVec2> = dense(&flat).into_iter().map(|index| flat[index]).collect();
            let across = [
                (first, flat.iter().map(|own| own.x).collect()),
                (second, flat.iter().map(|own| own.y).collect()),
            ];
            for (axis, values) in across.into_iter().filter(|_| !flat.is_empty()) {
                let [from, to] = ends(values);
                low[axis] = low[axis].min(from);
                high[axis] = high[axis].max(to);
            }
        }
        for axis in 0..3 {
            let Some(face) = &self.faces[axis] else { continue };
            // A side that is seen looks towards the camera.
            let is_high = axis == 2 || self.known.eye.dot(self.axes[axis]) > face.at;
            if is_high {
                high[axis] = face.at;
            } else {
                low[axis] = face.at;
            }
        }
        let middle = 0.5 * (low + high);
        let below = middle.x * self.axes[0] + middle.y * self.axes[1];
        let has_sides = self.faces[..2].iter().any(Option::is_some);
        let lowest = if has_sides { low.z } else { high.z };
        let floor = (self.known.floor)(below.truncate(), lowest).or(self.base);
        match (floor, has_sides) {
            (Some(floor), _) => low.z = floor,
            (None, true) => {}
            (None, false) => return Err(NoBox::Bottomless),
        }
        // One side alone has no depth.
        (low.is_finite() && high.is_finite()).then_some([low, high]).ok_or(NoBox::Flat)
    }

    /// Gives each point to the face that it is nearest to.
    fn gather(&mut self, [low, high]: &[DVec3; 2]) {
        let reach = self.known.reach;
        let mut on: [Vec<usize>; 3] = Default::default();
        for index in 0..self.points.len() {
            let place = DVec3::from_array([0, 1, 2].map(|axis| self.along(axis, index)));
            let is_beside = place.cmpge(*low - reach).all() && place.cmple(*high + reach).all();
            let off = |axis: usize| Some((place[axis] - self.faces[axis].as_ref()?.at).abs());
            let near = (0..3).filter_map(|axis| Some((axis, off(axis)?)));
            let near = near.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|own| own.1 < reach);
            // What it stands on is not a part of it.
            let is_base = place.z < low.z + reach && near.is_none_or(|own| own.0 == 2);
            if let Some((axis, _)) = near.filter(|_| is_beside && !is_base) {
                on[axis].push(index);
            }
        }
        for (axis, on) in on.into_iter().enumerate() {
            if !on.is_empty() && self.faces[axis].is_some() {
                self.faces[axis] = Some(self.face(axis, &on));
            }
        }
    }
}

/// A level direction along the outline of a level face.
fn by_outline(points: &[DVec3], on: &[usize], up: DVec3) -> Option<DVec3> {
    let x = up.any_orthonormal_vector();
    let y = up.cross(x);
    let flat = |&index: &usize| DVec2::new(points[index].dot(x), points[index].dot(y));
    let flat: Vec<DVec2> = on.iter().map(flat).collect();
    let flat: Vec<DVec2> = dense(&flat).into_iter().map(|index| flat[index]).collect();
    let axis = rectangle(&flat)?.axis;
    Some(axis.x * x + axis.y * y)
}
