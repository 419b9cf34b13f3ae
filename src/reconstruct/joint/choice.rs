//! Which light model: its background, the lights that stand out, a room or the open sky.

use glam::Vec3;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::reconstruct::Error;
use crate::reconstruct::joint::background::{self, Layout, LightSet, World};
use crate::reconstruct::joint::certainty::Member;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::history::History;
use crate::reconstruct::joint::judge::{self, Judge};
use crate::reconstruct::joint::lamps::Candidates;
use crate::reconstruct::joint::model::Model;
use crate::reconstruct::joint::options::JointOptions;
use crate::reconstruct::joint::sources::{self, Found, Wanted};
use crate::reconstruct::joint::unseen::Unseen;
use crate::reconstruct::joint::{gloss, held_out, relook};
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::reconstruct::solution::{Trial, TrialPart};
use crate::reconstruct::transport::PatchRadiosity;
use crate::scene::{Emitter, KnownLight};
use crate::watch::Watch;

/// A light model that was settled on for one world.
pub struct Choice {
    pub layout: Layout,
    pub density: Density,
    pub most_lamps: usize,
    /// The background with the known lights.
    pub background: Model,
    pub found: Found,
    pub held_out: Rgb,
    /// What was tried on the way, where the model is grown.
    pub trials: Vec<Trial>,
}

/// What the search in one world taught of the specular surfaces: their exponents, which of them
/// are none, and I_s.
pub struct Taught {
    exponents: Vec<f64>,
    irradiance: Vec<Radiance>,
    matt: Vec<bool>,
    known_specular: [Vec<Option<f64>>; CHANNELS],
}

impl Choice {
    pub fn error(&self) -> f64 {
        held_out::mean(&self.held_out)
    }

    /// Fine lobes, fitted as the fitter is now, instead.
    pub fn fine(
        fitter: &Fitter,
        layout: Layout,
        background: Model,
        fits: Fits,
        held_out: Rgb,
    ) -> Result<Self, Error> {
        let mut found = Found::without_lamps(background.clone(), None, fits);
        tie_colours(fitter, &mut found.model, &mut found.fits, fitter.options.ridge)?;
        let (density, trials) = (Density::Fine, Vec::new());
        Ok(Self { layout, density, most_lamps: 0, background, found, held_out, trials })
    }

    /// What unseen surfaces reflect of the light that was found, and the light that goes with
    /// that. Where no photograph looks the lights are not checked, so that this is no better a
    /// guess than that of the fine lobes, by which the reflectances are found; but whoever lights
    /// the scene anew with the lights that were found comes to just this.
    pub fn reflect(
        &mut self,
        fitter: &mut Fitter,
        unseen: &Unseen,
    ) -> Result<PatchRadiosity, Error> {
        let coupling = unseen.coupling(fitter, &self.found.model)?;
        let mut light = PatchRadiosity::default();
        for _ in 0..REFLECT_ROUNDS {
            light = unseen.light(fitter, &coupling, &self.found.fits);
            fitter.gathered = unseen.irradiance(fitter, &light);
            fitter.irradiance = relook::irradiance(fitter, &self.found.model, &self.found.fits)?;
            let model = &mut self.found.model;
            fitter.data.set_irradiance(&fitter.rows, model, &fitter.irradiance);
            let (model, fits) = (&self.found.model, &self.found.fits);
            self.found.fits =
                fitter.fit(model, fitter.options.ridge, &fitter.weights, Some(fits))?;
        }
        Ok(light)
    }

    /// Fine lobes beside the lights that were found, where they lower the error of held-out blocks
    /// by more than its standard error; none are tried where all lights are fine already, or where
    /// nothing is unseen. Only for reflectances that are known by now: free ones would give way to
    /// so many lights, which is why they are found with few. The number of those lobes, and the
    /// trial of them.
    pub fn refine(&mut self, fitter: &Fitter) -> Result<Option<(usize, Trial)>, Error> {
        if self.density == Density::Fine {
            return Ok(None);
        }
        let (data, ridge) = (&fitter.data, fitter.options.ridge);
        let layout = layout(fitter, self.layout.world, Density::Fine, 0);
        let set = background::place(data.views, data.cloud, &layout, data.watch)?;
        let lobes = set.lobes.lobes.len();
        if lobes == 0 {
            return Ok(None);
        }
        let part = data.part(&fitter.rows, set, &fitter.exponents)?;
        let coarse = &self.found.model;
        let mut fine = coarse.with([&part]);
        fine.ridged[coarse.columns()..].fill(true);
        let fitted = |model: Model| -> Result<Found, Error> {
            let fits = fitter.fit(&model, ridge, &fitter.weights, Some(&self.found.fits))?;
            Ok(Found { model, fits, ..self.found.clone() })
        };
        let (coarse, fine) = (fitted(coarse.clone())?, fitted(fine)?);
        let judge = Judge::default();
        if judge.keeps(fitter, ridge, TrialPart::Beside(lobes), [&coarse, &fine])? {
            self.found = fine;
        }
        Ok(judge.into_trials().pop().map(|trial| (lobes, trial)))
    }

    /// Finds the exponents once more, and how well they are known.
    pub fn find_exponents(&mut self, fitter: &mut Fitter) -> Result<Vec<gloss::Exponents>, Error> {
        gloss::find_exponents(
            fitter,
            &mut self.found.model,
            fitter.options.ridge,
            &mut self.found.fits,
        )
    }
}

impl Taught {
    fn of(fitter: &Fitter) -> Self {
        Self {
            exponents: fitter.exponents.clone(),
            irradiance: fitter.irradiance.clone(),
            matt: fitter.matt.clone(),
            known_specular: fitter.known_specular.clone(),
        }
    }

    /// Leaves the fitter with it.
    pub fn teach(self, fitter: &mut Fitter) {
        (fitter.exponents, fitter.irradiance) = (self.exponents, self.irradiance);
        (fitter.matt, fitter.known_specular) = (self.matt, self.known_specular);
    }
}

/// Rounds of light from reflectances and the reverse.
const REFLECT_ROUNDS: usize = 3;

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Density {
    /// Fewer lights than the options ask for, where they do as well.
    Sparse,
    Coarse,
    Fine,
}

/// The layout of the background of one light set; that of index 0 is what the options say.
pub fn layout(fitter: &Fitter, world: World, density: Density, index: usize) -> Layout {
    let (options, surfaces) = (fitter.options, fitter.surfaces_shine);
    let (spacing, grid, exponent) = match density {
        Density::Sparse => {
            (SPARSE * options.coarse_spacing, options.coarse_grid, options.coarse_exponent)
        }
        Density::Coarse => (options.coarse_spacing, options.coarse_grid, options.coarse_exponent),
        Density::Fine => (options.fine_spacing, options.fine_grid, options.fine_exponent),
    };
    if index == 0 {
        let radius = options.radius_factor;
        return Layout { world, radius, spacing, grid, exponent, seed: 1, surfaces };
    }
    // Spread over their ranges in different orders, so that no two go together.
    let part = |step: usize| ((index * step) % VARIATIONS) as f64 / (VARIATIONS - 1) as f64;
    Layout {
        world,
        radius: options.radius_factor * (1.0 + 0.35 * part(5)),
        spacing: spacing * (0.7 + 0.45 * part(3)),
        grid,
        exponent: exponent * (0.8 + 0.4 * part(2)),
        seed: 1 + index as u64,
        surfaces,
    }
}

/// The distance between lights of a sparse background: about half as many.
const SPARSE: f64 = std::f64::consts::SQRT_2;
/// Prime, so that every step runs through all of the values.
const VARIATIONS: usize = 7;

/// The ridge of one light set.
fn ridge(options: &JointOptions, index: usize) -> f64 {
    options.ridge * [1.0, 1.0 / 3.0, 3.0][index % 3]
}

/// A background with the lights that the artist gave.
pub fn background_model(fitter: &Fitter, layout: &Layout) -> Result<Model, Error> {
    let data = &fitter.data;
    let set = background::place(data.views, data.cloud, layout, data.watch)?;
    let irradiance = &fitter.irradiance;
    let mut model = data.model(&fitter.rows, set, irradiance, &fitter.exponents)?;
    // Rooms are dark but for their lamps, skies bright all over, and a probe says how bright.
    model.floating = layout.world == World::Open && !aim_at_probe(fitter, &mut model);
    let mut given = LightSet::default();
    let mut known = Vec::new();
    for (index, light) in data.views.capture.lights.iter().enumerate() {
        let KnownLight::Shape { emitter, emission, .. } = light else { continue };
        let column = model.columns() + given.lobes.lobes.len();
        let (light, axis) = match *emitter {
            Emitter::Sun { direction, angular_diameter } => {
                let half = 0.5 * angular_diameter;
                (VirtualLight::distant(LightKind::Sun, direction, half), direction)
            }
            _ => {
                let (position, radius_m) = emitter.extent();
                let kind = LightKind::Known(index);
                (VirtualLight { kind, ..VirtualLight::lamp(position, radius_m) }, Vec3::Z)
            }
        };
        given.push(light, &[(axis, 0.0)]);
        known.extend(emission.map(|emission| (column, emission)));
    }
    if !given.lights.lights.is_empty() {
        model = model.with([&data.part(&fitter.rows, given, &fitter.exponents)?]);
        for (column, emission) in known {
            model.fix(column, emission);
        }
    }
    Ok(model)
}

/// A light probe says what the sky is likely to send; whether there is one.
fn aim_at_probe(fitter: &Fitter, model: &mut Model) -> bool {
    let mut aimed = false;
    for light in &fitter.data.views.capture.lights {
        let KnownLight::Dome { dome, .. } = light else { continue };
        aimed = true;
        for (column, lobe) in model.set.lobes.lobes.iter().enumerate() {
            let light = &model.set.lights.lights[lobe.light];
            if light.kind == LightKind::Sky {
                let radiance = dome.mean_radiance(-light.normal, light.half_angle);
                for (centre, value) in model.centre[column].iter_mut().zip(radiance) {
                    *centre += f64::from(value);
                }
            }
        }
    }
    aimed
}

/// The sun that the artist gave.
fn given_sun<'a>(fitter: &Fitter<'a>) -> Option<&'a KnownLight> {
    let is_sun = |light: &&KnownLight| {
        matches!(light, KnownLight::Shape { emitter: Emitter::Sun { .. }, .. })
    };
    fitter.data.views.capture.lights.iter().find(is_sun)
}

/// Held-out error of a sky without lamps, with the sun that was found.
pub fn sky_alone(fitter: &Fitter, sky: &Model, sun: Option<Vec3>) -> Result<Rgb, Error> {
    let model = match sun {
        Some(towards) => sources::sunny(fitter, sky, towards)?,
        None => sky.clone(),
    };
    let fits = fitter.fit(&model, fitter.options.ridge, &fitter.weights, None)?;
    held_out::error(fitter, &model, fitter.options.ridge, &fits)
}

/// What is looked for over a background.
pub struct Search<'a> {
    pub candidates: &'a Candidates,
    pub most_lamps: usize,
    /// Unit direction towards the sun, where it was found before.
    pub sun: Option<Vec3>,
    /// Whether lights and gloss must be borne out by what they predict.
    pub grows: bool,
}

/// The lights of one world over its background; the fitter stays as it was.
pub fn choose_light(
    fitter: &mut Fitter,
    search: &Search,
    (layout, mut background): (Layout, Model),
    history: &History,
    watch: &Watch,
) -> Result<(Choice, Taught), Error> {
    let options = fitter.options;
    let may_find_sun = options.find_sun && given_sun(fitter).is_none();
    let before = Taught::of(fitter);
    let report = |fitter: &Fitter, found: &Found| history.push(fitter, &found.fits);
    let find = |fitter: &Fitter, background: &Model| -> Result<(Found, Vec<Trial>), Error> {
        let judge = search.grows.then(Judge::default);
        let wanted = Wanted {
            may_find_sun: may_find_sun && search.sun.is_none(),
            report: &|found: &Found| report(fitter, found),
            judge: judge.as_ref(),
            ..Wanted::lamps(search.candidates, search.most_lamps)
        };
        let found = match search.sun.filter(|_| may_find_sun) {
            None => sources::find(fitter, background, options.ridge, wanted)?,
            Some(towards) => {
                let sunny = sources::sunny(fitter, background, towards)?;
                let found = sources::find(fitter, &sunny, options.ridge, wanted)?;
                Found { sun: Some(towards), ..found }
            }
        };
        Ok((found, judge.map_or_else(Vec::new, Judge::into_trials)))
    };
    let (mut found, mut trials) = find(fitter, &background)?;
    let has_gloss = (0..fitter.rows.materials).any(|material| fitter.is_specular(material));
    if has_gloss {
        let (model, fits) = (&mut found.model, &mut found.fits);
        gloss::find_exponents(fitter, model, options.ridge, fits)?;
        let of_gloss = match search.grows {
            true => judge::drop_gloss(fitter, model, options.ridge, fits)?,
            false => Vec::new(),
        };
        // Lamps stand better where the highlights have their true sharpness, and I_s its part
        // from specular surfaces.
        fitter.irradiance = relook::irradiance(fitter, &found.model, &found.fits)?;
        fitter.data.set_irradiance(&fitter.rows, &mut background, &fitter.irradiance);
        fitter.data.set_exponents(&fitter.rows, &mut background, &fitter.exponents);
        (found, trials) = find(fitter, &background)?;
        trials.extend(of_gloss);
    }
    found = sources::settle_sun(fitter, found, &background, options.ridge)?;
    tie_colours(fitter, &mut found.model, &mut found.fits, options.ridge)?;
    let held_out = held_out::error(fitter, &found.model, options.ridge, &found.fits)?;
    let taught = Taught::of(fitter);
    // The other world is not to profit from what this one found.
    before.teach(fitter);
    watch.tick()?;
    let choice = Choice {
        layout,
        density: Density::Coarse,
        most_lamps: search.most_lamps,
        background,
        found,
        held_out,
        trials,
    };
    Ok((choice, taught))
}

/// The reflectances with another background, its lamps found anew.
pub fn member(
    fitter: &Fitter,
    candidates: &Candidates,
    choice: &Choice,
    index: usize,
) -> Result<Member, Error> {
    let (background, lambda) = member_background(fitter, choice, index)?;
    let fitted = match choice.density {
        Density::Coarse | Density::Sparse => {
            let wanted = Wanted::lamps(candidates, choice.most_lamps);
            let found = sources::find(fitter, &background, lambda, wanted)?;
            (found.model, found.fits)
        }
        Density::Fine => {
            let fits = fitter.fit(&background, lambda, &fitter.weights, None)?;
            (background, fits)
        }
    };
    settled(fitter, fitted, lambda)
}

/// The background of one light set, with the sun that was found, and its ridge.
pub fn member_background(
    fitter: &Fitter,
    choice: &Choice,
    index: usize,
) -> Result<(Model, f64), Error> {
    let layout = layout(fitter, choice.layout.world, choice.density, index);
    let mut background = background_model(fitter, &layout)?;
    if let Some(towards) = choice.found.sun {
        background = sources::sunny(fitter, &background, towards)?;
    }
    Ok((background, ridge(fitter.options, index)))
}

/// The reflectances of a light set's fit.
pub fn settled(
    fitter: &Fitter,
    (mut model, mut fits): (Model, Fits),
    lambda: f64,
) -> Result<Member, Error> {
    tie_colours(fitter, &mut model, &mut fits, lambda)?;
    Ok(Member::of(&fitter.settle(&model, lambda, fits)?))
}

/// Given lights of unknown strength but known colour: what the channels find separately is
/// replaced by one strength, which ties the scales of the channels to each other.
pub fn tie_colours(
    fitter: &Fitter,
    model: &mut Model,
    fits: &mut Fits,
    lambda: f64,
) -> Result<(), Error> {
    let mut tied = Vec::new();
    for (column, lobe) in model.set.lobes.lobes.iter().enumerate() {
        let light = &model.set.lights.lights[lobe.light];
        let given = match light.kind {
            LightKind::Known(index) => fitter.data.views.capture.lights.get(index),
            LightKind::Sun => given_sun(fitter),
            _ => None,
        };
        let Some(KnownLight::Shape { color: Some(color), emission: None, .. }) = given else {
            continue;
        };
        let logs: Vec<f64> = (0..CHANNELS)
            .map(|c| fits[c].state.emission[column] / color[c])
            .filter(|strength| *strength > 0.0 && strength.is_finite())
            .map(f64::ln)
            .collect();
        if !logs.is_empty() {
            let strength = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
            tied.push((column, color.map(|value| value * strength)));
        }
    }
    if tied.is_empty() {
        return Ok(());
    }
    for (column, emission) in tied {
        model.fix(column, emission);
        for fit in fits.iter_mut() {
            fit.state.emission[column] = 0.0;
        }
    }
    *fits = fitter.fit(model, lambda, &fitter.weights, Some(fits))?;
    Ok(())
}
