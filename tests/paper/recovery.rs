//! Radiances made with the model must give back the emissions and reflectances they were made
//! with.

use std::f64::consts::PI;

use faer::Mat;
use glam::{DVec3, Vec3};
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::emission::{self, EmissionOptions};
use lobelia::reconstruct::equations::Equations;
use lobelia::reconstruct::lights::{LightKind, VirtualLight, VirtualLights};
use lobelia::reconstruct::lobes::{Lobe, Lobes};
use lobelia::reconstruct::refine::refine;
use lobelia::reconstruct::samples::{Sample, SampleCloud};
use lobelia::reconstruct::solution::Stopped;
use lobelia::reconstruct::transport::{Transport, TransportOptions, gather};
use lobelia::scene::Brdf;
use lobelia::scene::Views;
use lobelia::watch::Watch;

use crate::rooms::{Dice, Room, bare_sample, cloud, quick};

const OPTIONS: EmissionOptions = EmissionOptions { weight_floor: 0.1, ridge: 0.0 };

/// A floor, and where `with_box` a box on it.
fn scene(with_box: bool) -> (Room, SampleCloud) {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.square(floor, 2.0, 0.0);
    let mut samples = Vec::new();
    let (low, high) = (DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, 0.8));
    for i in 0..18 {
        for j in 0..18 {
            let place = |k: i32| -1.9 + 3.8 * (f64::from(k) + 0.3) / 18.0;
            let p = DVec3::new(place(i), place(j), 0.0);
            if !with_box || p.x.abs().max(p.y.abs()) > 0.55 {
                samples.push(bare_sample(p.as_vec3(), Vec3::Z, floor, [0.0; 3]));
            }
        }
    }
    if with_box {
        let sides = room.diffuse("box");
        room.open_box(sides, low, high);
        for i in 0..6 {
            for j in 0..6 {
                let (s, t) = ((f64::from(i) + 0.4) / 6.0 - 0.5, (f64::from(j) + 0.6) / 6.0);
                let mut push = |p: DVec3, normal| {
                    samples.push(bare_sample(p.as_vec3(), normal, sides, [0.0; 3]));
                };
                push(DVec3::new(s, t - 0.5, 0.8), Vec3::Z);
                push(DVec3::new(0.5, s, 0.8 * t), Vec3::X);
                push(DVec3::new(-0.5, s, 0.8 * t), -Vec3::X);
                push(DVec3::new(s, 0.5, 0.8 * t), Vec3::Y);
                push(DVec3::new(s, -0.5, 0.8 * t), -Vec3::Y);
            }
        }
    }
    (room, cloud(samples))
}

/// Six lights over the scene with five lobes each, aimed at the middle and towards the corners.
fn lights() -> (VirtualLights, Lobes) {
    let (mut lights, mut lobes) = (VirtualLights::default(), Lobes::default());
    lobes.first.push(0);
    for index in 0..6 {
        let turn = 2.0 * std::f32::consts::PI * index as f32 / 6.0;
        let (height, reach) = if index % 2 == 0 { (2.8, 1.2) } else { (1.6, 2.6) };
        let position = Vec3::new(reach * turn.cos(), reach * turn.sin(), height);
        let normal = -position.normalize_or_zero();
        lights.lights.push(VirtualLight::disc(LightKind::Sphere, position, normal, 0.25));
        for (x, y) in [(0.0, 0.0), (1.5, 1.5), (1.5, -1.5), (-1.5, 1.5), (-1.5, -1.5)] {
            let direction = (Vec3::new(x, y, 0.0) - position).normalize_or_zero();
            lobes.lobes.push(Lobe { light: index, direction, exponent: 20.0 });
        }
        lobes.first.push(lobes.lobes.len());
    }
    (lights, lobes)
}

/// Emissions of which two in five are nothing.
fn emissions(count: usize, seed: u64) -> Vec<Rgb> {
    let mut dice = Dice::new(seed);
    let mut value = || if dice.uniform() < 0.4 { 0.0 } else { 0.1 + 3.0 * dice.uniform() };
    (0..count).map(|_| [value(), value(), value()]).collect()
}

/// L = ρ/π (I + Σ k E) in double precision.
fn radiance(
    sample: usize,
    rho: Rgb,
    irradiance: [f32; 3],
    coupling: &Mat<f64>,
    emission: &[Rgb],
) -> Rgb {
    std::array::from_fn(|c| {
        let light: f64 = (0..emission.len()).map(|j| coupling[(sample, j)] * emission[j][c]).sum();
        rho[c] / PI * (f64::from(irradiance[c]) + light)
    })
}

struct Case {
    room: Room,
    lobes: Lobes,
    transport: Transport,
    equations: Equations,
    truth: Vec<Option<Brdf>>,
    emission: Vec<Rgb>,
}

/// The box scene with its own coupling; the photographed irradiance is made up.
fn exact_case() -> Case {
    let (room, mut samples) = scene(true);
    let (lights, lobes) = lights();
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let options = TransportOptions::default();
    let mut transport =
        gather(&views, &samples, &lights, &lobes, &options, 5, &Watch::new()).unwrap();
    let mut dice = Dice::new(11);
    for irradiance in &mut transport.irradiance {
        *irradiance = std::array::from_fn(|_| (0.05 + 0.3 * dice.uniform()) as f32);
    }
    let colours = [[0.6, 0.35, 0.2], [0.15, 0.5, 0.8]];
    let emission = emissions(lobes.lobes.len(), 3);
    let all: Vec<Rgb> = (0..samples.samples.len())
        .map(|index| {
            let rho = colours[samples.samples[index].material];
            radiance(index, rho, transport.irradiance[index], &transport.coupling, &emission)
        })
        .collect();
    for (sample, radiance) in samples.samples.iter_mut().zip(&all) {
        sample.radiance = radiance.map(|value| value as f32);
    }
    let mut equations = Equations::new(&room.capture, &samples, &lights, &transport, 6);
    // Samples are kept in single precision; the exact model wants double.
    for row in &mut equations.rows {
        row.radiance = all[row.sample];
    }
    let truth = colours.map(|rho| Some(Brdf::diffuse(rho))).to_vec();
    Case { room, lobes, transport, equations, truth, emission }
}

fn largest(emission: &[Rgb]) -> f64 {
    emission.iter().flatten().copied().fold(0.0, f64::max)
}

fn distance(a: &[Rgb], b: &[Rgb]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The solver's optimality tolerance is 1e-12, and in this well-spread set of lobes its error
/// grows by the square of a condition number below 1000, so 1e-6 of the largest emission.
const EXACT: f64 = 1e-6;

#[test]
fn exact_radiances_give_back_the_emissions() {
    let case = exact_case();
    let solve = |equations: &Equations, start: Option<&[Rgb]>| {
        let watch = Watch::new();
        let Case { truth, lobes, transport, .. } = &case;
        emission::solve(equations, truth, lobes, transport, &OPTIONS, start, &watch).unwrap()
    };
    let tolerance = EXACT * largest(&case.emission);
    let found = solve(&case.equations, None);
    assert_eq!(found.unconverged, [false; 3]);
    assert!(found.emission.iter().flatten().all(|&value| value >= 0.0));
    let error = distance(&found.emission, &case.emission);
    assert!(error < tolerance, "cold start: {error}");

    // From a start that is wrong everywhere, zeros and non-zeros exchanged among them.
    let elsewhere = emissions(case.emission.len(), 99);
    let warm = solve(&case.equations, Some(&elsewhere));
    let error = distance(&warm.emission, &case.emission);
    assert!(error < tolerance, "warm start: {error}");

    // Twice the same equations say the same.
    let mut doubled = case.equations.clone();
    doubled.rows.extend(case.equations.rows.iter().copied());
    let mut wide = case.transport.clone();
    let rows = case.equations.rows.len();
    // The diffuse system is the coupling itself, row by row.
    wide.coupling = Mat::from_fn(2 * rows, case.emission.len(), |row, column| {
        case.transport.coupling[(row % rows, column)]
    });
    let watch = Watch::new();
    let twice =
        emission::solve(&doubled, &case.truth, &case.lobes, &wide, &OPTIONS, None, &watch).unwrap();
    let error = distance(&twice.emission, &case.emission);
    assert!(error < tolerance, "doubled equations: {error}");
}

#[test]
fn the_refinement_stays_at_an_exact_answer() {
    let case = exact_case();
    let solution = refine(
        &case.room.capture,
        &case.equations,
        &case.lobes,
        &case.transport,
        case.truth.clone(),
        &quick(),
        &|_| {},
        &Watch::new(),
    )
    .unwrap();
    assert!(solution.iterations.len() > 1, "reflectances were never estimated anew");
    for (found, truth) in solution.reflectances.iter().flatten().zip(case.truth.iter().flatten()) {
        for (found, truth) in found.diffuse.iter().zip(truth.diffuse) {
            assert!((found - truth).abs() < EXACT, "{found} for {truth}");
        }
    }
    assert!(distance(&solution.emission, &case.emission) < EXACT * largest(&case.emission));
    let rms = solution.iterations.last().unwrap().rms;
    // What errors of 1e-6 in light and reflectance leave at most.
    assert!(rms.relative.iter().all(|&value| value < 2.0 * EXACT), "{rms:?}");
    for (row, computed) in case.equations.rows.iter().zip(&solution.computed) {
        for (radiance, computed) in row.radiance.iter().zip(computed) {
            assert!((radiance - computed).abs() < 10.0 * EXACT * radiance, "{computed}");
        }
    }
    assert_ne!(solution.stopped, Stopped::NothingToSolve);
}

#[test]
fn the_coupling_of_a_convex_scene_is_equation_10() {
    let (room, mut samples) = scene(false);
    let (lights, lobes) = lights();
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let options = TransportOptions::default();
    let transport = gather(&views, &samples, &lights, &lobes, &options, 5, &Watch::new()).unwrap();

    // Eq. 10 with 1/r², V = 1, in double precision.
    let mut tolerances = Mat::<f64>::zeros(samples.samples.len(), lobes.lobes.len());
    let exact = Mat::from_fn(samples.samples.len(), lobes.lobes.len(), |row, column| {
        let (lobe, sample): (&Lobe, &Sample) = (&lobes.lobes[column], &samples.samples[row]);
        let light = lights.lights[lobe.light];
        let offset = light.position.as_dvec3() - sample.position.as_dvec3();
        let r = offset.length();
        let area = PI * f64::from(light.radius_m).powi(2);
        let factor = area * offset.dot(sample.normal.as_dvec3()) / r.powi(3);
        let cosine = (-offset / r).dot(lobe.direction.as_dvec3()).max(0.0);
        // Single precision: the cosine is off by 4e-7 at most (three products of rounded unit
        // vectors), which its power multiplies by α; the rest is a few relative roundings.
        // Values below 1e-7 of the factor are dropped, as the code says.
        tolerances[(row, column)] = factor
            * (1e-7 + 20.0 * cosine.powi(19) * 4e-7 + 1e-6 * cosine.powi(20))
            + f64::from(f32::MIN_POSITIVE);
        factor * cosine.powi(20)
    });
    for row in 0..exact.nrows() {
        for column in 0..exact.ncols() {
            let difference = (transport.coupling[(row, column)] - exact[(row, column)]).abs();
            assert!(difference <= tolerances[(row, column)], "{row}, {column}: {difference}");
        }
    }

    // Radiances from the exact coupling, light found with the library's.
    let rho = [0.6, 0.35, 0.2];
    let emission = emissions(lobes.lobes.len(), 21);
    let all: Vec<Rgb> =
        (0..exact.nrows()).map(|row| radiance(row, rho, [0.0; 3], &exact, &emission)).collect();
    for (sample, radiance) in samples.samples.iter_mut().zip(&all) {
        sample.radiance = radiance.map(|value| value as f32);
    }
    let mut equations = Equations::new(&room.capture, &samples, &lights, &transport, 6);
    for row in &mut equations.rows {
        row.radiance = all[row.sample];
    }
    let truth = vec![Some(Brdf::diffuse(rho))];
    let watch = Watch::new();
    let found =
        emission::solve(&equations, &truth, &lobes, &transport, &OPTIONS, None, &watch).unwrap();
    for channel in 0..3 {
        // x̂ minimises ‖W(K'x − b)‖ over x ≥ 0, which the truth x satisfies, so
        // ‖W K'(x̂ − x)‖ ≤ 2 ‖W (K' − K) x‖, and ‖x̂ − x‖ is less by the smallest singular
        // value. W is 1/L here, since nothing was photographed (L⁺ = 0).
        let weights: Vec<f64> = all.iter().map(|l| rho[channel] / PI / l[channel]).collect();
        let weighted = Mat::from_fn(exact.nrows(), exact.ncols(), |row, column| {
            weights[row] * transport.coupling[(row, column)]
        });
        let smallest =
            weighted.singular_values().unwrap().into_iter().fold(f64::INFINITY, f64::min);
        let perturbation: f64 = (0..exact.nrows())
            .map(|row| {
                let change: f64 = (0..exact.ncols())
                    .map(|column| {
                        (transport.coupling[(row, column)] - exact[(row, column)])
                            * emission[column][channel]
                    })
                    .sum();
                (weights[row] * change).powi(2)
            })
            .sum::<f64>()
            .sqrt();
        let bound = 2.0 * perturbation / smallest + EXACT * largest(&emission);
        let error: f64 = found
            .emission
            .iter()
            .zip(&emission)
            .map(|(found, truth)| (found[channel] - truth[channel]).powi(2))
            .sum::<f64>()
            .sqrt();
        assert!(error <= bound, "channel {channel}: {error}, bound {bound}");
        assert!(bound < 1e-2 * largest(&emission), "the bound {bound} says nothing");
    }
}
