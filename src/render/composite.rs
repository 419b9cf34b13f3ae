//! Adds layers up to pictures, and inserts edits into a photograph by differential rendering
//! (Debevec 1998).

use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance};
use crate::render::film::Film;
use crate::scene::{Camera, Image, Photograph};

/// The edits set into a photograph.
pub struct Composed {
    pub picture: Vec<Radiance>,
    /// What lights, objects and materials change of the known surfaces, beside the factor on the
    /// recovered light: shadows below 0, added light above.
    pub change: Vec<Radiance>,
}

/// Differential rendering (Debevec 1998): where objects are, their picture; elsewhere the
/// photograph with the difference that the edits make. Pixels of the photograph that are no
/// measurement are taken from the picture.
///
/// With `light`, the factor on all of the recovered light, the photograph is scaled as a whole:
/// what it shows beyond the model, parts that are not modelled and finer texture, was lit by the
/// same light. A difference alone would leave it there.
pub fn compose(with: &Film, without: &[Radiance], photograph: &Image, light: f32) -> Composed {
    let objects = with.object_coverage();
    let mut composed = Composed { picture: Vec::new(), change: Vec::new() };
    for (index, (with, without)) in with.beauty().into_iter().zip(without).enumerate() {
        let (x, y) = (index % photograph.width(), index / photograph.width());
        let measured = photograph.radiance(x, y);
        let (picture, change) = compose_pixel(with, *without, measured, objects[index], light);
        composed.picture.push(picture);
        composed.change.push(change);
    }
    composed
}

/// The same of one pixel, of which objects cover a part: the picture, and its change.
pub fn compose_pixel(
    with: Radiance,
    without: Radiance,
    measured: Option<Radiance>,
    object: f32,
    light: f32,
) -> (Radiance, Radiance) {
    let without = without.map(|value| light * value);
    let change = std::array::from_fn(|c| if object >= 1.0 { 0.0 } else { with[c] - without[c] });
    let picture = std::array::from_fn(|c| {
        // Of a pixel that an object covers in part both renderings have the background.
        let photographed = measured.map_or(without[c], |measured| light * measured[c]);
        let background = (photographed + (with[c] - without[c])).max(0.0);
        object * with[c] + (1.0 - object) * background
    });
    (picture, change)
}

/// Layers with their weights, and the photograph into which they are inserted.
pub struct Mix<'a> {
    pub after: Vec<(&'a Vec<Radiance>, Radiance)>,
    /// The scene without edits, where it is wanted.
    pub before: Option<Vec<(&'a Vec<Radiance>, Radiance)>>,
    /// Part of every pixel that known surfaces or objects cover.
    pub coverage: &'a [f32],
    /// Part of every pixel that objects cover.
    pub object: &'a [f32],
    /// A recovered sky is seen beyond them: the picture has no empty places.
    pub shows_sky: bool,
    pub photograph: Option<&'a Image>,
    /// Factor on all of the recovered light.
    pub light: f32,
}

/// Radiance, and the part of the pixel that the scene or a sky covers.
pub type Pixels = Vec<(Radiance, f32)>;

/// What the scene sends through the part of a pixel that it covers; `None` where it covers none.
pub fn covered_radiance(radiance: Radiance, coverage: f32) -> Option<Radiance> {
    let part = coverage.min(1.0);
    (part > 0.0).then(|| radiance.map(|value| value / part))
}

/// Pixels that one task mixes.
const MIXED: usize = 4096;

impl Mix<'_> {
    /// The picture, and that of the scene without edits; the latter only `with_former`.
    pub fn pictures(&self, width: usize, with_former: bool) -> (Pixels, Pixels) {
        let pixels = self.coverage.len();
        let mut result = vec![([0.0; CHANNELS], 0.0); pixels];
        let mut former = vec![([0.0; CHANNELS], 0.0); if with_former { pixels } else { 0 }];
        let strips = result.par_chunks_mut(MIXED).enumerate();
        if with_former {
            let both = strips.zip(former.par_chunks_mut(MIXED));
            both.for_each(|((index, result), former)| {
                self.fill(width, index * MIXED, result, former);
            });
        } else {
            strips.for_each(|(index, result)| self.fill(width, index * MIXED, result, &mut []));
        }
        (result, former)
    }

    /// The pixels from the `first` one on.
    fn fill(
        &self,
        width: usize,
        first: usize,
        result: &mut [(Radiance, f32)],
        former: &mut [(Radiance, f32)],
    ) {
        let range = first..first + result.len();
        let with = mixed(&self.after, range.clone());
        let without = self.before.as_ref().map(|layers| mixed(layers, range));
        let without = without.unwrap_or_default();
        let filled = |pixel: usize| if self.shows_sky { 1.0 } else { self.coverage[pixel] };
        let measured = |pixel: usize| self.photograph?.radiance(pixel % width, pixel / width);
        for (k, result) in result.iter_mut().enumerate() {
            let pixel = first + k;
            *result = (with[k], filled(pixel));
            if let (Some(_), Some(without)) = (self.photograph, without.get(k)) {
                let (seen, object) = (measured(pixel), self.object[pixel]);
                result.0 = compose_pixel(with[k], *without, seen, object, self.light).0;
                result.1 = if seen.is_some() { 1.0 } else { filled(pixel) };
            }
        }
        for (k, former) in former.iter_mut().enumerate() {
            let plain = || (without[k], filled(first + k));
            *former = measured(first + k).map_or_else(plain, |seen| (seen, 1.0));
        }
    }
}

/// The sum of layers times their weights, over a range of pixels.
fn mixed(layers: &[(&Vec<Radiance>, Radiance)], pixels: Range<usize>) -> Vec<Radiance> {
    // As many numbers as both a pixel and a vector of the processor have a multiple of.
    const WIDE: usize = 8 * CHANNELS;
    let mut sums = vec![[0.0; CHANNELS]; pixels.len()];
    for (layer, weight) in layers {
        let weights: [f32; WIDE] = std::array::from_fn(|k| weight[k % CHANNELS]);
        let sums = sums.as_flattened_mut();
        let values = layer[pixels.clone()].as_flattened();
        let whole = sums.len() / WIDE * WIDE;
        for (sums, values) in
            sums[..whole].as_chunks_mut::<WIDE>().0.iter_mut().zip(values.as_chunks::<WIDE>().0)
        {
            for k in 0..WIDE {
                sums[k] += weights[k] * values[k];
            }
        }
        for (k, (sum, value)) in sums[whole..].iter_mut().zip(&values[whole..]).enumerate() {
            *sum += weights[k] * value;
        }
    }
    sums
}

/// A photograph as another camera at the same place would have taken it, without distortion:
/// nothing where it shows nothing, or no measurement.
pub fn seen_by(camera: &Camera, photograph: &Photograph) -> Image {
    let nothing = [f32::NAN; CHANNELS];
    let at = |index: usize| {
        let image = photograph.image.as_ref()?;
        let corner = DVec2::new((index % camera.width) as f64, (index / camera.width) as f64);
        let direction = camera.direction(corner + 0.5)?;
        let (place, _) = photograph.camera.project(photograph.camera.position + direction)?;
        image.radiance(
            (place.x as usize).min(image.width() - 1),
            (place.y as usize).min(image.height() - 1),
        )
    };
    let pixels = (0..camera.width * camera.height)
        .into_par_iter()
        .map(|index| at(index).unwrap_or(nothing))
        .collect();
    Image::new(camera.width, camera.height, pixels, None)
}
