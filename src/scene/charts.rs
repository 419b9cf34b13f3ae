//! Cards of known reflectance that lie on known surfaces: found by their corners in photographs,
//! they become surfaces of their own, which the solve then treats as any other of known material.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2};

use crate::geometry::bvh::{Ray, RayCaster};
use crate::math::rgb::Rgb;
use crate::scene::views::offset_m;
use crate::scene::{Camera, Capture, Image, Material, MaterialKind, Role, Surface};

/// A card as the artist gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Of its surface and of its material.
    pub name: String,
    pub known_diffuse: Rgb,
    /// Standard deviation of the reflectance.
    pub known_diffuse_sd: Rgb,
    /// Where photographs show its four corners, in turn, one entry a photograph.
    pub views: Vec<ChartView>,
}

/// A card in a photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartView {
    /// Index into `Capture::photographs`.
    pub photograph: usize,
    /// In pixels from the photograph's corner.
    pub corners_px: [DVec2; 4],
}

/// Points that are looked at along a side of a card.
const SIDE: usize = 24;
/// The part of a card's sides that is looked at: clicks are off by a pixel or two.
const INNER: f64 = 0.8;
/// By how much of the card's diagonal surface and corners may be off its plane.
const FLAT: f64 = 0.03;
/// By how much of the card's diagonal photographs may disagree about a corner.
const AGREE: f64 = 0.1;
/// Pixels that tell whether a card is one.
const ENOUGH_PIXELS: usize = 30;
/// The part of a card that may be clipped or masked.
const UNREAD: f64 = 0.02;
/// The largest deviation, as a part of the mean, from light that changes evenly over the card.
const UNEVEN: f64 = 0.1;
/// Off the surface behind, in units of the distance by which rays start off surfaces.
const ABOVE: f32 = 5.0;

/// Lays a card onto the surface behind it.
///
/// # Errors
/// Why it cannot be used, for a person: then nothing is changed.
pub fn place(capture: &mut Capture, chart: &Chart) -> Result<(), String> {
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let corners = corners(capture, &caster, chart)?;
    add(capture, chart, corners);
    Ok(())
}

/// The corners in the world, counter-clockwise as seen from the cameras; or what is wrong.
fn corners(capture: &Capture, caster: &RayCaster, chart: &Chart) -> Result<[DVec3; 4], String> {
    let mut all = Vec::new();
    for view in &chart.views {
        let photograph = &capture.photographs[view.photograph];
        let failed = |problem: String| format!("{}: {problem}", photograph.name);
        let image = photograph.image.as_ref();
        let image = image.ok_or_else(|| failed("it is no measurement of radiance".into()))?;
        let corners = turned(view.corners_px).map_err(failed)?;
        all.push(on_surface(caster, &photograph.camera, corners).map_err(failed)?);
        check_pixels(image, corners).map_err(failed)?;
    }
    // One photograph may be turned against another: its corners begin with another one.
    let first = all[0];
    let diagonal = first[0].distance(first[2]);
    let mut sum = first;
    for other in &all[1..] {
        let off = |turn: usize| -> f64 {
            (0..4).map(|k| first[k].distance(other[(k + turn) % 4])).fold(0.0, f64::max)
        };
        let turn = (0..4).min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(0);
        if off(turn) > AGREE * diagonal {
            return Err(format!(
                "its photographs put a corner {:.1} cm apart; check the corners and the cameras",
                100.0 * off(turn)
            ));
        }
        for k in 0..4 {
            sum[k] += other[(k + turn) % 4];
        }
    }
    Ok(sum.map(|corner| corner / all.len() as f64))
}

/// The corners counter-clockwise as they are seen (y points down in photographs).
fn turned(mut corners: [DVec2; 4]) -> Result<[DVec2; 4], String> {
    let turns: [f64; 4] = std::array::from_fn(|k| {
        let [a, b, c] = [0, 1, 2].map(|next| corners[(k + next) % 4]);
        (b - a).perp_dot(c - b)
    });
    if turns.iter().all(|&turn| turn > 0.0) {
        corners.reverse();
    } else if !turns.iter().all(|&turn| turn < 0.0) {
        return Err("its four corners are no convex outline; give them in turn".into());
    }
    Ok(corners)
}

/// The point of a card's photograph at (s, t) of its unit square: straight lines stay straight, so
/// it is by the projective map of the four corners (Heckbert 1989, Section 2.2.3).
fn at(corners: [DVec2; 4], s: f64, t: f64) -> DVec2 {
    let [p0, p1, p2, p3] = corners;
    let (d1, d2, sum) = (p1 - p2, p3 - p2, p0 - p1 + p2 - p3);
    let divisor = d1.perp_dot(d2);
    let (g, h) = (sum.perp_dot(d2) / divisor, d1.perp_dot(sum) / divisor);
    let (a, b) = (p1 - p0 + g * p1, p3 - p0 + h * p3);
    (a * s + b * t + p0) / (g * s + h * t + 1.0)
}

/// Points over the inner part of the unit square.
fn grid() -> impl Iterator<Item = (f64, f64)> {
    let place = |k: usize| 0.5 + INNER * ((k as f64 + 0.5) / SIDE as f64 - 0.5);
    (0..SIDE * SIDE).map(move |k| (place(k % SIDE), place(k / SIDE)))
}

/// Where the corners meet the known surface, which must be flat between them.
fn on_surface(
    caster: &RayCaster,
    camera: &Camera,
    corners: [DVec2; 4],
) -> Result<[DVec3; 4], String> {
    let met = |pixel: DVec2| {
        let direction = camera.direction(pixel)?;
        let (origin, direction) = (camera.position.as_vec3(), direction.as_vec3());
        let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        caster.closest(&ray).map(|hit| (origin + direction * hit.t).as_dvec3())
    };
    let beyond = || "no known surface is behind it".to_owned();
    let [a, b, c, d] = corners.map(met);
    let [a, b, c, d] = [
        a.ok_or_else(beyond)?,
        b.ok_or_else(beyond)?,
        c.ok_or_else(beyond)?,
        d.ok_or_else(beyond)?,
    ];
    let (diagonal, middle) = (a.distance(c), (a + b + c + d) / 4.0);
    let normal = (c - a).cross(d - b).normalize_or_zero();
    let off = |point: DVec3| (point - middle).dot(normal).abs();
    let mut worst = [a, b, c, d].map(off).into_iter().fold(0.0, f64::max);
    for (s, t) in grid() {
        worst = worst.max(off(met(at(corners, s, t)).ok_or_else(beyond)?));
    }
    if worst > FLAT * diagonal {
        return Err(format!(
            "the surface behind it is not flat there: {:.1} cm off over {:.1} cm",
            100.0 * worst,
            100.0 * diagonal
        ));
    }
    Ok([a, b, c, d])
}

/// Whether the photograph shows one even thing between the corners, neither clipped nor masked.
fn check_pixels(image: &Image, corners: [DVec2; 4]) -> Result<(), String> {
    let mut pixels: Vec<(usize, usize)> = grid()
        .map(|(s, t)| at(corners, s, t))
        .filter(|p| p.cmpge(DVec2::ZERO).all())
        .map(|p| (p.x as usize, p.y as usize))
        .filter(|&(x, y)| x < image.width() && y < image.height())
        .collect();
    pixels.sort_unstable();
    pixels.dedup();
    if pixels.len() < ENOUGH_PIXELS {
        return Err(format!("it is too small there: {} pixels can be read", pixels.len()));
    }
    let read: Vec<(Vec2, f32)> = pixels
        .iter()
        .filter_map(|&(x, y)| {
            Some((Vec2::new(x as f32, y as f32), image.radiance(x, y)?.iter().sum()))
        })
        .collect();
    let unread = 1.0 - read.len() as f64 / pixels.len() as f64;
    if unread > UNREAD {
        return Err(format!(
            "{:.0} % of it is burnt out or masked; give a photograph that shows all of it",
            100.0 * unread
        ));
    }
    let uneven = unevenness(&read);
    if uneven > UNEVEN {
        return Err(format!(
            "what is between the corners is uneven by {:.0} %: it is hidden in part, in the edge of \
             a shadow, or no plain card",
            100.0 * uneven
        ));
    }
    Ok(())
}

/// RMS of what is left of values beside the plane a + b x + c y that fits best, as a part of their
/// mean.
fn unevenness(values: &[(Vec2, f32)]) -> f64 {
    let count = values.len() as f64;
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

/// Adds a card as a surface a little above the one behind it.
fn add(capture: &mut Capture, chart: &Chart, corners: [DVec3; 4]) {
    let above = ABOVE * offset_m(capture);
    let [a, b, c, d] = corners.map(|corner| corner.as_vec3());
    let lift = (c - a).cross(d - b).normalize_or_zero() * above;
    let surface = capture.surfaces.len();
    let mesh = Arc::make_mut(&mut capture.mesh);
    let first = mesh.positions.len() as u32;
    let polygon = mesh.polygon.iter().max().map_or(0, |last| last + 1);
    mesh.positions.extend([a, b, c, d].map(|corner| corner + lift));
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    mesh.surface.extend([surface as u32; 2]);
    // Two polygons: four measured points are never quite in one plane.
    mesh.polygon.extend([polygon, polygon + 1]);
    if !mesh.texcoords.is_empty() {
        mesh.texcoords.extend([[Vec2::ZERO; 3]; 2]);
    }
    let role = Role::Material(capture.materials.len());
    capture.surfaces.push(Surface { name: chart.name.clone(), role, has_texcoords: false });
    capture.materials.push(Material {
        name: chart.name.clone(),
        kind: MaterialKind::Diffuse,
        surfaces: vec![surface],
        textured: false,
        known_diffuse: Some(chart.known_diffuse),
        known_diffuse_sd: Some(chart.known_diffuse_sd),
    });
}

#[cfg(test)]
mod tests {
    use super::*;

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
        for (s, t) in grid() {
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
}
