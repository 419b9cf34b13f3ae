//! Finds the lines of the photographs that are edges of things, and adds them to a model.
//!
//! A line that is detected in a photograph lies within some tenths of a pixel of the edge that it
//! shows, a drawn stroke within one or two. With found lines beside the strokes, the bundle adjustment
//! therefore determines cameras and things several times as exactly. The strokes stay as they were
//! drawn.
//!
//! Each point on the visible outline of a thing is matched with the nearest line of similar
//! direction. The points of one edge that are matched with the same line make a stroke on that
//! line. All strokes are then solved together. This is repeated from the new places of cameras and
//! things, with a decreasing search distance. A line that is no edge of the thing, but happens to
//! lie near one, is an outlier of the robust loss. Real things are not exactly the boxes and planes
//! of the model, so the standard deviation of the found lines is taken from their residuals.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};

use super::outline::{self, Part, Place};
use super::{LIKE, nearest};
use crate::geometry::bvh::RayCaster;
use crate::math::statistics::robust_deviation;
use crate::model::adjust::AdjustOptions;
use crate::model::jet::Jet;
use crate::model::lines::Line;
use crate::model::solve::{faces, solve_near, solve_watched};
use crate::model::strokes::HAND_PX;
use crate::model::things::Face;
use crate::model::unknowns::{State, Unknowns};
use crate::model::{self, Model, ModelError, Solution, Stroke, Unsolved, residuals, things};
use crate::scene::Camera;
use crate::watch::Watch;

/// Lines are searched for within this many standard deviations of the strokes at first, and of the
/// least exact line in the end.
const FIRST: f64 = 3.0;
const LAST: f64 = 6.0;
/// By what the search distance is multiplied from one round to the next.
const SHRINK: f64 = 0.7;
/// Rounds at the last distance.
const LAST_ROUNDS: usize = 4;
/// Most rounds in all; from three pixels it takes eight.
const MOST_ROUNDS: usize = 20;
/// A piece of an edge that is found is as long at least, in pixels.
const SHORTEST_PX: f64 = 15.0;
/// Places that are nearer are one, in metres: a polygon that lies on another thing is lifted by a
/// millimetre in the mesh.
const NEAR_M: f64 = 2e-3;

/// The lines of the photographs that are edges of things.
#[derive(Clone, Debug)]
pub struct EdgesFound {
    /// The model with these lines among its strokes, in the place of those found before.
    pub model: Model,
    /// How many they are.
    pub lines: usize,
    /// How many photographs show any of them.
    pub photographs: usize,
    /// Robust standard deviation of these lines from the edges before and after, in pixels.
    pub off_px: [f64; 2],
    /// By how much the camera that turned most has turned, in radians.
    pub turned: f64,
    /// How far the corner that moved farthest has moved, in metres.
    pub moved_m: f64,
}

impl EdgesFound {
    /// What was found and has changed, in words.
    pub fn words(&self) -> String {
        let [before, after] = self.off_px;
        let photographs = match self.photographs {
            1 => "one photograph".to_owned(),
            count => format!("{count} photographs"),
        };
        format!(
            "{} edges were found in {photographs}. They are off by {after:.2} px ({before:.2} px \
             before). Cameras have turned by up to {:.2}°, and corners moved by up to {:.1} mm.",
            self.lines,
            self.turned.to_degrees(),
            1e3 * self.moved_m
        )
    }
}

/// Finds the edges of all things of a solved model. `lines` are those of each photograph, `caster`
/// makes of faces what hides behind them.
///
/// # Errors
/// If no line is an edge of a thing, if the strokes cannot be solved with those that are found, or if it is
/// cancelled.
pub fn find(
    model: &Model,
    solution: &Solution,
    lines: &[Arc<Vec<Line>>],
    caster: impl Fn(&[Face]) -> Option<RayCaster>,
    watch: &Watch,
) -> Result<EdgesFound, Unsolved> {
    let mut drawn = model.clone();
    drawn.forget_found(None);
    let all = lines.iter().flat_map(|own| own.iter());
    let line_px = all.map(|line| line.sd_px).fold(0.0, f64::max);
    let hand_px = solution.stroke_px.unwrap_or(HAND_PX);
    let mut reach = FIRST * hand_px;
    let mut before = (model.clone(), solution.clone());
    let (mut factor, mut rounds, mut last_rounds) = (1.0, 0, 0);
    loop {
        watch.check()?;
        rounds += 1;
        let last = LAST * factor * line_px;
        reach = reach.max(last);
        last_rounds += usize::from(reach <= last);
        let found = edges(&drawn, &before.1.state, lines, [reach, factor, hand_px], &caster);
        if found.is_empty() {
            let problem = "no line of a photograph is an edge of a thing".to_owned();
            let remedy = "Place things nearer to where the photographs show them";
            return Err(ModelError::new("things", problem, remedy).into());
        }
        let mut next = drawn.clone();
        next.strokes.extend(found);
        let exact = || solve_watched(&next, &AdjustOptions::default(), watch);
        if last_rounds == LAST_ROUNDS || rounds == MOST_ROUNDS {
            let solved = exact()?;
            return match solved.problems.first() {
                Some(problem) => Err(problem.clone().into()),
                None => Ok(summary(next, solution, &solved)),
            };
        }
        let solved = match solve_near(&next, (&before.0, &before.1)) {
            Some(solved) => solved,
            None => exact()?,
        };
        let off = off_px(&next, &solved.state).into_iter();
        factor *= robust_deviation(off.map(|(off, sd_px)| off / sd_px));
        factor = f64::max(factor, 1.0);
        reach *= SHRINK;
        before = (next, solved);
    }
}

/// The lines that are edges of things in a state, as strokes: how far lines are searched for in pixels,
/// what the standard deviations of lines are multiplied by, and that of drawn strokes in pixels.
fn edges(
    model: &Model,
    state: &State,
    lines: &[Arc<Vec<Line>>],
    [reach, factor, hand_px]: [f64; 3],
    caster: &impl Fn(&[Face]) -> Option<RayCaster>,
) -> Vec<Stroke> {
    let corners = state.corners(model);
    let faces = faces(model, state, &corners);
    let caster = caster(&faces);
    let mut pieces = Vec::new();
    for (thing, corners) in corners.iter().enumerate() {
        let mut bounding = Vec::new();
        if !corners.is_empty() {
            bounding = things::edges(&model.things[thing]);
            bounding.retain(|ends| is_bounding(&faces, ends.map(|end| corners[end])));
        }
        let mut own: BTreeMap<(usize, [usize; 2], usize), Piece> = BTreeMap::new();
        for place in outline::places(model, state, thing, caster.as_ref()) {
            let Place { photograph, part: Part::Edge(ends), pixel, .. } = place else { continue };
            if !bounding.contains(&ends) {
                continue;
            }
            let Some((line, foot)) = nearest(&place, lines, reach, LIKE[1]) else { continue };
            let key = (photograph, ends, line);
            let piece = own.entry(key).or_insert_with(|| Piece::new(photograph, thing, ends, line));
            piece.feet.push(foot);
            piece.off += foot.distance(pixel);
        }
        pieces.extend(own.into_values());
    }
    pieces.retain(|piece| {
        let drawn = piece.drawn(model);
        piece.length() >= SHORTEST_PX
            && !contradicts(&drawn, &lines[piece.photograph][piece.line], hand_px)
    });
    let stroke = |piece: &Piece| {
        let Piece { photograph, thing, corners, line, .. } = *piece;
        let sd_px = factor * lines[photograph][line].sd_px;
        let between = corners.map(|corner| model::Place::Corner { thing, corner });
        let (from, to) = (piece.feet[0], piece.feet[piece.feet.len() - 1]);
        let is_nearest = pieces.iter().all(|other| !piece.yields_to(other, sd_px));
        is_nearest.then_some(Stroke::Edge { photograph, between, from, to, sd_px: Some(sd_px) })
    };
    pieces.iter().filter_map(stroke).collect()
}

/// A piece of a line that may be an edge of a thing.
struct Piece {
    photograph: usize,
    thing: usize,
    /// Of the thing.
    corners: [usize; 2],
    /// Index into the photograph's lines.
    line: usize,
    /// On the line, in order along the edge.
    feet: Vec<DVec2>,
    /// Sum of their distances from the edge, in pixels.
    off: f64,
}

impl Piece {
    fn new(photograph: usize, thing: usize, corners: [usize; 2], line: usize) -> Self {
        Self { photograph, thing, corners, line, feet: Vec::new(), off: 0.0 }
    }

    fn length(&self) -> f64 {
        self.feet[0].distance(self.feet[self.feet.len() - 1])
    }

    fn mean_off(&self) -> f64 {
        self.off / self.feet.len() as f64
    }

    /// What was drawn of its edge in the photograph: the ends of strokes along it, and its corners.
    fn drawn(&self, model: &Model) -> Vec<DVec2> {
        let own = self.corners.map(|corner| model::Place::Corner { thing: self.thing, corner });
        let strokes = model.strokes.iter();
        let in_photograph = strokes.filter(|stroke| stroke.photograph() == Some(self.photograph));
        let pixels = in_photograph.flat_map(|stroke| match *stroke {
            Stroke::Edge { between: [a, b], from, to, .. } if own == [a, b] || own == [b, a] => {
                vec![from, to]
            }
            Stroke::Pick { at, pixel, .. } if own.contains(&at) => vec![pixel],
            _ => Vec::new(),
        });
        pixels.collect()
    }

    /// Whether another edge beside the same part of the line is nearer to it by more than what is
    /// given, so that the line is that edge.
    fn yields_to(&self, other: &Self, by_px: f64) -> bool {
        (self.photograph, self.line) == (other.photograph, other.line)
            && self.mean_off() > other.mean_off() + by_px
            && self.overlaps(other)
    }

    fn overlaps(&self, other: &Self) -> bool {
        let (from, to) = (self.feet[0], self.feet[self.feet.len() - 1]);
        let along = (to - from).normalize_or_zero();
        let range = |piece: &Self| {
            let ends = [0, piece.feet.len() - 1].map(|end| (piece.feet[end] - from).dot(along));
            (ends[0].min(ends[1]), ends[0].max(ends[1]))
        };
        let (own, other) = (range(self), range(other));
        own.0 < other.1 && other.0 < own.1
    }
}

/// Whether a line is too far from what was drawn of an edge to be that edge, by the mean over the pixels
/// that were drawn.
fn contradicts(drawn: &[DVec2], line: &Line, hand_px: f64) -> bool {
    let along = line.direction();
    let sum: f64 = drawn.iter().map(|pixel| along.perp_dot(*pixel - line.ends[0])).sum();
    let count = drawn.len().max(1) as f64;
    (sum / count).abs() > FIRST * hand_px / count.sqrt()
}

/// Whether the middle of an edge lies on the boundary of a face: edges between faces that were left
/// out are not seen.
fn is_bounding(faces: &[Face], [a, b]: [DVec3; 2]) -> bool {
    let middle = 0.5 * (a + b);
    let is_at = |p: DVec3, q: DVec3| {
        let part = (middle - p).dot(q - p) / (q - p).length_squared();
        let foot = p.lerp(q, part.clamp(0.0, 1.0));
        foot.distance(middle) <= NEAR_M
            && (q - p).cross(b - a).length() <= NEAR_M * (q - p).length()
    };
    let polygons = faces.iter().flat_map(|face| &face.polygons);
    polygons
        .into_iter()
        .any(|ring| (0..ring.len()).any(|k| is_at(ring[k], ring[(k + 1) % ring.len()])))
}

fn summary(model: Model, before: &Solution, after: &Solution) -> EdgesFound {
    let found: Vec<&Stroke> = model.strokes.iter().filter(|own| own.is_found()).collect();
    let mut shown: Vec<usize> = found.iter().filter_map(|own| own.photograph()).collect();
    shown.sort_unstable();
    shown.dedup();
    let cameras = before.cameras.iter().flatten().zip(after.cameras.iter().flatten());
    let turn = |(a, b): (&Camera, &Camera)| {
        DQuat::from_mat3(&(a.world_from_camera.transpose() * b.world_from_camera)).to_axis_angle().1
    };
    let corners = before.corners.iter().flatten().zip(after.corners.iter().flatten());
    EdgesFound {
        lines: found.len(),
        photographs: shown.len(),
        off_px: [before, after]
            .map(|own| robust_deviation(off_px(&model, &own.state).into_iter().map(|own| own.0))),
        turned: cameras.map(turn).fold(0.0, f64::max),
        moved_m: corners.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max),
        model,
    }
}

/// The distances of the ends of found edges from where a state has them, with their standard
/// deviations, in pixels.
fn off_px(model: &Model, state: &State) -> Vec<(f64, f64)> {
    let unknowns = Unknowns::none(model, state);
    let corners = state.corners(model);
    let corner = |place: model::Place| match place {
        model::Place::Corner { thing, corner } => {
            corners[thing].get(corner).map(|own| own.to_array().map(Jet::constant))
        }
        model::Place::Point(_) => None,
    };
    let mut off = Vec::new();
    for edge in model.strokes.iter().filter(|own| own.is_found()) {
        let Stroke::Edge { photograph, between, from, to, .. } = edge else { continue };
        let [Some(a), Some(b)] = between.map(corner) else { continue };
        for end in [*from, *to] {
            let row = residuals::from_edge(model, state, &unknowns, *photograph, [&a, &b], end);
            off.extend(row.map(|row| (row.value, edge.sd())));
        }
    }
    off
}
