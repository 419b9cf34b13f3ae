//! The tracer of graphics cards beside that of the processor, on an adapter in software: the same
//! means within the noise, layer by layer, and the same surfaces.

use std::sync::{Arc, LazyLock};

use glam::{DAffine3, DVec3, Vec3};
use lobelia::gpu::{Adapters, Card};
use lobelia::math::rgb::Radiance;
use lobelia::render::denoise::denoised;
use lobelia::render::edits::{AddedLight, Object, Override, Shape, Surroundings};
use lobelia::render::film::Film;
use lobelia::render::tracer::{Processor, Tracer};
use lobelia::render::{RenderOptions, render, render_by};
use lobelia::scene::{Brdf, Camera, Distortion, Dome, Emitter, Image, Optics};
use lobelia::watch::Watch;

use crate::recovered::{KINDS, add, corner};
use crate::rooms::{bent_camera, camera};
use crate::stage::{Estimate, Stage, ceiling, reflectance};

/// Found once; without one the tests fail, since a machine that runs them has Mesa's.
static CARD: LazyLock<Card> =
    LazyLock::new(|| Card::find(Adapters::Software).expect("Mesa's lavapipe is installed"));

/// Films of both tracers with seeds of their own.
fn films(stage: &Stage, view: &Camera) -> [Film; 2] {
    let own = |seed| RenderOptions { seed, ..stage.options };
    let watch = Watch::new();
    stage.with(&[view.position.as_vec3()], |scene| {
        let processor = render(scene, view, &own(11), &watch, &|_| {}).unwrap();
        let card = render_by(&*CARD, scene, view, &own(12), &watch, &|_| {}).unwrap();
        assert_eq!(CARD.trouble(), None);
        assert_eq!(processor.paths, card.paths);
        [processor, card]
    })
}

/// Mean over the pixels of b − a.
fn difference(a: &[Radiance], b: &[Radiance], channel: usize) -> Estimate {
    let pixels = a.iter().zip(b);
    let values = pixels.map(|(a, b)| f64::from(b[channel]) - f64::from(a[channel]));
    Estimate::of(&values.collect::<Vec<f64>>())
}

/// Light and surfaces are the same in both. Of each layer the mean over all pixels and over each
/// of 16 blocks of them is compared: `least` is the relative standard error of the first. Of the
/// surfaces, the part `alike` of the pixels has to be the same.
#[track_caller]
fn agree(stage: &Stage, view: &Camera, least: f64, alike: f64) {
    let [processor, card] = films(stage, view);
    let lit = (0..=processor.layers()).filter(|&layer| {
        let of =
            |film: &Film| if layer < film.layers() { film.layer(layer) } else { film.direct() };
        let (a, b) = (of(&processor), of(&card));
        let mut is_lit = false;
        for channel in 0..3 {
            let level =
                a.iter().map(|pixel| f64::from(pixel[channel])).sum::<f64>() / a.len() as f64;
            let Estimate { mean, error } = difference(&a, &b, channel);
            let told = format!("layer {layer}, channel {channel}: {mean} ± {error} beside {level}");
            assert!(mean.abs() <= 3.5 * error + 2e-5 * level, "{told}");
            assert!(error <= least * level || level == 0.0, "tells nothing of {told}");
            is_lit |= level > 0.0;
            for block in 0..16 {
                let within = |pixels: &[Radiance]| -> Vec<Radiance> {
                    let (width, height) = (view.width, view.height);
                    let of = |(index, pixel): (usize, &Radiance)| {
                        let (x, y) = (4 * (index % width) / width, 4 * (index / width) / height);
                        (4 * y + x == block).then_some(*pixel)
                    };
                    pixels.iter().enumerate().filter_map(of).collect()
                };
                let Estimate { mean, error } = difference(&within(&a), &within(&b), channel);
                assert!(
                    mean.abs() <= 5.0 * error + 1e-4 * level,
                    "block {block}, {mean} ± {error}, of {told}"
                );
            }
        }
        is_lit
    });
    assert!(lit.count() > 1, "there is light");
    let pixels = view.width * view.height;
    let close = |a: f32, b: f32| (a - b).abs() <= 1e-3 * a.abs().max(1e-2);
    let same = |a: &[Radiance], b: &[Radiance]| {
        a.iter().zip(b).filter(|(a, b)| a.iter().zip(*b).all(|(a, b)| close(*a, *b))).count()
    };
    // Beside edges pixels see each of two surfaces by other parts.
    let most = (alike * pixels as f64) as usize;
    assert!(same(&processor.normal(), &card.normal()) >= most);
    assert!(same(&processor.albedo(), &card.albedo()) >= most);
    let (far, found) = (processor.distance_m(), card.distance_m());
    let near = far.iter().zip(&found).filter(|(a, b)| (**a - **b).abs() <= 0.02 * a.max(1e-2));
    assert!(near.count() >= most);
    let (known, found) = (processor.object_coverage(), card.object_coverage());
    assert!(known.iter().zip(&found).filter(|(a, b)| close(**a, **b)).count() >= most);
}

fn view() -> Camera {
    camera((48, 40), 1.1, DVec3::new(0.9, -1.7, 1.3), DVec3::new(0.0, 0.6, 0.6))
}

/// Every kind of recovered light together, over all reflections, with and without a mirror.
#[test]
fn recovered_light_is_that_of_the_processor() {
    let mut stage = corner().most(16).spp(32);
    KINDS.iter().for_each(|kind| add(&mut stage, kind));
    stage.edits.original_light = 0.7;
    agree(&stage, &view(), 0.05, 0.9);
    stage.solved.optics = vec![Optics::Opaque, Optics::Opaque, Optics::Mirror([0.9, 0.7, 0.5])];
    agree(&stage, &view(), 0.05, 0.9);
}

fn added() -> Stage {
    let mut stage = corner().most(16).spp(32);
    stage.edits.surroundings = Surroundings::Albedo(0.5);
    let position = Vec3::new(0.7, -0.6, 1.4);
    stage
        .light(ceiling([0.2, 0.9], [-0.9, 0.1], 1.9), [3.0, 2.0, 1.0])
        .light(Emitter::Sphere { center: Vec3::new(-0.8, 0.2, 0.9), radius_m: 0.15 }, [9.0; 3])
        .light(Emitter::Point { position }, [1.0, 0.5, 0.2])
        .light(
            Emitter::Spot {
                position,
                direction: Vec3::new(-0.5, 0.6, -0.6).normalize_or_zero(),
                inner_angle: 0.3,
                outer_angle: 0.8,
            },
            [2.0; 3],
        )
        .light(
            Emitter::Sun {
                direction: Vec3::new(0.3, 0.5, -0.8).normalize_or_zero(),
                angular_diameter: 0.05,
            },
            [1.5, 1.4, 1.0],
        )
}

fn sky() -> AddedLight {
    let (width, height) = (24, 12);
    let texel = |k: usize| {
        let (x, y) = (k % width, k / width);
        [0.2 + x as f32 / 24.0, if (x, y) == (5, 3) { 60.0 } else { 0.5 }, y as f32 / 12.0]
    };
    let image = Image::new(width, height, (0..width * height).map(texel).collect(), None);
    let dome = Dome { turn: 0.7, ..Dome::new(Arc::new(image), 1.3) };
    AddedLight {
        name: "sky".into(),
        shape: Shape::Dome(dome),
        emission: [0.5, 1.0, 2.0],
        is_on: true,
    }
}

/// Every kind of added light, within and without surroundings, on a diffuse floor, a glossy wall,
/// a coated box and an object.
#[test]
fn added_light_is_that_of_the_processor() {
    let mut stage = added();
    stage.solved.reflectances[2] = Some(Brdf { coat: Some(0.2), ..Brdf::diffuse([0.3, 0.2, 0.1]) });
    let mut mesh = (*stage.room.capture.mesh).clone();
    mesh.surface.fill(0);
    stage.edits.objects.push(Object {
        name: "small".into(),
        file: Default::default(),
        mesh: Arc::new(mesh.into()),
        surfaces: vec![("paint".into(), reflectance(0.2, 0.5, 60.0))],
        world_from_object: DAffine3::from_translation(DVec3::new(0.6, -0.4, 0.1))
            * DAffine3::from_scale(DVec3::splat(0.15)),
    });
    agree(&stage, &view(), 0.1, 0.9);
    stage.edits.surroundings = Surroundings::Open;
    stage.edits.lights.push(sky());
    stage.edits.lights[1].is_on = false;
    let paint = Override { diffuse: Some([0.1, 0.8, 0.4]), ..Override::default() };
    stage.edits.materials.insert("floor".into(), paint);
    agree(&stage, &view(), 0.05, 0.9);
}

/// Clear glass under a sky, seen through a lens.
#[test]
fn glass_and_lenses_are_those_of_the_processor() {
    let mut stage = corner().most(16).spp(32);
    add(&mut stage, "sky");
    add(&mut stage, "lamp");
    stage.edits.lights.push(sky());
    stage.solved.optics = vec![Optics::Opaque, Optics::Opaque, Optics::Glass];
    let distortion = Distortion {
        radial: [-0.2, 0.05, 0.0, 0.0],
        tangential: [1e-3, -2e-3],
        ..Distortion::default()
    };
    let (eye, target) = (DVec3::new(0.9, -1.7, 1.3), DVec3::new(0.0, 0.6, 0.6));
    // What glass shows of itself is chosen at random.
    agree(&stage, &bent_camera((48, 40), 1.1, eye, target, distortion), 0.05, 0.6);
}

/// Surfaces that shine as photographs show them, and a light on a surface that no photograph shows,
/// by which light that is reflected there is counted already.
#[test]
fn light_of_photographs_is_that_of_the_processor() {
    let mut stage = corner().most(16).spp(32);
    let panel = stage.room.untagged("panel");
    let corner = DVec3::new(-1.6, 1.2, 0.4);
    stage.room.rectangle(panel, corner, DVec3::X * 0.8, DVec3::Z * 0.9);
    for (eye, target) in [
        (DVec3::new(0.2, -1.9, 1.4), DVec3::new(-0.5, 1.0, 0.6)),
        (DVec3::new(-1.8, -1.5, 1.0), DVec3::new(-0.5, 1.0, 0.5)),
    ] {
        let seen = camera((64, 48), 0.9, eye, target);
        stage.room.photograph(seen, |_| [3.0, 2.0, 1.0]);
    }
    add(&mut stage, "surface");
    agree(&stage, &view(), 0.05, 0.9);
}

/// The filter is the same, up to rounding, in pictures whose sides are no multiples of a group's.
#[test]
fn noise_is_taken_out_as_by_the_processor() {
    let mut stage = added().spp(6);
    add(&mut stage, KINDS.first().expect("there are kinds of light"));
    let view = camera((83, 61), 1.1, DVec3::new(0.9, -1.7, 1.3), DVec3::new(0.0, 0.6, 0.6));
    let noisy = stage.film(&view);
    let (processor, card) = (denoised(&noisy, &Processor), denoised(&noisy, &*CARD));
    assert_eq!(CARD.trouble(), None);
    for layer in 0..noisy.layers() {
        let [before, a, b] = [&noisy, &processor, &card].map(|film| film.layer(layer));
        let mean = a.iter().flatten().sum::<f32>() / a.len() as f32;
        let apart = |a: &[Radiance], b: &[Radiance]| {
            let pairs = a.iter().flatten().zip(b.iter().flatten());
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        let off = apart(&a, &b);
        assert!(off <= 1e-3 * mean, "layer {layer} is off by {off} of {mean}");
        assert!(mean == 0.0 || apart(&a, &before) > 0.1 * mean, "there was no noise to take out");
    }
}
