//! Progressive rendering of a scene while it is edited: a noisy picture appears within a moment and
//! becomes cleaner. It is kept as [layers](super::layers), one for each light. Layers that an edit
//! does not affect are not traced again.

use std::sync::Arc;

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance};
use crate::render::added::Added;
use crate::render::composite::{Mix, seen_by};
use crate::render::edits::Edits;
use crate::render::groups::{self, Group};
use crate::render::layers::{Source, most_layers, sources};
use crate::render::lights::{IrradianceGrid, Recovered, Use};
use crate::render::path::Sought;
use crate::render::scene::{Geometry, Scene, Shell, Solved};
use crate::render::tracer::{Processor, Tracer};
use crate::render::view::View;
use crate::render::{Pass, RenderOptions};
use crate::scene::{Camera, Image, Views};
use crate::watch::{Cancelled, Watch};

pub use crate::render::asked::{Asked, Picture};

/// Paths per pixel at which a picture is shown; between them it would hardly change.
const SHOWN: [usize; 7] = [4, 8, 16, 32, 64, 128, 256];
/// The same on the coarsest steps: as few as tell the noise.
const COARSE: usize = 2;
/// The same for lights that are off, so that they can be turned on at once.
const UNLIT: usize = 16;
/// Pixels of the finest picture; larger ones would take minutes, and memory.
const MOST_PIXELS: usize = 1 << 20;
/// The most memory that the films and pictures of a view take.
pub const MOST_BYTES: usize = 512 << 20;
/// Lights are traced together whose part of the error is at least this part of the largest.
const JOINED: f64 = 0.25;

/// Paths that are to be traced next.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Of the scene without edits.
    is_bare: bool,
    units: Vec<usize>,
    /// Pixels along a side of one of the picture's.
    step: usize,
    upto: usize,
    /// Before it there is no picture to show.
    pub is_first: bool,
}

/// A recovered scene with its layers.
pub struct Preview<'a> {
    tracer: Arc<dyn Tracer>,
    views: &'a Views<'a>,
    solved: &'a Solved,
    groups: Vec<Group>,
    grid: Arc<IrradianceGrid>,
    bare_geometry: Arc<Geometry>,
    asked: Option<Asked>,
    /// The scene with its edits.
    view: View,
    /// The scene without, where objects or materials are edited: else it is in the same layers.
    bare: Option<View>,
    /// Per added light when it was changed last, in requests.
    touched: Vec<u64>,
    requests: u64,
    traced: u64,
    /// The recovered lights as they were sampled last.
    recovered: Option<(Vec<Use>, Arc<Recovered>)>,
    /// What the films and pictures of a view may take.
    pub most_bytes: usize,
    /// The photograph as the view's camera would have taken it, with its index and the step.
    photograph: Option<(usize, usize, Camera, Arc<Image>)>,
}

impl<'a> Preview<'a> {
    /// Traced by this processor.
    pub fn new(views: &'a Views<'a>, solved: &'a Solved) -> Self {
        Self::by(Arc::new(Processor), views, solved)
    }

    pub fn by(tracer: Arc<dyn Tracer>, views: &'a Views<'a>, solved: &'a Solved) -> Self {
        let bare_geometry = Arc::new(Geometry::new(views.capture, solved, &Edits::default()));
        Self {
            tracer,
            views,
            solved,
            groups: groups::groups(views.capture, solved),
            grid: Arc::new(IrradianceGrid::new(views, solved)),
            view: View::empty(bare_geometry.clone()),
            bare_geometry,
            asked: None,
            bare: None,
            touched: Vec::new(),
            requests: 0,
            traced: 0,
            recovered: None,
            most_bytes: MOST_BYTES,
            photograph: None,
        }
    }

    /// Takes another request; layers that are still of use stay.
    pub fn ask(&mut self, asked: Asked) {
        let capture = self.views.capture;
        let before = self.asked.take().map_or_else(Arc::default, |asked| asked.edits);
        self.requests += 1;
        self.traced = 0;
        let edits = &asked.edits;
        // Compared one by one: after one was taken away, those behind it count as touched.
        self.touched.resize(edits.lights.len(), self.requests);
        for ((now, before), touched) in
            edits.lights.iter().zip(&before.lights).zip(&mut self.touched)
        {
            if (&now.shape, now.sent()) != (&before.shape, before.sent()) {
                *touched = self.requests;
            }
        }
        let finest = (1..)
            .find(|step| {
                asked.camera.width.div_ceil(*step) * asked.camera.height.div_ceil(*step)
                    <= MOST_PIXELS
            })
            .unwrap_or(1);
        let camera = asked.camera.reduced(finest);
        let is_same_stage = edits.objects == before.objects && edits.materials == before.materials;
        if self.view.camera != Some(camera) || !is_same_stage {
            let geometry = if edits.objects.is_empty() {
                self.bare_geometry.clone()
            } else if edits.objects == before.objects {
                self.view.geometry.clone()
            } else {
                Arc::new(Geometry::new(capture, self.solved, edits))
            };
            if self.view.camera != Some(camera) {
                self.bare = None;
            }
            self.view = View::new(camera, geometry);
        }
        let pixels = (camera.width * camera.height).max(1);
        let is_changed = !(edits.objects.is_empty() && edits.materials.is_empty());
        let is_compared = asked.before || asked.photograph.is_some();
        let most = most_layers(self.most_bytes / pixels, is_changed && is_compared);
        let all = sources(edits, &self.groups, &self.touched, most);
        let places = [camera.position.as_vec3()];
        let shell = Shell::around(capture, self.solved, &self.view.geometry, edits, &places);
        self.view.keep(all, shell);

        let is_folded = match &self.view.units[0].source {
            Source::Recovered { folded, .. } => !folded.is_empty(),
            _ => false,
        };
        if !is_compared || !is_changed && !is_folded {
            self.bare = None;
        } else if self.bare.is_none() {
            let mut bare = View::new(camera, self.bare_geometry.clone());
            let own = Source::Recovered { own: Vec::new(), folded: Default::default() };
            bare.keep(vec![own], None);
            self.bare = Some(bare);
        }
        self.asked = Some(asked);
    }

    /// What the layers of each unit are multiplied by.
    fn weights(&self, edits: &Edits) -> Vec<Vec<Radiance>> {
        self.view.units.iter().map(|unit| unit.source.weights(edits)).collect()
    }

    /// Whether each unit is seen.
    fn lit(&self, asked: &Asked, weights: &[Vec<Radiance>]) -> Vec<bool> {
        let is_lit = |weights: &Vec<Radiance>| weights.iter().flatten().any(|&value| value != 0.0);
        let mut lit: Vec<bool> = weights.iter().map(is_lit).collect();
        // It is all of the picture before.
        lit[0] |= asked.before || asked.photograph.is_some();
        lit
    }

    /// The next tracing step; `None` when all is done.
    pub fn plan(&self) -> Option<Plan> {
        let asked = self.asked.as_ref()?;
        let weights = self.weights(&asked.edits);
        let lit = self.lit(asked, &weights);
        let of = |is_lit: bool| (0..lit.len()).filter(|&k| lit[k] == is_lit).collect::<Vec<_>>();
        let last = SHOWN[SHOWN.len() - 1];
        let first = self.coarser(&of(true), self.view.steps.first().copied());
        first
            .or_else(|| self.bare_plan())
            .or_else(|| self.coarser(&of(true), None))
            .or_else(|| self.finer(&of(true), &weights, last))
            .or_else(|| self.coarser(&of(false), None))
            .or_else(|| self.finer(&of(false), &weights, UNLIT))
    }

    /// Paths per pixel of a step when it is first shown.
    fn first_paths(&self, step: usize) -> usize {
        let finer = self.view.steps.iter().filter(|&&of| of < step).count();
        match finer {
            0 => self.next_paths(step, 0).unwrap_or(SHOWN[0]),
            1 => SHOWN[0],
            _ => COARSE,
        }
    }

    /// Paths per pixel at which a step with so many is shown next. A fast tracer passes over numbers
    /// of paths between: to take out the noise of every picture would take longer than the paths.
    fn next_paths(&self, step: usize, paths: usize) -> Option<usize> {
        let camera = self.view.camera?.reduced(step);
        let most = paths + self.tracer.paths_at_once(camera.width * camera.height);
        let more = || SHOWN.iter().copied().filter(|&shown| shown > paths);
        more().take_while(|&shown| shown <= most).last().or_else(|| more().next())
    }

    /// The coarsest of some units to the next step; of `only` a step alone.
    fn coarser(&self, units: &[usize], only: Option<usize>) -> Option<Plan> {
        let next = |&unit: &usize| self.view.next_step(unit).map(|step| (step, unit));
        let all: Vec<(usize, usize)> = units.iter().filter_map(next).collect();
        let step = all.iter().map(|(step, _)| *step).max()?;
        if only.is_some_and(|only| only != step) {
            return None;
        }
        let mut units = all.iter().filter(|(of, _)| *of == step).map(|(_, unit)| *unit);
        let leader = units.next()?;
        let strips =
            |unit: usize| self.view.units[unit].next.as_ref().map(|film| film.strips().to_vec());
        let same = strips(leader);
        let units = std::iter::once(leader).chain(units.filter(|&unit| strips(unit) == same));
        let is_first = step == self.view.steps[0];
        let upto = self.first_paths(step);
        Some(Plan { is_bare: false, units: units.collect(), step, upto, is_first })
    }

    /// The scene without edits as far as the recovered light with them: their difference has least
    /// noise where both have the same number of paths.
    fn bare_plan(&self) -> Option<Plan> {
        let bare = self.bare.as_ref()?;
        let leader = &self.view.units[0];
        let own = &bare.units[0];
        let (step, paths) = (leader.step?, leader.film.paths());
        let is_there = own.step.is_some_and(|own| own <= step);
        let (step, upto) = match (is_there, bare.next_step(0)) {
            (false, Some(next)) => (next, self.first_paths(next)),
            _ if own.step == Some(step) && own.film.paths() < paths => {
                let next = self.next_paths(step, own.film.paths());
                (step, next.unwrap_or(paths).min(paths))
            }
            _ => return None,
        };
        let is_first = own.step.is_none();
        Some(Plan { is_bare: true, units: vec![0], step, upto, is_first })
    }

    /// More paths for the units that most of the error is of, on the finest step.
    fn finer(&self, units: &[usize], weights: &[Vec<Radiance>], last: usize) -> Option<Plan> {
        let films = units.iter().map(|&unit| (unit, &self.view.units[unit].film));
        let open: Vec<usize> =
            films.filter(|(_, film)| film.paths() < last).map(|(unit, _)| unit).collect();
        // Per path what doubling the paths takes from the squared error.
        let gain = |&unit: &usize| {
            let film = &self.view.units[unit].film;
            (unit, film.squared_error(&weights[unit]) / film.paths().max(1) as f64)
        };
        let gains: Vec<(usize, f64)> = open.par_iter().map(gain).collect();
        let &(leader, most) =
            gains.iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))?;
        let same = self.view.units[leader].film.strips();
        let joined = |&(unit, gain): &(usize, f64)| {
            (gain >= JOINED * most && self.view.units[unit].film.strips() == same).then_some(unit)
        };
        let units: Vec<usize> = gains.iter().filter_map(joined).collect();
        let paths = self.view.units[leader].film.paths();
        let step = *self.view.steps.last()?;
        let upto = self.next_paths(step, paths)?.min(last);
        Some(Plan { is_bare: false, units, step, upto, is_first: false })
    }

    /// Traces the planned step. When it is cancelled, the paths that were traced are kept.
    pub fn trace(&mut self, plan: &Plan, watch: &Watch) -> Result<(), Cancelled> {
        let Some(asked) = self.asked.clone() else { return Ok(()) };
        let weights = self.weights(&asked.edits);
        let bare_edits = Edits::default();
        let edits = if plan.is_bare { &bare_edits } else { &*asked.edits };
        let recovered_unit = plan.units.contains(&0);
        let source = match &self.bare {
            Some(bare) if plan.is_bare => &bare.units[0].source,
            _ => &self.view.units[0].source,
        };
        let (recovered_layers, recovered) = if recovered_unit {
            let plain = vec![[1.0; CHANNELS]];
            let weights = if plan.is_bare { &plain } else { &weights[0] };
            let count = self.solved.light.lights.lights.len();
            let uses = source.uses(&self.groups, weights, count);
            (source.layers(), self.recovered(uses))
        } else {
            (0, self.recovered(Vec::new()))
        };
        let view = match &mut self.bare {
            Some(bare) if plan.is_bare => bare,
            _ => &mut self.view,
        };
        let Some(camera) = view.camera.map(|camera| camera.reduced(plan.step)) else {
            return Ok(());
        };
        let mut added: Vec<Arc<Added>> = Vec::new();
        let (mut layer_of_added, mut layers) = (Vec::new(), recovered_layers);
        let mut ranges = Vec::new();
        for &index in &plan.units {
            let unit = &mut view.units[index];
            if index == 0 {
                ranges.push(0..recovered_layers);
                continue;
            }
            for light in unit.lights() {
                added.push(light.clone());
                layer_of_added.push(layers);
            }
            ranges.push(layers..layers + 1);
            layers += 1;
        }
        let geometry = view.geometry.clone();
        let places = [camera.position.as_vec3()];
        let mut scene =
            Scene::lit_by(recovered, added, self.views, &geometry, self.solved, edits, &places);
        (scene.layer_of_added, scene.layers, scene.original_light) = (layer_of_added, layers, 1.0);
        let sought = Sought { recovered: recovered_unit, ..scene.all_lights() };
        let options = RenderOptions::default();
        let pass = Pass {
            scene: &scene,
            camera: &camera,
            options: &options,
            sought: &sought,
            upto: plan.upto,
        };
        let tracer = self.tracer.clone();
        let (traced, ended) = view.trace(&*tracer, &pass, plan.step, &plan.units, &ranges, watch);
        self.traced += traced;
        ended
    }

    /// The recovered lights as `uses` says; those of last time where it says nothing.
    fn recovered(&mut self, uses: Vec<Use>) -> Arc<Recovered> {
        if let Some((of, recovered)) = &self.recovered
            && (uses.is_empty() || *of == uses)
        {
            return recovered.clone();
        }
        let capture = self.views.capture;
        let count = self.solved.light.lights.lights.len();
        let plain = Use { factor: 1.0, layer: 0, importance: 1.0 };
        let uses = if uses.is_empty() { vec![plain; count] } else { uses };
        let recovered = Arc::new(Recovered::used(self.grid.clone(), capture, self.solved, &uses));
        self.recovered = Some((uses, recovered.clone()));
        recovered
    }

    /// The picture as far as it is there; `None` while a light that is on has no layer at all.
    pub fn picture(&mut self) -> Option<Picture> {
        let asked = self.asked.clone()?;
        let weights = self.weights(&asked.edits);
        let lit = self.lit(&asked, &weights);
        let step = self.view.shown?;
        let camera = self.view.camera?.reduced(step);
        let lit_units = || self.view.units.iter().zip(&lit).filter(|(_, lit)| **lit);
        if lit_units().any(|(unit, _)| unit.clear.is_empty()) {
            return None;
        }
        let paths = lit_units().map(|(unit, _)| unit.shown_paths).min();
        let paths = paths.unwrap_or(SHOWN[SHOWN.len() - 1]);
        let photograph = asked.photograph.and_then(|index| self.photograph(index, step, camera));
        let wants_before = asked.before || photograph.is_some();
        // Layers of the picture after and of that before, with their weights.
        let mut after = Vec::new();
        for (unit, weights) in self.view.units.iter().zip(&weights) {
            after.extend(unit.clear.iter().zip(weights.iter().copied()));
        }
        after.retain(|(_, weight)| weight.iter().any(|&value| value != 0.0));
        let bare = match &self.bare {
            Some(bare) if wants_before && bare.shown != Some(step) => return None,
            Some(bare) => &bare.units[0],
            None => &self.view.units[0],
        };
        let before: Vec<(&Vec<Radiance>, Radiance)> =
            bare.clear.iter().map(|layer| (layer, [1.0; CHANNELS])).collect();
        let surfaces = self.view.surfaces(step)?;
        let mix = Mix {
            after,
            before: wants_before.then_some(before),
            coverage: &surfaces.coverage,
            object: &surfaces.object,
            shows_sky: self.solved.shows_sky(),
            photograph: photograph.as_deref(),
            light: asked.edits.original_light as f32,
        };
        let (result, former) = mix.pictures(camera.width, asked.before);
        Some(Picture {
            width: camera.width,
            height: camera.height,
            after: result,
            before: asked.before.then_some(former),
            paths,
            is_done: paths >= SHOWN[SHOWN.len() - 1],
            traced: self.traced,
            tracer: self.tracer.name(),
        })
    }
}

impl Preview<'_> {
    /// What its films and pictures take.
    pub fn bytes(&self) -> usize {
        self.view.bytes() + self.bare.as_ref().map_or(0, View::bytes)
    }

    /// A photograph as the view's camera would have taken it.
    fn photograph(&mut self, index: usize, step: usize, camera: Camera) -> Option<Arc<Image>> {
        let photograph = self.views.capture.photographs.get(index)?;
        let known = self.photograph.take();
        let known = known.filter(|(i, s, c, _)| (*i, *s, *c) == (index, step, camera));
        let new = || (index, step, camera, Arc::new(seen_by(&camera, photograph)));
        let (_, _, _, image) = self.photograph.insert(known.unwrap_or_else(new));
        Some(image.clone())
    }
}
