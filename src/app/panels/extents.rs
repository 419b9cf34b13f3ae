//! How large the geometry and its surfaces are, worked out away from the window's thread.

use std::collections::BTreeSet;
use std::sync::{Arc, Weak};

use eframe::egui;
use glam::Vec3;

use crate::app::pending::Pending;
use crate::geometry::mesh::Mesh;
use crate::scene::Capture;

/// Of one capture.
#[derive(Default)]
pub struct Extents {
    /// Of the whole, along each axis; `None` without geometry.
    pub size: Option<Vec3>,
    /// Of each surface the number of triangles and the area in m².
    surfaces: Vec<(usize, f64)>,
}

impl Extents {
    fn of(mesh: &Mesh) -> Self {
        let mut surfaces = Vec::new();
        for (index, surface) in mesh.surface.iter().enumerate() {
            let surface = *surface as usize;
            surfaces.resize(surfaces.len().max(surface + 1), (0, 0.0));
            surfaces[surface].0 += 1;
            surfaces[surface].1 += f64::from(mesh.area(index));
        }
        Self { size: mesh.bounds().map(|(low, high)| high - low), surfaces }
    }

    /// Triangles and area in m² of several surfaces.
    pub fn sum(&self, selected: &BTreeSet<usize>) -> (usize, f64) {
        let own = selected.iter().filter_map(|surface| self.surfaces.get(*surface));
        own.fold((0, 0.0), |sum, own| (sum.0 + own.0, sum.1 + own.1))
    }
}

/// Those of the capture that is open.
#[derive(Default)]
pub struct ExtentCache {
    of: Weak<Capture>,
    pending: Option<Pending<Extents>>,
    extents: Option<Extents>,
}

impl ExtentCache {
    /// `None` until they are known.
    pub fn of(&mut self, ctx: &egui::Context, capture: &Arc<Capture>) -> Option<&Extents> {
        if !std::ptr::eq(self.of.as_ptr(), Arc::as_ptr(capture)) {
            self.of = Arc::downgrade(capture);
            self.extents = None;
            let capture = capture.clone();
            let work = move || Extents::of(&capture.mesh);
            self.pending = Some(Pending::start("extents", ctx, work));
        }
        if let Some(extents) = Pending::take(&mut self.pending) {
            self.extents = Some(extents);
        }
        self.extents.as_ref()
    }
}

#[cfg(test)]
mod tests;
