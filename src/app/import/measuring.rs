//! A length that is measured between two places on photographs, and what it is in truth: sources
//! such as COLMAP know no unit.

use glam::{DVec2, DVec3};

use super::ImportPage;
use crate::io::import::{Picked, place_at};

/// How near to a point or a corner a click means it, in points of the window.
pub const REACH: f32 = 8.0;

/// What is measured.
#[derive(Clone, Debug, Default)]
pub struct Measuring {
    pub is_on: bool,
    /// Up to two places, in metres of the import, and what was found there.
    pub ends: Vec<(DVec3, Picked)>,
    /// What the length is in truth, in metres, once it was typed.
    pub true_m: Option<f64>,
    /// The last click met nothing.
    pub has_missed: bool,
    /// The import that comes next is the same, scaled by this.
    rescaled: Option<f64>,
}

impl Measuring {
    /// The length between both ends, in metres of the import.
    pub fn length_m(&self) -> Option<f64> {
        match self.ends[..] {
            [(a, _), (b, _)] => Some(a.distance(b)).filter(|length| *length > 0.0),
            _ => None,
        }
    }

    /// What hinders the scale from being set, in words.
    pub fn obstacle(&self) -> Option<&'static str> {
        match (self.ends.len(), self.length_m(), self.true_m) {
            (0 | 1, ..) => Some("Click two places of known distance on photographs first."),
            (_, None, _) => Some("Both places are the same: click two that are apart."),
            (.., None) => Some("Type the true length first."),
            _ => None,
        }
    }

    /// Another import stands: places of the one before mean nothing, but where it was only scaled.
    pub(super) fn follow(&mut self) {
        match self.rescaled.take() {
            Some(factor) => self.ends.iter_mut().for_each(|(place, _)| *place *= factor),
            None => (self.ends, self.true_m) = (Vec::new(), None),
        }
    }
}

impl ImportPage {
    /// A click on the photograph that is shown, at its pixel; `reach_px` is how near is meant.
    pub fn measure_at(&mut self, pixel: DVec2, reach_px: f64) {
        let Some(survey) = self.survey.clone() else { return };
        let picked = place_at(&survey, self.shot, pixel, reach_px);
        let own = &mut self.measuring;
        own.has_missed = picked.is_none();
        let Some(picked) = picked else { return };
        if own.ends.len() > 1 {
            own.ends.clear();
            own.true_m = None;
        }
        own.ends.push(picked);
    }

    /// Scales the import, so that what was measured is as long as it is in truth.
    pub fn set_scale(&mut self) {
        let own = &mut self.measuring;
        if let (None, Some(length), Some(truth)) = (own.obstacle(), own.length_m(), own.true_m) {
            let factor = truth / length;
            own.rescaled = Some(factor);
            self.options.scale *= factor;
        }
    }
}
