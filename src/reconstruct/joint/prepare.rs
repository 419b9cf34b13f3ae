//! The steps before the search for light: the light that surfaces without a photograph reflect, the
//! weight of each material, and the samples that are only used to judge the result.

use std::sync::Arc;

use crate::reconstruct::Error;
use crate::reconstruct::joint::background::{Density, Layout, World};
use crate::reconstruct::joint::blocks::deal;
use crate::reconstruct::joint::compare::{Validated, compare, validate};
use crate::reconstruct::joint::fit::{EXACT, Fitted, fit};
use crate::reconstruct::joint::indirect::{Indirect, Settled};
use crate::reconstruct::joint::light_model::LightModel;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::seen_sky::SeenSky;
use crate::reconstruct::solution::{Trial, TrialPart};
use crate::scene::Environment;

/// Blocks in one of so many parts are kept for judging the result.
const OUTER_FOLDS: usize = 5;
/// [`deal`]'s purpose of these parts.
const OUTER: u64 = 1;
/// Blocks below which none is kept: a scene so small needs all of them.
const ENOUGH_BLOCKS: usize = 20;
/// Standard errors by which a model has to predict better where lamps have not been looked for and it is
/// not asked again: once in forty such a difference is chance.
const DOUBTLESS: f64 = 2.0;
/// Samples with which the light model is chosen, about.
const SEARCHED: usize = 1200;

pub struct Prepared<'a> {
    /// All rows.
    pub all: Problem<'a>,
    /// An even part of those that do not judge the result: the light is looked for with these.
    pub search: Problem<'a>,
    /// Per row whether it only judges.
    pub is_outer: Vec<bool>,
    /// A fit of `search` by many fine lobes, which imitate almost any light.
    pub fine: Fitted,
    pub indirect: Indirect,
    /// Whether known surfaces that no photograph shows may shine.
    pub surfaces: bool,
    /// What came of the sky that photographs show.
    pub seen: Seen,
}

/// What came of the sky that photographs show, if they show any.
#[derive(Default)]
pub struct Seen {
    /// The sky, where the search is to tell whether it lights the scene.
    pub undecided: Option<Arc<SeenSky>>,
    /// The comparison that it was taken by before the search.
    pub trial: Option<Trial>,
}

pub fn prepare<'a>(problem: &Problem<'a>) -> Result<Prepared<'a>, Error> {
    let least = problem.data.options.samples.min_per_material;
    let is_outer = outer(problem);
    let search = problem.part(|row| !is_outer[row]).subsample(SEARCHED, least);
    let indirect = Indirect::new(&search)?;
    let (search, seen) = with_seen_sky(&search)?;
    let (search, surfaces) = if indirect.has_patches() {
        reflecting_or_shining(&search, &indirect)?
    } else {
        (search, false)
    };
    let indirect = if surfaces { indirect.without_patches() } else { indirect };

    let layout = Layout::new(&search, World::Room, Density::Fine, surfaces);
    let fine = fit(&search, &LightModel::new(&search, &layout)?, None, EXACT)?;
    let Settled { problem: search, fitted: fine, .. } = indirect.settle(&search, fine)?;
    let all = problem.with_surface_light(search.surface_light.clone()).informed_by(&search, &fine);
    let search = search.informed_by(&search, &fine);
    Ok(Prepared { all, search, is_outer, fine, indirect, surfaces, seen })
}

/// Per row whether its block is kept for judging the result.
fn outer(problem: &Problem) -> Vec<bool> {
    let blocks = problem.block_count();
    if blocks < ENOUGH_BLOCKS {
        return vec![false; problem.block.len()];
    }
    let fold = deal(blocks, OUTER_FOLDS, OUTER);
    problem.block.iter().map(|&block| fold[block] == 0).collect()
}

/// The light of the sky is what photographs show of it, where they show that it is far away or where that
/// predicts better beyond doubt: what they see beyond the known geometry may as well be near. Otherwise the
/// lamps and a sun may be missing that would show it, and the search decides.
fn with_seen_sky<'a>(search: &Problem<'a>) -> Result<(Problem<'a>, Seen), Error> {
    if search.capture().environment == Environment::Room {
        return Ok((search.clone(), Seen::default()));
    }
    let Some(sky) = SeenSky::find(search.data.views) else {
        return Ok((search.clone(), Seen::default()));
    };
    let cells = sky.radiance.len();
    let sky = Arc::new(sky);
    let seen = search.with_sky(Some(sky.clone()));
    // In whichever of the two worlds predicts better.
    let validated = |problem: &Problem| -> Result<Validated, Error> {
        let lit = |world| {
            let layout = Layout::new(problem, world, Density::Coarse, false);
            let fitted = fit(problem, &LightModel::new(problem, &layout)?, None, EXACT)?;
            validate(problem, fitted, None)
        };
        let (room, open) = (lit(World::Room)?, lit(World::Open)?);
        Ok(if compare(problem, &room, &open).change < 0.0 { open } else { room })
    };
    let cv = compare(search, &validated(search)?, &validated(&seen)?);
    if sky.is_distant || cv.is_better_beyond(DOUBTLESS) {
        let trial = Trial { supported: true, ..cv.trial(TrialPart::SeenSky(cells)) };
        return Ok((seen, Seen { undecided: None, trial: Some(trial) }));
    }
    Ok((search.clone(), Seen { undecided: Some(sky), trial: None }))
}

/// Known surfaces that no photograph shows reflect, unless a model in which they shine predicts
/// better beyond doubt: in a room that is known all around, the lamps are there.
fn reflecting_or_shining<'a>(
    search: &Problem<'a>,
    indirect: &Indirect,
) -> Result<(Problem<'a>, bool), Error> {
    let room = |shines| Layout::new(search, World::Room, Density::Coarse, shines);
    let reflecting = fit(search, &LightModel::new(search, &room(false))?, None, EXACT)?;
    let Settled { problem, fitted: reflecting, .. } = indirect.settle(search, reflecting)?;
    let shining = fit(search, &LightModel::new(search, &room(true))?, None, EXACT)?;
    let reflecting = validate(&problem, reflecting, None)?;
    let shining = validate(search, shining, None)?;
    let shines = compare(search, &reflecting, &shining).is_better_beyond(DOUBTLESS);
    Ok((if shines { search.clone() } else { problem }, shines))
}
