//! The Khronos PBR Neutral tone mapper (Khronos Group, ToneMapping, PBR_Neutral, 2024), which
//! `common.wgsl` has once more. Its symbols are those of the specification there.

use crate::math::rgb::{Radiance, Rgb};

/// F₉₀: what a shiny dielectric of refractive index 1.5 adds to its colour.
const SHINE: f64 = 0.04;
/// K_s: where highlights begin to be compressed.
const START: f64 = 0.8 - SHINE;
/// K_d: how fast they lose their colour.
const DESATURATION: f64 = 0.15;

/// Linear Rec. 709 from 0 to 1 for exposed radiance that is not negative.
pub fn neutral(exposed: Radiance) -> Radiance {
    let exposed: Rgb = exposed.map(f64::from);
    let x = exposed.into_iter().fold(f64::INFINITY, f64::min);
    let f = if x <= 2.0 * SHINE { x - x * x / (4.0 * SHINE) } else { SHINE };
    let base = exposed.map(|value| value - f);
    let p = base.into_iter().fold(0.0, f64::max);
    if p <= START {
        return base.map(|value| value as f32);
    }
    let p_n = 1.0 - (1.0 - START).powi(2) / (p + 1.0 - 2.0 * START);
    let g = 1.0 / (DESATURATION * (p - p_n) + 1.0);
    base.map(|value| (value * p_n / p * g + p_n * (1.0 - g)) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the specification says of it in words, and values of its formula in exact fractions
    /// (`tests/golden/color/neutral.py`).
    #[test]
    fn values_are_those_of_the_specification() {
        let golden = include_str!("../../../tests/golden/color/neutral.json");
        let golden: serde_json::Value = serde_json::from_str(golden).unwrap();
        let values = golden["values"].as_array().unwrap();
        assert!(values.len() > 80);
        for pair in values {
            let triple = |key: &str| [0, 1, 2].map(|k| pair[key][k].as_f64().unwrap() as f32);
            let (found, expected) = (neutral(triple("in")), triple("out"));
            for (found, expected) in std::iter::zip(found, expected) {
                assert!((found - expected).abs() < 2e-6, "{found} for {expected}: {pair}");
            }
        }
        // Between 0.08 and 0.8 of all channels colours lose 0.04, and no more.
        for color in [[0.1, 0.5, 0.79], [0.08, 0.08, 0.8], [0.3; 3]] {
            let found = neutral(color);
            for (found, own) in std::iter::zip(found, color) {
                assert!((found - (own - 0.04)).abs() < 1e-6, "{found} for {own}");
            }
        }
        // Never above white, and white in the end.
        assert!(neutral([1e6, 3e5, 0.0]).iter().all(|own| (0.99..=1.0).contains(own)));
    }
}
