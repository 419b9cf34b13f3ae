//! Stated exposure times against the pixels.
//!
//! Cameras round times, which does no harm, and automatics change them unseen, which does: then
//! pixels do not brighten as the times say. Neighbouring exposures of a series are links; a link
//! whose pixels contradict its times is cut, and a response is recovered from the others.

use super::response::{Response, Undetermined, recover};
use super::samples::Readings;

/// A link is contradicted when measured and stated differ by more than this many stops,
const TOLERANCE_STOPS: f64 = 0.25;
/// and by more than this fraction of what is stated.
const TOLERANCE_RELATIVE: f64 = 0.2;
/// With fewer readings nothing is said about a link.
const FEWEST_READINGS: usize = 24;
/// Readings of less than this fraction of the largest weight are left out.
const TELLING: f64 = 0.05;
/// Codes whose exposure is well known, in 255ths of full scale.
const WELL_KNOWN: std::ops::RangeInclusive<f32> = 12.0..=243.0;

/// What the pixels say about two neighbouring exposures of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// The shorter and the longer exposure.
    pub exposures: [usize; 2],
    pub stated_stops: f64,
    /// `None` where too few pixels are well exposed in both.
    pub measured_stops: Option<f64>,
}

impl Link {
    /// By how much pixels and times differ, as a multiple of what is tolerated.
    pub fn contradiction(&self) -> f64 {
        let tolerated = TOLERANCE_STOPS.max(TOLERANCE_RELATIVE * self.stated_stops.abs());
        self.measured_stops.map_or(0.0, |measured| (measured - self.stated_stops).abs() / tolerated)
    }

    pub fn is_contradicted(&self) -> bool {
        self.contradiction() > 1.0
    }
}

/// A response and what was found about the times.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    pub response: Response,
    /// For each series its links in the order of stated times.
    pub links: Vec<Vec<Link>>,
    /// For each series and exposure whether it belongs to the largest part of the series whose
    /// times agree with the pixels.
    pub trusted: Vec<Vec<bool>>,
}

/// Recovers a response from the links that agree with one another.
///
/// Wrong times bend the first curve towards themselves, so the most contradicted links are cut
/// and the curve is recovered again until none is left; links that the last curve agrees with
/// are taken back.
pub fn recover_checked(readings: &[Readings], smoothness: f64) -> Result<Checked, Undetermined> {
    let orders: Vec<Vec<usize>> = readings.iter().map(order).collect();
    let mut cut: Vec<Vec<bool>> =
        orders.iter().map(|order| vec![false; order.len().saturating_sub(1)]).collect();
    let mut response = recover(readings, &parts(&orders, &cut), smoothness)?;
    let rounds: usize = cut.iter().map(Vec::len).max().unwrap_or(0);
    for _ in 0..rounds {
        let links = measure_all(readings, &orders, &response);
        let standing = || std::iter::zip(links.iter().flatten(), cut.iter().flatten());
        let worst = standing()
            .filter(|(_, cut)| !**cut)
            .map(|(link, _)| link.contradiction())
            .fold(0.0, f64::max);
        if worst <= 1.0 {
            break;
        }
        for (link, cut) in links.iter().flatten().zip(cut.iter_mut().flatten()) {
            *cut |= link.contradiction() >= 1.0_f64.max(0.6 * worst);
        }
        response = recover(readings, &parts(&orders, &cut), smoothness)?;
    }
    let links = measure_all(readings, &orders, &response);
    let contradicted: Vec<Vec<bool>> =
        links.iter().map(|links| links.iter().map(Link::is_contradicted).collect()).collect();
    if contradicted != cut {
        response = recover(readings, &parts(&orders, &contradicted), smoothness)?;
    }
    Ok(check(readings, response))
}

/// Holds the times against a response that is known.
pub fn check(readings: &[Readings], response: Response) -> Checked {
    let orders: Vec<Vec<usize>> = readings.iter().map(order).collect();
    let links = measure_all(readings, &orders, &response);
    let cut: Vec<Vec<bool>> =
        links.iter().map(|links| links.iter().map(Link::is_contradicted).collect()).collect();
    let trusted = parts(&orders, &cut)
        .iter()
        .map(|parts| {
            let size = |part: usize| parts.iter().filter(|own| **own == part).count();
            // Of equal parts the one with the shorter times: nothing there is saturated.
            let largest =
                (0..parts.len()).max_by_key(|part| (size(*part), std::cmp::Reverse(*part)));
            parts.iter().map(|own| Some(*own) == largest).collect()
        })
        .collect();
    Checked { response, links, trusted }
}

/// The exposures from the shortest to the longest.
fn order(readings: &Readings) -> Vec<usize> {
    let mut order: Vec<usize> = (0..readings.seconds.len()).collect();
    order.sort_by(|a, b| readings.seconds[*a].total_cmp(&readings.seconds[*b]));
    order
}

/// The part that each exposure belongs to, parts being separated by cut links.
fn parts(orders: &[Vec<usize>], cut: &[Vec<bool>]) -> Vec<Vec<usize>> {
    std::iter::zip(orders, cut)
        .map(|(order, cut)| {
            let mut parts = vec![0; order.len()];
            let mut part = 0;
            for (place, &exposure) in order.iter().enumerate() {
                part += usize::from(place > 0 && cut[place - 1]);
                parts[exposure] = part;
            }
            parts
        })
        .collect()
}

fn measure_all(
    readings: &[Readings],
    orders: &[Vec<usize>],
    response: &Response,
) -> Vec<Vec<Link>> {
    std::iter::zip(readings, orders)
        .map(|(readings, order)| {
            order.windows(2).map(|pair| measure(readings, [pair[0], pair[1]], response)).collect()
        })
        .collect()
}

fn measure(readings: &Readings, exposures: [usize; 2], response: &Response) -> Link {
    let [short, long] = exposures;
    // (rise of ln exposure, weight). Weights matter: the fog of film and the flare of lenses are
    // the same code at any time, and there a code says next to nothing about exposure.
    let mut rises: Vec<(f64, f64)> = readings
        .pixels()
        .flat_map(|pixel| (0..3).map(move |channel| (pixel, channel)))
        .filter_map(|(pixel, channel)| {
            let codes = [pixel[short][channel], pixel[long][channel]];
            codes.iter().all(|code| WELL_KNOWN.contains(code)).then(|| {
                let [low, high] = codes.map(|code| response.ln_exposure(channel, code));
                let variance: f64 =
                    codes.iter().map(|code| response.deviation(channel, *code).powi(2)).sum();
                (high - low, variance.recip())
            })
        })
        .filter(|(rise, weight)| rise.is_finite() && weight.is_finite())
        .collect();
    let heaviest = rises.iter().map(|(_, weight)| *weight).fold(0.0, f64::max);
    rises.retain(|(_, weight)| *weight >= TELLING * heaviest);
    let measured_stops = (rises.len() >= FEWEST_READINGS)
        .then(|| weighted_median(&mut rises) / std::f64::consts::LN_2);
    let stated_stops = (readings.seconds[long] / readings.seconds[short]).log2();
    Link { exposures, stated_stops, measured_stops }
}

fn weighted_median(values: &mut [(f64, f64)]) -> f64 {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * values.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut sum = 0.0;
    let place = values.iter().position(|(_, weight)| {
        sum += weight;
        sum >= half
    });
    place.map_or(0.0, |place| values[place].0)
}
