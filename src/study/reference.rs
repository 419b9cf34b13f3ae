//! The reference of a study of stability: the truth, or without one the result of the same variant
//! on the unchanged capture.

use crate::io;
use crate::io::export::summary;
use crate::io::solution::Solution;
use crate::io::truth::Truth;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::options::OptionValue;
use crate::reconstruct::{self, Options, Quality};
use crate::scene::Capture;
use crate::study::stability::{Design, Variant};
use crate::study::{guarded, score};
use crate::watch::Watch;

/// A reference for each variant, or why there is none.
pub(super) struct References(Vec<(Variant, Result<Reference, String>)>);

pub(super) struct Reference {
    /// Name of the true material, and its reflectance, of each surface that is known.
    surfaces: Vec<(String, String, Rgb)>,
    /// Error that the reference itself is expected to have.
    own_error: f64,
}

impl References {
    pub(super) fn new(
        capture: &Capture,
        truth: Option<&Truth>,
        design: &Design,
        watch: &Watch,
    ) -> Result<Self, io::Error> {
        let base = &design.base;
        let careful = match truth {
            Some(_) => Err(String::new()),
            None => guarded(|| careful(capture, base, watch))?,
        };
        let one = |variant: &Variant| -> Result<_, io::Error> {
            let reference = match (truth, &careful) {
                (Some(truth), _) => Ok(true_reference(capture, truth)),
                (None, Ok(careful)) => {
                    guarded(|| own_reference(capture, careful, *variant, base, watch))?
                }
                (None, Err(failure)) => Err(failure.clone()),
            };
            Ok((*variant, reference))
        };
        design.variants.iter().map(one).collect::<Result<_, _>>().map(Self)
    }

    pub(super) fn of(&self, variant: Variant) -> Result<&Reference, &str> {
        let own = self.0.iter().find(|(own, _)| *own == variant).map(|(_, reference)| reference);
        own.map_or(Err("this variant was not asked for"), |own| {
            own.as_ref().map_err(String::as_str)
        })
    }
}

fn true_reference(capture: &Capture, truth: &Truth) -> Reference {
    let surfaces = capture.surfaces.iter().filter_map(|surface| {
        let (name, material) = truth.of_surface(&surface.name)?;
        Some((surface.name.clone(), name.to_owned(), material.rho_d))
    });
    Reference { surfaces: surfaces.collect(), own_error: 0.0 }
}

/// Mean absolute over half the width of a 95 % interval of the normal distribution.
const ERROR_PER_HALF_WIDTH: f64 = 0.798 / 1.96;

fn solve(
    capture: &Capture,
    options: &Options,
    watch: &Watch,
) -> Result<Solution, reconstruct::Error> {
    let whole = reconstruct::run(capture, options, watch, &|_| ())?;
    Ok(summary(capture, options, &whole, 0.0))
}

/// The best that can be said of the capture as it is, without a truth.
fn careful(
    capture: &Capture,
    base: &Options,
    watch: &Watch,
) -> Result<Solution, reconstruct::Error> {
    let mut options = Variant::Joint.options(base, 1);
    options.set("general", "quality", &Quality::Standard.text())?;
    solve(capture, &options, watch)
}

/// Without a truth: the variant's own result on the capture as it is. Its error is taken to be what
/// the intervals of the joint method promise, and what it differs from that method's result.
fn own_reference(
    capture: &Capture,
    careful: &Solution,
    variant: Variant,
    base: &Options,
    watch: &Watch,
) -> Result<Reference, reconstruct::Error> {
    let own = solve(capture, &variant.options(base, 1), watch)?;
    let mean = score::mean_half_width(careful).unwrap_or(0.0);
    let differs = Reference::of(careful).errors(&own, &[]).map_or(0.0, |[raw, _]| raw);
    Ok(Reference { own_error: ERROR_PER_HALF_WIDTH * mean + differs, ..Reference::of(&own) })
}

impl Reference {
    fn of(solution: &Solution) -> Self {
        let surfaces = solution.materials.iter().flat_map(|material| {
            let diffuse = material.diffuse.filter(|_| material.samples > 0);
            material
                .surfaces
                .iter()
                .filter_map(move |surface| Some((surface.clone(), material.name.clone(), diffuse?)))
        });
        Self { surfaces: surfaces.collect(), own_error: 0.0 }
    }

    /// Mean absolute error over pairs of an estimated and a true material that share a surface,
    /// raw and after one scale. `cut` names new surfaces with the ones they were part of.
    pub(super) fn errors(&self, solution: &Solution, cut: &[(String, String)]) -> Option<[f64; 2]> {
        let mut pairs: Vec<(usize, &str, Rgb, Rgb)> = Vec::new();
        for (index, material) in solution.materials.iter().enumerate() {
            let Some(diffuse) = material.diffuse.filter(|_| material.samples > 0) else {
                continue;
            };
            for surface in &material.surfaces {
                let old = cut.iter().find(|(new, _)| new == surface).map_or(surface, |(_, o)| o);
                let Some((_, name, truth)) = self.surfaces.iter().find(|(s, ..)| s == old) else {
                    continue;
                };
                if !pairs.iter().any(|(i, n, ..)| (*i, *n) == (index, name.as_str())) {
                    pairs.push((index, name, diffuse, *truth));
                }
            }
        }
        let values =
            || pairs.iter().flat_map(|(_, _, e, t)| (0..CHANNELS).map(move |c| (e[c], t[c])));
        let count = values().count();
        let scale = score::best_scale(values()).unwrap_or(1.0);
        let mean = |scale: f64| {
            let sum: f64 = values().map(|(e, t)| (scale * e - t).abs()).sum();
            self.own_error + sum / count as f64
        };
        (count > 0).then(|| [mean(1.0), mean(scale)])
    }
}
