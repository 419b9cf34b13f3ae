use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use lobelia::reconstruct::lights::VirtualLight;
use lobelia::reconstruct::lobes::Lobe;
use lobelia::render::edits::{AddedLight, Shape};
use lobelia::scene::Brdf;
use lobelia::scene::{Dome, Emitter, Image};

use crate::rooms::{Dice, Room, camera, icosphere};
use crate::stage::{Estimate, Stage, reflectance};

const ALBEDO: [f64; 3] = [0.3, 0.7, 1.0];

/// A ball of triangles at the origin.
fn ball() -> Stage {
    let mut room = Room::default();
    let ball = room.diffuse("ball");
    let (positions, faces) = icosphere(1);
    room.triangles(&positions, &faces, |_| ball);
    Stage::new(room, &[Brdf::diffuse(ALBEDO)])
}

/// All that is seen of a convex diffuse thing under light L from everywhere is its albedo times L.
#[track_caller]
fn all_is_albedo(stage: &Stage, radiance: f64) {
    let film = stage.film(&camera((32, 32), 1.4, DVec3::new(3.0, -2.0, 1.5), DVec3::ZERO));
    let seen = film.coverage();
    for (c, albedo) in ALBEDO.into_iter().enumerate() {
        let on_ball = film.beauty().into_iter().zip(&seen).filter(|(_, seen)| **seen >= 1.0);
        let values: Vec<f64> = on_ball.map(|(pixel, _)| f64::from(pixel[c])).collect();
        assert!(values.len() > 150);
        Estimate::of(&values).is(albedo * radiance, 1e-2);
        // Past the ball the light itself is seen.
        let beside = film.beauty().into_iter().zip(&seen).filter(|(_, seen)| **seen == 0.0);
        for (pixel, _) in beside {
            assert!((f64::from(pixel[c]) / radiance - 1.0).abs() < 1e-4);
        }
    }
}

#[test]
fn within_a_shining_sphere_all_is_albedo() {
    for radius_m in [4.0, 500.0] {
        let sphere = Emitter::Sphere { center: Vec3::new(0.2, 0.1, -0.1), radius_m };
        all_is_albedo(&ball().light(sphere, [2.5; 3]), 2.5);
    }
}

#[test]
fn under_an_even_dome_all_is_albedo() {
    for (width, height) in [(2, 1), (16, 8), (700, 350)] {
        let image = Image::new(width, height, vec![[0.5; 3]; width * height], None);
        let shape = Shape::Dome(Dome::new(Arc::new(image), 3.0));
        let mut stage = ball();
        stage.edits.lights.push(AddedLight {
            name: "sky".into(),
            shape,
            emission: [2.0; 3],
            is_on: true,
        });
        all_is_albedo(&stage, 3.0);
    }
}

/// The unit cube, all of one albedo.
fn cube(albedo: f64) -> Stage {
    let mut room = Room::default();
    let wall = room.diffuse("wall");
    room.open_box(wall, DVec3::ZERO, DVec3::ONE);
    room.rectangle(wall, DVec3::ZERO, DVec3::Y, DVec3::X);
    Stage::new(room, &[reflectance(albedo, 0.0, 1.0)])
}

/// Mean radiance over the inner side of the unit cube, at places spread evenly over it.
fn mean_of_walls(stage: &Stage) -> Estimate {
    let mut dice = Dice::new(3);
    let cameras: Vec<_> = (0..1500)
        .map(|k| {
            let (u, v) = (dice.uniform(), dice.uniform());
            let (side, axis) = ((k % 2) as f64, k / 2 % 3);
            let (mut at, mut inward) = (DVec3::new(u, v, 0.0), DVec3::ZERO);
            at[2] = at[axis];
            at[axis] = side;
            inward[axis] = 1.0 - 2.0 * side;
            // From so near that no light is in between.
            camera((1, 1), 1e6, at + 1e-2 * inward, at)
        })
        .collect();
    let films = stage.films(&cameras);
    Estimate::of(&films.iter().map(|film| f64::from(film.beauty()[0][1])).collect::<Vec<_>>())
}

/// Of the flux Φ all meets the walls, and a part a of it meets them again: the mean of the
/// irradiance is Φ/A times a geometric series, whatever the shape of room and light.
#[test]
fn a_closed_box_holds_a_geometric_series() {
    let lamp = Emitter::Sphere { center: Vec3::new(0.4, 0.5, 0.45), radius_m: 0.15 };
    let panel = Emitter::Rectangle {
        corners: [(0.2, 0.3), (0.7, 0.3), (0.7, 0.6), (0.2, 0.6)]
            .map(|(x, y)| Vec3::new(x, y, 0.8)),
        normal: -Vec3::Z,
    };
    let bulb = Emitter::Point { position: Vec3::new(0.6, 0.4, 0.55) };
    let flux = [4.0 * PI * PI * 0.15f64.powi(2), PI * 0.15, 4.0 * PI];
    for (light, flux) in [lamp, panel, bulb].into_iter().zip(flux) {
        for (albedo, most) in [(0.5, 1), (0.5, 2), (0.5, 4), (0.5, 200), (1.0, 3), (1.0, 12)] {
            let series: f64 = (1..=most).map(|k| f64::powi(albedo, k)).sum();
            let stage = cube(albedo).light(light, [0.5, 1.0, 2.0]).most(most as usize).spp(4);
            mean_of_walls(&stage).is(flux / 6.0 / PI * series, 0.03);
        }
    }
}

/// The same of a recovered lamp, whose shadow rays and falloff are its own.
#[test]
fn a_recovered_lamp_holds_the_same_series() {
    let mut stage = cube(0.5).most(200).spp(4);
    stage.solved.light.lights.lights.push(VirtualLight::lamp(Vec3::new(0.45, 0.6, 0.5), 0.02));
    stage.solved.light.lobes.lobes.push(Lobe { light: 0, direction: Vec3::Z, exponent: 0.0 });
    stage.solved.light.lobes.first.push(1);
    stage.solved.light.emission.push([100.0; 3]);
    // Radiance times cross section is the intensity, which leaves into 4π.
    let flux = 4.0 * PI * 100.0 * PI * 0.02f64.powi(2);
    mean_of_walls(&stage).is(flux / 6.0 / PI, 0.03);
}

/// Through one more thing that is convex and white nothing is lost.
#[test]
fn white_walls_keep_all_light_for_as_long_as_it_is_followed() {
    let bulb = Emitter::Point { position: Vec3::splat(0.5) };
    let mean = |most: usize| mean_of_walls(&cube(1.0).light(bulb, [1.0; 3]).most(most).spp(4));
    let (few, many) = (mean(20), mean(40));
    let step = 4.0 * PI / 6.0 / PI;
    few.is(20.0 * step, 0.03);
    many.is(40.0 * step, 0.03);
}
