//! Lamps that photographs show in front of known surfaces.
//!
//! Where a lamp that is not modelled stands in front of a wall, the wall's pixels show the lamp's
//! radiance, and I_s would have its light come from the wall. Two things tell a lamp from a surface
//! that is as bright, such as one in the sun: nothing else is nearly as bright as the lamp, and
//! photographs from elsewhere do not show it in front of the same points.

use std::sync::Arc;

use rayon::prelude::*;

use crate::math::sampling::lattice_step;
use crate::scene::agreement::brightness;
use crate::scene::views::VisibilityBuffer;
use crate::scene::{Capture, MaterialKind, Views};
use crate::watch::{Cancelled, Watch};

/// Pixels that are looked at in each photograph, about.
const PIXELS: usize = 20_000;
/// Pixels above a brightness stand out if they are so many times as bright as the median, show at
/// most this part of the area, send at least this part of all light, and those within a factor
/// [`GAP`] below them send at most [`IN_GAP`] of what they send. Set on the random scenes.
const OVER_MEDIAN: f32 = 10.0;
const LARGEST_PART: f64 = 0.05;
const LEAST_SENT: f64 = 0.01;
const GAP: f32 = 4.0;
const IN_GAP: f64 = 0.1;
/// Surfaces are bright themselves if more than this part of other photographs of the bright points show
/// them as bright. Of the random scenes, 0.84 to 0.98 do where the sun shines on something, and up to
/// 0.73 where a lamp is in view: photographs that are taken side by side show it in front of the same
/// points.
const AGREEING: f64 = 0.8;

/// Lamps in front of surfaces.
pub struct Lamps {
    /// The capture, whose photographs leave out the pixels of the lamps.
    pub capture: Capture,
    /// The surfaces in front of which they stand, by name.
    pub surfaces: Vec<String>,
}

/// A pixel that shows a surface of a diffuse material.
#[derive(Clone, Copy)]
struct Shown {
    brightness: f32,
    /// Of the surface, in m².
    area: f32,
    buffer: u32,
    x: u32,
    y: u32,
}

/// Finds lamps in front of surfaces; `None` where there are none.
///
/// # Errors
/// If it is cancelled.
pub fn find(views: &Views, watch: &Watch) -> Result<Option<Lamps>, Cancelled> {
    let shown = shown(views, watch)?;
    let Some(limit) = stand_out(shown.iter().map(|pixel| (pixel.brightness, pixel.area)).collect())
    else {
        return Ok(None);
    };
    let capture = views.capture;
    // Other photographs of the bright points, and those of them that show these as bright.
    let (mut seen, mut seen_bright) = (0usize, 0usize);
    let mut is_behind = vec![false; capture.surfaces.len()];
    for pixel in shown.iter().filter(|pixel| pixel.brightness > limit) {
        watch.check()?;
        let buffer = &views.buffers[pixel.buffer as usize];
        let hit = buffer.hit(pixel.x as usize, pixel.y as usize);
        let Some((position, triangle)) = hit else { continue };
        is_behind[capture.mesh.surface[triangle as usize] as usize] = true;
        let towards = buffer.camera.position.as_vec3() - position;
        let point = views.side(position, triangle, towards);
        for (index, other) in views.buffers.iter().enumerate() {
            let is_other = index != pixel.buffer as usize;
            let place = is_other.then(|| views.seen(other, point)).flatten();
            if let Some(radiance) = place.and_then(|place| other.image.radiance(place.x, place.y)) {
                seen += 1;
                seen_bright += usize::from(brightness(&radiance) > f64::from(limit));
            }
        }
    }
    if seen_bright as f64 > AGREEING * seen as f64 {
        return Ok(None);
    }
    let names = capture.surfaces.iter().zip(&is_behind).filter(|(_, is_behind)| **is_behind);
    let surfaces = names.map(|(surface, _)| surface.name.clone()).collect();
    Ok(Some(Lamps { capture: without(views, &is_behind, limit), surfaces }))
}

/// Whether a triangle is of a diffuse material: highlights are as bright as lamps, and other
/// photographs do not show them at the same points.
fn is_matt(capture: &Capture, triangle: u32) -> bool {
    let material = capture.material_of(triangle);
    material.is_some_and(|index| capture.materials[index].kind == MaterialKind::Diffuse)
}

/// Pixels of all photographs that show surfaces of materials, evenly chosen.
fn shown(views: &Views, watch: &Watch) -> Result<Vec<Shown>, Cancelled> {
    let of_photograph = |(index, buffer): (usize, &VisibilityBuffer)| {
        watch.check()?;
        let camera = buffer.camera;
        let step = lattice_step(camera.width * camera.height, PIXELS);
        let pixel_area = (step * step) as f32 / camera.focal_px.as_vec2().element_product();
        let mut shown = Vec::new();
        for y in (0..camera.height).step_by(step) {
            for x in (0..camera.width).step_by(step) {
                let Some((position, triangle)) = buffer.hit(x, y) else { continue };
                let Some(radiance) = buffer.image.radiance(x, y) else { continue };
                if !is_matt(views.capture, triangle) {
                    continue;
                }
                let towards = camera.position.as_vec3() - position;
                let cosine = views.normals[triangle as usize].dot(towards.normalize_or_zero());
                shown.push(Shown {
                    brightness: brightness(&radiance) as f32,
                    area: pixel_area * towards.length_squared() / cosine.abs().max(0.05),
                    buffer: index as u32,
                    x: x as u32,
                    y: y as u32,
                });
            }
        }
        buffer.image.release();
        Ok(shown)
    };
    let parts: Vec<Vec<Shown>> = views
        .buffers
        .par_iter()
        .enumerate()
        .map(of_photograph)
        .collect::<Result<_, Cancelled>>()?;
    Ok(parts.concat())
}

/// A brightness in the middle of the emptiest gap below pixels that stand out, of pixels with their
/// brightness and area; `None` where none do.
fn stand_out(mut pixels: Vec<(f32, f32)>) -> Option<f32> {
    pixels.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    // Sums over all pixels before each, and over all.
    let (mut sent, mut area) = (vec![0.0f64], vec![0.0f64]);
    for (&(brightness, m2), k) in pixels.iter().zip(0..) {
        sent.push(sent[k] + f64::from(brightness * m2));
        area.push(area[k] + f64::from(m2));
    }
    let (all_sent, all_area) = (sent[pixels.len()], area[pixels.len()]);
    let middle = area.partition_point(|&sum| sum < 0.5 * all_area).saturating_sub(1);
    let least = OVER_MEDIAN * pixels.get(middle)?.0;
    let (mut emptiest, mut found) = (IN_GAP, None);
    let first = pixels.partition_point(|pixel| pixel.0 < least);
    for (k, &(brightness, _)) in pixels.iter().enumerate().skip(first) {
        let beyond = all_sent - sent[k];
        if beyond < LEAST_SENT * all_sent || all_area - area[k] > LARGEST_PART * all_area {
            continue;
        }
        let below = pixels.partition_point(|pixel| pixel.0 < brightness / GAP);
        let in_gap = (sent[k] - sent[below]) / beyond;
        if in_gap < emptiest {
            (emptiest, found) = (in_gap, Some(brightness / GAP.sqrt()));
        }
    }
    found
}

/// The capture without pixels that are brighter and show one of these surfaces, without others that are
/// connected with them, and without the pixels beside these: all of them may show the same lamp.
fn without(views: &Views, is_behind: &[bool], limit: f32) -> Capture {
    let mut capture = views.capture.clone();
    for buffer in &views.buffers {
        let (width, height) = (buffer.camera.width, buffer.camera.height);
        let around = |x: usize, y: usize| {
            let columns = x.saturating_sub(1)..=(x + 1).min(width - 1);
            (y.saturating_sub(1)..=(y + 1).min(height - 1))
                .flat_map(move |y| columns.clone().map(move |x| (x, y)))
        };
        let is_bright = |&(x, y): &(usize, usize)| {
            let radiance = buffer.image.radiance(x, y);
            radiance.is_some_and(|radiance| brightness(&radiance) > f64::from(limit))
        };
        let is_in_front = |&(x, y): &(usize, usize)| {
            let triangle = buffer.hit(x, y).map(|(_, triangle)| triangle);
            let surface = triangle.map(|triangle| views.capture.mesh.surface[triangle as usize]);
            surface.is_some_and(|surface| is_behind[surface as usize])
        };
        let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let mut next: Vec<(usize, usize)> =
            all.filter(|place| is_in_front(place) && is_bright(place)).collect();
        let mut left_out = vec![false; width * height];
        next.iter().for_each(|&(x, y)| left_out[y * width + x] = true);
        while let Some((x, y)) = next.pop() {
            for (u, v) in around(x, y) {
                if !left_out[v * width + u] {
                    left_out[v * width + u] = true;
                    // A pixel beside the lamp ends it.
                    next.extend(Some((u, v)).filter(is_bright));
                }
            }
        }
        let image = &mut capture.photographs[buffer.photograph].image;
        if let Some(image) = image.as_mut().filter(|_| left_out.contains(&true)) {
            Arc::make_mut(image).mask(|x, y| left_out[y * width + x]);
        }
        buffer.image.release();
    }
    capture
}

#[cfg(test)]
mod tests;
