//! Cards and charts of known reflectance that lie on known surfaces or stand free in space: found by
//! their corners in photographs, they become surfaces of their own, which the solve then treats as any
//! other of known material.

mod color;
mod free;
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
    /// The lengths of the side from the first to the second corner and of the next, in metres, of one
    /// that stands free in space; `None` for one that lies on the surface behind it.
    pub size_m: Option<DVec2>,
}

/// The position of a chart in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// Its corners, counter-clockwise as seen from the cameras.
    pub corners: [DVec3; 4],
    /// Standard deviation of the direction of its normal, in radians; 0 where it lies on a surface.
    pub tilt_sd: f64,
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

/// Lays a chart onto the surface behind it, or places one of known size free in space.
///
/// # Errors
/// Why it cannot be used, for a person: then nothing is changed.
pub fn place(capture: &mut Capture, chart: &Chart) -> Result<Placed, String> {
    let pinned = chart.table.pinned();
    if pinned.is_empty() {
        return Err("none of its patches is grey, and colours are pinned by no others".into());
    }
    for name in chart.names(&pinned) {
        let is_taken = capture.materials.iter().any(|own| own.name == name)
            || capture.surfaces.iter().any(|own| own.name == name);
        if is_taken {
            return Err(format!("the name \"{name}\" is that of a material or surface"));
        }
    }
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = seen(capture, chart)?;
    let placed = match chart.size_m {
        Some(size_m) => in_space(capture, &caster, &views, size_m)?,
        None => Placed { corners: on_surfaces(capture, &caster, &views)?, tilt_sd: 0.0 },
    };
    add(capture, chart, &placed, &pinned);
    Ok(placed)
}

/// Removes the triangles of a chart that was placed. Its surfaces and materials stay, with nothing on
/// them.
pub fn take_away(capture: &mut Capture, chart: &Chart) {
    let patches = (0..chart.table.patches.len()).map(|patch| chart.name_of(patch));
    let names: Vec<String> = patches.chain([chart.name.clone(), chart.name_of_back()]).collect();
    let surfaces = &capture.surfaces;
    let stays = |surface: u32| !names.contains(&surfaces[surface as usize].name);
    Arc::make_mut(&mut capture.mesh).retain_surfaces(stays);
}

impl Chart {
    /// What the surface and the material of a patch are called.
    fn name_of(&self, patch: usize) -> String {
        match self.table.is_card() {
            true => self.name.clone(),
            false => format!("{} {}", self.name, self.table.patches[patch].name),
        }
    }

    /// The name of the back surface of a chart that stands free.
    fn name_of_back(&self) -> String {
        format!("{} back", self.name)
    }

    /// All names that it takes.
    fn names(&self, pinned: &[usize]) -> impl Iterator<Item = String> {
        let patches = pinned.iter().map(|&patch| self.name_of(patch));
        patches.chain(self.size_m.map(|_| self.name_of_back()))
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

/// Adds a chart as surfaces a little above the one behind it: a card as one of known reflectance; of
/// a chart of several patches those that are pinned, above a surface of the whole, of which nothing
/// is estimated.
///
/// One that stands free has a back, of which nothing is estimated either.
fn add(capture: &mut Capture, chart: &Chart, placed: &Placed, pinned: &[usize]) {
    let above = ABOVE * offset_m(capture);
    let &Placed { corners, tilt_sd } = placed;
    if chart.size_m.is_some() {
        let mut back = corners;
        back.reverse();
        add_untagged(capture, chart.name_of_back(), back, above);
    }
    if let &[_] = pinned
        && chart.table.is_card()
    {
        return add_pinned(capture, chart, 0, tilt_sd, corners, above);
    }
    add_untagged(capture, chart.name.clone(), corners, above);
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
        add_pinned(capture, chart, patch, tilt_sd, own, 2.0 * above);
    }
}

/// Adds a surface of which nothing is estimated.
fn add_untagged(capture: &mut Capture, name: String, corners: [DVec3; 4], above: f32) {
    let surface = capture.surfaces.len();
    add_quad(capture, surface, corners, above);
    capture.surfaces.push(Surface { name, role: Role::Untagged, has_texcoords: false });
}

/// Adds a patch as a surface of known reflectance. A tilt by an angle changes the irradiance from 45° by
/// that part, so that the reflectance is known less well by as much.
fn add_pinned(
    capture: &mut Capture,
    chart: &Chart,
    patch: usize,
    tilt_sd: f64,
    corners: [DVec3; 4],
    above: f32,
) {
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
        known_diffuse_sd: Some(std::array::from_fn(|c| {
            patch.sd[c].hypot(tilt_sd * patch.reflectance[c])
        })),
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
