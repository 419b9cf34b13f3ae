//! FLIP beside NVIDIA's own implementation, on stored pairs (`tests/golden/flip/make.py`).
//!
//! Means agree to 1e-5. FLIP takes the square root of differences of edges, so where there is next
//! to none the rounding of single precision (1e-7) shows as 3e-4 in a pixel.

use lobelia::study::flip::{Linear, hdr, ldr};
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f32> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap() as f32).collect()
}

#[test]
fn flip_is_that_of_its_authors() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/flip/pairs.json");
    let pairs: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let pairs = pairs.as_array().unwrap();
    assert_eq!(pairs.len(), 3);
    for pair in pairs {
        let picture = |name: &str| -> Vec<[f32; 3]> {
            numbers(&pair[name]).chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
        };
        let width = pair["width"].as_u64().unwrap() as usize;
        let ppd = pair["ppd"].as_f64().unwrap() as f32;
        let (truth, test) = (picture("truth"), picture("test"));
        let view = |pixels| Linear { width, pixels };
        let compare = if pair["kind"] == "hdr" { hdr } else { ldr };
        let errors = compare(view(&truth), view(&test), ppd);
        let expected = numbers(&pair["errors"]);
        assert_eq!(errors.len(), expected.len());
        for (index, (error, expected)) in errors.iter().zip(&expected).enumerate() {
            assert!((error - expected).abs() < 4e-4, "pixel {index}: {error}, not {expected}");
        }
        let mean = errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len() as f64;
        assert!((mean - pair["mean"].as_f64().unwrap()).abs() < 1e-4);
        assert!(mean > 0.05, "the pictures of a pair differ");
    }
}
