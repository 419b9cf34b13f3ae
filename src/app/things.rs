//! Objects that have a position in the 3D view and can be moved there: added lights and objects,
//! and known lights.

use std::sync::Arc;

use glam::Vec3;

use super::change::Change;
use super::given::GivenLight;
use super::relight::{self, Added, Motion};
use crate::render::edits::{AddedLight, Edits, Shape};
use crate::scene::{Dome, KnownLight};

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Things {
    pub edits: Arc<Edits>,
    pub given: Arc<GivenLight>,
}

impl Things {
    pub fn exists(&self, item: Added) -> bool {
        match item {
            Added::Known(index) => index < self.given.lights.len(),
            _ => relight::exists(&self.edits, item),
        }
    }

    /// As of [`relight::middle`].
    pub fn middle(&self, item: Added, bounds: (Vec3, Vec3)) -> Option<Vec3> {
        match item {
            Added::Known(index) => relight::middle(&self.lone(index)?, Added::Light(0), bounds),
            _ => relight::middle(&self.edits, item, bounds),
        }
    }

    /// The dome that something is.
    pub fn dome(&self, item: Added) -> Option<&Dome> {
        match item {
            Added::Light(index) => match &self.edits.lights.get(index)?.shape {
                Shape::Dome(dome) => Some(dome),
                Shape::Emitter(_) => None,
            },
            Added::Known(index) => match self.given.lights.get(index)? {
                KnownLight::Dome { dome, .. } => Some(dome),
                _ => None,
            },
            Added::Object(_) => None,
        }
    }

    /// As of [`relight::reach_m`].
    pub fn reach_m(&self, item: Added, normal: Vec3) -> f32 {
        match item {
            Added::Known(index) => self
                .lone(index)
                .map_or(0.0, |edits| relight::reach_m(&edits, Added::Light(0), normal)),
            _ => relight::reach_m(&self.edits, item, normal),
        }
    }

    pub fn moved(&self, item: Added, motion: Motion) -> Self {
        match item {
            Added::Known(index) => self.known_moved(index, motion),
            _ => {
                let edits = Arc::new(relight::moved(&self.edits, item, motion));
                Self { edits, ..self.clone() }
            }
        }
    }

    fn known_moved(&self, index: usize, motion: Motion) -> Self {
        let mut given = (*self.given).clone();
        if let (Some(edits), Some(light)) = (self.lone(index), given.lights.get_mut(index)) {
            let moved = relight::moved(&edits, Added::Light(0), motion).lights.remove(0);
            match (light, moved.shape) {
                (KnownLight::Shape { emitter, .. }, Shape::Emitter(moved)) => *emitter = moved,
                (KnownLight::Dome { dome, .. }, Shape::Dome(turned)) => {
                    let scale = dome.scale * moved.emission[0] as f32;
                    *dome = Dome { scale: scale.clamp(1e-9, 1e9), ..turned };
                }
                _ => {}
            }
        }
        Self { given: Arc::new(given), ..self.clone() }
    }

    /// The change that makes these of others, where one of them has become another.
    pub fn change(&self, name: &'static str, item: Added) -> Change {
        let of = Some(item);
        match item {
            Added::Known(_) => Change::Given { name, of, given: self.given.clone() },
            _ => Change::Relight { name, of, edits: self.edits.clone() },
        }
    }

    /// A known light as the only one of edits: it is moved as those are.
    fn lone(&self, index: usize) -> Option<Edits> {
        let light = self.given.lights.get(index)?;
        let shape = match light {
            KnownLight::Shape { emitter, .. } => Shape::Emitter(*emitter),
            KnownLight::Dome { dome, .. } => Shape::Dome(dome.clone()),
            KnownLight::Visible { .. } => return None,
        };
        let name = light.name().to_owned();
        let light = AddedLight { name, shape, emission: [1.0; 3], is_on: true };
        Some(Edits { lights: vec![light], ..Edits::default() })
    }
}
