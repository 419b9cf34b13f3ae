//! The recovered light in named groups whose strength an artist can change: every lamp and sun by
//! itself, and the background by the direction from which it comes.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::lights::LightKind;
use crate::render::edits::Edits;
use crate::render::scene::Solved;
use crate::scene::Capture;

/// Recovered lights that are turned up and down as one.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    pub name: String,
    /// Indices into `Solved::lights`.
    pub lights: Vec<usize>,
    /// The sum of their emissions; its hue is that of their light.
    pub emission: Rgb,
}

/// The groups of all lights with an emission: lamps, suns and known lights one by one, then the
/// background from each of six directions as seen from the middle of the geometry.
pub fn groups(capture: &Capture, solved: &Solved) -> Vec<Group> {
    let (low, high) = capture.mesh.bounds().unwrap_or_default();
    let middle = 0.5 * (low + high);
    let mut numbers: BTreeMap<&str, usize> = BTreeMap::new();
    let mut groups: Vec<Group> = Vec::new();
    let mut shared: BTreeMap<(u8, usize), Group> = BTreeMap::new();
    for (index, light) in solved.light.lights.lights.iter().enumerate() {
        let mut emission = [0.0; CHANNELS];
        for lobe in solved.light.lobes.of(index) {
            for (sum, value) in emission.iter_mut().zip(solved.light.emission[lobe]) {
                *sum += value;
            }
        }
        if emission.iter().all(|&value| value <= 0.0) {
            continue;
        }
        let mut numbered = |kind: &'static str| {
            let number = numbers.entry(kind).or_default();
            *number += 1;
            format!("{kind} {number}")
        };
        let name = match light.kind {
            LightKind::Lamp => numbered("lamp"),
            LightKind::Sun => numbered("sun"),
            LightKind::Known(known) => capture.lights[known].name().to_owned(),
            LightKind::Sphere | LightKind::Sky | LightKind::Surface => {
                let (order, kind) = match light.kind {
                    LightKind::Sky => (0, "sky"),
                    LightKind::Surface => (2, "unseen surfaces"),
                    _ => (1, "background"),
                };
                let (side, from) = side(light.direction_from(middle));
                let group = shared.entry((order, side)).or_insert_with(|| Group {
                    name: format!("{kind} {from}"),
                    lights: Vec::new(),
                    emission: [0.0; CHANNELS],
                });
                group.lights.push(index);
                for (sum, value) in group.emission.iter_mut().zip(emission) {
                    *sum += value;
                }
                continue;
            }
        };
        groups.push(Group { name, lights: vec![index], emission });
    }
    groups.extend(shared.into_values());
    groups
}

/// The half-axis that a direction is nearest to, with its name.
fn side(direction: Vec3) -> (usize, &'static str) {
    const NAMES: [&str; 6] =
        ["from above", "from below", "from +x", "from −x", "from +y", "from −y"];
    let axis = direction.abs().max_position();
    let index = 2 * ((axis + 1) % CHANNELS) + usize::from(direction[axis] < 0.0);
    (index, NAMES[index])
}

/// The factor on every recovered light that edits give to its group, and the names of groups that
/// they name and that are not there.
pub fn factors<'a>(
    capture: &Capture,
    solved: &Solved,
    edits: &'a Edits,
) -> (Vec<f32>, Vec<&'a str>) {
    let mut factors = vec![1.0; solved.light.lights.lights.len()];
    if edits.groups.is_empty() {
        return (factors, Vec::new());
    }
    let groups = groups(capture, solved);
    let mut unknown = Vec::new();
    for (name, &factor) in &edits.groups {
        let mut named = groups.iter().filter(|group| group.name == *name).peekable();
        if named.peek().is_none() {
            unknown.push(name.as_str());
        }
        for &light in named.flat_map(|group| &group.lights) {
            factors[light] *= factor as f32;
        }
    }
    (factors, unknown)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::lights::VirtualLight;
    use crate::reconstruct::lobes::Lobe;

    fn solved(lights: Vec<VirtualLight>) -> Solved {
        let mut solved = Solved::default();
        for (index, light) in lights.into_iter().enumerate() {
            solved.light.lobes.first.push(index);
            solved.light.lobes.lobes.push(Lobe {
                light: index,
                direction: light.normal,
                exponent: 0.0,
            });
            solved.light.emission.push([1.0, 2.0, 3.0]);
            solved.light.lights.lights.push(light);
        }
        solved.light.lobes.first.push(solved.light.lobes.lobes.len());
        solved
    }

    #[test]
    fn lamps_stand_alone_and_the_background_goes_by_direction() {
        let disc = |x: f32, z: f32| {
            VirtualLight::disc(LightKind::Sphere, Vec3::new(x, 0.0, z), -Vec3::Z, 0.1)
        };
        let mut solved = solved(vec![
            disc(0.2, 2.0),
            VirtualLight::lamp(Vec3::X, 0.1),
            disc(-0.1, 3.0),
            disc(-3.0, 0.5),
            VirtualLight::lamp(Vec3::Y, 0.1),
            VirtualLight::lamp(Vec3::Z, 0.1),
        ]);
        solved.light.emission[5] = [0.0; 3];
        let groups = groups(&Capture::default(), &solved);
        let found: Vec<(&str, &[usize])> =
            groups.iter().map(|group| (group.name.as_str(), group.lights.as_slice())).collect();
        assert_eq!(
            found,
            [
                ("lamp 1", &[1][..]),
                ("lamp 2", &[4]),
                ("background from above", &[0, 2]),
                ("background from −x", &[3]),
            ]
        );
        assert_eq!(groups[2].emission, [2.0, 4.0, 6.0]);

        let edits = Edits {
            groups: [("background from above".to_owned(), 0.5), ("lamp 7".to_owned(), 0.0)].into(),
            ..Edits::default()
        };
        let (factors, unknown) = factors(&Capture::default(), &solved, &edits);
        assert_eq!(factors, [0.5, 1.0, 0.5, 1.0, 1.0, 1.0]);
        assert_eq!(unknown, ["lamp 7"]);
    }
}
