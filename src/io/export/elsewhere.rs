//! Exports a recovered scene for other programs: the list of formats, and writing all that are
//! asked for into one folder.

use std::path::{Path, PathBuf};

use glam::Vec3;
use serde_json::json;

use super::super::table::SampleRow;
use super::super::{Error, atomic, exr};
use super::{glb, mitsuba, points, wavefront};
use crate::choices;
use crate::render::model::Model;
use crate::render::probe::{Content, Probe, ProbeSettings, probe};
use crate::render::scene::Scene;
use crate::scene::Capture;
use crate::watch::Watch;

choices! {
    /// What a recovered scene can be written as.
    Format {
        /// `scene.glb`, binary glTF 2.0.
        Glb = "glb",
        /// `obj/`: OBJ, MTL and EXR textures.
        Obj = "obj",
        /// `mitsuba/`: scenes for Mitsuba 3 with a script that renders them.
        Mitsuba = "mitsuba",
        /// `probe.exr`, the light that arrives at a point.
        Probe = "probe",
        /// `blender/`: the .glb with world and cameras, and a script that opens them.
        Blender = "blender",
        /// Samples and lights as PLY and CSV.
        Ply = "ply",
    }
}

impl Format {
    pub const ALL: [Self; 6] =
        [Self::Glb, Self::Obj, Self::Mitsuba, Self::Probe, Self::Blender, Self::Ply];
}

/// What is taken elsewhere, and where to.
#[derive(Clone, Debug)]
pub struct Plan {
    pub folder: PathBuf,
    pub formats: Vec<Format>,
    /// Of the light probe; `None` for a place before the first camera.
    pub probe_at: Option<Vec3>,
    pub probe: ProbeSettings,
    /// The reconstruction's samples, where they are known.
    pub samples: Option<Vec<SampleRow>>,
}

/// Writes every format that is asked for.
pub fn write(
    plan: &Plan,
    capture: &Capture,
    scene: &Scene,
    model: &Model,
    watch: &Watch,
) -> Result<(), Error> {
    let folder = &plan.folder;
    let wants = |format| plan.formats.contains(&format);
    if wants(Format::Glb) {
        glb::write(&folder.join("scene.glb"), &capture.name, model, watch)?;
    }
    if wants(Format::Obj) {
        wavefront::write(&folder.join("obj"), model, watch)?;
    }
    if wants(Format::Mitsuba) {
        mitsuba::write(&folder.join("mitsuba"), model, plan.probe.reflections, watch)?;
    }
    if wants(Format::Ply) {
        points::write_lights(folder, capture, model)?;
        if let Some(samples) = &plan.samples {
            points::write_samples(folder, samples)?;
        }
    }
    let at = plan.probe_at.unwrap_or_else(|| in_view(scene, model));
    if wants(Format::Probe) {
        let everything = probe(scene, at, Content::Everything, &plan.probe, watch)?;
        write_probe(&folder.join("probe.exr"), &everything)?;
    }
    if wants(Format::Blender) {
        let folder = folder.join("blender");
        glb::write(&folder.join("scene.glb"), &capture.name, model, watch)?;
        let world = probe(scene, at, Content::Background, &plan.probe, watch)?;
        write_probe(&folder.join("world.exr"), &world)?;
        atomic::write_bytes(&folder.join("cameras.json"), cameras(model).as_bytes())?;
        atomic::write_bytes(&folder.join("open_in_blender.py"), OPEN.as_bytes())?;
    }
    watch.check()?;
    Ok(())
}

const OPEN: &str = include_str!("blender/open_in_blender.py");

fn write_probe(file: &Path, probe: &Probe) -> Result<(), Error> {
    exr::write_rgb(file, probe.width, probe.height, &probe.texels)
}

/// Cameras by the names of their nodes, with what glTF cannot say.
fn cameras(model: &Model) -> String {
    let cameras: Vec<_> = model
        .cameras
        .iter()
        .map(|view| {
            let camera = &view.camera;
            json!({"name": view.name, "width": camera.width, "height": camera.height,
                "fl_x": camera.focal_px.x, "fl_y": camera.focal_px.y,
                "cx": camera.principal_px.x, "cy": camera.principal_px.y, "white": view.white})
        })
        .collect();
    format!("{:#}\n", json!({"cameras": cameras}))
}

/// A place in the open that a photograph looks at: three quarters of the way from the first camera
/// to what it sees in its middle; without one the middle of the geometry.
fn in_view(scene: &Scene, model: &Model) -> Vec3 {
    let seen = model.cameras.iter().find_map(|view| {
        let camera = &view.camera;
        let middle = 0.5 * glam::DVec2::new(camera.width as f64, camera.height as f64);
        let ray = camera.ray(middle)?;
        let hit = scene.geometry.caster.closest(&ray)?;
        Some(ray.origin + 0.75 * hit.t * ray.direction)
    });
    seen.unwrap_or(model.middle)
}
