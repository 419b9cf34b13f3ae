//! Error against severity as charts: a panel for each degradation.

use crate::io::drawing::{Drawing, Form, Ink};
use crate::study::chart::{self, Chart, Panel, Point, Scale, Series, number};
use crate::study::degradation::Degradation;
use crate::study::stability::{DegradationCurve, Variant};

/// The curves of a study, those of one degradation one after the other.
pub type DegradationCurves = [(Degradation, Variant, DegradationCurve)];

/// A panel for each degradation.
pub fn chart(capture: &str, curves: &DegradationCurves) -> Drawing {
    let panels = curves.chunk_by(|a, b| a.0 == b.0).map(panel).collect();
    chart::draw(&Chart {
        title: format!("How large errors of {capture} may be"),
        notes: vec![
            "Mean absolute error of reflectance as one thing gets worse: the line is the median \
             over seeds, the band from the lowest to the highest. A star marks where a method \
             breaks: an error over twice that of the capture as it is."
                .to_owned(),
        ],
        panels,
        columns: 3,
        size: [270.0, 180.0],
    })
}

/// One degradation by itself.
pub fn one(curves: &DegradationCurves) -> Drawing {
    let panels = vec![panel(curves)];
    chart::draw(&Chart { panels, columns: 1, size: [430.0, 210.0], ..Chart::default() })
}

/// The levels of a degradation that were run, with any variant.
pub fn levels(curves: &DegradationCurves) -> Vec<f64> {
    let mut levels: Vec<f64> =
        curves.iter().flat_map(|(.., curve)| &curve.steps).map(|(level, _)| *level).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

fn panel(curves: &DegradationCurves) -> Panel {
    let degradation = curves[0].0;
    let levels = levels(curves);
    let steps = std::iter::once("as it is".to_owned()).chain(levels.iter().map(|&l| number_of(l)));
    let series = curves.iter().map(|(_, variant, curve)| {
        let (ink, form) = match variant {
            Variant::Joint => (0, Form::Circle),
            Variant::Bare => (2, Form::Square),
            Variant::Paper => (1, Form::Triangle),
        };
        let clean = curve.clean.map(|y| Point { y, band: Some([y; 2]), ..Point::default() });
        let worse = curve.steps.iter().filter_map(|(level, errors)| {
            let step = levels.iter().position(|l| l == level)?;
            let [low, median, high] = (*errors)?;
            Some(Point {
                x: 1.0 + step as f64,
                y: median,
                band: Some([low, high]),
                label: String::new(),
                stands_out: curve.breaks_at == Some(*level),
            })
        });
        Series {
            name: variant.name().to_owned(),
            ink: Ink::Series(ink),
            form,
            filled: true,
            line: true,
            points: clean.into_iter().chain(worse).collect(),
        }
    });
    Panel {
        title: degradation.title().to_owned(),
        x_label: degradation.unit().to_owned(),
        y_label: "mean absolute error".to_owned(),
        series: series.collect(),
        x: Scale::Steps(steps.collect()),
        front: Vec::new(),
    }
}

/// A severity as the axis names it.
pub fn number_of(level: f64) -> String {
    if level >= 100.0 || level.fract() == 0.0 { level.to_string() } else { number(level) }
}
