//! From strokes to cameras and faces: start values, adjustment, certainty, and whether the result
//! can be used.

use std::sync::Arc;

use glam::DVec3;

use super::adjust::{self, AdjustOptions, Adjusted, Stopped};
use super::determined::{self, Certainty};
use super::rig::{self, Rig};
use super::things::{self, Face, Kind};
use super::unknowns::State;
use super::{
    LensReport, Model, ModelError, PhotographReport, Shape, Stroke, StrokeReport, Support,
    ThingReport, Unsolved, calibrate, check, conventions, report,
};
use crate::scene::Camera;
use crate::watch::Watch;

/// Strokes that are off by more than this part of the image's diagonal contradict others; where
/// more than [`CONTRADICTED`] of all do, nothing can be believed.
const CONTRADICTORY: f64 = 0.01;
const CONTRADICTED: f64 = 0.25;
/// A stroke that is off by more than this many times what strokes are off by is named.
const OUTLYING: f64 = 5.0;
/// How exactly strokes alone are adjusted before found edges take part, in pixels.
const BEGUN_PX: f64 = 0.1;
/// As often the term of an engine's points is made at most; two or three are usual.
const MOST_TERMS: usize = 20;

/// The solution of a model.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The adjusted numbers.
    pub state: State,
    /// By photograph; `None` where it could not be placed.
    pub cameras: Vec<Option<Camera>>,
    /// The corners of each placed thing in metres; of others none.
    pub corners: Vec<Vec<DVec3>>,
    /// The faces of all placed things.
    pub faces: Vec<Face>,
    /// Of each stroke that takes part.
    pub strokes: Vec<StrokeReport>,
    /// Of every lens.
    pub lenses: Vec<LensReport>,
    /// Of each placed photograph.
    pub photographs: Vec<PhotographReport>,
    /// Of each placed thing.
    pub things: Vec<ThingReport>,
    /// What strokes are off by: a standard deviation in pixels. `None` where something is open.
    pub stroke_px: Option<f64>,
    /// Steps of the adjustment.
    pub steps: usize,
    /// Why the adjustment ended.
    pub stopped: Stopped,
    /// Notes on values that were chosen, and on strokes that disagree with the others.
    pub notes: Vec<String>,
    /// Parts that were left out because too little is known of them.
    pub unplaced: Vec<ModelError>,
    /// Why cameras and things cannot be used as they are; empty where they can.
    pub problems: Vec<ModelError>,
    /// What an engine tells about its cameras.
    rig: Rig,
}

impl Solution {
    /// Whether the cameras and the mesh can be used.
    pub fn is_usable(&self) -> bool {
        self.problems.is_empty()
    }

    /// The stroke that disagrees most with everything else, by its residual.
    pub fn worst(&self) -> Option<&StrokeReport> {
        self.strokes.iter().max_by(|a, b| a.residual.total_cmp(&b.residual))
    }
}

/// Places cameras and things by the strokes. An error where the model contradicts itself, or
/// nothing can be placed; what makes a result useless stands in [`Solution::problems`].
pub fn solve(model: &Model, options: &AdjustOptions) -> Result<Solution, ModelError> {
    match solve_watched(model, options, &Watch::new()) {
        Ok(solution) => Ok(solution),
        Err(Unsolved::Model(error)) => Err(error),
        Err(Unsolved::Cancelled(_)) => unreachable!("nobody else has the watch"),
    }
}

/// The same for a job that may be cancelled.
///
/// # Errors
/// As [`solve`], and if it is cancelled.
pub fn solve_watched(
    model: &Model,
    options: &AdjustOptions,
    watch: &Watch,
) -> Result<Solution, Unsolved> {
    check::check(model)?;
    let (completed, mut notes) = conventions::completed(model);
    let mut start = calibrate::start(&completed)?;
    let rig = Rig::of(&completed, &start.state, options.loss_px);
    notes.extend(rig::keep(&completed, &rig, &mut start.state));
    let (adjusted, rig) = adjusted(&completed, rig, &start.state, options, watch)?;
    watch.check()?;
    let known = Known { notes, unplaced: start.unplaced, rig };
    Ok(solution(model, &completed, adjusted, known, options.loss_px))
}

/// How exactly what follows a hand is solved, in pixels.
const NEAR_PX: f64 = 0.01;
/// Steps until it is given up; from one place of the hand to the next it takes 2 to 13 in benches/drag.rs.
const NEAR_STEPS: usize = 40;

/// The solution of a model of which only strokes have changed since another was solved: the
/// adjustment begins from that solution and ends within a hundredth of a pixel. It is for what is
/// shown while something is dragged. `None` where more has changed, or the adjustment does not end,
/// so that the model is to be solved by [`solve`].
pub fn solve_near(model: &Model, near: (&Model, &Solution)) -> Option<Solution> {
    let (former, found) = near;
    check::check(model).ok()?;
    let (completed, mut notes) = conventions::completed(model);
    let is_like = completed.things == conventions::completed(former).0.things
        && model.points == former.points
        && model.lenses == former.lenses
        && model.photographs == former.photographs
        && Arc::ptr_eq(&model.found_points, &former.found_points);
    if !is_like || !found.is_usable() || !found.unplaced.is_empty() {
        return None;
    }
    let mut state = found.state.clone();
    state.angles = vec![0.0; completed.strokes.len()];
    calibrate::set_angles(&completed, &mut state);
    notes.extend(rig::keep(&completed, &found.rig, &mut state));
    let options =
        AdjustOptions { tolerance_px: NEAR_PX, max_steps: NEAR_STEPS, ..AdjustOptions::default() };
    let watch = Watch::new();
    let adjusted = adjust::adjust(&completed, &found.rig, &state, &options, &watch).ok()?;
    if adjusted.stopped != Stopped::Converged {
        return None;
    }
    let known = Known { notes, unplaced: Vec::new(), rig: found.rig.clone() };
    Some(solution(model, &completed, adjusted, known, options.loss_px))
}

/// What is known of a solution before the adjustment, and the rig after it.
struct Known {
    notes: Vec<String>,
    unplaced: Vec<ModelError>,
    rig: Rig,
}

/// Certainty, residuals and problems of an adjusted model; `completed` is it with what was chosen.
fn solution(
    model: &Model,
    completed: &Model,
    adjusted: Adjusted,
    known: Known,
    loss_px: f64,
) -> Solution {
    let Known { mut notes, unplaced, rig } = known;
    let mut problems = boundless(model, &adjusted.state);
    problems.extend(inside_out(model, &adjusted.state));
    let certainty = match determined::certainty(completed, &adjusted, loss_px) {
        Ok(certainty) => {
            problems.extend(determined::vague(completed, &adjusted, &certainty));
            Some(certainty)
        }
        Err(open) => {
            problems.push(open);
            None
        }
    };
    if adjusted.stopped == Stopped::MaxSteps && problems.is_empty() {
        problems.push(ModelError::new(
            "",
            format!("the adjustment has not settled after {} steps", adjusted.steps),
            "Check the strokes that are off by most",
        ));
    }
    let strokes = report::strokes(completed, &adjusted);
    problems.extend(contradictions(completed, &strokes));
    let sd = certainty.as_ref().map_or(1.0, |certainty: &Certainty| certainty.stroke_px.max(1.0));
    for own in strokes.iter().filter(|own| own.residual > OUTLYING * sd) {
        notes.push(outlier(completed, own));
    }
    let known = certainty.as_ref();
    let Adjusted { state, steps, stopped, .. } = &adjusted;
    let corners = state.corners(completed);
    Solution {
        cameras: (0..model.photographs.len())
            .map(|index| {
                let (pose, lens) = state.camera(model, index)?;
                Some(pose.camera(&lens, model.photographs[index].size))
            })
            .collect(),
        faces: faces(completed, state, &corners),
        lenses: report::lenses(completed, &adjusted, known),
        photographs: report::photographs(completed, &adjusted, &strokes, known),
        things: report::things(completed, &adjusted, known),
        strokes: strokes.into_iter().filter(|own| own.stroke < model.strokes.len()).collect(),
        stroke_px: known.map(|certainty| certainty.stroke_px),
        steps: *steps,
        stopped: *stopped,
        state: state.clone(),
        corners,
        notes,
        unplaced,
        problems,
        rig,
    }
}

/// Adjusts all, with the term of an engine's points made anew until it changes nothing.
fn adjusted(
    model: &Model,
    mut rig: Rig,
    start: &State,
    options: &AdjustOptions,
    watch: &Watch,
) -> Result<(Adjusted, Rig), ModelError> {
    // Each adjustment of several needs only be as exact as all together.
    let tolerance_px = match rig.has_points() {
        true => options.tolerance_px.max(0.1 * options.tracks_px),
        false => options.tolerance_px,
    };
    let options = &AdjustOptions { tolerance_px, ..*options };
    let near = by_strokes(model, &rig, start, options, watch)?;
    let mut adjusted = adjust::adjust(model, &rig, &near, options, watch)?;
    for _ in 1..MOST_TERMS {
        let Some(next) = rig.again(model, &adjusted.state, options.loss_px) else { break };
        rig = next;
        let steps = adjusted.steps;
        adjusted = adjust::adjust(model, &rig, &adjusted.state, options, watch)?;
        let [before, after] = adjusted.cost;
        adjusted.steps += steps;
        // A step of that length lowers a quadratic cost by half its square.
        if before - after <= 0.5 * options.tracks_px * options.tracks_px {
            break;
        }
    }
    Ok((adjusted, rig))
}

/// Where the adjustment of all begins: where strokes alone place everything, if there are found edges.
/// From the start values, which may be off by many pixels, they would all be outliers.
fn by_strokes(
    model: &Model,
    rig: &Rig,
    start: &State,
    options: &AdjustOptions,
    watch: &Watch,
) -> Result<State, ModelError> {
    if !model.strokes.iter().any(Stroke::is_found) {
        return Ok(start.clone());
    }
    let mut drawn = model.clone();
    drawn.forget_found(None);
    let options = AdjustOptions { tolerance_px: BEGUN_PX.max(options.tolerance_px), ..*options };
    Ok(adjust::adjust(&drawn, rig, start, &options, watch)?.state)
}

/// The faces of all placed things.
pub(super) fn faces(model: &Model, state: &State, corners: &[Vec<DVec3>]) -> Vec<Face> {
    let values = state.constants();
    let placed = (0..model.things.len()).filter(|&index| state.things[index].is_some());
    placed
        .flat_map(|index| {
            let rims = things::rims(&model.things, index, &values);
            let circles = rims.map(|(circles, radius)| {
                (circles.each_ref().map(super::jet::position), radius.value)
            });
            things::faces(&model.things[index], &corners[index], circles)
        })
        .collect()
}

/// Things of which a number has run away: only strokes that the robust loss outvotes hold it.
fn boundless(model: &Model, state: &State) -> Vec<ModelError> {
    let placed = model.things.iter().zip(&state.things).enumerate();
    placed
        .filter_map(|(index, (thing, values))| {
            let is_far = |value: &f64| !value.is_finite() || value.abs() > check::LARGEST_M;
            let parameters = things::parameters(thing).into_iter().zip(values.as_ref()?);
            let (own, _) = parameters.into_iter().find(|(_, value)| is_far(value))?;
            Some(ModelError::new(
                format!("things[{index}] ({})", thing.id),
                format!(
                    "its {} is not determined: the strokes that show it are outvoted",
                    own.name
                ),
                "Pick more of its corners, check those that are off by most, or type the number \
                 (\"hold\")",
            ))
        })
        .collect()
}

/// Things whose sizes came out negative, or whose outlines run the wrong way.
pub(super) fn inside_out(model: &Model, state: &State) -> Vec<ModelError> {
    let mut problems = Vec::new();
    let corners = state.corners(model);
    for (index, thing) in model.things.iter().enumerate() {
        let Some(values) = &state.things[index] else { continue };
        let place = format!("things[{index}] ({})", thing.id);
        let sizes = ["width", "depth", "height", "radius"];
        let negative = things::parameters(thing).into_iter().zip(values).find(|(own, value)| {
            let is_size = sizes.iter().any(|size| own.name.ends_with(size));
            own.kind == Kind::Length && is_size && **value <= 0.0
        });
        if let Some((own, value)) = negative {
            problems.push(ModelError::new(
                place,
                format!("it is turned inside out: its {} is {value:.3} m", own.name),
                "Check which of its corners were picked: bottom below top, and outlines \
                 counter-clockwise seen from above",
            ));
            continue;
        }
        let count = match thing.shape {
            Shape::Room { corners, .. } | Shape::Prism { corners } => corners,
            Shape::Polygon { corners } if thing.on != Support::Free => corners,
            _ => continue,
        };
        let normal = things::normal(&corners[index][..count]);
        let seen_from = match thing.on {
            Support::Side(_) => continue,
            _ => DVec3::Z,
        };
        if normal.dot(seen_from) <= 0.0 {
            problems.push(ModelError::new(
                place,
                "it is turned inside out: its outline runs clockwise seen from above",
                "Number its corners counter-clockwise",
            ));
        }
    }
    problems
}

fn contradictions(model: &Model, strokes: &[StrokeReport]) -> Option<ModelError> {
    let limit = |own: &StrokeReport| {
        let photograph = model.strokes[own.stroke].photograph()?;
        let (width, height) = model.photographs[photograph].size;
        Some(CONTRADICTORY * (width as f64).hypot(height as f64))
    };
    let drawn: Vec<(&StrokeReport, f64)> =
        strokes.iter().filter_map(|own| Some((own, limit(own)?))).collect();
    let wrong = drawn.iter().filter(|(own, limit)| own.residual > *limit).count();
    if (wrong as f64) <= CONTRADICTED * drawn.len() as f64 {
        return None;
    }
    let worst = drawn.iter().map(|own| own.0).max_by(|a, b| a.residual.total_cmp(&b.residual))?;
    Some(ModelError::new(
        format!("strokes[{}]", worst.stroke),
        format!(
            "the strokes contradict each other: {wrong} of {} are off by more than 1 % of the \
             image; most is {}, by {:.1} px",
            drawn.len(),
            model.stroke_name(worst.stroke),
            worst.residual
        ),
        "Check that stroke: the corner and the photograph that it names",
    ))
}

fn outlier(model: &Model, own: &StrokeReport) -> String {
    let name = model.stroke_name(own.stroke);
    match model.strokes[own.stroke] {
        Stroke::Position { sd_m, .. } | Stroke::Length { sd_m, .. } => format!(
            "{name} disagrees with the photographs: it is off by {:.3} m.",
            own.residual * sd_m
        ),
        _ => {
            format!("{name} disagrees with the other strokes: it is off by {:.1} px.", own.residual)
        }
    }
}
