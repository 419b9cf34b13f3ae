//! How exposures are merged.

use super::Vignetting;

/// Below this share of light left, dividing the vignetting out would amplify noise and errors
/// of the model beyond use.
pub const DARKEST_CORNER: f64 = 0.02;

crate::choices! {
    /// The response: how codes follow from exposure.
    ResponseKind {
        /// Linear for 16-bit files, recovered for others.
        Auto = "auto",
        /// Recovered from the exposures.
        Recover = "recover",
        /// Codes are proportional to exposure.
        Linear = "linear",
    }
}

crate::choices! {
    /// The weight of each exposure at a pixel.
    Weights {
        /// By how well a code determines ln E, and nothing at both ends of the range.
        Noise = "noise",
        /// The triangle of Debevec and Malik (Eq. 4), averaged over the channels as OpenCV has it.
        Hat = "hat",
    }
}

crate::choices! {
    /// The colours of RAW photographs.
    RawColor {
        /// Linear sRGB, by the camera's matrix for daylight; no white balance.
        Srgb = "srgb",
        /// What the sensor measured behind its filters.
        Camera = "camera",
    }
}

crate::options! {
    /// Options of merging exposures.
    MergeOptions in "merge" {
        /// Response of the camera, from exposure to codes: recovered from the exposures, linear
        /// (RAW developed to 16 bits), or auto: linear for 16-bit files, recovered for others.
        response: ResponseKind = ResponseKind::Auto, None, "";
        /// Weight of each exposure at a pixel: by its noise, or hat, the triangle of Debevec and
        /// Malik 1997, as in OpenCV.
        weights: Weights = Weights::Noise, None, "";
        /// Smoothness of a recovered response, lambda of Debevec and Malik 1997, Eq. 3, as it
        /// would be with 70 pixels.
        smoothness: f64 = 20.0, Some((0.1, 10_000.0)), "";
        /// Pixels that a response is recovered from, over all series.
        pixels: usize = 4000, Some((100.0, 100_000.0)), "";
        /// Codes at and below this fraction of full scale are not used; with a linear response
        /// it is also the level of no light.
        black: f64 = 0.0, Some((0.0, 0.5)), "";
        /// Codes at and above this fraction of full scale are saturated.
        saturation: f64 = 0.98, Some((0.5, 1.0)), "";
        /// Find the translations of hand-held exposures, and undo them.
        align: bool = true, None, "";
        /// Colours of RAW photographs: linear sRGB by the camera's matrix for daylight, the same for
        /// all lights and photographs (no white balance), or the channels of the camera's sensor.
        raw_color: RawColor = RawColor::Srgb, None, "";
        /// Vignetting to divide out: the images are radiance times 1 + a r^2 + b r^4, r in half
        /// diagonals from the middle; this is a.
        vignetting_a: f64 = 0.0, Some((-0.95, 2.0)), "";
        /// The same, b.
        vignetting_b: f64 = 0.0, Some((-0.95, 2.0)), "";
    }
}

impl MergeOptions {
    /// The codes between which a pixel is a measurement, both excluded, in 255ths of full scale.
    pub fn usable(&self) -> (f32, f32) {
        let full = f64::from(super::FULL_SCALE);
        ((self.black * full) as f32, (self.saturation * full) as f32)
    }

    /// Whether the vignetting leaves light enough everywhere to divide it out.
    pub fn check_corners(&self) -> Result<(), &'static str> {
        if self.vignetting().darkest() < DARKEST_CORNER {
            return Err("the vignetting leaves no light at the corners. Correct \
                        --merge.vignetting_a and --merge.vignetting_b: r is in half diagonals");
        }
        Ok(())
    }

    pub fn vignetting(&self) -> Vignetting {
        Vignetting { a: self.vignetting_a, b: self.vignetting_b }
    }
}
