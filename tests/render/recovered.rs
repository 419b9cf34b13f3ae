use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lobelia::geometry::bvh::RayCaster;
use lobelia::math::sampling::{Random, fibonacci};
use lobelia::reconstruct::lights::{LightKind, VirtualLight, VisibilityRays};
use lobelia::reconstruct::lobes::Lobe;
use lobelia::reconstruct::transport::arriving;
use lobelia::scene::{Emitter, Gloss, KnownLight, SurfacePoint, Viewing, Views};
use lobelia::watch::Watch;

use crate::rooms::{Dice, Room, camera};
use crate::stage::{Estimate, Stage, reflectance};

/// A floor and a wall with a box between them, which hides parts of what there is.
pub fn corner() -> Stage {
    let mut room = Room::default();
    let (floor, wall, sides) = (room.diffuse("floor"), room.diffuse("wall"), room.diffuse("box"));
    room.square(floor, 2.0, 0.0);
    room.rectangle(wall, DVec3::new(-2.0, 2.0, 0.0), DVec3::X * 4.0, DVec3::Z * 2.5);
    room.open_box(sides, DVec3::new(-0.3, 0.3, 0.0), DVec3::new(0.4, 0.9, 0.8));
    let reflectances =
        [reflectance(0.5, 0.0, 1.0), reflectance(0.3, 0.4, 25.0), reflectance(0.7, 0.0, 1.0)];
    Stage::new(room, &reflectances).most(1).spp(32)
}

fn shine(stage: &mut Stage, light: VirtualLight, lobes: &[(Vec3, f32)]) {
    let index = stage.solved.light.lights.lights.len();
    stage.solved.light.lights.lights.push(light);
    for (k, &(direction, exponent)) in lobes.iter().enumerate() {
        stage.solved.light.lobes.lobes.push(Lobe { light: index, direction, exponent });
        stage.solved.light.emission.push([1.0 + k as f64, 2.0, 3.0 / (1.0 + k as f64)]);
    }
    stage.solved.light.lobes.first.push(stage.solved.light.lobes.lobes.len());
}

fn unit(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z).normalize_or_zero()
}

/// Adds one light of a kind.
pub fn add(stage: &mut Stage, kind: &str) {
    let lobes = [(unit(-0.2, 0.5, -1.0), 20.0), (unit(0.4, 0.1, -0.6), 3.0)];
    match kind {
        "disc" => {
            let (place, facing) = (Vec3::new(0.3, -1.0, 2.6), unit(-0.1, 0.5, -1.0));
            shine(stage, VirtualLight::disc(LightKind::Sphere, place, facing, 0.3), &lobes);
        }
        "surface" => {
            let place = Vec3::new(-1.0, 2.0, 1.2);
            let disc = VirtualLight::disc(LightKind::Surface, place, -Vec3::Y, 0.25);
            shine(stage, disc, &[(-Vec3::Y, 1.0)]);
        }
        "lamp" => shine(
            stage,
            VirtualLight::lamp(Vec3::new(-0.6, 0.2, 1.6), 0.2),
            &[(Vec3::Z, 0.0), (unit(0.4, 0.1, -0.6), 2.0)],
        ),
        "sky" => {
            for tilt in [0.2f32, 1.0, 1.5] {
                let travels = -Vec3::new(0.6 * tilt.sin(), -0.8 * tilt.sin(), tilt.cos());
                let cell = VirtualLight::distant(LightKind::Sky, travels, 0.3);
                shine(stage, cell, &[(travels, 0.0)]);
            }
        }
        "sun" => {
            let travels = unit(-0.3, 0.6, -0.8);
            let half = 0.5 * Emitter::SUN_DIAMETER;
            shine(stage, VirtualLight::distant(LightKind::Sun, travels, half), &[(travels, 0.0)]);
        }
        "panel" | "spot" => {
            let known = stage.room.capture.lights.len();
            let emitter = match kind {
                "spot" => Emitter::Spot {
                    position: Vec3::new(0.8, -0.5, 1.9),
                    direction: unit(-0.3, 0.4, -1.0),
                    inner_angle: 0.4,
                    outer_angle: 0.9,
                },
                _ => crate::stage::ceiling([0.5, 1.1], [-0.8, -0.2], 2.1),
            };
            let light =
                KnownLight::Shape { name: kind.into(), emitter, emission: None, color: None };
            stage.room.capture.lights.push(light);
            let (middle, radius_m) = emitter.extent();
            let kind = LightKind::Known(known);
            let light = VirtualLight { kind, ..VirtualLight::lamp(middle, radius_m) };
            shine(stage, light, &[(Vec3::Z, 0.0)]);
        }
        _ => unreachable!(),
    }
}

pub const KINDS: [&str; 7] = ["disc", "surface", "lamp", "sky", "sun", "panel", "spot"];

/// Σ k E (ρ_d + ρ_s lobe)/π with the coupling of the solve, over many shadow rays.
fn coupled(
    stage: &Stage,
    point: SurfacePoint,
    eye: Vec3,
    material: usize,
    channel: usize,
) -> Estimate {
    let capture = &stage.room.capture;
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(capture, &caster, &Watch::new()).unwrap();
    let Some(surface) = stage.solved.reflectances[material] else { unreachable!() };
    let towards = (eye - point.position).normalize_or_zero();
    let viewing = Viewing::from(towards, point.normal);
    let run = |run: u64| {
        let mut rays = VisibilityRays::new(20, Random::new(run, 9, 9));
        let mut sum = 0.0;
        for (index, light) in stage.solved.light.lights.lights.iter().enumerate() {
            let range = stage.solved.light.lobes.of(index);
            let mut values = vec![0.0; range.len()];
            let lobes = &stage.solved.light.lobes.lobes[range.clone()];
            arriving(&views, light, lobes, point, &mut rays, &mut values);
            let specular = match surface.specular[channel] {
                0.0 => 0.0,
                specular => {
                    let gloss = Gloss::Phong { exponent: surface.exponent };
                    specular * light.lobe(point.position, viewing, gloss)
                }
            };
            let factor = (surface.diffuse[channel] + specular) / PI;
            let emissions = &stage.solved.light.emission[range];
            let coupled = values.iter().zip(emissions);
            sum += coupled.map(|(k, e)| factor * f64::from(*k) * e[channel]).sum::<f64>();
        }
        sum
    };
    Estimate::of(&(0..24).map(run).collect::<Vec<_>>())
}

/// A place, its normal, its material and an eye.
fn places() -> Vec<(SurfacePoint, Vec3, usize)> {
    let mut dice = Dice::new(11);
    let mut places = Vec::new();
    for k in 0..5 {
        let (u, v) = (4.0 * dice.uniform() as f32 - 2.0, dice.uniform() as f32);
        let floor = SurfacePoint { position: Vec3::new(u, 1.3 * v - 1.4, 0.0), normal: Vec3::Z };
        let wall = SurfacePoint { position: Vec3::new(u, 2.0, 0.2 + 2.0 * v), normal: -Vec3::Y };
        let top = SurfacePoint {
            position: Vec3::new(0.3 * v, 0.4 + 0.1 * k as f32, 0.8),
            normal: Vec3::Z,
        };
        places.extend([floor, wall, top].into_iter().zip(0..3).map(|(point, material)| {
            let aside = Vec3::new(v - 0.5, 0.3, 0.4).reject_from_normalized(point.normal);
            (point, point.position + 0.05 * (point.normal + aside), material)
        }));
    }
    places
}

fn agree(stage: &Stage) {
    let mut lit = 0;
    for (point, eye, material) in places() {
        let film = stage.radiance(eye.as_dvec3(), point.position.as_dvec3());
        for (channel, found) in film.into_iter().enumerate() {
            let expected = coupled(stage, point, eye, material, channel);
            let error = found.error.hypot(expected.error);
            let difference = (found.mean - expected.mean).abs();
            // Single precision moves the place by a rounding of its coordinates.
            assert!(
                difference <= 4.5 * error + 1e-4 * expected.mean,
                "{point:?} {channel}: {found:?}, not {expected:?}"
            );
            lit += usize::from(found.mean > 0.0 && found.error < 0.03 * found.mean);
        }
    }
    assert!(lit >= 10, "{lit} places tell anything");
}

#[test]
fn one_reflection_of_every_kind_of_light_is_its_coupling() {
    for kind in KINDS {
        let mut stage = corner();
        add(&mut stage, kind);
        agree(&stage);
    }
}

#[test]
fn many_lights_are_chosen_among_without_bias() {
    let mut stage = corner().spp(128);
    KINDS.iter().for_each(|kind| add(&mut stage, kind));
    agree(&stage);
}

#[test]
fn dark_lights_change_nothing() {
    let mut stage = corner();
    add(&mut stage, "lamp");
    let before = stage.film(&crate::stage::needle(DVec3::new(0.0, -1.0, 1.0), DVec3::ZERO));
    add(&mut stage, "disc");
    let lit = stage.solved.light.lobes.of(0).end;
    stage.solved.light.emission[lit..].fill([0.0; 3]);
    let after = stage.film(&crate::stage::needle(DVec3::new(0.0, -1.0, 1.0), DVec3::ZERO));
    assert_eq!(before.beauty(), after.beauty());
}

/// A light on a wall that no photograph shows is all that the wall sends, since it was solved for
/// as that; what the wall reflects of it and of other lights would come on top (Section 4.2). Of
/// added light the wall knows nothing yet, and reflects it.
#[test]
fn unseen_surfaces_that_shine_do_not_reflect_what_was_recovered() {
    let mut stage = corner().spp(64);
    add(&mut stage, "lamp");
    add(&mut stage, "surface");
    let eye = camera((48, 48), 0.8, DVec3::new(0.5, -1.9, 3.0), DVec3::new(0.5, -1.5, 0.0));
    stage.room.photograph(eye, |_| [1.0; 3]);
    let floor = |stage: &Stage, most: usize| {
        let stage = stage.clone().most(most);
        stage.radiance(DVec3::new(0.5, -1.4, 0.5), DVec3::new(0.5, -1.5, 0.0))[1]
    };
    let apart = |a: Estimate, b: Estimate| (a.mean - b.mean) / a.error.hypot(b.error);
    let (once, often) = (floor(&stage, 1), floor(&stage, 12));
    assert!(apart(often, once).abs() < 4.5, "{often:?}, not {once:?}");

    let mut lit = stage.clone();
    lit.edits.original_light = 0.0;
    let panel = crate::stage::ceiling([0.5, 1.1], [0.8, 1.4], 2.1);
    let lit = lit.light(panel, [5.0; 3]);
    let (once, often) = (floor(&lit, 1), floor(&lit, 12));
    assert!(apart(often, once) > 10.0, "{often:?}, {once:?}");

    // Where a photograph shows the wall, what it reflects was taken from there instead.
    let across = camera((48, 48), 0.8, DVec3::new(0.0, -1.5, 1.2), DVec3::new(0.0, 2.0, 1.2));
    stage.room.photograph(across, |_| [1.0; 3]);
    let (once, often) = (floor(&stage, 1), floor(&stage, 12));
    assert!(apart(often, once) > 10.0, "{often:?}, {once:?}");
}

/// Beyond the geometry a camera sees the recovered sky, once: below a cell's edge nothing, and the
/// light of what it sees is the light that falls on the floor.
#[test]
fn cameras_see_the_sky_beyond_the_geometry() {
    let mut stage = crate::stage::floor(reflectance(0.5, 0.0, 1.0)).most(1);
    let towards = Vec3::new(0.6, 0.0, 0.8);
    let cell = VirtualLight::distant(LightKind::Sky, -towards, 0.3);
    shine(&mut stage, cell, &[(-towards, 0.0)]);
    let eye = DVec3::new(0.0, 0.0, 1.0);
    let sent = stage.solved.light.emission[0];
    let seen = |angle: f64, factor: f64| {
        let mut stage = stage.clone();
        stage.edits.original_light = factor;
        // From the cell's middle, which is 0.6435 from the vertical, on towards the horizon.
        let (sine, cosine) = (0.643_501 + angle).sin_cos();
        stage.radiance(eye, eye + DVec3::new(sine, 0.0, cosine))
    };
    for factor in [1.0, 0.25] {
        for angle in [0.0, 0.28, -0.28] {
            for (found, sent) in seen(angle, factor).into_iter().zip(sent) {
                assert!((found.mean / (factor * sent) - 1.0).abs() < 1e-5, "{found:?} of {sent}");
            }
        }
    }
    for angle in [0.32, -0.32] {
        assert!(seen(angle, 1.0).iter().all(|found| found.mean == 0.0));
    }
    // What lies in front hides it.
    let below = stage.radiance(-eye, -eye + towards.as_dvec3());
    assert!(below.iter().all(|found| found.mean < 0.2 * sent[0]), "{below:?}");
}

/// Cells of a sky that cover every direction, many of them twice.
fn add_whole_sky(stage: &mut Stage, count: usize, half_angle: f32) {
    for towards in fibonacci(count, 0.4) {
        let cell = VirtualLight::distant(LightKind::Sky, -towards, half_angle);
        shine(stage, cell, &[(-towards, 0.0)]);
    }
}

#[test]
fn cells_of_a_sky_that_overlap_all_count_however_they_are_found() {
    let mut stage = corner().spp(64);
    add_whole_sky(&mut stage, 12, 0.9);
    agree(&stage);
}
