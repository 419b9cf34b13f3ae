//! Lines of a photograph whose directions in the world are known: strokes along axes, and edges of
//! things between corners that were picked.

use std::collections::HashMap;

use glam::DVec2;

use super::vanishing::Line;
use crate::model::{Axis, Model, Optic, Place, Shape, Stroke};

/// Lines along x, y and z.
pub type ByAxis = [Vec<Line>; 3];

/// The strokes of one photograph, in pixels from the principal point and without distortion.
pub struct Drawn<'a> {
    model: &'a Model,
    lines: Vec<(Axis, Line)>,
    picks: HashMap<Place, DVec2>,
    /// Pieces of edges, drawn either way.
    edges: Vec<([Place; 2], Line)>,
}

impl<'a> Drawn<'a> {
    /// What is drawn on a photograph, with the lens as far as it is known.
    pub fn on(model: &'a Model, photograph: usize, lens: &Optic) -> Self {
        let place = |pixel: DVec2| Some(lens.undistort(pixel)?.place * lens.focal_px);
        let mut drawn = Self { model, lines: Vec::new(), picks: HashMap::new(), edges: Vec::new() };
        for stroke in model.strokes.iter().filter(|own| own.photograph() == Some(photograph)) {
            match stroke {
                Stroke::Line { axis, from, to, .. } => {
                    if let Some((from, to)) = place(*from).zip(place(*to)) {
                        drawn.lines.push((*axis, Line { from, to, is_directed: true }));
                    }
                }
                Stroke::Pick { at, pixel, .. } => {
                    if let Some(pixel) = place(*pixel) {
                        drawn.picks.insert(*at, pixel);
                    }
                }
                Stroke::Edge { between, from, to, .. } => {
                    if let Some((from, to)) = place(*from).zip(place(*to)) {
                        drawn.edges.push((*between, Line { from, to, is_directed: false }));
                    }
                }
                Stroke::Rim { .. } | Stroke::Position { .. } | Stroke::Length { .. } => {}
            }
        }
        drawn
    }

    /// Lines along the axes of the world: drawn ones, upright edges, walls of rectilinear rooms.
    pub fn of_world(&self) -> ByAxis {
        let mut axes: ByAxis = Default::default();
        for (axis, line) in &self.lines {
            axes[*axis as usize].push(*line);
        }
        self.upright(&mut axes[2]);
        for (thing, own) in self.model.things.iter().enumerate() {
            let Shape::Room { corners, rectilinear: true, .. } = own.shape else { continue };
            for ring in [0, corners] {
                for wall in 0..corners {
                    let ends = [ring + wall, ring + (wall + 1) % corners];
                    // Of the others a turn of the outline decides.
                    let is_directed = wall == 0;
                    self.edge(thing, ends, is_directed, &mut axes[wall % 2]);
                }
            }
        }
        axes
    }

    /// Lines along the axes of a box: its width, its depth, and what is upright.
    pub fn of_box(&self, thing: usize) -> ByAxis {
        let mut axes: ByAxis = Default::default();
        for ring in [0, 4] {
            for (axis, ends) in [(0, [0, 1]), (0, [3, 2]), (1, [1, 2]), (1, [0, 3])] {
                self.edge(thing, ends.map(|corner| ring + corner), true, &mut axes[axis]);
            }
        }
        self.upright(&mut axes[2]);
        axes[2].extend(self.lines.iter().filter(|own| own.0 == Axis::Z).map(|own| own.1));
        axes
    }

    fn upright(&self, lines: &mut Vec<Line>) {
        for (thing, own) in self.model.things.iter().enumerate() {
            let count = match own.shape {
                Shape::Room { corners, .. } | Shape::Prism { corners } => corners,
                Shape::Box { .. } => 4,
                Shape::Cylinder | Shape::Polygon { .. } => 0,
            };
            for corner in 0..count {
                self.edge(thing, [corner, count + corner], true, lines);
            }
        }
    }

    /// The edge of a thing between two corners: from one pick to the other, or else from end to end
    /// of what was drawn of it, as one line, since short pieces tell a direction badly.
    fn edge(&self, thing: usize, ends: [usize; 2], is_directed: bool, lines: &mut Vec<Line>) {
        let [a, b] = ends.map(|corner| Place::Corner { thing, corner });
        let (from, to) = (self.picks.get(&a).copied(), self.picks.get(&b).copied());
        if let (Some(from), Some(to)) = (from, to) {
            if from.distance(to) > 2.0 {
                lines.push(Line { from, to, is_directed });
            }
            return;
        }
        let is_own = |between: &[Place; 2]| *between == [a, b] || *between == [b, a];
        let pieces = self.edges.iter().filter(|own| is_own(&own.0)).map(|own| own.1);
        let drawn: Vec<DVec2> = pieces.flat_map(|piece| [piece.from, piece.to]).collect();
        let places: Vec<DVec2> = from.into_iter().chain(to).chain(drawn.iter().copied()).collect();
        let pairs = places.iter().flat_map(|a| drawn.iter().map(move |b| (*a, *b)));
        let longest = pairs.max_by(|x, y| x.0.distance(x.1).total_cmp(&y.0.distance(y.1)));
        if let Some((from, to)) = longest.filter(|(from, to)| from.distance(*to) > 2.0) {
            lines.push(Line { from, to, is_directed: false });
        }
    }
}
