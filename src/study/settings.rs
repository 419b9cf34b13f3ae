//! The designed set of settings for the study of speed: changes of one option at a time from the
//! defaults of the two methods, for options that affect time and accuracy, and sets of options that
//! take as little time as possible.

use crate::options::{OptionError, OptionValue};
use crate::reconstruct::quality::{Change, Quality};
use crate::reconstruct::{Method, Options};

/// A named set of options.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// In tables and charts.
    pub name: &'static str,
    /// What it is set upon.
    pub base: Base,
    /// Options that differ from the base.
    pub changes: &'static [Change],
    /// Also part of the quick study.
    pub quick: bool,
}

/// The options that a setting starts from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Base {
    /// One of the qualities.
    Quality(Quality),
    /// The published method by its defaults.
    Paper,
    /// The joint method with one set of lights: a fraction of the seconds, and what else is set
    /// shows as well.
    OneSet,
    /// As few samples, rays and lamps as give an answer.
    Least,
}

/// How many of the settings are run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// A few that take seconds each.
    First,
    /// Some twenty, the qualities among them.
    Quick,
    /// All of them.
    Whole,
}

/// A first look: what little time buys, by either method.
const FIRST: [&str; 7] = [
    "draft",
    "paper, 150 samples",
    "paper, least",
    "least, coarse",
    "least, 150 samples",
    "least",
    "least, 3 lamps",
];

impl Scope {
    /// Whether a setting is run.
    pub fn has(self, setting: &Setting) -> bool {
        match self {
            Self::First => FIRST.contains(&setting.name),
            Self::Quick => setting.quick,
            Self::Whole => true,
        }
    }
}

/// Options that a base decides on, beside those of the qualities.
const OF_BASES: [(&str, &str); 7] = [
    ("general", "method"),
    ("joint", "light_sets"),
    ("joint", "max_lamps"),
    ("samples", "count"),
    ("samples", "min_per_material"),
    ("transport", "rays"),
    ("transport", "disc_rays"),
];

impl Setting {
    /// The setting by its name.
    pub fn named(name: &str) -> Option<&'static Self> {
        SETTINGS.iter().find(|setting| setting.name == name)
    }

    /// The setting upon every option's default.
    pub fn options(&self, seed: usize) -> Result<Options, OptionError> {
        self.upon(&Options::default(), seed)
    }

    /// The setting upon other options: what any setting decides on is as this one has it, all
    /// else as it was.
    pub fn upon(&self, base: &Options, seed: usize) -> Result<Options, OptionError> {
        let defaults = Options::default();
        let mut options = base.clone();
        options.set("general", "quality", &Quality::Standard.text())?;
        let changes = SETTINGS.iter().flat_map(|setting| setting.changes);
        let decided = changes.map(|(section, name, _)| (*section, *name)).chain(OF_BASES);
        for (section, name) in decided {
            options.set(section, name, &defaults.get(section, name).unwrap_or_default())?;
        }
        options.general.seed = seed;
        match self.base {
            Base::Quality(quality) => options.set("general", "quality", &quality.text())?,
            Base::Paper => options.general.method = Method::Paper,
            Base::OneSet => options.joint.light_sets = 1,
            Base::Least => {
                options.joint.light_sets = 1;
                options.joint.max_lamps = 0;
                options.samples.count = 300;
                options.samples.min_per_material = 30;
                options.transport.rays = 100;
                options.transport.disc_rays = 4;
            }
        }
        for (section, name, text) in self.changes {
            options.set(section, name, text)?;
        }
        Ok(options)
    }

    /// Whether this is the published method.
    pub fn is_paper(&self) -> bool {
        self.base == Base::Paper
    }

    /// The quality that it is, if it is one.
    pub fn quality(&self) -> Option<Quality> {
        match self.base {
            Base::Quality(quality) if self.changes.is_empty() => Some(quality),
            _ => None,
        }
    }
}

const fn set(name: &'static str, base: Base, changes: &'static [Change], quick: bool) -> Setting {
    Setting { name, base, changes, quick }
}

use Base::{Least, OneSet, Paper};

/// Every setting, in the order in which they are run.
pub const SETTINGS: &[Setting] = &[
    set("draft", Base::Quality(Quality::Draft), &[], true),
    set("standard", Base::Quality(Quality::Standard), &[], true),
    set("fine", Base::Quality(Quality::Fine), &[], true),
    // The published method: samples, lights, lobes, rays, solver.
    set("paper", Paper, &[], true),
    set("paper, 150 samples", Paper, &[("samples", "count", "150")], true),
    set("paper, 400 samples", Paper, &[("samples", "count", "400")], true),
    set("paper, 1200 samples", Paper, &[("samples", "count", "1200")], true),
    set("paper, 7000 samples", Paper, &[("samples", "count", "7000")], false),
    set("paper, 35 lights", Paper, &[("lights", "count", "35")], true),
    set("paper, 70 lights", Paper, &[("lights", "count", "70")], false),
    set("paper, 280 lights", Paper, &[("lights", "count", "280")], false),
    set("paper, lobes 3 × 3", Paper, &[("lobes", "grid", "3")], false),
    set("paper, lobes 8 × 8", Paper, &[("lobes", "grid", "8")], false),
    set("paper, exponent 5", Paper, &[("lobes", "exponent", "5")], false),
    set("paper, exponent 50", Paper, &[("lobes", "exponent", "50")], false),
    set("paper, 100 rays", Paper, &[("transport", "rays", "100")], true),
    set("paper, 1600 rays", Paper, &[("transport", "rays", "1600")], false),
    set("paper, 1 visibility ray", Paper, &[("transport", "disc_rays", "1")], false),
    set("paper, 25 visibility rays", Paper, &[("transport", "disc_rays", "25")], false),
    set("paper, 1 iteration", Paper, &[("refine", "max_iterations", "1")], false),
    set("paper, tolerance 0.0001", Paper, &[("refine", "rms_tolerance", "0.0001")], true),
    set(
        "paper, least",
        Paper,
        &[
            ("samples", "count", "150"),
            ("samples", "min_per_material", "20"),
            ("lights", "count", "35"),
            ("transport", "rays", "64"),
            ("transport", "disc_rays", "1"),
        ],
        true,
    ),
    // As little as gives an answer, and upwards from there.
    set(
        "least, coarse",
        Least,
        &[
            ("samples", "count", "150"),
            ("samples", "min_per_material", "20"),
            ("transport", "rays", "64"),
            ("transport", "disc_rays", "1"),
            ("joint", "fine_spacing", "0.7"),
        ],
        true,
    ),
    set("least", Least, &[], true),
    set("least, 150 samples", Least, &[("samples", "count", "150")], true),
    set("least, 600 samples", Least, &[("samples", "count", "600")], true),
    set("least, 1 lamp", Least, &[("joint", "max_lamps", "1")], true),
    set("least, 3 lamps", Least, &[("joint", "max_lamps", "3")], true),
    set("least, 6 lamps", Least, &[("joint", "max_lamps", "6")], false),
    set("least, 400 rays", Least, &[("transport", "rays", "400")], true),
    set(
        "least, 600 samples, 3 lamps",
        Least,
        &[("samples", "count", "600"), ("joint", "max_lamps", "3")],
        true,
    ),
    set(
        "least, 3 lamps, 400 rays",
        Least,
        &[("transport", "rays", "400"), ("joint", "max_lamps", "3")],
        true,
    ),
    set(
        "least, 3 lamps, 3 sets",
        Least,
        &[("joint", "light_sets", "3"), ("joint", "max_lamps", "3")],
        true,
    ),
    set(
        "least, 3 lamps, 6 sets",
        Least,
        &[("joint", "light_sets", "6"), ("joint", "max_lamps", "3")],
        false,
    ),
    set(
        "600 samples, 6 sets",
        Base::Quality(Quality::Standard),
        &[("samples", "count", "600")],
        true,
    ),
    set(
        "1200 samples, 6 sets",
        Base::Quality(Quality::Standard),
        &[("samples", "count", "1200")],
        false,
    ),
    set(
        "600 samples, 12 sets",
        Base::Quality(Quality::Standard),
        &[("samples", "count", "600"), ("joint", "light_sets", "12")],
        false,
    ),
    // One set of lights: samples, lights, lobes, rays, solver.
    set("1 set", OneSet, &[], true),
    set("1 set, 600 samples", OneSet, &[("samples", "count", "600")], true),
    set("1 set, 1200 samples", OneSet, &[("samples", "count", "1200")], false),
    set("1 set, 7000 samples", OneSet, &[("samples", "count", "7000")], false),
    set("1 set, no lamps", OneSet, &[("joint", "max_lamps", "0")], false),
    set("1 set, 3 lamps", OneSet, &[("joint", "max_lamps", "3")], false),
    set("1 set, 10 lamps", OneSet, &[("joint", "max_lamps", "10")], false),
    set("1 set, spacing 0.4", OneSet, &[("joint", "coarse_spacing", "0.4")], false),
    set("1 set, spacing 0.9", OneSet, &[("joint", "coarse_spacing", "0.9")], false),
    set("1 set, lobes 2 × 2", OneSet, &[("joint", "coarse_grid", "2")], false),
    set("1 set, lobes 5 × 5", OneSet, &[("joint", "coarse_grid", "5")], false),
    set("1 set, exponent 1", OneSet, &[("joint", "coarse_exponent", "1")], false),
    set("1 set, exponent 20", OneSet, &[("joint", "coarse_exponent", "20")], false),
    set("1 set, 100 rays", OneSet, &[("transport", "rays", "100")], false),
    set("1 set, 900 rays", OneSet, &[("transport", "rays", "900")], false),
    set("1 set, 1 visibility ray", OneSet, &[("transport", "disc_rays", "1")], false),
    set("1 set, 25 visibility rays", OneSet, &[("transport", "disc_rays", "25")], false),
    set("1 set, least squares", OneSet, &[("joint", "robust", "0")], false),
    // More of what a careful run may spend.
    set("3 sets", Base::Quality(Quality::Standard), &[("joint", "light_sets", "3")], false),
    set("12 sets", Base::Quality(Quality::Standard), &[("joint", "light_sets", "12")], false),
    set("900 rays", Base::Quality(Quality::Standard), &[("transport", "rays", "900")], false),
    set("7000 samples", Base::Quality(Quality::Standard), &[("samples", "count", "7000")], false),
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_setting_is_one_of_its_own() {
        let mut names = BTreeSet::new();
        for setting in SETTINGS {
            let options = setting.options(7).unwrap();
            options.check().unwrap();
            assert_eq!(options.general.seed, 7);
            assert_eq!(options.general.method == Method::Paper, setting.is_paper());
            assert!(names.insert(setting.name), "{} stands twice", setting.name);
            let twins = SETTINGS.iter().filter(|other| other.options(7).unwrap() == options);
            assert_eq!(twins.count(), 1, "{} is another one's twin", setting.name);
        }
    }
    #[test]
    fn what_no_setting_decides_on_stays_and_the_last_setting_counts() {
        let mut base = Options::default();
        base.set("gloss", "views_per_sample", "3").unwrap();
        base.set_start("wall", [0.5; 3]).unwrap();
        base.general.seed = 40;
        let draft = Setting::named("draft").unwrap();
        for setting in SETTINGS {
            let upon = setting.upon(&base, 1).unwrap();
            let expected = Options {
                gloss: base.gloss.clone(),
                start: base.start.clone(),
                ..setting.options(1).unwrap()
            };
            assert_eq!(upon, expected, "{}", setting.name);
            assert_eq!(draft.upon(&upon, 1).unwrap(), draft.upon(&base, 1).unwrap());
        }
        assert!(FIRST.iter().all(|name| Setting::named(name).is_some()));
    }
}
