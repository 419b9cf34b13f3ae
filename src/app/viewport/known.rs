//! The inputs of what was uploaded to the GPU, by which outdated uploads are recognised.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::Vec3;

use crate::app::derived::Derived;
use crate::app::viewport::content::{Content, SampleColor};
use crate::app::viewport::palette::MaterialColors;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::Solution;
use crate::render::scene::Solved;
use crate::scene::Capture;
use crate::worker::Relit;

/// Colours that depend on the theme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    pub accent: [f32; 4],
    pub wire: [f32; 4],
    pub line: [f32; 4],
    pub background: f32,
}

/// What the last upload of each kind was made from; `None` before the first.
#[derive(Default)]
pub struct UploadCache {
    pub surfaces: Option<Surfaces>,
    pub samples: Option<Samples>,
    pub lights: Option<Lights>,
    /// The selected photograph, the colours of lines, and the number of photographs on hand.
    pub lines: Option<(Option<usize>, Look, usize)>,
    pub relit: Option<Arc<Relit>>,
}

pub struct Surfaces {
    capture: Arc<Capture>,
    result_capture: Option<Arc<Capture>>,
    solved: Option<Arc<Solved>>,
    colors: MaterialColors,
    selected: BTreeSet<usize>,
    hidden: BTreeSet<usize>,
}

impl Surfaces {
    pub fn of(capture: &Arc<Capture>, content: &Content) -> Self {
        Self {
            capture: capture.clone(),
            result_capture: content.result_capture.clone(),
            solved: content.solved.clone(),
            colors: content.colors.clone(),
            selected: content.selected_surfaces.clone(),
            hidden: content.hidden_surfaces.clone(),
        }
    }

    pub fn is_current(&self, capture: &Arc<Capture>, content: &Content) -> bool {
        Arc::ptr_eq(&self.capture, capture)
            && same(self.result_capture.as_ref(), content.result_capture.as_ref())
            && same(self.solved.as_ref(), content.solved.as_ref())
            && self.colors == content.colors
            && self.selected == content.selected_surfaces
            && self.hidden == content.hidden_surfaces
    }
}

pub struct Samples {
    cloud: Arc<SampleCloud>,
    color: SampleColor,
    materials: MaterialColors,
    derived: Option<Arc<Derived>>,
}

impl Samples {
    pub fn of(cloud: &Arc<SampleCloud>, color: SampleColor, content: &Content) -> Self {
        let (materials, derived) = (content.result_colors.clone(), content.derived.clone());
        Self { cloud: cloud.clone(), color, materials, derived }
    }

    /// Only errors depend on what was worked out, and only materials on their colours.
    pub fn is_current(&self, now: &Self) -> bool {
        Arc::ptr_eq(&self.cloud, &now.cloud)
            && self.color == now.color
            && (now.color != SampleColor::Material || self.materials == now.materials)
            && (now.color != SampleColor::Error
                || same(self.derived.as_ref(), now.derived.as_ref()))
    }
}

pub struct Lights {
    lights: Arc<VirtualLights>,
    lobes: Arc<Lobes>,
    solution: Option<Arc<Solution>>,
}

impl Lights {
    pub fn of(
        (lights, lobes): &(Arc<VirtualLights>, Arc<Lobes>),
        solution: Option<&Arc<Solution>>,
    ) -> Self {
        Self { lights: lights.clone(), lobes: lobes.clone(), solution: solution.cloned() }
    }

    pub fn is_current(&self, now: &Self) -> bool {
        Arc::ptr_eq(&self.lights, &now.lights)
            && Arc::ptr_eq(&self.lobes, &now.lobes)
            && same(self.solution.as_ref(), now.solution.as_ref())
    }
}

/// Whether two products are one and the same.
pub fn same<T>(a: Option<&Arc<T>>, b: Option<&Arc<T>>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (None, None) => true,
        _ => false,
    }
}

/// Whether two captures have the same photographs and cameras, whatever is masked.
pub fn has_same_photographs(a: &Capture, b: &Capture) -> bool {
    a.photographs.len() == b.photographs.len()
        && a.photographs.iter().zip(&b.photographs).all(|(a, b)| {
            let is_same_image = match (&a.image, &b.image) {
                // Masks come and go over the same photograph.
                (Some(a), Some(b)) => a.has_pixels_of(b),
                (None, None) => a.display == b.display,
                _ => false,
            };
            a.camera == b.camera && is_same_image
        })
}

/// The corners of the box around the geometry and the cameras.
pub fn bounds(capture: &Capture) -> (Vec3, Vec3) {
    let cameras = capture.photographs.iter().map(|p| p.camera.position.as_vec3());
    let mesh = capture.mesh.bounds();
    let mut points = mesh.into_iter().flat_map(|(low, high)| [low, high]).chain(cameras);
    let Some(first) = points.next() else { return (Vec3::splat(-1.0), Vec3::ONE) };
    points.fold((first, first), |(low, high), p| (low.min(p), high.max(p)))
}
