//! One part of a light model: its lights, and their coupling to the rows of a problem.

use std::sync::Arc;

use faer::Mat;
use glam::Vec3;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::joint::background::{Layout, LightSet};
use crate::reconstruct::joint::lamps::Lamp;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::system::Rows;
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::scene::{Emitter, KnownLight};
use crate::watch::Cancelled;

/// One part of a light model, with how it reaches the rows of a problem.
#[derive(Clone, Debug)]
pub struct Part {
    /// Identifies the part within one model; a part that is moved keeps it.
    pub slot: usize,
    pub kind: PartKind,
    pub set: Arc<LightSet>,
    /// k_ij, rows × lobes of `set`, in sr.
    pub coupling: Arc<Mat<f32>>,
    /// Prior mean of each lobe's emission, per channel.
    pub centre: Vec<Rgb>,
    /// Pairs of neighbouring sky cells, whose emissions have a smoothness term, because a sky is
    /// bright everywhere. A room is dark except for its lamps, and where a light probe is given it
    /// determines the brightness of the sky. A pair is listed twice if each is among the nearest of
    /// the other.
    pub neighbours: Arc<Vec<[usize; 2]>>,
    /// Per lobe its emission where that is known.
    pub held: Vec<Option<Rgb>>,
    /// Its channels' emissions are this times one strength, which is not known.
    pub colour: Option<Rgb>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PartKind {
    Background(Layout),
    /// A known light, by its index among those of the capture.
    Given(usize),
    /// Cells of the sky that photographs show.
    SeenSky,
    /// Unit direction towards a sun that was found.
    Sun(Vec3),
    Lamp(Lamp),
}

/// Half the angle that the sun subtends, in radians.
const SUN_HALF_ANGLE: f32 = 0.5 * Emitter::SUN_DIAMETER;

impl Part {
    fn new(problem: &Problem, kind: PartKind, set: LightSet) -> Result<Self, Cancelled> {
        let coupling = Arc::new(problem.couple(&set)?);
        let centre = vec![[0.0; CHANNELS]; set.lobes.lobes.len()];
        let neighbours = Arc::default();
        let held = vec![None; centre.len()];
        let set = Arc::new(set);
        Ok(Self { slot: 0, kind, set, coupling, centre, neighbours, held, colour: None })
    }

    /// Lights beyond the known geometry, laid out so.
    pub fn background(problem: &Problem, layout: &Layout) -> Result<Self, Cancelled> {
        let (set, known) = layout.place(problem)?;
        let mut part = Self::new(problem, PartKind::Background(*layout), set)?;
        part.held = known;
        // A light probe says what the sky is likely to send.
        for light in &problem.capture().lights {
            let KnownLight::Dome { dome, .. } = light else { continue };
            for (centre, lobe) in part.centre.iter_mut().zip(&part.set.lobes.lobes) {
                let light = &part.set.lights.lights[lobe.light];
                if light.kind == LightKind::Sky {
                    let radiance = dome.mean_radiance(-light.normal, light.half_angle);
                    for (centre, value) in centre.iter_mut().zip(radiance) {
                        *centre += f64::from(value);
                    }
                }
            }
        }
        if part.centre.iter().flatten().all(|&centre| centre == 0.0) {
            part.neighbours = Arc::new(part.set.neighbours());
        }
        Ok(part)
    }

    /// Lights with this layout for a model that already has a background. The photographed sky and
    /// the prior from a light probe are in that background.
    pub fn beside(problem: &Problem, layout: &Layout) -> Result<Self, Cancelled> {
        let (set, known) = layout.place(problem)?;
        let set = set.selected(|lobe| known[lobe].is_none());
        let part = Self::new(problem, PartKind::Background(*layout), set)?;
        let neighbours = Arc::new(part.set.neighbours());
        Ok(Self { neighbours, ..part })
    }

    pub fn lamp(problem: &Problem, lamp: Lamp) -> Result<Self, Cancelled> {
        Self::new(problem, PartKind::Lamp(lamp), lamp.set())
    }

    /// `towards` is the unit direction towards the sun.
    pub fn sun(problem: &Problem, towards: Vec3) -> Result<Self, Cancelled> {
        let mut set = LightSet::default();
        let sun = VirtualLight::distant(LightKind::Sun, -towards, SUN_HALF_ANGLE);
        set.push(sun, &[(-towards, 0.0)]);
        Self::new(problem, PartKind::Sun(towards), set)
    }

    /// The sky that photographs show, if the problem has one.
    pub fn seen_sky(problem: &Problem) -> Result<Option<Self>, Cancelled> {
        let Some(sky) = &problem.sky else { return Ok(None) };
        let part = Self::new(problem, PartKind::SeenSky, sky.set())?;
        Ok(Some(Self { held: sky.radiance.iter().copied().map(Some).collect(), ..part }))
    }

    /// The known lights of the capture.
    pub fn given(problem: &Problem) -> Result<Vec<Self>, Cancelled> {
        let mut parts = Vec::new();
        for (index, light) in problem.capture().lights.iter().enumerate() {
            let KnownLight::Shape { emitter, emission, color, .. } = light else { continue };
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
            let mut set = LightSet::default();
            set.push(light, &[(axis, 0.0)]);
            let part = Self::new(problem, PartKind::Given(index), set)?;
            let colour = color.filter(|_| emission.is_none());
            parts.push(Self { held: vec![*emission], colour, ..part });
        }
        Ok(parts)
    }

    /// The same lights for the rows of another part of the problem. `rows` are those that the coupling is
    /// for now; what is known of them is not traced again.
    pub fn on(&self, problem: &Problem, rows: &Rows) -> Result<Self, Cancelled> {
        let coupling = problem.couple_beyond(&self.set, rows, &self.coupling)?;
        Ok(Self { coupling: Arc::new(coupling), ..self.clone() })
    }

    pub fn columns(&self) -> usize {
        self.set.lobes.lobes.len()
    }

    pub fn is_background(&self) -> bool {
        matches!(self.kind, PartKind::Background(_))
    }

    pub fn is_lamp(&self) -> bool {
        matches!(self.kind, PartKind::Lamp(_))
    }
}
