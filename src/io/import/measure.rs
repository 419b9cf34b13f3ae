//! The place that a click on a photograph refers to, so that a length can be measured and the scale
//! set by it: a point that COLMAP observed there, a corner of the mesh, or the mesh below the
//! click.

use glam::{DVec2, DVec3};

use super::Survey;
use crate::geometry::bvh::Ray;

/// What lies nearer than this before a corner, as a part of the distance, is its own surface.
const OWN_SURFACE: f64 = 4e-3;

/// What a click has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Picked {
    Point,
    Corner,
    Surface,
}

/// The place at a pixel of a photograph, in metres of the import: of points and corners within
/// `reach_px` the nearest, else the mesh. `None` where there is neither.
pub fn place_at(
    survey: &Survey,
    shot: usize,
    pixel: DVec2,
    reach_px: f64,
) -> Option<(DVec3, Picked)> {
    let import = &survey.import;
    let own = import.shots.get(shot)?;
    let camera = &own.camera;
    let observed = own.observations.iter().filter_map(|seen| {
        let place = *import.points.get(seen.point as usize)?;
        Some((seen.pixel.as_dvec2().distance(pixel), place, Picked::Point))
    });
    let hit = |towards: DVec3| {
        let (origin, direction) =
            (camera.position.as_vec3(), towards.as_vec3().normalize_or_zero());
        let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        survey.caster.as_ref()?.closest(&ray).map(|hit| f64::from(hit.t))
    };
    let is_seen = |place: DVec3| {
        let away = place - camera.position;
        hit(away).is_none_or(|t| t > (1.0 - OWN_SURFACE) * away.length())
    };
    let corners = survey.edges.iter().flatten().filter_map(|corner| {
        let corner = corner.as_dvec3();
        let (at, _) = camera.project(corner)?;
        Some((at.distance(pixel), corner, Picked::Corner))
    });
    let within = corners.filter(|(away, corner, _)| *away <= reach_px && is_seen(*corner));
    let near = observed.filter(|(away, ..)| *away <= reach_px).chain(within);
    let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, place, picked)) = nearest {
        return Some((place, picked));
    }
    let direction = camera.direction(pixel)?;
    Some((camera.position + direction * hit(direction)?, Picked::Surface))
}
