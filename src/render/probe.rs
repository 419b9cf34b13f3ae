//! Light probes: the radiance that arrives at a point from all directions.
//!
//! Their axes are those of a [`Dome`](crate::scene::Dome): z is up, the left edge looks along +y,
//! and to the right follow +x, −y (the middle) and −x.
//!
//! The irradiance of a recovered light is known better than its shape. Each light is drawn as the
//! disc, ball or cone of its model, with a constant radiance whose integral over the probe is the
//! light that the path tracer computes at the point. A light that is smaller than a pixel is added
//! to the pixel that contains its middle.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::geometry::bvh::Ray;
use crate::math::latlong;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::reconstruct::lights::{LightKind, VirtualLight};

use crate::render::film::Buffer;
use crate::render::path::Sequence;
use crate::render::scene::Scene;
use crate::scene::{Emitter, SurfacePoint};
use crate::watch::{Cancelled, Watch};

/// An image of all directions; see the module for its axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Twice the height.
    pub width: usize,
    pub height: usize,
    pub texels: Vec<Radiance>,
}

/// How a probe is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProbeSettings {
    pub width: usize,
    /// Paths per pixel.
    pub spp: usize,
    pub reflections: usize,
    pub seed: u64,
}

impl Default for ProbeSettings {
    fn default() -> Self {
        Self { width: 512, spp: 64, reflections: 16, seed: 1 }
    }
}

/// What a probe shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// All that arrives, from surfaces and from lights.
    Everything,
    /// Broad recovered lights and domes alone with nothing in front of them: for a scene that has
    /// the surfaces, and lamps, suns and added lights, in some other way.
    Background,
}

impl Probe {
    fn new(width: usize) -> Self {
        let height = width.div_ceil(2).max(1);
        let width = 2 * height;
        Self { width, height, texels: vec![[0.0; CHANNELS]; width * height] }
    }

    /// The direction of a place in pixels, v down.
    pub fn direction(&self, place: Vec2) -> Vec3 {
        latlong::direction(place / Vec2::new(self.width as f32, self.height as f32))
    }

    /// The pixel that a direction falls into.
    fn index(&self, direction: Vec3) -> usize {
        let (x, y) = latlong::cell(direction, (self.width, self.height));
        y * self.width + x
    }

    /// Of a pixel of a row, in sr.
    pub fn solid_angle(&self, row: usize) -> f32 {
        let edge = |row: usize| (row as f64 / self.height as f64 * std::f64::consts::PI).cos();
        ((edge(row) - edge(row + 1)) * std::f64::consts::TAU / self.width as f64) as f32
    }

    /// Irradiance of a surface of that normal, by the pixels' middles.
    pub fn irradiance(&self, normal: Vec3) -> [f64; CHANNELS] {
        let mut sum = [0.0; CHANNELS];
        for (index, texel) in self.texels.iter().enumerate() {
            let (x, y) = (index % self.width, index / self.width);
            let direction = self.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
            let weight = f64::from(direction.dot(normal).max(0.0) * self.solid_angle(y));
            for (sum, value) in sum.iter_mut().zip(texel) {
                *sum += weight * f64::from(*value);
            }
        }
        sum
    }
}

/// The light that arrives at a point.
pub fn probe(
    scene: &Scene,
    position: Vec3,
    content: Content,
    settings: &ProbeSettings,
    watch: &Watch,
) -> Result<Probe, Cancelled> {
    let mut probe = Probe::new(settings.width);
    let sources = sources(scene, content);
    watch.begin((probe.height * (1 + sources.len())) as u64);
    arriving_from_surfaces(scene, position, content, settings, &mut probe, watch)?;
    for source in &sources {
        let Some(power) = source.power(position) else { continue };
        let (covered, whole) = cover(&probe, source, scene, position, content, watch)?;
        if whole > 0.0 {
            let even = |value: f32| value / whole;
            for (index, part) in covered {
                let share = part / probe.solid_angle(index / probe.width);
                for (sum, value) in probe.texels[index].iter_mut().zip(power.map(even)) {
                    *sum += value * share;
                }
            }
        } else {
            let direction = source.direction(position);
            if content == Content::Background || source.is_free(scene, position, direction, None) {
                let index = probe.index(direction);
                let solid_angle = probe.solid_angle(index / probe.width);
                for (sum, value) in probe.texels[index].iter_mut().zip(power) {
                    *sum += value / solid_angle;
                }
            }
        }
    }
    Ok(probe)
}

/// What paths bring; of the background only domes.
fn arriving_from_surfaces(
    scene: &Scene,
    position: Vec3,
    content: Content,
    settings: &ProbeSettings,
    probe: &mut Probe,
    watch: &Watch,
) -> Result<(), Cancelled> {
    let (width, height) = (probe.width, probe.height);
    let layers = scene.layers;
    let sought = scene.all_lights();
    let edge = |row: usize| (row as f32 / height as f32 * PI).cos();
    probe.texels.par_chunks_exact_mut(width).enumerate().try_for_each(|(y, row)| {
        watch.tick()?;
        let mut buffer = Buffer::new(layers);
        let (top, bottom) = (edge(y), edge(y + 1));
        for (x, texel) in row.iter_mut().enumerate() {
            for index in 0..settings.spp.max(1) as u64 {
                let mut sequence = Sequence::new(settings.seed, (y * width + x) as u64, index);
                let part = sequence.point();
                // Even by solid angle.
                let z = top + part.y * (bottom - top);
                let azimuth = (x as f32 + part.x) / width as f32 * TAU;
                let across = (1.0 - z * z).max(0.0).sqrt();
                let direction = Vec3::new(across * azimuth.sin(), across * azimuth.cos(), z);
                let ray = Ray { origin: position, direction, t_min: 0.0, t_max: f32::INFINITY };
                let arriving = match content {
                    Content::Everything => {
                        let gathered = buffer.clear();
                        let most = settings.reflections;
                        scene.incident(ray, most, &mut sequence, &sought, gathered);
                        buffer.sum()
                    }
                    Content::Background => scene.domes(direction),
                };
                for (sum, value) in texel.iter_mut().zip(arriving) {
                    *sum += value;
                }
            }
            *texel = texel.map(|sum| sum / settings.spp.max(1) as f32);
        }
        Ok(())
    })
}

/// A light that no path meets.
enum Source<'a> {
    Recovered(&'a crate::render::lights::Light, f32),
    Emitter(Emitter, Radiance),
}

fn sources<'a>(scene: &'a Scene, content: Content) -> Vec<Source<'a>> {
    let factor = scene.original_light;
    let recovered = scene.recovered.lights().iter().filter(|light| match content {
        Content::Everything => true,
        Content::Background => is_broad(light.shape.kind),
    });
    let mut sources: Vec<Source> = recovered
        .map(|light| match light.emitter {
            Some(emitter) => Source::Emitter(emitter, light.lobes[0].1.map(|value| value * factor)),
            None => Source::Recovered(light, factor),
        })
        .collect();
    if content == Content::Everything {
        for added in &scene.added {
            // Paths meet the others.
            if let Some(
                emitter @ (Emitter::Point { .. } | Emitter::Spot { .. } | Emitter::Sun { .. }),
            ) = added.emitter()
            {
                sources.push(Source::Emitter(emitter, added.emission));
            }
        }
    }
    sources
}

/// Lights that represent all of the unmodelled surroundings rather than a luminaire.
pub fn is_broad(kind: LightKind) -> bool {
    matches!(kind, LightKind::Sphere | LightKind::Surface | LightKind::Sky)
}

/// Points of an emitter's square, along a side, by which its solid angle is found.
const SIDE: usize = 32;

impl Source<'_> {
    /// The integral of radiance over the directions that it comes from.
    fn power(&self, position: Vec3) -> Option<Radiance> {
        match self {
            Self::Recovered(light, factor) => {
                let arriving = light.facing(position)?;
                Some(arriving.irradiance.map(|value| value * factor))
            }
            Self::Emitter(emitter, emission) => {
                let point = SurfacePoint { position, normal: emitter.direction_from(position) };
                let strengths = (0..SIDE * SIDE).map(|k| {
                    let square = Vec2::new((k % SIDE) as f32 + 0.5, (k / SIDE) as f32 + 0.5);
                    let arrival = emitter.arrival(point, 0.0, square / SIDE as f32);
                    arrival.map_or(0.0, |arrival| f64::from(arrival.strength))
                });
                let strength = (strengths.sum::<f64>() / (SIDE * SIDE) as f64) as f32;
                Some(emission.map(|value| value * strength)).filter(|_| strength > 0.0)
            }
        }
    }

    fn direction(&self, position: Vec3) -> Vec3 {
        match self {
            Self::Recovered(light, _) => light.shape.direction_from(position),
            Self::Emitter(emitter, _) => emitter.direction_from(position),
        }
    }

    /// The distance at which a direction meets the light; infinite for one at infinity.
    fn met(&self, position: Vec3, direction: Vec3) -> Option<f32> {
        let within = |towards: Vec3, half_angle: f32| {
            (direction.angle_between(towards) <= half_angle).then_some(f32::INFINITY)
        };
        match self {
            Self::Recovered(light, _) => {
                let VirtualLight { position: place, normal, radius_m, half_angle, .. } =
                    light.shape;
                if light.shape.is_distant() {
                    return within(-normal, half_angle);
                }
                let offset = place - position;
                let facing = match light.shape.kind {
                    LightKind::Lamp => offset.normalize_or_zero(),
                    _ => normal,
                };
                let along = offset.dot(facing) / direction.dot(facing);
                let off = position + direction * along - place;
                (along > 0.0 && off.length() <= radius_m).then_some(along)
            }
            Self::Emitter(Emitter::Sun { direction: travels, angular_diameter }, _) => {
                within(-*travels, 0.5 * angular_diameter)
            }
            Self::Emitter(emitter, _) => {
                let point = SurfacePoint { position, normal: direction };
                emitter.met(point, direction).map(|(along, _)| along)
            }
        }
    }

    fn is_free(&self, scene: &Scene, position: Vec3, direction: Vec3, along: Option<f32>) -> bool {
        let views = &scene.geometry;
        let point = SurfacePoint { position, normal: direction };
        let along = along.unwrap_or_else(|| match self {
            Self::Recovered(light, _) if light.shape.is_distant() => f32::INFINITY,
            Self::Recovered(light, _) => light.shape.position.distance(position),
            Self::Emitter(Emitter::Sun { .. }, _) => f32::INFINITY,
            Self::Emitter(emitter, _) => emitter.extent().0.distance(position),
        });
        if along.is_finite() {
            views.is_free(point, position + direction * along)
        } else {
            !views.caster.occluded(&views.ray(point, direction))
        }
    }
}

/// Places within a pixel, along a side, at which a light is looked for.
const FINE: usize = 4;

/// The pixels where a light is seen, with the solid angle of the part of each where it is, and the
/// solid angle of all of it, seen or hidden.
fn cover(
    probe: &Probe,
    source: &Source,
    scene: &Scene,
    position: Vec3,
    content: Content,
    watch: &Watch,
) -> Result<(Vec<(usize, f32)>, f32), Cancelled> {
    let rows: Vec<(Vec<(usize, f32)>, f32)> = (0..probe.height)
        .into_par_iter()
        .map(|y| {
            watch.tick()?;
            let solid_angle = probe.solid_angle(y) / (FINE * FINE) as f32;
            let (mut covered, mut whole) = (Vec::new(), 0.0);
            for x in 0..probe.width {
                let mut part = 0.0;
                for k in 0..FINE * FINE {
                    let fine = Vec2::new((k % FINE) as f32 + 0.5, (k / FINE) as f32 + 0.5);
                    let place = Vec2::new(x as f32, y as f32) + fine / FINE as f32;
                    let direction = probe.direction(place);
                    let Some(along) = source.met(position, direction) else { continue };
                    whole += solid_angle;
                    if content == Content::Background
                        || source.is_free(scene, position, direction, Some(along))
                    {
                        part += solid_angle;
                    }
                }
                if part > 0.0 {
                    covered.push((y * probe.width + x, part));
                }
            }
            Ok((covered, whole))
        })
        .collect::<Result<_, Cancelled>>()?;
    let whole = rows.iter().map(|(_, whole)| whole).sum();
    Ok((rows.into_iter().flat_map(|(covered, _)| covered).collect(), whole))
}
