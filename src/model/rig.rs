//! The photographs that an engine placed, as one rig that strokes place in the world.
//!
//! An engine has adjusted these cameras to thousands of points, so their relative poses are more
//! certain than a stroke. What its points tell of them is one term of the adjustment
//! (`tracks.rs`); where the points' pixels are not known, each camera is held near its pose in the
//! rig by residuals in pixels. The [`Similarity`](super::Similarity) from the rig to the world,
//! which the engine cannot determine, is unknown. Those of its numbers that no stroke determines
//! keep their guessed values, and a note says so.

use glam::{DMat3, DQuat, DVec3};

use super::residuals::{NO_STROKE, Row};
use super::tracks::{self, Number};
use super::unknowns::{State, Unknowns};
use super::{Lens, Model, Optic, Pose, determined};

/// How far an engine's cameras are believed, in pixels of the photograph, where its points are not
/// known.
const FOUND_PX: f64 = 0.25;
/// How far an engine's lens is believed where its points tell no more: the focal length as a part of
/// itself, and k1. Engines that adjust lenses by four photographs were off by 1 to 5 % (the castle of
/// OpenMVS), so that these hold only what nothing else does.
const FOCAL: f64 = 0.05;
const RADIAL: f64 = 0.05;

/// What an engine tells about its cameras, in its own coordinates.
#[derive(Clone, Debug, Default)]
pub struct Rig {
    /// By photograph: about which pose the residuals are made.
    poses: Vec<Option<Pose>>,
    lenses: Vec<Optic>,
    term: Option<tracks::Term>,
}

impl Rig {
    /// About the poses of the engine and the lenses of a state in which photographs are placed.
    /// `loss_px` is c of the robust loss of points.
    pub fn of(model: &Model, state: &State, loss_px: f64) -> Self {
        let placed = model.photographs.iter().zip(&state.poses);
        let poses = placed.map(|(own, pose)| Some(own.found.filter(|_| pose.is_some())?.pose));
        Self::about(model, poses.collect(), state, loss_px)
    }

    /// The same with the term of the points made about the poses and lenses of a state, where it is
    /// exact then. `None` where there is no term, so that nothing would change.
    pub fn again(&self, model: &Model, state: &State, loss_px: f64) -> Option<Self> {
        let term = self.term.as_ref()?;
        let mut poses = self.poses.clone();
        for (index, pose) in poses.iter_mut().enumerate().filter(|own| term.tells(own.0)) {
            *pose = state.poses[index].map(|own| state.found.back(&own));
        }
        Some(Self::about(model, poses, state, loss_px))
    }

    /// Whether points tell of any photograph.
    pub fn has_points(&self) -> bool {
        self.term.is_some()
    }

    fn about(model: &Model, poses: Vec<Option<Pose>>, state: &State, loss_px: f64) -> Self {
        let points = tracks::chosen(&model.found_points, poses.len());
        let tracked = tracks::is_tracked(&points, poses.len());
        let camera = |(index, pose): (usize, &Option<Pose>)| {
            let pose = pose.filter(|_| tracked[index])?;
            let lens = model.photographs[index].lens;
            let is_free = model.lenses[lens].fit.parts();
            Some(tracks::Camera { pose, lens, optic: state.lenses[lens], is_free })
        };
        let cameras: Vec<_> = poses.iter().enumerate().map(camera).collect();
        let term = tracks::linearised(&points, &cameras, loss_px);
        Self { poses, lenses: state.lenses.clone(), term }
    }

    /// The residuals of every photograph of the rig.
    pub fn rows(&self, model: &Model, state: &State, unknowns: &Unknowns) -> Vec<Row> {
        let own = self.poses.iter().enumerate();
        let changes: Vec<Option<[Row; 6]>> =
            own.map(|(index, pose)| change(pose.as_ref()?, state, unknowns, index)).collect();
        let mut rows = self.held(model, &changes);
        if let Some(term) = &self.term {
            rows.extend(self.of_points(term, &changes, state, unknowns));
            rows.extend(of_lenses(term, model, state, unknowns));
        }
        rows
    }

    /// Of photographs of which no points tell: the turn from where the engine has it, and the distance
    /// from there, as far as they move what it shows, over a quarter of a pixel.
    fn held(&self, model: &Model, changes: &[Option<[Row; 6]>]) -> Vec<Row> {
        let is_told = |index: usize| self.term.as_ref().is_some_and(|term| term.tells(index));
        let mut rows = Vec::new();
        for (index, change) in changes.iter().enumerate().filter(|own| !is_told(own.0)) {
            let own = &model.photographs[index];
            let (Some(found), Some(change)) = (own.found, change) else { continue };
            let longest = own.size.0.max(own.size.1) as f64;
            let focal_px = model.lenses[own.lens].focal_px.unwrap_or(longest);
            let turn = focal_px / FOUND_PX;
            let weight = |part: usize| if part < 3 { turn } else { turn / found.distance };
            rows.extend(
                change.iter().enumerate().map(|(part, row)| row.clone().times(weight(part))),
            );
        }
        rows
    }

    /// The term of the points, of which each row is of all photographs and lenses.
    fn of_points(
        &self,
        term: &tracks::Term,
        changes: &[Option<[Row; 6]>],
        state: &State,
        unknowns: &Unknowns,
    ) -> Vec<Row> {
        let change = |own: &Number| match *own {
            Number::Pose(photograph, part) => {
                changes[photograph].as_ref().map(|all| all[part].clone())
            }
            Number::Lens(lens, part) => {
                let value = state.lenses[lens].numbers()[part] - self.lenses[lens].numbers()[part];
                let slopes = unknowns.lens(lens)[part].map(|column| (column, 1.0));
                Some(row(value, slopes.into_iter().collect()))
            }
        };
        let changes: Vec<Row> =
            term.numbers.iter().map(|own| change(own).unwrap_or_default()).collect();
        let mut slopes = vec![0.0; unknowns.list.len()];
        let combined = |(i, offset): (usize, &f64)| {
            slopes.fill(0.0);
            let mut value = *offset;
            for (j, change) in changes.iter().enumerate().skip(i) {
                let factor = term.factor[(i, j)];
                value += factor * change.value;
                change.slopes.iter().for_each(|&(column, by)| slopes[column] += factor * by);
            }
            let slopes = slopes.iter().copied().enumerate().filter(|own| own.1 != 0.0);
            row(value, slopes.collect())
        };
        term.offset.iter().enumerate().map(combined).collect()
    }
}

/// Focal lengths and distortion that are adjusted, by how far they are from those of the engine.
fn of_lenses(term: &tracks::Term, model: &Model, state: &State, unknowns: &Unknowns) -> Vec<Row> {
    let drawn = |own: &Number| {
        let &Number::Lens(index, part) = own else { return None };
        let Lens { focal_px, radial, .. } = model.lenses[index];
        let (expected, sd) = match part {
            0 => (focal_px?, FOCAL * focal_px?),
            3 => (radial.x, RADIAL),
            4 => (radial.y, RADIAL),
            _ => return None,
        };
        let column = unknowns.lens(index)[part]?;
        let value = (state.lenses[index].numbers()[part] - expected) / sd;
        Some(row(value, vec![(column, 1.0 / sd)]))
    };
    term.numbers.iter().filter_map(drawn).collect()
}

fn row(value: f64, slopes: Vec<(usize, f64)>) -> Row {
    Row { stroke: NO_STROKE, value, slopes, is_drawn: false }
}

/// By how much a photograph is turned from a pose in the rig, about the axes of its camera, and
/// moved, in the engine's coordinates; `None` where it is not adjusted.
fn change(from: &Pose, state: &State, unknowns: &Unknowns, photograph: usize) -> Option<[Row; 6]> {
    let (pose, first) = (state.poses[photograph]?, unknowns.pose(photograph)?);
    let (columns, whole) = (unknowns.found(), &state.found);
    let actual = pose.world_from_camera;
    let expected = whole.rotation * from.world_from_camera;
    let turn = rotation_vector(&(expected.transpose() * actual));
    let slope = turn_slope(turn);
    // In the engine's unit, so that the size of the world says nothing.
    let back = whole.rotation.transpose();
    let place = (pose.position - whole.shift) / whole.scale;
    let moved = back * place - from.position;
    Some(std::array::from_fn(|part| {
        let k = part % 3;
        let mut slopes = Vec::with_capacity(10);
        if part < 3 {
            for (j, axis) in DVec3::AXES.into_iter().enumerate() {
                slopes.push((first + j, slope.col(j)[k]));
                let by_world = -(slope * (actual.transpose() * axis));
                slopes.extend(columns[1 + j].map(|column| (column, by_world[k])));
            }
            return row(turn[k], slopes);
        }
        slopes.extend(columns[0].map(|column| (column, -(back * place)[k])));
        for (j, axis) in DVec3::AXES.into_iter().enumerate() {
            let shift = back.col(j)[k] / whole.scale;
            slopes.push((first + 3 + j, shift));
            slopes.extend(columns[4 + j].map(|column| (column, -shift)));
            let by_turn = -(back * axis.cross(place))[k];
            slopes.extend(columns[1 + j].map(|column| (column, by_turn)));
        }
        row(moved[k], slopes)
    }))
}

/// The axis of a rotation, as long as its angle. Exact also where that is tiny, which the adjustment
/// ends with: glam takes an angle below 1e-8 for none.
fn rotation_vector(rotation: &DMat3) -> DVec3 {
    let quaternion = DQuat::from_mat3(rotation);
    let (axis, w) = (quaternion.xyz(), quaternion.w);
    let sine = axis.length();
    match sine {
        ..1e-7 => 2.0 * w.signum() * axis,
        _ => axis * (w.signum() * 2.0 * sine.atan2(w.abs()) / sine),
    }
}

/// How the rotation vector of M changes with a small turn of M about its own axes: the inverse of
/// the right Jacobian of SO(3).
fn turn_slope(turn: DVec3) -> DMat3 {
    let angle = turn.length();
    let cross = DMat3::from_cols(
        DVec3::new(0.0, turn.z, -turn.y),
        DVec3::new(-turn.z, 0.0, turn.x),
        DVec3::new(turn.y, -turn.x, 0.0),
    );
    let second = match angle {
        ..1e-3 => 1.0 / 12.0 + angle * angle / 720.0,
        _ => 1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin()),
    };
    DMat3::IDENTITY + 0.5 * cross + second * (cross * cross)
}

/// Keeps the guessed values of undetermined numbers of the rig's pose in the world, and notes them.
pub fn keep(model: &Model, rig: &Rig, state: &mut State) -> Vec<String> {
    let mut placed = model.photographs.iter().zip(&state.poses);
    if !placed.any(|(own, pose)| own.found.is_some() && pose.is_some()) {
        return Vec::new();
    }
    let [x, y, z, tilt, roll, yaw, scale] = determined::untold(model, rig, state);
    // What nothing contradicts holds exactly: 1 is the metre of what was found.
    let is_metric = model.scale_is_found();
    state.kept = [scale || is_metric, tilt, roll, yaw, x, y, z];
    let mut notes = Vec::new();
    if tilt || roll {
        let text = "Which way is up is guessed from how the photographs were held: draw upright \
                    lines (Z), or show what stands on the floor.";
        notes.push(text.to_owned());
    }
    if scale && !is_metric {
        let text = "No length is known: what the photographs show is taken to be 2 m away. Give \
                    one (K).";
        notes.push(text.to_owned());
    }
    notes
}
