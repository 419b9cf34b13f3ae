//! The lights that are given rather than found: known and visible lights, and whether the capture
//! is in a room or in the open. They are kept as whole states, so that each change can be undone.

use std::collections::BTreeSet;

use serde_json::Value;

use super::relight::{self, NewLight};
use crate::io::edits::Unread;
use crate::io::{project, tags};
use crate::render::edits::{AddedLight, Shape};
use crate::scene::{Capture, Environment, KnownLight};

/// The known light of a project.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenLight {
    pub lights: Vec<KnownLight>,
    /// Lights of the project that could not be read; they are written back.
    pub unread: Vec<Unread>,
    pub environment: Environment,
}

impl GivenLight {
    /// That of a capture as it was loaded.
    pub fn of(capture: &Capture) -> Self {
        Self {
            lights: capture.lights.clone(),
            unread: Vec::new(),
            environment: capture.environment,
        }
    }

    /// The capture with this light.
    pub fn lit(&self, loaded: &Capture) -> Capture {
        project::lit(loaded, &self.lights, self.environment)
    }

    /// The lights as a project file has them.
    pub fn values(&self, loaded: &Capture) -> Vec<Value> {
        tags::light_values(&self.lights, &self.unread, loaded)
    }

    /// The surfaces of visible lights.
    pub fn luminaires(&self) -> BTreeSet<usize> {
        let surfaces = self.lights.iter().flat_map(surfaces_of);
        surfaces.copied().collect()
    }

    /// The visible light that a surface belongs to.
    pub fn visible_with(&self, surface: usize) -> Option<&KnownLight> {
        self.lights.iter().find(|light| surfaces_of(light).contains(&surface))
    }

    /// Adds a light whose strength is to be found, over the middle of the geometry.
    pub fn with_shape(&self, kind: NewLight, capture: &Capture) -> Self {
        let AddedLight { shape: Shape::Emitter(emitter), .. } = kind.light(capture, 1.0) else {
            return self.clone();
        };
        let name = self.free_name(&format!("{} light 1", kind.name()).to_lowercase());
        self.with(KnownLight::Shape { name, emitter, emission: None, color: None })
    }

    /// Makes a light of surfaces that photographs show shining. They are no others' any more.
    pub fn with_visible(&self, surfaces: &BTreeSet<usize>) -> Self {
        let mut own = self.clone();
        for light in &mut own.lights {
            if let KnownLight::Visible { surfaces: others, .. } = light {
                others.retain(|surface| !surfaces.contains(surface));
            }
        }
        own.lights.retain(
            |light| !matches!(light, KnownLight::Visible { surfaces, .. } if surfaces.is_empty()),
        );
        let name = own.free_name("visible light 1");
        own.with(KnownLight::Visible { name, surfaces: surfaces.iter().copied().collect() })
    }

    pub fn with(&self, mut light: KnownLight) -> Self {
        let mut own = self.clone();
        let name = own.free_name(light.name());
        *name_of(&mut light) = name;
        own.lights.push(light);
        own
    }

    pub fn without(&self, index: usize) -> Self {
        let mut own = self.clone();
        if index < own.lights.len() {
            own.lights.remove(index);
        }
        own
    }

    /// With a twin of a light behind the others. Surfaces can be of one light only.
    pub fn twin(&self, index: usize) -> Option<Self> {
        let light = self.lights.get(index)?;
        (!matches!(light, KnownLight::Visible { .. })).then(|| self.with(light.clone()))
    }

    fn free_name(&self, base: &str) -> String {
        relight::free_name(base, self.lights.iter().map(KnownLight::name))
    }
}

/// The surfaces of a visible light.
pub fn surfaces_of(light: &KnownLight) -> &[usize] {
    match light {
        KnownLight::Visible { surfaces, .. } => surfaces,
        KnownLight::Shape { .. } | KnownLight::Dome { .. } => &[],
    }
}

pub fn name_of(light: &mut KnownLight) -> &mut String {
    match light {
        KnownLight::Visible { name, .. }
        | KnownLight::Shape { name, .. }
        | KnownLight::Dome { name, .. } => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_surfaces_belong_to_one_light() {
        let capture = Capture::default();
        let given = GivenLight::default()
            .with_shape(NewLight::Point, &capture)
            .with_shape(NewLight::Point, &capture)
            .with_visible(&[1, 2].into())
            .with_visible(&[2, 3].into());
        let names: Vec<&str> = given.lights.iter().map(KnownLight::name).collect();
        let expected = ["point light 1", "point light 2", "visible light 1", "visible light 2"];
        assert_eq!(names, expected);
        assert_eq!(surfaces_of(&given.lights[2]), [1]);
        assert_eq!(given.visible_with(2).unwrap().name(), "visible light 2");
        let given = given.with_visible(&[1].into());
        assert_eq!(given.lights.len(), 4, "a visible light without surfaces is none");
        assert_eq!(given.luminaires(), [1, 2, 3].into());
        assert_eq!(given.twin(0).unwrap().lights[4].name(), "point light 3");
        assert_eq!(given.twin(3), None);
        assert_eq!(given.without(9), given);
    }
}
