//! By how much the cost of a fit falls when a sun in a given direction is added.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::geometry::spaced::Nearest;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::math::sampling::Frame;
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::problem::{Data, Problem};
use crate::reconstruct::joint::terms::{influence, loss};
use crate::scene::views::VisibilityBuffer;
use crate::scene::{SurfacePoint, Views};
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
        let normal = views.normals[triangle as usize];
        let is_facing = normal.dot(buffer.camera.position.as_vec3() - position) > 0.0;
        let point = SurfacePoint { position, normal: if is_facing { normal } else { -normal } };
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
    channels: Vec<ChannelGain>,
}

struct ChannelGain {
    places: Vec<Residual>,
    /// Sum of `influence`.
    influence: f64,
    /// The sum of the losses where all light is dimmed by so many steps of [`DIMMING`].
    dimmed: Vec<f64>,
}

/// A step of the logarithm of light, and how many of them are tabulated: a sun in the open is ten times
/// as bright as the sky.
const DIMMING: f64 = 0.05;
const DIMMINGS: usize = 60;

/// One channel at a place.
struct Residual {
    weight: f64,
    /// The weight with which it would count in a linear problem.
    influence: f64,
    robust: f64,
    /// log(L̂/L).
    residual: f64,
    /// π L̂, and what a sun of unit irradiance adds to it at normal incidence.
    computed: f64,
    reflectance: f64,
}

/// Number of strengths of a sun that are tried: quantiles of the strengths that fit single places.
const STRENGTHS: usize = 4;
/// Light that is left without a sun is at least this part of the light with it.
const LEAST_LEFT: f64 = 1e-3;

impl SunGain {
    /// Without the light of the part `without`.
    pub fn new(
        problem: &Problem,
        fitted: &Fitted,
        places: &[Place],
        without: Option<usize>,
    ) -> Self {
        let columns = without.map_or(0..0, |slot| fitted.model.columns_of(slot));
        let of = |c: usize| -> ChannelGain {
            let fit = &fitted.channels[c];
            let of_place = |place: &Place| {
                let row = place.row;
                let material = problem.rows.material[row];
                let reflectance = fit.state.log_diffuse[material].exp();
                let mut computed = (fit.residuals[row] + problem.rows.log_radiance[c][row]).exp();
                let least = LEAST_LEFT * computed;
                for column in columns.clone() {
                    let reach = fitted.design.diffuse[(row, column)];
                    computed -= reflectance * fit.state.emission[column] * reach;
                }
                let computed = computed.max(least);
                let residual = computed.ln() - place.log_radiance[c];
                let robust = problem.priors.robust[material];
                let weight = place.share * problem.weights[row];
                let influence = weight * influence(residual, robust);
                Residual { weight, influence, robust, residual, computed, reflectance }
            };
            ChannelGain::new(places.iter().map(of_place).collect())
        };
        Self { channels: (0..CHANNELS).map(of).collect() }
    }

    /// By how much the cost falls with a sun of this coupling to the places, if all other light is
    /// dimmed by a common factor.
    pub fn fall(&self, column: &[f32]) -> f64 {
        0.5 * self.channels.iter().map(|channel| channel.fall(column)).sum::<f64>()
    }

    /// The best direction near a first.
    pub fn climb(
        &self,
        problem: &Problem,
        places: &[Place],
        start: Vec3,
    ) -> Result<Vec3, Cancelled> {
        let fall = |towards: Vec3| {
            if is_above(towards) {
                self.fall(&column(problem.data.views, places, towards))
            } else {
                0.0
            }
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
    fn new(places: Vec<Residual>) -> Self {
        let dimmed = |step: usize| {
            places.iter().map(|place| place.loss(-(step as f64) * DIMMING)).sum::<f64>()
        };
        let dimmed = (0..=DIMMINGS).map(dimmed).collect();
        Self { influence: places.iter().map(|place| place.influence).sum(), dimmed, places }
    }

    /// The sum of the losses with all light dimmed, between tabulated steps.
    fn dimmed(&self, dimming: f64) -> f64 {
        let step = (dimming / DIMMING).clamp(0.0, DIMMINGS as f64 - 1e-9);
        let (whole, part) = (step as usize, step.fract());
        (1.0 - part) * self.dimmed[whole] + part * self.dimmed[whole + 1]
    }

    /// By how much the sum of the losses falls.
    fn fall(&self, column: &[f32]) -> f64 {
        let lit: Vec<(&Residual, f64)> = self
            .places
            .iter()
            .zip(column)
            .filter(|(place, reach)| **reach > 0.0 && place.weight > 0.0)
            .map(|(place, reach)| (place, place.reflectance * f64::from(*reach)))
            .collect();
        let mut wanted: Vec<f64> = lit
            .iter()
            .map(|(place, reach)| place.computed * ((-place.residual).exp() - 1.0) / reach)
            .filter(|strength| *strength > 0.0)
            .collect();
        if wanted.is_empty() {
            return 0.0;
        }
        wanted.sort_by(f64::total_cmp);
        let mut changes = vec![0.0; lit.len()];
        let mut fall = |strength: f64| {
            let mut changed = 0.0;
            for (change, (place, reach)) in changes.iter_mut().zip(&lit) {
                *change = (reach * strength / place.computed).ln_1p();
                changed += place.influence * *change;
            }
            let dimming = changed / self.influence.max(f64::MIN_POSITIVE);
            let of_lit: f64 = changes
                .iter()
                .zip(&lit)
                .map(|(change, (place, _))| place.loss(-dimming) - place.loss(change - dimming))
                .sum();
            self.dimmed[0] - self.dimmed(dimming) + of_lit
        };
        let strength = |k: usize| wanted[(2 * k + 1) * wanted.len() / (2 * STRENGTHS)];
        (0..STRENGTHS).map(|k| fall(strength(k))).fold(0.0, f64::max)
    }
}

impl Residual {
    /// The loss with so much added to the logarithm of what is computed.
    fn loss(&self, change: f64) -> f64 {
        if self.weight > 0.0 {
            self.weight * loss(self.residual + change, self.robust)
        } else {
            0.0
        }
    }
}

/// Whether a direction is above the horizon; z is up in every capture.
pub fn is_above(towards: Vec3) -> bool {
    towards.z > 0.0
}

/// V cos θ of a sun at some places.
pub fn column(views: &Views, places: &[Place], towards: Vec3) -> Vec<f32> {
    let reach = |place: &Place| {
        let cosine = towards.dot(place.point.normal);
        let is_lit = cosine > 0.0 && !views.caster.occluded(&views.ray(place.point, towards));
        if is_lit { cosine } else { 0.0 }
    };
    places.iter().map(reach).collect()
}
