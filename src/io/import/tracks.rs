//! The points of an import with where each photograph shows them.

use glam::{DVec2, DVec3};

use super::Import;
use crate::model::{FoundPoint, found};

/// As many points are kept: those that most photographs show, and of each photograph as many that
/// it shows.
const MOST_POINTS: usize = 2000;
const OF_EACH: usize = 100;

/// The points that two photographs or more show. `photograph` gives the number of a shot's photograph,
/// `pixel` where in it a pixel of the shot is.
pub(in crate::io) fn tracks(
    import: &Import,
    photograph: impl Fn(usize) -> Option<usize>,
    pixel: impl Fn(usize, DVec2) -> DVec2,
) -> Vec<FoundPoint> {
    let mut seen: Vec<Vec<(usize, DVec2)>> = vec![Vec::new(); import.points.len()];
    for (shot, own) in import.shots.iter().enumerate() {
        let Some(photograph) = photograph(shot) else { continue };
        for observation in &own.observations {
            if let Some(seen) = seen.get_mut(observation.point as usize) {
                seen.push((photograph, pixel(photograph, observation.pixel.as_dvec2())));
            }
        }
    }
    let point = |(position, mut seen): (&DVec3, Vec<(usize, DVec2)>)| {
        // Sorting keeps the order of those of one photograph.
        seen.sort_by_key(|own| own.0);
        seen.dedup_by_key(|own| own.0);
        let (photographs, pixels) = seen.into_iter().unzip();
        FoundPoint { position: *position, photographs, pixels }
    };
    let mut points: Vec<FoundPoint> = import
        .points
        .iter()
        .zip(seen)
        .map(point)
        .filter(|own| own.position.is_finite() && own.photographs.len() > 1)
        .collect();
    // Sorting keeps the order of those that as many show.
    points.sort_by_key(|own| std::cmp::Reverse(own.photographs.len()));
    let is_first = found::are_first(&points, OF_EACH);
    let ranked = points.into_iter().zip(is_first).enumerate();
    let kept = ranked.filter(|(rank, (_, is_first))| *rank < MOST_POINTS || *is_first);
    kept.map(|(_, (point, _))| point).collect()
}
