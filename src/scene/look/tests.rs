use glam::{DMat3, DVec2, DVec3};

use super::*;
use crate::math::sampling::Random;
use crate::scene::Distortion;

/// A floor of two large triangles below a dome of small ones, with a hole in it, and a sheet that
/// stands on the floor.
fn mesh() -> Mesh {
    let mut random = Random::new(3, 0, 0);
    let mut mesh = Mesh::default();
    let mut add = |corners: [Vec3; 3], surface: u32| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.surface.push(surface);
    };
    let corner = |x: f32, y: f32| Vec3::new(x, y, -1.0);
    add([corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0)], 0);
    add([corner(-9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)], 0);
    let dome = |ring: usize, place: usize| {
        let (down, around) = (0.02 + 0.05 * ring as f32, 0.1 * place as f32);
        6.0 * Vec3::new(down.sin() * around.cos(), down.sin() * around.sin(), down.cos())
    };
    for (ring, place) in (0..25).flat_map(|ring| (0..60).map(move |place| (ring, place))) {
        let [a, b] = [dome(ring, place), dome(ring, place + 1)];
        let [c, d] = [dome(ring + 1, place), dome(ring + 1, place + 1)];
        add([a, c, b], 1);
        add([b, c, d], 1);
    }
    for _ in 0..40 {
        let middle = Vec3::new(random.uniform() - 0.5, random.uniform() - 0.5, 0.0) * 6.0;
        let side = Vec3::new(random.uniform() - 0.5, random.uniform() - 0.5, 0.3);
        add([middle - Vec3::Z, middle + side - Vec3::Z, middle + Vec3::Z * random.uniform()], 2);
    }
    mesh
}

fn cameras() -> Vec<Camera> {
    let lens = Distortion { radial: [-0.1, 0.02, 0.0, 0.0], ..Distortion::default() };
    // Its corners lie beyond what the lens shows.
    let narrow = Distortion { radial: [-0.6, 0.0, 0.0, 0.0], ..Distortion::default() };
    let of = |(distortion, focal, turn): (Distortion, f64, f64)| {
        let turned = DMat3::from_rotation_z(1.7 * turn) * DMat3::from_rotation_x(0.9 + turn);
        Camera::new(
            (203, 139),
            DVec2::new(focal, 1.01 * focal),
            DVec2::new(100.0, 70.0),
            distortion,
            turned,
            DVec3::new(0.3, -0.2, 0.4 + 0.1 * turn),
        )
    };
    let none = Distortion::default();
    let all = [(none, 150.0, 0.0), (none, 60.0, 0.7), (none, 2000.0, 0.2)];
    all.into_iter().chain([(lens, 120.0, 0.1), (narrow, 70.0, 1.1)]).map(of).collect()
}

/// One ray at a time, and all nine hits around a pixel compared as they are described.
#[test]
fn squares_of_pixels_see_what_single_rays_meet() {
    let mesh = mesh();
    let normals: Vec<Vec3> = (0..mesh.triangles.len()).map(|index| mesh.normal(index)).collect();
    let caster = RayCaster::build(&mesh.positions, &mesh.triangles);
    let (mut one_by_one, mut clean, mut without_ray, mut empty) = (0, 0, 0, 0);
    for camera in cameras() {
        let Camera { width, height, .. } = camera;
        let look = Look { caster: &caster, camera: &camera, mesh: &mesh, normals: &normals };
        let [packed, whole] = [true, false].map(|is| look.hits(is, &Watch::new()).unwrap());
        let place = |index: usize| (index % width, index / width);
        let expected: Vec<Option<(Vec3, u32)>> = (0..width * height)
            .map(|index| {
                let ray = ray(&camera, place(index).0, place(index).1);
                without_ray += usize::from(ray.is_none());
                let ray = ray?;
                let hit = caster.closest(&ray)?;
                Some((ray.origin + ray.direction * hit.t, hit.triangle))
            })
            .collect();
        for (index, hit) in expected.iter().enumerate() {
            for hits in [&packed, &whole] {
                let position = hits.position(&camera, &mesh, index).to_array().map(f32::to_bits);
                let is_off = expected_clean(&look, &expected, place(index));
                assert_eq!(hits.seen(index).triangle(), hit.map(|own| own.1), "{:?}", place(index));
                let expected = hit.map_or(Vec3::ZERO, |own| own.0).to_array().map(f32::to_bits);
                assert_eq!(position, expected, "{:?}", place(index));
                assert_eq!(hits.seen(index).is_clean(), is_off, "{:?}", place(index));
                clean += usize::from(is_off);
            }
            one_by_one += 1;
            empty += usize::from(hit.is_none());
        }
    }
    assert!(one_by_one > 100_000 && clean > 50_000, "{clean} of {one_by_one}");
    assert!(without_ray > 100 && empty > 2000, "{without_ray} {empty}");
}

fn expected_clean(look: &Look, hits: &[Option<(Vec3, u32)>], (x, y): (usize, usize)) -> bool {
    let Camera { width, height, .. } = *look.camera;
    if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
        return false;
    }
    let Some((position, triangle)) = hits[y * width + x] else { return false };
    let sight = position - look.camera.position.as_vec3();
    let footprint = sight.length() / look.camera.focal_px.min_element() as f32;
    let direction = sight.normalize_or_zero();
    let facing = |triangle: u32| {
        let normal = look.normals[triangle as usize];
        if normal.dot(direction) > 0.0 { -normal } else { normal }
    };
    let normal = facing(triangle);
    let steepness = normal.dot(direction).abs().max(0.02);
    let around = (y - 1..=y + 1).flat_map(|v| (x - 1..=x + 1).map(move |u| v * width + u));
    let surface = |triangle: u32| look.mesh.surface[triangle as usize];
    around.into_iter().all(|index| {
        hits[index].is_some_and(|(other, neighbour)| {
            let off_plane = normal.dot(other - position).abs() / steepness;
            let is_smooth = facing(neighbour).dot(normal) > SMOOTH_COSINE && off_plane <= footprint;
            neighbour == triangle || surface(neighbour) == surface(triangle) && is_smooth
        })
    })
}
