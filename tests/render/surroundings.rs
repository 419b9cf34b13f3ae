use glam::{DVec3, Vec3};
use lobelia::reconstruct::lights::VirtualLight;
use lobelia::reconstruct::lobes::Lobe;
use lobelia::render::edits::Surroundings;
use lobelia::scene::{Camera, Emitter, Photograph};

use crate::rooms::{Room, camera};
use crate::stage::{Stage, ceiling, reflectance};

/// A floor with a box on it under a panel, in no room.
fn open() -> Stage {
    let mut room = Room::default();
    let (floor, sides) = (room.diffuse("floor"), room.diffuse("box"));
    room.square(floor, 1.0, 0.0);
    room.open_box(sides, DVec3::new(-0.3, -0.3, 0.0), DVec3::new(0.2, 0.2, 0.4));
    let reflectances = [reflectance(0.5, 0.0, 1.0), reflectance(0.3, 0.4, 20.0)];
    let mut stage = Stage::new(room, &reflectances)
        .light(ceiling([-0.3, 0.5], [-0.2, 0.3], 1.5), [2.0; 3])
        .light(Emitter::Point { position: Vec3::new(0.6, -0.5, 0.9) }, [1.0; 3]);
    stage.solved.light.lights.lights.push(VirtualLight::lamp(Vec3::new(0.0, 1.0, 1.0), 0.1));
    stage.solved.light.lobes.lobes.push(Lobe { light: 0, direction: Vec3::Z, exponent: 0.0 });
    stage.solved.light.lobes.first.push(1);
    stage.solved.light.emission.push([5.0; 3]);
    stage
}

fn view() -> Camera {
    camera((24, 18), 0.9, DVec3::new(1.5, -1.8, 1.2), DVec3::new(0.0, 0.0, 0.2))
}

fn within(mut stage: Stage, surroundings: Surroundings) -> Stage {
    stage.edits.surroundings = surroundings;
    stage
}

/// Sum of the added light over the picture.
fn added(stage: &Stage) -> f64 {
    let film = stage.film(&view());
    let layers = (1..film.layers()).flat_map(|layer| film.layer(layer));
    layers.flatten().map(f64::from).sum()
}

#[test]
fn black_surroundings_are_none() {
    let none = open().film(&view());
    let black = within(open(), Surroundings::Albedo(0.0)).film(&view());
    for layer in 0..3 {
        assert_eq!(none.layer(layer), black.layer(layer));
    }
}

#[test]
fn what_comes_back_grows_with_their_albedo() {
    let sums: Vec<f64> = [0.0, 0.25, 0.5, 0.75, 1.0]
        .map(|albedo| added(&within(open(), Surroundings::Albedo(albedo))))
        .to_vec();
    assert!(sums.windows(2).all(|pair| pair[1] > 1.02 * pair[0]), "{sums:?}");
    // A grey room returns more than a tenth of what falls on things, and no more than it all.
    assert!(sums[2] > 1.1 * sums[0] && sums[2] < 2.0 * sums[0], "{sums:?}");
    assert_eq!(sums[2], added(&within(open(), Surroundings::Auto)));
}

#[test]
fn recovered_light_never_comes_back_from_them() {
    let layer = |surroundings| within(open(), surroundings).film(&view()).layer(0);
    let none = layer(Surroundings::Open);
    assert!(none.iter().flatten().any(|&value| value > 0.0));
    assert_eq!(none, layer(Surroundings::Albedo(0.9)));
}

#[test]
fn a_closed_room_does_not_see_them() {
    let mut room = Room::default();
    let wall = room.diffuse("wall");
    room.open_box(wall, DVec3::ZERO, DVec3::new(2.0, 3.0, 2.5));
    room.rectangle(wall, DVec3::ZERO, DVec3::Y * 3.0, DVec3::X * 2.0);
    let stage = Stage::new(room, &[reflectance(0.6, 0.2, 10.0)])
        .light(ceiling([0.5, 1.0], [1.0, 2.0], 2.0), [2.0; 3]);
    let view = camera((24, 18), 0.9, DVec3::new(0.3, 0.4, 1.2), DVec3::new(1.5, 2.5, 0.8));
    let film = |surroundings| within(stage.clone(), surroundings).film(&view).beauty();
    assert_eq!(film(Surroundings::Open), film(Surroundings::Albedo(1.0)));
}

/// A picture does not depend on which others are made with it.
#[test]
fn photographs_are_taken_within_them() {
    let mut stage = within(open(), Surroundings::Albedo(0.5));
    let photograph = Photograph { name: "p".into(), camera: view(), image: None, display: None };
    stage.room.capture.photographs.push(photograph);
    let inner = camera((24, 18), 0.9, DVec3::new(0.9, -0.9, 0.6), DVec3::ZERO);
    let [among, _] = stage.films(&[inner, view()]).try_into().unwrap();
    assert!(among.beauty() == stage.film(&inner).beauty());
}

/// Around an unlit side there is light from the room alone, as much as its walls get at most.
#[test]
fn a_hidden_side_is_lit_by_them_alone() {
    let mut room = Room::default();
    let sheet = room.diffuse("sheet");
    room.square(sheet, 0.5, 0.0);
    let stage = Stage::new(room, &[reflectance(0.5, 0.0, 1.0)])
        .light(Emitter::Point { position: Vec3::new(0.0, 0.0, 0.5) }, [1.0; 3]);
    let below = |surroundings| {
        let stage = within(stage.clone(), surroundings).spp(256);
        stage.radiance(DVec3::new(0.1, 0.05, -0.3), DVec3::new(0.1, 0.05, 0.0))[0]
    };
    assert_eq!(below(Surroundings::Open).mean, 0.0);
    let lit = below(Surroundings::Albedo(0.5));
    assert!(lit.mean > 20.0 * lit.error, "{lit:?}");
}
