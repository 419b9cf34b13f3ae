use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use lobelia::geometry::mesh::Mesh;
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::lights::{LightKind, VirtualLight};
use lobelia::reconstruct::lobes::Lobe;
use lobelia::render::edits::{AddedLight, Object, Override, Shape, Surroundings};
use lobelia::scene::Brdf;
use lobelia::scene::{Dome, Emitter, Image};

use crate::rooms::{Dice, Room, camera};
use crate::stage::{Stage, reflectance};

/// Numbers of all sizes that files may hold.
struct Chance(Dice);

impl Chance {
    fn below(&mut self, count: usize) -> usize {
        (self.0.uniform() * count as f64) as usize
    }

    /// Among these, or in between.
    fn of(&mut self, special: &[f64]) -> f64 {
        let (low, high) = (special[0], special[special.len() - 1]);
        match self.below(special.len() + 2) {
            k if k < special.len() => special[k],
            _ => low + (high - low) * self.0.uniform(),
        }
    }

    fn strength(&mut self) -> Rgb {
        std::array::from_fn(|_| self.of(&[0.0, 1e-12, 1.0, 1e9]))
    }

    fn place(&mut self) -> Vec3 {
        Vec3::from([(); 3].map(|()| self.of(&[-1.0, -0.3, 0.0, 0.5, 1.0, 3.0]) as f32))
    }

    fn direction(&mut self) -> Vec3 {
        let axis = [Vec3::X, -Vec3::Y, Vec3::Z, -Vec3::Z][self.below(4)];
        if self.below(2) == 0 { axis } else { (self.place() + 0.01 * axis).normalize_or(axis) }
    }

    fn reflectance(&mut self) -> Brdf {
        let diffuse = self.of(&[0.0, 0.5, 1.0]);
        let specular = (1.0 - diffuse) * self.of(&[0.0, 1.0]);
        reflectance(diffuse, specular, self.of(&[0.0, 1.0, 40.0, 1e6]))
    }

    fn shape(&mut self) -> Shape {
        let position = self.place();
        Shape::Emitter(match self.below(6) {
            0 => {
                let normal = self.direction();
                let (u, v) = normal.any_orthonormal_pair();
                let (a, b) = (self.of(&[1e-6, 0.1, 4.0]) as f32, self.of(&[1e-6, 0.3, 9.0]) as f32);
                let corners =
                    [position, position + a * u, position + a * u + b * v, position + b * v];
                Emitter::Rectangle { corners, normal }
            }
            1 => Emitter::Sphere {
                center: position,
                radius_m: self.of(&[1e-6, 0.1, 0.5, 100.0]) as f32,
            },
            2 => Emitter::Point { position },
            3 => {
                let outer_angle = self.of(&[1e-4, 0.5, std::f64::consts::PI]) as f32;
                let inner_angle = outer_angle * self.of(&[0.0, 1.0]) as f32;
                let direction = self.direction();
                Emitter::Spot { position, direction, inner_angle, outer_angle }
            }
            4 => Emitter::Sun {
                direction: self.direction(),
                angular_diameter: self.of(&[1e-6, 0.0093, std::f64::consts::PI]) as f32,
            },
            _ => {
                let (width, height) = (1 + self.below(6), 1 + self.below(4));
                let pixels = (0..width * height)
                    .map(|_| match self.of(&[0.0, 1.0, 1e5]) as f32 {
                        value if value > 9e4 => [f32::NAN; 3],
                        value => [value, 0.5, value],
                    })
                    .collect();
                let image = Arc::new(Image::new(width, height, pixels, None));
                return Shape::Dome(Dome::new(image, self.of(&[1e-6, 1.0, 1e3]) as f32));
            }
        })
    }

    fn object(&mut self) -> Object {
        let [a, b, c] = [(); 3].map(|()| self.place());
        let mesh = Mesh {
            positions: vec![a, b, c, a + Vec3::Z],
            // With one that has no area.
            triangles: vec![[0, 1, 2], [0, 1, 3], [1, 1, 2]],
            surface: vec![0, 0, 0],
            polygon: vec![0, 1, 2],
            texcoords: Vec::new(),
        };
        Object {
            name: "object".into(),
            file: Default::default(),
            mesh: Arc::new(mesh.into()),
            surfaces: vec![("surface".into(), self.reflectance())],
            world_from_object: DAffine3::IDENTITY,
        }
    }

    fn recovered(&mut self) -> (VirtualLight, Lobe) {
        let direction = self.direction();
        let light = match self.below(4) {
            0 => VirtualLight::lamp(self.place(), self.of(&[0.0, 1e-3, 1.0]) as f32),
            1 => VirtualLight::disc(LightKind::Sphere, self.place(), direction, 0.3),
            2 => VirtualLight::distant(LightKind::Sky, direction, self.of(&[0.0, 0.3]) as f32),
            _ => VirtualLight::distant(LightKind::Sun, direction, 0.004),
        };
        (light, Lobe { light: 0, direction, exponent: self.of(&[0.0, 1.0, 20.0]) as f32 })
    }
}

fn room(chance: &mut Chance) -> Stage {
    let mut room = Room::default();
    let (floor, sides) = (room.diffuse("floor"), room.diffuse("box"));
    room.square(floor, 1.0, 0.0);
    room.open_box(sides, DVec3::new(-0.3, -0.3, 0.0), DVec3::new(0.2, 0.2, 0.5));
    let reflectances = [chance.reflectance(), chance.reflectance()];
    Stage::new(room, &reflectances)
}

#[test]
fn no_edit_makes_what_is_no_number() {
    let mut chance = Chance(Dice::new(5));
    let eye = DVec3::new(1.5, -1.8, 1.2);
    let view = camera((4, 3), 0.9, eye, DVec3::new(0.0, 0.0, 0.2));
    for round in 0..10_000 {
        let mut stage = room(&mut chance).spp(2);
        for index in 0..chance.below(4) {
            let (shape, emission) = (chance.shape(), chance.strength());
            stage.edits.lights.push(AddedLight {
                name: index.to_string(),
                shape,
                emission,
                is_on: true,
            });
        }
        for _ in 0..chance.below(2) {
            stage.edits.objects.push(chance.object());
        }
        // Lights take a table of where they matter, which takes time.
        if round % 20 == 0 {
            let (light, lobe) = chance.recovered();
            stage.solved.light.lights.lights.push(light);
            stage.solved.light.lobes.lobes.push(lobe);
            stage.solved.light.lobes.first.push(1);
            stage.solved.light.emission.push(chance.strength());
        }
        if chance.below(2) == 0 {
            let Brdf { diffuse, specular, exponent, .. } = chance.reflectance();
            let change = Override {
                diffuse: Some(diffuse),
                specular: Some(specular),
                exponent: Some(exponent),
            };
            stage.edits.materials.insert("floor".into(), change);
        }
        stage.edits.original_light = chance.of(&[0.0, 1.0, 1e6]);
        stage.edits.surroundings = match chance.below(3) {
            0 => Surroundings::Open,
            1 => Surroundings::Auto,
            _ => Surroundings::Albedo(chance.of(&[0.0, 1.0])),
        };
        let film = stage.film(&view);
        let layers = (0..film.layers()).flat_map(|layer| film.layer(layer));
        let light = layers.chain(film.direct()).flatten();
        let rest = film.albedo().into_iter().chain(film.normal()).flatten();
        let sound = |value: f32| value.is_finite();
        assert!(light.clone().all(|v| sound(v) && v >= 0.0), "{round}: {:?}", stage.edits);
        assert!(rest.chain(film.distance_m()).all(sound), "{round}: {:?}", stage.edits);
    }
}

#[test]
fn nothing_is_seen_of_nothing() {
    let view = camera((4, 3), 0.9, DVec3::new(1.5, -1.8, 1.2), DVec3::ZERO);
    let mut stage = Stage::new(Room::default(), &[]);
    stage.edits.surroundings = Surroundings::Auto;
    let stage = stage.light(Emitter::Point { position: Vec3::Z }, [1.0; 3]);
    let film = stage.film(&view);
    assert!(film.beauty().iter().flatten().all(|&value| value == 0.0));
    assert!(film.coverage().iter().all(|&known| known == 0.0));
}
