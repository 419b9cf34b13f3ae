//! Where samples are placed and what is read there (Section 4.1).

use glam::{DVec2, DVec3, Vec3};
use lobelia::math::rgb::Radiance;
use lobelia::reconstruct::samples::{SampleCloud, SampleOptions, place};
use lobelia::scene::{Camera, Distortion, Image, SurfacePoint, Views};
use lobelia::watch::Watch;

use crate::rooms::{Dice, Room, Struck, Tracer, bent_camera, camera, image_of};

/// Surfaces of `stage`, in order: the floor, the box, and a post that no tag names.
const COLOURS: [Radiance; 3] = [[0.5, 0.25, 0.125], [0.1, 0.9, 0.3], [7.0, 7.0, 7.0]];

fn flat_colour(struck: Struck) -> Radiance {
    COLOURS[struck.surface]
}

/// A floor, a box, and an untagged post.
fn stage() -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    let sides = room.diffuse("box");
    let post = room.untagged("post");
    room.square(floor, 1.0, 0.0);
    room.open_box(sides, DVec3::new(-0.4, -0.2, 0.0), DVec3::new(0.1, 0.3, 0.4));
    room.open_box(post, DVec3::new(0.4, -0.4, 0.0), DVec3::new(0.55, -0.25, 0.7));
    room
}

fn cameras() -> [Camera; 3] {
    let bent = Distortion {
        radial: [-0.18, 0.04, 0.0, 0.0],
        tangential: [2e-3, -1e-3],
        ..Default::default()
    };
    [
        camera((120, 90), 0.8, DVec3::new(1.5, -1.6, 1.3), DVec3::new(0.0, 0.0, 0.1)),
        bent_camera((120, 90), 0.7, DVec3::new(-1.4, -1.3, 1.2), DVec3::ZERO, bent),
        camera((90, 120), 0.9, DVec3::new(0.3, 1.9, 1.1), DVec3::new(0.0, 0.1, 0.1)),
    ]
}

fn placed(room: &Room, options: &SampleOptions) -> SampleCloud {
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    place(&views, options, 1, &Watch::new()).unwrap()
}

fn options() -> SampleOptions {
    SampleOptions { spacing_m: Some(0.06), min_per_material: 0, ..SampleOptions::default() }
}

#[test]
fn samples_lie_apart_on_tagged_surfaces_and_read_what_was_rendered() {
    let mut room = stage();
    for camera in cameras() {
        room.photograph(camera, flat_colour);
    }
    let cloud = placed(&room, &options());
    assert!(cloud.samples.len() > 300, "{} samples", cloud.samples.len());
    assert_eq!(cloud.spacing_m, 0.06);
    for (index, sample) in cloud.samples.iter().enumerate() {
        assert!(sample.surface < 2, "a sample on the untagged post");
        assert_eq!(sample.material, sample.surface);
        for other in &cloud.samples[..index] {
            let distance = sample.position.distance(other.position);
            assert!(distance >= 0.06, "{distance}");
        }
        // On the surface that it names: the floor's plane or one of the box's.
        let p = sample.position.as_dvec3();
        let off = match sample.surface {
            0 => p.z.abs(),
            _ => [(p.x + 0.4), (p.x - 0.1), (p.y + 0.2), (p.y - 0.3), (p.z - 0.4)]
                .into_iter()
                .map(f64::abs)
                .fold(f64::INFINITY, f64::min),
        };
        // A hit two metres away in single precision, a few 2⁻²⁴ of it.
        assert!(off < 2e-6, "{p} is {off} off its surface");
        assert!(!sample.views.is_empty());
        // Every surface has one colour and pixels beside edges are left out, so means are
        // exact to their rounding.
        let colour = COLOURS[sample.surface];
        for view in &cloud.views[sample.views.clone()] {
            for (found, colour) in view.radiance.iter().zip(colour) {
                assert!((found / colour - 1.0).abs() < 1e-6, "{found} for {colour}");
            }
            let towards = room.capture.photographs[view.photograph].camera.position.as_vec3()
                - sample.position;
            assert!((view.direction - towards.normalize_or_zero()).length() < 1e-5);
            assert!(view.direction.dot(sample.normal) >= 0.1);
        }
        for (found, colour) in sample.radiance.iter().zip(colour) {
            assert!((found / colour - 1.0).abs() < 1e-6, "{found} for {colour}");
        }
    }
}

#[test]
fn every_view_of_a_sample_is_listed_with_its_pixel() {
    let mut room = stage();
    for camera in cameras() {
        // Every pixel another value, so that a wrong one shows.
        let pixels =
            (0..camera.width * camera.height).map(|index| [1.0 + index as f32, 2.0, 3.0]).collect();
        room.photograph_of(camera, pixels, None);
    }
    let options = SampleOptions { window_px: 1, reject_edges: false, ..options() };
    let cloud = placed(&room, &options);
    let tracer = Tracer::new(&room.capture.mesh);
    let (mut decided, mut seen_twice) = (0, 0);
    for sample in &cloud.samples {
        let (p, normal) = (sample.position.as_dvec3(), sample.normal.as_dvec3());
        let listed = &cloud.views[sample.views.clone()];
        seen_twice += usize::from(listed.len() > 1);
        for (index, photograph) in room.capture.photographs.iter().enumerate() {
            let camera = &photograph.camera;
            let view = listed.iter().find(|view| view.photograph == index);
            if let Some(view) = view {
                // The right pixel, distortion and all; single precision of the position may
                // move it by 1e-4 px across a border.
                let pixel = image_of(camera, p).unwrap();
                let centre = DVec2::new(view.pixel[0] as f64, view.pixel[1] as f64) + 0.5;
                let off = (pixel - centre).abs().max_element();
                assert!(off <= 0.5 + 1e-3, "{pixel} was read at {centre}");
                let [x, y] = view.pixel;
                let image: &Image = photograph.image.as_ref().unwrap();
                assert_eq!(view.radiance, image.pixel(x, y));
            }
            // Whether it is seen, decided where the answer is the same a pixel's width about.
            let distance = p.distance(camera.position);
            let footprint = distance / camera.focal_px.x;
            let across = normal.cross(DVec3::new(0.36, 0.48, 0.8)).normalize_or_zero();
            let along = normal.cross(across);
            let is_seen = |q: DVec3| {
                let cosine = (camera.position - q).normalize_or_zero().dot(normal);
                image_of(camera, q).is_some_and(|pixel| {
                    pixel.cmpge(DVec2::ZERO).all()
                        && pixel.x < camera.width as f64
                        && pixel.y < camera.height as f64
                }) && cosine > options.min_cosine
                    && tracer.is_free(q + 1e-4 * normal, camera.position, 1e-6)
            };
            // Seen at a slant a pixel covers up to ten times as much along the surface.
            let reach =
                footprint / (camera.position - p).normalize_or_zero().dot(normal).abs().max(0.1);
            let answers =
                [DVec3::ZERO, reach * across, -reach * across, reach * along, -reach * along]
                    .map(|shift| is_seen(p + shift));
            if answers.iter().all(|&answer| answer == answers[0]) {
                decided += 1;
                assert_eq!(view.is_some(), answers[0], "photograph {index} and the sample at {p}");
            }
        }
    }
    assert!(decided > 2 * cloud.samples.len(), "{decided} of 3 × {}", cloud.samples.len());
    assert!(seen_twice > cloud.samples.len() / 2);
}

#[test]
fn edges_are_kept_clear_of() {
    let mut room = stage();
    for camera in cameras() {
        room.photograph(camera, flat_colour);
    }
    let tracer = Tracer::new(&room.capture.mesh);
    let cloud = placed(&room, &options());
    for sample in &cloud.samples {
        for view in &cloud.views[sample.views.clone()] {
            let camera = &room.capture.photographs[view.photograph].camera;
            // The nine pixels about the view's all show the sample's own plane.
            for (dx, dy) in [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1)] {
                let pixel = DVec2::new(
                    view.pixel[0] as f64 + f64::from(dx),
                    view.pixel[1] as f64 + f64::from(dy),
                ) + 0.5;
                let direction = crate::rooms::sight(camera, pixel);
                let (t, _) = tracer.nearest(camera.position, direction).expect("off the model");
                let hit = camera.position + t * direction;
                let off = (hit - sample.position.as_dvec3()).dot(sample.normal.as_dvec3()).abs();
                assert!(off < 1e-4, "the pixel beside {:?} shows another face", view.pixel);
            }
        }
    }
    let with_edges = placed(&room, &SampleOptions { reject_edges: false, ..options() });
    assert!(with_edges.samples.len() > cloud.samples.len());
}

#[test]
fn pixels_that_are_no_measurement_are_never_used() {
    let mut room = stage();
    let mut dice = Dice::new(8);
    let bad = [
        [f32::NAN, 0.5, 0.5],
        [0.5, f32::INFINITY, 0.5],
        [0.5, 0.5, -1e-3],
        [0.5, 0.5, 20.0],
        [f32::NEG_INFINITY, 0.0, 0.0],
    ];
    let mut bad_pixels = Vec::new();
    for camera in cameras() {
        let mut pixels = Tracer::new(&room.capture.mesh).render(&camera, flat_colour);
        let mut is_bad = vec![false; pixels.len()];
        for (index, pixel) in pixels.iter_mut().enumerate() {
            // The left half of the first photograph, and a fifth of all pixels.
            let left = bad_pixels.is_empty() && index % camera.width < camera.width / 2;
            if left || dice.uniform() < 0.2 {
                *pixel = bad[(dice.uniform() * bad.len() as f64) as usize];
                is_bad[index] = true;
            }
        }
        bad_pixels.push(is_bad);
        room.photograph_of(camera, pixels, Some(10.0));
    }
    let cloud = placed(&room, &options());
    assert!(cloud.samples.len() > 200);
    for sample in &cloud.samples {
        for view in &cloud.views[sample.views.clone()] {
            let camera = &room.capture.photographs[view.photograph].camera;
            assert!(!bad_pixels[view.photograph][view.pixel[1] * camera.width + view.pixel[0]]);
            for (found, colour) in view.radiance.iter().zip(COLOURS[sample.surface]) {
                assert!((found / colour - 1.0).abs() < 1e-6, "{found} for {colour}");
            }
        }
        assert!(sample.radiance.iter().all(|value| value.is_finite()));
    }
}

#[test]
fn a_photograph_that_is_no_measurement_is_not_read() {
    let mut room = stage();
    for camera in cameras() {
        room.photograph(camera, flat_colour);
    }
    room.capture.photographs[1].image = None;
    let cloud = placed(&room, &options());
    assert!(cloud.views.iter().all(|view| view.photograph != 1));
    assert!(cloud.views.iter().any(|view| view.photograph == 2));
}

#[test]
fn few_samples_of_a_material_are_made_more() {
    let mut room = stage();
    for camera in cameras() {
        room.photograph(camera, flat_colour);
    }
    let sparse = SampleOptions { spacing_m: Some(0.2), ..options() };
    let count = |cloud: &SampleCloud| cloud.samples.iter().filter(|s| s.material == 1).count();
    let few = placed(&room, &sparse);
    let more = placed(&room, &SampleOptions { min_per_material: 60, ..sparse });
    assert!(count(&few) < 30);
    // A smaller distance d gives as many as 1/d² on a large surface and somewhat fewer on faces
    // a few d wide, whose rims count as well (here up to a third).
    assert!(count(&more) >= 40, "{} for 60", count(&more));
}

/// Where an edge cuts a window, the mean of its other pixels would be that of points farther from the edge.
#[test]
fn a_radiance_that_varies_over_a_surface_is_read_at_the_sample() {
    let mut room = stage();
    let slope = DVec3::new(0.5, -0.3, 0.4);
    let linear = |p: DVec3| 3.0 + slope.dot(p);
    for camera in cameras() {
        room.photograph(camera, |struck| [linear(struck.position) as f32; 3]);
    }
    let caster = room.caster();
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let cloud = place(&views, &options(), 1, &Watch::new()).unwrap();
    let mut beside_edges = 0;
    for view in cloud.samples.iter().flat_map(|sample| &cloud.views[sample.views.clone()]) {
        let buffer =
            views.buffers.iter().find(|buffer| buffer.photograph == view.photograph).unwrap();
        let [x, y] = view.pixel;
        let Camera { width, height, .. } = *buffer.camera;
        if !(1..width - 1).contains(&x) || !(1..height - 1).contains(&y) {
            continue;
        }
        let at = |x: usize, y: usize| linear(buffer.hit(x, y).unwrap().0.as_dvec3());
        let around = (x - 1..=x + 1).flat_map(|u| (y - 1..=y + 1).map(move |v| (u, v)));
        beside_edges += usize::from(around.clone().any(|(u, v)| !buffer.is_off_edges(u, v)));
        // The steps from pixel to pixel differ a little by perspective and distortion.
        let step = around.map(|(u, v)| (at(u, v) - at(x, y)).abs()).fold(0.0, f64::max);
        let error = (f64::from(view.radiance[0]) - at(x, y)).abs();
        assert!(error < 0.1 * step + 1e-5, "{error} off at {x}, {y} with steps of {step}");
    }
    assert!(beside_edges > 50, "{beside_edges} windows are cut by an edge");
}

/// A pixel beside an edge shows two surfaces. It is used where fewer than two others show the point.
#[test]
fn a_point_is_looked_up_where_no_edge_is_near() {
    let bare = |room: &mut Room, colour: &dyn Fn(usize, usize, usize) -> Radiance| {
        for (index, camera) in cameras().into_iter().enumerate() {
            let (width, height) = (camera.width, camera.height);
            let pixels = (0..width * height).map(|k| colour(index, k % width, k / width)).collect();
            room.photograph_of(camera, pixels, None);
        }
    };
    let mut plain = stage();
    bare(&mut plain, &|_, _, _| [1.0; 3]);
    let caster = plain.caster();
    let plain = Views::new(&plain.capture, &caster, &Watch::new()).unwrap();
    let mut room = stage();
    let mixed = |index: usize, x: usize, y: usize| {
        if plain.buffers[index].is_off_edges(x, y) { [1.0; 3] } else { [1.2; 3] }
    };
    bare(&mut room, &mixed);
    let views = Views::new(&room.capture, &caster, &Watch::new()).unwrap();
    let mut dice = Dice::new(3);
    let (mut both, mut mixed_alone) = (0, 0);
    for _ in 0..4000 {
        let at = DVec2::new(dice.uniform(), dice.uniform()) * 2.0 - 1.0;
        let point = SurfacePoint { position: at.extend(0.0).as_vec3(), normal: Vec3::Z };
        let seen = views.buffers.iter().filter_map(|buffer| {
            views.seen(buffer, point).map(|seen| buffer.is_off_edges(seen.x, seen.y))
        });
        let off_edges: Vec<bool> = seen.collect();
        let clean = off_edges.iter().filter(|&&is_off| is_off).count();
        let beside = off_edges.len() - clean;
        both += usize::from(clean > 0 && beside > 0);
        let expected = match (clean, beside) {
            (0, 0) => {
                assert_eq!(views.radiance(point), None);
                continue;
            }
            (0, _) => {
                mixed_alone += 1;
                1.2
            }
            // A single one counts together with those beside edges.
            (1, _) => (1.0 + 1.2 * beside as f32) / (1 + beside) as f32,
            _ => 1.0,
        };
        let found = views.radiance(point).unwrap()[0];
        assert!((found - expected).abs() < 1e-6, "{found} for {expected} at {at}");
    }
    assert!(both > 100 && mixed_alone > 20, "{both} points in pixels of both kinds, {mixed_alone}");
}
