//! The settings of a study, and the runs that follow from them.

use super::TruthStatus;
use super::progress::Planning;
use crate::app::project::Project;
use crate::study::cost::cost;
use crate::study::degradation::Degradation;
use crate::study::runs::Planned;
use crate::study::settings::Scope;
use crate::study::stability::Variant;
use crate::study::{Source, speed, stability};

/// Settings of a study of speed.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedRequest {
    pub scope: Scope,
    pub repeats: usize,
}

/// Settings of a study of stability.
#[derive(Clone, Debug, PartialEq)]
pub struct StabilityRequest {
    pub degradations: Vec<(Degradation, Vec<f64>)>,
    pub variants: Vec<Variant>,
    pub seeds: usize,
    /// By the quality `draft` rather than the options as they are set.
    pub draft: bool,
}

/// Time of a picture that is made anew, beside that of reconstructions.
const PICTURE: f64 = 1.5;

impl SpeedRequest {
    pub(super) fn design(&self, project: &Project, known: &TruthStatus) -> speed::Design {
        speed::Design {
            sources: vec![source(project, known)],
            base: project.edit().run_options(),
            own: true,
            scope: self.scope,
            repeats: self.repeats,
        }
    }

    /// The runs of this: what they depend on, their names and expected times.
    pub(super) fn runs(
        &self,
        project: &Project,
        known: &TruthStatus,
    ) -> Result<Vec<Planning>, String> {
        let plan = speed::plan(&self.design(project, known)).map_err(|error| error.to_string())?;
        let planning = |run: &speed::Run| Planning {
            key: run.key(),
            name: format!("{}, {}", run.setting, run.repeat + 1),
            cost: 2.0 * cost(&run.options) + PICTURE,
        };
        Ok(plan.iter().map(planning).collect())
    }
}

impl StabilityRequest {
    pub(super) fn design(&self, project: &Project, known: &TruthStatus) -> stability::Design {
        let mut base = project.edit().run_options();
        if self.draft {
            // The option and its value exist.
            let _ = base.set("general", "quality", "draft");
        }
        stability::Design {
            source: source(project, known),
            base,
            degradations: self.degradations.clone(),
            variants: self.variants.clone(),
            seeds: self.seeds,
        }
    }

    pub(super) fn runs(&self, project: &Project, known: &TruthStatus) -> Vec<Planning> {
        let plan = stability::plan(&self.design(project, known));
        let planning = |run: &stability::Run| Planning {
            key: run.key(),
            name: run.name(),
            cost: cost(&run.options),
        };
        plan.iter().map(planning).collect()
    }
}

/// The open capture as it is tagged now.
fn source(project: &Project, known: &TruthStatus) -> Source {
    Source::Open((project.capture.clone(), known.truth().cloned()))
}
