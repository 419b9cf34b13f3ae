//! The light that no lamp or sun accounts for: lobes on a sphere in a room, cells of the sky in
//! the open.

use glam::Vec3;

use crate::reconstruct::lights::{self, LightKind, LightOptions, VirtualLight, VirtualLights};
use crate::reconstruct::lobes::{self, Lobe, LobeOptions, Lobes};
use crate::reconstruct::samples::{JAMMING_DENSITY, SampleCloud};
use crate::scene::Views;
use crate::watch::{Cancelled, Watch};

/// How a background is laid out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    pub world: World,
    /// Radius of the sphere in half-diagonals of the known geometry.
    pub radius: f64,
    /// Distance between lights in half-diagonals; sky cells are as many as they would be on a
    /// sphere of that spacing.
    pub spacing: f64,
    /// Side of the grid of lobes of each light.
    pub grid: usize,
    pub exponent: f64,
    pub seed: u64,
    /// Whether known surfaces that no photograph shows may shine.
    pub surfaces: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum World {
    /// Light comes from a finite distance.
    Room,
    /// Light comes from the sky.
    Open,
}

/// Lights with their lobes.
#[derive(Clone, Debug)]
pub struct LightSet {
    pub lights: VirtualLights,
    pub lobes: Lobes,
}

impl Default for LightSet {
    fn default() -> Self {
        let lobes = Lobes { lobes: Vec::new(), first: vec![0] };
        Self { lights: VirtualLights::default(), lobes }
    }
}

impl LightSet {
    /// Adds the lights of another set after its own.
    pub fn append(&mut self, other: &Self) {
        for (index, light) in other.lights.lights.iter().enumerate() {
            let lobes: Vec<(Vec3, f32)> = other.lobes.lobes[other.lobes.of(index)]
                .iter()
                .map(|lobe| (lobe.direction, lobe.exponent))
                .collect();
            self.push(*light, &lobes);
        }
    }

    /// Adds a light with its lobes: directions and exponents.
    pub fn push(&mut self, light: VirtualLight, lobes: &[(Vec3, f32)]) {
        let index = self.lights.lights.len();
        self.lights.lights.push(light);
        self.lobes.lobes.extend(lobes.iter().map(|&(direction, exponent)| Lobe {
            light: index,
            direction,
            exponent,
        }));
        self.lobes.first.push(self.lobes.lobes.len());
    }
}

/// Places the background's lights.
pub fn place(
    views: &Views,
    cloud: &SampleCloud,
    layout: &Layout,
    watch: &Watch,
) -> Result<LightSet, Cancelled> {
    let (low, high) = views.capture.mesh.bounds().unwrap_or_default();
    let half_diagonal = 0.5 * (high - low).length();
    let spacing_m = layout.spacing * f64::from(half_diagonal);
    let options = LightOptions {
        radius_factor: layout.radius,
        spacing_factor: Some(spacing_m / f64::from(cloud.spacing_m)),
        ..LightOptions::default()
    };
    let mut placed = lights::place(views, cloud, &options, layout.seed, watch)?;
    let mut set = LightSet {
        lights: VirtualLights { lights: Vec::new(), ..placed.clone() },
        ..LightSet::default()
    };
    let surfaces: Vec<VirtualLight> =
        placed.lights.iter().filter(|light| light.kind == LightKind::Surface).copied().collect();
    placed.lights.retain(|light| light.kind == LightKind::Sphere);
    match layout.world {
        World::Room => {
            let options = LobeOptions {
                mask_px: MASK_PX,
                grid: layout.grid,
                exponent: layout.exponent,
                ..LobeOptions::default()
            };
            let chosen = lobes::choose(views, &mut placed, &options, watch)?;
            for (index, light) in placed.lights.iter().enumerate() {
                let lobes: Vec<(Vec3, f32)> = chosen.lobes[chosen.of(index)]
                    .iter()
                    .map(|lobe| (lobe.direction, lobe.exponent))
                    .collect();
                set.push(*light, &lobes);
            }
        }
        World::Open => {
            // As many as points of that distance would be on the sphere.
            let area = 4.0 * std::f64::consts::PI * layout.radius.powi(2);
            let count = (JAMMING_DENSITY * area / layout.spacing.powi(2)).round();
            let count = count.max(12.0) as usize;
            // A cone with a cell's share of the sphere.
            let half_angle = 2.0 * (1.0 / count as f32).sqrt().asin();
            for direction in fibonacci(count, layout.seed as f32) {
                set.push(
                    VirtualLight::distant(LightKind::Sky, direction, half_angle),
                    &[(direction, 0.0)],
                );
            }
        }
    }
    // A known surface is taken to be diffuse: it sends the same radiance everywhere, and E
    // cosⁿ times k, which lacks the emitter's cosine, is that for n = 1.
    for light in surfaces.into_iter().filter(|_| layout.surfaces) {
        set.push(light, &[(light.normal, 1.0)]);
    }
    Ok(set)
}

/// Pixels along the side of a coverage mask; its grid has at most a quarter of that.
const MASK_PX: usize = 48;

/// `count` unit vectors evenly spread over the sphere, turned about z.
pub fn fibonacci(count: usize, turn: f32) -> impl Iterator<Item = Vec3> {
    let golden = std::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    (0..count).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f32 / count as f32;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let angle = golden * k as f32 + turn;
        Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
    })
}
