//! Upsamples the light of a coarse picture, guided by the surfaces of a picture of higher
//! resolution.

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance};
use crate::render::denoise::{GUIDES, Guides, alike};

impl Guides {
    /// What each of the four nearest pixels of a coarser picture counts for a pixel of this one, in
    /// 255 parts: those that show the same surface count. `factor` pixels lie along one of the coarse
    /// picture's.
    pub fn shares(&self, coarse: &Self, factor: usize) -> Vec<[u8; 4]> {
        let pixel = |index: usize| {
            let (x, y) = (index % self.width, index / self.width);
            let across = coarse.around(x, factor, coarse.width);
            let down = coarse.around(y, factor, coarse.height);
            let own: [f32; GUIDES] = std::array::from_fn(|plane| self.plane(y, plane)[x]);
            let weights: [f32; 4] = std::array::from_fn(|corner| {
                let ((u, share), (v, part)) = (across[corner % 2], down[corner / 2]);
                let other: [f32; GUIDES] = std::array::from_fn(|plane| coarse.plane(v, plane)[u]);
                let away =
                    |at: usize, to: usize| (to as f32 + 0.5) * factor as f32 - (at as f32 + 0.5);
                // Where none shows the same surface all count.
                share
                    * part
                    * (alike(own, other, [own[5], own[6]], [away(x, u), away(y, v)], 0.0) + 1e-6)
            });
            let sum: f32 = weights.iter().sum();
            weights.map(|weight| (255.0 * weight / sum).round() as u8)
        };
        (0..self.albedo.len()).into_par_iter().map(pixel).collect()
    }

    /// The two pixels of a row or column of these that lie around one of a finer picture, with what
    /// they count for.
    fn around(&self, at: usize, factor: usize, count: usize) -> [(usize, f32); 2] {
        let last = count.saturating_sub(1);
        let place = ((at as f32 + 0.5) / factor as f32 - 0.5).clamp(0.0, last as f32);
        let low = place as usize;
        let part = place - low as f32;
        [(low, 1.0 - part), ((low + 1).min(last), part)]
    }

    /// A coarser picture's layer as finely as these pixels, by their [`shares`](Self::shares).
    pub fn refined(
        &self,
        layer: &[Radiance],
        coarse: &Self,
        factor: usize,
        shares: &[[u8; 4]],
    ) -> Vec<Radiance> {
        let light: Vec<Radiance> = layer
            .iter()
            .zip(&coarse.albedo)
            .map(|(light, albedo)| std::array::from_fn(|c| light[c] / albedo[c]))
            .collect();
        let columns: Vec<[usize; 2]> = (0..self.width)
            .map(|x| coarse.around(x, factor, coarse.width).map(|(column, _)| column))
            .collect();
        let mut result = vec![[0.0; CHANNELS]; self.albedo.len()];
        result.par_chunks_mut(self.width.max(1)).enumerate().for_each(|(y, row)| {
            let rows = coarse.around(y, factor, coarse.height);
            let [above, below] = rows.map(|(row, _)| &light[row * coarse.width..][..coarse.width]);
            for (x, result) in row.iter_mut().enumerate() {
                let index = y * self.width + x;
                let [left, right] = columns[x];
                let four = [above[left], above[right], below[left], below[right]];
                let shares = shares[index].map(f32::from);
                let sum: f32 = shares.iter().sum();
                *result = std::array::from_fn(|c| {
                    let light = (0..4).map(|k| shares[k] * four[k][c]).sum::<f32>();
                    light / sum.max(1.0) * self.albedo[index][c]
                });
            }
        });
        result
    }
}
