//! Where virtual lights are placed (Section 4.2, Fig. 5).

use glam::DVec3;
use lobelia::reconstruct::Reconstruction;
use lobelia::reconstruct::lights::LightKind;

use crate::rooms::{Room, Tracer, box_room, camera, quick, run};

fn mutual_distance(result: &Reconstruction) -> f32 {
    let lights = &result.lights.lights;
    let mut smallest = f32::INFINITY;
    for (i, a) in lights.iter().enumerate() {
        for b in &lights[..i] {
            smallest = smallest.min(a.position.distance(b.position));
        }
    }
    smallest
}

#[test]
fn lights_lie_on_the_sphere_where_rays_escape() {
    let room = box_room();
    let mut options = quick();
    options.lights.count = 60;
    let result = run(&room, &options).unwrap();
    let lights = &result.lights;
    assert!(lights.lights.len() > 10);
    // The bounding box is 2 × 2 × 0.5 m; half its diagonal is 1.436 m.
    let half_diagonal = 0.5 * (4.0f32 + 4.0 + 0.25).sqrt();
    assert!((lights.sphere_radius_m / (1.2 * half_diagonal) - 1.0).abs() < 1e-6);
    let tracer = Tracer::new(&room.capture.mesh);
    for light in &lights.lights {
        if light.kind == LightKind::Surface {
            continue;
        }
        let outward = light.position - lights.sphere_center;
        // A ray's end in single precision, of a length of a few metres: a few 2⁻²⁴ of it.
        assert!((outward.length() / lights.sphere_radius_m - 1.0).abs() < 3e-6);
        let inward = -outward.normalize_or_zero();
        assert!((light.normal - inward).length() < 1e-5);
        assert!((light.radius_m / (0.5 * lights.spacing_m) - 1.0).abs() < 1e-6);
        // Some sample sees it past the known surfaces.
        let reached = result.samples.samples.iter().any(|sample| {
            let (from, to) = (sample.position.as_dvec3(), light.position.as_dvec3());
            (to - from).dot(sample.normal.as_dvec3()) > 0.0 && tracer.is_free(from, to, 1e-4)
        });
        assert!(reached, "no sample sees the light at {}", light.position);
    }
    assert!(mutual_distance(&result) >= lights.spacing_m);
}

#[test]
fn the_spacing_factor_and_the_radius_are_obeyed() {
    let room = box_room();
    let mut options = quick();
    options.samples.spacing_m = Some(0.1);
    options.lights.spacing_factor = Some(6.0);
    options.lights.radius_factor = 2.0;
    options.lights.disc_radius_factor = 1.0;
    let result = run(&room, &options).unwrap();
    assert!((result.lights.spacing_m - 0.6).abs() < 1e-6);
    let half_diagonal = 0.5 * (8.25f32).sqrt();
    assert!((result.lights.sphere_radius_m / (2.0 * half_diagonal) - 1.0).abs() < 1e-6);
    assert!(mutual_distance(&result) >= result.lights.spacing_m);
    for light in &result.lights.lights {
        // The paper's disc: the spacing is its radius.
        assert!((light.area_m2() - std::f32::consts::PI * 0.36).abs() < 1e-5);
    }
}

/// A floor, a photographed wall to the north (y = 1) and a wall to the south (y = −1) that the
/// camera, in front of it, turns its back to.
fn two_walls() -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    let north = room.diffuse("north");
    let south = room.diffuse("south");
    room.square(floor, 1.0, 0.0);
    let (width, height) = (DVec3::X * 2.0, DVec3::Z * 1.2);
    room.rectangle(north, DVec3::new(-1.0, 1.0, 0.0), width, height);
    // Wound to face south, away from the room: the side that faces the samples must be found.
    room.rectangle(south, DVec3::new(-1.0, -1.0, 0.0), width, height);
    let eye = DVec3::new(0.0, -0.9, 0.9);
    room.photograph(camera((120, 90), 0.45, eye, DVec3::new(0.0, 1.0, 0.3)), |struck| {
        [[0.4f32, 0.5, 0.6], [0.6, 0.5, 0.4], [0.0; 3]][struck.surface]
    });
    room
}

#[test]
fn an_unseen_known_wall_carries_diffuse_lights_and_a_seen_one_none() {
    let room = two_walls();
    let mut options = quick();
    options.lights.count = 60;
    let result = run(&room, &options).unwrap();
    let mut on_south = 0;
    for (index, light) in result.lights.lights.iter().enumerate() {
        let p = light.position;
        match light.kind {
            LightKind::Sphere => {
                let radius = p.distance(result.lights.sphere_center);
                assert!((radius / result.lights.sphere_radius_m - 1.0).abs() < 3e-6);
            }
            LightKind::Surface => {
                let lobes = result.lobes.of(index);
                assert_eq!(lobes.len(), 1);
                let lobe = result.lobes.lobes[lobes.start];
                assert_eq!(lobe.exponent, 1.0);
                assert!((lobe.direction - light.normal).length() < 1e-6);
                // The room's surfaces beside the image's border are unseen as well.
                if (p.y + 1.0).abs() < 1e-4 {
                    on_south += 1;
                    assert!((light.normal.y - 1.0).abs() < 1e-6, "it looks {}", light.normal);
                } else {
                    let seen =
                        crate::rooms::image_of(&room.capture.photographs[0].camera, p.as_dvec3());
                    let inside = seen.is_some_and(|pixel| {
                        (1.0..119.0).contains(&pixel.x) && (1.0..89.0).contains(&pixel.y)
                    });
                    assert!(!inside, "a light on a photographed surface, at {p}");
                }
            }
            kind => panic!("the paper has no {kind:?}"),
        }
    }
    assert!(on_south >= 3, "{on_south} lights on the unseen wall");
    assert!(mutual_distance(&result) >= result.lights.spacing_m);
    // The unseen wall's material has no sample, and the artist is told.
    assert!(result.solution.reflectances[2].is_none());
    assert!(result.warnings.iter().any(|warning| warning.contains("\"south\"")));
}

#[test]
fn photographed_surfaces_keep_lights_out() {
    // A lid over the floor, photographed from between them: no light above it can matter, for
    // none of its undersides' samples nor the floor's looks up past it except sideways.
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    let lid = room.diffuse("lid");
    room.square(floor, 1.0, 0.0);
    room.rectangle(lid, DVec3::new(-1.0, -1.0, 0.8), DVec3::Y * 2.0, DVec3::X * 2.0);
    for (x, y) in [(-1.6, -0.2), (1.6, 0.1), (0.1, 1.6), (-0.1, -1.6)] {
        let eye = DVec3::new(x, y, 0.4);
        room.photograph(camera((160, 120), 0.4, eye, DVec3::new(0.0, 0.0, 0.4)), |struck| {
            [[0.4f32, 0.5, 0.6], [0.6, 0.5, 0.4]][struck.surface]
        });
    }
    let mut options = quick();
    options.lights.count = 60;
    options.samples.reject_edges = false;
    let result = run(&room, &options).unwrap();
    assert!(result.lights.lights.len() > 5);
    let sphere = result.lights.sphere_radius_m;
    for light in &result.lights.lights {
        assert_eq!(light.kind, LightKind::Sphere, "at {}", light.position);
        // From anywhere on the floor or the lid a ray that gets out through the gap, 0.8 m high
        // and at least 0 m away, may end at any height; but straight above or below the middle,
        // within 0.3 m, it would have to pass the lid or the floor.
        let aside = light.position.truncate().length();
        assert!(aside > 0.3, "{} of a sphere of {sphere}", light.position);
    }
}
