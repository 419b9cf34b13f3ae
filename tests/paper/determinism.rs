//! The same capture and options give the same bytes on any number of threads.

use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::Reconstruction;

use crate::rooms::{Room, box_room, quick, run};

fn on_threads(count: usize, room: &Room, seed: usize) -> Reconstruction {
    let mut options = quick();
    options.general.seed = seed;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
    pool.install(|| run(room, &options)).unwrap()
}

/// Everything that a result consists of, as bits, so that even zeros' signs must agree.
fn bits(result: &Reconstruction) -> Vec<(&'static str, Vec<u64>)> {
    let single = |values: &mut dyn Iterator<Item = f32>| {
        values.map(|value| u64::from(value.to_bits())).collect::<Vec<_>>()
    };
    let double = |values: &mut dyn Iterator<Item = Rgb>| {
        values.flatten().map(f64::to_bits).collect::<Vec<_>>()
    };
    let coupling = &result.transport.coupling;
    vec![
        (
            "positions",
            single(&mut result.samples.samples.iter().flat_map(|s| s.position.to_array())),
        ),
        ("radiances", single(&mut result.samples.samples.iter().flat_map(|s| s.radiance))),
        ("lights", single(&mut result.lights.lights.iter().flat_map(|l| l.position.to_array()))),
        ("lobes", single(&mut result.lobes.lobes.iter().flat_map(|l| l.direction.to_array()))),
        ("irradiance", single(&mut result.transport.irradiance.iter().copied().flatten())),
        (
            "coupling",
            (0..coupling.ncols())
                .flat_map(|j| (0..coupling.nrows()).map(move |i| coupling[(i, j)].to_bits()))
                .collect(),
        ),
        ("emission", double(&mut result.solution.emission.iter().copied())),
        (
            "reflectances",
            double(&mut result.solution.reflectances.iter().flatten().map(|r| r.diffuse)),
        ),
        (
            "texels",
            single(&mut result.textures.iter().flat_map(|t| t.texels.iter().flatten().copied())),
        ),
    ]
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let mut room = box_room();
    room.capture.materials[0].textured = true;
    let one = on_threads(1, &room, 1);
    let two = on_threads(2, &room, 1);
    let five = on_threads(5, &room, 1);
    assert!(!one.textures.is_empty() && one.lobes.lobes.len() > 10);
    for other in [two, five] {
        for ((name, one), (_, other)) in bits(&one).into_iter().zip(bits(&other)) {
            assert!(!one.is_empty(), "no {name}");
            assert!(one == other, "{name} differ");
        }
    }
}

#[test]
fn another_seed_gives_other_samples() {
    let room = box_room();
    let (first, second) = (on_threads(2, &room, 1), on_threads(2, &room, 2));
    let (first, second) = (bits(&first), bits(&second));
    assert_ne!(first[0], second[0]);
    assert_ne!(first[2], second[2]);
}
