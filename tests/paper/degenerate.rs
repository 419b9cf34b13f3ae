//! Captures with little, nothing or nonsense in them: an error or a warning that helps, never a
//! panic or a number that is none.

use std::sync::Arc;

use glam::DVec3;
use lobelia::math::rgb::Radiance;
use lobelia::reconstruct::{Error, Reconstruction};

use crate::rooms::{Room, box_room, camera, cube_cameras, paper_options, quick, run};

fn finite(values: &mut impl Iterator<Item = f64>) -> bool {
    values.all(f64::is_finite)
}

/// Every number of a result is finite, and reflectances are physical.
fn assert_finite(result: &Reconstruction) {
    let samples = &result.samples.samples;
    assert!(finite(&mut samples.iter().flat_map(|s| s.position.to_array()).map(f64::from)));
    assert!(finite(&mut samples.iter().flat_map(|s| s.radiance).map(f64::from)));
    assert!(samples.iter().all(|s| (s.normal.length() - 1.0).abs() < 1e-5), "a normal of none");
    for light in &result.lights.lights {
        assert!(light.position.is_finite() && light.radius_m.is_finite());
        assert!((light.normal.length() - 1.0).abs() < 1e-5);
    }
    assert!(result.lobes.lobes.iter().all(|lobe| lobe.direction.is_finite()));
    let coupling = &result.transport.coupling;
    assert!(finite(
        &mut (0..coupling.ncols())
            .flat_map(|j| (0..coupling.nrows()).map(move |i| coupling[(i, j)]))
    ));
    assert!(finite(&mut result.transport.irradiance.iter().flatten().copied().map(f64::from)));
    assert!(finite(&mut result.solution.emission.iter().flatten().copied()));
    assert!(finite(&mut result.solution.computed.iter().flatten().copied()));
    for iteration in &result.solution.iterations {
        let rms = iteration.rms;
        assert!(finite(&mut rms.absolute.into_iter().chain(rms.relative)), "{rms:?}");
        assert!(iteration.change.is_finite());
    }
    for reflectance in result.solution.reflectances.iter().flatten() {
        for c in 0..3 {
            assert!((0.0..=1.0).contains(&reflectance.diffuse[c]), "{reflectance:?}");
            assert!((0.0..=1.0).contains(&reflectance.specular[c]), "{reflectance:?}");
        }
    }
    for texture in result.textures.iter() {
        assert!(texture.texels.iter().flatten().all(|t| (0.0..=1.0).contains(t)));
    }
}

/// The error's text, which must name what to look at.
fn error_of(room: &Room, word: &str) -> Error {
    let error = run(room, &quick()).unwrap_err();
    let text = error.to_string();
    assert!(text.contains(word), "\"{text}\" does not mention {word}");
    error
}

fn grey(room: &mut Room, eye: DVec3, target: DVec3) {
    room.photograph(camera((64, 48), 0.8, eye, target), |_| [0.3, 0.3, 0.3]);
}

#[test]
fn nothing_at_all() {
    assert!(matches!(error_of(&Room::default(), "photograph"), Error::NoMeasurement));
}

#[test]
fn photographs_without_radiance() {
    let mut room = box_room();
    for photograph in &mut room.capture.photographs {
        photograph.image = None;
    }
    assert!(matches!(error_of(&room, "radiance"), Error::NoMeasurement));
}

#[test]
fn cameras_that_look_elsewhere() {
    let mut room = box_room();
    room.capture.photographs.clear();
    grey(&mut room, DVec3::new(0.0, 0.0, 3.0), DVec3::new(0.0, 0.0, 9.0));
    assert!(matches!(error_of(&room, "coordinates"), Error::NothingSeen));
    // One that does see something: the other is named in a warning.
    grey(&mut room, DVec3::new(0.0, -2.0, 3.0), DVec3::ZERO);
    let result = run(&room, &quick()).unwrap();
    assert_finite(&result);
    let named = |w: &String| w.contains("photograph 0") && w.contains("none of the geometry");
    assert!(result.warnings.iter().any(named), "{:?}", result.warnings);
}

#[test]
fn a_photograph_and_no_geometry() {
    let mut room = Room::default();
    room.diffuse("nothing");
    grey(&mut room, DVec3::new(0.0, -2.0, 3.0), DVec3::ZERO);
    assert!(matches!(error_of(&room, "geometry"), Error::NothingSeen));
}

#[test]
fn only_untagged_geometry() {
    let mut room = Room::default();
    let floor = room.untagged("floor");
    room.square(floor, 1.0, 0.0);
    grey(&mut room, DVec3::new(0.0, -2.0, 3.0), DVec3::ZERO);
    assert!(matches!(error_of(&room, "tag"), Error::NothingMeasured));
}

#[test]
fn photographs_without_a_valid_pixel() {
    for bad in [f32::NAN, f32::INFINITY, -1.0, 50.0] {
        let mut room = box_room();
        let camera = room.capture.photographs[0].camera;
        room.capture.photographs.clear();
        room.photograph_of(camera, vec![[bad; 3]; 96 * 72], Some(50.0));
        assert!(matches!(error_of(&room, "saturat"), Error::NothingMeasured));
    }
}

/// What damaged files and dead surface points hold: values that are no number, and some whose sums
/// or squares are none.
#[test]
fn pixels_of_any_size_leave_the_numbers_finite() {
    let values = [f32::NAN, f32::INFINITY, f32::MAX, 1e38, 1e19];
    let mut room = box_room();
    let cameras: Vec<_> = room.capture.photographs.drain(..).map(|p| p.camera).collect();
    for camera in cameras {
        let pixels = (0..camera.width * camera.height).map(|index| {
            let mut pixel = [0.4, 0.5, 0.3];
            // Runs of three, so that whole windows are of them.
            if index / 3 % 17 == 0 {
                pixel[index / 51 % 3] = values[index / 51 % values.len()];
            }
            pixel
        });
        room.photograph_of(camera, pixels.collect(), None);
    }
    let result = run(&room, &quick()).unwrap();
    assert_finite(&result);
    for sample in &result.samples.samples {
        assert!(sample.radiance.iter().all(|value| *value <= 0.51));
    }
}

#[test]
fn black_photographs() {
    let mut room = box_room();
    for index in 0..2 {
        let camera = room.capture.photographs[index].camera;
        room.photograph_of(camera, vec![[0.0; 3]; 96 * 72], None);
    }
    room.capture.photographs.drain(..2);
    let result = run(&room, &quick()).unwrap();
    assert_finite(&result);
    assert!(result.solution.emission.iter().flatten().all(|&emission| emission == 0.0));
}

#[test]
fn a_black_channel() {
    let mut room = box_room();
    room.capture.materials[0].textured = true;
    let cameras: Vec<_> = room.capture.photographs.drain(..).map(|p| p.camera).collect();
    for camera in cameras {
        room.photograph(camera, |_| [0.4, 0.0, 0.3]);
    }
    let result = run(&room, &quick()).unwrap();
    assert_finite(&result);
    for reflectance in result.solution.reflectances.iter().flatten() {
        assert_eq!(reflectance.diffuse[1], 0.0);
    }
}

#[test]
fn one_triangle() {
    let mut room = Room::default();
    let floor = room.diffuse("triangle");
    room.polygon(floor, &[DVec3::new(-1.0, -1.0, 0.0), DVec3::X, DVec3::Y]);
    room.capture.materials[0].textured = true;
    grey(&mut room, DVec3::new(0.0, -1.0, 2.0), DVec3::ZERO);
    let result = run(&room, &quick()).unwrap();
    assert_finite(&result);
    assert!(result.samples.samples.len() > 100);
}

#[test]
fn a_photograph_of_one_pixel() {
    let mut room = box_room();
    room.capture.photographs.clear();
    room.photograph(camera((1, 1), 0.8, DVec3::new(0.0, -2.0, 3.0), DVec3::ZERO), |_| [0.3; 3]);
    let result = run(&room, &quick()).unwrap();
    assert_finite(&result);
    // One equation for many lobes: the artist is told that this cannot be.
    assert_eq!(result.samples.samples.len(), 1);
    assert!(result.warnings.iter().any(|w| w.contains("fewer samples")), "{:?}", result.warnings);
}

#[test]
fn a_camera_inside_a_box() {
    let mut room = box_room();
    room.capture.photographs.clear();
    grey(&mut room, DVec3::new(0.0, 0.0, 0.25), DVec3::new(1.0, 0.2, 0.1));
    let result = run(&room, &quick()).unwrap();
    assert_finite(&result);
    assert!(result.warnings.iter().any(|w| w.contains("inner sides")), "{:?}", result.warnings);
}

/// A closed cube photographed from within.
fn cube(
    faces: impl Fn(&mut Room) -> [usize; 6],
    radiance: impl Fn(usize) -> Radiance + Sync,
) -> Room {
    let mut room = Room::default();
    let surfaces = faces(&mut room);
    let (x, y, z, o) = (DVec3::X, DVec3::Y, DVec3::Z, DVec3::ZERO);
    for (surface, (corner, u, v)) in
        surfaces.into_iter().zip([(o, x, y), (z, y, x), (o, z, x), (y, x, z), (o, y, z), (x, z, y)])
    {
        room.rectangle(surface, corner, u, v);
    }
    for camera in cube_cameras(DVec3::new(0.52, 0.47, 0.55), 40) {
        room.photograph(camera, |struck| radiance(struck.surface));
    }
    room
}

#[test]
fn a_closed_scene_with_nothing_unknown() {
    let six = |room: &mut Room| [0; 6].map(|_| room.diffuse("wall"));
    let room = cube(six, |surface| [0.1 + 0.1 * surface as f32, 0.5, 0.0]);
    let result = run(&room, &quick()).unwrap();
    assert_finite(&result);
    assert!(result.lobes.lobes.is_empty());
    assert!(result.warnings.iter().any(|w| w.contains("no virtual light")));
    // A lit luminaire that is all there is: nothing to reconstruct.
    let lamps = |room: &mut Room| [0; 6].map(|_| room.luminaire("lamp"));
    let room = cube(lamps, |_| [1.0; 3]);
    assert!(matches!(run(&room, &quick()), Err(Error::NothingMeasured)));
}

#[test]
fn triangles_without_area_and_needles() {
    let mut room = box_room();
    let bent = room.diffuse("bent");
    let nan_free = |room: &mut Room, corners: [DVec3; 3]| room.polygon(bent, &corners);
    nan_free(&mut room, [DVec3::ZERO; 3]);
    nan_free(&mut room, [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X]);
    nan_free(&mut room, [DVec3::Z, DVec3::Z, DVec3::X]);
    // A needle a metre long and a micrometre wide, and one an ångström wide.
    for width in [1e-6, 1e-10] {
        let tip = DVec3::new(0.9, 0.0, 0.3 + width);
        nan_free(&mut room, [DVec3::new(-0.1, 0.0, 0.6), tip, DVec3::new(0.9, 0.0, 0.3)]);
    }
    room.capture.materials[0].textured = true;
    room.capture.materials[2].textured = true;
    let result = run(&room, &quick()).unwrap();
    assert_finite(&result);
    assert!(result.solution.reflectances[0].is_some());
}

#[test]
fn surfaces_that_coincide() {
    let mut room = box_room();
    let again = room.diffuse("floor again");
    room.square(again, 1.0, 0.0);
    let cameras: Vec<_> = room.capture.photographs.drain(..).map(|p| p.camera).collect();
    for camera in cameras {
        room.photograph(camera, |_| [0.4; 3]);
    }
    assert_finite(&run(&room, &quick()).unwrap());
}

#[test]
fn tiny_and_huge_scenes_and_scenes_far_off() {
    for (scale, shift) in [(1e-3, 0.0), (1e3, 0.0), (1.0, 300.0)] {
        let mut room = Room::default();
        let floor = room.diffuse("floor");
        let sides = room.diffuse("box");
        room.square(floor, 1.0, 0.0);
        room.open_box(sides, DVec3::new(-0.3, -0.2, 0.0), DVec3::new(0.25, 0.3, 0.5));
        let shift = DVec3::new(shift, -shift, 0.0);
        for p in &mut Arc::make_mut(&mut room.capture.mesh).positions {
            *p = *p * scale as f32 + shift.as_vec3();
        }
        for eye in [DVec3::new(1.6, -1.8, 1.4), DVec3::new(-1.7, -1.2, 1.5)] {
            room.photograph(camera((64, 48), 0.9, scale * eye + shift, shift), |struck| {
                [[0.3f32, 0.2, 0.4], [0.1, 0.5, 0.2]][struck.surface]
            });
        }
        let result = run(&room, &quick()).unwrap();
        assert_finite(&result);
        assert!(result.solution.is_usable() && result.solution.active_lobes() > 0);
        assert!(result.samples.samples.len() > 100);
    }
}

#[test]
fn options_out_of_range_are_named() {
    let mut options = quick();
    options.transport.rays = 0;
    let error = run(&box_room(), &options).unwrap_err();
    assert!(error.to_string().contains("transport.rays"), "{error}");
    let mut options = paper_options();
    options.start.insert("flor".to_owned(), [0.5; 3]);
    let error = run(&box_room(), &options).unwrap_err().to_string();
    assert!(error.contains("flor") && error.contains("floor, box"), "{error}");
}
