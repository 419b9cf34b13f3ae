//! Converts reflectance spectra to linear Rec. 709.

use glam::{DMat3, DVec3};

use super::color::REC_709_FROM_XYZ;
use super::rgb::Rgb;

const FIRST_NM: f64 = 360.0;
const STEP_NM: f64 = 5.0;

/// X, Y and Z under D65, by the CIE 1931 2° observer, of a reflectance that is 1 at a node, 0 at the
/// others, and between them the cubic of the four nearest; Y of white is 1. Summed at 1 nm from the
/// tables of ISO/CIE 11664-1 and 11664-2, as colour-science has them (`tests/golden/color/charts.py`).
const WEIGHTS: [[f64; 3]; 85] = [
    [1.295614e-06, 3.908511e-08, 6.044701e-06],
    [6.457796e-06, 1.936998e-07, 3.020868e-05],
    [9.437881e-06, 2.830653e-07, 4.426800e-05],
    [1.827344e-05, 5.394874e-07, 8.591553e-05],
    [3.188657e-05, 9.131382e-07, 1.503101e-04],
    [5.538511e-05, 1.579538e-06, 2.613234e-04],
    [1.101364e-04, 3.129945e-06, 5.203966e-04],
    [2.543248e-04, 7.189120e-06, 1.203809e-03],
    [5.406842e-04, 1.496743e-05, 2.563359e-03],
    [9.684389e-04, 2.675800e-05, 4.601949e-03],
    [1.866309e-03, 5.177203e-05, 8.895698e-03],
    [3.406057e-03, 9.524945e-05, 1.628802e-02],
    [5.950865e-03, 1.773083e-04, 2.859324e-02],
    [9.090794e-03, 3.088765e-04, 4.397812e-02],
    [1.183964e-02, 4.835918e-04, 5.778793e-02],
    [1.486534e-02, 7.634295e-04, 7.344126e-02],
    [1.721625e-02, 1.135937e-03, 8.636185e-02],
    [1.829568e-02, 1.567547e-03, 9.370678e-02],
    [1.852140e-02, 2.092075e-03, 9.762715e-02],
    [1.771863e-02, 2.670175e-03, 9.697528e-02],
    [1.619094e-02, 3.336555e-03, 9.292937e-02],
    [1.378897e-02, 4.067045e-03, 8.392891e-02],
    [1.066424e-02, 4.955724e-03, 7.025670e-02],
    [7.756691e-03, 6.154976e-03, 5.687524e-02],
    [5.221693e-03, 7.586149e-03, 4.440628e-02],
    [3.093661e-03, 9.000878e-03, 3.280925e-02],
    [1.650153e-03, 1.075646e-02, 2.404367e-02],
    [7.571722e-04, 1.333517e-02, 1.821732e-02],
    [2.510093e-04, 1.671605e-02, 1.407182e-02],
    [1.219013e-04, 2.091677e-02, 1.088684e-02],
    [4.762673e-04, 2.565165e-02, 8.062122e-03],
    [1.465357e-03, 3.057707e-02, 5.624315e-03],
    [3.145757e-03, 3.529596e-02, 3.898765e-03],
    [5.518542e-03, 3.989348e-02, 2.871733e-03],
    [8.397630e-03, 4.376694e-02, 2.138100e-03],
    [1.132805e-02, 4.591844e-02, 1.499323e-03],
    [1.437029e-02, 4.720625e-02, 1.004585e-03],
    [1.774236e-02, 4.834703e-02, 6.608400e-04],
    [2.129644e-02, 4.888248e-02, 4.297582e-04],
    [2.472554e-02, 4.828967e-02, 2.777494e-04],
    [2.813453e-02, 4.708726e-02, 1.842830e-04],
    [3.150093e-02, 4.544261e-02, 1.276798e-04],
    [3.480403e-02, 4.347587e-02, 9.593860e-05],
    [3.831428e-02, 4.162037e-02, 8.193153e-05],
    [4.135972e-02, 3.926982e-02, 7.417738e-05],
    [4.269443e-02, 3.562556e-02, 6.085885e-05],
    [4.331642e-02, 3.194614e-02, 4.711005e-05],
    [4.462967e-02, 2.935111e-02, 4.166441e-05],
    [4.519720e-02, 2.684387e-02, 3.435048e-05],
    [4.443162e-02, 2.409109e-02, 2.510254e-05],
    [4.246934e-02, 2.130605e-02, 1.481170e-05],
    [3.938023e-02, 1.851563e-02, 1.001262e-05],
    [3.538406e-02, 1.577809e-02, 7.686382e-06],
    [3.039269e-02, 1.298484e-02, 4.171125e-06],
    [2.541965e-02, 1.048493e-02, 1.967516e-06],
    [2.139580e-02, 8.567312e-03, 1.175160e-06],
    [1.768615e-02, 6.910076e-03, 7.840418e-07],
    [1.398046e-02, 5.355390e-03, 3.754653e-07],
    [1.076913e-02, 4.064116e-03, 3.332087e-08],
    [8.283066e-03, 3.090413e-03, -6.282338e-09],
    [6.266807e-03, 2.318255e-03, 5.453311e-26],
    [4.658930e-03, 1.713494e-03, 0.000000e+00],
    [3.391213e-03, 1.241657e-03, 0.000000e+00],
    [2.420572e-03, 8.829273e-04, 0.000000e+00],
    [1.721870e-03, 6.258608e-04, 0.000000e+00],
    [1.153960e-03, 4.181153e-04, 0.000000e+00],
    [7.553770e-04, 2.731800e-04, 0.000000e+00],
    [5.285261e-04, 1.909522e-04, 0.000000e+00],
    [3.844351e-04, 1.388257e-04, 0.000000e+00],
    [2.805106e-04, 1.012965e-04, 0.000000e+00],
    [2.011907e-04, 7.265364e-05, 0.000000e+00],
    [1.323841e-04, 4.780631e-05, 0.000000e+00],
    [8.615342e-05, 3.111158e-05, 0.000000e+00],
    [6.340891e-05, 2.289812e-05, 0.000000e+00],
    [4.748440e-05, 1.714749e-05, 0.000000e+00],
    [3.436735e-05, 1.241068e-05, 0.000000e+00],
    [2.420431e-05, 8.740619e-06, 0.000000e+00],
    [1.568564e-05, 5.664370e-06, 0.000000e+00],
    [9.941112e-06, 3.589917e-06, 0.000000e+00],
    [6.091629e-06, 2.199798e-06, 0.000000e+00],
    [3.814795e-06, 1.377592e-06, 0.000000e+00],
    [3.179288e-06, 1.148099e-06, 0.000000e+00],
    [2.334496e-06, 8.430293e-07, 0.000000e+00],
    [2.217832e-06, 8.008998e-07, 0.000000e+00],
    [5.622936e-07, 2.030545e-07, 0.000000e+00],
];

/// Linear Rec. 709 of a surface under D65, a perfect white being 1, 1, 1. Channels are below 0 where
/// the primaries of Rec. 709 cannot make the colour.
///
/// `wavelengths_nm` increase; between them the reflectance follows the cubic of the four nearest
/// (ASTM E2022), and beyond their ends it stays.
///
/// # Panics
/// If the two differ in length or are empty.
pub fn rec_709(wavelengths_nm: &[f64], reflectances: &[f64]) -> Rgb {
    assert!(wavelengths_nm.len() == reflectances.len() && !reflectances.is_empty());
    let node = |k: usize| FIRST_NM + STEP_NM * k as f64;
    let xyz = |values: &dyn Fn(f64) -> f64| -> DVec3 {
        let terms = WEIGHTS.iter().enumerate();
        terms.map(|(k, weights)| values(node(k)) * DVec3::from_array(*weights)).sum()
    };
    let own = xyz(&|at| value(wavelengths_nm, reflectances, at));
    let matrix = DMat3::from_cols_array(&REC_709_FROM_XYZ).transpose();
    ((matrix * own) / (matrix * xyz(&|_| 1.0))).to_array()
}

/// The value at a wavelength, by the Lagrange polynomial of the nodes about it.
fn value(wavelengths: &[f64], values: &[f64], at: f64) -> f64 {
    let count = wavelengths.len();
    if at <= wavelengths[0] {
        return values[0];
    }
    if at >= wavelengths[count - 1] {
        return values[count - 1];
    }
    let after = wavelengths.partition_point(|own| *own <= at);
    let first = after.saturating_sub(2).min(count.saturating_sub(4));
    let nodes = first..(first + 4).min(count);
    let term = |i: usize| {
        let others = nodes.clone().filter(|&k| k != i);
        others.fold(values[i], |product, k| {
            product * (at - wavelengths[k]) / (wavelengths[i] - wavelengths[k])
        })
    };
    nodes.clone().map(term).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against colour-science, see `tests/golden/color/charts.py`.
    #[test]
    fn spectra_of_patches_are_those_of_colour_science() {
        let golden = include_str!("../../tests/golden/color/charts.json");
        let golden: serde_json::Value = serde_json::from_str(golden).unwrap();
        let numbers = |value: &serde_json::Value| -> Vec<f64> {
            value.as_array().unwrap().iter().map(|own| own.as_f64().unwrap()).collect()
        };
        let wavelengths = numbers(&golden["wavelengths"]);
        let patches = golden["patches"].as_array().unwrap();
        assert_eq!(patches.len(), 24);
        for patch in patches {
            let found = rec_709(&wavelengths, &numbers(&patch["reflectance"]));
            for (found, expected) in std::iter::zip(found, numbers(&patch["rec709"])) {
                assert!((found - expected).abs() < 1e-4, "{}: {found}, {expected}", patch["name"]);
            }
        }
    }

    #[test]
    fn greys_are_grey_whatever_their_wavelengths() {
        for wavelengths in [vec![550.0], vec![400.0, 700.0], vec![380.0, 385.0, 500.0, 730.0]] {
            let grey = rec_709(&wavelengths, &vec![0.3; wavelengths.len()]);
            assert!(grey.iter().all(|value| (value - 0.3).abs() < 1e-12), "{grey:?}");
        }
    }
}
