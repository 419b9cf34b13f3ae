//! Integrating spheres: everything is photographed, nothing is unknown, and the light on every
//! point is known.

use std::f64::consts::PI;

use glam::DVec3;
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::Reconstruction;
use lobelia::reconstruct::options::Method;

use crate::rooms::{Room, Tracer, cube_cameras, icosphere, quick, run};

/// The eye stands off the centre, so that no pixel centre falls exactly on an edge.
const EYE: DVec3 = DVec3::new(0.03, -0.02, 0.05);

/// A sphere of one diffuse material, or with the cap above `cap_from` as a luminaire; `inwards`
/// says how the faces are wound.
fn sphere(inwards: bool, cap_from: f64) -> Room {
    let mut room = Room::default();
    let wall = room.diffuse("wall");
    let lamp = (cap_from < 1.0).then(|| room.luminaire("cap"));
    let (positions, mut faces) = icosphere(3);
    if inwards {
        faces.iter_mut().for_each(|face| face.swap(1, 2));
    }
    room.triangles(&positions, &faces, |[a, b, c]| match lamp {
        Some(lamp) if (a + b + c).z / 3.0 > cap_from => lamp,
        _ => wall,
    });
    room
}

#[test]
fn in_a_uniform_furnace_everything_is_white() {
    let radiance = [0.7f32, 1.9, 0.02];
    for inwards in [true, false] {
        let mut room = sphere(inwards, 1.0);
        for camera in cube_cameras(EYE, 48) {
            room.photograph(camera, |_| radiance);
        }
        let result = run(&room, &quick()).unwrap();
        assert!(result.samples.samples.len() > 100);
        for irradiance in &result.transport.irradiance {
            for (found, radiance) in irradiance.iter().zip(radiance) {
                // Every ray meets the same radiance, so only rounding is left: a mean of the
                // pixels (2⁻²³) summed in double precision and stored in single.
                let relative = f64::from(*found) / (PI * f64::from(radiance)) - 1.0;
                assert!(relative.abs() < 1e-5, "{inwards}: {relative}");
            }
        }
        assert!(result.lights.lights.is_empty(), "{} lights", result.lights.lights.len());
        assert!(
            result.warnings.iter().any(|warning| warning.contains("no virtual light")),
            "{:?}",
            result.warnings
        );
        assert!(result.solution.is_usable());
        let wall = result.solution.reflectances[0].unwrap();
        // ρ = πL / I, to the same rounding.
        assert!(wall.diffuse.iter().all(|value| (value - 1.0).abs() < 1e-5), "{wall:?}");
    }
}

#[test]
fn what_no_photograph_shows_is_the_rest_of_the_hemisphere() {
    let mut room = sphere(true, 1.0);
    for camera in cube_cameras(EYE, 48).into_iter().take(3) {
        room.photograph(camera, |_| [1.0; 3]);
    }
    let result = run(&room, &quick()).unwrap();
    let transport = &result.transport;
    let mut unphotographed = 0.0;
    for sample in 0..result.samples.samples.len() {
        let rest: f64 =
            transport.unphotographed_of(sample).iter().map(|met| met.projected_sr).sum();
        // The sphere is closed: every ray meets radiance 1 or what is hidden.
        let whole = transport.irradiance(sample, 1) + rest;
        assert!((whole / PI - 1.0).abs() < 1e-5, "sample {sample}: {whole}");
        unphotographed += rest / PI;
    }
    // Every point of a sphere sees every area alike, and three of six cube faces show half of it
    // but for the eye's distance from the centre.
    let unphotographed = unphotographed / result.samples.samples.len() as f64;
    assert!((unphotographed - 0.5).abs() < 0.05, "{unphotographed}");
    for met in transport.unphotographed.iter() {
        let surface = room.capture.mesh.surface[met.triangle as usize];
        let plane = room.capture.mesh.normal(met.triangle as usize);
        assert_eq!(surface, 0);
        assert!((plane.dot(met.point.normal).abs() - 1.0).abs() < 1e-5);
    }
}

#[test]
fn walls_that_no_photograph_shows_reflect_like_the_others() {
    let rho = [0.7, 0.5, 0.1];
    let mut room = cap_furnace(rho).room;
    // The bottom's photograph is missing; the luminous cap is at the top.
    room.capture.photographs.remove(5);
    let mut options = quick();
    options.general.method = Method::Joint;
    options.joint.light_sets = 1;
    options.transport.rays = 400;
    let result = run(&room, &options).unwrap();
    let samples = result.samples.samples.len();
    let unphotographed: f64 =
        result.transport.unphotographed.iter().map(|met| met.projected_sr).sum();
    assert!(
        unphotographed > 0.1 * PI * samples as f64,
        "hardly anything is unphotographed: {unphotographed}"
    );
    let is_lit = |emission: &Rgb| emission.iter().any(|&value| value > 0.0);
    assert!(!result.solution.emission.iter().any(is_lit), "light was invented");
    let wall = result.solution.reflectances[0].unwrap().diffuse;
    for (wall, rho) in wall.iter().zip(rho) {
        // Without the light from the bottom they come out up to 10 % too bright; what is left is
        // noise of the rays and the jitter of what stands for the bottom.
        assert!((wall / rho - 1.0).abs() < 0.02, "{wall} for {rho}");
    }
}

/// The irradiance at a point from a uniform triangle above its horizon, per unit of radiance
/// (Lambert 1760): half the sum of the edges' angles, each times the cosine between the normal
/// and the edge's plane.
fn lambert(point: DVec3, normal: DVec3, corners: [DVec3; 3]) -> f64 {
    let towards = corners.map(|corner| corner - point);
    let sum: f64 = (0..3)
        .map(|k| {
            let (a, b) = (towards[k], towards[(k + 1) % 3]);
            let plane = a.cross(b);
            let angle = plane.length().atan2(a.dot(b));
            angle * plane.normalize_or_zero().dot(normal)
        })
        .sum();
    0.5 * sum.abs()
}

/// A sphere with a luminous cap of radiance 1 in equilibrium with a wall of reflectance `rho`.
struct CapFurnace {
    room: Room,
    wall: Rgb,
    /// Fraction of the sphere's area.
    cap: f64,
}

fn cap_furnace(rho: Rgb) -> CapFurnace {
    let mut room = sphere(true, 0.6);
    let mesh = &room.capture.mesh;
    let area = |surface: u32| -> f64 {
        (0..mesh.triangles.len())
            .filter(|&triangle| mesh.surface[triangle] == surface)
            .map(|triangle| {
                let [a, b, c] = mesh.corners(triangle).map(|p| p.as_dvec3());
                0.5 * (b - a).cross(c - a).length()
            })
            .sum()
    };
    let cap = area(1) / (area(0) + area(1));
    // Every point of a sphere sees every area alike: L = ρ (f + (1 − f) L).
    let wall = rho.map(|rho| rho * cap / (1.0 - rho * (1.0 - cap)));
    let colours = [wall.map(|value| value as f32), [1.0; 3]];
    for camera in cube_cameras(EYE, 96) {
        room.photograph(camera, |struck| colours[struck.surface]);
    }
    CapFurnace { room, wall, cap }
}

/// The exact irradiance of every sample: the sphere's facets form a convex body, so all facets
/// are seen whole.
fn exact_irradiance(furnace: &CapFurnace, result: &Reconstruction) -> Vec<Rgb> {
    let mesh = &furnace.room.capture.mesh;
    let irradiance = |sample: &lobelia::reconstruct::samples::Sample| {
        let (mut from_cap, mut from_wall) = (0.0, 0.0);
        let (point, normal) = (sample.position.as_dvec3(), sample.normal.as_dvec3());
        for triangle in 0..mesh.triangles.len() {
            let corners = mesh.corners(triangle).map(|p| p.as_dvec3());
            // The sample's own facet is level with it and gives nothing.
            let above = corners.iter().map(|p| (*p - point).dot(normal)).fold(0.0, f64::max);
            if above < 1e-5 {
                continue;
            }
            let value = lambert(point, normal, corners);
            *(if mesh.surface[triangle] == 1 { &mut from_cap } else { &mut from_wall }) += value;
        }
        assert!((from_cap + from_wall - PI).abs() < 1e-3, "the hemisphere is {from_cap}");
        furnace.wall.map(|wall| from_cap + wall * from_wall)
    };
    result.samples.samples.iter().map(irradiance).collect()
}

#[test]
fn a_sphere_with_a_luminous_cap_gives_the_walls_reflectance() {
    let rho = [0.8, 0.5, 0.1];
    let furnace = cap_furnace(rho);
    let mut options = quick();
    options.transport.rays = 1600;
    let result = run(&furnace.room, &options).unwrap();
    assert!(result.lights.lights.is_empty());
    let exact = exact_irradiance(&furnace, &result);
    let samples = exact.len() as f64;
    let found = result.solution.reflectances[0].unwrap().diffuse;
    for channel in 0..3 {
        let wall = furnace.wall[channel];
        // A ray finds the cap with probability p: variance p (1 − p) (1 − L)². Jittering rays
        // within strata never has more variance than throwing them independently.
        let p = furnace.cap;
        let per_ray = PI * (p * (1.0 - p)).sqrt() * (1.0 - wall);
        let per_sample = per_ray / 1600f64.sqrt();
        let mean: f64 = exact.iter().map(|e| e[channel]).sum::<f64>() / samples;
        let error: f64 = result
            .transport
            .irradiance
            .iter()
            .zip(&exact)
            .map(|(found, exact)| f64::from(found[channel]) - exact[channel])
            .sum::<f64>()
            / samples;
        // A pixel on the cap's rim shows one side for both. Its centre decides, so the error's
        // expectation is 0 and at most one pixel (1/96 of 2.12, seen from 1 m) in area each,
        // over about 2π·0.8·1.2 m / 0.022 m = 270 pixels, independent: 5 × √270 / 2 of them.
        let pixel = 2.12 / 96.0;
        let rim = PI * (1.0 - wall) * 2.5 * 270f64.sqrt() * pixel * pixel / (4.0 * PI);
        let bound = 5.0 * per_sample / samples.sqrt() + rim;
        assert!(error.abs() < bound, "{channel}: I is off by {error}, bound {bound}");
        // That the bound says something: it is below a tenth of the irradiance.
        assert!(bound < 0.1 * mean, "{bound} of {mean}");

        // Eq. 13 is a ratio of sums, π Σ L G / Σ G²: noise of relative variance v in G lowers it
        // by v; an error of the mean moves it by as much.
        let noise = (per_sample / mean).powi(2);
        // The facets' departure from the sphere, from the exact irradiances themselves.
        let facets = PI * wall * exact.iter().map(|e| e[channel]).sum::<f64>()
            / exact.iter().map(|e| e[channel].powi(2)).sum::<f64>()
            / rho[channel]
            - 1.0;
        // Normals are off the radius by up to half a facet's width (0.08 rad) in all directions
        // alike, so what they do to the mean is of second order.
        assert!(facets.abs() < 0.08f64.powi(2) * 2.0, "{facets}");
        let bound = 1.1 * (bound / mean + noise + facets.abs());
        let relative = found[channel] / rho[channel] - 1.0;
        assert!(relative.abs() < bound, "{channel}: {} for {}", found[channel], rho[channel]);
    }
}

#[test]
fn no_ray_escapes_a_closed_sphere() {
    // The library's caster against a body without holes: what leaks would become light.
    let room = sphere(true, 1.0);
    let caster = room.caster();
    let tracer = Tracer::new(&room.capture.mesh);
    let mut dice = crate::rooms::Dice::new(3);
    for _ in 0..200_000 {
        let direction =
            DVec3::new(dice.uniform() - 0.5, dice.uniform() - 0.5, dice.uniform() - 0.5)
                .normalize_or_zero();
        let ray = lobelia::geometry::bvh::Ray {
            origin: EYE.as_vec3(),
            direction: direction.as_vec3(),
            t_min: 0.0,
            t_max: f32::INFINITY,
        };
        assert!(caster.closest(&ray).is_some(), "{direction} escaped");
    }
    assert!(tracer.nearest(EYE, DVec3::X).is_some());
}
