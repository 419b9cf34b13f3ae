//! Rotations as files state them, which may be scaled, rounded, mirrored or invalid.

use glam::DMat3;

/// A rotation may be off by rounding (silently), or by a little (with a warning).
const ROUNDING: f64 = 1e-4;
const TOLERATED: f64 = 2e-2;

/// A matrix read as a rotation, and what had to be done to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Orientation {
    pub rotation: DMat3,
    /// A scale was taken out.
    pub is_scaled: bool,
    /// It was not quite orthogonal; this is the nearest rotation.
    pub is_sheared: bool,
}

/// Why a matrix is no orientation of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoRotation {
    Mirrored,
    Deformed,
}

/// The nearest rotation to a matrix that is one up to scale and rounding.
pub(crate) fn orientation(matrix: DMat3) -> Result<Orientation, NoRotation> {
    let determinant = matrix.determinant();
    if determinant < 0.0 {
        return Err(NoRotation::Mirrored);
    }
    let scale = determinant.cbrt();
    if !scale.is_finite() || scale < 1e-12 {
        return Err(NoRotation::Deformed);
    }
    let matrix = matrix * (1.0 / scale);
    let error = deviation(matrix);
    // NaN is no rotation either.
    if !matches!(error.partial_cmp(&TOLERATED), Some(std::cmp::Ordering::Less)) {
        return Err(NoRotation::Deformed);
    }
    Ok(Orientation {
        rotation: nearest_rotation(matrix),
        is_scaled: (scale - 1.0).abs() > ROUNDING,
        is_sheared: error > ROUNDING,
    })
}

/// The largest entry of RᵀR − 1; NaN where an entry is none.
fn deviation(matrix: DMat3) -> f64 {
    let difference = matrix.transpose() * matrix - DMat3::IDENTITY;
    let larger = |largest: f64, entry: f64| {
        if entry.is_nan() { f64::NAN } else { entry.abs().max(largest) }
    };
    difference.to_cols_array().into_iter().fold(0.0, larger)
}

/// Newton's iteration for the orthogonal polar factor.
fn nearest_rotation(mut matrix: DMat3) -> DMat3 {
    for _ in 0..20 {
        if deviation(matrix) < 1e-15 {
            break;
        }
        matrix = (matrix + matrix.inverse().transpose()) * 0.5;
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_rotation_is_refused() {
        let turn = DMat3::from_rotation_z(0.4);
        let scaled = orientation(turn * 3.0).unwrap();
        assert!(scaled.is_scaled && !scaled.is_sheared);
        assert!(deviation(scaled.rotation) < 1e-14);
        assert_eq!(
            orientation(DMat3::from_diagonal((1., 1., -1.).into())),
            Err(NoRotation::Mirrored)
        );
        for wrong in [DMat3::ZERO, DMat3::from_diagonal((1., 1., f64::NAN).into()), turn * f64::MAX]
        {
            assert_eq!(orientation(wrong), Err(NoRotation::Deformed));
        }
    }
}
