//! All options of a reconstruction: those of every stage.

use std::collections::BTreeMap;

use crate::math::rgb::Rgb;
use crate::options::{Declaration, OptionError, OptionGroup};
use crate::reconstruct::gain::PhotographOptions;
use crate::reconstruct::joint::JointOptions;
use crate::reconstruct::lights::LightOptions;
use crate::reconstruct::lobes::LobeOptions;
use crate::reconstruct::quality::Quality;
use crate::reconstruct::refine::RefineOptions;
use crate::reconstruct::reflectance::GlossOptions;
use crate::reconstruct::samples::SampleOptions;
use crate::reconstruct::textures::TextureOptions;
use crate::reconstruct::transport::TransportOptions;
use crate::{choices, options};

choices! {
    /// How reflectances and light are estimated.
    Method {
        /// Light and reflectances solved together, with intervals.
        Joint = "joint",
        /// The paper's alternation, Sections 3 to 5 as printed.
        Paper = "paper",
    }
}

options! {
    /// Options of the whole reconstruction.
    GeneralOptions in "general" {
        /// joint: light and reflectances are solved for together, with intervals. paper: the
        /// alternation of Sections 3 to 5, for comparison; its result stays close to its start.
        method: Method = Method::Joint, None, "";
        /// Sets the options that time and accuracy depend on most: draft for a first look, standard
        /// for their defaults, fine for the last run. Options that are given too override it.
        quality: Quality = Quality::Standard, None, "";
        /// Seed of all random choices: the same seed gives the same result.
        seed: usize = 1, Some((0.0, 9e15)), "";
    }
}

/// The options of every stage.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Of the whole reconstruction.
    pub general: GeneralOptions,
    /// Of exposures of the photographs.
    pub photographs: PhotographOptions,
    /// Of Section 4.1.
    pub samples: SampleOptions,
    /// Of the positions of Section 4.2.
    pub lights: LightOptions,
    /// Of the lobes of Section 4.2.
    pub lobes: LobeOptions,
    /// Of Section 5.1.
    pub transport: TransportOptions,
    /// Of the method `joint`.
    pub joint: JointOptions,
    /// Of the method `paper` (Section 5.4).
    pub refine: RefineOptions,
    /// Of specular materials (Eq. 12).
    pub gloss: GlossOptions,
    /// Of Section 5.5.
    pub textures: TextureOptions,
    /// Diffuse reflectances to start from, by material, in place of Eq. 11's.
    pub start: BTreeMap<String, Rgb>,
}

impl Options {
    fn groups(&self) -> [&dyn OptionGroup; 10] {
        [
            &self.general,
            &self.photographs,
            &self.samples,
            &self.lights,
            &self.lobes,
            &self.transport,
            &self.joint,
            &self.refine,
            &self.gloss,
            &self.textures,
        ]
    }

    fn group_mut(&mut self, section: &str) -> Option<&mut dyn OptionGroup> {
        let groups: [&mut dyn OptionGroup; 10] = [
            &mut self.general,
            &mut self.photographs,
            &mut self.samples,
            &mut self.lights,
            &mut self.lobes,
            &mut self.transport,
            &mut self.joint,
            &mut self.refine,
            &mut self.gloss,
            &mut self.textures,
        ];
        groups.into_iter().find(|group| group.section() == section)
    }

    /// Every option of every stage, in the order of the stages.
    pub fn declarations(&self) -> Vec<Declaration> {
        self.groups().iter().flat_map(|group| group.declarations()).collect()
    }

    /// The value of one option as text; `None` where there is no such option.
    pub fn get(&self, section: &str, name: &str) -> Option<String> {
        self.groups().into_iter().find(|group| group.section() == section)?.get(name)
    }

    /// Sets one option from text.
    pub fn set(&mut self, section: &str, name: &str, text: &str) -> Result<(), OptionError> {
        let sections: Vec<_> = self.groups().iter().map(|group| group.section()).collect();
        match self.group_mut(section) {
            Some(group) => {
                group.set(name, text)?;
                if (section, name) == ("general", "quality") {
                    self.apply_quality()?;
                }
                Ok(())
            }
            None => Err(OptionError {
                section: section.to_owned(),
                name: name.to_owned(),
                problem: format!("there is no such section; there are {}", sections.join(", ")),
            }),
        }
    }

    /// Sets what the quality chosen decides on; what another quality had set returns to its
    /// default.
    fn apply_quality(&mut self) -> Result<(), OptionError> {
        let defaults = Self::default();
        for (section, name, _) in Quality::ALL.iter().flat_map(|quality| quality.changes()) {
            let text = defaults.get(section, name).unwrap_or_default();
            self.set(section, name, &text)?;
        }
        for (section, name, text) in self.general.quality.changes() {
            self.set(section, name, text)?;
        }
        Ok(())
    }

    /// The defaults with a quality.
    pub fn of_quality(quality: Quality) -> Self {
        let mut options = Self::default();
        options.general.quality = quality;
        // The options that a quality names exist: a test sets them all.
        let _ = options.apply_quality();
        options
    }

    /// Sets the reflectance that a material starts from.
    pub fn set_start(&mut self, material: &str, diffuse: Rgb) -> Result<(), OptionError> {
        if diffuse.iter().all(|value| (0.0..=1.0).contains(value)) {
            self.start.insert(material.to_owned(), diffuse);
            return Ok(());
        }
        Err(OptionError {
            section: "start".to_owned(),
            name: material.to_owned(),
            problem: "a reflectance has three numbers from 0 to 1".to_owned(),
        })
    }

    /// Whether every option is within its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), OptionError> {
        self.groups().iter().try_for_each(|group| group.check())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::OptionValue;

    #[test]
    fn a_quality_sets_options_and_another_takes_them_back() {
        let mut options = Options::default();
        for quality in Quality::ALL {
            options.set("general", "quality", &quality.text()).unwrap();
            assert_eq!(options, Options::of_quality(quality));
            for (section, name, text) in quality.changes() {
                assert_eq!(options.get(section, name).as_deref(), Some(*text));
            }
            options.check().unwrap();
        }
        options.set("general", "quality", "standard").unwrap();
        assert_eq!(options, Options::default());
    }
}
