use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use lobelia::render::edits::{AddedLight, Shape};
use lobelia::render::film::Film;
use lobelia::scene::{Dome, Emitter, Image};

use crate::stage::{Estimate, Stage, ceiling, floor, reflectance};

const RHO: f64 = 0.6;
const STRENGTH: f64 = 4.0;

/// The middle of a diffuse floor sends ρ/π times its irradiance per unit of the light's strength.
#[track_caller]
fn sends(emitter: Emitter, irradiance: f64) {
    let stage = floor(reflectance(RHO, 0.0, 1.0)).light(emitter, [STRENGTH; 3]).spp(256);
    sends_from(&stage, irradiance);
}

#[track_caller]
fn sends_from(stage: &Stage, irradiance: f64) {
    // Near, so that no light is in between.
    let estimate = stage.radiance(DVec3::new(0.011, -0.012, 0.02), DVec3::ZERO)[1];
    if irradiance == 0.0 {
        assert_eq!((estimate.mean, estimate.error), (0.0, 0.0));
    } else {
        estimate.is(RHO / PI * STRENGTH * irradiance, 1e-2);
    }
}

/// π times the view factor of a parallel rectangle with a corner above the element: sides a and
/// b in units of the distance.
fn corner_form(a: f64, b: f64) -> f64 {
    let (p, q) = (a.hypot(1.0), b.hypot(1.0));
    0.5 * (a / p * (b / p).atan() + b / q * (a / q).atan())
}

/// The same for [x0, x1] × [y0, y1] at height z above the origin.
fn above([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> f64 {
    let f = |x: f64, y: f64| x.signum() * y.signum() * corner_form(x.abs() / z, y.abs() / z);
    f(x1, y1) - f(x0, y1) - f(x1, y0) + f(x0, y0)
}

#[test]
fn a_rectangle_near_and_far() {
    // Nearly all directions meet the first, hardly any the last; the fourth is off to the side.
    for (x, y, z) in [
        ([-2.0, 1.5], [-1.0, 3.0], 0.1),
        ([-1.0, 1.5], [-0.5, 2.0], 1.0),
        ([0.5, 0.8], [1.0, 1.1], 0.9),
        ([2.0, 3.0], [0.5, 1.0], 0.3),
        ([-0.5, 0.5], [-0.5, 0.5], 10.0),
    ] {
        sends(ceiling(x, y, z), above(x, y, z));
    }
}

#[test]
fn the_back_of_a_rectangle_is_dark() {
    let Emitter::Rectangle { corners, normal } = ceiling([-1.0, 1.0], [-1.0, 1.0], 1.0) else {
        unreachable!()
    };
    sends(Emitter::Rectangle { corners, normal: -normal }, 0.0);
    sends(ceiling([-1.0, 1.0], [-1.0, 1.0], -1.0), 0.0);
}

/// Where light sampling finds it, so do paths that run into it, which get most of so large a
/// one's weight.
#[test]
fn a_panel_flush_with_a_ceiling() {
    let (x, y) = ([-2.0, 1.5], [-1.0, 3.0]);
    for z in [0.3, 0.7331] {
        let mut stage = floor(reflectance(RHO, 0.0, 1.0)).light(ceiling(x, y, z), [STRENGTH; 3]);
        let black = stage.room.diffuse("ceiling");
        stage.solved.reflectances.push(Some(reflectance(0.0, 0.0, 1.0)));
        stage.room.square(black, 5.0, z);
        sends_from(&stage, above(x, y, z));
    }
}

/// A light of which a cone of half-angle `half` is full, `tilt` off the normal: over the circles
/// of equal height, the part of each within the cone.
fn cone_form(half: f64, tilt: f64) -> f64 {
    let steps = 100_000;
    let (first, last) = ((tilt - half).max(0.0), (tilt + half).min(FRAC_PI_2));
    let step = (last - first) / steps as f64;
    let ring = |k| {
        let polar = first + (f64::from(k) + 0.5) * step;
        let cosine = (half.cos() - polar.cos() * tilt.cos()) / (polar.sin() * tilt.sin());
        2.0 * cosine.clamp(-1.0, 1.0).acos() * polar.cos() * polar.sin() * step
    };
    (0..steps).map(ring).sum()
}

#[test]
fn a_sphere_near_far_and_at_the_horizon() {
    for (distance, radius) in [(3.0, 0.5), (1.0, 0.95), (50.0, 0.02)] {
        let half = f64::asin(radius / distance);
        for tilt in [0.1f64, 1.2, FRAC_PI_2 + 0.5 * half] {
            let direction = DVec3::new(tilt.sin() * 0.6, tilt.sin() * 0.8, tilt.cos());
            let center = (distance * direction).as_vec3();
            sends(Emitter::Sphere { center, radius_m: radius as f32 }, cone_form(half, tilt));
        }
    }
    // Around the place there is nothing but light.
    sends(Emitter::Sphere { center: Vec3::new(0.3, 0.2, 0.1), radius_m: 2.0 }, PI);
}

#[test]
fn a_point_and_a_spot() {
    let position = Vec3::new(0.3, -0.4, 1.2);
    let distance = position.as_dvec3().length();
    let irradiance = 1.2 / distance.powi(3);
    sends(Emitter::Point { position }, irradiance);
    // The floor's middle lies off the axis by an angle whose cosine is that of the slant.
    let spot = |inner: f64, outer: f64| Emitter::Spot {
        position,
        direction: -Vec3::Z,
        inner_angle: inner as f32,
        outer_angle: outer as f32,
    };
    let off_axis = (1.2 / distance).acos();
    sends(spot(off_axis + 0.1, off_axis + 0.3), irradiance);
    sends(spot(0.0, off_axis - 0.1), 0.0);
    let (inner, outer) = (off_axis - 0.2, off_axis + 0.15);
    let t = (off_axis.cos() - outer.cos()) / (inner.cos() - outer.cos());
    sends(spot(inner, outer), t * t * (3.0 - 2.0 * t) * irradiance);
}

#[test]
fn a_sun_small_large_and_setting() {
    for diameter in [0.0093, 0.8, 2.5] {
        for tilt in [0.05f64, 0.9, 1.45] {
            let direction = -DVec3::new(tilt.sin() * 0.6, tilt.sin() * 0.8, tilt.cos()).as_vec3();
            let half = 0.5 * diameter;
            // A surface that faces a disc of radiance L gets π sin² of its half-angle of it.
            let irradiance = cone_form(half, tilt) / (PI * half.sin().powi(2));
            sends(Emitter::Sun { direction, angular_diameter: diameter as f32 }, irradiance);
        }
    }
}

/// A sky whose rows have these values, under a factor.
fn sky(rows: &[f32], columns: usize) -> AddedLight {
    let pixels = rows.iter().flat_map(|&row| vec![[row; 3]; columns]).collect();
    let image = Arc::new(Image::new(columns, rows.len(), pixels, None));
    let emission = [STRENGTH; 3];
    AddedLight {
        name: "sky".into(),
        shape: Shape::Dome(Dome::new(image, 1.0)),
        emission,
        is_on: true,
    }
}

/// Irradiance of the floor from a sky that depends on the angle from the zenith, linear between
/// the middles of the rows.
fn zonal(rows: &[f32]) -> f64 {
    let steps = 100_000;
    let step = FRAC_PI_2 / f64::from(steps);
    let ring = |k: i32| {
        let polar = (f64::from(k) + 0.5) * step;
        let place = (polar / PI * rows.len() as f64 - 0.5).clamp(0.0, rows.len() as f64 - 1.0);
        let (row, part) = (place as usize, place.fract());
        let next = rows[(row + 1).min(rows.len() - 1)];
        let radiance = (1.0 - part) * f64::from(rows[row]) + part * f64::from(next);
        2.0 * PI * radiance * polar.sin() * polar.cos() * step
    };
    (0..steps).map(ring).sum()
}

#[test]
fn a_dome_even_layered_and_with_a_bright_band() {
    let mut band = vec![0.01f32; 600];
    band[110] = 300.0;
    for rows in [vec![1.0], vec![4.0, 1.0, 0.0, 2.0, 50.0, 50.0], band] {
        let mut stage = floor(reflectance(RHO, 0.0, 1.0)).spp(64);
        stage.edits.lights.push(sky(&rows, 2 * rows.len()));
        sends_from(&stage, zonal(&rows));
    }
}

#[test]
fn lights_keep_to_their_layers() {
    let near = ceiling([-1.0, 1.5], [-0.5, 2.0], 1.0);
    let bulb = Emitter::Point { position: Vec3::new(0.3, -0.4, 1.2) };
    let alone = |light| floor(reflectance(RHO, 0.0, 1.0)).light(light, [1.0, 2.0, 3.0]);
    let both = alone(near).light(bulb, [3.0, 2.0, 1.0]);
    let camera = crate::stage::needle(DVec3::new(0.1, -0.2, 0.5), DVec3::ZERO);
    let film = both.film(&camera);
    assert_eq!(film.layers(), 3);
    assert!(film.layer(0).iter().all(|pixel| *pixel == [0.0; 3]));
    for (layer, light) in [(1, near), (2, bulb)] {
        let mean = |film: &Film, layer: usize| {
            Estimate::of(&film.layer(layer).iter().map(|p| p[1].into()).collect::<Vec<f64>>())
        };
        let (among, alone) = (mean(&film, layer), mean(&alone(light).film(&camera), 1));
        let error = among.error.hypot(alone.error) + 1e-6;
        assert!((among.mean - alone.mean).abs() < 4.5 * error, "{among:?}, {alone:?}");
    }
    for (pixel, beauty) in film.beauty().iter().enumerate() {
        for (c, beauty) in beauty.iter().enumerate() {
            let sum: f32 = (0..3).map(|layer| film.layer(layer)[pixel][c]).sum();
            assert!((sum / beauty - 1.0).abs() < 1e-5);
            // One floor alone: all light comes without a detour.
            assert!((film.direct()[pixel][c] / beauty - 1.0).abs() < 1e-5);
        }
    }
}
