//! Moves a thing until its outline lies on the lines that the photographs show.
//!
//! Cameras and all other things are held fixed. Each point on the visible part of the outline is
//! matched with the nearest line of similar direction. Then the numbers of the thing are adjusted,
//! with the solver and the robust loss of the bundle adjustment ([`adjust`]), to minimise the
//! distances between the projected outline and the feet of these points on their lines. This is
//! repeated with a decreasing search distance. A wrong line may be nearer than the right one, so
//! the search starts from several positions, and the result with the smallest unmatched part of the
//! outline is taken. Typed numbers have the same weight as in the bundle adjustment, and numbers
//! that no line determines stay as they were. In the resulting model the strokes of the thing have
//! moved with it, so that solving the model places the thing there.

mod find;
mod outline;
mod strokes;

pub use find::{EdgesFound, find};
pub use strokes::follow;

use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;

use self::outline::{Part, Place, Solid};
use super::adjust::{self, AdjustOptions};
use super::jet;
use super::lines::Line;
use super::residuals::{self, Row};
use super::rig::Rig;
use super::solve::{faces, inside_out};
use super::things::Face;
use super::unknowns::{Owner, State, Unknowns};
use super::{Model, ModelError, Solution, Stroke, Unsolved};
use crate::geometry::bvh::RayCaster;
use crate::math::sampling::Random;
use crate::watch::Watch;

/// How far lines may lie from the outline at first, as a part of the image's diagonal.
const REACH: f64 = 0.02;
/// By what that is multiplied from one round to the next, down to [`LAST`].
const SHRINK: f64 = 0.7;
/// In the end lines count within this part of the diagonal, and within so many pixels at least.
const LAST: f64 = 0.002;
const LAST_PX: f64 = 3.0;
/// Rounds at the last reach.
const LAST_ROUNDS: usize = 4;
/// The scale of the loss, as a part of the reach, and at least in pixels.
const LOSS: f64 = 0.3;
const LEAST_LOSS_PX: f64 = 0.5;
/// Sines of the angles between outline and line that are taken for like directions, at the first
/// reach and at the last: 15° and 5°.
const LIKE: [f64; 2] = [0.26, 0.087];
/// A line counts this far beyond its ends, in pixels.
const BEYOND_PX: f64 = 2.0;
/// Standard deviation of where the thing is believed to be before, in pixels: enough to keep what
/// no line tells, and of no account beside lines.
const BEFORE_PX: f64 = 100.0;
/// Starts besides the thing's own place, and how far from it, as a part of the reach.
const STARTS: u64 = 40;
const AROUND: f64 = 0.6;
/// What a move as far as the reach costs, beside the part of the outline that lies on no line.
const FAR: f64 = 0.05;
/// The part of the visible outline that must lie on lines in the end.
const LEAST_PART: f64 = 0.4;
/// By how much that may be off from them, as a part of [`LAST`].
const WORST: f64 = 1.0 / 3.0;
const NEARER: &str =
    "Move its corners nearer to where the photographs show them, or draw its edges";

/// A thing that was fitted.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model with the strokes about the thing moved.
    pub model: Model,
    /// The thing's numbers, by [`things::parameters`](super::things::parameters).
    pub values: Vec<f64>,
    /// What of its visible outline lies on lines now, from 0 to 1.
    pub part: f64,
    /// Root mean square distance of that from those lines before and after, in pixels.
    pub off_px: [f64; 2],
    /// Photographs that show such lines.
    pub photographs: usize,
    /// How far the corner that moved farthest has moved, in metres.
    pub moved_m: f64,
}

impl Fitted {
    /// What has changed, in words.
    pub fn words(&self, id: &str) -> String {
        let [before, after] = self.off_px;
        let photographs = match self.photographs {
            1 => "one photograph".to_owned(),
            count => format!("{count} photographs"),
        };
        format!(
            "{id} is fitted to edges: {:.0} % of its outline lies on lines of {photographs}, and is off \
             by {after:.2} px ({before:.2} px before). Its corners have moved by up to {:.1} mm.",
            100.0 * self.part,
            1e3 * self.moved_m
        )
    }
}

/// A place with the line that it is to lie on.
struct Match {
    photograph: usize,
    part: Part,
    /// On the line.
    foot: DVec2,
}

/// Fits thing `thing` of a solved model. `lines` are those of each photograph, `caster` makes of
/// faces what hides behind them.
///
/// # Errors
/// If the thing is not placed or cannot move, if no lines fit it, or if it is cancelled.
pub fn fit(
    model: &Model,
    solution: &Solution,
    thing: usize,
    lines: &[Arc<Vec<Line>>],
    caster: impl Fn(&[Face]) -> Option<RayCaster> + Sync,
    watch: &Watch,
) -> Result<Fitted, Unsolved> {
    let id = &model.things[thing].id;
    let error = |problem: String, remedy: &str| {
        Unsolved::from(ModelError::new(format!("things[{thing}] ({id})"), problem, remedy))
    };
    let start = &solution.state;
    let Some(before) = start.things.get(thing).cloned().flatten() else {
        let remedy = "Show its corners in the photographs first";
        return Err(error(format!("{id} is not placed yet"), remedy));
    };
    let unknowns = Unknowns::of_thing(model, start, thing);
    if unknowns.list.is_empty() {
        let problem = format!("all numbers of {id} are held, so that it cannot move");
        return Err(error(problem, "Untick those that the photographs are to tell"));
    }
    let fit = Fit { model, thing, lines, start, unknowns, watch };
    let seen = |state: &State| {
        let faces = faces(model, state, &state.corners(model));
        outline::places(model, state, thing, caster(&faces).as_ref())
    };
    let (first, last) = fit.reach();
    // The nearest lines may be the wrong ones: of what is found from several starts, the best counts.
    let search = |(state, mut reach): (State, f64)| {
        let (mut state, mut rounds) = (state, 0);
        while rounds < LAST_ROUNDS && watch.check().is_ok() {
            rounds += usize::from(reach <= last);
            let matches = fit.matches(&seen(&state), reach, LIKE[usize::from(reach <= last)]);
            state = fit.moved(&state, &matches, (LOSS * reach).max(LEAST_LOSS_PX));
            reach = (SHRINK * reach).max(last);
        }
        let places = seen(&state);
        let matches = fit.matches(&places, last, LIKE[1]);
        let missed = places.len() - matches.len();
        let rows = fit.rows(&state, &fit.unknowns, &matches);
        let off: f64 = rows.iter().map(|row| (row.value / last).powi(2).min(1.0)).sum();
        let moved = fit.distance_px(&state) / first;
        let mut cost = (off + missed as f64) / places.len().max(1) as f64 + FAR * moved * moved;
        if !inside_out(model, &state).is_empty() || places.is_empty() {
            cost = f64::INFINITY;
        }
        (cost, state, places, matches)
    };
    let found: Vec<_> = fit.starts(first).into_par_iter().map(search).collect();
    watch.check()?;
    let best = found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, state, places, matches)) = best.filter(|own| !own.2.is_empty()) else {
        let problem = format!("no photograph shows the outline of {id}");
        return Err(error(problem, "Place it where a photograph shows it"));
    };
    let part = matches.len() as f64 / places.len().max(1) as f64;
    if part < LEAST_PART {
        let problem = format!(
            "no lines of the photographs lie near {id}: within {first:.0} px no more than {:.0} % of \
             its outline can be put onto lines",
            100.0 * part
        );
        return Err(error(problem, NEARER));
    }
    let own = format!("({id})");
    if let Some(wrong) = inside_out(model, &state).into_iter().find(|o| o.place.contains(&own)) {
        return Err(error(format!("the lines near {id} do not fit it: {}", wrong.problem), NEARER));
    }
    let off = |state: &State| {
        let rows = fit.rows(state, &fit.unknowns, &matches);
        (rows.iter().map(|row| row.value * row.value).sum::<f64>() / rows.len() as f64).sqrt()
    };
    let off_px = [off(start), off(&state)];
    if off_px[1] > last * WORST {
        let problem = format!(
            "the lines near {id} do not fit it: its outline would still be off by {:.1} px",
            off_px[1]
        );
        return Err(error(problem, NEARER));
    }
    let mut shown: Vec<usize> = matches.iter().map(|own| own.photograph).collect();
    shown.dedup();
    let points = |state: &State| Solid::new(model, state, &fit.unknowns, thing).points();
    let (old, new) = (points(start), points(&state));
    let pairs = old.iter().zip(&new);
    Ok(Fitted {
        model: strokes::follow(model, start, &state, thing),
        off_px,
        part,
        photographs: shown.len(),
        moved_m: pairs
            .map(|(a, b)| jet::position(a).distance(jet::position(b)))
            .fold(0.0, f64::max),
        values: state.things[thing].clone().unwrap_or(before),
    })
}

struct Fit<'a> {
    model: &'a Model,
    thing: usize,
    lines: &'a [Arc<Vec<Line>>],
    start: &'a State,
    unknowns: Unknowns,
    watch: &'a Watch,
}

/// The nearest line of like direction within reach of a place: its index in the photograph, and the
/// foot of the place on it.
fn nearest(
    place: &Place,
    lines: &[Arc<Vec<Line>>],
    reach: f64,
    like: f64,
) -> Option<(usize, DVec2)> {
    let lines = lines.get(place.photograph)?.iter().enumerate();
    let near = lines.filter_map(|(index, line)| {
        let along = line.direction();
        if along.perp_dot(place.direction).abs() > like {
            return None;
        }
        let from = place.pixel - line.ends[0];
        let at = from.dot(along);
        let is_beside = at >= -BEYOND_PX && at <= line.length() + BEYOND_PX;
        let off = from.perp_dot(along).abs();
        (is_beside && off < reach).then_some((off, index, line))
    });
    let (_, index, line) = near.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((index, line.foot(place.pixel)))
}

impl Fit<'_> {
    /// How far lines are looked for at first and in the end, in pixels.
    fn reach(&self) -> (f64, f64) {
        let diagonals = self.model.photographs.iter().map(|own| {
            let (width, height) = own.size;
            (width as f64).hypot(height as f64)
        });
        let diagonal = diagonals.fold(0.0, f64::max);
        let last = (LAST * diagonal).max(LAST_PX);
        ((REACH * diagonal).max(last), last)
    }

    /// Where the search begins, with the reach there: where the thing is, and around that.
    fn starts(&self, reach: f64) -> Vec<(State, f64)> {
        let scales = self.scales();
        let around = |index: u64| {
            let mut random = Random::new(1, index, 0);
            let step: Vec<f64> = scales
                .iter()
                .map(|scale| AROUND * reach * (2.0 * f64::from(random.uniform()) - 1.0) / scale)
                .collect();
            (self.unknowns.moved(self.start, &step), 0.5 * reach)
        };
        std::iter::once((self.start.clone(), reach)).chain((0..STARTS).map(around)).collect()
    }

    /// How far the thing is from where it was, in pixels: the root mean square over what the
    /// photographs show of it.
    fn distance_px(&self, state: &State) -> f64 {
        let points =
            |state: &State| Solid::new(self.model, state, &self.unknowns, self.thing).points();
        let (old, new) = (points(self.start), points(state));
        let (mut sum, mut count) = (0.0, 0);
        for photograph in 0..self.model.photographs.len() {
            let Some((pose, lens)) = self.start.camera(self.model, photograph) else { continue };
            let shown = |point| Some(pose.project(&lens, jet::position(point))?.pixel);
            for (old, new) in old.iter().zip(&new) {
                if let Some((a, b)) = shown(old).zip(shown(new)) {
                    sum += a.distance_squared(b);
                    count += 1;
                }
            }
        }
        (sum / f64::from(count.max(1))).sqrt()
    }

    /// The nearest line of like direction for each place that has one within reach.
    fn matches(&self, places: &[Place], reach: f64, like: f64) -> Vec<Match> {
        let found = places.iter().filter_map(|place| {
            let Place { photograph, part, .. } = *place;
            let (_, foot) = nearest(place, self.lines, reach, like)?;
            Some(Match { photograph, part, foot })
        });
        found.collect()
    }

    /// How far the feet are from the outline of a state.
    fn rows(&self, state: &State, unknowns: &Unknowns, matches: &[Match]) -> Vec<Row> {
        let solid = Solid::new(self.model, state, unknowns, self.thing);
        let row = |own: &Match| {
            let [a, b] = solid.ends(own.part)?;
            residuals::from_edge(self.model, state, unknowns, own.photograph, [&a, &b], own.foot)
        };
        matches.iter().filter_map(row).collect()
    }

    /// The state with the thing where it fits best to what it is matched with.
    fn moved(&self, state: &State, matches: &[Match], loss_px: f64) -> State {
        // What was typed about the thing.
        let mut typed = self.model.clone();
        typed.strokes.retain(|stroke| {
            let is_own = |place: &super::Place| {
                matches!(place, super::Place::Corner { thing, .. } if *thing == self.thing)
            };
            let is_typed = matches!(stroke, Stroke::Position { .. } | Stroke::Length { .. });
            is_typed && stroke.places().iter().any(is_own)
        });
        let start = self.start.things[self.thing].clone().unwrap_or_default();
        let scales = self.scales();
        let rows = |state: &State, unknowns: &Unknowns| {
            let mut rows = self.rows(state, unknowns, matches);
            // An outline that turns away from its lines must not be cheaper for having fewer.
            if rows.len() < matches.len() {
                return Err(residuals::NO_STROKE);
            }
            rows.extend(residuals::rows(&typed, &Rig::default(), state, unknowns)?);
            let values = state.things[self.thing].as_deref().unwrap_or_default();
            for (column, own) in unknowns.list.iter().enumerate() {
                let weight = scales[column] / BEFORE_PX;
                let value = weight * (values[own.part] - start[own.part]);
                rows.push(Row { value, slopes: vec![(column, weight)], ..Row::default() });
            }
            Ok(rows)
        };
        let options =
            AdjustOptions { loss_px, max_steps: 50, tolerance_px: 1e-4, ..Default::default() };
        let adjusted = adjust::minimise(state, self.unknowns.clone(), rows, &options, self.watch);
        // Where the first state has no residuals, nothing can be told by them.
        adjusted.map_or_else(|_| state.clone(), |own| own.state)
    }

    /// By how many pixels each unknown moves what the photographs show, one unit of it: the root
    /// mean square over corners (or circles) and photographs.
    fn scales(&self) -> Vec<f64> {
        let solid = Solid::new(self.model, self.start, &self.unknowns, self.thing);
        let points = solid.points();
        let mut sums = vec![(0.0, 0); self.unknowns.list.len()];
        for photograph in 0..self.model.photographs.len() {
            let Some((pose, lens)) = self.start.camera(self.model, photograph) else { continue };
            for point in &points {
                let Some(seen) = pose.project(&lens, jet::position(point)) else { continue };
                for (column, by) in jet::slopes(point) {
                    let [x, y, z] = seen.by_point;
                    let (sum, count) = &mut sums[column];
                    *sum += (x * by.x + y * by.y + z * by.z).length_squared();
                    *count += 1;
                }
            }
        }
        debug_assert!(self.unknowns.list.iter().all(|own| own.owner == Owner::Thing(self.thing)));
        sums.into_iter()
            .map(|(sum, count)| (sum / f64::from(count.max(1))).sqrt().max(1e-6))
            .collect()
    }
}
