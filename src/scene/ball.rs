//! A mirror ball in photographs: the radiance that arrives at its place, by direction.
//!
//! The outline of a ball is a cone of rays, and all angles within it follow from the half angle of
//! that cone: neither the size of the ball nor its distance is needed. The scene is assumed to be
//! far away compared with the size of the ball.

use glam::{DMat3, DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::{Camera, Image};
use crate::math::latlong;
use crate::math::rgb::{CHANNELS, Radiance, Rgb};

/// Rays whose sine of the angle from the middle is beyond this share of the outline's are left out:
/// there a pixel shows a wide strip of directions, and an outline that is a little off shows the
/// background.
const RIM: f64 = 0.985;
/// Of the outline's half angle: a point that lies farther from it belongs to no ball's outline.
const LARGEST_MISS: f64 = 0.05;
/// Points whose scatter across is less than this share of that along (as squares) lie on a line.
const STRAIGHT: f64 = 1e-4;
/// Samples along each side of a pixel of the result.
const SAMPLES: usize = 4;

/// A ball as a camera sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// The unit world direction of its middle.
    pub axis: DVec3,
    /// Half the angle that it covers, in radians.
    pub half_angle: f64,
}

/// A photograph of the ball.
#[derive(Clone, Copy, Debug)]
pub struct BallView<'a> {
    pub camera: &'a Camera,
    pub image: &'a Image,
    pub ball: Ball,
}

/// Radiance by direction, an image in latitude and longitude as that of a [`Dome`](super::Dome).
#[derive(Clone, Debug, PartialEq)]
pub struct Surroundings {
    pub width: usize,
    pub height: usize,
    /// `None` where no photograph shows the direction.
    pub texels: Vec<Option<Radiance>>,
    /// By how much two photographs of a direction differ, as |ln| of their ratio in the middle of all
    /// directions that two show; `None` where no two show one.
    pub difference: Option<f64>,
}

impl Ball {
    /// From three or more points on its outline, in pixels. `Err` says what is wrong.
    ///
    /// Their rays r of unit length have r · x = 1, where x is the axis over the cosine of the half
    /// angle. In the axes of a direction m amid them, with x = p, q along the others and 1 + k along m,
    /// that is p u + q v + k w = 1 − w, free of cancellation however small the ball is.
    pub fn fit(camera: &Camera, outline_px: &[DVec2]) -> Result<Self, String> {
        if outline_px.len() < 3 {
            return Err("three points on its outline are needed".to_owned());
        }
        let rays: Vec<DVec3> = outline_px.iter().filter_map(|px| camera.direction(*px)).collect();
        let middle = rays.iter().sum::<DVec3>().try_normalize();
        let Some(middle) = middle.filter(|_| rays.len() == outline_px.len()) else {
            return Err("a point of its outline lies beyond what the lens shows".to_owned());
        };
        let (e, f) = middle.any_orthonormal_pair();
        let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
        for ray in &rays {
            let own = DVec3::new(ray.dot(e), ray.dot(f), ray.dot(middle));
            normal += DMat3::from_cols(own * own.x, own * own.y, own * own.z);
            right += own * (own.x * own.x + own.y * own.y) / (1.0 + own.z);
        }
        let spread = normal.x_axis.x + normal.y_axis.y;
        let scattered = "its points are not on the outline of one ball".to_owned();
        let is_line = normal.determinant() < STRAIGHT * spread * spread * normal.z_axis.z;
        if is_line || rays.iter().any(|ray| ray.dot(middle) <= 0.0) {
            return Err(scattered);
        }
        let DVec3 { x: p, y: q, z: k } = normal.inverse() * right;
        let axis = (e * p + f * q + middle * (1.0 + k)).normalize();
        let half_angle = (p * p + q * q + k * (2.0 + k)).max(0.0).sqrt().atan();
        let miss = |ray: &DVec3| {
            (ray.cross(axis).length().atan2(ray.dot(axis)) - half_angle).abs() / half_angle
        };
        let worst = rays.iter().map(miss).fold(0.0, f64::max);
        if !worst.is_finite() || worst > LARGEST_MISS {
            return Err(format!("{scattered}: one is off by {:.0} % of its radius", 100.0 * worst));
        }
        Ok(Self { axis, half_angle })
    }

    /// The ray of the camera that is mirrored into a unit direction, and how many times wider than
    /// around that ray the solid angle around the direction is; `None` behind the ball and at its rim.
    ///
    /// With the middle of the ball one unit away, its radius is s = sin(half angle). Where the normal
    /// is at the angle β from the way back to the camera, the ray is at γ from the axis, tan γ =
    /// s sin β / (1 − s cos β), and what it shows is at ρ = 2β + γ from the way back.
    pub fn ray_to(&self, direction: DVec3) -> Option<(DVec3, f64)> {
        let s = self.half_angle.sin();
        let across = direction - self.axis * direction.dot(self.axis);
        let rho = across.length().atan2(-direction.dot(self.axis));
        let gamma = |beta: f64| (s * beta.sin()).atan2(1.0 - s * beta.cos());
        // ρ grows with β, up to where the ray touches the ball.
        let (mut low, mut high) = (0.0, s.acos());
        if 2.0 * high + gamma(high) <= rho {
            return None;
        }
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if 2.0 * middle + gamma(middle) < rho { low = middle } else { high = middle }
        }
        let beta = 0.5 * (low + high);
        let gamma = gamma(beta);
        if gamma.sin() > RIM * s {
            return None;
        }
        let slope = s * (beta.cos() - s) / (1.0 - 2.0 * s * beta.cos() + s * s);
        let along = (2.0 + slope) / slope;
        let around = if rho > 1e-6 { rho.sin() / gamma.sin() } else { along };
        let across = across.try_normalize().unwrap_or_else(|| self.axis.any_orthonormal_vector());
        Some((self.axis * gamma.cos() + across * gamma.sin(), along * around))
    }
}

/// The radiance of all directions by photographs of one ball of the given reflectance. Where several
/// show a direction, each counts by the square of the pixels that it spends on it. What is less than
/// `camera_angle` (in radians) beside the way to a camera, or its photographer, is of the other
/// photographs where they show it. `width` becomes even.
pub fn surroundings(
    views: &[BallView],
    reflectance: Rgb,
    camera_angle: f64,
    width: usize,
) -> Surroundings {
    let height = width.div_ceil(2).max(1);
    let width = 2 * height;
    let texel = |index: usize| {
        // Of each photograph, the weighted sum and the weight.
        let mut sums = vec![([0.0; CHANNELS], 0.0); views.len()];
        for sample in 0..SAMPLES * SAMPLES {
            let offset = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
            let x = (index % width) as f64 + offset(sample % SAMPLES);
            let y = (index / width) as f64 + offset(sample / SAMPLES);
            let direction = direction(x / width as f64, y / height as f64);
            for (view, (sum, total)) in views.iter().zip(&mut sums) {
                let Some((radiance, weight)) = view.radiance(direction, camera_angle) else {
                    continue;
                };
                *total += weight;
                for channel in 0..CHANNELS {
                    sum[channel] += weight * f64::from(radiance[channel]) / reflectance[channel];
                }
            }
        }
        let total: f64 = sums.iter().map(|(_, total)| total).sum();
        let mean =
            |channel: usize| (sums.iter().map(|(sum, _)| sum[channel]).sum::<f64>() / total) as f32;
        let texel = (total > 0.0).then(|| std::array::from_fn(mean));
        // The two that count most, where they count alike.
        sums.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        let brightness = |k: usize| sums[k].0.iter().sum::<f64>() / sums[k].1;
        let comparable = sums.len() > 1 && sums[1].1 > 0.1 * sums[0].1;
        let apart = comparable.then(|| (brightness(0) / brightness(1)).ln().abs());
        (texel, apart.filter(|apart| apart.is_finite()))
    };
    let (texels, apart): (Vec<_>, Vec<_>) = (0..width * height).into_par_iter().map(texel).unzip();
    let mut apart: Vec<f64> = apart.into_iter().flatten().collect();
    apart.sort_by(f64::total_cmp);
    let difference = apart.get(apart.len() / 2).copied();
    Surroundings { width, height, texels, difference }
}

impl BallView<'_> {
    /// What the ball shows of a direction, not yet divided by its reflectance, and its weight.
    fn radiance(&self, direction: DVec3, camera_angle: f64) -> Option<(Radiance, f64)> {
        let (ray, wider) = self.ball.ray_to(direction)?;
        let radiance = between(self.image, self.camera.place(self.camera.position + ray)?)?;
        let hidden = (-direction.dot(self.ball.axis)).clamp(-1.0, 1.0).acos() < camera_angle;
        Some((radiance, wider.powi(-2) * if hidden { 1e-6 } else { 1.0 }))
    }
}

/// The unit direction of a place in an image of all directions, both coordinates 0 to 1.
fn direction(across: f64, down: f64) -> DVec3 {
    latlong::direction(DVec2::new(across, down).as_vec2()).as_dvec3().normalize()
}

/// Between the four nearest pixels, all of which must be measurements.
fn between(image: &Image, px: DVec2) -> Option<Radiance> {
    let (place, limit) = (px - 0.5, DVec2::new(image.width() as f64, image.height() as f64) - 1.0);
    if place.min_element() < 0.0 || place.cmpgt(limit).any() {
        return None;
    }
    let (x, y) = (place.x as usize, place.y as usize);
    let (across, down) = (place.x.fract() as f32, place.y.fract() as f32);
    let mut sum = [0.0; CHANNELS];
    for (row, weight) in [(y, 1.0 - down), (y + 1, down)] {
        for (column, weight) in [(x, weight * (1.0 - across)), (x + 1, weight * across)] {
            let (column, row) = (column.min(image.width() - 1), row.min(image.height() - 1));
            let radiance = image.radiance(column, row)?;
            sum.iter_mut().zip(radiance).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    Some(sum)
}

/// How radiance by direction compares with another one, such as the light that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compared {
    /// Of the directions that both show, by solid angle: the share that differs by 5 % at most, in
    /// the sum of the channels.
    pub within_5_percent: f64,
    /// First over second, in the middle of those directions.
    pub ratio: f64,
}

impl Surroundings {
    /// The share of all directions that is shown.
    pub fn shown(&self) -> f64 {
        let of = |all: bool| {
            let texels = self.texels.iter().enumerate();
            let shown = texels.filter(|(_, texel)| all || texel.is_some());
            shown.map(|(index, _)| self.solid_angle(index)).sum::<f64>()
        };
        of(false) / of(true)
    }

    /// Compares with the radiance of an image that has another size, by its mean over each texel.
    pub fn compare(&self, other: impl Fn(Vec3) -> Radiance) -> Option<Compared> {
        let sum = |radiance: Radiance| radiance.iter().map(|&v| f64::from(v)).sum::<f64>();
        let mean = |index: usize| {
            let sample = |k: usize| {
                let offset = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
                let x = (index % self.width) as f64 + offset(k % SAMPLES);
                let y = (index / self.width) as f64 + offset(k / SAMPLES);
                sum(other(direction(x / self.width as f64, y / self.height as f64).as_vec3()))
            };
            (0..SAMPLES * SAMPLES).map(sample).sum::<f64>() / (SAMPLES * SAMPLES) as f64
        };
        let mut ratios: Vec<(f64, f64)> = (self.texels.iter().enumerate())
            .filter_map(|(index, texel)| {
                let (ours, theirs) = (sum((*texel)?), mean(index));
                (theirs > 0.0).then(|| (ours / theirs, self.solid_angle(index)))
            })
            .collect();
        ratios.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let total: f64 = ratios.iter().map(|(_, angle)| angle).sum();
        let near = ratios.iter().filter(|(ratio, _)| (ratio - 1.0).abs() <= 0.05);
        let within_5_percent = near.map(|(_, angle)| angle).sum::<f64>() / total;
        let ratio = ratios.get(ratios.len() / 2)?.0;
        Some(Compared { within_5_percent, ratio })
    }

    /// Of a texel, up to a factor that all share.
    fn solid_angle(&self, index: usize) -> f64 {
        (((index / self.width) as f64 + 0.5) * std::f64::consts::PI / self.height as f64).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Distortion;

    fn camera() -> Camera {
        let axes = DMat3::from_rotation_y(0.4) * DMat3::from_rotation_x(-0.3);
        let (focal, middle) = (DVec2::splat(300.0), DVec2::new(160.0, 120.0));
        Camera::new(
            (320, 240),
            focal,
            middle,
            Distortion::default(),
            axes,
            DVec3::new(1.0, 2.0, 3.0),
        )
    }

    /// Pixels where rays touch a ball of that direction and half angle.
    fn outline(camera: &Camera, axis: DVec3, half_angle: f64, count: usize) -> Vec<DVec2> {
        let (e, f) = axis.any_orthonormal_pair();
        let point = |k: usize| {
            let (sin, cos) = (k as f64 * 2.1).sin_cos();
            let ray = axis * half_angle.cos() + (e * cos + f * sin) * half_angle.sin();
            camera.place(camera.position + ray).unwrap()
        };
        (0..count).map(point).collect()
    }

    #[test]
    fn a_ball_is_found_from_its_outline() {
        let camera = camera();
        // Far from the middle of the picture, where the outline is no circle.
        let axis = camera.direction(DVec2::new(60.0, 190.0)).unwrap();
        for (half_angle, count) in [(0.02, 3), (0.1, 3), (0.1, 7), (0.3, 4)] {
            let ball = Ball::fit(&camera, &outline(&camera, axis, half_angle, count)).unwrap();
            assert!(ball.axis.distance(axis) < 1e-9, "{ball:?}");
            assert!((ball.half_angle - half_angle).abs() < 1e-9, "{ball:?}");
        }
        let mut off = outline(&camera, axis, 0.1, 6);
        assert!(Ball::fit(&camera, &off[..2]).unwrap_err().contains("three points"));
        off[3] += DVec2::new(9.0, 4.0);
        assert!(Ball::fit(&camera, &off).unwrap_err().contains("off by"));
        let line: Vec<DVec2> =
            (0..4).map(|k| DVec2::new(50.0 + 20.0 * f64::from(k), 80.0)).collect();
        assert!(Ball::fit(&camera, &line).is_err());
    }

    /// The ray meets the ball where the law of reflection turns it into the direction, and solid
    /// angles are those of finite differences.
    #[test]
    fn rays_are_mirrored_into_their_directions() {
        let (axis, half_angle) = (DVec3::new(0.3, -0.8, 0.5).normalize(), 0.2_f64);
        let ball = Ball { axis, half_angle };
        let mirrored = |ray: DVec3| {
            let s = half_angle.sin();
            let along = ray.dot(axis);
            let distance = along - (along * along - 1.0 + s * s).sqrt();
            let normal = (ray * distance - axis) / s;
            ray - normal * 2.0 * ray.dot(normal)
        };
        let mut seen = 0;
        for k in 0..500 {
            let direction = direction((f64::from(k) * 0.618).fract(), (f64::from(k) + 0.5) / 500.0);
            let Some((ray, wider)) = ball.ray_to(direction) else {
                assert!(direction.dot(axis) > 0.6, "{direction}");
                continue;
            };
            seen += 1;
            assert!((ray.length() - 1.0).abs() < 1e-12);
            assert!(mirrored(ray).distance(direction) < 1e-9, "{direction}");
            let (e, f) = ray.any_orthonormal_pair();
            let moved = |by: DVec3| mirrored((ray + by * 1e-6).normalize()) - direction;
            let area = moved(e).cross(moved(f)).length() / 1e-12;
            assert!((wider / area - 1.0).abs() < 1e-3, "{wider} {area}");
        }
        assert!(seen > 400);
        // Straight back to the camera, where around and along are the same.
        let (ray, wider) = ball.ray_to(-axis).unwrap();
        assert!(ray.distance(axis) < 1e-9 && wider > 1.0);
    }
}
