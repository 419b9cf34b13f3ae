//! The photographs that an engine placed, as one rig that strokes place in the world.
//!
//! An engine has adjusted these cameras to thousands of points, so their relative poses are more
//! certain than a stroke. Each camera is held near its pose in the rig by residuals in pixels. The
//! [`Similarity`](super::Similarity) from the rig to the world, which the engine cannot determine,
//! is unknown. Those of its numbers that no stroke determines keep their guessed values, and a note
//! says so.

use glam::{DMat3, DQuat, DVec3};

use super::residuals::{NO_STROKE, Row};
use super::unknowns::{State, Unknowns};
use super::{Model, determined};

/// How far an engine's cameras are believed, in pixels of the photograph.
const FOUND_PX: f64 = 0.25;

/// The residuals of every photograph that an engine placed: its turn from where the engine has it,
/// and its distance from there, as far as they move what it shows, over a quarter
/// of a pixel.
pub fn rows(model: &Model, state: &State, unknowns: &Unknowns) -> Vec<Row> {
    let mut rows = Vec::new();
    let columns = unknowns.found();
    let whole = &state.found;
    for (index, own) in model.photographs.iter().enumerate() {
        let (Some(found), Some(pose)) = (own.found, state.poses[index]) else { continue };
        let Some(first) = unknowns.pose(index) else { continue };
        let longest = own.size.0.max(own.size.1) as f64;
        let focal_px = model.lenses[own.lens].focal_px.unwrap_or(longest);
        let actual = pose.world_from_camera;
        let expected = whole.rotation * found.pose.world_from_camera;
        let turn = rotation_vector(&(expected.transpose() * actual));
        let (slope, weight) = (turn_slope(turn), focal_px / FOUND_PX);
        for k in 0..3 {
            let mut row = Row { stroke: NO_STROKE, value: weight * turn[k], ..Row::default() };
            for (j, axis) in DVec3::AXES.into_iter().enumerate() {
                row.slopes.push((first + j, weight * slope.col(j)[k]));
                let by_world = -(slope * (actual.transpose() * axis));
                row.slopes.extend(columns[1 + j].map(|column| (column, weight * by_world[k])));
            }
            rows.push(row);
        }
        // In the engine's unit, so that the size of the world says nothing.
        let weight = weight / found.distance;
        let place = (pose.position - whole.shift) / whole.scale;
        let expected = whole.rotation * found.pose.position;
        for k in 0..3 {
            let value = weight * (place[k] - expected[k]);
            let mut row = Row { stroke: NO_STROKE, value, ..Row::default() };
            let shift = weight / whole.scale;
            row.slopes.push((first + 3 + k, shift));
            row.slopes.extend(columns[4 + k].map(|column| (column, -shift)));
            row.slopes.extend(columns[0].map(|column| (column, -weight * place[k])));
            for (j, axis) in DVec3::AXES.into_iter().enumerate() {
                let by = -weight * axis.cross(expected)[k];
                row.slopes.extend(columns[1 + j].map(|column| (column, by)));
            }
            rows.push(row);
        }
    }
    rows
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
pub fn keep(model: &Model, state: &mut State) -> Vec<String> {
    let mut placed = model.photographs.iter().zip(&state.poses);
    if !placed.any(|(own, pose)| own.found.is_some() && pose.is_some()) {
        return Vec::new();
    }
    let [x, y, z, tilt, roll, yaw, scale] = determined::untold(model, state);
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
