//! Images of all directions in latitude and longitude, z up: the left edge looks along +y, the middle
//! along −y, and what is right of the left edge along +x. Places are across and down, both 0 to 1.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

/// The unit direction of a place.
pub fn direction(place: Vec2) -> Vec3 {
    let (azimuth, polar) = (place.x * TAU, place.y * PI);
    Vec3::new(polar.sin() * azimuth.sin(), polar.sin() * azimuth.cos(), polar.cos())
}

/// Column and row, of so many each, that a unit direction falls into.
pub fn cell(direction: Vec3, (columns, rows): (usize, usize)) -> (usize, usize) {
    let azimuth = direction.x.atan2(direction.y).rem_euclid(TAU);
    // The angle from the zenith; acos would lose half the digits near the poles.
    let polar = direction.truncate().length().atan2(direction.z);
    let index = |part: f32, count: usize| ((part * count as f32) as usize).min(count - 1);
    (index(azimuth / TAU, columns), index(polar / PI, rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_cells_agree() {
        for (place, towards) in [
            ((0.0, 0.5), Vec3::Y),
            ((0.25, 0.5), Vec3::X),
            ((0.5, 0.5), Vec3::NEG_Y),
            ((0.7, 0.0), Vec3::Z),
            ((0.1, 1.0), Vec3::NEG_Z),
        ] {
            assert!(direction(place.into()).distance(towards) < 1e-6, "{place:?}");
        }
        let size = (36, 18);
        for (column, row) in
            (0..size.0).flat_map(|column| (0..size.1).map(move |row| (column, row)))
        {
            let middle = Vec2::new((column as f32 + 0.5) / 36.0, (row as f32 + 0.5) / 18.0);
            assert_eq!(cell(direction(middle), size), (column, row));
        }
        assert_eq!([Vec3::Z, Vec3::NEG_Z].map(|pole| cell(pole, size).1), [0, 17]);
    }
}
