//! The model of a scene's light: a background of lobes or sky cells, a sun, lamps and known lights.
//! It also has the gloss of each material, because a fit uses both together.

use std::sync::Arc;

use faer::Mat;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::hemisphere::incoming;
use crate::reconstruct::joint::background::{Layout, LightSet, NEIGHBOURS, World};
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::part::{Part, PartKind};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::system::{Design, Rows};
use crate::reconstruct::joint::terms::Pair;
use crate::reconstruct::lights::{LightKind, VirtualLights};
use crate::reconstruct::lobes::Lobe;
use crate::scene::Gloss;
use crate::solve::kernels::{column_of, column_of_mut};
use crate::watch::Cancelled;

/// The light and the gloss that a fit may use.
#[derive(Clone, Debug)]
pub struct LightModel {
    pub parts: Vec<Part>,
    /// Exponent n of Eq. 12 per material; `None` where a material is diffuse.
    pub gloss: Vec<Option<Gloss>>,
    /// Ridge on the background's emissions, relative to their columns' norms.
    pub ridge: f64,
}

/// The number of cells for which the smoothness term between neighbouring cells is as strong as the
/// ridge on the lights of a background. The default spacing gives a sky of so many cells.
const CELLS: f64 = 35.0;
/// Ridge on the emission by which a lamp differs between directions, as a fraction of the ridge on
/// the background. It matters only in directions in which hardly any row lies: a lamp that is a
/// hundred times as bright there as one that provides all light costs as much as residuals of
/// 0.3 %. It was set with the random scenes coat-0, 1 and 5 in view, so low that it does not change
/// the results of rooms without noise.
const LAMP_RIDGE: f64 = 1e-7;

impl LightModel {
    /// A background with the known lights and the photographed sky; every material that is tagged
    /// as specular is glossy.
    pub fn new(problem: &Problem, layout: &Layout) -> Result<Self, Cancelled> {
        let exponent = problem.data.options.gloss.start_exponent;
        let gloss =
            |material| problem.is_tagged_specular(material).then_some(Gloss::Phong { exponent });
        let none = Self {
            parts: Vec::new(),
            gloss: (0..problem.materials()).map(gloss).collect(),
            ridge: problem.options().ridge,
        };
        // Of a sky the cells that photographs show are known.
        let seen = match layout.world {
            World::Room => Part::seen_sky(problem)?,
            World::Open => None,
        };
        let parts = Part::given(problem)?.into_iter().chain(seen);
        let model = parts.fold(none, |model, part| model.with(part));
        Ok(model.with(Part::background(problem, layout)?))
    }

    /// The model with another part.
    pub fn with(&self, part: Part) -> Self {
        let slot = self.parts.iter().map(|part| part.slot + 1).max().unwrap_or(0);
        let mut model = self.clone();
        model.parts.push(Part { slot, ..part });
        model
    }

    pub fn without(&self, slot: usize) -> Self {
        let mut model = self.clone();
        model.parts.retain(|part| part.slot != slot);
        model
    }

    /// The model with one part in place of another.
    pub fn replacing(&self, slot: usize, part: Part) -> Self {
        let mut model = self.clone();
        for own in model.parts.iter_mut().filter(|own| own.slot == slot) {
            *own = Part { slot, ..part.clone() };
        }
        model
    }

    pub fn with_gloss(&self, material: usize, gloss: Option<Gloss>) -> Self {
        let mut model = self.clone();
        model.gloss[material] = gloss;
        model
    }

    /// The same lights for the rows of another part of the problem. `rows` are those that the couplings
    /// are for now; what is known of them is not traced again.
    pub fn on(&self, problem: &Problem, rows: &Rows) -> Result<Self, Cancelled> {
        let parts = self.parts.iter().map(|part| part.on(problem, rows));
        Ok(Self { parts: parts.collect::<Result<_, _>>()?, ..self.clone() })
    }

    pub fn lamps(&self) -> usize {
        self.parts.iter().filter(|part| part.is_lamp()).count()
    }

    /// The part with a sun that was found.
    pub fn sun(&self) -> Option<&Part> {
        self.parts.iter().find(|part| matches!(part.kind, PartKind::Sun(_)))
    }

    /// The first background that has lights.
    pub fn background(&self) -> Option<&Part> {
        self.parts.iter().find(|part| part.is_background() && part.columns() > 0)
    }

    /// The layout of the first background.
    pub fn layout(&self) -> Option<&Layout> {
        self.parts.iter().find_map(|part| match &part.kind {
            PartKind::Background(layout) => Some(layout),
            _ => None,
        })
    }

    pub fn is_glossy(&self) -> bool {
        self.gloss.iter().any(Option::is_some)
    }

    pub fn columns(&self) -> usize {
        self.parts.iter().map(Part::columns).sum()
    }

    /// The columns of a part, by its slot.
    pub fn columns_of(&self, slot: usize) -> std::ops::Range<usize> {
        let place = self.parts.iter().position(|part| part.slot == slot);
        let place = place.unwrap_or(self.parts.len());
        let first = self.parts[..place].iter().map(Part::columns).sum();
        first..first + self.parts.get(place).map_or(0, Part::columns)
    }

    /// All lights, in the order of the columns.
    pub fn set(&self) -> LightSet {
        let mut set = LightSet::default();
        for part in &self.parts {
            if part.is_background() && set.lights.spacing_m == 0.0 {
                let lights = std::mem::take(&mut set.lights.lights);
                set.lights = VirtualLights { lights, ..part.set.lights.clone() };
            }
            set.append(&part.set);
        }
        set
    }

    /// Whether any light of the model is unknown.
    pub fn has_unknown_light(&self) -> bool {
        self.parts
            .iter()
            .any(|part| part.held.contains(&None) && !matches!(part.kind, PartKind::Given(_)))
    }

    /// The ridge of each column. It is on the directional lobes of lamps, and on the lights of
    /// backgrounds that have no smoothness term. It is not on known surfaces that emit light, which
    /// are few and have known positions.
    pub fn ridges(&self) -> Vec<f64> {
        let of_part = |part: &Part| -> Vec<f64> {
            let is_drawn = part.is_background() && part.neighbours.is_empty();
            let of_lobe = |lobe: &Lobe| {
                let on_surface = part.set.lights.lights[lobe.light].kind == LightKind::Surface;
                if is_drawn && !on_surface {
                    self.ridge
                } else if part.is_lamp() && lobe.exponent > 0.0 {
                    LAMP_RIDGE * self.ridge
                } else {
                    0.0
                }
            };
            part.set.lobes.lobes.iter().map(of_lobe).collect()
        };
        self.parts.iter().flat_map(of_part).collect()
    }

    /// Per column the one whose norm is the unit of its ridge: of a lamp's lobes that which sends the
    /// same in all directions.
    pub fn ridge_units(&self) -> Vec<usize> {
        let mut units = Vec::new();
        for part in &self.parts {
            let first = units.len();
            let unit = |column: usize| if part.is_lamp() { first } else { first + column };
            units.extend((0..part.columns()).map(unit));
        }
        units
    }

    /// Pairs of emissions with a smoothness term: those of neighbouring sky cells.
    pub fn pairs(&self) -> Vec<Pair> {
        let mut pairs = Vec::new();
        let mut first = 0;
        for part in &self.parts {
            let weight = self.ridge / (NEIGHBOURS as f64 * CELLS * CELLS);
            let pair = |columns: &[usize; 2]| Pair { columns: columns.map(|j| first + j), weight };
            pairs.extend(part.neighbours.iter().map(pair));
            first += part.columns();
        }
        pairs
    }

    pub fn centres(&self, channel: usize) -> Vec<f64> {
        self.parts.iter().flat_map(|part| &part.centre).map(|centre| centre[channel]).collect()
    }

    /// Emissions that are known, per column.
    pub fn held(&self, channel: usize) -> Vec<Option<f64>> {
        let held = self.parts.iter().flat_map(|part| &part.held);
        held.map(|held| held.map(|held| held[channel])).collect()
    }

    /// The emissions of a fit of a model with some of the same parts, in this one's columns.
    pub fn carry(&self, from: &Fitted, channel: usize) -> Vec<f64> {
        let emission = &from.channels[channel].state.emission;
        let of = |part: &Part| {
            let columns = from.model.columns_of(part.slot);
            if columns.len() == part.columns() {
                emission[columns].to_vec()
            } else {
                vec![0.0; part.columns()]
            }
        };
        self.parts.iter().flat_map(of).collect()
    }

    /// Per column the column of a fit's model with the same coupling, if there is one.
    pub fn columns_in(&self, fitted: &Fitted) -> Vec<Option<usize>> {
        let of = |part: &Part| -> Vec<Option<usize>> {
            match fitted.columns_of_same(part) {
                Some(columns) => columns.map(Some).collect(),
                None => vec![None; part.columns()],
            }
        };
        self.parts.iter().flat_map(of).collect()
    }

    /// How the light reaches the rows. `earlier` is a fit to the same rows: what it has found of the same
    /// lights and lobes is taken from there.
    pub fn design(&self, problem: &Problem, earlier: Option<&Fitted>) -> Design {
        let alike = earlier.filter(|fitted| self.has_the_lights_of(&fitted.model));
        let diffuse = match alike {
            Some(fitted) => fitted.design.diffuse.clone(),
            None => Arc::new(self.coupling(problem.rows.sample.len())),
        };
        let base = |c: usize| -> Vec<f64> {
            let of = |&sample: &usize| f64::from(problem.surface_light.irradiance[sample][c]);
            problem.rows.sample.iter().map(of).collect()
        };
        let base = [base(0), base(1), base(2)];
        let patches = problem.surface_light.patches.clone();
        let is_same = |f: &&Fitted| f.model.gloss == self.gloss && f.design.has_patches(&patches);
        let (specular, specular_base) = match alike.filter(is_same) {
            Some(fitted) => (fitted.design.specular.clone(), fitted.design.specular_base.clone()),
            None => {
                let (specular, base) = self.specular(problem, &diffuse, earlier);
                (Arc::new(specular), base)
            }
        };
        Design { diffuse, base, specular, specular_base, patches }
    }

    /// Whether the columns are those of another model.
    fn has_the_lights_of(&self, other: &Self) -> bool {
        let is_same = |(own, other): (&Part, &Part)| Arc::ptr_eq(&own.coupling, &other.coupling);
        self.parts.len() == other.parts.len() && self.parts.iter().zip(&other.parts).all(is_same)
    }

    /// k_ij of all parts, rows × columns.
    fn coupling(&self, rows: usize) -> Mat<f32> {
        let mut coupling = Mat::zeros(rows, self.columns());
        let mut next = 0;
        for part in &self.parts {
            for column in 0..part.columns() {
                let own = column_of((*part.coupling).as_ref(), column);
                column_of_mut(&mut coupling, next).copy_from_slice(own);
                next += 1;
            }
        }
        coupling
    }

    /// π f/ρ_s times the coupling, glossy rows × columns, and the same of the light of known surfaces, per
    /// channel and glossy row. Zero for materials that are diffuse here. `earlier` is of the same rows.
    fn specular(
        &self,
        problem: &Problem,
        diffuse: &Mat<f32>,
        earlier: Option<&Fitted>,
    ) -> (Mat<f32>, [Vec<f64>; CHANNELS]) {
        let glossy = |row: &usize| problem.rows.glossy[*row].is_some();
        let rows: Vec<usize> = (0..problem.rows.sample.len()).filter(glossy).collect();
        let viewing = |place: usize| problem.data.equations.glossy[problem.glossy[place]].viewing;
        // Per row its lobe, and the earlier fit where it had the same.
        let lobe = |&row: &usize| {
            let material = problem.rows.material[row];
            let gloss = self.gloss[material];
            gloss.map(|gloss| (gloss, earlier.filter(|f| f.model.gloss[material] == Some(gloss))))
        };
        type Shape<'f> = Option<(Gloss, Option<&'f Fitted>)>;
        let lobes: Vec<Shape> = rows.iter().map(lobe).collect();
        let patches = &problem.surface_light.patches;
        let records = |(place, lobe): (usize, &Shape)| -> Rgb {
            match *lobe {
                None => [0.0; CHANNELS],
                Some((_, Some(earlier))) if earlier.design.has_patches(patches) => {
                    std::array::from_fn(|c| earlier.design.specular_base[c][place])
                }
                Some((gloss, _)) => {
                    let sample = problem.rows.sample[rows[place]];
                    let records = problem.surface_light.records(problem.data.transport, sample);
                    incoming(records).reflected(viewing(place), gloss)
                }
            }
        };
        let records: Vec<Rgb> = lobes.par_iter().enumerate().map(records).collect();
        let mut specular = Mat::zeros(rows.len(), self.columns());
        let mut first = 0;
        for part in &self.parts {
            let before = earlier.and_then(|fitted| fitted.columns_of_same(part));
            // Of every light, where it is not known by the earlier fit.
            let of_row = |(place, lobe): (usize, &Shape)| {
                let (gloss, earlier) = (*lobe)?;
                if before.is_some() && earlier.is_some() {
                    return None;
                }
                let (position, viewing) =
                    (problem.surface_point(rows[place]).position, viewing(place));
                let lights = part.set.lights.lights.iter();
                Some(lights.map(|light| light.lobe(position, viewing, gloss)).collect())
            };
            let found: Vec<Option<Vec<f64>>> = lobes.par_iter().enumerate().map(of_row).collect();
            for (offset, shape) in part.set.lobes.lobes.iter().enumerate() {
                let known = before
                    .as_ref()
                    .zip(earlier)
                    .map(|(columns, earlier)| earlier.design.specular_of(columns.start + offset));
                let diffuse = column_of(diffuse.as_ref(), first + offset);
                let out = column_of_mut(&mut specular, first + offset);
                for (place, out) in out.iter_mut().enumerate() {
                    *out = match (&found[place], &lobes[place], known) {
                        (Some(found), ..) => found[shape.light] as f32 * diffuse[rows[place]],
                        (None, Some(_), Some(known)) => known[place],
                        _ => 0.0,
                    };
                }
            }
            first += part.columns();
        }
        (specular, std::array::from_fn(|c| records.iter().map(|rgb| rgb[c]).collect()))
    }
}
