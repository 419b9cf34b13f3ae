//! The couplings of a light model with the rows of a problem.

use std::sync::Arc;

use faer::Mat;

use crate::math::rgb::Radiance;
use crate::solve::kernels::column_of;

/// How the light reaches the rows. Single precision is what rays give; sums over it are of double
/// precision.
#[derive(Clone, Debug)]
pub struct Design {
    /// k_ij, rows × columns.
    pub diffuse: Arc<Mat<f32>>,
    /// Irradiance per channel that is no unknown: I_s and lights of known emission.
    pub base: [Vec<f64>; 3],
    /// (n+2)/2 cosⁿγ k_ij, glossy rows × columns.
    pub specular: Arc<Mat<f32>>,
    /// The same part of `base`, per channel and glossy row.
    pub specular_base: [Vec<f64>; 3],
    /// `SurfaceLight::patches` with which `specular_base` was computed.
    pub patches: Arc<Vec<Radiance>>,
}

impl Design {
    /// Whether `specular_base` was computed with this light of unphotographed surfaces.
    pub fn has_patches(&self, patches: &Arc<Vec<Radiance>>) -> bool {
        Arc::ptr_eq(&self.patches, patches)
    }

    /// Number of emissions.
    pub fn columns(&self) -> usize {
        self.diffuse.ncols()
    }

    /// k_ij of one column.
    pub fn diffuse_of(&self, column: usize) -> &[f32] {
        column_of((*self.diffuse).as_ref(), column)
    }

    /// (n+2)/2 cosⁿγ k_ij of one column, per glossy row.
    pub fn specular_of(&self, column: usize) -> &[f32] {
        if self.specular.nrows() == 0 {
            return &[];
        }
        column_of((*self.specular).as_ref(), column)
    }
}
