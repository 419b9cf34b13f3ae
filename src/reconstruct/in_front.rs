//! What photographs show in front of known surfaces and is not modelled: lamps ([`lamps`]) and other
//! things ([`clutter`]). Their pixels are left out, so that their radiance is not taken for that of
//! the surface behind them. Where no other photograph shows that surface, it counts as one without a
//! photograph.

mod lamps;

use std::sync::Arc;

use crate::scene::clutter::{self, Mask};
use crate::scene::{Capture, Image, Views};
use crate::watch::{Cancelled, Watch};

/// Photographs are compared at so many pixels or fewer along each side, and at so many in all.
const LONGEST_SIDE: usize = 320;
const MOST_PIXELS: usize = 2_000_000;
/// Bytes for one of these pixels, while things are looked for.
pub const PIXEL_BYTES: u64 = 170;

/// What stands in front of surfaces.
#[derive(Default)]
pub struct InFront {
    /// The capture, whose photographs leave out the pixels that show it, where there is anything.
    pub capture: Option<Capture>,
    pub found: Found,
}

/// What was found in front of surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// The surfaces in front of which lamps stand, by name.
    pub lamps: Vec<String>,
    /// Other things, if there are any.
    pub things: Option<Things>,
}

/// Where things were found.
#[derive(Clone, Debug, PartialEq)]
pub struct Things {
    /// The part of a photograph that they take up in the mean, 0 to 1.
    pub share: f64,
    /// The photograph with the largest part, and that part.
    pub most: (String, f64),
}

/// Finds lamps, and, if asked to, other things that are not modelled. Photographs that have a mask keep
/// it as it is, but for lamps.
///
/// # Errors
/// If it is cancelled.
pub fn find(views: &Views, with_things: bool, watch: &Watch) -> Result<InFront, Cancelled> {
    let mut in_front = InFront::default();
    if let Some(lamps) = lamps::find(views, watch)? {
        in_front.capture = Some(lamps.capture);
        in_front.found.lamps = lamps.surfaces;
    }
    if !with_things {
        return Ok(in_front);
    }
    let side = longest_side(views.buffers.len());
    let mut masks = clutter::find(views, side, clutter::CERTAIN, watch)?;
    let photographs = &views.capture.photographs;
    // Somebody has looked at a photograph that has a mask.
    let has_none = |image: &Arc<Image>| image.masked_count() == 0;
    masks.retain(|mask| {
        let image = &photographs[mask.photograph].image;
        mask.share() > 0.0 && image.as_ref().is_some_and(has_none)
    });
    let largest = |a: &&Mask, b: &&Mask| a.share().total_cmp(&b.share());
    let Some(most) = masks.iter().max_by(largest) else { return Ok(in_front) };
    in_front.found.things = Some(Things {
        share: masks.iter().map(Mask::share).sum::<f64>() / views.buffers.len() as f64,
        most: (photographs[most.photograph].name.clone(), most.share()),
    });
    let capture = in_front.capture.get_or_insert_with(|| views.capture.clone());
    for mask in &masks {
        let Some(image) = &mut capture.photographs[mask.photograph].image else { continue };
        Arc::make_mut(image).mask(|x, y| mask.is_masked(x, y));
    }
    Ok(in_front)
}

/// Pixels along the longest side of so many photographs when they are compared.
fn longest_side(photographs: usize) -> usize {
    LONGEST_SIDE.min((MOST_PIXELS / photographs.max(1)).isqrt())
}

/// Pixels of so many photographs when they are compared, at most.
pub fn compared_pixels(photographs: usize) -> usize {
    photographs * longest_side(photographs).pow(2)
}

impl Found {
    /// A warning for lamps.
    pub fn warning(&self) -> Option<String> {
        let names: Vec<String> = self.lamps.iter().map(|name| format!("\"{name}\"")).collect();
        (!names.is_empty()).then(|| {
            format!(
                "photographs show something far brighter than all surfaces in front of {}: it is \
                 taken for a lamp, and its pixels are left out; if the surface shines there, model \
                 that part and tag it as a visible light",
                names.join(", ")
            )
        })
    }

    /// A note on other things.
    pub fn note(&self) -> Option<String> {
        let Things { share, most: (name, largest) } = self.things.as_ref()?;
        Some(format!(
            "{:.1} % of the photographs, and {:.0} % of {name}, seem to show things that are not \
             modelled, and are left out (samples.omit_unmodelled); Suggest masks shows such things",
            100.0 * share,
            100.0 * largest
        ))
    }
}

#[cfg(test)]
mod tests;
