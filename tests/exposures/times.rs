//! Stated times that the pixels contradict.

use lobelia::exposures::MergeOptions;
use lobelia::exposures::times::recover_checked;

use super::*;

/// Thirteen exposures, stated 1/256 to 16 s; from 0.5 s to 8 s the camera's automatics kept the
/// picture as it was, as in a published series.
#[test]
fn exposures_that_did_not_brighten_are_found_and_left_out() {
    let stated: Vec<f64> = (0..13).map(|k| f64::from(k - 8).exp2()).collect();
    let real: Vec<f64> = (0..13)
        .map(|k| {
            let steps = f64::from(k - 8);
            // Up to 0.5 s (the eighth) as stated, then a tenth of a stop a step to the twelfth.
            let steps = match k {
                0..=7 => steps,
                8..=11 => -1.0 + 0.1 * f64::from(k - 7),
                _ => 0.5,
            };
            steps.exp2()
        })
        .collect();
    let mut exposures = photograph(&real, &still(13), 0.6);
    for (exposure, stated) in exposures.iter_mut().zip(&stated) {
        exposure.seconds = *stated;
    }
    let checked = recover_checked(&read(&exposures), MergeOptions::default().smoothness).unwrap();
    let expected: Vec<bool> = (0..13).map(|k| k < 8).collect();
    assert_eq!(checked.trusted[0], expected, "{:#?}", checked.links);
    for (place, link) in checked.links[0].iter().enumerate() {
        assert_eq!(link.is_contradicted(), (7..=10).contains(&place), "{link:?}");
        let really = (real[place + 1] / real[place]).log2();
        if let Some(measured) = link.measured_stops {
            assert!((measured - really).abs() < 0.1, "{place}: {measured} for {really}");
        }
    }
    // The response is that of the consistent ones.
    let truth = (exposure_of_film(200.0) / exposure_of_film(50.0)).ln();
    let rise = checked.response.ln_exposure(1, 200.0) - checked.response.ln_exposure(1, 50.0);
    assert!((rise - truth).abs() < 0.05, "{rise} {truth}");
}

#[test]
fn rounded_times_are_no_contradiction() {
    // 1/60 is 1/64, 1/15 is 1/16, and so on.
    let real = [1.0 / 64.0, 1.0 / 16.0, 0.25, 1.0, 4.0, 16.0];
    let stated = [1.0 / 60.0, 1.0 / 15.0, 0.25, 1.0, 4.0, 15.0];
    let mut exposures = photograph(&real, &still(6), 0.6);
    for (exposure, stated) in exposures.iter_mut().zip(stated) {
        exposure.seconds = stated;
    }
    let checked = recover_checked(&read(&exposures), MergeOptions::default().smoothness).unwrap();
    assert!(checked.trusted[0].iter().all(|trusted| *trusted), "{:#?}", checked.links);
}
