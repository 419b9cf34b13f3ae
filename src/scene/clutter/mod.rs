//! Finds unmodelled things in front of the known surfaces in photographs, such as cups, plants and
//! people. Masks are suggested for them.
//!
//! Photographs of one point of a diffuse surface agree. A photograph may differ from most others at
//! a point by more than is usual for that surface (because of noise, gloss or small errors of the
//! mesh). Then it shows a highlight there, or something was in front of the surface (`difference`).
//! A point that no other photograph shows is compared with the usual colour of its surface. An
//! object has a position: somewhere along the ray of the pixel, in front of the surface, the other
//! photographs differ too, and none of them shows the known surface behind that place (`occupied`).
//! For a highlight there is no such place. Finally, the mask is extended to edges in the photograph
//! (`regions`).
//!
//! The constants were set on `kitchen-coarse`, where the unmodelled things are known, and what counts
//! half on the random furnished rooms and those with clutter or coats.

mod difference;
mod islands;
mod occupied;
mod regions;
mod small;

use rayon::prelude::*;

use crate::geometry::bvh::RayCaster;
use crate::scene::views::VisibilityBuffer;
use crate::scene::{Capture, Views};
use crate::watch::{Cancelled, Watch};

use small::{SmallView, Squares};

/// Evidence from which on a pixel is masked in a suggestion, unless another one is asked for.
pub const SUGGESTED: f64 = 0.5;
/// Evidence from which on a pixel may be left out without anybody having looked at it: more than
/// doubtful evidence alone reaches.
pub const CERTAIN: f64 = 1.0;
/// For a suggestion, photographs are made smaller until no side has more pixels.
const LONGEST_SIDE: usize = 640;
/// Photographs below which none can be told to be the odd one.
const FEWEST: usize = 3;
/// How much the evidence along the ray counts beside the pixel's own.
const ALONG_RAY: f32 = 0.3;
/// Islands and holes below this part of the photograph are not kept.
const SMALLEST_ISLAND: f64 = 5e-4;

/// A mask for one photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// Index into `Capture::photographs`.
    pub photograph: usize,
    /// For each pixel, row by row from the top, whether it shows what was not modelled.
    pub is_masked: Vec<bool>,
}

impl Suggestion {
    /// The part of the photograph that is masked, 0 to 1.
    pub fn share(&self) -> f64 {
        let masked = self.is_masked.iter().filter(|&&own| own).count();
        masked as f64 / self.is_masked.len().max(1) as f64
    }
}

/// A mask for one photograph, in squares of its pixels.
pub struct Mask {
    /// Index into `Capture::photographs`.
    pub photograph: usize,
    squares: Squares,
    /// For each square, row by row from the top.
    is_masked: Vec<bool>,
}

impl Mask {
    /// Whether a pixel shows what was not modelled.
    pub fn is_masked(&self, x: usize, y: usize) -> bool {
        self.is_masked[self.squares.index((x, y))]
    }

    /// The part of the photograph that is masked, 0 to 1.
    pub fn share(&self) -> f64 {
        let masked = self.is_masked.iter().filter(|&&own| own).count();
        masked as f64 / self.is_masked.len().max(1) as f64
    }
}

/// Masks for all photographs that are measurements. Fewer than three give empty masks: of two that
/// disagree nobody knows which is right. Masks that the photographs have already are not heeded.
pub fn suggest(
    capture: &Capture,
    threshold: f64,
    watch: &Watch,
) -> Result<Vec<Suggestion>, Cancelled> {
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(capture, &caster, watch)?;
    let masks = find(&views, LONGEST_SIDE, threshold, watch)?;
    let enlarged = |(mask, buffer): (&Mask, &VisibilityBuffer)| {
        let (width, height) = (buffer.camera.width, buffer.camera.height);
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let is_masked = pixels.map(|(x, y)| mask.is_masked(x, y)).collect();
        Suggestion { photograph: mask.photograph, is_masked }
    };
    Ok(masks.iter().zip(&views.buffers).map(enlarged).collect())
}

/// The same for photographs whose visibility is known, and which are compared at `longest_side` pixels
/// or fewer.
pub fn find(
    views: &Views,
    longest_side: usize,
    threshold: f64,
    watch: &Watch,
) -> Result<Vec<Mask>, Cancelled> {
    let count = views.buffers.len();
    if count < FEWEST {
        let empty = |buffer: &VisibilityBuffer| {
            let squares = Squares::new(buffer.camera, longest_side);
            let is_masked = vec![false; squares.width * squares.height];
            Mask { photograph: buffer.photograph, squares, is_masked }
        };
        return Ok(views.buffers.iter().map(empty).collect());
    }
    watch.begin(4 * count as u64);
    let small: Vec<SmallView> =
        each(count, watch, |view| SmallView::new(views, view, longest_side))?;
    let compared = each(count, watch, |view| difference::compare(views, &small, view))?;
    let usual = difference::usual(views, &small, &compared);
    let own: Vec<Vec<f32>> = std::iter::zip(&small, &compared)
        .map(|(view, compared)| difference::evidence(view, compared, &usual))
        .collect();
    let extent = small::typical_distance(&small);
    each(count, watch, |view| {
        let occupied = occupied::along_rays(views, &small, &own, view, extent);
        Ok((view, occupied))
    })?
    .into_par_iter()
    .map(|(index, occupied)| {
        watch.tick()?;
        let view = &small[index];
        let sum = |(own, along): (&f32, &f32)| own + ALONG_RAY * along;
        let both: Vec<f32> = own[index].iter().zip(&occupied).map(sum).collect();
        let both = islands::median(&both, view.size(), 2);
        let evidence = regions::joined(view, &both);
        let mut is_masked: Vec<bool> =
            evidence.iter().map(|&own| f64::from(own) > threshold).collect();
        islands::tidy(&mut is_masked, view.size(), SMALLEST_ISLAND);
        Ok(Mask { photograph: view.photograph, squares: view.squares, is_masked })
    })
    .collect()
}

fn each<T: Send>(
    count: usize,
    watch: &Watch,
    of: impl Fn(usize) -> Result<T, Cancelled> + Sync,
) -> Result<Vec<T>, Cancelled> {
    let one = |index| {
        watch.tick()?;
        of(index)
    };
    (0..count).into_par_iter().map(one).collect()
}

#[cfg(test)]
mod tests;
