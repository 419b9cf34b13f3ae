//! What is selected, everywhere in the window.

use std::collections::BTreeSet;

use super::relight::Added;
use crate::scene::Capture;
use crate::scene::charts::surfaces;

/// One of each kind, and surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    pub surfaces: BTreeSet<usize>,
    /// The surface from which shift extends.
    pub anchor: Option<usize>,
    pub hidden: BTreeSet<usize>,
    /// Index into the edited list.
    pub material: Option<usize>,
    pub sample: Option<usize>,
    pub light: Option<usize>,
    pub photograph: Option<usize>,
    /// An added light or object.
    pub added: Option<Added>,
    /// Whose corners are shown and can be placed.
    pub chart: Option<usize>,
    /// What was selected last: this is what the inspector shows.
    pub focus: Focus,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Focus {
    #[default]
    Nothing,
    Surfaces,
    Material,
    Sample,
    Light,
    Photograph,
    Added,
}

impl Selection {
    /// Surfaces of other charts have other numbers.
    pub(super) fn forget_surfaces_of_charts(&mut self, loaded: &Capture) {
        let first = loaded.surfaces.len() - surfaces(&loaded.charts).len();
        for surfaces in [&mut self.surfaces, &mut self.hidden] {
            surfaces.retain(|&surface| surface < first);
        }
        self.anchor = self.anchor.filter(|&surface| surface < first);
        if self.surfaces.is_empty() && self.focus == Focus::Surfaces {
            self.focus = Focus::Nothing;
        }
        self.chart = self.chart.filter(|&chart| chart < loaded.charts.len());
    }

    /// Samples and lights of other results have other numbers.
    pub fn forget_products(&mut self) {
        self.sample = None;
        self.light = None;
        if matches!(self.focus, Focus::Sample | Focus::Light) {
            self.focus = Focus::Nothing;
        }
    }
}
