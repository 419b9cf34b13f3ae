//! The residuals of the strokes for a state of cameras and things, with their derivatives.
//!
//! Residuals are in pixels. Picks give two: the coordinates. Lines and edges are compared in the
//! image without distortion, scaled by the focal length: for an edge the distances of the stroke's
//! ends from the projected edge; for a line along an axis, whose place in the world is unknown,
//! √2 times the distance of its ends from the line that joins its middle to the axis' vanishing
//! point, which has the variance of one end. What was measured in metres, and lines that were found
//! in photographs, are divided by their standard deviations: a residual of 1 is one standard
//! deviation, as a pixel of what was drawn is taken to be.

use glam::{DVec2, DVec3};

use super::jet::{Jet, Jet3, position, slopes};
use super::rig::Rig;
use super::strokes::HAND_PX;
use super::unknowns::{State, Unknowns};
use super::view::{Undistorted, flip, turned};
use super::{Model, Place, Stroke, things};

/// What [`Row::stroke`] is where the residual is of no stroke.
pub const NO_STROKE: usize = usize::MAX;

/// One residual.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// Index into `Model::strokes`, or [`NO_STROKE`].
    pub stroke: usize,
    /// Pixels, or standard deviations.
    pub value: f64,
    /// Unknown and derivative by it; an unknown may stand more than once.
    pub slopes: Vec<(usize, f64)>,
    /// It was drawn: an outlier counts for little. Numbers that were typed are believed.
    pub is_drawn: bool,
}

impl Row {
    /// With the residual and its derivatives multiplied.
    pub(super) fn times(mut self, factor: f64) -> Self {
        self.value *= factor;
        self.slopes.iter_mut().for_each(|own| own.1 *= factor);
        self
    }
}

/// The residuals of all strokes whose cameras and things are placed, in the strokes' order, and
/// those of the rig. Strokes
/// whose places lie behind the camera, or beyond what the lens model describes, are the error.
pub fn rows(
    model: &Model,
    rig: &Rig,
    state: &State,
    unknowns: &Unknowns,
) -> Result<Vec<Row>, usize> {
    let values = unknowns.jets(state);
    let is_placed = |index: usize| state.things[index].is_some();
    let corners: Vec<Vec<Jet3>> = (0..model.things.len())
        .map(|index| match is_placed(index) {
            true => things::corners(&model.things, index, &values),
            false => Vec::new(),
        })
        .collect();
    let place = |place: Place| match place {
        Place::Corner { thing, corner } => corners[thing].get(corner).cloned(),
        Place::Point(index) => unknowns.point(state, index),
    };
    let mut all = Vec::new();
    for (index, stroke) in model.strokes.iter().enumerate() {
        if !state.is_placed(stroke) {
            continue;
        }
        let view =
            stroke.photograph().map(|photograph| View { model, state, unknowns, photograph });
        let made = match stroke {
            Stroke::Line { axis, from, to, .. } => {
                view.and_then(|view| view.line(axis.direction(), *from, *to))
            }
            Stroke::Pick { at, pixel, .. } => {
                place(*at).zip(view).and_then(|(point, view)| view.pick(&point, *pixel))
            }
            Stroke::Edge { between: [a, b], from, to, .. } => place(*a)
                .zip(place(*b))
                .zip(view)
                .and_then(|((a, b), view)| view.edge([&a, &b], &[*from, *to])),
            Stroke::Rim { thing, top, pixel, .. } => {
                let angle = match unknowns.angle(index) {
                    Some(column) => Jet::unknown(state.angles[index], column),
                    None => Jet::constant(state.angles[index]),
                };
                let rims = things::rims(&model.things, *thing, &values);
                rims.zip(view).and_then(|((circles, radius), view)| {
                    let (sin, cos) = angle.sin_cos();
                    let [x, y, z] = &circles[usize::from(*top)];
                    let point = [x + &(&radius * &cos), y + &(&radius * &sin), z.clone()];
                    view.pick(&point, *pixel)
                })
            }
            Stroke::Position { at, position, sd_m } => place(*at).map(|point| {
                let row =
                    |k: usize| measured(&(&point[k] - &Jet::constant(position[k])), 1.0 / sd_m);
                (0..3).map(row).collect()
            }),
            Stroke::Length { between: [a, b], length_m, sd_m } => {
                place(*a).zip(place(*b)).map(|(a, b)| {
                    let square = |k: usize| {
                        let side = &a[k] - &b[k];
                        &side * &side
                    };
                    let sum = &(&square(0) + &square(1)) + &square(2);
                    // Where both places are one, the distance has no derivative.
                    let distance = if sum.value > 1e-24 { sum.sqrt() } else { sum };
                    vec![measured(&(&distance - &Jet::constant(*length_m)), 1.0 / sd_m)]
                })
            }
        };
        let made = made.filter(|rows| rows.iter().all(|row: &Row| row.value.is_finite()));
        let own = made.ok_or(index)?.into_iter().map(|row| Row { stroke: index, ..row });
        match stroke.is_found() {
            // As many pixels of a hand are worth as much.
            true => all.extend(own.map(|row| row.times(HAND_PX / stroke.sd()))),
            false => all.extend(own),
        }
    }
    all.extend(rig.rows(model, state, unknowns));
    Ok(all)
}

fn measured(difference: &Jet, weight: f64) -> Row {
    let Jet { value, slopes } = difference * weight;
    Row { value, slopes, ..Row::default() }
}

/// By how much a place in a photograph misses the projected line through two points, in pixels;
/// `None` where the camera is not placed, or does not see that line as one.
pub(super) fn from_edge(
    model: &Model,
    state: &State,
    unknowns: &Unknowns,
    photograph: usize,
    between: [&Jet3; 2],
    place: DVec2,
) -> Option<Row> {
    let rows = View { model, state, unknowns, photograph }.edge(between, &[place])?;
    rows.into_iter().next().filter(|row| row.value.is_finite())
}

/// A placed photograph.
struct View<'a> {
    model: &'a Model,
    state: &'a State,
    unknowns: &'a Unknowns,
    photograph: usize,
}

impl View<'_> {
    fn lens_columns(&self) -> [Option<usize>; 5] {
        self.unknowns.lens(self.model.photographs[self.photograph].lens)
    }

    fn pick(&self, point: &Jet3, pixel: DVec2) -> Option<Vec<Row>> {
        let (pose, lens) = self.state.camera(self.model, self.photograph)?;
        let first = self.unknowns.pose(self.photograph);
        let projected = pose.project(&lens, position(point))?;
        let difference = projected.pixel - pixel;
        let mut rows =
            [0, 1].map(|axis| Row { value: difference[axis], is_drawn: true, ..Row::default() });
        let mut put = |column: usize, by: DVec2| {
            rows[0].slopes.push((column, by.x));
            rows[1].slopes.push((column, by.y));
        };
        for (k, first) in (0..3).filter_map(|k| Some((k, first?))) {
            put(first + k, projected.by_turn[k]);
            put(first + 3 + k, -projected.by_point[k]);
        }
        let [x, y] = [DVec2::X, DVec2::Y];
        let [k1, k2] = projected.by_radial;
        for (column, by) in self.lens_columns().into_iter().zip([projected.by_focal, x, y, k1, k2])
        {
            if let Some(column) = column {
                put(column, by);
            }
        }
        for (column, by) in slopes(point) {
            let [x, y, z] = projected.by_point;
            put(column, x * by.x + y * by.y + z * by.z);
        }
        Some(rows.into())
    }

    fn line(&self, axis: DVec3, from: DVec2, to: DVec2) -> Option<Vec<Row>> {
        let (pose, lens) = self.state.camera(self.model, self.photograph)?;
        let first = self.unknowns.pose(self.photograph);
        let (a, b) = (lens.undistort(from)?, lens.undistort(to)?);
        let direction = flip(pose.world_from_camera.transpose() * axis);
        let (half, middle) = (0.5 * (a.place - b.place), 0.5 * (a.place + b.place));
        // From the middle towards the vanishing point, also where that is infinitely far.
        let toward = direction.truncate() - middle * direction.z;
        let length = toward.length();
        if length < 1e-12 {
            return None;
        }
        let distance = half.perp_dot(toward) / length;
        let scale = std::f64::consts::SQRT_2 * lens.focal_px;
        let by_half = DVec2::new(toward.y, -toward.x) / length;
        let by_toward = DVec2::new(-half.y, half.x) / length - toward * (distance / length.powi(2));
        let mut row = Row { value: scale * distance, is_drawn: true, ..Row::default() };
        let turns = turned(direction).into_iter().enumerate();
        for ((k, turn), first) in turns.filter_map(|own| Some((own, first?))) {
            let by = turn.truncate() - middle * turn.z;
            row.slopes.push((first + k, scale * by_toward.dot(by)));
        }
        for (k, column) in self.lens_columns().into_iter().enumerate() {
            let Some(column) = column else { continue };
            let (da, db) = (a.by_lens[k], b.by_lens[k]);
            let mut by =
                by_half.dot(0.5 * (da - db)) - by_toward.dot(0.5 * (da + db) * direction.z);
            by *= scale;
            if k == 0 {
                by += std::f64::consts::SQRT_2 * distance;
            }
            row.slopes.push((column, by));
        }
        Some(vec![row])
    }

    /// The distances of places in the photograph from the projected line through two points.
    fn edge(&self, [p, q]: [&Jet3; 2], places: &[DVec2]) -> Option<Vec<Row>> {
        let (pose, lens) = self.state.camera(self.model, self.photograph)?;
        let first = self.unknowns.pose(self.photograph);
        let (seen_p, seen_q) =
            (pose.image_from_world(position(p)), pose.image_from_world(position(q)));
        if seen_p.z <= 1e-9 && seen_q.z <= 1e-9 {
            return None;
        }
        // The edge's line in the image: the points u with normal · (u, 1) = 0.
        let normal = seen_p.cross(seen_q);
        let flat = normal.truncate();
        let length = flat.length();
        if length < 1e-12 {
            return None;
        }
        let into = |vector: DVec3| flip(pose.world_from_camera.transpose() * vector);
        // How the normal changes with each unknown but those of the lens.
        let mut changes: Vec<(usize, DVec3)> = Vec::new();
        let (turn_p, turn_q) = (turned(seen_p), turned(seen_q));
        let axes = DVec3::AXES.into_iter().enumerate();
        for ((k, axis), first) in axes.filter_map(|own| Some((own, first?))) {
            changes.push((first + k, turn_p[k].cross(seen_q) + seen_p.cross(turn_q[k])));
            let shift = -into(axis);
            changes.push((first + 3 + k, shift.cross(seen_q) + seen_p.cross(shift)));
        }
        changes.extend(slopes(p).into_iter().map(|(column, by)| (column, into(by).cross(seen_q))));
        changes.extend(slopes(q).into_iter().map(|(column, by)| (column, seen_p.cross(into(by)))));
        let row = |end: DVec2| {
            let Undistorted { place, by_lens } = lens.undistort(end)?;
            let at = place.extend(1.0);
            let distance = normal.dot(at) / length;
            let by_normal = at / length - (flat * (distance / length.powi(2))).extend(0.0);
            let mut slopes: Vec<(usize, f64)> = changes
                .iter()
                .map(|&(column, by)| (column, lens.focal_px * by_normal.dot(by)))
                .collect();
            for (k, column) in self.lens_columns().into_iter().enumerate() {
                let Some(column) = column else { continue };
                let by = lens.focal_px * flat.dot(by_lens[k]) / length;
                slopes.push((column, if k == 0 { by + distance } else { by }));
            }
            Some(Row { value: lens.focal_px * distance, slopes, is_drawn: true, stroke: 0 })
        };
        places.iter().map(|place| row(*place)).collect()
    }
}
