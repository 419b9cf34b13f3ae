//! How a photograph's pixels are turned, or mirrored, before they are used: EXIF's orientation.
//!
//! Cameras write the pixels as the sensor lay, and say in EXIF how it was held. A frame of a camera
//! file says by `orientation` that its photograph is turned; `w`, `h` and the lens are then those of
//! the upright photograph. Without it, pixels are used as they are stored, whatever EXIF says: so
//! cameras of programs that leave EXIF aside (COLMAP) stay true.

use glam::{DMat3, DVec2};

use super::Error;
use super::json::Field;
use crate::scene::{Camera, Distortion};

/// One of EXIF's eight (CIPA DC-008, tag 0x0112).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orientation(u32);

impl Default for Orientation {
    /// Pixels are stored upright.
    fn default() -> Self {
        Self(1)
    }
}

impl Orientation {
    /// `None` of a number that EXIF does not know.
    pub fn of(exif: u32) -> Option<Self> {
        (1..=8).contains(&exif).then_some(Self(exif))
    }

    /// EXIF's number for it.
    pub fn exif(self) -> u32 {
        self.0
    }

    pub fn is_upright(self) -> bool {
        self.0 == 1
    }

    /// Pixels are stored as in a mirror.
    pub fn is_mirrored(self) -> bool {
        matches!(self.0, 2 | 4 | 5 | 7)
    }

    /// Where the upright photograph shows what is stored at a place from the middle: the columns
    /// are the directions of the stored photograph's x (right) and y (down).
    fn axes(self) -> [DVec2; 2] {
        let (x, y) = (DVec2::X, DVec2::Y);
        match self.0 {
            2 => [-x, y],
            3 => [-x, -y],
            4 => [x, -y],
            5 => [y, x],
            6 => [y, -x],
            7 => [-y, -x],
            8 => [-y, x],
            _ => [x, y],
        }
    }

    /// Width and height of the upright photograph from those that are stored, and the other way
    /// round.
    pub fn size(self, (width, height): (usize, usize)) -> (usize, usize) {
        if self.0 >= 5 { (height, width) } else { (width, height) }
    }

    /// The place in the upright photograph of a place in the stored one, both in pixels from the
    /// top left corner; `stored` is the stored size.
    pub fn place(self, stored: (usize, usize), pixel: DVec2) -> DVec2 {
        let half = |(width, height)| 0.5 * DVec2::new(width as f64, height as f64);
        let [x, y] = self.axes();
        let from_middle = pixel - half(stored);
        half(self.size(stored)) + x * from_middle.x + y * from_middle.y
    }

    /// The upright photograph, row by row from the top, of the stored one.
    pub fn turn<T: Copy>(self, stored: (usize, usize), pixels: Vec<T>) -> Vec<T> {
        if self.is_upright() {
            return pixels;
        }
        let ((width, height), (own_width, own_height)) = (self.size(stored), stored);
        let [x, y] = self.axes().map(|axis| [axis.x as i64, axis.y as i64]);
        // A stored coordinate counts along the upright one that its axis lies in.
        let along = |axis: [i64; 2], place: [usize; 2], side: usize| {
            let (own, sign) = if axis[0] == 0 { (place[1], axis[1]) } else { (place[0], axis[0]) };
            if sign < 0 { side - 1 - own } else { own }
        };
        let at = |place| along(y, place, own_height) * own_width + along(x, place, own_width);
        let places = (0..height).flat_map(|v| (0..width).map(move |u| [u, v]));
        places.map(|place| pixels[at(place)]).collect()
    }

    /// The camera of the upright photograph, from that of the stored one. A camera cannot be
    /// mirrored: `None`.
    pub fn camera(self, stored: &Camera) -> Option<Camera> {
        if self.is_mirrored() {
            return None;
        }
        let [x, y] = self.axes();
        let turned = |of: DVec2| x * of.x + y * of.y;
        let size = (stored.width, stored.height);
        // OpenCV's p2 and p1 go with x and y.
        let [p1, p2] = stored.distortion.tangential;
        let tangential = turned(DVec2::new(p2, p1));
        let distortion =
            Distortion { tangential: [tangential.y, tangential.x], ..stored.distortion };
        // The upright photograph's x and y (down) in the stored one's, and from there in the world.
        let own = &stored.world_from_camera;
        let axis = |upright: DVec2| upright.dot(x) * own.x_axis - upright.dot(y) * own.y_axis;
        let rotation = DMat3::from_cols(axis(DVec2::X), -axis(DVec2::Y), own.z_axis);
        Some(Camera::new(
            self.size(size),
            turned(stored.focal_px).abs(),
            self.place(size, stored.principal_px),
            distortion,
            rotation,
            stored.position,
        ))
    }
}

/// What `orientation` of a frame says; upright where it says nothing.
pub(super) fn of_frame(frame: &Field) -> Result<Orientation, Error> {
    let Some(field) = frame.get("orientation") else { return Ok(Orientation::default()) };
    let number = field.number()?;
    let whole = Some(number as u32).filter(|whole| f64::from(*whole) == number);
    whole.and_then(Orientation::of).ok_or_else(|| {
        field.wrong_with(
            "this is no orientation that EXIF knows",
            "Give a whole number from 1 (upright) to 8, or leave it out",
        )
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn all() -> impl Iterator<Item = Orientation> {
        (1..=8).filter_map(Orientation::of)
    }

    /// The `image` crate turns pictures by code of its own.
    #[test]
    fn pixels_lie_where_another_program_puts_them() {
        let (width, height) = (5, 3);
        let codes: Vec<u8> = (0..15).collect();
        for own in all() {
            let stored = image::GrayImage::from_raw(width, height, codes.clone()).unwrap();
            let mut theirs = image::DynamicImage::ImageLuma8(stored);
            let exif = image::metadata::Orientation::from_exif(own.exif() as u8).unwrap();
            theirs.apply_orientation(exif);
            let ours = own.turn((5, 3), codes.clone());
            assert_eq!(ours, theirs.to_luma8().into_raw(), "orientation {}", own.exif());
            let size = own.size((5, 3));
            assert_eq!(size, (theirs.width() as usize, theirs.height() as usize));
            // The middle of each pixel goes where the pixel goes.
            for (code, pixel) in codes.iter().enumerate() {
                let middle = DVec2::new((code % 5) as f64, (code / 5) as f64) + 0.5;
                let place = own.place((5, 3), middle) - 0.5;
                assert_eq!(ours[place.y as usize * size.0 + place.x as usize], *pixel);
            }
        }
    }

    #[test]
    fn a_turned_camera_shows_points_at_their_turned_places() {
        let distortion = Distortion {
            radial: [-0.11, 0.02, 0.004, -0.001],
            tangential: [0.013, -0.021],
            denominator: [0.01, 0.002, 0.0],
        };
        let rotation = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -0.5, 1.1);
        let (focal, principal) = (DVec2::new(610.0, 590.0), DVec2::new(300.0, 270.0));
        let position = DVec3::new(0.4, -1.0, 2.0);
        let camera = Camera::new((640, 480), focal, principal, distortion, rotation, position);
        let mut compared = 0;
        for own in all() {
            let Some(turned) = own.camera(&camera) else {
                assert!(own.is_mirrored());
                continue;
            };
            assert!((turned.world_from_camera.determinant() - 1.0).abs() < 1e-12);
            for index in 0..40 {
                let across = DVec2::new(f64::from(index % 8) - 3.5, f64::from(index / 8) - 2.0);
                let point = position + rotation * (across * 0.11).extend(-1.0) * 3.0;
                let Some((pixel, depth)) = camera.project(point) else { continue };
                let (theirs, their_depth) = turned.project(point).unwrap();
                assert!(own.place((640, 480), pixel).distance(theirs) < 1e-9);
                assert!((depth - their_depth).abs() < 1e-12);
                compared += 1;
            }
        }
        assert!(compared > 100, "{compared}");
    }
}
