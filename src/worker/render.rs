//! Renders a recovered scene, to be shown or written.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use crate::geometry::bvh::RayCaster;
use crate::io;
use crate::io::export::pictures::{self, Development, Written};
use crate::io::exr::ColorSpace;
use crate::render::edits::Edits;
use crate::render::film::Film;
use crate::render::scene::{Geometry, Scene, Solved};
use crate::render::{RenderOptions, render_by};
use crate::scene::{Camera, Capture, Views};
use crate::study::pictures as judge;
use crate::watch::Watch;
use crate::worker::engine;
use crate::worker::event::JobEvent;

/// Pictures to be made of a recovered scene.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The capture that was reconstructed.
    pub capture: Arc<Capture>,
    /// What was recovered.
    pub solved: Arc<Solved>,
    /// Added lights and objects, and changed materials.
    pub edits: Arc<Edits>,
    /// One picture each.
    pub frames: Vec<Frame>,
    /// Paths per pixel, and the like.
    pub options: RenderOptions,
    /// Where to write; with `None` every pass is sent as [`JobEvent::Picture`] instead.
    pub files: Option<Files>,
}

/// A picture's camera.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Part of the names of files.
    pub name: String,
    /// The view, and the size in pixels.
    pub camera: Camera,
    /// Index into the capture's photographs, where one was taken from there.
    pub photograph: Option<usize>,
}

/// Which files are written.
#[derive(Clone, Debug)]
pub struct Files {
    /// Made where it is missing.
    pub folder: PathBuf,
    /// Also an sRGB picture of each.
    pub png: Option<Development>,
    /// Also the edits set into the photographs.
    pub composite: bool,
    /// Of the OpenEXR files.
    pub color_space: ColorSpace,
    /// Light by light, albedo, normals and distance beside the radiance.
    pub layers: bool,
}

pub(super) fn perform(
    rendering: &Rendering,
    watch: &Watch,
    emit: &(dyn Fn(JobEvent) + Sync),
) -> Result<JobEvent, io::Error> {
    let Rendering { capture, solved, edits, frames, options, files } = rendering;
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(capture, &caster, watch)?;
    let places: Vec<_> = frames.iter().map(|frame| frame.camera.position.as_vec3()).collect();
    let geometry = Geometry::new(capture, solved, edits);
    let scene = Scene::new(&views, &geometry, solved, edits, &places);
    let composite = files.as_ref().is_some_and(|files| files.composite);
    let bare = Edits::default();
    let bare_geometry = composite.then(|| Geometry::new(capture, solved, &bare));
    let bare_scene = bare_geometry.as_ref().map(|geometry| {
        let recovered = scene.recovered.with_groups(capture, solved, &bare);
        let recovered = Arc::new(recovered);
        Scene::lit_by(recovered, Vec::new(), &views, geometry, solved, &bare, &places)
    });
    let tracer = &*engine::tracer(options.engine).tracer;
    let lights: Vec<&str> = edits.lights.iter().map(|light| light.name.as_str()).collect();

    let mut taken = BTreeSet::new();
    for (index, frame) in frames.iter().enumerate() {
        let show = |film: &Film| {
            if files.is_none() {
                emit(JobEvent::Picture { frame: index, film: Arc::new(film.clone()) });
            }
        };
        let film = render_by(tracer, &scene, &frame.camera, options, watch, &show)?;
        let photograph = frame.photograph.and_then(|p| capture.photographs[p].image.as_ref());
        let Some(files) = files else {
            if let Some(image) = photograph {
                watch.check()?;
                let score = Box::new(judge::against_photograph(&frame.name, &film, image));
                emit(JobEvent::Judged { frame: index, score });
            }
            continue;
        };
        let without = match (&bare_scene, photograph) {
            (Some(scene), Some(_)) => {
                Some(render_by(tracer, scene, &frame.camera, options, watch, &|_| ())?)
            }
            _ => None,
        };
        watch.check()?;
        pictures::write(&Written {
            folder: &files.folder,
            name: &pictures::name(&frame.name, &mut taken),
            film: &film,
            lights: &lights,
            shows_sky: solved.shows_sky(),
            color_space: files.color_space,
            has_layers: files.layers,
            png: files.png.as_ref(),
            composite: without
                .as_ref()
                .zip(photograph)
                .map(|(without, photograph)| (without, &**photograph, edits.original_light as f32)),
        })?;
        emit(JobEvent::PictureWritten { done: index + 1 });
    }
    Ok(JobEvent::Rendered(files.as_ref().map(|files| files.folder.clone())))
}
