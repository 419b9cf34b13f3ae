//! The patches of charts and their reflectances.

use glam::DVec2;

use crate::math::rgb::Rgb;

/// The patches of a chart, row by row from its first corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub rows: usize,
    pub columns: usize,
    /// The gap between patches, as a part of a patch's side.
    pub gap: f64,
    /// `rows × columns` of them.
    pub patches: Vec<Patch>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    pub name: String,
    /// Linear Rec. 709 under D65, a perfect white being 1; a channel may be below 0.
    pub reflectance: Rgb,
    /// Standard deviation of the reflectance.
    pub sd: Rgb,
}

/// A patch in a photograph.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PatchReading {
    /// Mean radiance.
    pub mean: Rgb,
    /// RMS deviation, as a part of the mean, from light that changes evenly over the patch.
    pub spread: f64,
    /// The part of its pixels that is no measurement: clipped or masked.
    pub missing: f64,
    /// Pixels that were looked at.
    pub pixels: usize,
}

/// How far charts of one make are taken to be off their published mean: a part of the reflectance,
/// and what is added to it.
const SD: (f64, f64) = (0.03, 0.002);
/// How far the channels of a neutral patch may be off their mean, as a part of it.
const NEUTRAL: f64 = 0.05;
/// Darker patches are not pinned: stray light of the lens is a large part of what is read there.
const DARKEST_PINNED: f64 = 0.05;

impl Table {
    /// A card of one reflectance.
    pub fn card(reflectance: Rgb, sd: Rgb) -> Self {
        let patches = vec![Patch { name: String::new(), reflectance, sd }];
        Self { rows: 1, columns: 1, gap: 0.0, patches }
    }

    /// The ColorChecker Classic: the mean spectra of 30 charts that D. Pascale measured ("RGB
    /// coordinates of the Macbeth ColorChecker", BabelColor, 2006), as they are under D65. The first
    /// corner is that of *dark skin*, the second that of *bluish green*.
    pub fn color_checker() -> Self {
        let patch = |(name, reflectance): &(&str, Rgb)| Patch {
            name: (*name).to_owned(),
            reflectance: *reflectance,
            sd: Self::usual_sd(*reflectance),
        };
        Self { rows: 4, columns: 6, gap: 0.15, patches: CLASSIC.iter().map(patch).collect() }
    }

    /// The deviation of a patch whose table says none.
    pub fn usual_sd(reflectance: Rgb) -> Rgb {
        reflectance.map(|value| SD.0 * value.max(0.0) + SD.1)
    }

    pub fn is_card(&self) -> bool {
        self.patches.len() == 1
    }

    /// Where a patch lies in the unit square of the chart, low and high corner. The square's corners
    /// are the outer ones of the patches in the corners.
    pub fn place(&self, patch: usize) -> [DVec2; 2] {
        let count = DVec2::new(self.columns as f64, self.rows as f64);
        let whole = count + self.gap * (count - 1.0);
        let at = DVec2::new((patch % self.columns) as f64, (patch / self.columns) as f64);
        let low = at * (1.0 + self.gap) / whole;
        [low, low + 1.0 / whole]
    }

    /// The middle of a patch, −1 to 1 over the chart.
    pub fn centred(&self, patch: usize) -> DVec2 {
        let [low, high] = self.place(patch);
        low + high - 1.0
    }

    /// The patches that a pin rests on: those whose reading depends least on the camera's own
    /// primaries, and on stray light.
    pub fn pinned(&self) -> Vec<usize> {
        let is_pinned = |patch: &Patch| {
            let mean = patch.reflectance.iter().sum::<f64>() / 3.0;
            let is_even = patch.reflectance.iter().all(|own| (own - mean).abs() <= NEUTRAL * mean);
            self.is_card() || mean >= DARKEST_PINNED && is_even
        };
        (0..self.patches.len()).filter(|&k| is_pinned(&self.patches[k])).collect()
    }
}

/// Linear Rec. 709 under D65 (`tests/golden/color/charts.py`).
const CLASSIC: [(&str, Rgb); 24] = [
    ("dark skin", [0.1725, 0.0837, 0.0576]),
    ("light skin", [0.5481, 0.2985, 0.2170]),
    ("blue sky", [0.1103, 0.1968, 0.3359]),
    ("foliage", [0.1038, 0.1502, 0.0521]),
    ("blue flower", [0.2244, 0.2177, 0.4303]),
    ("bluish green", [0.1232, 0.5190, 0.4045]),
    ("orange", [0.7168, 0.1990, 0.0271]),
    ("purplish blue", [0.0650, 0.1062, 0.3925]),
    ("moderate red", [0.5417, 0.0883, 0.1203]),
    ("purple", [0.1042, 0.0438, 0.1396]),
    ("yellow green", [0.3547, 0.5078, 0.0482]),
    ("orange yellow", [0.7804, 0.3540, 0.0215]),
    ("blue", [0.0234, 0.0492, 0.2916]),
    ("green", [0.0653, 0.3019, 0.0645]),
    ("red", [0.4294, 0.0319, 0.0402]),
    ("yellow", [0.8568, 0.5753, 0.0078]),
    ("magenta", [0.5032, 0.0889, 0.3056]),
    ("cyan", [-0.0286, 0.2490, 0.3831]),
    ("white 9.5", [0.9163, 0.9154, 0.8706]),
    ("neutral 8", [0.5819, 0.5911, 0.5840]),
    ("neutral 6.5", [0.3552, 0.3609, 0.3590]),
    ("neutral 5", [0.1876, 0.1923, 0.1918]),
    ("neutral 3.5", [0.0871, 0.0901, 0.0908]),
    ("black 2", [0.0321, 0.0319, 0.0326]),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Against colour-science, see `tests/golden/color/charts.py`.
    #[test]
    fn the_color_checker_is_that_of_its_spectra() {
        let golden = include_str!("../../../tests/golden/color/charts.json");
        let golden: serde_json::Value = serde_json::from_str(golden).unwrap();
        let table = Table::color_checker();
        let patches = golden["patches"].as_array().unwrap();
        for (patch, golden) in std::iter::zip(&table.patches, patches) {
            assert!(golden["name"].as_str().unwrap().starts_with(&patch.name), "{golden}");
            for (channel, value) in patch.reflectance.iter().enumerate() {
                let expected = golden["rec709"][channel].as_f64().unwrap();
                assert!((value - expected).abs() < 1e-4, "{}: {value}, {expected}", patch.name);
            }
        }
        let names: Vec<&str> =
            table.pinned().iter().map(|&k| table.patches[k].name.as_str()).collect();
        assert_eq!(names, ["white 9.5", "neutral 8", "neutral 6.5", "neutral 5", "neutral 3.5"]);
    }

    #[test]
    fn patches_fill_the_square_but_for_their_gaps() {
        let table = Table::color_checker();
        assert_eq!(table.place(0)[0], DVec2::ZERO);
        assert!(table.place(23)[1].distance(DVec2::ONE) < 1e-12);
        // 6 patches of 1 and 5 gaps of 0.15.
        assert!((table.place(7)[0].x - 1.15 / 6.75).abs() < 1e-12);
        assert!((table.place(7)[1].x - 2.15 / 6.75).abs() < 1e-12);
        assert_eq!(Table::card([0.5; 3], [0.0; 3]).place(0), [DVec2::ZERO, DVec2::ONE]);
    }
}
