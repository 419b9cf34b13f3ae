//! The report of a solve: the residual of each stroke, and the standard error of each number.

use glam::DVec3;

use super::adjust::Adjusted;
use super::determined::Certainty;
use super::residuals::{NO_STROKE, Row};
use super::unknowns::{Owner, State};
use super::{Model, Stroke, things};

/// A number with its standard error; `None` where it was held, or nothing tells.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// The name of the parameter.
    pub name: String,
    /// Pixels, metres or radians.
    pub value: f64,
    /// Its standard error.
    pub sd: Option<f64>,
}

/// The residual of a stroke in the fit of all strokes.
#[derive(Clone, Debug, PartialEq)]
pub struct StrokeReport {
    /// Index into `Model::strokes`.
    pub stroke: usize,
    /// Root mean square of its residuals: pixels, or standard deviations of what was typed.
    pub residual: f64,
}

/// A lens as it was adjusted: `focal_px`, `cx`, `cy`, `k1`, `k2`.
#[derive(Clone, Debug, PartialEq)]
pub struct LensReport {
    /// Index into `Model::lenses`.
    pub lens: usize,
    /// Its parameters.
    pub numbers: Vec<Estimate>,
}

/// A placed photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotographReport {
    /// Index into `Model::photographs`.
    pub photograph: usize,
    /// Strokes drawn on it, and the root mean square of their residuals in pixels.
    pub strokes: usize,
    /// Over its strokes.
    pub rms_px: f64,
    /// Standard errors of direction (radians) and position (metres), the three axes together;
    /// `None` where the strokes leave something open.
    pub direction_sd: Option<f64>,
    /// As for the direction.
    pub position_sd_m: Option<f64>,
}

/// A placed thing.
#[derive(Clone, Debug, PartialEq)]
pub struct ThingReport {
    /// Index into `Model::things`.
    pub thing: usize,
    /// Its parameters.
    pub numbers: Vec<Estimate>,
}

/// The report of each stroke that takes part, in the strokes' order.
pub(super) fn strokes(model: &Model, adjusted: &Adjusted) -> Vec<StrokeReport> {
    let chunks = adjusted.rows.chunk_by(|a, b| a.stroke == b.stroke);
    let report = |rows: &[Row]| {
        if rows[0].stroke == NO_STROKE {
            return None;
        }
        let squares: f64 = rows.iter().map(|row| row.value * row.value).sum();
        let mut residual = (squares / rows.len() as f64).sqrt();
        if let Some(own) = model.strokes.get(rows[0].stroke).filter(|own| own.is_found()) {
            residual *= own.sd();
        }
        Some(StrokeReport { stroke: rows[0].stroke, residual })
    };
    chunks.filter_map(report).collect()
}

pub(super) fn lenses(
    model: &Model,
    adjusted: &Adjusted,
    certainty: Option<&Certainty>,
) -> Vec<LensReport> {
    let report = |lens: usize| {
        let values = adjusted.state.lenses[lens].numbers();
        let names = ["focal_px", "cx", "cy", "k1", "k2"];
        let columns = adjusted.unknowns.lens(lens);
        let number = |k: usize| Estimate {
            name: names[k].to_owned(),
            value: values[k],
            sd: certainty
                .zip(columns[k])
                .map(|(certainty, column)| certainty.standard_error(column)),
        };
        LensReport { lens, numbers: (0..5).map(number).collect() }
    };
    (0..model.lenses.len()).map(report).collect()
}

pub(super) fn photographs(
    model: &Model,
    adjusted: &Adjusted,
    strokes: &[StrokeReport],
    certainty: Option<&Certainty>,
) -> Vec<PhotographReport> {
    let report = |(photograph, first): (usize, usize)| {
        let own: Vec<f64> = strokes
            .iter()
            .filter(|own| {
                model.strokes.get(own.stroke).and_then(Stroke::photograph) == Some(photograph)
            })
            .map(|own| own.residual * own.residual)
            .collect();
        let together = |from: usize| {
            let sd = |k| certainty.map_or(0.0, |certainty| certainty.standard_error(from + k));
            certainty.map(|_| DVec3::new(sd(0), sd(1), sd(2)).length())
        };
        PhotographReport {
            photograph,
            strokes: own.len(),
            // Without strokes 0: the sum of nothing is −0.
            rms_px: (own.iter().sum::<f64>() / own.len().max(1) as f64).sqrt().abs(),
            direction_sd: together(first),
            position_sd_m: together(first + 3),
        }
    };
    let placed = (0..model.photographs.len())
        .filter_map(|index| Some((index, adjusted.unknowns.pose(index)?)));
    placed.map(report).collect()
}

pub(super) fn things(
    model: &Model,
    adjusted: &Adjusted,
    certainty: Option<&Certainty>,
) -> Vec<ThingReport> {
    let state: &State = &adjusted.state;
    let report = |thing: usize| {
        let values = state.things[thing].as_ref()?;
        let names = things::parameters(&model.things[thing]);
        let column = |part: usize| {
            let list = &adjusted.unknowns.list;
            list.iter().position(|own| own.owner == Owner::Thing(thing) && own.part == part)
        };
        let number = |(part, parameter): (usize, things::Parameter)| Estimate {
            name: parameter.name,
            value: values[part],
            sd: certainty.zip(column(part)).map(|(certainty, at)| certainty.standard_error(at)),
        };
        Some(ThingReport { thing, numbers: names.into_iter().enumerate().map(number).collect() })
    };
    (0..model.things.len()).filter_map(report).collect()
}
