//! Translations between exposures.

use lobelia::exposures::align::shifts;
use lobelia::watch::Watch;

use super::*;

const TIMES: [f64; 5] = [0.05, 0.2, 0.8, 3.2, 12.8];

#[test]
fn hand_held_exposures_are_brought_together() {
    let moved = [[5, -3], [2, 3], [0, 0], [-6, 1], [-4, -5]];
    let exposures = photograph(&TIMES, &moved, 0.6);
    assert_eq!(shifts(&exposures, 2, &Watch::new()).unwrap(), moved);
    // In another order of the files, and against another reference.
    let turned: Vec<Exposure> = exposures.into_iter().rev().collect();
    let expected: Vec<[isize; 2]> =
        moved.iter().rev().map(|[x, y]| [x - moved[4][0], y - moved[4][1]]).collect();
    assert_eq!(shifts(&turned, 0, &Watch::new()).unwrap(), expected);
}

#[test]
fn exposures_from_a_tripod_stay() {
    for noise in [0.0, 4.0] {
        let exposures = photograph(&TIMES, &still(5), noise);
        assert_eq!(shifts(&exposures, 2, &Watch::new()).unwrap(), still(5));
    }
}

#[test]
fn a_uniform_or_tiny_image_stays() {
    let flat = |code, seconds| exposure(Codes::Eight(vec![[code; 3]; WIDTH * HEIGHT]), seconds);
    assert_eq!(shifts(&[flat(40, 1.0), flat(90, 2.0)], 0, &Watch::new()).unwrap(), still(2));
    let tiny = |code, seconds| Exposure {
        width: 2,
        height: 1,
        codes: Codes::Eight(vec![[code, 0, 9]; 2]),
        seconds,
        shift: [0, 0],
    };
    assert_eq!(shifts(&[tiny(40, 1.0), tiny(90, 2.0)], 1, &Watch::new()).unwrap(), still(2));
    assert_eq!(shifts(&[], 0, &Watch::new()).unwrap(), still(0));
}
