//! Section 4.2, Eq. 8: the emission lobes of each virtual light, chosen by a coverage mask.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::math::sampling::{Frame, square_to_uniform_hemisphere};
use crate::options;
use crate::reconstruct::lights::{LightKind, VirtualLight, VirtualLights};
use crate::scene::{SurfacePoint, Views};
use crate::watch::{Cancelled, Watch};

options! {
    /// The directional distribution of a virtual light.
    LobeOptions in "lobes" {
        /// Side of the coverage mask (128 or more in Section 4.2).
        mask_px: usize = 128, Some((6.0, 2048.0)), "px";
        /// Side of the grid of regions of the mask, each giving at most one lobe (6 in
        /// Section 4.2: at most 36 lobes).
        grid: usize = 6, Some((1.0, 32.0)), "";
        /// A region gives a lobe when more than this fraction of its directions meets measured
        /// surfaces (Section 4.2).
        min_coverage: f64 = 0.1, Some((0.0, 1.0)), "";
        /// Exponent α of the cosine lobes (Eq. 8).
        exponent: f64 = 20.0, Some((0.0, 1e4)), "";
    }
}

/// Which directions over a light's hemisphere meet measured surfaces (Fig. 6).
#[derive(Clone, Debug, PartialEq)]
pub struct CoverageMask {
    /// Pixels along each side.
    pub side: usize,
    /// Row by row; a pixel is set if its direction meets a measured surface.
    pub pixels: Vec<bool>,
}

/// The lobes of all lights; emissions are one number per lobe and channel.
#[derive(Clone, Debug, Default)]
pub struct Lobes {
    /// The lobes of all lights, one light after the other.
    pub lobes: Vec<Lobe>,
    /// The first lobe of each light, and at the end the number of lobes.
    pub first: Vec<usize>,
}

/// E (ω · ω_ij)^α, for directions ω within 90° of the lobe's; with α = 0 alike in all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// Index into `VirtualLights::lights`.
    pub light: usize,
    /// Unit direction ω_ij in which the lobe is strongest, away from the light.
    pub direction: Vec3,
    /// α_i.
    pub exponent: f32,
}

impl Lobe {
    /// (ω · ω_ij)^α for a unit direction away from the light (Eq. 8).
    pub fn value(&self, direction: Vec3) -> f32 {
        if self.exponent == 0.0 {
            return 1.0;
        }
        let cosine = direction.dot(self.direction).max(0.0);
        // Most lobes of lamps; the same number sooner.
        if self.exponent == 1.0 { cosine } else { cosine.powf(self.exponent) }
    }
}

impl Lobes {
    /// The lobes of one light, as a range of indices.
    pub fn of(&self, light: usize) -> std::ops::Range<usize> {
        self.first[light]..self.first[light + 1]
    }
}

/// Chooses lobes for every light; lights without a lobe light nothing and are removed.
pub fn choose(
    views: &Views,
    lights: &mut VirtualLights,
    options: &LobeOptions,
    watch: &Watch,
) -> Result<Lobes, Cancelled> {
    watch.begin((lights.lights.len() * options.mask_px) as u64);
    let chosen: Vec<Vec<(Vec3, f32)>> = lights
        .lights
        .par_iter()
        .map(|light| {
            // An unseen known surface is taken to be diffuse: one lobe along its normal.
            if light.kind == LightKind::Surface {
                watch.advance(options.mask_px as u64)?;
                return Ok(vec![(light.normal, 1.0)]);
            }
            let mask = coverage(views, light, options.mask_px, watch)?;
            let directions = centroids(&mask, options.grid, options.min_coverage)
                .into_iter()
                .map(|centroid| {
                    let local = square_to_uniform_hemisphere(centroid);
                    (Frame::about(light.normal).to_world(local), options.exponent as f32)
                })
                .collect();
            Ok(directions)
        })
        .collect::<Result<_, Cancelled>>()?;

    let mut kept = chosen.iter().map(|lobes| !lobes.is_empty());
    lights.lights.retain(|_| kept.next().unwrap_or(false));
    let mut lobes = Lobes { lobes: Vec::new(), first: vec![0] };
    for directions in chosen.into_iter().filter(|lobes| !lobes.is_empty()) {
        let light = lobes.first.len() - 1;
        lobes.lobes.extend(directions.into_iter().map(|(direction, exponent)| Lobe {
            light,
            direction,
            exponent,
        }));
        lobes.first.push(lobes.lobes.len());
    }
    Ok(lobes)
}

/// Casts a ray for every pixel of a light's coverage mask.
pub fn coverage(
    views: &Views,
    light: &VirtualLight,
    side: usize,
    watch: &Watch,
) -> Result<CoverageMask, Cancelled> {
    let frame = Frame::about(light.normal);
    let point = SurfacePoint { position: light.position, normal: light.normal };
    let rows: Vec<Vec<bool>> = (0..side)
        .into_par_iter()
        .map(|y| {
            watch.tick()?;
            let pixel = |x: usize| {
                let square = (Vec2::new(x as f32, y as f32) + 0.5) / side as f32;
                let ray = views.ray(point, frame.to_world(square_to_uniform_hemisphere(square)));
                views
                    .caster
                    .closest(&ray)
                    .is_some_and(|hit| views.is_measured(views.surface_point(&ray, &hit)))
            };
            Ok((0..side).map(pixel).collect())
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(CoverageMask { side, pixels: rows.concat() })
}

/// The centroids of the set pixels of every region that has enough of them, in [0, 1]².
pub fn centroids(mask: &CoverageMask, grid: usize, min_coverage: f64) -> Vec<Vec2> {
    let mut sums = vec![(Vec2::ZERO, 0usize, 0usize); grid * grid];
    for y in 0..mask.side {
        for x in 0..mask.side {
            let region = (y * grid / mask.side) * grid + x * grid / mask.side;
            let (sum, set, all) = &mut sums[region];
            *all += 1;
            if mask.pixels[y * mask.side + x] {
                *sum += (Vec2::new(x as f32, y as f32) + 0.5) / mask.side as f32;
                *set += 1;
            }
        }
    }
    sums.into_iter()
        .filter(|&(_, set, all)| set > 0 && set as f64 > min_coverage * all as f64)
        .map(|(sum, set, _)| sum / set as f32)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_gives_a_lobe_at_the_centroid_of_what_it_covers() {
        let side = 12;
        let mut pixels = vec![false; side * side];
        // The two left columns of the lower right region of a 2×2 grid, and a lone pixel.
        for y in 6..12 {
            pixels[y * side + 6] = true;
            pixels[y * side + 7] = true;
        }
        pixels[0] = true;
        let mask = CoverageMask { side, pixels };
        let found = centroids(&mask, 2, 0.1);
        assert_eq!(found.len(), 1);
        assert!((found[0] - Vec2::new(7.0 / 12.0, 9.0 / 12.0)).length() < 1e-6);
        assert_eq!(centroids(&mask, 2, 0.0).len(), 2);
    }
}
