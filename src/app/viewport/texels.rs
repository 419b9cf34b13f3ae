//! Photographs as textures: half floats, with the lens distortion removed.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use half::f16;
use rayon::prelude::*;

use crate::app::viewport::projection::window;
use crate::io::import;
use crate::io::orientation::Orientation;
use crate::math::rgb::{CHANNELS, Radiance, srgb_to_linear};
use crate::render::composite::covered_radiance;
use crate::scene::{Camera, Capture, Display, Image, Photograph};

/// Of the radiance that nine tenths of the pixels stay below, what part of white it becomes at an
/// exposure of 0.
pub const BRIGHT_PART: f32 = 0.7;

/// What the fourth channel says of a texel.
const UNSEEN: f32 = 0.0;
const INVALID: f32 = 0.5;
const VALID: f32 = 1.0;
/// In a relit picture: this plus the part of the pixel that the scene covers.
const COVERED: f32 = 1.0;

/// The radiance that nine tenths of the valid pixels of all photographs stay below; 1 without
/// any. Radiance is in an arbitrary unit, so exposure has to start from the photographs.
pub fn bright(capture: &Capture) -> f32 {
    const WANTED: usize = 20_000;
    let count: usize = capture.measurements().map(|(_, _, image)| image.pixels().len()).sum();
    let step = (count / WANTED).max(1);
    let mut seen = Vec::new();
    for (_, _, image) in capture.measurements() {
        let width = image.width().max(1);
        // A step that shares a factor with the width would see some columns of pixels only.
        let step = (step..).find(|step| are_coprime(*step, width)).unwrap_or(step);
        seen.extend((0..image.pixels().len()).step_by(step).filter_map(|index| {
            let radiance = image.radiance(index % width, index / width)?;
            Some(radiance.iter().copied().fold(0.0, f32::max))
        }));
    }
    seen.sort_unstable_by(f32::total_cmp);
    let bright = seen.get(seen.len() * 9 / 10).copied().unwrap_or(1.0);
    if bright.is_finite() && bright > 0.0 { bright } else { 1.0 }
}

/// A picture in units of `bright`: what the scene sends through its part of every pixel, and how
/// large that part is.
pub fn of_pixels(pixels: &[(Radiance, f32)], bright: f32) -> Vec<u16> {
    let texel = |&(radiance, coverage): &(Radiance, f32)| {
        // Half floats cannot tell a much smaller part from none, and it cannot be seen.
        let seen = covered_radiance(radiance, coverage).filter(|_| coverage >= 1.0 / 64.0);
        let Some(radiance) = seen else { return [0.0, 0.0, 0.0, UNSEEN].map(half) };
        let [r, g, b] = radiance.map(|value| value / bright);
        [r, g, b, COVERED + coverage.min(1.0)].map(half)
    };
    pixels.par_iter().flat_map_iter(texel).collect()
}

fn are_coprime(mut a: usize, mut b: usize) -> bool {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a == 1
}

/// A size of the same shape with neither side above a limit.
pub fn within([width, height]: [usize; 2], limit: usize) -> [usize; 2] {
    let longest = width.max(height).max(1);
    if longest <= limit {
        return [width.max(1), height.max(1)];
    }
    [width, height].map(|side| (side * limit / longest).max(1))
}

/// What a photograph is drawn from: radiance, or a picture in fewer pixels.
struct Source {
    image: Arc<Image>,
    /// Pixels of the photograph along a side of one of these.
    step: f64,
    /// Its values that are 1 in the texture.
    unit: f32,
}

impl Source {
    /// The source for a texture of a size in units of `bright`; `None` where it cannot be read.
    fn of(photograph: &Photograph, size: [usize; 2], bright: f32) -> Option<Self> {
        if let Some(image) = &photograph.image {
            return Some(Self { image: image.clone(), step: 1.0, unit: bright });
        }
        let Display { file, orientation } = photograph.display.as_ref()?;
        let orientation = Orientation::of(*orientation).unwrap_or_default();
        // What cannot be read was told when the capture was opened.
        let shown = import::show(file, orientation, 2 * size[0].max(size[1])).ok()?;
        let linear: [f32; 256] =
            std::array::from_fn(|code| srgb_to_linear(code as f64 / 255.0) as f32);
        let pixels = shown.pixels.iter().map(|pixel| pixel.map(|code| linear[usize::from(code)]));
        let image = Arc::new(Image::new(shown.width, shown.height, pixels.collect(), None));
        // At an exposure of 0 it is seen as it is.
        Some(Self { image, step: shown.step as f64, unit: BRIGHT_PART })
    }
}

/// The photograph's [`window`] as its camera would see without distortion, in units of `bright`,
/// resampled to a size: four half floats a texel. One that is no measurement is as it is displayed,
/// and empty where there is nothing to display; `None` once it is no longer wanted, which is asked
/// for every row.
pub fn of(
    photograph: &Photograph,
    [width, height]: [usize; 2],
    bright: f32,
    is_wanted: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<u16>> {
    if photograph.image.is_none() && photograph.display.is_none() {
        return Some(Vec::new());
    }
    let mut texels = vec![0; 4 * width * height];
    let Some(source) = Source::of(photograph, [width, height], bright) else { return Some(texels) };
    let (image, unit) = (&source.image, source.unit);
    let camera = &photograph.camera;
    let (low, high) = window(camera);
    let scale = (high - low) / DVec2::new(width as f64, height as f64);
    // Where the texture is smaller than the photograph, each texel is a mean.
    let taps = ((scale.max_element() / source.step).ceil() as usize).clamp(1, 8);
    let exact = scale == DVec2::ONE && source.step == 1.0 && camera.distortion.is_none();
    texels.par_chunks_exact_mut(4 * width).enumerate().try_for_each(|(y, row)| {
        for (x, texel) in row.chunks_exact_mut(4).enumerate() {
            let [r, g, b, seen] = if exact {
                pixel(image, x as i64, y as i64)
            } else {
                let corner = low + DVec2::new(x as f64, y as f64) * scale;
                mean(&source, camera, corner, scale, taps)
            };
            texel.copy_from_slice(&[r / unit, g / unit, b / unit, seen].map(half));
        }
        is_wanted().then_some(())
    })?;
    image.release();
    Some(texels)
}

fn pixel(image: &Image, x: i64, y: i64) -> [f32; 4] {
    let (width, height) = (image.width() as i64, image.height() as i64);
    let (x, y) = (x.clamp(0, width - 1) as usize, y.clamp(0, height - 1) as usize);
    let valid = image.radiance_without_mask(x, y).is_some();
    let [r, g, b] = image.pixel(x, y).map(|v| if v.is_nan() { 0.0 } else { v });
    [r, g, b, if valid { VALID } else { INVALID }]
}

/// The mean over a texel, from its upper left corner on.
fn mean(source: &Source, camera: &Camera, corner: DVec2, scale: DVec2, taps: usize) -> [f32; 4] {
    let mut sum: Radiance = [0.0; CHANNELS];
    let (mut seen, mut valid) = (0, true);
    for tap in 0..taps * taps {
        let inside = DVec2::new((tap % taps) as f64 + 0.5, (tap / taps) as f64 + 0.5) / taps as f64;
        let Some(place) = distorted(camera, corner + inside * scale) else { continue };
        let [r, g, b, alpha] = interpolated(&source.image, place / source.step);
        for (sum, value) in sum.iter_mut().zip([r, g, b]) {
            *sum += value;
        }
        seen += 1;
        valid &= alpha == VALID;
    }
    if 2 * seen < taps * taps {
        return [0.0, 0.0, 0.0, UNSEEN];
    }
    let [r, g, b] = sum.map(|value| value / seen as f32);
    [r, g, b, if valid { VALID } else { INVALID }]
}

/// Where the photograph shows what a camera without distortion would see at a pixel position.
pub fn distorted(camera: &Camera, pixel: DVec2) -> Option<DVec2> {
    if camera.distortion.is_none() {
        return Some(pixel);
    }
    let p = (pixel - camera.principal_px) / camera.focal_px;
    let direction = camera.world_from_camera * DVec3::new(p.x, -p.y, -1.0);
    Some(camera.project(camera.position + direction)?.0)
}

fn interpolated(image: &Image, place: DVec2) -> [f32; 4] {
    let corner = place - 0.5;
    let (x, y) = (corner.x.floor(), corner.y.floor());
    let part = (corner - DVec2::new(x, y)).as_vec2();
    let mut sum = [0.0; 4];
    for (dx, dy, weight) in [
        (0, 0, (1.0 - part.x) * (1.0 - part.y)),
        (1, 0, part.x * (1.0 - part.y)),
        (0, 1, (1.0 - part.x) * part.y),
        (1, 1, part.x * part.y),
    ] {
        if weight == 0.0 {
            continue;
        }
        let texel = pixel(image, x as i64 + dx, y as i64 + dy);
        for (sum, value) in sum.iter_mut().zip(texel) {
            *sum += weight * value;
        }
    }
    sum[3] = if sum[3] > 1.0 - 1e-4 { VALID } else { INVALID };
    sum
}

/// A number in half precision, rounded; too large ones become the largest.
pub fn half(value: f32) -> u16 {
    let value = if value.is_nan() { 0.0 } else { value };
    f16::from_f32(value.clamp(f16::MIN.to_f32(), f16::MAX.to_f32())).to_bits()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DMat3;

    use super::*;
    use crate::scene::Distortion;

    #[test]
    fn a_pixel_at_the_edge_of_the_scene_has_the_radiance_of_its_covered_part() {
        let pixels = [([1.0, 2.0, 0.5], 0.25), ([3.0; 3], 1.0), ([0.001; 3], 0.001)];
        let texels = of_pixels(&pixels, 2.0);
        let values: Vec<f32> = texels.iter().map(|&bits| f16::from_bits(bits).to_f32()).collect();
        let expected = [[2.0, 4.0, 1.0, 1.25], [1.5, 1.5, 1.5, 2.0], [0.0; 4]];
        assert_eq!(values, expected.concat());
    }

    #[test]
    fn halves_are_the_nearest() {
        for (value, bits) in [
            (0.0, 0),
            (1.0, 0x3c00),
            (-2.0, 0xc000),
            (0.5, 0x3800),
            (65504.0, 0x7bff),
            (1e9, 0x7bff),
            (5.960_464_5e-8, 1),
            (6.103_515_6e-5, 0x0400),
            (1.0 + 1.0 / 2048.0, 0x3c00),
            (1.0 + 3.0 / 2048.0, 0x3c02),
            (f32::NAN, 0),
        ] {
            assert_eq!(half(value), bits, "{value}");
        }
    }

    #[test]
    fn an_undistorted_photograph_shows_each_point_where_a_pinhole_would() {
        let distortion = Distortion {
            radial: [-0.2, 0.05, 0.0, 0.0],
            tangential: [1e-3, -2e-3],
            ..Default::default()
        };
        let (width, height) = (160, 120);
        let camera = Camera::new(
            (width, height),
            DVec2::new(130.0, 131.0),
            DVec2::new(78.0, 61.0),
            distortion,
            DMat3::IDENTITY,
            DVec3::ZERO,
        );
        // A photograph whose red and green tell the pixel.
        let pixels = (0..width * height)
            .map(|i| [(i % width) as f32 + 0.5, (i / width) as f32 + 0.5, 1.0])
            .collect();
        let image = Some(Arc::new(Image::new(width, height, pixels, None)));
        let photograph = Photograph { name: String::new(), camera, image, display: None };
        let texels = of(&photograph, [width, height], 64.0, &|| true).unwrap();
        assert!(of(&photograph, [width, height], 64.0, &|| false).is_none());
        let (low, high) = window(&camera);
        let value = |bits: u16| {
            let exponent = i32::from(bits >> 10 & 31);
            (1.0 + f32::from(bits & 1023) / 1024.0) * 2f32.powi(exponent - 15) * 64.0
        };
        for (x, y) in [(80, 60), (40, 30), (120, 100), (20, 90)] {
            let texel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let pinhole = low + texel * (high - low) / DVec2::new(width as f64, height as f64);
            let p = (pinhole - camera.principal_px) / camera.focal_px;
            let (pixel, _) = camera.project(DVec3::new(p.x, -p.y, -1.0)).unwrap();
            let texel = &texels[4 * (y * width + x)..][..4];
            assert!((f64::from(value(texel[0])) - pixel.x).abs() < 0.1);
            assert!((f64::from(value(texel[1])) - pixel.y).abs() < 0.1);
            assert_eq!(texel[3], half(1.0));
        }
    }

    fn pinhole(width: usize, height: usize) -> Camera {
        let size = DVec2::new(width as f64, height as f64);
        let distortion = Distortion::default();
        Camera::new((width, height), size, 0.5 * size, distortion, DMat3::IDENTITY, DVec3::ZERO)
    }

    #[test]
    fn exposure_is_judged_from_all_columns() {
        // 400,000 pixels, one in twenty of which are looked at; each twentieth column is dark.
        let (width, height) = (1000, 400);
        let value = |i: usize| if (i % width).is_multiple_of(20) { 0.1 } else { 5.0 };
        let pixels = (0..width * height).map(|i| [value(i); 3]).collect();
        let image = Some(Arc::new(Image::new(width, height, pixels, None)));
        let camera = pinhole(width, height);
        let photograph = Photograph { name: String::new(), camera, image, display: None };
        let capture = Capture { photographs: vec![photograph], ..Capture::default() };
        assert_eq!(bright(&capture), 5.0);
        assert_eq!(bright(&Capture::default()), 1.0);
    }

    #[test]
    fn sizes_keep_their_shape() {
        assert_eq!(within([320, 240], 1024), [320, 240]);
        assert_eq!(within([4000, 3000], 1000), [1000, 750]);
    }
}
