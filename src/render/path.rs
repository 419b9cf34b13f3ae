//! Paths from the camera into the scene.
//!
//! The estimator is the usual one: at every place that a path comes to, light is gathered from
//! one of the recovered lights (at the first place from a few) and from every added one, and the path goes on in a direction that
//! the surface is likely to reflect into. Two kinds of light are kept apart, since the recovered
//! light contains already what the unmodelled part of the room returns:
//!
//! - recovered light reaches what the path comes to over known surfaces and objects alone;
//! - added light also by way of the [`Shell`](super::scene::Shell) that stands for the room.
//!
//! Where virtual lights lie on known surfaces that no photograph shows, they are all that these
//! send: a path that comes there goes on for added light alone.
//!
//! A ray that leaves the known scene meets no recovered light: that was gathered where the ray
//! began, also for the specular lobe, which is widened by the light's size as in the solve.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::geometry::bvh::Ray;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::math::sampling::{Frame, Random, mirrored, square_to_cosine_hemisphere};
use crate::render::looks::BrdfF32;
use crate::render::scene::{Met, Scene};
use crate::scene::{SurfacePoint, Viewing};

/// Low-discrepancy numbers of one path (Owen-scrambled Sobol; Burley 2020), one dimension after
/// the other.
pub struct Sequence {
    index: u32,
    seed: u32,
    dimension: u32,
    /// Of the four dimensions that hold the next one: four cost about as much as one.
    four: [f32; 4],
    /// For what comes after the last dimension, and where points of a set would gain nothing.
    pub random: Random,
}

/// Points of one set; the next set has another seed.
const SET: u64 = 1 << 16;

impl Sequence {
    /// Path `index` of a pixel. Even and odd ones are two sets that know nothing of each other, so
    /// that their difference gives the noise.
    pub fn new(seed: u64, pixel: u64, index: u64) -> Self {
        let (half, index) = (index % 2, index / 2);
        let mut mixed = Random::new(seed, pixel, 2 * (index / SET) + half);
        let seed = mixed.next_u64();
        let random = Random::new(seed, pixel, index);
        Self {
            index: (index % SET) as u32,
            seed: seed as u32,
            dimension: 0,
            four: [0.0; 4],
            random,
        }
    }

    fn number(&mut self) -> f32 {
        if self.dimension >= sobol_burley::NUM_DIMENSIONS {
            return self.random.uniform();
        }
        let within = self.dimension % 4;
        if within == 0 {
            self.four = sobol_burley::sample_4d(self.index, self.dimension / 4, self.seed);
        }
        self.dimension += 1;
        self.four[within as usize]
    }

    pub fn point(&mut self) -> Vec2 {
        Vec2::new(self.number(), self.number())
    }
}

/// What the first place of a path is like.
#[derive(Clone, Copy, Debug, Default)]
pub struct First {
    /// Diffuse and specular reflectance together; 0 where nothing is met.
    pub albedo: Radiance,
    pub normal: Vec3,
    /// Metres along the ray; 0 where nothing is met.
    pub distance_m: f32,
    pub is_known: bool,
    pub is_object: bool,
}

/// Where the light of a path goes: one entry for the recovered light and one per added light.
pub struct Gathered<'a> {
    pub layers: &'a mut [Radiance],
    /// What reached the first place without a detour, and what was seen to shine.
    pub direct: &'a mut Radiance,
}

impl Gathered<'_> {
    fn add(&mut self, layer: usize, depth: usize, light: Radiance) {
        add(&mut self.layers[layer], light);
        if depth == 0 {
            add(self.direct, light);
        }
    }
}

/// Where a path is, and what it carries.
#[derive(Clone, Copy)]
struct Place {
    point: SurfacePoint,
    brdf: BrdfF32,
    viewing: Viewing,
    throughput: Radiance,
    depth: usize,
}

/// Recovered lights that are sampled at the first place of a path: what is seen is mostly lit by them
/// directly, and a shadow ray costs less than a path.
const FIRST_SAMPLES: usize = 4;
/// Places that a path goes on from whatever it carries; later it ends by chance.
const SURE_DEPTH: usize = 3;

fn add(sum: &mut Radiance, light: Radiance) {
    for (sum, value) in sum.iter_mut().zip(light) {
        *sum += value;
    }
}

fn times(a: Radiance, b: Radiance) -> Radiance {
    std::array::from_fn(|c| a[c] * b[c])
}

fn scaled(a: Radiance, factor: f32) -> Radiance {
    a.map(|value| value * factor)
}

fn largest(a: Radiance) -> f32 {
    a[0].max(a[1]).max(a[2])
}

impl Scene<'_> {
    /// Follows one path from a camera through at most `most` reflections.
    pub fn trace(
        &self,
        ray: Ray,
        most: usize,
        sequence: &mut Sequence,
        gathered: Gathered,
    ) -> First {
        self.follow(ray, most, sequence, gathered, false)
    }

    /// The same from within the scene, where also the surroundings are met, which no camera sees.
    pub fn incident(&self, ray: Ray, most: usize, sequence: &mut Sequence, gathered: Gathered) {
        self.follow(ray, most, sequence, gathered, true);
    }

    fn follow(
        &self,
        ray: Ray,
        most: usize,
        sequence: &mut Sequence,
        mut gathered: Gathered,
        is_within: bool,
    ) -> First {
        let mut first = First::default();
        let mut throughput = [1.0f32; CHANNELS];
        let mut ray = ray;
        // Where the ray began, and the density with which its direction was chosen; none for the
        // camera's.
        let mut from: Option<(SurfacePoint, f32)> = None;
        // From here on the recovered light is counted already.
        let mut is_counted = false;
        // Whether the ray comes from a mirror: only there light of the sky is met, which is sampled at
        // all other surfaces.
        let mut is_mirrored = false;
        for depth in 0..=most {
            let hit = self.closest(&ray, from.is_none(), &mut sequence.random);
            let distance_m = hit.as_ref().map_or(f32::INFINITY, |hit| hit.t);
            self.added_met(&ray, distance_m, from, throughput, depth, &mut gathered);

            let (point, brdf) = match hit {
                Some(hit) => {
                    let point = self.geometry.surface_point(&ray, &hit);
                    let met = self.met(point, hit.triangle, (hit.u, hit.v));
                    if depth == 0 {
                        first = self.first(point, hit.t, &met, self.is_object(hit.triangle));
                    }
                    if let Met::Mirror(reflected) = met {
                        throughput = times(throughput, reflected);
                        ray = self.geometry.ray(point, mirrored(-ray.direction, point.normal));
                        (from, is_mirrored) = (None, true);
                        continue;
                    }
                    // What a camera sees there has to be guessed: what it would reflect.
                    is_counted |= (depth > 0 || is_within)
                        && !self.is_object(hit.triangle)
                        && self.is_counted(point);
                    match met {
                        Met::Surface(brdf) => (point, brdf),
                        Met::Mirror(_) => unreachable!("mirrors are followed above"),
                        Met::Shining(radiance) => {
                            if !is_counted {
                                let depth = depth.saturating_sub(1);
                                gathered.add(0, depth, times(throughput, radiance));
                            }
                            break;
                        }
                    }
                }
                None => {
                    if is_mirrored && !is_counted && self.original_light > 0.0 {
                        let sky = scaled(self.recovered.sky(ray.direction), self.original_light);
                        gathered.add(0, depth.saturating_sub(1), times(throughput, sky));
                    }
                    let Some(shell) =
                        self.shell.filter(|_| (depth > 0 || is_within) && !self.added.is_empty())
                    else {
                        break;
                    };
                    is_counted = true;
                    let grey = [shell.albedo; CHANNELS];
                    let brdf = BrdfF32 { diffuse: grey, ..BrdfF32::default() };
                    (shell.exit(ray.origin, ray.direction), brdf)
                }
            };
            if depth == most {
                break;
            }
            let viewing = Viewing::from(-ray.direction, point.normal);
            let place = Place { point, brdf, viewing, throughput, depth };
            if !is_counted {
                self.recovered_at(&place, sequence, &mut gathered);
            }
            self.added_at(&place, sequence, &mut gathered);

            let Some((direction, weight, density)) = scatter(&brdf, viewing, sequence) else {
                break;
            };
            throughput = times(throughput, weight);
            let mut survives = 1.0f32;
            if depth + 1 >= SURE_DEPTH {
                survives = largest(throughput).min(0.95);
                if sequence.random.uniform() >= survives {
                    break;
                }
            }
            if largest(throughput) <= 0.0 {
                break;
            }
            throughput = scaled(throughput, 1.0 / survives);
            ray = self.geometry.ray(point, direction);
            (from, is_mirrored) = (Some((point, density)), false);
        }
        first
    }

    fn first(&self, point: SurfacePoint, distance_m: f32, met: &Met, is_object: bool) -> First {
        let albedo = match met {
            Met::Surface(brdf) => std::array::from_fn(|c| brdf.diffuse[c] + brdf.specular[c]),
            Met::Mirror(reflected) => *reflected,
            Met::Shining(_) => [0.0; CHANNELS],
        };
        First { albedo, normal: point.normal, distance_m, is_known: true, is_object }
    }

    /// Added lights that the ray meets, which sampling them might have found as well.
    fn added_met(
        &self,
        ray: &Ray,
        distance_m: f32,
        from: Option<(SurfacePoint, f32)>,
        throughput: Radiance,
        depth: usize,
        gathered: &mut Gathered,
    ) {
        let eye = SurfacePoint { position: ray.origin, normal: ray.direction };
        let (point, density) = from.unwrap_or((eye, f32::INFINITY));
        for (index, added) in self.added.iter().enumerate() {
            let Some((radiance, by_light)) =
                added.met(&self.geometry, point, ray.direction, distance_m)
            else {
                continue;
            };
            // The balance heuristic (Veach 1997); a camera looks at lights in one way only.
            let share = if density.is_finite() { density / (density + by_light) } else { 1.0 };
            let light = scaled(times(throughput, radiance), share);
            gathered.add(1 + index, depth.saturating_sub(1), light);
        }
    }

    fn recovered_at(&self, place: &Place, sequence: &mut Sequence, gathered: &mut Gathered) {
        if self.original_light == 0.0 || self.recovered.is_dark() {
            return;
        }
        let Place { point, brdf, viewing, throughput, depth } = *place;
        let strength = brdf.strength();
        let samples = if depth == 0 { FIRST_SAMPLES } else { 1 };
        for _ in 0..samples {
            let (choice, square) = (sequence.number(), sequence.point());
            let found = self.recovered.sample(&self.geometry, point, choice, square);
            let Some((arriving, light)) = found else { continue };
            let lobe = if brdf.is_specular() {
                light.lobe(point.position, viewing, brdf.gloss()) as f32
            } else {
                0.0
            };
            let factor = self.original_light / (PI * samples as f32);
            let reflected = std::array::from_fn(|c| {
                factor * (brdf.diffuse[c] + strength[c] * lobe) * arriving.irradiance[c]
            });
            gathered.add(0, depth, times(throughput, reflected));
        }
    }

    fn added_at(&self, place: &Place, sequence: &mut Sequence, gathered: &mut Gathered) {
        let Place { point, brdf, viewing, throughput, depth } = *place;
        for (index, added) in self.added.iter().enumerate() {
            let square = sequence.point();
            let Some(direct) = added.sample(&self.geometry, point, square) else { continue };
            let reflected = brdf.value(viewing, direct.direction);
            let share = if direct.density > 0.0 {
                let by_surface = brdf.density(viewing, direct.direction, direct.cosine);
                direct.density / (direct.density + by_surface)
            } else {
                1.0
            };
            let light = scaled(times(reflected, direct.light), direct.cosine * share);
            gathered.add(1 + index, depth, times(throughput, light));
        }
    }
}

/// A direction in which light may have come, with the reflectance times cosine over its density,
/// and that density; `None` where the lobe points into the surface, or nothing is reflected.
fn scatter(
    brdf: &BrdfF32,
    viewing: Viewing,
    sequence: &mut Sequence,
) -> Option<(Vec3, Radiance, f32)> {
    let normal = viewing.normal;
    let part = brdf.specular_part(viewing);
    if part == 0.0 {
        // Reflectance times cosine over density is the reflectance.
        let local = square_to_cosine_hemisphere(sequence.point());
        let direction = Frame::about(normal).to_world(local);
        let cosine = direction.dot(normal);
        return (cosine > 0.0).then_some((direction, brdf.diffuse, cosine / PI));
    }
    let (choice, square) = (sequence.number(), sequence.point());
    let direction = if choice < part {
        brdf.sample_lobe(viewing, square)
    } else {
        Frame::about(normal).to_world(square_to_cosine_hemisphere(square))
    };
    let cosine = direction.dot(normal);
    if cosine <= 0.0 {
        return None;
    }
    let density = brdf.density(viewing, direction, cosine);
    let weight = scaled(brdf.value(viewing, direction), cosine / density.max(f32::MIN_POSITIVE));
    (density > 0.0).then_some((direction, weight, density))
}
