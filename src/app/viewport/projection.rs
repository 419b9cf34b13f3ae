//! From world to window and back, for the free view and for a photograph's own camera.

use glam::{DMat3, DMat4, DVec2, DVec3, DVec4, Mat4, Vec2, Vec3};

use crate::geometry::bvh::Ray;
use crate::scene::{Camera, Distortion};

/// The part of the image plane that a photograph fills once its lens's distortion is undone, in
/// pixels of a camera without any: upper left and lower right corner. Beyond twice the photograph's
/// own size the rim of very wide lenses is left out, so that its middle keeps its sharpness.
pub fn window(camera: &Camera) -> (DVec2, DVec2) {
    let size = DVec2::new(camera.width as f64, camera.height as f64);
    if camera.distortion.is_none() {
        return (DVec2::ZERO, size);
    }
    const STEPS: usize = 16;
    let edge = (0..=STEPS).map(|step| step as f64 / STEPS as f64).flat_map(|t| {
        [DVec2::new(t, 0.0), DVec2::new(t, 1.0), DVec2::new(0.0, t), DVec2::new(1.0, t)]
    });
    let (mut low, mut high) = (camera.principal_px, camera.principal_px);
    for direction in edge.filter_map(|place| camera.direction(place * size)) {
        let local = camera.world_from_camera.transpose() * direction;
        let p = DVec2::new(local.x, -local.y) / -local.z * camera.focal_px + camera.principal_px;
        (low, high) = (low.min(p), high.max(p));
    }
    (low.max(-0.5 * size).floor(), high.min(1.5 * size).ceil())
}

/// How the world is drawn into a window of `size` points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Double precision, so that a click finds what is drawn far from the origin, too.
    pub clip_from_world: DMat4,
    pub eye: Vec3,
    /// Unit axes of the view in the world.
    pub right: Vec3,
    pub up: Vec3,
    pub forward: Vec3,
    pub orthographic: bool,
    /// The window in points.
    pub size: Vec2,
    /// Where the photograph lies, when looking through one: its top left corner and size in
    /// points.
    pub picture: Option<(Vec2, Vec2)>,
}

/// The visible range of distances in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    pub near: f64,
    pub far: f64,
}

/// How a photograph is placed in the window: fitted whole, then enlarged and moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    pub zoom: f32,
    /// In points.
    pub shift: Vec2,
}

impl Default for Placement {
    fn default() -> Self {
        Self { zoom: 1.0, shift: Vec2::ZERO }
    }
}

impl Projection {
    /// A view from `eye`; `half_height` is the tangent of half the vertical angle of view, or
    /// half the height in metres if orthographic.
    pub fn free(
        eye: Vec3,
        [right, up, back]: [Vec3; 3],
        half_height: f32,
        orthographic: bool,
        size: Vec2,
        range: Range,
    ) -> Self {
        let view = view_from_world([right, up, back], eye.as_dvec3());
        let y = 1.0 / f64::from(half_height);
        let x = y * f64::from(size.y / size.x);
        let Range { near, far } = range;
        let clip_from_view = if orthographic {
            let depth = 1.0 / (near - far);
            DMat4::from_cols(
                DVec4::new(x, 0.0, 0.0, 0.0),
                DVec4::new(0.0, y, 0.0, 0.0),
                DVec4::new(0.0, 0.0, depth, 0.0),
                DVec4::new(0.0, 0.0, near * depth, 1.0),
            )
        } else {
            pinhole([x, y], [0.0, 0.0], range)
        };
        Self {
            clip_from_world: clip_from_view * view,
            eye,
            right,
            up,
            forward: -back,
            orthographic,
            size,
            picture: None,
        }
    }

    /// What a photograph's camera sees, without its lens distortion: `picture` is where its
    /// [`window`] is drawn.
    pub fn through(camera: &Camera, size: Vec2, placement: Placement, range: Range) -> Self {
        let (low, high) = window(camera);
        let pixels = (high - low).as_vec2();
        let fit = (size / pixels).min_element() * placement.zoom;
        let corner = 0.5 * (size - pixels * fit) + placement.shift;
        let (s, w, h) = (f64::from(fit), f64::from(size.x), f64::from(size.y));
        let middle = corner.as_dvec2() + s * (camera.principal_px - low);
        let clip_from_view = pinhole(
            [2.0 * s * camera.focal_px.x / w, 2.0 * s * camera.focal_px.y / h],
            [2.0 * middle.x / w - 1.0, 1.0 - 2.0 * middle.y / h],
            range,
        );
        let axes = camera.world_from_camera.as_mat3();
        let axes = [axes.x_axis, axes.y_axis, axes.z_axis];
        Self {
            clip_from_world: clip_from_view * view_from_world(axes, camera.position),
            eye: camera.position.as_vec3(),
            right: axes[0],
            up: axes[1],
            forward: -axes[2],
            orthographic: false,
            size,
            picture: Some((corner, pixels * fit)),
        }
    }

    /// A photograph's [`window`] over the square of clip coordinates.
    pub fn image(camera: &Camera, range: Range) -> Self {
        let (low, high) = window(camera);
        Self::through(camera, (high - low).as_vec2(), Placement::default(), range)
    }

    pub fn matrix(&self) -> Mat4 {
        self.clip_from_world.as_mat4()
    }

    /// The camera that sees what is drawn, with so many pixels over the window; `None` of an
    /// orthographic view.
    pub fn camera(&self, pixels: [u32; 2]) -> Option<Camera> {
        if self.orthographic {
            return None;
        }
        let per_point =
            DVec2::new(f64::from(pixels[0]), f64::from(pixels[1])) / self.size.as_dvec2();
        let at = |direction: Vec3| Some(self.project(self.eye + direction)?.as_dvec2() * per_point);
        let principal = at(self.forward)?;
        let focal = DVec2::new(
            at(self.forward + self.right)?.x - principal.x,
            principal.y - at(self.forward + self.up)?.y,
        );
        let axes = [self.right, self.up, -self.forward].map(|axis| axis.as_dvec3());
        let axes = DMat3::from_cols(axes[0], axes[1], axes[2]);
        let size = (pixels[0] as usize, pixels[1] as usize);
        let eye = self.eye.as_dvec3();
        Some(Camera::new(size, focal, principal, Distortion::default(), axes, eye))
    }

    /// Where a world point is drawn, in points from the top left; `None` behind the eye.
    pub fn project(&self, point: Vec3) -> Option<Vec2> {
        let clip = self.clip_from_world * point.as_dvec3().extend(1.0);
        if clip.w <= 1e-9 {
            return None;
        }
        let (x, y) = (clip.x / clip.w, clip.y / clip.w);
        Some(Vec2::new(0.5 + 0.5 * x as f32, 0.5 - 0.5 * y as f32) * self.size)
    }

    /// The ray through a position in points.
    pub fn ray(&self, position: Vec2) -> Ray {
        let x = 2.0 * f64::from(position.x / self.size.x) - 1.0;
        let y = 1.0 - 2.0 * f64::from(position.y / self.size.y);
        let world_from_clip = self.clip_from_world.inverse();
        let at = |depth: f64| -> DVec3 {
            let point = world_from_clip * DVec4::new(x, y, depth, 1.0);
            point.truncate() / point.w
        };
        let (near, beyond) = (at(0.0), at(0.5));
        let direction = (beyond - near).normalize_or(self.forward.as_dvec3());
        let origin = if self.orthographic { near } else { self.eye.as_dvec3() };
        Ray {
            origin: origin.as_vec3(),
            direction: direction.as_vec3(),
            // What lies before the near plane is not drawn.
            t_min: (near - origin).length() as f32,
            t_max: f32::INFINITY,
        }
    }
}

/// Perspective with the image's centre shifted by `offset` in clip coordinates.
fn pinhole([x, y]: [f64; 2], offset: [f64; 2], Range { near, far }: Range) -> DMat4 {
    let depth = far / (near - far);
    DMat4::from_cols(
        DVec4::new(x, 0.0, 0.0, 0.0),
        DVec4::new(0.0, y, 0.0, 0.0),
        DVec4::new(-offset[0], -offset[1], depth, -1.0),
        DVec4::new(0.0, 0.0, near * depth, 0.0),
    )
}

fn view_from_world([right, up, back]: [Vec3; 3], eye: DVec3) -> DMat4 {
    let (r, u, b) = (right.as_dvec3(), up.as_dvec3(), back.as_dvec3());
    DMat4::from_cols(
        DVec4::new(r.x, u.x, b.x, 0.0),
        DVec4::new(r.y, u.y, b.y, 0.0),
        DVec4::new(r.z, u.z, b.z, 0.0),
        DVec4::new(-r.dot(eye), -u.dot(eye), -b.dot(eye), 1.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const RANGE: Range = Range { near: 0.01, far: 100.0 };

    fn camera() -> Camera {
        lens(Distortion::default())
    }

    fn lens(distortion: Distortion) -> Camera {
        Camera::new(
            (640, 480),
            DVec2::new(500.0, 510.0),
            DVec2::new(310.0, 245.0),
            distortion,
            DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(1.1),
            DVec3::new(1.0, -2.0, 0.5),
        )
    }

    #[test]
    fn looking_through_a_photograph_puts_points_where_its_camera_does() {
        let camera = camera();
        let placements =
            [Placement::default(), Placement { zoom: 2.5, shift: Vec2::new(40.0, -31.0) }];
        for placement in placements {
            for size in [Vec2::new(900.0, 500.0), Vec2::new(400.0, 700.0)] {
                let projection = Projection::through(&camera, size, placement, RANGE);
                let (corner, extent) = projection.picture.unwrap();
                let scale = extent / Vec2::new(640.0, 480.0);
                assert!((scale.x - scale.y).abs() < 1e-5, "pixels stay square");
                for (x, y) in [(1.0, 1.0), (310.0, 245.0), (600.5, 17.25), (20.0, 470.0)] {
                    let direction = camera.direction(DVec2::new(x, y)).unwrap();
                    let point = (camera.position + 3.7 * direction).as_vec3();
                    let (pixel, _) = camera.project(point.as_dvec3()).unwrap();
                    let drawn = projection.project(point).unwrap();
                    let expected = corner + pixel.as_vec2() * scale;
                    assert!((drawn - expected).length() < 0.02, "{drawn} is not {expected}");
                    let back = projection.ray(drawn);
                    assert!(back.direction.dot(direction.as_vec3()) > 1.0 - 1e-6);
                }
            }
        }
    }

    #[test]
    fn a_camera_of_the_view_sees_what_is_drawn() {
        let size = Vec2::new(900.0, 500.0);
        let placement = Placement { zoom: 1.5, shift: Vec2::new(40.0, -31.0) };
        let axes = [Vec3::X, Vec3::Z, -Vec3::Y];
        for view in [
            Projection::through(&camera(), size, placement, RANGE),
            Projection::free(Vec3::new(1.0, 2.0, 3.0), axes, 0.4, false, size, RANGE),
        ] {
            let seen = view.camera([1800, 1000]).unwrap();
            for position in [Vec2::new(3.0, 5.0), Vec2::new(450.0, 250.0), Vec2::new(890.0, 30.0)] {
                let ray = view.ray(position);
                let direction = seen.direction(2.0 * position.as_dvec2()).unwrap();
                assert!(ray.direction.dot(direction.as_vec3()) > 1.0 - 1e-6, "{position}");
            }
        }
        let flat = Projection::free(Vec3::ZERO, axes, 0.4, true, size, RANGE);
        assert_eq!(flat.camera([10, 10]), None);
    }

    #[test]
    fn a_window_holds_the_rim_that_a_lens_drew_in() {
        let barrel = Distortion { radial: [-0.2, 0.05, 0.0, 0.0], ..Distortion::default() };
        let camera = lens(barrel);
        let (low, high) = window(&camera);
        assert!(low.max_element() < 0.0 && high.cmpgt(DVec2::new(640.0, 480.0)).all());
        let p = Projection::image(&camera, RANGE);
        for (x, y) in [(1.0, 1.0), (639.0, 1.0), (639.0, 479.0), (1.0, 240.0)] {
            let direction = camera.direction(DVec2::new(x, y)).unwrap();
            let drawn = p.project((camera.position + 2.0 * direction).as_vec3()).unwrap();
            assert!(drawn.cmpge(Vec2::ZERO).all() && drawn.cmple(p.size).all(), "{drawn}");
        }
    }

    #[test]
    fn a_fitted_photograph_is_letterboxed() {
        let projection =
            Projection::through(&camera(), Vec2::new(1280.0, 480.0), Placement::default(), RANGE);
        assert_eq!(projection.picture, Some((Vec2::new(320.0, 0.0), Vec2::new(640.0, 480.0))));
    }

    #[test]
    fn depth_goes_from_0_to_1_over_the_range() {
        let axes = [Vec3::X, Vec3::Z, -Vec3::Y];
        for orthographic in [false, true] {
            let p =
                Projection::free(Vec3::ZERO, axes, 0.5, orthographic, Vec2::splat(100.0), RANGE);
            for (y, depth) in [(0.01, 0.0), (100.0, 1.0)] {
                let clip = p.clip_from_world * DVec4::new(0.0, y, 0.0, 1.0);
                assert!((clip.z / clip.w - depth).abs() < 1e-9);
            }
        }
    }
}
