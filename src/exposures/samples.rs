//! Pixels that the response is estimated from: ones without motion, spread over the image.
//!
//! A pixel on an edge is at another place in every exposure of a series that moved or was
//! sharpened, so of a few candidates in each cell of a grid the one with the flattest
//! neighbourhood is taken.

use rayon::prelude::*;

use super::Exposure;
use crate::math::sampling::{Random, grid_side};

/// Candidates in each cell.
const CANDIDATES: usize = 12;
/// Codes within which a pixel is of use to the response, in 255ths of full scale.
const TELLING: std::ops::Range<f32> = 5.0..250.0;

/// What the chosen pixels of one series read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readings {
    /// Of each exposure.
    pub seconds: Vec<f64>,
    /// For each pixel one code triple an exposure, in 255ths of full scale; NaN where the
    /// exposure does not show it.
    pub codes: Vec<[f32; 3]>,
}

impl Readings {
    pub fn pixels(&self) -> std::slice::ChunksExact<'_, [f32; 3]> {
        self.codes.chunks_exact(self.seconds.len().max(1))
    }
}

/// Reads about `count` pixels of a series. `reference` has a shift of 0; `stream` makes different
/// series look at different places.
pub fn read(exposures: &[Exposure], reference: usize, count: usize, stream: u64) -> Readings {
    let seconds = exposures.iter().map(|exposure| exposure.seconds).collect();
    let Some(image) = exposures.get(reference) else {
        return Readings { seconds, codes: Vec::new() };
    };
    let (width, height) = (image.width, image.height);
    if width < 3 || height < 3 {
        return Readings { seconds, codes: Vec::new() };
    }
    let side = grid_side(count);
    let codes = (0..side * side)
        .into_par_iter()
        .filter_map(|cell| {
            let mut random = Random::new(0, stream, cell as u64);
            let (column, row) = (cell % side, cell / side);
            let place = |cell: usize, within: f32, length: usize| {
                let place = (cell as f32 + within) / side as f32 * (length - 2) as f32;
                1 + (place as usize).min(length - 3)
            };
            let mut best: Option<(f32, Vec<[f32; 3]>)> = None;
            for _ in 0..CANDIDATES {
                let within = random.point();
                let (x, y) = (place(column, within.x, width), place(row, within.y, height));
                let Some((contrast, reading)) = look(exposures, x, y) else { continue };
                if best.as_ref().is_none_or(|(least, _)| contrast < *least) {
                    best = Some((contrast, reading));
                }
            }
            best.map(|(_, reading)| reading)
        })
        .flatten_iter()
        .collect();
    Readings { seconds, codes }
}

/// The codes at (x, y) of the reference and the largest contrast around it, if two exposures
/// are of use there.
fn look(exposures: &[Exposure], x: usize, y: usize) -> Option<(f32, Vec<[f32; 3]>)> {
    let mut reading = Vec::with_capacity(exposures.len());
    let mut telling = 0;
    let mut contrast = 0.0_f32;
    for exposure in exposures {
        let Some(index) = exposure.index(x, y) else {
            reading.push([f32::NAN; 3]);
            continue;
        };
        let code = exposure.codes.at(index);
        reading.push(code);
        if !code.iter().any(|code| TELLING.contains(code)) {
            continue;
        }
        telling += 1;
        let around = [(-1, 0), (1, 0), (0, -1), (0, 1)];
        for (dx, dy) in around {
            let near = x.checked_add_signed(dx).zip(y.checked_add_signed(dy));
            let Some(near) = near.and_then(|(x, y)| exposure.index(x, y)) else { continue };
            let near = exposure.codes.at(near);
            for channel in 0..3 {
                if TELLING.contains(&code[channel]) {
                    contrast = contrast.max((near[channel] - code[channel]).abs());
                }
            }
        }
    }
    (telling >= 2).then_some((contrast, reading))
}
