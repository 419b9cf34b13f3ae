//! The numbers of an adjustment and which of them are unknown.

use glam::{DMat3, DVec2, DVec3};

use super::jet::{Jet, Jet3};
use super::things::{self, Kind, Parameter};
use super::{Model, Optic, Place, Pose, Similarity, Stroke};

/// The values of everything.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// By lens.
    pub lenses: Vec<Optic>,
    /// By photograph; `None` where it is not placed.
    pub poses: Vec<Option<Pose>>,
    /// The parameters of every thing ([`things::parameters`]); `None` where it is not placed.
    pub things: Vec<Option<Vec<f64>>>,
    /// By point; `None` where it is not placed.
    pub points: Vec<Option<DVec3>>,
    /// By stroke: the angle about a cylinder's axis at which a rim was picked, in radians. Zero
    /// for other strokes.
    pub angles: Vec<f64>,
    /// From the coordinates of the photographs that an engine placed to the world.
    pub found: Similarity,
    /// Which numbers of that are kept, since nothing tells them: the scale, the turns about the
    /// axes of the world, the shift.
    pub kept: [bool; 7],
}

/// Whose number an unknown is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Owner {
    /// Of a lens, by index.
    Lens(usize),
    /// Of a camera.
    Photograph(usize),
    /// Of a thing.
    Thing(usize),
    /// Of a point.
    Point(usize),
    /// The angle of a rim's pick.
    Stroke(usize),
    /// Where all that an engine placed lies in the world.
    Found,
}

/// One unknown: parameter `part` of its owner.
///
/// Parts of a lens are focal length, principal point (x, y), k1, k2; of a photograph the turn
/// about its three axes and its position; of a thing its parameters; of a point its coordinates;
/// of what was found the logarithm of the scale, the turn about the world's axes and the shift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unknown {
    /// Whose it is.
    pub owner: Owner,
    /// Which of its numbers.
    pub part: usize,
}

/// Which numbers are unknown, in the order of the columns of the Jacobian.
#[derive(Clone, Debug, Default)]
pub struct Unknowns {
    /// By column.
    pub list: Vec<Unknown>,
    lenses: Vec<[Option<usize>; 5]>,
    poses: Vec<Option<usize>>,
    things: Vec<Vec<Option<usize>>>,
    points: Vec<Option<usize>>,
    angles: Vec<Option<usize>>,
    found: [Option<usize>; 7],
    parameters: Vec<Vec<Parameter>>,
}

impl Unknowns {
    /// The unknowns of what is placed in `state`.
    pub fn of(model: &Model, state: &State) -> Self {
        let mut all = Self {
            parameters: model.things.iter().map(things::parameters).collect(),
            ..Self::default()
        };
        for (index, lens) in model.lenses.iter().enumerate() {
            let is_used = model
                .photographs
                .iter()
                .zip(&state.poses)
                .any(|(photograph, pose)| photograph.lens == index && pose.is_some());
            let free = lens.fit.parts();
            let columns =
                std::array::from_fn(|k| all.add(Owner::Lens(index), k, is_used && free[k]));
            all.lenses.push(columns);
        }
        for (index, pose) in state.poses.iter().enumerate() {
            let first = all.list.len();
            for k in 0..6 {
                all.add(Owner::Photograph(index), k, pose.is_some());
            }
            all.poses.push(pose.map(|_| first));
        }
        for (index, values) in state.things.iter().enumerate() {
            let held = &model.things[index].held;
            let names = all.parameters[index].clone();
            let is_free = |name: &str| values.is_some() && !held.iter().any(|(own, _)| own == name);
            let columns = names.iter().enumerate();
            let columns = columns
                .map(|(k, own)| all.add(Owner::Thing(index), k, is_free(&own.name)))
                .collect();
            all.things.push(columns);
        }
        for (index, point) in state.points.iter().enumerate() {
            let first = all.list.len();
            for k in 0..3 {
                all.add(Owner::Point(index), k, point.is_some());
            }
            all.points.push(point.map(|_| first));
        }
        for (index, stroke) in model.strokes.iter().enumerate() {
            let is_free = matches!(stroke, Stroke::Rim { .. }) && state.is_placed(stroke);
            let column = all.add(Owner::Stroke(index), 0, is_free);
            all.angles.push(column);
        }
        let mut placed = model.photographs.iter().zip(&state.poses);
        let is_used = placed.any(|(own, pose)| own.found.is_some() && pose.is_some());
        all.found = std::array::from_fn(|k| all.add(Owner::Found, k, is_used && !state.kept[k]));
        all
    }

    /// None: all is as it is in a state.
    pub fn none(model: &Model, state: &State) -> Self {
        Self {
            parameters: model.things.iter().map(things::parameters).collect(),
            lenses: vec![[None; 5]; state.lenses.len()],
            poses: vec![None; state.poses.len()],
            things: state
                .things
                .iter()
                .map(|own| vec![None; own.iter().flatten().count()])
                .collect(),
            points: vec![None; state.points.len()],
            angles: vec![None; state.angles.len()],
            ..Self::default()
        }
    }

    /// The parameters of one placed thing that are not held.
    pub fn of_thing(model: &Model, state: &State, thing: usize) -> Self {
        let mut all = Self::none(model, state);
        let held = &model.things[thing].held;
        for part in 0..all.things[thing].len() {
            let name = &all.parameters[thing][part].name;
            let is_free = !held.iter().any(|(own, _)| own == name);
            all.things[thing][part] = all.add(Owner::Thing(thing), part, is_free);
        }
        all
    }

    fn add(&mut self, owner: Owner, part: usize, is_unknown: bool) -> Option<usize> {
        is_unknown.then(|| {
            self.list.push(Unknown { owner, part });
            self.list.len() - 1
        })
    }

    /// The columns of a lens.
    pub fn lens(&self, index: usize) -> [Option<usize>; 5] {
        self.lenses[index]
    }

    /// The first of the six columns of a placed photograph.
    pub fn pose(&self, photograph: usize) -> Option<usize> {
        self.poses[photograph]
    }

    /// The column of a rim's angle.
    pub fn angle(&self, stroke: usize) -> Option<usize> {
        self.angles[stroke]
    }

    /// The columns of what an engine found: scale, turn, shift.
    pub fn found(&self) -> [Option<usize>; 7] {
        self.found
    }

    /// What the parameter of a thing measures.
    pub fn kind(&self, thing: usize, part: usize) -> Kind {
        self.parameters[thing][part].kind
    }

    /// The name of a thing's parameter.
    pub fn parameter_name(&self, thing: usize, part: usize) -> &str {
        &self.parameters[thing][part].name
    }

    /// Every thing's parameters as numbers with derivatives; of things that are not placed none.
    pub fn jets(&self, state: &State) -> Vec<Vec<Jet>> {
        let jet = |(&value, column): (&f64, &Option<usize>)| match column {
            Some(column) => Jet::unknown(value, *column),
            None => Jet::constant(value),
        };
        let jets = |(values, columns): (&Option<Vec<f64>>, &Vec<Option<usize>>)| {
            values.iter().flatten().zip(columns).map(jet).collect()
        };
        state.things.iter().zip(&self.things).map(jets).collect()
    }

    /// A point with its derivatives; `None` where it is not placed.
    pub fn point(&self, state: &State, index: usize) -> Option<Jet3> {
        let value = state.points[index]?;
        Some(std::array::from_fn(|k| match self.points[index] {
            Some(first) => Jet::unknown(value[k], first + k),
            None => Jet::constant(value[k]),
        }))
    }

    /// The state after a step of the unknowns. Turns are about the cameras' own axes.
    pub fn moved(&self, state: &State, step: &[f64]) -> State {
        let mut new = state.clone();
        for (lens, columns) in new.lenses.iter_mut().zip(&self.lenses) {
            let change = columns.map(|column| column.map_or(0.0, |column| step[column]));
            lens.focal_px += change[0];
            lens.principal_px += DVec2::new(change[1], change[2]);
            lens.radial += DVec2::new(change[3], change[4]);
        }
        for (pose, first) in new.poses.iter_mut().zip(&self.poses) {
            if let (Some(pose), Some(first)) = (pose, first) {
                let part = |at: usize| DVec3::from_slice(&step[at..at + 3]);
                *pose = pose.moved(part(*first), part(first + 3));
            }
        }
        for (values, columns) in new.things.iter_mut().zip(&self.things) {
            for (value, column) in values.iter_mut().flatten().zip(columns) {
                *value += column.map_or(0.0, |column| step[column]);
            }
        }
        for (point, first) in new.points.iter_mut().zip(&self.points) {
            if let (Some(point), Some(first)) = (point, first) {
                *point += DVec3::from_slice(&step[*first..first + 3]);
            }
        }
        for (angle, column) in new.angles.iter_mut().zip(&self.angles) {
            *angle += column.map_or(0.0, |column| step[column]);
        }
        let change = self.found.map(|column| column.map_or(0.0, |column| step[column]));
        new.found = new.found.moved(change);
        new
    }
}

impl State {
    /// Nothing is placed; lenses as the model gives them, where `focal_px` has theirs.
    pub fn unplaced(model: &Model, focal_px: &[f64]) -> Self {
        let optic = |(index, &focal_px): (usize, &f64)| {
            let lens = &model.lenses[index];
            let own = model.photographs.iter().find(|photograph| photograph.lens == index);
            let middle = own.map_or(DVec2::ZERO, |photograph| {
                0.5 * DVec2::new(photograph.size.0 as f64, photograph.size.1 as f64)
            });
            Optic {
                focal_px,
                principal_px: lens.principal_px.unwrap_or(middle),
                radial: lens.radial,
            }
        };
        Self {
            lenses: focal_px.iter().enumerate().map(optic).collect(),
            poses: vec![None; model.photographs.len()],
            things: vec![None; model.things.len()],
            points: vec![None; model.points.len()],
            angles: vec![0.0; model.strokes.len()],
            found: Similarity::default(),
            kept: [false; 7],
        }
    }

    /// Whether everything that a stroke is about is placed.
    pub fn is_placed(&self, stroke: &Stroke) -> bool {
        let place = |place: &Place| match *place {
            Place::Corner { thing, .. } => self.things[thing].is_some(),
            Place::Point(index) => self.points[index].is_some(),
        };
        let rim = match stroke {
            Stroke::Rim { thing, .. } => self.things[*thing].is_some(),
            _ => true,
        };
        let photograph = stroke.photograph().is_none_or(|index| self.poses[index].is_some());
        rim && photograph && stroke.places().iter().all(place)
    }

    /// The corners of every placed thing, in metres.
    pub fn corners(&self, model: &Model) -> Vec<Vec<DVec3>> {
        let values = self.constants();
        let corners = |index: usize| match self.things[index] {
            Some(_) => {
                let corners = things::corners(&model.things, index, &values);
                corners.iter().map(super::jet::position).collect()
            }
            None => Vec::new(),
        };
        (0..model.things.len()).map(corners).collect()
    }

    /// Every thing's parameters as numbers without derivatives; none of a thing that is not placed.
    pub fn constants(&self) -> Vec<Vec<Jet>> {
        let constants = |values: &Option<Vec<f64>>| {
            values.iter().flatten().map(|&v| Jet::constant(v)).collect()
        };
        self.things.iter().map(constants).collect()
    }

    /// The pose of a photograph and its lens.
    pub fn camera(&self, model: &Model, photograph: usize) -> Option<(Pose, Optic)> {
        Some((self.poses[photograph]?, self.lenses[model.photographs[photograph].lens]))
    }
}

/// The rotation nearest to a matrix with positive determinant (its orthogonal polar factor, by
/// Newton's iteration); `None` for a matrix that is near none.
pub(super) fn nearest_rotation(mut matrix: DMat3) -> Option<DMat3> {
    for _ in 0..60 {
        if matrix.determinant() <= 1e-9 {
            return None;
        }
        let next = (matrix + matrix.inverse().transpose()) * 0.5;
        let change = (next - matrix).to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
        matrix = next;
        if change < 1e-15 {
            break;
        }
    }
    matrix.is_finite().then_some(matrix)
}
