//! Reads the patches of a chart in a photograph, and checks whether they are those of this chart.

use glam::{DVec2, Vec2};

use super::color::luminances;
use super::table::{PatchReading, Table};
use crate::math::rgb::{CHANNELS, luminance};
use crate::scene::Image;

/// Points that are looked at along a side of a patch.
const SIDE: usize = 24;
/// The part of a card's sides that is looked at: clicks are off by a pixel or two.
const INNER: f64 = 0.8;
/// The same of a patch among others: tables do not say how wide the gaps are.
const INNER_OF_PATCH: f64 = 0.5;
/// Pixels that tell whether a card, or a patch among others, is one.
const ENOUGH_PIXELS: [usize; 2] = [30, 9];
/// The part of a patch that may be clipped or masked.
const MISSING: f64 = 0.02;
/// The largest spread, and what of the brightest patch's radiance is added to it: noise and stray
/// light are a large part of what is read in a dark patch.
const UNEVEN: f64 = 0.1;
const UNEVEN_OF_BRIGHTEST: f64 = 0.01;
/// Fewer patches do not tell how a chart lies.
const ENOUGH_PATCHES: usize = 6;
/// The correlation of ln radiance and ln reflectance, what changes evenly over the chart apart, from
/// which on it is the chart; a wrong response or other primaries leave more than 0.9.
const CORRELATED: f64 = 0.8;
/// By how much more another arrangement must explain than the one that is given.
const BETTER: f64 = 0.5;
/// How far a patch's luminance may be off that of the table, the others being as it says; in parts of
/// white.
const OFF: f64 = 0.15;
/// Reflectances and radiances below these parts of white are of noise.
const DARKEST: f64 = 0.01;

/// Reads the patches of a chart between its corners: those that the table begins and goes on with,
/// row by row. A card may begin with any corner and go either way round.
///
/// # Errors
/// What is wrong, for a person: the outline, what is hidden or burnt out, or that it is no such chart.
pub fn read(
    image: &Image,
    table: &Table,
    corners_px: [DVec2; 4],
) -> Result<Vec<PatchReading>, String> {
    outline(corners_px)?;
    let size = DVec2::new(image.width() as f64, image.height() as f64);
    let is_outside =
        |corner: &&DVec2| !(corner.cmpge(DVec2::ZERO).all() && corner.cmple(size).all());
    if let Some(corner) = corners_px.iter().find(is_outside) {
        return Err(format!(
            "the corner {:.1},{:.1} is outside of the picture, which has {} x {} pixels; give a \
             photograph that shows all of it",
            corner.x, corner.y, size.x, size.y
        ));
    }
    let patches = all(image, table, corners_px);
    let named = |k: usize| match table.patches[k].name.as_str() {
        "" => "it".to_owned(),
        name => format!("\"{name}\""),
    };
    let enough = ENOUGH_PIXELS[usize::from(!table.is_card())];
    if let Some(k) = (0..patches.len()).find(|&k| patches[k].pixels < enough) {
        return Err(format!(
            "{} is too small there: {} pixels can be read, and {enough} are needed",
            named(k),
            patches[k].pixels
        ));
    }
    let worst = |of: &dyn Fn(&PatchReading) -> f64| {
        (0..patches.len()).max_by(|a, b| of(&patches[*a]).total_cmp(&of(&patches[*b]))).unwrap_or(0)
    };
    let missing = worst(&|patch| patch.missing);
    if patches[missing].missing > MISSING {
        let more = patches.iter().filter(|patch| patch.missing > MISSING).count() - 1;
        let more =
            if more > 0 { format!(", and of {more} more patches some") } else { String::new() };
        return Err(format!(
            "{:.0} % of {} is burnt out or masked{more}; give a photograph that shows all of it",
            100.0 * patches[missing].missing,
            named(missing)
        ));
    }
    check_order(image, table, corners_px, &patches)?;
    let brightest =
        if table.is_card() { 0.0 } else { patches.iter().map(brightness).fold(0.0, f64::max) };
    let excess = |patch: &PatchReading| {
        patch.spread - UNEVEN_OF_BRIGHTEST * brightest / brightness(patch).max(f64::MIN_POSITIVE)
    };
    let uneven = worst(&excess);
    if excess(&patches[uneven]) > UNEVEN {
        let what =
            if table.is_card() { "what is between the corners".into() } else { named(uneven) };
        return Err(format!(
            "{what} is uneven by {:.0} %: it is hidden in part, in the edge of a shadow, or no plain \
             card",
            100.0 * patches[uneven].spread
        ));
    }
    let bright = luminances(table, &patches).unwrap_or_default();
    let known = |k: usize| luminance(table.patches[k].reflectance);
    let off = |k: &usize| (bright[*k] - known(*k)).abs();
    if let Some(k) = (0..bright.len()).max_by(|a, b| off(a).total_cmp(&off(b)))
        && off(&k) > OFF
    {
        return Err(format!(
            "{} reflects {:.2} by the other patches and {:.2} by the table: it is hidden, in a shadow, \
             or mirrors a light",
            named(k),
            bright[k],
            known(k)
        ));
    }
    Ok(patches)
}

/// Whether corners are given as a convex outline, clockwise as it is seen.
pub(super) fn outline(corners: [DVec2; 4]) -> Result<bool, String> {
    let turns: [f64; 4] = std::array::from_fn(|k| {
        let [a, b, c] = [0, 1, 2].map(|next| corners[(k + next) % 4]);
        (b - a).perp_dot(c - b)
    });
    // y points down in photographs.
    match turns {
        turns if turns.iter().all(|&turn| turn > 0.0) => Ok(true),
        turns if turns.iter().all(|&turn| turn < 0.0) => Ok(false),
        _ => Err("its four corners are no convex outline; give them in turn".into()),
    }
}

/// Whether the patches are those of the table, in its order.
fn check_order(
    image: &Image,
    table: &Table,
    corners: [DVec2; 4],
    patches: &[PatchReading],
) -> Result<(), String> {
    if patches.len() < ENOUGH_PATCHES {
        return Ok(());
    }
    let given = likeness(table, patches);
    let others = (1..8).map(|k| arranged(corners, k));
    let best = others
        .map(|other| (likeness(table, &all(image, table, other)), other))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or((given, corners));
    if given.max(best.0) < CORRELATED {
        return Err(
            "its patches are not bright and dark as the table says, whichever way it is turned: it is \
             another chart, half hidden, or the corners are wrong"
                .into(),
        );
    }
    let left = |correlation: f64| 1.0 - correlation.max(0.0).powi(2);
    if left(best.0) < BETTER * left(given) {
        let order: Vec<String> =
            best.1.iter().map(|corner| format!("{},{}", corner.x, corner.y)).collect();
        let is_mirrored = outline(best.1)? != outline(corners)?;
        return Err(format!(
            "the chart is {} there; give its corners in the order {}",
            if is_mirrored { "mirrored" } else { "turned" },
            order.join(" ")
        ));
    }
    if !outline(corners)? {
        return Err("the chart is seen in a mirror, or the photograph is mirrored".into());
    }
    Ok(())
}

/// The corners in another of the eight ways in which a chart can lie.
fn arranged(mut corners: [DVec2; 4], way: usize) -> [DVec2; 4] {
    if way >= 4 {
        corners.reverse();
    }
    corners.rotate_left(way % 4);
    corners
}

/// How like readings are to a table, whatever the colour of the light and its even change over the
/// chart: the correlation of ln radiance and ln reflectance.
fn likeness(table: &Table, patches: &[PatchReading]) -> f64 {
    let brightest = patches.iter().flat_map(|patch| patch.mean).fold(f64::MIN_POSITIVE, f64::max);
    let places: Vec<DVec2> = (0..patches.len()).map(|k| table.centred(k)).collect();
    let [mut own, mut both, mut read] = [0.0; 3];
    for channel in 0..CHANNELS {
        let known = |k: usize| table.patches[k].reflectance[channel].max(DARKEST).ln();
        let seen = |k: usize| (patches[k].mean[channel] / brightest).max(0.1 * DARKEST).ln();
        let known = without_plane(&places, (0..patches.len()).map(known).collect());
        let seen = without_plane(&places, (0..patches.len()).map(seen).collect());
        for (known, seen) in std::iter::zip(&known, &seen) {
            own += known * known;
            both += known * seen;
            read += seen * seen;
        }
    }
    both / (own * read).sqrt().max(f64::MIN_POSITIVE)
}

/// What is left of values beside the plane that fits best; beside their mean in one row or column.
fn without_plane(places: &[DVec2], mut values: Vec<f64>) -> Vec<f64> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let columns: [&dyn Fn(&DVec2) -> f64; 3] = [&|_| 1.0, &|p| p.x, &|p| p.y];
    let project_out = |basis: &[Vec<f64>], values: &mut Vec<f64>| {
        for unit in basis {
            let part: f64 = std::iter::zip(unit, values.iter()).map(|(a, b)| a * b).sum();
            std::iter::zip(unit, values.iter_mut()).for_each(|(unit, value)| *value -= part * unit);
        }
    };
    for column in columns {
        let mut column: Vec<f64> = places.iter().map(column).collect();
        project_out(&basis, &mut column);
        let length = column.iter().map(|value| value * value).sum::<f64>().sqrt();
        if length > 1e-6 {
            column.iter_mut().for_each(|value| *value /= length);
            basis.push(column);
        }
    }
    project_out(&basis, &mut values);
    values
}

fn brightness(patch: &PatchReading) -> f64 {
    patch.mean.iter().sum()
}

fn all(image: &Image, table: &Table, corners: [DVec2; 4]) -> Vec<PatchReading> {
    (0..table.patches.len()).map(|k| patch(image, table, corners, k)).collect()
}

fn patch(image: &Image, table: &Table, corners: [DVec2; 4], index: usize) -> PatchReading {
    let [low, high] = table.place(index);
    let inner = if table.is_card() { INNER } else { INNER_OF_PATCH };
    let mut pixels: Vec<(usize, usize)> = grid(inner)
        .map(|(s, t)| low + DVec2::new(s, t) * (high - low))
        .map(|place| at(corners, place.x, place.y))
        .filter(|p| p.cmpge(DVec2::ZERO).all())
        .map(|p| (p.x as usize, p.y as usize))
        .filter(|&(x, y)| x < image.width() && y < image.height())
        .collect();
    pixels.sort_unstable();
    pixels.dedup();
    let read: Vec<(Vec2, [f32; 3])> = pixels
        .iter()
        .filter_map(|&(x, y)| Some((Vec2::new(x as f32, y as f32), image.radiance(x, y)?)))
        .collect();
    let count = read.len() as f64;
    let mean = std::array::from_fn(|channel| {
        read.iter().map(|(_, value)| f64::from(value[channel])).sum::<f64>() / count.max(1.0)
    });
    let sums: Vec<(Vec2, f32)> = read.iter().map(|(p, value)| (*p, value.iter().sum())).collect();
    PatchReading {
        mean,
        spread: unevenness(&sums),
        missing: 1.0 - count / (pixels.len() as f64).max(1.0),
        pixels: pixels.len(),
    }
}

/// The point of a card's photograph at (s, t) of its unit square: straight lines stay straight, so
/// it is by the projective map of the four corners (Heckbert 1989, Section 2.2.3).
pub(super) fn at(corners: [DVec2; 4], s: f64, t: f64) -> DVec2 {
    let [p0, p1, p2, p3] = corners;
    let (d1, d2, sum) = (p1 - p2, p3 - p2, p0 - p1 + p2 - p3);
    let divisor = d1.perp_dot(d2);
    let (g, h) = (sum.perp_dot(d2) / divisor, d1.perp_dot(sum) / divisor);
    let (a, b) = (p1 - p0 + g * p1, p3 - p0 + h * p3);
    (a * s + b * t + p0) / (g * s + h * t + 1.0)
}

/// Points over the inner part of a card.
pub(super) fn whole() -> impl Iterator<Item = (f64, f64)> {
    grid(INNER)
}

/// Points over the inner part of the unit square.
fn grid(inner: f64) -> impl Iterator<Item = (f64, f64)> {
    let place = move |k: usize| 0.5 + inner * ((k as f64 + 0.5) / SIDE as f64 - 0.5);
    (0..SIDE * SIDE).map(move |k| (place(k % SIDE), place(k / SIDE)))
}

/// RMS of what is left of values beside the plane a + b x + c y that fits best, as a part of their
/// mean; 0 of none.
fn unevenness(values: &[(Vec2, f32)]) -> f64 {
    let count = (values.len() as f64).max(1.0);
    let middle = values.iter().map(|(p, _)| p.as_dvec2()).sum::<DVec2>() / count;
    let mean = values.iter().map(|(_, value)| f64::from(*value)).sum::<f64>() / count;
    let (mut xx, mut xy, mut yy, mut right) = (0.0, 0.0, 0.0, DVec2::ZERO);
    for (p, value) in values {
        let p = p.as_dvec2() - middle;
        (xx, xy, yy) = (xx + p.x * p.x, xy + p.x * p.y, yy + p.y * p.y);
        right += p * (f64::from(*value) - mean);
    }
    let determinant = (xx * yy - xy * xy).max(f64::MIN_POSITIVE);
    let slope = DVec2::new(yy * right.x - xy * right.y, xx * right.y - xy * right.x) / determinant;
    let left = |(p, value): &(Vec2, f32)| {
        (f64::from(*value) - mean - slope.dot(p.as_dvec2() - middle)).powi(2)
    };
    (values.iter().map(left).sum::<f64>() / count).sqrt() / mean.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::math::rgb::Rgb;

    #[test]
    fn the_square_is_mapped_as_a_camera_sees_it() {
        // A square in a plane through a pinhole: x / z, y / z of points of the plane.
        let point =
            |s: f64, t: f64| DVec3::new(0.3 + 2.0 * s, t - 0.2 * s, 3.0 + 0.7 * s - 1.1 * t);
        let seen = |s, t| {
            let p = point(s, t);
            DVec2::new(p.x / p.z, p.y / p.z)
        };
        let corners = [seen(0.0, 0.0), seen(1.0, 0.0), seen(1.0, 1.0), seen(0.0, 1.0)];
        for (s, t) in whole() {
            assert!(at(corners, s, t).distance(seen(s, t)) < 1e-12);
        }
    }

    #[test]
    fn light_that_changes_evenly_is_even() {
        let values = |f: fn(f32, f32) -> f32| -> f64 {
            let place = |k: usize| Vec2::new((k % 20) as f32, (k / 20) as f32);
            unevenness(&(0..400).map(|k| (place(k), f(place(k).x, place(k).y))).collect::<Vec<_>>())
        };
        assert!(values(|x, y| 5.0 + 0.1 * x - 0.05 * y) < 1e-6);
        // Half of it at 1, half at 3, in strips: ± 1 about 2, of which a plane explains little.
        let striped = values(|x, _| if (x as usize).is_multiple_of(2) { 1.0 } else { 3.0 });
        assert!((striped - 0.5).abs() < 0.01, "{striped}");
    }

    #[test]
    fn what_changes_evenly_tells_nothing_of_a_chart() {
        let table = Table::color_checker();
        let readings = |of: &dyn Fn(usize) -> Rgb| -> Vec<PatchReading> {
            (0..24).map(|k| PatchReading { mean: of(k), ..Default::default() }).collect()
        };
        let lit = |k: usize| (0.8 * table.centred(k).x - 0.5 * table.centred(k).y).exp();
        let own = |k: usize| table.patches[k].reflectance.map(|r| 7.0 * lit(k) * r.max(DARKEST));
        assert!(likeness(&table, &readings(&own)) > 1.0 - 1e-9);
        assert!(likeness(&table, &readings(&|k| [lit(k); 3])).abs() < CORRELATED);
        assert!(likeness(&table, &readings(&|k| own(23 - k))) < 0.5);
    }
}
