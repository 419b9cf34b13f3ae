//! Lights of known colour, which have one strength in all channels.

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::Error;

/// Emissions that are held fixed, per channel and column.
pub type Held = [Vec<Option<f64>>; CHANNELS];

/// Of the logarithm of a light's strength.
pub const STRENGTH_TOLERANCE: f64 = 1e-3;
const FIRST_STEP: f64 = 10.0 * STRENGTH_TOLERANCE;
/// The way after which the search for less cost ends: a factor of 10¹³.
const FARTHEST: f64 = 30.0;
/// Steps between two places of different sign, at most.
const MOST_STEPS: usize = 20;

/// Holds a light of known colour at a strength, whose logarithm is given.
pub fn hold(held: &mut Held, column: usize, colour: Rgb, log_strength: Option<f64>) {
    for (held, colour) in held.iter_mut().zip(colour) {
        held[column] = log_strength.map(|log| colour * log.exp());
    }
}

/// The mean of the logarithms of the strengths that a light of known colour has in the channels; `None`
/// if it has none in any.
pub fn mean_log_strength(emissions: impl Iterator<Item = f64>, colour: Rgb) -> Option<f64> {
    let strengths = emissions.zip(colour).map(|(emission, colour)| emission / colour);
    let logs: Vec<f64> = strengths.filter(|s| *s > 0.0 && s.is_finite()).map(f64::ln).collect();
    (!logs.is_empty()).then(|| logs.iter().sum::<f64>() / logs.len() as f64)
}

/// Where the slope of a cost with one minimum is 0, and the fit there, by the Illinois variant of the
/// method of false position (Dowell and Jarratt 1971). The search starts from a place and the fit there.
/// `at` computes the fit at another place, starting from a fit nearby; `slope` is the slope of the cost
/// at a fit. Ends when a step is smaller than the tolerance.
pub fn zero_of_slope<T>(
    (mut a, mut at_a): (f64, T),
    tolerance: f64,
    at: impl Fn(f64, &T) -> Result<T, Error>,
    slope: impl Fn(&T) -> f64,
) -> Result<(f64, T), Error> {
    // Towards less cost until the slope has another sign.
    let first = a;
    let mut slope_a = slope(&at_a);
    let mut step = -FIRST_STEP * slope_a.signum();
    let mut b = a + step;
    let mut at_b = at(b, &at_a)?;
    let mut slope_b = slope(&at_b);
    while slope_a * slope_b > 0.0 && (b - first).abs() < FARTHEST {
        // A little beyond where the line through both is 0.
        let ahead = -slope_b * (b - a) / (slope_b - slope_a) / step;
        let longer = if ahead > 0.0 { (1.5 * ahead).clamp(2.0, 20.0) } else { 20.0 };
        step = (longer * step).clamp(-FARTHEST, FARTHEST);
        (a, slope_a, at_a) = (b, slope_b, at_b);
        b += step;
        at_b = at(b, &at_a)?;
        slope_b = slope(&at_b);
    }
    if slope_a * slope_b > 0.0 {
        return Ok((b, at_b));
    }
    for _ in 0..MOST_STEPS {
        let next = if slope_a == slope_b {
            b
        } else {
            (b - slope_b * (b - a) / (slope_b - slope_a)).clamp(a.min(b), a.max(b))
        };
        if (next - b).abs() < tolerance {
            break;
        }
        let at_next = at(next, &at_b)?;
        let slope_next = slope(&at_next);
        if slope_next * slope_b < 0.0 {
            (a, slope_a) = (b, slope_b);
        } else {
            slope_a *= 0.5;
        }
        (b, slope_b, at_b) = (next, slope_next, at_next);
    }
    Ok((b, at_b))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn the_zero_of_the_slope_is_found_from_either_side_and_from_far_away() {
        // The derivative of cosh(x − 1.3) + x²/8, whose zero was found by bisection.
        let slope = |x: &f64| (x - 1.3).sinh() + 0.25 * x;
        let zero = 1.042_289_69;
        assert!(slope(&(zero - 1e-6)) < 0.0 && slope(&(zero + 1e-6)) > 0.0);
        for start in [-4.0, 0.9, zero, 1.0375, 1.5, 8.0] {
            let calls = Cell::new(0);
            let at = |x: f64, _: &f64| {
                calls.set(calls.get() + 1);
                Ok(x)
            };
            let (place, value) = zero_of_slope((start, start), 1e-3, at, slope).unwrap();
            assert_eq!(place, value);
            assert!((place - zero).abs() < 2e-3, "{place} from {start}");
            assert!(calls.get() <= if (start - zero).abs() < 0.2 { 5 } else { 15 }, "{start}");
        }
    }

    #[test]
    fn a_cost_that_always_falls_ends_the_search() {
        let (place, _) = zero_of_slope((0.0, 0.0), 1e-3, |x, _| Ok(x), |_| -1.0).unwrap();
        assert!((FARTHEST..3.0 * FARTHEST).contains(&place), "{place}");
        assert!(zero_of_slope((0.0, 0.0), 1e-3, |x, _| Ok(x), |_| f64::NAN).is_ok());
    }

    #[test]
    fn the_strength_is_that_of_the_channels_that_have_one() {
        let mean = |emissions: [f64; 3]| mean_log_strength(emissions.into_iter(), [1.0, 2.0, 0.0]);
        assert!((mean([4.0, 2.0, 5.0]).unwrap() - 2.0f64.ln()).abs() < 1e-12);
        assert_eq!(mean([0.0, 0.0, 5.0]), None);
        let mut held: Held = std::array::from_fn(|_| vec![None; 2]);
        hold(&mut held, 1, [1.0, 2.0, 3.0], Some(0.0));
        assert_eq!(held, [[None, Some(1.0)], [None, Some(2.0)], [None, Some(3.0)]].map(Vec::from));
    }
}
