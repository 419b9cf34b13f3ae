//! Light is linear: a picture is the sum of the contributions of the lights, each times the
//! strength and colour of its light. Pictures are therefore kept as one layer for each light,
//! rendered with strength 1. After a change of strengths the layers are only added again.
//!
//! A layer is identified by the shape and position of its light, so that it remains valid after
//! every edit except a move. If there are more lights than layers, the lights that were not changed
//! share one layer, which contains their strengths.

use std::collections::BTreeMap;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::render::edits::{AddedLight, Edits, Shape};
use crate::render::groups::Group;
use crate::render::lights::Use;

/// Lights that are traced together, into one layer or more.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// All recovered light. The first layer is what photographed surfaces send that are no
    /// material, and all groups without a layer of their own.
    Recovered {
        /// Names of the groups of the layers that follow.
        own: Vec<String>,
        /// Factors on the groups in the first layer.
        folded: BTreeMap<String, f64>,
    },
    /// All added lights of one shape, at a strength of 1.
    Added(Shape),
    /// Added lights that share a layer, at their strengths.
    Shared(Vec<(Shape, Rgb)>),
}

/// The least fraction of its share of the samples for a recovered light that is turned down. Its
/// layer may be turned up again, and noisy samples have the same weight in it as good ones.
const LEAST_IMPORTANCE: f32 = 0.2;

/// Memory of a layer per pixel: its sums, its picture, and the noise of a film of its own.
const LAYER_BYTES: usize = 2 * size_of::<Radiance>() + size_of::<f32>();
/// All other memory per pixel: surfaces and guides of all steps, a photograph, and a light that is
/// traced again.
const OTHER_BYTES: usize = 160;
/// The same of the scene without edits, where it is traced by itself.
const BARE_BYTES: usize = 170;

/// The layers that there is memory for, of so many bytes a pixel; `is_compared` where the scene
/// without edits is traced by itself.
pub fn most_layers(bytes: usize, is_compared: bool) -> usize {
    let other = OTHER_BYTES + if is_compared { BARE_BYTES } else { 0 };
    (bytes.saturating_sub(other) / LAYER_BYTES).max(4)
}

/// The sources of a scene in at most `most` layers, which must be 4 or more. `touched` says per
/// added light when it was changed last: the latest are first to get layers of their own.
pub fn sources(edits: &Edits, groups: &[Group], touched: &[u64], most: usize) -> Vec<Source> {
    let mut names: Vec<&Group> = Vec::new();
    for group in groups {
        if !names.iter().any(|other| other.name == group.name) {
            names.push(group);
        }
    }
    // Per shape when one of its lights was touched.
    let mut shapes: Vec<(&Shape, u64)> = Vec::new();
    for (light, &touched) in edits.lights.iter().zip(touched) {
        match shapes.iter_mut().find(|(shape, _)| **shape == light.shape) {
            Some((_, latest)) => *latest = touched.max(*latest),
            None => shapes.push((&light.shape, touched)),
        }
    }
    let half = most / 2;
    let is_tight = 1 + names.len() + shapes.len() > most && shapes.len() > half;
    let mut by_time: Vec<usize> = (0..shapes.len()).collect();
    by_time.sort_by_key(|&index| std::cmp::Reverse(shapes[index].1));
    let mut own: Vec<usize> = by_time[..if is_tight { half - 1 } else { shapes.len() }].to_vec();
    own.sort_unstable();
    let added = own.len() + usize::from(is_tight);

    let factor = |group: &&Group| edits.groups.get(&group.name).copied().unwrap_or(1.0);
    // Those that were changed first, then the strongest.
    let mut by_use: Vec<&Group> = names.clone();
    by_use.sort_by(|a, b| {
        let key = |group: &&Group| (factor(group) != 1.0, group.emission.iter().sum::<f64>());
        let (a, b) = (key(a), key(b));
        b.0.cmp(&a.0).then(b.1.total_cmp(&a.1))
    });
    by_use.truncate(most - 1 - added);
    let is_own = |group: &&&Group| by_use.iter().any(|other| other.name == group.name);
    let folded = names.iter().filter(|group| !is_own(group) && factor(group) != 1.0);
    let mut sources = vec![Source::Recovered {
        own: names.iter().filter(is_own).map(|group| group.name.clone()).collect(),
        folded: folded.map(|group| (group.name.clone(), factor(group))).collect(),
    }];
    sources.extend(own.iter().map(|&index| Source::Added(shapes[index].0.clone())));
    if is_tight {
        let is_shared = |light: &&AddedLight| !own.iter().any(|&k| *shapes[k].0 == light.shape);
        let shared = edits.lights.iter().filter(is_shared);
        sources.push(Source::Shared(
            shared.map(|light| (light.shape.clone(), light.sent())).collect(),
        ));
    }
    sources
}

impl Source {
    pub fn layers(&self) -> usize {
        match self {
            Self::Recovered { own, .. } => 1 + own.len(),
            Self::Added(_) | Self::Shared(_) => 1,
        }
    }

    /// The lights to trace, as they are to be traced; none of the recovered ones.
    pub fn added(&self) -> Vec<AddedLight> {
        let light = |shape: &Shape, emission: Rgb| AddedLight {
            name: String::new(),
            shape: shape.clone(),
            emission,
            is_on: true,
        };
        match self {
            Self::Recovered { .. } => Vec::new(),
            Self::Added(shape) => vec![light(shape, [1.0; CHANNELS])],
            Self::Shared(lights) => lights.iter().map(|(shape, e)| light(shape, *e)).collect(),
        }
    }

    /// The factor on each layer for the light of the edits.
    pub fn weights(&self, edits: &Edits) -> Vec<Radiance> {
        match self {
            Self::Recovered { own, .. } => {
                let factor = |name: &String| edits.groups.get(name).copied().unwrap_or(1.0);
                let factors = std::iter::once(1.0).chain(own.iter().map(factor));
                factors.map(|factor| [(factor * edits.original_light) as f32; CHANNELS]).collect()
            }
            Self::Added(shape) => {
                let mut sum = [0.0; CHANNELS];
                for light in edits.lights.iter().filter(|light| light.shape == *shape) {
                    for (sum, value) in sum.iter_mut().zip(light.sent()) {
                        *sum += value;
                    }
                }
                vec![sum.map(|value| value as f32)]
            }
            Self::Shared(_) => vec![[1.0; CHANNELS]],
        }
    }

    /// The use of each of `count` recovered lights if `weights` multiply the layers: lights with
    /// larger weights are sampled more often.
    pub fn uses(&self, groups: &[Group], weights: &[Radiance], count: usize) -> Vec<Use> {
        let Self::Recovered { own, folded } = self else { return Vec::new() };
        let strength = |layer: usize| weights.get(layer).map_or(0.0, |weight| weight[0]);
        let most = (0..=own.len()).map(strength).fold(0.0, f32::max);
        let importance = |layer: usize| {
            if most > 0.0 { (strength(layer) / most).max(LEAST_IMPORTANCE) } else { 1.0 }
        };
        let mut uses = vec![Use { factor: 1.0, layer: 0, importance: importance(0) }; count];
        for group in groups {
            let layer =
                own.iter().position(|name| *name == group.name).map_or(0, |index| index + 1);
            let factor = folded.get(&group.name).copied().unwrap_or(1.0) as f32;
            for &light in &group.lights {
                uses[light] = Use { factor, layer, importance: factor * importance(layer) };
            }
        }
        uses
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::Emitter;

    fn group(name: &str, power: f64) -> Group {
        Group { name: name.into(), lights: vec![0], emission: [power; CHANNELS] }
    }

    fn lit(count: usize) -> Edits {
        let light = |k: usize| AddedLight {
            name: format!("{k}"),
            shape: Shape::Emitter(Emitter::Point { position: Vec3::X * k as f32 }),
            emission: [1.0 + k as f64; CHANNELS],
            is_on: true,
        };
        Edits { lights: (0..count).map(light).collect(), ..Edits::default() }
    }

    fn layers(sources: &[Source]) -> usize {
        sources.iter().map(Source::layers).sum()
    }

    #[test]
    fn everything_has_its_own_layer_where_there_is_room() {
        let groups = [group("a", 1.0), group("b", 2.0), group("a", 1.0)];
        let edits = lit(3);
        let all = sources(&edits, &groups, &[0; 3], 6);
        assert_eq!(layers(&all), 6);
        assert_eq!(all[2].weights(&edits), [[2.0; CHANNELS]]);
        // Twins share a layer, and add up.
        let mut twins = lit(3);
        twins.lights.push(twins.lights[1].clone());
        let all = sources(&twins, &groups, &[0; 4], 6);
        assert_eq!(layers(&all), 6);
        assert_eq!(all[2].weights(&twins), [[4.0; CHANNELS]]);
    }

    #[test]
    fn what_was_not_touched_shares_where_there_is_none() {
        let groups = [group("weak", 1.0), group("strong", 3.0), group("changed", 0.1)];
        let mut edits = lit(9);
        edits.groups = [("changed".to_owned(), 0.5), ("weak".to_owned(), 1.0)].into();
        let touched = [0, 0, 7, 0, 0, 0, 0, 8, 0];
        let all = sources(&edits, &groups, &touched, 6);
        assert_eq!(layers(&all), 6);
        let own = vec!["strong".to_owned(), "changed".to_owned()];
        assert_eq!(all[0], Source::Recovered { own, folded: BTreeMap::new() });
        assert_eq!(all[1], Source::Added(edits.lights[2].shape.clone()));
        assert_eq!(all[2], Source::Added(edits.lights[7].shape.clone()));
        let Source::Shared(rest) = &all[3] else { panic!("{:?}", all[3]) };
        assert_eq!(rest.len(), 7);
        // Even changed groups share in the end: then their factors are in the layer.
        edits.groups = [("changed".to_owned(), 0.5), ("weak".to_owned(), 2.0)].into();
        let all = sources(&edits, &groups, &touched, 4);
        assert_eq!(layers(&all), 4);
        let Source::Recovered { own, folded } = &all[0] else { panic!("{:?}", all[0]) };
        assert_eq!((own.len(), folded.len()), (1, 1));
    }

    #[test]
    fn lights_that_count_for_more_are_sampled_more_often() {
        let mut first = group("first", 1.0);
        first.lights = vec![1];
        let mut second = group("second", 1.0);
        second.lights = vec![2];
        let source = Source::Recovered { own: vec!["first".into()], folded: BTreeMap::new() };
        let weights = [[1.0; CHANNELS], [10.0; CHANNELS]];
        let uses = source.uses(&[first, second], &weights, 3);
        assert_eq!(uses.iter().map(|light| light.layer).collect::<Vec<_>>(), [0, 1, 0]);
        assert_eq!(uses.iter().map(|light| light.importance).collect::<Vec<_>>(), [0.2, 1.0, 0.2]);
    }
}
