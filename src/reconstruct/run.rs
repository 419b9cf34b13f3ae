//! One run: the steps in a straight line, each done, or its product taken from the stage cache.

use std::sync::Arc;

use crate::geometry::bvh::RayCaster;
use crate::reconstruct::cache::{
    LightProducts, Product, RunProducts, SampleProducts, SolveProducts, Visibility,
};
use crate::reconstruct::checks::{
    LOWER_JOINT, LOWER_PAPER, SolveSize, check_size, check_start, of_photographs, warn,
};
use crate::reconstruct::clock::Clock;
use crate::reconstruct::equations::{self, Equations};
use crate::reconstruct::gain::{self, GainUse};
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::predict::{self, Predicted};
use crate::reconstruct::reads::{Inputs, Step};
use crate::reconstruct::samples::Sample;
use crate::reconstruct::transport::Transport;
use crate::reconstruct::{
    Error, Method, Options, Reconstruction, Stage, Update, in_front, joint, lights, lobes,
    normalize, optics, refine, samples, textures, transport, unsampled,
};
use crate::scene::{Brdf, Capture, MirrorsAndGlass, Views};
use crate::watch::Watch;

/// A run in progress.
pub(super) struct Run<'a> {
    pub capture: &'a Capture,
    pub options: &'a Options,
    /// The inputs of each step, in the order of `Step::ALL`.
    pub inputs: [Arc<Inputs>; 7],
    /// Products of earlier runs, which may be taken over.
    pub earlier: Vec<RunProducts>,
    pub products: RunProducts,
    /// The quarter of all blocks, by its number, whose samples are held out and then predicted.
    pub withheld: Option<usize>,
    pub watch: &'a Watch,
    pub update: &'a (dyn Fn(Update) + Sync),
}

impl Run<'_> {
    /// All steps; what is done of them is in `products`, whether or not the run succeeds.
    pub(super) fn perform(&mut self) -> Result<(Reconstruction, Vec<Predicted>), Error> {
        self.options.check()?;
        check_start(self.capture, self.options)?;
        if self.capture.measurements().next().is_none() {
            return Err(Error::NoMeasurement);
        }
        let mut clock = Clock::new(self.update);
        let (placed, withheld) = self.samples(&mut clock)?;
        let solved = match self.options.general.method {
            Method::Joint => self.joint(&placed, &mut clock)?,
            Method::Paper => self.paper(&placed, &mut clock)?,
        };
        let textures = self.textures(&placed, &solved, &mut clock)?;
        clock.stop(&mut self.products.secs);

        let capture = placed.corrected(self.capture);
        let visibility = self.visibility()?;
        let views = visibility.views(&capture).through(&placed.mirrors);
        let (light, brdfs) = (solved.light(), &solved.solution.reflectances);
        let predicted =
            predict::radiance(&views, withheld, &light, brdfs, self.options, self.watch)?;
        let SolveProducts { lights, lobes, transport, equations, solution } = (*solved).clone();
        let solution = unsampled::complete(&views, &light, solution, self.options, self.watch)?;
        let gains = match self.options.photographs.gain {
            GainUse::Off => Vec::new(),
            GainUse::Report => gain::estimate(&capture, &placed.cloud),
            GainUse::Apply => placed.gains.clone(),
        };
        let mut warnings = of_photographs(&views);
        warnings.extend(gain::warnings(&capture, &gains, !placed.gains.is_empty()));
        warnings.extend(placed.in_front.warning());
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
            seconds: self.products.secs,
            kept: clock.kept,
            warnings,
        };
        Ok((reconstruction, predicted))
    }

    fn inputs(&self, step: Step) -> Arc<Inputs> {
        self.inputs[step as usize].clone()
    }

    fn product<T>(&mut self, step: Step, value: T) -> Product<T> {
        self.products.is_new = true;
        Product { inputs: self.inputs(step), value: Arc::new(value) }
    }

    /// An earlier run that did this step with the same inputs.
    fn earlier(&self, step: Step) -> Option<RunProducts> {
        let method = self.options.general.method;
        self.earlier.iter().find(|run| run.holds(step, method, &self.inputs)).cloned()
    }

    /// A stage's product from an earlier run, and that run; where there is none the stage begins.
    fn kept<T>(
        &mut self,
        step: Step,
        stage: Stage,
        product: fn(&mut RunProducts) -> Option<Product<T>>,
        clock: &mut Clock,
    ) -> Option<(Product<T>, RunProducts)> {
        if let Some(mut run) = self.earlier(step)
            && let Some(found) = product(&mut run)
        {
            clock.keep(stage, &mut self.products.secs, &run.secs);
            return Some((found, run));
        }
        clock.begin(stage, &mut self.products.secs);
        None
    }

    /// Calls `work` with the visibility buffers over the corrected photographs, and with the inputs
    /// of a step.
    fn with_views<T>(
        &mut self,
        step: Step,
        placed: &SampleProducts,
        work: impl FnOnce(&Views, &Inputs) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let (inputs, visibility) = (self.inputs(step), self.visibility()?);
        let capture = placed.corrected(&inputs.capture);
        work(&visibility.views(&capture).through(&placed.mirrors), &inputs)
    }

    /// The ray caster and the visibility buffers.
    fn visibility(&mut self) -> Result<Arc<Visibility>, Error> {
        if self.products.visibility.is_none() {
            self.products.visibility =
                self.earlier(Step::Visibility).and_then(|run| run.visibility);
        }
        if let Some(visibility) = &self.products.visibility {
            return Ok(visibility.value.clone());
        }
        let inputs = self.inputs(Step::Visibility);
        let mesh = &inputs.capture.mesh;
        let caster = RayCaster::build(&mesh.positions, &mesh.triangles);
        let buffers = Views::new(&inputs.capture, &caster, self.watch)?.visibility();
        let visibility = self.product(Step::Visibility, Visibility { caster, buffers });
        Ok(self.products.visibility.insert(visibility).value.clone())
    }

    /// Samples and Eq. 11; also the samples that were withheld.
    fn samples(&mut self, clock: &mut Clock) -> Result<(Arc<SampleProducts>, Vec<Sample>), Error> {
        let mut withheld = Vec::new();
        let kept = self.kept(Step::Samples, Stage::Samples, |run| run.samples.take(), clock);
        let placed = if let Some((placed, run)) = kept {
            self.products.visibility = run.visibility;
            placed
        } else {
            let placed = self.place(&mut withheld)?;
            self.product(Step::Samples, placed)
        };
        let placed = self.products.samples.insert(placed).value.clone();
        (self.update)(Update::Samples(placed.cloud.clone()));
        Ok((placed, withheld))
    }

    fn place(&mut self, withheld: &mut Vec<Sample>) -> Result<SampleProducts, Error> {
        let (visibility, watch) = (self.visibility()?, self.watch);
        let inputs = self.inputs(Step::Samples);
        let (options, seed) = (&inputs.options, seed(&inputs));
        let views = visibility.views(&inputs.capture);
        let mirrors = MirrorsAndGlass::new(&inputs.capture, optics::find(&views, watch)?);
        let with_things = options.samples.omit_unmodelled;
        let in_front = in_front::find(&views.through(&mirrors), with_things, watch)?;
        let capture = in_front.capture.as_ref().unwrap_or(&inputs.capture);
        let mut views = visibility.views(capture).through(&mirrors);
        let mut cloud = samples::place(&views, &options.samples, seed, watch)?;
        let applies = options.photographs.gain == GainUse::Apply;
        let gains = if applies { gain::estimate(capture, &cloud) } else { Vec::new() };
        let equalised = gain::corrected(capture, &gains);
        if let Some(equalised) = &equalised {
            views = visibility.views(equalised).through(&mirrors);
            cloud = samples::place(&views, &options.samples, seed, watch)?;
        }
        if let Some(part) = self.withheld {
            *withheld = predict::withhold(&views, &mut cloud, part);
        }
        if cloud.samples.is_empty() {
            let shows = views.shows_anything();
            return Err(if shows { Error::NothingMeasured } else { Error::NothingSeen });
        }
        let start = normalize::initial_diffuse(&views, &cloud, watch)?;
        let corrected = equalised.or(in_front.capture).map(|capture| capture.photographs);
        let (cloud, mirrors, in_front) = (Arc::new(cloud), Arc::new(mirrors), in_front.found);
        Ok(SampleProducts { cloud, mirrors, gains, in_front, corrected, start })
    }

    /// The light that photographed surfaces send to the samples.
    fn gather(&mut self, placed: &SampleProducts) -> Result<Arc<Transport>, Error> {
        if let Some(gathered) = self.earlier(Step::Gathered).and_then(|run| run.gathered) {
            return Ok(self.products.gathered.insert(gathered).value.clone());
        }
        let watch = self.watch;
        let gathered = self.with_views(Step::Gathered, placed, |views, inputs| {
            let options = &inputs.options.transport;
            Ok(transport::photographed(views, &placed.cloud, options, seed(inputs), watch)?)
        })?;
        let gathered = self.product(Step::Gathered, gathered);
        Ok(self.products.gathered.insert(gathered).value.clone())
    }

    /// The joint method: the lights are part of what is solved for, so they come last.
    fn joint(
        &mut self,
        placed: &SampleProducts,
        clock: &mut Clock,
    ) -> Result<Arc<SolveProducts>, Error> {
        let joint = &self.options.joint;
        let size = self.solve_size(placed, joint.largest_set(), joint.light_sets);
        check_size(&size, LOWER_JOINT)?;
        if let Some(run) = self.earlier(Step::Gathered) {
            clock.keep(Stage::Transport, &mut self.products.secs, &run.secs);
        } else {
            clock.begin(Stage::Transport, &mut self.products.secs);
        }
        let gathered = self.gather(placed)?;
        let kept = self.kept(Step::Solved, Stage::Solve, |run| run.solved.take(), clock);
        if let Some((solved, run)) = kept {
            self.tell_iterations(&solved.value);
            clock.keep(Stage::Lights, &mut self.products.secs, &run.secs);
            self.tell_lights(&solved.value);
            return Ok(self.products.solved.insert(solved).value.clone());
        }
        let (update, watch, cloud) = (self.update, self.watch, &placed.cloud);
        let (outcome, equations) = self.with_views(Step::Solved, placed, |views, inputs| {
            let (options, no_lights) = (&inputs.options, VirtualLights::default());
            let (capture, most) = (views.capture, options.gloss.views_per_sample);
            let equations = Equations::new(capture, cloud, &no_lights, &gathered, most);
            let data = joint::Data {
                views,
                cloud,
                transport: &gathered,
                equations: &equations,
                options,
                watch,
            };
            let outcome =
                joint::solve(data, &placed.start, &placed.start_of(inputs), &|iteration| {
                    update(Update::Iteration(*iteration));
                })?;
            Ok((outcome, equations))
        })?;

        clock.begin(Stage::Lights, &mut self.products.secs);
        let transport = Transport {
            irradiance: outcome.irradiance,
            patch_radiosity: outcome.patch_radiosity,
            coupling: outcome.coupling,
            // What is shared, and a number for each sample.
            ..Transport::clone(&gathered)
        };
        let equations = equations.with_lights(cloud, &outcome.lights);
        let solved = SolveProducts {
            lights: Arc::new(outcome.lights),
            lobes: Arc::new(outcome.lobes),
            transport: Arc::new(transport),
            equations: Arc::new(equations),
            solution: Arc::new(placed.told(self.capture, outcome.solution)),
        };
        self.tell_lights(&solved);
        let solved = self.product(Step::Solved, solved);
        Ok(self.products.solved.insert(solved).value.clone())
    }

    /// The paper's method: lights are placed first, and light and reflectances refined in turn.
    fn paper(
        &mut self,
        placed: &SampleProducts,
        clock: &mut Clock,
    ) -> Result<Arc<SolveProducts>, Error> {
        let lit = self.lights(placed, clock)?;
        (self.update)(Update::Lights(lit.lights.clone(), lit.lobes.clone()));
        check_size(&self.solve_size(placed, lit.lobes.lobes.len(), 1), LOWER_PAPER)?;
        let coupled = self.couple(placed, &lit, clock)?;
        (self.update)(Update::Transport(coupled.clone()));
        let kept = self.kept(Step::Solved, Stage::Solve, |run| run.solved.take(), clock);
        if let Some((solved, _)) = kept {
            self.tell_iterations(&solved.value);
            return Ok(self.products.solved.insert(solved).value.clone());
        }
        let inputs = self.inputs(Step::Solved);
        let capture = placed.corrected(&inputs.capture);
        let options = &inputs.options;
        let equations = Equations::new(
            &capture,
            &placed.cloud,
            &lit.lights,
            &coupled,
            options.gloss.views_per_sample,
        );
        let start = placed.start_of(&inputs).into_iter();
        let start = start.map(|diffuse| diffuse.map(Brdf::diffuse)).collect();
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
        let solved = SolveProducts {
            lights: lit.lights.clone(),
            lobes: lit.lobes.clone(),
            transport: coupled,
            equations: Arc::new(equations),
            solution: Arc::new(placed.told(self.capture, solution)),
        };
        let solved = self.product(Step::Solved, solved);
        Ok(self.products.solved.insert(solved).value.clone())
    }

    fn lights(
        &mut self,
        placed: &SampleProducts,
        clock: &mut Clock,
    ) -> Result<Arc<LightProducts>, Error> {
        let kept = self.kept(Step::Lights, Stage::Lights, |run| run.lights.take(), clock);
        if let Some((lit, _)) = kept {
            return Ok(self.products.lights.insert(lit).value.clone());
        }
        let watch = self.watch;
        let lit = self.with_views(Step::Lights, placed, |views, inputs| {
            let (options, seed) = (&inputs.options, seed(inputs));
            let mut lights = lights::place(views, &placed.cloud, &options.lights, seed, watch)?;
            let lobes = Arc::new(lobes::choose(views, &mut lights, &options.lobes, watch)?);
            Ok(LightProducts { lights: Arc::new(lights), lobes })
        })?;
        let lit = self.product(Step::Lights, lit);
        Ok(self.products.lights.insert(lit).value.clone())
    }

    fn couple(
        &mut self,
        placed: &SampleProducts,
        lit: &LightProducts,
        clock: &mut Clock,
    ) -> Result<Arc<Transport>, Error> {
        let kept = self.kept(Step::Coupled, Stage::Transport, |run| run.coupled.take(), clock);
        if let Some((coupled, run)) = kept {
            self.products.gathered = run.gathered;
            return Ok(self.products.coupled.insert(coupled).value.clone());
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
        Ok(self.products.coupled.insert(coupled).value.clone())
    }

    fn textures(
        &mut self,
        placed: &SampleProducts,
        solved: &SolveProducts,
        clock: &mut Clock,
    ) -> Result<Arc<Vec<textures::Texture>>, Error> {
        let kept = self.kept(Step::Textures, Stage::Textures, |run| run.textures.take(), clock);
        if let Some((textures, _)) = kept {
            return Ok(self.products.textures.insert(textures).value.clone());
        }
        let watch = self.watch;
        let textures = self.with_views(Step::Textures, placed, |views, inputs| {
            textures::reconstruct(
                views,
                &placed.cloud,
                &solved.light(),
                &solved.solution.reflectances,
                &inputs.options,
                watch,
            )
        })?;
        let textures = self.product(Step::Textures, textures);
        Ok(self.products.textures.insert(textures).value.clone())
    }

    fn solve_size(&self, placed: &SampleProducts, lobes: usize, light_sets: usize) -> SolveSize {
        let views_per_sample = self.options.gloss.views_per_sample;
        SolveSize {
            samples: placed.cloud.samples.len(),
            rows: equations::count(self.capture, &placed.cloud, views_per_sample),
            lobes,
            light_sets,
            threads: rayon::current_num_threads(),
        }
    }

    fn tell_iterations(&self, solved: &SolveProducts) {
        for iteration in &solved.solution.iterations {
            (self.update)(Update::Iteration(*iteration));
        }
    }

    fn tell_lights(&self, solved: &SolveProducts) {
        (self.update)(Update::Lights(solved.lights.clone(), solved.lobes.clone()));
        (self.update)(Update::Transport(solved.transport.clone()));
    }
}

fn seed(inputs: &Inputs) -> u64 {
    inputs.options.general.seed as u64
}
