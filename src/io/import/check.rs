//! Compares an import with the photographs: the mesh's edges as each camera sees them, and the
//! points of a COLMAP model, observed and projected.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::reprojection::median_and_worst;
use super::shown::{self, Shown};
use super::{Import, figure};
use crate::geometry::bvh::RayCaster;
use crate::scene::Capture;
use crate::scene::wireframe::{self, Stroke};
use crate::watch::{Cancelled, Watch};

/// Edges that are drawn; of denser meshes only creases.
const MOST_EDGES: usize = 20_000;
/// Longer side of a photograph on the screen, in pixels.
const LONGEST_PX: usize = 1600;

/// What all photographs of an import are checked with.
pub struct Survey {
    pub import: Arc<Import>,
    /// The mesh's edges that are worth drawing, in metres.
    pub edges: Vec<[Vec3; 2]>,
    /// `None` without a mesh.
    pub caster: Option<RayCaster>,
    /// Mesh and cameras to be looked at, with a person beside them.
    pub scene: Arc<Capture>,
}

/// A photograph with what its camera says of it.
#[derive(Clone, Debug)]
pub struct ShotCheck {
    /// An index into `Import::shots`.
    pub shot: usize,
    /// The photograph, or why it cannot be shown; `None` where none was found.
    pub picture: Option<Result<Shown, String>>,
    pub strokes: Vec<Stroke>,
    pub marks: Vec<Mark>,
    /// Of the marks' distances, in pixels of the photograph; 0 without any.
    pub median_px: f64,
    pub worst_px: f64,
}

/// A point of a COLMAP model in a photograph, in its pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    pub observed: Vec2,
    /// By the imported camera; `None` where it does not see the point.
    pub projected: Option<Vec2>,
}

impl std::fmt::Debug for Survey {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Survey").field("edges", &self.edges.len()).finish_non_exhaustive()
    }
}

/// Prepares the checks of an import.
pub fn survey(import: Arc<Import>, watch: &Watch) -> Result<Survey, Cancelled> {
    watch.begin(2);
    let mesh = import.geometry.as_ref().map(|geometry| &geometry.mesh);
    let edges = mesh.map_or_else(Vec::new, |mesh| wireframe::edges(mesh, MOST_EDGES));
    watch.tick()?;
    let caster = mesh.map(|mesh| RayCaster::build(&mesh.positions, &mesh.triangles));
    let scene = Arc::new(figure::scene(&import));
    watch.tick()?;
    Ok(Survey { import, edges, caster, scene })
}

/// Checks one photograph. `watch` counts edges.
pub fn check_shot(survey: &Survey, shot: usize, watch: &Watch) -> Result<ShotCheck, Cancelled> {
    let own = &survey.import.shots[shot];
    let picture = own.image.as_ref().map(|file| {
        shown::read(file, own.orientation, LONGEST_PX).map_err(|error| error.to_string())
    });
    watch.check()?;
    let strokes = wireframe::strokes(&own.camera, &survey.edges, survey.caster.as_ref(), watch)?;
    let project = |point: u32| {
        let place = survey.import.points.get(point as usize)?;
        own.camera.project(*place).map(|(pixel, _)| pixel.as_vec2())
    };
    let marks: Vec<Mark> = own
        .observations
        .iter()
        .map(|seen| Mark { observed: seen.pixel, projected: project(seen.point) })
        .collect();
    let distances = marks.iter().filter_map(|mark| Some(mark.projected?.distance(mark.observed)));
    let (median_px, worst_px) = median_and_worst(distances.map(f64::from).collect());
    Ok(ShotCheck { shot, picture, strokes, marks, median_px, worst_px })
}
