//! Eq. 9: the emissions of all lobes, for given reflectances.

use std::f64::consts::PI;

use faer::MatRef;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::equations::{Equation, Equations};
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::transport::Transport;
use crate::scene::Brdf;
use crate::solve::bounded::{
    BoundedError, BoundedOptions, BoundedProblem, Bounds, bounded_least_squares,
};
use crate::watch::Watch;

/// How Eq. 9 is weighted and bounded.
#[derive(Clone, Copy, Debug)]
pub struct EmissionOptions {
    /// Eq. 9 is divided by L − L⁺, or by this part of L where that is more.
    pub weight_floor: f64,
    /// Ridge on the lobes, relative to their column norms.
    pub ridge: f64,
}

/// Emissions and how well the bounded least squares were solved.
#[derive(Clone, Debug)]
pub struct Emissions {
    /// E_ij per lobe and channel, at least 0, in the photographs' unit of radiance.
    pub emission: Vec<Rgb>,
    /// The channels in which the solver's optimality conditions are not met.
    pub unconverged: [bool; CHANNELS],
}

/// Solves Eq. 9 for every channel. `reflectances` has an entry for every material with samples.
pub fn solve(
    equations: &Equations,
    reflectances: &[Option<Brdf>],
    lobes: &Lobes,
    transport: &Transport,
    options: &EmissionOptions,
    start: Option<&[Rgb]>,
    watch: &Watch,
) -> Result<Emissions, BoundedError> {
    let count = lobes.lobes.len();
    let mut emission = vec![[0.0; CHANNELS]; count];
    let mut unconverged = [false; CHANNELS];
    let rows = equations.rows.len();
    let photographed: Vec<Rgb> = equations
        .rows
        .par_iter()
        .map(|row| {
            let reflectance = reflectances[row.material].as_ref();
            reflectance.map_or([0.0; CHANNELS], |r| equations.photographed(row, r, transport))
        })
        .collect();
    for channel in 0..CHANNELS {
        let mut target = vec![0.0; rows];
        let mut weights = vec![0.0; rows];
        for (index, row) in equations.rows.iter().enumerate() {
            let Some(reflectance) = &reflectances[row.material] else { continue };
            let radiance = row.radiance[channel];
            let photographed = photographed[index][channel];
            let weight =
                weight(radiance, photographed, equations.dark(channel), options.weight_floor);
            // A diffuse row of the system is k_ij itself, shared by the channels: its
            // reflectance goes into the weight and the target.
            let scale = row_scale(row, reflectance, channel);
            if scale > 0.0 {
                weights[index] = row.share.sqrt() * scale * weight;
                target[index] = (radiance - photographed) / scale;
            }
        }
        let built;
        let matrix = if equations.glossy.is_empty() {
            transport.coupling.as_ref()
        } else {
            built = build(equations, reflectances, lobes, transport, channel);
            MatRef::from_column_major_slice(&built, rows, count)
        };
        let warm: Option<Vec<f64>> =
            start.map(|start| start.iter().map(|emission| emission[channel]).collect());
        let problem = BoundedProblem {
            matrix,
            target: &target,
            weights: Some(&weights),
            bounds: Bounds::NonNegative,
            ridge: options.ridge,
        };
        let solution =
            bounded_least_squares(&problem, warm.as_deref(), &BoundedOptions::default(), watch)?;
        unconverged[channel] = !solution.converged;
        for (emission, value) in emission.iter_mut().zip(solution.x) {
            emission[channel] = value;
        }
    }
    Ok(Emissions { emission, unconverged })
}

/// 1/(L − L⁺), the weight of Eq. 9, kept finite where the photographed surfaces account for all of
/// L or more.
pub fn weight(radiance: f64, photographed: f64, dark: f64, floor: f64) -> f64 {
    1.0 / (radiance - photographed).abs().max(floor * radiance.max(dark))
}

/// What a row of the system is multiplied by to become Eq. 9.
fn row_scale(row: &Equation, reflectance: &Brdf, channel: usize) -> f64 {
    match row.glossy {
        None => reflectance.diffuse[channel] / PI,
        Some(_) => 1.0,
    }
}

/// The system with specular rows, column by column: k_ij for diffuse rows, f k_ij for specular.
fn build(
    equations: &Equations,
    reflectances: &[Option<Brdf>],
    lobes: &Lobes,
    transport: &Transport,
    channel: usize,
) -> Vec<f64> {
    let rows = equations.rows.len();
    let factors: Vec<Vec<f64>> = equations
        .rows
        .par_iter()
        .map(|row| match (&reflectances[row.material], row.glossy) {
            (Some(reflectance), Some(glossy)) => {
                equations.glossy[glossy].light_factors(reflectance, channel)
            }
            _ => Vec::new(),
        })
        .collect();
    let mut system = vec![0.0; rows * lobes.lobes.len()];
    system.par_chunks_mut(rows.max(1)).zip(&lobes.lobes).enumerate().for_each(
        |(column, (values, lobe))| {
            for ((value, row), factor) in values.iter_mut().zip(&equations.rows).zip(&factors) {
                let factor = factor.get(lobe.light).copied().unwrap_or(1.0);
                *value = factor * transport.coupling[(row.sample, column)];
            }
        },
    );
    system
}
