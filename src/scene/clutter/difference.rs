//! The difference of each pixel from the radiance of its surface point in most photographs.

use super::small::SmallView;
use super::{FEWEST, islands};
use crate::math::rgb::CHANNELS;
use crate::scene::Views;
use crate::watch::Cancelled;

/// Other photographs that a pixel is compared with, at most: those that share most with its own.
const MOST_OTHERS: usize = 24;
/// Differences of a logarithm that mean nothing on any surface.
const SLACK: f32 = 0.05;
/// Parts of the differences of a surface that are taken to be usual for it: of the brightness, and
/// of the colour.
const USUAL_BRIGHTNESS: f64 = 0.8;
const USUAL_COLOR: f64 = 0.7;
/// How much a difference of colour counts beside one of brightness: gloss, shadow and exposure
/// change colours little.
const COLOR_WEIGHT: f32 = 2.0;

/// One pixel beside the other photographs of its point.
#[derive(Clone, Copy, Default)]
pub(super) struct Compared {
    /// Photographs that measure the point, its own included.
    pub count: usize,
    /// Mean over the channels of the logarithm of own over median radiance.
    pub brightness: f32,
    /// How far a channel's logarithm is from that, at most.
    pub color: f32,
}

/// Per surface the usual difference between photographs of it.
pub(super) struct Usual {
    brighter: Vec<f32>,
    darker: Vec<f32>,
    color: Vec<f32>,
}

/// The photographs that see most of what a photograph sees, itself left out.
pub(super) fn others(views: &Views, small: &[SmallView], view: usize) -> Vec<usize> {
    let mut others: Vec<usize> = (0..small.len()).filter(|&other| other != view).collect();
    if others.len() > MOST_OTHERS {
        let step = (small[view].points.len() / 400).max(1);
        let shared = |other: usize| {
            let points = small[view].points.iter().step_by(step).flatten();
            points.filter(|hit| views.seen(&views.buffers[other], hit.point).is_some()).count()
        };
        others.sort_by_cached_key(|&other| (std::cmp::Reverse(shared(other)), other));
        others.truncate(MOST_OTHERS);
        others.sort_unstable();
    }
    others
}

/// Compares each pixel of a photograph with the others.
pub(super) fn compare(
    views: &Views,
    small: &[SmallView],
    view: usize,
) -> Result<Vec<Compared>, Cancelled> {
    let own = &small[view];
    let others = others(views, small, view);
    let mut logs: Vec<[f32; CHANNELS]> = Vec::new();
    let one = |index: usize| {
        let Some(hit) = own.points[index].filter(|_| own.is_valid[index]) else {
            return Compared::default();
        };
        logs.clear();
        logs.push(own.log[index]);
        for &other in &others {
            let buffer = &views.buffers[other];
            let Some(_) = views.seen(buffer, hit.point) else { continue };
            let Some((place, _)) = buffer.camera.project(hit.point.position.as_dvec3()) else {
                continue;
            };
            logs.extend(small[other].between(place));
        }
        let mut residual = [0.0; CHANNELS];
        for (channel, residual) in residual.iter_mut().enumerate() {
            let mut values: Vec<f32> = logs.iter().map(|own| own[channel]).collect();
            values.sort_by(f32::total_cmp);
            let middle = values.len() / 2;
            let median = if values.len() % 2 == 1 {
                values[middle]
            } else {
                0.5 * (values[middle - 1] + values[middle])
            };
            *residual = own.log[index][channel] - median;
        }
        let brightness = residual.iter().sum::<f32>() / CHANNELS as f32;
        let color = residual.iter().map(|own| (own - brightness).abs()).fold(0.0, f32::max);
        Compared { count: logs.len(), brightness, color }
    };
    Ok((0..own.points.len()).map(one).collect())
}

/// The usual difference between photographs of each surface, from the points that enough of them
/// show.
pub(super) fn usual(small: &[SmallView], compared: &[Vec<Compared>], surfaces: usize) -> Usual {
    let mut brightness = vec![Vec::new(); surfaces];
    let mut color = vec![Vec::new(); surfaces];
    for (view, compared) in small.iter().zip(compared) {
        for (hit, own) in view.points.iter().zip(compared).step_by(3) {
            if let Some(hit) = hit.filter(|_| own.count >= FEWEST) {
                brightness[hit.surface].push(own.brightness);
                color[hit.surface].push(own.color);
            }
        }
    }
    let quantile = |values: Vec<f32>, part: f64| {
        let mut values = values;
        values.sort_by(f32::total_cmp);
        let last = values.len().saturating_sub(1) as f64;
        // A surface that too few photographs see is one of which nothing is known to be odd.
        values.get((part * last).round() as usize).copied().unwrap_or(1.0)
    };
    let signed = |sign: f32| {
        let of = |values: &Vec<f32>| {
            let values = values.iter().map(|own| (sign * own).max(0.0)).collect();
            quantile(values, USUAL_BRIGHTNESS)
        };
        brightness.iter().map(of).collect()
    };
    Usual {
        brighter: signed(1.0),
        darker: signed(-1.0),
        color: color.into_iter().map(|own| quantile(own, USUAL_COLOR)).collect(),
    }
}

/// For each pixel the evidence that something stands before its surface: negative where it agrees,
/// 0 where nothing can be said.
pub(super) fn evidence(view: &SmallView, compared: &[Compared], usual: &Usual) -> Vec<f32> {
    let odd: Vec<f32> = (view.points.iter().zip(compared))
        .map(|(hit, own)| {
            let Some(hit) = hit.filter(|_| own.count >= 2) else { return 0.0 };
            let sided = if own.brightness > 0.0 { &usual.brighter } else { &usual.darker };
            let brightness = own.brightness.abs() / (SLACK + sided[hit.surface]);
            let color = own.color / (0.5 * SLACK + usual.color[hit.surface]);
            (brightness * brightness + COLOR_WEIGHT * color * color).sqrt()
        })
        .collect();
    let odd = islands::median(&odd, view.size(), 1);
    (odd.into_iter().zip(compared))
        .map(|(odd, own)| {
            let evidence = ((odd + 0.2) / 1.2).ln().clamp(-1.5, 2.0);
            match own.count {
                0 | 1 => 0.0,
                // Of two that disagree nobody knows which is right.
                2 => 0.5 * evidence,
                _ => evidence,
            }
        })
        .collect()
}
