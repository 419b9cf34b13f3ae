//! A closed room with rough walls, full of spheres and boxes, and the rays one would trace in it.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use lobelia::geometry::bvh::{Ray, RayCaster};
use lobelia::math::sampling::Random;

pub struct Scene {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

pub struct RaySet {
    pub name: &'static str,
    pub rays: Vec<Ray>,
}

/// Half the size of the room, in metres.
const ROOM: Vec3 = Vec3::new(4.0, 3.0, 1.5);
const WALL_CELLS: usize = 90;
const IMAGE: usize = 512;
/// Surfaces are left and lights are reached with this much to spare.
const OFFSET: f32 = 1e-4;

impl Scene {
    pub fn new() -> Self {
        let mut scene = Self { positions: Vec::new(), triangles: Vec::new() };
        let mut random = Random::new(1, 0, 0);
        scene.add_room();
        for _ in 0..70 {
            let center = inside(&mut random, 0.9);
            let radius = 0.05 + 0.3 * random.uniform();
            scene.add_sphere(center, radius, 32);
        }
        for _ in 0..150 {
            let center = inside(&mut random, 0.9).with_z(-ROOM.z);
            let half = Vec3::new(random.uniform(), random.uniform(), 2.0 * random.uniform());
            scene.add_box(center, 0.02 + 0.25 * half, TAU * random.uniform());
        }
        scene
    }

    /// Camera rays row by row, cosine-distributed bounces off what they hit in random order, and
    /// segments from there to lights.
    pub fn ray_sets(&self, caster: &RayCaster) -> [RaySet; 3] {
        let camera: Vec<Ray> = (0..IMAGE * IMAGE)
            .map(|pixel| {
                let place = Vec2::new((pixel % IMAGE) as f32, (pixel / IMAGE) as f32);
                let place = (place + 0.5) / IMAGE as f32 - 0.5;
                let direction =
                    Vec3::new(1.0, 1.6 * place.x - 0.3, -1.2 * place.y).normalize_or_zero();
                ray(Vec3::new(-3.6, 0.5, 0.4), direction, f32::INFINITY)
            })
            .collect();
        let mut random = Random::new(2, 0, 0);
        let mut bounce: Vec<Ray> = Vec::with_capacity(camera.len());
        for ray_in in &camera {
            if let Some((place, normal)) = self.hit(caster, ray_in) {
                bounce.push(ray(place, cosine(normal, &mut random), f32::INFINITY));
            }
        }
        random.shuffle(&mut bounce);
        let lights: Vec<Vec3> = (0..64).map(|_| inside(&mut random, 0.8)).collect();
        let mut shadow: Vec<Ray> = Vec::with_capacity(bounce.len());
        for ray_in in &bounce {
            if let Some((place, _)) = self.hit(caster, ray_in) {
                let path = lights[random.below(lights.len())] - place;
                shadow.push(ray(place, path.normalize_or_zero(), path.length() - OFFSET));
            }
        }
        [
            RaySet { name: "camera", rays: camera },
            RaySet { name: "bounce", rays: bounce },
            RaySet { name: "shadow", rays: shadow },
        ]
    }

    /// Where a ray arrives, and the normal on its side.
    fn hit(&self, caster: &RayCaster, ray: &Ray) -> Option<(Vec3, Vec3)> {
        let hit = caster.closest(ray)?;
        let [a, b, c] =
            self.triangles[hit.triangle as usize].map(|vertex| self.positions[vertex as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let place = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
        Some((place, if normal.dot(ray.direction) > 0.0 { -normal } else { normal }))
    }

    /// A grid over [0, 1]², put into space by `place`.
    fn add_grid(&mut self, cells: usize, place: impl Fn(Vec2) -> Vec3) {
        let first = self.positions.len() as u32;
        let side = cells as u32 + 1;
        for vertex in 0..side * side {
            let corner = Vec2::new((vertex % side) as f32, (vertex / side) as f32);
            self.positions.push(place(corner / cells as f32));
        }
        for cell in 0..(cells * cells) as u32 {
            let a = first + cell / cells as u32 * side + cell % cells as u32;
            self.triangles.extend([[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]);
        }
    }

    fn add_room(&mut self) {
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                self.add_grid(WALL_CELLS, |place| {
                    let mut wall = [0.0; 3];
                    wall[axis] = sign;
                    wall[(axis + 1) % 3] = 2.0 * place.x - 1.0;
                    wall[(axis + 2) % 3] = 2.0 * place.y - 1.0;
                    let point = Vec3::from(wall) * ROOM;
                    // The walls stay closed: nothing moves along their edges.
                    let edge = (place * (Vec2::ONE - place)).min_element().min(0.05) / 0.05;
                    let mut rough = [0.0; 3];
                    rough[axis] = -sign * 0.05 * edge * (1.0 + ripple(point));
                    point + Vec3::from(rough)
                });
            }
        }
    }

    fn add_sphere(&mut self, center: Vec3, radius: f32, cells: usize) {
        self.add_grid(cells, |place| {
            let (sin, cos) = (TAU * place.x).sin_cos();
            let (across, up) = (0.5 * TAU * place.y).sin_cos();
            center + radius * Vec3::new(across * cos, across * sin, up)
        });
    }

    fn add_box(&mut self, center: Vec3, half: Vec3, turn: f32) {
        let (sin, cos) = turn.sin_cos();
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                self.add_grid(1, |place| {
                    let mut face = [0.0; 3];
                    face[axis] = sign;
                    face[(axis + 1) % 3] = 2.0 * place.x - 1.0;
                    face[(axis + 2) % 3] = 2.0 * place.y - 1.0;
                    let p = Vec3::from(face) * half;
                    center + Vec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z)
                });
            }
        }
    }
}

fn ray(origin: Vec3, direction: Vec3, t_max: f32) -> Ray {
    Ray { origin, direction, t_min: OFFSET, t_max }
}

fn inside(random: &mut Random, share: f32) -> Vec3 {
    let place = Vec3::new(random.uniform(), random.uniform(), random.uniform());
    (2.0 * place - 1.0) * ROOM * share
}

fn ripple(p: Vec3) -> f32 {
    (7.0 * p.x + 3.0 * p.z).sin() * (5.0 * p.y - 4.0 * p.z).cos()
        + 0.3 * (31.0 * p).sin().dot(Vec3::ONE)
}

fn cosine(normal: Vec3, random: &mut Random) -> Vec3 {
    let (sin, cos) = (TAU * random.uniform()).sin_cos();
    let height = 2.0 * random.uniform() - 1.0;
    let across = (1.0 - height * height).sqrt();
    (normal + Vec3::new(across * cos, across * sin, height)).try_normalize().unwrap_or(normal)
}
