use super::*;

/// Beside the C library's, over all magnitudes, and closely about 1, where logarithms cancel.
#[test]
fn the_inlined_logarithm_is_that_of_the_library() {
    let mut worst = 0.0f64;
    let mut compare = |x: f64| {
        let (own, library) = (vectorised!(ln(x)), x.ln());
        let error = (own - library).abs() / library.abs().max(f64::MIN_POSITIVE);
        worst = worst.max(if own == library { 0.0 } else { error });
    };
    for step in 0..100_000 {
        let step = f64::from(step) / 100_000.0;
        compare((600.0 * (step - 0.5)).exp());
        compare(0.7 + 0.72 * step);
        compare(1.0 + 1e-6 * (step - 0.5));
    }
    for x in [1.0, f64::MIN_POSITIVE, f64::MAX, 0.5f64.sqrt(), 2.0f64.sqrt(), 2.0, 0.5] {
        compare(x);
    }
    assert!(worst < 3e-16, "{worst}");
    assert_eq!(ln(1.0), 0.0);
    assert!(ln(f64::INFINITY).is_nan() && ln(f64::NAN).is_nan());
}

#[test]
fn the_logarithm_in_single_precision_is_that_of_the_library() {
    let mut worst = 0.0f64;
    let mut compare = |x: f32| {
        let (own, library) = (f64::from(vectorised!(log2(x))), f64::from(x).log2());
        let error = (own - library).abs() / library.abs().max(f64::MIN_POSITIVE);
        worst = worst.max(if own == library { 0.0 } else { error });
    };
    for step in 0..100_000 {
        let step = step as f32 / 100_000.0;
        compare((160.0 * (step - 0.5)).exp());
        compare(0.7 + 0.72 * step);
        compare(1.0 - 1e-3 * step);
    }
    for x in [1.0, f32::MIN_POSITIVE, f32::MAX, 0.5f32.sqrt(), 2.0f32.sqrt(), 2.0, 0.5] {
        compare(x);
    }
    assert!(worst < 3e-7, "{worst}");
}

#[test]
fn columns_added_together_are_those_added_one_after_the_other() {
    let column = |j: usize| -> Vec<f64> {
        (0..37).map(|i| ((i * 7 + j * 13) as f64).sin() / (1 + i + j) as f64).collect()
    };
    for count in 0..10 {
        let columns: Vec<Vec<f64>> = (1..=count).map(column).collect();
        let terms: Vec<(f64, &[f64])> =
            columns.iter().enumerate().map(|(j, x)| (0.3 + j as f64, &x[..])).collect();
        let (mut together, mut each) = (column(0), column(0));
        vectorised!(add_all_scaled(&mut together, &terms));
        terms.iter().for_each(|(factor, x)| add_scaled(&mut each, *factor, x));
        assert_eq!(together, each, "{count}");
    }
}

#[test]
fn columns_that_are_multiplied_together_are_multiplied_as_one_by_one() {
    let mut random = crate::math::sampling::Random::new(5, 0, 0);
    for rows in [0, 1, 7, 64, 101] {
        let columns: Vec<Vec<f32>> =
            (0..6).map(|_| (0..rows).map(|_| random.uniform() - 0.5).collect()).collect();
        let weights: [Vec<f64>; 2] =
            std::array::from_fn(|_| (0..rows).map(|_| f64::from(random.uniform()) - 0.5).collect());
        let all: Vec<usize> = (0..columns.len()).collect();
        let mut found = Vec::new();
        for group in groups(&all) {
            let of = group.map(|column| columns[column].as_slice());
            found.extend(vectorised!(dots_single(of, [&weights[0][..], &weights[1]])));
        }
        assert_eq!(found.len(), 8, "two of the last group are repeated");
        for (column, found) in columns.iter().zip(found) {
            for (weights, found) in weights.iter().zip(found) {
                let expected: f64 =
                    column.iter().zip(weights).map(|(&a, b)| f64::from(a) * b).sum();
                assert!((found - expected).abs() < 1e-13, "{rows}: {found} {expected}");
            }
        }
    }
}
