use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3};
use lobelia::geometry::mesh::Mesh;
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::lights::{LightKind, VirtualLight};
use lobelia::reconstruct::lobes::Lobe;
use lobelia::reconstruct::textures::Texture;
use lobelia::reconstruct::unwrap::Unwrap;
use lobelia::render::edits::{Object, Override};
use lobelia::scene::{Camera, Emitter, Image, Photograph};

use crate::rooms::{Room, camera};
use crate::stage::{Stage, floor, needle, reflectance};

const SUN: Emitter = Emitter::Sun { direction: Vec3::NEG_Z, angular_diameter: 1e-3 };

/// The value of a picture of one place, which has no noise under a sun straight above.
fn value(stage: &Stage, x: f64, y: f64) -> Rgb {
    let film = stage.film(&needle(DVec3::new(x + 0.2, y - 0.3, 0.9), DVec3::new(x, y, 0.0)));
    film.beauty()[17].map(f64::from)
}

#[track_caller]
fn is(found: Rgb, expected: Rgb) {
    let near = found.iter().zip(expected).all(|(f, e)| (f - e).abs() <= 2e-5 * e.abs() + 1e-12);
    assert!(near, "{found:?}, not {expected:?}");
}

/// A floor whose second triangle lies elsewhere in the texture than the first.
fn textured() -> Stage {
    let mut stage = floor(reflectance(0.5, 0.0, 1.0)).light(SUN, [PI; 3]);
    // Each texel's colour says where it lies.
    let (width, height) = (50, 40);
    let texels = (0..width * height)
        .map(|k| [(k % width) as f32 / 50.0, (k / width) as f32 / 40.0, 0.25])
        .collect();
    let corners = vec![
        [Vec2::new(0.1, 0.2), Vec2::new(0.4, 0.2), Vec2::new(0.4, 0.9)],
        [Vec2::new(0.9, 0.1), Vec2::new(0.6, 0.8), Vec2::new(0.9, 0.8)],
    ];
    let unwrap = Unwrap { triangles: vec![0, 1], corners, width, height, is_own: false };
    let seen = vec![true; width * height];
    Arc::make_mut(&mut stage.solved.textures).push(Texture {
        surface: 0,
        material: 0,
        unwrap,
        texels,
        seen,
    });
    stage
}

#[test]
fn textures_are_looked_up_where_they_lie() {
    let stage = textured();
    let mesh = &stage.room.capture.mesh;
    for (triangle, uvs) in stage.solved.textures[0].unwrap.corners.iter().enumerate() {
        for weights in [[0.2, 0.3, 0.5], [0.7, 0.2, 0.1], [0.1, 0.8, 0.1]] {
            let corners = mesh.corners(triangle);
            let at: Vec3 = corners.iter().zip(weights).map(|(c, w)| *c * w).sum();
            let uv: Vec2 = uvs.iter().zip(weights).map(|(c, w)| *c * w).sum();
            // Texels are linear in their place; row 0 is at the top, v = 1, and a texel's value
            // that of its middle.
            let (column, row) = (uv.x * 50.0 - 0.5, (1.0 - uv.y) * 40.0 - 0.5);
            let expected = [f64::from(column) / 50.0, f64::from(row) / 40.0, 0.25];
            is(value(&stage, at.x.into(), at.y.into()), expected);
        }
    }
    let film = stage.film(&needle(DVec3::new(0.2, -0.3, 0.9), DVec3::ZERO));
    assert_eq!(film.albedo()[5][2], 0.25);
}

#[test]
fn another_diffuse_reflectance_takes_the_place_of_a_texture() {
    let mut stage = textured();
    let mut paint = |change: Override| {
        stage.edits.materials = BTreeMap::from([("floor".to_owned(), change)]);
        value(&stage, 1.0, 1.5)
    };
    let textured = paint(Override::default());
    let gloss = Override { specular: Some([0.1; 3]), exponent: Some(1.0), ..Override::default() };
    let glossy = paint(gloss);
    assert!(glossy.iter().zip(textured).all(|(glossy, before)| *glossy > before));
    let diffuse = Some([0.1, 0.2, 0.3]);
    is(paint(Override { diffuse, ..Override::default() }), [0.1, 0.2, 0.3]);
}

#[test]
fn what_is_not_overridden_stays() {
    let mut stage = floor(reflectance(0.4, 0.3, 20.0)).light(SUN, [1.0; 3]);
    let before = value(&stage, 0.0, 0.0);
    stage.edits.materials.insert("floor".into(), Override::default());
    is(value(&stage, 0.0, 0.0), before);
    let change = Override { specular: Some([0.0; 3]), ..Override::default() };
    stage.edits.materials.insert("floor".into(), change);
    is(value(&stage, 0.0, 0.0), [0.4 / PI; 3]);
}

#[test]
fn an_override_never_makes_more_light_than_there_was() {
    let mut stage = floor(reflectance(0.4, 0.3, 1e6)).light(SUN, [PI; 3]);
    let diffuse = Some([0.9, 0.2, 1.0]);
    let change = Override { diffuse, ..Override::default() };
    stage.edits.materials.insert("floor".into(), change);
    let film = stage.film(&needle(DVec3::new(0.2, -0.3, 0.9), DVec3::ZERO));
    is(film.albedo()[3].map(f64::from), [1.0, 0.5, 1.0]);
}

/// What no photograph shows is taken to be the mean of the rest.
#[test]
fn an_unknown_material_is_the_mean_of_the_known() {
    let mut stage = floor(reflectance(0.4, 0.0, 1.0)).light(SUN, [PI; 3]);
    for name in ["known", "other"] {
        stage.room.diffuse(name);
    }
    let of = |value: f64| Some(reflectance(value, 0.0, 1.0));
    stage.solved.reflectances = vec![None, of(0.2), of(0.6)];
    is(value(&stage, 0.0, 0.0), [0.4; 3]);
}

/// A horizontal square sheet of half-side 0.3 at height 0.5.
fn sheet() -> Object {
    let corner = |x: f32, y: f32| Vec3::new(0.3 * x, 0.3 * y, 0.5);
    let positions =
        vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let mesh = Mesh {
        positions,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        surface: vec![1, 1],
        polygon: vec![0, 0],
        texcoords: Vec::new(),
    };
    let named = |name: &str, diffuse| (name.to_owned(), reflectance(diffuse, 0.0, 1.0));
    Object {
        name: "sheet".into(),
        file: Default::default(),
        mesh: Arc::new(mesh.into()),
        surfaces: vec![named("black", 0.0), named("light", 0.8)],
        world_from_object: DAffine3::IDENTITY,
    }
}

fn recovered_sun() -> (VirtualLight, Lobe) {
    let light = VirtualLight::distant(LightKind::Sun, -Vec3::Z, 1e-3);
    (light, Lobe { light: 0, direction: -Vec3::Z, exponent: 0.0 })
}

#[test]
fn objects_are_lit_and_cast_shadows_of_all_light() {
    let mut stage = floor(reflectance(0.4, 0.0, 1.0)).light(SUN, [PI; 3]).most(1);
    let (light, lobe) = recovered_sun();
    stage.solved.light.lights.lights.push(light);
    stage.solved.light.lobes.lobes.push(lobe);
    stage.solved.light.lobes.first.push(1);
    stage.solved.light.emission.push([2.0 * PI; 3]);
    is(value(&stage, 0.1, 0.0), [1.2; 3]);
    stage.edits.objects.push(sheet());
    let from_aside = |target: DVec3| {
        let film = stage.film(&needle(DVec3::new(2.0, 0.5, 0.3), target));
        (film.beauty()[3].map(f64::from), film.object_coverage()[3])
    };
    let (shadow, object) = from_aside(DVec3::new(0.1, 0.0, 0.0));
    assert_eq!((shadow, object), ([0.0; 3], 0.0));
    let (lit, object) = from_aside(DVec3::new(0.4, 0.0, 0.0));
    is(lit, [1.2; 3]);
    assert_eq!(object, 0.0);
    let above = stage.film(&needle(DVec3::new(0.1, 0.2, 3.0), DVec3::new(0.0, 0.0, 0.5)));
    is(above.beauty()[3].map(f64::from), [2.4; 3]);
    assert_eq!(above.object_coverage()[3], 1.0);
    is(above.albedo()[3].map(f64::from), [0.8; 3]);
    assert!((above.distance_m()[3] - 2.51).abs() < 0.01);
    assert_eq!(above.normal()[3], [0.0, 0.0, 1.0]);
}

/// A glowing square that a photograph shows, above nothing.
fn photographed() -> (Stage, Camera) {
    let mut room = Room::default();
    let glowing = room.untagged("glowing");
    room.square(glowing, 1.0, 0.0);
    let view = camera((40, 30), 1.5, DVec3::new(0.0, -0.5, 2.0), DVec3::ZERO);
    let image = Image::new(40, 30, vec![[0.5, 1.0, 2.0]; 1200], None);
    let image = Some(Arc::new(image));
    let photograph = Photograph { name: "p".into(), camera: view, image, display: None };
    room.capture.photographs.push(photograph);
    (Stage::new(room, &[]), view)
}

#[test]
fn the_factor_on_recovered_light_is_on_all_of_it() {
    let (mut stage, view) = photographed();
    let middle = |stage: &Stage| stage.film(&view).beauty()[15 * 40 + 20].map(f64::from);
    is(middle(&stage), [0.5, 1.0, 2.0]);
    for factor in [0.0, 0.25, 3.0] {
        stage.edits.original_light = factor;
        is(middle(&stage), [0.5 * factor, factor, 2.0 * factor]);
    }
    let mut stage = floor(reflectance(0.4, 0.0, 1.0)).light(SUN, [PI; 3]);
    let (light, lobe) = recovered_sun();
    stage.solved.light.lights.lights.push(light);
    stage.solved.light.lobes.lobes.push(lobe);
    stage.solved.light.lobes.first.push(1);
    stage.solved.light.emission.push([2.0 * PI; 3]);
    for factor in [0.0, 0.5, 1.0] {
        stage.edits.original_light = factor;
        is(value(&stage, 0.3, 0.2), [0.4 + 0.8 * factor; 3]);
    }
}
