//! The difference of each pixel from the radiance of its surface point in most photographs, or, where
//! no other photograph shows the point, from the usual colour of its surface.

use super::small::SmallView;
use super::{FEWEST, islands};
use crate::math::rgb::{CHANNELS, Radiance};
use crate::scene::{MaterialKind, Role, Views};
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
/// Factor on evidence that may have another reason: of two photographs that disagree, nobody knows
/// which is right; the colour of a surface may vary; and most photographs may show a highlight.
const DOUBTFUL: f32 = 0.5;

/// One pixel beside the other photographs of its point.
#[derive(Clone, Copy)]
pub(super) struct Compared {
    /// Photographs that measure the point, its own included.
    pub count: usize,
    /// Mean over the channels of the median difference of own logarithm from the others, less what is
    /// usual for the photograph.
    pub brightness: f32,
    /// How far a channel's difference is from that, at most.
    pub color: f32,
}

/// What is usual for one surface.
pub(super) struct Usual {
    /// The differences between photographs of it.
    brighter: f32,
    darker: f32,
    color: f32,
    /// Its median colour, and how far its colours usually are from that.
    median: Radiance,
    from_median: f32,
    /// Whether it is tagged as specular.
    is_specular: bool,
}

/// The logarithm of a radiance without its mean over the channels.
fn color(log: Radiance) -> Radiance {
    let mean = log.iter().sum::<f32>() / CHANNELS as f32;
    log.map(|own| own - mean)
}

/// How far a channel's logarithm is from that of another colour, at most.
fn color_difference(a: Radiance, b: Radiance) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
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
    let mut differences: Vec<Radiance> = Vec::new();
    let one = |index: usize| {
        let Some(hit) = own.points[index].filter(|_| own.is_valid[index]) else {
            return (0, [0.0; CHANNELS]);
        };
        differences.clear();
        differences.push([0.0; CHANNELS]);
        for &other in &others {
            let buffer = &views.buffers[other];
            let Some(_) = views.seen(buffer, hit.point) else { continue };
            let Some((place, _)) = buffer.camera.project(hit.point.position.as_dvec3()) else {
                continue;
            };
            differences.extend(small[other].beyond(place, own.log[index]));
        }
        let residual =
            |channel: usize| median(differences.iter().map(|own| own[channel]).collect());
        (differences.len(), std::array::from_fn(residual))
    };
    let residuals: Vec<(usize, Radiance)> = (0..own.points.len()).map(one).collect();
    // The whole photograph may be exposed differently.
    let exposure: Radiance = std::array::from_fn(|channel| {
        let compared = residuals.iter().filter(|(count, _)| *count >= FEWEST);
        median(compared.map(|(_, residual)| residual[channel]).collect())
    });
    let compared = |(count, residual): (usize, Radiance)| {
        // The median of two differences, of which its own is 0, is half of the other.
        let part = [0.0, 0.0, 0.5].get(count).copied().unwrap_or(1.0);
        let residual: Radiance =
            std::array::from_fn(|channel| residual[channel] - part * exposure[channel]);
        let brightness = residual.iter().sum::<f32>() / CHANNELS as f32;
        let color = color_difference(residual, [brightness; CHANNELS]);
        Compared { count, brightness, color }
    };
    Ok(residuals.into_iter().map(compared).collect())
}

/// 0 of nothing.
fn median(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => 0.0,
        odd if odd % 2 == 1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}

/// What is usual for each surface: of the differences, from the points that enough photographs show.
pub(super) fn usual(views: &Views, small: &[SmallView], compared: &[Vec<Compared>]) -> Vec<Usual> {
    let capture = views.capture;
    let mut brightness = vec![Vec::new(); capture.surfaces.len()];
    let mut difference = brightness.clone();
    let mut colors = vec![Vec::new(); capture.surfaces.len()];
    for (view, compared) in small.iter().zip(compared) {
        for (index, own) in compared.iter().enumerate().step_by(3) {
            let Some(hit) = view.points[index].filter(|_| own.count > 0) else { continue };
            colors[hit.surface].push(color(view.log[index]));
            if own.count >= FEWEST {
                brightness[hit.surface].push(own.brightness);
                difference[hit.surface].push(own.color);
            }
        }
    }
    // A surface that too few photographs see is one of which nothing is known to be odd.
    let of = |values: Vec<f32>, part: f64| quantile(values, part).unwrap_or(1.0);
    (capture.surfaces.iter().zip(brightness).zip(difference).zip(colors))
        .map(|(((surface, brightness), difference), colors)| {
            let sided = |sign: f32| {
                let values = brightness.iter().map(|own| (sign * own).max(0.0)).collect();
                of(values, USUAL_BRIGHTNESS)
            };
            let channel = |c: usize| colors.iter().map(|own| own[c]).collect();
            let median = std::array::from_fn(|c| of(channel(c), 0.5));
            let from_median = colors.iter().map(|&own| color_difference(own, median)).collect();
            let is_specular = matches!(surface.role, Role::Material(material)
                if capture.materials[material].kind == MaterialKind::Specular);
            Usual {
                brighter: sided(1.0),
                darker: sided(-1.0),
                color: of(difference, USUAL_COLOR),
                median,
                from_median: of(from_median, USUAL_COLOR),
                is_specular,
            }
        })
        .collect()
}

fn quantile(mut values: Vec<f32>, part: f64) -> Option<f32> {
    values.sort_by(f32::total_cmp);
    let last = values.len().saturating_sub(1) as f64;
    values.get((part * last).round() as usize).copied()
}

/// For each pixel the evidence that something stands before its surface: negative where it agrees,
/// 0 where nothing can be said.
pub(super) fn evidence(view: &SmallView, compared: &[Compared], usual: &[Usual]) -> Vec<f32> {
    let odd: Vec<f32> = (view.points.iter().zip(compared).enumerate())
        .map(|(index, (hit, own))| {
            let Some(hit) = hit.filter(|_| own.count > 0) else { return 0.0 };
            let usual = &usual[hit.surface];
            if own.count == 1 {
                let apart = color_difference(color(view.log[index]), usual.median);
                return COLOR_WEIGHT.sqrt() * apart / (0.5 * SLACK + usual.from_median);
            }
            let sided = if own.brightness > 0.0 { usual.brighter } else { usual.darker };
            let brightness = own.brightness.abs() / (SLACK + sided);
            let color = own.color / (0.5 * SLACK + usual.color);
            (brightness * brightness + COLOR_WEIGHT * color * color).sqrt()
        })
        .collect();
    let odd = islands::median(&odd, view.size(), 1);
    (odd.into_iter().zip(&view.points).zip(compared))
        .map(|((odd, hit), own)| {
            let evidence = ((odd + 0.2) / 1.2).ln().clamp(-1.5, 2.0);
            let is_specular = hit.is_some_and(|hit| usual[hit.surface].is_specular);
            match own.count {
                0 => 0.0,
                // A thing may have the colour of the surface behind it.
                1 => DOUBTFUL * evidence.max(0.0),
                2 => DOUBTFUL * evidence,
                // It may show a highlight.
                _ if is_specular && own.brightness > 0.0 => evidence.min(0.0),
                _ if is_specular => DOUBTFUL * evidence,
                _ => evidence,
            }
        })
        .collect()
}
