//! Blocks of neighbouring samples. A block is held out as a whole, because errors of the light
//! model and textures affect neighbouring samples in the same way.

use std::collections::BTreeMap;

use crate::geometry::mesh::Mesh;
use crate::math::sampling::Random;
use crate::reconstruct::Stream;
use crate::reconstruct::samples::Sample;

/// Side of a block in half-diagonals of the geometry's bounds.
const SIDE: f32 = 0.2;

/// The blocks of a sample cloud: samples of one surface within one cell of a grid share a block.
pub struct Blocks {
    /// Per sample its block, numbered from 0 in the order of surface and cell.
    pub of_sample: Vec<usize>,
    pub count: usize,
}

impl Blocks {
    pub fn of(mesh: &Mesh, samples: &[Sample]) -> Self {
        let (low, high) = mesh.bounds().unwrap_or_default();
        let side = (SIDE * 0.5 * (high - low).length()).max(f32::MIN_POSITIVE);
        let key = |sample: &Sample| {
            (sample.surface, ((sample.position - low) / side).floor().as_i64vec3().to_array())
        };
        let keys: Vec<_> = samples.iter().map(key).collect();
        let mut number: BTreeMap<_, usize> = keys.iter().map(|key| (*key, 0)).collect();
        number.values_mut().enumerate().for_each(|(index, value)| *value = index);
        Self { of_sample: keys.iter().map(|key| number[key]).collect(), count: number.len() }
    }
}

/// Deals blocks into folds of nearly equal size, at random; per block its fold, below `folds`.
/// Different `purpose`s deal independently of each other.
pub fn deal(count: usize, folds: usize, purpose: u64) -> Vec<usize> {
    let mut order: Vec<u32> = (0..count as u32).collect();
    Random::new(0, Stream::Folds as u64, purpose).shuffle(&mut order);
    let mut fold = vec![0; count];
    for (place, &block) in order.iter().enumerate() {
        fold[block as usize] = place % folds;
    }
    fold
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn sample(surface: usize, position: Vec3) -> Sample {
        Sample { position, normal: Vec3::Z, material: 0, surface, views: 0..0, radiance: [0.0; 3] }
    }

    /// Cell 1 of the x axis of surface 0 and cell 0 of surface 4 had the same key where cells were
    /// shifted by 42 bits and surfaces by 44.
    #[test]
    fn no_two_surfaces_and_no_two_cells_share_a_block() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::new(10.0, 0.0, 0.0), Vec3::new(0.0, 10.0, 0.0)],
            triangles: vec![[0, 1, 2]],
            surface: vec![0],
            ..Mesh::default()
        };
        let mut samples = Vec::new();
        for surface in 0..20 {
            for x in 0..5 {
                samples.push(sample(surface, Vec3::new(1.42 * x as f32 + 0.1, 0.1, 0.0)));
            }
        }
        let blocks = Blocks::of(&mesh, &samples);
        assert_eq!(blocks.count, 100);
        let same = Blocks::of(&mesh, &[samples[0].clone(), samples[0].clone()]);
        assert_eq!(same.of_sample, [0, 0]);
    }

    #[test]
    fn folds_are_nearly_equal_and_differ_by_purpose() {
        let folds = deal(103, 4, 0);
        let size = |k: usize| folds.iter().filter(|&&fold| fold == k).count();
        assert!((0..4).all(|k| (25..=26).contains(&size(k))));
        assert_ne!(folds, deal(103, 4, 1));
        assert!(deal(0, 4, 0).is_empty());
    }
}
