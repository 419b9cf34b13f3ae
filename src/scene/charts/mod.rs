//! Cards and charts of known reflectance that lie on known surfaces: found by their corners in
//! photographs, they become surfaces of their own, which the solve then treats as any other of known
//! material.

mod color;
mod read;
mod table;

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2};

use crate::geometry::bvh::RayCaster;
use crate::scene::views::offset_m;
use crate::scene::{Camera, Capture, Material, MaterialKind, Role, Surface};

pub use color::{ColorFit, Curve, fit};
pub use read::read;
use read::{at, outline, whole};
pub use table::{Patch, PatchReading, Table};

/// A chart as the artist gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Of its surface and of its material.
    pub name: String,
    pub table: Table,
    /// Where photographs show its four corners, in turn, one entry a photograph; of a chart of
    /// several patches clockwise from that of the first patch on.
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

/// By how much of a chart's diagonal surface and corners may be off its plane.
const FLAT: f64 = 0.03;
/// By how much of a chart's diagonal photographs may disagree about a corner.
const AGREE: f64 = 0.1;
/// The part of a patch's sides that its surface covers: its edges are mixed with what is beside them.
const PINNED_PART: f64 = 0.8;
/// Off the surface behind, in units of the distance by which rays start off surfaces.
const ABOVE: f32 = 5.0;

/// Lays a chart onto the surface behind it.
///
/// # Errors
/// Why it cannot be used, for a person: then nothing is changed.
pub fn place(capture: &mut Capture, chart: &Chart) -> Result<(), String> {
    let pinned = chart.table.pinned();
    if pinned.is_empty() {
        return Err("none of its patches is grey, and colours are pinned by no others".into());
    }
    for &patch in &pinned {
        let name = chart.name_of(patch);
        let is_taken = capture.materials.iter().any(|own| own.name == name)
            || capture.surfaces.iter().any(|own| own.name == name);
        if is_taken {
            return Err(format!("the name \"{name}\" is that of a material or surface"));
        }
    }
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let corners = corners(capture, &caster, chart)?;
    add(capture, chart, corners, &pinned);
    Ok(())
}

impl Chart {
    /// What the surface and the material of a patch are called.
    fn name_of(&self, patch: usize) -> String {
        match self.table.is_card() {
            true => self.name.clone(),
            false => format!("{} {}", self.name, self.table.patches[patch].name),
        }
    }
}

/// The corners in the world, counter-clockwise as seen from the cameras; or what is wrong.
fn corners(capture: &Capture, caster: &RayCaster, chart: &Chart) -> Result<[DVec3; 4], String> {
    let mut all = Vec::new();
    for view in &chart.views {
        let photograph = &capture.photographs[view.photograph];
        let failed = |problem: String| format!("{}: {problem}", photograph.name);
        let image = photograph.image.as_ref();
        let image = image.ok_or_else(|| failed("it is no measurement of radiance".into()))?;
        read(image, &chart.table, view.corners_px).map_err(failed)?;
        let corners = turned(view.corners_px).map_err(failed)?;
        all.push(on_surface(caster, &photograph.camera, corners).map_err(failed)?);
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

/// Adds a chart as surfaces a little above the one behind it: a card as one of known reflectance; of
/// a chart of several patches those that are pinned, above a surface of the whole, of which nothing
/// is estimated.
fn add(capture: &mut Capture, chart: &Chart, corners: [DVec3; 4], pinned: &[usize]) {
    let above = ABOVE * offset_m(capture);
    if let &[_] = pinned
        && chart.table.is_card()
    {
        return add_pinned(capture, chart, 0, corners, above);
    }
    let surface = capture.surfaces.len();
    add_quad(capture, surface, corners, above);
    let role = Role::Untagged;
    capture.surfaces.push(Surface { name: chart.name.clone(), role, has_texcoords: false });
    // As seen clockwise from the first patch on; they are counter-clockwise.
    let [p3, p2, p1, p0] = corners;
    let within = |place: DVec2| {
        let (along, other) = (p0.lerp(p1, place.x), p3.lerp(p2, place.x));
        along.lerp(other, place.y)
    };
    for &patch in pinned {
        let [low, high] = chart.table.place(patch);
        let (middle, half) = (0.5 * (low + high), 0.5 * PINNED_PART * (high - low));
        let corner = |x: f64, y: f64| within(middle + half * DVec2::new(x, y));
        let [a, b, c, d] = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
        let own = [a, b, c, d].map(|(x, y)| corner(x, y));
        add_pinned(capture, chart, patch, own, 2.0 * above);
    }
}

/// Adds a patch as a surface of known reflectance.
fn add_pinned(capture: &mut Capture, chart: &Chart, patch: usize, corners: [DVec3; 4], above: f32) {
    let surface = capture.surfaces.len();
    add_quad(capture, surface, corners, above);
    let name = chart.name_of(patch);
    let role = Role::Material(capture.materials.len());
    capture.surfaces.push(Surface { name: name.clone(), role, has_texcoords: false });
    let patch = &chart.table.patches[patch];
    capture.materials.push(Material {
        name,
        kind: MaterialKind::Diffuse,
        surfaces: vec![surface],
        textured: false,
        known_diffuse: Some(patch.reflectance),
        known_diffuse_sd: Some(patch.sd),
    });
}

/// Adds a quadrilateral to the mesh, lifted towards where its corners are counter-clockwise from.
fn add_quad(capture: &mut Capture, surface: usize, corners: [DVec3; 4], above: f32) {
    let [a, b, c, d] = corners.map(|corner| corner.as_vec3());
    let lift = (c - a).cross(d - b).normalize_or_zero() * above;
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
}
