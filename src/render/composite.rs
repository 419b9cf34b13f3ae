//! Edits set into a photograph by differential rendering (Debevec 1998).

use crate::math::rgb::Radiance;
use crate::render::film::Film;
use crate::scene::Image;

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
        let object = objects[index];
        let measured = photograph.radiance(x, y);
        let without = without.map(|value| light * value);
        let change: Radiance =
            std::array::from_fn(|c| if object >= 1.0 { 0.0 } else { with[c] - without[c] });
        composed.picture.push(std::array::from_fn(|c| {
            // Of a pixel that an object covers in part both renderings have the background.
            let photographed = measured.map_or(without[c], |measured| light * measured[c]);
            let background = (photographed + (with[c] - without[c])).max(0.0);
            object * with[c] + (1.0 - object) * background
        }));
        composed.change.push(change);
    }
    composed
}
