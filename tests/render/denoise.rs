use glam::{DVec3, Vec3};
use lobelia::render::RenderOptions;
use lobelia::render::film::Film;
use lobelia::scene::{Camera, Emitter};

use crate::rooms::{Room, camera};
use crate::stage::{Stage, ceiling, reflectance};

/// A floor with a shadow and the grey surroundings' light, which is noisy.
fn stage() -> Stage {
    let mut room = Room::default();
    let (floor, wall) = (room.diffuse("floor"), room.diffuse("wall"));
    room.square(floor, 5.0, 0.0);
    room.square(wall, 0.3, 0.3);
    let mut stage = Stage::new(room, &[reflectance(0.4, 0.0, 1.0), reflectance(0.7, 0.0, 1.0)])
        .light(ceiling([-0.5, 0.5], [-0.5, 0.5], 1.5), [3.0, 2.0, 1.0])
        .light(Emitter::Point { position: Vec3::new(1.3, 0.2, 0.8) }, [0.2; 3])
        .most(4);
    stage.edits.surroundings = lobelia::render::edits::Surroundings::Auto;
    stage
}

fn view() -> Camera {
    camera((80, 60), 0.9, DVec3::new(1.0, -1.8, 1.2), DVec3::ZERO)
}

fn with_denoise(stage: Stage) -> Film {
    let denoised = RenderOptions { denoise: true, ..stage.options };
    Stage { options: denoised, ..stage }.film(&view())
}

/// Relative difference of two pictures, root mean square, and of their means.
fn apart(film: &Film, truth: &Film) -> (f64, f64) {
    let (a, b) = (film.beauty(), truth.beauty());
    let (mut squares, mut sum, mut all) = (0.0f64, 0.0f64, 0.0f64);
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        squares += f64::from(a - b).powi(2);
        sum += f64::from(a - b);
        all += f64::from(*b);
    }
    let count = (3 * a.len()) as f64;
    ((squares / count).sqrt() / (all / count), sum / all)
}

#[test]
fn most_of_the_noise_goes_and_the_light_stays() {
    let truth = stage().spp(1024).film(&view());
    // Root mean squares over a few seeds: one path in thousands meets a light's bright surroundings.
    // Twelve paths leave a tenth of the light as noise.
    let (mut noisy, mut clean) = (0.0, 0.0);
    for seed in 1..=6 {
        let mut few = stage().spp(12);
        few.options.seed = seed;
        noisy += apart(&few.film(&view()), &truth).0.powi(2) / 6.0;
        let (error, mean) = apart(&with_denoise(few), &truth);
        clean += error.powi(2) / 6.0;
        assert!(mean.abs() < 0.01, "the light changed by {mean}");
    }
    let (noisy, clean) = (noisy.sqrt(), clean.sqrt());
    assert!(noisy > 0.02, "there is too little noise to tell: {noisy}");
    assert!(clean < 0.6 * noisy, "{clean} of {noisy} is left");
}

#[test]
fn layers_still_add_up_and_nothing_else_changes() {
    let (raw, film) = (stage().spp(16).film(&view()), with_denoise(stage().spp(16)));
    let sum: Vec<f32> = (0..film.layers()).fold(vec![0.0; 3 * 80 * 60], |sum, layer| {
        sum.iter().zip(film.layer(layer).iter().flatten()).map(|(a, b)| a + b).collect()
    });
    for (sum, beauty) in sum.iter().zip(film.beauty().iter().flatten()) {
        assert!((sum - beauty).abs() <= 1e-5 * beauty, "{sum} is not {beauty}");
    }
    assert_eq!(film.albedo(), raw.albedo());
    assert_eq!(film.coverage(), raw.coverage());
    assert_ne!(film.direct(), raw.direct());
}

/// Without noise there is nothing to smooth: a point light's shadows keep their edges.
#[test]
fn edges_of_hard_shadows_stay() {
    let lit = || {
        let mut stage = stage().most(1).spp(16);
        stage.edits.lights.remove(0);
        stage.edits.surroundings = lobelia::render::edits::Surroundings::Open;
        stage
    };
    let truth = lit().spp(512).film(&view());
    let (raw, _) = apart(&lit().film(&view()), &truth);
    let (error, _) = apart(&with_denoise(lit()), &truth);
    // What is left are the pixels that the shadow's edge runs through.
    assert!(error < 1.2 * raw.max(0.01), "{error} after {raw}");
}
