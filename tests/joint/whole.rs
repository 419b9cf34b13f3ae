//! Whole reconstructions of scenes that are no easy ones: closed, tiny, black, without freedom.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};

use glam::DVec3;
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::options::{Method, Options};
use lobelia::reconstruct::{Error, Reconstruction, Stage, Update};
use lobelia::scene::MaterialKind;
use lobelia::watch::Watch;

use crate::rooms::{Room, box_room, camera, cube_cameras, icosphere, quick, run};

/// Coarse settings with two sets of lights, so that there are intervals.
pub fn options() -> Options {
    let mut options = quick();
    options.general.method = Method::Joint;
    options.joint.light_sets = 2;
    options
}

fn solved(room: &Room) -> Reconstruction {
    let result = run(room, &options()).unwrap();
    let solution = &result.solution;
    let finite = |values: &[Rgb]| values.iter().flatten().all(|value| value.is_finite());
    assert!(solution.is_usable());
    assert!(finite(&solution.emission) && finite(&solution.computed));
    assert!(solution.emission.iter().flatten().all(|&emission| emission >= 0.0));
    assert_eq!(solution.emission.len(), result.lobes.lobes.len());
    for iteration in &solution.iterations {
        assert!(finite(&[iteration.rms.absolute, iteration.rms.relative]), "{iteration:?}");
        assert!(iteration.objective.is_some_and(|value| finite(&[value])), "{iteration:?}");
    }
    let certainty = solution.certainty.as_ref().unwrap();
    let scale = &certainty.scale;
    assert!(finite(&[scale.singular_value, scale.log_rms, scale.log_sd]), "{scale:?}");
    assert!(certainty.held_out.is_none_or(|held_out| finite(&[held_out])));
    for (reflectance, certainty) in solution.reflectances.iter().zip(&certainty.materials) {
        assert_eq!(reflectance.is_some(), certainty.is_some());
        let (Some(reflectance), Some(certainty)) = (reflectance, certainty) else { continue };
        let diffuse = reflectance.diffuse;
        assert!(diffuse.iter().all(|value| (0.0..=1.0).contains(value)), "{reflectance:?}");
        for [low, high] in certainty.diffuse.iter().chain(&certainty.specular).flatten() {
            assert!(0.0 <= *low && low <= high && *high <= 1.0, "{certainty:?}");
        }
    }
    result
}

/// The boxes and the floor of `box_room`, in colours of one's own.
fn painted(colours: [[f32; 3]; 2]) -> Room {
    let mut room = box_room();
    let cameras: Vec<_> = room.capture.photographs.drain(..).map(|p| p.camera).collect();
    for camera in cameras {
        room.photograph(camera, |struck| {
            let lit = 1.0 + 0.3 * (2.0 * struck.position.x).sin() + 0.2 * struck.position.y;
            colours[struck.surface].map(|value| value * lit as f32)
        });
    }
    room
}

/// A sphere of a luminous cap of radiance 1 and two walls that are in equilibrium with it: every
/// point of a sphere sees every area alike, so E/π = f_cap + Σ f_i ρ_i E/π. From each of `places`
/// six photographs see all of it.
pub fn furnace(rho: [Rgb; 2], places: &[DVec3]) -> Room {
    spotted_furnace([rho[0], rho[1], rho[1]], places, -1.0)
}

/// The same with a third material in the lower wall, a spot up to a height.
fn spotted_furnace(rho: [Rgb; 3], places: &[DVec3], height: f64) -> Room {
    let mut room = Room::default();
    let (upper, lower) = (room.diffuse("upper"), room.diffuse("lower"));
    let spot = if height > -1.0 { room.diffuse("spot") } else { lower };
    let cap = room.luminaire("cap");
    let (positions, mut faces) = icosphere(3);
    faces.iter_mut().for_each(|face| face.swap(1, 2));
    room.triangles(&positions, &faces, |[a, b, c]| match (a + b + c).z / 3.0 {
        z if z > 0.6 => cap,
        z if z > -0.1 => upper,
        z if z > height => lower,
        _ => spot,
    });
    let mesh = &room.capture.mesh;
    let mut areas = vec![0.0; cap + 1];
    for (triangle, &surface) in mesh.surface.iter().enumerate() {
        let [a, b, c] = mesh.corners(triangle).map(|p| p.as_dvec3());
        areas[surface as usize] += 0.5 * (b - a).cross(c - a).length();
    }
    let whole: f64 = areas.iter().sum();
    let colour = |surface: usize| -> [f32; 3] {
        std::array::from_fn(|c| {
            let returned = |surface: usize| rho[surface][c] * areas[surface] / whole;
            let returned: f64 = (0..cap).map(returned).sum();
            (rho[surface][c] * areas[cap] / whole / (1.0 - returned)) as f32
        })
    };
    let mut colours: Vec<[f32; 3]> = (0..cap).map(colour).collect();
    colours.push([1.0; 3]);
    for camera in places.iter().flat_map(|&place| cube_cameras(place, 96)) {
        room.photograph(camera, |struck| colours[struck.surface]);
    }
    room
}

#[test]
fn a_closed_room_whose_luminaire_is_seen_needs_no_lobes() {
    let rho = [[0.8, 0.5, 0.1], [0.3, 0.6, 0.7]];
    let room = furnace(rho, &[DVec3::new(0.03, -0.02, 0.05)]);
    let mut options = options();
    options.transport.rays = 1024;
    let result = run(&room, &options).unwrap();
    for (reflectance, rho) in result.solution.reflectances.iter().zip(rho) {
        for (found, rho) in reflectance.unwrap().diffuse.into_iter().zip(rho) {
            assert!((found / rho - 1.0).abs() < 0.03, "{found} for {rho}");
        }
    }
    assert!(result.lobes.lobes.is_empty(), "{:?}", result.lights.lights);
    let named = |warning: &String| warning.contains("no virtual light");
    assert!(result.warnings.iter().any(named), "{:?}", result.warnings);
}

#[test]
fn a_material_between_the_samples_has_a_reflectance() {
    let rho = [[0.8, 0.5, 0.1], [0.3, 0.6, 0.7], [0.1, 0.9, 0.4]];
    let mut room = spotted_furnace(rho, &[DVec3::new(0.03, -0.02, 0.05)], -0.97);
    let mut options = options();
    options.transport.rays = 1024;
    options.samples.spacing_m = Some(0.8);
    let result = run(&room, &options).unwrap();
    let spot = 2;
    assert!(result.samples.samples.iter().all(|sample| sample.material != spot));
    let found = result.solution.reflectances[spot].unwrap().diffuse;
    for (found, rho) in found.into_iter().zip(rho[spot]) {
        assert!((found / rho - 1.0).abs() < 0.05, "{found} for {rho}");
    }
    let certainty = result.solution.certainty.as_ref().unwrap().materials[spot].unwrap();
    assert_eq!(certainty.identified, [false; 3]);
    for (interval, rho) in certainty.diffuse.into_iter().zip(rho[spot]) {
        let [low, high] = interval.unwrap();
        assert!(low <= rho && rho <= high, "{low} to {high} for {rho}");
    }
    let tells = |note: &String| note.contains("\"spot\"");
    assert!(result.solution.notes.iter().any(tells), "{:?}", result.solution.notes);

    room.capture.materials[spot].known_diffuse = Some([0.2; 3]);
    let result = run(&room, &options).unwrap();
    assert_eq!(result.solution.reflectances[spot].unwrap().diffuse, [0.2; 3]);
}

#[test]
fn a_black_channel_gives_numbers() {
    let room = painted([[0.5, 0.0, 0.3], [0.2, 0.0, 0.7]]);
    let result = solved(&room);
    for reflectance in result.solution.reflectances.iter().flatten() {
        assert!(reflectance.diffuse[0] > 0.01 && reflectance.diffuse[2] > 0.01);
    }
    // All of it black.
    solved(&painted([[0.0; 3]; 2]));
    // One material of it.
    solved(&painted([[0.0; 3], [0.2, 0.3, 0.4]]));
}

#[test]
fn one_material_gives_numbers() {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.square(floor, 1.0, 0.0);
    for eye in [DVec3::new(1.6, -1.8, 1.4), DVec3::new(-1.7, -1.2, 1.5)] {
        room.photograph(camera((64, 48), 0.9, eye, DVec3::ZERO), |struck| {
            [0.3 + 0.1 * struck.position.x as f32; 3]
        });
    }
    let result = solved(&room);
    // Nothing lights it but what is unknown: its brightness says nothing.
    let certainty = result.solution.certainty.as_ref().unwrap().materials[0].unwrap();
    assert_eq!(certainty.identified, [false; 3], "{certainty:?}");
}

#[test]
fn one_photograph_gives_numbers() {
    let mut room = box_room();
    room.capture.photographs.truncate(1);
    solved(&room);
}

#[test]
fn one_sample_gives_numbers() {
    let mut room = box_room();
    room.capture.photographs.clear();
    room.photograph(camera((1, 1), 0.8, DVec3::new(0.0, -2.0, 3.0), DVec3::ZERO), |_| [0.3; 3]);
    let result = solved(&room);
    assert_eq!(result.samples.samples.len(), 1);
}

#[test]
fn specular_materials_give_numbers() {
    let mut room = box_room();
    for material in &mut room.capture.materials {
        material.kind = MaterialKind::Specular;
    }
    solved(&room);
}

#[test]
fn materials_that_are_all_known_keep_what_is_known() {
    let mut room = box_room();
    let known: [Rgb; 2] = [[0.5, 0.4, 0.3], [0.2, 0.5, 0.7]];
    for (material, known) in room.capture.materials.iter_mut().zip(known) {
        material.known_diffuse = Some(known);
    }
    let result = solved(&room);
    for (reflectance, known) in result.solution.reflectances.iter().zip(known) {
        for (found, known) in reflectance.unwrap().diffuse.into_iter().zip(known) {
            assert!((found / known - 1.0).abs() < 1e-12, "{found} for {known}");
        }
    }
    // With a standard deviation each they may move, but not far.
    for material in &mut room.capture.materials {
        material.known_diffuse_sd = Some([0.01; 3]);
    }
    let result = solved(&room);
    for (reflectance, known) in result.solution.reflectances.iter().zip(known) {
        for (found, known) in reflectance.unwrap().diffuse.into_iter().zip(known) {
            assert!((found - known).abs() < 0.05, "{found} for {known}");
        }
    }
}

/// A sphere with a luminous cap. Photographs show the cap, the wall around it and the lowest part of the
/// wall; the belt between, which they do not show, reflects far more. Every point of a sphere sees every
/// area alike, so that E/π = f_cap + (Σ f_i ρ_i) E/π, with fractions f of the area.
#[test]
fn a_surface_without_a_photograph_reflects_what_is_known_of_it() {
    let (wall, belt): (Rgb, f64) = ([0.4, 0.3, 0.2], 0.85);
    let (cap_from, belt_to, belt_from) = (0.75, 0.5, -0.1);
    let mut room = Room::default();
    let (of_wall, of_belt) = (room.diffuse("wall"), room.diffuse("belt"));
    let cap = room.luminaire("cap");
    let (positions, mut faces) = icosphere(4);
    faces.iter_mut().for_each(|face| face.swap(1, 2));
    room.triangles(&positions, &faces, |[a, b, c]| match (a + b + c).z / 3.0 {
        z if z > cap_from => cap,
        z if z < belt_to && z > belt_from => of_belt,
        _ => of_wall,
    });
    let (of_cap, belted) = (0.5 * (1.0 - cap_from), 0.5 * (belt_to - belt_from));
    let radiance = wall.map(|rho| {
        let returned = (1.0 - of_cap - belted) * rho + belted * belt;
        (rho * of_cap / (1.0 - returned)) as f32
    });
    for (eye, towards) in [(0.03, 1.0), (-0.03, -1.0)] {
        let (eye, towards) = (DVec3::new(0.02, 0.03, eye), DVec3::new(0.0, 0.0, towards));
        room.photograph(camera((96, 96), 0.5, eye, towards), |struck| {
            if struck.surface == cap { [1.0; 3] } else { radiance }
        });
    }
    let mean_error = |room: &Room| -> f64 {
        let found = solved(room).solution.reflectances[0].unwrap().diffuse;
        found.iter().zip(wall).map(|(found, truth)| (found - truth).abs()).sum::<f64>() / 3.0
    };
    let guessed = mean_error(&room);
    room.capture.materials[1].known_diffuse = Some([belt; 3]);
    let known = mean_error(&room);
    assert!(known < 0.015 && guessed > 2.0 * known, "{known}, without it {guessed}");
}

/// It fixed the scale once, and the intervals were too narrow.
#[test]
fn a_known_reflectance_that_no_photograph_shows_does_not_fix_the_scale() {
    let mut room = box_room();
    room.diffuse("nowhere");
    let without = solved(&room);
    let nowhere = room.capture.materials.last_mut().unwrap();
    nowhere.known_diffuse = Some([0.5; 3]);
    let with = solved(&room);
    assert_eq!(with.solution.reflectances, without.solution.reflectances);
    assert_eq!(with.solution.certainty, without.solution.certainty);
    let told = |result: &Reconstruction| {
        result.warnings.iter().filter(|warning| warning.contains("\"nowhere\"")).count()
    };
    assert_eq!((told(&with), told(&without)), (0, 1));
}

#[test]
fn the_solve_can_be_cancelled() {
    let room = box_room();
    for last in [0, 1, 2] {
        let watch = Watch::new();
        let (after, cancelled) = (AtomicUsize::new(0), AtomicBool::new(false));
        let result = lobelia::reconstruct::run(&room.capture, &options(), &watch, &|update| {
            if cancelled.load(SeqCst) {
                after.fetch_add(1, SeqCst);
            }
            let is_it = match &update {
                Update::Stage(stage) => last == 0 && *stage == Stage::Solve,
                Update::Iteration(iteration) => iteration.index == last,
                _ => false,
            };
            if is_it {
                watch.cancel();
                cancelled.store(true, SeqCst);
            }
        });
        assert!(cancelled.load(SeqCst), "iteration {last} never came");
        assert!(matches!(result, Err(Error::Cancelled(_))), "{last}");
        assert_eq!(after.load(SeqCst), 0, "it went on after iteration {last}");
        // The stage's own steps are what progress counts.
        let progress = watch.progress();
        assert!(
            last == 0 || (progress.done < progress.total && progress.total > 2),
            "{progress:?}"
        );
    }
}

#[test]
fn the_solve_can_be_cancelled_from_another_thread_midway() {
    let room = box_room();
    let mut options = options();
    // Minutes of work, if nobody looked at the watch within the stage.
    options.joint.light_sets = 100;
    let watch = Watch::new();
    let in_solve = AtomicBool::new(false);
    let result = std::thread::scope(|scope| {
        scope.spawn(|| {
            // The first step is done: the stage is in its midst.
            while !in_solve.load(SeqCst) || watch.progress().done < 1 {
                std::thread::yield_now();
            }
            watch.cancel();
        });
        lobelia::reconstruct::run(&room.capture, &options, &watch, &|update| {
            if matches!(update, Update::Iteration(_)) {
                in_solve.store(true, SeqCst);
            }
        })
    });
    assert!(matches!(result, Err(Error::Cancelled(_))));
}
