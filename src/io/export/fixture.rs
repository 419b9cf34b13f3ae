//! A result of the joint method that contains one of everything, for tests.

use std::sync::Arc;

use glam::Vec3;

use crate::math::rgb::Rgb;
use crate::reconstruct::Reconstruction;
use crate::reconstruct::equations::Equations;
use crate::reconstruct::lights::{LightKind, VirtualLight, VirtualLights};
use crate::reconstruct::lobes::{Lobe, Lobes};
use crate::reconstruct::samples::{Sample, SampleCloud};
use crate::reconstruct::solution::{
    Certainty, Iteration, MaterialCertainty, Rms, ScaleCertainty, Solution, Stopped,
};
use crate::reconstruct::transport::{PatchRadiosity, Transport};
use crate::scene::Brdf;
use crate::scene::{Capture, Emitter, KnownLight, Material, MaterialKind};

const DARK: Rgb = [0.0; 3];

/// Materials: a specular floor whose blue is not identified, a diffuse wall, and one unseen.
pub(crate) fn capture() -> Capture {
    let material = |name: &str, kind| Material {
        name: name.into(),
        kind,
        surfaces: Vec::new(),
        textured: false,
        known_diffuse: None,
        known_diffuse_sd: None,
    };
    let known = |name: &str| KnownLight::Shape {
        name: name.into(),
        emitter: Emitter::Point { position: Vec3::Z },
        emission: None,
        color: None,
    };
    Capture {
        materials: vec![
            material("floor", MaterialKind::Specular),
            material("wall", MaterialKind::Diffuse),
            material("unseen", MaterialKind::Diffuse),
        ],
        lights: vec![known("dead bulb"), known("bulb")],
        ..Capture::default()
    }
}

/// Two discs, one of them dark; of a lamp, the sky, the sun and known lights one that shines,
/// and a dark one of all but the sun. The lamp has a lobe that is dark.
pub(crate) fn reconstruction() -> Reconstruction {
    let (mut lights, mut lobes, mut emission) = (Vec::new(), Lobes::default(), Vec::new());
    lobes.first.push(0);
    let mut push = |light: VirtualLight, shapes: &[(f32, Rgb)]| {
        for &(exponent, value) in shapes {
            lobes.lobes.push(Lobe { light: lights.len(), direction: light.normal, exponent });
            emission.push(value);
        }
        lobes.first.push(lobes.lobes.len());
        lights.push(light);
    };
    let place = Vec3::new(1.0, 2.0, 3.0);
    push(VirtualLight::disc(LightKind::Sphere, place, -Vec3::Z, 0.5), &[(20.0, DARK)]);
    push(VirtualLight::disc(LightKind::Surface, place, Vec3::X, 0.5), &[(1.0, [1.0; 3])]);
    push(VirtualLight::lamp(place, 0.25), &[(0.0, [9.0, 8.0, 7.0]), (1.0, DARK)]);
    push(VirtualLight::lamp(-place, 0.25), &[(0.0, DARK)]);
    push(VirtualLight::distant(LightKind::Sky, -Vec3::Z, 0.2), &[(0.0, [0.0, 0.0, 0.5])]);
    push(VirtualLight::distant(LightKind::Sky, Vec3::Y, 0.2), &[(0.0, DARK)]);
    push(VirtualLight::distant(LightKind::Sun, -Vec3::X, 0.0047), &[(0.0, [3.0; 3])]);
    let known = |index| VirtualLight::disc(LightKind::Known(index), place, Vec3::Z, 0.0);
    push(known(0), &[(0.0, DARK)]);
    push(known(1), &[(0.0, [2.0; 3])]);

    let sample = |material| Sample {
        position: Vec3::ZERO,
        normal: Vec3::Z,
        material,
        surface: 0,
        views: 0..0,
        radiance: [1.0; 3],
    };
    let iteration = |index: usize, objective: f64, change: f64| Iteration {
        index,
        rms: Rms { absolute: [objective; 3], relative: [0.1 * objective; 3] },
        objective: Some([objective, 0.5 * objective, 0.25 * objective]),
        change,
        elapsed_secs: 0.5 * index as f64,
    };
    let floor = Brdf::phong([0.5, 0.4, 0.3], [0.05, 0.06, 0.07], 40.0);
    Reconstruction {
        samples: Arc::new(SampleCloud {
            samples: vec![sample(0), sample(1)],
            ..SampleCloud::default()
        }),
        lights: Arc::new(VirtualLights { lights, ..VirtualLights::default() }),
        lobes: Arc::new(lobes),
        transport: Arc::new(Transport {
            irradiance: Vec::new(),
            records: Arc::default(),
            first_record: Vec::new(),
            bright: Arc::default(),
            coupling: faer::Mat::zeros(0, 0),
            unphotographed: Arc::default(),
            first_unphotographed: Vec::new(),
            patch_radiosity: PatchRadiosity::default(),
        }),
        equations: Arc::new(Equations::default()),
        solution: Arc::new(Solution {
            reflectances: vec![Some(floor), Some(Brdf::diffuse([0.2; 3])), None],
            optics: Vec::new(),
            emission,
            iterations: vec![iteration(1, 2.0, 0.5), iteration(2, 1.0, 0.0)],
            stopped: Stopped::GradientConverged,
            computed: Vec::new(),
            certainty: Some(certainty()),
            notes: vec!["the world is open: a sky explains the photographs better".into()],
            warnings: Vec::new(),
        }),
        textures: Arc::default(),
        gains: Vec::new(),
        seconds: [0.0; 5],
        kept: [false; 5],
        warnings: Vec::new(),
    }
}

fn certainty() -> Certainty {
    let floor = MaterialCertainty {
        diffuse: [Some([0.45, 0.56]), Some([0.35, 0.46]), None],
        specular: [Some([0.04, 0.06]), Some([0.05, 0.07]), None],
        exponent: Some([30.0, 52.0]),
        roughness: None,
        identified: [true, true, false],
    };
    let wall = MaterialCertainty { identified: [true; 3], ..MaterialCertainty::default() };
    Certainty {
        materials: vec![Some(floor), Some(wall), None],
        scale: ScaleCertainty {
            singular_value: [0.5, 0.6, 0.7],
            log_rms: [0.01, 0.02, 0.03],
            log_sd: [0.1, 0.11, 0.12],
        },
        held_out: Some([0.04, 0.05, 0.06]),
        light_sets: 5,
        selection: None,
    }
}
