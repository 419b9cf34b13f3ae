//! The notes and warnings of a joint solve.

use crate::math::rgb::CHANNELS;
use crate::reconstruct::joint::average::{Ensemble, Posterior};
use crate::reconstruct::joint::background::World;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::search::Found;
use crate::reconstruct::joint::uncertainty::listed;
use crate::reconstruct::solution::{Certainty, MaterialCertainty, Selection, Trial, TrialPart};
use crate::scene::Gloss;

/// A specular reflectance below this is not visible.
const NO_HIGHLIGHT: f64 = 0.01;

/// Materials that are tagged as specular but show no highlight.
pub fn without_highlight(
    problem: &Problem,
    ensemble: &Ensemble,
    certainty: &Certainty,
    posterior: &Posterior,
) -> Vec<usize> {
    let shows =
        |own: &MaterialCertainty, material: usize, channel: usize| match own.specular[channel] {
            Some([low, _]) => low > 0.0 && posterior.specular[channel][material] > NO_HIGHLIGHT,
            // A highlight has to be present in all light sets.
            None => ensemble
                .members
                .iter()
                .all(|(fitted, _)| fitted.specular(material)[channel] > NO_HIGHLIGHT),
        };
    let is_matt = |material: &usize| {
        certainty.materials[*material]
            .as_ref()
            .is_some_and(|own| !(0..CHANNELS).any(|channel| shows(own, *material, channel)))
    };
    (0..problem.materials()).filter(|&m| problem.is_tagged_specular(m)).filter(is_matt).collect()
}

/// A warning for each of these materials.
pub fn no_highlight(problem: &Problem, materials: &[usize]) -> impl Iterator<Item = String> {
    materials.iter().map(|&material| {
        format!(
            "\"{}\" is tagged as specular, but the photographs show no highlight on it: it is \
             taken to be diffuse",
            problem.capture().materials[material].name
        )
    })
}

/// One sentence for each decision of the search.
pub fn notes(problem: &Problem, found: &Found, selection: &Selection) -> Vec<String> {
    let capture = problem.capture();
    let mut notes = Vec::new();
    let model = &found.best.fitted.model;
    let is_open = model.layout().is_some_and(|layout| layout.world == World::Open);
    let lamps = model.lamps();
    notes.push(format!(
        "the unmodelled surroundings are taken to be {}, with {lamps} lamp{}{}; {} of {} lobes that \
         were tried emit light",
        if is_open { "an open sky" } else { "a room" },
        if lamps == 1 { "" } else { "s" },
        if model.sun().is_some() { " and a sun" } else { "" },
        selection.kept,
        selection.candidates,
    ));
    for found in &found.sharpness {
        let name = &capture.materials[found.material].name;
        notes.push(match (found.gloss, found.range) {
            (
                Gloss::Coat { roughness },
                [Gloss::Coat { roughness: most }, Gloss::Coat { roughness: least }],
            ) => format!(
                "\"{name}\": a coat of roughness {roughness:.2}; {least:.2} to {most:.2} fit the \
                 photographs about as well"
            ),
            (gloss, [low, high]) => format!(
                "\"{name}\": exponent {:.0}; {:.0} to {:.0} fit the photographs about as well",
                gloss.exponent(),
                low.exponent(),
                high.exponent(),
            ),
        });
    }
    let is_assumed = |trial: &&Trial| trial.supported && !trial.is_significant();
    let assumed: Vec<&str> = selection
        .trials
        .iter()
        .filter(is_assumed)
        .filter_map(|trial| match trial.part {
            TrialPart::Gloss(material) => Some(capture.materials[material].name.as_str()),
            _ => None,
        })
        .collect();
    if !assumed.is_empty() {
        let (is, they) = if assumed.len() == 1 { ("is", "it is") } else { ("are", "they are") };
        notes.push(format!(
            "{} {is} tagged as specular, and the photographs do not tell whether {they} glossy: a \
             coat is assumed",
            listed(&assumed)
        ));
    }
    let told: Vec<String> = selection
        .trials
        .iter()
        .map(|trial| {
            let part = match trial.part {
                TrialPart::Sun => "a sun".to_owned(),
                TrialPart::SeenSky(cells) => {
                    format!("the sky that photographs show in {cells} cells")
                }
                TrialPart::Room => "a room rather than a sky".to_owned(),
                TrialPart::Lamp(number) => format!("lamp {number}"),
                TrialPart::Background(lobes) => {
                    format!("a background of {lobes} lobes rather than fewer")
                }
                TrialPart::FineLobes => "fine lobes in place of lamps".to_owned(),
                TrialPart::Beside(lobes) => {
                    format!("{lobes} fine lobes beside the other lights for pictures")
                }
                TrialPart::Lobe(material) => {
                    let name = &capture.materials[material].name;
                    format!("a lobe of its own strength on \"{name}\" rather than a coat")
                }
                TrialPart::Gloss(material) => {
                    format!("gloss of \"{}\"", capture.materials[material].name)
                }
            };
            let verdict = if trial.supported { "kept" } else { "left out" };
            format!("{part}: {verdict} ({})", error_change(trial))
        })
        .collect();
    if !told.is_empty() {
        notes.push(format!(
            "parts, by how the error in held-out blocks changes: {}",
            told.join("; ")
        ));
    }
    notes
}

fn error_change(trial: &Trial) -> String {
    match trial.standard_error {
        Some(error) => {
            format!("{:+.1} % ± {:.1} %", 100.0 * trial.change, 100.0 * error).replace('-', "−")
        }
        None => "too few samples to tell".to_owned(),
    }
}
