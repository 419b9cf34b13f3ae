//! Cards and charts of known reflectance that lie on known surfaces or stand free in space: found by
//! their corners in photographs, they become surfaces of their own, which the solve then treats as any
//! other of known material.

mod color;
mod find;
mod free;
mod read;
mod table;

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2};

use crate::math::rgb::Rgb;
use crate::scene::views::offset_m;
use crate::scene::{Capture, Material, MaterialKind, Role, Surface};

pub use color::{ColorFit, Curve, fit};
pub use find::find;
pub use read::read;
pub use table::{Patch, PatchReading, Table};

/// A chart as the artist gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Of its surface and of its material.
    pub name: String,
    pub kind: ChartKind,
    pub table: Table,
    /// Where photographs show its four corners, in turn, one entry a photograph; of a chart of
    /// several patches clockwise from that of the first patch on.
    pub views: Vec<ChartView>,
    /// The lengths of the side from the first to the second corner and of the next, in metres, of one
    /// that stands free in space; `None` for one that lies on the surface behind it.
    pub size_m: Option<DVec2>,
}

/// What a chart is, as `tags.json` names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ChartKind {
    Grey,
    White,
    ColorChecker,
    /// The CSV file with its reflectances.
    Table(PathBuf),
}

/// A chart and its position in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct LaidChart {
    pub chart: Chart,
    /// Or why it cannot be used, for a person: then it adds nothing to the capture.
    pub placed: Result<Placed, String>,
}

/// A surface that a chart adds to a capture.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartSurface {
    /// Of the surface, and of its material where its reflectance is known.
    pub name: String,
    /// Counter-clockwise as seen.
    pub corners: [DVec3; 4],
    /// By how many layers it is lifted off the surface behind it.
    layers: f32,
    /// Its reflectance with the standard deviation; `None` where nothing is estimated of it.
    pub known: Option<[Rgb; 2]>,
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

/// The part of a patch's sides that its surface covers: its edges are mixed with what is beside them.
const PINNED_PART: f64 = 0.8;
/// Off the surface behind, in units of the distance by which rays start off surfaces.
const ABOVE: f32 = 5.0;
/// Triangles and vertices of the quadrilateral of a surface.
const TRIANGLES: usize = 2;
const VERTICES: usize = 4;

impl Capture {
    /// With charts whose positions are known, in place of those that it has. Each is a surface a little
    /// above the one behind it: a card one of known reflectance; a chart of several patches those that
    /// are pinned, above a surface of the whole, of which nothing is estimated. One that stands free
    /// has a back, of which nothing is estimated either.
    ///
    /// Materials must be those of the files: those of its charts are the last ones.
    pub fn with_charts(&self, charts: Arc<Vec<LaidChart>>) -> Self {
        // The same charts keep their mesh, so that it need not be copied, drawn or compared anew.
        if self.charts == charts {
            return self.clone();
        }
        let mut capture = self.without_charts();
        let above = ABOVE * offset_m(&capture);
        for surface in charts.iter().flat_map(LaidChart::surfaces) {
            add(&mut capture, surface, above);
        }
        capture.charts = charts;
        capture
    }

    /// As its files would be read without charts.
    fn without_charts(&self) -> Self {
        let mut capture = self.clone();
        let count = surfaces(&capture.charts).len();
        capture.charts = Arc::default();
        if count == 0 {
            return capture;
        }
        let stays = capture.surfaces.len() - count;
        capture.surfaces.truncate(stays);
        capture
            .materials
            .retain(|own| own.surfaces.is_empty() || own.surfaces.iter().any(|&own| own < stays));
        let mesh = Arc::make_mut(&mut capture.mesh);
        let triangles = mesh.triangles.len() - TRIANGLES * count;
        mesh.positions.truncate(mesh.positions.len() - VERTICES * count);
        mesh.triangles.truncate(triangles);
        mesh.surface.truncate(triangles);
        mesh.polygon.truncate(triangles);
        mesh.texcoords.truncate(triangles);
        capture
    }
}

/// The surfaces that charts add to a capture, in their order there.
pub fn surfaces(charts: &[LaidChart]) -> Vec<ChartSurface> {
    charts.iter().flat_map(LaidChart::surfaces).collect()
}

impl LaidChart {
    /// The surfaces that it adds to a capture; none where it cannot be used.
    pub fn surfaces(&self) -> Vec<ChartSurface> {
        let Ok(Placed { corners, tilt_sd }) = &self.placed else { return Vec::new() };
        let (chart, pinned) = (&self.chart, self.chart.table.pinned());
        let mut surfaces = Vec::new();
        if chart.size_m.is_some() {
            let mut back = *corners;
            back.reverse();
            surfaces.push(ChartSurface {
                name: chart.name_of_back(),
                corners: back,
                layers: 1.0,
                known: None,
            });
        }
        if chart.table.is_card() {
            surfaces.push(ChartSurface {
                name: chart.name.clone(),
                corners: *corners,
                layers: 1.0,
                known: Some(chart.known(0, *tilt_sd)),
            });
            return surfaces;
        }
        surfaces.push(ChartSurface {
            name: chart.name.clone(),
            corners: *corners,
            layers: 1.0,
            known: None,
        });
        // As seen clockwise from the first patch on; they are counter-clockwise.
        let [p3, p2, p1, p0] = *corners;
        let within = |place: DVec2| {
            let (along, other) = (p0.lerp(p1, place.x), p3.lerp(p2, place.x));
            along.lerp(other, place.y)
        };
        for patch in pinned {
            let [low, high] = chart.table.place(patch);
            let (middle, half) = (0.5 * (low + high), 0.5 * PINNED_PART * (high - low));
            let signs = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
            surfaces.push(ChartSurface {
                name: chart.name_of(patch),
                corners: signs.map(|(x, y)| within(middle + half * DVec2::new(x, y))),
                layers: 2.0,
                known: Some(chart.known(patch, *tilt_sd)),
            });
        }
        surfaces
    }
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

    /// The reflectance of a patch, and its standard deviation. A tilt by an angle changes the irradiance
    /// from 45° by that part, so that the reflectance is known less well by as much.
    fn known(&self, patch: usize, tilt_sd: f64) -> [Rgb; 2] {
        let Patch { reflectance, sd, .. } = &self.table.patches[patch];
        [*reflectance, std::array::from_fn(|c| sd[c].hypot(tilt_sd * reflectance[c]))]
    }
}

/// Adds a surface of a chart, lifted by layers of a height in metres towards where its corners are
/// counter-clockwise from.
fn add(capture: &mut Capture, added: ChartSurface, above: f32) {
    let surface = capture.surfaces.len();
    let [a, b, c, d] = added.corners.map(|corner| corner.as_vec3());
    let lift = (c - a).cross(d - b).normalize_or_zero() * above * added.layers;
    let mesh = Arc::make_mut(&mut capture.mesh);
    let first = mesh.positions.len() as u32;
    let polygon = mesh.polygon.iter().max().map_or(0, |last| last + 1);
    mesh.positions.extend([a, b, c, d].map(|corner| corner + lift));
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    mesh.surface.extend([surface as u32; TRIANGLES]);
    // Two polygons: four measured points are never quite in one plane.
    mesh.polygon.extend([polygon, polygon + 1]);
    if !mesh.texcoords.is_empty() {
        mesh.texcoords.extend([[Vec2::ZERO; 3]; TRIANGLES]);
    }
    let role = added.known.map_or(Role::Untagged, |_| Role::Material(capture.materials.len()));
    let name = added.name.clone();
    capture.surfaces.push(Surface { name: added.name, role, has_texcoords: false });
    if let Some(known) = added.known {
        capture.materials.push(Material::of_chart(name, surface, known));
    }
}

impl Material {
    /// That of a surface of a chart.
    pub fn of_chart(name: String, surface: usize, [reflectance, sd]: [Rgb; 2]) -> Self {
        Self {
            name,
            kind: MaterialKind::Diffuse,
            surfaces: vec![surface],
            textured: false,
            known_diffuse: Some(reflectance),
            known_diffuse_sd: Some(sd),
        }
    }
}
