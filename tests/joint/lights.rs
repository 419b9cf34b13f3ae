//! Scenes under lights of known answer, shaded by formulas and brute force: a sun must be found,
//! a light that tags.json gives must be used, a highlight must come out as gloss.
//!
//! The pictures have no light between surfaces, so surfaces are dark: what is left out is below
//! 3 % of the light, and reflectances may be off by a little more than that.

use glam::{DVec2, DVec3};
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::Reconstruction;
use lobelia::reconstruct::lights::{LightKind, VirtualLight};
use lobelia::reconstruct::options::{Method, Options};
use lobelia::reconstruct::solution::{Trial, TrialPart};
use lobelia::scene::{Emitter, KnownLight, MaterialKind};

use crate::rooms::{Room, Tracer, camera, quick, run, sight};

const LOW: DVec3 = DVec3::new(-0.35, -0.3, 0.0);
const HIGH: DVec3 = DVec3::new(0.3, 0.35, 0.6);
pub const FLOOR: Rgb = [0.12, 0.09, 0.06];
const BOX: Rgb = [0.05, 0.10, 0.13];

pub fn options() -> Options {
    let mut options = quick();
    options.general.method = Method::Joint;
    options.samples.count = 1500;
    // Shadows are sharp here, and the pictures have no noise to be averaged over.
    options.samples.window_px = 1;
    options.transport.rays = 100;
    options.joint.light_sets = 2;
    options
}

/// A floor with a box, on which light falls as `irradiance` says: of a position, its normal, and
/// what hides it.
fn scene(irradiance: impl Fn(&Tracer, DVec3, DVec3) -> Rgb + Sync) -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    let sides = room.diffuse("box");
    room.square(floor, 1.5, 0.0);
    room.open_box(sides, LOW, HIGH);
    let tracer = Tracer::new(&room.capture.mesh);
    for position in
        [DVec3::new(2.2, -2.4, 2.0), DVec3::new(-2.3, -1.8, 2.1), DVec3::new(-0.4, 2.9, 1.9)]
    {
        let camera = camera((240, 180), 0.9, position, DVec3::new(0.0, 0.0, 0.15));
        room.photograph(camera, |struck| {
            let (p, low, high) = (struck.position, LOW, HIGH);
            let close = |a: f64, b: f64| (a - b).abs() < 1e-5;
            let (normal, reflectance) = if struck.surface == floor {
                (DVec3::Z, FLOOR)
            } else if close(p.z, high.z) {
                (DVec3::Z, BOX)
            } else if close(p.x, high.x) {
                (DVec3::X, BOX)
            } else if close(p.x, low.x) {
                (DVec3::NEG_X, BOX)
            } else if close(p.y, high.y) {
                (DVec3::Y, BOX)
            } else {
                (DVec3::NEG_Y, BOX)
            };
            let light = irradiance(&tracer, p, normal);
            std::array::from_fn(|c| (reflectance[c] / std::f64::consts::PI * light[c]) as f32)
        });
    }
    room
}

fn diffuse(result: &Reconstruction, material: usize) -> Rgb {
    result.solution.reflectances[material].unwrap().diffuse
}

/// Irradiance from a uniform sky of radiance 1/π, all around, where the box does not hide it.
pub fn sky(tracer: &Tracer, p: DVec3, normal: DVec3) -> f64 {
    let (x, y) = normal.any_orthonormal_pair();
    let count = 32;
    let free = |k: &usize| {
        // Cosine-distributed, on a spiral.
        let square = (*k as f64 + 0.5) / count as f64;
        let angle = 2.399_963 * *k as f64;
        let direction =
            square.sqrt() * (angle.cos() * x + angle.sin() * y) + (1.0 - square).sqrt() * normal;
        tracer.is_free(p, p + 20.0 * direction, 1e-4)
    };
    (0..count).filter(free).count() as f64 / count as f64
}

#[test]
fn a_sun_is_found_where_it_stands() {
    let towards = DVec3::new(0.45, -0.35, 0.8).normalize_or_zero();
    let strength = [2.4, 2.1, 1.7];
    let mut room = scene(|tracer, p, normal| {
        let cosine = normal.dot(towards).max(0.0);
        let is_lit = cosine > 0.0 && tracer.is_free(p, p + 20.0 * towards, 1e-4);
        let sky = sky(tracer, p, normal);
        strength.map(|e| sky + if is_lit { e * cosine } else { 0.0 })
    });
    // The scale is left to a pin: without light between surfaces nothing else tells it.
    room.capture.materials[0].known_diffuse = Some(FLOOR);
    let mut options = options();
    // The edge of a shadow is known as well as samples are dense.
    options.samples.count = 4000;
    options.joint.light_sets = 1;
    let result = run(&room, &options).unwrap();
    let suns: Vec<usize> = (0..result.lights.lights.len())
        .filter(|&light| result.lights.lights[light].kind == LightKind::Sun)
        .collect();
    assert_eq!(suns.len(), 1, "{:?}", result.solution.notes);
    let found = -result.lights.lights[suns[0]].normal.as_dvec3();
    let off = found.dot(towards).clamp(-1.0, 1.0).acos().to_degrees();
    assert!(off < 0.5, "{off}° off");
    let emission = result.solution.emission[result.lobes.of(suns[0]).start];
    for c in 0..3 {
        assert!((emission[c] / strength[c] - 1.0).abs() < 0.1, "{emission:?}");
        assert!((diffuse(&result, 1)[c] - BOX[c]).abs() < 0.01, "{:?}", diffuse(&result, 1));
    }
}

/// What was reported of the sky that photographs show.
fn seen_sky(result: &Reconstruction) -> &Trial {
    let certainty = result.solution.certainty.as_ref().unwrap();
    let mut trials = certainty.selection.as_ref().unwrap().trials.iter();
    trials.find(|trial| matches!(trial.part, TrialPart::SeenSky(_))).expect("a sky is shown")
}

/// Photographs that look past the geometry show what shines there.
#[test]
fn a_sky_that_photographs_show_is_as_bright_as_they_show_it() {
    let mut room = scene(|tracer, p, normal| [1.2, 1.0, 0.8].map(|c| c * sky(tracer, p, normal)));
    let shown = [1.2, 1.0, 0.8].map(|c: f32| c / std::f32::consts::PI);
    // All of the upper hemisphere, by eight photographs around and one to the zenith.
    let from = DVec3::new(0.0, 0.0, 3.0);
    let around = (0..8).map(|k| (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos());
    let around = around.map(|(y, x)| from + DVec3::new(x, y, 0.45));
    for target in around.chain([from + DVec3::new(0.05, 0.0, 1.0)]) {
        let camera = camera((120, 90), 1.5, from, target);
        let pixels = vec![shown; camera.width * camera.height];
        room.photograph_of(camera, pixels, None);
    }
    let result = run(&room, &options()).unwrap();
    let seen = seen_sky(&result);
    assert!(seen.supported, "{seen:?}");
    // The sky above 45° is seen for certain: 15 % of the sphere, of which cells are 1 in 2000.
    let lights = result.lights.lights.iter().enumerate();
    let as_shown = |(index, light): &(usize, &VirtualLight)| {
        let emission = result.solution.emission[result.lobes.of(*index).start];
        let is_near = |(e, c): (f64, f32)| (e / f64::from(c) - 1.0).abs() < 1e-6;
        light.kind == LightKind::Sky && emission.into_iter().zip(shown).all(is_near)
    };
    let cells: Vec<_> = lights.filter(as_shown).collect();
    assert!(cells.len() >= 300, "{} cells", cells.len());
    assert!(cells.iter().all(|(_, light)| light.normal.z < 0.0), "light from below the horizon");
    // No light of the sky is there twice: where one is shown there is no other. Cells that touch are at
    // least about the half-angle of the larger one apart.
    let free = result.lights.lights.iter().enumerate().filter(|(_, light)| {
        light.kind == LightKind::Sky && cells.iter().all(|(_, shown)| shown.normal != light.normal)
    });
    for (_, free) in free {
        for (_, shown) in &cells {
            let angle = free.normal.angle_between(shown.normal);
            assert!(angle > 0.6 * free.half_angle, "{angle} from a cell of {}", free.half_angle);
        }
    }
    let certainty = result.solution.certainty.as_ref().unwrap();
    for (material, truth) in [FLOOR, BOX].into_iter().enumerate() {
        let known = certainty.materials[material].as_ref().unwrap();
        for (c, true_value) in truth.into_iter().enumerate() {
            let [low, high] = known.diffuse[c].expect("an interval");
            assert!((low..=high).contains(&true_value), "{true_value} in {low} to {high}");
        }
    }
}

/// Photographs from two places show the same radiance in the same directions, so that the sky is far away.
/// It is used then, though the scene is lit by an even sky, which predicts it better.
#[test]
fn a_sky_that_is_seen_to_be_far_away_is_reported_as_used() {
    let mut room = scene(|tracer, p, normal| [1.2, 1.0, 0.8].map(|c| c * sky(tracer, p, normal)));
    let shown = |direction: DVec3| {
        let brightness = 1.0 + 0.9 * direction.y.atan2(direction.x).sin();
        [1.2, 1.0, 0.8].map(|c| (c * brightness / std::f64::consts::PI) as f32)
    };
    for from in [DVec3::new(0.0, 0.0, 3.0), DVec3::new(1.5, -1.0, 2.0)] {
        for k in 0..8 {
            let (y, x) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
            let camera = camera((120, 90), 1.5, from, from + DVec3::new(x, y, 0.45));
            let places =
                (0..90 * 120).map(|i| DVec2::new((i % 120) as f64, (i / 120) as f64) + 0.5);
            let pixels = places.map(|place| shown(sight(&camera, place))).collect();
            room.photograph_of(camera, pixels, None);
        }
    }
    let mut options = options();
    options.samples.count = 600;
    options.joint.light_sets = 1;
    let result = run(&room, &options).unwrap();
    let seen = seen_sky(&result);
    assert!(seen.change > 0.0 && seen.supported, "{seen:?}");
}

/// A lamp that the artist knows, close to a point: its irradiance is I cos θ / d².
fn lamp(tracer: &Tracer, p: DVec3, normal: DVec3) -> f64 {
    let offset = LAMP - p;
    let cosine = normal.dot(offset.normalize_or_zero()).max(0.0);
    let is_lit = cosine > 0.0 && tracer.is_free(p, LAMP, 1e-4);
    if is_lit { cosine / offset.length_squared() } else { 0.0 }
}

const LAMP: DVec3 = DVec3::new(0.9, -0.8, 1.9);
const INTENSITY: Rgb = [9.0, 7.0, 5.0];

/// The scene under that lamp and a sky, neither of which is known.
pub fn lamp_and_sky() -> Room {
    scene(|tracer, p, normal| {
        let (lamp, sky) = (lamp(tracer, p, normal), sky(tracer, p, normal));
        INTENSITY.map(|intensity| 0.3 * sky + intensity * lamp)
    })
}

fn lit_by_lamp(emission: Option<Rgb>, color: Option<Rgb>) -> Room {
    let mut room = lamp_and_sky();
    room.capture.lights.push(KnownLight::Shape {
        name: "bulb".into(),
        emitter: Emitter::Point { position: LAMP.as_vec3() },
        emission,
        color,
    });
    room
}

fn bulb(result: &Reconstruction) -> Rgb {
    let light = result
        .lights
        .lights
        .iter()
        .position(|light| matches!(light.kind, LightKind::Known(_)))
        .expect("the given light is among the lights");
    result.solution.emission[result.lobes.of(light).start]
}

#[test]
fn a_given_light_of_known_strength_sets_the_scale() {
    let result = run(&lit_by_lamp(Some(INTENSITY), None), &options()).unwrap();
    assert_eq!(bulb(&result), INTENSITY);
    for c in 0..3 {
        let (floor, sides) = (diffuse(&result, 0)[c], diffuse(&result, 1)[c]);
        assert!((floor / FLOOR[c] - 1.0).abs() < 0.08, "floor {floor} for {}", FLOOR[c]);
        assert!((sides / BOX[c] - 1.0).abs() < 0.08, "box {sides} for {}", BOX[c]);
    }
}

#[test]
fn a_given_light_of_unknown_strength_is_solved_for() {
    let mut room = lit_by_lamp(None, None);
    room.capture.materials[0].known_diffuse = Some(FLOOR);
    let result = run(&room, &options()).unwrap();
    let found = bulb(&result);
    for c in 0..3 {
        assert!((found[c] / INTENSITY[c] - 1.0).abs() < 0.08, "{found:?}");
        assert!((diffuse(&result, 1)[c] - BOX[c]).abs() < 0.01);
    }
}

#[test]
fn a_given_colour_ties_the_channels() {
    let color = INTENSITY.map(|value| 0.01 * value);
    let result = run(&lit_by_lamp(None, Some(color)), &options()).unwrap();
    let found = bulb(&result);
    let strength = found[0] / color[0];
    for c in 0..3 {
        assert!((found[c] / (strength * color[c]) - 1.0).abs() < 1e-9, "{found:?}");
        // The scale is open, but it is the same in all channels.
        let scale = diffuse(&result, 0)[0] / FLOOR[0];
        assert!((diffuse(&result, 0)[c] / FLOOR[c] / scale - 1.0).abs() < 0.08);
    }
}

/// The strength that goes with a colour is found like any other unknown: what it leaves open of the
/// reflectances is not hidden by taking it for a fact.
#[test]
fn a_colour_leaves_the_scale_open() {
    let scale_sd = |emission: Option<Rgb>, color: Option<Rgb>| {
        let result = run(&lit_by_lamp(emission, color), &options()).unwrap();
        let certainty = result.solution.certainty.as_ref();
        certainty.expect("a joint solve says how sure it is").scale.log_sd
    };
    let known = scale_sd(Some(INTENSITY), None);
    let open = scale_sd(None, None);
    let coloured = scale_sd(None, Some(INTENSITY.map(|value| 0.01 * value)));
    for c in 0..3 {
        assert!(open[c] > 2.0 * known[c], "{open:?} open, {known:?} known");
        assert!(coloured[c] > 0.5 * open[c], "{coloured:?} with a colour, {open:?} open");
    }
}

#[test]
fn an_uncertain_pin_gives_way_and_an_exact_one_does_not() {
    let wrong = FLOOR.map(|value| 1.5 * value);
    let mut room = lit_by_lamp(Some(INTENSITY), None);
    room.capture.materials[0].known_diffuse = Some(wrong);
    let exact = run(&room, &options()).unwrap();
    assert!((diffuse(&exact, 0)[0] - wrong[0]).abs() < 1e-9);
    room.capture.materials[0].known_diffuse_sd = Some([0.05; 3]);
    let loose = run(&room, &options()).unwrap();
    assert!((diffuse(&loose, 0)[0] / FLOOR[0] - 1.0).abs() < 0.15, "{:?}", diffuse(&loose, 0));
}

#[test]
fn no_highlight_no_gloss() {
    let mut room = lit_by_lamp(None, None);
    room.capture.materials[0].kind = MaterialKind::Specular;
    let mut options = options();
    options.samples.count = 500;
    let result = run(&room, &options).unwrap();
    let floor = result.solution.reflectances[0].unwrap();
    assert!(floor.specular.iter().all(|&specular| specular < 0.01), "{floor:?}");
    let said = result.solution.warnings.iter().any(|warning| warning.contains("no highlight"));
    assert!(said, "{:?}", result.solution.warnings);
}
