//! One of the recovered lights, in the form in which the path tracer uses it.

use glam::{Vec2, Vec3};

use crate::math::rgb::{CHANNELS, Radiance};
use crate::reconstruct::RecoveredLight;
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::reconstruct::lobes::Lobe;
use crate::reconstruct::transport::geometric_factor;
use crate::render::scene::Solved;
use crate::scene::emitter::Arrival;
use crate::scene::{Capture, Emitter, KnownLight, SurfacePoint, Views};

/// A recovered light with an emission above 0.
#[derive(Clone, Debug)]
pub struct Light {
    pub shape: VirtualLight,
    /// Of a light that the artist gave.
    pub emitter: Option<Emitter>,
    /// E per lobe; one entry for a light that the artist gave.
    pub lobes: Vec<(Lobe, Radiance)>,
    /// The layer that its light goes into.
    pub layer: usize,
}

/// Light that reaches a surface point from one direction, were nothing in the way.
#[derive(Clone, Copy, Debug)]
pub struct Arriving {
    /// Irradiance of the surface point.
    pub irradiance: Radiance,
    /// (n+2)/2 cosⁿγ per mirror direction and exponent is evaluated for this.
    pub direction: Vec3,
}

impl Light {
    /// One of the recovered lights with its emission times a factor; `None` if it is dark.
    pub fn recovered(
        capture: &Capture,
        solved: &Solved,
        index: usize,
        factor: f32,
    ) -> Option<Self> {
        let RecoveredLight { lights, lobes, emission, .. } = &solved.light;
        let shape = lights.lights[index];
        let emitter = match shape.kind {
            LightKind::Known(known) => match &capture.lights[known] {
                KnownLight::Shape { emitter, .. } => Some(*emitter),
                _ => return None,
            },
            _ => None,
        };
        let lobes: Vec<(Lobe, Radiance)> = lobes
            .of(index)
            .map(|lobe| (lobes.lobes[lobe], emission[lobe].map(|value| factor * value as f32)))
            .filter(|(_, emission)| emission.iter().any(|&value| value > 0.0))
            .collect();
        (!lobes.is_empty()).then_some(Self { shape, emitter, lobes, layer: 0 })
    }

    /// Unit direction from a position to its middle.
    pub fn direction_from(&self, position: Vec3) -> Vec3 {
        match &self.emitter {
            Some(emitter) => emitter.direction_from(position),
            None => self.shape.direction_from(position),
        }
    }

    /// Whether nothing is in the way of what [`arriving`](Self::arriving) found.
    pub fn is_free(
        &self,
        views: &Views,
        point: SurfacePoint,
        arrival: Option<Arrival>,
        square: Vec2,
    ) -> bool {
        match arrival {
            Some(arrival) => arrival.is_free(views, point),
            None => self.shape.is_seen(views, point, square),
        }
    }

    /// How many of a few points see it.
    pub fn seen_by(&self, views: &Views, points: &[SurfacePoint], squares: &[Vec2]) -> usize {
        let is_seen = |(&point, &square): (&SurfacePoint, &Vec2)| {
            let arriving = self.arriving(point, views.offset_m, square);
            arriving.is_some_and(|(_, arrival)| self.is_free(views, point, arrival, square))
        };
        points.iter().zip(squares).filter(|&pair| is_seen(pair)).count()
    }

    /// Irradiance of a surface at a position that faces the light, were nothing in the way; for a
    /// light that the artist gave the part that comes from its middle.
    pub fn facing(&self, position: Vec3) -> Option<Arriving> {
        let normal = self.direction_from(position);
        let arriving = self.arriving(SurfacePoint { position, normal }, 0.0, Vec2::splat(0.5));
        arriving.map(|(arriving, _)| arriving)
    }

    /// Light at a surface point were nothing in the way; of a light that the artist gave also the
    /// way that it takes.
    pub fn arriving(
        &self,
        point: SurfacePoint,
        least_m: f32,
        square: Vec2,
    ) -> Option<(Arriving, Option<Arrival>)> {
        let mut irradiance = [0.0; CHANNELS];
        if let Some(emitter) = &self.emitter {
            let arrival = emitter.arrival(point, least_m, square)?;
            for (sum, value) in irradiance.iter_mut().zip(self.lobes[0].1) {
                *sum = value * arrival.cosine * arrival.strength;
            }
            return Some((Arriving { irradiance, direction: arrival.direction }, Some(arrival)));
        }
        let geometry = geometric_factor(&self.shape, point)?;
        for (lobe, emission) in &self.lobes {
            let value = geometry.factor * lobe.value(-geometry.direction);
            for (sum, emission) in irradiance.iter_mut().zip(emission) {
                *sum += value * emission;
            }
        }
        Some((Arriving { irradiance, direction: geometry.direction }, None))
    }
}
