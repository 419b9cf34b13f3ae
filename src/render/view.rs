//! The layers of a scene for one camera, at every resolution from coarse to fine.

use std::ops::Range;
use std::sync::Arc;

use crate::math::rgb::Radiance;
use crate::render::added::Added;
use crate::render::denoise::Guides;
use crate::render::film::{LightFilm, SurfaceFilm};
use crate::render::layers::Source;
use crate::render::scene::{Geometry, Shell};
use crate::render::tracer::Tracer;
use crate::render::{Exposure, Pass};
use crate::scene::Camera;
use crate::watch::{Cancelled, Watch};

/// Pixels of the finest picture along a side of a coarser picture's pixel, coarsest first. In a view of
/// 1280×720 two cores trace the first paths of the coarsest step in about 20 ms.
const STEPS: [usize; 4] = [8, 4, 2, 1];

/// Lights that are traced together, and what was traced of them.
pub struct Unit {
    pub source: Source,
    /// Of added lights what surrounds the scene.
    shell: Option<Shell>,
    lights: Vec<Arc<Added>>,
    /// Of `step`; without a step nothing was traced.
    pub film: LightFilm,
    pub step: Option<usize>,
    /// Of the next finer step, in the making.
    pub next: Option<LightFilm>,
    /// The layers with less noise, as finely as the view is shown; empty before there are any.
    pub clear: Vec<Vec<Radiance>>,
    /// Paths per pixel of these.
    pub shown_paths: usize,
}

impl Unit {
    fn new(source: Source, shell: Option<Shell>, lights: Vec<Arc<Added>>) -> Self {
        let film = LightFilm::new(0, source.layers(), 0);
        let (step, next, clear) = (None, None, Vec::new());
        Self { source, shell, lights, film, step, next, clear, shown_paths: 0 }
    }

    /// Those of its lights that were added.
    pub fn lights(&self) -> &[Arc<Added>] {
        &self.lights
    }
}

/// What is met first through every pixel of one step.
struct Surfaces {
    film: SurfaceFilm,
    found: Option<Found>,
    /// What its pixels count for those of a finer step.
    shares: Option<(usize, Vec<[u8; 4]>)>,
}

/// What a whole film of surfaces says.
pub struct Found {
    guides: Guides,
    /// Paths per pixel that say it.
    paths: usize,
    /// Part of every pixel that known surfaces or objects cover.
    pub coverage: Vec<f32>,
    /// Part of every pixel that objects cover.
    pub object: Vec<f32>,
}

/// A camera's view of a scene.
pub struct View {
    /// `None` before there is any.
    pub camera: Option<Camera>,
    pub geometry: Arc<Geometry>,
    pub steps: Vec<usize>,
    /// The finest step of which everything is known that rays meet first.
    pub shown: Option<usize>,
    surfaces: Vec<(usize, Surfaces)>,
    /// The first one is the recovered light.
    pub units: Vec<Unit>,
}

impl View {
    pub fn empty(geometry: Arc<Geometry>) -> Self {
        let (steps, surfaces, units) = (Vec::new(), Vec::new(), Vec::new());
        Self { camera: None, geometry, steps, shown: None, surfaces, units }
    }

    pub fn new(camera: Camera, geometry: Arc<Geometry>) -> Self {
        let is_seen = |step: &usize| {
            let reduced = camera.reduced(*step);
            reduced.width * reduced.height > 0
        };
        let steps = STEPS.into_iter().filter(is_seen).collect();
        Self { camera: Some(camera), steps, ..Self::empty(geometry) }
    }

    /// Keeps what was traced of these sources within the same surroundings; there are no others.
    pub fn keep(&mut self, sources: Vec<Source>, shell: Option<Shell>) {
        let mut former = std::mem::take(&mut self.units);
        for source in sources {
            let shell = shell.filter(|_| !matches!(source, Source::Recovered { .. }));
            let known = former.iter().position(|unit| unit.source == source);
            let lights = match known.map(|index| former.swap_remove(index)) {
                Some(unit) if unit.shell == shell => {
                    self.units.push(unit);
                    continue;
                }
                Some(unit) => unit.lights,
                None => source.added().iter().map(|light| Arc::new(Added::new(light))).collect(),
            };
            self.units.push(Unit::new(source, shell, lights));
        }
    }

    /// The step after the one that a unit is traced on; `None` for the finest.
    pub fn next_step(&self, unit: usize) -> Option<usize> {
        let done = self.units[unit].step;
        self.steps.iter().copied().find(|&step| done.is_none_or(|done| step < done))
    }

    /// What is known of a step.
    pub fn surfaces(&self, step: usize) -> Option<&Found> {
        let (_, surfaces) = self.surfaces.iter().find(|(of, _)| *of == step)?;
        surfaces.found.as_ref()
    }

    /// Adds paths to units on a step, whose layers are those `ranges` of the scene's. Returns how
    /// many paths were traced, also where it was cancelled.
    pub fn trace(
        &mut self,
        tracer: &dyn Tracer,
        pass: &Pass,
        step: usize,
        units: &[usize],
        ranges: &[Range<usize>],
        watch: &Watch,
    ) -> (u64, Result<(), Cancelled>) {
        let pixels = pass.camera.width * pass.camera.height;
        let surfaces = match self.surfaces.iter().position(|(of, _)| *of == step) {
            Some(index) => index,
            None => {
                let film = SurfaceFilm::new(pixels);
                self.surfaces.push((step, Surfaces { film, found: None, shares: None }));
                self.surfaces.len() - 1
            }
        };
        let surfaces = &mut self.surfaces[surfaces].1;
        let mut exposures = Vec::new();
        for (index, unit) in self.units.iter_mut().enumerate() {
            let Some(place) = units.iter().position(|&of| of == index) else { continue };
            let new = || LightFilm::new(pixels, unit.source.layers(), 0);
            let film = match unit.step {
                Some(of) if of == step => &mut unit.film,
                _ => unit.next.get_or_insert_with(new),
            };
            exposures.push(Exposure { film, layers: ranges[place].clone() });
        }
        let traced = |exposures: &[Exposure]| exposures.first().map_or(0, |e| e.film.total_paths());
        let before = traced(&exposures);
        let ended = tracer.trace(pass, &mut surfaces.film, &mut exposures, watch);
        let count = traced(&exposures) - before;
        if ended.is_ok() {
            let size = (pass.camera.width, pass.camera.height);
            surfaces.look(size);
            for &index in units {
                let unit = &mut self.units[index];
                if let Some(film) = unit.next.take_if(|_| unit.step != Some(step)) {
                    (unit.film, unit.step) = (film, Some(step));
                }
            }
            if self.shown.is_none_or(|shown| step < shown) {
                self.shown = Some(step);
                (0..self.units.len()).for_each(|unit| self.clear(unit, tracer));
            } else {
                units.iter().for_each(|&unit| self.clear(unit, tracer));
            }
        }
        (count, ended)
    }

    /// Makes the layers of a unit anew that are shown.
    fn clear(&mut self, unit: usize, tracer: &dyn Tracer) {
        let (Some(step), Some(shown)) = (self.units[unit].step, self.shown) else { return };
        let place = |step: usize| self.surfaces.iter().position(|(of, _)| *of == step);
        let (Some(own), Some(finest)) = (place(step), place(shown)) else { return };
        let (Some(found), Some(fine)) = (self.surfaces(step), self.surfaces(shown)) else { return };
        let mut layers = found.guides.denoised(&self.units[unit].film, tracer);
        if step != shown {
            let known = self.surfaces[own].1.shares.as_ref().filter(|(of, _)| *of == finest);
            if known.is_none() {
                let shares = fine.guides.shares(&found.guides, step / shown);
                self.surfaces[own].1.shares = Some((finest, shares));
            }
            if let (Some(found), Some(fine), Some((_, shares))) =
                (self.surfaces(step), self.surfaces(shown), &self.surfaces[own].1.shares)
            {
                let guides = &found.guides;
                for layer in &mut layers {
                    *layer = fine.guides.refined(layer, guides, step / shown, shares);
                }
            }
        }
        let unit = &mut self.units[unit];
        (unit.clear, unit.shown_paths) = (layers, unit.film.paths());
    }

    /// What its films and pictures take.
    pub fn bytes(&self) -> usize {
        let unit = |unit: &Unit| {
            let clear = unit.clear.iter().map(|layer| size_of_val(&**layer)).sum::<usize>();
            unit.film.bytes() + unit.next.as_ref().map_or(0, LightFilm::bytes) + clear
        };
        let found = |found: &Found| {
            found.guides.bytes() + size_of_val(&*found.coverage) + size_of_val(&*found.object)
        };
        let surfaces = |(_, surfaces): &(usize, Surfaces)| {
            let shares = surfaces.shares.as_ref().map_or(0, |(_, shares)| size_of_val(&**shares));
            surfaces.film.bytes() + surfaces.found.as_ref().map_or(0, found) + shares
        };
        self.units.iter().map(unit).chain(self.surfaces.iter().map(surfaces)).sum()
    }
}

impl Surfaces {
    /// Looks at the film anew where there are more paths.
    fn look(&mut self, (width, height): (usize, usize)) {
        let paths = self.film.paths();
        if self.found.as_ref().is_none_or(|found| found.paths < paths) {
            let guides = Guides::new(&self.film, width, height);
            let (coverage, object) = (self.film.coverage(), self.film.object_coverage());
            self.found = Some(Found { guides, paths, coverage, object });
        }
    }
}
