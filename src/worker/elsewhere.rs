//! Writes a recovered scene for other programs.

use std::sync::Arc;

use crate::geometry::bvh::RayCaster;
use crate::io;
use crate::io::export::elsewhere::{self, Plan};
use crate::render::edits::Edits;
use crate::render::model::Model;
use crate::render::scene::{Geometry, Scene, Solved};
use crate::scene::{Capture, Views};
use crate::watch::Watch;
use crate::worker::event::JobEvent;

/// A recovered scene with its edits, to be written for other programs.
#[derive(Clone, Debug)]
pub struct SceneExport {
    /// The capture that was reconstructed.
    pub capture: Arc<Capture>,
    /// What was recovered.
    pub solved: Arc<Solved>,
    /// Added lights and objects, and changed materials.
    pub edits: Arc<Edits>,
    /// What is written, and where to.
    pub plan: Plan,
}

pub(super) fn perform(scene_export: &SceneExport, watch: &Watch) -> Result<JobEvent, io::Error> {
    let SceneExport { capture, solved, edits, plan } = scene_export;
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(capture, &caster, watch)?;
    let geometry = Geometry::new(capture, solved, edits);
    let places: Vec<_> = plan.probe_at.into_iter().collect();
    let scene = Scene::new(&views, &geometry, solved, edits, &places);
    let model = Model::new(&scene, &views, solved, edits, watch)?;
    elsewhere::write(plan, capture, &scene, &model, watch)?;
    Ok(JobEvent::Exported(plan.folder.clone()))
}
