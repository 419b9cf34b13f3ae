//! The positions of charts in the world, from their corners in photographs.

use std::cell::LazyCell;
use std::collections::BTreeSet;

use glam::{DVec2, DVec3};

use crate::geometry::bvh::RayCaster;
use crate::scene::charts::read::{at, outline, whole};
use crate::scene::charts::{Chart, ChartView, LaidChart, Placed, free, read};
use crate::scene::{Camera, Capture};

/// By how much of a chart's diagonal surface and corners may be off its plane.
const FLAT: f64 = 0.03;
/// By how much of a chart's diagonal photographs may disagree about a corner.
const AGREE: f64 = 0.1;

/// Lays charts onto the surfaces behind them, or places those of known size free in space. `capture`
/// is as its files say, without these charts.
pub fn find(capture: &Capture, charts: Vec<Chart>) -> Vec<LaidChart> {
    if charts.is_empty() {
        return Vec::new();
    }
    let bare = capture.without_charts();
    let caster = LazyCell::new(|| RayCaster::build(&bare.mesh.positions, &bare.mesh.triangles));
    let surfaces = bare.surfaces.iter().map(|own| own.name.clone());
    let materials = bare.materials.iter().map(|own| own.name.clone());
    let mut taken: BTreeSet<String> = surfaces.chain(materials).collect();
    let laid = |chart: Chart| {
        let placed = place(&bare, &caster, &chart);
        let mut laid = LaidChart { chart, placed };
        let names: Vec<String> = laid.surfaces().into_iter().map(|own| own.name).collect();
        match names.iter().find(|name| taken.contains(*name)) {
            Some(name) => {
                laid.placed = Err(format!("the name \"{name}\" is that of a material or surface"));
            }
            None => taken.extend(names),
        }
        laid
    };
    charts.into_iter().map(laid).collect()
}

/// The position of one chart; or why it cannot be used, for a person.
fn place(
    capture: &Capture,
    caster: &LazyCell<RayCaster, impl FnOnce() -> RayCaster>,
    chart: &Chart,
) -> Result<Placed, String> {
    if chart.table.pinned().is_empty() {
        return Err("none of its patches is grey, and colours are pinned by no others".into());
    }
    if chart.views.is_empty() {
        return Err("its corners are given in no photograph".into());
    }
    let views = seen(capture, chart)?;
    match chart.size_m {
        Some(size_m) => in_space(capture, caster, &views, size_m),
        None => Ok(Placed { corners: on_surfaces(capture, caster, &views)?, tilt_sd: 0.0 }),
    }
}

/// Its views with the corners counter-clockwise as seen; or why one cannot be read.
fn seen(capture: &Capture, chart: &Chart) -> Result<Vec<ChartView>, String> {
    let of = |view: &ChartView| {
        let photograph = &capture.photographs[view.photograph];
        let failed = |problem: String| format!("{}: {problem}", photograph.name);
        let image = photograph.image.as_ref();
        let image = image.ok_or_else(|| failed("it is no measurement of radiance".into()))?;
        read(image, &chart.table, view.corners_px).map_err(failed)?;
        Ok(ChartView { corners_px: turned(view.corners_px).map_err(failed)?, ..*view })
    };
    chart.views.iter().map(of).collect()
}

/// Where a card of known size stands; no known surface may be in front of it.
fn in_space(
    capture: &Capture,
    caster: &RayCaster,
    views: &[ChartView],
    size_m: DVec2,
) -> Result<Placed, String> {
    let seen = |view: &ChartView| free::Seen {
        camera: &capture.photographs[view.photograph].camera,
        corners_px: view.corners_px,
    };
    let placed = free::pose(&views.iter().map(seen).collect::<Vec<_>>(), size_m)?;
    let [a, b, c, d] = placed.corners;
    for view in views {
        let photograph = &capture.photographs[view.photograph];
        for (s, t) in whole() {
            let point = a.lerp(b, s).lerp(d.lerp(c, s), t);
            let pixel = photograph.camera.place(point);
            let Some(ray) = pixel.and_then(|pixel| photograph.camera.ray(pixel)) else { continue };
            let distance = point.distance(photograph.camera.position);
            let Some(hit) = caster.closest(&ray) else { continue };
            if f64::from(hit.t) < distance {
                return Err(format!(
                    "{}: a known surface is {:.1} cm in front of it; check its size, or leave the size \
                     out for a card that lies on a known surface",
                    photograph.name,
                    100.0 * (distance - f64::from(hit.t))
                ));
            }
        }
    }
    Ok(placed)
}

/// The corners in the world, on the known surface behind each photograph's; or what is wrong.
fn on_surfaces(
    capture: &Capture,
    caster: &RayCaster,
    views: &[ChartView],
) -> Result<[DVec3; 4], String> {
    let mut all = Vec::new();
    for view in views {
        let photograph = &capture.photographs[view.photograph];
        let found = on_surface(caster, &photograph.camera, view.corners_px);
        all.push(found.map_err(|problem| format!("{}: {problem}", photograph.name))?);
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
    if outline(corners)? {
        corners.reverse();
    }
    Ok(corners)
}

/// Where the corners meet the known surface, which must be flat between them.
fn on_surface(
    caster: &RayCaster,
    camera: &Camera,
    corners: [DVec2; 4],
) -> Result<[DVec3; 4], String> {
    let met = |pixel: DVec2| {
        let ray = camera.ray(pixel)?;
        caster.closest(&ray).map(|hit| (ray.origin + ray.direction * hit.t).as_dvec3())
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
    for (s, t) in whole() {
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
