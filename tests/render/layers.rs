use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use glam::{DVec3, Vec3};
use lobelia::geometry::bvh::RayCaster;
use lobelia::math::rgb::Radiance;
use lobelia::reconstruct::lights::VirtualLight;
use lobelia::reconstruct::lobes::Lobe;
use lobelia::render::added::Added;
use lobelia::render::edits::{AddedLight, Edits, Override, Shape, Surroundings};
use lobelia::render::film::{LightFilm, SurfaceFilm};
use lobelia::render::lights::{IrradianceGrid, Recovered, Use};
use lobelia::render::path::Sought;
use lobelia::render::preview::{Asked, Picture, Preview};
use lobelia::render::scene::{Geometry, Scene};
use lobelia::render::tracer::Tracer;
use lobelia::render::{Exposure, Pass};
use lobelia::scene::{Camera, Emitter, Views};
use lobelia::watch::{Cancelled, Watch};

use crate::rooms::{Room, camera};
use crate::stage::{Stage, ceiling, floor, needle, reflectance};

/// A glossy floor and a wall under two recovered lamps and three added lights, within grey
/// surroundings; what a photograph shows beside it shines.
fn stage() -> Stage {
    let mut room = Room::default();
    let (floor, wall) = (room.diffuse("floor"), room.diffuse("wall"));
    let seen = room.untagged("seen");
    room.square(floor, 5.0, 0.0);
    room.square(wall, 0.3, 0.3);
    room.square(seen, 0.2, 0.5);
    let mut stage = Stage::new(room, &[reflectance(0.4, 0.3, 9.0), reflectance(0.7, 0.0, 1.0)])
        .light(ceiling([-0.5, 0.5], [-0.5, 0.5], 1.5), [3.0, 2.0, 1.0])
        .light(Emitter::Point { position: Vec3::new(1.3, 0.2, 0.8) }, [0.2, 0.4, 0.1])
        .light(Emitter::Sphere { center: Vec3::new(-0.6, 0.4, 0.6), radius_m: 0.1 }, [2.0; 3])
        .most(5)
        .spp(8);
    stage.edits.surroundings = Surroundings::Albedo(0.5);
    for (index, x) in [-0.8, 0.9].into_iter().enumerate() {
        let light = &mut stage.solved.light;
        light.lights.lights.push(VirtualLight::lamp(Vec3::new(x, 0.0, 2.0), 0.2));
        light.lobes.lobes.push(Lobe { light: index, direction: -Vec3::Z, exponent: 1.0 });
        light.lobes.first.push(index + 1);
        light.emission.push([10.0, 8.0, 6.0 * x.abs() as f64]);
    }
    stage.room.photograph(view(), |struck| [struck.position.x as f32 + 6.0, 1.0, 2.0]);
    stage
}

fn view() -> Camera {
    camera((40, 30), 0.9, DVec3::new(1.0, -1.8, 1.2), DVec3::ZERO)
}

/// Asks about the stage's captures and what was recovered.
fn with<T>(stage: &Stage, ask: impl FnOnce(&Views) -> T) -> T {
    let capture = &stage.room.capture;
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    ask(&Views::new(capture, &caster, &Watch::new()).unwrap())
}

/// Layers of the stage's lights at a strength of 1: what photographs show, each lamp, each added
/// light. Only some are traced.
fn layers(stage: &Stage, views: &Views, recovered: bool, added: &[usize]) -> Vec<Vec<Radiance>> {
    let unit = |light: &AddedLight| AddedLight { emission: [1.0; 3], ..light.clone() };
    let lights = stage.edits.lights.iter().map(|light| Arc::new(Added::new(&unit(light))));
    let grid = Arc::new(IrradianceGrid::new(views, &stage.solved));
    let uses = [1, 2].map(|layer| Use { factor: 1.0, layer, importance: 1.0 });
    let lamps = Recovered::used(grid, views.capture, &stage.solved, &uses);
    let geometry = Geometry::new(views.capture, &stage.solved, &stage.edits);
    let places = [view().position.as_vec3()];
    let mut scene = Scene::lit_by(
        Arc::new(lamps),
        lights.collect(),
        views,
        &geometry,
        &stage.solved,
        &stage.edits,
        &places,
    );
    (scene.layer_of_added, scene.layers, scene.original_light) = (vec![3, 4, 5], 6, 1.0);
    let pixels = view().width * view().height;
    let mut films = vec![LightFilm::new(pixels, 3, 0)];
    films.extend((0..3).map(|_| LightFilm::new(pixels, 1, 0)));
    let ranges = [0..3, 3..4, 4..5, 5..6];
    let sought = Sought { recovered, added: added.to_vec() };
    for upto in [4, 8] {
        let mut exposures: Vec<Exposure> = films
            .iter_mut()
            .zip(ranges.clone())
            .map(|(film, layers)| Exposure { film, layers })
            .collect();
        let pass =
            Pass { scene: &scene, camera: &view(), options: &stage.options, sought: &sought, upto };
        pass.trace(&mut SurfaceFilm::new(pixels), &mut exposures, &Watch::new()).unwrap();
    }
    films.iter().flat_map(|film| (0..film.layers()).map(|layer| film.layer(layer))).collect()
}

#[test]
fn layers_add_up_to_the_whole_picture() {
    let stage = stage();
    with(&stage, |views| {
        let layers = layers(&stage, views, true, &[0, 1, 2]);
        assert!(layers.iter().all(|layer| layer.iter().flatten().any(|&value| value > 0.0)));
        let whole = stage.film(&view()).beauty();
        for (pixel, whole) in whole.iter().enumerate() {
            for c in 0..3 {
                let recovered: f32 = layers[..3].iter().map(|layer| layer[pixel][c]).sum();
                let added = layers[3..].iter().zip(&stage.edits.lights);
                let added: f32 =
                    added.map(|(layer, light)| layer[pixel][c] * light.emission[c] as f32).sum();
                let sum = recovered + added;
                assert!((sum - whole[c]).abs() <= 2e-5 * whole[c], "{sum}, not {}", whole[c]);
            }
        }
    });
}

#[test]
fn a_layer_does_not_know_what_else_is_traced() {
    let stage = stage();
    with(&stage, |views| {
        let all = layers(&stage, views, true, &[0, 1, 2]);
        let recovered = layers(&stage, views, true, &[]);
        assert!(all[..3] == recovered[..3]);
        for light in 0..3 {
            assert!(all[3 + light] == layers(&stage, views, false, &[light])[3 + light]);
        }
    });
}

#[test]
fn a_stronger_light_is_its_layer_times_a_number() {
    let mut strong = stage();
    strong.edits.lights[0].emission = [30.0, 1.0, 7.0];
    let (weak, strong) = (stage().film(&view()), strong.film(&view()));
    assert!(weak.layer(2) == strong.layer(2) && weak.layer(0) == strong.layer(0));
    for (weak, strong) in weak.layer(1).iter().zip(strong.layer(1)) {
        for (c, factor) in [10.0, 0.5, 7.0].into_iter().enumerate() {
            assert!((weak[c] * factor - strong[c]).abs() <= 1e-5 * strong[c]);
        }
    }
}

fn ask(preview: &mut Preview, camera: Camera, edits: &Edits) {
    preview.ask(Asked { edits: Arc::new(edits.clone()), camera, photograph: None, before: false });
}

fn finished(preview: &mut Preview) -> Picture {
    loop {
        match preview.plan() {
            Some(plan) => preview.trace(&plan, &Watch::new()).unwrap(),
            None => return preview.picture().unwrap(),
        }
    }
}

fn mean(picture: &Picture) -> [f64; 3] {
    let count = picture.after.len() as f64;
    std::array::from_fn(|c| {
        picture.after.iter().map(|(radiance, _)| f64::from(radiance[c])).sum::<f64>() / count
    })
}

#[track_caller]
fn is(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let near = found.iter().zip(expected).all(|(f, e)| (f - e).abs() <= tolerance * e.abs());
    assert!(near, "{found:?}, not {expected:?}");
}

/// A lamp at height h over a floor sends ρ/π I/h² straight down from there.
#[test]
fn strengths_and_colours_follow_closed_forms_and_trace_nothing() {
    let point = Emitter::Point { position: Vec3::new(0.0, 0.0, 2.0) };
    let sun = Emitter::Sun { direction: Vec3::NEG_Z, angular_diameter: 1e-3 };
    let stage = floor(reflectance(0.5, 0.0, 1.0)).light(point, [8.0; 3]).light(sun, [1.0; 3]);
    // The floor's own reflection in the lamp's surroundings is none.
    let camera = needle(DVec3::new(0.011, -0.012, 0.02), DVec3::ZERO);
    with(&stage, |views| {
        let mut preview = Preview::new(views, &stage.solved);
        ask(&mut preview, camera, &stage.edits);
        is(mean(&finished(&mut preview)), [0.5 / PI * (8.0 / 4.0 + 1.0); 3], 1e-4);
        for (of_point, of_sun) in
            [([80.0; 3], [1.0; 3]), ([0.0; 3], [2.0; 3]), ([1.0, 4.0, 0.0], [0.0; 3])]
        {
            let mut edits = stage.edits.clone();
            (edits.lights[0].emission, edits.lights[1].emission) = (of_point, of_sun);
            ask(&mut preview, camera, &edits);
            let picture = preview.picture().unwrap();
            assert_eq!(picture.traced, 0);
            let expected = |c: usize| 0.5 / PI * (of_point[c] / 4.0 + of_sun[c]);
            is(mean(&picture), std::array::from_fn(expected), 1e-4);
        }
    });
}

/// The processor, taken to be as fast as is said, with a count of what it is asked for.
struct Counted {
    at_once: usize,
    passes: AtomicUsize,
}

impl Counted {
    fn new(at_once: usize) -> Arc<Self> {
        Arc::new(Self { at_once, passes: AtomicUsize::new(0) })
    }
}

impl Tracer for Counted {
    fn name(&self) -> String {
        "counted".to_owned()
    }

    fn paths_at_once(&self, _: usize) -> usize {
        self.at_once
    }

    fn trace(
        &self,
        pass: &Pass,
        surfaces: &mut SurfaceFilm,
        exposures: &mut [Exposure],
        watch: &Watch,
    ) -> Result<(), Cancelled> {
        self.passes.fetch_add(1, Ordering::Relaxed);
        pass.trace(surfaces, exposures, watch)
    }
}

/// With a fast tracer pictures between the first and the last are passed over, and the last one is
/// the same.
#[test]
fn a_fast_tracer_shows_fewer_pictures_on_the_way() {
    let stage = stage();
    with(&stage, |views| {
        let [(expected, slow), (found, fast)] = [4, 200].map(|at_once| {
            let tracer = Counted::new(at_once);
            let mut preview = Preview::by(tracer.clone(), views, &stage.solved);
            ask(&mut preview, view(), &stage.edits);
            (finished(&mut preview), tracer.passes.load(Ordering::Relaxed))
        });
        assert_eq!((found.paths, found.tracer.as_str()), (expected.paths, "counted"));
        is(mean(&found), mean(&expected), 1e-5);
        assert!(2 * fast <= slow, "{fast} passes, and {slow}");
    });
}

#[test]
fn a_moved_light_leaves_the_other_layers_as_they_are() {
    let stage = stage();
    with(&stage, |views| {
        let mut preview = Preview::new(views, &stage.solved);
        let without = |edits: &Edits| {
            let mut edits = edits.clone();
            edits.lights[1].emission = [0.0; 3];
            edits
        };
        let mut edits = stage.edits.clone();
        ask(&mut preview, view(), &edits);
        let first = finished(&mut preview);
        ask(&mut preview, view(), &without(&edits));
        let others = preview.picture().unwrap();
        assert!(others.after != first.after && others.traced == 0);
        edits.lights[1].shape =
            Shape::Emitter(Emitter::Point { position: Vec3::new(1.2, 0.3, 0.9) });
        ask(&mut preview, view(), &edits);
        // Its place has changed, so there is no picture yet; then a coarse one of it alone.
        assert!(preview.picture().is_none());
        let moved = finished(&mut preview);
        assert!(moved.after != first.after);
        ask(&mut preview, view(), &without(&edits));
        let again = preview.picture().unwrap();
        assert_eq!(again.traced, 0);
        assert!(again.after == others.after);
        // It is what a session that begins there finds.
        let mut fresh = Preview::new(views, &stage.solved);
        ask(&mut fresh, view(), &edits);
        let fresh = mean(&finished(&mut fresh));
        is(mean(&moved), fresh, 5e-3);
    });
}

/// Groups and the whole of the recovered light, as rendered anew.
#[test]
fn groups_are_turned_up_and_down_without_a_path() {
    let stage = stage();
    with(&stage, |views| {
        let mut preview = Preview::new(views, &stage.solved);
        ask(&mut preview, view(), &stage.edits);
        finished(&mut preview);
        let mut edits = stage.edits.clone();
        edits.groups = [("lamp 1".to_owned(), 0.0), ("lamp 2".to_owned(), 5.0)].into();
        edits.original_light = 0.5;
        ask(&mut preview, view(), &edits);
        let picture = preview.picture().unwrap();
        assert_eq!(picture.traced, 0);
        let film = Stage { edits, ..stage.clone() }.spp(1024).film(&view()).beauty();
        let count = film.len() as f64;
        let expected: [f64; 3] =
            std::array::from_fn(|c| film.iter().map(|p| f64::from(p[c])).sum::<f64>() / count);
        is(mean(&picture), expected, 5e-3);
    });
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let stage = stage();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            with(&stage, |views| {
                let mut preview = Preview::new(views, &stage.solved);
                ask(&mut preview, view(), &stage.edits);
                finished(&mut preview).after
            })
        })
    };
    assert!(on(1) == on(2));
}

#[test]
fn what_was_cancelled_goes_on_where_it_was() {
    let stage = stage();
    with(&stage, |views| {
        let mut whole = Preview::new(views, &stage.solved);
        ask(&mut whole, view(), &stage.edits);
        let whole = finished(&mut whole);
        let mut preview = Preview::new(views, &stage.solved);
        ask(&mut preview, view(), &stage.edits);
        let mut cancelled = 0;
        while let Some(plan) = preview.plan() {
            // It is cancelled once its first strip is begun, and then let run.
            let (watch, over) = (Watch::new(), AtomicBool::new(false));
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    while watch.progress().done == 0 && !over.load(Ordering::Relaxed) {
                        std::thread::yield_now();
                    }
                    watch.cancel();
                });
                cancelled += usize::from(preview.trace(&plan, &watch).is_err());
                over.store(true, Ordering::Relaxed);
            });
            if let Some(plan) = preview.plan() {
                preview.trace(&plan, &Watch::new()).unwrap();
            }
        }
        let picture = preview.picture().unwrap();
        assert!(picture.after == whole.after, "after {cancelled} were cancelled");
    });
}

/// Lights beyond what there is memory for share a layer, and the picture is the same.
#[test]
fn memory_is_bounded() {
    let mut stage = stage();
    for k in 0..12 {
        let position = Vec3::new(0.2 * k as f32 - 1.0, 0.3, 1.0);
        stage = stage.light(Emitter::Point { position }, [0.05; 3]);
    }
    with(&stage, |views| {
        let mut roomy = Preview::new(views, &stage.solved);
        ask(&mut roomy, view(), &stage.edits);
        let expected = mean(&finished(&mut roomy));
        let mut preview = Preview::new(views, &stage.solved);
        preview.most_bytes = 350 * view().width * view().height;
        assert!(roomy.bytes() > preview.most_bytes);
        let mut edits = stage.edits.clone();
        ask(&mut preview, view(), &edits);
        is(mean(&finished(&mut preview)), expected, 5e-3);
        for k in 0..8 {
            // Whichever is changed gets a layer of its own, and another one gives its up.
            edits.lights[3 + k].emission = [0.1; 3];
            ask(&mut preview, view(), &edits);
            finished(&mut preview);
            edits.lights[3 + k].emission = [0.2; 3];
            ask(&mut preview, view(), &edits);
            assert_eq!(preview.picture().unwrap().traced, 0);
            edits.lights[3 + k].emission = [0.05; 3];
            assert!(preview.bytes() <= preview.most_bytes, "{}", preview.bytes());
        }
    });
}

/// The scene without edits is in the same layers, or in one of its own where objects or materials
/// are edited.
#[test]
fn the_picture_before_is_that_without_edits() {
    let stage = stage();
    with(&stage, |views| {
        let mut plain = Preview::new(views, &stage.solved);
        ask(&mut plain, view(), &Edits::default());
        let plain = finished(&mut plain);
        let mut painted = stage.edits.clone();
        let change = Override { diffuse: Some([0.1, 0.5, 0.2]), ..Override::default() };
        painted.materials.insert("floor".into(), change);
        let mut preview = Preview::new(views, &stage.solved);
        for edits in [&stage.edits, &painted] {
            preview.ask(Asked {
                edits: Arc::new(edits.clone()),
                camera: view(),
                photograph: None,
                before: true,
            });
            let picture = finished(&mut preview);
            let before = Picture { after: picture.before.clone().unwrap(), ..picture.clone() };
            is(mean(&before), mean(&plain), 5e-3);
            assert!(picture.after != before.after);
        }
    });
}
