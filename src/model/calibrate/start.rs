//! The order in which the closed forms are used: photographs with lines come first, and those that
//! are placed by then help to place the others.

use glam::{DMat3, DVec2, DVec3};

use super::connected::connected;
use super::linear;
use super::lines::{ByAxis, Drawn};
use super::resect::{self, Sight};
use super::rig;
use super::shapes;
use super::vanishing::{self, VanishingPoint};
use crate::model::things::parameters;
use crate::model::unknowns::State;
use crate::model::{Model, ModelError, Place, Pose, Shape, Similarity, Stroke, found};

/// Where everything is to begin with.
#[derive(Clone, Debug)]
pub struct Start {
    /// The values of what could be placed.
    pub state: State,
    /// What could not be placed, and why.
    pub unplaced: Vec<ModelError>,
}

/// Finds start values for everything that the strokes place. An error where they place nothing.
pub fn start(model: &Model) -> Result<Start, ModelError> {
    let mut search = Search::new(model);
    search.focal_lengths();
    search.by_found();
    for photograph in 0..model.photographs.len() {
        if search.rotations[photograph].is_none() {
            search.by_axes(photograph);
        }
    }
    search.by_boxes();
    search.by_positions();
    search.solve();
    // What is placed places more; each round places a photograph at least.
    for _ in 0..=model.photographs.len() {
        if !search.by_boxes() && !search.by_corners() && !search.by_level() {
            break;
        }
        search.solve();
    }
    search.finish()
}

struct Search<'a> {
    model: &'a Model,
    /// By lens.
    focal_px: Vec<Option<f64>>,
    /// World from camera, by photograph.
    rotations: Vec<Option<DMat3>>,
    /// Why a photograph has no rotation yet.
    reasons: Vec<Option<ModelError>>,
    /// Why a lens has no focal length.
    no_focal: Vec<Option<vanishing::NoFocal>>,
    state: State,
}

impl<'a> Search<'a> {
    fn new(model: &'a Model) -> Self {
        let focal_px: Vec<Option<f64>> = model.lenses.iter().map(|lens| lens.focal_px).collect();
        let count = model.photographs.len();
        Self {
            model,
            state: State::unplaced(model, &guessed(model, &focal_px)),
            focal_px,
            rotations: vec![None; count],
            reasons: vec![None; count],
            no_focal: vec![None; model.lenses.len()],
        }
    }

    fn lens(&self, photograph: usize) -> usize {
        self.model.photographs[photograph].lens
    }

    fn diagonal_px(&self, photograph: usize) -> f64 {
        let (width, height) = self.model.photographs[photograph].size;
        (width as f64).hypot(height as f64)
    }

    fn drawn(&self, photograph: usize) -> Drawn<'a> {
        Drawn::on(self.model, photograph, &self.state.lenses[self.lens(photograph)])
    }

    fn vanishing(&self, lines: &ByAxis, photograph: usize) -> [Option<VanishingPoint>; 3] {
        let scale_px = 0.5 * self.diagonal_px(photograph);
        std::array::from_fn(|k| vanishing::vanishing_point(&lines[k], scale_px))
    }

    fn boxes(&self) -> Vec<usize> {
        let is_box = |&index: &usize| matches!(self.model.things[index].shape, Shape::Box { .. });
        (0..self.model.things.len()).filter(is_box).collect()
    }

    /// The focal length of every lens that has none, from its photographs' vanishing points: the
    /// median.
    fn focal_lengths(&mut self) {
        for lens in 0..self.model.lenses.len() {
            let own: Vec<usize> =
                (0..self.rotations.len()).filter(|&index| self.lens(index) == lens).collect();
            if self.model.lenses[lens].fit.principal
                && self.model.lenses[lens].principal_px.is_none()
            {
                let centre = own.iter().find_map(|&photograph| {
                    let lines = self.drawn(photograph).of_world();
                    vanishing::principal(&self.vanishing(&lines, photograph))
                });
                let range = own.first().map_or(0.0, |&photograph| self.diagonal_px(photograph));
                // A centre out of the image's middle part is an error of the lines.
                let centre = centre.filter(|centre| centre.length() < 0.2 * range);
                self.state.lenses[lens].principal_px += centre.unwrap_or(DVec2::ZERO);
            }
            if self.focal_px[lens].is_some() {
                continue;
            }
            let (mut found, mut reason) = (Vec::new(), vanishing::NoFocal::None);
            for &photograph in &own {
                let drawn = self.drawn(photograph);
                let frames = self.boxes().into_iter().map(|thing| drawn.of_box(thing));
                for lines in std::iter::once(drawn.of_world()).chain(frames) {
                    match vanishing::focal(&self.vanishing(&lines, photograph)) {
                        Ok(focal) => found.push(focal),
                        Err(vanishing::NoFocal::None) => {}
                        Err(other) => reason = other,
                    }
                }
            }
            found.sort_by(f64::total_cmp);
            match found.get(found.len() / 2) {
                Some(&focal) => self.set_focal(lens, focal),
                None => self.no_focal[lens] = Some(reason),
            }
        }
    }

    fn set_focal(&mut self, lens: usize, focal_px: f64) {
        self.focal_px[lens] = Some(focal_px);
        self.state.lenses[lens].focal_px = focal_px;
    }

    /// The rotations of photographs that an engine placed, from what is drawn on all of them.
    fn by_found(&mut self) {
        let poses: Vec<_> = self.model.photographs.iter().map(|own| own.found).collect();
        if poses.iter().all(Option::is_none) {
            return;
        }
        let points: Vec<DVec3> = self.model.found_points.iter().map(|own| own.position).collect();
        let lenses = &self.state.lenses;
        let scale = self.model.found_in_metres.then_some(1.0);
        let guess = found::guess(&poses, &points, None, scale);
        let rotation = rig::rotation(self.model, lenses, &guess.rotation);
        self.state.found = found::guess(&poses, &points, Some(rotation), scale);
        for (own, pose) in self.rotations.iter_mut().zip(poses) {
            *own = pose.map(|found| rotation * found.pose.world_from_camera);
        }
    }

    /// A photograph's rotation from lines along two axes of the world or more, or from what is
    /// upright in it, by itself or with a box, and a level line. Of all that are possible it is the
    /// one that most lines agree with: strokes that are wrong are outvoted.
    fn by_axes(&mut self, photograph: usize) {
        let Some(focal_px) = self.focal_px[self.lens(photograph)] else { return };
        let drawn = self.drawn(photograph);
        let lines = drawn.of_world();
        let points = self.vanishing(&lines, photograph);
        let boxes = self.boxes().into_iter().filter_map(|thing| {
            let points = self.vanishing(&drawn.of_box(thing), photograph);
            let is_told = points.iter().flatten().count() > 1;
            is_told.then(|| vanishing::rotation(&points, focal_px).ok()).flatten()
        });
        let plumb = points[2].and_then(|up| vanishing::upright(&up, focal_px));
        let level = boxes.chain(plumb).filter_map(|upright| {
            vanishing::turned_level(upright, [&lines[0], &lines[1]], focal_px)
        });
        let is_told = points.iter().flatten().count() > 1;
        let by_axes = is_told.then(|| vanishing::rotation(&points, focal_px));
        let misfit = |rotation: &DMat3| vanishing::misfit(*rotation, &lines, focal_px);
        let all = level.chain(by_axes.and_then(Result::ok));
        self.rotations[photograph] = all.min_by(|a, b| misfit(a).total_cmp(&misfit(b)));
        if let (None, Some(Err(problem))) = (self.rotations[photograph], by_axes) {
            let name = &self.model.photographs[photograph].name;
            self.reasons[photograph] = Some(ModelError::new(
                format!("photographs[{photograph}] ({name})"),
                problem.to_string(),
                "Check along which axis, and in which direction, each line was drawn",
            ));
        }
    }

    /// Rotations from boxes whose yaw is typed or placed; whether there is a new one.
    fn by_boxes(&mut self) -> bool {
        let mut found = false;
        for photograph in 0..self.rotations.len() {
            let Some(focal_px) = self.focal_px[self.lens(photograph)] else { continue };
            if self.rotations[photograph].is_some() {
                continue;
            }
            let drawn = self.drawn(photograph);
            for thing in self.boxes() {
                let points = self.vanishing(&drawn.of_box(thing), photograph);
                if points.iter().flatten().count() < 2 {
                    continue;
                }
                match (self.yaw(thing), vanishing::rotation(&points, focal_px)) {
                    (Some(yaw), Ok(rotation)) => {
                        self.rotations[photograph] = Some(DMat3::from_rotation_z(yaw) * rotation);
                        found = true;
                        break;
                    }
                    (_, Err(vanishing::NoRotation::Mirrored)) => {
                        self.reasons[photograph] = Some(ModelError::new(
                            format!("things[{thing}] ({})", self.model.things[thing].id),
                            format!(
                                "{} shows it turned inside out",
                                self.model.photographs[photograph].name
                            ),
                            "Number its corners counter-clockwise seen from above, bottom below top",
                        ));
                    }
                    _ => {}
                }
            }
        }
        found
    }

    fn yaw(&self, thing: usize) -> Option<f64> {
        let own = &self.model.things[thing];
        let held = own.held.iter().find(|(name, _)| name == "yaw").map(|(_, value)| *value);
        let place = parameters(own).iter().position(|parameter| parameter.name == "yaw")?;
        held.or_else(|| Some(self.state.things[thing].as_ref()?[place]))
    }

    /// Cameras from points of known position.
    fn by_positions(&mut self) {
        let known: Vec<(Place, DVec3)> = self
            .model
            .strokes
            .iter()
            .filter_map(|stroke| match stroke {
                Stroke::Position { at, position, .. } => Some((*at, *position)),
                _ => None,
            })
            .collect();
        let at = |place: Place| known.iter().find(|own| own.0 == place).map(|own| own.1);
        self.by_sights(&at);
    }

    /// Cameras from corners and points that are placed; whether there is a new one.
    fn by_corners(&mut self) -> bool {
        let corners = self.state.corners(self.model);
        let state = self.state.clone();
        self.by_sights(&|place| crate::model::conventions::at(&state, &corners, place))
    }

    fn by_sights(&mut self, at: &dyn Fn(Place) -> Option<DVec3>) -> bool {
        let mut found = false;
        for photograph in 0..self.rotations.len() {
            if self.rotations[photograph].is_some() {
                continue;
            }
            let lens = self.lens(photograph);
            let optic = self.state.lenses[lens];
            let sights: Vec<Sight> = self
                .model
                .strokes
                .iter()
                .filter_map(|stroke| match stroke {
                    Stroke::Pick { photograph: own, at: place, pixel } if *own == photograph => {
                        let pixel = optic.undistort(*pixel)?.place * optic.focal_px;
                        Some(Sight { point: at(*place)?, pixel })
                    }
                    _ => None,
                })
                .collect();
            let diagonal_px = self.diagonal_px(photograph);
            match resect::resect(&sights, self.focal_px[lens], diagonal_px) {
                Ok((Pose { world_from_camera, .. }, focal_px)) => {
                    self.rotations[photograph] = Some(world_from_camera);
                    if self.focal_px[lens].is_none() {
                        self.set_focal(lens, focal_px);
                    }
                    found = true;
                }
                Err(problem) => {
                    let name = &self.model.photographs[photograph].name;
                    self.reasons[photograph].get_or_insert_with(|| ModelError::new(
                        format!("photographs[{photograph}] ({name})"),
                        problem.to_string(),
                        "Draw lines along two axes, or pick more corners that other photographs show",
                    ));
                }
            }
        }
        found
    }

    /// Rotations of cameras that are taken to stand level, from lines along one level axis.
    fn by_level(&mut self) -> bool {
        let mut found = false;
        for photograph in 0..self.rotations.len() {
            let Some(focal_px) = self.focal_px[self.lens(photograph)] else { continue };
            if self.rotations[photograph].is_some() {
                continue;
            }
            let points = self.vanishing(&self.drawn(photograph).of_world(), photograph);
            if points[2].is_none()
                && let Ok(rotation) = vanishing::rotation(&points, focal_px)
            {
                self.rotations[photograph] = Some(rotation);
                found = true;
            }
        }
        found
    }

    /// Places everything that the photographs with rotations see, by one linear system.
    fn solve(&mut self) {
        if self.rotations.iter().all(Option::is_none) {
            return;
        }
        let seen = connected(self.model, &self.rotations);
        let lenses = &self.state.lenses;
        let Some(placed) =
            linear::place(self.model, lenses, &self.rotations, &seen, &self.state.found.rotation)
        else {
            return;
        };
        if let Some((scale, shift)) = placed.found.filter(|own| own.0 > 0.0) {
            self.state.found = Similarity { scale, shift, ..self.state.found };
        }
        for (index, position) in placed.cameras.iter().enumerate() {
            self.state.poses[index] = position
                .zip(self.rotations[index])
                .map(|(position, world_from_camera)| Pose { world_from_camera, position });
        }
        self.state.points.clone_from(&placed.points);
        self.state.things.iter_mut().for_each(|thing| *thing = None);
        for index in 0..self.model.things.len() {
            shapes::set(self.model, &mut self.state, index, &placed.corners[index]);
        }
    }

    fn finish(mut self) -> Result<Start, ModelError> {
        // Where nothing is drawn, what an engine found stands by itself.
        if self.state.poses.iter().all(Option::is_none) {
            for (index, own) in self.model.photographs.iter().enumerate() {
                self.state.poses[index] = own.found.map(|own| self.state.found.pose(&own.pose));
            }
        }
        shapes::set_angles(self.model, &mut self.state);
        let mut unplaced = Vec::new();
        for (index, pose) in self.state.poses.iter().enumerate() {
            if pose.is_some() {
                continue;
            }
            let photograph = &self.model.photographs[index];
            let place = format!("photographs[{index}] ({})", photograph.name);
            let no_focal =
                self.no_focal[photograph.lens].filter(|_| self.focal_px[photograph.lens].is_none());
            unplaced.push(match (no_focal, self.rotations[index], self.reasons[index].take()) {
                (Some(reason), _, _) => ModelError::new(place, reason.to_string(), reason.remedy()),
                (None, None, Some(reason)) => reason,
                (None, None, None) => ModelError::new(
                    place,
                    "nothing drawn on it tells how the camera is turned",
                    "Draw lines along two axes, or pick corners that other photographs show",
                ),
                (None, Some(_), _) => ModelError::new(
                    place,
                    "it shows nothing that is placed",
                    "Pick corners in it that other photographs show",
                ),
            });
        }
        if self.state.poses.iter().all(Option::is_none) {
            let none = || ModelError::new("photographs", "there is none", "Add a photograph");
            return Err(unplaced.into_iter().next().unwrap_or_else(none));
        }
        for (index, thing) in self.model.things.iter().enumerate() {
            if self.state.things[index].is_none() {
                unplaced.push(ModelError::new(
                    format!("things[{index}] ({})", thing.id),
                    "too little of it is picked to place it",
                    "Pick more of its corners in photographs that are placed",
                ));
            }
        }
        for (index, point) in self.model.points.iter().enumerate() {
            if self.state.points[index].is_none() {
                unplaced.push(ModelError::new(
                    format!("points[{index}] ({})", point.id),
                    "fewer than two placed photographs show it",
                    "Pick it in another photograph",
                ));
            }
        }
        Ok(Start { state: self.state, unplaced })
    }
}

/// A focal length for every lens: where none is known, one of an ordinary angle of view.
fn guessed(model: &Model, focal_px: &[Option<f64>]) -> Vec<f64> {
    let size = |lens: usize| {
        let own = model.photographs.iter().find(|photograph| photograph.lens == lens);
        own.map_or(1.0, |photograph| photograph.size.0.max(photograph.size.1) as f64)
    };
    focal_px.iter().enumerate().map(|(lens, focal)| focal.unwrap_or(size(lens))).collect()
}
