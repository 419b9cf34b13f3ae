//! A robust estimate of the radiance of a surface point from several photographs.

use crate::math::rgb::{CHANNELS, Radiance};

/// Photographs of a point agree if none is brighter than the darkest by more than this factor: far
/// beyond noise, while a highlight below it adds at most a quarter to a mean of two. Set on
/// kitchen-full and kitchen-coarse.
pub const AGREEMENT: f64 = 1.5;

/// Photographs that are asked for the radiance of a point, if they agree and at most.
const ENOUGH_VIEWS: usize = 3;
const MOST_VIEWS: usize = 16;

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

    /// The radiance that they agree on ([`agreed`]); `None` without photographs.
    pub fn agreed(&self) -> Option<Radiance> {
        (self.count > 0).then(|| agreed(self.read()))
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
    let (mut sum, mut count) = ([0.0; CHANNELS], 0.0);
    let is_near = agreeing(seen.iter().map(brightness));
    for (radiance, _) in seen.iter().zip(is_near).filter(|(_, is_near)| *is_near) {
        sum.iter_mut().zip(radiance).for_each(|(sum, value)| *sum += value);
        count += 1.0;
    }
    sum.map(|value| value / f32::max(count, 1.0))
}

/// Which of some brightnesses of one point are not far above the darkest.
pub fn agreeing(seen: impl Iterator<Item = f64> + Clone) -> impl Iterator<Item = bool> {
    let limit = AGREEMENT * seen.clone().fold(f64::INFINITY, f64::min);
    seen.map(move |brightness| brightness <= limit)
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

    /// The glass of a table in kitchen-full, in which some photographs see the window: it was taken
    /// to send that to the ceiling and made a third of its light.
    #[test]
    fn a_mirror_image_in_some_photographs_is_not_sent_all_around() {
        let glass = [[0.02; CHANNELS], [1.9; CHANNELS], [0.024; CHANNELS], [3.4; CHANNELS]];
        assert!((agreed(&glass)[0] - 0.022).abs() < 1e-6);
    }
}
