//! What every step of a run reads: the table that the stage cache relies on.
//!
//! A step is handed only what this table lists, so that its product cannot depend on an option or
//! tag that is missing here. Where all of it is the same in two runs, for a step and for the steps
//! that it builds on, both runs give the same bytes there.
//!
//! | step | stage | builds on | options | of the capture |
//! |---|---|---|---|---|
//! | visibility: which surface every pixel sees | samples | | | mesh, cameras, which photographs measure |
//! | mirrors and glass, samples, Eq. 11 | samples | visibility | seed, `samples`, whether `photographs.gain = apply` | photographs, which surface is of which material, kinds of materials |
//! | gathered: light of photographed surfaces | transport | samples | seed, `transport.rays`, `transport.glossy_rays` | kinds of materials |
//! | lights (method `paper`) | lights | samples | seed, `lights`, `lobes` | as samples |
//! | coupled (`paper`) | transport | gathered, lights | seed, `transport.disc_rays` | known lights |
//! | solved (`joint`) | solve, lights | gathered | seed, `transport`, `joint`, `gloss`, start values, `samples.min_per_material` | all of it |
//! | solved (`paper`) | solve | coupled | `refine`, `gloss`, start values | all of it |
//! | textures | textures | solved | seed, `textures` | all of it |
//!
//! `general.quality` is a name for values of other options and is read by none.

use std::sync::Arc;

use crate::reconstruct::gain::{GainUse, PhotographOptions};
use crate::reconstruct::options::GeneralOptions;
use crate::reconstruct::samples::SampleOptions;
use crate::reconstruct::transport::TransportOptions;
use crate::reconstruct::{Method, Options, Stage};
use crate::scene::{Capture, Material, MaterialKind};

/// A part of a run whose product can be cached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    Visibility,
    Samples,
    Gathered,
    Lights,
    Coupled,
    Solved,
    Textures,
}

impl Step {
    pub(super) const ALL: [Self; 7] = [
        Self::Visibility,
        Self::Samples,
        Self::Gathered,
        Self::Lights,
        Self::Coupled,
        Self::Solved,
        Self::Textures,
    ];

    /// The steps whose products this one is handed as well.
    pub(super) fn builds_on(self, method: Method) -> &'static [Self] {
        match (self, method) {
            (Self::Visibility, _) => &[],
            (Self::Samples, _) => &[Self::Visibility],
            (Self::Gathered | Self::Lights, _) => &[Self::Samples],
            (Self::Coupled, _) => &[Self::Gathered, Self::Lights],
            (Self::Solved, Method::Joint) => &[Self::Gathered],
            (Self::Solved, Method::Paper) => &[Self::Coupled],
            (Self::Textures, _) => &[Self::Solved],
        }
    }

    /// The step with which a stage is done.
    pub(super) fn ending(stage: Stage, method: Method) -> Self {
        match (stage, method) {
            (Stage::Samples, _) => Self::Samples,
            (Stage::Lights, Method::Paper) => Self::Lights,
            (Stage::Transport, Method::Joint) => Self::Gathered,
            (Stage::Transport, Method::Paper) => Self::Coupled,
            (Stage::Lights, Method::Joint) | (Stage::Solve, _) => Self::Solved,
            (Stage::Textures, _) => Self::Textures,
        }
    }
}

/// The inputs of a step: what it does not read is empty in the capture and at its default in the
/// options.
#[derive(Clone, Debug)]
pub(super) struct Inputs {
    pub capture: Capture,
    pub options: Options,
}

impl Inputs {
    /// What a step reads of a capture and options.
    pub(super) fn of(step: Step, capture: &Capture, options: &Options) -> Self {
        let own = options;
        let none = Options::default();
        let seed = GeneralOptions { seed: own.general.seed, ..GeneralOptions::default() };
        let general = GeneralOptions { method: own.general.method, ..seed.clone() };
        let seeded = Options { general: seed, ..none.clone() };
        match step {
            Step::Visibility => Self { capture: photographed(capture), options: none },
            Step::Samples => Self {
                capture: assigned(capture, true),
                options: Options {
                    // Gains that are only told of are looked for at the end of every run.
                    photographs: PhotographOptions {
                        gain: match own.photographs.gain {
                            GainUse::Apply => GainUse::Apply,
                            GainUse::Off | GainUse::Report => GainUse::Off,
                        },
                    },
                    samples: own.samples.clone(),
                    ..seeded
                },
            },
            Step::Gathered => Self {
                capture: assigned(capture, true),
                options: Options {
                    transport: TransportOptions {
                        rays: own.transport.rays,
                        glossy_rays: own.transport.glossy_rays,
                        ..none.transport
                    },
                    ..seeded
                },
            },
            Step::Lights => Self {
                capture: assigned(capture, false),
                options: Options { lights: own.lights.clone(), lobes: own.lobes.clone(), ..seeded },
            },
            Step::Coupled => Self {
                capture: Capture { lights: capture.lights.clone(), ..assigned(capture, false) },
                options: Options {
                    transport: TransportOptions {
                        disc_rays: own.transport.disc_rays,
                        ..none.transport
                    },
                    ..seeded
                },
            },
            Step::Solved => Self {
                capture: told(capture),
                options: match own.general.method {
                    Method::Joint => Options {
                        general,
                        transport: own.transport.clone(),
                        joint: own.joint.clone(),
                        gloss: own.gloss.clone(),
                        start: own.start.clone(),
                        samples: SampleOptions {
                            min_per_material: own.samples.min_per_material,
                            ..none.samples
                        },
                        ..none
                    },
                    Method::Paper => Options {
                        general,
                        refine: own.refine.clone(),
                        gloss: own.gloss.clone(),
                        start: own.start.clone(),
                        ..none
                    },
                },
            },
            Step::Textures => Self {
                capture: told(capture),
                options: Options { textures: own.textures.clone(), ..seeded },
            },
        }
    }

    /// The same for every step, without leaving anything out.
    pub(super) fn whole(capture: &Capture, options: &Options) -> [Arc<Self>; 7] {
        let whole = Arc::new(Self { capture: capture.clone(), options: options.clone() });
        Step::ALL.map(|_| whole.clone())
    }

    /// For every step what it reads.
    pub(super) fn of_all(capture: &Capture, options: &Options) -> [Arc<Self>; 7] {
        Step::ALL.map(|step| Arc::new(Self::of(step, capture, options)))
    }

    /// Whether these are the same inputs. Pixels of images are compared by their address, not by their
    /// contents: read again from a file they count as others. Masks are compared by what they leave
    /// out, and meshes by their triangles: a mask that is drawn and taken back is the one before, and so
    /// is the mesh without a chart that was added and removed.
    pub(super) fn same_as(&self, other: &Self) -> bool {
        // Destructured, so that a field that is added cannot be forgotten here.
        let Capture {
            name,
            mesh,
            surfaces,
            photographs,
            materials,
            lights,
            environment,
            charts,
            color_matrix,
            warnings,
        } = &self.capture;
        let capture = &other.capture;
        let same_photograph = |(a, b): (&crate::scene::Photograph, &crate::scene::Photograph)| {
            let same_image = match (&a.image, &b.image) {
                (Some(a), Some(b)) => Arc::ptr_eq(a, b) || a.has_pixels_of(b) && a == b,
                (None, None) => true,
                _ => false,
            };
            same_image && a.name == b.name && a.camera == b.camera
        };
        self.options == other.options
            && (Arc::ptr_eq(mesh, &capture.mesh) || *mesh == capture.mesh)
            && photographs.len() == capture.photographs.len()
            && photographs.iter().zip(&capture.photographs).all(same_photograph)
            && (name, environment, warnings)
                == (&capture.name, &capture.environment, &capture.warnings)
            && (charts, color_matrix) == (&capture.charts, &capture.color_matrix)
            && (surfaces, materials, lights)
                == (&capture.surfaces, &capture.materials, &capture.lights)
    }
}

/// The mesh and the photographs.
fn photographed(capture: &Capture) -> Capture {
    Capture {
        mesh: capture.mesh.clone(),
        photographs: capture.photographs.clone(),
        ..Capture::default()
    }
}

/// With the surfaces, and the materials by name alone or with their kinds.
fn assigned(capture: &Capture, with_kinds: bool) -> Capture {
    let bare = |material: &Material| Material {
        name: material.name.clone(),
        kind: if with_kinds { material.kind } else { MaterialKind::Diffuse },
        surfaces: Vec::new(),
        textured: false,
        known_diffuse: None,
        known_diffuse_sd: None,
    };
    Capture {
        surfaces: capture.surfaces.clone(),
        materials: capture.materials.iter().map(bare).collect(),
        ..photographed(capture)
    }
}

/// With every tag. Charts are known by their surfaces, a colour matrix by what it makes of the pixels.
fn told(capture: &Capture) -> Capture {
    Capture {
        name: String::new(),
        charts: Arc::default(),
        color_matrix: None,
        warnings: Vec::new(),
        ..capture.clone()
    }
}
