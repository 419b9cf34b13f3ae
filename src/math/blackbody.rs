//! The colour of a black body of a given temperature, by which lamps are described.

use crate::math::rgb::Rgb;

/// The linear sRGB colour of a black body of a temperature in kelvin (above 0), its largest
/// channel 1. Colours outside the gamut, below about 1900 K, lose their negative blue.
///
/// Planck's law over the CIE 1931 observer in the analytic fit of Wyman, Sloan and Shirley,
/// "Simple Analytic Approximations to the CIE XYZ Color Matching Functions" (2013).
pub fn blackbody(kelvin: f64) -> Rgb {
    /// The second radiation constant in nm K.
    const C2: f64 = 1.438_776_877e7;
    let mut xyz = [0.0; 3];
    for step in 0..=94 {
        let nm = 360.0 + 5.0 * f64::from(step);
        let power = (560.0 / nm).powi(5) / ((C2 / (nm * kelvin)).exp_m1());
        for (sum, part) in xyz.iter_mut().zip(observer(nm)) {
            *sum += power * part;
        }
    }
    let [x, y, z] = xyz;
    let rgb = [
        3.240_97 * x - 1.537_383 * y - 0.498_611 * z,
        -0.969_244 * x + 1.875_968 * y + 0.041_555 * z,
        0.055_63 * x - 0.203_977 * y + 1.056_972 * z,
    ];
    let largest = rgb.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    rgb.map(|value| (value / largest).max(0.0))
}

/// The colour matching functions at a wavelength in nanometres.
fn observer(nm: f64) -> [f64; 3] {
    let lobe = |height: f64, center: f64, left: f64, right: f64| {
        let away = (nm - center) * if nm < center { left } else { right };
        height * (-0.5 * away * away).exp()
    };
    [
        lobe(0.362, 442.0, 0.0624, 0.0374)
            + lobe(1.056, 599.8, 0.0264, 0.0323)
            + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chromaticities of the Planckian locus (CIE 015): illuminant A (2856 K) and 6500 K.
    #[test]
    fn colours_lie_on_the_planckian_locus() {
        for (kelvin, expected) in [(2856.0, [0.4476, 0.4074]), (6500.0, [0.3135, 0.3236])] {
            let [r, g, b] = blackbody(kelvin);
            let x = 0.412_391 * r + 0.357_584 * g + 0.180_481 * b;
            let y = 0.212_639 * r + 0.715_169 * g + 0.072_192 * b;
            let z = 0.019_331 * r + 0.119_195 * g + 0.950_532 * b;
            let sum = x + y + z;
            let away = (x / sum - expected[0]).abs().max((y / sum - expected[1]).abs());
            // What the analytic observer differs by from the tables.
            assert!(away < 0.004, "{kelvin} K: {} {}", x / sum, y / sum);
        }
        assert_eq!(blackbody(1000.0)[2], 0.0);
        assert!(blackbody(20_000.0)[0] < blackbody(20_000.0)[2]);
    }
}
