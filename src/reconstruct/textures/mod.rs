//! Section 5.5: a map of diffuse reflectance for every textured surface, by Eq. 13 per texel.
//!
//! Textures are reconstructed once, after the refinement has converged, so that gradients of
//! the light are not taken for texture.

mod cells;
pub(super) mod light;
pub(super) mod sharpen;
mod texels;

use std::collections::VecDeque;

use glam::Vec2;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::options;
use crate::reconstruct::Error;
use crate::reconstruct::options::Options;
use crate::reconstruct::recovered::RecoveredLight;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::textures::cells::Grid;
use crate::reconstruct::textures::light::Light;
use crate::reconstruct::textures::texels::{Estimate, Texels};
use crate::reconstruct::unwrap::{TexelSize, Unwrap, unwrap};
use crate::scene::views::{Seen, VisibilityBuffer};
use crate::scene::{Brdf, MaterialKind, Role, SurfacePoint, Views};
use crate::watch::{Cancelled, Watch};

options! {
    /// The texture maps of textured materials.
    TextureOptions in "textures" {
        /// Reconstruct textures at all (Section 5.5).
        enabled: bool = true, None, "";
        /// Size of a texel, as a multiple of the surface that a pixel of the nearest photograph
        /// covers.
        texel_px: f64 = 0.7, Some((0.1, 100.0)), "px";
        /// Texels along a texture's side at most.
        max_side: usize = 1024, Some((4.0, 16384.0)), "texels";
        /// Irradiance is computed at every so many texels, and between them only where it
        /// changes quickly.
        stride: usize = 12, Some((1.0, 64.0)), "texels";
        /// Rounds in which the texels of diffuse surfaces are sharpened until their means over the
        /// photographs' pixels are what these measured. More rounds: sharper, and noisier.
        sharpen: usize = 4, Some((0.0, 1000.0)), "rounds";
        /// Rays that gather the light of photographed surfaces where irradiance is computed.
        rays: usize = 196, Some((1.0, 1e5)), "";
        /// Rays over a light's disc there.
        disc_rays: usize = 4, Some((1.0, 1e4)), "";
    }
}

/// The diffuse reflectance of one surface as a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Index into `Capture::surfaces`.
    pub surface: usize,
    /// Index into `Capture::materials`.
    pub material: usize,
    /// Size of the texture, and where each triangle lies on it.
    pub unwrap: Unwrap,
    /// Diffuse reflectance, row by row from the top (v = 1); texels that no photograph
    /// measures are filled from their neighbours.
    pub texels: Vec<Radiance>,
    /// The texel was measured.
    pub seen: Vec<bool>,
}

/// Where a texel's centre lies on the surface.
#[derive(Clone, Copy, Debug)]
struct Place {
    polygon: u32,
    point: SurfacePoint,
}

/// Reconstructs the textures of all textured materials that have samples. `brdfs` has one per
/// material.
///
/// # Errors
/// `Error::Cancelled` alone.
pub fn reconstruct(
    views: &Views,
    cloud: &SampleCloud,
    light: &RecoveredLight,
    brdfs: &[Option<Brdf>],
    options: &Options,
    watch: &Watch,
) -> Result<Vec<Texture>, Error> {
    let capture = views.capture;
    let mut textures = Vec::new();
    if !options.textures.enabled {
        return Ok(textures);
    }
    let light = Light::new(light, options);
    for (surface, tagged) in capture.surfaces.iter().enumerate() {
        let Role::Material(material) = tagged.role else { continue };
        let Some(brdf) = &brdfs[material] else { continue };
        let Some(footprint) = footprint(views, cloud, surface) else { continue };
        if !capture.materials[material].textured {
            continue;
        }
        let size = TexelSize {
            texel_m: footprint * options.textures.texel_px as f32,
            max_side: options.textures.max_side,
        };
        let unwrap = unwrap(&capture.mesh, surface, tagged.has_texcoords, size);
        let places = rasterize(views, &unwrap, watch)?;
        watch.begin(2 * places.len() as u64);
        let stride = options.textures.stride.next_power_of_two();
        let grid = Grid { places: &places, width: unwrap.width, stride, finest: 1 };
        let irradiance = light.irradiance(views, grid, &options.textures, watch)?;
        let is_specular = capture.materials[material].kind == MaterialKind::Specular;
        let texels = Texels {
            views,
            surface,
            is_specular,
            grid,
            irradiance: &irradiance,
            light: &light,
            options: &options.textures,
        };
        let mut estimated = without_edges(texels.reflectances(brdf, watch)?, unwrap.width);
        if !is_specular && options.textures.sharpen > 0 {
            estimated =
                sharpened(views, &unwrap, estimated, &irradiance, options.textures.sharpen, watch)?;
        }
        let seen: Vec<bool> = estimated.iter().map(Option::is_some).collect();
        let fallback = brdf.diffuse.map(|value| value as f32);
        let texels = fill(estimated, unwrap.width, fallback);
        textures.push(Texture { surface, material, unwrap, texels, seen });
    }
    Ok(textures)
}

/// Reflectances with more detail; of texels that have one.
fn sharpened(
    views: &Views,
    unwrap: &Unwrap,
    estimated: Vec<Option<Radiance>>,
    irradiance: &[Option<Rgb>],
    rounds: usize,
    watch: &Watch,
) -> Result<Vec<Option<Radiance>>, Cancelled> {
    let factors: Vec<Option<Radiance>> = irradiance
        .iter()
        .map(|irradiance| irradiance.map(|e| e.map(|e| (e / std::f64::consts::PI) as f32)))
        .collect();
    let times = |(texel, factor): (Option<Radiance>, &Option<Radiance>)| {
        texel.zip(*factor).map(|(texel, factor)| std::array::from_fn(|c| texel[c] * factor[c]))
    };
    let sent = estimated.into_iter().zip(&factors).map(times).collect();
    let sent = sharpen::sharpen(views, unwrap, sent, rounds, watch)?;
    let over = |(texel, factor): (Option<Radiance>, &Option<Radiance>)| {
        let over = |(sent, factor): (Radiance, Radiance)| {
            std::array::from_fn(|c| (sent[c] / factor[c]).clamp(0.0, 1.0))
        };
        texel.zip(*factor).map(over)
    };
    Ok(sent.into_iter().zip(&factors).map(over).collect())
}

/// Mean over the measured texels of a material's textures; `None` where it has none.
pub fn mean_reflectance(textures: &[Texture], material: usize) -> Option<Rgb> {
    let (mut sum, mut count) = ([0.0; CHANNELS], 0usize);
    for texture in textures.iter().filter(|texture| texture.material == material) {
        for (texel, _) in texture.texels.iter().zip(&texture.seen).filter(|(_, seen)| **seen) {
            for (sum, value) in sum.iter_mut().zip(texel) {
                *sum += f64::from(*value);
            }
            count += 1;
        }
    }
    (count > 0).then(|| sum.map(|value| value / count as f64))
}

/// The length on the surface that one pixel of the nearest photograph covers: the median over
/// the surface's samples, in metres.
fn footprint(views: &Views, cloud: &SampleCloud, surface: usize) -> Option<f32> {
    let capture = views.capture;
    let mut footprints: Vec<f32> = cloud
        .samples
        .iter()
        .filter(|sample| sample.surface == surface)
        .map(|sample| {
            cloud.views[sample.views.clone()]
                .iter()
                .map(|view| {
                    let camera = &capture.photographs[view.photograph].camera;
                    let distance = camera.position.as_vec3().distance(sample.position);
                    distance / camera.focal_px.min_element() as f32
                })
                .fold(f32::INFINITY, f32::min)
        })
        .collect();
    footprints.sort_unstable_by(f32::total_cmp);
    footprints.get(footprints.len() / 2).copied()
}

/// The surface point at every texel's centre that a photograph measures, on the photographed side.
pub fn points(
    views: &Views,
    unwrap: &Unwrap,
    watch: &Watch,
) -> Result<Vec<Option<SurfacePoint>>, Cancelled> {
    let places = rasterize(views, unwrap, watch)?;
    Ok(places.into_iter().map(|place| place.map(|place| place.point)).collect())
}

/// The place of every texel's centre that a photograph measures, on the photographed side.
fn rasterize(
    views: &Views,
    unwrap: &Unwrap,
    watch: &Watch,
) -> Result<Vec<Option<Place>>, Cancelled> {
    let mesh = &views.capture.mesh;
    // An unwrap is of one surface.
    let surface = unwrap.triangles.first().map_or(0, |&first| mesh.surface[first] as usize);
    let size = Vec2::new(unwrap.width as f32, unwrap.height as f32);
    let mut places: Vec<Option<Place>> = vec![None; unwrap.width * unwrap.height];
    for (&triangle, corners) in unwrap.triangles.iter().zip(&unwrap.corners) {
        watch.check()?;
        // Texel coordinates, rows from the top.
        let [a, b, c] = corners.map(|uv| Vec2::new(uv.x, 1.0 - uv.y) * size);
        let doubled = (b - a).perp_dot(c - a);
        if doubled.abs() < 1e-12 {
            continue;
        }
        let low = a.min(b).min(c).floor().max(Vec2::ZERO);
        let high = a.max(b).max(c).ceil().min(size);
        let positions = mesh.corners(triangle);
        let normal = views.normals[triangle];
        for y in low.y as usize..high.y as usize {
            for x in low.x as usize..high.x as usize {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let v = (p - a).perp_dot(c - a) / doubled;
                let w = (b - a).perp_dot(p - a) / doubled;
                // A texel on the edge between two triangles belongs to both; the first has it.
                if v >= -1e-4 && w >= -1e-4 && v + w <= 1.0002 {
                    let position =
                        positions[0] * (1.0 - v - w) + positions[1] * v + positions[2] * w;
                    let point = SurfacePoint { position, normal };
                    let polygon = mesh.polygon[triangle];
                    places[y * unwrap.width + x].get_or_insert(Place { polygon, point });
                }
            }
        }
    }
    places
        .into_par_iter()
        .map(|place| {
            watch.check()?;
            Ok(place.and_then(|place| {
                let point = measured_side(views, surface, place.point)?;
                Some(Place { point, ..place })
            }))
        })
        .collect()
}

/// The pixel in which a photograph shows a point of a surface, and the radiance there. A thing that
/// lies on the surface may be flatter than a pixel is wide, so that [`Views::seen`] does not tell them
/// apart.
fn shows(
    views: &Views,
    buffer: &VisibilityBuffer,
    surface: usize,
    point: SurfacePoint,
) -> Option<(Seen, Radiance)> {
    let seen = views.seen(buffer, point)?;
    let is_other = |triangle| views.capture.mesh.surface[triangle as usize] as usize != surface;
    if buffer.is_off_edges(seen.x, seen.y) && buffer.triangle(seen.x, seen.y).is_some_and(is_other)
    {
        return None;
    }
    Some((seen, buffer.image.radiance(seen.x, seen.y)?))
}

/// The side of a surface that is photographed: the outer one, unless only the inner one is. The inner
/// side of a thin sheet lies less than a pixel behind its front, and is dark.
fn measured_side(views: &Views, surface: usize, outer: SurfacePoint) -> Option<SurfacePoint> {
    let is_shown = |buffer, point| shows(views, buffer, surface, point).is_some();
    if views.buffers.iter().any(|buffer| is_shown(buffer, outer)) {
        return Some(outer);
    }
    let inner = SurfacePoint { normal: -outer.normal, ..outer };
    let is_in_sight = |buffer| is_shown(buffer, inner) && views.is_in_sight(buffer, inner);
    views.buffers.iter().any(is_in_sight).then_some(inner)
}

/// The reflectance of every texel. Those that are shown only beside edges, together with another
/// surface, get the mean of their neighbours that are not; their own is kept where no such texel is
/// connected with them.
fn without_edges(estimated: Vec<Option<Estimate>>, width: usize) -> Vec<Option<Radiance>> {
    let own = |estimate: &Option<Estimate>| estimate.map(|estimate| estimate.reflectance);
    let is_mixed: Vec<bool> =
        estimated.iter().map(|texel| texel.is_some_and(|texel| !texel.is_off_edges)).collect();
    let mut texels: Vec<Option<Radiance>> = estimated
        .iter()
        .zip(&is_mixed)
        .map(|(texel, mixed)| own(texel).filter(|_| !mixed))
        .collect();
    spread(&mut texels, width, |index| is_mixed[index]);
    texels.iter().zip(&estimated).map(|(texel, estimate)| texel.or(own(estimate))).collect()
}

/// Gives every texel without an estimate the mean of its neighbours that have one, working
/// outwards; `fallback` where there is no estimate at all.
pub fn fill(mut texels: Vec<Option<Radiance>>, width: usize, fallback: Radiance) -> Vec<Radiance> {
    spread(&mut texels, width, |_| true);
    texels.into_iter().map(|texel| texel.unwrap_or(fallback)).collect()
}

/// Gives those texels without an estimate that `may` have one the mean of their neighbours that have
/// one, working outwards.
fn spread(texels: &mut [Option<Radiance>], width: usize, may: impl Fn(usize) -> bool) {
    let height = texels.len() / width.max(1);
    let neighbours = |index: usize| {
        let (x, y) = (index % width, index / width);
        let left = (x > 0).then(|| index - 1);
        let right = (x + 1 < width).then(|| index + 1);
        let above = (y > 0).then(|| index - width);
        let below = (y + 1 < height).then(|| index + width);
        [left, right, above, below].into_iter().flatten()
    };
    let mut queue: VecDeque<usize> =
        (0..texels.len()).filter(|&index| texels[index].is_some()).collect();
    while let Some(index) = queue.pop_front() {
        for next in neighbours(index) {
            if texels[next].is_some() || !may(next) {
                continue;
            }
            let (mut sum, mut count) = ([0.0f32; CHANNELS], 0.0);
            for texel in neighbours(next).filter_map(|index| texels[index]) {
                for (sum, value) in sum.iter_mut().zip(texel) {
                    *sum += value;
                }
                count += 1.0;
            }
            texels[next] = Some(sum.map(|value| value / count));
            queue.push_back(next);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_without_a_measurement_are_filled_from_their_neighbours() {
        let mut estimated = vec![None; 12];
        estimated[0] = Some([0.2; 3]);
        estimated[3] = Some([0.6; 3]);
        let filled = fill(estimated, 4, [0.9; 3]);
        assert_eq!(filled[4], [0.2; 3]);
        assert_eq!(filled[11], [0.6; 3]);
        assert!(filled.iter().all(|t| (0.2..=0.6).contains(&t[0])));
        assert_eq!(fill(vec![None; 4], 2, [0.9; 3]), [[0.9; 3]; 4]);
    }

    #[test]
    fn texels_beside_edges_follow_those_that_show_the_surface_alone() {
        let texel = |value: f32, is_off_edges| {
            Some(Estimate { reflectance: [value; CHANNELS], is_off_edges })
        };
        // One row: clean, two beside an edge, a gap, and two beside an edge alone.
        let row = [texel(0.2, true), texel(0.6, false), texel(0.8, false), None, texel(0.5, false)];
        let told = without_edges(row.to_vec(), row.len());
        let expected = [Some(0.2), Some(0.2), Some(0.2), None, Some(0.5)];
        assert_eq!(told, expected.map(|value| value.map(|value| [value; CHANNELS])));
    }
}
