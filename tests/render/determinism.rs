use std::sync::Mutex;

use glam::{DVec3, Vec3};
use lobelia::render::film::Film;
use lobelia::render::{RenderOptions, render};
use lobelia::scene::{Camera, Emitter};
use lobelia::watch::{Cancelled, Watch};

use crate::rooms::camera;
use crate::stage::{Stage, ceiling, floor, reflectance};

fn stage() -> Stage {
    let mut stage = floor(reflectance(0.4, 0.3, 20.0))
        .light(ceiling([-0.5, 0.5], [-0.5, 0.5], 1.0), [1.0; 3])
        .light(Emitter::Point { position: Vec3::new(0.3, 0.2, 0.8) }, [1.0; 3]);
    stage.edits.surroundings = lobelia::render::edits::Surroundings::Auto;
    stage
}

fn view() -> Camera {
    camera((20, 15), 0.9, DVec3::new(1.0, -1.8, 1.2), DVec3::ZERO)
}

fn bytes(film: &Film) -> Vec<u32> {
    let layers = (0..film.layers()).flat_map(|layer| film.layer(layer));
    let rest = film.direct().into_iter().chain(film.albedo()).chain(film.normal());
    layers.chain(rest).flatten().chain(film.distance_m()).map(f32::to_bits).collect()
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bytes(&stage().film(&view())))
    };
    let one = on(1);
    assert!(one == on(2) && one == on(5));
}

#[test]
fn another_seed_makes_another_picture_of_the_same_scene() {
    let mut other = stage();
    other.options.seed = 2;
    assert_ne!(bytes(&stage().film(&view())), bytes(&other.film(&view())));
}

/// What is shown after a number of paths is what a picture of that many paths is.
#[test]
fn passes_are_pictures_of_fewer_paths() {
    let (stage, passes) = (stage().spp(10), Mutex::new(Vec::new()));
    let watch = Watch::new();
    stage.with(&[], |scene| {
        let on_pass = |film: &Film| passes.lock().unwrap().push((film.paths, bytes(film)));
        render(scene, &view(), &stage.options, &watch, &on_pass).unwrap()
    });
    let progress = watch.progress();
    assert_eq!(progress.done, progress.total);
    let passes = passes.into_inner().unwrap();
    assert_eq!(passes.iter().map(|pass| pass.0).collect::<Vec<_>>(), [4, 8, 10]);
    for (paths, shown) in passes {
        let whole = stage.with(&[], |scene| {
            let options = RenderOptions { spp: paths, ..stage.options };
            render(scene, &view(), &options, &Watch::new(), &|_| {}).unwrap()
        });
        assert!(shown == bytes(&whole), "{paths}");
    }
}

#[test]
fn a_cancelled_picture_ends() {
    let (stage, watch) = (stage().spp(1_000_000), Watch::new());
    stage.with(&[], |scene| {
        // Before anything, and after the first pass.
        let cancel = watch.clone();
        let on_pass = move |_: &Film| cancel.cancel();
        let ended = render(scene, &view(), &stage.options, &watch, &on_pass);
        assert!(matches!(ended, Err(Cancelled)));
        let again = render(scene, &view(), &stage.options, &watch, &|_| {});
        assert!(matches!(again, Err(Cancelled)));
    });
}

#[test]
fn less_noise_is_asked_for_and_reached() {
    let mut stage = stage().spp(4096);
    stage.options.noise = Some(0.05);
    let film = stage.film(&view());
    assert!(film.paths < 4096 && film.noise().unwrap() <= 0.05);
    // As told from itself, so it is: against a picture of many more paths.
    let many = Stage { options: RenderOptions { noise: None, seed: 77, ..stage.options }, ..stage };
    let many = many.spp(2048).film(&view()).beauty();
    let (mut squares, mut sum) = (0.0, 0.0);
    for (few, many) in film.beauty().iter().flatten().zip(many.iter().flatten()) {
        squares += f64::from(few - many).powi(2);
        sum += f64::from(*many);
    }
    let count = (3 * many.len()) as f64;
    let found = (squares / count).sqrt() / (sum / count);
    assert!((0.5..2.0).contains(&(found / film.noise().unwrap())), "{found}");
}
