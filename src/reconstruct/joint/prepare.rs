//! What is settled before the light is looked for: what no photograph shows, what no light
//! explains, and how much each material's word counts.

use crate::reconstruct::Error;
use crate::reconstruct::joint::background::{Layout, World};
use crate::reconstruct::joint::choice::{self, Density, background_model};
use crate::reconstruct::joint::diagnose;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::history::History;
use crate::reconstruct::joint::model::Model;
use crate::reconstruct::joint::unseen::Unseen;
use crate::reconstruct::transport::PatchRadiosity;

/// Lights on unseen surfaces are called for where they make the objective smaller than this part
/// of what it is when these surfaces only reflect: then a lamp or a window is there.
const SHINING_GAIN: f64 = 0.5;
/// Rounds of reflectances from light and light from reflectances, each of which leaves about a
/// tenth of the error.
const COARSE_ROUNDS: usize = 3;

/// Fine lobes, which fit almost any light: good enough to see what no light explains.
pub struct Fine {
    pub layout: Layout,
    pub model: Model,
    pub fits: Fits,
}

pub struct Prepared {
    /// The coarse background of a room.
    pub room: Model,
    pub fine: Fine,
    pub patch_radiosity: PatchRadiosity,
    /// Surfaces that only reflect.
    pub unseen: Option<Unseen>,
    pub warnings: Vec<String>,
}

pub fn prepare(fitter: &mut Fitter, history: &History) -> Result<Prepared, Error> {
    let joint = fitter.options;
    let unseen = Unseen::find(fitter)?;
    let mut patch_radiosity = PatchRadiosity::default();
    let (light, room) = match &unseen {
        Some(unseen) => reflected(fitter, unseen)?,
        None => (None, background_model(fitter, &coarse_room(fitter))?),
    };
    match (&unseen, light) {
        (Some(unseen), Some(light)) => fitter.irradiance = unseen.irradiance(fitter, &light),
        // What shines is a light of its own.
        (unseen, _) => fitter.surfaces_shine = unseen.is_some(),
    }
    let layout = choice::layout(fitter, World::Room, Density::Fine, 0);
    let mut model = background_model(fitter, &layout)?;
    let mut fits = fitter.fit(&model, joint.ridge, &fitter.weights, None)?;
    let unseen = unseen.filter(|_| !fitter.surfaces_shine);
    if let Some(unseen) = &unseen {
        let coupling = unseen.coupling(fitter, &model)?;
        // The light that was found with too little from these surfaces stood in for them.
        for round in 0..2 {
            if round > 0 {
                fits = fitter.fit(&model, joint.ridge, &fitter.weights, Some(&fits))?;
            }
            patch_radiosity = unseen.light(fitter, &coupling, &fits);
            fitter.irradiance = unseen.irradiance(fitter, &patch_radiosity);
            fitter.data.set_irradiance(&fitter.rows, &mut model, &fitter.irradiance);
        }
        fitter.gathered.clone_from(&fitter.irradiance);
    }
    history.push(fitter, &fits);
    let warnings = diagnose::drop_emitters(fitter, &fits, diagnose::EMITS_CLEARLY);
    fitter.limit_by_brightest(&fits);
    fitter.pin_geometric_means(&fits);
    if joint.robust > 0.0 {
        fitter.weigh_by_deviation(&fits, joint.robust);
    }
    Ok(Prepared { room, fine: Fine { layout, model, fits }, patch_radiosity, unseen, warnings })
}

fn coarse_room(fitter: &Fitter) -> Layout {
    choice::layout(fitter, World::Room, Density::Coarse, 0)
}

/// What known surfaces that no photograph shows reflect, by a coarse light, and that light;
/// `None` where they shine: in a room that is known all around, the lamps are there.
fn reflected(fitter: &Fitter, unseen: &Unseen) -> Result<(Option<PatchRadiosity>, Model), Error> {
    let ridge = fitter.options.ridge;
    let layout = coarse_room(fitter);
    let lit = background_model(fitter, &Layout { surfaces: true, ..layout })?;
    let shining = fitter.fit(&lit, ridge, &fitter.weights, None)?;

    let mut model = background_model(fitter, &layout)?;
    let coupling = unseen.coupling(fitter, &model)?;
    let mut reflecting = fitter.fit(&model, ridge, &fitter.weights, None)?;
    for _ in 0..COARSE_ROUNDS {
        let light = unseen.light(fitter, &coupling, &reflecting);
        let irradiance = unseen.irradiance(fitter, &light);
        fitter.data.set_irradiance(&fitter.rows, &mut model, &irradiance);
        reflecting = fitter.fit(&model, ridge, &fitter.weights, Some(&reflecting))?;
    }
    if Fitter::total(&shining) < SHINING_GAIN * Fitter::total(&reflecting) {
        return Ok((None, lit));
    }
    Ok((Some(unseen.light(fitter, &coupling, &reflecting)), model))
}
