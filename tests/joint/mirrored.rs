//! What glossy surfaces mirror, where no photograph shows it.

use std::f64::consts::PI;

use glam::DVec3;
use lobelia::math::rgb::Rgb;
use lobelia::scene::MaterialKind;

use crate::coats::coat;
use crate::rooms::{Room, camera, icosphere, run};
use crate::whole::options;

const WALL: Rgb = [0.7, 0.5, 0.6];
const PLATE: Rgb = [0.2, 0.15, 0.1];
const ROUGHNESS: f64 = 0.25;
/// The lowest height of the luminous cap of the sphere of radius 1.
const CAP: f64 = 0.75;

/// Radiance of the sphere's wall around a cap of radiance 1: every point of a sphere sees every area
/// alike, so that L = ρ (f_cap + f_wall L), with fractions f of the area.
fn of_wall() -> Rgb {
    let cap = 0.5 * (1.0 - CAP);
    WALL.map(|rho| rho * cap / (1.0 - rho * (1.0 - cap)))
}

/// Radiance of the plate, which faces up and has a coat, at a point of it, by the midpoint rule.
fn of_plate(position: DVec3, eye: DVec3) -> Rgb {
    let (rings, spokes) = (64, 96);
    let towards = (eye - position).normalize_or_zero();
    let wall = of_wall();
    let mut sum = [0.0; 3];
    for ring in 0..rings {
        // Directions that are distributed by the cosine: each stands for π/(rings × spokes) sr.
        let square = (ring as f64 + 0.5) / rings as f64;
        let (z, across) = ((1.0 - square).sqrt(), square.sqrt());
        for spoke in 0..spokes {
            let (sine, cosine) = (2.0 * PI * (spoke as f64 + 0.5) / spokes as f64).sin_cos();
            let direction = DVec3::new(across * cosine, across * sine, z);
            let along = position.dot(direction);
            let far = -along + (along * along + 1.0 - position.length_squared()).sqrt();
            let met = position + far * direction;
            let lobe = PI * coat(ROUGHNESS, towards, direction);
            for c in 0..3 {
                let radiance = if met.z > CAP { 1.0 } else { wall[c] };
                sum[c] += radiance * (PLATE[c] + lobe);
            }
        }
    }
    sum.map(|sum| sum / f64::from(rings * spokes))
}

/// A sphere with a luminous cap and a small glossy plate at its centre. Photographs show the plate, the cap
/// and the wall below the plate; the wall above the plate, which the plate mirrors, they do not show.
#[test]
fn a_lobe_reflects_known_surfaces_that_no_photograph_shows() {
    let mut room = Room::default();
    let wall = room.diffuse("wall");
    let plate = room.material("plate", MaterialKind::Specular);
    let cap = room.luminaire("cap");
    let (positions, mut faces) = icosphere(4);
    faces.iter_mut().for_each(|face| face.swap(1, 2));
    room.triangles(
        &positions,
        &faces,
        |[a, b, c]| {
            if (a + b + c).z / 3.0 > CAP { cap } else { wall }
        },
    );
    room.square(plate, 0.1, 0.0);
    let low = [18.0, 26.0, 34.0].into_iter().flat_map(|height: f64| {
        [-25.0, 0.0, 25.0].map(|azimuth: f64| (height.to_radians(), azimuth.to_radians()))
    });
    let mut cameras: Vec<_> = low
        .map(|(height, azimuth)| {
            let (across, z) = (0.6 * height.cos(), 0.6 * height.sin());
            let eye = DVec3::new(across * azimuth.sin(), -across * azimuth.cos(), z);
            camera((80, 60), 1.5, eye, DVec3::ZERO)
        })
        .collect();
    cameras.push(camera((80, 80), 0.5, DVec3::new(0.02, 0.03, 0.03), DVec3::Z));
    for camera in cameras {
        let eye = camera.position;
        room.photograph(camera, |struck| {
            let radiance = match struck.surface {
                surface if surface == wall => of_wall(),
                surface if surface == plate => of_plate(struck.position, eye),
                _ => [1.0; 3],
            };
            radiance.map(|value| value as f32)
        });
    }
    // What the scale follows from is not the question here.
    room.capture.materials[0].known_diffuse = Some(WALL);
    let mut options = options();
    options.transport.rays = 1024;
    options.transport.glossy_rays = 2500;
    let result = run(&room, &options).unwrap();
    let found = result.solution.reflectances[1].unwrap();
    for (found, truth) in found.diffuse.into_iter().zip(PLATE) {
        assert!((found - truth).abs() < 0.01, "{found} for {truth}");
    }
    let roughness = found.coat.expect("a coat");
    assert!((roughness / ROUGHNESS).log2().abs() < 0.5, "{roughness} for {ROUGHNESS}");
}
