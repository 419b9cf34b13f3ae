//! Options of the joint solve.

use crate::options;

options! {
    /// The joint solve of light and reflectances.
    JointOptions in "joint" {
        /// Sets of lights that the result is averaged over; their spread goes into the
        /// intervals. With 1 there are no intervals, and the run takes a fraction of the time.
        light_sets: usize = 6, Some((1.0, 100.0)), "";
        /// Largest number of lamps, which are placed anywhere in space; 0 for none.
        max_lamps: usize = 6, Some((0.0, 30.0)), "";
        /// Look for a sun where tags.json gives none.
        find_sun: bool = true, None, "";
        /// Radius of the sphere that carries the background's lights.
        radius_factor: f64 = 1.2, Some((1.0, 100.0)), "half-diagonals";
        /// Distance between the lights of the coarse background, which lamps and a sun complement.
        coarse_spacing: f64 = 0.6, Some((0.1, 3.0)), "half-diagonals";
        /// Side of the grid of lobes of each light of the coarse background.
        coarse_grid: usize = 3, Some((1.0, 12.0)), "";
        /// Exponent of the lobes of the coarse background.
        coarse_exponent: f64 = 5.0, Some((0.0, 1e3)), "";
        /// Distance between fine lights, which are tried in place of lamps and in addition to them.
        fine_spacing: f64 = 0.32, Some((0.05, 3.0)), "half-diagonals";
        /// Side of the grid of lobes of each fine light.
        fine_grid: usize = 6, Some((1.0, 12.0)), "";
        /// Exponent of the fine lights' lobes.
        fine_exponent: f64 = 20.0, Some((0.0, 1e3)), "";
        /// Ridge on the background's emissions, relative to their columns' norms; the light sets
        /// vary it by a factor of 3 either way.
        ridge: f64 = 1e-2, Some((0.0, 1.0)), "";
        /// Residuals larger than this many standard deviations of their material have less
        /// weight (Cauchy's loss), and materials are weighted by the inverse of that deviation, so
        /// that textured and cluttered surfaces do not determine the light. 0 is least squares.
        robust: f64 = 2.5, Some((0.0, 100.0)), "standard deviations";
        /// Reflectance of the brightest diffuse surfaces: fresh plaster and white paint. No part
        /// of a surface is taken to be brighter.
        brightest: f64 = 0.9, Some((0.05, 1.0)), "";
        /// Weak prior on the scale: the mean of the log reflectances is normal about the
        /// logarithm of this.
        prior_mean: f64 = 0.35, Some((0.01, 1.0)), "";
        /// Standard deviation of that mean, of the logarithm.
        prior_sd: f64 = 0.25, Some((0.01, 10.0)), "";
        /// Standard deviation by which that mean differs between channels, of the logarithm.
        channel_tie: f64 = 0.5, Some((0.01, 10.0)), "";
    }
}

impl JointOptions {
    /// Rough upper bound on the lobes of the largest light set that these options ask for.
    pub fn largest_set(&self) -> usize {
        // A sphere of r half-diagonals holds about 0.7 · 4π r² / d² lights at spacing d.
        let lights = |spacing: f64| 8.8 * (1.35 * self.radius_factor / (0.7 * spacing)).powi(2);
        let fine = lights(self.fine_spacing) * (self.fine_grid * self.fine_grid) as f64;
        let coarse = lights(self.coarse_spacing) * (self.coarse_grid * self.coarse_grid) as f64;
        // Of all lobes those are held that reach the surfaces: in random rooms and the full captures up to a thirtieth.
        fine.max(coarse) as usize / 16 + 7 * self.max_lamps
    }
}
