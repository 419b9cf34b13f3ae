//! Calibrated cameras: from points to pixels and from pixels to rays.
//!
//! Camera axes are OpenGL's (+x right, +y up, looking along −z). Pixel coordinates are counted
//! from the image's top left corner, so the centre of the first pixel is (0.5, 0.5).
//! Distortion is applied here, where points are projected and rays are made, so images are
//! used as they are.

use glam::{DMat3, DVec2, DVec3};

use crate::geometry::bvh::Ray;

/// OpenCV's radial and tangential lens distortion, acting on normalised image coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// The factors of r², r⁴, r⁶ and r⁸: k1 to k4 of the polynomial models.
    pub radial: [f64; 4],
    /// p1 and p2.
    pub tangential: [f64; 2],
    /// The factors of r², r⁴ and r⁶ in the denominator of OpenCV's rational model, which calls
    /// them k4 to k6. Zero in the polynomial models.
    pub denominator: [f64; 3],
}

/// A pinhole camera with distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub width: usize,
    pub height: usize,
    pub focal_px: DVec2,
    pub principal_px: DVec2,
    pub distortion: Distortion,
    /// Columns are the camera's axes in the world; a rotation.
    pub world_from_camera: DMat3,
    pub position: DVec3,
    /// Largest undistorted radius (tangent of the angle to the optical axis) up to which the
    /// radial distortion is monotonic; beyond it points would fold back into the image.
    reach: f64,
}

impl Distortion {
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The distorted position of an undistorted normalised image point (y down).
    pub fn apply(&self, p: DVec2) -> DVec2 {
        let r2 = p.length_squared();
        let [p1, p2] = self.tangential;
        p * self.radial_factor(r2)
            + DVec2::new(
                2.0 * p1 * p.x * p.y + p2 * (r2 + 2.0 * p.x * p.x),
                p1 * (r2 + 2.0 * p.y * p.y) + 2.0 * p2 * p.x * p.y,
            )
    }

    fn radial_factor(&self, r2: f64) -> f64 {
        self.numerator(r2) / self.divisor(r2)
    }

    fn numerator(&self, r2: f64) -> f64 {
        let [k1, k2, k3, k4] = self.radial;
        1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)))
    }

    fn divisor(&self, r2: f64) -> f64 {
        let [k4, k5, k6] = self.denominator;
        1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    }

    /// d(distorted radius)/d(radius) of the radial part.
    fn radial_slope(&self, r2: f64) -> f64 {
        let [k1, k2, k3, k4] = self.radial;
        let slope = 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * (7.0 * k3 + r2 * 9.0 * k4)));
        let [k4, k5, k6] = self.denominator;
        // (r n / d)' = ((r n)' − (r n) d' / d) / d.
        let divisor_slope = r2 * (2.0 * k4 + r2 * (4.0 * k5 + r2 * 6.0 * k6));
        let divisor = self.divisor(r2);
        (slope - self.numerator(r2) * divisor_slope / divisor) / divisor
    }

    /// The undistorted point whose distorted position is `p`; `None` where none is found within
    /// `reach` (Newton's method on the two coordinates, to 1e-12).
    fn invert(&self, p: DVec2, reach: f64) -> Option<DVec2> {
        if self.is_none() {
            return Some(p);
        }
        let mut q = p;
        for _ in 0..50 {
            let error = self.apply(q) - p;
            if error.length() < 1e-12 {
                return (q.length() <= reach).then_some(q);
            }
            let h = 1e-7;
            let dx = (self.apply(q + DVec2::X * h) - self.apply(q - DVec2::X * h)) / (2.0 * h);
            let dy = (self.apply(q + DVec2::Y * h) - self.apply(q - DVec2::Y * h)) / (2.0 * h);
            let determinant = dx.x * dy.y - dy.x * dx.y;
            if determinant.abs() < 1e-12 {
                return None;
            }
            q -= DVec2::new(
                (dy.y * error.x - dy.x * error.y) / determinant,
                (dx.x * error.y - dx.y * error.x) / determinant,
            );
            if !q.is_finite() || q.length() > 10.0 * (reach.min(1e3) + 1.0) {
                return None;
            }
        }
        None
    }
}

impl Camera {
    pub fn new(
        (width, height): (usize, usize),
        focal_px: DVec2,
        principal_px: DVec2,
        distortion: Distortion,
        world_from_camera: DMat3,
        position: DVec3,
    ) -> Self {
        let reach = monotonic_reach(&distortion);
        Self {
            width,
            height,
            focal_px,
            principal_px,
            distortion,
            world_from_camera,
            position,
            reach,
        }
    }

    /// The largest tangent of the angle to the optical axis at which the lens is defined.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The same camera with pixels `step` times as wide; those beyond the last whole one go.
    pub fn reduced(&self, step: usize) -> Self {
        let (step, factor) = (step.max(1), 1.0 / step.max(1) as f64);
        Self {
            width: self.width / step,
            height: self.height / step,
            focal_px: self.focal_px * factor,
            principal_px: self.principal_px * factor,
            ..*self
        }
    }

    /// Where a world point appears, in pixels, and its distance from the camera in metres;
    /// `None` behind the camera, outside the image, or beyond the lens model's reach.
    pub fn project(&self, point: DVec3) -> Option<(DVec2, f64)> {
        let pixel = self.place(point)?;
        let inside = pixel.x >= 0.0
            && pixel.y >= 0.0
            && pixel.x < self.width as f64
            && pixel.y < self.height as f64;
        inside.then(|| (pixel, (point - self.position).length()))
    }

    /// The same for the pixel alone, which may lie outside of the image.
    pub fn place(&self, point: DVec3) -> Option<DVec2> {
        let local = self.world_from_camera.transpose() * (point - self.position);
        if local.z >= 0.0 {
            return None;
        }
        // Image coordinates have y down.
        let undistorted = DVec2::new(local.x / -local.z, -local.y / -local.z);
        let distorted = if self.distortion.is_none() {
            undistorted
        } else {
            if undistorted.length() > self.reach {
                return None;
            }
            self.distortion.apply(undistorted)
        };
        Some(distorted * self.focal_px + self.principal_px)
    }

    /// The unit world direction in which a pixel position looks; `None` where the distortion
    /// cannot be undone.
    pub fn direction(&self, pixel: DVec2) -> Option<DVec3> {
        let distorted = (pixel - self.principal_px) / self.focal_px;
        let p = self.distortion.invert(distorted, self.reach)?;
        Some((self.world_from_camera * DVec3::new(p.x, -p.y, -1.0)).normalize())
    }

    /// The ray from the camera through a pixel position, which goes on for ever; `None` where the
    /// distortion cannot be undone.
    pub fn ray(&self, pixel: DVec2) -> Option<Ray> {
        let direction = self.direction(pixel)?.as_vec3();
        let origin = self.position.as_vec3();
        Some(Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY })
    }
}

/// The radius up to which distorted radius grows with radius, by a scan of the slope's sign.
fn monotonic_reach(distortion: &Distortion) -> f64 {
    if distortion.radial == [0.0; 4] && distortion.denominator == [0.0; 3] {
        return f64::INFINITY;
    }
    // tan 84°: wider than any perspective lens.
    let (step, limit) = (0.005, 10.0);
    let mut radius = 0.0;
    while radius < limit {
        radius += step;
        let r2 = radius * radius;
        // Beyond a zero of the divisor the model means nothing.
        if distortion.divisor(r2) <= 0.0 || distortion.radial_slope(r2) <= 0.0 {
            return radius - step;
        }
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wide(distortion: Distortion) -> Camera {
        let turn = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(1.1);
        Camera::new(
            (640, 480),
            DVec2::new(500.0, 510.0),
            DVec2::new(310.0, 245.0),
            distortion,
            turn,
            DVec3::new(1.0, -2.0, 0.5),
        )
    }

    #[test]
    fn a_ray_through_a_pixel_projects_back_to_it() {
        let strong = Distortion {
            radial: [-0.2, 0.05, 0.01, 0.0],
            tangential: [1e-3, -2e-3],
            ..Default::default()
        };
        let rational = Distortion { denominator: [0.3, -0.02, 0.01], ..strong };
        for distortion in [Distortion::default(), strong, rational] {
            let camera = wide(distortion);
            for (x, y) in [(0.5, 0.5), (310.0, 245.0), (639.5, 479.5), (12.25, 400.75)] {
                let pixel = DVec2::new(x, y);
                let direction = camera.direction(pixel).unwrap();
                let (back, distance) = camera.project(camera.position + 3.0 * direction).unwrap();
                assert!((back - pixel).length() < 1e-8, "{pixel} became {back}");
                assert!((distance - 3.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn points_behind_and_beyond_the_lens_are_not_seen() {
        let camera = wide(Distortion { radial: [-0.5, 0.0, 0.0, 0.0], ..Default::default() });
        let forward = camera.world_from_camera * DVec3::new(0.0, 0.0, -1.0);
        assert!(camera.project(camera.position - forward).is_none());
        // The radial slope 1 − 1.5 r² vanishes at r = 0.8165. A point at r = 1.35 folds back to
        // a distorted radius of 0.12, well inside the image, and must not be seen there.
        let side = camera.world_from_camera * DVec3::new(1.35, 0.0, -1.0);
        assert!(camera.project(camera.position + side).is_none());
    }
}
