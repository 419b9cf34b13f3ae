//! A run that takes over what an earlier one made comes to the same bytes as one from the
//! beginning: for every option that there is, and for every tag.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

use glam::{DVec3, Vec3};
use lobelia::io::export::summary;
use lobelia::io::solution::Solution;
use lobelia::options::{Declaration, Kind};
use lobelia::reconstruct::options::{Method, Options};
use lobelia::reconstruct::{Error, Reconstruction, Stage, StageCache, Update, run, run_cached};
use lobelia::scene::image::Image;
use lobelia::scene::{Capture, Emitter, Environment, KnownLight, MaterialKind, Role};
use lobelia::watch::Watch;

use crate::rooms::{Room, camera, quick};

/// A room with something for every option to act on: a glossy floor, a textured box, a small card
/// beside a lamp in sight, a lamp out of sight, and a photograph that was exposed otherwise.
fn capture() -> Capture {
    let mut room = Room::default();
    let floor = room.material("floor", MaterialKind::Specular);
    let sides = room.diffuse("box");
    let card = room.diffuse("card");
    let wall = room.diffuse("wall");
    let lamp = room.luminaire("lamp");
    room.square(floor, 1.0, 0.0);
    room.open_box(sides, DVec3::new(-0.3, -0.2, 0.0), DVec3::new(0.25, 0.3, 0.5));
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    room.rectangle(card, DVec3::new(0.5, -0.6, 0.01), 0.3 * x, 0.3 * y);
    room.rectangle(wall, DVec3::new(-1.0, 1.0, 0.0), 2.0 * x, 1.2 * z);
    room.rectangle(lamp, DVec3::new(0.5, 0.5, 0.9), 0.3 * y, 0.3 * x);
    room.capture.materials[sides].textured = true;
    room.capture.lights.push(KnownLight::Shape {
        name: "bulb".into(),
        emitter: Emitter::Sphere { center: Vec3::new(-1.2, -0.4, 1.6), radius_m: 0.1 },
        emission: None,
        color: None,
    });
    let places = [(1.6, -1.8, 1.4, 1.0), (-1.7, -1.2, 1.5, 1.25), (0.2, -2.1, 1.0, 1.0)];
    for (px, py, pz, gain) in places {
        let eye = DVec3::new(px, py, pz);
        room.photograph(camera((48, 36), 0.9, eye, DVec3::new(0.0, 0.0, 0.2)), |struck| {
            let base = [[0.5, 0.4, 0.3], [0.2, 0.5, 0.7], [0.6, 0.6, 0.6], [0.7, 0.5, 0.4]];
            let p = struck.position;
            let Some(base) = base.get(struck.surface) else { return [9.0; 3] };
            let stripes = if struck.surface == sides { 0.2 * (20.0 * p.z).sin() } else { 0.0 };
            let mirrored = (p - eye).normalize_or_zero() * DVec3::new(1.0, 1.0, -1.0);
            let towards = (DVec3::new(-1.2, -0.4, 1.6) - p).normalize_or_zero();
            let shine =
                if struck.surface == floor { mirrored.dot(towards).max(0.0).powi(12) } else { 0.0 };
            let lit = 1.0 + 0.3 * (2.0 * p.x).sin() + 0.2 * p.y + stripes;
            base.map(|value| (gain * (value * lit + 0.4 * shine)) as f32)
        });
    }
    room.capture
}

fn options(method: Method) -> Options {
    let mut options = quick();
    options.general.method = method;
    options.samples.count = 70;
    options.samples.min_per_material = 10;
    options.lights.count = 12;
    options.lobes.mask_px = 16;
    options.lobes.grid = 2;
    options.transport.rays = 16;
    options.transport.glossy_rays = 16;
    options.joint.light_sets = 2;
    options.joint.max_lamps = 1;
    options.joint.coarse_spacing = 1.0;
    options.joint.coarse_grid = 2;
    options.joint.fine_spacing = 0.8;
    options.joint.fine_grid = 2;
    options.refine.max_iterations = 3;
    // No run of three iterations comes to this; any comes to the other value that is tried, 1.
    options.refine.rms_tolerance = 0.0;
    options.gloss.max_evaluations = 30;
    options.textures.max_side = 16;
    options.textures.stride = 4;
    options.textures.rays = 16;
    options
}

fn afresh(capture: &Capture, options: &Options) -> Result<Reconstruction, Error> {
    run(capture, options, &Watch::new(), &|_| ())
}

fn kept(
    capture: &Capture,
    options: &Options,
    stage_cache: &StageCache,
) -> Result<Reconstruction, Error> {
    run_cached(capture, options, stage_cache, &Watch::new(), &|_| ())
}

/// Everything that a result consists of but seconds, every number to its last digit.
fn told(result: &Result<Reconstruction, Error>) -> String {
    let whole = match result {
        Ok(whole) => whole,
        Err(error) => return error.to_string(),
    };
    let mut solution = (*whole.solution).clone();
    solution.iterations.iter_mut().for_each(|iteration| iteration.elapsed_secs = 0.0);
    let whole = Reconstruction {
        solution: solution.into(),
        seconds: [0.0; 5],
        kept: [false; 5],
        ..whole.clone()
    };
    format!("{whole:?}")
}

/// Other values of an option, as text.
fn others(declaration: &Declaration, options: &Options) -> Vec<String> {
    let now = options.get(declaration.section, declaration.name).unwrap();
    let (low, high) = declaration.range.unwrap_or((f64::MIN, f64::MAX));
    match declaration.kind {
        Kind::Switch => vec![(now != "true").to_string()],
        Kind::Choice(names) => {
            names.iter().filter(|name| **name != now).map(|name| (*name).to_owned()).collect()
        }
        Kind::Integer | Kind::Number | Kind::NumberOrAuto => {
            let value = now.parse().unwrap_or(0.1_f64);
            let tried = [2.0 * value + 1.0, 1.4 * value, 0.6 * value, 0.02, 0.0];
            let whole = declaration.kind == Kind::Integer;
            let text = |value: f64| if whole { value.round() } else { value }.to_string();
            let mut texts: Vec<String> = tried
                .into_iter()
                .filter(|value| (low..=high).contains(value))
                .map(text)
                .filter(|text| *text != now)
                .collect();
            texts.truncate(1);
            texts
        }
    }
}

/// Changes every option in turn; those whose change made no difference.
fn every_option(method: Method) -> Vec<String> {
    let capture = capture();
    let mut base = options(method);
    base.joint.light_sets = 1;
    let plain = told(&afresh(&capture, &base));
    // Every changed run takes over from the plain one.
    let of_plain = stage_cache(&capture, &base);
    let mut idle = Vec::new();
    for declaration in base.declarations() {
        let Declaration { section, name, .. } = declaration;
        let others = others(&declaration, &base);
        assert!(!others.is_empty(), "{section}.{name} has no other value");
        let mut differs = false;
        for text in others {
            let mut changed = base.clone();
            changed.set(section, name, &text).unwrap();
            let stage_cache = of_plain.fork();
            let foreseen = stage_cache.stages(&capture, &changed);
            let (all, part) = (afresh(&capture, &changed), kept(&capture, &changed, &stage_cache));
            let all = told(&all);
            assert!(all == told(&part), "{section}.{name} = {text}");
            if let Ok(part) = part {
                assert_eq!(part.kept, foreseen, "{section}.{name} = {text}");
            }
            differs |= all != plain;
        }
        if !differs {
            idle.push(format!("{section}.{name}"));
        }
    }
    // What was kept is that of the plain options, and was not changed by the others.
    assert!(told(&kept(&capture, &base, &of_plain)) == plain);
    idle
}

/// Options that do nothing in the scene with the paper's method, where the one other value that is
/// tried is no limit there. Every other one makes a difference, so that a table that forgot it
/// would be noticed.
const IDLE: [&str; 7] = [
    "samples.omit_unmodelled",
    "samples.min_cosine",
    "refine.weight_floor",
    "gloss.views_per_sample",
    "gloss.max_exponent",
    "gloss.max_equations",
    "textures.stride",
];

#[test]
fn any_option_changed_gives_the_bytes_of_a_paper_run_from_the_beginning() {
    let idle = every_option(Method::Paper);
    let (others, own): (Vec<String>, Vec<String>) =
        idle.into_iter().partition(|name| name.starts_with("joint."));
    assert_eq!(own, IDLE);
    assert_eq!(others.len(), 16, "{others:?}");
}

#[test]
fn any_option_changed_gives_the_bytes_of_a_joint_run_from_the_beginning() {
    let idle = every_option(Method::Joint);
    for own in ["samples.count", "transport.rays", "joint.ridge", "textures.rays"] {
        assert!(!idle.iter().any(|name| name == own), "{own} makes no difference");
    }
}

/// The stage cache that a finished run of the plain options leaves.
fn stage_cache(capture: &Capture, options: &Options) -> StageCache {
    let stage_cache = StageCache::default();
    let first = kept(capture, options, &stage_cache).unwrap();
    assert_eq!(first.kept, [false; 5]);
    stage_cache
}

fn stages(kept: [bool; 5]) -> Vec<Stage> {
    Stage::ALL.into_iter().filter(|stage| kept[*stage as usize]).collect()
}

#[test]
fn a_run_begins_where_the_table_says() {
    use Stage::{Lights, Samples, Solve, Textures, Transport};
    let capture = capture();
    let all = vec![Samples, Lights, Transport, Solve, Textures];
    let before_textures = vec![Samples, Lights, Transport, Solve];
    let of = |method: Method, section: &str, name: &str, text: &str| {
        let plain = options(method);
        let stage_cache = stage_cache(&capture, &plain);
        let mut changed = plain.clone();
        changed.set(section, name, text).unwrap();
        stages(kept(&capture, &changed, &stage_cache).unwrap().kept)
    };
    for method in [Method::Joint, Method::Paper] {
        assert_eq!(of(method, "textures", "rays", "49"), before_textures);
        assert_eq!(of(method, "samples", "count", "60"), []);
        assert_eq!(of(method, "general", "seed", "2"), []);
    }
    assert_eq!(of(Method::Joint, "joint", "ridge", "0.02"), [Samples, Transport]);
    assert_eq!(of(Method::Joint, "gloss", "start_exponent", "9"), [Samples, Transport]);
    assert_eq!(of(Method::Joint, "transport", "rays", "25"), [Samples]);
    assert_eq!(of(Method::Joint, "refine", "max_iterations", "2"), all, "it is not its method's");
    assert_eq!(of(Method::Joint, "general", "method", "paper"), [Samples]);
    assert_eq!(of(Method::Paper, "general", "method", "joint"), [Samples, Transport]);
    assert_eq!(of(Method::Paper, "refine", "max_iterations", "2"), [Samples, Lights, Transport]);
    assert_eq!(of(Method::Paper, "transport", "rays", "25"), [Samples, Lights]);
    assert_eq!(of(Method::Paper, "lights", "count", "9"), [Samples]);
    assert_eq!(of(Method::Paper, "joint", "ridge", "0.02"), all);
}

/// A change of the capture, with its name.
type Tag = (&'static str, fn(&mut Capture));

const TAGS: [Tag; 14] = [
    ("known", |capture| capture.materials[2].known_diffuse = Some([0.4, 0.5, 0.6])),
    ("known, textured", |capture| capture.materials[1].known_diffuse = Some([0.4, 0.5, 0.6])),
    ("deviation", |capture| {
        capture.materials[2].known_diffuse = Some([0.4, 0.5, 0.6]);
        capture.materials[2].known_diffuse_sd = Some([0.05; 3]);
    }),
    ("matt", |capture| capture.materials[0].kind = MaterialKind::Diffuse),
    ("glossy", |capture| capture.materials[3].kind = MaterialKind::Specular),
    ("textured", |capture| capture.materials[3].textured = true),
    ("no texture", |capture| capture.materials[1].textured = false),
    ("another name", |capture| capture.materials[3].name = "plaster".into()),
    ("one material fewer", |capture| {
        capture.surfaces[3].role = Role::Material(1);
        capture.materials[1].surfaces.push(3);
        capture.materials.remove(3);
    }),
    ("untagged", |capture| {
        capture.surfaces[3].role = Role::Untagged;
        capture.materials.remove(3);
    }),
    ("another light", |capture| {
        capture.lights.push(KnownLight::Shape {
            name: "spot".into(),
            emitter: Emitter::Point { position: Vec3::new(1.3, 1.1, 1.2) },
            emission: Some([0.4; 3]),
            color: None,
        });
    }),
    ("no light", |capture| capture.lights.truncate(1)),
    ("outside", |capture| capture.environment = Environment::Open),
    ("a photograph fewer", |capture| capture.photographs[2].image = None),
];

#[test]
fn any_tag_changed_gives_the_bytes_of_a_run_from_the_beginning() {
    let capture = capture();
    for method in [Method::Joint, Method::Paper] {
        let mut options = options(method);
        options.start.insert("box".into(), [0.3; 3]);
        let stage_cache = StageCache::default();
        for (name, change) in TAGS {
            kept(&capture, &options, &stage_cache).unwrap();
            let mut changed = capture.clone();
            change(&mut changed);
            let (all, part) = (afresh(&changed, &options), kept(&changed, &options, &stage_cache));
            assert!(told(&all) == told(&part), "{name}, {method:?}");
        }
        // With gains divided out as well.
        options.photographs.gain = lobelia::reconstruct::gain::GainUse::Apply;
        kept(&capture, &options, &stage_cache).unwrap();
        let mut changed = capture.clone();
        changed.materials[0].kind = MaterialKind::Diffuse;
        let (all, part) = (afresh(&changed, &options), kept(&changed, &options, &stage_cache));
        assert!(told(&all) == told(&part), "gains, {method:?}");
        assert_eq!(part.unwrap().kept, [false; 5]);
    }
}

#[test]
fn tags_leave_what_does_not_read_them() {
    use Stage::{Lights, Samples, Transport};
    let capture = capture();
    let of = |method: Method, change: fn(&mut Capture)| {
        let options = options(method);
        let stage_cache = stage_cache(&capture, &options);
        let mut changed = capture.clone();
        change(&mut changed);
        stages(kept(&changed, &options, &stage_cache).unwrap().kept)
    };
    for (name, change) in TAGS {
        let expected: &[Stage] = match name {
            "known" | "known, textured" | "deviation" | "textured" | "no texture"
            | "another light" | "no light" | "outside" => &[Samples, Transport],
            // Mirrors and glass, which have no samples, are looked for among specular materials.
            _ => &[],
        };
        assert_eq!(of(Method::Joint, change), expected, "{name}");
    }
    assert_eq!(of(Method::Paper, TAGS[0].1), [Samples, Lights, Transport]);
    assert_eq!(of(Method::Paper, TAGS[3].1), []);
}

#[test]
fn what_is_kept_is_told_as_if_it_were_new() {
    let capture = capture();
    let options = options(Method::Joint);
    let stage_cache = stage_cache(&capture, &options);
    let tell = |stage_cache: &StageCache| {
        let told = Mutex::new(Vec::new());
        let whole = run_cached(&capture, &options, stage_cache, &Watch::new(), &|update| {
            told.lock().unwrap().push(match update {
                Update::Stage(stage) => format!("does {}", stage.name()),
                Update::Reused(stage) => format!("keeps {}", stage.name()),
                Update::Samples(cloud) => format!("{} samples", cloud.samples.len()),
                Update::Lights(lights, _) => format!("{} lights", lights.lights.len()),
                Update::Transport(_) => "transport".to_owned(),
                Update::Iteration(iteration) => format!("iteration {}", iteration.index),
            });
        });
        (told.into_inner().unwrap(), whole.unwrap())
    };
    let (again, second) = tell(&stage_cache);
    let (first, anew) = tell(&stage_cache.afresh());
    let as_new: Vec<String> = again.iter().map(|line| line.replace("keeps", "does")).collect();
    assert_eq!(as_new, first);
    assert_eq!((second.kept, anew.kept), ([true; 5], [false; 5]));
    assert_eq!(second.spent(), [0.0; 5]);
    assert!(second.seconds.iter().sum::<f64>() > 0.0, "what they took once is still known");
    assert_eq!(anew.spent(), anew.seconds);
    // And the report says so, in numbers still.
    let file = tempfile::tempdir().unwrap();
    let file = file.path().join("solution.json");
    let report = |whole: &Reconstruction| {
        summary(&capture, &options, whole, 0.5).write(&file).unwrap();
        (Solution::read(&file).unwrap(), std::fs::read_to_string(&file).unwrap())
    };
    let (read, _) = report(&second);
    assert_eq!(read.kept_stages, Stage::ALL.map(Stage::name));
    assert_eq!((read.seconds.load, read.seconds.solve, read.seconds.total), (0.5, 0.0, 0.5));
    let (read, text) = report(&anew);
    assert!(read.seconds.solve > 0.0 && !text.contains("kept_stages"));
}

/// A run that is cancelled as a stage begins.
fn stopped(capture: &Capture, options: &Options, stage_cache: &StageCache, at: Stage) {
    let watch = Watch::new();
    let stops = AtomicUsize::new(0);
    let result = run_cached(capture, options, stage_cache, &watch, &|update| {
        if matches!(update, Update::Stage(stage) if stage == at) {
            stops.fetch_add(1, SeqCst);
            watch.cancel();
        }
    });
    assert!(matches!(result, Err(Error::Cancelled(_))));
    assert_eq!(stops.load(SeqCst), 1, "the moment to cancel never came");
}

#[test]
fn a_run_that_was_stopped_takes_nothing_away_and_leaves_its_own() {
    use Stage::{Samples, Solve, Textures, Transport};
    let capture = capture();
    let plain = options(Method::Joint);
    let stage_cache = stage_cache(&capture, &plain);
    let mut other = plain.clone();
    other.set("samples", "count", "60").unwrap();
    stopped(&capture, &other, &stage_cache, Solve);
    assert_eq!(stage_cache.stages(&capture, &plain), [true; 5], "what was there before");
    assert_eq!(stages(stage_cache.stages(&capture, &other)), [Samples, Transport]);
    // Stopped once more before anything new is done.
    let mut third = plain.clone();
    third.set("samples", "count", "50").unwrap();
    stopped(&capture, &third, &stage_cache, Samples);
    assert_eq!(stages(stage_cache.stages(&capture, &other)), [Samples, Transport]);
    // And on from there, with another option of the stage that it was stopped in.
    other.set("joint", "ridge", "0.02").unwrap();
    let part = kept(&capture, &other, &stage_cache);
    assert_eq!(stages(part.as_ref().unwrap().kept), [Samples, Transport]);
    assert!(told(&part) == told(&afresh(&capture, &other)));
    stopped(&capture, &plain, &stage_cache.afresh(), Textures);
    assert_eq!(stage_cache.stages(&capture, &other), [true; 5]);
    assert_eq!(stage_cache.stages(&capture, &plain), [true, true, true, true, false]);
}

#[test]
fn a_solve_that_was_done_on_kept_stages_is_kept_with_them() {
    for (method, section, name) in
        [(Method::Joint, "joint", "light_sets"), (Method::Paper, "refine", "max_iterations")]
    {
        let capture = capture();
        let plain = options(method);
        let stage_cache = stage_cache(&capture, &plain);
        let mut other = plain.clone();
        other.set(section, name, "1").unwrap();
        stopped(&capture, &other, &stage_cache, Stage::Textures);
        assert_eq!(stage_cache.stages(&capture, &other), [true, true, true, true, false]);
        assert_eq!(stage_cache.stages(&capture, &plain), [true; 5]);
    }
}

#[test]
fn nothing_is_copied_and_another_capture_finds_nothing() {
    let capture = capture();
    let options = options(Method::Joint);
    let stage_cache = stage_cache(&capture, &options);
    let (a, b) = (
        kept(&capture, &options, &stage_cache).unwrap(),
        kept(&capture, &options, &stage_cache).unwrap(),
    );
    assert!(std::sync::Arc::ptr_eq(&a.samples, &b.samples));
    assert!(std::sync::Arc::ptr_eq(&a.transport, &b.transport));
    assert!(std::sync::Arc::ptr_eq(&a.solution, &b.solution));
    // A chart that was added and removed leaves an equal mesh.
    let mut again = capture.clone();
    let mut mesh = (*capture.mesh).clone();
    again.mesh = std::sync::Arc::new(mesh.clone());
    assert_eq!(stage_cache.stages(&again, &options), [true; 5]);
    mesh.positions[0].x += 0.01;
    again.mesh = std::sync::Arc::new(mesh);
    assert_eq!(stage_cache.stages(&again, &options), [false; 5]);
    // The same photograph read again: equal, but not known to be without looking at every pixel.
    let with_image = |change: &dyn Fn(&mut Image)| {
        let mut again = capture.clone();
        let mut image = again.photographs[0].image.as_deref().unwrap().clone();
        change(&mut image);
        again.photographs[0].image = Some(std::sync::Arc::new(image));
        stage_cache.stages(&again, &options)
    };
    assert_eq!(with_image(&|image| image.recolor(|radiance| radiance)), [false; 5]);
    // A mask makes another image of it, until it is taken back.
    let left_out = |x: usize, _: usize| x < 5;
    assert_eq!(with_image(&|image| image.mask(left_out)), [false; 5]);
    let taken_back = |image: &mut Image| {
        let before = image.mask_pixels();
        image.mask(left_out);
        image.set_mask(&before);
    };
    assert_eq!(with_image(&taken_back), [true; 5]);
}
