//! Vanishing points, and the focal length, principal point and rotation of a camera from them.
//!
//! Closed forms as in B. Caprile, V. Torre, "Using Vanishing Points for Camera Calibration" (1990):
//! vanishing points of orthogonal directions are orthogonal as seen from the camera.

use faer::{Mat, Side};
use glam::{DMat3, DVec2, DVec3};

use crate::model::unknowns::nearest_rotation;
use crate::model::view::flip;

/// A line in an image, in pixels from the principal point and without distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Where it begins.
    pub from: DVec2,
    /// Where it ends.
    pub to: DVec2,
    /// It was drawn from `from` to `to` in the direction of its axis; else it may run either way.
    pub is_directed: bool,
}

/// Where lines of one direction meet in the image, perhaps infinitely far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VanishingPoint {
    /// Homogeneous, of unit length, in units of `scale_px` from the principal point.
    pub point: DVec3,
    /// The unit of `point`, in pixels.
    pub scale_px: f64,
    /// Standard deviation of `point.z` for strokes that are one pixel off.
    pub sd: f64,
    /// Whether the axis points towards it; `None` where no line tells.
    sign: Option<f64>,
}

/// Times its standard deviation that a vanishing point must be from infinity to be finite.
const FINITE: f64 = 3.0;
/// A line that is off by this many pixels or more is no line of that axis.
const MISSED_PX: f64 = 10.0;
/// Pixels by which lines must differ from one and the same line.
const DISTINCT_PX: f64 = 5.0;
/// Directions of two axes nearer to each other than this (its cosine, 30°) contradict each other:
/// they are at right angles.
const ALIKE: f64 = 0.866;

/// The point where lines meet: the least sum of squared distances of their ends from the lines
/// that join their middles to it. `None` for fewer than two lines, or where all
/// lines are nearly one.
pub fn vanishing_point(lines: &[Line], scale_px: f64) -> Option<VanishingPoint> {
    if lines.len() < 2 {
        return None;
    }
    // The distance is nearly linear in the point: its denominator comes from the last round.
    let mut point = DVec3::ZERO;
    let mut variances = [0.0; 3];
    let mut vectors = [DVec3::ZERO; 3];
    for round in 0..5 {
        let mut normal = Mat::<f64>::zeros(3, 3);
        for line in lines {
            let half = 0.5 * (line.from - line.to) / scale_px;
            let middle = 0.5 * (line.from + line.to) / scale_px;
            let toward = point.truncate() - middle * point.z;
            let length = if point == DVec3::ZERO { 1.0 } else { toward.length().max(1e-6) };
            let row = DVec3::new(-half.y, half.x, half.y * middle.x - half.x * middle.y)
                * (std::f64::consts::SQRT_2 / length);
            for i in 0..3 {
                for j in 0..3 {
                    normal[(i, j)] += row[i] * row[j];
                }
            }
        }
        let eigen = normal.self_adjoint_eigen(Side::Lower).ok()?;
        for k in 0..3 {
            variances[k] = eigen.S().column_vector()[k];
            vectors[k] = DVec3::new(eigen.U()[(0, k)], eigen.U()[(1, k)], eigen.U()[(2, k)]);
        }
        // Strokes along one and the same line meet wherever their errors say.
        let is_one_line = variances[1].max(0.0).sqrt() * scale_px < DISTINCT_PX;
        if !vectors[0].is_finite() || (round == 0 && is_one_line) {
            return None;
        }
        point = vectors[0];
    }
    // One pixel is 1 / scale in these units.
    let spread = (1..3).map(|k| vectors[k].z.powi(2) / variances[k]).sum::<f64>();
    let sd = spread.sqrt() / scale_px;
    // Longer lines tell the direction better.
    let vote: f64 = lines
        .iter()
        .filter(|line| line.is_directed)
        .map(|line| {
            let middle = 0.5 * (line.from + line.to) / scale_px;
            (point.truncate() - middle * point.z).normalize_or_zero().dot(line.to - line.from)
        })
        .sum();
    let sign = (vote != 0.0).then(|| vote.signum());
    Some(VanishingPoint { point, scale_px, sd, sign })
}

impl VanishingPoint {
    /// Whether the lines converge by more than the error of a hand.
    pub fn is_finite(&self) -> bool {
        self.point.z.abs() > FINITE * self.sd
    }

    /// The axis' direction as a camera of that focal length sees it: unit, y down, z forward. Its
    /// sign means nothing where no line tells it.
    pub fn direction(&self, focal_px: f64) -> DVec3 {
        let stretch = focal_px / self.scale_px;
        let direction = DVec3::new(self.point.x, self.point.y, self.point.z * stretch);
        direction.normalize_or_zero() * self.sign.unwrap_or(1.0)
    }
}

/// Why vanishing points do not give a focal length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoFocal {
    /// No axis has two lines.
    #[error("there is no vanishing point, so the focal length is not determined")]
    None,
    /// One axis has.
    #[error("there is one vanishing point, so the focal length is not determined")]
    One,
    /// Fewer than two vanishing points are finite.
    #[error(
        "the lines of an axis are parallel in the image, so the focal length is not determined"
    )]
    Parallel,
    /// The squared focal length is negative.
    #[error("the lines of two axes contradict each other: no camera sees right angles so")]
    Contradictory,
}

impl NoFocal {
    /// What to do about it, without a full stop.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::None => "Draw two lines or more along each of two axes, or pick corners",
            Self::One => "Add lines along a second axis, or give the focal length",
            Self::Parallel => {
                "Add lines along another axis, whose ends converge, or give the focal length"
            }
            Self::Contradictory => "Check along which axis each line was drawn",
        }
    }
}

/// The focal length in pixels that makes the axes orthogonal, by least squares over the pairs of
/// finite vanishing points. The principal point is taken to be where lines are counted from.
pub fn focal(points: &[Option<VanishingPoint>; 3]) -> Result<f64, NoFocal> {
    let all: Vec<&VanishingPoint> = points.iter().flatten().collect();
    let finite: Vec<&&VanishingPoint> = all.iter().filter(|own| own.is_finite()).collect();
    match (all.len(), finite.len()) {
        (0, _) => return Err(NoFocal::None),
        (1, _) => return Err(NoFocal::One),
        (_, 0 | 1) => return Err(NoFocal::Parallel),
        _ => {}
    }
    // a + b f² = 0 of every pair.
    let (mut above, mut below) = (0.0, 0.0);
    for (i, first) in finite.iter().enumerate() {
        for second in &finite[i + 1..] {
            let a = first.point.truncate().dot(second.point.truncate());
            let b = first.point.z * second.point.z;
            above -= a * b;
            below += b * b;
        }
    }
    let square = above / below;
    if !square.is_finite() || square <= 1e-4 {
        return Err(NoFocal::Contradictory);
    }
    Ok(square.sqrt() * finite[0].scale_px)
}

/// The principal point in pixels from where lines are counted from: where the heights of the
/// triangle of three finite vanishing points meet. `None` where they are not three, or not finite.
pub fn principal(points: &[Option<VanishingPoint>; 3]) -> Option<DVec2> {
    let mut places = [DVec2::ZERO; 3];
    for (place, point) in places.iter_mut().zip(points) {
        let point = point.filter(VanishingPoint::is_finite)?;
        *place = point.point.truncate() / point.point.z * point.scale_px;
    }
    let [a, b, c] = places;
    // (a − b) · (p − c) = 0 and (a − c) · (p − b) = 0.
    let (first, second) = (a - b, a - c);
    let determinant = first.perp_dot(second);
    if determinant.abs() < 1e-9 * first.length() * second.length() {
        return None;
    }
    let (x, y) = (first.dot(c), second.dot(b));
    let place = DVec2::new(x * second.y - y * first.y, first.x * y - second.x * x) / determinant;
    place.is_finite().then_some(place)
}

/// Why vanishing points do not give a rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoRotation {
    /// Fewer than two directions, or no line that tells their sense.
    #[error("the lines do not tell how the camera is turned")]
    TooFew,
    /// Less than 30° apart.
    #[error("the lines of two axes run in nearly the same direction")]
    Alike,
    /// Left-handed.
    #[error("the axes make a left-handed frame: lines of one axis run against its direction")]
    Mirrored,
}

/// The rotation (world from camera, OpenGL's axes) of a camera of that focal length that sees the
/// axes x, y, z there: the nearest to two or three directions.
///
/// With one level axis the camera is taken to stand level: its x axis horizontal, z up. One
/// vertical axis leaves open where x is.
pub fn rotation(points: &[Option<VanishingPoint>; 3], focal_px: f64) -> Result<DMat3, NoRotation> {
    let mut axes =
        points.map(|point| point.map(|point| (point.direction(focal_px), point.sign.is_some())));
    let count = axes.iter().flatten().count();
    for i in 0..3 {
        let (Some((a, _)), Some((b, _))) = (axes[i], axes[(i + 1) % 3]) else { continue };
        if a.dot(b).abs() > ALIKE {
            return Err(NoRotation::Alike);
        }
    }
    match count {
        0 => return Err(NoRotation::TooFew),
        1 => {
            let Some(level) = (0..2).find(|&k| axes[k].is_some()) else {
                return Err(NoRotation::TooFew);
            };
            let Some((direction, _)) = axes[level] else { return Err(NoRotation::TooFew) };
            let up = direction.cross(DVec3::X).normalize_or_zero();
            // y is down in the image.
            axes[2] = Some((if up.y > 0.0 { -up } else { up }, true));
        }
        _ => {}
    }
    // An axis whose lines do not tell its direction takes it from the other two.
    for i in 0..3 {
        let (next, last) = ((i + 1) % 3, (i + 2) % 3);
        if let (Some((own, false)), Some((a, true)), Some((b, true))) =
            (axes[i], axes[next], axes[last])
        {
            axes[i] = Some((if a.cross(b).dot(own) < 0.0 { -own } else { own }, true));
        }
    }
    for i in 0..3 {
        let (next, last) = ((i + 1) % 3, (i + 2) % 3);
        if let (None, Some((a, true)), Some((b, true))) = (axes[i], axes[next], axes[last]) {
            axes[i] = Some((a.cross(b).normalize_or_zero(), true));
        }
    }
    if axes.iter().any(|axis| axis.is_none_or(|(_, is_told)| !is_told)) {
        return Err(NoRotation::TooFew);
    }
    let [x, y, z] = axes.map(|axis| axis.map_or(DVec3::ZERO, |axis| axis.0));
    let seen = DMat3::from_cols(x, y, z);
    if seen.determinant() < 0.0 {
        return Err(NoRotation::Mirrored);
    }
    let image_from_world = nearest_rotation(seen).ok_or(NoRotation::TooFew)?;
    Ok(world_from_camera(image_from_world))
}

/// The turn about the vertical that makes level lines run along x and y: `upright` is a rotation
/// (world from camera) that has z right. The mean over directed lines, by their lengths. `None`
/// without a line that tells.
pub fn turned_level(upright: DMat3, lines: [&[Line]; 2], focal_px: f64) -> Option<DMat3> {
    let mut sum = DVec2::ZERO;
    for (axis, lines) in lines.into_iter().enumerate() {
        for line in lines.iter().filter(|line| line.is_directed) {
            let seen = |pixel: DVec2| (pixel / focal_px).extend(1.0);
            let normal = upright * flip(seen(line.from).cross(seen(line.to)));
            // Level, and in the plane of the line and the camera.
            let along = normal.cross(DVec3::Z).normalize_or_zero();
            let direction = flip(upright.transpose() * along);
            let middle = 0.5 * (line.from + line.to) / focal_px;
            let shown = (direction.truncate() - middle * direction.z).dot(line.to - line.from);
            let along = along * shown.signum();
            // A quarter turn back for lines along y.
            let own = if axis == 0 { along.truncate() } else { -along.truncate().perp() };
            sum += own * line.from.distance(line.to);
        }
    }
    let length = sum.length();
    (length > 0.0).then(|| DMat3::from_rotation_z(-sum.y.atan2(sum.x)) * upright)
}

/// By how much lines along x, y and z miss a rotation, in pixels, summed: the distance of a line's
/// ends from where the axis would run, at most 10 (`MISSED_PX`), which also counts for a line that was
/// drawn against its axis.
pub fn misfit(rotation: DMat3, lines: &[Vec<Line>; 3], focal_px: f64) -> f64 {
    let mut sum = 0.0;
    for (axis, lines) in DVec3::AXES.into_iter().zip(lines) {
        let direction = flip(rotation.transpose() * axis);
        for line in lines {
            let middle = 0.5 * (line.from + line.to);
            let toward = direction.truncate() * focal_px - middle * direction.z;
            let (along, half) = (toward.normalize_or_zero(), 0.5 * (line.to - line.from));
            let is_against = line.is_directed && along.dot(half) < 0.0;
            let missed = half.perp_dot(along).abs();
            sum += if is_against { MISSED_PX } else { missed.min(MISSED_PX) };
        }
    }
    sum
}

/// A rotation that has z right and is turned about it in some way, from upright lines alone.
pub fn upright(point: &VanishingPoint, focal_px: f64) -> Option<DMat3> {
    point.sign?;
    let up = point.direction(focal_px);
    let x = (DVec3::X - up * up.x).normalize_or_zero();
    let seen = nearest_rotation(DMat3::from_cols(x, up.cross(x), up))?;
    Some(world_from_camera(seen))
}

/// From the axes as an image shows them (y down, z forward) to OpenGL's camera axes.
fn world_from_camera(image_from_world: DMat3) -> DMat3 {
    let columns = image_from_world.to_cols_array_2d();
    DMat3::from_cols_array_2d(&columns.map(|column| flip(DVec3::from(column)).to_array()))
        .transpose()
}
