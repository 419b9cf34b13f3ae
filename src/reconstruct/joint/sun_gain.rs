//! By how much the cost of a fit falls when a sun in a given direction is added.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::OnceLock;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::geometry::spaced::Nearest;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::math::sampling::Frame;
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::problem::{Data, Problem};
use crate::reconstruct::joint::terms::influence;
use crate::scene::views::VisibilityBuffer;
use crate::scene::{SurfacePoint, Views};
use crate::solve::kernels::{ln, vectorised};
use crate::watch::Cancelled;

/// Radians: half of what the first directions are apart, and less than the sun's own size.
const FIRST_STEP: f32 = 0.044;
const LAST_STEP: f32 = 0.0005;

/// A point on the known surfaces with what was measured there.
#[derive(Clone, Copy)]
pub struct Place {
    point: SurfacePoint,
    /// The row of the problem from which the other light at this point is taken.
    row: usize,
    /// The part of the row's weight that it has.
    share: f64,
    /// log π L, per channel.
    log_radiance: Rgb,
}

impl Place {
    pub fn of_row(problem: &Problem, row: usize) -> Self {
        let log_radiance = std::array::from_fn(|c| problem.rows.log_radiance[c][row]);
        Self { point: problem.surface_point(row), row, share: 1.0, log_radiance }
    }
}

/// At most so many pixels of all photographs, evenly chosen, that show a surface with rows. They
/// are much denser than rows, and the other light at a pixel is about that at the nearest row.
pub fn pixels(problem: &Problem, most: usize) -> Vec<Place> {
    let Data { views, equations, .. } = problem.data;
    let mesh = &views.capture.mesh;
    let mut of_surface: BTreeMap<usize, (Vec<usize>, Vec<Vec3>)> = BTreeMap::new();
    for (row, &sample) in problem.rows.sample.iter().enumerate() {
        let sample = &problem.data.cloud.samples[sample];
        let (rows, positions) = of_surface.entry(sample.surface).or_default();
        rows.push(row);
        positions.push(sample.position);
    }
    let trees: BTreeMap<usize, (Vec<usize>, Nearest)> = of_surface
        .into_iter()
        .filter_map(|(surface, (rows, positions))| {
            Some((surface, (rows, Nearest::new(&positions)?)))
        })
        .collect();
    let total: usize = views.buffers.iter().map(|b| b.camera.width * b.camera.height).sum();
    let stride = (total as f64 / most.max(1) as f64).sqrt().ceil() as usize;
    let dark: Rgb = std::array::from_fn(|c| equations.dark(c));
    let pixel = |buffer: &VisibilityBuffer, x: usize, y: usize| -> Option<Place> {
        let (position, triangle) = buffer.hit(x, y).filter(|_| buffer.is_off_edges(x, y))?;
        let radiance = buffer.image.radiance(x, y)?;
        let (rows, tree) = trees.get(&(mesh.surface[triangle as usize] as usize))?;
        let towards = buffer.camera.position.as_vec3() - position;
        let point = views.side(position, triangle, towards);
        let log = |c: usize| (PI * f64::from(radiance[c]).max(dark[c])).ln();
        let log_radiance = std::array::from_fn(log);
        Some(Place { point, row: rows[tree.to(position)], share: 1.0, log_radiance })
    };
    let mut places: Vec<Place> = Vec::new();
    for buffer in views.buffers.iter().filter(|_| most > 0) {
        let lines: Vec<usize> = (stride / 2..buffer.camera.height).step_by(stride).collect();
        let of_lines: Vec<Vec<Place>> = lines
            .into_par_iter()
            .map(|y| {
                let line = (stride / 2..buffer.camera.width).step_by(stride);
                line.filter_map(|x| pixel(buffer, x, y)).collect()
            })
            .collect();
        places.extend(of_lines.into_iter().flatten());
    }
    let mut counts = vec![0usize; problem.rows.sample.len()];
    places.iter().for_each(|place| counts[place.row] += 1);
    places.iter_mut().for_each(|place| place.share = 1.0 / counts[place.row] as f64);
    places
}

/// By how much a sun would lower the loss of a fit at some places, per channel. Without its sun, a
/// model is wrong by several octaves where the sun shines in; the gain is therefore computed from
/// the loss itself and not from its linearisation.
pub struct SunGain {
    /// The places that count.
    counting: Vec<usize>,
    channels: Vec<ChannelGain>,
}

/// One channel at the places that count.
struct ChannelGain {
    /// What a sun of unit irradiance adds to π L̂ at normal incidence, as a part of π L̂.
    slope: Vec<f64>,
    /// The irradiance, at normal incidence, that is missing there.
    missing: Vec<f64>,
    residuals: Residuals,
    /// Sum of the influences.
    influence: f64,
    /// The sum of the losses where all light is dimmed by so many steps of [`DIMMING`].
    dimmed: Vec<OnceLock<f64>>,
}

/// A step of the logarithm of light, and how many of them are tabulated: a sun in the open is ten times
/// as bright as the sky.
const DIMMING: f64 = 0.05;
const DIMMINGS: usize = 60;

/// The residuals of one channel as a structure of arrays, for vector instructions.
#[derive(Default)]
struct Residuals {
    /// log(L̂/L).
    residual: Vec<f64>,
    /// The weight with which it would count in a linear problem.
    influence: Vec<f64>,
    /// Its loss is `of_log` ln(1 + (`inverse` r)²) + `of_square` r², one of the two being 0.
    inverse: Vec<f64>,
    of_log: Vec<f64>,
    of_square: Vec<f64>,
}

/// Number of strengths of a sun that are tried: quantiles of the strengths that fit single places.
const STRENGTHS: usize = 4;
/// Light that is left without a sun is at least this part of the light with it.
const LEAST_LEFT: f64 = 1e-3;
/// Residuals whose losses are summed side by side.
const LANES: usize = 8;

impl SunGain {
    /// Without the light of the part `without`.
    pub fn new(
        problem: &Problem,
        fitted: &Fitted,
        places: &[Place],
        without: Option<usize>,
    ) -> Self {
        let columns = without.map_or(0..0, |slot| fitted.model.columns_of(slot));
        let counts = |&index: &usize| {
            let place = &places[index];
            place.share * problem.weights[place.row] > 0.0
        };
        let counting: Vec<usize> = (0..places.len()).filter(counts).collect();
        let of = |c: usize| -> ChannelGain {
            let fit = &fitted.channels[c];
            let (mut slope, mut missing) = (Vec::new(), Vec::new());
            let mut residuals = Residuals::default();
            for &index in &counting {
                let place = &places[index];
                let row = place.row;
                let material = problem.rows.material[row];
                let reflectance = fit.state.log_diffuse[material].exp();
                let mut computed = (fit.residuals[row] + problem.rows.log_radiance[c][row]).exp();
                let least = LEAST_LEFT * computed;
                for column in columns.clone() {
                    let reach = f64::from(fitted.design.diffuse[(row, column)]);
                    computed -= reflectance * fit.state.emission[column] * reach;
                }
                let computed = computed.max(least);
                let residual = computed.ln() - place.log_radiance[c];
                slope.push(reflectance / computed);
                missing.push(computed * ((-residual).exp() - 1.0) / reflectance);
                let weight = place.share * problem.weights[row];
                residuals.push(residual, weight, problem.priors.robust[material]);
            }
            ChannelGain::new(slope, missing, residuals)
        };
        let channels = (0..CHANNELS).into_par_iter().map(of).collect();
        Self { counting, channels }
    }

    /// By how much the cost falls with a sun of this coupling to the places, if all other light is
    /// dimmed by a common factor.
    pub fn fall(&self, column: &[f32]) -> f64 {
        self.fall_of(self.counting.iter().map(|&place| column[place]))
    }

    /// The same with how it reaches each of the places that count.
    fn fall_of(&self, reach: impl Iterator<Item = f32>) -> f64 {
        let lit: Vec<(usize, f64)> = reach
            .enumerate()
            .filter(|(_, reach)| *reach > 0.0)
            .map(|(index, reach)| (index, f64::from(reach)))
            .collect();
        0.5 * self.channels.iter().map(|channel| channel.fall(&lit)).sum::<f64>()
    }

    /// The best direction near a first.
    pub fn climb(
        &self,
        problem: &Problem,
        places: &[Place],
        start: Vec3,
    ) -> Result<Vec3, Cancelled> {
        let fall = |towards: Vec3| {
            if !is_above(towards) {
                return 0.0;
            }
            let views = problem.data.views;
            self.fall_of(self.counting.iter().map(|&index| reach(views, &places[index], towards)))
        };
        let mut best = (start, fall(start));
        let mut step = FIRST_STEP;
        while step > LAST_STEP {
            problem.watch().check()?;
            let frame = Frame::about(best.0);
            let tries: Vec<Vec3> = (0..9)
                .filter(|&k| k != 4)
                .map(|k| {
                    let offset = Vec2::new((k % 3) as f32 - 1.0, (k / 3) as f32 - 1.0) * step;
                    let moved = best.0 + frame.tangent * offset.x + frame.bitangent * offset.y;
                    moved.normalize_or_zero()
                })
                .collect();
            let falls: Vec<f64> = tries.par_iter().map(|&towards| fall(towards)).collect();
            let mut moved = false;
            for (towards, fall) in tries.into_iter().zip(falls) {
                if fall > best.1 {
                    best = (towards, fall);
                    moved = true;
                }
            }
            if !moved {
                step *= 0.5;
            }
        }
        Ok(best.0)
    }
}

impl ChannelGain {
    fn new(slope: Vec<f64>, missing: Vec<f64>, residuals: Residuals) -> Self {
        let influence = residuals.influence.iter().sum();
        let residuals = residuals.some(0..slope.len());
        let dimmed = vec![OnceLock::new(); DIMMINGS + 1];
        Self { slope, missing, residuals, influence, dimmed }
    }

    /// The sum of the losses with all light dimmed by so many steps; most are never asked for.
    fn dimmed_by(&self, steps: usize) -> f64 {
        *self.dimmed[steps].get_or_init(|| self.residuals.losses(-(steps as f64) * DIMMING))
    }

    /// The sum of the losses with all light dimmed, between tabulated steps.
    fn dimmed(&self, dimming: f64) -> f64 {
        let step = (dimming / DIMMING).clamp(0.0, DIMMINGS as f64 - 1e-9);
        let (whole, part) = (step as usize, step.fract());
        (1.0 - part) * self.dimmed_by(whole) + part * self.dimmed_by(whole + 1)
    }

    /// By how much the sum of the losses falls with a sun that reaches these of the places.
    fn fall(&self, lit: &[(usize, f64)]) -> f64 {
        let mut wanted: Vec<f64> = lit
            .iter()
            .map(|&(index, reach)| self.missing[index] / reach)
            .filter(|strength| *strength > 0.0)
            .collect();
        if wanted.is_empty() {
            return 0.0;
        }
        let residuals = self.residuals.some(lit.iter().map(|&(index, _)| index));
        let mut slope: Vec<f64> =
            lit.iter().map(|&(index, reach)| self.slope[index] * reach).collect();
        slope.resize(residuals.residual.len(), 0.0);
        let mut changes = vec![0.0; slope.len()];
        let mut fall = |strength: f64| {
            let changed = residuals.brighten(&slope, strength, &mut changes);
            let dimming = changed / self.influence.max(f64::MIN_POSITIVE);
            self.dimmed_by(0) - self.dimmed(dimming) + residuals.falls(&changes, dimming)
        };
        let (mut most, mut first) = (0.0, 0);
        for k in 0..STRENGTHS {
            let place = (2 * k + 1) * wanted.len() / (2 * STRENGTHS);
            let rest = &mut wanted[first..];
            let (_, strength, _) = rest.select_nth_unstable_by(place - first, f64::total_cmp);
            most = f64::max(most, fall(*strength));
            first = place;
        }
        most
    }
}

impl Residuals {
    fn push(&mut self, residual: f64, weight: f64, robust: f64) {
        let is_square = robust.is_infinite();
        self.residual.push(residual);
        self.influence.push(weight * influence(residual, robust));
        self.inverse.push(robust.recip());
        self.of_log.push(if is_square { 0.0 } else { weight * robust * robust });
        self.of_square.push(if is_square { weight } else { 0.0 });
    }

    /// Some of them, padded to whole lanes with zeros, whose loss and influence are 0.
    fn some(&self, of: impl Iterator<Item = usize> + Clone) -> Self {
        let pick = |values: &[f64]| {
            let mut some: Vec<f64> = of.clone().map(|index| values[index]).collect();
            some.resize(some.len().next_multiple_of(LANES), 0.0);
            some
        };
        Self {
            residual: pick(&self.residual),
            influence: pick(&self.influence),
            inverse: pick(&self.inverse),
            of_log: pick(&self.of_log),
            of_square: pick(&self.of_square),
        }
    }

    /// `residual`, `inverse`, `of_log` and `of_square`, [`LANES`] of each at a time.
    #[inline(always)]
    fn lanes(&self) -> impl Iterator<Item = [&[f64; LANES]; 4]> {
        let pairs = lanes(&self.residual).zip(lanes(&self.inverse));
        let factors = lanes(&self.of_log).zip(lanes(&self.of_square));
        pairs.zip(factors).map(|((r, inverse), (log, square))| [r, inverse, log, square])
    }

    /// The sum of the losses with `change` added to the logarithm of every computed radiance. The
    /// residuals fill whole lanes.
    fn losses(&self, change: f64) -> f64 {
        vectorised!({
            let mut sums = [0.0; LANES];
            for [residual, inverse, of_log, of_square] in self.lanes() {
                for lane in 0..LANES {
                    let r = residual[lane] + change;
                    let scaled = r * inverse[lane];
                    let log = ln(1.0 + scaled * scaled);
                    sums[lane] += of_log[lane] * log + of_square[lane] * r * r;
                }
            }
            sums.iter().sum()
        })
    }

    /// Writes to `changes` by how much a sun of this strength raises the logarithm of each computed
    /// radiance. `slope` is the radiance that a sun of strength 1 adds, divided by the computed one.
    /// Returns the sum of the changes, weighted by the influences.
    fn brighten(&self, slope: &[f64], strength: f64, changes: &mut [f64]) -> f64 {
        vectorised!({
            let mut sums = [0.0; LANES];
            let changes = changes.as_chunks_mut::<LANES>().0;
            let given = lanes(slope).zip(lanes(&self.influence));
            for ((slope, influence), changes) in given.zip(changes) {
                for lane in 0..LANES {
                    changes[lane] = ln(1.0 + slope[lane] * strength);
                    sums[lane] += influence[lane] * changes[lane];
                }
            }
            sums.iter().sum()
        })
    }

    /// The sum of the losses with all light dimmed, minus the same with `changes` added.
    fn falls(&self, changes: &[f64], dimming: f64) -> f64 {
        vectorised!({
            let mut sums = [0.0; LANES];
            let all = self.lanes().zip(lanes(changes));
            for ([residual, inverse, of_log, of_square], changes) in all {
                for lane in 0..LANES {
                    let before = residual[lane] - dimming;
                    let after = before + changes[lane];
                    let (a, b) = (before * inverse[lane], after * inverse[lane]);
                    let log = ln((1.0 + a * a) / (1.0 + b * b));
                    let square = before * before - after * after;
                    sums[lane] += of_log[lane] * log + of_square[lane] * square;
                }
            }
            sums.iter().sum()
        })
    }
}

#[inline(always)]
fn lanes(values: &[f64]) -> std::slice::Iter<'_, [f64; LANES]> {
    values.as_chunks::<LANES>().0.iter()
}

/// Whether a direction is above the horizon; z is up in every capture.
pub fn is_above(towards: Vec3) -> bool {
    towards.z > 0.0
}

/// V cos θ of a sun at some places.
pub fn column(views: &Views, places: &[Place], towards: Vec3) -> Vec<f32> {
    places.iter().map(|place| reach(views, place, towards)).collect()
}

fn reach(views: &Views, place: &Place, towards: Vec3) -> f32 {
    let cosine = towards.dot(place.point.normal);
    let is_lit = cosine > 0.0 && !views.caster.occluded(&views.ray(place.point, towards));
    if is_lit { cosine } else { 0.0 }
}
