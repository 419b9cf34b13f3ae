//! The rows of a problem: its measured radiance.

use std::ops::Range;

/// The rows of all channels: a diffuse sample has one, a specular sample one per photograph.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Per row its sample.
    pub sample: Vec<usize>,
    /// Per row its material.
    pub material: Vec<usize>,
    /// Whether the row's material is fitted with a specular lobe, as its position among such
    /// rows.
    pub glossy: Vec<Option<usize>>,
    /// log πL per channel.
    pub log_radiance: [Vec<f64>; 3],
    /// Number of materials, with rows or without.
    pub materials: usize,
}

/// Rows of one material that follow each other; all of them are glossy or none is.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    pub material: usize,
    pub rows: Range<usize>,
    /// Their positions among the glossy rows.
    pub glossy: Option<Range<usize>>,
}

impl Rows {
    /// All rows, in as few runs as there are: one for each material where the rows are ordered by material.
    pub fn runs(&self) -> impl Iterator<Item = Run> + '_ {
        let mut next = 0;
        std::iter::from_fn(move || {
            let first = next;
            let (material, glossy) = (*self.material.get(first)?, self.glossy[first]);
            let is_alike = |&row: &usize| {
                let expected = glossy.map(|glossy| glossy + row - first);
                self.material[row] == material && self.glossy[row] == expected
            };
            let count = (first..self.material.len()).take_while(is_alike).count();
            next += count;
            let glossy = glossy.map(|glossy| glossy..glossy + count);
            Some(Run { material, rows: first..next, glossy })
        })
    }
}

/// Values that stand one after the other in two arrays.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    pub places: Range<usize>,
    pub from: Range<usize>,
}

/// Pairs of a place in one array and one in another, in as few stretches as there are.
pub fn stretches(pairs: impl Iterator<Item = (usize, usize)>) -> Vec<Stretch> {
    let mut found: Vec<Stretch> = Vec::new();
    for (place, from) in pairs {
        match found.last_mut().filter(|last| last.places.end == place && last.from.end == from) {
            Some(last) => (last.places.end, last.from.end) = (place + 1, from + 1),
            None => found.push(Stretch { places: place..place + 1, from: from..from + 1 }),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_have_one_material_and_are_glossy_or_not() {
        let rows = Rows {
            material: vec![0, 0, 2, 2, 2, 1],
            glossy: vec![None, None, Some(0), Some(1), None, Some(2)],
            ..Rows::default()
        };
        let run = |material, rows, glossy| Run { material, rows, glossy };
        let expected = [
            run(0, 0..2, None),
            run(2, 2..4, Some(0..2)),
            run(2, 4..5, None),
            run(1, 5..6, Some(2..3)),
        ];
        assert_eq!(rows.runs().collect::<Vec<_>>(), expected);
        assert_eq!(Rows::default().runs().count(), 0);
    }
    #[test]
    fn stretches_end_where_either_place_jumps() {
        let pairs = [(0, 4), (1, 5), (2, 7), (4, 8), (5, 9)];
        let stretch = |places, from| Stretch { places, from };
        let expected = [stretch(0..2, 4..6), stretch(2..3, 7..8), stretch(4..6, 8..10)];
        assert_eq!(stretches(pairs.into_iter()), expected);
    }
}
