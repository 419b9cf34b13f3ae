//! About how long a reconstruction takes, relative to others: for the time that a study has left.

use crate::reconstruct::{Method, Options};

/// The expected seconds of a reconstruction, up to a factor that depends on the capture and the
/// machine. Fitted by eye to runs of `lobelia study speed` on the example; within a factor of two
/// of most of them.
pub fn cost(options: &Options) -> f64 {
    let thousands = options.samples.count as f64 / 1000.0;
    let rays = options.transport.rays as f64 / 400.0;
    let solve = match options.general.method {
        Method::Paper => 0.4 * (options.lights.count as f64 / 140.0),
        Method::Joint => {
            0.8 * options.joint.max_lamps as f64 + 1.3 * options.joint.light_sets as f64
        }
    };
    1.0 + thousands * (rays + solve)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::Quality;

    #[test]
    fn more_care_costs_more() {
        let [draft, standard, fine] =
            Quality::ALL.map(|quality| cost(&Options::of_quality(quality)));
        assert!(draft < standard && standard < fine);
        let mut paper = Options::default();
        paper.general.method = Method::Paper;
        assert!(cost(&paper) < standard);
    }
}
