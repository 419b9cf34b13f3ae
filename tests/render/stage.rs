use glam::{DVec3, Vec3};
use lobelia::geometry::bvh::RayCaster;
use lobelia::math::rgb::Rgb;
use lobelia::render::edits::{AddedLight, Edits, Shape, Surroundings};
use lobelia::render::film::Film;
use lobelia::render::scene::{Geometry, Scene, Solved};
use lobelia::render::{RenderOptions, render};
use lobelia::scene::Brdf;
use lobelia::scene::{Camera, Emitter, Views};
use lobelia::watch::Watch;

use crate::rooms::{Room, camera};

/// A room with its reflectances, its light and its edits.
#[derive(Clone, Default)]
pub struct Stage {
    pub room: Room,
    pub solved: Solved,
    pub edits: Edits,
    pub options: RenderOptions,
}

/// Mean over independent pixels with its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
}

impl Estimate {
    pub fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
        Self { mean, error: (variance / count).sqrt() }
    }

    /// `least` is the relative standard error with which the test tells something.
    #[track_caller]
    pub fn is(self, expected: f64, least: f64) {
        let Self { mean, error } = self;
        assert!(error <= least * expected.abs(), "{mean} ± {error} tells nothing of {expected}");
        // Single precision adds what the spread over the pixels does not show.
        let tolerance = 4.5 * error + 1e-5 * expected.abs();
        assert!((mean - expected).abs() <= tolerance, "{mean} ± {error}, not {expected}");
    }
}

impl Stage {
    /// `surface` per reflectance, in their order; nothing shines, and nothing surrounds.
    pub fn new(room: Room, reflectances: &[Brdf]) -> Self {
        let mut stage = Self { room, ..Self::default() };
        stage.solved.reflectances = reflectances.iter().copied().map(Some).collect();
        stage.solved.light.lobes.first.push(0);
        stage.edits.surroundings = Surroundings::Open;
        stage.options.spp = 16;
        // Pixels that know nothing of each other.
        stage.options.denoise = false;
        stage
    }

    pub fn light(mut self, emitter: Emitter, emission: Rgb) -> Self {
        let name = format!("light {}", self.edits.lights.len());
        self.edits.lights.push(AddedLight {
            name,
            shape: Shape::Emitter(emitter),
            emission,
            is_on: true,
        });
        self
    }

    pub fn most(mut self, reflections: usize) -> Self {
        self.options.reflections = reflections;
        self
    }

    pub fn spp(mut self, spp: usize) -> Self {
        self.options.spp = spp;
        self
    }

    pub fn with<T>(&self, places: &[Vec3], ask: impl FnOnce(&Scene) -> T) -> T {
        let capture = &self.room.capture;
        let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
        let views = Views::new(capture, &caster, &Watch::new()).unwrap();
        let geometry = Geometry::new(capture, &self.solved, &self.edits);
        ask(&Scene::new(&views, &geometry, &self.solved, &self.edits, places))
    }

    pub fn films(&self, cameras: &[Camera]) -> Vec<Film> {
        let places: Vec<Vec3> = cameras.iter().map(|camera| camera.position.as_vec3()).collect();
        self.with(&places, |scene| {
            let picture = |(index, camera): (usize, &Camera)| {
                let seed = self.options.seed + index;
                let options = RenderOptions { seed, ..self.options };
                render(scene, camera, &options, &Watch::new(), &|_| {}).unwrap()
            };
            cameras.iter().enumerate().map(picture).collect()
        })
    }

    pub fn film(&self, camera: &Camera) -> Film {
        self.films(std::slice::from_ref(camera)).remove(0)
    }

    /// Radiance of the place that a line of sight meets, per channel, over 32 × 32 pixels that
    /// all look along it.
    pub fn radiance(&self, eye: DVec3, target: DVec3) -> [Estimate; 3] {
        let film = self.film(&needle(eye, target));
        std::array::from_fn(|c| {
            Estimate::of(&film.beauty().iter().map(|p| f64::from(p[c])).collect::<Vec<_>>())
        })
    }
}

/// A camera whose pixels all look along one line, to a millionth of the distance.
pub fn needle(eye: DVec3, target: DVec3) -> Camera {
    camera((32, 32), 1e6, eye, target)
}

pub fn reflectance(diffuse: f64, specular: f64, exponent: f64) -> Brdf {
    Brdf::phong([diffuse; 3], [specular; 3], exponent)
}

/// A diffuse square of half-side 5 at height 0.
pub fn floor(reflectance: Brdf) -> Stage {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    room.square(floor, 5.0, 0.0);
    Stage::new(room, &[reflectance])
}

/// The rectangle [x0, x1] × [y0, y1] at a height, shining down.
pub fn ceiling([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> Emitter {
    let corner = |x, y| DVec3::new(x, y, z).as_vec3();
    let corners = [corner(x0, y0), corner(x1, y0), corner(x1, y1), corner(x0, y1)];
    Emitter::Rectangle { corners, normal: -Vec3::Z }
}
