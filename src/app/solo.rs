//! Solo: one light alone. All others are off until it ends, and are then restored.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::render::edits::Edits;

/// A light that can be seen alone.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solo {
    /// An added light, by its name.
    Added(String),
    /// A part of the recovered light, by its name.
    Recovered(String),
}

/// The light that is seen alone, and which lights were on before.
#[derive(Clone, Debug, PartialEq)]
pub struct Alone {
    pub solo: Solo,
    before: Before,
}

/// Which lights were on, and how strong the recovered ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Before {
    /// Names of added lights that were off.
    off: BTreeSet<String>,
    original_light: f64,
    groups: BTreeMap<String, f64>,
}

impl Before {
    fn of(edits: &Edits) -> Self {
        let off = edits.lights.iter().filter(|light| !light.is_on);
        Self {
            off: off.map(|light| light.name.clone()).collect(),
            original_light: edits.original_light,
            groups: edits.groups.clone(),
        }
    }
}

impl Alone {
    /// As a project keeps it.
    pub fn value(&self) -> Value {
        json!({ "of": self.solo, "before": self.before })
    }

    pub fn of_value(value: &Value) -> Option<Self> {
        let solo = Solo::deserialize(value.get("of")?).ok()?;
        Some(Self { solo, before: Before::deserialize(value.get("before")?).ok()? })
    }
}

/// The edits with one light alone, given the names of all parts of the recovered light.
pub fn alone(edits: &Edits, solo: &Solo, parts: &[String]) -> Edits {
    let mut next = edits.clone();
    for light in &mut next.lights {
        light.is_on = matches!(solo, Solo::Added(name) if *name == light.name);
    }
    match solo {
        Solo::Added(_) => next.original_light = 0.0,
        Solo::Recovered(own) => {
            // One that was off is wanted now.
            if next.original_light == 0.0 {
                next.original_light = 1.0;
            }
            for part in parts {
                if part != own {
                    next.groups.insert(part.clone(), 0.0);
                } else if next.groups.get(part) == Some(&0.0) {
                    next.groups.remove(part);
                }
            }
        }
    }
    next
}

/// All lights on and off as before; what else was changed meanwhile stays.
fn together(edits: &Edits, before: &Before) -> Edits {
    let mut next = edits.clone();
    for light in &mut next.lights {
        light.is_on = !before.off.contains(&light.name);
    }
    next.original_light = before.original_light;
    next.groups.clone_from(&before.groups);
    next
}

/// What a click on a light's switch makes of the edits.
pub fn toggled(edits: &Edits, now: &mut Option<Alone>, solo: Solo, parts: &[String]) -> Edits {
    match now.take() {
        Some(own) if own.solo == solo => together(edits, &own.before),
        // From one alone to another: all come back as they were before the first.
        Some(Alone { before, .. }) => {
            let next = alone(&together(edits, &before), &solo, parts);
            *now = Some(Alone { solo, before });
            next
        }
        None => {
            let next = alone(edits, &solo, parts);
            *now = Some(Alone { solo, before: Before::of(edits) });
            next
        }
    }
}

/// Whether a light is still alone: undo and other switches end that.
pub fn is_alone(edits: &Edits, now: Option<&Alone>, solo: &Solo, parts: &[String]) -> bool {
    now.is_some_and(|own| own.solo == *solo) && alone(edits, solo, parts) == *edits
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::render::edits::{AddedLight, Shape};
    use crate::scene::Emitter;

    fn edits() -> Edits {
        let light = |name: &str, is_on| AddedLight {
            name: name.into(),
            shape: Shape::Emitter(Emitter::Point { position: Vec3::ZERO }),
            emission: [1.0; 3],
            is_on,
        };
        let lights = vec![light("a", true), light("b", false), light("c", true)];
        Edits { lights, original_light: 0.3, ..Edits::default() }
    }

    #[test]
    fn one_light_is_alone_and_all_come_back_as_they_were() {
        let parts = ["lamp 1".to_owned(), "left".to_owned()];
        let before = Edits { groups: [("left".to_owned(), 0.5)].into(), ..edits() };
        let on = |edits: &Edits| edits.lights.iter().map(|own| own.is_on).collect::<Vec<_>>();
        let mut now = None;
        let b = toggled(&before, &mut now, Solo::Added("b".into()), &parts);
        assert_eq!((on(&b), b.original_light), (vec![false, true, false], 0.0));
        let lamp = toggled(&b, &mut now, Solo::Recovered("lamp 1".into()), &parts);
        assert_eq!((on(&lamp), lamp.original_light), (vec![false; 3], 0.3));
        assert_eq!(lamp.groups, [("left".to_owned(), 0.0)].into());
        assert!(is_alone(&lamp, now.as_ref(), &Solo::Recovered("lamp 1".into()), &parts));
        assert!(!is_alone(&before, now.as_ref(), &Solo::Recovered("lamp 1".into()), &parts));
        // A project that is closed and opened again keeps it.
        now = Alone::of_value(&now.as_ref().unwrap().value());
        // A strength that was changed meanwhile stays.
        let mut changed = lamp;
        changed.lights[0].emission = [2.0; 3];
        let after = toggled(&changed, &mut now, Solo::Recovered("lamp 1".into()), &parts);
        let mut expected = before;
        expected.lights[0].emission = [2.0; 3];
        assert_eq!((after, now), (expected, None));
    }
}
