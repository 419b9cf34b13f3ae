//! Cards of known reflectance on a floor that a lamp lights, whose radiance is known in closed form.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};
use lobelia::io::tags::{chart_values, stored_charts};
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::options::Options;
use lobelia::scene::charts::{Chart, ChartKind, ChartView, Placed, Table, find};
use lobelia::scene::{Capture, Distortion, Emitter, Image, KnownLight, Role};

use crate::rooms::{Room, bent_camera, image_of, run};

const FLOOR: Rgb = [0.6, 0.5, 0.3];
const CARD: Rgb = [0.18; 3];
const EYES: [DVec3; 3] =
    [DVec3::new(1.6, -1.8, 1.4), DVec3::new(-1.7, -1.2, 1.5), DVec3::new(0.2, 2.0, 1.6)];

/// The card's corners: 30 × 20 cm, turned on the floor, in turn from its top left.
fn corners() -> [DVec3; 4] {
    let (u, v) = (DVec3::new(0.8, 0.6, 0.0), DVec3::new(-0.6, 0.8, 0.0));
    let middle = DVec3::new(0.3, 0.2, 0.0);
    [(-0.15, 0.1), (0.15, 0.1), (0.15, -0.1), (-0.15, -0.1)].map(|(a, b)| middle + a * u + b * v)
}

/// A floor with a card under a point lamp 1.5 m above, in lenses that bend lines.
fn room() -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.square(floor, 1.0, 0.0);
    let [a, b, _, d] = corners();
    let is_card = |p: DVec3| {
        let inside = |edge: DVec3| (0.0..=edge.length_squared()).contains(&(p - a).dot(edge));
        inside(b - a) && inside(d - a)
    };
    for eye in EYES {
        let lens = Distortion { radial: [0.05, 0.0, 0.0, 0.0], ..Default::default() };
        let camera = bent_camera((160, 120), 0.9, eye, DVec3::new(0.1, 0.1, 0.0), lens);
        room.photograph(camera, |struck| {
            let rho = if is_card(struck.position) { CARD } else { FLOOR };
            let towards = DVec3::new(-0.3, 0.2, 1.5) - struck.position;
            // E / π of an intensity of 2π: 2 cos θ / r².
            let lit = 2.0 * towards.z / towards.length().powi(3);
            rho.map(|rho| (rho * lit) as f32)
        });
    }
    room
}

fn view(room: &Room, photograph: usize, corners: [DVec3; 4]) -> ChartView {
    let camera = &room.capture.photographs[photograph].camera;
    ChartView { photograph, corners_px: corners.map(|corner| image_of(camera, corner).unwrap()) }
}

fn chart(views: Vec<ChartView>) -> Chart {
    Chart {
        name: "card".into(),
        kind: ChartKind::Grey,
        table: Table::card(CARD, [0.001; 3]),
        views,
        size_m: None,
    }
}

/// Adds a chart to a capture, if it can be used.
fn place(capture: &mut Capture, chart: &Chart) -> Result<Placed, String> {
    let laid = find(capture, vec![chart.clone()]);
    let placed = laid[0].placed.clone();
    *capture = capture.with_charts(Arc::new(laid));
    placed
}

fn refused(room: &mut Room, chart: &Chart, part: &str) {
    let before = room.capture.mesh.triangles.len();
    let problem = place(&mut room.capture, chart).unwrap_err();
    assert!(problem.contains(part), "\"{part}\" is missing in: {problem}");
    assert_eq!(room.capture.mesh.triangles.len(), before);
    assert!(room.capture.surfaces.iter().all(|surface| surface.name != "card"));
}

#[test]
fn a_card_lies_where_its_corners_are_seen() {
    let exact = corners();
    for views in [vec![0], vec![0, 1, 2]] {
        let mut room = room();
        let mut views: Vec<_> = views.into_iter().map(|k| view(&room, k, exact)).collect();
        // Told the other way round, and from another corner on.
        views[0].corners_px.reverse();
        views.last_mut().unwrap().corners_px.rotate_left(1);
        place(&mut room.capture, &chart(views)).unwrap();
        let capture = &room.capture;
        let card = capture.surfaces.iter().position(|surface| surface.name == "card").unwrap();
        assert_eq!(capture.surfaces[card].role, Role::Material(1));
        assert_eq!(capture.materials[1].known_diffuse, Some(CARD));
        let own: Vec<usize> = (0..capture.mesh.triangles.len())
            .filter(|&t| capture.mesh.surface[t] as usize == card)
            .collect();
        let area: f32 = own.iter().map(|&t| capture.mesh.area(t)).sum();
        assert!((area - 0.06).abs() < 1e-4, "{area}");
        for triangle in own {
            assert!(capture.mesh.normal(triangle).z > 0.999);
            for corner in capture.mesh.corners(triangle).map(|p| p.as_dvec3()) {
                let nearest = exact.iter().map(|p| p.distance(corner)).fold(9.0, f64::min);
                // Above the floor by less than a millimetre, and nowhere else.
                assert!(corner.z > 1e-5 && corner.z < 1e-3 && nearest < 1e-3, "{corner}");
            }
        }
    }
}

/// The floor's reflectance follows from the card beside it, whatever the light; with the wrong card
/// it is wrong by that factor.
#[test]
fn a_card_settles_the_scale() {
    let mut options = Options::default();
    options.samples.count = 800;
    options.joint.light_sets = 1;
    for factor in [1.0, 0.7] {
        let mut room = room();
        let mut card = chart(vec![view(&room, 0, corners())]);
        card.table = Table::card(CARD.map(|value| factor * value), [0.001; 3]);
        place(&mut room.capture, &card).unwrap();
        let result = run(&room, &options).unwrap();
        let found = result.solution.reflectances[0].unwrap().diffuse;
        for (found, rho) in std::iter::zip(found, FLOOR) {
            assert!((found / (factor * rho) - 1.0).abs() < 0.02, "{found} for {}", factor * rho);
        }
    }
}

/// The corners of a card of 30 × 20 cm above and behind the floor, so that neither lights, hides or shades
/// the other.
fn standing() -> [DVec3; 4] {
    let (u, v) = (DVec3::X, DVec3::Y);
    let middle = DVec3::new(-0.3, 1.25, 0.3);
    [(-0.15, 0.1), (0.15, 0.1), (0.15, -0.1), (-0.15, -0.1)].map(|(a, b)| middle + a * u + b * v)
}

/// The floor of [`room`] under the same lamp, whose place is known here, with a card that stands free.
fn room_with_standing_card() -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.square(floor, 1.0, 0.0);
    let [a, b, _, d] = standing();
    let normal = (d - a).cross(b - a).normalize();
    // E / π of an intensity of 2π: 2 cos θ / r².
    let lit = |position: DVec3, normal: DVec3| {
        let towards = DVec3::new(-0.3, 0.2, 1.5) - position;
        2.0 * towards.dot(normal) / towards.length().powi(3)
    };
    for eye in [DVec3::new(1.2, -1.0, 2.4), DVec3::new(-1.6, -0.6, 2.2), DVec3::new(0.2, -1.6, 2.6)]
    {
        let target = DVec3::new(0.0, 0.3, 0.0);
        let camera = bent_camera((640, 480), 0.9, eye, target, Distortion::default());
        let radiance = |position: DVec3, normal: DVec3, rho: Rgb| {
            rho.map(|rho| (rho * lit(position, normal)) as f32)
        };
        room.photograph(camera, |struck| radiance(struck.position, DVec3::Z, FLOOR));
        let image = room.capture.photographs.last_mut().unwrap().image.as_mut().unwrap();
        let mut pixels: Vec<_> = image.pixels().collect();
        for (index, pixel) in pixels.iter_mut().enumerate() {
            let place = DVec2::new((index % 640) as f64, (index / 640) as f64) + 0.5;
            let direction = camera.direction(place).unwrap();
            let position = eye + direction * ((a - eye).dot(normal) / direction.dot(normal));
            let inside =
                |edge: DVec3| (0.0..=edge.length_squared()).contains(&(position - a).dot(edge));
            if inside(b - a) && inside(d - a) {
                *pixel = radiance(position, normal, CARD);
            }
        }
        *image = Arc::new(Image::new(640, 480, pixels, None));
    }
    room.capture.lights.push(KnownLight::Shape {
        name: "lamp".into(),
        emitter: Emitter::Point { position: Vec3::new(-0.3, 0.2, 1.5) },
        emission: None,
        color: None,
    });
    room
}

/// What a project stores of charts brings them back; what cannot be read is kept, and said.
#[test]
fn charts_of_a_project_come_back() {
    let mut room = room();
    let on_floor = chart(vec![view(&room, 0, corners()), view(&room, 2, corners())]);
    let mut lost = chart(vec![view(&room, 1, corners())]);
    lost.name = "lost".into();
    lost.views[0].corners_px.swap(0, 1);
    let bare = room.capture.clone();
    let laid = Arc::new(find(&bare, vec![on_floor, lost]));
    room.capture = bare.with_charts(laid.clone());
    assert!(laid[0].placed.is_ok() && laid[1].placed.is_err());
    assert_eq!(room.capture.materials.len(), bare.materials.len() + 1);
    let missing = serde_json::json!({"name": "m", "kind": "grey", "views": [
        {"file_path": "nowhere.exr", "corners": [[0, 0], [1, 0], [1, 1], [0, 1]]}]});
    let values = chart_values(&laid, std::slice::from_ref(&missing), &room.capture);
    let stored = stored_charts(Path::new("a.lobelia"), &values, &bare);
    assert_eq!(stored.capture.charts, laid);
    assert_eq!(stored.capture.materials, room.capture.materials);
    assert_eq!(stored.capture.mesh.positions, room.capture.mesh.positions);
    assert_eq!(stored.unread, [missing]);
    assert!(stored.warnings[0].contains("there is no photograph \"nowhere.exr\""));
    assert!(stored.warnings[1].contains("the chart \"lost\" is left out"));
    // Without charts all is as it was.
    let none = stored_charts(Path::new("a.lobelia"), &[], &room.capture).capture;
    assert_eq!((none.surfaces.len(), &none.materials), (bare.surfaces.len(), &bare.materials));
    assert_eq!(none.mesh.positions, bare.mesh.positions);
}

/// A card on a stand that is not modelled: its pose follows from its size, and the floor's reflectance from it.
#[test]
fn a_card_that_stands_free_settles_the_scale() {
    let mut room = room_with_standing_card();
    let mut card = chart(vec![view(&room, 0, standing()), view(&room, 1, standing())]);
    card.size_m = Some(DVec2::new(0.3, 0.2));
    let placed = place(&mut room.capture, &card).unwrap();
    assert!((0.02..0.1).contains(&placed.tilt_sd), "{placed:?}");
    for corner in standing() {
        let nearest = placed.corners.iter().map(|own| own.distance(corner)).fold(9.0, f64::min);
        assert!(nearest < 1e-3, "{nearest} {placed:?}");
    }
    let sd = room.capture.materials[1].known_diffuse_sd.unwrap()[0];
    assert!((sd - 0.001f64.hypot(0.18 * placed.tilt_sd)).abs() < 1e-9, "{sd}");
    assert!(room.capture.surfaces.iter().any(|own| own.name == "card back"));
    let mut options = Options::default();
    options.samples.count = 800;
    options.joint.light_sets = 1;
    let result = run(&room, &options).unwrap();
    let found = result.solution.reflectances[0].unwrap().diffuse;
    for (found, rho) in std::iter::zip(found, FLOOR) {
        assert!((found / rho - 1.0).abs() < 0.05, "{found} for {rho}");
    }
}

#[test]
fn a_card_that_cannot_stand_free_there_is_refused() {
    let mut room = room_with_standing_card();
    let mut card = chart(vec![view(&room, 0, standing()), view(&room, 1, standing())]);
    card.size_m = Some(DVec2::new(0.6, 0.2));
    refused(&mut room, &card, "does not fit its corners");
}

/// A ColorChecker of 30 × 20 cm on the floor, seen from near, in light that falls off over it: its greys
/// are materials of known reflectance, and its colours are nobody's.
#[test]
fn the_greys_of_a_chart_are_known() {
    let [a, b, c, d] = corners();
    let table = Table::color_checker();
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.square(floor, 1.0, 0.0);
    let middle = (a + c) / 2.0;
    let reflectance = |p: DVec3| {
        let along = |edge: DVec3| (p - a).dot(edge) / edge.length_squared();
        let place = DVec2::new(along(b - a), along(d - a));
        if !(place.cmpge(DVec2::ZERO).all() && place.cmple(DVec2::ONE).all()) {
            return FLOOR;
        }
        let inside = |[low, high]: [DVec2; 2]| place.cmpge(low).all() && place.cmple(high).all();
        let patch = (0..24).find(|&k| inside(table.place(k)));
        patch.map_or([0.04; 3], |k| table.patches[k].reflectance.map(|value| value.max(0.0)))
    };
    for eye in [EYES[0], EYES[1], EYES[2], middle + DVec3::new(0.1, -0.2, 0.6)] {
        let target = if eye.z < 1.0 { middle } else { DVec3::new(0.1, 0.1, 0.0) };
        let camera = bent_camera((240, 180), 0.9, eye, target, Distortion::default());
        room.photograph(camera, |struck| {
            let towards = DVec3::new(-0.3, 0.2, 1.5) - struck.position;
            let lit = 2.0 * towards.z / towards.length().powi(3);
            reflectance(struck.position).map(|rho| (rho * lit) as f32)
        });
    }
    let seen = view(&room, 3, [a, b, c, d]);
    let mirrored = ChartView { corners_px: [0, 3, 2, 1].map(|k| seen.corners_px[k]), ..seen };
    let chart = |views: Vec<ChartView>| Chart {
        name: "card".into(),
        kind: ChartKind::ColorChecker,
        table: table.clone(),
        views,
        size_m: None,
    };
    refused(&mut room, &chart(vec![mirrored]), "mirrored");
    let surfaces = room.capture.surfaces.len();
    place(&mut room.capture, &chart(vec![seen])).unwrap();
    let capture = &room.capture;
    assert_eq!(capture.surfaces.len(), surfaces + 6);
    assert_eq!(capture.surfaces[surfaces].role, Role::Untagged);
    assert_eq!(capture.materials.len(), 6);
    for (k, material) in capture.materials[1..].iter().enumerate() {
        assert_eq!(material.known_diffuse, Some(table.patches[18 + k].reflectance));
        // The middle of its surface is the middle of its patch.
        let own = |t: &usize| capture.mesh.surface[*t] as usize == material.surfaces[0];
        let triangle = (0..capture.mesh.triangles.len()).find(own).unwrap();
        let [p, _, q] = capture.mesh.corners(triangle).map(|corner| corner.as_dvec3());
        let at = (table.centred(18 + k) + 1.0) / 2.0;
        let expected = a + at.x * (b - a) + at.y * (d - a);
        assert!(((p + q) / 2.0).distance(expected) < 2e-3, "{}", material.name);
    }
}

#[test]
fn what_is_no_card_pins_nothing() {
    let change =
        |room: &mut Room, photograph: usize, value: [f32; 3], of: &dyn Fn(usize) -> bool| {
            let image = room.capture.photographs[photograph].image.as_ref().unwrap();
            let (width, height) = (image.width(), image.height());
            let pixels = image.pixels().enumerate();
            let pixels =
                pixels.map(|(k, pixel)| if of(k % width) { value } else { pixel }).collect();
            let image = Image::new(width, height, pixels, Some(100.0));
            room.capture.photographs[photograph].image = Some(Arc::new(image));
        };
    let mut sound = room();
    let seen = view(&sound, 0, corners());
    let middle = seen.corners_px.iter().sum::<DVec2>() / 4.0;

    // Half hidden, burnt out, half of it floor.
    let mut hidden = room();
    change(&mut hidden, 0, [3.0; 3], &|x| x as f64 > middle.x);
    refused(&mut hidden, &chart(vec![seen]), "uneven");
    change(&mut hidden, 0, [200.0; 3], &|x| x as f64 > middle.x);
    refused(&mut hidden, &chart(vec![seen]), "burnt out");
    let shifted = corners().map(|corner| corner + DVec3::new(0.2, 0.05, 0.0));
    let shifted = view(&sound, 0, shifted);
    refused(&mut sound, &chart(vec![shifted]), "uneven");

    // Its corners.
    let mut crossed = seen;
    crossed.corners_px.swap(0, 1);
    refused(&mut sound, &chart(vec![crossed]), "in turn");
    let point = ChartView { corners_px: [middle; 4], ..seen };
    refused(&mut sound, &chart(vec![point]), "in turn");
    let tiny =
        ChartView { corners_px: seen.corners_px.map(|p| middle + 0.1 * (p - middle)), ..seen };
    refused(&mut sound, &chart(vec![tiny]), "too small");
    let outside = ChartView { corners_px: seen.corners_px.map(|p| p - DVec2::Y * 200.0), ..seen };
    refused(&mut sound, &chart(vec![outside]), "outside of the picture");
    let other = view(&sound, 1, corners().map(|corner| corner - DVec3::X * 0.6));
    refused(&mut sound, &chart(vec![seen, other]), "cm apart");

    // No plane behind it, and no measurement.
    let mut stepped = room();
    let floor = 0;
    stepped.rectangle(floor, DVec3::new(0.3, -1.0, 0.1), DVec3::X * 0.7, DVec3::Y * 2.0);
    refused(&mut stepped, &chart(vec![seen]), "not flat");
    sound.capture.photographs[0].image = None;
    refused(&mut sound, &chart(vec![seen]), "no measurement");
}
