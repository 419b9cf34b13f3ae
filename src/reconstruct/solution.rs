//! The result of a reconstruction, and the report of its solve.

use crate::math::rgb::{CHANNELS, Rgb};
use crate::scene::{Brdf, Optics};

/// Root mean square differences between computed and measured radiance, per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rms {
    /// In the photographs' unit of radiance.
    pub absolute: Rgb,
    /// Of the differences divided by the measured radiance.
    pub relative: Rgb,
}

impl Rms {
    /// One number for all channels: the root mean square of the absolute errors, each relative
    /// to its channel's mean radiance.
    pub fn total(&self, mean_radiance: &Rgb) -> f64 {
        let square = |c: usize| {
            if mean_radiance[c] > 0.0 { (self.absolute[c] / mean_radiance[c]).powi(2) } else { 0.0 }
        };
        ((0..CHANNELS).map(square).sum::<f64>() / CHANNELS as f64).sqrt()
    }

    /// The root mean square of the relative errors of all channels.
    pub fn total_relative(&self) -> f64 {
        (self.relative.iter().map(|value| value * value).sum::<f64>() / CHANNELS as f64).sqrt()
    }
}

/// One iteration of the refinement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Counted from 1.
    pub index: usize,
    /// Root mean squares over all equations.
    pub rms: Rms,
    /// The objective, per channel; `None` for the paper's alternation, whose half steps minimise
    /// different things.
    pub objective: Option<Rgb>,
    /// Largest change of any diffuse or specular reflectance since the iteration before.
    pub change: f64,
    /// Since the refinement began.
    pub elapsed_secs: f64,
}

/// Why the refinement stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// RMS errors changed by less than the tolerance.
    RmsConverged,
    /// The RMS error rose, absolute or relative, and neither fell; the iteration before is the
    /// result.
    RmsRose,
    /// As many iterations were done as the options allow.
    IterationLimit,
    /// The objective's gradient vanishes within the bounds.
    GradientConverged,
    /// There is no sample, or none with a reflectance to estimate.
    NothingToSolve,
}

impl Stopped {
    /// In words, for people.
    pub fn describe(self) -> &'static str {
        match self {
            Self::RmsConverged => "rms change below threshold",
            Self::RmsRose => "rms rose, so the iteration before is kept",
            Self::GradientConverged => "the objective's gradient vanishes",
            Self::IterationLimit => "iteration limit reached",
            Self::NothingToSolve => "nothing to solve",
        }
    }
}

/// Reflectances and emissions, with the report of how they were found.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Per material; `None` where it has no sample.
    pub reflectances: Vec<Option<Brdf>>,
    /// Per material which are mirrors or glass and have no BRDF; those beyond its end are opaque.
    pub optics: Vec<Optics>,
    /// E_ij per lobe and channel, in the photographs' unit of radiance.
    pub emission: Vec<Rgb>,
    /// In order, the state before the first included where the method reports it.
    pub iterations: Vec<Iteration>,
    /// Why no further iteration was done.
    pub stopped: Stopped,
    /// Computed radiance of each equation.
    pub computed: Vec<Rgb>,
    /// The certainty of the result; `None` for the paper's method, and as far as the fields say.
    pub certainty: Option<Certainty>,
    /// The decisions of the run, one sentence each: which light model, how many lamps, which gloss.
    pub notes: Vec<String>,
    /// Warnings, one sentence each.
    pub warnings: Vec<String>,
}

/// How far a joint solution can be trusted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Certainty {
    /// Per material; `None` where it has no sample.
    pub materials: Vec<Option<MaterialCertainty>>,
    /// How well the common scale of the reflectances is determined.
    pub scale: ScaleCertainty,
    /// Root mean square of log(computed/measured) of the delivered model in blocks of samples that
    /// neither chose nor fitted it; `None` where there are too few blocks.
    pub held_out: Option<Rgb>,
    /// Sets of lights over which the result was averaged; with 1 there are no intervals.
    pub light_sets: usize,
    /// Which parts of a light model were tried, and which were kept.
    pub selection: Option<Selection>,
}

/// How the light model was chosen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Lobes that were tried: of backgrounds, of fine light, of lamps and suns.
    pub candidates: usize,
    /// Lobes with an emission above 0 in the result.
    pub kept: usize,
    /// In the order in which they were made.
    pub trials: Vec<Trial>,
}

/// Something that could be added to a model, and what it does to the error of blocks of samples
/// that were held out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// The part that was tried.
    pub part: TrialPart,
    /// Root of the mean loss in held-out blocks, without the part and with it.
    pub before: f64,
    /// The same with the part.
    pub after: f64,
    /// after/before − 1, and its standard error over the blocks; `None` where there are fewer
    /// than two.
    pub change: f64,
    /// Of `change`, over the blocks.
    pub standard_error: Option<f64>,
    /// Whether the part is used: as a rule, if the error fell by more than that.
    pub supported: bool,
}

impl Trial {
    /// Whether the error fell by more than its standard error.
    pub fn is_significant(&self) -> bool {
        self.standard_error.is_some_and(|error| -self.change > error)
    }
}

/// A part of a light model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrialPart {
    /// A sun.
    Sun,
    /// The photographed sky, in so many cells.
    SeenSky(usize),
    /// The lights of a room in place of those of an open sky.
    Room,
    /// The lamp of this number, from 1, with any before it that are not supported alone.
    Lamp(usize),
    /// Gloss of the material of this index.
    Gloss(usize),
    /// A specular lobe whose strength is unknown (Eq. 12) on the material of this index, in place of
    /// a coat.
    Lobe(usize),
    /// Twice the background's lights, to so many lobes or sky cells.
    Background(usize),
    /// Fine lobes in place of lamps and a coarse background.
    FineLobes,
    /// So many fine lobes beside the other lights, for reflectances that are known.
    Beside(usize),
}

/// 95 % intervals of one material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaterialCertainty {
    /// Of ρ_d per channel; `None` where there is only one light set.
    pub diffuse: [Option<[f64; 2]>; CHANNELS],
    /// Of ρ_s; `None` also for diffuse materials.
    pub specular: [Option<[f64; 2]>; CHANNELS],
    /// Range of exponents that fit the photographs about as well.
    pub exponent: Option<[f64; 2]>,
    /// The same of the roughness of a coat.
    pub roughness: Option<[f64; 2]>,
    /// Whether the photographs determine the channel's reflectance better than the weak prior
    /// does.
    pub identified: [bool; CHANNELS],
}

/// The common scale of all reflectances of a channel: brighter surfaces under dimmer light look
/// nearly alike.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScaleCertainty {
    /// Smallest singular value of the reflectances' logarithms, the light projected out and
    /// bounds ignored.
    pub singular_value: Rgb,
    /// Root mean square of log(computed/measured).
    pub log_rms: Rgb,
    /// Standard deviation of the logarithm of the scale; 0 where a reflectance is known.
    pub log_sd: Rgb,
}

impl Solution {
    /// Whether every number of the result is finite and there is something in it.
    pub fn is_usable(&self) -> bool {
        let mut reflectances = self.reflectances.iter().flatten().peekable();
        reflectances.peek().is_some()
            && reflectances.all(|r| {
                let numbers = r.diffuse.iter().chain(&r.specular).chain(&r.coat);
                numbers.chain([&r.exponent]).all(|value| value.is_finite())
            })
            && self.emission.iter().flatten().all(|v| v.is_finite())
    }

    /// Lobes with any light in them.
    pub fn active_lobes(&self) -> usize {
        self.emission.iter().filter(|emission| emission.iter().any(|&e| e > 0.0)).count()
    }

    /// One line on how it went.
    pub fn brief(&self) -> String {
        let Some((first, last)) = self.iterations.first().zip(self.iterations.last()) else {
            return self.stopped.describe().to_owned();
        };
        let triple = |rgb: Rgb| rgb.map(|value| format!("{:.1}", 100.0 * value)).join(" / ");
        format!(
            "{} iterations ({}): relative RMS from {} % to {} % (R / G / B)",
            self.iterations.len(),
            self.stopped.describe(),
            triple(first.rms.relative),
            triple(last.rms.relative),
        )
    }
}
