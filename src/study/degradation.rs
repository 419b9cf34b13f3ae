//! Degradations of a capture, its tags or the settings: their names, units and levels.

/// One thing about a capture, its tags or the settings that is made worse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Degradation {
    /// Noise whose variance is proportional to radiance.
    Noise,
    /// The brightest pixels are no measurements.
    Saturation,
    /// Cameras are turned and moved.
    Misregistration,
    /// The first radial distortion coefficient is wrong.
    Lens,
    /// The focal length is wrong.
    Focal,
    /// Each photograph has a gain of its own.
    Exposure,
    /// Photographs are darker in their corners.
    Vignetting,
    /// Photographs are left out.
    FewerImages,
    /// Fewer samples are placed.
    FewerSamples,
    /// Surfaces are taken out of the geometry.
    MissingSurfaces,
    /// Vertices are moved.
    MovedVertices,
    /// Virtual lights stand closer.
    MoreLights,
    /// Virtual lights stand further apart.
    FewerLights,
    /// All light has another colour.
    LightColor,
    /// Pairs of materials are tagged as one.
    MergedTags,
    /// Surfaces are tagged as two materials.
    SplitTags,
    /// Surfaces have a texture that no tag mentions.
    Texture,
    /// The solver starts from other reflectances.
    Start,
}

impl Degradation {
    /// All of them, in the order of tables and charts.
    pub const ALL: [Self; 18] = [
        Self::Noise,
        Self::Saturation,
        Self::Misregistration,
        Self::Lens,
        Self::Focal,
        Self::Exposure,
        Self::Vignetting,
        Self::FewerImages,
        Self::FewerSamples,
        Self::MissingSurfaces,
        Self::MovedVertices,
        Self::MoreLights,
        Self::FewerLights,
        Self::LightColor,
        Self::MergedTags,
        Self::SplitTags,
        Self::Texture,
        Self::Start,
    ];

    /// The name, in tables and the window.
    pub fn title(self) -> &'static str {
        match self {
            Self::Noise => "Image noise",
            Self::Saturation => "Saturation",
            Self::Misregistration => "Cameras misplaced",
            Self::Lens => "Lens distortion wrong",
            Self::Focal => "Focal length wrong",
            Self::Exposure => "Exposures differ",
            Self::Vignetting => "Vignetting left in",
            Self::FewerImages => "Photographs left out",
            Self::FewerSamples => "Fewer samples",
            Self::MissingSurfaces => "Surfaces missing",
            Self::MovedVertices => "Geometry inexact",
            Self::MoreLights => "Lights crowded",
            Self::FewerLights => "Too few lights",
            Self::LightColor => "Light strongly coloured",
            Self::MergedTags => "Two materials tagged as one",
            Self::SplitTags => "One material tagged as two",
            Self::Texture => "Texture taken to be plain",
            Self::Start => "Start values off",
        }
    }

    /// What the steps are counted in, for an axis.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Noise => "standard deviation, % of the mean radiance",
            Self::Saturation => "pixels at the sensor's limit, %",
            Self::Misregistration => "error of reprojection, px rms",
            Self::Lens => "error of k1",
            Self::Focal => "error of the focal length, %",
            Self::Exposure => "standard deviation between photographs, %",
            Self::Vignetting => "light lost in the corners, %",
            Self::FewerImages => "photographs left out, %",
            Self::FewerSamples => "samples left out, %",
            Self::MissingSurfaces => "surfaces removed",
            Self::MovedVertices => "standard deviation, % of the half-diagonal",
            Self::MoreLights => "background lights, times as many",
            Self::FewerLights => "background lights, one in",
            Self::LightColor => "red over blue, times",
            Self::MergedTags => "pairs of materials merged",
            Self::SplitTags => "surfaces split in two",
            Self::Texture => "contrast of the texture, ± %",
            Self::Start => "factor on the start, times or one in",
        }
    }

    /// The steps, from mild to gross. The quick study takes every second one.
    pub fn levels(self) -> &'static [f64] {
        match self {
            Self::Noise => &[5.0, 10.0, 20.0, 40.0, 80.0],
            Self::Saturation => &[5.0, 15.0, 30.0, 45.0, 60.0],
            Self::Misregistration => &[1.0, 2.0, 4.0, 8.0, 16.0],
            Self::Lens => &[0.01, 0.02, 0.04, 0.08, 0.16],
            Self::Focal => &[0.5, 1.0, 2.0, 4.0, 8.0],
            Self::Exposure => &[2.0, 5.0, 10.0, 20.0, 40.0],
            Self::Vignetting => &[5.0, 10.0, 20.0, 40.0, 60.0],
            Self::FewerImages => &[34.0, 50.0, 67.0, 84.0],
            Self::FewerSamples => &[50.0, 75.0, 90.0, 95.0, 98.0],
            Self::MissingSurfaces => &[1.0, 2.0, 3.0],
            Self::MovedVertices => &[0.2, 0.5, 1.0, 2.0, 4.0],
            Self::MoreLights => &[1.5, 2.0, 3.0],
            Self::FewerLights => &[2.0, 4.0, 8.0],
            Self::LightColor => &[3.0, 10.0, 30.0, 100.0],
            Self::MergedTags => &[1.0, 2.0],
            Self::SplitTags => &[1.0, 2.0, 3.0],
            Self::Texture => &[10.0, 20.0, 35.0, 50.0, 70.0],
            Self::Start => &[1.5, 2.0, 4.0, 8.0],
        }
    }

    /// The steps up to the most severe one that is asked for, at most `count`, which ends them.
    pub fn steps_to(self, most: f64, count: usize) -> Vec<f64> {
        let mut steps: Vec<f64> =
            self.levels().iter().copied().filter(|&level| level < 0.99 * most).collect();
        steps.push(most);
        let (all, count) = (steps.len(), count.clamp(1, steps.len()));
        (1..=count).map(|k| steps[(k * all).div_ceil(count) - 1]).collect()
    }

    /// Whether its steps are counted in whole things.
    pub fn is_whole(self) -> bool {
        matches!(self, Self::MissingSurfaces | Self::MergedTags | Self::SplitTags)
    }

    /// What stands before and after a level as a number.
    pub fn affixes(self) -> [&'static str; 2] {
        match self {
            Self::Misregistration => ["", " px"],
            Self::Lens | Self::MissingSurfaces | Self::SplitTags => ["", ""],
            Self::MergedTags => ["", " pairs"],
            Self::FewerLights => ["1 in ", ""],
            Self::MoreLights | Self::LightColor | Self::Start => ["", " ×"],
            Self::Texture => ["± ", " %"],
            _ => ["", " %"],
        }
    }

    /// What is done to the capture.
    pub fn help(self) -> &'static str {
        match self {
            Self::Noise => {
                "Noise that grows with the root of the radiance, as of a sensor in dim light"
            }
            Self::Saturation => "The brightest pixels are no measurements any more",
            Self::Misregistration => {
                "Every camera is turned and moved a little, each in its own way"
            }
            Self::Lens => "All photographs are taken to have another lens distortion",
            Self::Focal => "All photographs are taken to have another focal length",
            Self::Exposure => "Every photograph is brighter or darker by a factor of its own",
            Self::Vignetting => "Photographs get darker towards their corners",
            Self::FewerImages => "Some photographs are not used; one is always left",
            Self::FewerSamples => "Fewer points of the surfaces are sampled",
            Self::MissingSurfaces => {
                "Surfaces are taken out of the geometry, and their light with them"
            }
            Self::MovedVertices => "Every corner of the geometry is moved a little",
            Self::MoreLights => "The background's virtual lights stand closer",
            Self::FewerLights => "The background's virtual lights stand further apart",
            Self::LightColor => "All light is more red and less blue",
            Self::MergedTags => "Two materials each are tagged as one",
            Self::SplitTags => "The largest surfaces are tagged as two materials each",
            Self::Texture => "A chequered pattern lies on every surface, and no tag says so",
            Self::Start => "The reflectances that the solver starts from are off",
        }
    }

    /// A step in words that need no axis.
    pub fn step(self, level: f64) -> String {
        match self {
            Self::Noise => format!("noise of {level} % of the mean brightness"),
            Self::Saturation => format!("{level} % of the pixels burnt out"),
            Self::Misregistration => format!("cameras {level} px off"),
            Self::Lens => format!("a lens coefficient k1 that is {level} off"),
            Self::Focal => format!("a focal length {level} % off"),
            Self::Exposure => format!("exposures that differ by {level} %"),
            Self::Vignetting => format!("corners {level} % too dark"),
            Self::FewerImages => format!("{level} % of the photographs left out"),
            Self::FewerSamples => format!("{level} % of the samples left out"),
            Self::MissingSurfaces => format!("{level} surfaces missing from the model"),
            Self::MovedVertices => format!("corners of the model {level} % of its size off"),
            Self::MoreLights => format!("{level} times as many background lights"),
            Self::FewerLights => format!("one background light in {level}"),
            Self::LightColor => format!("light {level} times as red as blue"),
            Self::MergedTags => format!("{level} pairs of materials under one tag"),
            Self::SplitTags => format!("{level} surfaces cut in two materials"),
            Self::Texture => format!("a pattern of ± {level} % on every surface"),
            Self::Start => format!("start values {level} times too bright or too dark"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_end_with_the_most_severe_one() {
        assert_eq!(Degradation::Noise.steps_to(80.0, 9), [5.0, 10.0, 20.0, 40.0, 80.0]);
        assert_eq!(Degradation::Noise.steps_to(30.0, 9), [5.0, 10.0, 20.0, 30.0]);
        assert_eq!(Degradation::Noise.steps_to(30.0, 2), [10.0, 30.0]);
        assert_eq!(Degradation::Noise.steps_to(30.0, 1), [30.0]);
        assert_eq!(Degradation::MergedTags.steps_to(1.0, 3), [1.0]);
        for degradation in Degradation::ALL {
            let levels = degradation.levels();
            let last = levels[levels.len() - 1];
            assert_eq!(degradation.steps_to(last, 9), levels);
        }
    }
}
