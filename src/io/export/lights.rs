//! The recovered virtual lights: `lights.json`, and the light model in `solution.json`.

use super::numbers;
use crate::io::solution::{Light, LightModel, Lights, Lobe, Selection, Trial};
use crate::reconstruct::Reconstruction;
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::reconstruct::solution::{self, TrialPart};
use crate::scene::Capture;

/// The light model and its numbers of lamps and suns.
pub fn model(reconstruction: &Reconstruction) -> LightModel {
    let result = &reconstruction.solution;
    let shining = |kind| count(reconstruction, |light| light.kind == kind);
    let lights = &reconstruction.lights.lights;
    let is_open = lights.iter().any(|light| light.kind == LightKind::Sky);
    let world = if is_open { "open" } else { "room" };
    LightModel {
        world: (!lights.is_empty()).then(|| world.to_owned()),
        light_sets: result.certainty.as_ref().map_or(1, |certainty| certainty.light_sets),
        lamps: shining(LightKind::Lamp),
        sun: shining(LightKind::Sun) > 0,
        notes: result.notes.clone(),
    }
}

/// The comparisons of the search for a light model.
pub fn selection(capture: &Capture, selection: &solution::Selection) -> Selection {
    let trial = |trial: &solution::Trial| {
        let (part, number, material) = match trial.part {
            TrialPart::Sun => ("sun", None, None),
            TrialPart::SeenSky(cells) => ("photographed sky", Some(cells), None),
            TrialPart::Room => ("room", None, None),
            TrialPart::Lamp(number) => ("lamp", Some(number), None),
            TrialPart::Background(lobes) => ("background", Some(lobes), None),
            TrialPart::FineLobes => ("fine lobes", None, None),
            TrialPart::Beside(lobes) => ("fine lobes beside", Some(lobes), None),
            TrialPart::Lobe(index) => ("lobe", None, Some(capture.materials[index].name.clone())),
            TrialPart::Gloss(index) => ("gloss", None, Some(capture.materials[index].name.clone())),
        };
        Trial {
            part: part.to_owned(),
            number,
            material,
            error_before: trial.before,
            error_after: trial.after,
            change: trial.change,
            standard_error: trial.standard_error,
            supported: trial.supported,
        }
    };
    Selection {
        candidates: selection.candidates,
        kept: selection.kept,
        trials: selection.trials.iter().map(trial).collect(),
    }
}

/// Lights of a kind that `lights.json` has: discs whether they shine or not, others that do.
pub fn count(reconstruction: &Reconstruction, of_kind: impl Fn(&VirtualLight) -> bool) -> usize {
    let lights = reconstruction.lights.lights.iter().enumerate();
    lights.filter(|(index, light)| of_kind(light) && is_kept(reconstruction, *index)).count()
}

pub(super) fn file(capture: &Capture, reconstruction: &Reconstruction) -> Lights {
    let lights = 0..reconstruction.lights.lights.len();
    let kept = lights.filter(|&index| is_kept(reconstruction, index));
    Lights::new(kept.map(|index| light(capture, reconstruction, index)).collect())
}

fn light(capture: &Capture, reconstruction: &Reconstruction, index: usize) -> Light {
    let light = &reconstruction.lights.lights[index];
    let lobe = |lobe: usize| {
        let shape = &reconstruction.lobes.lobes[lobe];
        Lobe {
            direction: numbers(shape.direction),
            exponent: f64::from(shape.exponent),
            emission: reconstruction.solution.emission[lobe],
        }
    };
    let is_disc = is_disc(light);
    let lobes =
        reconstruction.lobes.of(index).filter(|&lobe| is_disc || shines(reconstruction, lobe));
    let empty = Light { lobes: lobes.map(lobe).collect(), ..Light::default() };
    let disc = |kind: &str| Light {
        kind: kind.into(),
        position: Some(numbers(light.position)),
        normal: Some(numbers(light.normal)),
        area_m2: Some(f64::from(light.area_m2())),
        radius_m: Some(f64::from(light.radius_m)),
        ..empty.clone()
    };
    match light.kind {
        LightKind::Sphere => disc("sphere"),
        LightKind::Surface => disc("surface"),
        LightKind::Lamp => Light {
            kind: "lamp".into(),
            position: Some(numbers(light.position)),
            radius_m: Some(f64::from(light.radius_m)),
            ..empty
        },
        LightKind::Sky => Light {
            kind: "sky".into(),
            direction: Some(numbers(light.normal)),
            solid_angle_sr: Some(f64::from(light.solid_angle_sr())),
            ..empty
        },
        LightKind::Sun => {
            Light { kind: "sun".into(), direction: Some(numbers(light.normal)), ..empty }
        }
        // Its place and shape are in `tags.json`, under the same name.
        LightKind::Known(known) => Light {
            kind: "known".into(),
            name: capture.lights.get(known).map(|light| light.name().to_owned()),
            ..empty
        },
    }
}

/// Discs are kept dark or lit: they show where the unknown world was taken to be. Whatever else
/// does not shine is not there.
fn is_kept(reconstruction: &Reconstruction, index: usize) -> bool {
    is_disc(&reconstruction.lights.lights[index])
        || reconstruction.lobes.of(index).any(|lobe| shines(reconstruction, lobe))
}

fn is_disc(light: &VirtualLight) -> bool {
    matches!(light.kind, LightKind::Sphere | LightKind::Surface)
}

fn shines(reconstruction: &Reconstruction, lobe: usize) -> bool {
    reconstruction.solution.emission[lobe].iter().any(|&emission| emission != 0.0)
}
