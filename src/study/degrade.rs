//! Captures made worse in controlled steps, from their photographs, cameras and geometry alone.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DMat3, DQuat, DVec2, DVec3, Vec3};

use crate::geometry::bvh::RayCaster;
use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::math::sampling::Random;
use crate::reconstruct::Options;
use crate::scene::{Camera, Capture, Distortion, Image, Role, Views};
use crate::study::degradation::Degradation;
use crate::watch::{Cancelled, Watch};

/// A degraded capture, and the settings that go with it.
pub struct Degraded {
    /// With everything else as it was.
    pub capture: Capture,
    /// Those given, but for degradations of settings.
    pub options: Options,
    /// New surfaces with the ones that they were cut from.
    pub cut: Vec<(String, String)>,
}

/// Degrades a capture. What is random follows from `seed`.
pub fn degrade(
    capture: &Capture,
    options: &Options,
    degradation: Degradation,
    level: f64,
    seed: u64,
    watch: &Watch,
) -> Result<Degraded, Cancelled> {
    let mut random = Random::new(seed, 0x4a12, degradation as u64);
    let mut worse =
        Degraded { capture: capture.clone(), options: options.clone(), cut: Vec::new() };
    let part = 0.01 * level;
    match degradation {
        Degradation::Noise => {
            let mean = mean_radiance(capture);
            each_image(&mut worse.capture, |_, pixel, _| {
                pixel.map(|v| {
                    let sd = part * (f64::from(v) * mean).sqrt();
                    (f64::from(v) + sd * normal(&mut random)).max(0.0) as f32
                })
            });
        }
        Degradation::Saturation => {
            let limit = brightest_part(capture, part);
            each_image(&mut worse.capture, |_, pixel, _| match pixel.iter().any(|&v| v >= limit) {
                true => [f32::NAN; CHANNELS],
                false => pixel,
            });
        }
        Degradation::Misregistration => {
            let corners = seen_corners(capture);
            for photograph in &mut worse.capture.photographs {
                photograph.camera = misplaced(&photograph.camera, &corners, level, &mut random);
            }
        }
        Degradation::Lens => each_camera(&mut worse.capture, |camera| {
            let mut radial = camera.distortion.radial;
            radial[0] += level;
            let distortion = Distortion { radial, ..camera.distortion };
            with_lens(camera, camera.focal_px, distortion)
        }),
        Degradation::Focal => each_camera(&mut worse.capture, |camera| {
            with_lens(camera, camera.focal_px * (1.0 + part), camera.distortion)
        }),
        Degradation::Exposure => {
            let gains: Vec<f64> =
                capture.photographs.iter().map(|_| (part * normal(&mut random)).exp()).collect();
            each_image(&mut worse.capture, |photograph, pixel, _| {
                pixel.map(|v| v * gains[photograph] as f32)
            });
        }
        Degradation::Vignetting => each_image(&mut worse.capture, |_, pixel, place| {
            pixel.map(|v| v * (1.0 - part * place.length_squared()) as f32)
        }),
        Degradation::FewerImages => {
            let measured: Vec<usize> = capture.measurements().map(|(index, ..)| index).collect();
            let kept = ((measured.len() as f64 * (1.0 - part)).round() as usize).max(1);
            // Evenly over the row, beginning elsewhere for each seed.
            let keep: Vec<usize> = (0..kept)
                .map(|k| measured[(seed as usize + k * measured.len() / kept) % measured.len()])
                .collect();
            for index in measured {
                if !keep.contains(&index) {
                    worse.capture.photographs[index].image = None;
                }
            }
        }
        Degradation::FewerSamples => {
            let samples = &mut worse.options.samples;
            let keep = |count: usize| ((count as f64 * (1.0 - part)) as usize).max(1);
            samples.count = keep(samples.count);
            samples.min_per_material = keep(samples.min_per_material);
        }
        Degradation::MissingSurfaces => {
            remove_surfaces(&mut worse.capture, level as usize, &mut random)
        }
        Degradation::MovedVertices => move_vertices(&mut worse.capture, part, &mut random),
        Degradation::MoreLights | Degradation::FewerLights => {
            let factor = if degradation == Degradation::MoreLights { level } else { 1.0 / level };
            let spacing = factor.sqrt().recip();
            let Options { lights, joint, .. } = &mut worse.options;
            lights.count = ((lights.count as f64 * factor) as usize).max(1);
            joint.coarse_spacing = (joint.coarse_spacing * spacing).clamp(0.1, 3.0);
            joint.fine_spacing = (joint.fine_spacing * spacing).clamp(0.1, 3.0);
        }
        Degradation::LightColor => {
            // Light of another colour changes every photograph by the same factors.
            let gain = [level.sqrt(), 1.0, level.sqrt().recip()];
            each_image(&mut worse.capture, |_, pixel, _| {
                std::array::from_fn(|c| pixel[c] * gain[c] as f32)
            });
        }
        Degradation::MergedTags => merge_tags(&mut worse.capture, level as usize, &mut random),
        Degradation::SplitTags => worse.cut = split_tags(&mut worse.capture, level as usize),
        Degradation::Texture => add_texture(&mut worse.capture, part, watch)?,
        Degradation::Start => {
            for material in &capture.materials {
                let factor = if random.uniform() < 0.5 { level } else { 1.0 / level };
                let value: Rgb = [(factor / 3.0).clamp(0.01, 0.99); CHANNELS];
                worse.options.start.insert(material.name.clone(), value);
            }
        }
    }
    Ok(worse)
}

/// A number of the standard normal distribution (Box and Muller 1958).
fn normal(random: &mut Random) -> f64 {
    let radius = (-2.0 * (1.0 - f64::from(random.uniform())).max(1e-12).ln()).sqrt();
    radius * (TAU * f64::from(random.uniform())).cos()
}

/// Changes every valid pixel: `change` is called with the photograph, the pixel, and its position
/// from the principal point in half-diagonals of the image. Pixels that were no measurement stay
/// none.
fn each_image(capture: &mut Capture, mut change: impl FnMut(usize, Radiance, DVec2) -> Radiance) {
    for (index, photograph) in capture.photographs.iter_mut().enumerate() {
        let Some(image) = &photograph.image else { continue };
        let (width, height) = (image.width(), image.height());
        let half_diagonal = 0.5 * (width as f64).hypot(height as f64);
        let center = photograph.camera.principal_px;
        let pixels = (0..width * height)
            .map(|k| {
                let (x, y) = (k % width, k / width);
                let place = (DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - center) / half_diagonal;
                match image.radiance(x, y) {
                    Some(pixel) => change(index, pixel, place),
                    None => [f32::NAN; CHANNELS],
                }
            })
            .collect();
        photograph.image = Some(Arc::new(remade(image, pixels)));
    }
}

/// A photograph with other radiance: what its mask leaves out stays so.
fn remade(image: &Image, pixels: Vec<Radiance>) -> Image {
    let mut remade = Image::new(image.width(), image.height(), pixels, None);
    remade.mask(|x, y| image.is_masked(x, y));
    remade
}

fn each_camera(capture: &mut Capture, change: impl Fn(&Camera) -> Camera) {
    for photograph in &mut capture.photographs {
        photograph.camera = change(&photograph.camera);
    }
}

fn with_lens(camera: &Camera, focal_px: DVec2, distortion: Distortion) -> Camera {
    Camera::new(
        (camera.width, camera.height),
        focal_px,
        camera.principal_px,
        distortion,
        camera.world_from_camera,
        camera.position,
    )
}

/// Of all channels of all valid pixels.
fn mean_radiance(capture: &Capture) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    each_pixel(capture, |pixel| {
        sum += pixel.iter().map(|&v| f64::from(v)).sum::<f64>();
        count += CHANNELS;
    });
    sum / count.max(1) as f64
}

fn each_pixel(capture: &Capture, mut tell: impl FnMut(Radiance)) {
    for (_, _, image) in capture.measurements() {
        for y in 0..image.height() {
            for x in 0..image.width() {
                if let Some(pixel) = image.radiance(x, y) {
                    tell(pixel);
                }
            }
        }
    }
}

/// The level that a part of all pixels have a channel at or above.
fn brightest_part(capture: &Capture, part: f64) -> f32 {
    let mut largest = Vec::new();
    each_pixel(capture, |pixel| largest.push(pixel.iter().copied().fold(0.0, f32::max)));
    if largest.is_empty() {
        return f32::INFINITY;
    }
    let index = ((largest.len() - 1) as f64 * (1.0 - part)) as usize;
    *largest.select_nth_unstable_by(index, f32::total_cmp).1
}

/// Corners of the geometry, at most about a hundred.
fn seen_corners(capture: &Capture) -> Vec<DVec3> {
    let positions = &capture.mesh.positions;
    positions.iter().step_by(positions.len().div_ceil(100).max(1)).map(|p| p.as_dvec3()).collect()
}

/// A camera turned and moved by so much that corners move by `rms_px` in the image.
fn misplaced(camera: &Camera, corners: &[DVec3], rms_px: f64, random: &mut Random) -> Camera {
    let mut vector = || DVec3::new(normal(random), normal(random), normal(random));
    // A rotation of a milliradian goes with some millimetres in a room.
    let (turn, shift) = (0.0015 * vector(), 0.004 * vector());
    let moved = |amount: f64| {
        let mut moved = *camera;
        moved.world_from_camera =
            DMat3::from_quat(DQuat::from_scaled_axis(amount * turn)) * camera.world_from_camera;
        moved.position = camera.position + amount * shift;
        moved
    };
    let place = |camera: &Camera, corner: &DVec3| camera.project(*corner).map(|(pixel, _)| pixel);
    let mut amount = rms_px;
    for _ in 0..20 {
        let other = moved(amount);
        let squares: Vec<f64> = corners
            .iter()
            .filter_map(|corner| {
                Some((place(camera, corner)? - place(&other, corner)?).length_squared())
            })
            .collect();
        let rms = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        if rms <= 0.0 {
            break;
        }
        amount *= rms_px / rms;
    }
    moved(amount)
}

/// Takes the triangles of some surfaces out; of the rest nothing changes.
fn remove_surfaces(capture: &mut Capture, count: usize, random: &mut Random) {
    let mut order: Vec<u32> = (0..capture.surfaces.len() as u32).collect();
    random.shuffle(&mut order);
    let gone = &order[..count.min(order.len().saturating_sub(1))];
    let mut mesh = (*capture.mesh).clone();
    let keep: Vec<bool> = mesh.surface.iter().map(|surface| !gone.contains(surface)).collect();
    let mut kept = keep.iter();
    mesh.triangles.retain(|_| *kept.next().unwrap_or(&true));
    let mut kept = keep.iter();
    mesh.surface.retain(|_| *kept.next().unwrap_or(&true));
    let mut kept = keep.iter();
    mesh.polygon.retain(|_| *kept.next().unwrap_or(&true));
    let mut kept = keep.iter();
    mesh.texcoords.retain(|_| *kept.next().unwrap_or(&true));
    capture.mesh = Arc::new(mesh);
}

/// Moves every corner at random; corners at one place move together, so that nothing opens.
fn move_vertices(capture: &mut Capture, part: f64, random: &mut Random) {
    let mut mesh = (*capture.mesh).clone();
    let (low, high) = mesh.bounds().unwrap_or_default();
    let sd = part * 0.5 * f64::from((high - low).length());
    let base = random.next_u64();
    for position in &mut mesh.positions {
        let bits = position.to_array().map(|v| u64::from((v + 0.0).to_bits()));
        let place = bits[0] ^ bits[1].rotate_left(21) ^ bits[2].rotate_left(42);
        let mut own = Random::new(base, place, 0);
        let mut step = || (sd * normal(&mut own)) as f32;
        *position += Vec3::new(step(), step(), step());
    }
    capture.mesh = Arc::new(mesh);
}

/// Tags the surfaces of one material as another one's, pair by pair.
fn merge_tags(capture: &mut Capture, pairs: usize, random: &mut Random) {
    let mut order: Vec<usize> = (0..capture.materials.len()).collect();
    random.shuffle(&mut order);
    for pair in order.chunks_exact(2).take(pairs) {
        let moved = std::mem::take(&mut capture.materials[pair[1]].surfaces);
        for &surface in &moved {
            capture.surfaces[surface].role = Role::Material(pair[0]);
        }
        capture.materials[pair[0]].surfaces.extend(moved);
    }
}

/// Cuts the largest surfaces in two across their longest side, each half with a material of its
/// own; gives the new surfaces with the old ones' names.
fn split_tags(capture: &mut Capture, count: usize) -> Vec<(String, String)> {
    let mut mesh = (*capture.mesh).clone();
    let area = |surface: usize| -> f32 {
        (0..mesh.triangles.len())
            .filter(|&t| mesh.surface[t] as usize == surface)
            .map(|t| mesh.area(t))
            .sum()
    };
    let mut order: Vec<usize> =
        (0..capture.surfaces.len()).filter(|&s| capture.surfaces[s].material().is_some()).collect();
    order.sort_by(|&a, &b| area(b).total_cmp(&area(a)));
    let mut cut = Vec::new();
    for surface in order.into_iter().take(count) {
        let Some(material) = capture.surfaces[surface].material() else { continue };
        let triangles: Vec<usize> =
            (0..mesh.triangles.len()).filter(|&t| mesh.surface[t] as usize == surface).collect();
        // A surface of a single face has no half of its own.
        let Some((&first, _)) = triangles.split_first().filter(|_| triangles.len() > 1) else {
            continue;
        };
        let center = |t: usize| mesh.corners(t).iter().sum::<Vec3>() / 3.0;
        let from = center(first);
        let across = triangles
            .iter()
            .map(|&t| center(t) - from)
            .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
            .unwrap_or_default();
        let far: Vec<usize> = triangles
            .into_iter()
            .filter(|&t| (center(t) - from).dot(across) > 0.5 * across.length_squared())
            .collect();
        let mut other = capture.surfaces[surface].clone();
        let mut twin = capture.materials[material].clone();
        let index = capture.surfaces.len();
        other.name = format!("{} (half)", other.name);
        other.role = Role::Material(capture.materials.len());
        twin.name = format!("{} (half {})", twin.name, index);
        twin.surfaces = vec![index];
        cut.push((other.name.clone(), capture.surfaces[surface].name.clone()));
        for t in far {
            mesh.surface[t] = index as u32;
        }
        capture.surfaces.push(other);
        capture.materials.push(twin);
    }
    capture.mesh = Arc::new(mesh);
    cut
}

/// Multiplies what the photographs show of the surfaces by a pattern in space whose mean is one;
/// the light that surfaces send each other stays as it was.
fn add_texture(capture: &mut Capture, contrast: f64, watch: &Watch) -> Result<(), Cancelled> {
    let (low, high) = capture.mesh.bounds().unwrap_or_default();
    let cell = 0.07 * 0.5 * (high - low).length().max(f32::MIN_POSITIVE);
    let original = capture.clone();
    let caster = RayCaster::build(&original.mesh.positions, &original.mesh.triangles);
    let views = Views::new(&original, &caster, watch)?;
    for buffer in &views.buffers {
        let image = buffer.image;
        let (width, height) = (image.width(), image.height());
        let pixel = |k: usize| -> Radiance {
            let (x, y) = (k % width, k / width);
            let Some(radiance) = image.radiance(x, y) else { return [f32::NAN; CHANNELS] };
            let Some((position, _)) = buffer.hit(x, y) else { return radiance };
            // Off the planes of walls by a part of a cell that no rounding reaches.
            let place = ((position - low) / cell + Vec3::splat(0.37)).floor();
            let is_light = (place.x + place.y + place.z).rem_euclid(2.0) < 0.5;
            let factor = if is_light { 1.0 + contrast } else { 1.0 - contrast };
            radiance.map(|v| v * factor as f32)
        };
        let pixels = (0..width * height).map(pixel).collect();
        capture.photographs[buffer.photograph].image = Some(Arc::new(remade(image, pixels)));
    }
    Ok(())
}
