use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use lobelia::render::edits::{AddedLight, Shape};
use lobelia::scene::{Brdf, Dome, Emitter, Image};

use crate::coats::coat;
use crate::stage::{Stage, ceiling, floor, reflectance};

/// ρ_d/π + ρ_s (n+2)/2π cosⁿγ of a floor seen from `eye`, for light from `towards`.
fn brdf([diffuse, specular, exponent]: [f64; 3], eye: DVec3, towards: DVec3) -> f64 {
    let mirror = DVec3::new(-eye.x, -eye.y, eye.z);
    let cosine = mirror.dot(towards);
    let lobe = if cosine > 0.0 { cosine.powf(exponent) } else { 0.0 };
    diffuse / PI + specular * (exponent + 2.0) / (2.0 * PI) * lobe
}

fn even_sky() -> AddedLight {
    let image = Arc::new(Image::new(32, 16, vec![[1.0; 3]; 512], None));
    let shape = Shape::Dome(Dome::new(image, 1.0));
    AddedLight { name: "sky".into(), shape, emission: [1.0; 3], is_on: true }
}

/// The part of even light that is reflected towards `eye`: over rings about the mirror direction.
fn albedo(surface: [f64; 3], eye: DVec3) -> f64 {
    albedo_of(|towards| brdf(surface, eye, towards), eye)
}

fn albedo_of(brdf: impl Fn(DVec3) -> f64, eye: DVec3) -> f64 {
    let mirror = DVec3::new(-eye.x, -eye.y, eye.z);
    let (tangent, bitangent) = mirror.any_orthonormal_pair();
    let (rings, parts) = (1500, 720);
    let mut sum = 0.0;
    for ring in 0..rings {
        // Denser about the mirror direction, where the lobe is.
        let (from, to) = (f64::from(ring) / 1500.0, f64::from(ring + 1) / 1500.0);
        let angles = [from, to].map(|x| PI * x * x);
        let polar = 0.5 * (angles[0] + angles[1]);
        for part in 0..parts {
            let azimuth = (f64::from(part) + 0.5) / f64::from(parts) * 2.0 * PI;
            let across = azimuth.cos() * tangent + azimuth.sin() * bitangent;
            let towards = polar.cos() * mirror + polar.sin() * across;
            if towards.z > 0.0 {
                let solid_angle = (angles[0].cos() - angles[1].cos()) * 2.0 * PI / f64::from(parts);
                sum += brdf(towards) * towards.z * solid_angle;
            }
        }
    }
    sum
}

fn looking_from(tilt: f64) -> DVec3 {
    DVec3::new(0.6 * tilt.sin(), -0.8 * tilt.sin(), tilt.cos())
}

#[test]
fn a_lobe_reflects_its_integral_of_even_light() {
    for exponent in [0.0, 1.0, 7.0, 60.0, 2000.0] {
        for (diffuse, specular) in [(0.0, 1.0), (0.3, 0.6)] {
            for tilt in [0.0, 0.7, 1.4] {
                let surface = [diffuse, specular, exponent];
                let mut stage = floor(reflectance(diffuse, specular, exponent));
                stage.edits.lights.push(even_sky());
                let eye = looking_from(tilt);
                stage.radiance(eye, DVec3::ZERO)[0].is(albedo(surface, eye), 5e-3);
            }
        }
    }
}

#[test]
fn upright_a_lobe_reflects_what_its_formula_says() {
    // ∫ (n+2)/2π cosⁿ⁺¹ over the hemisphere is 1.
    for exponent in [0.0, 3.0, 100.0] {
        assert!((albedo([0.0, 1.0, exponent], DVec3::Z) - 1.0).abs() < 1e-4);
    }
}

/// Radiance that a floor sends to `eye` from the light [x0, x1] × [y0, y1] at height z.
fn quadrature(surface: [f64; 3], eye: DVec3, x: [f64; 2], y: [f64; 2], z: f64) -> f64 {
    quadrature_of(|towards| brdf(surface, eye, towards), x, y, z)
}

fn quadrature_of(brdf: impl Fn(DVec3) -> f64, x: [f64; 2], y: [f64; 2], z: f64) -> f64 {
    let side = 1500;
    let step = [x, y].map(|[low, high]| (high - low) / f64::from(side));
    let mut sum = 0.0;
    for i in 0..side {
        for j in 0..side {
            let (u, v) = (f64::from(i) + 0.5, f64::from(j) + 0.5);
            let offset = DVec3::new(x[0] + u * step[0], y[0] + v * step[1], z);
            let towards = offset.normalize_or_zero();
            sum += brdf(towards) * towards.z.powi(2) / offset.length_squared();
        }
    }
    sum * step[0] * step[1]
}

/// A coat over a diffuse floor, under an even sky and under rectangles, by quadrature with formulas
/// of its own.
#[test]
fn a_coat_reflects_what_its_formulas_say() {
    const DIFFUSE: f64 = 0.2;
    for roughness in [0.08, 0.3] {
        let coated = Brdf { coat: Some(roughness), ..Brdf::diffuse([DIFFUSE; 3]) };
        for tilt in [0.2, 1.2] {
            let eye = looking_from(tilt);
            let brdf = |towards: DVec3| DIFFUSE / PI + coat(roughness, eye, towards);
            let mut stage = floor(coated);
            stage.edits.lights.push(even_sky());
            stage.radiance(eye, DVec3::ZERO)[0].is(albedo_of(brdf, eye), 0.01);
            for (x, y, z) in [([-2.0, 2.5], [-2.0, 2.0], 0.7), ([-0.3, 0.2], [0.1, 0.9], 1.1)] {
                let stage = floor(coated).light(ceiling(x, y, z), [1.0; 3]).spp(64);
                let expected = quadrature_of(brdf, x, y, z);
                stage.radiance(0.05 * eye, DVec3::ZERO)[2].is(expected, 0.02);
            }
        }
    }
}

#[test]
fn a_glossy_floor_under_rectangles_large_and_small() {
    let eye = looking_from(0.6);
    for (x, y, z) in [
        ([-2.0, 2.5], [-2.0, 2.0], 0.7),
        // About the mirror direction, and off it.
        ([-0.5, -0.4], [0.5, 0.7], 1.1),
        ([0.0, 0.3], [0.0, 0.2], 1.1),
    ] {
        for [diffuse, specular, exponent] in
            [[0.4, 0.3, 40.0], [0.0, 0.8, 5.0], [0.1, 0.8, 600.0], [0.2, 0.5, 0.0]]
        {
            let stage = floor(reflectance(diffuse, specular, exponent))
                .light(ceiling(x, y, z), [1.0; 3])
                .spp(64);
            let expected = quadrature([diffuse, specular, exponent], eye, x, y, z);
            // Nearly nothing is asked of the lobe far off its axis.
            if expected > 1e-6 {
                stage.radiance(0.05 * eye, DVec3::ZERO)[2].is(expected, 0.02);
            }
        }
    }
}

#[test]
fn lights_without_extent_are_reflected_by_the_formula() {
    let eye = looking_from(0.5);
    let surface = [0.2, 0.6, 30.0];
    let stage = || floor(reflectance(0.2, 0.6, 30.0));
    let towards = DVec3::new(-0.2, 0.45, 0.8).normalize_or_zero();
    let reflected = brdf(surface, eye, towards) * towards.z;
    let bulb = Emitter::Point { position: (2.0 * towards).as_vec3() };
    let spot = Emitter::Spot {
        position: (2.0 * towards).as_vec3(),
        direction: -towards.as_vec3(),
        inner_angle: 0.2,
        outer_angle: 0.3,
    };
    let sun = Emitter::Sun { direction: -towards.as_vec3(), angular_diameter: 1e-3 };
    for (light, factor) in [(bulb, 0.25), (spot, 0.25), (sun, 1.0)] {
        let seen = |stage: Stage| stage.light(light, [1.0; 3]).radiance(0.05 * eye, DVec3::ZERO);
        seen(stage())[0].is(factor * reflected, 1e-3);
    }
}

/// A mirror-like wall sends on what a diffuse one gets: glossy paths of two reflections, seen
/// by light sampling at the far end alone.
#[test]
fn gloss_hands_on_what_it_sees() {
    let mut room = crate::rooms::Room::default();
    let (mirror, wall) = (room.diffuse("mirror"), room.diffuse("wall"));
    room.square(mirror, 5.0, 0.0);
    // A wall at y = 2 that faces the eye, lit evenly by a sun.
    room.rectangle(wall, DVec3::new(-5.0, 2.0, 0.0), DVec3::X * 10.0, DVec3::Z * 9.0);
    let stage = Stage::new(room, &[reflectance(0.0, 0.9, 3e4), reflectance(0.5, 0.0, 1.0)]);
    // A third reflection would show the sun's own glint on the mirror, as the wall sees it.
    let stage = stage.most(2);
    let towards = Vec3::new(0.0, -0.8, 0.6);
    let sun = Emitter::Sun { direction: -towards, angular_diameter: 1e-3 };
    let film = stage.light(sun, [1.0; 3]).radiance(DVec3::new(0.0, -1.0, 1.0), DVec3::ZERO);
    // ρ/π E cos of the wall, times 0.9 and the cosine at the mirror, which Eq. 12 has and a lobe
    // whole above the horizon keeps.
    film[0].is(0.9 * 0.5f64.sqrt() * 0.5 / PI * 0.8, 5e-3);
}
