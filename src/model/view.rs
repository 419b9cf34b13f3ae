//! A camera in the adjustment: a lens and a pose, with the derivatives of its projection.
//!
//! The lens is OpenCV's pinhole with the radial terms k1 and k2 and square pixels. Camera axes
//! are OpenGL's, as in [`Camera`]; *image coordinates* are normalised, with y down and z forward.

use glam::{DMat2, DMat3, DQuat, DVec2, DVec3};

use crate::scene::{Camera, Distortion};

/// The numbers of a lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optic {
    /// Focal length in pixels.
    pub focal_px: f64,
    /// Principal point in pixels from the image's top left corner.
    pub principal_px: DVec2,
    /// OpenCV's k1 and k2.
    pub radial: DVec2,
}

/// Where a camera stands and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Columns are the camera's axes in the world; a rotation.
    pub world_from_camera: DMat3,
    /// Metres.
    pub position: DVec3,
}

/// A projected point with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Projected {
    /// Pixels.
    pub pixel: DVec2,
    /// By the point, in pixels a metre; by the camera's position it is the negative. Columns are
    /// the three axes of the world.
    pub by_point: [DVec2; 3],
    /// By a small turn of the camera about its own axes, in pixels a radian.
    pub by_turn: [DVec2; 3],
    /// By focal length, and by k1 and k2. By the principal point it is the unit matrix.
    pub by_focal: DVec2,
    /// By k1 and k2.
    pub by_radial: [DVec2; 2],
}

/// A pixel's place in the undistorted image, with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Undistorted {
    /// Normalised, y down.
    pub place: DVec2,
    /// By the focal length, the principal point's coordinates, k1 and k2.
    pub by_lens: [DVec2; 5],
}

impl Optic {
    /// Focal length, principal point (x, y), k1, k2.
    pub fn numbers(&self) -> [f64; 5] {
        let Self { focal_px, principal_px, radial } = self;
        [*focal_px, principal_px.x, principal_px.y, radial.x, radial.y]
    }

    /// How the lens distorts a normalised point, and the derivative of that.
    fn distort(&self, u: DVec2) -> (DVec2, DMat2) {
        let r2 = u.length_squared();
        let factor = 1.0 + r2 * (self.radial.x + r2 * self.radial.y);
        let slope = 2.0 * (self.radial.x + 2.0 * r2 * self.radial.y);
        let outer = DMat2::from_cols(u * u.x, u * u.y);
        (u * factor, DMat2::from_diagonal(DVec2::splat(factor)) + outer * slope)
    }

    /// Where a pixel would be without distortion; `None` where the distortion cannot be undone.
    pub fn undistort(&self, pixel: DVec2) -> Option<Undistorted> {
        let distorted = (pixel - self.principal_px) / self.focal_px;
        let mut u = distorted;
        // Newton's method; without distortion the first step is zero.
        for _ in 0..50 {
            let (image, slope) = self.distort(u);
            // The branch that begins at the middle of the image ends where the slope vanishes.
            if slope.determinant() <= 1e-9 || !u.is_finite() {
                return None;
            }
            let step = slope.inverse() * (image - distorted);
            u -= step;
            if step.length() <= 1e-15 * (1.0 + u.length()) {
                break;
            }
        }
        let (image, slope) = self.distort(u);
        if (image - distorted).length() > 1e-9 || slope.determinant() <= 1e-9 {
            return None;
        }
        let (back, r2) = (slope.inverse(), u.length_squared());
        let by_lens = [
            -distorted / self.focal_px,
            DVec2::NEG_X / self.focal_px,
            DVec2::NEG_Y / self.focal_px,
            -u * r2,
            -u * (r2 * r2),
        ]
        .map(|by| back * by);
        Some(Undistorted { place: u, by_lens })
    }

    /// The unit direction of a pixel in the camera's axes; `None` as for [`Self::undistort`].
    pub fn ray(&self, pixel: DVec2) -> Option<DVec3> {
        let place = self.undistort(pixel)?.place;
        Some(DVec3::new(place.x, -place.y, -1.0).normalize_or_zero())
    }
}

impl Pose {
    /// A world point in the camera's axes, y down and z forward.
    pub fn image_from_world(&self, point: DVec3) -> DVec3 {
        flip(self.world_from_camera.transpose() * (point - self.position))
    }

    /// The pose after a small turn about the camera's own axes, in radians, and a move in metres.
    pub fn moved(&self, turn: DVec3, shift: DVec3) -> Self {
        let turned = self.world_from_camera * DMat3::from_quat(DQuat::from_scaled_axis(turn));
        // Many small turns would let rounding grow.
        let world_from_camera = DMat3::from_quat(DQuat::from_mat3(&turned).normalize());
        Self { world_from_camera, position: self.position + shift }
    }

    /// Where a lens at this pose shows a point; `None` for a point that is not before the camera.
    pub fn project(&self, lens: &Optic, point: DVec3) -> Option<Projected> {
        let p = self.image_from_world(point);
        if p.z <= 1e-9 {
            return None;
        }
        let u = p.truncate() / p.z;
        let (distorted, slope) = lens.distort(u);
        // By the place in the camera's axes.
        let inner = slope * (lens.focal_px / p.z);
        let by_place = |v: DVec3| inner * (v.truncate() - u * v.z);
        let r2 = u.length_squared();
        Some(Projected {
            pixel: distorted * lens.focal_px + lens.principal_px,
            by_point: DVec3::AXES
                .map(|axis| by_place(flip(self.world_from_camera.transpose() * axis))),
            by_turn: turned(p).map(by_place),
            by_focal: distorted,
            by_radial: [u * (r2 * lens.focal_px), u * (r2 * r2 * lens.focal_px)],
        })
    }

    /// The camera of the scene that this is.
    pub fn camera(&self, lens: &Optic, size: (usize, usize)) -> Camera {
        let distortion =
            Distortion { radial: [lens.radial.x, lens.radial.y, 0.0, 0.0], ..Default::default() };
        let focal = DVec2::splat(lens.focal_px);
        Camera::new(
            size,
            focal,
            lens.principal_px,
            distortion,
            self.world_from_camera,
            self.position,
        )
    }
}

/// How a vector in the camera's axes (y down, z forward) changes with a turn of the camera about
/// each of its OpenGL axes.
pub fn turned(p: DVec3) -> [DVec3; 3] {
    // A turn w takes l to l − w × l.
    let local = flip(p);
    DVec3::AXES.map(|axis| flip(local.cross(axis)))
}

/// Between OpenGL's camera axes and those with y down and z forward.
pub fn flip(v: DVec3) -> DVec3 {
    DVec3::new(v.x, -v.y, -v.z)
}
