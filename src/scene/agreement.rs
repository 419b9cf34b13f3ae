//! A robust estimate of the radiance of a surface point from several photographs.

use crate::math::rgb::{CHANNELS, Radiance};

/// Photographs of a point agree if none is brighter than the darkest by more than this factor: far
/// beyond noise, while a highlight below it adds at most a quarter to a mean of two. Set on
/// kitchen-full and kitchen-coarse.
pub const AGREEMENT: f64 = 1.5;

/// Photographs that are asked for the radiance of a point, if they agree and at most.
const ENOUGH_VIEWS: usize = 3;
const MOST_VIEWS: usize = 16;
/// Photographs that can be compared with each other, so that they need no others.
const FEWEST_ALONE: usize = 2;

/// What some photographs measure of one point.
#[derive(Debug, Default)]
pub struct Readings {
    values: [Radiance; MOST_VIEWS],
    count: usize,
}

impl Readings {
    /// Adds the radiance in one more photograph, unless there are enough.
    pub fn add(&mut self, radiance: Radiance) {
        if !self.is_enough() {
            self.values[self.count] = radiance;
            self.count += 1;
        }
    }

    /// Whether no other photograph needs to be asked.
    pub fn is_enough(&self) -> bool {
        let agree = || agreeing(self.read().iter().map(brightness)).all(|is_near| is_near);
        self.count == MOST_VIEWS || self.count == ENOUGH_VIEWS && agree()
    }

    /// The radiance that these agree on ([`agreed`]), if there are two or more; else the one that these
    /// and `others` agree on. `None` without any. A single photograph may show a highlight or a thing in
    /// front of the surface, which only another photograph tells.
    pub fn agreed_or_with(&self, others: &Self) -> Option<Radiance> {
        let others = if self.count < FEWEST_ALONE { others.read() } else { &[] };
        let seen = || self.read().iter().chain(others);
        mean_near(seen(), darkest(seen().map(brightness)))
    }

    fn read(&self) -> &[Radiance] {
        &self.values[..self.count]
    }
}

/// The diffuse radiance of a surface point from photographs in several directions: the mean of
/// those that are not far brighter than the darkest. A highlight, a mirror image or a thing in
/// front of the surface makes the point brighter in some photographs, by any factor, although this
/// light goes in few directions only. Zero without photographs.
pub fn agreed(seen: &[Radiance]) -> Radiance {
    mean_near(seen.iter(), darkest(seen.iter().map(brightness))).unwrap_or_default()
}

/// Which of some brightnesses of one point are not far above the darkest.
pub fn agreeing(seen: impl Iterator<Item = f64> + Clone) -> impl Iterator<Item = bool> {
    let darkest = darkest(seen.clone());
    seen.map(move |brightness| is_near(brightness, darkest))
}

fn darkest(brightnesses: impl Iterator<Item = f64>) -> f64 {
    brightnesses.fold(f64::INFINITY, f64::min)
}

fn is_near(brightness: f64, darkest: f64) -> bool {
    brightness <= AGREEMENT * darkest
}

/// The mean of those that are not far brighter than the darkest, if there are any.
fn mean_near<'a>(seen: impl Iterator<Item = &'a Radiance>, darkest: f64) -> Option<Radiance> {
    let (mut sum, mut count) = ([0.0; CHANNELS], 0.0);
    for radiance in seen.filter(|radiance| is_near(brightness(radiance), darkest)) {
        sum.iter_mut().zip(radiance).for_each(|(sum, value)| *sum += value);
        count += 1.0;
    }
    (count > 0.0).then(|| sum.map(|value| value / count))
}

/// By which photographs are compared: the sum of the channels.
pub fn brightness(radiance: &Radiance) -> f64 {
    radiance.iter().map(|&value| f64::from(value)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photographs_that_agree_are_averaged() {
        let seen = [[1.0, 2.0, 3.0], [1.2, 2.4, 3.6], [0.8, 1.6, 2.4]];
        let mean = agreed(&seen);
        for (value, expected) in mean.into_iter().zip([1.0, 2.0, 3.0]) {
            assert!((value - expected).abs() < 1e-6, "{mean:?}");
        }
        assert_eq!(agreed(&[]), [0.0; CHANNELS]);
        assert_eq!(agreed(&[[0.0; CHANNELS], [5.0; CHANNELS]]), [0.0; CHANNELS]);
    }

    /// As pixels off the edges and pixels beside them: the only one off the edges shows a highlight.
    #[test]
    fn a_single_photograph_is_compared_with_others() {
        let readings = |values: &[f32]| {
            let mut readings = Readings::default();
            values.iter().for_each(|&value| readings.add([value; CHANNELS]));
            readings
        };
        let agreed = |own: &[f32], others: &[f32]| {
            readings(own).agreed_or_with(&readings(others)).map(|radiance| radiance[0])
        };
        assert_eq!(agreed(&[3.0], &[0.5, 0.5]), Some(0.5));
        assert_eq!(agreed(&[0.75], &[0.5, 0.625]), Some(0.625));
        assert_eq!(agreed(&[0.75, 0.75], &[0.25, 0.5]), Some(0.75));
        assert_eq!(agreed(&[3.0, 0.625], &[0.5, 0.5]), Some(0.625));
        assert_eq!(agreed(&[3.0], &[]), Some(3.0));
        assert_eq!(agreed(&[], &[0.25, 0.25]), Some(0.25));
        assert_eq!(agreed(&[], &[]), None);
    }

    /// The glass of a table in kitchen-full, in which some photographs see the window: it was taken
    /// to send that to the ceiling and made a third of its light.
    #[test]
    fn a_mirror_image_in_some_photographs_is_not_sent_all_around() {
        let glass = [[0.02; CHANNELS], [1.9; CHANNELS], [0.024; CHANNELS], [3.4; CHANNELS]];
        assert!((agreed(&glass)[0] - 0.022).abs() < 1e-6);
    }
}
