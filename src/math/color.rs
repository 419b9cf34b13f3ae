//! Visible differences between colours: CIELAB and the colour difference CIEDE2000.

use glam::{DMat3, DVec3};

use super::rgb::Rgb;

/// XYZ to linear Rec. 709 with its white, D65; row by row (from the chromaticities of Rec. ITU-R
/// BT.709).
pub const REC_709_FROM_XYZ: [f64; 9] = [
    3.240_969_941_904_52,
    -1.537_383_177_570_09,
    -0.498_610_760_293_00,
    -0.969_243_636_280_88,
    1.875_967_501_507_72,
    0.041_555_057_407_18,
    0.055_630_079_696_99,
    -0.203_976_958_888_98,
    1.056_971_514_242_88,
];

/// L*, a* and b* of linear Rec. 709 that is seen beside a white of 1, 1, 1 (CIE 15:2004, 8.2.1).
pub fn lab(rgb: Rgb) -> [f64; 3] {
    let xyz_from_rgb = DMat3::from_cols_array(&REC_709_FROM_XYZ).transpose().inverse();
    let relative = (xyz_from_rgb * DVec3::from_array(rgb)) / (xyz_from_rgb * DVec3::ONE);
    let [x, y, z] = relative.to_array().map(|t| {
        if t > (6.0_f64 / 29.0).powi(3) { t.cbrt() } else { t * 841.0 / 108.0 + 4.0 / 29.0 }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// CIEDE2000 of two colours in CIELAB, in the notation of Sharma, Wu and Dalal, "The CIEDE2000
/// color-difference formula", 2005, Eq. 2 to 22.
pub fn difference(first: [f64; 3], second: [f64; 3]) -> f64 {
    let chroma = |lab: [f64; 3]| lab[1].hypot(lab[2]);
    let seventh = |c: f64| (c.powi(7) / (c.powi(7) + 25.0_f64.powi(7))).sqrt();
    let g = 0.5 * (1.0 - seventh(0.5 * (chroma(first) + chroma(second))));
    let adjusted = |[l, a, b]: [f64; 3]| {
        let a = (1.0 + g) * a;
        let hue =
            if a == 0.0 && b == 0.0 { 0.0 } else { b.atan2(a).to_degrees().rem_euclid(360.0) };
        (l, a.hypot(b), hue)
    };
    let ((l1, c1, h1), (l2, c2, h2)) = (adjusted(first), adjusted(second));
    let grey = c1 * c2 == 0.0;
    let turn = match h2 - h1 {
        _ if grey => 0.0,
        turn if turn > 180.0 => turn - 360.0,
        turn if turn < -180.0 => turn + 360.0,
        turn => turn,
    };
    let hue_difference = 2.0 * (c1 * c2).sqrt() * (0.5 * turn).to_radians().sin();
    let (l, c) = (0.5 * (l1 + l2), 0.5 * (c1 + c2));
    let h = match h1 + h2 {
        sum if grey => sum,
        sum if (h1 - h2).abs() <= 180.0 => 0.5 * sum,
        sum if sum < 360.0 => 0.5 * (sum + 360.0),
        sum => 0.5 * (sum - 360.0),
    };
    let cosine = |degrees: f64| degrees.to_radians().cos();
    let t = 1.0 - 0.17 * cosine(h - 30.0) + 0.24 * cosine(2.0 * h) + 0.32 * cosine(3.0 * h + 6.0)
        - 0.20 * cosine(4.0 * h - 63.0);
    let from_50 = (l - 50.0).powi(2);
    let s_l = 1.0 + 0.015 * from_50 / (20.0 + from_50).sqrt();
    let (s_c, s_h) = (1.0 + 0.045 * c, 1.0 + 0.015 * c * t);
    let angle = 60.0 * (-((h - 275.0) / 25.0).powi(2)).exp();
    let rotation = -2.0 * seventh(c) * angle.to_radians().sin();
    let [l, c, h] = [(l2 - l1) / s_l, (c2 - c1) / s_c, hue_difference / s_h];
    (l * l + c * c + h * h + rotation * c * h).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pairs of Sharma, Wu and Dalal, Table 1, and colour-science's Lab of chart patches
    /// (`tests/golden/color/charts.py`).
    #[test]
    fn lab_and_differences_are_those_published() {
        let golden = include_str!("../../tests/golden/color/charts.json");
        let golden: serde_json::Value = serde_json::from_str(golden).unwrap();
        let triple = |value: &serde_json::Value| [0, 1, 2].map(|k| value[k].as_f64().unwrap());
        let pairs = golden["differences"].as_array().unwrap();
        assert_eq!(pairs.len(), 34);
        for pair in pairs {
            let found = difference(triple(&pair["a"]), triple(&pair["b"]));
            // Published to four decimals.
            assert!((found - pair["published"].as_f64().unwrap()).abs() < 0.5001e-4, "{pair}");
            assert!((found - pair["colour_science"].as_f64().unwrap()).abs() < 1e-9, "{pair}");
        }
        for patch in golden["patches"].as_array().unwrap() {
            let found = lab(triple(&patch["rec709"]));
            let expected = triple(&patch["lab"]);
            let off = std::iter::zip(found, expected).map(|(a, b)| (a - b).abs());
            // Its matrix has the white of four decimals.
            assert!(off.fold(0.0, f64::max) < 1e-3, "{found:?}: {patch}");
        }
    }

    #[test]
    fn a_colour_is_as_far_from_itself_as_0() {
        for lab in [[0.0; 3], [50.0, 0.0, 0.0], [50.0, -30.0, 20.0]] {
            assert_eq!(difference(lab, lab), 0.0);
        }
    }
}
