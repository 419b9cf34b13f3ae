use std::sync::Arc;

use glam::DVec3;
use lobelia::render::edits::{AddedLight, Shape};
use lobelia::scene::{Brdf, Dome, Image, Optics};

use crate::rooms::{Room, camera};
use crate::stage::{Estimate, Stage};

const RADIANCE: f64 = 2.0;

/// A horizontal pane at z = 0.5 over a floor of a reflectance, under an even sky.
fn pane(optics: Optics, floor: f64) -> Stage {
    let mut room = Room::default();
    let ground = room.diffuse("floor");
    let sheet = room.diffuse("pane");
    room.square(ground, 4.0, 0.0);
    room.square(sheet, 2.0, 0.5);
    let mut stage = Stage::new(room, &[Brdf::diffuse([floor; 3]), Brdf::diffuse([0.0; 3])]);
    stage.solved.optics = vec![Optics::Opaque, optics];
    let image = Image::new(2, 1, vec![[1.0; 3]; 2], None);
    let shape = Shape::Dome(Dome::new(Arc::new(image), RADIANCE as f32));
    stage.edits.lights.push(AddedLight {
        name: "sky".into(),
        shape,
        emission: [1.0; 3],
        is_on: true,
    });
    stage.spp(64)
}

/// Mean radiance of what a narrow camera sees from above under an angle to the vertical.
fn seen(stage: &Stage, degrees: f64) -> Estimate {
    let target = DVec3::new(0.0, 0.0, 0.5);
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let eye = target + 3.0 * DVec3::new(sine, 0.0, cosine);
    let film = stage.film(&camera((24, 24), 40.0, eye, target));
    let values: Vec<f64> = film.beauty().iter().map(|pixel| f64::from(pixel[1])).collect();
    Estimate::of(&values)
}

/// The part that an interface of index 1.5 reflects, by Fresnel's equations for both polarisations.
fn reflected(degrees: f64) -> f64 {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let within = (1.0 - (sine / 1.5).powi(2)).sqrt();
    let across = (cosine - 1.5 * within) / (cosine + 1.5 * within);
    let along = (1.5 * cosine - within) / (1.5 * cosine + within);
    0.5 * (across * across + along * along)
}

#[test]
fn a_mirror_shows_its_part_of_the_sky() {
    let mirror = pane(Optics::Mirror([0.9, 0.7, 0.5]), 0.0);
    let found = seen(&mirror, 30.0);
    assert!((found.mean - 0.7 * RADIANCE).abs() < 1e-4, "{found:?}");
}

/// What lies behind is black: only what Fresnel's equations reflect is left.
#[test]
fn glass_reflects_what_fresnel_says() {
    for degrees in [0.0, 45.0, 75.0] {
        seen(&pane(Optics::Glass, 0.0), degrees).is(reflected(degrees) * RADIANCE, 0.05);
    }
}

/// A white floor under an even sky is as bright as the sky, which light that the pane kept away
/// would change: it passes the pane on its way to the floor, and the camera's ray does as well.
#[test]
fn light_passes_glass_on_its_way_to_a_floor() {
    let opaque = seen(&pane(Optics::Opaque, 1.0), 20.0);
    assert_eq!(opaque.mean, 0.0, "the pane itself is black");
    seen(&pane(Optics::Glass, 1.0), 20.0).is(RADIANCE, 0.01);
    // From below the pane, where the camera sees the floor alone.
    let below = |optics| {
        let stage = pane(optics, 1.0).most(1);
        let eye = DVec3::new(0.3, 0.1, 0.4);
        let film = stage.film(&camera((24, 24), 4.0, eye, DVec3::new(0.0, 0.0, 0.0)));
        let values: Vec<f64> = film.beauty().iter().map(|pixel| f64::from(pixel[0])).collect();
        Estimate::of(&values)
    };
    below(Optics::Glass).is(RADIANCE, 0.01);
    assert!(below(Optics::Opaque).mean < 0.3 * RADIANCE);
}
