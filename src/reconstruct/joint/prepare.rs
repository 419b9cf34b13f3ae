//! What is settled before the light is looked for: what no photograph shows, what no light
//! explains, and how much each material's word counts.

use crate::reconstruct::Error;
use crate::reconstruct::joint::background::{Layout, World};
use crate::reconstruct::joint::choice::{self, Density, background_model};
use crate::reconstruct::joint::diagnose;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::history::History;
use crate::reconstruct::joint::model::Model;
use crate::reconstruct::joint::unseen::{self, Unseen};
use crate::reconstruct::lights::LightKind;
use crate::reconstruct::transport::HiddenLight;

/// Lights on unseen surfaces are called for where they make the objective smaller than this part
/// of what it is without: then a lamp or a window is there. As reflectors they gain a quarter.
const SHINING_GAIN: f64 = 0.5;

/// Fine lobes, which fit almost any light: good enough to see what no light explains.
pub struct Prepared {
    pub layout: Layout,
    pub model: Model,
    pub fits: Fits,
    pub hidden_light: HiddenLight,
    pub warnings: Vec<String>,
}

pub fn prepare(fitter: &mut Fitter, history: &History) -> Result<Prepared, Error> {
    let joint = fitter.options;
    fitter.surfaces_shine = do_surfaces_shine(fitter)?;
    let layout = choice::layout(fitter, World::Room, Density::Fine, 0);
    let mut model = background_model(fitter, &layout)?;
    let mut fits = fitter.fit(&model, joint.ridge, &fitter.weights, None)?;
    let mut hidden_light = HiddenLight::default();
    // What shines is a light of its own already.
    let unseen = if fitter.surfaces_shine { None } else { Unseen::find(fitter, &model)? };
    if let Some(unseen) = unseen {
        // The light that was found without these surfaces stood in for them.
        light_hidden(fitter, &mut model, &unseen.light(fitter, &fits));
        fits = fitter.fit(&model, joint.ridge, &fitter.weights, Some(&fits))?;
        hidden_light = unseen.light(fitter, &fits);
        light_hidden(fitter, &mut model, &hidden_light);
    }
    history.push(fitter, &fits);
    let warnings = diagnose::drop_emitters(fitter, &fits, diagnose::EMITS_CLEARLY);
    fitter.limit_by_brightest(&fits);
    fitter.pin_geometric_means(&fits);
    if joint.robust > 0.0 {
        fitter.weigh_by_deviation(&fits, joint.robust);
    }
    Ok(Prepared { layout, model, fits, hidden_light, warnings })
}

fn light_hidden(fitter: &mut Fitter, model: &mut Model, light: &HiddenLight) {
    fitter.irradiance = unseen::irradiance(fitter, light);
    fitter.gathered.clone_from(&fitter.irradiance);
    fitter.data.set_irradiance(&fitter.rows, model, &fitter.irradiance);
}

/// Whether there is light on known surfaces that no photograph shows: in a room that is known
/// all around, the lamps are there.
fn do_surfaces_shine(fitter: &Fitter) -> Result<bool, Error> {
    let total = |layout: &Layout| -> Result<(bool, f64), Error> {
        let model = background_model(fitter, layout)?;
        let has_surfaces =
            model.set.lights.lights.iter().any(|light| light.kind == LightKind::Surface);
        let ridge = fitter.options.ridge;
        Ok((has_surfaces, Fitter::total(&fitter.fit(&model, ridge, &fitter.weights, None)?)))
    };
    let dark = choice::layout(fitter, World::Room, Density::Coarse, 0);
    let (has_surfaces, shining) = total(&Layout { surfaces: true, ..dark })?;
    Ok(has_surfaces && shining < SHINING_GAIN * total(&dark)?.1)
}
