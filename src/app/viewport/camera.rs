//! The free view and how the hand moves it. Plain data and functions; z is up.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Vec2, Vec3};

use crate::app::viewport::projection::{Projection, Range};

/// Tangent of half the vertical angle of view (40°).
const HALF_HEIGHT: f32 = 0.364;
/// Radians of a turn per point of the mouse's way.
const TURN: f32 = 0.006;

/// A view that turns about a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewCamera {
    pub target: Vec3,
    /// From the eye to the target in metres.
    pub distance: f32,
    /// Direction from the target to the eye: radians about z from +x, and above the horizon.
    pub azimuth: f32,
    pub elevation: f32,
    pub orthographic: bool,
}

impl Default for ViewCamera {
    fn default() -> Self {
        Self {
            target: Vec3::ZERO,
            distance: 8.0,
            azimuth: 0.7,
            elevation: 0.45,
            orthographic: false,
        }
    }
}

/// The views along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards +y.
    Front,
    Back,
    /// From +x.
    Right,
    Left,
    Top,
    Bottom,
}

impl ViewCamera {
    /// Right, up and backwards.
    pub fn axes(&self) -> [Vec3; 3] {
        let ((sin_a, cos_a), (sin_e, cos_e)) = (self.azimuth.sin_cos(), self.elevation.sin_cos());
        let right = Vec3::new(-sin_a, cos_a, 0.0);
        let back = Vec3::new(cos_e * cos_a, cos_e * sin_a, sin_e);
        [right, back.cross(right), back]
    }

    pub fn eye(&self) -> Vec3 {
        self.target + self.axes()[2] * self.distance
    }

    /// Draws what lies in the ball of the scene.
    pub fn projection(&self, size: Vec2, (center, radius): (Vec3, f32)) -> Projection {
        let back = self.axes()[2];
        // An orthographic eye stands outside of the scene, wherever the target is.
        let stand = if self.orthographic {
            self.distance.max((center - self.target).dot(back) + 3.0 * radius)
        } else {
            self.distance
        };
        let eye = self.target + back * stand;
        let far = (eye - center).length() + 3.0 * radius;
        let near = if self.orthographic {
            0.0
        } else {
            // Not beyond what is looked at from close by.
            (2e-3 * radius).min(0.1 * self.distance).max(1e-5 * far)
        };
        let half = if self.orthographic { HALF_HEIGHT * self.distance } else { HALF_HEIGHT };
        let range = Range { near: f64::from(near), far: f64::from(far) };
        Projection::free(eye, self.axes(), half, self.orthographic, size, range)
    }

    pub fn orbit(&mut self, drag: Vec2) {
        self.azimuth = (self.azimuth - drag.x * TURN).rem_euclid(TAU);
        self.elevation = (self.elevation + drag.y * TURN).clamp(-FRAC_PI_2, FRAC_PI_2);
    }

    /// Moves so that the target's plane follows the hand.
    pub fn pan(&mut self, drag: Vec2, height: f32) {
        let [right, up, _] = self.axes();
        let metres = 2.0 * HALF_HEIGHT * self.distance / height.max(1.0);
        self.target += (up * drag.y - right * drag.x) * metres;
    }

    /// Comes nearer by a factor below 1, keeping what is under the cursor where it is. `cursor`
    /// is counted from the window's middle in points, y down.
    pub fn zoom(&mut self, factor: f32, cursor: Vec2, height: f32, scene_radius: f32) {
        let low = 1e-3 * scene_radius.max(1e-3);
        let distance = (self.distance * factor).clamp(low, 100.0 * scene_radius.max(1.0));
        let metres = 2.0 * HALF_HEIGHT * (self.distance - distance) / height.max(1.0);
        let [right, up, _] = self.axes();
        self.target += (right * cursor.x - up * cursor.y) * metres;
        self.distance = distance;
    }

    /// Turns the head: the eye stays where it is.
    pub fn look(&mut self, drag: Vec2) {
        let eye = self.eye();
        self.azimuth = (self.azimuth - 0.5 * drag.x * TURN).rem_euclid(TAU);
        self.elevation = (self.elevation + 0.5 * drag.y * TURN).clamp(-FRAC_PI_2, FRAC_PI_2);
        self.target = eye - self.axes()[2] * self.distance;
    }

    /// Moves eye and target by metres to the right, forwards and up.
    pub fn fly(&mut self, way: Vec3) {
        let [right, _, back] = self.axes();
        self.target += right * way.x - back * way.y + Vec3::Z * way.z;
    }

    /// Shows a ball whole.
    pub fn frame(&mut self, center: Vec3, radius: f32, size: Vec2) {
        self.target = center;
        let narrow = (size.x / size.y.max(1.0)).min(1.0);
        let angle = (HALF_HEIGHT * narrow.max(0.05)).atan();
        self.distance = 1.05 * radius.max(1e-4) / angle.sin();
    }

    pub fn turn_to(&mut self, side: Side) {
        (self.azimuth, self.elevation) = match side {
            Side::Front => (-FRAC_PI_2, 0.0),
            Side::Back => (FRAC_PI_2, 0.0),
            Side::Right => (0.0, 0.0),
            Side::Left => (2.0 * FRAC_PI_2, 0.0),
            Side::Top => (-FRAC_PI_2, FRAC_PI_2),
            Side::Bottom => (-FRAC_PI_2, -FRAC_PI_2),
        };
    }

    /// Takes an eye's place and direction of sight, upright; it turns about what lies `distance`
    /// ahead.
    pub fn take(&mut self, eye: Vec3, forward: Vec3, distance: f32) {
        self.distance = distance.max(1e-3);
        self.elevation = (-forward.z).clamp(-1.0, 1.0).asin();
        self.azimuth = (-forward.y).atan2(-forward.x).rem_euclid(TAU);
        self.orthographic = false;
        self.target = eye - self.axes()[2] * self.distance;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Vec2 = Vec2::new(800.0, 600.0);

    fn camera() -> ViewCamera {
        ViewCamera { target: Vec3::new(1.0, 2.0, 0.5), ..ViewCamera::default() }
    }

    fn project(camera: &ViewCamera, point: Vec3) -> Vec2 {
        camera.projection(SIZE, (Vec3::ZERO, 5.0)).project(point).unwrap()
    }

    #[test]
    fn the_target_is_in_the_middle_and_z_is_up() {
        for orthographic in [false, true] {
            let camera = ViewCamera { orthographic, ..camera() };
            assert!((project(&camera, camera.target) - 0.5 * SIZE).length() < 1e-2);
            let above = project(&camera, camera.target + 0.5 * Vec3::Z);
            assert!(above.y < 0.5 * SIZE.y && (above.x - 0.5 * SIZE.x).abs() < 1e-2);
        }
    }

    #[test]
    fn zooming_keeps_what_is_under_the_cursor() {
        for orthographic in [false, true] {
            let mut camera = ViewCamera { orthographic, ..camera() };
            let [right, up, _] = camera.axes();
            let point = camera.target + 0.8 * right + 0.3 * up;
            let before = project(&camera, point);
            camera.zoom(0.6, before - 0.5 * SIZE, SIZE.y, 5.0);
            assert!((project(&camera, point) - before).length() < 0.05);
        }
    }

    #[test]
    fn the_closest_target_is_drawn() {
        let mut camera = camera();
        camera.zoom(0.0, Vec2::ZERO, SIZE.y, 5.0);
        let target = camera.target.as_dvec3().extend(1.0);
        let clip = camera.projection(SIZE, (Vec3::ZERO, 5.0)).clip_from_world * target;
        assert!((0.0..=clip.w).contains(&clip.z), "{clip}");
        let ray = camera.projection(SIZE, (Vec3::ZERO, 5.0)).ray(0.5 * SIZE);
        assert!(ray.t_min > 0.0 && ray.t_min < camera.distance);
    }

    #[test]
    fn panning_follows_the_hand_and_orbiting_keeps_the_distance() {
        let mut camera = camera();
        let point = camera.target;
        camera.pan(Vec2::new(30.0, -12.0), SIZE.y);
        let moved = project(&camera, point) - 0.5 * SIZE;
        assert!((moved - Vec2::new(30.0, -12.0)).length() < 0.05, "{moved}");
        let target = camera.target;
        camera.orbit(Vec2::new(100.0, 5000.0));
        assert_eq!((camera.target, camera.elevation), (target, FRAC_PI_2));
        assert!((camera.eye().distance(target) - camera.distance).abs() < 1e-4);
    }

    #[test]
    fn looking_about_keeps_the_eye() {
        let mut camera = camera();
        let eye = camera.eye();
        camera.look(Vec2::new(80.0, 20.0));
        assert!(camera.eye().distance(eye) < 1e-4);
    }

    #[test]
    fn a_framed_ball_fits_the_window() {
        for size in [SIZE, Vec2::new(300.0, 900.0)] {
            let mut camera = camera();
            let center = Vec3::new(-3.0, 1.0, 2.0);
            camera.frame(center, 2.0, size);
            let projection = camera.projection(size, (center, 2.0));
            let [right, up, _] = camera.axes();
            for offset in [right, -right, up, -up] {
                let p = projection.project(center + 2.0 * offset).unwrap();
                assert!(p.cmpge(Vec2::ZERO).all() && p.cmple(size).all(), "{p}");
            }
        }
    }

    #[test]
    fn sides_look_along_their_axes() {
        for (side, forward, up) in [
            (Side::Front, Vec3::Y, Vec3::Z),
            (Side::Right, -Vec3::X, Vec3::Z),
            (Side::Top, -Vec3::Z, Vec3::Y),
        ] {
            let mut camera = camera();
            camera.turn_to(side);
            let [_, drawn_up, back] = camera.axes();
            assert!((back + forward).length() < 1e-6 && (drawn_up - up).length() < 1e-6);
        }
    }

    #[test]
    fn a_taken_view_looks_from_there() {
        let mut camera = camera();
        let (eye, forward) = (Vec3::new(4.0, 1.0, 1.5), Vec3::new(-2.0, 0.5, -0.6));
        let forward = forward.normalize_or_zero();
        camera.take(eye, forward, 3.0);
        assert!(camera.eye().distance(eye) < 1e-5);
        assert!((camera.axes()[2] + forward).length() < 1e-5);
    }
}
