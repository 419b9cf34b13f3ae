//! One light alone: all others are off until it is given up, and then are as they were.

use crate::render::edits::Edits;

/// A light that can be seen alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Solo {
    /// An added light, by its name.
    Added(String),
    /// A part of the recovered light, by its name.
    Recovered(String),
}

/// The light that is seen alone, and the edits before.
pub type Alone = (Solo, Edits);

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
pub fn together(edits: &Edits, before: &Edits) -> Edits {
    let mut next = edits.clone();
    for light in &mut next.lights {
        let was_on = before.lights.iter().find(|own| own.name == light.name);
        light.is_on = was_on.is_none_or(|own| own.is_on);
    }
    next.original_light = before.original_light;
    next.groups.clone_from(&before.groups);
    next
}

/// What a click on a light's switch makes of the edits.
pub fn toggled(edits: &Edits, now: &mut Option<Alone>, solo: Solo, parts: &[String]) -> Edits {
    match now.take() {
        Some((own, before)) if own == solo => together(edits, &before),
        // From one alone to another: all come back as they were before the first.
        Some((_, before)) => {
            let next = alone(&together(edits, &before), &solo, parts);
            *now = Some((solo, before));
            next
        }
        None => {
            let next = alone(edits, &solo, parts);
            *now = Some((solo, edits.clone()));
            next
        }
    }
}

/// Whether a light is still alone: undo and other switches end that.
pub fn is_alone(edits: &Edits, now: Option<&Alone>, solo: &Solo, parts: &[String]) -> bool {
    now.is_some_and(|(own, _)| own == solo) && alone(edits, solo, parts) == *edits
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
        // A strength that was changed meanwhile stays.
        let mut changed = lamp;
        changed.lights[0].emission = [2.0; 3];
        let after = toggled(&changed, &mut now, Solo::Recovered("lamp 1".into()), &parts);
        let mut expected = before;
        expected.lights[0].emission = [2.0; 3];
        assert_eq!((after, now), (expected, None));
    }
}
