//! Which material of the results is which of the list: either may have been edited since.

use std::collections::BTreeMap;

use super::Project;
use crate::scene::{Capture, Surface};

impl Project {
    /// The material of the results that one of the list was found as. Names and order may have
    /// been edited since: what counts is where most surfaces of either went.
    pub fn found_as(&self, material: usize) -> Option<usize> {
        let results = self.result_capture();
        let own = &self.edit.materials.get(material)?.surfaces;
        let of = |&surface: &usize| same_surface(surface, &self.capture, results)?.material();
        let result = most(own.iter().filter_map(of))?;
        (self.listed_as(result) == Some(material)).then_some(result)
    }

    /// The material of the list that has most surfaces of one of the results.
    pub fn listed_as(&self, result: usize) -> Option<usize> {
        let listed = self.edit.listed();
        let surfaces = &self.result_capture().materials.get(result)?.surfaces;
        most(surfaces.iter().filter_map(|&surface| {
            let own = same_surface(surface, self.result_capture(), &self.capture)?;
            own.material().map(|index| listed[index])
        }))
    }
}

/// The surface of another state of a capture: charts that come and go renumber those of charts.
fn same_surface<'a>(index: usize, of: &Capture, other: &'a Capture) -> Option<&'a Surface> {
    let name = &of.surfaces.get(index)?.name;
    let at_its_place = other.surfaces.get(index).filter(|own| own.name == *name);
    at_its_place.or_else(|| other.surfaces.iter().find(|own| own.name == *name))
}

/// What comes most often; of several the smallest.
fn most(items: impl Iterator<Item = usize>) -> Option<usize> {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    for item in items {
        *counts.entry(item).or_default() += 1;
    }
    counts.into_iter().rev().max_by_key(|(_, count)| *count).map(|(item, _)| item)
}
