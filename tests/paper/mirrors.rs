//! Mirrors and glass that photographs show to be such, and the light that they pass on.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use lobelia::geometry::bvh::Ray;
use lobelia::math::sampling::Random;
use lobelia::reconstruct::bright::BrightCells;
use lobelia::reconstruct::hemisphere::hemisphere;
use lobelia::reconstruct::optics::find;
use lobelia::scene::{MaterialKind, MirrorsAndGlass, Optics, SurfacePoint, Views};
use lobelia::watch::Watch;

use crate::rooms::{Room, Struck, Tracer, camera};

const REFLECTED: f64 = 0.8;
const CEILING: f64 = 2.0;

/// Floor, ceiling, mirror, pane of glass and a plain board, the last three tagged as specular.
struct Parts {
    room: Room,
    floor: usize,
    mirror: usize,
    glass: usize,
    board: usize,
}

fn parts() -> Parts {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    let ceiling = room.diffuse("ceiling");
    let mirror = room.material("mirror", MaterialKind::Specular);
    let glass = room.material("glass", MaterialKind::Specular);
    let board = room.material("board", MaterialKind::Specular);
    room.square(floor, 2.0, 0.0);
    let corner = DVec3::new(-2.0, -2.0, CEILING);
    room.rectangle(ceiling, corner, 4.0 * DVec3::Y, 4.0 * DVec3::X);
    // The mirror stands at y = 1.5 and faces −y; the pane and the board lie at z = 0.4.
    let along = DVec3::new(2.0, 0.0, 0.0);
    room.rectangle(mirror, DVec3::new(-1.0, 1.5, 0.3), along, 1.2 * DVec3::Z);
    room.rectangle(glass, DVec3::new(-1.1, -0.9, 0.4), DVec3::X, DVec3::Y);
    room.rectangle(board, DVec3::new(0.1, -0.9, 0.4), DVec3::X, DVec3::Y);
    Parts { room, floor, mirror, glass, board }
}

/// What an opaque surface sends at a place: a pattern, so that no two places are alike.
fn pattern(p: DVec3) -> f64 {
    0.6 + 0.25 * (TAU * 0.9 * p.x).sin() + 0.2 * (TAU * 0.7 * (p.y + 0.3 * p.z)).cos()
}

/// The distance of the first surface along a ray, and which it is.
fn nearest(parts: &Parts, tracer: &Tracer, at: DVec3, direction: DVec3) -> Option<(f64, usize)> {
    let (distance, triangle) = tracer.nearest(at, direction)?;
    Some((distance, parts.room.capture.mesh.surface[triangle] as usize))
}

/// Radiance along a ray, by following it over mirror and glass.
fn radiance(parts: &Parts, tracer: &Tracer, origin: DVec3, direction: DVec3, most: usize) -> f64 {
    let Some((distance, surface)) = nearest(parts, tracer, origin, direction) else { return 0.0 };
    let p = origin + distance * direction;
    if most == 0 || (surface != parts.mirror && surface != parts.glass) {
        return pattern(p);
    }
    let normal = if surface == parts.mirror { DVec3::NEG_Y } else { DVec3::Z };
    let mirrored = direction - 2.0 * direction.dot(normal) * normal;
    let after =
        |direction: DVec3| radiance(parts, tracer, p + 1e-6 * direction, direction, most - 1);
    if surface == parts.mirror {
        return REFLECTED * after(mirrored);
    }
    // Fresnel's equations at one interface of index 1.5.
    let cosine = direction.dot(normal).abs();
    let within = (1.0 - (1.0 - cosine * cosine) / 2.25).sqrt();
    let across = (cosine - 1.5 * within) / (cosine + 1.5 * within);
    let along = (1.5 * cosine - within) / (1.5 * cosine + within);
    let part = 0.5 * (across * across + along * along);
    part * after(mirrored) + (1.0 - part) * after(direction)
}

fn photographed() -> Parts {
    let mut parts = parts();
    let tracer = Tracer::new(&parts.room.capture.mesh);
    for eye in [
        DVec3::new(1.7, -1.8, 1.5),
        DVec3::new(-1.7, -1.7, 1.2),
        DVec3::new(0.2, -1.9, 1.7),
        DVec3::new(-0.5, 0.4, 1.8),
        DVec3::new(0.6, 1.2, 0.7),
        DVec3::new(0.0, -1.5, 0.2),
    ] {
        for target in [DVec3::new(0.0, 0.0, 0.2), DVec3::new(0.0, 0.3, CEILING)] {
            let camera = camera((160, 120), 0.7, eye, target);
            let value = |struck: Struck| {
                let direction = (struck.position - eye).normalize();
                [radiance(&parts, &tracer, eye, direction, 4) as f32; 3]
            };
            let mut room = parts.room.clone();
            room.photograph(camera, value);
            parts.room = room;
        }
    }
    parts
}

#[test]
fn photographs_tell_a_mirror_and_glass_from_a_board() {
    let parts = photographed();
    let caster = parts.room.caster();
    let views = Views::new(&parts.room.capture, &caster, &Watch::new()).unwrap();
    let found = find(&views, &Watch::new()).unwrap();
    let Optics::Mirror(reflected) = found[2] else { panic!("{found:?}") };
    for part in reflected {
        assert!((f64::from(part) - REFLECTED).abs() < 0.03, "{part} for {REFLECTED}");
    }
    assert_eq!(found[3], Optics::Glass);
    assert_eq!([found[0], found[1], found[4]], [Optics::Opaque; 3]);
    assert_eq!(parts.board, 4);

    // What is tagged as diffuse is left alone.
    let mut matt = parts.room.clone();
    matt.capture.materials.iter_mut().for_each(|m| m.kind = MaterialKind::Diffuse);
    let views = Views::new(&matt.capture, &caster, &Watch::new()).unwrap();
    assert_eq!(find(&views, &Watch::new()).unwrap(), vec![Optics::Opaque; 5]);
}

/// Without the pane in the mesh the same rays meet the same places.
#[test]
fn light_passes_glass_and_comes_by_way_of_mirrors() {
    let parts = photographed();
    let capture = &parts.room.capture;
    let caster = parts.room.caster();
    let mut optics = vec![Optics::Opaque; 5];
    optics[3] = Optics::Glass;
    let through = MirrorsAndGlass::new(capture, optics.clone());
    let views = Views::new(capture, &caster, &Watch::new()).unwrap().through(&through);
    let below = SurfacePoint { position: Vec3::new(-0.6, -0.4, 0.0), normal: Vec3::Z };
    let plain = BrightCells::default();
    let gathered = hemisphere(&views, &plain, below, 20, &mut Random::new(1, 2, 3));
    let tracer = Tracer::new(&capture.mesh);
    let (mut sum, mut count) = (0.0, 0);
    for record in &gathered.records {
        let direction = record.direction.as_dvec3();
        let mut at = below.position.as_dvec3() + 1e-4 * direction;
        let (mut distance, mut surface) = nearest(&parts, &tracer, at, direction).unwrap();
        if surface == parts.glass {
            at += (distance + 1e-6) * direction;
            (distance, surface) = nearest(&parts, &tracer, at, direction).unwrap();
            count += 1;
        }
        assert_ne!(surface, parts.glass);
        assert_ne!(surface, parts.floor);
        if surface != parts.mirror {
            let expected = pattern(at + distance * direction) * PI / 400.0;
            sum += (f64::from(record.irradiance[0]) / expected - 1.0).abs();
        }
    }
    assert!(count > 100, "{count} rays passed the pane");
    assert!(sum / (gathered.records.len() as f64) < 0.05, "{sum}");

    optics[2] = Optics::Mirror([0.5, 0.6, 0.7]);
    let mirrors = MirrorsAndGlass::new(capture, optics);
    let views = Views::new(capture, &caster, &Watch::new()).unwrap().through(&mirrors);
    let origin = Vec3::new(0.2, 0.5, 0.6);
    let direction = Vec3::new(0.1, 1.0, 0.6).normalize_or_zero();
    let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
    let (last, hit, part) = views.met(ray).unwrap();
    assert_eq!(part, [0.5, 0.6, 0.7]);
    let place = last.origin + hit.t * last.direction;
    // As if the ray went straight on to the ceiling's mirror image behind y = 1.5.
    let along = (CEILING as f32 - origin.z) / direction.z;
    let image = origin + along * direction;
    let reached = Vec3::new(image.x, 3.0 - image.y, CEILING as f32);
    assert!(reached.y.abs() < 1.0 && place.distance(reached) < 1e-3, "{place} for {reached}");
}

/// Pixels of a mirror are no samples, nor are those of glass.
#[test]
fn mirrors_and_glass_have_no_samples_and_no_reflectance() {
    let parts = photographed();
    let result = crate::rooms::run(&parts.room, &crate::rooms::quick()).unwrap();
    assert!(result.samples.samples.iter().all(|sample| ![2, 3].contains(&sample.material)));
    assert!(result.samples.samples.iter().any(|sample| sample.material == 4));
    let solution = &result.solution;
    assert!(matches!(solution.optics[..], [_, _, Optics::Mirror(_), Optics::Glass, _]));
    assert_eq!([solution.reflectances[2], solution.reflectances[3]], [None, None]);
    assert!(
        solution.notes.iter().any(|note| note.contains("\"glass\" is taken to be clear glass"))
    );
    assert!(!result.warnings.iter().any(|warning| warning.contains("\"mirror\"")));
}
