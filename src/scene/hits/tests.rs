use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use super::*;
use crate::geometry::bvh::RayCaster;
use crate::math::sampling::Random;
use crate::scene::{Capture, Distortion, Image, Photograph, Role, Surface, SurfacePoint, Views};
use crate::watch::Watch;

/// A hilly ground below scattered triangles, seen by two cameras, one of them with a lens.
fn capture() -> Capture {
    let mut random = Random::new(5, 0, 0);
    let mut uniform = |low: f32, high: f32| low + (high - low) * random.uniform();
    let mut mesh = Mesh::default();
    const SIDE: u32 = 12;
    for index in 0..SIDE * SIDE {
        let (x, y) = ((index % SIDE) as f32, (index / SIDE) as f32);
        mesh.positions.push(Vec3::new(x - 6.0, y - 6.0, uniform(-4.0, -3.9)));
        if index % SIDE + 1 < SIDE && index / SIDE + 1 < SIDE {
            mesh.triangles.push([index, index + 1, index + SIDE]);
            mesh.triangles.push([index + 1, index + SIDE + 1, index + SIDE]);
        }
    }
    for _ in 0..60 {
        let first = mesh.positions.len() as u32;
        let middle = Vec3::new(uniform(-3.0, 3.0), uniform(-3.0, 3.0), uniform(-3.5, -2.0));
        for _ in 0..3 {
            let side = Vec3::new(uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-0.5, 0.5));
            mesh.positions.push(middle + side);
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh.surface = vec![0; mesh.triangles.len()];
    mesh.polygon = (0..mesh.triangles.len() as u32).collect();
    let lens = Distortion { radial: [-0.1, 0.02, 0.0, 0.0], ..Distortion::default() };
    let photographs = [(Distortion::default(), 0.0), (lens, 0.4)].map(|(distortion, turn)| {
        let (width, height) = (131, 97);
        let camera = Camera::new(
            (width, height),
            DVec2::new(120.0, 121.0),
            DVec2::new(64.0, 50.0),
            distortion,
            DMat3::from_rotation_y(turn) * DMat3::from_rotation_z(0.3),
            DVec3::new(4.0 * turn, 0.1, 0.2),
        );
        let image = Image::new(width, height, vec![[1.0; 3]; width * height], None);
        Photograph { name: String::new(), camera, image: Some(Arc::new(image)), display: None }
    });
    let surface = Surface { name: String::new(), role: Role::Untagged, has_texcoords: false };
    Capture {
        mesh: Arc::new(mesh),
        surfaces: vec![surface],
        photographs: photographs.into(),
        ..Capture::default()
    }
}

#[test]
fn packed_hits_are_the_same_to_the_bit() {
    let capture = capture();
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let whole = Views::new(&capture, &caster, &Watch::new()).unwrap();
    let packed = Views::holding(&capture, &caster, 0, &Watch::new()).unwrap();
    let (mut shown, mut clean, mut seen_count) = (0, 0, 0);
    for (a, b) in whole.buffers.iter().zip(&packed.buffers) {
        let hit = |own: Option<(Vec3, u32)>| {
            own.map(|(position, triangle)| (position.to_array().map(f32::to_bits), triangle))
        };
        for (x, y) in (0..a.camera.height).flat_map(|y| (0..a.camera.width).map(move |x| (x, y))) {
            assert_eq!(hit(a.hit(x, y)), hit(b.hit(x, y)), "pixel {x}, {y}");
            assert_eq!(a.triangle(x, y), b.hit(x, y).map(|(_, triangle)| triangle));
            assert_eq!(a.is_off_edges(x, y), b.is_off_edges(x, y));
            clean += usize::from(a.is_off_edges(x, y));
            let Some((position, triangle)) = a.hit(x, y) else { continue };
            shown += 1;
            let normal = whole.normals[triangle as usize];
            let point = SurfacePoint { position, normal };
            for (a, b) in whole.buffers.iter().zip(&packed.buffers) {
                let [a, b] = [whole.seen(a, point), packed.seen(b, point)];
                assert_eq!(a.map(|own| (own.x, own.y)), b.map(|own| (own.x, own.y)));
                seen_count += usize::from(a.is_some());
            }
        }
    }
    assert!(shown > 10_000 && clean > 5_000 && seen_count > 10_000, "{shown} {clean} {seen_count}");
    assert!(packed.shows_anything());
}

#[test]
fn runs_give_back_what_they_were_made_of() {
    let mut random = Random::new(9, 0, 0);
    // Long runs, and changes at every pixel, over several groups of 64 and a rest.
    let mut pixels = Vec::new();
    while pixels.len() < 1000 {
        let seen = SeenTriangle(random.below(5) as u32);
        let length = if random.below(2) == 0 { 1 } else { random.below(150) };
        pixels.extend(std::iter::repeat_n(seen, length));
    }
    let runs = Runs::of(&pixels);
    assert!(runs.values.len() < pixels.len() / 4);
    let parts = pixels.chunks(3 * CHUNK).map(Runs::of).collect();
    let whole = pixels.iter().map(|&seen| PixelHit { position: Vec3::ZERO, seen }).collect();
    for hits in [runs, Runs::joined(parts)].map(|runs| Hits::Packed(Arc::new(runs))) {
        assert_eq!(hits.len(), pixels.len());
        for (index, &seen) in pixels.iter().enumerate() {
            assert!(hits.seen(index) == seen, "pixel {index}");
        }
        // From anywhere to anywhere, runs are of equal pixels and leave none out.
        for hits in [hits, Hits::Whole(Arc::clone(&whole))] {
            let mut next = 7;
            while next < 777 {
                let (seen, end) = hits.run(next, 777);
                assert!(end > next && end <= 777);
                assert!(pixels[next..end].iter().all(|own| *own == seen), "run {next} to {end}");
                next = end;
            }
        }
    }
}
