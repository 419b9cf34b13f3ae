//! Texture maps (Section 5.5): a floor with a known pattern under a dome of uniform radiance,
//! where irradiance is π times that radiance everywhere.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2};
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::Reconstruction;
use lobelia::reconstruct::textures::{Texture, mean_reflectance};

use crate::rooms::{Room, Tracer, cube_cameras, icosphere, quick, run, sight};

/// Radiance of the dome.
const SKY: Rgb = [2.0, 1.0, 0.5];
/// The floor reaches beyond the dome at its corners, where nobody sees it.
const HALF: f64 = 0.8;
/// The dome's inscribed radius at the floor is a little less than 1.
const SEEN_WITHIN: f64 = 0.9;
const EYE: DVec3 = DVec3::new(0.03, 0.02, 0.45);

fn dome(textured: bool, pattern: impl Fn(f64, f64) -> Rgb + Sync) -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.capture.materials[0].textured = textured;
    let sky = room.luminaire("sky");
    room.square(floor, HALF, 0.0);
    let (positions, faces) = icosphere(2);
    room.triangles(&positions, &faces, |_| sky);
    photograph(&mut room, pattern);
    room
}

fn photograph(room: &mut Room, pattern: impl Fn(f64, f64) -> Rgb + Sync) {
    for camera in cube_cameras(EYE, 160) {
        room.photograph(camera, |struck| {
            let floor = struck.surface == 0;
            let rho = if floor { pattern(struck.position.x, struck.position.y) } else { [1.0; 3] };
            std::array::from_fn(|c| (rho[c] * SKY[c]) as f32)
        });
    }
}

/// One texture coordinate per corner of the floor, given as a map from the plane.
fn give_texcoords(room: &mut Room, uv: impl Fn(f64, f64) -> (f64, f64)) {
    let mesh = Arc::make_mut(&mut room.capture.mesh);
    mesh.texcoords = (0..mesh.triangles.len())
        .map(|triangle| match mesh.surface[triangle] {
            0 => mesh.corners(triangle).map(|p| {
                let (u, v) = uv(f64::from(p.x), f64::from(p.y));
                Vec2::new(u as f32, v as f32)
            }),
            _ => [Vec2::ZERO; 3],
        })
        .collect();
    room.capture.surfaces[0].has_texcoords = true;
}

/// How far from a point the centre of the nearest pixel that shows it may lie: half a pixel's
/// diagonal, stretched by the slant of the view.
fn pixel_reach(x: f64, y: f64) -> f64 {
    let offset = DVec3::new(x, y, 0.0) - EYE;
    let distance = offset.length();
    let cosine = EYE.z / distance;
    // 160 px over 2 × 1.06 units at distance 1 on the axis; up to √3 further away at a corner
    // of the image, which the distance to the eye already includes.
    0.5 * 2.0f64.sqrt() * distance * (2.12 / 160.0) / cosine
}

/// Relative error of the irradiance at a distance from the floor's centre: rounding alone where
/// every ray meets the sky. A ray that meets it within half a pixel (about 1 cm) of the floor
/// reads a pixel of the floor. The lowest of 144 stratified rays, whose outermost cells begin at
/// a sine of 11/12, is some 1/12 above the horizon, so this takes a wall nearer than 0.2 m;
/// beyond 0.6 m from the centre two rays are allowed for, which lose all at worst.
fn irradiance_error(radius: f64) -> f64 {
    if radius < 0.6 { 1e-5 } else { 1e-5 + 2.0 / 144.0 }
}

/// The place on the floor of a texel's centre, by the texture's own corners.
fn place_of(room: &Room, texture: &Texture, x: usize, y: usize) -> Option<(f64, f64)> {
    let unwrap = &texture.unwrap;
    let u = (x as f64 + 0.5) / unwrap.width as f64;
    let v = 1.0 - (y as f64 + 0.5) / unwrap.height as f64;
    for (&triangle, corners) in unwrap.triangles.iter().zip(&unwrap.corners) {
        let [a, b, c] = corners.map(|uv| uv.as_dvec2());
        let determinant = (b - a).perp_dot(c - a);
        let p = glam::DVec2::new(u, v);
        let (s, t) = ((p - a).perp_dot(c - a) / determinant, (b - a).perp_dot(p - a) / determinant);
        if s >= -1e-9 && t >= -1e-9 && s + t <= 1.0 + 1e-9 {
            let [a, b, c] = room.capture.mesh.corners(triangle).map(|p| p.as_dvec3());
            let place = a * (1.0 - s - t) + b * s + c * t;
            return Some((place.x, place.y));
        }
    }
    None
}

fn the_texture(result: &Reconstruction) -> &Texture {
    assert_eq!(result.textures.len(), 1);
    let texture = &result.textures[0];
    let unwrap = &texture.unwrap;
    assert_eq!(texture.texels.len(), unwrap.width * unwrap.height);
    assert_eq!(texture.seen.len(), texture.texels.len());
    assert_eq!((texture.surface, texture.material), (0, 0));
    texture
}

fn gradient(x: f64, y: f64) -> Rgb {
    [0.5 + 0.3 * (2.0 * x + y).sin(), 0.4 + 0.25 * x, 0.3 - 0.2 * y]
}

/// Largest slopes of `gradient`'s channels, per metre.
const SLOPES: [f64; 3] = [0.67, 0.25, 0.2];

/// Every texel that the dome's photographs show has the pattern's value there.
fn assert_gradient(texture: &Texture, where_is: impl Fn(usize, usize) -> Option<(f64, f64)>) {
    let (mut checked, mut hidden) = (0, 0);
    for y in 0..texture.unwrap.height {
        for x in 0..texture.unwrap.width {
            let Some((px, py)) = where_is(x, y) else { continue };
            let index = y * texture.unwrap.width + x;
            let radius = px.hypot(py);
            if radius > 1.05 {
                // Beyond the dome: no measurement, filled with something of the sort around.
                assert!(!texture.seen[index], "{px}, {py} is behind the dome");
                hidden += 1;
            }
            let border = HALF - px.abs().max(py.abs());
            if radius > SEEN_WITHIN || border <= pixel_reach(px, py) {
                // The pixel may show the dome.
                assert!(texture.texels[index].iter().all(|value| (0.0..=1.0).contains(value)));
                continue;
            }
            assert!(texture.seen[index], "{px}, {py} was photographed");
            checked += 1;
            let exact = gradient(px, py);
            for c in 0..3 {
                let error = (f64::from(texture.texels[index][c]) - exact[c]).abs();
                // Pixels count that show any part of the texel: half its diagonal further away,
                // which is 0.7 of theirs.
                let bound = SLOPES[c] * 1.7 * pixel_reach(px, py) + irradiance_error(radius);
                assert!(error < bound, "{px}, {py}: off by {error}, bound {bound}");
            }
        }
    }
    assert!(checked > 500, "{checked} texels");
    assert!(hidden > 0 || HALF * 2.0f64.sqrt() < 1.05);
}

#[test]
fn a_gradient_comes_back_on_the_polygons_own_unwrap() {
    let room = dome(true, gradient);
    let result = run(&room, &quick()).unwrap();
    assert!(result.lights.lights.is_empty(), "the dome leaks");
    let floor = &result.transport.irradiance;
    for irradiance in floor {
        for (found, sky) in irradiance.iter().zip(SKY) {
            assert!((f64::from(*found) / (PI * sky) - 1.0).abs() < 1e-5);
        }
    }
    let texture = the_texture(&result);
    assert!(!texture.unwrap.is_own);
    assert_gradient(texture, |x, y| place_of(&room, texture, x, y));
    // Eq. 13 over the samples and the mean of the texels describe the same floor; both cover the
    // seen part evenly, the samples but for what lies beside edges, a few per cent of the area
    // at the rim, over which the pattern varies by its slope.
    let mean = mean_reflectance(&result.textures, 0).unwrap();
    let material = result.solution.reflectances[0].unwrap().diffuse;
    for c in 0..3 {
        assert!((mean[c] - material[c]).abs() < 0.1 * SLOPES[c], "{mean:?} and {material:?}");
    }
}

#[test]
fn the_files_own_coordinates_are_used() {
    let mut room = dome(true, gradient);
    // Mirrored and turned, within a margin of the unit square.
    let uv = |x: f64, y: f64| (0.5 - 0.4 * y / HALF, 0.5 - 0.45 * x / HALF);
    give_texcoords(&mut room, uv);
    let result = run(&room, &quick()).unwrap();
    let texture = the_texture(&result);
    assert!(texture.unwrap.is_own);
    let (width, height) = (texture.unwrap.width as f64, texture.unwrap.height as f64);
    assert_gradient(texture, |x, y| {
        // The inverse of `uv`; row 0 is v = 1.
        let u = (x as f64 + 0.5) / width;
        let v = 1.0 - (y as f64 + 0.5) / height;
        let place = ((0.5 - v) * HALF / 0.45, (0.5 - u) * HALF / 0.4);
        (place.0.abs() < HALF && place.1.abs() < HALF).then_some(place)
    });
}

#[test]
fn repeating_coordinates_are_replaced() {
    let mut room = dome(true, gradient);
    give_texcoords(&mut room, |x, y| (2.0 * (x + HALF), 2.0 * (y + HALF)));
    let result = run(&room, &quick()).unwrap();
    let texture = the_texture(&result);
    assert!(!texture.unwrap.is_own);
    assert_gradient(texture, |x, y| place_of(&room, texture, x, y));
}

#[test]
fn overlapping_coordinates_are_replaced() {
    // The floor as two halves that share one half of the texture.
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.capture.materials[0].textured = true;
    let sky = room.luminaire("sky");
    for corner in [-HALF, 0.0] {
        let corner = DVec3::new(corner, -HALF, 0.0);
        room.rectangle(floor, corner, DVec3::X * HALF, DVec3::Y * 2.0 * HALF);
    }
    let (positions, faces) = icosphere(2);
    room.triangles(&positions, &faces, |_| sky);
    photograph(&mut room, gradient);
    give_texcoords(&mut room, |x, y| (x.abs() / HALF, 0.5 + 0.5 * y / HALF));
    let result = run(&room, &quick()).unwrap();
    let texture = the_texture(&result);
    assert!(!texture.unwrap.is_own, "one texel cannot stand for two places");
    assert_gradient(texture, |x, y| place_of(&room, texture, x, y));
}

#[test]
fn a_checker_comes_back_away_from_its_lines() {
    let (dark, bright) = ([0.1, 0.2, 0.05], [0.9, 0.6, 0.8]);
    let cell = 0.4;
    let is_dark =
        move |x: f64, y: f64| ((x / cell).floor() + (y / cell).floor()).rem_euclid(2.0) < 1.0;
    let room = dome(true, move |x, y| if is_dark(x, y) { dark } else { bright });
    let mut options = quick();
    // These pixels are no means over what they cover.
    options.textures.sharpen = 0;
    let result = run(&room, &options).unwrap();
    let texture = the_texture(&result);
    let mut checked = [0; 2];
    for y in 0..texture.unwrap.height {
        for x in 0..texture.unwrap.width {
            let Some((px, py)) = place_of(&room, texture, x, y) else { continue };
            let to_line = |p: f64| (p / cell - (p / cell).round()).abs() * cell;
            let near = to_line(px).min(to_line(py)) <= pixel_reach(px, py);
            if px.hypot(py) > SEEN_WITHIN || near {
                continue;
            }
            let dark_here = is_dark(px, py);
            checked[usize::from(dark_here)] += 1;
            let exact = if dark_here { dark } else { bright };
            let found = texture.texels[y * texture.unwrap.width + x];
            for (found, exact) in found.iter().zip(exact) {
                // Off the lines nothing is mixed.
                let bound = irradiance_error(px.hypot(py));
                assert!((f64::from(*found) - exact).abs() < bound, "{px}, {py}: {found}");
            }
        }
    }
    assert!(checked.iter().all(|&count| count > 100), "{checked:?}");
}

/// Pixels show the mean over what they cover; stripes little wider than that are told apart only
/// by taking this into account.
#[test]
fn stripes_of_two_pixels_are_sharper_than_by_the_nearest_pixel() {
    // Pixels below the eye are 6 mm wide.
    let stripes = |x: f64| 0.5 + 0.3 * (2.0 * PI * x / 0.026).sin();
    let mut room = dome(true, |x, _| [stripes(x); 3]);
    let tracer = Tracer::new(&room.capture.mesh);
    let below = room.capture.photographs.pop().unwrap().camera;
    let side = 5;
    let part = |pixel: usize, k: usize| {
        let corner = DVec2::new((pixel % below.width) as f64, (pixel / below.width) as f64);
        let within = DVec2::new((k % side) as f64, (k / side) as f64) + 0.5;
        let direction = sight(&below, corner + within / side as f64);
        let (distance, face) = tracer.nearest(below.position, direction).unwrap();
        let x = (below.position + distance * direction).x;
        if room.capture.mesh.surface[face] == 0 { stripes(x) } else { 1.0 }
    };
    let pixel = |pixel: usize| {
        let mean = (0..side * side).map(|k| part(pixel, k)).sum::<f64>() / (side * side) as f64;
        SKY.map(|sky| (mean * sky) as f32)
    };
    let pixels = (0..below.width * below.height).map(pixel).collect();
    room.photograph_of(below, pixels, None);
    let error = |rounds: usize| {
        let mut options = quick();
        options.textures.sharpen = rounds;
        options.textures.max_side = 1024;
        // Of the pixels of most of the floor, which lies further away.
        options.textures.texel_px = 0.35;
        let result = run(&room, &options).unwrap();
        let texture = the_texture(&result);
        let (mut sum, mut count) = (0.0, 0);
        for index in 0..texture.texels.len() {
            let width = texture.unwrap.width;
            let Some((x, y)) = place_of(&room, texture, index % width, index / width) else {
                continue;
            };
            if x.hypot(y) < 0.25 {
                sum += (f64::from(texture.texels[index][1]) - stripes(x)).powi(2);
                count += 1;
            }
        }
        assert!(count > 1000, "{count} texels");
        (sum / f64::from(count)).sqrt()
    };
    let (nearest, sharpened) = (error(0), error(4));
    assert!(nearest > 0.05, "{nearest}");
    assert!(sharpened < 0.5 * nearest, "{sharpened}, {nearest} by the nearest pixel");
}

/// Pixels below the eye are 6 mm wide: neither the floor's underside nor what a mat covers of it may
/// take over what they show, for it is dark there.
#[test]
fn what_lies_less_than_a_pixel_behind_is_not_shown() {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.capture.materials[0].textured = true;
    let mat = room.diffuse("mat");
    let sky = room.luminaire("sky");
    room.square(floor, HALF, 0.0);
    let below = DVec3::new(-HALF, HALF, -0.001);
    room.rectangle(floor, below, DVec3::X * 2.0 * HALF, DVec3::NEG_Y * 2.0 * HALF);
    room.square(mat, 0.2, 0.001);
    let (positions, faces) = icosphere(2);
    room.triangles(&positions, &faces, |_| sky);
    for camera in cube_cameras(EYE, 160) {
        room.photograph(camera, |struck| {
            let rho = [0.5, 0.1, 1.0][struck.surface];
            SKY.map(|sky| (rho * sky) as f32)
        });
    }
    let result = run(&room, &quick()).unwrap();
    let texture = the_texture(&result);
    let seen = texture.texels.iter().zip(&texture.seen).filter(|(_, seen)| **seen);
    let seen: Vec<f32> = seen.map(|(texel, _)| texel[1]).collect();
    assert!(seen.len() > 500, "{} texels", seen.len());
    let wrong: Vec<f32> = seen.iter().copied().filter(|texel| (texel - 0.5).abs() > 0.05).collect();
    assert!(wrong.is_empty(), "of {}: {wrong:?}", seen.len());
}

#[test]
fn only_textured_materials_get_a_texture() {
    let room = dome(false, gradient);
    assert!(run(&room, &quick()).unwrap().textures.is_empty());
    let room = dome(true, gradient);
    let mut options = quick();
    options.textures.enabled = false;
    assert!(run(&room, &options).unwrap().textures.is_empty());
}
