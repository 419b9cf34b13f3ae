//! Standard errors of what the strokes determine, and sentences about what they do not determine.

use std::collections::BTreeMap;

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};
use glam::DVec3;

use super::adjust::{Adjusted, Normal, weight};
use super::movement::Movement;
use super::residuals::{self, Row};
use super::rig::Rig;
use super::strokes::HAND_PX;
use super::unknowns::{Owner, State, Unknowns};
use super::{Model, ModelError};

/// A singular value below this part of the largest, with columns of unit length, is zero: strokes
/// leave a combination of unknowns open. Rounding leaves 1e-15, drawn lines that are nearly
/// degenerate 1e-4 and more.
const ZERO: f64 = 1e-9;
/// Condition number of normal equations with columns of unit length up to which they are inverted as
/// they are: rounding of 1e-16 leaves six digits.
const WELL_POSED: f64 = 1e10;
/// Part of a residual's change below which a movement of everything changes nothing.
const UNSEEN: f64 = 1e-7;
/// The number of residuals that the belief in [`HAND_PX`] is worth.
const BELIEF: f64 = 4.0;
/// Least relative precision of a focal length, of a camera's place by its distance from what it
/// sees, and least precision of its direction in radians: beyond, a number says nothing.
const VAGUE_FOCAL: f64 = 0.25;
const VAGUE_PLACE: f64 = 0.25;
const VAGUE_TURN: f64 = 0.1;

/// How well everything is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Certainty {
    /// Standard deviation of a stroke, in pixels, from the residuals.
    pub stroke_px: f64,
    /// Covariance of the unknowns, in their units: pixels, radians, metres.
    pub covariance: Mat<f64>,
}

impl Certainty {
    /// The standard error of an unknown.
    pub fn standard_error(&self, column: usize) -> f64 {
        self.covariance[(column, column)].max(0.0).sqrt()
    }
}

/// The covariance of the unknowns, (JᵀWJ)⁻¹ times the variance of a stroke; where some are open,
/// what is open, in words.
///
/// The variance is that of the weighted residuals over the degrees of freedom, with a belief of
/// one pixel that is worth four residuals: a handful of strokes that happen to agree is no proof
/// of a steady hand.
pub fn certainty(
    model: &Model,
    adjusted: &Adjusted,
    loss_px: f64,
) -> Result<Certainty, ModelError> {
    let (unknowns, rows) = (&adjusted.unknowns, &adjusted.rows);
    let normal = Normal::of(rows, unknowns.list.len(), loss_px);
    let norms = norms(rows, unknowns.list.len(), loss_px);
    if let Some(open) = unseen(model, unknowns, &norms) {
        return Err(open);
    }
    let inverse = match inverted(&normal, &norms) {
        Some(inverse) => inverse,
        None => decomposed(model, adjusted, &norms, loss_px)?,
    };
    let squares: f64 = rows.iter().map(|row| weight(row, loss_px) * row.value * row.value).sum();
    let freedom = rows.len().saturating_sub(norms.len()) as f64;
    let variance = (BELIEF * HAND_PX * HAND_PX + squares) / (BELIEF + freedom);
    let entry = |i: usize, j: usize| variance * inverse[(i, j)] / (norms[i] * norms[j]);
    let covariance = Mat::from_fn(norms.len(), norms.len(), entry);
    Ok(Certainty { stroke_px: variance.sqrt(), covariance })
}

/// The lengths of the columns of the weighted Jacobian. A row may name an unknown more than once, with
/// derivatives that cancel.
fn norms(rows: &[Row], count: usize, loss_px: f64) -> Vec<f64> {
    let (mut squares, mut sums) = (vec![0.0; count], vec![0.0; count]);
    for row in rows {
        row.slopes.iter().for_each(|&(j, slope)| sums[j] += slope);
        for &(j, _) in &row.slopes {
            let sum = std::mem::take(&mut sums[j]);
            squares[j] += weight(row, loss_px) * sum * sum;
        }
    }
    squares.into_iter().map(f64::sqrt).collect()
}

/// (JᵀWJ)⁻¹ with columns of unit length, where rounding leaves six digits of it or more; that is so
/// in nearly every model, and much faster than a decomposition.
fn inverted(normal: &Normal, norms: &[f64]) -> Option<Mat<f64>> {
    let count = norms.len();
    let scaled = Mat::from_fn(count, count, |i, j| normal.at(i, j) / (norms[i] * norms[j]));
    let inverse = scaled.llt(Side::Lower).ok()?.inverse();
    // The largest eigenvalue is at most the one trace, the inverse of the smallest at most the other.
    let trace: f64 = (0..count).map(|i| inverse[(i, i)]).sum();
    let condition = count as f64 * trace;
    (condition.is_finite() && condition < WELL_POSED).then_some(inverse)
}

/// The same by singular values, which tell also what is open; that is the error, in words.
fn decomposed(
    model: &Model,
    adjusted: &Adjusted,
    norms: &[f64],
    loss_px: f64,
) -> Result<Mat<f64>, ModelError> {
    let (rows, count) = (&adjusted.rows, norms.len());
    // With fewer rows than unknowns the decomposition would leave out what is open.
    let mut jacobian = Mat::zeros(rows.len().max(count), count);
    for (i, row) in rows.iter().enumerate() {
        let root = weight(row, loss_px).sqrt();
        for &(j, slope) in &row.slopes {
            jacobian[(i, j)] += root * slope / norms[j];
        }
    }
    let svd = jacobian.thin_svd().map_err(|_| {
        ModelError::new("", "the adjustment has no finite derivatives", "Check the strokes")
    })?;
    let (values, vectors) = (svd.S().column_vector(), svd.V());
    let largest = if count > 0 { values[0] } else { 0.0 };
    let open: Vec<Vec<f64>> = (0..count)
        .filter(|&k| values[k] <= ZERO * largest)
        .map(|k| (0..count).map(|j| vectors[(j, k)]).collect())
        .collect();
    if !open.is_empty() {
        return Err(in_words(model, adjusted, &jacobian, norms, &open));
    }
    let entry = |i: usize, j: usize| {
        let product = |k: usize| vectors[(i, k)] * vectors[(j, k)] / (values[k] * values[k]);
        (0..count).map(product).sum()
    };
    Ok(Mat::from_fn(count, count, entry))
}

/// What no stroke depends on at all.
fn unseen(model: &Model, unknowns: &Unknowns, norms: &[f64]) -> Option<ModelError> {
    let mut names: BTreeMap<Owner, Vec<String>> = BTreeMap::new();
    for (unknown, _) in unknowns.list.iter().zip(norms).filter(|(_, norm)| **norm == 0.0) {
        names.entry(unknown.owner).or_default().push(part_name(
            unknowns,
            unknown.owner,
            unknown.part,
        ));
    }
    let (&owner, parts) = names.iter().next()?;
    let remedy = match owner {
        Owner::Thing(_) => "Pick the corners that show it, or type the number (\"hold\")",
        _ => "Add strokes that show it",
    };
    Some(ModelError::new(
        place(owner),
        format!("no stroke tells the {} of {}", parts.join(", "), owner_name(model, owner)),
        remedy,
    ))
}

/// The changes of the whole world that are undetermined: three shifts, three rotations, the scale.
pub fn untold(model: &Model, rig: &Rig, state: &State) -> [bool; 7] {
    let unknowns = Unknowns::of(model, state);
    let Ok(rows) = residuals::rows(model, rig, state, &unknowns) else { return [false; 7] };
    let mut squares = vec![0.0; unknowns.list.len()];
    let slopes = || rows.iter().flat_map(|row| &row.slopes);
    slopes().for_each(|&(j, slope)| squares[j] += slope * slope);
    Movement::ALL.map(|movement| {
        let rate = |j: usize| movement.rate(&unknowns, state, j);
        let length: f64 = (0..squares.len()).map(|j| squares[j] * rate(j).powi(2)).sum();
        let change = |row: &Row| row.slopes.iter().map(|&(j, slope)| slope * rate(j)).sum::<f64>();
        let seen: f64 = rows.iter().map(|row| change(row).powi(2)).sum();
        seen.sqrt() <= UNSEEN * length.sqrt()
    })
}

/// The combinations of unknowns that the strokes do not determine.
fn in_words(
    model: &Model,
    adjusted: &Adjusted,
    jacobian: &Mat<f64>,
    norms: &[f64],
    open: &[Vec<f64>],
) -> ModelError {
    let unknowns = &adjusted.unknowns;
    let (mut problems, mut remedies): (Vec<String>, Vec<&str>) = (Vec::new(), Vec::new());
    for movement in Movement::ALL {
        let direction: Vec<f64> = (0..norms.len())
            .map(|j| norms[j] * movement.rate(unknowns, &adjusted.state, j))
            .collect();
        let length = direction.iter().map(|value| value * value).sum::<f64>().sqrt();
        let seen: f64 = (0..jacobian.nrows())
            .map(|i| (0..norms.len()).map(|j| jacobian[(i, j)] * direction[j]).sum::<f64>().powi(2))
            .sum();
        if length > 0.0 && seen.sqrt() <= UNSEEN * length {
            problems.push(movement.problem().to_owned());
            remedies.push(movement.remedy());
        }
    }
    if problems.is_empty() {
        // The share of each owner in what is open.
        let mut shares: BTreeMap<Owner, f64> = BTreeMap::new();
        for (j, unknown) in unknowns.list.iter().enumerate() {
            let share: f64 = open.iter().map(|vector| vector[j] * vector[j]).sum();
            *shares.entry(unknown.owner).or_default() += share;
        }
        let most = shares.values().copied().fold(0.0, f64::max);
        let owners: Vec<Owner> =
            shares.iter().filter(|(_, share)| **share > 0.05 * most).map(|own| *own.0).collect();
        let lens = owners.iter().find(|owner| matches!(owner, Owner::Lens(_)));
        let names: Vec<String> =
            owners.iter().take(4).map(|&owner| owner_name(model, owner)).collect();
        problems.push(match lens {
            Some(&lens) => format!(
                "the focal length or another number of {} is not determined, together with {}",
                owner_name(model, lens),
                names
                    .iter()
                    .filter(|name| **name != owner_name(model, lens))
                    .cloned()
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
            None => format!("{} {} not determined", names.join(" and "), are(names.len())),
        });
        remedies.push(match (lens, owners.first()) {
            (Some(_), _) => "Add lines along a second axis, or give the focal length and hold it",
            (None, Some(Owner::Point(_))) => "Pick it in another photograph, from another place",
            _ => "Pick more of its corners, in other photographs or along other directions",
        });
    }
    ModelError::new("", problems.join("; "), remedies.join(". "))
}

fn place(owner: Owner) -> String {
    match owner {
        Owner::Lens(index) => format!("lenses[{index}]"),
        Owner::Photograph(index) => format!("photographs[{index}]"),
        Owner::Thing(index) => format!("things[{index}]"),
        Owner::Point(index) => format!("points[{index}]"),
        Owner::Stroke(index) => format!("strokes[{index}]"),
        Owner::Found => "photographs".to_owned(),
    }
}

fn owner_name(model: &Model, owner: Owner) -> String {
    match owner {
        Owner::Lens(index) => format!("the lens {}", model.lenses[index].id),
        Owner::Photograph(index) => format!("the camera of {}", model.photographs[index].name),
        Owner::Thing(index) => {
            let thing = &model.things[index];
            format!("the {} {}", thing.shape.name(), thing.id)
        }
        Owner::Point(index) => format!("the point {}", model.points[index].id),
        Owner::Stroke(index) => model.stroke_name(index),
        Owner::Found => "the photographs that were found together".to_owned(),
    }
}

fn part_name(unknowns: &Unknowns, owner: Owner, part: usize) -> String {
    match owner {
        Owner::Lens(_) => {
            ["focal length", "principal point", "principal point", "k1", "k2"][part].into()
        }
        Owner::Photograph(_) if part < 3 => "direction".into(),
        Owner::Photograph(_) | Owner::Point(_) => "position".into(),
        Owner::Thing(index) => unknowns.parameter_name(index, part).to_owned(),
        Owner::Stroke(_) => "angle".into(),
        Owner::Found => "place in the world".into(),
    }
}

fn are(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}

/// Numbers that are determined, but too badly to be of use: one sentence each.
pub fn vague(model: &Model, adjusted: &Adjusted, certainty: &Certainty) -> Vec<ModelError> {
    let (state, unknowns) = (&adjusted.state, &adjusted.unknowns);
    let mut list = Vec::new();
    for (index, lens) in model.lenses.iter().enumerate() {
        let Some(column) = unknowns.lens(index)[0] else { continue };
        let (focal_px, sd) = (state.lenses[index].focal_px, certainty.standard_error(column));
        if sd > VAGUE_FOCAL * focal_px.abs() {
            list.push(ModelError::new(
                format!("lenses[{index}]"),
                format!(
                    "the focal length of the lens {} is not determined: {focal_px:.0} ± {sd:.0} px",
                    lens.id
                ),
                "Add lines along a second axis whose lines converge in the image, or give the \
                 focal length and hold it",
            ));
        }
    }
    let corners = state.corners(model);
    for (index, photograph) in model.photographs.iter().enumerate() {
        let (Some(first), Some(pose)) = (unknowns.pose(index), state.poses[index]) else {
            continue;
        };
        let error = |from: usize| {
            let error = |k| certainty.standard_error(from + k);
            DVec3::new(error(0), error(1), error(2)).length()
        };
        let far = distance(model, state, &corners, index, pose.position);
        if error(first) > VAGUE_TURN || error(first + 3) > VAGUE_PLACE * far {
            list.push(ModelError::new(
                format!("photographs[{index}]"),
                format!(
                    "the camera of {} is not determined: direction ± {:.0}°, position ± {:.2} m",
                    photograph.name,
                    error(first).to_degrees(),
                    error(first + 3)
                ),
                "Pick more corners in it, also such as do not lie in one plane",
            ));
        }
    }
    for (index, point) in model.points.iter().enumerate() {
        let Some(at) = state.points[index] else { continue };
        let Some(first) = unknowns.list.iter().position(|own| own.owner == Owner::Point(index))
        else {
            continue;
        };
        let error = |k| certainty.standard_error(first + k);
        let sd = DVec3::new(error(0), error(1), error(2)).length();
        let near = state.poses.iter().flatten().map(|pose| pose.position.distance(at));
        if sd > VAGUE_PLACE * near.fold(f64::INFINITY, f64::min) {
            list.push(ModelError::new(
                format!("points[{index}]"),
                format!(
                    "the point {} is not determined (± {sd:.2} m): the photographs that show it \
                     were taken from nearly one place",
                    point.id
                ),
                "Pick it in a photograph from another place",
            ));
        }
    }
    list
}

/// The mean distance of what a photograph shows.
fn distance(
    model: &Model,
    state: &State,
    corners: &[Vec<DVec3>],
    photograph: usize,
    from: DVec3,
) -> f64 {
    let seen: Vec<DVec3> = model
        .strokes
        .iter()
        .filter(|stroke| stroke.photograph() == Some(photograph))
        .flat_map(|stroke| stroke.places())
        .filter_map(|&place| super::conventions::at(state, corners, place))
        .collect();
    if let (true, Some(found)) = (seen.is_empty(), model.photographs[photograph].found) {
        return state.found.scale * found.distance;
    }
    let sum: f64 = seen.iter().map(|at| at.distance(from)).sum();
    sum / seen.len().max(1) as f64
}
