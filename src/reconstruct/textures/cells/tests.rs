use std::sync::atomic::{AtomicUsize, Ordering};

use glam::Vec3;

use super::*;
use crate::scene::SurfacePoint;

const WIDTH: usize = 48;

/// A value of several parts, each a function of the column and the row, that counts what it computes.
struct Counted {
    parts: Vec<fn(f64, f64) -> f64>,
    computed: AtomicUsize,
}

impl Counted {
    fn new(parts: Vec<fn(f64, f64) -> f64>) -> Self {
        Self { parts, computed: AtomicUsize::new(0) }
    }

    fn at(&self, texel: usize) -> f64 {
        let (x, y) = ((texel % WIDTH) as f64, (texel / WIDTH) as f64);
        self.parts.iter().map(|part| part(x, y)).sum()
    }
}

impl Sum for Counted {
    fn parts(&self) -> usize {
        self.parts.len()
    }

    fn compute(&self, texel: usize, parts: &[usize], values: &mut [Radiance]) {
        self.computed.fetch_add(parts.len(), Ordering::Relaxed);
        let (x, y) = ((texel % WIDTH) as f64, (texel / WIDTH) as f64);
        for &part in parts {
            values[part] = [self.parts[part](x, y) as f32; CHANNELS];
        }
    }
}

/// The polygon of each texel, where it has a place.
fn places(polygon: impl Fn(usize, usize) -> Option<u32>) -> Vec<Option<Place>> {
    let point = SurfacePoint { position: Vec3::ZERO, normal: Vec3::Z };
    let of_texel = |texel| Some(Place { polygon: polygon(texel % WIDTH, texel / WIDTH)?, point });
    (0..WIDTH * WIDTH).map(of_texel).collect()
}

/// Largest difference from the function itself, relative, over all placed texels.
fn error(places: &[Option<Place>], sum: &Counted, finest: usize) -> f64 {
    let grid = Grid { places, width: WIDTH, stride: 16, finest };
    let found = grid.map(sum, &Watch::new()).unwrap();
    let mut largest = 0.0f64;
    for (texel, (found, place)) in found.iter().zip(places).enumerate() {
        assert_eq!(found.is_some(), place.is_some(), "texel {texel}");
        let Some(found) = found else { continue };
        largest = largest.max((found[0] / sum.at(texel) - 1.0).abs());
    }
    largest
}

#[test]
fn what_changes_evenly_is_interpolated_exactly() {
    let places = places(|_, _| Some(0));
    let sum = Counted::new(vec![|x, y| 100.0 + 0.1 * x + 0.2 * y]);
    assert!(error(&places, &sum, 1) < 1e-6);
    let computed = sum.computed.into_inner();
    // Four corners of each of nine cells.
    assert_eq!(computed, 36);
}

#[test]
fn only_the_light_whose_shadow_has_an_edge_is_computed_at_every_texel_there() {
    let places = places(|_, _| Some(0));
    let edge: fn(f64, f64) -> f64 = |x, y| if x + 0.3 * y < 25.0 { 1.0 } else { 0.0 };
    let even: fn(f64, f64) -> f64 = |x, _| 0.1 + 1e-5 * x;
    let mut parts = vec![even; 99];
    parts.push(edge);
    let sum = Counted::new(parts);
    let error = error(&places, &sum, 1);
    // The whole is about ten, so the edge is no more than is interpolated over.
    assert!(error <= SMOOTH, "{error}");
    let few = Counted::new(vec![even, edge, even]);
    assert!(self::error(&places, &few, 1) < 1e-3);
    let computed = few.computed.into_inner();
    let all = 3 * WIDTH * WIDTH;
    assert!(computed < all / 6, "{computed} of {all}");
}

#[test]
fn polygons_are_apart_and_gaps_have_no_value() {
    // Stripes of three texels with gaps between, and a wide polygon beside them.
    let polygon = |x: usize, y: usize| match x {
        0..20 => (y % 4 < 3).then_some(y as u32 / 4),
        20..22 => None,
        _ => Some(1000),
    };
    let places = places(polygon);
    let value: fn(f64, f64) -> f64 =
        |x, y| if x < 20.0 { 1.0 + (y / 4.0).floor() } else { 1000.0 + x };
    let sum = Counted::new(vec![value]);
    assert!(error(&places, &sum, 1) < 1e-6);
    let computed = sum.computed.into_inner();
    let placed = places.iter().flatten().count();
    assert!(computed < placed / 3, "{computed} of {placed}");
}

#[test]
fn cells_below_the_finest_are_interpolated_whatever_they_hold() {
    let places = places(|_, _| Some(0));
    let steep: fn(f64, f64) -> f64 = |x, y| 1.0 + x * x + y * y;
    let (fine, coarse) = (Counted::new(vec![steep]), Counted::new(vec![steep]));
    let errors = [error(&places, &fine, 1), error(&places, &coarse, 8)];
    assert!(errors[0] < errors[1] && errors[0] < SMOOTH, "{errors:?}");
    assert!(coarse.computed.into_inner() < fine.computed.into_inner());
}
