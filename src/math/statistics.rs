//! Robust statistics.

/// Median absolute deviation from 0, as the standard deviation of a normal distribution; 0 of no
/// values.
pub fn robust_deviation(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return 0.0;
    }
    1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outliers_do_not_count() {
        assert_eq!(robust_deviation(std::iter::empty()), 0.0);
        let values = [0.1, -0.2, 0.3, -0.4, 1e9];
        assert!((robust_deviation(values.into_iter()) - 1.4826 * 0.3).abs() < 1e-12);
    }
}
