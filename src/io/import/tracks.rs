//! The points of an import with where each photograph shows them.

use glam::DVec2;

use super::Import;
use crate::model::FoundPoint;

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
    let point = |(position, mut seen): (&glam::DVec3, Vec<(usize, DVec2)>)| {
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
    kept(points)
}

/// The first of the points, and of each photograph the first that it shows, in their order.
fn kept(points: Vec<FoundPoint>) -> Vec<FoundPoint> {
    let photographs = points.iter().flat_map(|own| &own.photographs).max().map_or(0, |own| own + 1);
    let mut counts = vec![0; photographs];
    let is_kept = |(rank, point): (usize, &FoundPoint)| {
        let is_scarce = point.photographs.iter().any(|&photograph| counts[photograph] < OF_EACH);
        point.photographs.iter().for_each(|&photograph| counts[photograph] += 1);
        rank < MOST_POINTS || is_scarce
    };
    let kept: Vec<bool> = points.iter().enumerate().map(is_kept).collect();
    points.into_iter().zip(kept).filter(|own| own.1).map(|own| own.0).collect()
}
