//! An environment map: a photographed or painted sky, infinitely far away.

use std::f32::consts::{PI, TAU};
use std::path::PathBuf;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::math::rgb::{CHANNELS, Radiance};
use crate::math::sampling::{Frame, square_to_uniform_cone};
use crate::scene::Image;

/// A light probe in latitude and longitude, z up; as follows where it is not turned.
///
/// The top edge of the image is straight up, the bottom edge straight down, and rows are evenly
/// spaced in the angle from the zenith. The left edge looks along +y; to the right the view turns
/// by the compass, over +x, −y (the middle of the image) and −x back to +y. That is the image of
/// Mitsuba's `envmap`, turned by 90° about x so that its y axis points up.
#[derive(Clone, Debug)]
pub struct Dome {
    /// Where the image was read from; empty for one that is in no file.
    pub file: PathBuf,
    pub image: Arc<Image>,
    /// Factor that brings the image's values to the capture's unit of radiance.
    pub scale: f32,
    /// The angle by which it is turned about z, counter-clockwise seen from above, in radians.
    pub turn: f32,
}

impl PartialEq for Dome {
    fn eq(&self, other: &Self) -> bool {
        // Most often it is the same image, whose pixels then need no look.
        self.file == other.file
            && (self.scale, self.turn) == (other.scale, other.turn)
            && (Arc::ptr_eq(&self.image, &other.image) || self.image == other.image)
    }
}

impl Dome {
    /// A dome whose image is in no file, not turned.
    pub fn new(image: Arc<Image>, scale: f32) -> Self {
        Self { file: PathBuf::new(), image, scale, turn: 0.0 }
    }

    /// Where the middle of the image lies.
    pub fn middle(&self) -> Vec3 {
        Vec3::new(self.turn.sin(), -self.turn.cos(), 0.0)
    }

    /// Radiance that arrives from a unit direction (away from the scene), interpolated between
    /// the four nearest pixel centres. Pixels that are no radiance count as black.
    pub fn radiance(&self, direction: Vec3) -> Radiance {
        let (width, height) = (self.image.width(), self.image.height());
        if width == 0 || height == 0 {
            return [0.0; CHANNELS];
        }
        // Clockwise from +y, as the image's columns run.
        let azimuth = direction.x.atan2(direction.y) + self.turn;
        // The angle from the zenith; acos would lose half the digits near the poles.
        let polar = direction.truncate().length().atan2(direction.z);
        let (left, across) = cell(azimuth / TAU * width as f32 - 0.5);
        let (top, down) = cell(polar / PI * height as f32 - 0.5);
        let mut sum = [0.0; CHANNELS];
        for (row, row_weight) in [(top, 1.0 - down), (top + 1, down)] {
            for (column, column_weight) in [(left, 1.0 - across), (left + 1, across)] {
                // Columns go round; at the poles the last row goes on.
                let x = column.rem_euclid(width as i64) as usize;
                let y = row.clamp(0, height as i64 - 1) as usize;
                let Some(pixel) = self.image.radiance(x, y) else { continue };
                for (sum, value) in sum.iter_mut().zip(pixel) {
                    *sum += self.scale * row_weight * column_weight * value;
                }
            }
        }
        sum
    }

    /// Mean radiance over the cone of half an angle (radians) about a unit direction.
    pub fn mean_radiance(&self, direction: Vec3, half_angle: f32) -> Radiance {
        const SIDE: usize = 16;
        let frame = Frame::about(direction);
        let cap = 2.0 * (0.5 * half_angle).sin().powi(2);
        let mut sum = [0.0; CHANNELS];
        for cell in 0..SIDE * SIDE {
            let square = Vec2::new((cell % SIDE) as f32 + 0.5, (cell / SIDE) as f32 + 0.5);
            let local = square_to_uniform_cone(square / SIDE as f32, cap);
            let radiance = self.radiance(frame.to_world(local));
            for (sum, value) in sum.iter_mut().zip(radiance) {
                *sum += value / (SIDE * SIDE) as f32;
            }
        }
        sum
    }
}

/// A position in pixel centres as the one before it and the fraction beyond.
fn cell(position: f32) -> (i64, f32) {
    (position.floor() as i64, position - position.floor())
}
