//! Eq. 12 to 14: the reflectances of all materials, for given emissions.

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::options;
use crate::reconstruct::equations::{Equation, Equations};
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::transport::Transport;
use crate::scene::Brdf;
use crate::scene::{Capture, MaterialKind};
use crate::solve::subplex::{SubplexOptions, subplex};
use crate::watch::{Cancelled, Watch};

options! {
    /// How specular reflectances are found.
    GlossOptions in "gloss" {
        /// Photographs used per specular sample; more photographs cover more of the specular lobe.
        views_per_sample: usize = 6, Some((1.0, 1e4)), "";
        /// Exponent n from which the search starts (Eq. 12).
        start_exponent: f64 = 20.0, Some((0.1, 1e4)), "";
        /// Largest exponent n; sharper lobes than the radiance records resolve cannot be told
        /// apart.
        max_exponent: f64 = 1000.0, Some((1.0, 1e5)), "";
        /// Evaluations of the cost per material and iteration at most (Section 5.3).
        max_evaluations: usize = 400, Some((10.0, 1e6)), "";
        /// Equations per material at most: an even selection of them is used beyond.
        max_equations: usize = 4000, Some((10.0, 1e9)), "";
    }
}

/// Irradiance at a sample: I_s, and what each virtual light adds.
struct Incident {
    photographed: Rgb,
    /// Σ_j E_ij k_ij per light.
    lights: Vec<Rgb>,
}

impl Incident {
    fn of(sample: usize, emission: &[Rgb], lobes: &Lobes, transport: &Transport) -> Self {
        let mut lights = vec![[0.0; CHANNELS]; lobes.first.len() - 1];
        for (light, total) in lights.iter_mut().enumerate() {
            for lobe in lobes.of(light) {
                let coupling = transport.coupling[(sample, lobe)];
                for (total, emission) in total.iter_mut().zip(emission[lobe]) {
                    *total += emission * coupling;
                }
            }
        }
        Self { photographed: transport.irradiance[sample].map(f64::from), lights }
    }

    /// G_s of Eq. 14.
    fn total(&self) -> Rgb {
        let mut total = self.photographed;
        for light in &self.lights {
            for (total, value) in total.iter_mut().zip(light) {
                *total += value;
            }
        }
        total
    }
}

/// G_s of every sample (Eq. 14), in the photographs' unit times sr.
pub fn irradiance(emission: &[Rgb], lobes: &Lobes, transport: &Transport) -> Vec<Rgb> {
    (0..transport.irradiance.len())
        .into_par_iter()
        .map(|sample| Incident::of(sample, emission, lobes, transport).total())
        .collect()
}

/// The radiance that every equation's right-hand side gives (Eq. 7); zero where a material has
/// no reflectance.
pub fn computed(
    equations: &Equations,
    reflectances: &[Option<Brdf>],
    emission: &[Rgb],
    lobes: &Lobes,
    transport: &Transport,
) -> Vec<Rgb> {
    equations
        .rows
        .par_iter()
        .map(|row| {
            let Some(reflectance) = &reflectances[row.material] else { return [0.0; CHANNELS] };
            let incident = Incident::of(row.sample, emission, lobes, transport);
            let total = incident.total();
            let specular = match row.glossy {
                Some(glossy) => {
                    equations.glossy[glossy].lobe_light(reflectance.exponent, &incident)
                }
                None => [0.0; CHANNELS],
            };
            std::array::from_fn(|c| {
                reflectance.diffuse[c] / std::f64::consts::PI * total[c]
                    + reflectance.lobe_scale(c) * specular[c]
            })
        })
        .collect()
}

impl crate::reconstruct::equations::Glossy {
    /// ∫ L cosⁿγ cos θ dω over the whole hemisphere, per channel.
    fn lobe_light(&self, exponent: f64, incident: &Incident) -> Rgb {
        let records = self.records(exponent);
        let lights = self.lights(exponent, &incident.lights);
        std::array::from_fn(|c| records[c] + lights[c])
    }
}

#[expect(clippy::too_many_arguments, reason = "every product of the stages before is needed")]
/// Estimates every material's reflectance anew; a known diffuse reflectance stays as it is.
pub fn update(
    capture: &Capture,
    equations: &Equations,
    reflectances: &mut [Option<Brdf>],
    emission: &[Rgb],
    lobes: &Lobes,
    transport: &Transport,
    options: &GlossOptions,
    watch: &Watch,
) -> Result<(), Cancelled> {
    for (material, reflectance) in reflectances.iter_mut().enumerate() {
        let Some(reflectance) = reflectance else { continue };
        watch.check()?;
        let known = capture.materials[material].known_diffuse;
        let rows: Vec<&Equation> =
            equations.of_material[material].iter().map(|&row| &equations.rows[row]).collect();
        let incident = |row: &&Equation| Incident::of(row.sample, emission, lobes, transport);
        match capture.materials[material].kind {
            MaterialKind::Diffuse => {
                if known.is_none() {
                    let total: Vec<Rgb> =
                        rows.par_iter().map(|row| incident(row).total()).collect();
                    reflectance.diffuse = diffuse(&rows, &total, reflectance.diffuse);
                }
            }
            MaterialKind::Specular => {
                let rows = evenly(&rows, options.max_equations);
                let incident: Vec<Incident> = rows.par_iter().map(incident).collect();
                *reflectance =
                    glossy(equations, &rows, &incident, *reflectance, known, options, watch)?;
            }
        }
    }
    Ok(())
}

/// Eq. 13 in the least-squares sense, clamped to [0, 1]; a channel in which nothing arrives
/// keeps its value.
fn diffuse(rows: &[&Equation], irradiance: &[Rgb], previous: Rgb) -> Rgb {
    std::array::from_fn(|c| {
        let (mut product, mut square) = (0.0, 0.0);
        for (row, total) in rows.iter().zip(irradiance) {
            product += row.share * row.radiance[c] * total[c];
            square += row.share * total[c] * total[c];
        }
        if square > 0.0 {
            (std::f64::consts::PI * product / square).clamp(0.0, 1.0)
        } else {
            previous[c]
        }
    })
}

/// Section 5.3 for a specular material: ρ_d and ρ_s of each channel and the exponent they share,
/// by a subspace-searching simplex on the squared differences of Eq. 9.
fn glossy(
    equations: &Equations,
    rows: &[&Equation],
    incident: &[Incident],
    previous: Brdf,
    known: Option<Rgb>,
    options: &GlossOptions,
    watch: &Watch,
) -> Result<Brdf, Cancelled> {
    let totals: Vec<Rgb> = incident.iter().map(Incident::total).collect();
    let scale: f64 = rows
        .iter()
        .map(|row| row.share * row.radiance.iter().map(|l| l * l).sum::<f64>())
        .sum::<f64>()
        .max(f64::MIN_POSITIVE);
    let log_limits = (0.1f64.ln(), options.max_exponent.ln());

    // The lobe integrals depend on the exponent alone, which a simplex step may leave as it is.
    let mut lobe_light: (f64, Vec<Rgb>) = (f64::NAN, Vec::new());
    let cost = |x: &[f64]| {
        // Cancelled: nothing is worth computing any more, and the search runs dry.
        if watch.check().is_err() {
            return f64::INFINITY;
        }
        let candidate = unpack(x, known);
        let mut violation = 0.0;
        let log_exponent = x[x.len() - 1];
        let clamped = log_exponent.clamp(log_limits.0, log_limits.1);
        violation += (log_exponent - clamped).powi(2);
        if clamped != lobe_light.0 {
            let exponent = clamped.exp();
            let fresh = rows
                .par_iter()
                .zip(incident)
                .map(|(row, incident)| {
                    row.glossy.map_or([0.0; CHANNELS], |glossy| {
                        equations.glossy[glossy].lobe_light(exponent, incident)
                    })
                })
                .collect();
            lobe_light = (clamped, fresh);
        }
        let candidate = Brdf { exponent: clamped.exp(), ..candidate };
        let mut sum = 0.0;
        for ((row, total), lobe) in rows.iter().zip(&totals).zip(&lobe_light.1) {
            for c in 0..CHANNELS {
                let computed = candidate.diffuse[c] / std::f64::consts::PI * total[c]
                    + candidate.lobe_scale(c) * lobe[c];
                sum += row.share * (row.radiance[c] - computed).powi(2);
            }
        }
        // Penalties keep ρ_d, ρ_s ≥ 0 and ρ_d + ρ_s ≤ 1 (Section 5.3).
        for c in 0..CHANNELS {
            let (d, s) = (candidate.diffuse[c], candidate.specular[c]);
            violation += d.min(0.0).powi(2) + s.min(0.0).powi(2) + (d + s - 1.0).max(0.0).powi(2);
        }
        sum / scale + 1e3 * violation
    };
    let start = pack(&previous, known, options.start_exponent);
    let free = start.len() - 1;
    let mut steps = vec![0.05; free];
    steps.push(0.5);
    let report = subplex(
        cost,
        &start,
        &steps,
        &SubplexOptions {
            tolerance: 1e-5,
            max_evaluations: options.max_evaluations,
            ..SubplexOptions::default()
        },
    );
    watch.check()?;
    let mut found = unpack(&report.x, known);
    found.exponent = report.x[free].clamp(log_limits.0, log_limits.1).exp();
    // A penalty bends the optimum to its bound only nearly.
    for c in 0..CHANNELS {
        found.diffuse[c] = found.diffuse[c].clamp(0.0, 1.0);
        found.specular[c] = found.specular[c].clamp(0.0, 1.0 - found.diffuse[c]);
    }
    Ok(found)
}

/// The simplex's variables: ρ_d unless known, ρ_s, ln n.
fn pack(reflectance: &Brdf, known: Option<Rgb>, start_exponent: f64) -> Vec<f64> {
    let mut x = Vec::new();
    if known.is_none() {
        x.extend(reflectance.diffuse);
    }
    x.extend(reflectance.specular);
    // Without a lobe yet, the exponent is only a place to start from.
    let fresh = reflectance.specular == [0.0; CHANNELS];
    x.push(if fresh { start_exponent } else { reflectance.exponent }.ln());
    x
}

fn unpack(x: &[f64], known: Option<Rgb>) -> Brdf {
    let (diffuse, rest) = match known {
        Some(known) => (known, x),
        None => ([x[0], x[1], x[2]], &x[CHANNELS..]),
    };
    Brdf::phong(diffuse, [rest[0], rest[1], rest[2]], rest[3].exp())
}

/// At most about `count` of the rows, evenly spread.
fn evenly<'a>(rows: &[&'a Equation], count: usize) -> Vec<&'a Equation> {
    let step = rows.len().div_ceil(count.max(1)).max(1);
    rows.iter().step_by(step).copied().collect()
}
