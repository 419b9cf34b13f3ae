//! How much model a scene gets: one lamp needs few lobes, gloss is kept where it shows and not where
//! it is only tagged, the same bytes on any number of threads, and a report.

use std::f64::consts::PI;
use std::sync::OnceLock;

use glam::DVec3;
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::options::Options;
use lobelia::reconstruct::solution::{Selection, Trial, TrialPart};
use lobelia::reconstruct::{Reconstruction, Update};
use lobelia::scene::{Emitter, Environment, KnownLight, MaterialKind};
use lobelia::watch::Watch;

use crate::coats::coat;
use crate::lights;
use crate::rooms::{Room, Tracer, camera};

const LOW: DVec3 = DVec3::new(-0.35, -0.3, 0.0);
const HIGH: DVec3 = DVec3::new(0.3, 0.35, 0.6);
const FLOOR: Rgb = [0.12, 0.09, 0.06];
const BOX: Rgb = [0.05, 0.10, 0.13];
const LAMP: DVec3 = DVec3::new(0.9, -0.8, 1.9);
const INTENSITY: Rgb = [9.0, 7.0, 5.0];
/// Of the floor, where it shines.
const GLOSS: f64 = 0.06;
const EXPONENT: f64 = 30.0;
const ROUGHNESS: f64 = 0.2;

/// What the floor mirrors.
#[derive(Clone, Copy, PartialEq)]
enum Shine {
    Nothing,
    /// The modified Phong lobe of Eq. 12 with ρ_s [`GLOSS`] and the exponent [`EXPONENT`].
    Lobe,
    /// A coat of the roughness [`ROUGHNESS`].
    Coat,
}

/// A floor with a box under one lamp and nothing else. The box is tagged as specular and is not.
fn scene(shine: Shine) -> Room {
    let mut room = lit_by(&[(LAMP, INTENSITY)], shine);
    room.capture.environment = Environment::Room;
    room
}

/// The same under point lights of these intensities.
fn lit_by(lights: &[(DVec3, Rgb)], shine: Shine) -> Room {
    let mut room = Room::default();
    let is_matt = shine == Shine::Nothing;
    let floor_kind = if is_matt { MaterialKind::Diffuse } else { MaterialKind::Specular };
    let floor = room.material("floor", floor_kind);
    let sides = room.material("box", MaterialKind::Specular);
    room.square(floor, 1.5, 0.0);
    room.open_box(sides, LOW, HIGH);
    let tracer = Tracer::new(&room.capture.mesh);
    for eye in [DVec3::new(2.2, -2.4, 2.0), DVec3::new(-2.3, -1.8, 2.1), DVec3::new(-1.2, 2.2, 1.6)]
    {
        let camera = camera((240, 180), 0.9, eye, DVec3::new(0.0, 0.0, 0.15));
        room.photograph(camera, |struck| {
            let p = struck.position;
            let close = |a: f64, b: f64| (a - b).abs() < 1e-5;
            let normal = match () {
                _ if struck.surface == floor || close(p.z, HIGH.z) => DVec3::Z,
                _ if close(p.x, HIGH.x) => DVec3::X,
                _ if close(p.x, LOW.x) => DVec3::NEG_X,
                _ if close(p.y, HIGH.y) => DVec3::Y,
                _ => DVec3::NEG_Y,
            };
            let is_floor = struck.surface == floor;
            let diffuse = if is_floor { FLOOR } else { BOX };
            // A little light from everywhere: no logarithm likes black shadows.
            let mut radiance = diffuse.map(|rho| 0.05 * rho);
            for &(light, intensity) in lights {
                let offset = light - p;
                let direction = offset.normalize_or_zero();
                let cosine = normal.dot(direction);
                if cosine <= 0.0 || !tracer.is_free(p, light, 1e-4) {
                    continue;
                }
                let arriving = cosine / offset.length_squared();
                let reflected = 2.0 * cosine * normal - direction;
                let towards = (eye - p).normalize_or_zero();
                let cosine = reflected.dot(towards).max(0.0);
                let lobe = match shine {
                    Shine::Lobe if is_floor => {
                        GLOSS * 0.5 * (EXPONENT + 2.0) * cosine.powf(EXPONENT)
                    }
                    Shine::Coat if is_floor => PI * coat(ROUGHNESS, towards, direction),
                    _ => 0.0,
                };
                for c in 0..3 {
                    radiance[c] += (diffuse[c] + lobe) * intensity[c] * arriving;
                }
            }
            radiance.map(|value| (value / PI) as f32)
        });
    }
    // The scale is left to a pin: without light between surfaces nothing else tells it.
    room.capture.materials[0].known_diffuse = Some(FLOOR);
    room
}

fn options() -> Options {
    let mut options = lights::options();
    options.transport.glossy_rays = 100;
    options.joint.max_lamps = 3;
    options
}

fn reconstruct(room: &Room, options: &Options, threads: usize) -> Reconstruction {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let ignore = |_: Update| ();
    pool.install(|| {
        lobelia::reconstruct::run(&room.capture, options, &Watch::new(), &ignore).unwrap()
    })
}

/// The scene with the glossy floor.
fn glossy() -> &'static Reconstruction {
    static RESULT: OnceLock<Reconstruction> = OnceLock::new();
    RESULT.get_or_init(|| reconstruct(&scene(Shine::Lobe), &options(), 2))
}

fn selection(result: &Reconstruction) -> &Selection {
    result.solution.certainty.as_ref().unwrap().selection.as_ref().expect("the model was grown")
}

fn trial(result: &Reconstruction, part: TrialPart) -> &Trial {
    let mut trials = selection(result).trials.iter();
    trials.find(|trial| trial.part == part).unwrap_or_else(|| panic!("{part:?} was not tried"))
}

#[test]
fn one_lamp_explains_everything_with_few_lobes() {
    let mut room = scene(Shine::Nothing);
    room.capture.materials[1].kind = MaterialKind::Diffuse;
    let result = reconstruct(&room, &options(), 2);
    let first = trial(&result, TrialPart::Lamp(1));
    assert!(first.supported && first.change < -0.5, "{first:?}");
    let Selection { candidates, kept, .. } = *selection(&result);
    assert_eq!(kept, result.solution.active_lobes());
    assert!(4 * kept < candidates, "{kept} of {candidates}: {:?}", result.solution.notes);
    let found = result.solution.reflectances[1].unwrap().diffuse;
    for (found, truth) in found.into_iter().zip(BOX) {
        assert!((found - truth).abs() < 0.01, "{found} for {truth}");
    }
}

/// A lamp, and a window that no coarse lobe draws: only once the reflectances are known may the
/// light be as fine as that.
#[test]
fn finer_light_is_kept_where_it_predicts_better() {
    let mut lights = vec![(LAMP, INTENSITY)];
    for (column, row) in (0..6).flat_map(|column| (0..4).map(move |row| (column, row))) {
        let place = DVec3::new(-1.6 + 0.2 * f64::from(column), 2.3, 0.8 + 0.2 * f64::from(row));
        lights.push((place, [0.1, 0.14, 0.18]));
    }
    let room = lit_by(&lights, Shine::Nothing);
    let mut options = options();
    options.joint.max_lamps = 1;
    options.joint.light_sets = 1;
    let result = reconstruct(&room, &options, 2);
    let beside = |trial: &&Trial| matches!(trial.part, TrialPart::Beside(_));
    let trial = selection(&result)
        .trials
        .iter()
        .find(beside)
        .unwrap_or_else(|| panic!("not tried: {:?}", result.solution.notes));
    assert!(trial.supported && trial.change < -0.05, "{trial:?}");
    let note = "fine lobes beside the other lights for pictures: kept (−";
    assert!(result.solution.notes.iter().any(|told| told.contains(note)));
    assert_eq!(selection(&result).kept, result.solution.active_lobes());
    // The samples are met as well as that says, and the box is what it is.
    let last = result.solution.iterations.last().unwrap();
    let settled = &result.solution.iterations[result.solution.iterations.len() - 2];
    for c in 0..3 {
        assert!(last.rms.absolute[c] < 0.9 * settled.rms.absolute[c], "{last:?} {settled:?}");
    }
    for (found, truth) in result.solution.reflectances[1].unwrap().diffuse.into_iter().zip(BOX) {
        assert!((found - truth).abs() < 0.02, "{found} for {truth}");
    }
}

#[test]
fn gloss_is_kept_where_it_shows_and_not_where_it_is_only_tagged() {
    let result = glossy();
    let floor = trial(result, TrialPart::Gloss(0));
    assert!(floor.supported && floor.change < -0.1, "{floor:?}");
    let sides = trial(result, TrialPart::Gloss(1));
    assert!(!sides.supported, "{sides:?}");
    let reflectance = |material: usize| result.solution.reflectances[material].unwrap();
    assert_eq!(reflectance(1).specular, [0.0; 3]);
    for specular in reflectance(0).specular {
        assert!((specular - GLOSS).abs() < 0.3 * GLOSS, "{specular} for {GLOSS}");
    }
    let told = |text: &str| result.solution.warnings.iter().any(|warning| warning.contains(text));
    assert!(told("\"box\" is tagged as specular"), "{:?}", result.solution.warnings);
    assert!(!told("\"floor\" is tagged as specular"));
}

/// A coat has one unknown where a lobe of its own strength has two for each channel and more.
#[test]
fn a_coat_is_told_from_a_lobe_of_its_own_strength() {
    let mut room = scene(Shine::Coat);
    // Its highlight alone would tell a small lamp on a rough coat from a large lamp on a smooth one.
    room.capture.lights.push(KnownLight::Shape {
        name: "lamp".into(),
        emitter: Emitter::Point { position: LAMP.as_vec3() },
        emission: Some(INTENSITY),
        color: None,
    });
    let coated = reconstruct(&room, &options(), 2);
    assert!(trial(&coated, TrialPart::Gloss(0)).supported, "{:?}", coated.solution.notes);
    assert!(!trial(&coated, TrialPart::Lobe(0)).supported, "{:?}", coated.solution.notes);
    let floor = coated.solution.reflectances[0].unwrap();
    let roughness = floor.coat.expect("the floor is coated");
    assert!((roughness / ROUGHNESS - 1.0).abs() < 0.25, "{roughness} for {ROUGHNESS}");
    assert_eq!(floor.specular, [0.0; 3]);
    let certainty = coated.solution.certainty.as_ref().unwrap().materials[0].unwrap();
    let [low, high] = certainty.roughness.unwrap();
    assert!(low <= ROUGHNESS && ROUGHNESS <= high, "{ROUGHNESS} in [{low}, {high}]");
    assert_eq!(certainty.exponent, None);
    assert!(trial(glossy(), TrialPart::Lobe(0)).supported, "{:?}", glossy().solution.notes);
}

#[test]
fn what_was_tried_is_told() {
    let result = glossy();
    let notes = &result.solution.notes;
    let Selection { candidates, kept, trials } = selection(result);
    let counts = format!("{kept} of {candidates} lobes that were tried emit light");
    assert!(notes.iter().any(|note| note.ends_with(&counts)), "{notes:?}");
    let parts = notes.iter().find(|note| note.starts_with("parts, ")).expect("a note on the parts");
    for part in [
        "lamp 1: kept (−",
        "a background of ",
        "fine lobes in place of lamps: ",
        "gloss of \"floor\": kept (−",
        "gloss of \"box\": left out (",
    ] {
        assert!(parts.contains(part), "{part}: {parts}");
    }
    for trial in trials {
        assert!((trial.after / trial.before - 1.0 - trial.change).abs() < 1e-9, "{trial:?}");
        let bears_out = trial.standard_error.is_some_and(|error| -trial.change > error);
        assert_eq!(trial.supported, bears_out, "{trial:?}");
    }
}

#[test]
fn one_thread_and_two_give_the_same() {
    let one = reconstruct(&scene(Shine::Lobe), &options(), 1);
    let two = glossy();
    let bits = |result: &Reconstruction| -> Vec<u64> {
        let of_reflectances = result.solution.reflectances.iter().flatten().flat_map(|r| {
            r.diffuse.iter().chain(&r.specular).copied().chain([r.exponent]).collect::<Vec<_>>()
        });
        let all = of_reflectances.chain(result.solution.emission.iter().flatten().copied());
        all.map(f64::to_bits).collect()
    };
    assert_eq!(bits(&one), bits(two));
    assert_eq!(selection(&one), selection(two));
    assert_eq!(one.solution.notes, two.solution.notes);
}
