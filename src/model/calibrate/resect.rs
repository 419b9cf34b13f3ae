//! Resection: a camera from points of known position.
//!
//! Six or more points that are not in one plane give the projection by the direct linear
//! transformation; four or more points in a plane give it by the homography of the plane (Z. Zhang,
//! "A Flexible New Technique for Camera Calibration", 2000). Both also give the focal length if it
//! is unknown. Written on faer: `sqpnp` would bring a second matrix library, and takes points in
//! single precision.

use faer::{Mat, Side};
use glam::{DMat3, DVec2, DVec3};

use crate::model::unknowns::nearest_rotation;
use crate::model::view::{Pose, flip};

/// Points are in one plane where they leave it by less than this part of their extent.
const FLAT: f64 = 0.03;
/// A focal length beyond these parts of the image's diagonal is none of a camera.
const FOCAL_RANGE: (f64, f64) = (0.1, 50.0);

/// A point in the world and where it is seen, in pixels from the principal point and without
/// distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// In the world, in metres.
    pub point: DVec3,
    /// Where it is seen.
    pub pixel: DVec2,
}

/// Why points do not give a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoCamera {
    /// Fewer than four points, or fewer than six that are not in one plane.
    #[error("it shows too few corners that are placed: six are needed, or four in one plane")]
    TooFew,
    /// The points tell no plane.
    #[error("the corners that it shows lie on one line, or in one place")]
    OnALine,
    /// There is no perspective.
    #[error("the plane of the corners is seen face on, which leaves the focal length open")]
    FaceOn,
    /// Points behind the camera, or no rotation.
    #[error("no camera sees the corners where they were picked")]
    Impossible,
}

/// The camera's pose, and its focal length in pixels, which is the one that was given.
/// `diagonal_px` is the image's, for judging a focal length.
pub fn resect(
    sights: &[Sight],
    focal_px: Option<f64>,
    diagonal_px: f64,
) -> Result<(Pose, f64), NoCamera> {
    if sights.len() < 4 {
        return Err(NoCamera::TooFew);
    }
    let middle = sights.iter().map(|own| own.point).sum::<DVec3>() / sights.len() as f64;
    let (axes, extents) = spread(sights.iter().map(|own| own.point - middle));
    if extents[1] <= FLAT * extents[2] {
        return Err(NoCamera::OnALine);
    }
    let size = extents[2];
    // Coordinates along the main axes, in units of the extent.
    let local: Vec<(DVec3, DVec2)> = sights
        .iter()
        .map(|own| ((axes.transpose() * (own.point - middle)) / size, own.pixel / diagonal_px))
        .collect();
    let given = focal_px.map(|focal| focal / diagonal_px);
    let (matrix, shift, focal) = if extents[0] <= FLAT * extents[2] {
        by_plane(&local, given)?
    } else if sights.len() >= 6 {
        by_space(&local, given)?
    } else {
        return Err(NoCamera::TooFew);
    };
    if !(FOCAL_RANGE.0..FOCAL_RANGE.1).contains(&focal) {
        return Err(NoCamera::Impossible);
    }
    // image = matrix · axesᵀ (point − middle) / size + shift.
    let image_from_world = matrix * axes.transpose();
    let position = middle - image_from_world.transpose() * shift * size;
    let camera_from_world = DMat3::from_cols_array_2d(
        &image_from_world.to_cols_array_2d().map(|column| flip(DVec3::from(column)).to_array()),
    );
    let pose = Pose { world_from_camera: camera_from_world.transpose(), position };
    let before = sights.iter().filter(|own| pose.image_from_world(own.point).z > 0.0).count();
    if before < sights.len() || !position.is_finite() {
        return Err(NoCamera::Impossible);
    }
    Ok((pose, focal * diagonal_px))
}

/// Principal axes (a right-handed frame, the shortest extent last) and the extents, ascending.
fn spread(vectors: impl Iterator<Item = DVec3>) -> (DMat3, [f64; 3]) {
    let mut moments = Mat::<f64>::zeros(3, 3);
    for vector in vectors {
        for i in 0..3 {
            for j in 0..3 {
                moments[(i, j)] += vector[i] * vector[j];
            }
        }
    }
    let Ok(eigen) = moments.self_adjoint_eigen(Side::Lower) else {
        return (DMat3::IDENTITY, [0.0; 3]);
    };
    let axis = |k: usize| DVec3::new(eigen.U()[(0, k)], eigen.U()[(1, k)], eigen.U()[(2, k)]);
    let extent = |k: usize| eigen.S().column_vector()[k].max(0.0).sqrt();
    let (x, y) = (axis(2), axis(1));
    (DMat3::from_cols(x, y, x.cross(y)), [extent(0), extent(1), extent(2)])
}

/// Rotation, translation (y down, z forward) and focal length.
type Projection = (DMat3, DVec3, f64);

fn by_plane(local: &[(DVec3, DVec2)], given: Option<f64>) -> Result<Projection, NoCamera> {
    let rows = local.iter().flat_map(|(point, pixel)| {
        let at = DVec3::new(point.x, point.y, 1.0);
        equations(at, *pixel)
    });
    let h = null_vector(rows, 9)?;
    let matrix = DMat3::from_cols_slice(&h).transpose();
    let (mut a, mut b, mut c) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    if c.z < 0.0 {
        (a, b, c) = (-a, -b, -c);
    }
    let focal = match given {
        Some(focal) => focal,
        None => {
            // Two equations k + l / f² = 0.
            let flat = |v: DVec3, w: DVec3| v.truncate().dot(w.truncate());
            let pairs = [(a.z * b.z, flat(a, b)), (a.z * a.z - b.z * b.z, flat(a, a) - flat(b, b))];
            let above: f64 = -pairs.iter().map(|(k, l)| k * l).sum::<f64>();
            let below: f64 = pairs.iter().map(|(k, _)| k * k).sum();
            // The plane's vanishing line is then too far away to be seen.
            let scale = flat(a, a) + flat(b, b);
            if below.sqrt() <= 1e-3 * scale {
                return Err(NoCamera::FaceOn);
            }
            let square = above / below;
            if square <= 0.0 {
                return Err(NoCamera::Impossible);
            }
            square.sqrt()
        }
    };
    let back = |v: DVec3| DVec3::new(v.x / focal, v.y / focal, v.z);
    let (a, b, c) = (back(a), back(b), back(c));
    let size = (a.length() * b.length()).sqrt();
    if size < 1e-12 {
        return Err(NoCamera::Impossible);
    }
    let (x, y) = (a / size, b / size);
    let rotation = nearest_rotation(DMat3::from_cols(x, y, x.cross(y)));
    Ok((rotation.ok_or(NoCamera::Impossible)?, c / size, focal))
}

fn by_space(local: &[(DVec3, DVec2)], given: Option<f64>) -> Result<Projection, NoCamera> {
    let rows = local.iter().flat_map(|(point, pixel)| equations4(*point, *pixel));
    let p = null_vector(rows, 12)?;
    let row = |i: usize| DVec3::new(p[4 * i], p[4 * i + 1], p[4 * i + 2]);
    let mut matrix = DMat3::from_cols(row(0), row(1), row(2)).transpose();
    let mut shift = DVec3::new(p[3], p[7], p[11]);
    if matrix.determinant() < 0.0 {
        (matrix, shift) = (-matrix, -shift);
    }
    let lengths = [0, 1, 2].map(|i| matrix.row(i).length());
    let focal = given.unwrap_or((lengths[0] * lengths[1]).sqrt() / lengths[2].max(1e-12));
    let back = DVec3::new(1.0 / focal, 1.0 / focal, 1.0);
    let (matrix, shift) = (DMat3::from_diagonal(back) * matrix, back * shift);
    let size = matrix.determinant().cbrt();
    if size < 1e-12 {
        return Err(NoCamera::Impossible);
    }
    let rotation = nearest_rotation(matrix * (1.0 / size)).ok_or(NoCamera::Impossible)?;
    Ok((rotation, shift / size, focal))
}

/// That a pixel is the image of a point, for the rows of a 3 × 3 matrix.
fn equations(at: DVec3, pixel: DVec2) -> [Vec<f64>; 2] {
    [0, 1].map(|axis| {
        let mut row = vec![0.0; 9];
        for k in 0..3 {
            row[3 * axis + k] = at[k];
            row[6 + k] = -pixel[axis] * at[k];
        }
        row
    })
}

/// The same for a 3 × 4 matrix.
fn equations4(point: DVec3, pixel: DVec2) -> [Vec<f64>; 2] {
    let at = [point.x, point.y, point.z, 1.0];
    [0, 1].map(|axis| {
        let mut row = vec![0.0; 12];
        for k in 0..4 {
            row[4 * axis + k] = at[k];
            row[8 + k] = -pixel[axis] * at[k];
        }
        row
    })
}

/// The unit vector that the rows send nearest to zero, if it is the only one.
fn null_vector(rows: impl Iterator<Item = Vec<f64>>, count: usize) -> Result<Vec<f64>, NoCamera> {
    let mut normal = Mat::<f64>::zeros(count, count);
    for row in rows {
        for i in 0..count {
            for j in 0..count {
                normal[(i, j)] += row[i] * row[j];
            }
        }
    }
    let eigen = normal.self_adjoint_eigen(Side::Lower).map_err(|_| NoCamera::Impossible)?;
    let values = eigen.S().column_vector();
    if values[1] <= 1e-13 * values[count - 1] {
        return Err(NoCamera::OnALine);
    }
    Ok((0..count).map(|i| eigen.U()[(i, 0)]).collect())
}
