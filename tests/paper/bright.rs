//! The light of small bright patches: rays that are aimed at them and rays over the hemisphere add up
//! to what there is.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};
use lobelia::math::sampling::Random;
use lobelia::reconstruct::bright::BrightCells;
use lobelia::reconstruct::hemisphere::hemisphere;
use lobelia::scene::{SurfacePoint, Views};
use lobelia::watch::Watch;

use crate::rooms::{Room, camera, cube_cameras, icosphere};

/// On a sphere every part of it sends the same irradiance everywhere: π times the mean radiance.
#[test]
fn in_a_sphere_the_irradiance_of_a_small_bright_patch_is_the_same_everywhere() {
    const BRIGHT: f32 = 60.0;
    const PATCH_FROM: f32 = 0.97;
    let mut room = Room::default();
    let wall = room.diffuse("wall");
    let (positions, mut faces) = icosphere(3);
    faces.iter_mut().for_each(|face| face.swap(1, 2));
    room.triangles(&positions, &faces, |_| wall);
    for camera in cube_cameras(DVec3::new(0.03, -0.02, 0.05), 128) {
        room.photograph(camera, |struck| {
            let is_bright = struck.position.normalize().z as f32 > PATCH_FROM;
            [if is_bright { BRIGHT } else { 1.0 }; 3]
        });
    }
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let bright = BrightCells::new(&views);
    // A cap's share of a sphere's area is half its height.
    let share = 0.5 * (1.0 - f64::from(PATCH_FROM));
    let expected = PI * (1.0 - share + share * f64::from(BRIGHT));
    let mesh = &room.capture.mesh;
    let deviations = |cells: &BrightCells| {
        let mut found = Vec::new();
        for triangle in (0..mesh.triangles.len()).step_by(7) {
            let position = mesh.corners(triangle).iter().sum::<Vec3>() / 3.0;
            if position.z > 0.9 {
                continue;
            }
            let point = SurfacePoint { position, normal: mesh.normal(triangle) };
            let mut random = Random::new(5, 6, triangle as u64);
            let gathered = hemisphere(&views, cells, point, 12, &mut random);
            found.push(f64::from(gathered.irradiance[1]) / expected - 1.0);
        }
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        (mean, (found.iter().map(|x| x * x).sum::<f64>() / found.len() as f64).sqrt())
    };
    let (_, plain) = deviations(&BrightCells::default());
    let (mean, aimed) = deviations(&bright);
    println!("144 rays alone {plain:.3}, with 36 aimed ones {aimed:.3}, in the mean {mean:+.4}");
    // 1 % in area are the facets, as much the pixels along the patch's edge.
    assert!(mean.abs() < 0.02, "{mean}");
    assert!(aimed < 0.25 * plain, "{aimed} against {plain}");
}

/// Rays are aimed by the density that is told of the place.
#[test]
fn the_density_of_a_place_is_that_by_which_it_is_aimed_at() {
    let mut room = Room::default();
    let (floor, board) = (room.diffuse("floor"), room.diffuse("board"));
    room.square(floor, 2.0, 0.0);
    // Seen from above alone: its back has no density.
    room.rectangle(board, DVec3::new(-0.5, -0.5, 0.8), DVec3::X, 0.6 * DVec3::Y);
    for eye in [DVec3::new(1.5, -1.7, 2.5), DVec3::new(-1.2, 1.5, 2.8)] {
        let camera = camera((160, 120), 0.9, eye, DVec3::ZERO);
        room.photograph(camera, |struck| [0.1 + struck.position.x.max(0.0).powi(6) as f32; 3]);
    }
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let bright = BrightCells::new(&views);
    assert!(!bright.is_empty());
    let mesh = &room.capture.mesh;
    let mut random = Random::new(1, 2, 3);
    for _ in 0..2000 {
        let aim = bright.aim(&views, random.uniform(), random.point());
        let found = (0..mesh.triangles.len()).find_map(|triangle| {
            let [a, b, c] = mesh.corners(triangle);
            let (along, across, to) = (b - a, c - a, aim.point.position - a);
            let normal = along.cross(across);
            let u = to.cross(across).dot(normal) / normal.length_squared();
            let v = along.cross(to).dot(normal) / normal.length_squared();
            let on_plane = to.dot(normal).abs() < 1e-5 * normal.length();
            (on_plane && u.min(v) >= 0.0 && u + v <= 1.0).then_some((triangle, Vec2::new(u, v)))
        });
        let Some((triangle, at)) = found else { continue };
        let density = bright.density(&views, triangle as u32, aim.point, at);
        // Beside the edge of a cell rounding may tell the next one.
        assert!(density > 0.3 * aim.density && density < 3.0 * aim.density, "{density}");
        let back = SurfacePoint { normal: -aim.point.normal, ..aim.point };
        assert_eq!(bright.density(&views, triangle as u32, back, at), 0.0);
    }
    // It adds up to 1.
    let mut sum = 0.0;
    const PLACES: usize = 40_000;
    for triangle in 0..mesh.triangles.len() {
        let point = SurfacePoint { position: Vec3::ZERO, normal: mesh.normal(triangle) };
        let part = mesh.area(triangle) / PLACES as f32;
        for _ in 0..PLACES {
            let at = random.point();
            let at = if at.element_sum() > 1.0 { Vec2::ONE - at } else { at };
            sum += part * bright.density(&views, triangle as u32, point, at);
        }
    }
    assert!((sum - 1.0).abs() < 0.03, "{sum}");
}

/// Where all is alike there is nothing to aim at.
#[test]
fn an_even_room_has_no_bright_cells() {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.square(floor, 2.0, 0.0);
    room.photograph(camera((64, 48), 0.9, DVec3::new(1.0, 0.0, 2.0), DVec3::ZERO), |_| [0.4; 3]);
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    assert!(BrightCells::new(&views).is_empty());
}
