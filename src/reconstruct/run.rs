//! One run: the steps in a straight line, each done, or taken over from an earlier run.

use std::sync::Arc;

use crate::geometry::bvh::RayCaster;
use crate::math::rgb::Rgb;
use crate::reconstruct::checks::{
    LOWER_JOINT, LOWER_PAPER, SolveSize, check_size, check_start, warn,
};
use crate::reconstruct::clock::Clock;
use crate::reconstruct::equations::{self, Equations, Reflectance};
use crate::reconstruct::gain::{self, GainUse};
use crate::reconstruct::kept::{Lit, Made, Placed, Product, Sight, Solved};
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::predict::{self, Predicted};
use crate::reconstruct::reads::{Inputs, Step};
use crate::reconstruct::samples::Sample;
use crate::reconstruct::transport::Transport;
use crate::reconstruct::{
    Error, Method, Options, Reconstruction, Stage, Update, joint, lights, lobes, normalize, refine,
    samples, textures, transport,
};
use crate::scene::{Capture, Views};
use crate::watch::Watch;

/// A run on its way.
pub(super) struct Run<'a> {
    pub capture: &'a Capture,
    pub options: &'a Options,
    /// What each step is handed, in the order of `Step::ALL`.
    pub inputs: [Arc<Inputs>; 7],
    /// What may be taken over.
    pub earlier: Vec<Made>,
    pub made: Made,
    /// The part of all blocks whose samples are taken out, by its number.
    pub withheld: Option<usize>,
    pub watch: &'a Watch,
    pub update: &'a (dyn Fn(Update) + Sync),
}

impl Run<'_> {
    /// All steps; what is done of them is in `made`, whatever the end.
    pub(super) fn perform(&mut self) -> Result<(Reconstruction, Vec<Predicted>), Error> {
        self.options.check()?;
        check_start(self.capture, self.options)?;
        if self.capture.measurements().next().is_none() {
            return Err(Error::NoMeasurement);
        }
        let mut clock = Clock::new(self.update);
        let (placed, unseen) = self.samples(&mut clock)?;
        let solved = match self.options.general.method {
            Method::Joint => self.joint(&placed, &mut clock)?,
            Method::Paper => self.paper(&placed, &mut clock)?,
        };
        let textures = self.textures(&placed, &solved, &mut clock)?;
        clock.stop(&mut self.made.secs);

        let capture = corrected(self.capture, &placed);
        let sight = self.sight()?;
        let views = Views::along(&capture, &sight.caster, &sight.lines);
        let Solved { lights, lobes, transport, equations, solution } = (*solved).clone();
        let light = (&*lights, &*lobes, &transport.hidden_light, &*solution);
        let predicted = predict::radiance(&views, unseen, light, self.options, self.watch)?;
        let gains = match self.options.photographs.gain {
            GainUse::Off => Vec::new(),
            GainUse::Report => gain::estimate(&capture, &placed.cloud),
            GainUse::Apply => placed.gains.clone(),
        };
        let mut warnings = views.warnings();
        warnings.extend(gain::warnings(&capture, &gains, placed.corrected.is_some()));
        warnings.extend(warn(&capture, self.options, &placed.cloud, &lobes, &solution));
        let reconstruction = Reconstruction {
            samples: placed.cloud.clone(),
            lights,
            lobes,
            transport,
            equations,
            solution,
            textures,
            gains,
            seconds: self.made.secs,
            kept: clock.kept,
            warnings,
        };
        Ok((reconstruction, predicted))
    }

    fn inputs(&self, step: Step) -> Arc<Inputs> {
        self.inputs[step as usize].clone()
    }

    fn product<T>(&mut self, step: Step, it: T) -> Product<T> {
        self.made.is_new = true;
        Product { of: self.inputs(step), it: Arc::new(it) }
    }

    /// An earlier run that did this step with the same.
    fn earlier(&self, step: Step) -> Option<Made> {
        let method = self.options.general.method;
        self.earlier.iter().find(|made| made.holds(step, method, &self.inputs)).cloned()
    }

    /// A stage's product as an earlier run made it, and that run; without one the stage begins.
    fn kept<T>(
        &mut self,
        step: Step,
        stage: Stage,
        product: fn(&mut Made) -> Option<Product<T>>,
        clock: &mut Clock,
    ) -> Option<(Product<T>, Made)> {
        if let Some(mut made) = self.earlier(step)
            && let Some(found) = product(&mut made)
        {
            clock.keep(stage, &mut self.made.secs, &made.secs);
            return Some((found, made));
        }
        clock.begin(stage, &mut self.made.secs);
        None
    }

    /// Works with the photographs as they were measured with, and with what a step is handed.
    fn with_views<T>(
        &mut self,
        step: Step,
        placed: &Placed,
        work: impl FnOnce(&Views, &Inputs) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let (inputs, sight) = (self.inputs(step), self.sight()?);
        let capture = corrected(&inputs.capture, placed);
        work(&Views::along(&capture, &sight.caster, &sight.lines), &inputs)
    }

    /// What every pixel sees.
    fn sight(&mut self) -> Result<Arc<Sight>, Error> {
        if self.made.sight.is_none() {
            self.made.sight = self.earlier(Step::Sight).and_then(|made| made.sight);
        }
        if let Some(sight) = &self.made.sight {
            return Ok(sight.it.clone());
        }
        let inputs = self.inputs(Step::Sight);
        let mesh = &inputs.capture.mesh;
        let caster = RayCaster::build(&mesh.positions, &mesh.triangles);
        let lines = Views::new(&inputs.capture, &caster, self.watch)?.lines();
        let sight = self.product(Step::Sight, Sight { caster, lines });
        Ok(self.made.sight.insert(sight).it.clone())
    }

    /// Samples and Eq. 11; also the samples that were taken out.
    fn samples(&mut self, clock: &mut Clock) -> Result<(Arc<Placed>, Vec<Sample>), Error> {
        let mut unseen = Vec::new();
        let kept = self.kept(Step::Samples, Stage::Samples, |made| made.samples.take(), clock);
        let placed = if let Some((placed, made)) = kept {
            self.made.sight = made.sight;
            placed
        } else {
            let placed = self.place(&mut unseen)?;
            self.product(Step::Samples, placed)
        };
        let placed = self.made.samples.insert(placed).it.clone();
        (self.update)(Update::Samples(placed.cloud.clone()));
        Ok((placed, unseen))
    }

    fn place(&mut self, unseen: &mut Vec<Sample>) -> Result<Placed, Error> {
        let (sight, watch) = (self.sight()?, self.watch);
        let inputs = self.inputs(Step::Samples);
        let (options, seed) = (&inputs.options, seed(&inputs));
        let mut views = Views::along(&inputs.capture, &sight.caster, &sight.lines);
        let mut cloud = samples::place(&views, &options.samples, seed, watch)?;
        let applies = options.photographs.gain == GainUse::Apply;
        let gains = if applies { gain::estimate(&inputs.capture, &cloud) } else { Vec::new() };
        let corrected = gain::corrected(&inputs.capture, &gains);
        if let Some(corrected) = &corrected {
            views = Views::along(corrected, &sight.caster, &sight.lines);
            cloud = samples::place(&views, &options.samples, seed, watch)?;
        }
        if let Some(part) = self.withheld {
            *unseen = predict::withhold(&views, &mut cloud, part);
        }
        if cloud.samples.is_empty() {
            return Err(if views.shows_anything() {
                Error::NothingMeasured
            } else {
                Error::NothingSeen
            });
        }
        let start = normalize::initial_diffuse(&views, &cloud, watch)?;
        let corrected = corrected.map(|capture| capture.photographs);
        Ok(Placed { cloud: Arc::new(cloud), gains, corrected, start })
    }

    /// The light that photographed surfaces send to the samples.
    fn gather(&mut self, placed: &Placed) -> Result<Arc<Transport>, Error> {
        if let Some(gathered) = self.earlier(Step::Gathered).and_then(|made| made.gathered) {
            return Ok(self.made.gathered.insert(gathered).it.clone());
        }
        let watch = self.watch;
        let gathered = self.with_views(Step::Gathered, placed, |views, inputs| {
            let options = &inputs.options.transport;
            Ok(transport::photographed(views, &placed.cloud, options, seed(inputs), watch)?)
        })?;
        let gathered = self.product(Step::Gathered, gathered);
        Ok(self.made.gathered.insert(gathered).it.clone())
    }

    /// The joint method: the lights are part of what is solved for, so they come last.
    fn joint(&mut self, placed: &Placed, clock: &mut Clock) -> Result<Arc<Solved>, Error> {
        let joint = &self.options.joint;
        let size = self.solve_size(placed, joint.largest_set(), joint.light_sets);
        check_size(&size, LOWER_JOINT)?;
        if let Some(made) = self.earlier(Step::Gathered) {
            clock.keep(Stage::Transport, &mut self.made.secs, &made.secs);
        } else {
            clock.begin(Stage::Transport, &mut self.made.secs);
        }
        let gathered = self.gather(placed)?;
        let kept = self.kept(Step::Solved, Stage::Solve, |made| made.solved.take(), clock);
        if let Some((solved, made)) = kept {
            self.tell_iterations(&solved.it);
            clock.keep(Stage::Lights, &mut self.made.secs, &made.secs);
            self.tell_lights(&solved.it);
            return Ok(self.made.solved.insert(solved).it.clone());
        }
        let (update, watch, cloud) = (self.update, self.watch, &placed.cloud);
        let (outcome, equations) = self.with_views(Step::Solved, placed, |views, inputs| {
            let (options, no_lights) = (&inputs.options, VirtualLights::default());
            let (capture, most) = (views.capture, options.gloss.views_per_sample);
            let equations = Equations::new(capture, cloud, &no_lights, &gathered, most);
            let outcome = joint::solve(
                views,
                cloud,
                &gathered,
                &equations,
                &start(inputs, placed),
                options,
                &|iteration| update(Update::Iteration(*iteration)),
                watch,
            )?;
            Ok((outcome, equations))
        })?;

        clock.begin(Stage::Lights, &mut self.made.secs);
        let transport = Transport {
            irradiance: outcome.irradiance,
            hidden_light: outcome.hidden_light,
            coupling: outcome.coupling,
            // What is shared, and a number for each sample.
            ..Transport::clone(&gathered)
        };
        let equations = equations.with_lights(cloud, &outcome.set.lights);
        let solved = Solved {
            lights: Arc::new(outcome.set.lights),
            lobes: Arc::new(outcome.set.lobes),
            transport: Arc::new(transport),
            equations: Arc::new(equations),
            solution: Arc::new(outcome.solution),
        };
        self.tell_lights(&solved);
        let solved = self.product(Step::Solved, solved);
        Ok(self.made.solved.insert(solved).it.clone())
    }

    /// The paper's method: lights are placed first, and light and reflectances refined in turn.
    fn paper(&mut self, placed: &Placed, clock: &mut Clock) -> Result<Arc<Solved>, Error> {
        let lit = self.lights(placed, clock)?;
        (self.update)(Update::Lights(lit.lights.clone(), lit.lobes.clone()));
        check_size(&self.solve_size(placed, lit.lobes.lobes.len(), 1), LOWER_PAPER)?;
        let coupled = self.couple(placed, &lit, clock)?;
        (self.update)(Update::Transport(coupled.clone()));
        let kept = self.kept(Step::Solved, Stage::Solve, |made| made.solved.take(), clock);
        if let Some((solved, _)) = kept {
            self.tell_iterations(&solved.it);
            return Ok(self.made.solved.insert(solved).it.clone());
        }
        let inputs = self.inputs(Step::Solved);
        let capture = corrected(&inputs.capture, placed);
        let options = &inputs.options;
        let equations = Equations::new(
            &capture,
            &placed.cloud,
            &lit.lights,
            &coupled,
            options.gloss.views_per_sample,
        );
        let start = start(&inputs, placed);
        let start = start.into_iter().map(|diffuse| diffuse.map(Reflectance::diffuse)).collect();
        let solution = refine::refine(
            &capture,
            &equations,
            &lit.lobes,
            &coupled,
            start,
            options,
            &|iteration| (self.update)(Update::Iteration(*iteration)),
            self.watch,
        )?;
        let solved = Solved {
            lights: lit.lights.clone(),
            lobes: lit.lobes.clone(),
            transport: coupled,
            equations: Arc::new(equations),
            solution: Arc::new(solution),
        };
        let solved = self.product(Step::Solved, solved);
        Ok(self.made.solved.insert(solved).it.clone())
    }

    fn lights(&mut self, placed: &Placed, clock: &mut Clock) -> Result<Arc<Lit>, Error> {
        let kept = self.kept(Step::Lights, Stage::Lights, |made| made.lights.take(), clock);
        if let Some((lit, _)) = kept {
            return Ok(self.made.lights.insert(lit).it.clone());
        }
        let watch = self.watch;
        let lit = self.with_views(Step::Lights, placed, |views, inputs| {
            let (options, seed) = (&inputs.options, seed(inputs));
            let mut lights = lights::place(views, &placed.cloud, &options.lights, seed, watch)?;
            let lobes = Arc::new(lobes::choose(views, &mut lights, &options.lobes, watch)?);
            Ok(Lit { lights: Arc::new(lights), lobes })
        })?;
        let lit = self.product(Step::Lights, lit);
        Ok(self.made.lights.insert(lit).it.clone())
    }

    fn couple(
        &mut self,
        placed: &Placed,
        lit: &Lit,
        clock: &mut Clock,
    ) -> Result<Arc<Transport>, Error> {
        let kept = self.kept(Step::Coupled, Stage::Transport, |made| made.coupled.take(), clock);
        if let Some((coupled, made)) = kept {
            self.made.gathered = made.gathered;
            return Ok(self.made.coupled.insert(coupled).it.clone());
        }
        let (gathered, watch) = (self.gather(placed)?, self.watch);
        let coupling = self.with_views(Step::Coupled, placed, |views, inputs| {
            let (lights, lobes, options) = (&lit.lights, &lit.lobes, &inputs.options.transport);
            Ok(transport::couple(
                views,
                &placed.cloud,
                lights,
                lobes,
                options,
                seed(inputs),
                watch,
            )?)
        })?;
        let coupled = Transport { coupling, ..Transport::clone(&gathered) };
        let coupled = self.product(Step::Coupled, coupled);
        Ok(self.made.coupled.insert(coupled).it.clone())
    }

    fn textures(
        &mut self,
        placed: &Placed,
        solved: &Solved,
        clock: &mut Clock,
    ) -> Result<Arc<Vec<textures::Texture>>, Error> {
        let kept = self.kept(Step::Textures, Stage::Textures, |made| made.textures.take(), clock);
        if let Some((textures, _)) = kept {
            return Ok(self.made.textures.insert(textures).it.clone());
        }
        let watch = self.watch;
        let textures = self.with_views(Step::Textures, placed, |views, inputs| {
            textures::reconstruct(
                views,
                &placed.cloud,
                &solved.lights,
                &solved.lobes,
                &solved.transport.hidden_light,
                &solved.solution,
                &inputs.options,
                seed(inputs),
                watch,
            )
        })?;
        let textures = self.product(Step::Textures, textures);
        Ok(self.made.textures.insert(textures).it.clone())
    }

    fn solve_size(&self, placed: &Placed, lobes: usize, light_sets: usize) -> SolveSize {
        let views_per_sample = self.options.gloss.views_per_sample;
        SolveSize {
            samples: placed.cloud.samples.len(),
            rows: equations::count(self.capture, &placed.cloud, views_per_sample),
            lobes,
            light_sets,
            threads: rayon::current_num_threads(),
        }
    }

    fn tell_iterations(&self, solved: &Solved) {
        for iteration in &solved.solution.iterations {
            (self.update)(Update::Iteration(*iteration));
        }
    }

    fn tell_lights(&self, solved: &Solved) {
        (self.update)(Update::Lights(solved.lights.clone(), solved.lobes.clone()));
        (self.update)(Update::Transport(solved.transport.clone()));
    }
}

fn seed(inputs: &Inputs) -> u64 {
    inputs.options.general.seed as u64
}

/// The reflectances to start from: known ones, given ones, else Eq. 11.
fn start(inputs: &Inputs, placed: &Placed) -> Vec<Option<Rgb>> {
    let mut start = placed.start.clone();
    for (diffuse, material) in start.iter_mut().zip(&inputs.capture.materials) {
        let given = inputs.options.start.get(&material.name).copied();
        if let (Some(diffuse), Some(value)) = (diffuse, material.known_diffuse.or(given)) {
            *diffuse = value;
        }
    }
    start
}

/// A capture with its photographs as they were measured with.
fn corrected(capture: &Capture, placed: &Placed) -> Capture {
    let mut capture = capture.clone();
    if let Some(photographs) = &placed.corrected {
        capture.photographs.clone_from(photographs);
    }
    capture
}
