//! The pose of a card of known size that stands free in space, from its corners in photographs.

use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{Mat, Side};
use glam::{DMat3, DVec2, DVec3};

use crate::scene::Camera;
use crate::scene::charts::Placed;

/// By how many pixels corners that a person gives are off, as a standard deviation of each coordinate.
const CLICK_PX: f64 = 1.0;
/// The largest RMS distance of the corners from those of the pose, in parts of the card's diagonal in
/// the photograph and at least in pixels: beyond it the size or a camera is wrong.
const MISSES: f64 = 0.03;
const MISSES_PX: f64 = 3.0 * CLICK_PX;
/// Poses whose normals are less far apart, in radians, count as one.
const ONE_POSE: f64 = 0.05;
/// Steps of the least squares, and the relative change of the pose at which they end.
const STEPS: usize = 100;
const SETTLED: f64 = 1e-10;
/// Step of the finite differences of the Jacobian, in radians and in parts of the distance.
const DIFFERENCE: f64 = 1e-6;
/// Unknowns of a pose: a displacement and a rotation.
const UNKNOWNS: usize = 6;

/// A card in a photograph, its corners counter-clockwise as seen.
#[derive(Clone, Copy)]
pub struct Seen<'a> {
    pub camera: &'a Camera,
    pub corners_px: [DVec2; 4],
}

/// A pose that the least squares came to.
struct Minimum {
    middle: DVec3,
    /// Its first and second side, and its normal.
    axes: DMat3,
    rms_px: f64,
    /// As that of [`Placed`], about the less certain of the two sides and all axes between them.
    tilt_sd: f64,
}

/// The pose in which corners of a card appear closest to where photographs show them, by least squares
/// over all of its photographs. `size_m` has the lengths of the side from its first to its second corner,
/// and of the next.
///
/// # Errors
/// Why there is none, for a person.
pub fn pose(views: &[Seen], size_m: DVec2) -> Result<Placed, String> {
    let first = views.first().ok_or("no photograph shows it")?;
    let mut found: Vec<Minimum> = Vec::new();
    let starts = starts(first, size_m).ok_or("a corner lies beyond what the lens shows")?;
    for (middle, axes) in starts {
        // The other photographs may begin with another corner, which shows where it stands.
        let alone = settle(&[*first], size_m, middle, axes);
        let Some(alone) = alone else { continue };
        let views: Vec<Seen> = (views.iter())
            .map(|view| view.begun_as(&corners(alone.middle, alone.axes, size_m)))
            .collect();
        found.extend(settle(&views, size_m, alone.middle, alone.axes));
    }
    found.sort_by(|a, b| a.rms_px.total_cmp(&b.rms_px));
    let best = found.first().ok_or("no pose shows its corners there")?;
    let diagonal = |view: &Seen| {
        let [a, b, c, d] = view.corners_px;
        0.5 * (a.distance(c) + b.distance(d))
    };
    let smallest = views.iter().map(diagonal).fold(f64::INFINITY, f64::min);
    if best.rms_px > (MISSES * smallest).max(MISSES_PX) {
        return Err(format!(
            "a card of {:.1} x {:.1} cm does not fit its corners: they are off by {:.1} pixels; check \
             its size (the first is that of the side from the first corner to the second), the corners \
             and the cameras",
            100.0 * size_m.x,
            100.0 * size_m.y,
            best.rms_px
        ));
    }
    let apart = |other: &&Minimum| {
        best.axes.z_axis.dot(other.axes.z_axis).clamp(-1.0, 1.0).acos() > ONE_POSE
    };
    if let Some(other) = found.iter().find(apart).filter(|other| other.rms_px < CLICK_PX) {
        return Err(format!(
            "two poses fit its corners to {:.1} and {:.1} pixels, with {:.0}° between them; give its \
             corners in another photograph, from another side",
            best.rms_px,
            other.rms_px,
            best.axes.z_axis.dot(other.axes.z_axis).clamp(-1.0, 1.0).acos().to_degrees()
        ));
    }
    Ok(Placed { corners: corners(best.middle, best.axes, size_m), tilt_sd: best.tilt_sd })
}

impl Seen<'_> {
    /// The same with the corner first that is nearest to where the first of `corners` appears.
    fn begun_as(&self, corners: &[DVec3; 4]) -> Self {
        let places = corners.map(|corner| self.camera.place(corner));
        let off = |turn: usize| -> f64 {
            let of = |k: usize| {
                places[k].map_or(f64::INFINITY, |place| {
                    place.distance_squared(self.corners_px[(k + turn) % 4])
                })
            };
            (0..4).map(of).sum()
        };
        let turn = (0..4).min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(0);
        let mut corners_px = self.corners_px;
        corners_px.rotate_left(turn);
        Self { corners_px, ..*self }
    }
}

/// The corners of a card, counter-clockwise about its normal.
fn corners(middle: DVec3, axes: DMat3, size_m: DVec2) -> [DVec3; 4] {
    let signs = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
    signs.map(|(x, y)| middle + axes * (size_m * DVec2::new(x, y)).extend(0.0))
}

/// Poses from which the least squares start: as far away as the size says, facing the camera and turned
/// from it to all sides, since two poses may fit nearly as well.
fn starts(view: &Seen, size_m: DVec2) -> Option<Vec<(DVec3, DMat3)>> {
    let directions = view.corners_px.map(|pixel| view.camera.direction(pixel));
    let [a, b, c, d] = directions;
    let (a, b, c, d) = (a?, b?, c?, d?);
    let towards = (a + b + c + d).normalize();
    let distance = 2.0 * size_m.length() / (a.distance(c) + b.distance(d));
    let middle = view.camera.position + distance * towards;
    let normal = -towards;
    let along = (b - a).reject_from(normal).try_normalize()?;
    let turns = (0..9).map(|k| match k {
        0 => DMat3::IDENTITY,
        k => {
            let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
            let axis = along * cos + normal.cross(along) * sin;
            DMat3::from_axis_angle(axis, std::f64::consts::FRAC_PI_4)
        }
    });
    let facing = DMat3::from_cols(along, normal.cross(along), normal);
    Some(turns.map(|turn| (middle, turn * facing)).collect())
}

/// The differences in pixels between where the corners appear and where they are seen; `None` if one
/// appears nowhere.
fn residuals(views: &[Seen], size_m: DVec2, middle: DVec3, axes: DMat3) -> Option<Vec<f64>> {
    let corners = corners(middle, axes, size_m);
    let mut residuals = Vec::with_capacity(8 * views.len());
    for view in views {
        // The front is seen.
        if (view.camera.position - middle).dot(axes.z_axis) <= 0.0 {
            return None;
        }
        for (corner, seen) in corners.iter().zip(view.corners_px) {
            residuals.extend((view.camera.place(*corner)? - seen).to_array());
        }
    }
    Some(residuals)
}

/// The pose moved by a step of the unknowns, the first three in units of `distance`.
fn moved(middle: DVec3, axes: DMat3, step: &[f64; UNKNOWNS], distance: f64) -> (DVec3, DMat3) {
    let by = DVec3::from_slice(&step[..3]) * distance;
    let turn = DVec3::from_slice(&step[3..]);
    let turn = match turn.length() {
        angle if angle > 0.0 => DMat3::from_axis_angle(turn / angle, angle),
        _ => DMat3::IDENTITY,
    };
    (middle + by, turn * axes)
}

/// Levenberg and Marquardt's least squares from a start; `None` if a corner appears nowhere there.
fn settle(views: &[Seen], size_m: DVec2, middle: DVec3, axes: DMat3) -> Option<Minimum> {
    let (mut middle, mut axes) = (middle, axes);
    let distance = middle.distance(views.first()?.camera.position);
    let cost = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
    let mut own = residuals(views, size_m, middle, axes)?;
    let mut damping = 1e-3;
    let jacobian = |middle: DVec3, axes: DMat3| -> Option<Mat<f64>> {
        let columns: Vec<Vec<f64>> = (0..UNKNOWNS)
            .map(|unknown| {
                let at = |by: f64| {
                    let mut step = [0.0; UNKNOWNS];
                    step[unknown] = by;
                    let (middle, axes) = moved(middle, axes, &step, distance);
                    residuals(views, size_m, middle, axes)
                };
                let (up, down) = (at(DIFFERENCE)?, at(-DIFFERENCE)?);
                Some(
                    up.iter()
                        .zip(down)
                        .map(|(up, down)| (up - down) / (2.0 * DIFFERENCE))
                        .collect(),
                )
            })
            .collect::<Option<_>>()?;
        Some(Mat::from_fn(columns[0].len(), UNKNOWNS, |row, column| columns[column][row]))
    };
    for _ in 0..STEPS {
        let jacobian = jacobian(middle, axes)?;
        let normal = jacobian.transpose() * &jacobian;
        let right = Mat::from_fn(UNKNOWNS, 1, |k, _| {
            -(0..own.len()).map(|row| jacobian[(row, k)] * own[row]).sum::<f64>()
        });
        let damped = Mat::from_fn(UNKNOWNS, UNKNOWNS, |row, column| {
            normal[(row, column)] * if row == column { 1.0 + damping } else { 1.0 }
        });
        let step = damped.llt(Side::Lower).ok()?.solve(&right);
        let step: [f64; UNKNOWNS] = std::array::from_fn(|k| step[(k, 0)]);
        let (next, turned) = moved(middle, axes, &step, distance);
        match residuals(views, size_m, next, turned) {
            Some(residuals) if cost(&residuals) <= cost(&own) => {
                (middle, axes, own) = (next, turned, residuals);
                damping = (0.1 * damping).max(1e-12);
                if step.iter().all(|by| by.abs() < SETTLED) {
                    break;
                }
            }
            _ if damping > 1e9 => break,
            _ => damping *= 10.0,
        }
    }
    let jacobian = jacobian(middle, axes)?;
    let normal = jacobian.transpose() * &jacobian;
    // Rotations about the two sides tilt the normal; that about the normal itself does not.
    let inverse = normal.llt(Side::Lower).ok()?.inverse();
    let variance = |axis: DVec3| {
        let axis = axis.to_array();
        let of = |i: usize, j: usize| axis[i] * inverse[(3 + i, 3 + j)] * axis[j];
        (0..9).map(|k| of(k / 3, k % 3)).sum::<f64>()
    };
    let covariance = {
        let sum = variance(axes.x_axis + axes.y_axis);
        0.5 * (sum - variance(axes.x_axis) - variance(axes.y_axis))
    };
    let (x, y) = (variance(axes.x_axis), variance(axes.y_axis));
    let largest = 0.5 * (x + y) + (0.25 * (x - y).powi(2) + covariance.powi(2)).sqrt();
    Some(Minimum {
        middle,
        axes,
        rms_px: (cost(&own) / (0.5 * own.len() as f64)).sqrt(),
        tilt_sd: CLICK_PX * largest.sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Distortion;

    const SIZE: DVec2 = DVec2::new(0.29, 0.2);

    fn camera(position: DVec3, target: DVec3) -> Camera {
        let back = (position - target).normalize();
        let right = DVec3::Z.cross(back).normalize();
        let axes = DMat3::from_cols(right, back.cross(right), back);
        let lens = Distortion { radial: [0.03, 0.0, 0.0, 0.0], ..Distortion::default() };
        let (focal, middle) = (DVec2::splat(900.0), DVec2::new(640.0, 480.0));
        Camera::new((1280, 960), focal, middle, lens, axes, position)
    }

    fn card() -> (DVec3, DMat3) {
        (DVec3::new(0.1, 0.3, 1.2), DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(1.1))
    }

    fn seen(camera: &Camera, off: impl Fn(usize) -> DVec2) -> Seen<'_> {
        let (middle, axes) = card();
        let corners = corners(middle, axes, SIZE);
        let place = |k: usize| camera.place(corners[k]).unwrap() + off(k);
        Seen { camera, corners_px: std::array::from_fn(place) }
    }

    /// Cameras before the card, to the left and to the right.
    fn cameras() -> [Camera; 2] {
        let (middle, axes) = card();
        [(-0.7, 1.2), (0.6, 1.5)].map(|(aside, before)| {
            camera(middle + axes.x_axis * aside + axes.z_axis * before, middle)
        })
    }

    #[test]
    fn a_card_stands_where_its_corners_are_seen() {
        let cameras = cameras();
        let (middle, axes) = card();
        let expected = corners(middle, axes, SIZE);
        let near = |found: &Placed, by: f64| {
            let off = found.corners.iter().zip(&expected).map(|(a, b)| a.distance(*b));
            assert!(off.fold(0.0, f64::max) < by, "{found:?}");
        };
        let all = cameras.each_ref().map(|camera| seen(camera, |_| DVec2::ZERO));
        near(&pose(&all[..1], SIZE).unwrap(), 1e-7);
        // The second photograph begins with another corner.
        let mut turned = all;
        turned[1].corners_px.rotate_left(3);
        near(&pose(&turned, SIZE).unwrap(), 1e-7);
    }

    /// The tilt is as uncertain as it comes out of corners that are off by a pixel.
    #[test]
    fn the_tilt_is_as_certain_as_repeated_clicks_say() {
        let cameras = cameras();
        let normal = card().1.z_axis;
        let mut random = crate::math::sampling::Random::new(1, 0, 0);
        let mut squares = [0.0; 2];
        let (mut told, runs) = (0.0, 200);
        for _ in 0..runs {
            // Sums of twelve even numbers have a variance of 1.
            let mut click = || (0..12).map(|_| f64::from(random.uniform())).sum::<f64>() - 6.0;
            let clicks: [DVec2; 8] = std::array::from_fn(|_| DVec2::new(click(), click()));
            let views = [0, 1].map(|k| seen(&cameras[k], |corner| clicks[4 * k + corner]));
            let found = pose(&views, SIZE).unwrap();
            let [a, b, _, d] = found.corners;
            let own = (b - a).cross(d - a).normalize();
            squares[0] += own.dot(card().1.x_axis).powi(2) / f64::from(runs);
            squares[1] += own.dot(card().1.y_axis).powi(2) / f64::from(runs);
            assert!(own.dot(normal) > 0.9);
            told += found.tilt_sd / f64::from(runs);
        }
        let largest = squares[0].max(squares[1]).sqrt();
        assert!((told / largest - 1.0).abs() < 0.2, "{told} {largest}");
    }

    #[test]
    fn what_does_not_fit_is_told() {
        let cameras = cameras();
        let view = seen(&cameras[0], |_| DVec2::ZERO);
        let problem = pose(&[view], DVec2::new(0.2, 0.29)).unwrap_err();
        assert!(problem.contains("20.0 x 29.0 cm does not fit"), "{problem}");
        // So far away that rays through its corners are almost parallel.
        let (middle, axes) = card();
        let far = camera(middle + 9.0 * (axes.z_axis + 0.5 * axes.x_axis), middle);
        let problem = pose(&[seen(&far, |_| DVec2::ZERO)], SIZE).unwrap_err();
        assert!(problem.contains("two poses fit"), "{problem}");
        assert!(pose(&[], SIZE).is_err());
    }
}
