//! Section 4.1: surface samples, the points at which measured and computed radiance are compared.

use std::sync::atomic::AtomicUsize;

use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::spaced::{indices, select_spaced};
use crate::math::rgb::Radiance;
use crate::math::sampling::Random;
use crate::options;
use crate::reconstruct::candidates::{self, Candidate, material_of, materials};
use crate::reconstruct::{Error, Stream};
use crate::scene::{SurfacePoint, Views, agreed};
use crate::watch::{Cancelled, Watch};

options! {
    /// Where samples are placed and what is read there.
    SampleOptions in "samples" {
        /// Number of samples aimed at when the spacing is chosen automatically (Section 4.1).
        count: usize = 3500, Some((1.0, 2e6)), "";
        /// Minimum distance between samples (Section 4.1); auto: chosen to reach the count.
        spacing_m: Option<f64> = None, Some((1e-6, 1e6)), "m";
        /// A material with fewer samples than this is sampled again, more densely.
        min_per_material: usize = 80, Some((0.0, 1e6)), "";
        /// Reject pixels beside face and silhouette edges, which mix two surfaces.
        reject_edges: bool = true, None, "";
        /// Side of the window of pixels over which a sample's radiance is averaged. Where an edge cuts
        /// the window, the pixel in its middle is used alone.
        window_px: usize = 3, Some((1.0, 31.0)), "px";
        /// Leave out pixels that show unmodelled things in front of surfaces, where photographs of one
        /// point differ and a highlight is not the cause. Needs three photographs.
        omit_unmodelled: bool = false, None, "";
        /// A photograph is not used where the cosine between its viewing direction and the surface
        /// normal is smaller.
        min_cosine: f64 = 0.1, Some((0.0, 0.99)), "";
    }
}

/// The surface samples and what each photograph measured there.
#[derive(Clone, Debug, Default)]
pub struct SampleCloud {
    /// Minimum distance between samples in metres (materials with few samples have a smaller
    /// one).
    pub spacing_m: f32,
    /// The samples, material by material in no particular order.
    pub samples: Vec<Sample>,
    /// The photographs of all samples, one after the other; see `Sample::views`.
    pub views: Vec<View>,
    /// Per material the area that one of its samples represents, relative to that of samples at the
    /// common distance; 1 for materials beyond its end.
    pub relative_area: Vec<f64>,
    /// Warnings about the samples, one sentence each.
    pub warnings: Vec<String>,
}

impl SampleCloud {
    /// The area that a sample of a material represents, relative to that of samples at the common
    /// distance.
    pub fn relative_area(&self, material: usize) -> f64 {
        self.relative_area.get(material).copied().unwrap_or(1.0)
    }
}

/// A point on a known surface with its measured radiance.
#[derive(Clone, Debug)]
pub struct Sample {
    /// In metres, in world coordinates.
    pub position: Vec3,
    /// Unit normal of the photographed side.
    pub normal: Vec3,
    /// Index into `Capture::materials`.
    pub material: usize,
    /// Index into `Capture::surfaces`.
    pub surface: usize,
    /// The first of this sample's entries in `SampleCloud::views`, and one past the last.
    pub views: std::ops::Range<usize>,
    /// Of the views, see [`agreed`]: L of a diffuse sample.
    pub radiance: Radiance,
}

/// The radiance that one photograph measured at one sample: L(x, ω_k).
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Index into `Capture::photographs`.
    pub photograph: usize,
    /// Pixel that shows the sample.
    pub pixel: [usize; 2],
    /// Unit direction from the sample to the camera, ω_r.
    pub direction: Vec3,
    /// In the unit of the photographs.
    pub radiance: Radiance,
}

impl Sample {
    /// The point that light transport is computed for.
    pub fn surface_point(&self) -> SurfacePoint {
        SurfacePoint { position: self.position, normal: self.normal }
    }
}

/// Random points that keep a distance d from each other and leave no room for another cover
/// an area A with about 0.697 A/d² points (a jamming coverage of 0.547 by discs of radius d/2).
pub const JAMMING_DENSITY: f64 = 0.697;

/// Places samples over the photographed surfaces.
///
/// # Errors
/// `Error::Cancelled`, and `Error::TooManyPixels` where the photographs have more pixels than
/// samples can be chosen from.
pub fn place(
    views: &Views,
    options: &SampleOptions,
    seed: u64,
    watch: &Watch,
) -> Result<SampleCloud, Error> {
    let capture = views.capture;
    let mut warnings = Vec::new();
    watch.begin(4);
    let wanted = candidates::Wanted {
        min_cosine: options.min_cosine,
        samples: options.count,
        seed,
        of_material: &|_| true,
    };
    let mut candidates = candidates::find(views, &wanted, options.reject_edges)?;
    watch.tick()?;

    // A material that shows only beside edges is better sampled there than not at all.
    let mut shown = vec![0usize; capture.materials.len()];
    for material in materials(views, &candidates) {
        shown[material as usize] += 1;
    }
    if options.reject_edges && shown.contains(&0) {
        let edge = candidates::find(views, &wanted, false)?;
        let mut rescued = vec![0usize; capture.materials.len()];
        for candidate in edge {
            let material = material_of(views, candidate);
            if shown[material] == 0 {
                rescued[material] += 1;
                candidates.push(candidate);
            }
        }
        for (material, count) in rescued.iter().enumerate().filter(|(_, count)| **count > 0) {
            warnings.push(format!(
                "material \"{}\" shows only beside edges: its samples ({count} pixels) are \
                 mixed with neighbouring surfaces",
                capture.materials[material].name
            ));
        }
    }
    // In the order of the pixels, samples would line up along the rows of the first photograph.
    let mut order = indices(candidates.len())?;
    Random::new(seed, Stream::Samples as u64, 0).shuffle(&mut order);
    watch.tick()?;

    let positions: Vec<Vec3> =
        candidates.par_iter().map(|candidate| candidate.hit(views).0).collect();
    let spacing_m = match options.spacing_m {
        Some(spacing) => spacing as f32,
        None => spacing_for(&positions, &order, options.count, watch)?,
    };
    let mut kept = select_spaced(&positions, &order, spacing_m, watch)?;
    watch.tick()?;

    let relative_area =
        densify(views, options, &candidates, (&positions, &order), spacing_m, &mut kept, watch)?;
    let done = AtomicUsize::new(0);
    let read: Vec<Option<(Sample, Vec<View>)>> = kept
        .par_iter()
        .map(|&index| {
            watch.check()?;
            views.count_point(&done);
            Ok(read(views, options, candidates[index as usize]))
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut cloud = SampleCloud { spacing_m, relative_area, warnings, ..SampleCloud::default() };
    for (mut sample, seen) in read.into_iter().flatten() {
        sample.views = cloud.views.len()..cloud.views.len() + seen.len();
        cloud.views.extend(seen);
        cloud.samples.push(sample);
    }
    watch.tick()?;
    Ok(cloud)
}

/// The minimum distance at which about `count` of the points, in a random order, are kept.
pub fn spacing_for(
    positions: &[Vec3],
    order: &[u32],
    count: usize,
    watch: &Watch,
) -> Result<f32, Cancelled> {
    let Some(&first) = positions.first() else { return Ok(1.0) };
    let (low, high) =
        positions.iter().fold((first, first), |(low, high), p| (low.min(*p), high.max(*p)));
    let size = high - low;
    let box_area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
    let spacing_of =
        |area: f64, count: f64| ((JAMMING_DENSITY * area / count).sqrt() as f32).max(1e-6);
    // Two trials: the first, on the area of the bounding box, measures the area that is seen;
    // the second corrects for the edges of small surfaces.
    let mut spacing = spacing_of(f64::from(box_area).max(1e-12), count.min(1000) as f64);
    for trial in [count.min(1000), count] {
        let some = &order[..order.len().min(50 * trial.max(200))];
        let kept = select_spaced(positions, some, spacing, watch)?.len();
        let area = kept as f64 * f64::from(spacing).powi(2) / JAMMING_DENSITY;
        spacing = spacing_of(area, count as f64);
    }
    Ok(spacing)
}

/// Replaces the samples of materials that have too few by more closely spaced ones. Returns the area
/// that a sample of each material stands for then ([`SampleCloud::relative_area`]).
fn densify(
    views: &Views,
    options: &SampleOptions,
    candidates: &[Candidate],
    (positions, order): (&[Vec3], &[u32]),
    spacing_m: f32,
    kept: &mut Vec<u32>,
    watch: &Watch,
) -> Result<Vec<f64>, Cancelled> {
    let mut counts = vec![0usize; views.capture.materials.len()];
    let mut relative_area = vec![1.0; counts.len()];
    for &index in kept.iter() {
        counts[material_of(views, candidates[index as usize])] += 1;
    }
    if counts.iter().all(|&count| count == 0 || count >= options.min_per_material) {
        return Ok(relative_area);
    }
    let materials = materials(views, candidates);
    for (material, &count) in counts.iter().enumerate() {
        if count == 0 || count >= options.min_per_material {
            continue;
        }
        let own: Vec<u32> = order
            .iter()
            .copied()
            .filter(|&index| materials[index as usize] as usize == material)
            .collect();
        let closer = spacing_m * (count as f32 / options.min_per_material as f32).sqrt();
        kept.retain(|&index| materials[index as usize] as usize != material);
        let more = select_spaced(positions, &own, closer, watch)?;
        relative_area[material] = count as f64 / more.len() as f64;
        kept.extend(more);
    }
    Ok(relative_area)
}

/// Reads a sample's radiance in every photograph that shows it.
fn read(
    views: &Views,
    options: &SampleOptions,
    candidate: Candidate,
) -> Option<(Sample, Vec<View>)> {
    let (position, triangle) = candidate.hit(views);
    let point = candidate.point(views);
    let look = |off_edges: bool| -> Vec<View> {
        views
            .buffers
            .iter()
            .filter_map(|buffer| {
                let seen = views.seen(buffer, point)?;
                if f64::from(seen.cosine) < options.min_cosine
                    || (off_edges && !buffer.is_off_edges(seen.x, seen.y))
                {
                    return None;
                }
                Some(View {
                    photograph: buffer.photograph,
                    pixel: [seen.x, seen.y],
                    direction: seen.direction,
                    radiance: buffer.window(seen.x, seen.y, options.window_px)?,
                })
            })
            .collect()
    };
    let mut seen = look(options.reject_edges);
    if seen.is_empty() && options.reject_edges {
        seen = look(false);
    }
    if seen.is_empty() {
        return None;
    }
    let measured: Vec<Radiance> = seen.iter().map(|view| view.radiance).collect();
    let sample = Sample {
        position,
        normal: point.normal,
        material: material_of(views, candidate),
        surface: views.capture.mesh.surface[triangle as usize] as usize,
        views: 0..0,
        radiance: agreed(&measured),
    };
    Some((sample, seen))
}
